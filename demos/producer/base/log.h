#pragma once
/// Talk to the person at the terminal. All but the names of outputs goes to standard error, and that nobody
/// reads it any more (a closed pipe, a full log disk) is no reason to end a run.

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace offstage::producer {

/// Prints the name of a finished output as a line of standard output. Where that was closed from the start
/// nobody wants the name, and the output is there all the same.
void print_output_name(const std::string& name);
/// Says that standard output was closed from the start.
void note_closed_output();

/// Writes whole lines. A status line that is shown is removed first, so that the two never mix. Any thread
/// may call it.
void write_log(std::string_view lines);

/// Shows one line that later calls replace, for a terminal; without a line break, and no wider than
/// terminal_width(). An empty text removes it.
void show_status(std::string_view line);
/// Leaves the status line where it is and goes on below it.
void keep_status();

/// Columns of the terminal behind standard error; 80 if it does not say.
int terminal_width();

template <class... Args>
void log(fmt::format_string<Args...> text, Args&&... args) {
  write_log(fmt::format(text, std::forward<Args>(args)...));
}

}  // namespace offstage::producer
