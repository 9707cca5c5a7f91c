#pragma once
/// Talk to the person at the terminal. It goes to standard error, and that nobody reads it any more (a closed
/// pipe, a full log disk) is no reason to end a run.

#include <cstdio>
#include <string>
#include <utility>

#include <fmt/format.h>

namespace offstage::producer {

template <class... Args>
void say(fmt::format_string<Args...> text, Args&&... args) {
  const std::string line = fmt::format(text, std::forward<Args>(args)...);
  std::fwrite(line.data(), 1, line.size(), stderr);
  std::fflush(stderr);
}

}  // namespace offstage::producer
