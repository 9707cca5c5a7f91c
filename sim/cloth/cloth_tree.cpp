#include "sim/cloth/cloth_tree.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "sim/core/disjoint_sets.h"

namespace offstage::sim {
namespace {

/// A patch is flat enough if all its normals have at least this cosine with a common direction.
constexpr float kLeaning = 0.3F;

/// The same limit for the triangles around a point. An angle a between them then appears as less than a /
/// cosine: it is at most 2 atan(tan(a / 2) / cosine).
constexpr float kStarLeaning = 0.7F;
/// Strain may increase the angles of a triangle by this factor.
constexpr Real kStrainedAngle = 1.15;

constexpr uint32_t kNone = ~0u;

/// Returns by triangle the neighbour across each edge; kNone at borders and where more than two triangles
/// meet.
std::vector<std::array<uint32_t, 3>> neighbours(std::span<const Triangle> triangles) {
  std::vector<std::array<uint32_t, 3>> beside(triangles.size(), {kNone, kNone, kNone});
  struct Edge {
    std::pair<uint32_t, uint32_t> ends;
    uint32_t triangle, corner;
  };
  std::vector<Edge> edges;
  for (uint32_t t = 0; t < triangles.size(); ++t)
    for (uint32_t k = 0; k < 3; ++k)
      edges.push_back({std::minmax(triangles[t][k], triangles[t][(k + 1) % 3]), t, k});
  std::ranges::stable_sort(edges, {}, &Edge::ends);
  for (std::size_t i = 0, end; i < edges.size(); i = end) {
    for (end = i + 1; end < edges.size() && edges[end].ends == edges[i].ends; ++end) {
    }
    if (end - i != 2) continue;
    beside[edges[i].triangle][edges[i].corner] = edges[i + 1].triangle;
    beside[edges[i + 1].triangle][edges[i + 1].corner] = edges[i].triangle;
  }
  return beside;
}

/// Returns twice the signed area of a triangle in the plane.
Real turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// Returns, for each triangle, the number of its connected piece: the smallest point index in the piece.
std::vector<uint32_t> pieces(std::span<const Triangle> triangles, std::size_t point_count) {
  DisjointSets sets(point_count);
  for (const Triangle& t : triangles) {
    sets.join(t[0], t[1]);
    sets.join(t[1], t[2]);
  }
  std::vector<uint32_t> piece;
  for (const Triangle& t : triangles) piece.push_back(sets.find(t[0]));
  return piece;
}

/// Returns the unit normal of a triangle, or zero if it has no area.
Vec4 unit_normal(const Triangle& t, std::span<const Vec4> x) {
  const Vec4 n = (x[t[1]] - x[t[0]]).cross3(x[t[2]] - x[t[0]]);
  const Real size = n.norm();
  return size > 0 ? Vec4(n / size) : Vec4(Vec4::Zero());
}

/// 62 directions that cover the sphere evenly: every direction is within 20 degrees of one of them. They have
/// the components 0 0 1, 1 1 1, 0 1 2 and 1 2 2 in any order and with any signs. The last two of the 64 are
/// zero.
struct Directions {
  alignas(32) std::array<std::array<float, 64>, 3> axis = {};

