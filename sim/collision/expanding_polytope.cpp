#include "sim/collision/expanding_polytope.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {
namespace {

constexpr std::size_t kMaxPoints = 128;
constexpr std::size_t kMaxFaces = 2 * kMaxPoints;  // a closed surface of n points has 2 n - 4 triangles
// Tolerance of heights over a face, in units of the rounding of a point.
constexpr Real kHeightTolerance = 64;
constexpr Real kCurvedTolerance = 1e-10;  // tolerance for curved cores, as a fraction of the size
// At a depth of more than this fraction of the size, the nearest point gives the direction of the normal.
constexpr Real kDeep = 1e-6;
// If the iteration ends early, its result is accepted if the gap between the bounds is less than this
// fraction of the size.
constexpr Real kAcceptedGap = 1e-9;

using Index = uint16_t;

struct PolytopeFace {
  std::array<Index, 3> corner;     ///< counter-clockwise seen from outside
  std::array<Index, 3> neighbour;  ///< by side k, from corner k to the next: the face beyond it
  Vec3 normal;                     ///< unit, outward
  Real offset;                     ///< normal.w for all points w of its plane
  Real slack;                      ///< points at a height of less than this over the plane may be in it
  Real key;                        ///< lower bound of the depth; infinite for a removed face
  bool is_key_exact, alive;
};

struct HorizonEdge {
  Index face;
  uint8_t side;
};

std::size_t next(std::size_t k) {
  return k == 2 ? 0 : k + 1;
}

class ExpandingPolytope {
 public:
  ExpandingPolytope(const MinkowskiDifference& m, const Simplex& tetrahedron)
      : m_(m),
        rounding_(m.rounding()),
        size_(rounding_ / std::numeric_limits<Real>::epsilon()),
        tolerance_(m.has_vertices() ? kHeightTolerance * rounding_ : kCurvedTolerance * size_) {
    std::copy_n(tetrahedron.points.begin(), 4, points_.begin());
    const Vec3& p = points_[0].w;
    if ((points_[1].w - p).cross(points_[2].w - p).dot(points_[3].w - p) > 0)
      std::swap(points_[1], points_[2]);
    constexpr std::array<std::array<Index, 3>, 4> kCorners = {{{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}}};
    constexpr std::array<std::array<Index, 3>, 4> kNeighbours = {
        {{1, 3, 2}, {2, 3, 0}, {0, 3, 1}, {1, 2, 0}}};
    point_count_ = face_count_ = 4;
    for (std::size_t f = 0; f < 4; ++f) {
      faces_[f].neighbour = kNeighbours[f];
      set_face(faces_[f], kCorners[f]);
    }
  }

  /// Expands the polytope and returns the deepest point. `last` becomes the final face, or the best face so
  /// far if there is no memory for more points or rounding breaks the polytope.
  DeepestPoint expand(Simplex& last) {
    DeepestPoint best{.normal = Vec3::UnitY(), .distance = -kInfinity, .on_a = Vec3::Zero()};
    for (int iterations = 0;; ++iterations) {
      const Index nearest = nearest_face();
      const PolytopeFace& face = faces_[nearest];
      if (face.key == kInfinity) return best;  // only slivers are left
      const SupportPoint p = m_.lowest(-face.normal, points_[face.corner[0]].from);
      const Real height = face.normal.dot(p.w), gap = height - face.offset;
      const bool found = gap <= tolerance_ || (gap <= face.slack && is_known(p));
      if (found || -height > best.distance) best = answer(face, height, last);
      best.iterations = iterations;
      if (found || point_count_ == kMaxPoints || !add(p, nearest)) return best;
    }
  }

 private:
  /// Returns the depth along the normal of a face. Rounding can leave several faces nearly in one plane, none
  /// of which is under the origin. The edge nearest to the origin is then used; if it is deep, its point
  /// gives the direction.
  DeepestPoint answer(const PolytopeFace& face, Real height, Simplex& corners) const {
    corners.size = 3;
    for (std::size_t k = 0; k < 3; ++k) corners.points[k] = points_[face.corner[k]];
    const SimplexPoint foot = nearest_point(corners);
    const Real depth = std::sqrt(foot.squared);
    const bool converged = height - face.offset <= kAcceptedGap * size_;
    const bool beside = foot.size < 3 && face.offset > 0 && depth > kDeep * size_;
    return {.normal = beside ? Vec3(-foot.v / depth) : Vec3(-face.normal),
            .distance = beside ? -depth : -height,
            .on_a = foot.on_a(corners),
            .converged = converged};
  }

  /// Whether a support point was found before, within rounding.
  bool is_known(const SupportPoint& p) const {
    return std::any_of(points_.begin(), points_.begin() + static_cast<std::ptrdiff_t>(point_count_),
                       [&](const SupportPoint& q) { return q.w == p.w; });
  }

