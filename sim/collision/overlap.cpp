#include "sim/collision/overlap.h"

#include "sim/collision/sphere_sweep.h"

namespace offstage::sim {
namespace {

struct OrientedBox {
  Vec3 centre, half;
  Mat3 axes;
};

OrientedBox oriented_box(const Solid& s, const Pose& pose) {
  const Aabb box = local_bounds(s);
  return {pose.point_to_world(box.center()), box.sizes() / 2, pose.orientation.toRotationMatrix()};
}

/// The fifteen candidate axes of two boxes: three of each, and the products of their edges.
bool boxes_touch(const OrientedBox& a, const OrientedBox& b) {
  const Vec3 between = b.centre - a.centre;
  const auto separates = [&](const Vec3& axis) {
    const Real spread = (a.axes.transpose() * axis).cwiseAbs().dot(a.half) +
                        (b.axes.transpose() * axis).cwiseAbs().dot(b.half);
    return std::abs(between.dot(axis)) > spread;
  };
  for (int i = 0; i < 3; ++i)
    if (separates(a.axes.col(i)) || separates(b.axes.col(i))) return false;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const Vec3 axis = a.axes.col(i).cross(b.axes.col(j));
      // Parallel edges add nothing to the face axes, and their product is noise.
      if (axis.squaredNorm() > 1e-12 && separates(axis)) return false;
    }
  return true;
}

bool plane_touches(const Pose& plane, const Solid& s, const Pose& pose) {
  const Vec3 down = pose.vector_to_body(plane.vector_to_world(-Vec3::UnitY()));
  return plane.point_to_body(pose.position).y() <= support(s, down);
}

/// A capsule is the sphere of its radius swept along its axis.
bool swept_sphere_touches(const Capsule& c, const Pose& pose, const Solid& s, const Pose& other) {
  const Vec3 along(0, c.height / 2, 0);
  const Vec3 a = other.point_to_body(pose.point_to_world(-along)),
             b = other.point_to_body(pose.point_to_world(along));
  return signed_distance(s, a).distance <= c.radius || sweep_sphere(s, a, b, c.radius);
}

bool is_plane(const Solid& s) {
  return std::holds_alternative<Plane>(*s.shape);
}

/// The pair's test if `a` is a shape that has an exact one against all others.
std::optional<bool> exact_test(const Solid& a, const Pose& pa, const Solid& b, const Pose& pb) {
  if (is_plane(a)) return plane_touches(pa, b, pb);
  if (const auto* s = std::get_if<Sphere>(a.shape))
    return signed_distance(b, pb.point_to_body(pa.position)).distance <= s->radius;
  if (const auto* c = std::get_if<Capsule>(a.shape)) return swept_sphere_touches(*c, pa, b, pb);
  return std::nullopt;
}

}  // namespace

bool touching(const Solid& a, const Pose& world_from_a, const Solid& b, const Pose& world_from_b) {
  if (is_plane(a) && is_plane(b)) return false;
  if (const auto exact = exact_test(a, world_from_a, b, world_from_b)) return *exact;
  if (const auto exact = exact_test(b, world_from_b, a, world_from_a)) return *exact;
  return boxes_touch(oriented_box(a, world_from_a), oriented_box(b, world_from_b));
}

}  // namespace offstage::sim
