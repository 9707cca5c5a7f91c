#include "sim/collision/sphere_sweep.h"

#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// Gap that counts as touching [m]; well above the rounding of coordinates up to 1000 m.
constexpr Real kTouching = 1e-12;
/// For a sphere that grazes a surface, each iteration reduces the gap only to a quarter. This many iterations
/// reach kTouching from any size.
constexpr int kMaxIterations = 32;

template <class Distance>
std::optional<SweepHit> sweep_convex(const Distance& distance, const Vec3& a, const Vec3& b, Real radius) {
  const Vec3 path = b - a;
  Real s = 0;
  SurfaceDistance at = distance(a);
  for (int i = 0; i < kMaxIterations; ++i) {
    const Real slope = at.normal.dot(path), gap = at.distance - radius;
    if (slope >= 0) return std::nullopt;
    if (gap <= kTouching) break;
    s -= gap / slope;
    if (s > 1) return std::nullopt;
    at = distance(a + s * path);
  }
  return SweepHit{s, at.distance, at.normal};
}

SurfaceDistance triangle_distance(const TriangleMesh& mesh, uint32_t face, const Vec3& p) {
  const Triangle& t = mesh.triangles[face];
  const Vec3 away =
      p - closest_on_triangle(p, mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]).point;
  const Real distance = away.norm();
  return {distance, distance > 0 ? Vec3(away / distance) : Vec3::Zero()};
}

std::optional<SweepHit> sweep_mesh(const CollisionMesh& m, const Vec3& a, const Vec3& b, Real radius) {
  Aabb box(a.cwiseMin(b), a.cwiseMax(b));
  box.min().array() -= radius;
  box.max().array() += radius;
  std::optional<SweepHit> first;
  m.tree.overlapping(box, [&](uint32_t face) {
    const auto hit =
        sweep_convex([&](const Vec3& p) { return triangle_distance(m.mesh, face, p); }, a, b, radius);
    if (!hit) return;
    // If several faces are touched from the start, the nearest one counts.
    const auto earlier = [](const SweepHit& x, const SweepHit& y) {
      return x.fraction != y.fraction ? x.fraction < y.fraction : x.distance < y.distance;
    };
    if (!first || earlier(*hit, *first)) first = hit;
  });
  return first;
}

}  // namespace

std::optional<SweepHit> sweep_sphere(const Solid& s, const Vec3& a, const Vec3& b, Real radius) {
  if (s.mesh) return sweep_mesh(*s.mesh, a, b, radius);
  return std::visit(
      [&](const auto& shape) -> std::optional<SweepHit> {
        if constexpr (std::is_same_v<std::decay_t<decltype(shape)>, MeshShape>)
          return std::nullopt;
        else
          return sweep_convex([&](const Vec3& p) { return signed_distance(shape, p); }, a, b, radius);
      },
      *s.shape);
}

}  // namespace offstage::sim
