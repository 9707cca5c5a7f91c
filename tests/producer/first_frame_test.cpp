// Frame 1 shows the state at output.start with all objects that exist then: prewarmed particles and those
// created at that time, and no others.

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "producer/build/simulation.h"
#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

/// A scene given as text, simulated frame by frame.
class Film {
 public:
  explicit Film(const std::string& text)
      : loaded_(parse_scene(text, "scene", OFFSTAGE_SOURCE_DIR)),
        simulation_(loaded_.scene, ModelLibrary()) {}
  /// Returns the particles of the first source in a frame. Frames must be requested in ascending order.
  const std::vector<render::Point>& at(int frame) {
    while (simulation_.frame() < frame) simulation_.advance();
    snapshot_ = simulation_.snapshot();
    return snapshot_.point_sets[0].points;
  }
  const Snapshot& snapshot() const { return snapshot_; }
  SimulationTotals totals() const { return simulation_.totals(); }

 private:
  LoadedScene loaded_;
  Simulation simulation_;
  Snapshot snapshot_;
};

/// Returns a scene with one emitter; the arguments add keys to the emitter, the output section and the scene.
std::string scene(const std::string& emitter, const std::string& output = "", const std::string& more = "") {
  return R"({"emitters": [{"overlap": true, "radius": 0.02, "surface": {"position": [0, 6, 0], "size": [2, 2]},)" +
         emitter + R"(}], "output": {"fps": 10, "duration": 1)" + output + "}" + more + "}";
}

float lowest(const std::vector<render::Point>& points) {
  float y = 1e30f;
  for (const render::Point& p : points) y = std::min(y, p.position.y());
  return y;
}

TEST(FirstFrame, HasABurstAtTheStartTime) {
  for (const auto& [time, start] : {std::pair(0.0, 0.0), {1.0, 1.0}, {0.3, 0.3}}) {
    Film film(scene(R"("rate": 0, "speed": 2, "lifespan": 9, "bursts": [{"count": 10, "time": )" +
                        std::to_string(time) + "}]",
                    R"(, "start": )" + std::to_string(start)));
    ASSERT_EQ(film.at(1).size(), 10u) << time;
    EXPECT_EQ(film.totals().particles.born, 10u);
    for (const render::Point& p : film.at(1)) EXPECT_NEAR(p.position.y(), 6.02, 1e-6);
    const auto& later = film.at(2);
    // Each particle is integrated over the whole first step: 2 m/s upwards for 0.1 s.
    for (const render::Point& p : later) EXPECT_NEAR(p.position.y(), 6.02 + 0.2 - 9.81 * 0.01 / 2, 1e-5);
  }
}

TEST(FirstFrame, HasTheFirstIntervalRelease) {
  Film film(scene(R"("rate": 0, "count": 7, "interval": 0.5, "lifespan": 9)"));
  EXPECT_EQ(film.at(1).size(), 7u);
  EXPECT_EQ(film.at(6).size(), 14u);
}

// Rain from 6 m onto the ground: by 3 s, drops have been landing for about two seconds.
TEST(FirstFrame, HasPrewarmedParticlesWhereAFilmWithAnEarlierStartHasThem) {
  const std::string
      rain = R"("rate": 300, "direction": [0, -1, 0], "speed": 5, "lifespan": 3, "restitution": 0.2)",
      ground = R"(, "bodies": [{"motion": "static", "shape": {"type": "plane"}}])";
  Film prewarmed(scene(rain + R"(, "prewarm": 3)", "", ground)),
      started(scene(rain, R"(, "start": 3)", ground));
  const auto here = prewarmed.at(1), there = started.at(1);
  EXPECT_NEAR(static_cast<double>(here.size()), 900, 2);
  ASSERT_EQ(here.size(), there.size());
  for (std::size_t i = 0; i < here.size(); ++i)
    EXPECT_NEAR((here[i].position - there[i].position).norm(), 0, 1e-4) << i;
  // No particle was below the ground and had to be moved out of it.
  EXPECT_GT(lowest(here), 0.0199);
  prewarmed.at(3);
  EXPECT_EQ(prewarmed.totals().particles.ejected + prewarmed.totals().particles.removed, 0u);
}

TEST(FirstFrame, HasSplashesOfPrewarmedParticlesThatDied) {
  Film film(scene(
      R"("rate": 300, "direction": [0, -1, 0], "speed": 5, "lifespan": 30, "dies_on_hit": true, "prewarm": 3,
                     "on_collision": [{"name": "splash", "lifespan": 0.3, "count": 2}])",
      "", R"(, "bodies": [{"motion": "static", "shape": {"type": "plane"}}])"));
  // Falling 6 m from an initial speed of 5 m/s takes 0.72 s.
  EXPECT_NEAR(static_cast<double>(film.at(1).size()), 300 * 0.72, 6);
  EXPECT_NEAR(static_cast<double>(film.snapshot().point_sets[1].points.size()), 300 * 0.3 * 2, 10);
}

