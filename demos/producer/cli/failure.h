#pragma once
/// Errors of a command: a message, an exit code and a short name of the kind.

#include <exception>
#include <functional>
#include <string>

namespace offstage::producer {

struct Failure {
  int code = 0;         ///< an ExitCode
  std::string kind;     ///< kind of the error: "scene invalid", "usage", ...
  std::string message;  ///< the message that the program prints, without a line break at its end
};

/// Describes any exception except those of an interrupt (Interrupted, render::StoppedError), which are
/// rethrown.
Failure describe_failure(const std::exception_ptr& error);

/// Returns the exit code of a command; an exception becomes a message and an exit code of its own.
int reported(const std::function<int()>& command);

}  // namespace offstage::producer
