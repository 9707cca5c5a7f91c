/// Springs, drag and hands act on bodies that carry other bodies. These forces depend on the motion of the
/// body with its load, not on the path that it would take without it.

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "sim/world.h"
#include "validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kPlate_kg = 2, kLoad_kg = 6, kAll_kg = kPlate_kg + kLoad_kg, kGravity = 9.81;

class LoadedMotion : public BothSolvers {
 protected:
  struct Scene {
    World world;
    BodyHandle plate, load;
    Real height() const { return world.body(plate).pose.position.y(); }
    Real speed() const { return world.body(plate).velocity.y(); }
    Real gap() const { return world.body(load).pose.position.y() - height() - 0.12; }
  };
  /// Returns a plate at height y with a box on it.
  Scene scene(Real step, Real y, Real linear_drag = 0) const {
    Scene s{World(def(step)), {}, {}};
    s.plate = s.world.add_body({.shape = Box{{0.6, 0.04, 0.6}},
                                .pose = {Vec3(0, y, 0), Quat::Identity()},
                                .mass = kPlate_kg,
                                .linear_drag = linear_drag,
                                .restitution = 0});
    s.load = s.world.add_body({.shape = Box{{0.2, 0.2, 0.2}},
                               .pose = {Vec3(0, y + 0.12, 0), Quat::Identity()},
                               .mass = kLoad_kg,
                               .restitution = 0});
    return s;
  }
  static void guide(Scene& s) {
    s.world.add_joint({.type = JointType::prismatic, .a = s.plate, .axis = Vec3::UnitY()});
  }
  static void add_spring(Scene& s, Real stiffness, Real damping) {
    s.world.add_spring({.a = WorldPoint{{0, 2, 0}},
                        .b = BodyPoint{s.plate},
                        .stiffness = stiffness,
                        .damping = damping,
                        .rest_length = 1});
  }
};

TEST_P(LoadedMotion, ADampedSpringCarriesALoadAtTheHeightOfItsWeight) {
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const Real damping : {50.0, 100.0}) {
      Scene s = scene(step, 1);
      guide(s);
      add_spring(s, 2000, damping);
      run(s.world, 6, step);
      const Real sag = kAll_kg * kGravity / 2000;
      EXPECT_NEAR(1 - s.height(), sag, 2e-3 * sag) << damping << " N s/m, step " << step;
    }
}

TEST_P(LoadedMotion, ALoadOnASpringOscillatesWithTheMassOfBoth) {
  const Real stiffness = 2000, sag = kAll_kg * kGravity / stiffness, amplitude = 0.02;
  const Real frequency = std::sqrt(stiffness / kAll_kg), period = 2 * std::numbers::pi / frequency;
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    Scene s = scene(step, 1 - sag - amplitude);
    guide(s);
    add_spring(s, stiffness, 0);
    Real lowest = 1, highest = 0;
    for (Real time = 0; time < 5.5; time += step) {
      s.world.step(step);
      if (time < 5.5 - period) continue;
      lowest = std::min(lowest, s.height());
      highest = std::max(highest, s.height());
    }
    EXPECT_NEAR((lowest + highest) / 2, 1 - sag, 0.02 * amplitude) << step;
    EXPECT_NEAR((highest - lowest) / 2, amplitude, (step < 0.01 ? 0.01 : 0.08) * amplitude) << step;
  }
}

TEST_P(LoadedMotion, DragAndWindSlowALoadedPlateByTheSpeedOfBoth) {
  const Real drag = 50, time = 1;
  const Real speed = kAll_kg * kGravity / drag * (1 - std::exp(-drag * time / kAll_kg));
  for (const Real step : {1.0 / 240, 1.0 / 60})
    for (const bool is_wind : {false, true}) {
      Scene s = scene(step, 1, is_wind ? 0 : drag);
      if (is_wind) s.world.add_force({.bodies = {s.plate}, .effect = WindField{.drag = drag}});
      run(s.world, time, step);
      EXPECT_NEAR(-s.speed(), speed, 5e-3 * speed) << "step " << step << ", wind " << is_wind;
      EXPECT_NEAR(s.gap(), 0, 5e-4) << "step " << step << ", wind " << is_wind;
    }
}

TEST_P(LoadedMotion, AHandCarriesALoadAtTheHeightOfItsWeight) {
  for (const Real step : {1.0 / 240, 1.0 / 60}) {
    Scene s = scene(step, 1);
    guide(s);
    s.world.add_force(
        {.bodies = {s.plate},
         .effect = Grab{.track = {.keys = {{0, {Vec3(0, 1, 0)}}}}, .stiffness = 2000, .damping = 50}});
    run(s.world, 6, step);
    const Real sag = kAll_kg * kGravity / 2000;
    EXPECT_NEAR(1 - s.height(), sag, 2e-3 * sag) << step;
  }
}

OFFSTAGE_ALL_SOLVERS(Solvers, LoadedMotion);

}  // namespace
}  // namespace offstage::sim
