#pragma once
/// Ctrl-C and TERM. The first asks the run to end tidily; the second ends the process at once.

#include <stdexcept>

namespace offstage::producer {

/// Thrown where a signal ends work that is of no use in part.
class Interrupted : public std::runtime_error {
 public:
  explicit Interrupted(int signal) : std::runtime_error("interrupted"), signal_(signal) {}
  int signal() const { return signal_; }

 private:
  int signal_;
};

/// Installs the handlers for SIGINT and SIGTERM, and ignores SIGPIPE and SIGXFSZ: a closed pipe or a file at
/// its size limit is an error of the write instead.
void install_signal_handlers();

/// The signal that asked the run to end, or 0.
int interrupt_signal();

}  // namespace offstage::producer
