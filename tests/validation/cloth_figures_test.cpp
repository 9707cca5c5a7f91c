/// Statistics of cloth: loads compared with closed forms, the stretch limit under bodies, momentum, and
/// bodies that a cloth stops.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

constexpr Real kFiguresGravity = 9.81;

Quat turned(Real angle, const Vec3& axis) {
  return Quat(Eigen::AngleAxis<Real>(angle, axis));
}

/// A strip of 0.2 m x 1 m that hangs from its upper edge, with a body at its lower one; `strain`: strain at
/// the start.
struct HangingStrip {
  HangingStrip(const effects::Fabric& fabric, Real mass, Real strain, Real step, ClothIntegrator integrator)
      : world({.max_step = step}) {
    def = effects::grid_cloth({0.2, 1, 4, 20}, {Vec3::Zero(), turned(std::numbers::pi / 2, Vec3::UnitX())},
                              fabric);
    def.air.density = 0;
    def.collides = def.self_collision = false;
    def.integrator = integrator;
    def.rest_vertices = def.vertices;
    for (Vec3& p : def.vertices) p.y() = 0.5 - (1 + strain) * (0.5 - p.y());
    const Vec3 place(0, -0.5 - strain, 0);
    body = world.add_body({.shape = Box{{0.2, 0.02, 0.02}},
                           .pose = {place},
                           .mass = mass,
                           .linear_drag = mass,
                           .collides = false});
    for (uint32_t i = 0; i < def.vertices.size(); ++i) {
      const Vec3& p = def.vertices[i];
      if (def.rest_vertices[i].y() > 0.499) def.pins.push_back({.vertex = i, .position = p});
      if (def.rest_vertices[i].y() < -0.499)
        def.pins.push_back({.vertex = i, .body = body, .position = p - place});
    }
    cloth = world.add_cloth(def);
  }
  /// Returns the mean elongation of the strip over some seconds, relative to its rest length [m].
  Real mean_elongation(int seconds) {
    Real sum = 0;
    for (int i = 0; i < 60 * seconds; ++i) {
      world.step(1.0 / 60);
      sum -= 0.5 + world.body(body).pose.position.y();
    }
    return sum / (60 * seconds);
  }

  ClothDef def;
  World world;
  BodyHandle body;
  ClothHandle cloth;
};

/// Parameters: fabric, load as a fraction of the load at the stretch limit, step of the world [s].
class ClothUnderALoad : public testing::TestWithParam<std::tuple<std::string, Real, Real>> {};

TEST_P(ClothUnderALoad, StretchesByItsStiffness) {
  // The elongation is the fraction (load + half the weight of the strip) / (stiffness * width) of the length.
  const auto [name, fraction, step] = GetParam();
  const effects::Fabric fabric = effects::find_fabric(name)->fabric;
  const Real limit = fabric.max_stretch - 1;
  const Real mass = fraction * limit * fabric.stretch * 0.2 / kFiguresGravity;
  const Real expected = (mass + fabric.areal_density * 0.2 / 2) * kFiguresGravity / (fabric.stretch * 0.2);
  HangingStrip strip(fabric, mass, expected, step, ClothIntegrator::relaxed);
  EXPECT_NEAR(strip.mean_elongation(2), expected, 0.02 * expected);
  EXPECT_EQ(strip.world.cloth_report(strip.cloth).clamped, 0u);
}

INSTANTIATE_TEST_SUITE_P(Fabrics, ClothUnderALoad,
                         testing::Combine(testing::Values("silk", "cotton", "denim", "leather", "rubber"),
                                          testing::Values(0.3, 0.9), testing::Values(1.0 / 240, 1.0 / 60)));

/// Parameters: integrator, step of the world [s].
class StiffClothUnderALoad : public testing::TestWithParam<std::tuple<ClothIntegrator, Real>> {};

TEST_P(StiffClothUnderALoad, StretchesByItsStiffnessAtTheDefaultSubstep) {
  const auto [integrator, step] = GetParam();
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.stretch = 20000;
  fabric.areal_density = 0.3;
  fabric.max_stretch = 0;
  const Real expected = (2 + 0.03) * kFiguresGravity / (20000 * 0.2);
  HangingStrip strip(fabric, 2, 0, step, integrator);  // the body falls into the strip
  EXPECT_NEAR(strip.mean_elongation(1), expected, 0.02 * expected);
}

INSTANTIATE_TEST_SUITE_P(Integrators, StiffClothUnderALoad,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit),
                                          testing::Values(1.0 / 240, 1.0 / 60)));

class ClothLimit : public testing::TestWithParam<std::tuple<ClothIntegrator, Real>> {};

TEST_P(ClothLimit, HoldsUnderABodyThatWouldStretchItFurther) {
  const auto [integrator, mass] = GetParam();
  HangingStrip strip(effects::find_fabric("cotton")->fabric, mass, 0, 1.0 / 240, integrator);
  Real strain = 0;
  for (int i = 0; i < 120; ++i) {
    strip.world.step(1.0 / 60);
    strain = std::max(strain, strip.world.cloth_report(strip.cloth).max_strain);
  }
  EXPECT_LE(strain, 0.1 + 1e-9);
  // The body hangs at this height; it is neither held higher nor thrown back.
  EXPECT_NEAR(strip.world.body(strip.body).pose.position.y(), -0.6, 0.01);
  EXPECT_LT(strip.world.body(strip.body).velocity.norm(), 0.2);
}

