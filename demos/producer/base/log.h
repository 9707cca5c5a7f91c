#pragma once
/// Talk to the person at the terminal. It goes to standard error, and that nobody reads it any more (a closed
/// pipe, a full log disk) is no reason to end a run.

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace offstage::producer {

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
