// The runs of a sweep and its table.

#include "producer/run/sweep.h"

#include <stdexcept>

#include <gtest/gtest.h>

#include "producer/base/time_code.h"
#include "producer/run/contact_sheet.h"
#include "producer/run/production.h"

namespace offstage::producer {
namespace {

using Values = std::vector<std::string>;

TEST(Sweep, RangesIncludeBothEndsWithoutRoundingInTheLabels) {
  EXPECT_EQ(parse_variation("a.b=100:400:100").values, (Values{"100", "200", "300", "400"}));
  EXPECT_EQ(parse_variation("a=0:1:0.1").values,
            (Values{"0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7", "0.8", "0.9", "1"}));
  EXPECT_EQ(parse_variation("a=-0.2:0.2:0.1").values, (Values{"-0.2", "-0.1", "0", "0.1", "0.2"}));
  EXPECT_EQ(parse_variation("a=5:1:-2").values, (Values{"5", "3", "1"}));
  EXPECT_EQ(parse_variation("a=1:2:0.7").values, (Values{"1", "1.7"})) << "never past the end";
  EXPECT_EQ(parse_variation("a.b=1:2:1").path, "a.b");
}

TEST(Sweep, CommasInsideBracketsAndQuotesBelongToTheValue) {
  EXPECT_EQ(parse_variation("p=[0,1,0],[0,2,0]").values, (Values{"[0,1,0]", "[0,2,0]"}));
  EXPECT_EQ(parse_variation(R"(p={"mean":1,"deviation":2},3)").values,
            (Values{R"({"mean":1,"deviation":2})", "3"}));
  EXPECT_EQ(parse_variation(R"(p="a,b:c","d\",e")").values, (Values{R"("a,b:c")", R"("d\",e")"}));
  EXPECT_EQ(parse_variation("p=smoke,fire").values, (Values{"smoke", "fire"}));
}

TEST(Sweep, InvalidVariationsAreRefused) {
  for (const char* text : {"a", "=1,2", "a=", "a=1,,2", "a=1:2", "a=1:2:0", "a=1:2:-1", "a=1:x:1",
                           "a=1:2:3:4", "a=0:1e9:1", "a=1:nan:1"})
    EXPECT_THROW(parse_variation(text), std::invalid_argument) << text;
}

TEST(Sweep, CombinationsAreTheProductTheLastVaryingFastest) {
  const auto all = combinations({{"a", {"1", "2"}}, {"b", {"x", "y", "z"}}});
  EXPECT_EQ(all,
            (std::vector<Values>{{"1", "x"}, {"1", "y"}, {"1", "z"}, {"2", "x"}, {"2", "y"}, {"2", "z"}}));
  EXPECT_THROW(combinations({{"a", {"1"}}, {"a", {"2"}}}), std::invalid_argument);
  const Variation seventeen = parse_variation("a=1:17:1");
  EXPECT_EQ(combinations({parse_variation("a=1:16:1"), parse_variation("b=1:16:1")}).size(), 256u);
  EXPECT_THROW(combinations({parse_variation("a=1:16:1"), parse_variation("b=1:17:1")}),
               std::invalid_argument);
}

TEST(Sweep, TheTableHasTheColumnsOfAllRunsAndQuotesTextWhereNeeded) {
  EXPECT_EQ(to_csv({{{"p", "[0,1]"}, {"n", "3"}}, {{"p", "say \"x\""}, {"fault", "two\nlines"}}}),
            "p,n,fault\n\"[0,1]\",3,\n\"say \"\"x\"\"\",,\"two\nlines\"\n");
}

TEST(Sweep, FiguresHaveNoTimesSoThatTheyRepeat) {
  RunStats fast, slow;
  fast.state_hash = slow.state_hash = "abc";
  fast.wall_s = 1;
  slow.wall_s = 2;
  slow.sim.add(7);
  EXPECT_EQ(figures_of(fast), figures_of(slow));
  const std::string table = to_csv({figures_of(fast)});
  for (const char* name : {"bodies", "contacts", "particles", "particles_born", "particles_removed",
                           "exact_solver.solves", "state_hash"})
    EXPECT_NE(table.find(name), std::string::npos) << name;
}

/// Returns whether a rectangle of an image has a pixel that differs from the lower right corner of the image.
bool is_drawn(const render::Image& image, int left, int top, int right, int bottom) {
  const auto at = [&](int x, int y) {
    return image.rgba[4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width_px) +
                           static_cast<std::size_t>(x))];
  };
  const uint8_t paper = at(image.width_px - 1, image.height_px - 1);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x)
      if (at(x, y) != paper) return true;
  return false;
}

TEST(ContactSheet, LongLabelsStayUnderTheirPicture) {
  render::Image picture{160, 90, {}};
  picture.rgba.assign(4 * picture.pixel_count(), 255);
  const std::string longest(300, 'W');
  const render::Image sheet = contact_sheet({longest}, {{{longest}, picture}, {{"b"}, picture}}, 2);
  // From the right: a margin, a picture, a gap, a picture, a margin; all gaps are equal.
  const int gap = (sheet.width_px - 2 * 160) / 3;
  ASSERT_GT(gap, 4);
  const int top = sheet.height_px / 4;  // below the heading
  EXPECT_TRUE(is_drawn(sheet, gap, top, gap + 160, sheet.height_px));
  EXPECT_FALSE(is_drawn(sheet, gap + 160, top, 2 * gap + 160, sheet.height_px)) << "the gap between is empty";
  EXPECT_FALSE(is_drawn(sheet, sheet.width_px - gap, 0, sheet.width_px, sheet.height_px));
  EXPECT_FALSE(is_drawn(sheet, 0, sheet.height_px - gap, sheet.width_px, sheet.height_px));
}

TEST(ContactSheet, AFailedRunLeavesItsReasonInItsPlace) {
  render::Image picture{160, 90, {}};
  picture.rgba.assign(4 * picture.pixel_count(), 255);
  const render::Image without = contact_sheet({}, {{{"a"}, picture}, {{"b"}, {}, ""}}, 2);
  const render::Image with = contact_sheet({}, {{{"a"}, picture}, {{"b"}, {}, "it diverged"}}, 2);
  EXPECT_EQ(with.width_px, without.width_px);
  EXPECT_NE(with.rgba, without.rgba);
}

TEST(ContactSheet, TimeCodesCarryAndSheetsHaveALimit) {
  EXPECT_EQ(time_code(0), "0:00.00");
  EXPECT_EQ(time_code(2.5), "0:02.50");
  EXPECT_EQ(time_code(59.996), "1:00.00");
  EXPECT_EQ(time_code(-0.5), "-0:00.50");
  EXPECT_NO_THROW(check_sheet_size(256, 16, 320, 180));
  EXPECT_THROW(check_sheet_size(256, 16, 1920, 1080), std::invalid_argument);
  for (std::size_t n = 1; n < 300; ++n) EXPECT_LE(columns_for(n), 20) << n;
  EXPECT_EQ(columns_for(12), 4);
}

}  // namespace
}  // namespace offstage::producer