INSTANTIATE_TEST_SUITE_P(Bodies, ClothLimit,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed,
                                                          ClothIntegrator::implicit),
                                          testing::Values(5, 20)));

Vec3 total_momentum(const World& world, BodyHandle body, ClothHandle cloth, const ClothDef& def) {
  Vec3 sum = world.body_def(body).mass * world.body(body).velocity;
  const ClothView view = world.cloth(cloth);
  for (std::size_t i = 0; i < view.points.size(); ++i) sum += def.masses[i] * view.velocities[i];
  return sum;
}

class ClothMomentum : public testing::TestWithParam<std::tuple<ClothIntegrator, int>> {};

TEST_P(ClothMomentum, IsKeptWhenABodyHitsAFreeCloth) {
  const auto [integrator, rate] = GetParam();
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.areal_density = 0.4;
  ClothDef def = effects::grid_cloth({1, 0.5, 12, 6}, {}, fabric);
  def.air.density = 0;
  def.integrator = integrator;
  if (largest_stable_step(def).step < def.substep) def.substep = 0.9 * largest_stable_step(def).step;
  World world({.gravity = Vec3::Zero(), .max_step = 1.0 / rate});
  const BodyHandle body = world.add_body(
      {.shape = Box{{0.2, 0.2, 0.2}}, .pose = {Vec3(0, 0.3, 0.05)}, .velocity = {0.3, -3, 0}, .mass = 0.5});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 24; ++i) {
    world.step(1.0 / 30);
    ASSERT_LT((total_momentum(world, body, cloth, def) - Vec3(0.15, -1.5, 0)).norm(), 1e-6) << i;
  }
  EXPECT_LT(world.body(body).velocity.norm(), 2.9);  // it did hit
}

INSTANTIATE_TEST_SUITE_P(Integrators, ClothMomentum,
                         testing::Combine(testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                                          ClothIntegrator::symplectic, ClothIntegrator::rk4),
                                          testing::Values(60, 240)));

TEST(ClothPins, LetTheClothWeighOnItsBody) {
  // A body throws a cloth that is pinned to it along one edge, and at rest at first.
  ClothDef def = effects::grid_cloth({0.5, 0.5, 8, 8}, {}, effects::find_fabric("denim")->fabric);
  def.air.density = 0;
  World world({.gravity = Vec3::Zero()});
  const BodyHandle body = world.add_body(
      {.shape = Box{{0.02, 0.02, 0.5}}, .pose = {Vec3(-0.26, 0, 0)}, .velocity = {-1, 2, 0}, .mass = 0.1});
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].x() < -0.249)
      def.pins.push_back({.vertex = i, .body = body, .position = def.vertices[i] - Vec3(-0.26, 0, 0)});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 30; ++i) {
    world.step(1.0 / 30);
    ASSERT_LT((total_momentum(world, body, cloth, def) - Vec3(-0.1, 0.2, 0)).norm(), 1e-9) << i;
  }
}

class ClothStops : public testing::TestWithParam<Real> {};

TEST_P(ClothStops, ABallThatFallsOnIt) {
  const Real speed = GetParam();
  ClothDef def =
      effects::grid_cloth({1.2, 1.2, 24, 24}, {Vec3(0, 1.2, 0)}, effects::find_fabric("denim")->fabric);
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (std::max(std::abs(def.vertices[i].x()), std::abs(def.vertices[i].z())) > 0.599)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  World world;
  const BodyHandle ball = world.add_body(
      {.shape = Sphere{0.1}, .pose = {Vec3(0.013, 1.7, 0.017)}, .velocity = {0, -speed, 0}, .mass = 1});
  const ClothHandle cloth = world.add_cloth(def);
  Real lowest = 2;
  for (int i = 0; i < 60; ++i) {
    world.step(1.0 / 240);
    lowest = std::min(lowest, world.body(ball).pose.position.y());
    // The sagging cloth adds less than 1 J to the energy of the ball.
    const BodyState state = world.body(ball);
    ASSERT_LE(state.velocity.squaredNorm() / 2 + kFiguresGravity * state.pose.position.y(),
              speed * speed / 2 + kFiguresGravity * 1.7 + 1);
    ASSERT_LE(world.cloth_report(cloth).max_strain, 0.1 + 1e-9);
  }
  // The sheet sags by at most a limit's worth of its half width: 0.6 sqrt(1.1^2 - 1) = 0.27 m.
  EXPECT_GT(lowest, 1.2 - 0.28);
  EXPECT_GT(world.body(ball).pose.position.y(), 1.2 - 0.28);
}

INSTANTIATE_TEST_SUITE_P(Speeds, ClothStops, testing::Values(10, 15, 20, 25));

class ClothHangs : public testing::TestWithParam<Shape> {};

