// Lines of overlays, compared with known properties of their bodies.

#include "producer/build/overlays.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

using Eigen::Vector3f;

/// The simulation of a scene given as text; files are found in the source folder.
struct Shown {
  explicit Shown(const std::string& text)
      : loaded(parse_scene(text, "scene", OFFSTAGE_SOURCE_DIR)),
        models(loaded.scene, loaded.folder, DecompositionCache(), loaded.warnings),
        simulation(loaded.scene, models) {
    simulation.advance();
  }
  LineSet lines(std::size_t overlay = 0) const { return simulation.snapshot().overlays.at(overlay); }

  LoadedScene loaded;
  ModelLibrary models;
  Simulation simulation;
};

/// Returns a scene of kinematic bodies and overlays.
std::string overlaid(const std::string& bodies, const std::string& overlays) {
  return R"({"bodies": [)" + bodies + R"(], "overlays": [)" + overlays + "]}";
}
std::string ball(const std::string& name, const std::string& position, const std::string& more = "") {
  return R"({"name": ")" + name +
         R"(", "motion": "kinematic", "shape": {"type": "sphere", "radius": 0.5}, "position": )" + position +
         more + "}";
}
constexpr const char* kCrank =
    R"({"name": "crank", "motion": "kinematic", "position": [1, 2, 3],
        "shape": {"type": "mesh", "file": "assets/models/crank.glb", "scale": 2}})";
std::string tree_of_crank(const std::string& more) {
  return overlaid(kCrank, R"({"type": "tree", "body": "crank", )" + more + "}");
}

Eigen::AlignedBox3f box_of(const LineSet& set) {
  Eigen::AlignedBox3f box;
  for (const render::Line& line : set.lines) box.extend(line.a).extend(line.b);
  return box;
}

TEST(Overlays, RootOfABoxTreeIsTheBoxOfTheMesh) {
  const Shown shown(tree_of_crank(R"("volume": "aabb", "level": 0)"));
  const LineSet set = shown.lines();
  ASSERT_EQ(set.lines.size(), 12u);
  const Eigen::AlignedBox3f model = shown.models.model("assets/models/crank.glb").bounds();
  EXPECT_TRUE(box_of(set).min().isApprox(2 * model.min() + Vector3f(1, 2, 3), 1e-5f));
  EXPECT_TRUE(box_of(set).max().isApprox(2 * model.max() + Vector3f(1, 2, 3), 1e-5f));
}

TEST(Overlays, LevelsOfATreeDoubleAndFadeIntoEachOther) {
  for (const char* volume : {"aabb", "obb", "sphere"}) {
    const std::string start = R"("volume": ")" + std::string(volume) + R"(", "level": )";
    const auto at = [&](const char* level) { return Shown(tree_of_crank(start + level)).lines(); };
    const LineSet two = at("2"), three = at("3"), between = at("2.25");
    EXPECT_EQ(three.lines.size(), 2 * two.lines.size()) << volume;
    EXPECT_EQ(between.lines.size(), two.lines.size() + three.lines.size());
    float fading = 0, coming = 0;
    for (const render::Line& line : between.lines)
      (line.color.head<3>() == two.lines[0].color.head<3>() ? fading : coming) = line.color.w();
    EXPECT_FLOAT_EQ(fading, 0.75f);
    EXPECT_FLOAT_EQ(coming, 0.25f);
  }
}

TEST(Overlays, ClosestPointsAreOnTheLineBetweenTheCentresOfBalls) {
  const Shown shown(overlaid(
      ball("left", "[0, 0, 0]") + "," + ball("right", "[0, 3, 0]"),
      R"({"type": "closest", "a": "left", "b": "right", "color": [0, 0, 1], "penetrating": [1, 0, 0]})"));
  const render::Line line = shown.lines().lines.at(0);
  EXPECT_TRUE(line.a.isApprox(Vector3f(0, 0.5f, 0), 1e-5f));
  EXPECT_TRUE(line.b.isApprox(Vector3f(0, 2.5f, 0), 1e-5f));
  EXPECT_GT(line.color.z(), line.color.x());
}

TEST(Overlays, OverlappingBodiesShowTheirDepthInAnotherColour) {
  const Shown shown(overlaid(
      ball("left", "[0, 0, 0]") + "," + ball("right", "[0, 0.8, 0]"),
      R"({"type": "closest", "a": "left", "b": "right", "color": [0, 0, 1], "penetrating": [1, 0, 0]})"));
  const render::Line line = shown.lines().lines.at(0);
  EXPECT_NEAR((line.a - line.b).norm(), 0.2, 1e-5);
  EXPECT_GT(line.color.x(), line.color.z());
}

