#include "tune/text_edit.h"

#include <random>

#include <gtest/gtest.h>

#include "producer/base/error.h"
#include "producer/base/json.h"

namespace offstage::tune {
namespace {

using producer::List;
using producer::Node;
using producer::Object;
using producer::parse_json;
using producer::to_text;

TEST(TextEdit, ReplacesOnlyTheBytesOfAValue) {
  const std::string text =
      "{\r\n  \"a\" : 1.50, // one\r\n  /* two */ \"b\":[1e3,  2 ,{\"c\": \"x // no comment\"}]\r\n}\r\n";
  EXPECT_EQ(
      set_value(text, "/a", "0.1"),
      "{\r\n  \"a\" : 0.1, // one\r\n  /* two */ \"b\":[1e3,  2 ,{\"c\": \"x // no comment\"}]\r\n}\r\n");
  EXPECT_EQ(set_value(text, "/b/2/c", "\"y\""),
            "{\r\n  \"a\" : 1.50, // one\r\n  /* two */ \"b\":[1e3,  2 ,{\"c\": \"y\"}]\r\n}\r\n");
}

TEST(TextEdit, AddsAKeyInTheLayoutOfTheObject) {
  EXPECT_EQ(set_value("{}", "/a", "1"), "{\"a\": 1}");
  EXPECT_EQ(set_value("{\"a\":1,\"b\":2}", "/c", "3"), "{\"a\":1,\"b\":2,\"c\":3}");
  EXPECT_EQ(set_value("{\"a\": 1}", "/b", "2"), "{\"a\": 1, \"b\": 2}");
  EXPECT_EQ(set_value("{\n\t\"a\": 1  // the first\n}", "/b", "2"),
            "{\n\t\"a\": 1,  // the first\n\t\"b\": 2\n}");
  EXPECT_EQ(set_value("{\r\n  \"a\": 1\r\n}", "/b/c", "2"), "{\r\n  \"a\": 1,\r\n  \"b\": {\"c\": 2}\r\n}");
  EXPECT_EQ(set_value("{\n  \"a\": 1\n}", "/b/0", "{}"), "{\n  \"a\": 1,\n  \"b\": [\n    {}\n  ]\n}");
  EXPECT_EQ(set_value("{\"a\": [1, 2]}", "/a/2", "3"), "{\"a\": [1, 2, 3]}");
  EXPECT_EQ(set_value("{\"a\": 1}", "/list/0", "{}"), "{\"a\": 1, \"list\": [{}]}");
}

TEST(TextEdit, RemovesOneCommaWithAValue) {
  EXPECT_EQ(remove_value("{\"a\": 1, \"b\": 2, \"c\": 3}", "/b"), "{\"a\": 1, \"c\": 3}");
  EXPECT_EQ(remove_value("{\"a\": 1, \"b\": 2}", "/b"), "{\"a\": 1}");
  EXPECT_EQ(remove_value("{\"a\": 1}", "/a"), "{}");
  EXPECT_EQ(remove_value("{\n  \"a\": 1,  // gone with it\n  // stays\n  \"b\": 2\n}", "/a"),
            "{\n  // stays\n  \"b\": 2\n}");
  EXPECT_EQ(remove_value("[\n  1,\n  2\n]", "/1"), "[\n  1\n]");
  EXPECT_EQ(remove_value("{\"a\": 1}", "/none"), "{\"a\": 1}");
}

TEST(TextEdit, ReportsImpossibleEdits) {
  EXPECT_THROW(set_value("{\"a\": 1", "/a", "2"), SceneError);
  EXPECT_THROW(set_value("{\"a\": 1}", "/a", "nonsense"), SceneError);
  EXPECT_THROW(set_value("{\"a\": [1]}", "/a/5", "2"), std::invalid_argument);
  EXPECT_THROW(set_value("{\"a\": 1}", "/a/b", "2"), std::invalid_argument);
  EXPECT_THROW(rename_key("{\"a\": 1, \"b\": 2}", "/a", "b"), std::invalid_argument);
  EXPECT_EQ(rename_key("{\"a\": 1, \"b\": 2}", "/a", "c"), "{\"c\": 1, \"b\": 2}");
}

TEST(TextEdit, BlankingKeepsLinesAndColumns) {
  const std::string text = "{\"l\": [\n  1, 22,\n  3]}";
  EXPECT_EQ(blank_out(text, {"/l/1"}), "{\"l\": [\n  1,    \n  3]}");
  EXPECT_EQ(blank_out(text, {"/l/2"}), "{\"l\": [\n  1, 22 \n   ]}");
  EXPECT_EQ(blank_out(text, {"/l/0", "/l/1", "/l/2", "/nowhere/7"}), "{\"l\": [\n        \n   ]}");
}

/// Writes random JSON with comments, blanks and all kinds of line ends.
class Writer {
 public:
  explicit Writer(uint32_t seed) : random_(seed) {}

