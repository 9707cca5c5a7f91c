#include "sim/geometry/hull_sketch.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace offstage::sim {
namespace {

constexpr std::size_t kFewPoints = 160;
constexpr int kSpread = 96;
constexpr Real kSketchFlat = 1e-9;  // thinner sets count as flat; fraction of the extent

/// Returns directions that are spread evenly over the sphere, along a spiral.
std::vector<Vec3> spread_directions(int count) {
  std::vector<Vec3> list;
  // Cosine and sine of the golden angle, which turns each direction to the next.
  const Real c = -0.7373688780783197, s = 0.6754902942615238;
  Real x = 1, y = 0;
  for (int i = 0; i < count; ++i) {
    const Real z = 1 - (2 * i + 1.0) / count, r = std::sqrt(1 - z * z);
    list.emplace_back(r * x, r * y, z);
    const Real next = c * x - s * y;
    y = s * x + c * y;
    x = next;
  }
  return list;
}

/// A hull to which points are added one by one. The faces that are visible from a new point are replaced by
/// faces between their outline and the point.
class HullSketch {
 public:
  explicit HullSketch(std::span<const Vec3> points)
      : points_(points), owner_(points.size() * points.size()) {}

  Real volume() {
    if (!start()) return 0;
    for (uint32_t p = 0; p < points_.size(); ++p) add(p);
    Real six = 0;
    const Vec3& origin = points_[0];
    for (uint32_t f : alive_)
      six += (points_[faces_[f].corners[0]] - origin)
                 .dot((points_[faces_[f].corners[1]] - origin).cross(points_[faces_[f].corners[2]] - origin));
    return std::max(0.0, six / 6);
  }

 private:
  struct Face {
    std::array<uint32_t, 3> corners;
    Vec3 normal;
    Real offset;
    bool alive;
  };

  /// Returns the point with the largest measure(point).
  template <class Measure>
  uint32_t farthest(Measure&& measure) const {
    uint32_t best = 0;
    Real most = -1;
    for (uint32_t i = 0; i < points_.size(); ++i)
      if (const Real m = measure(points_[i]); m > most) {
        most = m;
        best = i;
      }
    return best;
  }

  /// Starts the hull with a tetrahedron of four points that are far apart. Returns false if the set is flat.
  bool start() {
    if (points_.size() < 4) return false;
    const Vec3& first = points_[0];
    const uint32_t a = farthest([&](const Vec3& p) { return (p - first).squaredNorm(); });
    const uint32_t b = farthest([&](const Vec3& p) { return (p - points_[a]).squaredNorm(); });
    const Vec3 along = points_[b] - points_[a];
    const uint32_t c = farthest([&](const Vec3& p) { return along.cross(p - points_[a]).squaredNorm(); });
    const Vec3 normal = along.cross(points_[c] - points_[a]).normalized();
    if (!normal.allFinite()) return false;
    const uint32_t d = farthest([&](const Vec3& p) { return std::abs(normal.dot(p - points_[a])); });
    flat_ = kSketchFlat * along.norm();
    const Real height = normal.dot(points_[d] - points_[a]);
    if (!(std::abs(height) > flat_)) return false;
    const uint32_t e = height < 0 ? b : c, f = height < 0 ? c : b;
    for (const auto& [i, j, k] :
         {std::array{a, e, f}, std::array{a, f, d}, std::array{f, e, d}, std::array{e, a, d}})
      add_face(i, j, k);
    return true;
  }

  void add_face(uint32_t i, uint32_t j, uint32_t k) {
    Vec3 normal = (points_[j] - points_[i]).cross(points_[k] - points_[i]).normalized();
    if (!normal.allFinite()) normal.setZero();  // no point sees a face without area
    const auto index = static_cast<uint32_t>(faces_.size());
    faces_.push_back({{i, j, k}, normal, normal.dot(points_[i]), true});
    alive_.push_back(index);
    owner(i, j) = owner(j, k) = owner(k, i) = index;
  }

  /// Returns the face on the left of the directed edge.
  uint32_t& owner(uint32_t from, uint32_t to) { return owner_[from * points_.size() + to]; }

  void add(uint32_t p) {
    const Vec3& point = points_[p];
    seen_.clear();
    for (uint32_t f : alive_)
      if (faces_[f].normal.dot(point) - faces_[f].offset > flat_) seen_.push_back(f);
    if (seen_.empty()) return;
    for (uint32_t f : seen_) faces_[f].alive = false;
    std::erase_if(alive_, [&](uint32_t f) { return !faces_[f].alive; });
    outline_.clear();
    for (uint32_t f : seen_) {
      const auto [i, j, k] = faces_[f].corners;
      for (const auto& [from, to] : {std::pair{i, j}, std::pair{j, k}, std::pair{k, i}})
        if (faces_[owner(to, from)].alive) outline_.emplace_back(from, to);
    }
    for (const auto& [from, to] : outline_) add_face(from, to, p);
  }

  std::span<const Vec3> points_;
  std::vector<uint32_t> owner_;
  std::vector<Face> faces_;  // all faces, including those that were replaced
  std::vector<uint32_t> alive_;
  std::vector<uint32_t> seen_;
  std::vector<std::pair<uint32_t, uint32_t>> outline_;
  Real flat_ = 0;
};

}  // namespace

std::vector<Vec3> extreme_points(std::span<const Vec3> points, int directions) {
  // All directions are compared at once for each point, in arrays that the compiler vectorizes.
  Eigen::Array<Real, Eigen::Dynamic, 3> unit(directions, 3);
  const std::vector<Vec3> list = spread_directions(directions);
  for (int k = 0; k < directions; ++k) unit.row(k) = list[static_cast<std::size_t>(k)].transpose().array();
  Eigen::ArrayXd farthest = Eigen::ArrayXd::Constant(directions, -kInfinity), at(directions),
                 best(directions);
  best.setZero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i];
    at = p.x() * unit.col(0) + p.y() * unit.col(1) + p.z() * unit.col(2);
    if (!(at > farthest).any()) continue;
    best = (at > farthest).select(static_cast<Real>(i), best);
    farthest = farthest.max(at);
  }
  std::vector<std::size_t> extreme;
  for (const Real index : best) extreme.push_back(static_cast<std::size_t>(index));
  std::sort(extreme.begin(), extreme.end());
  extreme.erase(std::unique(extreme.begin(), extreme.end()), extreme.end());
  std::vector<Vec3> some;
  for (std::size_t i : extreme) some.push_back(points[i]);
  return some;
}

Real sketched_hull_volume(std::span<const Vec3> points) {
  if (points.size() <= kFewPoints) return HullSketch(points).volume();
  const std::vector<Vec3> some = extreme_points(points, kSpread);
  return HullSketch(some).volume();
}

}  // namespace offstage::sim
