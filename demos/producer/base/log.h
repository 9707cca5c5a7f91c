#pragma once
/// Output for the user at the terminal. Everything except the names of outputs goes to standard error. A
/// closed or full standard error does not end a run.

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace offstage::producer {

/// Prints the name of a finished output on standard output. Does nothing if note_closed_output() was called.
void print_output_name(const std::string& name);
/// Records that standard output was already closed when the program started.
void note_closed_output();

/// Writes complete lines to standard error. Removes a visible status line first, so that the texts do not
/// mix. Any thread may call this function.
void write_log(std::string_view lines);

/// Shows a status line on a terminal. Later calls replace it; an empty text removes it. The text must have no
/// line break and at most terminal_width() columns.
void show_status(std::string_view line);
/// Keeps the status line visible and continues below it.
void end_status_line();

/// Returns the number of columns of the terminal at standard error; 80 if it is unknown.
int terminal_width();

template <class... Args>
void log(fmt::format_string<Args...> text, Args&&... args) {
  write_log(fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace offstage::producer
