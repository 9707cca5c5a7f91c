#include "sim/cloth/corner_contacts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace offstage::sim {
namespace {

/// A triangle lies over a feature if the cosine between its normal and the feature's outward direction is at
/// least this.
constexpr Real kLeastCosine = 0.3;
/// A support's point may lie outside of its triangle by this weight: springs may move the feature to the
/// neighbouring triangle.
constexpr Real kSupportOverhang = 0.1;
/// A support of a triangle needs at least this weight of points that are not pinned.
constexpr Real kLeastFree = 0.1;
constexpr int kMaxSamples = 32;            // per edge
constexpr std::size_t kMaxCorners = 2000;  // per mesh

int samples(Real length, Real spacing, int least) {
  return std::clamp(static_cast<int>(std::ceil(length / spacing)), least, kMaxSamples);
}

/// Returns the mean normal of the faces at a vertex. The direction from the centre is no substitute: at the
/// top of a ring it is nearly horizontal, and cloth beside the ring would count as lying over that vertex.
Vec3 outward_normal(const ConvexPolyhedron& hull, uint32_t vertex) {
  Vec3 sum = Vec3::Zero();
  for (const uint32_t e : hull.vertex_edges(vertex)) {
    const ConvexPolyhedron::Edge& edge = hull.edge(e);
    sum += hull.plane(edge.tail == vertex ? edge.left : edge.right).normal;  // each face once
  }
  return sum.normalized();
}

/// Whether a body presses a triangle against another body.
bool is_pressed(const Triangle& t, const ClothBody& body, const ClothPoints& points,
                const ClothContacts& of_points) {
  return !body.loads.empty() &&
         std::ranges::all_of(t, [&](uint32_t i) { return of_points.is_pressed_by(points, body, i); });
}

}  // namespace

void CornerContacts::assign(std::vector<Triangle> triangles, const ClothPoints& points) {
  triangles_ = std::move(triangles);
  tree_.build(triangles_, points.rest);
  Real sum = 0;
  longest_ = 0;
  thinnest_ = std::numeric_limits<Real>::infinity();
  for (const Triangle& t : triangles_) {
    sum += (points.rest[t[0]] - points.rest[t[1]]).norm();
    thinnest_ = std::min(thinnest_, points.thickness[t[0]]);
    for (std::size_t k = 0; k < 3; ++k)
      longest_ = std::max(longest_, (points.rest[t[k]] - points.rest[t[(k + 1) % 3]]).norm());
  }
  spacing_ = triangles_.empty() ? 1 : std::max(1e-3, sum / static_cast<Real>(triangles_.size()) / 2);
  near_.clear();
}

std::vector<CornerContacts::Corner> CornerContacts::corners(const Solid& solid) const {
  std::vector<Corner> found;
  const auto rim = [&](Real radius, Real y, Real up, Real depth) {
    const int count = std::max(8, 2 * samples(std::numbers::pi * radius, spacing_, 4));
    for (int k = 0; k < count; ++k) {
      // The samples of a quarter circle come from the tangent of half the angle: they are nearly even, and
      // need no sine.
      const Real t = 4.0 * k / count, quarter = std::floor(t), s = t - quarter;
      const Real half = s * (std::numbers::sqrt2 - 1), d = 1 + half * half;  // tan of half the angle
      Vec3 around((1 - half * half) / d, 0, 2 * half / d);
      for (Real q = 0; q < quarter; ++q) around = Vec3(-around.z(), 0, around.x());
      found.push_back(
          {radius * around + y * Vec3::UnitY(), (around + up * Vec3::UnitY()).normalized(), depth});
    }
  };
  if (const auto* box = std::get_if<Box>(solid.shape)) {
    const Vec3 half = box->size / 2;
    for (int axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 4; ++side) {
        Vec3 outward = Vec3::Zero();
        outward[(axis + 1) % 3] = side & 1 ? 1 : -1;
        outward[(axis + 2) % 3] = side & 2 ? 1 : -1;
        const int count = samples(box->size[axis], spacing_, 1);
        for (int k = 0; k <= count; ++k) {
          Vec3 direction = outward;
          direction[axis] = k == 0 ? -1 : k == count ? 1 : 0;
          Vec3 place = half.cwiseProduct(outward);
          place[axis] = half[axis] * (2.0 * k / count - 1);
          found.push_back({place, direction.normalized(), half.minCoeff()});
        }
      }
  } else if (const auto* cylinder = std::get_if<Cylinder>(solid.shape)) {
    const Real depth = std::min(cylinder->radius, cylinder->height / 2);
    for (Real up : {-1.0, 1.0}) rim(cylinder->radius, up * cylinder->height / 2, up, depth);
  } else if (const auto* cone = std::get_if<Cone>(solid.shape)) {
    const Real depth = std::min(cone->radius, cone->height) / 2;
    rim(cone->radius, -cone->height / 2, -1, depth);
    found.push_back({Vec3(0, cone->height / 2, 0), Vec3::UnitY(), depth});
  } else if (const auto* frustum = std::get_if<Frustum>(solid.shape)) {
    const Real depth = std::min(std::min(frustum->radius, frustum->top_radius), frustum->height / 2);
    rim(frustum->radius, -frustum->height / 2, -1, depth);
    rim(frustum->top_radius, frustum->height / 2, 1, depth);
  } else if (solid.mesh && solid.mesh->solid && solid.mesh->hull.vertices().size() <= kMaxCorners) {
    const Aabb around = local_bounds(solid);
    const ConvexPolyhedron& hull = solid.mesh->hull;
    for (uint32_t v = 0; v < hull.vertices().size(); ++v)
      found.push_back({hull.vertex(v), outward_normal(hull, v), around.sizes().minCoeff() / 4});
  }
  return found;
}