// The jet of a rotating nozzle is a spiral from the first frame on.
TEST(FirstFrame, ShowsParticlesPrewarmedFromAMovingBody) {
  Film film(R"({"world": {"gravity": [0, 0, 0]},
    "bodies": [{"name": "nozzle", "motion": "kinematic", "collides": false, "shape": {"type": "sphere"}, "spin": [0, 6.283185307179586, 0]}],
    "emitters": [{"body": "nozzle", "overlap": true, "rate": 100, "speed": 3, "lifespan": 5, "prewarm": 1, "spread_deg": 0,
                  "surface": {"position": [0, 0, 0], "direction": [1, 0, 0], "size": [1e-6, 1e-6]}}]})");
  const auto& points = film.at(1);
  ASSERT_NEAR(static_cast<double>(points.size()), 100, 1);
  std::array<int, 4> quadrants{};
  for (const render::Point& p : points)
    ++quadrants[static_cast<std::size_t>((p.position.x() < 0) + 2 * (p.position.z() < 0))];
  for (const int count : quadrants) EXPECT_NEAR(count, 25, 2);
}

// Prewarming does not move groups, bodies and cloths: they start as the scene says.
TEST(FirstFrame, PrewarmingDoesNotMoveOtherObjects) {
  Film film(scene(
      R"("rate": 100, "lifespan": 9, "prewarm": 2)", "",
      R"(, "bodies": [{"name": "ball", "shape": {"type": "sphere"}, "position": [3, 5, 0], "velocity": [1, 0, 0]}],
                      "particles": [{"name": "group", "places": [{"position": [5, 5, 5], "velocity": [0, 1, 0]}]}])"));
  film.at(1);
  EXPECT_EQ(film.snapshot().bodies[0].position, Eigen::Vector3f(3, 5, 0));
  ASSERT_EQ(film.snapshot().point_sets[0].points.size(), 1u);
  EXPECT_EQ(film.snapshot().point_sets[0].points[0].position, Eigen::Vector3f(5, 5, 5));
  film.at(2);
  EXPECT_NEAR(film.snapshot().bodies[0].position.x(), 3.1, 1e-5);
  EXPECT_NEAR(film.snapshot().point_sets[0].points[0].position.y(), 5.1 - 9.81 * 0.01 / 2, 1e-5);
}

// Keys of the form "hold, then move" do not overshoot in grabs and motors either, as in cameras and bodies.
TEST(Keys, OfAGrabAndOfAMotorDoNotOvershootTheirValues) {
  const LoadedScene loaded = parse_scene(R"({"world": {"gravity": [0, 0, 0]},
    "bodies": [{"name": "held", "shape": {"type": "sphere", "radius": 0.1}, "mass": 1},
               {"name": "arm", "shape": {"type": "box"}, "position": [5, 0, 0], "collides": false}],
    "joints": [{"name": "slide", "type": "prismatic", "a": "arm", "axis": [0, 1, 0], "anchor": [5, 0, 0],
                "motor": {"mode": "position", "keys": [{"time": 0, "target": 0}, {"time": 2, "target": 0},
                          {"time": 2.2, "target": 1}, {"time": 4, "target": 1}]}}],
    "forces": [{"type": "grab", "body": "held", "stiffness": 4000, "damping": 130, "keyframes": [
                {"time": 0}, {"time": 2}, {"time": 2.2, "position": [1, 0, 0]}, {"time": 4, "position": [1, 0, 0]}]}],
    "output": {"fps": 20, "duration": 3}})",
                                         "scene", OFFSTAGE_SOURCE_DIR);
  Simulation simulation(loaded.scene, ModelLibrary());
  while (simulation.frame() < loaded.scene.frame_count()) {
    simulation.advance();
    const Snapshot now = simulation.snapshot();
    const bool still = now.time < 2.01;
    EXPECT_NEAR(now.bodies[0].position.x(), still ? 0 : 0.5, still ? 1e-6 : 0.6) << now.time;
    EXPECT_NEAR(now.bodies[1].position.y(), still ? 0 : 0.5, still ? 1e-6 : 0.51) << now.time;
  }
  EXPECT_NEAR(simulation.snapshot().bodies[1].position.y(), 1, 1e-3);
}

}  // namespace
}  // namespace offstage::producer
