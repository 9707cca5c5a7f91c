#include "producer/build/placement.h"

#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

Copies copies_of(const Placement& placement, const Vec3& position = Vec3::Zero(), uint64_t seed = 1,
                 std::string_view name = "rock") {
  return expand(placement, position, seed, name);
}

/// Positions of the copies of an object at `position`.
std::vector<Vec3> places(const Copies& copies, const Vec3& position = Vec3::Zero()) {
  std::vector<Vec3> all;
  for (const PlacedCopy& copy : copies.placed) all.push_back(copy.motion.point_to_world(position));
  return all;
}

Scene parsed_scene(const std::string& text) {
  return parse_scene(text, "scene", ".").scene;
}

TEST(Placement, WithoutPlacementThereIsOnlyTheOriginal) {
  const Copies copies = copies_of({}, {1, 2, 3});
  ASSERT_EQ(copies.placed.size(), 1u);
  EXPECT_EQ(copies.placed[0].suffix, "");
  EXPECT_EQ(copies.placed[0].motion.point_to_world({1, 2, 3}), Vec3(1, 2, 3));
}

TEST(Placement, RepeatedCopiesStandInARow) {
  const std::vector<Vec3> at = places(copies_of({.repeat = Repeat{.count = 4, .offset = {1, 0.5, 0}}}));
  ASSERT_EQ(at.size(), 4u);
  for (std::size_t i = 0; i < 4; ++i)
    EXPECT_EQ(at[i], Vec3(static_cast<Real>(i), 0.5 * static_cast<Real>(i), 0));
}

TEST(Placement, RepeatedCopiesStandInARingAboutThePivot) {
  const Vec3 pivot(1, 0, 2), original(4, 1, 2);
  const Copies copies = copies_of({.repeat = Repeat{.count = 6, .turn_deg = 60, .pivot = pivot}}, original);
  const std::vector<Vec3> at = places(copies, original);
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Real angle = static_cast<Real>(i) * std::numbers::pi / 3;
    EXPECT_LT((at[i] - Vec3(1 + 3 * std::cos(angle), 1, 2 - 3 * std::sin(angle))).norm(), 1e-12);
    const Vec3 outward =
        // the x axis of the original, rotated with the copy
        copies.placed[i].motion.vector_to_world(Vec3::UnitX());
    EXPECT_LT((outward - (at[i] - Vec3(1, 1, 2)) / 3).norm(), 1e-12);
  }
}

TEST(Placement, AGridIsCentredInXAndZAndGrowsUpwards) {
  const std::vector<Vec3> at = places(copies_of({.grid = Grid{.count = {3, 2, 4}, .spacing = {1, 2, 0.5}}}));
  ASSERT_EQ(at.size(), 24u);
  Vec3 low = at[0], high = at[0], sum = Vec3::Zero();
  std::set<std::array<Real, 3>> distinct;
  for (const Vec3& p : at) {
    low = low.cwiseMin(p), high = high.cwiseMax(p), sum += p;
    distinct.insert({p.x(), p.y(), p.z()});
  }
  EXPECT_EQ(distinct.size(), 24u);
  EXPECT_EQ(low, Vec3(-1, 0, -0.75));
  EXPECT_EQ(high, Vec3(1, 2, 0.75));
  EXPECT_EQ(sum.x(), 0);
  EXPECT_EQ(sum.z(), 0);
}

TEST(Placement, ScatteredCopiesStayInTheRectangleAndApart) {
  const Scatter scatter{.count = 300, .size = {10, 4}, .min_distance = 0.25};
  const Vec3 original(5, 1, -3);
  const Copies copies = copies_of({.scatter = scatter}, original);
  const std::vector<Vec3> at = places(copies, original);
  EXPECT_EQ(at.size() + static_cast<std::size_t>(copies.left_out), 300u);
  EXPECT_GT(at.size(), 250u);
  for (std::size_t i = 0; i < at.size(); ++i) {
    EXPECT_LE(std::abs(at[i].x() - 5), 5);
    EXPECT_EQ(at[i].y(), 1);
    EXPECT_LE(std::abs(at[i].z() + 3), 2);
    for (std::size_t j = 0; j < i; ++j) ASSERT_GE((at[i] - at[j]).norm(), 0.25) << i << " " << j;
  }
}