TEST(Overlays, ContactsOfAllPairsArePushedApart) {
  // A ball in the floor and a ball on the first one. The third ball is far away, and the fourth does not
  // collide.
  const Shown shown(overlaid(R"({"motion": "static", "shape": {"type": "plane"}},)" +
                                 ball("low", "[0, 0.499, 0]") + "," + ball("high", "[0, 1.495, 0]") + "," +
                                 ball("far", "[5, 3, 0]") + "," +
                                 ball("ghost", "[0.2, 1, 0]", R"(, "collides": false)"),
                             R"({"type": "contacts", "size": 0.05})"));
  std::vector<float> heights;
  for (const render::Line& line : shown.lines().lines) {
    if (line.a == line.b) heights.push_back(line.a.y());
    if (line.width_b > 0) continue;
    // An arrow head: along the normal, which is vertical here.
    EXPECT_NEAR(line.a.x(), 0, 1e-5);
    EXPECT_NEAR(line.b.x(), 0, 1e-5);
  }
  std::ranges::sort(heights);
  ASSERT_EQ(heights.size(), 2u) << testing::PrintToString(heights);
  EXPECT_NEAR(heights[0], -0.0005, 1e-5);
  EXPECT_NEAR(heights[1], 0.997, 1e-5);
}

/// Returns a cube of 2 kg that comes to rest on the floor within half a second, and one in free fall far
/// above.
std::string resting_and_falling(const std::string& overlays, const std::string& more = "") {
  return R"({"materials": [{"name": "wood", "restitution": 0}], "bodies": [
    {"name": "floor", "motion": "static", "shape": {"type": "plane"}, "material": "wood"},
    {"name": "resting", "mass": 2, "position": [0, 0.501, 0], "material": "wood"},
    {"name": "falling", "mass": 2, "position": [3, 90, 0], "velocity": [1, 0, 0], "angular_velocity": [0, 0, 2]}],
    "output": {"fps": 10}, "overlays": [)" +
         overlays + "]" + more + "}";
}
Shown after_half_a_second(const std::string& text) {
  Shown shown(text);
  for (int frame = 0; frame < 5; ++frame) shown.simulation.advance();
  return shown;
}
/// Returns the vectors from start to tip of all arrows in a set.
std::vector<Vector3f> arrows(const LineSet& set) {
  std::vector<Vector3f> all;
  for (std::size_t i = 1; i < set.lines.size(); ++i)
    if (set.lines[i].width_b == 0) all.push_back(set.lines[i].b - set.lines[i - 1].a);
  return all;
}

TEST(Overlays, ForcesOfContactsAddUpToTheWeight) {
  const Shown shown = after_half_a_second(resting_and_falling(
      R"({"type": "contacts", "force_scale": 0.1}, {"type": "contacts", "size": 0.05},
         {"type": "contacts", "a": "falling", "b": "floor"}, {"type": "contacts", "a": "floor", "b": "resting"})"));
  const std::vector<Vector3f> forces = arrows(shown.lines(0)), normals = arrows(shown.lines(1));
  ASSERT_EQ(forces.size(), 4u);
  Vector3f sum = Vector3f::Zero();
  for (const Vector3f& force : forces) sum += force;
  EXPECT_NEAR(std::abs(sum.y()), 0.1 * 2 * 9.81, 1e-3);
  ASSERT_EQ(normals.size(), 4u);
  for (const Vector3f& normal : normals) EXPECT_NEAR(std::abs(normal.y()), 4 * 0.05, 1e-5);
  EXPECT_TRUE(shown.lines(2).lines.empty());
  EXPECT_EQ(shown.lines(3).lines.size(), shown.lines(1).lines.size());
}

TEST(Overlays, VelocitiesAreArrowsFromTheCentre) {
  const Shown shown = after_half_a_second(resting_and_falling(
      R"({"type": "velocities", "body": "falling", "scale": 0.5, "angular_scale": 0.25}, {"type": "velocities"})"));
  const std::vector<Vector3f> shown_arrows = arrows(shown.lines(0));
  ASSERT_EQ(shown_arrows.size(), 2u);
  EXPECT_TRUE(shown_arrows[0].isApprox(0.5f * Vector3f(1, -9.81f * 0.5f, 0), 1e-5f));
  EXPECT_TRUE(shown_arrows[1].isApprox(Vector3f(0, 0, 0.5f), 1e-5f));
  EXPECT_TRUE(shown.lines(0).lines[0].a.isApprox(Vector3f(3.5f, 90 - 9.81f / 8, 0), 1e-5f));
  EXPECT_EQ(arrows(shown.lines(1)).size(), 1u) << "the resting body and the floor have no arrow";
}

TEST(Overlays, TrailsLieOnThePathAndEndAtTheirAge) {
  Shown shown(R"({"bodies": [{"name": "thrown", "position": [0, 50, 0], "velocity": [2, 3, 0],
                              "shape": {"type": "sphere", "radius": 0.1}},
                             {"name": "other", "motion": "static", "position": [9, 9, 9], "shape": {"type": "sphere"}}],
                  "output": {"fps": 50, "duration": 2}, "overlays": [{"type": "trails", "duration": 0.4}]})");
  while (shown.simulation.world().time() < 0.9999) shown.simulation.advance();
  const LineSet trail = shown.lines();
  ASSERT_GT(trail.lines.size(), 10u);
  float oldest = 1e9f, newest = 0, last_alpha = 0, way = 0;
  for (const render::Line& line : trail.lines) {
    for (const Vector3f& place : {line.a, line.b}) {
      const float t = place.x() / 2;  // time on the ballistic parabola
      EXPECT_NEAR(place.y(), 50 + 3 * t - 0.5f * 9.81f * t * t, 2e-3f);
      oldest = std::min(oldest, t);
      newest = std::max(newest, t);
    }
    EXPECT_GE(line.color.w(), last_alpha) << "the trail gets more opaque towards the body";
    last_alpha = line.color.w();
    way += (line.b - line.a).norm();
  }
  const double now = shown.simulation.world().time();
  EXPECT_NEAR(newest, now, 1e-4) << "the trail reaches the body";
  EXPECT_NEAR(oldest, now - 0.4, 0.05);
  EXPECT_NEAR(way, 0.4 * std::hypot(2, 3 - 9.81 * (now - 0.2)), 0.4) << "the trail has no gaps";
}

