/// Validation rows on cloth: with bodies, in both directions, and with itself.

#include "effects/cloth.h"

#include <cmath>

#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "cloth_crossings.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

Real speed(const ClothView& cloth) {
  Real sum = 0;
  for (const Vec3& v : cloth.velocities) sum += v.squaredNorm();
  return std::sqrt(sum / static_cast<Real>(cloth.velocities.size()));
}

ClothDef sheet(Real size, uint32_t cells, const Vec3& place) {
  return effects::grid_cloth({size, size, cells, cells}, {place}, effects::find_fabric("cotton")->fabric);
}

/// Drops a cloth for some seconds; nothing may be inside of a body or cross itself at any frame.
void drop_cloth(World& world, ClothHandle cloth, int frames) {
  for (int i = 0; i < frames; ++i) {
    const StepReport report = world.step(1.0 / 24);
    ASSERT_TRUE(report.finite);
    ASSERT_EQ(report.cloth.penetration, 0);
    ASSERT_EQ(report.cloth.crossings, 0u);
    ASSERT_EQ(crossings(world.cloth(cloth)), 0u);
  }
}

TEST(ClothValidation, ComesToRestOnASphere) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  world.add_body({.shape = Sphere{0.5}, .motion = MotionType::static_body, .pose = {{0, 0.5, 0}}});
  const ClothHandle cloth = world.add_cloth(sheet(1.6, 24, {0.05, 1.1, 0}));
  drop_cloth(world, cloth, 120);
  EXPECT_LT(speed(world.cloth(cloth)), 0.1);
}

TEST(ClothValidation, ComesToRestOnTheEdgeOfABox) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  world.add_body({.shape = Box{{1, 0.5, 1}}, .motion = MotionType::static_body, .pose = {{0, 0.25, 0}}});
  const ClothHandle cloth = world.add_cloth(sheet(1.2, 24, {0.5, 0.7, 0}));
  drop_cloth(world, cloth, 120);
  EXPECT_LT(speed(world.cloth(cloth)), 0.1);
}

TEST(ClothValidation, ADishRestsOnAClothOnATable) {
  World world;
  world.add_body({.shape = Box{{1, 0.5, 1}}, .motion = MotionType::static_body, .pose = {{0, 0.25, 0}}});
  const ClothHandle cloth = world.add_cloth(sheet(0.8, 24, {0, 0.51, 0}));
  const BodyHandle dish =
      world.add_body({.shape = Cylinder{0.12, 0.05}, .pose = {{0, 0.55, 0}}, .mass = 0.4});
  drop_cloth(world, cloth, 72);
  const Vec3 place = world.body(dish).centre;
  drop_cloth(world, cloth, 24);
  EXPECT_LT((world.body(dish).centre - place).norm(), 1e-3);  // it creeps by less than 1 mm in a second
  // The dish lies two thicknesses above the table, less the overlap that holds it.
  EXPECT_NEAR(place.y(), 0.5 + 0.025 + 2 * world.cloth_def(cloth).thickness, 2e-3);
}

TEST(ClothValidation, ExchangesMomentumWithABody) {
  World world({.gravity = Vec3::Zero()});
  ClothDef def = sheet(0.6, 16, Vec3::Zero());
  def.air.density = 0;
  const ClothHandle cloth = world.add_cloth(def);
  const BodyHandle ball =
      world.add_body({.shape = Sphere{0.1}, .pose = {{0, 0.3, 0}}, .velocity = {0, -2, 0}, .mass = 0.5});
  const auto momentum = [&] {
    Vec3 sum = 0.5 * world.body(ball).velocity;
    const ClothView view = world.cloth(cloth);
    for (std::size_t i = 0; i < view.points.size(); ++i) sum += def.masses[i] * view.velocities[i];
    return sum;
  };
  for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
  EXPECT_LT(world.body(ball).velocity.norm(), 1.99);
  // Removing overlaps does not change velocities; this is the energy lost here.
  EXPECT_NEAR((momentum() - Vec3(0, -1, 0)).norm(), 0, 0.02);
}

Vec3 cloth_momentum(const ClothDef& def, const ClothView& view) {
  Vec3 sum = Vec3::Zero();
  for (std::size_t i = 0; i < view.points.size(); ++i) sum += def.masses[i] * view.velocities[i];
  return sum;
}

TEST(ClothValidation, AnExplosionGivesEachPointItsShareByMass) {
  World world({.gravity = Vec3::Zero()});
  ClothDef def = sheet(0.6, 12, {0, 1, 0});
  def.air.density = 0;
  const ClothHandle cloth = world.add_cloth(def);
  const Explosion blast{.point = {0.1, 0.5, 0}, .impulse = 0.2, .radius = 3};
  world.add_force({.effect = blast});
  Vec3 expected = Vec3::Zero();
  Real total = 0;
  for (Real m : def.masses) total += m;
  for (std::size_t i = 0; i < def.vertices.size(); ++i)
    expected += def.masses[i] / total * impulse(blast, def.vertices[i]);
  for (int i = 0; i < 6; ++i) world.step(1.0 / 24);
  EXPECT_GT(expected.y(), 0.1);
  EXPECT_LT((cloth_momentum(def, world.cloth(cloth)) - expected).norm(), 1e-9 + 1e-3 * expected.norm());
}

