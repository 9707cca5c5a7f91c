#include "tune/text_edit.h"

#include <algorithm>
#include <charconv>
#include <optional>
#include <stdexcept>

#include "producer/base/json.h"

namespace offstage::tune {
namespace {

constexpr std::string_view kBlanks = " \t\r\n";

/// A value with its range of bytes; a list item has no key.
struct Part {
  std::string key;
  ByteRange key_range, value;
  std::size_t comma = std::string_view::npos;  ///< position of the comma after it
  bool object = false, list = false;
  std::vector<Part> parts;

  std::size_t begin() const { return key_range.end > 0 ? key_range.begin : value.begin; }
};

/// Finds the bytes of every value in a text that parse_json has accepted, so it needs no checks.
class PartFinder {
 public:
  explicit PartFinder(std::string_view text) : text_(text) {
    if (text_.starts_with("\xEF\xBB\xBF")) i_ = 3;
  }
  Part find() {
    skip();
    return value();
  }
  /// Returns the first byte from `i` on that is neither white space nor in a comment.
  static std::size_t skip_from(std::string_view text, std::size_t i) {
    while (i < text.size()) {
      i = std::min(text.find_first_not_of(kBlanks, i), text.size());
      if (text.substr(i, 2) == "//")
        i = std::min(text.find('\n', i), text.size());
      else if (text.substr(i, 2) == "/*")
        i = std::min(text.find("*/", i + 2), text.size() - 2) + 2;
      else
        break;
    }
    return i;
  }

 private:
  void skip() { i_ = skip_from(text_, i_); }
  ByteRange quoted() {
    const std::size_t begin = i_++;
    for (; i_ < text_.size() && text_[i_] != '"'; ++i_)
      if (text_[i_] == '\\') ++i_;
    return {begin, ++i_};
  }
  Part value() {
    Part part;
    part.value.begin = i_;
    const char c = text_[i_];
    if (c == '{' || c == '[') {
      part.object = c == '{';
      part.list = c == '[';
      ++i_;
      members(part);
    } else if (c == '"') {
      quoted();
    } else {
      i_ = std::min(text_.find_first_of(" \t\r\n{}[],:\"/", i_), text_.size());
    }
    part.value.end = i_;
    return part;
  }
  void members(Part& parent) {
    for (skip(); i_ < text_.size() && text_[i_] != '}' && text_[i_] != ']'; skip()) {
      Part part;
      if (parent.object) {
        const ByteRange key = quoted();
        skip();
        ++i_;  // the colon
        skip();
        part = value();
        part.key_range = key;
        part.key = *producer::parse_json(text_.substr(key.begin, key.end - key.begin), "").as<std::string>();
      } else {
        part = value();
      }
      skip();
      if (i_ < text_.size() && text_[i_] == ',') part.comma = i_++;
      parent.parts.push_back(std::move(part));
    }
    ++i_;
  }

  std::string_view text_;
  std::size_t i_ = 0;
};

Part parts_of(std::string_view text) {
  producer::parse_json(text, "");  // throws
  return PartFinder(text).find();
}

std::vector<std::string> steps_of(std::string_view path) {
  std::vector<std::string> steps;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path[i] == '/') {
      steps.emplace_back();
    } else if (steps.empty()) {
      throw std::invalid_argument("a path must begin with a slash: " + std::string(path));
    } else if (path[i] == '~' && i + 1 < path.size()) {
      steps.back() += path[++i] == '0' ? '~' : '/';
    } else {
      steps.back() += path[i];
    }
  }
  return steps;
}

std::optional<std::size_t> index_of_step(const std::string& step) {
  std::size_t index = 0;
  const auto [end, error] = std::from_chars(step.data(), step.data() + step.size(), index);
  if (error != std::errc() || end != step.data() + step.size()) return {};
  return index;
}

std::optional<std::size_t> child_of(const Part& parent, const std::string& step) {
  if (parent.list) {
    const auto index = index_of_step(step);
    return index && *index < parent.parts.size() ? index : std::nullopt;
  }
  const auto it = std::ranges::find(parent.parts, step, &Part::key);
  if (!parent.object || it == parent.parts.end()) return {};
  return static_cast<std::size_t>(it - parent.parts.begin());
}

/// Result of following a path: the deepest existing value, its parent, and the number of steps.
struct FollowedPath {
  const Part* parent = nullptr;
  std::size_t index = 0;  ///< index of the value in its parent
  const Part* end;
  std::size_t steps = 0;
};

FollowedPath follow(const Part& root, const std::vector<std::string>& steps) {
  FollowedPath followed{.end = &root};
  for (const std::string& step : steps) {
    const auto child = child_of(*followed.end, step);
    if (!child) break;
    followed = {followed.end, *child, &followed.end->parts[*child], followed.steps + 1};
  }
  return followed;
}

