#pragma once
/// Ctrl-C and TERM. The first asks the run to end tidily; the second ends the process at once.

namespace offstage::producer {

/// Installs the handlers for SIGINT and SIGTERM, and ignores SIGPIPE and SIGXFSZ: a closed pipe or a file at
/// its size limit is an error of the write instead.
void install_signal_handlers();

/// The signal that asked the run to end, or 0.
int interrupt_signal();

}  // namespace offstage::producer
