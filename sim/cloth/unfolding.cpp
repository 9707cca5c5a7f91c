#include "sim/cloth/unfolding.h"

#include <algorithm>
#include <utility>

namespace offstage::sim {

using Vec2 = Eigen::Vector2d;

Unfolding::Unfolding(std::span<const Vec3> rest, std::span<const Triangle> triangles)
    : rest_(rest), triangles_(triangles) {
  struct Side {
    std::pair<uint32_t, uint32_t> ends;
    uint32_t triangle, corner;
  };
  std::vector<Side> sides;
  sides.reserve(3 * triangles.size());
  first_at_.assign(rest.size(), kNone);
  for (uint32_t t = 0; t < triangles.size(); ++t)
    for (uint32_t k = 0; k < 3; ++k) {
      sides.push_back({std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]), t, k});
      if (first_at_[triangles[t][k]] == kNone) first_at_[triangles[t][k]] = t;
    }
  std::ranges::sort(sides, {}, [](const Side& s) { return std::pair(s.ends, s.triangle); });
  neighbours_.assign(triangles.size(), {kNone, kNone, kNone});
  for (std::size_t i = 0, end; i < sides.size(); i = end) {
    for (end = i + 1; end < sides.size() && sides[end].ends == sides[i].ends; ++end) {
    }
    if (end - i != 2) continue;
    neighbours_[sides[i].triangle][sides[i].corner] = sides[i + 1].triangle;
    neighbours_[sides[i + 1].triangle][sides[i + 1].corner] = sides[i].triangle;
  }
}

FlatTriangle Unfolding::own_plane(uint32_t t) const {
  const Triangle& own = triangles_[t];
  const Vec3 ab = rest_[own[1]] - rest_[own[0]], ac = rest_[own[2]] - rest_[own[0]];
  const Real length = ab.norm(), along = ab.dot(ac) / length;
  return {t, {Vec2::Zero(), Vec2(length, 0), Vec2(along, ab.cross(ac).norm() / length)}};
}

std::vector<FlatTriangle> Unfolding::fan(uint32_t point, bool wide) const {
  std::vector<FlatTriangle> found;
  if (first_at_[point] == kNone) return found;
  std::vector<uint32_t> around = {point};
  found.push_back(own_plane(first_at_[point]));
  for (int ring = 0; ring < (wide ? 2 : 1); ++ring) {
    for (std::size_t i = 0; i < found.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k) {
        const uint32_t u = neighbours_[found[i].triangle][k];
        if (u == kNone || std::ranges::find(found, u, &FlatTriangle::triangle) != found.end()) continue;
        const auto is_near = [&](uint32_t p) { return std::ranges::find(around, p) != around.end(); };
        if (std::ranges::none_of(triangles_[u], is_near)) continue;
        found.push_back(unfold(u, found[i], k));
      }
    for (const FlatTriangle& f : found)
      for (uint32_t p : triangles_[f.triangle])
        if (std::ranges::find(around, p) == around.end()) around.push_back(p);
  }
  return found;
}

FlatTriangle Unfolding::unfold(uint32_t u, const FlatTriangle& from, std::size_t k) const {
  const Triangle& t = triangles_[from.triangle];
  FlatTriangle result{u, {}};
  const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
  const Vec2 origin = from.corners[k], edge = (from.corners[next] - origin).normalized();
  Vec2 outward(edge.y(), -edge.x());
  if (outward.dot(from.corners[last] - origin) > 0) outward = -outward;
  for (std::size_t j = 0; j < 3; ++j) {
    const uint32_t point = triangles_[u][j];
    if (point == t[k] || point == t[next]) {
      result.corners[j] = from.corners[point == t[k] ? k : next];
      continue;
    }
    const Vec3 side = (rest_[t[next]] - rest_[t[k]]).normalized(), to = rest_[point] - rest_[t[k]];
    const Real along = side.dot(to), away = side.cross(to).norm();
    result.corners[j] = origin + along * edge + away * outward;
  }
  return result;
}

}  // namespace offstage::sim