TEST(ClothValidation, ParticlesBounceOffClothAndPushIt) {
  World world({.gravity = Vec3::Zero()});
  ClothDef def = sheet(0.6, 12, Vec3::Zero());
  def.air.density = 0;
  def.max_stretch = 0;  // shortened moves lose momentum
  def.self_collision = false;
  const ClothHandle cloth = world.add_cloth(def);
  const ParticleSystemHandle grains = world.add_particle_system({.name = "grains"});
  constexpr Real kMass = 0.002, kSpeed = 5;
  for (int i = 0; i < 40; ++i)
    world.add_particle(grains, {.position = {0.011 * i - 0.22, 0.1 + 0.005 * i, 0.007 * i - 0.13},
                                .velocity = {0, -kSpeed, 0},
                                .mass = kMass,
                                .radius = 0.004,
                                .friction = 0});
  for (int i = 0; i < 3; ++i) world.step(1.0 / 24);
  const ParticleArrays& p = world.particles(grains);
  Vec3 sum = cloth_momentum(def, world.cloth(cloth));
  for (std::size_t i = 0; i < p.size(); ++i) {
    sum += p.mass[i] * p.velocity[i];
    EXPECT_GT(p.velocity[i].y(), -0.99 * kSpeed) << i;
  }
  EXPECT_LT((sum - Vec3(0, -kSpeed * 40 * kMass, 0)).norm(), 1e-9);
}

TEST(ClothValidation, AFastBallDoesNotGoThroughAPinnedCloth) {
  World world;
  ClothDef def = sheet(1, 24, {0, 1, 0});
  for (uint32_t i = 0; i <= 24; ++i)
    for (uint32_t k : {i, 24 * 25 + i, 25 * i, 25 * i + 24})
      def.pins.push_back({.vertex = k, .position = def.vertices[k]});
  const ClothHandle cloth = world.add_cloth(def);
  const BodyHandle ball =
      world.add_body({.shape = Sphere{0.12}, .pose = {{0, 1.3, 0}}, .velocity = {0, -15, 0}, .mass = 3});
  for (int i = 0; i < 48; ++i) {
    EXPECT_LT(world.step(1.0 / 24).cloth.penetration, 2 * def.thickness) << i;
    ASSERT_GT(world.body(ball).centre.y(), 0.2) << i;
  }
  EXPECT_EQ(crossings(world.cloth(cloth)), 0u);
}

TEST(ClothValidation, NoCornerOfABoxPokesThroughACoarseCloth) {
  World world;
  world.add_body({.shape = Plane{}, .motion = MotionType::static_body});
  const Vec3 centre(0.03, 0.2, 0.02);
  world.add_body({.shape = Box{{0.4, 0.4, 0.4}}, .motion = MotionType::static_body, .pose = {centre}});
  const ClothHandle cloth = world.add_cloth(sheet(1.4, 12, {0, 0.45, 0}));
  drop_cloth(world, cloth, 72);
  const ClothView view = world.cloth(cloth);
  for (Real x : {-0.2, 0.2})
    for (Real z : {-0.2, 0.2})
      for (const Triangle& t : view.triangles)
        ASSERT_FALSE(segment_intersects_triangle(centre, centre + Vec3(x, 0.2, z),
                                                 {view.points[t[0]], view.points[t[1]], view.points[t[2]]}));
}

TEST(ClothValidation, HangsEquallyFarForAnyNumberOfCells) {
  Real sag[2];
  for (uint32_t k : {0u, 1u}) {
    World world;
    const uint32_t cells = k == 0 ? 10 : 20;
    ClothDef def = sheet(1, cells, {0, 1, 0});
    for (uint32_t i = 0; i <= cells; ++i)
      for (uint32_t v : {i, cells * (cells + 1) + i})
        def.pins.push_back({.vertex = v, .position = Vec3(1, 1, 0.97).cwiseProduct(def.vertices[v])});
    const ClothHandle cloth = world.add_cloth(def);
    for (int i = 0; i < 96; ++i) world.step(1.0 / 24);
    Real low = 1;
    for (const Vec3& p : world.cloth(cloth).points) low = std::min(low, p.y());
    sag[k] = 1 - low;
  }
  EXPECT_NEAR(sag[1] / sag[0], 1, 0.05);
}

TEST(ClothValidation, IsTheSameBitsForAnyNumberOfThreads) {
  StateHash hashes[2];
  for (std::size_t threads : {1, 2}) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    World world;
    world.add_body({.shape = Sphere{0.5}, .motion = MotionType::static_body, .pose = {{0, 0.5, 0}}});
    world.add_cloth(sheet(2, 48, {0, 1.05, 0}));
    for (int i = 0; i < 24; ++i) world.step(1.0 / 24);
    hashes[threads - 1] = world.state_hash();
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

}  // namespace
}  // namespace offstage::sim