TEST_P(ClothHangs, OverWhatIsThinnerThanItsCells) {
  ClothDef def =
      effects::grid_cloth({1.2, 1.2, 24, 24}, {Vec3(0, 1, 0)}, effects::find_fabric("cotton")->fabric);
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  world.add_body({.shape = GetParam(),
                  .motion = MotionType::static_body,
                  .pose = {Vec3(0.025, 0.9, 0.025), turned(std::numbers::pi / 2, Vec3::UnitZ())}});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 36; ++i) world.step(1.0 / 24);
  Real top = 0;
  for (const Vec3& p : world.cloth(cloth).points) top = std::max(top, p.y());
  EXPECT_GT(top, 0.89);
}

INSTANTIATE_TEST_SUITE_P(Shapes, ClothHangs,
                         testing::Values(Shape(Cylinder{0.02, 2}), Shape(Sphere{0.02}),
                                         Shape(Capsule{0.01, 2})));

/// Parameter: whether the sheet is sheared; false: it is stretched along its threads.
class ClothDamping : public testing::TestWithParam<bool> {};

TEST_P(ClothDamping, OfEachKindOfSpringIsItsFractionOfTheCriticalOne) {
  // Vertices of two cells have several masses. Each spring has the fraction of its kind.
  const bool sheared = GetParam();
  constexpr Real kZeta = 0.05, kOther = 0.8;
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.bend_model = effects::BendModel::springs;
  fabric.stretch_damping = sheared ? kOther : kZeta;
  fabric.shear_damping = sheared ? kZeta : kOther;
  fabric.bend_spring_damping = 0.3;
  const ClothDef def = effects::grid_cloth({0.2, 0.1, 2, 1}, {}, fabric);
  for (const ClothSpring& s : def.springs) {
    const Real ma = def.masses[s.a], mb = def.masses[s.b];
    const Real fraction = s.kind == SpringKind::bend                 ? 0.3
                          : (s.kind == SpringKind::shear) == sheared ? kZeta
                                                                     : kOther;
    EXPECT_NEAR(s.damping, 2 * fraction * std::sqrt(s.stiffness * ma * mb / (ma + mb)), 1e-12);
  }
  // Two points on a spring swing as q'' + 2 zeta omega q' + omega^2 q = 0.
  const ClothSpring& s =
      *std::ranges::find(def.springs, sheared ? SpringKind::shear : SpringKind::stretch, &ClothSpring::kind);
  ClothDef pair;
  pair.rest_vertices = {Vec3::Zero(), Vec3(s.rest_length, 0, 0)};
  pair.vertices = {Vec3::Zero(), Vec3(1.01 * s.rest_length, 0, 0)};
  pair.masses = {def.masses[s.a], def.masses[s.b]};
  pair.springs = {s};
  pair.springs[0].a = 0;
  pair.springs[0].b = 1;
  pair.springs[0].counterpart_rest = 0;
  pair.integrator = ClothIntegrator::rk4;
  const Real reduced = pair.masses[0] * pair.masses[1] / (pair.masses[0] + pair.masses[1]);
  const Real omega = std::sqrt(s.stiffness / reduced), period = 2 * std::numbers::pi / omega;
  pair.substep = period / 50;
  World world({.gravity = Vec3::Zero(), .max_step = pair.substep});
  const ClothHandle cloth = world.add_cloth(pair);
  for (int i = 0; i < 150; ++i) world.step(pair.substep);
  const Real left = (world.cloth(cloth).points[1] - world.cloth(cloth).points[0]).norm() - s.rest_length;
  const Real swings = omega * std::sqrt(1 - kZeta * kZeta) * 150 * pair.substep;
  const Real expected = 0.01 * s.rest_length * std::exp(-kZeta * omega * 150 * pair.substep) *
                        (std::cos(swings) + kZeta / std::sqrt(1 - kZeta * kZeta) * std::sin(swings));
  EXPECT_NEAR(left, expected, 0.01 * expected);
}

INSTANTIATE_TEST_SUITE_P(Kinds, ClothDamping, testing::Bool());

TEST(StiffCloth, ThatTouchesItselfStaysBoundedAndFinite) {
  effects::Fabric fabric = effects::find_fabric("cotton")->fabric;
  fabric.areal_density = 0.2;
  fabric.stretch = 2000;
  fabric.bend = 0.1;
  fabric.thickness = 0.004;
  fabric.max_stretch = 0;
  ClothDef def = effects::grid_cloth({0.4, 0.4, 24, 24}, {Vec3(0, 0.305, 0)}, fabric);
  def.air.density = 0;
  World world;
  world.add_body({.shape = Cylinder{0.09, 0.6}, .motion = MotionType::static_body});
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 15; ++i) ASSERT_TRUE(world.step(1.0 / 30).finite);
  // The cloth lies flat on the disc, which is half as wide, as a card would.
  Real lowest = 1;
  for (const Vec3& p : world.cloth(cloth).points) lowest = std::min(lowest, p.y());
  EXPECT_GT(lowest, 0.28);
}

}  // namespace
}  // namespace offstage::sim
