/// Measures queries of two hulls of 100 vertices along a smooth motion, as in a simulation: between two
/// queries, B turns by about 0.01 rad and moves by 0.001. The hulls have the size 1. Their distance stays at
/// 0.1 or below 0.001, or they overlap by 0.001. libccd has no distance query. Its intersection test and its
/// penetration depth are therefore measured, with the same hill-climbing support mapping as for GJK. The
/// distance of FCL, which is based on libccd, is measured with the support mapping of FCL. Counters:
/// iterations per query.

#include <cmath>
#include <memory>
#include <vector>

#include <benchmark/benchmark.h>
#include <ccd/ccd.h>
#include <ccd/quat.h>
#include <fcl/fcl.h>

#include "sim/collision/gjk.h"
#include "sim/collision/vclip.h"
#include "sim/geometry/convex_hull.h"
#include "tests/random.h"

namespace offstage::sim {
namespace {

/// Returns the hull of points on a sphere or on an ellipsoid, so that every point is a vertex.
ConvexPolyhedron round_hull(uint64_t seed, int points) {
  const Scatter scatter{seed};
  std::vector<Vec3> cloud;
  for (uint64_t i = 0; cloud.size() < static_cast<std::size_t>(points); ++i) {
    const Vec3 p =
        2 * Vec3(scatter.uniform(i, 0), scatter.uniform(i, 1), scatter.uniform(i, 2)) - Vec3::Ones();
    if (p.norm() < 1) cloud.push_back(p.normalized().cwiseProduct(Vec3(0.5, 0.4, 0.3)));
  }
  return convex_hull(cloud);
}

struct HullMotion {
  ConvexPolyhedron a = round_hull(1, 100), b = round_hull(2, 100);
  std::vector<Pose> poses;

