#pragma once
/// Changes single values in the text of a scene and leaves every other byte as it is: comments, order, line
/// ends, and how other numbers are written.

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace offstage::tune {

/// A half-open range of bytes in a text.
struct ByteRange {
  std::size_t begin = 0, end = 0;
};

/// The value at a path, such as /emitters/0/rate, becomes the JSON text `json`. A number is written as the
/// shortest decimal that reads back to the same bits; other values keep the layout of `json`. Keys that are
/// missing on the way are added to the deepest object there is, with that object's own indentation; the index
/// one past the end of a list appends to it. Throws SceneError if `text` or `json` is no JSON, and
/// std::invalid_argument if the path leads nowhere.
std::string set_value(std::string_view text, std::string_view path, std::string_view json);

/// Removes a key with its value, or an item of a list, and one comma with it. A comment that follows on the
/// same line goes as well. Nothing happens if there is no such value. Throws SceneError if `text` is no JSON.
std::string remove_value(std::string_view text, std::string_view path);

/// Replaces the key at a path. Throws SceneError if `text` is no JSON, and std::invalid_argument if there is
/// no such key, or the object has the new one already.
std::string rename_key(std::string_view text, std::string_view path, const std::string& key);

/// Overwrites items of lists with blanks, each with one comma, so that everything else keeps its line and
/// column. Paths that lead nowhere are ignored. `text` must be valid JSON with comments.
std::string blank_out(std::string_view text, const std::vector<std::string>& paths);

/// Where the value at a path stands. Throws SceneError if `text` is no JSON, and std::invalid_argument if
/// there is no such value.
ByteRange range_of(std::string_view text, std::string_view path);

}  // namespace offstage::tune
