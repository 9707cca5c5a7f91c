/// Validation rows on particles that meet cloth: none passes it, and momentum is kept (physics F9).

#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "effects/cloth.h"
#include "sim/geometry/intersection.h"
#include "sim/world.h"

namespace offstage::sim {
namespace {

ClothDef cotton(Real size, uint32_t cells, const Vec3& place) {
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
  ClothDef def = cotton(1, kCells, {0, 0.3, 0});
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
    for (const Shower& shower :
         {Shower{step, 0.5, 1e-5, 0.002}, Shower{step, 10, 1e-5, 0.002}, Shower{step, 30, 1e-5, 0.002},
          Shower{step, 30, 1e-3, 0.005}})
      for (const bool pinned : {true, false})
        for (const bool internal : {false, true})
          EXPECT_EQ(passed(shower, pinned, internal), 0)
              << "step " << step << " speed " << shower.speed << " mass " << shower.mass
              << (pinned ? " pinned" : " falling") << (internal ? " internal" : "");
}

}  // namespace
}  // namespace offstage::sim
