#pragma once
/// Serves the page and its session over HTTP, on this machine only.
///
/// One server delivers the page and the pictures, and receives the changes. Two more servers deliver the
/// event streams of the tabs, four each, because browsers open at most six connections to one server. The
/// path of every address begins with a random token. The Host header of every request, and its Origin header
/// if it has one, must name this server. Other pages in the same browser therefore cannot read or change
/// anything, even with a host name that resolves to this machine.

#include <memory>
#include <string>

#include "tune/session.h"

namespace offstage::tune {

class HttpServer {
 public:
  /// Starts to listen on 127.0.0.1. Port 0 selects any free port. Throws std::runtime_error if the port is in
  /// use.
  HttpServer(Session& session, int port);
  /// Ends the streams and the requests.
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  /// Returns the address to open in a browser, including the token.
  std::string address() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace offstage::tune