[[noreturn]] void refuse_path(std::string_view path) {
  throw std::invalid_argument("the scene has no " + std::string(path));
}

/// Returns the text between the beginning of the line and `at`, if it is only white space.
std::optional<std::string> own_line_indent(std::string_view text, std::size_t at) {
  const std::size_t line = text.substr(0, at).find_last_of('\n');
  const std::size_t begin = line == std::string_view::npos ? 0 : line + 1;
  const std::string_view before = text.substr(begin, at - begin);
  if (before.find_first_not_of(" \t") != std::string_view::npos || line == std::string_view::npos) return {};
  return std::string(before);
}

/// Returns the end of the line of `at`, before its line break, if there are only white space and complete
/// comments in between.
std::optional<std::size_t> rest_of_line(std::string_view text, std::size_t at) {
  while (at < text.size()) {
    at = std::min(text.find_first_not_of(" \t", at), text.size());
    if (at < text.size() && (text[at] == '\n' || text[at] == '\r')) return at;
    if (text.substr(at, 2) == "//") {
      const std::size_t end = std::min(text.find('\n', at), text.size());
      return end > at && text[end - 1] == '\r' ? end - 1 : end;
    }
    if (text.substr(at, 2) != "/*") return {};
    const std::size_t end = text.find("*/", at);
    if (end == std::string_view::npos || text.substr(at, end - at).find('\n') != std::string_view::npos)
      return {};
    at = end + 2;
  }
  return at;
}

std::string_view line_end(std::string_view text) {
  return text.find("\r\n") != std::string_view::npos ? "\r\n" : "\n";
}

/// Returns the text between keys and values in this object, or else in the whole text.
std::string colon_of(std::string_view text, const Part& object) {
  if (object.parts.empty()) return ": ";
  const Part& last = object.parts.back();
  const std::string between(text.substr(last.key_range.end, last.value.begin - last.key_range.end));
  return between.find_first_not_of(" \t:") == std::string::npos ? between : ": ";
}

/// Adds `member` ("key": value, or an item) after the last one of a container.
std::string append_to(std::string_view text, const Part& container, const std::string& member) {
  std::string result(text);
  if (container.parts.empty()) return result.insert(container.value.begin + 1, member);
  const Part& last = container.parts.back();
  const auto indent = own_line_indent(text, last.begin());
  const auto end = rest_of_line(text, last.value.end);
  // The new member gets its own line, below the comment of the last member.
  if (indent && end && *end < container.value.end) {
    result.insert(*end, std::string(line_end(text)) + *indent + member);
    return result.insert(last.value.end, ",");
  }
  std::string gap = " ";
  if (indent) {
    gap = std::string(line_end(text)) + *indent;
  } else if (container.parts.size() > 1) {
    const Part& before = container.parts[container.parts.size() - 2];
    const std::string between(text.substr(before.comma + 1, last.begin() - before.comma - 1));
    gap = between.find_first_not_of(kBlanks) == std::string::npos ? between : " ";
  }
  return result.insert(last.value.end, "," + gap + member);
}

/// Returns the bytes that are removed with a part.
std::vector<ByteRange> bytes_to_remove(std::string_view text, const Part& container, std::size_t index) {
  const Part& part = container.parts[index];
  const bool is_last = index + 1 == container.parts.size();
  ByteRange gone{part.begin(), is_last ? part.value.end : part.comma + 1};
  std::vector<ByteRange> all;
  if (is_last && index > 0) {
    const std::size_t comma = container.parts[index - 1].comma;
    all.push_back({comma, comma + 1});
  }
  const bool own_line = own_line_indent(text, gone.begin).has_value();
  const auto end = rest_of_line(text, gone.end);
  if (own_line && end) {
    gone.end = *end;
    gone.begin = text.substr(0, gone.begin).find_last_of('\n');  // also removes the line break before it
    if (gone.begin > 0 && text[gone.begin - 1] == '\r') --gone.begin;
  } else if (!is_last) {
    gone.end = std::min(text.find_first_not_of(" \t", gone.end), text.size());
  } else if (index > 0) {
    const std::size_t blank = text.substr(0, gone.begin).find_last_not_of(kBlanks) + 1;
    if (PartFinder::skip_from(text, container.parts[index - 1].comma + 1) == part.begin() &&
        blank == container.parts[index - 1].comma + 1)
      gone.begin = blank;
  }
  all.push_back(gone);
  return all;
}

std::string normalized(std::string_view json) {
  const producer::Node node = producer::parse_json(json, "value");
  if (node.as<double>() || node.as<int64_t>()) return producer::to_text(node);
  return std::string(json);
}

