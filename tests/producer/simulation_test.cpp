// Bodies, contacts and forces of a scene have their effect in the simulation. The results are compared with
// closed forms that depend on each of the keys.

#include "producer/build/simulation.h"

#include <cmath>
#include <stdexcept>

#include <gtest/gtest.h>

#include "producer/format/scene_io.h"

namespace offstage::producer {
namespace {

constexpr Real kGravity = 9.81;

/// A scene given as text, simulated to its end.
class Simulated {
 public:
  explicit Simulated(const std::string& text)
      : loaded_(parse_scene(text, "scene", OFFSTAGE_SOURCE_DIR)), simulation_(loaded_.scene, ModelLibrary()) {
    for (int frame = 0; frame < loaded_.scene.frame_count(); ++frame) simulation_.advance();
  }
  sim::BodyState body(const std::string& name) const {
    for (const Simulation::NamedBody& body : simulation_.moving_bodies())
      if (body.name == name) return simulation_.world().body(body.handle);
    throw std::out_of_range(name);
  }
  /// Returns the position of the first particle of a group.
  Vec3 particle(std::size_t group) const {
    return simulation_.world().particles(simulation_.particle_groups()[group].handle).position.front();
  }
  Vec3 cloth_point(uint32_t vertex) const {
    return simulation_.world().cloth(simulation_.cloths().front().handle).points[vertex];
  }
  SimulationTotals totals() const { return simulation_.totals(); }

 private:
  LoadedScene loaded_;
  Simulation simulation_;
};

/// Balls of 2 kg at the given places of the x axis, for one second; gravity is off.
std::string balls(const std::vector<double>& places, const std::string& more) {
  std::string bodies;
  for (const double x : places)
    bodies += (bodies.empty() ? "" : ",") +
              std::string(R"({"mass": 2, "shape": {"type": "sphere"}, "position": [)") + std::to_string(x) +
              ", 0, 0]}";
  return R"({"world": {"gravity": [0, 0, 0]}, "bodies": [)" + bodies +
         R"(], "output": {"fps": 10, "duration": 1.1}, )" + more + "}";
}

/// Returns a scene of two seconds with a box of 1 kg on a floor. The arguments add keys to the floor, the box
/// and the scene.
std::string cube_on_floor(const std::string& floor, const std::string& cube, const std::string& scene) {
  return R"({"bodies": [{"name": "floor", "motion": "static", "shape": {"type": "plane"}, "material": "floor")" +
         floor +
         R"(}, {"name": "cube", "mass": 1, "shape": {"type": "box", "size": [0.4, 0.1, 0.4]},
             "position": [0, 0.05, 0], "material": "cube")" +
         cube + R"(}], "output": {"fps": 10, "duration": 2.1}, )" + scene + "}";
}
/// Returns the stopping distance of a body that slides with 2 m/s.
Real stopping_distance(Real friction) {
  return 4 / (2 * friction * kGravity);
}

TEST(Simulation, AFieldActsOnItsObjectsInItsRegionDuringItsTime) {
  const Simulated run(balls({0, 5, 10}, R"("forces": [
    {"type": "constant", "force": [0, 3, 0], "bodies": ["body_0"], "start": 0.25, "end": 0.75},
    {"type": "constant", "force": [0, 0, 8], "region": {"type": "box", "centre": [5, 0, 0], "size": [4, 4, 40]}},
    {"type": "point", "point": [14, 0, 0], "force": -1, "drop_rate": 2, "end": 0.1,
     "region": {"type": "sphere", "centre": [12, 0, 0], "radius": 4}}])"));
  constexpr Real kStep = 1.0 / 240;  // the start and end of a force are rounded to a sub-step
  EXPECT_TRUE(run.body("body_0").velocity.isApprox(Vec3(0, 0.75, 0), 2 * kStep));
  EXPECT_TRUE(run.body("body_1").velocity.isApprox(Vec3(0, 0, 4), 1e-9));
  EXPECT_NEAR(run.body("body_2").velocity.x(), -0.25 / 2 * 0.1, 0.25 / 2 * kStep);
  EXPECT_EQ(run.body("body_2").velocity.tail<2>().norm(), 0);
}

TEST(Simulation, AForceActsOnAllCopiesOfABodyThatItNames) {
  const Simulated run(R"({"world": {"gravity": [0, 0, 0]}, "output": {"fps": 10, "duration": 1.1},
    "bodies": [{"name": "crate", "mass": 1, "repeat": {"count": 3, "offset": [5, 0, 0]}},
               {"name": "ball", "mass": 1, "position": [0, 5, 0]}],
    "forces": [{"type": "constant", "force": [0, 0, 1], "bodies": ["crate"]},
               {"type": "constant", "force": [0, 1, 0], "bodies": ["ball", "crate_1"]}]})");
  EXPECT_TRUE(run.body("crate_0").velocity.isApprox(Vec3(0, 0, 1), 1e-9));
  EXPECT_TRUE(run.body("crate_1").velocity.isApprox(Vec3(0, 1, 1), 1e-9));
  EXPECT_TRUE(run.body("crate_2").velocity.isApprox(Vec3(0, 0, 1), 1e-9));
  EXPECT_TRUE(run.body("ball").velocity.isApprox(Vec3(0, 1, 0), 1e-9));
}