TEST(Placement, ScatteringCoversTheRectangleEvenly) {
  const std::vector<Vec3> at = places(copies_of({.scatter = Scatter{.count = 20000, .size = {2, 2}}}));
  std::array<int, 16> cells{};
  for (const Vec3& p : at)
    ++cells[static_cast<std::size_t>((p.x() + 1) * 2) * 4 + static_cast<std::size_t>((p.z() + 1) * 2)];
  for (const int n : cells) EXPECT_NEAR(n, 1250, 4 * std::sqrt(1250.0));
}

TEST(Placement, ScatteringFollowsSeedsAndNameAndNothingElse) {
  const Placement placement{.scatter = Scatter{.count = 20}},
      reseeded{.scatter = Scatter{.count = 20, .seed = 2}};
  const std::vector<Vec3> first = places(copies_of(placement));
  EXPECT_EQ(first, places(copies_of(placement)));
  EXPECT_NE(first, places(copies_of(placement, Vec3::Zero(), 2)));
  EXPECT_NE(first, places(copies_of(placement, Vec3::Zero(), 1, "tree")));
  EXPECT_NE(first, places(copies_of(reseeded)));
  const std::vector<Vec3> more = places(copies_of({.scatter = Scatter{.count = 40}}));
  EXPECT_TRUE(std::equal(first.begin(), first.end(), more.begin())) << "more copies moved the first ones";
}

TEST(Placement, CopiesWithoutAFreePlaceAreLeftOutWithAWarning) {
  const LoadedScene loaded = parse_scene(
      R"({"bodies": [{"name": "rock", "scatter": {"count": 50, "size": [2, 2], "min_distance": 1}}]})", "s",
      ".");
  EXPECT_LT(loaded.scene.bodies.size(), 10u);
  EXPECT_GE(loaded.scene.bodies.size(), 2u);
  ASSERT_EQ(loaded.warnings.size(), 1u);
  EXPECT_EQ(loaded.warnings[0].describe(),
            "s:1:41: /bodies/0/scatter: " + std::to_string(50 - loaded.scene.bodies.size()) +
                " copies found no free place: reduce min_distance or enlarge size");
}

TEST(Placement, KindsMultiplyAndEachGroupScattersByItself) {
  const Placement placement{.repeat = Repeat{.count = 2, .offset = {100, 0, 0}},
                            .grid = Grid{.count = {2, 1, 3}, .spacing = {20, 1, 20}},
                            .scatter = Scatter{.count = 4, .size = {1, 1}}};
  const Copies copies = copies_of(placement);
  ASSERT_EQ(copies.placed.size(), 48u);
  EXPECT_EQ(copy_count(placement), 48);
  const std::vector<Vec3> at = places(copies);
  std::set<std::string> suffixes;
  for (std::size_t i = 0; i < 48; ++i) {
    suffixes.insert(copies.placed[i].suffix);
    const std::size_t group = i / 4, cell = group % 6;
    const Vec3 centre((group < 6 ? 0 : 100) + (cell % 2 == 0 ? -10 : 10), 0,
                      -20.0 + 20.0 * static_cast<Real>(cell / 2));
    EXPECT_LE((at[i] - centre).cwiseAbs().maxCoeff(), 0.5) << i;
  }
  EXPECT_EQ(suffixes.size(), 48u);
  EXPECT_NE(at[4] - at[0], Vec3(20, 0, 0)) << "two groups are scattered alike";
}

TEST(Placement, TooManyCopiesAreAnErrorForAnyProduct) {
  const std::string scene =
      R"({"bodies": [{"repeat": {"count": 100000}, "grid": {"count": [100000, 100000, 2]}}]})";
  try {
    parsed_scene(scene);
    FAIL();
  } catch (const SceneError& error) {
    EXPECT_STREQ(
        error.what(),
        "scene:1:13: /bodies/0: asks for more than 100000 copies: the counts of fill, repeat, grid and "
        "scatter multiply");
  }
}

