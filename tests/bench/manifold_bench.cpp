/// Manifolds of solids in contact, each turned a little from query to query: from the separation to the
/// points, and for boxes the whole query, separation included, next to Bullet's test of two boxes. Counters:
/// points per query.

#include <numbers>
#include <vector>

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <benchmark/benchmark.h>

#include "sim/collision/gjk.h"
#include "sim/collision/manifold.h"

namespace offstage::sim {
namespace {

/// B under A, overlapping by 0.1 mm, turned about Y and rocked by 1e-4 rad.
std::vector<Pose> poses() {
  std::vector<Pose> result;
  for (int k = 0; k < 1000; ++k)
    result.push_back({Vec3(0.1, -0.9999, 0.2), Quat(Eigen::AngleAxisd(0.01 * k, Vec3::UnitY()) *
                                                    Eigen::AngleAxisd(1e-4, Vec3::UnitX()))});
  return result;
}

template <class Query>
void run(benchmark::State& state, Query&& query) {
  const std::vector<Pose> at = poses();
  std::size_t k = 0;
  uint64_t points = 0;
  for (auto _ : state) {
    points += query(k);
    if (++k == at.size()) k = 0;
  }
  state.counters["points"] = static_cast<double>(points) / static_cast<double>(state.iterations());
}

void points_of(benchmark::State& state, const Shape& shape_a, const Shape& shape_b) {
  const Convex a = convex(shape_a), b = convex(shape_b);
  const std::vector<Pose> at = poses();
  std::vector<Separation> separations;
  for (const Pose& pose : at) {
    GjkCache fresh;
    separations.push_back(gjk(a, b, pose, fresh));
  }
  run(state, [&](std::size_t k) { return manifold(a, b, at[k], separations[k], 0.01).count; });
}

void boxes(benchmark::State& state) {
  points_of(state, Box{Vec3::Ones()}, Box{Vec3::Ones()});
}
void cylinder_on_box(benchmark::State& state) {
  points_of(state, Cylinder{0.5, 1}, Box{Vec3::Ones()});
}
void cylinders(benchmark::State& state) {
  points_of(state, Cylinder{0.5, 1}, Cylinder{0.5, 1});
}

void boxes_with_separation(benchmark::State& state) {
  const Convex box = convex(Box{Vec3::Ones()});
  const std::vector<Pose> at = poses();
  GjkCache cache;
  run(state,
      [&](std::size_t k) { return manifold(box, box, at[k], gjk(box, box, at[k], cache), 0.01).count; });
}

struct Counter : btDiscreteCollisionDetectorInterface::Result {
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3&, const btVector3&, btScalar) override { ++points; }
  uint32_t points = 0;
};

void bullet_boxes(benchmark::State& state) {
  const btBoxShape box(btVector3(0.5f, 0.5f, 0.5f));
  btBoxBoxDetector detector(&box, &box);
  std::vector<btTransform> transforms;
  for (const Pose& p : poses()) {
    const Eigen::Quaternionf q = p.orientation.cast<float>();
    const Eigen::Vector3f x = p.position.cast<float>();
    transforms.emplace_back(btQuaternion(q.x(), q.y(), q.z(), q.w()), btVector3(x.x(), x.y(), x.z()));
  }
  btDiscreteCollisionDetectorInterface::ClosestPointInput input;
  input.m_transformA.setIdentity();
  run(state, [&](std::size_t k) {
    Counter counter;
    input.m_transformB = transforms[k];
    detector.getClosestPoints(input, counter, nullptr);
    return counter.points;
  });
}

BENCHMARK(boxes);
BENCHMARK(cylinder_on_box);
BENCHMARK(cylinders);
BENCHMARK(boxes_with_separation);
BENCHMARK(bullet_boxes);

}  // namespace
}  // namespace offstage::sim

BENCHMARK_MAIN();