  std::string text() { return gap() + value(0) + gap(); }
  /// Collects the paths of all values in a tree.
  static void collect(const Node& node, const std::string& path, std::vector<std::string>& paths) {
    if (!path.empty()) paths.push_back(path);
    if (const List* list = node.as<List>())
      for (std::size_t i = 0; i < list->size(); ++i)
        collect((*list)[i], path + "/" + std::to_string(i), paths);
    if (const Object* object = node.as<Object>())
      for (const auto& member : *object)
        collect(member.value, path + producer::pointer_step(member.key), paths);
  }
  std::size_t below(std::size_t n) { return random_() % n; }

 private:
  std::string gap() {
    static const char* const kGaps[] = {"", " ", "\n  ", "\r\n\t", " /* , } */ ", " // { \"no\n", ""};
    return kGaps[below(std::size(kGaps))];
  }
  std::string value(int depth) {
    static const char* const kPlain[] = {"1",   "-2.50e-3", "true", "null", "\"a, \\\"b\\\" // c\"",
                                         "0.1", "1E5"};
    const std::size_t kind = depth == 0 ? 0 : depth > 3 ? 2 : below(4);
    if (kind > 1) return kPlain[below(std::size(kPlain))];
    const std::size_t size = below(4) + (depth == 0);
    std::string text = kind == 0 ? "{" : "[";
    for (std::size_t i = 0; i < size; ++i) {
      if (i > 0) text += ",";
      text += gap();
      if (kind == 0)
        text += "\"k" + std::to_string(i) + (below(5) == 0 ? "/~" : "") + "\"" + gap() + ":" + gap();
      text += value(depth + 1) + gap();
    }
    return text + (kind == 0 ? "}" : "]");
  }
  std::mt19937 random_;
};

TEST(TextEdit, OfRandomTextsOnlyTheChangedValueDiffers) {
  for (uint32_t seed = 0; seed < 400; ++seed) {
    Writer writer(seed);
    const std::string text = writer.text();
    std::vector<std::string> paths;
    Writer::collect(parse_json(text, "text"), "", paths);
    const std::string path = paths[writer.below(paths.size())];
    const ByteRange range = range_of(text, path);
    const std::string changed = set_value(text, path, "-7.25");
    EXPECT_EQ(changed, text.substr(0, range.begin) + "-7.25" + text.substr(range.end)) << "seed " << seed;

    // After removing and adding a value, every other value reads as before.
    std::vector<std::string> left;
    const std::string shorter = remove_value(text, path);
    Writer::collect(parse_json(shorter, "text"), "", left);
    std::size_t gone = 0;
    for (const std::string& other : paths) gone += other == path || other.starts_with(path + "/");
    EXPECT_EQ(left.size(), paths.size() - gone) << "seed " << seed << "\n" << text << "\n" << shorter;
    const std::string longer = set_value(text, "/new/0", "3");
    EXPECT_EQ(to_text(*parse_json(longer, "text").find("new")), "[3]") << "seed " << seed;
    Node without = parse_json(longer, "text");
    without.as<Object>()->pop_back();
    EXPECT_EQ(to_text(without), to_text(parse_json(text, "text"))) << "seed " << seed;
  }
}

TEST(TextEdit, NumbersReadBackToTheSameBits) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 2000; ++i) {
    const uint64_t bits = random();
    double x = 0;
    std::memcpy(&x, &bits, sizeof x);
    if (!std::isfinite(x)) continue;
    const std::string text = set_value("{\"x\": 0}", "/x", to_text(Node(x)));
    const Node root = parse_json(text, "text");
    const double* back = root.find("x")->as<double>();
    ASSERT_TRUE(back || root.find("x")->as<int64_t>());
    EXPECT_EQ(back ? *back : static_cast<double>(*root.find("x")->as<int64_t>()), x);
  }
  EXPECT_EQ(set_value("{\"x\": 0}", "/x", "0.10000000000000001"), "{\"x\": 0.1}");
}

}  // namespace
}  // namespace offstage::tune
