/// Measures manifolds of solids in contact, which turn a little between two queries: the computation of the
/// points from the separation, and the whole query of two shapes. Bullet's test of two boxes is measured for
/// comparison. Counters: points per query.

#include <memory>
#include <numbers>
#include <vector>

#include <BulletCollision/CollisionDispatch/btBoxBoxDetector.h>
#include <BulletCollision/CollisionShapes/btBoxShape.h>
#include <benchmark/benchmark.h>

#include "sim/collision/narrow_phase.h"
#include "sim/core/rotation.h"
#include "sim/geometry/convex_hull.h"
#include "sim/geometry/solid_mesh.h"

namespace offstage::sim {
namespace {

/// Returns poses of body B below body A. Their centres are `depth` apart along Y; B is turned about Y and
/// tilted by 1e-4 rad.
std::vector<Pose> poses(Real depth = 0.9999) {
  std::vector<Pose> result;
  for (int k = 0; k < 1000; ++k)
    result.push_back({Vec3(0.1, -depth, 0.2), Quat(Eigen::AngleAxisd(0.01 * k, Vec3::UnitY()) *
                                                   Eigen::AngleAxisd(1e-4, Vec3::UnitX()))});
  return result;
}

template <class Query>
void run_manifolds(benchmark::State& state, const std::vector<Pose>& at, Query&& query) {
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
  run_manifolds(state, at, [&](std::size_t k) { return manifold(a, b, at[k], separations[k], 0.01).count; });
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

/// A shape with the data that the narrow phase needs.
struct Body {
  explicit Body(const Shape& s) : shape(s), collision({&shape, nullptr}, true) {}
  explicit Body(const SolidMesh& solid)
      : shape(MeshShape{}),
        mesh(std::make_unique<CollisionMesh>(std::vector{solid})),
        collision({&shape, mesh.get()}, true) {}
  explicit Body(const ConvexPolyhedron& p)
      : shape(MeshShape{}),
        mesh(std::make_unique<CollisionMesh>(p.triangles())),
        collision({&shape, mesh.get()}, true) {}

  Shape shape;
  std::unique_ptr<CollisionMesh> mesh;
  CollisionShape collision;
};

/// Returns an icosahedron of radius 0.5 m that rests on a face.
ConvexPolyhedron icosahedron() {
  std::vector<Vec3> points;
  for (int k = 0; k < 3; ++k)
    for (const Real x : {-1.0, 1.0})
      for (const Real y : {-std::numbers::phi, std::numbers::phi}) {
        Vec3 p = Vec3::Zero();
        p[k] = x;
        p[(k + 1) % 3] = y;
        points.push_back(0.5 * (rotation_between(Vec3::Ones(), Vec3::UnitY()) * p.normalized()));
      }
  return convex_hull(points);
}

/// `keep`: whether the PairCache is kept between queries, as in a world; otherwise each query begins with an
/// empty one.
void query(benchmark::State& state, const Body& a, const Body& b, const std::vector<Pose>& at,
           bool keep = true, DistanceMethod method = DistanceMethod::gjk) {
  PairCache cache;
  std::vector<Manifold> manifolds;
  run_manifolds(state, at, [&](std::size_t k) {
    manifolds.clear();
    if (!keep) cache = {};
    find_manifolds(a.collision, b.collision, at[k], 0.01, cache, method, manifolds);
    cache.forget_unused();
    return manifolds.empty() ? 0 : manifolds[0].count;
  });
}

const Body& unit_box() {
  static const Body box(Box{Vec3::Ones()});
  return box;
}
const Body& small_ball() {
  static const Body ball(Sphere{0.5});
  return ball;
}
const Body& hedron() {
  static const Body body(icosahedron());
  return body;
}
const Body& ground() {
  static const Body slab(Box{{200, 1, 200}});
  return slab;
}

void boxes_with_separation(benchmark::State& state) {
  const Convex box = convex(Box{Vec3::Ones()});
  const std::vector<Pose> at = poses();
  GjkCache cache;
  run_manifolds(state, at, [&](std::size_t k) {
    return manifold(box, box, at[k], gjk(box, box, at[k], cache), 0.01).count;
  });
}
void query_boxes(benchmark::State& state) {
  query(state, unit_box(), unit_box(), poses());
}
void query_boxes_hovering(benchmark::State& state) {
  query(state, unit_box(), unit_box(), poses(1.001));
}
void query_boxes_apart(benchmark::State& state) {
  query(state, unit_box(), unit_box(), poses(1.05));
}
void query_box_on_ground(benchmark::State& state) {
  query(state, unit_box(), ground(), poses());
}
void query_balls(benchmark::State& state) {
  query(state, small_ball(), small_ball(), poses(0.97));
}
void query_ball_on_box(benchmark::State& state) {
  query(state, small_ball(), unit_box(), poses());
}
/// Returns poses of body B below body A in which the bodies overlap by `depth`. B is turned about Y.
std::vector<Pose> touching(const Body& a, const Body& b, Real depth) {
  std::vector<Pose> at = poses(1);
  for (Pose& p : at) {
    PairCache fresh;
    const Separation s = *separation(a.collision, b.collision, p, fresh);
    p.position += (s.distance + depth) * s.normal;
  }
  return at;
}
/// Returns the poses of touching(), rotated together with a tumbling body A.
std::vector<Pose> tumbling(const Body& a, const Body& b, Real depth) {
  std::vector<Pose> at = poses(1);
  for (std::size_t k = 0; k < at.size(); ++k) {
    const Quat turn(Eigen::AngleAxisd(0.01 * static_cast<Real>(k), Vec3(1, 2, 3).normalized()));
    at[k] = {turn * at[k].position, turn};
    PairCache fresh;
    const Separation s = *separation(a.collision, b.collision, at[k], fresh);
    at[k].position += (s.distance + depth) * s.normal;
  }
  return at;
}
void query_icosahedra(benchmark::State& state) {
  query(state, hedron(), hedron(), touching(hedron(), hedron(), 1e-4));
}
void query_icosahedra_tumbling(benchmark::State& state) {
  query(state, hedron(), hedron(), tumbling(hedron(), hedron(), 1e-4));
}
void query_icosahedron_tumbling_on_ground(benchmark::State& state) {
  query(state, hedron(), ground(), tumbling(hedron(), ground(), 1e-4));
}
void query_icosahedra_hovering(benchmark::State& state) {
  query(state, hedron(), hedron(), touching(hedron(), hedron(), -1e-4));
}
void query_icosahedron_on_ground(benchmark::State& state) {
  query(state, hedron(), ground(), touching(hedron(), ground(), 1e-4));
}
void query_icosahedron_over_ground(benchmark::State& state) {
  query(state, hedron(), ground(), touching(hedron(), ground(), -1e-4));
}

/// Arguments: whether the cache is kept, and whether V-Clip is used.
void pair_cache(benchmark::State& state, const Body& a, const Body& b, const std::vector<Pose>& at) {
  query(state, a, b, at, state.range(0) != 0,
        state.range(1) != 0 ? DistanceMethod::vclip : DistanceMethod::gjk);
}
void pair_cache_icosahedra(benchmark::State& state) {
  pair_cache(state, hedron(), hedron(), touching(hedron(), hedron(), 1e-4));
}
void pair_cache_icosahedra_hovering(benchmark::State& state) {
  pair_cache(state, hedron(), hedron(), touching(hedron(), hedron(), -1e-4));
}
void pair_cache_icosahedra_tumbling(benchmark::State& state) {
  pair_cache(state, hedron(), hedron(), tumbling(hedron(), hedron(), 1e-4));
}
/// Two rings of 48 parts, one on the other.
void pair_cache_rings(benchmark::State& state) {
  static const Body ring(solid_mesh(Torus{0.4, 0.1}));
  pair_cache(state, ring, ring, touching(ring, ring, 1e-4));
}

struct Counter : btDiscreteCollisionDetectorInterface::Result {
  void setShapeIdentifiersA(int, int) override {}
  void setShapeIdentifiersB(int, int) override {}
  void addContactPoint(const btVector3&, const btVector3&, btScalar) override { ++points; }
  uint32_t points = 0;
};

void bullet(benchmark::State& state, Real depth) {
  const btBoxShape box(btVector3(0.5f, 0.5f, 0.5f));
  btBoxBoxDetector detector(&box, &box);
  std::vector<btTransform> transforms;
  for (const Pose& p : poses(depth)) {
    const Eigen::Quaternionf q = p.orientation.cast<float>();
    const Eigen::Vector3f x = p.position.cast<float>();
    transforms.emplace_back(btQuaternion(q.x(), q.y(), q.z(), q.w()), btVector3(x.x(), x.y(), x.z()));
  }
  btDiscreteCollisionDetectorInterface::ClosestPointInput input;
  input.m_transformA.setIdentity();
  run_manifolds(state, poses(depth), [&](std::size_t k) {
    Counter counter;
    input.m_transformB = transforms[k];
    detector.getClosestPoints(input, counter, nullptr);
    return counter.points;
  });
}

void bullet_boxes(benchmark::State& state) {
  bullet(state, 0.9999);
}
void bullet_boxes_apart(benchmark::State& state) {
  bullet(state, 1.05);
}

BENCHMARK(boxes);
BENCHMARK(cylinder_on_box);
BENCHMARK(cylinders);
BENCHMARK(boxes_with_separation);
BENCHMARK(query_boxes);
BENCHMARK(bullet_boxes);
BENCHMARK(query_boxes_hovering);
BENCHMARK(query_boxes_apart);
BENCHMARK(bullet_boxes_apart);
BENCHMARK(query_box_on_ground);
BENCHMARK(query_balls);
BENCHMARK(query_ball_on_box);
BENCHMARK(query_icosahedra);
BENCHMARK(query_icosahedra_tumbling);
BENCHMARK(query_icosahedra_hovering);
BENCHMARK(query_icosahedron_on_ground);
BENCHMARK(query_icosahedron_tumbling_on_ground);
BENCHMARK(query_icosahedron_over_ground);
BENCHMARK(pair_cache_icosahedra)->ArgsProduct({{0, 1}, {0, 1}});
BENCHMARK(pair_cache_icosahedra_hovering)->ArgsProduct({{0, 1}, {0, 1}});
BENCHMARK(pair_cache_icosahedra_tumbling)->ArgsProduct({{0, 1}, {0, 1}});
BENCHMARK(pair_cache_rings)->ArgsProduct({{0, 1}, {0, 1}});

}  // namespace
}  // namespace offstage::sim