void CornerContacts::find(const ClothPoints& points, const ClothContacts& of_points,
                          std::span<ClothBody> bodies, Real from, Real to, Real h) {
  bodies_ = bodies;
  near_.clear();
  corners_.clear();
  round_.clear();
  if (triangles_.empty()) return;
  bool fitted = false;
  const auto seek = [&](const Aabb& box, uint32_t body, auto&& visit) {
    if (!std::exchange(fitted, true)) {
      std::vector<Real> margin(points.size());
      for (std::size_t i = 0; i < margin.size(); ++i)
        margin[i] = points.thickness[i] + 2 * h * points.velocity[i].norm();
      tree_.fit(points.position, points.position, margin);
    }
    tree_.overlapping(box, [&](uint32_t triangle) {
      const auto is_held = [&](uint32_t i) { return of_points.is_held_inside(points, body, i); };
      if (std::ranges::none_of(triangles_[triangle], is_held)) visit(triangle);
    });
  };
  for (uint32_t b = 0; b < bodies.size(); ++b) {
    if (!bodies[b].collides) continue;
    const Obstacle& obstacle = bodies[b].obstacle();
    if (RoundContacts::concerns(obstacle.solid, longest_, thinnest_))
      seek(obstacle.swept_bounds(), b, [&](uint32_t t) { round_.add(t, b); });
    const Pose first = bodies[b].predicted(from), last = bodies[b].predicted(to);
    for (const Corner& corner : corners(obstacle.solid)) {
      const Vec3 p = first.point_to_world(corner.place), q = last.point_to_world(corner.place);
      const Real depth = std::min(corner.depth, 2 * spacing_);
      Aabb box(p.cwiseMin(q), p.cwiseMax(q));
      box.min().array() -= depth;
      box.max().array() += depth;
      const auto index = static_cast<uint32_t>(corners_.size());
      const std::size_t before = near_.size();
      seek(box, b, [&](uint32_t t) { near_.push_back({index, t}); });
      if (near_.size() > before) corners_.push_back({corner.place, corner.outward, depth, b});
    }
  }
}

const Vec3& CornerContacts::Places::of(uint32_t corner) {
  if (known_ != corner) {
    const Corner& c = of_.corners_[corner];
    place_ = of_.bodies_[c.body].end().point_to_world(c.place);
    known_ = corner;
  }
  return place_;
}

void CornerContacts::solve(ClothPoints& points, const ClothContacts& of_points, Real dt,
                           std::vector<VelocityCut>& cuts) {
  const auto is_pressed = [&](const Triangle& t, const ClothBody& body) {
    return sim::is_pressed(t, body, points, of_points);
  };
  round_.solve(triangles_, points, bodies_, dt, cuts, is_pressed);
  Places places(*this);
  for (const Near& near : near_) {
    const Corner& corner = corners_[near.corner];
    const Triangle& t = triangles_[near.triangle];
    const auto contact =
        touch(corner, places.of(near.corner), {points.at(t[0]), points.at(t[1]), points.at(t[2])},
              points.thickness[t[0]], 0, 0);
    if (!contact || is_pressed(t, bodies_[corner.body])) continue;
    separate(*contact, t, points, bodies_[corner.body], dt, cuts);
    places.forget();
  }
}

