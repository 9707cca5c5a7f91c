/// Validation rows on particles that meet cloth: none passes it, and momentum is kept (physics F9).

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/geometry/intersection.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

ClothDef wide_cotton(Real size, uint32_t cells, const Vec3& place) {
  return effects::grid_cloth({size, size, cells, cells}, {place}, effects::find_fabric("cotton")->fabric);
}

/// Pins the border of a square grid of cells.
void pin_border(ClothDef& def, uint32_t cells) {
  for (uint32_t i = 0; i <= cells; ++i)
    for (uint32_t k : {i, cells * (cells + 1) + i, (cells + 1) * i, (cells + 1) * i + cells})
      def.pins.push_back({.vertex = k, .position = def.vertices[k]});
}

/// A value in [-1, 1) that depends on k only.
Real scatter(uint32_t k) {
  const Real x = std::sin(12.9898 * k) * 43758.5453;
  return 2 * (x - std::floor(x)) - 1;
}

struct Shower {
  Real step, speed, mass, radius;
};

/// Lets particles fall on a cloth 0.3 m above the ground, with births at any time within a sub-step, and
/// returns how many of them are below the cloth after a second.
int passed(const Shower& shower, bool pinned, bool internal) {
  World world({.max_step = shower.step});
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  constexpr uint32_t kCells = 20;
  ClothDef def = wide_cotton(1, kCells, {0, 0.3, 0});
  if (pinned) pin_border(def, kCells);
  const ClothHandle cloth = world.add_cloth(def);
  const ParticleSystemHandle drops = world.add_particle_system({.name = "drops", .internal = internal});
  uint32_t born = 0;
  for (int frame = 0; frame < 60; ++frame) {
    world.step(1.0 / 60, [&](Real start, Real end) {
      if (frame >= 30) return;
      for (int k = 0; k < 4; ++k, ++born)
        world.add_particle(drops,
                           {.position = {0.3 * scatter(3 * born), 0.55, 0.3 * scatter(3 * born + 1)},
                            .velocity = {0.02 * shower.speed * scatter(3 * born + 2), -shower.speed, 0},
                            .mass = shower.mass,
                            .radius = shower.radius},
                           (end - start) * (scatter(7 * born) + 1) / 2);
    });
  }
  const ClothView view = world.cloth(cloth);
  int below = 0;
  for (const Vec3& p : world.particles(drops).position) {
    const Vec3 up = p + Vec3(0, 5, 0), down = p - Vec3(0, 5, 0);
    bool above_any = false, below_any = false;
    for (const Triangle& t : view.triangles) {
      const TriangleVertices at{view.points[t[0]], view.points[t[1]], view.points[t[2]]};
      above_any |= segment_intersects_triangle(p, down, at);
      below_any |= segment_intersects_triangle(p, up, at);
    }
    below += below_any && !above_any;
  }
  return below;
}

TEST(ClothParticles, NonePassesCloth) {
  for (const Real step : {1.0 / 60, 1.0 / 240})
    for (const Shower& shower : {Shower{step, 0.5, 1e-5, 0.002}, Shower{step, 10, 1e-5, 0.002},
                                 Shower{step, 30, 1e-5, 0.002}, Shower{step, 30, 1e-3, 0.005}})
      for (const bool pinned : {true, false}) {
        if (!pinned && shower.mass > 1e-4) continue;  // it tears the free cloth aside
        for (const bool internal : {false, true})
          EXPECT_EQ(passed(shower, pinned, internal), 0)
              << "step " << step << " speed " << shower.speed << " mass " << shower.mass
              << (pinned ? " pinned" : " falling") << (internal ? " internal" : "");
      }
}

