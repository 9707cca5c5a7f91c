#include "sim/cloth/round_contacts.h"

#include <algorithm>
#include <cmath>

#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// Paths are sampled at this fraction of the radius, so that nothing passes between two samples.
constexpr Real kSampleSpacing = 0.5;
constexpr int kMaxPathSamples = 256;
/// Number of iterations of the search for the point of a triangle that is nearest to an axis.
constexpr int kMaxAxisSteps = 8;
/// A contact is left to the contacts of points if a corner of the triangle has more than this weight.
constexpr Real kWithin = 0.99;

/// A shape that is the set of all points within a radius of a segment along y, from -half to half.
struct Rounding {
  Real half, radius;
};

std::optional<Rounding> rounding(const Solid& solid) {
  if (const auto* s = std::get_if<Sphere>(solid.shape)) return Rounding{0, s->radius};
  if (const auto* s = std::get_if<Capsule>(solid.shape)) return Rounding{s->height / 2, s->radius};
  if (const auto* s = std::get_if<Cylinder>(solid.shape)) return Rounding{s->height / 2, s->radius};
  if (const auto* s = std::get_if<Cone>(solid.shape)) return Rounding{s->height / 2, s->radius / 2};
  if (const auto* s = std::get_if<Frustum>(solid.shape))
    return Rounding{s->height / 2, (s->radius + s->top_radius) / 2};
  return {};
}

/// Returns the point of a triangle that is nearest to the segment, by alternating projections.
TrianglePoint nearest_to_axis(const Rounding& shape, const std::array<Vec3, 3>& t) {
  const auto on_axis = [&](const Vec3& p) { return Vec3(0, std::clamp(p.y(), -shape.half, shape.half), 0); };
  Vec3 axis = on_axis((t[0] + t[1] + t[2]) / 3);
  TrianglePoint nearest = closest_on_triangle(axis, t[0], t[1], t[2]);
  for (int step = 0; step < kMaxAxisSteps && shape.half > 0; ++step) {
    const Vec3 next = on_axis(nearest.point);
    if ((next - axis).squaredNorm() < 1e-6 * shape.radius * shape.radius) break;
    axis = next;
    nearest = closest_on_triangle(axis, t[0], t[1], t[2]);
  }
  return nearest;
}

/// Returns the contact of a triangle that the axis of a shape passes, in the frame of the shape: the end of
/// the shape that is nearer to the crossing has come through the triangle, and the triangle is pushed back
/// over it. The nearest point of the surface would be beside the axis, and the shape would pass.
std::optional<TriangleContact> passed_by_axis(const Rounding& shape, const Solid& solid,
                                              const std::array<Vec3, 3>& t, Real keeps) {
  // The tip of a cone is a corner, which has contacts of its own (corner_contacts.h).
  const bool is_rod =
      std::holds_alternative<Capsule>(*solid.shape) || std::holds_alternative<Cylinder>(*solid.shape);
  if (!is_rod || !(shape.half > 0)) return {};
  // The signed areas of the triangle's projection along the axis, opposite to each corner.
  std::array<Real, 3> w;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 &a = t[(k + 1) % 3], &b = t[(k + 2) % 3];
    w[k] = a.z() * b.x() - a.x() * b.z();
  }
  const Real area = w[0] + w[1] + w[2];
  if (!(std::abs(area) > 0)) return {};
  Real height = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    w[k] /= area;
    if (w[k] < 0) return {};
    height += w[k] * t[k].y();
  }
  if (!(std::abs(height) < shape.half)) return {};
  const Real up = height < 0 ? -1 : 1;
  const Real end = shape.half + (std::holds_alternative<Capsule>(*solid.shape) ? shape.radius : 0);
  return TriangleContact{w, Vec3(0, up * end, 0), Vec3(0, up, 0), up * height - end - keeps};
}

std::array<Vec3, 3> present(const Triangle& t, const ClothPoints& points) {
  return {points.at(t[0]), points.at(t[1]), points.at(t[2])};
}

}  // namespace

