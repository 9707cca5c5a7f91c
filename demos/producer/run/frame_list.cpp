#include "producer/run/frame_list.h"

#include <charconv>
#include <optional>
#include <set>
#include <stdexcept>
#include <string_view>

#include <fmt/format.h>

namespace offstage::producer {
namespace {

/// Returns the integer at the start of `text` and removes it from the text. Returns nothing if there is none.
std::optional<int> take_number(std::string_view& text) {
  int value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return std::nullopt;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return value;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

[[noreturn]] void refuse(std::string_view item) {
  throw std::invalid_argument(
      fmt::format("frames: cannot read '{}'; give frames and ranges such as 1-30,40,50-90x2,-1", item));
}

}  // namespace

std::vector<int> parse_frames(const std::string& text, int count) {
  std::set<int> frames;
  const auto resolve = [&](int frame, std::string_view item) {
    const int k = frame < 0 ? count + 1 + frame : frame;
    if (k < 1 || k > count)
      throw std::invalid_argument(
          fmt::format("frames: {} in '{}' is outside the film; it has frames 1-{}", frame, item, count));
    return k;
  };
  std::string_view rest = text;
  if (rest.empty()) {
    for (int k = 1; k <= count; ++k) frames.insert(frames.end(), k);
  }
  while (!rest.empty()) {
    const std::string_view item = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), item.size() + 1));
    std::string_view part = item;
    const auto first = take_number(part);
    if (!first) refuse(item);
    const int a = resolve(*first, item);
    int b = a, step = 1;
    if (take(part, '-')) {
      const auto last = take_number(part);
      if (!last) refuse(item);
      b = resolve(*last, item);
      if (take(part, 'x')) {
        const auto every = take_number(part);
        if (!every || *every < 1) refuse(item);
        step = *every;
      }
      if (b < a)
        throw std::invalid_argument(fmt::format("frames: the range '{}' ends before it starts", item));
    }
    if (!part.empty()) refuse(item);
    for (int k = a; k <= b; k += step) frames.insert(k);
  }
  return {frames.begin(), frames.end()};
}

std::vector<int> chunk_of(const std::vector<int>& frames, const std::string& chunk) {
  std::string_view text = chunk;
  const auto i = take_number(text);
  const bool slash = take(text, '/');
  const auto n = take_number(text);
  if (!i || !slash || !n || !text.empty() || *n < 1 || *i < 1 || *i > *n)
    throw std::invalid_argument(
        fmt::format("--chunk '{}': must be I/N with 1 <= I <= N, such as 2/8", chunk));
  const auto at = [&](int part) {
    return static_cast<std::ptrdiff_t>(frames.size() * static_cast<std::size_t>(part) /
                                       static_cast<std::size_t>(*n));
  };
  return {frames.begin() + at(*i - 1), frames.begin() + at(*i)};
}

}  // namespace offstage::producer