/// A particle that meets a free triangle of three points in its middle, without friction, has the speed of a
/// collision with a body of the triangle's mass.
TEST(ClothParticles, MeetATriangleAsABodyOfItsMass) {
  for (const Real step : {1.0 / 60, 1.0 / 240}) {
    World world({.gravity = Vec3::Zero(), .max_step = step});
    ClothDef def;
    def.vertices = {{-0.1, 0, 0.1}, {0.1, 0, 0.1}, {0, 0, -0.2}};
    def.triangles = {{0, 1, 2}};
    def.springs = {{.a = 0, .b = 1, .rest_length = 0.2}};
    def.masses = {0.01, 0.01, 0.01};
    def.air.density = 0;
    const ClothHandle cloth = world.add_cloth(def);
    const ParticleSystemHandle shot = world.add_particle_system({.name = "shot"});
    constexpr Real kMass = 0.01, kSpeed = 20, kRestitution = 0.5;
    world.add_particle(shot, {.position = {0, 0.5, 0},
                              .velocity = {0, -kSpeed, 0},
                              .mass = kMass,
                              .radius = 0.004,
                              .restitution = kRestitution});
    for (int i = 0; i < 3; ++i) world.step(1.0 / 60);
    // u1' = u1 - (1 + e) m2 / (m1 + m2) u1
    EXPECT_NEAR(world.particles(shot).velocity[0].y(), -kSpeed * (1 - (1 + kRestitution) * 0.03 / 0.04),
                1e-9);
    for (const Vec3& v : world.cloth(cloth).velocities)
      EXPECT_NEAR(v.y(), -kSpeed * (1 + kRestitution) * kMass / 0.04, 1e-9);
  }
}

/// A cloth of 0.4 m, some or all points of which are pinned to a plate of 0.2 kg behind it, in free flight.
struct ClothOnPlate {
  World world{{.gravity = Vec3::Zero(), .max_step = 1.0 / 240, .sleep = false}};
  BodyHandle plate;
  ClothHandle cloth;
  ParticleSystemHandle shot;
  std::vector<Real> masses;
  Real mass = 0.2;

  ClothOnPlate(bool whole, bool internal) {
    constexpr uint32_t kCells = 8;
    plate = world.add_body(
        {.shape = Box{{0.3, 0.02, 0.2}}, .pose = {Vec3(0.1, -0.1, 0)}, .mass = mass, .collides = false});
    ClothDef def = wide_cotton(0.4, kCells, {0, 0, 0});
    def.air.density = 0;
    for (uint32_t k = 0; k < def.vertices.size(); ++k)
      if (whole || def.vertices[k].x() < -0.05)
        def.pins.push_back({.vertex = k, .body = plate, .position = def.vertices[k] - Vec3(0.1, -0.1, 0)});
    masses = def.masses;
    cloth = world.add_cloth(def);
    shot = world.add_particle_system({.name = "shot", .internal = internal});
  }
  void add_shot(const Vec3& place, const Vec3& velocity) {
    world.add_particle(shot, {.position = place,
                              .velocity = velocity,
                              .mass = 2e-3,
                              .radius = 0.004,
                              .restitution = 0.4,
                              .friction = 0.5});
  }
  Vec3 momentum() const {
    Vec3 sum = mass * world.body(plate).velocity;
    const ClothView view = world.cloth(cloth);
    for (std::size_t i = 0; i < masses.size(); ++i) sum += masses[i] * view.velocities[i];
    for (const Vec3& v : world.particles(shot).velocity) sum += 2e-3 * v;
    return sum;
  }
};

/// Hits on points that are pinned to a free body push the body.
TEST(ClothParticles, PushTheBodyThatHoldsTheCloth) {
  for (const bool whole : {true, false})
    for (const bool internal : {false, true}) {
      ClothOnPlate scene(whole, internal);
      for (int i = 0; i < 40; ++i)
        scene.add_shot({0.15 * scatter(2 * i), 0.1 + 0.02 * i, 0.15 * scatter(2 * i + 1)}, {1, -5, 0.5});
      const Vec3 before = scene.momentum();
      for (int i = 0; i < 60; ++i) scene.world.step(1.0 / 60);
      EXPECT_LT((scene.momentum() - before).norm(), 1e-6 * before.norm())
          << "all points pinned: " << whole << " internal: " << internal << " "
          << scene.momentum().transpose() << " before " << before.transpose();
      EXPECT_LT(scene.world.body(scene.plate).velocity.y(), -0.3);
    }
}