std::string quoted(const std::string& key) {
  return producer::to_text(producer::Node(key));
}

}  // namespace

std::string set_value(std::string_view text, std::string_view path, std::string_view json) {
  const Part root = parts_of(text);
  const std::vector<std::string> steps = steps_of(path);
  const FollowedPath followed = follow(root, steps);
  std::string value = normalized(json);
  if (followed.steps == steps.size()) {
    std::string result(text);
    return result.replace(followed.end->value.begin, followed.end->value.end - followed.end->value.begin,
                          value);
  }
  // Text of the missing objects and lists, built from the innermost outwards. If an object has its keys on
  // separate lines, a new list in it has its first item on a separate line, too.
  const auto indent = followed.end->object && !followed.end->parts.empty()
                          ? own_line_indent(text, followed.end->parts.back().begin())
                          : std::nullopt;
  const std::string line(line_end(text));
  for (std::size_t i = steps.size(); i > followed.steps + 1; --i) {
    if (steps[i - 1] != "0")
      value = "{" + quoted(steps[i - 1]) + ": " + value + "}";
    else if (indent && i == followed.steps + 2)
      value = "[" + line + *indent + "  " + value + line + *indent + "]";
    else
      value = "[" + value + "]";
  }
  const std::string& step = steps[followed.steps];
  if (followed.end->list && index_of_step(step) == followed.end->parts.size())
    return append_to(text, *followed.end, value);
  if (!followed.end->object) refuse_path(path);
  return append_to(text, *followed.end, quoted(step) + colon_of(text, *followed.end) + value);
}

std::string remove_value(std::string_view text, std::string_view path) {
  const Part root = parts_of(text);
  const std::vector<std::string> steps = steps_of(path);
  const FollowedPath followed = follow(root, steps);
  std::string result(text);
  if (followed.steps < steps.size() || !followed.parent) return result;
  std::vector<ByteRange> gone = bytes_to_remove(text, *followed.parent, followed.index);
  std::ranges::sort(gone, std::ranges::greater(), &ByteRange::begin);
  for (const ByteRange& range : gone) result.erase(range.begin, range.end - range.begin);
  return result;
}

std::string rename_key(std::string_view text, std::string_view path, const std::string& key) {
  const Part root = parts_of(text);
  const std::vector<std::string> steps = steps_of(path);
  const FollowedPath followed = follow(root, steps);
  if (followed.steps < steps.size() || !followed.parent || !followed.parent->object) refuse_path(path);
  if (followed.end->key != key && child_of(*followed.parent, key))
    throw std::invalid_argument("there is already a key \"" + key + '"');
  std::string result(text);
  return result.replace(followed.end->key_range.begin,
                        followed.end->key_range.end - followed.end->key_range.begin, quoted(key));
}

std::string blank_out(std::string_view text, const std::vector<std::string>& paths) {
  const Part root = parts_of(text);
  std::string result(text);
  const auto blank = [&](ByteRange range) {
    for (std::size_t i = range.begin; i < range.end; ++i)
      if (result[i] != '\n' && result[i] != '\r') result[i] = ' ';
  };
  std::vector<std::pair<const Part*, std::size_t>> items;
  for (const std::string& path : paths) {
    const std::vector<std::string> steps = steps_of(path);
    const FollowedPath followed = follow(root, steps);
    if (followed.steps == steps.size() && followed.parent && followed.parent->list)
      items.emplace_back(followed.parent, followed.index);
  }
  for (const auto& [list, index] : items) blank(list->parts[index].value);
  // The commas between two remaining items of a list stay.
  std::vector<const Part*> lists;
  for (const auto& item : items)
    if (std::ranges::find(lists, item.first) == lists.end()) lists.push_back(item.first);
  for (const Part* list : lists) {
    const auto stays = [&](std::size_t i) {
      return std::ranges::find(items, std::pair(list, i)) == items.end();
    };
    std::size_t left = 0;
    for (std::size_t i = 0; i < list->parts.size(); ++i) left += stays(i);
    for (std::size_t i = 0; i < list->parts.size(); ++i) {
      if (list->parts[i].comma == std::string_view::npos) continue;
      if (stays(i) && left > 1)
        --left;
      else
        blank({list->parts[i].comma, list->parts[i].comma + 1});
    }
  }
  return result;
}

ByteRange range_of(std::string_view text, std::string_view path) {
  const Part root = parts_of(text);
  const std::vector<std::string> steps = steps_of(path);
  const FollowedPath followed = follow(root, steps);
  if (followed.steps < steps.size()) refuse_path(path);
  return followed.end->value;
}

}  // namespace offstage::tune
