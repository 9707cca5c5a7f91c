#pragma once
/// A program run as a child in its own process group, so that Ctrl-C for this process does not end it first.
/// The kernel kills it when the thread that started it, or the whole process, ends.

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <sys/types.h>

#include "render/file_io.h"

namespace offstage::render {

/// A memory file of limited size for the standard output or error of a child. Output beyond the limit is
/// lost, so the child can neither block nor fill a disk.
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
  /// Runs the program `arguments[0]`, which is searched in PATH. `in`, `out` and `err`: descriptors of its
  /// standard streams; -1 is /dev/null. If the program cannot be started, error() is set.
  ChildProcess(const std::vector<std::string>& arguments, int in, int out, int err);
  /// Kills the child if it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  /// Returns the errno value if the child could not be started; otherwise 0.
  int error() const { return error_; }
  void kill();
  /// Waits for the end of the child. Returns nothing if it succeeded, otherwise "exit code 1" or "signal 9".
  /// A child that does not end after a request to stop is killed (StopDeadline).
  std::optional<std::string> wait(const StopTest& stop = {});
  /// Waits for at most `limit`, after which the child is killed.
  std::optional<std::string> wait_for(std::chrono::milliseconds limit);

 private:
  pid_t pid_ = -1;
  int error_ = 0;
};

/// Waits at most `limit` for the end of a child; returns false if it still runs. Does not reap it.
bool wait_for_end(pid_t child, std::chrono::milliseconds limit);

/// Converts waitpid's status to "exit code 1" or "signal 9 (Killed)"; nothing for success.
std::optional<std::string> describe_failure(int wait_status);

}  // namespace offstage::render