/// Cloth stops particles before they reach the light body behind it, also if both are on the way of a single
/// sub-step.
TEST(ClothParticles, DoNotPushABodyBehindCloth) {
  World world({.gravity = Vec3::Zero(), .max_step = 1.0 / 60});
  constexpr uint32_t kCells = 8;
  ClothDef def = wide_cotton(0.4, kCells, {0, 0, 0});
  for (uint32_t k = 0; k < def.vertices.size(); ++k)
    def.pins.push_back({.vertex = k, .position = def.vertices[k]});
  world.add_cloth(def);
  const BodyHandle plate =
      world.add_body({.shape = Box{{0.4, 0.02, 0.4}}, .pose = {Vec3(0, -0.04, 0)}, .mass = 0.01});
  const ParticleSystemHandle shot = world.add_particle_system({.name = "shot"});
  for (uint32_t i = 0; i < 40; ++i)
    world.add_particle(shot, {.position = {0.15 * scatter(2 * i), 0.05 + 0.01 * i, 0.15 * scatter(2 * i + 1)},
                              .velocity = {0, -20, 0},
                              .mass = 2e-3,
                              .radius = 0.004,
                              .restitution = 0.4});
  for (int i = 0; i < 4; ++i) world.step(1.0 / 60);
  EXPECT_EQ(world.body(plate).velocity.norm(), 0);
  for (const Vec3& p : world.particles(shot).position) EXPECT_GT(p.y(), 0);
}

/// The body moves as its joint permits, with the mass of the cloth that is pinned to it.
TEST(ClothParticles, PushAJointedBodyThatHoldsTheCloth) {
  for (const bool internal : {false, true}) {
    ClothOnPlate scene(true, internal);
    scene.world.add_joint(
        {.name = "rail", .type = JointType::prismatic, .a = scene.plate, .axis = Vec3::UnitY()});
    scene.add_shot({-0.12, 0.1, 0.05}, {0, -5, 0});
    for (int i = 0; i < 10; ++i) scene.world.step(1.0 / 60);
    Real whole = scene.mass;
    for (const Real m : scene.masses) whole += m;
    // m2 u2' = m12 (1 + e) u1
    const Vec3 v = scene.world.body(scene.plate).velocity;
    EXPECT_NEAR(v.y(), -1.4 * 5 * 2e-3 / (2e-3 + whole), 1e-6) << internal;
    EXPECT_LT(std::hypot(v.x(), v.z()), 1e-9);
    EXPECT_LT(scene.world.body(scene.plate).angular_velocity.norm(), 1e-9);
  }
}

/// Particles that lie on a pinned cloth stay on it. They vibrate by up to g h^2, because each side sees the
/// impulses of the other one only in the next sub-step.
TEST(ClothParticles, RestOnAPinnedCloth) {
  World world;
  constexpr uint32_t kCells = 20;
  ClothDef def = wide_cotton(1, kCells, {0, 0.3, 0});
  pin_border(def, kCells);
  world.add_cloth(def);
  const ParticleSystemHandle beads = world.add_particle_system({.name = "beads"});
  for (uint32_t k = 0; k < 50; ++k)
    world.add_particle(beads, {.position = {0.3 * scatter(2 * k), 0.32, 0.3 * scatter(2 * k + 1)},
                               .mass = 1e-3,
                               .radius = 0.005,
                               .friction = 1});
  for (int i = 0; i < 120; ++i) world.step(1.0 / 60);
  for (const Vec3& v : world.particles(beads).velocity) EXPECT_LT(v.norm(), 0.1);
  for (const Vec3& p : world.particles(beads).position) {
    EXPECT_GT(p.y(), 0.2);
    EXPECT_LT(p.y(), 0.32);
  }
}

}  // namespace
}  // namespace offstage::sim
