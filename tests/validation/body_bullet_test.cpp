/// Bullets of 300 m/s do not pass through a plate of 1 cm, for all combinations of shapes, with the full
/// simulation (physics R12).

#include <algorithm>
#include <cmath>

#include "tests/meshes.h"
#include "tests/random.h"
#include "tests/validation/both_solvers.h"

namespace offstage::sim {
namespace {

constexpr Real kBodySpeed = 300, kPlate = 0.01;

class BodyBullet : public BothSolvers {
 protected:
  static TriangleMesh sheet_mesh() {
    TriangleMesh sheet;
    sheet.vertices = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
    sheet.triangles = {{0, 2, 1}, {0, 3, 2}};
    return sheet;
  }
  /// Returns whether a bullet reaches the far side of a plate within the time for twice its path, unless it
  /// slid off the plate's edge.
  static bool gets_through(World& world, BodyHandle bullet, BodyHandle plate, Real max_step) {
    const auto seen_from_plate = [&] {
      return world.body(plate).pose.point_to_body(world.body(bullet).centre);
    };
    const Real behind = -5 * kPlate, end = world.time() + 4 / kBodySpeed + 2 * max_step;
    for (Vec3 before = seen_from_plate(); world.time() < end - max_step / 2;) {
      world.step(max_step);
      const Vec3 now = seen_from_plate();
      if (now.y() < behind) {
        const Vec3 out = before + (behind - before.y()) / (now.y() - before.y()) * (now - before);
        return std::max(std::abs(out.x()), std::abs(out.z())) < 1;
      }
      before = now;
    }
    return false;
  }
  /// Fires all bullets in one world; plates and bullets are added and removed.
  static void shoot(uint64_t shots, Real max_step) {
    World world(weightless(max_step));
    const Shape bullets[] = {Sphere{0.01},
                             Box{{0.02, 0.01, 0.01}},
                             Capsule{0.005, 0.02},
                             Cylinder{0.01, 0.02},
                             Cone{0.01, 0.03},
                             MeshShape{world.add_mesh(box_mesh(Vec3(0.02, 0.01, 0.01)))},
                             MeshShape{world.add_mesh(torus_mesh(0.02, 0.005, 8, 6))}};
    const Shape plates[] = {Box{{2, kPlate, 2}}, Cylinder{1, kPlate}, Plane{},
                            MeshShape{world.add_mesh(box_mesh(Vec3(2, kPlate, 2)))},
                            MeshShape{world.add_mesh(sheet_mesh())}};
    const Scatter random{301};
    for (uint64_t i = 0; i < shots; ++i) {
      const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
      const Shape& plate_shape = plates[i / 7 % 5];
      const bool planar = std::holds_alternative<Plane>(plate_shape) || i / 7 % 5 == 4;
      const bool free = !planar && i % 3 == 0;  // a plate that can move when it is hit
      const Real e = 0.5 * Real(i % 4 % 3);
      const auto plate = world.add_body({.shape = plate_shape,
                                         .motion = free ? MotionType::dynamic : MotionType::static_body,
                                         .density = 5000,
                                         .restitution = e});
      const Vec3 target(0.6 * u(0), 0, 0.6 * u(1)),
          way = Vec3(u(2), -0.3 - std::abs(u(3)), u(4)).normalized();
      const Quat turn = Quat(u(10), u(11), u(12), u(13)).normalized();
      const auto bullet = world.add_body({.shape = bullets[i % 7],
                                          .pose = {target - (0.5 + random.uniform(i, 5) * 3) * way, turn},
                                          .velocity = kBodySpeed * way,
                                          .angular_velocity = 100 * Vec3(u(6), u(7), u(8)),
                                          .density = 8000,
                                          .restitution = e});
      const Real energy = world.energy().kinetic;
      EXPECT_FALSE(gets_through(world, bullet, plate, max_step))
          << "shot " << i << ", bullet " << i % 7 << ", plate " << i / 7 % 5 << (free ? ", free" : ", fixed")
          << ", restitution " << e << ", step " << max_step;
      EXPECT_LE(world.energy().kinetic, 1.01 * energy) << "shot " << i;
      world.remove(bullet);
      world.remove(plate);
    }
  }
};
class LongBodyBullet : public BodyBullet {};

TEST_P(BodyBullet, NeverPassesAPlate) {
  for (const Real max_step : {1.0 / 240, 1.0 / 60}) shoot(500, max_step);
}
TEST_P(LongBodyBullet, NeverPassesAPlateInTenThousandShots) {
  for (const Real max_step : {1.0 / 240, 1.0 / 60}) shoot(5000, max_step);
}
OFFSTAGE_BOTH_SOLVERS(Solvers, BodyBullet);
OFFSTAGE_BOTH_SOLVERS(Long, LongBodyBullet);

}  // namespace
}  // namespace offstage::sim
