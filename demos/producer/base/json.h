#pragma once
/// JSON text as a tree. Every value and every key has its position in the text, for messages. Comments are
/// allowed; repeated keys are not.

#include <cstdint>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace offstage::producer {

/// A position in one of the texts of a scene.
struct Position {
  int file = -1;             ///< index into SceneSource::files; -1: not from a text
  int line = 0, column = 0;  ///< position in characters, from 1; 0: not from a file
};

struct Node;
struct Member;
using List = std::vector<Node>;
using Object = std::vector<Member>;  ///< members in the order of the file; their keys are unique

/// A JSON value and its position.
struct Node {
  using Value = std::variant<std::nullptr_t, bool, int64_t, double, std::string, List, Object>;
  Value value;  ///< the value; null in a new node
  Position at;

  Node();
  template <class T>
  requires(!std::is_same_v<std::remove_cvref_t<T>, Node> && std::is_constructible_v<Value, T>)
      Node(T&& v, Position p = {})
      : value(std::forward<T>(v)), at(p) {}

  template <class T>
  const T* as() const {
    return std::get_if<T>(&value);
  }
  template <class T>
  T* as() {
    return std::get_if<T>(&value);
  }
  /// Returns the value of a key; null if there is none or if this is not an object.
  const Node* find(std::string_view key) const;
  Node* find(std::string_view key) { return const_cast<Node*>(std::as_const(*this).find(key)); }
};

/// A key with its value; `at` is where the key starts.
struct Member {
  std::string key;
  Node value;
  Position at = {};
};

inline Node::Node() = default;  // defined here, because Member must be complete

inline constexpr int kMaxDepth = 64;  ///< greatest depth of nested lists and objects

/// Parses one JSON text. `file` is its index in positions, `name` its name in messages. Throws SceneError
/// with position and reason for a syntax error, nesting deeper than kMaxDepth, an integer that does not fit
/// in 64 bits, or repeated keys.
Node parse_json(std::string_view text, const std::string& name, int file = 0);

/// Converts to JSON: compact if `indent` is 0, otherwise on several lines with this indentation. Each number
/// is the shortest text that reads back to the same bits.
std::string to_text(const Node& node, int indent = 0);

/// Returns the description of a value for messages: `the string "abc"`, `-1`, `[0,0,0]`, `an object`.
std::string describe(const Node& node);

/// Converts a key to a step of a JSON pointer, with a leading slash; "/" and "~" in the key are escaped.
std::string pointer_step(std::string_view key);

}  // namespace offstage::producer
