#include "producer/base/json.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "effects/random.h"
#include "producer/base/error.h"

namespace offstage::producer {
namespace {

std::string at(const Position& p) {
  return std::to_string(p.line) + ":" + std::to_string(p.column);
}

/// Returns the error message for a text that must be refused.
std::string error_of(const std::string& text) {
  try {
    parse_json(text, "f");
  } catch (const SceneError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Json, EveryValueAndKeyKnowsWhereItStarts) {
  const Node root =
      parse_json("// a scene\n{\"a\": /* why */ [1,\n  -2.5, \"x\"],\n\t\"b\" : {\"c\":null} }\n", "f");
  EXPECT_EQ(at(root.at), "2:1");
  const Object& members = *root.as<Object>();
  EXPECT_EQ(at(members[0].at), "2:2");
  EXPECT_EQ(at(members[0].value.at), "2:17");
  const List& list = *members[0].value.as<List>();
  EXPECT_EQ(at(list[0].at), "2:18");
  EXPECT_EQ(at(list[1].at), "3:3");
  EXPECT_EQ(at(list[2].at), "3:9");
  EXPECT_EQ(at(members[1].at), "4:2");
  EXPECT_EQ(at(members[1].value.as<Object>()->front().at), "4:9");
  EXPECT_EQ(at(members[1].value.find("c")->at), "4:13");
}

TEST(Json, ColumnsCountCharactersNotBytes) {
  const Node root = parse_json("{\"größe\": 1}", "f");
  EXPECT_EQ(at(root.find("größe")->at), "1:11");
}

TEST(Json, ByteOrderMarkAndCarriageReturnsDoNotShiftPositions) {
  const Node root = parse_json("\xEF\xBB\xBF{\r\n \"a\": 1 // x\r\n, \"b\": 2}", "f");
  EXPECT_EQ(at(root.at), "1:1");
  EXPECT_EQ(at(root.find("a")->at), "2:7");
  EXPECT_EQ(at(root.find("b")->at), "3:8");
}

TEST(Json, ReadsEveryKindOfValue) {
  const Node root = parse_json(R"([null, true, -7, 2.5e1, "a\n\u00e9", [], {}, 9223372036854775807])", "f");
  const List& list = *root.as<List>();
  EXPECT_TRUE(list[0].as<std::nullptr_t>());
  EXPECT_EQ(*list[1].as<bool>(), true);
  EXPECT_EQ(*list[2].as<int64_t>(), -7);
  EXPECT_EQ(*list[3].as<double>(), 25.0);
  EXPECT_EQ(*list[4].as<std::string>(), "a\né");
  EXPECT_TRUE(list[5].as<List>()->empty());
  EXPECT_TRUE(list[6].as<Object>()->empty());
  EXPECT_EQ(*list[7].as<int64_t>(), std::numeric_limits<int64_t>::max());
}

TEST(Json, SyntaxErrorsHaveAReasonAndAPlace) {
  EXPECT_EQ(error_of("{\"a\": [1, 2,\n]}"), "f:1:12: trailing comma before ']'; remove it");
  EXPECT_EQ(error_of("{\n\"a\": 1,\n}"), "f:2:7: trailing comma before '}'; remove it");
  EXPECT_EQ(error_of(""), "f:1:1: the file is empty");
  EXPECT_EQ(error_of("// nothing\n"), "f:2:1: the file is empty");
  EXPECT_EQ(error_of("{\"a\": 1"), "f:1:8: the file ends too early; expected '}'");
  EXPECT_EQ(error_of("[1 2]"), "f:1:4: unexpected number literal; expected ']'");
  EXPECT_EQ(error_of("{a: 1}"), "f:1:2: invalid literal; expected string literal");
  EXPECT_EQ(error_of("{\"a\" 1}"), "f:1:6: unexpected number literal; expected ':'");
  EXPECT_EQ(error_of("[NaN]"), "f:1:2: invalid literal");
  EXPECT_EQ(error_of("[\"a\n\"]"),
            "f:1:2: invalid string: control character U+000A (LF) must be escaped to \\u000A or \\n");
  EXPECT_EQ(error_of("[1] x"), "f:1:5: invalid literal; expected end of input");
}

TEST(Json, NumbersThatDoNotFitAreRefused) {
  EXPECT_EQ(error_of("[1, 9223372036854775808]"), "f:1:5: the integer does not fit in 64 bits");
  EXPECT_EQ(error_of("[18446744073709551616]"), "f:1:2: the integer does not fit in 64 bits");
  EXPECT_EQ(error_of("[1e999]"), "f:1:2: number overflow parsing '1e999'");
}

TEST(Json, EveryRepeatedKeyIsAnError) {
  EXPECT_EQ(error_of("{\"a\": 1, \"b\": {\"c\": 1, \"c\": 2},\n \"a\": 3}"),
            "f:1:24: the key \"c\" is already given above\nf:2:2: the key \"a\" is already given above");
}

TEST(Json, NestingIsBounded) {
  const std::string open(kMaxDepth, '['), close(kMaxDepth, ']');
  EXPECT_NO_THROW(parse_json(open + close, "f"));
  EXPECT_EQ(error_of("[" + open + close + "]"), "f:1:65: is nested deeper than 64 levels");
  EXPECT_NE(error_of(std::string(1'000'000, '[')), "accepted");
}

TEST(Json, ZeroBytesAreNoText) {
  EXPECT_EQ(error_of(std::string("{}\0{", 4)), "f:1:3: is not a text file: it contains a zero byte");
}

TEST(Json, NumbersAreWrittenSoThatTheyReadBackBitForBit) {
  const effects::RandomStream random(7, 1);
  for (uint64_t i = 0; i < 20000; ++i) {
    const uint64_t bits = random.below(uint64_t{1} << 32, i, 0) << 32 | random.below(uint64_t{1} << 32, i, 1);
    double v;
    std::memcpy(&v, &bits, sizeof v);
    if (!std::isfinite(v)) continue;
    const Node back = parse_json(to_text(v), "f");
    const double read = back.as<double>() ? *back.as<double>() : static_cast<double>(*back.as<int64_t>());
    ASSERT_EQ(std::memcmp(&read, &v, sizeof v), 0) << to_text(v);
  }
  EXPECT_EQ(to_text(0.1), "0.1");
  EXPECT_EQ(to_text(100000.0), "100000");
  EXPECT_EQ(to_text(-0.0), "-0.0");
}

TEST(Json, TextIsEscapedSoThatItReadsBack) {
  std::string text;
  for (char c = 1; c < 127; ++c) text += c;
  text += "é漢😀";
  EXPECT_EQ(*parse_json(to_text(text), "f").as<std::string>(), text);
}

/// Writes a random tree with random white space and comments, and records the position of each value.
class RandomText {
 public:
  explicit RandomText(uint64_t seed) : random_(seed, 2) { value(0); }

  std::string text;
  std::vector<std::string> places;  // positions of all values, in order

 private:
  uint64_t draw(uint64_t n) { return random_.below(n, i_++, 0); }

  void add(const std::string& s) {
    for (const char c : s) {
      text += c;
      column_ = c == '\n' ? 1 : column_ + ((c & 0xC0) != 0x80);
      line_ += c == '\n';
    }
  }
  void space() {
    static const std::string kSpaces[] = {"", " ", "\n", "\t ", "/* [,\"é */", "// {\"x\n", "\r\n"};
    for (uint64_t n = draw(3); n > 0; --n) add(kSpaces[draw(std::size(kSpaces))]);
  }
  void value(int depth) {
    static const std::string kLeaves[] = {"1", "-2.5e3", "true", "null", "\"a\\\"//b\"", "\"é\\\\\"", "0"};
    space();
    places.push_back(std::to_string(line_) + ":" + std::to_string(column_));
    const uint64_t kind = depth < 5 ? draw(4) : 0;
    const bool list = kind == 1;
    if (kind == 0 || kind == 3) {
      add(kLeaves[draw(std::size(kLeaves))]);
    } else {
      add(list ? "[" : "{");
      for (uint64_t n = draw(5), i = 0; i < n; ++i) {
        if (i > 0) add(",");
        space();
        if (!list) add("\"k" + std::to_string(i) + "\"");
        if (!list) space();
        if (!list) add(":");
        value(depth + 1);
        space();
      }
      add(list ? "]" : "}");
    }
  }

  effects::RandomStream random_;
  uint64_t i_ = 0;
  int line_ = 1, column_ = 1;
};

void collect_places(const Node& node, std::vector<std::string>& places) {
  places.push_back(at(node.at));
  if (const List* list = node.as<List>())
    for (const Node& item : *list) collect_places(item, places);
  if (const Object* object = node.as<Object>())
    for (const Member& member : *object) collect_places(member.value, places);
}

TEST(Json, PositionsHoldForAnyLayout) {
  for (uint64_t seed = 0; seed < 500; ++seed) {
    const RandomText random(seed);
    std::vector<std::string> places;
    ASSERT_NO_THROW(collect_places(parse_json(random.text, "f"), places)) << random.text;
    ASSERT_EQ(places, random.places) << random.text;
  }
}

}  // namespace
}  // namespace offstage::producer