TEST(Simulation, WindCarriesBodiesAlong) {
  const Simulated run(balls({0}, R"("forces": [{"type": "wind", "wind": [0, 0, 3], "drag": 1}])"));
  EXPECT_NEAR(run.body("body_0").velocity.z(), 3 * (1 - std::exp(-0.5)), 1e-6);
}

TEST(Simulation, AnExplosionThrowsByDistance) {
  // The impulse falls linearly from 6 N s to zero at 4 m; the nearest point of the ball is 1 m away.
  const Simulated run(balls({1.5, 20}, R"("forces": [
    {"type": "explosion", "time": 0.5, "point": [0, 0, 0], "impulse": 6, "radius": 4}])"));
  EXPECT_TRUE(run.body("body_0").velocity.isApprox(Vec3(6 * 0.75 / 2, 0, 0), 1e-9));
  EXPECT_EQ(run.body("body_1").velocity, Vec3(0, 0, 0));
}

TEST(Simulation, AGrabHoldsABodyByOnePoint) {
  const Simulated run(
      R"({"world": {"integrator": "implicit_euler"}, "bodies": [{"name": "box", "mass": 2, "angular_drag": 1}],
    "forces": [{"type": "grab", "body": "box", "point": [0, 0.5, 0], "stiffness": 400, "damping": 40,
                "keyframes": [{"time": 0, "position": [0, 0.5, 0]}, {"time": 2, "position": [3, 1.5, 0]}]}],
    "output": {"fps": 10, "duration": 8}})");
  EXPECT_TRUE(run.body("box").centre.isApprox(Vec3(3, 1 - 2 * kGravity / 400, 0), 1e-3));
}

TEST(Simulation, ASpringActsFromTheTimeAtWhichItsParticleAppears) {
  const Simulated run(
      R"({"particles": [{"name": "late", "mass": 1, "places": [{"position": [0, 1, 0]}], "appear_at": 0.5}],
    "springs": [{"a": {"position": [0, 2, 0]}, "b": {"particles": "late"}, "stiffness": 100}],
    "output": {"fps": 10, "duration": 1.1}})");
  const Real oscillation = std::cos(std::sqrt(100.0) * 0.5);
  EXPECT_NEAR(run.particle(0).y(), 1 - kGravity / 100 * (1 - oscillation), 1e-4);
}

// The cloth falls until the bar appears. From then on, the bar holds its edge where it is.
TEST(Simulation, PinsToABodyThatAppearsHoldTheClothWhereItIsThen) {
  const auto film = [](const std::string& duration) {
    return Simulated(
        R"({"bodies": [{"name": "bar", "motion": "static", "shape": {"type": "box", "size": [0.6, 0.05, 0.05]},
        "position": [0, 1.2, -0.3], "appear_at": 0.2, "collides": false}],
      "cloths": [{"fabric": "cotton", "position": [0, 1.2, 0], "shape": {"type": "grid", "size": [0.6, 0.6], "cells": [6, 6]},
        "pins": [{"type": "side", "side": "top", "body": "bar"}]}],
      "output": {"fps": 10, "duration": )" +
        duration + "}}");
  };
  const Simulated falling = film("0.25"), held = film("1");
  for (uint32_t vertex = 0; vertex < 7; ++vertex) {
    const Vec3 then = falling.cloth_point(vertex);
    EXPECT_LT(then.y(), 1.05);
    EXPECT_LT((held.cloth_point(vertex) - then).norm(), 1e-9) << vertex;
  }
  EXPECT_LT(held.totals().cloth.strain, 0.05);
}

