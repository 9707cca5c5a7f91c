/// Grains that flow out of a silo (physics P9).

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "sim/geometry/solid_mesh.h"
#include "sim/world.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

constexpr Real kGrain = 0.01, kGrainDensity = 2500;  // diameter [m], [kg/m^3]
constexpr Real kGrainMass = kGrainDensity * std::numbers::pi / 6 * kGrain * kGrain * kGrain;
constexpr Real kPlate = 0.002;                              // thickness of the floor [m]
constexpr Real kSiloStep = 1.0 / 480, kSiloFriction = 0.3;  // friction of glass beads

struct Silo {
  Real orifice;  ///< diameter of the hole in the floor [m]
  Real width;    ///< width of the square silo [m]
  int layers;    ///< number of layers of grains that fall in
};

struct Discharge {
  Real rate = 0;  ///< [kg/s]
  /// Mass of the grains divided by the volume that they fill in the silo, including the voids at its walls
  /// [kg/m^3].
  Real bulk_density = 0;
  Real fill = 0;  ///< height of the grains at rest [m]

  /// Returns the discharge rate by Beverloo, Leniger and van de Velde (1961) [kg/s], with C = 0.58 and k =
  /// 1.4 for spheres.
  Real expected(Real orifice) const {
    return 0.58 * bulk_density * std::sqrt(9.81) * std::pow(orifice - 1.4 * kGrain, 2.5);
  }
};

class SiloRun {
 public:
  explicit SiloRun(const Silo& silo);

  Discharge run();

 private:
  BodyHandle add_wall(const Vec3& position, const Vec3& size);
  void pour();
  std::size_t inside() const;

  Silo silo_;
  World world_;
  ParticleSystemHandle grains_;
  BodyHandle door_;
};

SiloRun::SiloRun(const Silo& silo)
    : silo_(silo), world_({.max_step = kSiloStep, .bounds = Aabb(Vec3(-2, -0.2, -2), Vec3(2, 5, 2))}) {
  const Real w = silo.width, tall = 3;
  for (int axis : {0, 2})
    for (Real side : {-1.0, 1.0}) {
      Vec3 size(w + 0.2, tall, w + 0.2);
      size[axis] = 0.1;
      add_wall(Vec3(0, tall / 2, 0) + side * (w / 2 + 0.05) * Vec3::Unit(axis), size);
    }
  const SolidMesh floor = solid_mesh(Tube{.radius = w, .height = kPlate, .thickness = w - silo.orifice / 2});
  world_.add_body({.shape = MeshShape{world_.add_mesh(floor.mesh)},
                   .motion = MotionType::static_body,
                   .pose = {Vec3(0, -kPlate / 2, 0), Quat::Identity()},
                   .restitution = 0.3,
                   .friction = kSiloFriction});
  door_ = add_wall(Vec3(0, -kPlate - 0.01, 0), Vec3(2 * silo.orifice, 0.02, 2 * silo.orifice));
  pour();
}

BodyHandle SiloRun::add_wall(const Vec3& position, const Vec3& size) {
  return world_.add_body({.shape = Box{size},
                          .motion = MotionType::static_body,
                          .pose = {position, Quat::Identity()},
                          .restitution = 0.3,
                          .friction = kSiloFriction});
}

void SiloRun::pour() {
  grains_ = world_.add_particle_system({.internal = true, .rotates = true});
  const Scatter scatter{5};
  const Real pitch = 1.15 * kGrain;
  const int row = static_cast<int>(silo_.width / pitch);
  for (int layer = 0; layer < silo_.layers; ++layer)
    for (int i = 0; i < row; ++i)
      for (int j = 0; j < row; ++j) {
        const auto id = world_.particles(grains_).size();
        const Vec3 shift(scatter.uniform(id, 0) - 0.5, scatter.uniform(id, 1) - 0.5,
                         scatter.uniform(id, 2) - 0.5);
        world_.add_particle(grains_, {.position = Vec3((i + 0.5 - row / 2.0) * pitch, (layer + 0.6) * pitch,
                                                       (j + 0.5 - row / 2.0) * pitch) +
                                                  0.14 * kGrain * shift,
                                      .mass = kGrainMass,
                                      .radius = kGrain / 2,
                                      .restitution = 0.3,
                                      .friction = kSiloFriction});
      }
}

std::size_t SiloRun::inside() const {
  return static_cast<std::size_t>(std::ranges::count_if(world_.particles(grains_).position,
                                                        [](const Vec3& x) { return x.y() > -kGrain; }));
}

Discharge SiloRun::run() {
  for (int i = 0; i < 40; ++i) world_.step(1.0 / 60);
  Discharge out;
  const auto& settled = world_.particles(grains_).position;
  std::vector<Real> heights;
  for (const Vec3& x : settled) heights.push_back(x.y());
  std::ranges::sort(heights);
  out.fill = heights[heights.size() * 99 / 100];
  const Real volume = silo_.width * silo_.width * (out.fill + kGrain / 2);
  out.bulk_density = static_cast<Real>(settled.size()) * kGrainMass / volume;
  world_.remove(door_);
  for (int i = 0; i < 9; ++i) world_.step(1.0 / 60);
  const std::size_t before = inside();
  constexpr int kFrames = 18;
  for (int i = 0; i < kFrames; ++i) world_.step(1.0 / 60);
  out.rate = static_cast<Real>(before - inside()) * kGrainMass / (kFrames / 60.0);
  return out;
}

struct HopperCase {
  Real orifice, width;
  std::vector<int> layers;
};

class Hopper : public testing::TestWithParam<HopperCase> {};

// Grains that jam above the hole, and those that the walls carry, make the rate independent of the fill.
TEST_P(Hopper, DischargesByBeverloosLawForAnyFill) {
  std::vector<Real> rates;
  for (const int layers : GetParam().layers) {
    const Discharge d = SiloRun({GetParam().orifice, GetParam().width, layers}).run();
    SCOPED_TRACE(testing::Message() << "fill " << d.fill << " m, bulk density " << d.bulk_density
                                    << " kg/m^3, rate " << d.rate << " kg/s");
    EXPECT_NEAR(d.bulk_density / kGrainDensity, 0.57, 0.04);
    EXPECT_NEAR(d.rate / d.expected(GetParam().orifice), 1, 0.15);
    rates.push_back(d.rate);
    RecordProperty("rate_over_beverloo_" + std::to_string(layers),
                   std::to_string(d.rate / d.expected(GetParam().orifice)));
  }
  EXPECT_NEAR(rates.back() / rates.front(), 1, 0.1);
}

INSTANTIATE_TEST_SUITE_P(Short, Hopper, testing::Values(HopperCase{0.07, 0.15, {16}}));
INSTANTIATE_TEST_SUITE_P(Long, Hopper,
                         testing::Values(HopperCase{0.07, 0.15, {18, 28}}, HopperCase{0.09, 0.18, {26, 36}}));

}  // namespace
}  // namespace offstage::sim
