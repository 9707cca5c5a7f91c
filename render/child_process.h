#pragma once
/// A program run as a child in its own process group, so that a Ctrl-C meant for us does not end it first.
/// The kernel kills it if the thread that started it ends, or its whole process.

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "render/file_io.h"

namespace offstage::render {

/// Memory of fixed size that a child may use as its standard output or error: what does not fit is lost, so
/// it can neither block nor fill anything.
class BoundedCapture {
 public:
  explicit BoundedCapture(std::size_t max_bytes);
  int fd() const { return memory_.fd(); }
  std::string text() const;

 private:
  std::size_t max_bytes_;
  Descriptor memory_;
};

class ChildProcess {
 public:
  /// Runs `arguments[0]`, searched in PATH, with these as its standard streams; -1 is /dev/null. Sets error()
  /// if it cannot be run.
  ChildProcess(const std::vector<std::string>& arguments, int in, int out, int err);
  /// Kills what still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Why it could not be started, an errno value; 0 if it was.
  int error() const { return error_; }
  void kill();
  /// Waits for its end: nothing if it succeeded, else "exit code 1" or "signal 9". A child that does not end
  /// after a request to stop is killed (Patience).
  std::optional<std::string> wait(const StopTest& stop = {});
  /// The same with a limit, after which it is killed.
  std::optional<std::string> wait_for(std::chrono::milliseconds limit);

 private:
  pid_t pid_ = -1;
  int error_ = 0;
};

/// Waits at most `limit` for the end of a child; false if it still runs. Does not reap it.
bool wait_for_end(pid_t child, std::chrono::milliseconds limit);

/// "exit code 1" or "signal 9 (Killed)" from waitpid's status; nothing for success.
std::optional<std::string> describe_failure(int wait_status);

}  // namespace offstage::render
