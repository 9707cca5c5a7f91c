#pragma once
/// Converts errors of commands to a message, an exit code and a short name of the kind of error.

#include <exception>
#include <functional>
#include <string>

namespace offstage::producer {

struct Failure {
  int code = 0;         ///< an ExitCode
  std::string kind;     ///< kind of the error: "scene invalid", "usage", ...
  std::string message;  ///< the message that the program prints, without a line break at its end
};

/// Describes an exception. Rethrows Interrupted and render::StoppedError, which are not errors.
Failure describe_failure(const std::exception_ptr& error);

/// Runs a command and returns its exit code. If the command throws an exception, prints a message and returns
/// the exit code for this kind of exception.
int reported(const std::function<int()>& command);

}  // namespace offstage::producer
