#pragma once
<<<<<<< ours
/// A program run as a child in its own process group, so that a Ctrl-C meant for us does not end it first.
/// Private to render.
=======
/// Runs a program as a child in its own process group, so that a Ctrl-C meant for this process does not end
/// the child first. The kernel kills the child if this process dies. Private to render.
>>>>>>> theirs

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "render/file_io.h"

namespace offstage::render {

/// A fixed-size buffer that a child may use as its standard output or error. Output beyond the size is lost,
/// so the child can neither block nor fill the disk.
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
  /// Runs `arguments[0]`, searched in PATH, with these descriptors as its standard streams; -1 is /dev/null.
  /// Sets error() if it cannot be run.
  ChildProcess(const std::vector<std::string>& arguments, int in, int out, int err);
  /// Kills the child if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// The errno value of a failed start; 0 if the child was started.
  int error() const { return error_; }
  void kill();
<<<<<<< ours
  /// Waits for its end: nothing if it succeeded, else "exit code 1" or "signal 9".
  std::optional<std::string> wait();
  /// The same with a limit, after which it is killed.
=======
  /// Waits until the child ends. Returns nothing if it succeeded, else "exit code 1" or "signal 9". A child
  /// that does not end after a request to stop is killed (Patience).
  std::optional<std::string> wait(const StopTest& stop = {});
  /// Waits as above, and kills the child after `limit`.
>>>>>>> theirs
  std::optional<std::string> wait_for(std::chrono::milliseconds limit);

 private:
  pid_t pid_ = -1;
  int error_ = 0;
};

<<<<<<< ours
/// "exit code 1" or "signal 9 (Killed)" from waitpid's status; nothing for success.
=======
/// Waits at most `limit` for a child to end; returns false if it still runs. Does not reap it.
bool wait_for_end(pid_t child, std::chrono::milliseconds limit);

/// Describes waitpid's status as "exit code 1" or "signal 9 (Killed)"; nothing for success.
>>>>>>> theirs
std::optional<std::string> describe_failure(int wait_status);

}  // namespace offstage::render
