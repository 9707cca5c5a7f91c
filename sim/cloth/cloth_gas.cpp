#include "sim/cloth/cloth_gas.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace offstage::sim {
namespace {

/// A smaller fraction of the overpressure counts as none.
constexpr Real kLeastGas = 1e-3;

}  // namespace

void ClothGas::assign(std::span<const Triangle> triangles) {
  // Border edges, sorted by their start: they have no counterpart in the opposite direction.
  std::map<std::pair<uint32_t, uint32_t>, int> count;
  for (const Triangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) ++count[{t[k], t[(k + 1) % 3]}];
  std::multimap<uint32_t, uint32_t> left;
  for (const auto& [edge, n] : count)
    if (!count.contains({edge.second, edge.first})) left.emplace(edge);
  edges_.clear();
  holes_.clear();
  while (!left.empty()) {
    const std::size_t first = edges_.size();
    for (auto at = left.begin(); at != left.end(); at = left.find(edges_.back().to)) {
      edges_.push_back({at->first, at->second});
      left.erase(at);
    }
    holes_.push_back({first, edges_.size()});
  }
}

Vec3 ClothGas::centre(const Hole& hole, std::span<const Vec3> points) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t k = hole.first; k < hole.end; ++k) sum += points[edges_[k].from];
  return sum / static_cast<Real>(hole.end - hole.first);
}

Real ClothGas::volume(std::span<const Vec3> points, std::span<const Triangle> triangles) const {
  if (triangles.empty()) return 0;
  // Coordinates relative to one of the points keep their precision far from the origin.
  const Vec3& o = points[triangles[0][0]];
  Real six_fold = 0;
  const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
    six_fold += (a - o).dot((b - o).cross(c - o));
  };
  for (const Triangle& t : triangles) add(points[t[0]], points[t[1]], points[t[2]]);
  for (const Hole& hole : holes_) {
    const Vec3 c = centre(hole, points);
    for (std::size_t k = hole.first; k < hole.end; ++k) add(points[edges_[k].to], points[edges_[k].from], c);
  }
  return six_fold / 6;
}

Real ClothGas::hole_area(std::span<const Vec3> points) const {
  Real area = 0;
  for (const Hole& hole : holes_) {
    const Vec3 c = centre(hole, points);
    Vec3 doubled = Vec3::Zero();
    for (std::size_t k = hole.first; k < hole.end; ++k)
      doubled += (points[edges_[k].from] - c).cross(points[edges_[k].to] - c);
    area += doubled.norm() / 2;
  }
  return area;
}

void ClothGas::leak(std::span<const Vec3> points, Real volume, Real pressure, Real density, Real h) {
  if (holes_.empty() || !(volume > 0) || !(remaining_fraction_ > 0)) return;
  // The remaining fraction s decreases as ds/dt = -s Q / V, with the flow Q = kDischarge A sqrt(2 p s /
  // density). If area and volume are constant during a step, 1 / sqrt(s) grows linearly with the time.
  const Real flow = kDischarge * hole_area(points) * std::sqrt(2 * std::abs(pressure) / density);
  const Real root = 1 / (1 / std::sqrt(remaining_fraction_) + h * flow / (2 * volume));
  remaining_fraction_ = root * root;
  if (remaining_fraction_ < kLeastGas) remaining_fraction_ = 0;
}

}  // namespace offstage::sim
