#include "sim/collision/coplanar_manifolds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "sim/collision/collision_mesh.h"
#include "sim/collision/contact_candidates.h"
#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// Least cosine of the angle between the normals of coplanar triangles; the angle is about 1e-4 rad.
constexpr Real kSameNormal = 1 - 5e-9;
/// All points on coplanar triangles are within this distance of one plane [m].
constexpr Real kSamePlane = 1e-6;
/// Points that are nearer to each other than this are identical, such as two points over the common edge of
/// two triangles [m].
constexpr Real kSamePoint = 1e-6;

/// The manifolds of one convex piece with coplanar triangles.
class CoplanarGroup {
 public:
  CoplanarGroup(const Manifold& first, const CollisionMesh& mesh, const Pose& mesh_pose, bool of_b)
      : first_(first), mesh_(mesh), pose_(mesh_pose), of_b_(of_b) {}

  bool takes(const Manifold& m) const {
    if (m.source != first_.source || piece_of(m) != piece_of(first_)) return false;
    if (!(m.normal.dot(first_.normal) > kSameNormal)) return false;
    const auto is_in_plane = [&](const Vec3& p) {
      return std::abs(first_.normal.dot(p - on_mesh(first_.points[0]))) < kSamePlane;
    };
    return std::all_of(m.points.begin(), m.points.begin() + m.count,
                       [&](const ContactPoint& p) { return is_in_plane(on_mesh(p)); });
  }

  void add(const Manifold& m) {
    if (points_.empty()) add_points(first_);
    add_points(m);
    continues_a_ &= m.continues_a;
    continues_b_ &= m.continues_b;
  }

  /// Returns the joined manifold, with at most four points.
  Manifold joined() const {
    Manifold m = first_;
    if (points_.empty()) return m;
    m.continues_a &= continues_a_;
    m.continues_b &= continues_b_;
    reduce(m, outline(), kSamePlane);
    (of_b_ ? m.piece_b : m.piece_a) = triangle_at_middle(m);
    return m;
  }

 private:
  uint32_t piece_of(const Manifold& m) const { return of_b_ ? m.piece_a : m.piece_b; }
  uint32_t triangle_of(const Manifold& m) const { return of_b_ ? m.piece_b : m.piece_a; }
  const Vec3& on_mesh(const ContactPoint& p) const { return of_b_ ? p.on_b : p.on_a; }

  void add_points(const Manifold& m) {
    triangles_.push_back(triangle_of(m));
    for (uint32_t k = 0; k < m.count; ++k) {
      const ContactPoint& p = m.points[k];
      const bool is_known = std::any_of(points_.begin(), points_.end(), [&](const Candidate& c) {
        return (c.on_a - p.on_a).squaredNorm() < kSamePoint * kSamePoint;
      });
      if (!is_known) points_.push_back({p.on_a, p.on_b, p.separation, p.id, p.piece});
    }
  }

  const Candidate& farthest_from(const Vec3& place) const {
    return *std::max_element(points_.begin(), points_.end(), [&](const Candidate& x, const Candidate& y) {
      return (x.on_a - place).squaredNorm() < (y.on_a - place).squaredNorm();
    });
  }

  /// Returns the corners of the convex outline of the points, and also the deepest point if that is inside.
  /// The separation is linear over a flat part of the piece, so other points add nothing.
  std::vector<Candidate> outline() const {
    if (points_.size() < 2) return points_;
    // Points are ordered along the greatest extent, so that rounding does not decide the order of points on a
    // line.
    const Vec3& end = farthest_from(points_.front().on_a).on_a;
    const Vec3 along = (farthest_from(end).on_a - end).normalized(), across = first_.normal.cross(along);
    const auto at = [&](const Candidate& c) {
      return Eigen::Vector2d(along.dot(c.on_a), across.dot(c.on_a));
    };
    std::vector<Candidate> sorted = points_;
    std::sort(sorted.begin(), sorted.end(), [&](const Candidate& x, const Candidate& y) {
      const Eigen::Vector2d p = at(x), q = at(y);
      return std::pair(p.x(), p.y()) < std::pair(q.x(), q.y());
    });
    std::vector<Candidate> corners;
    add_side(sorted, at, corners);
    std::reverse(sorted.begin(), sorted.end());
    add_side(sorted, at, corners);
    const auto deepest =
        std::min_element(points_.begin(), points_.end(),
                         [](const Candidate& x, const Candidate& y) { return x.separation < y.separation; });
    const bool is_deeper = std::all_of(corners.begin(), corners.end(), [&](const Candidate& c) {
      return deepest->separation < c.separation - kSamePlane;
    });
    if (is_deeper) corners.push_back(*deepest);
    return corners;
  }

  /// Adds one side of the outline of sorted points by Andrew's monotone chain. Its last corner is omitted,
  /// because the other side begins there.
  static void add_side(std::span<const Candidate> sorted, const auto& at, std::vector<Candidate>& corners) {
    const std::size_t first = corners.size();
    for (const Candidate& c : sorted) {
      const auto is_passed = [&] {
        const Eigen::Vector2d from = at(corners[corners.size() - 2]), p = at(corners.back()) - from,
                              q = at(c) - from;
        return p.x() * q.y() - p.y() * q.x() <= kSamePoint * q.norm();
      };
      while (corners.size() >= first + 2 && is_passed()) corners.pop_back();
      corners.push_back(c);
    }
    corners.pop_back();
  }

  uint32_t triangle_at_middle(const Manifold& m) const {
    Vec3 middle = Vec3::Zero();
    for (uint32_t k = 0; k < m.count; ++k) middle += on_mesh(m.points[k]) / m.count;
    const Vec3 place = pose_.point_to_body(middle);
    uint32_t nearest = triangles_.front();
    Real least = std::numeric_limits<Real>::infinity();
    for (const uint32_t t : triangles_) {
      const Triangle& corners = mesh_.mesh.triangles[t];
      const auto corner = [&](std::size_t k) -> const Vec3& { return mesh_.mesh.vertices[corners[k]]; };
      const Real distance2 =
          (closest_on_triangle(place, corner(0), corner(1), corner(2)).point - place).squaredNorm();
      if (distance2 < least) least = distance2, nearest = t;
    }
    return nearest;
  }

  const Manifold& first_;
  const CollisionMesh& mesh_;
  const Pose& pose_;
  bool of_b_;
  bool continues_a_ = true, continues_b_ = true;
  std::vector<Candidate> points_;
  std::vector<uint32_t> triangles_;
};

}  // namespace

void join_coplanar(std::vector<Manifold>& manifolds, std::size_t from, const CollisionMesh& mesh,
                   const Pose& mesh_pose, bool of_b) {
  if (manifolds.size() < from + 2) return;
  const NormalSource face = of_b ? NormalSource::face_of_b : NormalSource::face_of_a;
  for (std::size_t i = from; i < manifolds.size(); ++i) {
    if (manifolds[i].source != face || manifolds[i].count == 0) continue;
    CoplanarGroup group(manifolds[i], mesh, mesh_pose, of_b);
    for (std::size_t k = i + 1; k < manifolds.size(); ++k)
      if (manifolds[k].count > 0 && group.takes(manifolds[k])) {
        group.add(manifolds[k]);
        manifolds[k].count = 0;
      }
    manifolds[i] = group.joined();
  }
  const auto joined = [](const Manifold& m) { return m.count == 0; };
  manifolds.erase(
      std::remove_if(manifolds.begin() + static_cast<std::ptrdiff_t>(from), manifolds.end(), joined),
      manifolds.end());
}

}  // namespace offstage::sim