  /// Returns the face with the smallest distance from the origin. If the origin is not over the triangle, the
  /// distance of the triangle counts instead of the distance of its plane. So the face under the origin is
  /// chosen among several in one plane. The second distance is computed only when it is needed.
  Index nearest_face() {
    for (;;) {
      Index best = 0;
      for (std::size_t f = 1; f < face_count_; ++f)
        if (faces_[f].key < faces_[best].key) best = static_cast<Index>(f);
      PolytopeFace& face = faces_[best];
      if (face.is_key_exact || face.key == kInfinity || face.offset < -face.slack) return best;
      const SimplexPoint foot = nearest_on_triangle(w(face.corner[0]), w(face.corner[1]), w(face.corner[2]));
      if (foot.size < 3) face.key = std::sqrt(foot.squared);
      face.is_key_exact = true;
    }
  }

  const Vec3& w(Index i) const { return points_[i].w; }

  void set_face(PolytopeFace& f, const std::array<Index, 3>& corner) {
    f.corner = corner;
    f.alive = true;
    const Vec3 &p = w(corner[0]), e = w(corner[1]) - p, g = w(corner[2]) - p, n = e.cross(g);
    const Real area = n.norm(), size2 = std::max(e.squaredNorm(), g.squaredNorm());
    const bool sliver = !(area > 4 * rounding_ * std::sqrt(size2));
    f.is_key_exact = sliver;
    if (sliver) {  // a sliver has no direction; its neighbours are equally near
      f.normal = Vec3::Zero();
      f.offset = 0;
      f.slack = f.key = kInfinity;
      return;
    }
    f.normal = n / area;
    f.key = f.offset = f.normal.dot(p);
    f.slack = rounding_ * (4 + size2 / area);
  }

  /// Replaces the faces that are visible from the point by a fan around it; returns false if rounding breaks
  /// their outline.
  bool add(const SupportPoint& p, Index above) {
    const auto apex = static_cast<Index>(point_count_);
    points_[point_count_++] = p;
    horizon_size_ = 0;
    remove(above);
    for (std::size_t k = 0; k < 3; ++k) visit(across(above, k), p.w);
    return horizon_size_ >= 3 && is_loop() && fan(apex);
  }

  void remove(Index f) {
    faces_[f].alive = false;
    faces_[f].key = kInfinity;
    dead_[dead_size_++] = f;
  }

  /// Returns the edge as an edge of the neighbouring face.
  HorizonEdge across(Index f, std::size_t k) const {
    const Index other = faces_[f].neighbour[k];
    const auto& back = faces_[other].neighbour;
    const Index head = faces_[f].corner[next(k)];
    for (uint8_t side = 0; side < 3; ++side)
      if (back[side] == f && faces_[other].corner[side] == head) return {other, side};
    return {other, 0};
  }

  /// Visits a face over an edge. If the face is kept, the edge is part of the outline; otherwise the face is
  /// removed and its neighbours are visited.
  void visit(HorizonEdge e, const Vec3& p) {
    const PolytopeFace& f = faces_[e.face];
    if (!f.alive) return;
    if (f.normal.dot(p) <= f.offset) {
      horizon_[horizon_size_++] = e;
      return;
    }
    remove(e.face);
    visit(across(e.face, next(e.side)), p);
    visit(across(e.face, next(next(e.side))), p);
  }

  /// Whether the edges of the outline form a loop, clockwise seen from the kept faces.
  bool is_loop() const {
    for (std::size_t k = 0; k < horizon_size_; ++k) {
      const HorizonEdge e = horizon_[k], f = horizon_[k + 1 == horizon_size_ ? 0 : k + 1];
      if (faces_[e.face].corner[e.side] != faces_[f.face].corner[next(f.side)]) return false;
    }
    return true;
  }

  bool fan(Index apex) {
    if (face_count_ + horizon_size_ > kMaxFaces + dead_size_) return false;
    std::array<Index, kMaxFaces> slot;
    for (std::size_t k = 0; k < horizon_size_; ++k)
      slot[k] = dead_size_ > 0 ? dead_[--dead_size_] : static_cast<Index>(face_count_++);
    for (std::size_t k = 0; k < horizon_size_; ++k) {
      const HorizonEdge e = horizon_[k];
      PolytopeFace& kept = faces_[e.face];
      PolytopeFace& f = faces_[slot[k]];
      const Index before = slot[k == 0 ? horizon_size_ - 1 : k - 1],
                  after = slot[k + 1 == horizon_size_ ? 0 : k + 1];
      kept.neighbour[e.side] = slot[k];
      f.neighbour = {e.face, after, before};
      set_face(f, {kept.corner[next(e.side)], kept.corner[e.side], apex});
    }
    return true;
  }