TEST(Simulation, AConveyorAcceleratesBodiesToItsSpeed) {
  // With a friction coefficient of 0.2, the belt needs 0.76 s to accelerate the cube to 1.5 m/s.
  const std::string materials =
      R"("materials": [{"name": "floor", "friction": 0.2}, {"name": "cube", "friction": 0.2}])";
  const Simulated run(cube_on_floor(R"(, "surface_velocity": [0, 0, 1.5])", "", materials));
  EXPECT_NEAR(run.body("cube").velocity.z(), 1.5, 1e-3);
  const Real slid = 1.5 * 1.5 / (2 * 0.2 * kGravity);
  EXPECT_NEAR(run.body("cube").centre.z(), 1.5 * 2 - slid, 0.01);
}

TEST(Simulation, FrictionComesFromTheMaterialsOrTheirRule) {
  const std::string materials =
      R"("materials": [{"name": "floor", "friction": 0.8}, {"name": "cube", "friction": 0.2}])";
  const std::string slides = R"(, "velocity": [2, 0, 0])";
  EXPECT_NEAR(Simulated(cube_on_floor("", slides, materials)).body("cube").centre.x(), stopping_distance(0.4),
              5e-3);
  const std::string rule = R"(, "contacts": [{"materials": ["cube", "floor"], "friction": 0.25}])";
  EXPECT_NEAR(Simulated(cube_on_floor("", slides, materials + rule)).body("cube").centre.x(),
              stopping_distance(0.25), 5e-3);
  const std::string ice = R"(, "contacts": [{"materials": ["floor", "cube"], "friction": 0}])";
  EXPECT_NEAR(Simulated(cube_on_floor("", slides, materials + ice)).body("cube").centre.x(), 4, 5e-3);
}

TEST(Simulation, StickingContactsUseStaticFriction) {
  // A force of 0.45 of the weight: below the limit of static friction, above that of dynamic friction.
  const auto pushed = [](const std::string& more) {
    return Simulated(cube_on_floor("", "",
                                   R"("materials": [{"name": "floor", "friction": 0.3)" + more +
                                       R"(}, {"name": "cube", "friction": 0.3)" + more + R"(}],
      "world": {"solver": "exact"}, "forces": [{"type": "constant", "force": [4.4145, 0, 0], "start": 0.1}])"));
  };
  EXPECT_LT(pushed(R"(, "static_friction": 0.6)").body("cube").centre.x(), 1e-3);
  EXPECT_GT(pushed("").body("cube").centre.x(), 1);
}

TEST(Simulation, CrossFrictionActsAcrossTheFrictionAxis) {
  const std::string materials =
      R"("materials": [{"name": "floor", "friction": 0.4}, {"name": "cube", "friction": 0.4, "cross_friction": 0.1}])";
  const auto slid = [&](const std::string& velocity) {
    const Simulated run(
        cube_on_floor("", R"(, "friction_axis": [1, 0, 0], "velocity": )" + velocity, materials));
    return run.body("cube").centre;
  };
  EXPECT_NEAR(slid("[2, 0, 0]").x(), stopping_distance(0.4), 5e-3);
  EXPECT_NEAR(slid("[0, 0, 2]").z(), stopping_distance(0.2), 5e-3);  // the mean of 0.1 and 0.4
}

TEST(Simulation, ImpactLawsDifferInARowOfBalls) {
  const auto last = [](const std::string& law) {
    const Simulated run(R"({"world": {"gravity": [0, 0, 0], "impact": ")" + law + R"("},
      "materials": [{"name": "steel", "restitution": 1, "friction": 0}],
      "bodies": [{"name": "first", "shape": {"type": "sphere"}, "position": [-2, 0, 0], "velocity": [3, 0, 0],
                  "material": "steel"},
                 {"name": "middle", "shape": {"type": "sphere"}, "material": "steel"},
                 {"name": "last", "shape": {"type": "sphere"}, "position": [1, 0, 0], "material": "steel"}],
      "output": {"fps": 10, "duration": 1}})");
    return run.body("last").velocity.x();
  };
  EXPECT_NEAR(last("sequential"), 3, 1e-6);
  // solution of the complementarity problem with all three balls: -1, 2 and 2
  EXPECT_NEAR(last("simultaneous"), 2, 1e-6);
}

