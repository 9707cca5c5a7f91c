#include "render/loop_subdivision.h"

#include <algorithm>
#include <tuple>

namespace offstage::render {
namespace {

/// An edge with its one or two triangles: `left` and `right` are the opposite corners.
struct Edge {
  uint32_t a, b;  // a < b
  uint32_t left, right;
  bool boundary;
};

/// A side of a triangle, with its index in the list of triangles.
struct Side {
  uint32_t a, b, opposite, place;
};

std::vector<Side> sorted_sides(std::span<const uint32_t> triangles) {
  std::vector<Side> sides;
  sides.reserve(triangles.size());
  for (uint32_t t = 0; t + 2 < triangles.size(); t += 3) {
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t a = triangles[t + k], b = triangles[t + (k + 1) % 3];
      sides.push_back({std::min(a, b), std::max(a, b), triangles[t + (k + 2) % 3], t + k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& x, const Side& y) {
    return std::tie(x.a, x.b, x.place) < std::tie(y.a, y.b, y.place);
  });
  return sides;
}

/// Calls visit(first, last) for the sides of each edge.
template <class Visit>
void for_each_edge(const std::vector<Side>& sides, Visit&& visit) {
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end].a == sides[i].a && sides[end].b == sides[i].b) ++end;
    visit(i, end);
    i = end;
  }
}

/// Returns whether a boundary with these directions before and after a vertex has a corner there. A zero
/// direction counts as a corner.
bool turns(const Eigen::Vector2f& before, const Eigen::Vector2f& after) {
  return !(before.dot(after) > 0.5f * before.norm() * after.norm());
}

}  // namespace

std::vector<BoundaryEdge> boundary_edges(std::span<const uint32_t> triangles) {
  std::vector<BoundaryEdge> result;
  const std::vector<Side> sides = sorted_sides(triangles);
  for_each_edge(sides, [&](std::size_t first, std::size_t end) {
    if (end - first != 1) return;
    const uint32_t place = sides[first].place;
    const uint32_t next = place % 3 == 2 ? place - 2 : place + 1;
    result.push_back({triangles[place], triangles[next]});
  });
  return result;
}

LoopSubdivision::LoopSubdivision(std::span<const uint32_t> triangles,
                                 std::span<const Eigen::Vector2f> places) {
  const std::size_t vertex_count = places.size();
  const std::vector<Side> sides = sorted_sides(triangles);
  std::vector<Edge> edges;
  std::vector<uint32_t> edge_of(triangles.size());  // edge of each side
  for_each_edge(sides, [&](std::size_t first, std::size_t end) {
    const Side &s = sides[first], &last = sides[end - 1];
    for (std::size_t k = first; k < end; ++k) edge_of[sides[k].place] = static_cast<uint32_t>(edges.size());
    edges.push_back({s.a, s.b, s.opposite, last.opposite, end - first != 2});
  });

  // Neighbours of each vertex along inner edges and along boundary edges.
  std::vector<uint32_t> first_edge(vertex_count + 1, 0), boundary_count(vertex_count, 0);
  for (const Edge& e : edges) {
    ++first_edge[e.a + 1], ++first_edge[e.b + 1];
    if (e.boundary) ++boundary_count[e.a], ++boundary_count[e.b];
  }
  for (std::size_t v = 0; v < vertex_count; ++v) first_edge[v + 1] += first_edge[v];
  std::vector<uint32_t> edges_of(first_edge.back()), next(first_edge.begin(), first_edge.end() - 1);
  for (uint32_t e = 0; e < edges.size(); ++e)
    edges_of[next[edges[e].a]++] = e, edges_of[next[edges[e].b]++] = e;

  first_term_.reserve(vertex_count + edges.size() + 1);
  terms_.reserve(7 * vertex_count + 4 * edges.size());
  const auto begin_vertex = [this] { first_term_.push_back(static_cast<uint32_t>(terms_.size())); };
  for (uint32_t v = 0; v < vertex_count; ++v) {
    begin_vertex();
    const uint32_t valence = first_edge[v + 1] - first_edge[v];
    const bool on_boundary = boundary_count[v] > 0;
    std::array<uint32_t, 2> ends = {v, v};  // neighbours along the boundary on both sides
    if (boundary_count[v] == 2) {
      std::size_t found = 0;
      for (uint32_t k = first_edge[v]; k < first_edge[v + 1]; ++k) {
        const Edge& e = edges[edges_of[k]];
        if (e.boundary) ends[found++] = e.a == v ? e.b : e.a;
      }
    }
    if (valence == 0 || (on_boundary && turns(places[v] - places[ends[0]], places[ends[1]] - places[v]))) {
      terms_.push_back({v, 1});
      continue;
    }
    const float n = static_cast<float>(valence);
    const float fraction = on_boundary ? 1.0f / 8 : valence == 3 ? 3.0f / 16 : 3.0f / (8 * n);
    terms_.push_back({v, 1 - fraction * (on_boundary ? 2 : n)});
    for (uint32_t k = first_edge[v]; k < first_edge[v + 1]; ++k) {
      const Edge& e = edges[edges_of[k]];
      if (!on_boundary || e.boundary) terms_.push_back({e.a == v ? e.b : e.a, fraction});
    }
  }
  for (const Edge& e : edges) {
    begin_vertex();
    const float end = e.boundary ? 1.0f / 2 : 3.0f / 8;
    terms_.push_back({e.a, end});
    terms_.push_back({e.b, end});
    if (e.boundary) continue;
    terms_.push_back({e.left, 1.0f / 8});
    terms_.push_back({e.right, 1.0f / 8});
  }
  begin_vertex();

  triangles_.reserve(4 * triangles.size());
  const auto count = static_cast<uint32_t>(vertex_count);
  for (std::size_t t = 0; t + 2 < triangles.size(); t += 3) {
    const uint32_t a = triangles[t], b = triangles[t + 1], c = triangles[t + 2];
    const uint32_t ab = count + edge_of[t], bc = count + edge_of[t + 1], ca = count + edge_of[t + 2];
    for (const uint32_t index : {a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca}) triangles_.push_back(index);
  }
}

}  // namespace offstage::render
