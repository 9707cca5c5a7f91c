#pragma once
/// Serves the page and its session over HTTP, on this machine only.
///
/// One server answers requests for the page and the pictures, and takes the changes. Two more serve the
/// streams of the tabs, four each, because browsers allow at most six connections to a server. Every address
/// begins with a random token. The Host of every request, and the Origin of those that have one, must be
/// ours, so that no other page in the same browser can read or change anything, even by a host name that
/// resolves to this machine.

#include <memory>
#include <string>

#include "tune/session.h"

namespace offstage::tune {

class HttpServer {
 public:
  /// Binds to 127.0.0.1; port 0 selects any free port. Throws std::runtime_error if the port is in use.
  HttpServer(Session& session, int port);
  /// Ends the streams and the requests.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// The address to open, with the token.
  std::string address() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace offstage::tune
