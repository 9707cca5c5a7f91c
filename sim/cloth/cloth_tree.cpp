#include "sim/cloth/cloth_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

namespace offstage::sim {
namespace {

constexpr uint32_t kLeaf = 4;
/// A patch is flat enough if all its normals have at least this cosine with a common direction.
constexpr Real kLeaning = 0.3;

constexpr uint32_t kNone = ~0u;

/// The triangle across each edge; none at borders and where more than two meet.
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

/// Twice the area of a triangle in the plane.
Real turn(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
}

/// The number of the connected piece of each triangle: its least point.
std::vector<uint32_t> pieces(std::span<const Triangle> triangles, std::size_t point_count) {
  std::vector<uint32_t> parent(point_count);
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  };
  for (const Triangle& t : triangles) {
    const std::array<uint32_t, 3> r = {root(t[0]), root(t[1]), root(t[2])};
    for (uint32_t k : r) parent[k] = std::min({r[0], r[1], r[2]});
  }
  std::vector<uint32_t> piece;
  for (const Triangle& t : triangles) piece.push_back(root(t[0]));
  return piece;
}

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
  nodes_.clear();
  std::vector<Vec4> centres;
  for (const Triangle& t : triangles) centres.push_back((points[t[0]] + points[t[1]] + points[t[2]]) / 3);
  if (!triangles.empty()) build_below(centres, 0, static_cast<uint32_t>(triangles.size()));
  place_.resize(order_.size());
  for (uint32_t i = 0; i < order_.size(); ++i) place_[order_[i]] = i;
  parent_.assign(nodes_.size(), 0);
  leaf_.resize(order_.size());
  for (uint32_t k = 0; k < nodes_.size(); ++k) {
    const Node& node = nodes_[k];
    if (node.second != 0)
      parent_[k + 1] = parent_[node.second] = k;
    else
      std::fill_n(leaf_.begin() + node.first, node.count, k);
  }
}

/// Whether the outline of a patch, seen along its mean normal, crosses itself: sweeps over its segments.
bool ClothTree::outline_crosses(std::span<const Vec4> points, const Node& node) const {
  if (node.count <= kLeaf) return true;  // no dearer to look at its triangles
  const Vec3 normal = (node.normal_low + node.normal_high).head<3>().normalized();
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

/// Parts between pieces first; a piece is halved along its longest axis.
uint32_t ClothTree::build_below(const std::vector<Vec4>& centres, uint32_t first, uint32_t count) {
  const auto at = static_cast<uint32_t>(nodes_.size());
  nodes_.emplace_back();
  nodes_[at].first = first;
  nodes_[at].count = count;
  nodes_[at].second = 0;
  nodes_[at].connected = piece_[order_[first]] == piece_[order_[first + count - 1]];
  if (count <= kLeaf) return at;
  uint32_t half = count / 2;
  if (!nodes_[at].connected) {
    // Where the piece in the middle begins or, if that is the first, ends.
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

void ClothTree::Box::extend(const Box& b) {
  low = low.cwiseMin(b.low);
  high = high.cwiseMax(b.high);
  least_move = least_move.cwiseMin(b.least_move);
  greatest_move = greatest_move.cwiseMax(b.greatest_move);
}

ClothTree::Box ClothTree::box_of(const Triangle& t, std::span<const Vec4> from, std::span<const Vec4> to,
                                 std::span<const Real> margin) const {
  const Vec4 &a = from[t[0]], &b = from[t[1]], &c = from[t[2]];
  const Vec4 move_a = to[t[0]] - a, move_b = to[t[1]] - b, move_c = to[t[2]] - c;
  const Vec4 around = Vec4::Constant(std::max({margin[t[0]], margin[t[1]], margin[t[2]]}));
  return {a.cwiseMin(b).cwiseMin(c) - around, a.cwiseMax(b).cwiseMax(c) + around,
          move_a.cwiseMin(move_b).cwiseMin(move_c), move_a.cwiseMax(move_b).cwiseMax(move_c)};
}

void ClothTree::fit_box(Node& node, uint32_t at) const {
  if (node.second != 0) {
    node.box = nodes_[at + 1].box;
    node.box.extend(nodes_[node.second].box);
    return;
  }
  node.box = boxes_[node.first];
  for (uint32_t i = node.first + 1; i < node.first + node.count; ++i) node.box.extend(boxes_[i]);
}

void ClothTree::fit(std::span<const Vec4> from, std::span<const Vec4> to, std::span<const Real> margin) {
  std::vector<std::array<Vec4, 2>> normals(order_.size());  // least and greatest at both ends of the way
  const auto unit_normal = [](const Vec4& a, const Vec4& b, const Vec4& c) {
    const Vec3 n = (b - a).head<3>().cross((c - a).head<3>());
    const Real size = n.norm();
    return size > 0 ? padded(n / size) : Vec4(Vec4::Zero());
  };
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Triangle& t = triangles_[order_[i]];
    boxes_[i] = box_of(t, from, to, margin);
    const Vec4 first = unit_normal(from[t[0]], from[t[1]], from[t[2]]);
    const Vec4 last = unit_normal(to[t[0]], to[t[1]], to[t[2]]);
    normals[i] = {first.cwiseMin(last), first.cwiseMax(last)};
  }
  for (auto k = static_cast<uint32_t>(nodes_.size()); k-- > 0;) {
    Node& node = nodes_[k];
    fit_box(node, k);
    if (node.second != 0) {
      const Node &a = nodes_[k + 1], &b = nodes_[node.second];
      node.normal_low = a.normal_low.cwiseMin(b.normal_low);
      node.normal_high = a.normal_high.cwiseMax(b.normal_high);
    } else {
      node.normal_low = normals[node.first][0];
      node.normal_high = normals[node.first][1];
      for (uint32_t i = node.first + 1; i < node.first + node.count; ++i) {
        node.normal_low = node.normal_low.cwiseMin(normals[i][0]);
        node.normal_high = node.normal_high.cwiseMax(normals[i][1]);
      }
    }
    const Vec4 middle = node.normal_low + node.normal_high;
    const Real size = middle.norm();
    const Vec4 least = (middle.cwiseProduct(node.normal_low)).cwiseMin(middle.cwiseProduct(node.normal_high));
    node.leans = node.connected && least.sum() > kLeaning * size;
  }
}

void ClothTree::refit(std::span<const uint32_t> triangles, std::span<const Vec4> from,
                      std::span<const Vec4> to, std::span<const Real> margin) {
  std::vector<uint8_t> changed(nodes_.size(), 0);
  for (uint32_t t : triangles) {
    boxes_[place_[t]] = box_of(triangles_[t], from, to, margin);
    changed[leaf_[place_[t]]] = 1;
  }
  for (auto k = static_cast<uint32_t>(nodes_.size()); k-- > 0;) {  // children come after their parents
    if (!changed[k]) continue;
    fit_box(nodes_[k], k);
    changed[parent_[k]] = 1;
  }
}

}  // namespace offstage::sim
