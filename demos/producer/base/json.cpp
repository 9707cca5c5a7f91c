#include "producer/base/json.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include <nlohmann/json.hpp>

#include "producer/base/error.h"

namespace offstage::producer {
namespace {

struct Token {
  std::size_t offset;
  Position at;
  char first;

  bool separator() const { return first == ',' || first == ':'; }
};

/// Scans the text once and records the start of each token. It does not validate the text, because nlohmann's
/// parser does; both agree on the tokens up to the first error.
class Scanner {
 public:
  Scanner(std::string_view text, int file) : text_(text), at_{file, 1, 1} {}

  std::vector<Token> scan() {
    std::vector<Token> tokens;
    while (skip_space_and_comments(), i_ < text_.size()) {
      tokens.push_back({i_, at_, text_[i_]});
      skip_token();
    }
    return tokens;
  }
  Position end() const { return at_; }

 private:
  static constexpr std::string_view kPunctuation = "{}[],:";
  static constexpr std::string_view kSpace = " \t\r\n";

  bool ahead(std::string_view s) const { return text_.substr(i_, s.size()) == s; }

  void advance(std::size_t n = 1) {
    for (; n > 0 && i_ < text_.size(); --n, ++i_) {
      // Bytes of a UTF-8 character.
      const bool continuation = (static_cast<unsigned char>(text_[i_]) & 0xC0) == 0x80;
      if (text_[i_] == '\n') {
        ++at_.line;
        at_.column = 1;
      } else if (!continuation) {
        ++at_.column;
      }
    }
  }
  void advance_to(std::size_t offset) { advance(std::min(offset, text_.size()) - i_); }

  void skip_space_and_comments() {
    for (std::size_t before = i_ + 1; before != i_;) {
      before = i_;
      advance_to(text_.find_first_not_of(kSpace, i_));
      if (ahead("//")) advance_to(text_.find_first_of("\r\n", i_));
      if (ahead("/*")) {
        advance(2);
        advance_to(text_.find("*/", i_));
        advance(2);
      }
    }
  }

  void skip_token() {
    if (kPunctuation.find(text_[i_]) != std::string_view::npos) return advance();
    if (text_[i_] != '"') return advance_to(std::max(text_.find_first_of(" \t\r\n{}[],:\"/", i_), i_ + 1));
    for (advance(); i_ < text_.size() && text_[i_] != '"' && text_[i_] != '\n'; advance())
      if (text_[i_] == '\\') advance();
    advance();
  }

  std::string_view text_;
  std::size_t i_ = 0;
  Position at_;
};

/// Builds the tree from nlohmann's events: the i-th event belongs to the i-th token that is not a separator.
class TreeBuilder : public nlohmann::json_sax<nlohmann::json> {
 public:
  TreeBuilder(std::string_view text, const std::string& name, int file) : name_(name) {
    Scanner scanner(text, file);
    tokens_ = scanner.scan();
    end_ = scanner.end();
  }

  Node root;
  std::vector<Problem> problems;

  bool null() override { return place(nullptr); }
  bool boolean(bool v) override { return place(v); }
  bool number_integer(int64_t v) override { return place(v); }
  bool number_unsigned(uint64_t v) override {
    if (v > static_cast<uint64_t>(INT64_MAX)) return fail(here(), "the integer does not fit in 64 bits");
    return place(static_cast<int64_t>(v));
  }
  bool number_float(double v, const std::string& text) override {
    if (text.find_first_of(".eE") == std::string::npos)
      return fail(here(), "the integer does not fit in 64 bits");
    return place(v);
  }
  bool string(std::string& v) override { return place(std::move(v)); }
  bool binary(binary_t&) override { return false; }

  bool start_object(std::size_t) override {
    keys_.emplace_back();
    return open(Object{});
  }
  bool end_object() override {
    keys_.pop_back();
    return close();
  }
  bool start_array(std::size_t) override { return open(List{}); }
  bool end_array() override { return close(); }

