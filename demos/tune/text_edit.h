#pragma once
/// Changes single values in the text of a scene. All other bytes stay unchanged, such as comments, the order
/// of keys, line ends and the notation of other numbers.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace offstage::tune {

/// A half-open range of bytes in a text.
struct ByteRange {
  std::size_t begin = 0, end = 0;
};

/// Returns the text with the value at a path, such as /emitters/0/rate, replaced by the JSON text `json`. A
/// number is written as the shortest decimal that reads back to the same bits; other values keep the layout
/// of `json`. Missing keys of the path are added to the deepest existing object, with that object's
/// indentation; the index one past the end of a list appends to it. Throws SceneError if `text` or `json` is
/// not JSON, and std::invalid_argument if the path does not exist.
std::string set_value(std::string_view text, std::string_view path, std::string_view json);

/// Returns the text without the key and value, or the list item, at a path. One comma, and a comment that
/// follows on the same line, are removed, too. Returns the same text if there is no such value. Throws
/// SceneError if `text` is not JSON.
std::string remove_value(std::string_view text, std::string_view path);

/// Returns the text with the key at a path renamed to `key`. Throws SceneError if `text` is not JSON, and
/// std::invalid_argument if there is no such key or if the object already has the new key.
std::string rename_key(std::string_view text, std::string_view path, const std::string& key);

/// Returns the text with some list items, each with one comma, overwritten by blanks. All other values keep
/// their line and column. Paths that do not exist are ignored. `text` must be valid JSON with comments.
std::string blank_out(std::string_view text, const std::vector<std::string>& paths);

/// Returns the position of the value at a path in the text. Throws SceneError if `text` is not JSON, and
/// std::invalid_argument if there is no such value.
ByteRange range_of(std::string_view text, std::string_view path);

}  // namespace offstage::tune