TEST(Overlays, IslandsShareAColourAndSleepingOnesAreDim) {
  const std::string stack =
      R"({"name": "upper", "position": [0, 1.5, 0]}, {"name": "lower", "position": [0, 0.5, 0]},
    {"name": "lone", "position": [5, 0.5, 0]}, {"motion": "static", "shape": {"type": "plane"}})";
  const auto colors = [&](const std::string& sleep) {
    Shown shown(R"({"world": {"sleep": )" + sleep + R"(}, "bodies": [)" + stack +
                R"(], "overlays": [{"type": "islands", "asleep": 0.5}]})");
    for (int frame = 0; frame < 90; ++frame) shown.simulation.advance();
    const LineSet set = shown.lines();
    EXPECT_EQ(set.lines.size(), 3u * 12);
    return std::array{set.lines[0].color, set.lines[12].color, set.lines[24].color};
  };
  const auto awake = colors("false"), asleep = colors("true");
  EXPECT_EQ(awake[0], awake[1]);
  EXPECT_NE(awake[0], awake[2]);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_TRUE(asleep[i].head<3>().isApprox(0.5f * awake[i].head<3>(), 1e-5f)) << i;
}

TEST(Overlays, DoNotDependOnEarlierFrames) {
  const std::string box = R"({"name": "box", "motion": "kinematic", "spin": [1, 2, 3]})";
  const std::string text =
      overlaid(ball("a", "[0, 1.02, 0]") + "," + box,
               R"({"type": "closest", "a": "a", "b": "box"}, {"type": "contacts", "margin": 0.3})");
  Shown once(text), often(text);
  for (int frame = 0; frame < 5; ++frame) {
    often.simulation.advance();
    often.simulation.snapshot();
    once.simulation.advance();
  }
  for (const std::size_t overlay : {0, 1}) {
    const LineSet a = once.lines(overlay), b = often.lines(overlay);
    ASSERT_EQ(a.ids, b.ids);
    for (std::size_t i = 0; i < a.lines.size(); ++i) EXPECT_EQ(a.lines[i].a, b.lines[i].a);
  }
}

TEST(Overlays, DoNotTouchTheState) {
  const Shown with(tree_of_crank(R"("level": 3)")), without(overlaid(kCrank, ""));
  EXPECT_EQ(with.simulation.snapshot().state_hash, without.simulation.snapshot().state_hash);
}

// A weight of 2 kg that hangs on a hinge: the overlay shows its axis, a line to the centre, and an arrow for
// the constraint force.
TEST(JointsOverlay, ShowsTheHingeAndItsForce) {
  Shown shown(R"({"bodies": [{"name": "arm", "shape": {"type": "box", "size": [0.1, 1, 0.1]}, "density": 200,
                              "position": [0, 0.5, 0]}],
    "joints": [{"name": "hinge", "type": "revolute", "a": "arm", "anchor": [0, 1, 0], "axis": [0, 0, 1]}],
    "output": {"fps": 10},
    "overlays": [{"type": "joints", "joint": "hinge", "size": 0.1, "force_scale": 0.05}]})");
  shown.simulation.advance();
  const LineSet set = shown.lines();
  float lowest = 1, highest = 1, along = 0;
  for (const render::Line& line : set.lines)
    for (const Vector3f& p : {line.a, line.b}) {
      lowest = std::min(lowest, p.y());
      highest = std::max(highest, p.y());
      along = std::max(along, std::abs(p.z()));
    }
  EXPECT_NEAR(lowest, 0.5, 1e-4) << "the centre of the arm";
  EXPECT_NEAR(along, 0.2, 1e-4) << "the axis";
  EXPECT_NEAR(highest, 1 + 0.05 * 2 * 9.81, 1e-3) << "the arrow";
}

}  // namespace
}  // namespace offstage::producer