  const MinkowskiDifference& m_;
  Real rounding_, size_, tolerance_;
  std::size_t point_count_ = 0, face_count_ = 0, horizon_size_ = 0, dead_size_ = 0;
  std::array<SupportPoint, kMaxPoints> points_;
  std::array<PolytopeFace, kMaxFaces> faces_;
  std::array<HorizonEdge, kMaxFaces> horizon_;
  std::array<Index, kMaxFaces> dead_;
};

/// Returns some direction perpendicular to `u`.
Vec3 any_perpendicular(const Vec3& u) {
  int axis;
  u.cwiseAbs().minCoeff(&axis);
  return u.cross(Vec3(Vec3::Unit(axis))).normalized();
}

/// Extends a simplex of points of A - B to a tetrahedron. Corners that lie in the line or plane of others are
/// replaced by support points.
class TetrahedronMaker {
 public:
  TetrahedronMaker(const MinkowskiDifference& m, Simplex& s) : m_(m), s_(s) {}

  /// Returns false if A - B is flat; the simplex then has one corner more than its dimension.
  bool make() {
    const Real size = m_.rounding() / std::numeric_limits<Real>::epsilon();
    for (std::size_t have = 1; have < 4; ++have) {
      span(have);
      if (s_.size > have && farthest_corner(have) > kWide * size) continue;
      s_.size = have;
      if (farthest_support(have) <= kHeightTolerance * m_.rounding()) return false;
      ++s_.size;
    }
    return true;
  }
  /// Returns a unit vector perpendicular to the point, line or plane that the simplex spans. Of all such
  /// vectors it is the nearest to `sense`.
  Vec3 across(const Vec3& sense) const {
    if (s_.size == 3) return normal_.dot(sense) < 0 ? Vec3(-normal_) : normal_;
    const Vec3 n = s_.size == 2 ? Vec3(sense - along_.dot(sense) * along_) : sense;
    if (n.norm() > 1e-9 * sense.norm()) return n.normalized();
    return s_.size == 2 ? any_perpendicular(along_) : Vec3(Vec3::UnitY());
  }

 private:
  // A corner that is nearer to the line or plane of the others than this fraction of the size is replaced.
  static constexpr Real kWide = 1e-6;

  const Vec3& w(std::size_t i) const { return s_.points[i].w; }

  void span(std::size_t have) {
    if (have == 2) along_ = (w(1) - w(0)).normalized();
    if (have == 3) normal_ = (w(1) - w(0)).cross(w(2) - w(0)).normalized();
  }
  /// Returns the distance of x from the point, line or plane of the first `have` corners.
  Real distance(std::size_t have, const Vec3& x) const {
    const Vec3 d = x - w(0);
    return have == 1 ? d.norm() : have == 2 ? d.cross(along_).norm() : std::abs(d.dot(normal_));
  }
  Real farthest_corner(std::size_t have) {
    for (std::size_t i = have + 1; i < s_.size; ++i)
      if (distance(have, w(i)) > distance(have, w(have))) std::swap(s_.points[i], s_.points[have]);
    return distance(have, w(have));
  }
  Real farthest_support(std::size_t have) {
    std::array<Vec3, 3> axes = {Vec3::UnitX(), Vec3::UnitY(), Vec3::UnitZ()};
    if (have == 2) axes[0] = any_perpendicular(along_), axes[1] = along_.cross(axes[0]);
    if (have == 3) axes[0] = normal_;
    Real best = -1;
    for (std::size_t k = 0; k < 4 - have; ++k)
      for (const Real sign : {1.0, -1.0}) {
        const SupportPoint p = m_.lowest(sign * axes[k], s_.points[0].from);
        if (const Real d = distance(have, p.w); d > best) {
          best = d;
          s_.points[have] = p;
        }
      }
    return best;
  }

  const MinkowskiDifference& m_;
  Simplex& s_;
  Vec3 along_, normal_;
};

}  // namespace

DeepestPoint deepest_point(const MinkowskiDifference& m, Simplex& s, const Vec3& sense) {
  const SimplexPoint nearest = nearest_point(s);
  const Vec3 on_a = nearest.on_a(s);
  TetrahedronMaker maker(m, s);
  if (!maker.make()) {
    const Real distance = std::sqrt(nearest.squared);
    const bool apart = distance > kHeightTolerance * m.rounding();
    return {.normal = apart ? Vec3(nearest.v / distance) : maker.across(sense),
            .distance = distance,
            .on_a = on_a};
  }
  DeepestPoint deepest = ExpandingPolytope(m, s).expand(s);
  if (deepest.distance > 0 && nearest.size < 4)
    deepest.on_a = on_a;  // they are separate after all: use GJK's nearest point
  return deepest;
}

}  // namespace offstage::sim