  Directions() {
    std::size_t count = 0;
    for (int x = -2; x <= 2; ++x)
      for (int y = -2; y <= 2; ++y)
        for (int z = -2; z <= 2; ++z) {
          const int length2 = x * x + y * y + z * z;
          if (length2 != 1 && length2 != 3 && length2 != 5 && length2 != 9) continue;
          const float length = std::sqrt(static_cast<float>(length2));
          for (std::size_t k = 0; k < 3; ++k)
            axis[k][count] = static_cast<float>(std::array{x, y, z}[k]) / length;
          ++count;
        }
  }
  /// Returns the mean of some of the directions; `some` has a bit for each.
  Vec3 mean(uint64_t some) const {
    Vec3 sum = Vec3::Zero();
    for (; some != 0; some &= some - 1) {
      const auto i = static_cast<std::size_t>(std::countr_zero(some));
      sum += Vec3(axis[0][i], axis[1][i], axis[2][i]);
    }
    return sum.normalized();
  }
};
const Directions kDirections;

}  // namespace

void ClothTree::build(std::span<const Triangle> triangles, std::span<const Vec4> points) {
  triangles_.assign(triangles.begin(), triangles.end());
  order_.resize(triangles.size());
  std::iota(order_.begin(), order_.end(), 0u);
  piece_ = pieces(triangles, points.size());
  beside_ = neighbours(triangles);
  std::stable_sort(order_.begin(), order_.end(),
                   [&](uint32_t a, uint32_t b) { return piece_[a] < piece_[b]; });
  boxes_.resize(triangles.size());
  normals_.resize(triangles.size());
  ring_leans_.assign(triangles.size(), 0);
  nodes_.clear();
  std::vector<Vec4> centres;
  for (const Triangle& t : triangles) centres.push_back((points[t[0]] + points[t[1]] + points[t[2]]) / 3);
  if (!triangles.empty()) build_below(centres, 0, static_cast<uint32_t>(triangles.size()));
  place_.resize(order_.size());
  for (uint32_t i = 0; i < order_.size(); ++i) place_[order_[i]] = i;
  leaf_.resize(order_.size());
  leaves_.clear();
  for (uint32_t k = 0; k < nodes_.size(); ++k) {
    Node& node = nodes_[k];
    if (node.second != 0) continue;
    std::fill_n(leaf_.begin() + node.first, node.count, k);
    node.leaf = static_cast<uint32_t>(leaves_.size());
    leaves_.emplace_back().clear();
  }
  build_stars(points);
  build_rings();
}

void ClothTree::build_stars(std::span<const Vec4> rest) {
  stars_.assign(rest.size(), {});
  std::vector<Real> angle(rest.size(), 0);
  std::vector<uint32_t> joined(rest.size(), 0);  // by point: neighbours in its star that share an edge
  for (std::size_t t = 0; t < triangles_.size(); ++t)
    for (std::size_t k = 0; k < 3; ++k) {
      const Triangle& p = triangles_[t];
      const std::size_t next = (k + 1) % 3, last = (k + 2) % 3;
      const Vec3 a = (rest[p[next]] - rest[p[k]]).head<3>(), b = (rest[p[last]] - rest[p[k]]).head<3>();
      angle[p[k]] += std::atan2(a.cross(b).norm(), a.dot(b));
      joined[p[k]] += beside_[t][k] != kNone;
      ++stars_[p[k]].count;
    }
  uint32_t first = 0;
  for (std::size_t i = 0; i < stars_.size(); ++i) {
    Star& star = stars_[i];
    star.first = first;
    first += star.count;
    // Every shared edge at the point counts once: for the triangle whose edge starts at the point.
    const bool closed = joined[i] == star.count, fan = joined[i] + 1 == star.count;
    const Real seen = angle[i] * kStrainedAngle / kStarLeaning;
    star.simple = (closed && seen < 4 * std::numbers::pi) || (fan && seen < 2 * std::numbers::pi);
  }
  around_.resize(first);
  std::vector<uint32_t> taken(stars_.size(), 0);
  for (uint32_t place = 0; place < order_.size(); ++place)
    for (uint32_t i : triangles_[order_[place]]) around_[stars_[i].first + taken[i]++] = place;
}

/// Finds for each triangle the two rings around it: the triangles that share a point with one that shares a
/// point with it.
void ClothTree::build_rings() {
  ring_.clear();
  first_in_ring_ = {0};
  std::vector<uint32_t> seen_by(order_.size(), kNone);  // by place: the last triangle whose rings contain it
  for (uint32_t at = 0; at < order_.size(); ++at) {
    const std::size_t first = ring_.size();
    const auto add = [&](uint32_t place) {
      if (std::exchange(seen_by[place], at) == at) return;
      const Node& node = nodes_[leaf_[place]];
      const auto own = std::ranges::find(ring_.begin() + static_cast<std::ptrdiff_t>(first), ring_.end(),
                                         node.leaf, &RingPart::leaf);
      const uint32_t lane = 1u << (place - node.first);
      own == ring_.end() ? ring_.push_back({node.leaf, lane}) : void(own->lanes |= lane);
    };
    const auto around = [&](uint32_t point) {
      return std::span(around_).subspan(stars_[point].first, stars_[point].count);
    };
    for (uint32_t corner : triangles_[order_[at]])
      for (uint32_t place : around(corner))
        for (uint32_t point : triangles_[order_[place]]) std::ranges::for_each(around(point), add);
    first_in_ring_.push_back(static_cast<uint32_t>(ring_.size()));
  }
}

void ClothTree::fit_star(Star& star) const {
  star.leans = false;
  star.views = 0;
  if (!star.simple) return;
  const auto around = std::span(around_).subspan(star.first, star.count);
  star.views = ~Views{0};
  Vec4 sum = Vec4::Zero();
  for (uint32_t place : around) {
    star.views &= normals_[place].steep_views;
    sum += normals_[place].at[0] + normals_[place].at[1];
  }
  const Real least = kStarLeaning * sum.norm();
  star.leans = star.views != 0 || std::ranges::all_of(around, [&](uint32_t place) {
                 const auto& [first, last] = normals_[place].at;
                 return std::min(sum.dot(first), sum.dot(last)) > least;
               });
}

/// Finds out whether the two rings around a triangle appear as one sheet from some direction. They do if all
/// of their triangles lean steeply towards this direction and if all stars are `simple`, so that there is no
/// notch or slit at any point.
void ClothTree::fit_rings() {
  views_around_.assign(stars_.size(), ~Views{0});
  for (const Triangle& t : triangles_) {
    const Views views = stars_[t[0]].views & stars_[t[1]].views & stars_[t[2]].views;
    for (uint32_t corner : t) views_around_[corner] &= views;
  }
  for (std::size_t at = 0; at < order_.size(); ++at) {
    const Triangle& t = triangles_[order_[at]];
    ring_leans_[at] = (views_around_[t[0]] & views_around_[t[1]] & views_around_[t[2]]) != 0;
  }
}

/// Whether the outline of a patch crosses itself, seen along a direction towards which the patch leans. The
/// test sweeps over the segments of the outline.
bool ClothTree::outline_crosses(std::span<const Vec4> points, const Node& node) const {
  if (node.count <= EightBoxes::kCount) return true;  // testing its triangles one by one costs no more
  const Vec3 normal = kDirections.mean(node.views);
  const Vec3 u = normal.unitOrthogonal(), v = normal.cross(u);
  struct Segment {
    uint32_t a, b;
    Eigen::Vector2d from, to;
    Real low, high;
  };
  std::vector<Segment> outline;
  const auto seen = [&](uint32_t i) {
    const Vec3 p = points[i].head<3>();
    return Eigen::Vector2d(u.dot(p), v.dot(p));
  };
  for (uint32_t i = node.first; i < node.first + node.count; ++i)
    for (std::size_t k = 0; k < 3; ++k) {
      const uint32_t other = beside_[order_[i]][k];
      if (other != kNone && place_[other] - node.first < node.count) continue;
      const Triangle& t = triangles_[order_[i]];
      const Eigen::Vector2d a = seen(t[k]), b = seen(t[(k + 1) % 3]);
      outline.push_back({t[k], t[(k + 1) % 3], a, b, std::min(a.x(), b.x()), std::max(a.x(), b.x())});
    }
  std::ranges::stable_sort(outline, {}, &Segment::low);
  for (std::size_t i = 0; i < outline.size(); ++i)
    for (std::size_t j = i + 1; j < outline.size() && outline[j].low <= outline[i].high; ++j) {
      const Segment &p = outline[i], &q = outline[j];
      if (p.a == q.a || p.a == q.b || p.b == q.a || p.b == q.b) continue;
      if (turn(p.from, p.to, q.from) * turn(p.from, p.to, q.to) <= 0 &&
          turn(q.from, q.to, p.from) * turn(q.from, q.to, p.to) <= 0)
        return true;
    }
  return false;
}

/// Builds the tree over a range of triangles. It first separates connected pieces, and then halves each piece
/// along its longest axis.
uint32_t ClothTree::build_below(const std::vector<Vec4>& centres, uint32_t first, uint32_t count) {
  const auto at = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  nodes_[at].first = first;
  nodes_[at].count = count;
  nodes_[at].second = 0;
  nodes_[at].connected = piece_[order_[first]] == piece_[order_[first + count - 1]];
  if (count <= EightBoxes::kCount) return at;
  uint32_t half = (count / 2 + EightBoxes::kCount - 1) / EightBoxes::kCount * EightBoxes::kCount;
  if (!nodes_[at].connected) {
    // The start of the piece in the middle or, if this is the first piece, its end.
    const auto begin = order_.begin() + first;
    const uint32_t middle = piece_[*(begin + half)];
    const auto same = [&](uint32_t t) { return piece_[t] == middle; };
    half = static_cast<uint32_t>(std::find_if(begin, begin + count, same) - begin);
    if (half == 0) half = static_cast<uint32_t>(std::find_if_not(begin, begin + count, same) - begin);
  } else {
    halve(centres, first, count, half);
  }
  build_below(centres, first, half);
  const uint32_t second = build_below(centres, first + half, count - half);
  nodes_[at].second = second;
  return at;
}

void ClothTree::halve(const std::vector<Vec4>& centres, uint32_t first, uint32_t count, uint32_t half) {
  Vec4 low = centres[order_[first]], high = low;
  for (uint32_t i = first; i < first + count; ++i) {
    low = low.cwiseMin(centres[order_[i]]);
    high = high.cwiseMax(centres[order_[i]]);
  }
  int axis;
  (high - low).head<3>().maxCoeff(&axis);
  const auto begin = order_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](uint32_t a, uint32_t b) {
    return centres[a][axis] != centres[b][axis] ? centres[a][axis] < centres[b][axis] : a < b;
  });
}