bool RoundContacts::concerns(const Solid& solid, Real edge, Real thickness) {
  // If both ends of a straight edge keep the distance `thickness`, its middle is nearer to the shape by
  // edge^2 / (8 (radius + thickness)).
  const std::optional<Rounding> shape = rounding(solid);
  return shape && edge * edge > 8 * (shape->radius + thickness) * (1 - kTriangleDistance) * thickness;
}

std::optional<TriangleContact> RoundContacts::touch(const Triangle& t, const ClothPoints& points,
                                                    const std::array<Vec3, 3>& ends, const ClothBody& body,
                                                    Real reach, bool is_short) {
  const std::optional<Rounding> shape = rounding(body.solid());
  if (!shape) return {};
  const Real keeps = kTriangleDistance * points.thickness[t[0]];
  std::array<Vec3, 3> from, to;
  Real longest = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    from[k] = body.start().point_to_body(points.start_at(t[k]));
    to[k] = body.end().point_to_body(ends[k]);
    longest = std::max(longest, (to[k] - from[k]).norm());
  }
  if (auto passed = passed_by_axis(*shape, body.solid(), to, keeps)) {
    passed->on_body = body.end().point_to_world(passed->on_body);
    passed->normal = body.end().vector_to_world(passed->normal);
    return passed;
  }
  const Real samples = std::ceil(longest / (kSampleSpacing * (shape->radius + keeps)));
  if (is_short && samples > 1) return {};
  const int count = std::clamp(static_cast<int>(std::min(samples, 1e6)), 1, kMaxPathSamples);
  for (int i = 1; i <= count; ++i) {
    const Real s = static_cast<Real>(i) / count;
    std::array<Vec3, 3> at;
    for (std::size_t k = 0; k < 3; ++k) at[k] = from[k] + s * (to[k] - from[k]);
    const TrianglePoint nearest = nearest_to_axis(*shape, at);
    const SurfaceDistance d = signed_distance(body.solid(), nearest.point);
    if (d.distance >= keeps + reach) continue;
    const auto& w = nearest.weights;
    if (std::max({w[0], w[1], w[2]}) > kWithin) return {};
    const Vec3 end = w[0] * to[0] + w[1] * to[1] + w[2] * to[2];
    const Real gap = d.distance + d.normal.dot(end - nearest.point) - keeps;
    if (gap >= reach) return {};
    const Vec3 on_body = nearest.point - d.distance * d.normal;
    return TriangleContact{
        {w[0], w[1], w[2]}, body.end().point_to_world(on_body), body.end().vector_to_world(d.normal), gap};
  }
  return {};
}

void RoundContacts::solve(std::span<const Triangle> triangles, ClothPoints& points,
                          std::span<ClothBody> bodies, Real dt, std::vector<VelocityCut>& cuts,
                          const std::function<bool(const Triangle&, const ClothBody&)>& is_pressed) const {
  for (const Near& near : near_) {
    const Triangle& t = triangles[near.triangle];
    if (is_pressed(t, bodies[near.body])) continue;
    if (const auto contact = touch(t, points, present(t, points), bodies[near.body], 0, false))
      separate(*contact, t, points, bodies[near.body], dt, cuts);
  }
}

void RoundContacts::collect(std::span<const Triangle> triangles, const ClothPoints& points,
                            std::span<ClothBody> bodies, Real reach,
                            const std::function<bool(const Triangle&, const ClothBody&)>& is_pressed,
                            std::vector<BodyContact>& found) const {
  for (const Near& near : near_) {
    ClothBody& body = bodies[near.body];
    if (!body.is_dynamic()) continue;
    const Triangle& t = triangles[near.triangle];
    if (is_pressed(t, body)) continue;
    const auto contact = touch(t, points, present(t, points), body, reach * points.thickness[t[0]], false);
    if (!contact) continue;
    found.push_back({t, contact->weights, &body, contact->normal, contact->on_body, contact->gap});
  }
}

}  // namespace offstage::sim
