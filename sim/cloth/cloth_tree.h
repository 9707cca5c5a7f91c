#pragma once
/// Tree of boxes over the triangles of all cloths, refitted as they move, that finds which may touch each
/// other. A connected patch whose normals all lean to one side, and whose outline seen from there does not
/// cross itself, cannot cross itself and is passed over whole (Volino and Magnenat-Thalmann, "Efficient
/// self-collision detection on smoothly discretized surface animations using geometrical shape regularity",
/// 1994).

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"

namespace offstage::sim {

class ClothTree {
 public:
  /// Triangles that may touch others, over the points of the unstrained cloths.
  void build(std::span<const Triangle> triangles, std::span<const Vec4> rest);
  /// Fits boxes around the triangles at `from`, larger by each point's `margin`, with the bounds of their
  /// ways to `to`.
  void fit(std::span<const Vec4> from, std::span<const Vec4> to, std::span<const Real> margin);
  /// The same of a few triangles, for meeting() and overlapping().
  void refit(std::span<const uint32_t> triangles, std::span<const Vec4> from, std::span<const Vec4> to,
             std::span<const Real> margin);

  /// Calls visit(a, b) for pairs of triangles whose boxes meet on their ways, each once, in an order that
  /// depends on the tree and the boxes alone. `points` as fitted.
  template <class Visit>
  void pairs(std::span<const Vec4> points, Visit&& visit) const;
  /// Calls visit(other) for the triangles that one of the tree meets on their ways, itself among them.
  template <class Visit>
  void meeting(uint32_t triangle, Visit&& visit) const {
    meeting(boxes_[place_[triangle]], visit);
  }
  /// Calls visit(triangle) for those that meet a box that stays where it is.
  template <class Visit>
  void overlapping(const Aabb& box, Visit&& visit) const {
    meeting({padded(box.min()), padded(box.max()), Vec4::Zero(), Vec4::Zero()}, visit);
  }

 private:
  /// Of points at first, and of the ways that they make. What moves together meets nothing by that.
  struct Box {
    Vec4 low, high, least_move, greatest_move;

    void extend(const Box& b);
    bool meets(const Box& b) const {
      const Vec4 nearer_a = (least_move - b.greatest_move).cwiseMin(0);
      const Vec4 nearer_b = (b.least_move - greatest_move).cwiseMin(0);
      return ((low - b.high + nearer_a).cwiseMax(b.low - high + nearer_b)).maxCoeff() <= 0;
    }
  };
  struct Node {
    Box box;
    Vec4 normal_low, normal_high;  // of the unit normals
    uint32_t first, count;         // triangles, in order_
    uint32_t second;               // node; the first child is the next one. 0: a leaf
    bool connected = false;        // all of it one piece
    bool leans = false;            // that, and all normals to one side
  };

  Box box_of(const Triangle& t, std::span<const Vec4> from, std::span<const Vec4> to,
             std::span<const Real> margin) const;
  void fit_box(Node& node, uint32_t at) const;
  uint32_t build_below(const std::vector<Vec4>& centres, uint32_t first, uint32_t count);
  void halve(const std::vector<Vec4>& centres, uint32_t first, uint32_t count, uint32_t half);
  template <class Visit>
  void within(std::span<const Vec4> points, uint32_t node, Visit& visit) const;
  bool outline_crosses(std::span<const Vec4> points, const Node& node) const;
  template <class Visit>
  void between(uint32_t a, uint32_t b, Visit& visit) const;
  template <class Visit>
  void meeting(const Box& box, Visit&& visit) const;

  std::vector<Triangle> triangles_;
  std::vector<uint32_t> order_;
  std::vector<uint32_t> place_;                  // of each triangle in order_
  std::vector<uint32_t> piece_;                  // connected piece of each triangle
  std::vector<std::array<uint32_t, 3>> beside_;  // triangle across each edge from a corner to the next
  std::vector<Box> boxes_;                       // in the order of order_
  std::vector<Node> nodes_;
  std::vector<uint32_t> parent_;  // of each node; the root's is itself
  std::vector<uint32_t> leaf_;    // of each place in order_
};

template <class Visit>
void ClothTree::pairs(std::span<const Vec4> points, Visit&& visit) const {
  if (!nodes_.empty()) within(points, 0, visit);
}

template <class Visit>
void ClothTree::within(std::span<const Vec4> points, uint32_t at, Visit& visit) const {
  const Node& node = nodes_[at];
  if (node.leans && !outline_crosses(points, node)) return;
  if (node.second != 0) {
    within(points, at + 1, visit);
    within(points, node.second, visit);
    between(at + 1, node.second, visit);
    return;
  }
  for (uint32_t i = node.first; i < node.first + node.count; ++i)
    for (uint32_t j = i + 1; j < node.first + node.count; ++j)
      if (boxes_[i].meets(boxes_[j])) visit(order_[i], order_[j]);
}

template <class Visit>
void ClothTree::between(uint32_t at_a, uint32_t at_b, Visit& visit) const {
  const Node &a = nodes_[at_a], &b = nodes_[at_b];
  if (!a.box.meets(b.box)) return;
  if (a.second == 0 && b.second == 0) {
    for (uint32_t i = a.first; i < a.first + a.count; ++i)
      for (uint32_t j = b.first; j < b.first + b.count; ++j)
        if (boxes_[i].meets(boxes_[j])) visit(order_[i], order_[j]);
    return;
  }
  if (b.second == 0 || (a.second != 0 && a.count >= b.count)) {
    between(at_a + 1, at_b, visit);
    between(a.second, at_b, visit);
  } else {
    between(at_a, at_b + 1, visit);
    between(at_a, b.second, visit);
  }
}

template <class Visit>
void ClothTree::meeting(const Box& box, Visit&& visit) const {
  if (nodes_.empty()) return;
  std::vector<uint32_t> open{0};
  while (!open.empty()) {
    const uint32_t at = open.back();
    const Node& node = nodes_[at];
    open.pop_back();
    if (!node.box.meets(box)) continue;
    if (node.second != 0) {
      open.push_back(node.second);
      open.push_back(at + 1);
      continue;
    }
    for (uint32_t i = node.first; i < node.first + node.count; ++i)
      if (boxes_[i].meets(box)) visit(order_[i]);
  }
}

}  // namespace offstage::sim