ClothTree::Normals ClothTree::normals_of(const std::array<Vec4, 2>& at) {
  Normals normals{at, 0, 0};
  for (std::size_t i = 0; i < 64; i += 8) {
    const auto along = [&](const Vec4& n) {
      __m256 sum = _mm256_setzero_ps();
      for (std::size_t k = 0; k < 3; ++k)
        sum = _mm256_add_ps(sum, _mm256_mul_ps(_mm256_set1_ps(static_cast<float>(n[static_cast<int>(k)])),
                                               _mm256_load_ps(&kDirections.axis[k][i])));
      return sum;
    };
    const __m256 least = _mm256_min_ps(along(at[0]), along(at[1]));
    const auto above = [&](float cosine) {
      const int bits = _mm256_movemask_ps(_mm256_cmp_ps(least, _mm256_set1_ps(cosine), _CMP_GT_OQ));
      return static_cast<Views>(static_cast<unsigned>(bits)) << i;
    };
    normals.views |= above(kLeaning);
    normals.steep_views |= above(kStarLeaning);
  }
  return normals;
}

void ClothTree::fit_triangle(uint32_t place, std::span<const Vec4> from, std::span<const Vec4> to,
                             std::span<const Real> margin) {
  const Triangle& t = triangles_[order_[place]];
  const Vec4 around = Vec4::Constant(std::max({margin[t[0]], margin[t[1]], margin[t[2]]}));
  const auto least = [&](std::span<const Vec4> x) -> Vec4 {
    return x[t[0]].cwiseMin(x[t[1]]).cwiseMin(x[t[2]]) - around;
  };
  const auto greatest = [&](std::span<const Vec4> x) -> Vec4 {
    return x[t[0]].cwiseMax(x[t[1]]).cwiseMax(x[t[2]]) + around;
  };
  boxes_[place] = MovingBox::around(least(from), greatest(from), least(to), greatest(to));
  normals_[place] = normals_of({unit_normal(t, from), unit_normal(t, to)});
  Node& node = nodes_[leaf_[place]];
  leaves_[node.leaf].set(place - node.first, boxes_[place]);
  node.fresh |= 1u << (place - node.first);
}