TEST(Placement, MotionIsRotatedWithItsCopy) {
  const Scene scene = parsed_scene(R"({"bodies": [
    {"name": "arm", "motion": "kinematic", "position": [1, 0, 0], "orientation": {"axis": [1, 2, 0], "angle_deg": 30},
     "keyframes": [{"time": 0}, {"time": 1, "position": [2, 1, 0], "orientation": {"axis": [0, 0, 1], "angle_deg": 90}}],
     "spin": [1, 0, 0], "repeat": {"count": 3, "turn_deg": 120, "offset": [0, 5, 0], "pivot": [3, 0, 0]}},
    {"name": "shot", "velocity": [1, 0, 0], "angular_velocity": [0, 0, 1], "repeat": {"turn_deg": 90}}]})");
  ASSERT_EQ(scene.bodies.size(), 5u);
  EXPECT_EQ(scene.bodies[2].name, "arm_2");
  const auto second_key_in_body = [](const Body& body) {
    const sim::Pose pose{body.position, body.orientation};
    return pose.point_to_body(*body.keyframes[1].position);
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const Body &copy = scene.bodies[i], &original = scene.bodies[0];
    EXPECT_LT((second_key_in_body(copy) - second_key_in_body(original)).norm(), 1e-12);
    const Quat turned = copy.orientation.conjugate() * *copy.keyframes[1].orientation;
    EXPECT_LT(turned.angularDistance(original.orientation.conjugate() * *original.keyframes[1].orientation),
              1e-7);
    EXPECT_FALSE(copy.keyframes[0].position) << "left out means the copy's own position";
    EXPECT_EQ(copy.spin, Vec3(1, 0, 0)) << "spin is about the body's own axes";
  }
  EXPECT_LT((scene.bodies[4].velocity - Vec3(0, 0, -1)).norm(), 1e-12);
  EXPECT_LT((scene.bodies[4].angular_velocity - Vec3(1, 0, 0)).norm(), 1e-12);
}

TEST(Placement, ScaleActsOnShapeAndModel) {
  const Scene scene = parse_scene(R"({"bodies": [
    {"shape": {"type": "sphere", "radius": 2}, "scatter": {"count": 1, "scale": 3}},
    {"shape": {"type": "box", "size": [1, 2, 3]}, "scatter": {"count": 1, "scale": 3}},
    {"shape": {"type": "cone", "radius": 1, "height": 2}, "scatter": {"count": 1, "scale": 3}},
    {"shape": {"type": "mesh", "file": "LICENSE", "scale": 2}, "model": {"file": "LICENSE", "position": [1, 0, 0]},
     "scatter": {"count": 1, "scale": 3}}]})",
                                  "scene", OFFSTAGE_SOURCE_DIR)
                          .scene;
  EXPECT_EQ(std::get<sim::Sphere>(scene.bodies[0].shape).radius, 6);
  EXPECT_EQ(std::get<sim::Box>(scene.bodies[1].shape).size, Vec3(3, 6, 9));
  EXPECT_EQ(std::get<sim::Cone>(scene.bodies[2].shape).height, 6);
  EXPECT_EQ(std::get<MeshFile>(scene.bodies[3].shape).scale, 6);
  EXPECT_EQ(scene.bodies[3].model->scale, 3);
  EXPECT_EQ(scene.bodies[3].model->position, Vec3(3, 0, 0));
}

TEST(Placement, EmittersAreCopiedToo) {
  const Scene scene = parsed_scene(R"({"emitters": [
    {"name": "jet", "surface": {"position": [2, 1, 0], "direction": [1, 0, 0]}, "repeat": {"count": 2, "turn_deg": 90}}]})");
  ASSERT_EQ(scene.emitters.size(), 2u);
  EXPECT_EQ(scene.emitters[1].name, "jet_1");
  const PlaneSurface& surface = std::get<PlaneSurface>(scene.emitters[1].surface);
  EXPECT_LT((surface.position - Vec3(0, 1, -2)).norm(), 1e-12);
  EXPECT_LT((surface.direction - Vec3(0, 0, -1)).norm(), 1e-12);
}

TEST(Placement, ACopiedEmitterTurnsAsAWhole) {
  const Scene scene = parsed_scene(R"({"emitters": [
    {"surface": {"direction": [0, 1, 0], "size": [2, 0.02]}, "repeat": {"count": 2, "turn_deg": 90}},
    {"surface": {"direction": [1, 2, 3], "turn_deg": 20, "size": [2, 0.02]}, "repeat": {"count": 2, "turn_deg": -35}}]})");
  for (const std::size_t first : {0u, 2u}) {
    const auto& a = std::get<PlaneSurface>(scene.emitters[first].surface);
    const auto& b = std::get<PlaneSurface>(scene.emitters[first + 1].surface);
    const double turn = (first == 0 ? 90 : -35) * std::numbers::pi / 180;
    const Quat expected = Quat(Eigen::AngleAxisd(turn, Vec3::UnitY())) * a.orientation();
    EXPECT_LT(b.orientation().angularDistance(expected), 1e-12) << first;
  }
}

}  // namespace
}  // namespace offstage::producer
