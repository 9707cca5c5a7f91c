// The page about a run is self-contained, and its plots and tables show the given figures.

#include "producer/run/run_report.h"

#include <regex>

#include <gtest/gtest.h>

#include "render/image_io.h"

namespace offstage::producer {
namespace {

RunStats three_frames() {
  RunStats stats;
  stats.frames = 3;
  for (int k = 0; k < 3; ++k)
    stats.figures.push_back({.frame = k + 1,
                             .time = 0.1 * k,
                             .sim_ms = 10.0 * k,
                             .render_ms = 40,
                             .encode_ms = 5,
                             .particles = 0,
                             .contacts = static_cast<std::size_t>(2 * k),
                             .energy = sim::Energy{.kinetic = 1.0 * k, .potential = 2.0 - k, .elastic = 0},
                             .state_hash = "state" + std::to_string(k),
                             .pixel_hash = "pixels" + std::to_string(k)});
  stats.pictures.emplace_back(1, render::Image{2, 1, {255, 0, 0, 255, 0, 0, 255, 255}});
  return stats;
}

std::string page(const RunStats& stats = three_frames()) {
  LoadedScene loaded =
      parse_scene(R"({"name": "a < b & c", "description": "<script>"})", "scene", OFFSTAGE_SOURCE_DIR);
  return run_report(loaded, "settings-hash", stats);
}

std::vector<std::string> all(const std::string& text, const std::string& pattern) {
  const std::regex regex(pattern);
  std::vector<std::string> found;
  for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i) found.push_back((*i)[1]);
  return found;
}

std::vector<uint8_t> from_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<uint8_t> bytes;
  uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<uint32_t>(digits.find(c));
    if ((count += 6) >= 8) bytes.push_back(static_cast<uint8_t>(bits >> (count -= 8)));
  }
  return bytes;
}

TEST(RunReport, PicturesAreInThePageItself) {
  const std::string html = page();
  const auto pictures = all(html, "src=\"data:image/png;base64,([^\"]*)\"");
  ASSERT_EQ(pictures.size(), 1u);
  const render::Image image = render::decode_image(from_base64(pictures[0]), "picture");
  EXPECT_EQ(image.rgba, three_frames().pictures[0].second.rgba);
  // Nothing is loaded from elsewhere.
  EXPECT_EQ(all(html, "((?:src|href)=\"(?!data:))").size(), 0u);
  EXPECT_EQ(html.find("http"), std::string::npos);
}

TEST(RunReport, TextOfTheSceneIsEscaped) {
  const std::string html = page();
  EXPECT_NE(html.find("<h1>a &lt; b &amp; c</h1>"), std::string::npos);
  EXPECT_EQ(html.find("<script"), std::string::npos);
}

TEST(RunReport, PlotsGoThroughTheFigures) {
  const auto lines = all(page(), "points=\"([^\"]*)\"");
  ASSERT_EQ(lines.size(), 4u + 1u + 3u) << "energies, contacts, times; no particles, as there are none";
  const auto points = [](const std::string& line) {
    std::vector<std::array<double, 2>> out;
    for (const std::string& pair : all(line, "([0-9.]+,[0-9.]+) "))
      out.push_back({std::stod(pair), std::stod(pair.substr(pair.find(',') + 1))});
    return out;
  };
  const auto kinetic = points(lines[0]), potential = points(lines[1]), total = points(lines[3]);
  ASSERT_EQ(kinetic.size(), 3u);
  // Points are evenly spaced in time and value; the y axis of a picture points down.
  EXPECT_NEAR(kinetic[2][0] - kinetic[1][0], kinetic[1][0] - kinetic[0][0], 0.11);
  EXPECT_NEAR(kinetic[2][1] - kinetic[1][1], kinetic[1][1] - kinetic[0][1], 0.11);
  EXPECT_GT(kinetic[0][1], kinetic[2][1]);
  EXPECT_NEAR(potential[0][1], kinetic[2][1], 0.11) << "both are 2 J";
  EXPECT_NEAR(total[0][1], total[2][1], 0.11) << "kept";
}

TEST(RunReport, EveryFrameHasItsHashesAndARunWithoutFramesAPage) {
  const std::string html = page();
  for (int k = 0; k < 3; ++k) {
    EXPECT_NE(html.find("<td>state" + std::to_string(k) + "</td>"), std::string::npos);
    EXPECT_NE(html.find("<td>pixels" + std::to_string(k) + "</td>"), std::string::npos);
  }
  EXPECT_NE(html.find("settings-hash"), std::string::npos);
  EXPECT_NE(page({}).find("No frames were drawn"), std::string::npos);
}

}  // namespace
}  // namespace offstage::producer
