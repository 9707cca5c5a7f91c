#include "sim/collision/coplanar_manifolds.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sim/collision/collision_mesh.h"
#include "sim/collision/contact_candidates.h"
#include "sim/collision/contact_frame.h"
#include "sim/geometry/closest_points.h"

namespace offstage::sim {
namespace {

/// Cosine: normals of coplanar triangles differ by less than 1e-4 rad.
constexpr Real kSameNormal = 1 - 5e-9;
/// All points on coplanar triangles are within this distance of one plane [m].
constexpr Real kSamePlane = 1e-6;
/// Points that are nearer to each other are the same, such as one over the common edge of two triangles [m].
constexpr Real kSamePoint = 1e-6;

/// The manifolds of one convex piece with coplanar triangles.
class CoplanarGroup {
 public:
  CoplanarGroup(const Manifold& first, const CollisionMesh& mesh, const Pose& mesh_pose, bool of_b)
      : first_(first), mesh_(mesh), pose_(mesh_pose), of_b_(of_b) {
    triangles_.push_back(triangle_of(first));
  }

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
    triangles_.push_back(triangle_of(m));
    continues_a_ &= m.continues_a;
    continues_b_ &= m.continues_b;
  }

  /// The joined manifold, with at most four points.
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
    for (uint32_t k = 0; k < m.count; ++k) {
      const ContactPoint& p = m.points[k];
      const bool is_known = std::any_of(points_.begin(), points_.end(), [&](const Candidate& c) {
        return (c.on_a - p.on_a).squaredNorm() < kSamePoint * kSamePoint;
      });
      if (!is_known) points_.push_back({p.on_a, p.on_b, p.separation, p.id, p.piece});
    }
  }

  /// The corners of the convex outline of the points, and the deepest point if it is inside. The separation
  /// is linear over a flat part of the piece, so the others add nothing.
  std::vector<Candidate> outline() const {
    if (points_.size() < 2) return points_;
    const ContactFrame frame = contact_frame(first_.normal);
    const auto at = [&](const Candidate& c) {
      return Eigen::Vector2d(frame.t.dot(c.on_a), frame.k.dot(c.on_a));
    };
    std::vector<Candidate> sorted = points_;
    std::sort(sorted.begin(), sorted.end(), [&](const Candidate& x, const Candidate& y) {
      const Eigen::Vector2d p = at(x), q = at(y);
      return std::pair(p.x(), p.y()) < std::pair(q.x(), q.y());
    });
    // Andrew's monotone chain: the lower side, then the upper one.
    std::vector<Candidate> corners;
    const auto wind = [&](auto begin, auto end) {
      const std::size_t first = corners.size();
      for (auto c = begin; c != end; ++c) {
        const auto is_inside = [&] {
          const Eigen::Vector2d o = at(corners[corners.size() - 2]), p = at(corners.back()) - o,
                                q = at(*c) - o;
          return p.x() * q.y() - p.y() * q.x() <= kSamePoint * q.norm();
        };
        while (corners.size() >= first + 2 && is_inside()) corners.pop_back();
        corners.push_back(*c);
      }
      corners.pop_back();  // it begins the other side
    };
    wind(sorted.begin(), sorted.end());
    wind(sorted.rbegin(), sorted.rend());
    const auto deepest =
        std::min_element(points_.begin(), points_.end(),
                         [](const Candidate& x, const Candidate& y) { return x.separation < y.separation; });
    const bool is_deeper = std::all_of(corners.begin(), corners.end(), [&](const Candidate& c) {
      return deepest->separation < c.separation - kSamePlane;
    });
    if (is_deeper) corners.push_back(*deepest);
    return corners;
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
  std::vector<uint8_t> is_taken(manifolds.size(), 0);
  std::size_t kept = from;
  for (std::size_t i = from; i < manifolds.size(); ++i) {
    if (is_taken[i]) continue;
    Manifold m = manifolds[i];
    if (m.source == face) {
      CoplanarGroup group(manifolds[i], mesh, mesh_pose, of_b);
      for (std::size_t k = i + 1; k < manifolds.size(); ++k)
        if (!is_taken[k] && group.takes(manifolds[k])) {
          group.add(manifolds[k]);
          is_taken[k] = 1;
        }
      m = group.joined();
    }
    manifolds[kept++] = m;
  }
  manifolds.resize(kept);
}

}  // namespace offstage::sim