void CornerContacts::collect(const ClothPoints& points, const ClothContacts& of_points, Real reach,
                             std::vector<BodyContact>& found) const {
  const auto pressed = [&](const Triangle& t, const ClothBody& body) {
    return is_pressed(t, body, points, of_points);
  };
  round_.collect(triangles_, points, bodies_, reach, pressed, found);
  Places places(*this);
  for (const Near& near : near_) {
    const Corner& corner = corners_[near.corner];
    ClothBody& body = bodies_[corner.body];
    if (!body.is_dynamic()) continue;
    const Triangle& t = triangles_[near.triangle];
    const Real thickness = points.thickness[t[0]];
    const auto c = touch(corner, places.of(near.corner), {points.at(t[0]), points.at(t[1]), points.at(t[2])},
                         thickness, reach * thickness, 0);
    if (!c || is_pressed(t, body, points, of_points)) continue;
    // Where points touch the body as well, their contacts stop it.
    const auto is_close = [&](uint32_t i) { return of_points.is_close(points, corner.body, i); };
    if (std::ranges::none_of(t, is_close))
      found.push_back({t, c->weights, &body, c->normal, c->on_body, c->gap});
  }
}

void CornerContacts::find_supports(ClothPoints& points, const ClothContacts& of_points, Real dt) const {
  for (auto& of_cloth : points.triangle_supports) of_cloth.clear();
  const auto add = [&](uint32_t triangle, ClothBody& body, auto&& find) {
    const Triangle& t = triangles_[triangle];
    std::array<Vec3, 3> at;
    for (std::size_t k = 0; k < 3; ++k)
      at[k] = (points.inverse_mass[t[k]] > 0 ? points.free_end(t[k], dt) : points.position[t[k]]).head<3>();
    const std::optional<TriangleContact> contact = find(t, at, kSupportReach * points.thickness[t[0]]);
    if (!contact || is_pressed(t, body, points, of_points) ||
        std::ranges::any_of(t, [&](uint32_t i) { return !of_points.may_support(points, body, i); }))
      return;
    // The support may keep the triangle exactly at its distance, so that solve() finds no overlap.
    if (contact->gap <= 0) body.touch(0);
    Real free = 0;  // weight of the points that are not pinned
    for (std::size_t k = 0; k < 3; ++k)
      if (points.inverse_mass[t[k]] > 0) free += std::abs(contact->weights[k]);
    if (free < kLeastFree) return;
    TriangleSupport found{
        {t[0], padded(contact->normal), 0, padded(body.surface_motion(contact->on_body, contact->normal)),
         std::sqrt(points.friction[t[0]] * body.obstacle().friction), body.is_dynamic() ? &body : nullptr,
         contact->on_body},
        t,
        contact->weights};
    Vec4 motion = -found.surface;
    for (std::size_t k = 0; k < 3; ++k) motion += contact->weights[k] * (padded(at[k]) - points.start[t[k]]);
    found.gap = std::max(contact->gap - found.normal.dot(motion), 0.0);
    points.triangle_supports[points.cloth[t[0]]].push_back(found);
  };
  // A thin dynamic body such as a needle turns aside within a sub-step, and is left to solve().
  round_.for_each([&](uint32_t triangle, uint32_t b) {
    if (bodies_[b].is_dynamic()) return;
    add(triangle, bodies_[b], [&](const Triangle& t, const std::array<Vec3, 3>& at, Real reach) {
      return RoundContacts::touch(t, points, at, bodies_[b], reach, true);
    });
  });
  Places places(*this);
  for (const Near& near : near_) {
    const Corner& corner = corners_[near.corner];
    add(near.triangle, bodies_[corner.body],
        [&](const Triangle& t, const std::array<Vec3, 3>& at, Real reach) {
          return touch(corner, places.of(near.corner), at, points.thickness[t[0]], reach, kSupportOverhang);
        });
  }
}

std::optional<TriangleContact> CornerContacts::touch(const Corner& corner, const Vec3& p,
                                                     const std::array<Vec3, 3>& at, Real thickness,
                                                     Real reach, Real overhang) const {
  const Vec3 a = at[0], ab = at[1] - a, ac = at[2] - a;
  const Vec3 cross = ab.cross(ac);
  const Real size2 = cross.squaredNorm();
  if (!(size2 > 0)) return {};
  const Real keeps = kTriangleDistance * thickness;
  // Most features are far from the triangle's plane.
  const Real far = std::max(corner.depth, keeps + reach), scaled_height = cross.dot(a - p);
  if (scaled_height * scaled_height > size2 * far * far) return {};
  const Vec3 outward = bodies_[corner.body].end().vector_to_world(corner.outward);
  const Vec3 n = cross / std::sqrt(size2) * (cross.dot(outward) < 0 ? -1 : 1);
  const Real cosine = n.dot(outward);
  if (cosine < kLeastCosine) return {};
  const Real height = n.dot(a - p), gap = height - keeps;
  if (gap >= reach || height < -corner.depth) return {};
  const Vec3 hit = p + height / cosine * outward - a;
  const Real s = hit.cross(ac).dot(cross) / size2, r = ab.cross(hit).dot(cross) / size2;
  const std::array<Real, 3> weights = {1 - s - r, s, r};
  if (std::ranges::min(weights) < -overhang) return {};
  return TriangleContact{weights, p, n, gap};
}

}  // namespace offstage::sim