TEST(Simulation, BodiesThatMeetSlowlyDoNotBounce) {
  const auto top = [](const std::string& speed) {
    const Simulated run(R"({"world": {"collision_speed": )" + speed +
                        R"(}, "materials": [{"name": "rubber", "restitution": 1}],
      "bodies": [{"motion": "static", "shape": {"type": "plane"}, "material": "rubber"},
                 {"name": "ball", "shape": {"type": "sphere"}, "position": [0, 0.7, 0], "material": "rubber"}],
      "output": {"fps": 100, "duration": 0.41}})");  // the ball falls for 0.2 s
    return run.body("ball").centre.y();
  };
  EXPECT_NEAR(top("0.05"), 0.7, 0.01);
  EXPECT_NEAR(top("5"), 0.5, 0.01);
}

TEST(Simulation, TheSceneSelectsSolverAndSleep) {
  const std::string materials = R"("materials": [{"name": "floor"}, {"name": "cube"}], "world": )";
  const Simulated fast(cube_on_floor("", "", materials + R"({"solver": "fast"})"));
  EXPECT_EQ(fast.totals().solvers.exact.solves, 0u);
  EXPECT_GT(fast.totals().solvers.fast.solves, 0u);
  EXPECT_EQ(fast.totals().bodies.asleep, 1u);
  const Simulated exact(cube_on_floor("", "", materials + R"({"solver": "exact", "sleep": false})"));
  EXPECT_GT(exact.totals().solvers.exact.solves, 0u);
  EXPECT_EQ(exact.totals().solvers.fast.solves, 0u);
  EXPECT_EQ(exact.totals().bodies.asleep, 0u);
  EXPECT_EQ(exact.totals().contacts.points, 4u);
}

TEST(SceneBodies, OnlyBodiesWhoseShapeIsReadHaveACollisionMesh) {
  // Bodies, overlays, and whether body "a" needs its mesh.
  const auto has_mesh = [](const std::string& keys, const std::string& overlays) {
    LoadedScene loaded =
        parse_scene(R"({"bodies": [{"name": "a", "shape": {"type": "mesh", "file": "rock.glb"}, )" + keys +
                        R"(}, {"name": "b", "motion": "kinematic"}], "overlays": [)" + overlays + "]}",
                    "scene", OFFSTAGE_SOURCE_DIR);
    const ModelLibrary models(loaded.scene, loaded.folder, DecompositionCache(), loaded.warnings);
    const Simulation simulation(loaded.scene, models);
    bool found = false;
    simulation.world().for_each_body([&](sim::BodyHandle body) {
      const sim::BodyDef& def = simulation.world().body_def(body);
      if (def.name == "a") found = std::holds_alternative<sim::MeshShape>(def.shape);
    });
    return found;
  };
  const std::string idle = R"("motion": "static", "collides": false)";
  EXPECT_FALSE(has_mesh(idle, ""));
  EXPECT_FALSE(has_mesh(idle, R"({"type": "contacts"}, {"type": "islands"}, {"type": "text"})"));
  EXPECT_TRUE(has_mesh(R"("motion": "static")", ""));
  EXPECT_TRUE(has_mesh(R"("motion": "kinematic", "collides": false)", ""));
  EXPECT_TRUE(has_mesh(R"("collides": false)", ""));
  EXPECT_TRUE(has_mesh(idle, R"({"type": "tree", "body": "a"})"));
  EXPECT_TRUE(has_mesh(idle, R"({"type": "closest", "a": "a", "b": "b"})"));
  EXPECT_TRUE(has_mesh(idle, R"({"type": "contacts", "a": "b", "b": "a"})"));
}

}  // namespace
}  // namespace offstage::producer