void ClothTree::fit_node(uint32_t at) {
  Node& node = nodes_[at];
  if (node.second != 0) {
    const Node &a = nodes_[at + 1], &b = nodes_[node.second];
    node.box = a.box;
    node.box.extend(b.box);
    node.views = a.views & b.views;
  } else {
    node.box = boxes_[node.first];
    node.views = normals_[node.first].views;
    for (uint32_t i = node.first + 1; i < node.first + node.count; ++i) {
      node.box.extend(boxes_[i]);
      node.views &= normals_[i].views;
    }
  }
}

/// Fits the nodes above newly fitted triangles; children come before their parents.
void ClothTree::fit_above() {
  for (auto k = static_cast<uint32_t>(nodes_.size()); k-- > 0;) {
    Node& node = nodes_[k];
    if (node.second != 0) node.fresh = (nodes_[k + 1].fresh | nodes_[node.second].fresh) != 0;
    if (node.fresh != 0) fit_node(k);
  }
}

void ClothTree::fit(std::span<const Vec4> from, std::span<const Vec4> to, std::span<const Real> margin) {
  for (uint32_t i = 0; i < order_.size(); ++i) fit_triangle(i, from, to, margin);
  for (Star& star : stars_) fit_star(star);
  fit_rings();
  fit_above();
}

void ClothTree::refit(std::span<const uint32_t> triangles, std::span<const Vec4> from,
                      std::span<const Vec4> to, std::span<const Real> margin) {
  for (Node& node : nodes_) node.fresh = 0;
  for (uint32_t t : triangles) fit_triangle(place_[t], from, to, margin);
  for (uint32_t t : triangles)
    for (uint32_t i : triangles_[t]) fit_star(stars_[i]);
  fit_rings();
  fit_above();
}

}  // namespace offstage::sim
