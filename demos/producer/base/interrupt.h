#pragma once
/// Handling of SIGINT (Ctrl-C) and SIGTERM. The first one asks the run to end cleanly; the second one ends
/// the process at once.

#include <stdexcept>

namespace offstage::producer {

/// Thrown when a signal ends work whose partial result is useless.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal) : std::runtime_error("interrupted"), signal_(signal) {}
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// Installs the handlers for SIGINT and SIGTERM. Ignores SIGPIPE and SIGXFSZ, so that writing fails with an
/// error if a pipe is closed or a file reaches its size limit.
void install_signal_handlers();

/// Returns the number of the signal that asked the run to end, or 0 if there was none.
int interrupt_signal();

}  // namespace offstage::producer