  explicit HullMotion(Real gap) {
    GjkCache cache;
    for (int k = 0; k < 10000; ++k) {
      const Real s = 0.01 * k;
      Pose pose{2 * Vec3(std::cos(0.1 * s), 0.3 * std::sin(0.07 * s), std::sin(0.1 * s)),
                Quat(Eigen::AngleAxisd(s, Vec3(std::cos(0.01 * s), std::sin(0.01 * s), 0.5).normalized()))};
      for (int i = 0; i < 3; ++i) {  // moves B to the given gap along the normal; this turns the normal a
                                     // little, so it is repeated
        const Separation separation = gjk(convex(a), convex(b), pose, cache);
        pose.position += (separation.distance - gap) * separation.normal;
      }
      poses.push_back(pose);
    }
  }
};

const HullMotion& motion(int64_t which) {
  static const HullMotion apart(0.1), near(0.001), overlapping(-0.001);
  return which == 0 ? apart : which == 1 ? near : overlapping;
}

/// Calls a query with each pose in turn. The query returns its number of iterations.
template <class Query>
void run_queries(benchmark::State& state, Query&& query) {
  const std::vector<Pose>& poses = motion(state.range(0)).poses;
  std::size_t k = 0;
  int64_t iterations = 0;
  for (auto _ : state) {
    iterations += query(poses[k]);
    if (++k == poses.size()) k = 0;
  }
  state.counters["iterations"] = static_cast<double>(iterations) / static_cast<double>(state.iterations());
}

void gjk_warm(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  GjkCache cache;
  run_queries(state, [&](const Pose& pose) { return gjk(convex(m.a), convex(m.b), pose, cache).iterations; });
}

void gjk_cold(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  run_queries(state, [&](const Pose& pose) {
    GjkCache cache;
    return gjk(convex(m.a), convex(m.b), pose, cache).iterations;
  });
}

void vclip_warm(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  VclipCache cache;
  run_queries(state, [&](const Pose& pose) { return vclip(m.a, m.b, pose, cache).iterations; });
}

void vclip_cold(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  run_queries(state, [&](const Pose& pose) {
    VclipCache cache;
    return vclip(m.a, m.b, pose, cache).iterations;
  });
}

void overlap_warm(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  GjkCache cache;
  run_queries(state, [&](const Pose& pose) { return int{overlap(convex(m.a), convex(m.b), pose, cache)}; });
}

/// Argument of libccd's support mapping: a hull with its pose, and the last vertex of the hill climbing.
struct CcdHull {
  const ConvexPolyhedron* hull;
  Pose pose;
  mutable uint32_t hint = 0;
};

void ccd_support(const void* object, const ccd_vec3_t* direction, ccd_vec3_t* out) {
  const auto& h = *static_cast<const CcdHull*>(object);
  const Vec3 d(direction->v[0], direction->v[1], direction->v[2]);
  h.hint = support_vertex(*h.hull, h.pose.vector_to_body(d), h.hint);
  const Vec3 w = h.pose.point_to_world(h.hull->vertex(h.hint));
  ccdVec3Set(out, w.x(), w.y(), w.z());
}

void ccd_centre(const void* object, ccd_vec3_t* out) {
  const auto& h = *static_cast<const CcdHull*>(object);
  const Vec3 c = h.pose.point_to_world(h.hull->centre());
  ccdVec3Set(out, c.x(), c.y(), c.z());
}

ccd_t ccd_settings() {
  ccd_t ccd;
  CCD_INIT(&ccd);
  ccd.support1 = ccd.support2 = ccd_support;
  ccd.center1 = ccd.center2 = ccd_centre;
  ccd.max_iterations = 100;
  return ccd;
}

void ccd_intersect(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  const ccd_t ccd = ccd_settings();
  CcdHull a{&m.a, {}}, b{&m.b, {}};
  run_queries(state, [&](const Pose& pose) {
    b.pose = pose;
    return ccdGJKIntersect(&a, &b, &ccd);
  });
}

void ccd_penetration(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  const ccd_t ccd = ccd_settings();
  CcdHull a{&m.a, {}}, b{&m.b, {}};
  run_queries(state, [&](const Pose& pose) {
    b.pose = pose;
    ccd_real_t depth = 0;
    ccd_vec3_t direction, position;
    return ccdGJKPenetration(&a, &b, &ccd, &depth, &direction, &position);
  });
}

std::shared_ptr<fcl::Convexd> fcl_convex(const ConvexPolyhedron& p) {
  const auto vertices =
      std::make_shared<std::vector<fcl::Vector3d>>(p.vertices().begin(), p.vertices().end());
  const auto faces = std::make_shared<std::vector<int>>();
  for (uint32_t f = 0; f < p.face_count(); ++f) {
    faces->push_back(static_cast<int>(p.face_vertices(f).size()));
    for (uint32_t v : p.face_vertices(f)) faces->push_back(static_cast<int>(v));
  }
  return std::make_shared<fcl::Convexd>(vertices, static_cast<int>(p.face_count()), faces);
}

void fcl_distance(benchmark::State& state) {
  const HullMotion& m = motion(state.range(0));
  fcl::CollisionObjectd a(fcl_convex(m.a)), b(fcl_convex(m.b));
  fcl::DistanceRequestd request(true, state.range(0) == 2);
  request.distance_tolerance = 1e-9;
  run_queries(state, [&](const Pose& pose) {
    b.setTransform(pose.orientation, pose.position);
    fcl::DistanceResultd result;
    benchmark::DoNotOptimize(fcl::distance(&a, &b, request, result));
    return 0;
  });
}

constexpr int kApart = 0, kNear = 1, kOverlapping = 2;

BENCHMARK(gjk_warm)->Arg(kApart)->Arg(kNear)->Arg(kOverlapping);
BENCHMARK(gjk_cold)->Arg(kApart)->Arg(kNear)->Arg(kOverlapping);
BENCHMARK(vclip_warm)->Arg(kApart)->Arg(kNear)->Arg(kOverlapping);
BENCHMARK(vclip_cold)->Arg(kApart)->Arg(kNear)->Arg(kOverlapping);
BENCHMARK(overlap_warm)->Arg(kApart)->Arg(kNear)->Arg(kOverlapping);
BENCHMARK(ccd_intersect)->Arg(kApart)->Arg(kNear)->Arg(kOverlapping);
BENCHMARK(ccd_penetration)->Arg(kOverlapping);
BENCHMARK(fcl_distance)->Arg(kApart)->Arg(kNear);

}  // namespace
}  // namespace offstage::sim
