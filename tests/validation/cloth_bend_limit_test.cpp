/// The smallest radius to which a cloth bends, against closed forms and invariants.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "random.h"
#include "sim/cloth/cloth_system.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

using effects::BendModel;

effects::Fabric limp(BendModel model, Real radius) {
  effects::Fabric f = effects::find_fabric("cotton")->fabric;
  f.areal_density = 0.2;
  f.stretch = 3000;
  f.shear = 300;
  f.bend = 1e-6;
  f.bend_model = model;
  f.max_stretch = 0;
  f.min_bend_radius = radius;
  return f;
}

/// Sets the integrator. Explicit integrators get softer springs and shorter steps, without which they are
/// unstable.
void make_stable(ClothDef& def, ClothIntegrator integrator) {
  def.integrator = integrator;
  if (integrator != ClothIntegrator::symplectic && integrator != ClothIntegrator::rk4) return;
  for (ClothSpring& s : def.springs) s.stiffness /= 100;
  def.substep = 1.0 / 6000;
  ASSERT_GT(largest_stable_step(def).step, def.substep);
}

/// Returns a strip along x of cells of the given size, four wide.
ClothDef bend_strip(BendModel model, Real radius, Real length, Real cell) {
  const auto cells = static_cast<uint32_t>(std::lround(length / cell));
  ClothDef def = effects::grid_cloth({length, 4 * cell, cells, 4}, {}, limp(model, radius));
  def.self_collision = def.collides = false;
  def.air.density = 0;
  return def;
}

/// Energy (including the springs), momentum and angular momentum of a cloth.
struct Motion {
  Real energy = 0;
  Vec3 momentum = Vec3::Zero(), spin = Vec3::Zero();
};
Motion motion_of(const Cloth& cloth) {
  Motion sum;
  sum.energy = elastic_energy(cloth);
  for (std::size_t i = 0; i < cloth.points.size(); ++i) {
    const Vec3 p = cloth.masses[i] * cloth.velocities[i];
    sum.energy += p.dot(cloth.velocities[i]) / 2;
    sum.momentum += p;
    sum.spin += cloth.points[i].cross(p);
  }
  return sum;
}

class ClothBendLimit : public testing::TestWithParam<std::tuple<BendModel, ClothIntegrator>> {};

TEST_P(ClothBendLimit, AClampedLimpStripTurnsDownOnAQuarterCircle) {
  // The weight of the strip bends it to the limit, from horizontal to vertical. Its lower part is straight.
  const auto [model, integrator] = GetParam();
  constexpr Real kLength = 0.2, kCell = 0.01, kArcRadius = 0.05;
  constexpr Real kWithin = 0.75 * kCell;  // the ends of the arc lie within cells
  ClothDef def = bend_strip(model, kArcRadius, kLength, kCell);
  make_stable(def, integrator);
  def.air.density = 40;  // dense air brings the strip to rest
  const Real edge = def.vertices[0].x();
  for (uint32_t i = 0; i < def.vertices.size(); ++i)
    if (def.vertices[i].x() < edge + 1.5 * kCell)
      def.pins.push_back({.vertex = i, .position = def.vertices[i]});
  World world;
  const ClothHandle cloth = world.add_cloth(def);
  for (int i = 0; i < 60; ++i) world.step(1.0 / 24);
  const ClothView view = world.cloth(cloth);
  const Real clamp = edge + kCell, arc = kArcRadius * std::numbers::pi / 2;
  for (uint32_t i = 0; i < def.vertices.size(); ++i) {
    const Real s = def.vertices[i].x() - clamp;
    const Real angle = std::clamp(s / kArcRadius, 0.0, std::numbers::pi / 2);
    const Real x = clamp + kArcRadius * std::sin(angle) + std::min(s, 0.0);
    const Real y = -kArcRadius * (1 - std::cos(angle)) - std::max(s - arc, 0.0);
    EXPECT_NEAR(view.points[i].x(), x, kWithin) << "at " << s;
    EXPECT_NEAR(view.points[i].y(), y, kWithin) << "at " << s;
  }
  EXPECT_LT(world.cloth_report(cloth).max_bend, 1.05);
  EXPECT_GT(world.cloth_report(cloth).bend_limited, 0u);
}