  bool key(std::string& v) override {
    const Position at = here();
    if (!keys_.back().insert(v).second) fail(at, "the key \"" + v + "\" is already given above");
    open_.back()->as<Object>()->push_back({v, {}, at});
    next();
    return true;
  }

  bool parse_error(std::size_t offset, const std::string&,
                   const nlohmann::detail::exception& error) override {
    const auto after = std::partition_point(tokens_.begin(), tokens_.end(),
                                            [&](const Token& token) { return token.offset < offset; });
    const std::string what = error.what();
    if (after == tokens_.begin() || what.find("unexpected end of input") != std::string::npos) {
      return fail(end_, tokens_.empty() ? "the file is empty" : "the file ends too early" + expected(what));
    }
    const auto bad = after - 1;
    const bool closes = bad->first == '}' || bad->first == ']';
    if (closes && bad != tokens_.begin() && (bad - 1)->first == ',')
      return fail((bad - 1)->at, std::string("trailing comma before '") + bad->first + "'; remove it");
    return fail(bad->at, reason(what) + expected(what));
  }

 private:
  /// Returns a text such as "; expected ',' or '}'" if nlohmann's message contains it; otherwise an empty
  /// text.
  static std::string expected(const std::string& what) {
    const std::size_t at = what.rfind("; expected ");
    return at == std::string::npos ? "" : what.substr(at);
  }
  /// Returns the reason in nlohmann's message, without exception number, position and last token.
  static std::string reason(const std::string& what) {
    const std::size_t dash = what.find(" - "), bracket = what.find("] ");
    const std::size_t begin = dash != std::string::npos      ? dash + 3
                              : bracket == std::string::npos ? 0
                                                             : bracket + 2;
    const std::size_t end = std::min(what.find("; last read:", begin), what.rfind("; expected "));
    return what.substr(begin, end == std::string::npos || end < begin ? end : end - begin);
  }

  bool fail(Position at, std::string what) {
    problems.push_back({{name_, at.line, at.column, {}}, std::move(what)});
    return false;
  }

  Position here() {
    while (token_ < tokens_.size() && tokens_[token_].separator()) ++token_;
    return token_ < tokens_.size() ? tokens_[token_].at : end_;
  }
  void next() { ++token_; }

  /// Adds a value to the innermost open list or object.
  template <class T>
  Node& add(T&& value) {
    const Position at = here();
    next();
    if (open_.empty()) return root = Node(std::forward<T>(value), at);
    if (List* list = open_.back()->as<List>()) return list->emplace_back(std::forward<T>(value), at);
    return open_.back()->as<Object>()->back().value = Node(std::forward<T>(value), at);
  }
  template <class T>
  bool place(T&& value) {
    add(std::forward<T>(value));
    return true;
  }
  template <class T>
  bool open(T&& container) {
    if (open_.size() == kMaxDepth)
      return fail(here(), "is nested deeper than " + std::to_string(kMaxDepth) + " levels");
    // The address stays valid, because the parent grows only after this is closed.
    open_.push_back(&add(std::forward<T>(container)));
    return true;
  }
  bool close() {
    here();
    next();
    open_.pop_back();
    return true;
  }

