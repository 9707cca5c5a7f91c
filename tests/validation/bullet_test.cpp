/// Small fast bodies never pass through thin bodies between two steps (physics R12).

#include <gtest/gtest.h>

#include "meshes.h"
#include "random.h"
#include "sim/collision/narrow_phase.h"

namespace offstage::sim {
namespace {

constexpr Real kBulletSpeed = 300, kBulletStep = 1.0 / 60, kThickness = 0.01;
constexpr uint64_t kShots = 10'000;

struct Body {
  explicit Body(const Shape& s) : shape(s), collision({&shape, nullptr}, true) {}
  explicit Body(const TriangleMesh& m)
      : shape(MeshShape{}), mesh(std::make_unique<CollisionMesh>(m)), collision({&shape, mesh.get()}, true) {}

  Shape shape;
  std::unique_ptr<CollisionMesh> mesh;
  CollisionShape collision;
};

TriangleMesh sheet_mesh() {
  TriangleMesh sheet;
  sheet.vertices = {{-1, 0, -1}, {1, 0, -1}, {1, 0, 1}, {-1, 0, 1}};
  sheet.triangles = {{0, 2, 1}, {0, 3, 2}};
  return sheet;
}

/// Bullets of 300 m/s (5 m a step) from random directions hit a point of the plate; they rotate in flight,
/// and the steps end anywhere behind the plate. In half of the cases the plate also moves and rotates.
TEST(Bullet, NeverPassesAPlate) {
  std::vector<std::unique_ptr<Body>> bullets, plates;
  for (const Shape& s : {Shape(Sphere{0.01}), Shape(Box{Vec3(0.02, 0.01, 0.01)}), Shape(Capsule{0.005, 0.02}),
                         Shape(Cylinder{0.01, 0.02}), Shape(Cone{0.01, 0.03})})
    bullets.push_back(std::make_unique<Body>(s));
  bullets.push_back(std::make_unique<Body>(box_mesh(Vec3(0.02, 0.01, 0.01))));
  bullets.push_back(std::make_unique<Body>(torus_mesh(0.02, 0.005, 8, 6)));
  for (const Shape& s : {Shape(Box{Vec3(2, kThickness, 2)}), Shape(Cylinder{1, kThickness}), Shape(Plane{})})
    plates.push_back(std::make_unique<Body>(s));
  plates.push_back(std::make_unique<Body>(box_mesh(Vec3(2, kThickness, 2))));
  plates.push_back(std::make_unique<Body>(sheet_mesh()));

  const Scatter random{300};
  uint64_t misses = 0, stalled = 0;
  for (uint64_t i = 0; i < kShots; ++i) {
    const auto u = [&](uint64_t k) { return 2 * random.uniform(i, k) - 1; };
    const auto turned = [&](uint64_t k) { return Quat(u(k), u(k + 1), u(k + 2), u(k + 3)).normalized(); };
    const Body &bullet = *bullets[i % bullets.size()], &plate = *plates[i / bullets.size() % plates.size()];
    // The bullet crosses the middle of the plate at a random fraction of the step, from above so that planes
    // are also hit.
    const Vec3 target(0.6 * u(0), 0, 0.6 * u(1)),
        direction = Vec3(u(2), -0.3 - std::abs(u(3)), u(4)).normalized();
    const Real fraction = 0.02 + 0.96 * random.uniform(i, 5);
    const Vec3 way = kBulletSpeed * kBulletStep * direction;
    const PosePath flight({target - fraction * way, turned(10)}, {target + (1 - fraction) * way, turned(14)});
    const bool moving = i % 2 == 1;
    const Pose rest;
    const Pose tilted{Vec3(0.01 * u(6), 0.01 * u(7), 0.01 * u(8)),
                      Quat(Eigen::AngleAxisd(0.02 * u(9), Vec3::UnitX()))};
    const PosePath standing(rest, moving ? tilted : rest);
    const auto impact =
        time_of_impact(MovingShape{bullet.collision, flight}, MovingShape{plate.collision, standing}, 1e-5);
    // At the impact, the bullet is still in front of the plate, and near it.
    const bool hit =
        impact && flight.at(impact->fraction).position.dot(direction) < target.dot(direction) + 0.05;
    misses += !hit;
    stalled += impact && !impact->converged;
  }
  EXPECT_EQ(misses, 0u);
  EXPECT_EQ(stalled, 0u);
}

}  // namespace
}  // namespace offstage::sim