TEST_P(ClothBendLimit, KeepsMomentumAndTakesEnergy) {
  // The ends of a strip are thrown together.
  const auto [model, integrator] = GetParam();
  // The implicit integrator does not conserve angular momentum. The corrections of the limit do; see below.
  const Real spin_tolerance = integrator == ClothIntegrator::implicit ? kInfinity : 0.02;
  ClothDef def = bend_strip(model, 0.05, 0.2, 0.01);
  make_stable(def, integrator);
  Cloth cloth({}, def);
  for (std::size_t i = 0; i < cloth.points.size(); ++i) {
    const Real x = cloth.points[i].x();
    cloth.velocities[i] = Vec3(0.2, 8 * std::abs(x), 3 * x);
  }
  ClothSystem system;
  system.assign({&cloth});
  const Motion start = motion_of(cloth);
  Real greatest = 0;  // energy
  ClothWeather weather{0, 1.0 / 960, Vec3::Zero(), Vec3::Zero(), {}};
  for (int i = 0; i < 360; ++i, weather.time += weather.h) {
    system.step(weather, {});
    system.measure();
    const Motion now = motion_of(cloth);
    ASSERT_LT((now.momentum - start.momentum).norm(), 1e-9 * start.momentum.norm());
    ASSERT_LT((now.spin - start.spin).norm(), spin_tolerance * start.spin.norm());
    ASSERT_LT(cloth.report.max_bend, 1.02);
    greatest = std::max(greatest, now.energy);
  }
  EXPECT_GT(cloth.report.bend_limited, 0u);
  EXPECT_LT(motion_of(cloth).energy, start.energy);
  EXPECT_LT(greatest, 1.02 * start.energy);
}

INSTANTIATE_TEST_SUITE_P(Models, ClothBendLimit,
                         testing::Combine(testing::Values(BendModel::plate, BendModel::springs),
                                          testing::Values(ClothIntegrator::relaxed, ClothIntegrator::implicit,
                                                          ClothIntegrator::symplectic,
                                                          ClothIntegrator::rk4)));

/// A crumpled cloth whose points have all kinds of masses.
struct Crumpled {
  explicit Crumpled(const ClothDef& def) {
    const Scatter scatter{3};
    for (uint32_t i = 0; i < def.vertices.size(); ++i) {
      const Vec3 p = def.vertices[i];
      const Vec3 shift(scatter.uniform(i, 0), scatter.uniform(i, 1), scatter.uniform(i, 2));
      points.start.push_back(padded(p));
      points.position.push_back(padded(p + 0.01 * shift));
      points.mass.push_back(0.5 + scatter.uniform(i, 3));
      points.inverse_mass.push_back(1 / points.mass.back());
    }
    points.pin_impulse.assign(points.size(), Vec4::Zero());
    kick.assign(points.size(), Vec4::Zero());
    bending.assign(def.vertices, def.triangles, points.mass, 0, 0, 1, true);
  }
  ClothPoints points;
  std::vector<Vec4> kick;
  ClothBending bending;
};

TEST(ClothBendLimits, KeepMomentumAndAngularMomentumToRounding) {
  const ClothDef flat = bend_strip(BendModel::springs, 0.1, 0.1, 0.01);
  const ClothDef curved = effects::sphere_cloth(0.1, 3, {}, limp(BendModel::springs, 0.1));
  for (const ClothDef* def : {&flat, &curved}) {
    Crumpled crumpled(*def);
    ClothPoints& points = crumpled.points;
    const std::vector<Vec4> before = points.position;
    BendLimit limit(0, 0, points.size(), crumpled.bending, 0.1);
    std::vector<VelocityCut> cuts;
    const Real bent = limit.greatest(points);
    ASSERT_TRUE(limit.project(points, 0.001, crumpled.kick, cuts));
    EXPECT_LT(limit.greatest(points), bent / 2);
    Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
    Real size = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 p = points.mass[i] * (points.position[i] - before[i]).head<3>();
      sum += p;
      moment += points.at(i).cross(p);
      size += p.norm();
    }
    EXPECT_GT(size, 1e-3);
    EXPECT_LT(sum.norm(), 1e-12 * size);
    EXPECT_LT(moment.norm(), 1e-12 * size);
  }
}

TEST(ClothBendLimits, ChangeNothingWhereTheyAreNotReached) {
  std::vector<Vec3> with, without;
  for (auto* points : {&with, &without}) {
    ClothDef def = bend_strip(BendModel::plate, points == &with ? 0.02 : 0, 0.2, 0.02);
    def.bend = 0.01;
    for (uint32_t i = 0; i < 2; ++i) def.pins.push_back({.vertex = i, .position = def.vertices[i]});
    World world;
    const ClothHandle cloth = world.add_cloth(def);
    for (int i = 0; i < 12; ++i) world.step(1.0 / 24);
    EXPECT_EQ(world.cloth_report(cloth).bend_limited, 0u);
    const auto view = world.cloth(cloth).points;
    points->assign(view.begin(), view.end());
  }
  EXPECT_EQ(with, without);
}

}  // namespace
}  // namespace offstage::sim
