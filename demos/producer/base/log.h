#pragma once
/// Output for the user at the terminal. Everything except the names of outputs goes to standard error. A
/// closed or full standard error does not end a run.

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace offstage::producer {

/// Prints the name of a finished output as a line of standard output. Does nothing if standard output was
/// closed from the start.
void print_output_name(const std::string& name);
/// Records that standard output was closed from the start.
void note_closed_output();

/// Writes whole lines. A visible status line is removed first, so that the two never mix. Any thread may call
/// it.
void write_log(std::string_view lines);

/// Shows a status line, which later calls replace, on a terminal. It must have no line break and be no wider
/// than terminal_width(). An empty text removes it.
void show_status(std::string_view line);
/// Keeps the status line visible and continues below it.
void end_status_line();

/// Columns of the terminal at standard error; 80 if unknown.
int terminal_width();

template <class... Args>
void log(fmt::format_string<Args...> text, Args&&... args) {
  write_log(fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace offstage::producer