  std::string name_;
  std::vector<Token> tokens_;
  Position end_;
  std::size_t token_ = 0;
  std::vector<Node*> open_;
  std::vector<std::set<std::string>> keys_;  // keys of each open object
};

void append_number(double v, std::string& out) {
  if (v == 0 && std::signbit(v)) {  // "-0" would be read back as the integer 0
    out += "-0.0";
    return;
  }
  constexpr double kManyDigits = 1e15;
  if (v == std::trunc(v) && std::abs(v) < kManyDigits) {  // 100000 instead of 1e+05
    out += std::to_string(static_cast<int64_t>(v));
    return;
  }
  char buffer[32];
  // The number gets an exponent. Otherwise it would be read back as an integer that does not fit in 64 bits.
  const bool large = std::abs(v) >= kManyDigits;
  const auto format = large ? std::chars_format::scientific : std::chars_format::general;
  out.append(buffer, std::to_chars(buffer, buffer + sizeof buffer, v, format).ptr);
}

void append_string(const std::string& s, std::string& out) {
  static constexpr char kHex[] = "0123456789abcdef";
  out += '"';
  for (const char c : s) {
    if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else if (static_cast<unsigned char>(c) < 0x20) {
      out += {'\\', 'u', '0', '0', kHex[c >> 4], kHex[c & 15]};
    } else {
      out += c;
    }
  }
  out += '"';
}

struct Writer {
  int indent;
  std::string out = {};

  void write(const Node& node, int depth) {
    if (node.as<std::nullptr_t>()) out += "null";
    if (const bool* v = node.as<bool>()) out += *v ? "true" : "false";
    if (const int64_t* v = node.as<int64_t>()) out += std::to_string(*v);
    if (const double* v = node.as<double>()) append_number(*v, out);
    if (const std::string* v = node.as<std::string>()) append_string(*v, out);
    if (const List* list = node.as<List>())
      enclose('[', ']', *list, depth, [&](const Node& item) { write(item, depth + 1); });
    if (const Object* object = node.as<Object>())
      enclose('{', '}', *object, depth, [&](const Member& member) {
        append_string(member.key, out);
        out += indent > 0 ? ": " : ":";
        write(member.value, depth + 1);
      });
  }

  template <class Items, class F>
  void enclose(char open, char close, const Items& items, int depth, F&& write_item) {
    out += open;
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (i > 0) out += ',';
      new_line(depth + 1);
      write_item(items[i]);
    }
    if (!items.empty()) new_line(depth);
    out += close;
  }
  void new_line(int depth) {
    if (indent > 0) out.append("\n").append(static_cast<std::size_t>(indent * depth), ' ');
  }
};

}  // namespace

const Node* Node::find(std::string_view key) const {
  const Object* object = as<Object>();
  if (!object) return nullptr;
  const auto it = std::find_if(object->begin(), object->end(), [&](const Member& m) { return m.key == key; });
  return it == object->end() ? nullptr : &it->value;
}

Node parse_json(std::string_view text, const std::string& name, int file) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (const std::size_t zero = text.find('\0'); zero != std::string_view::npos) {
    const std::string_view before = text.substr(0, zero);
    const auto line = static_cast<int>(std::count(before.begin(), before.end(), '\n')) + 1;
    const auto column = static_cast<int>(zero - (before.rfind('\n') + 1)) + 1;  // npos + 1 is 0
    throw SceneError({name, line, column, {}}, "is not a text file: it contains a zero byte");
  }
  TreeBuilder builder(text, name, file);
  nlohmann::json::sax_parse(text, &builder, nlohmann::json::input_format_t::json, true, true);
  if (!builder.problems.empty()) throw SceneError(std::move(builder.problems));
  return std::move(builder.root);
}

std::string to_text(const Node& node, int indent) {
  Writer writer{indent};
  writer.write(node, 0);
  return std::move(writer.out);
}

std::string describe(const Node& node) {
  constexpr std::size_t kLongest = 60;
  if (node.as<Object>()) return "an object";
  const std::string text = to_text(node);
  if (node.as<List>()) return text.size() <= kLongest ? text : "a list";
  if (!node.as<std::string>()) return text;
  return "the string " +
         (text.size() <= kLongest ? text : "of " + std::to_string(text.size() - 2) + " bytes");
}

std::string pointer_step(std::string_view key) {
  std::string step = "/";
  for (const char c : key) step += c == '~' ? "~0" : c == '/' ? "~1" : std::string(1, c);
  return step;
}

}  // namespace offstage::producer
