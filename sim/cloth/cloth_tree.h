#pragma once
/// Bounding-box tree over the triangles of all cloths, which is refitted when they move. It finds the pairs
/// of triangles that may touch, and skips patches that cannot cross themselves. Consider a connected patch
/// whose normals all lie in one half-space. If the outline of the patch, projected along the axis of this
/// half-space, does not cross itself, then the patch cannot cross itself either (Volino and
/// Magnenat-Thalmann, "Efficient self-collision detection on smoothly discretized surface animations using
/// geometrical shape regularity", 1994). The triangles around one point are skipped under the same condition,
/// unless their angles at the point may add up to more than a full turn, seen from that side. Two rings of
/// triangles around one triangle are treated in the same way.

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/cloth/cloth_points.h"
#include "sim/cloth/moving_box.h"

namespace offstage::sim {

class ClothTree {
 public:
  /// Builds the tree over the triangles that collide with cloth. `rest`: positions of the points in the
  /// unstrained cloths [m].
  void build(std::span<const Triangle> triangles, std::span<const Vec4> rest);
  /// Fits the boxes to the paths of the triangles from the positions `from` to the positions `to`, enlarged
  /// by the `margin` of each point [m].
  void fit(std::span<const Vec4> from, std::span<const Vec4> to, std::span<const Real> margin);
  /// Updates the boxes like fit(), but only for some of the triangles.
  void refit(std::span<const uint32_t> triangles, std::span<const Vec4> from, std::span<const Vec4> to,
             std::span<const Real> margin);

  /// Calls visit(a, b) once for each pair of triangles whose moving boxes may overlap, if one of the two was
  /// fitted in the last call of fit() or refit(). `points`: the argument `from` of that call. The order
  /// depends only on the tree and the boxes.
  template <class Visit>
  void pairs(std::span<const Vec4> points, Visit&& visit) const;
  /// Calls visit(triangle) for triangles whose moving boxes overlap a box at rest.
  template <class Visit>
  void overlapping(const Aabb& bounds, Visit&& visit) const;

 private:
  /// Bit mask of directions (see cloth_tree.cpp). The bit of a direction is set if all normals of a set of
  /// triangles lean towards this direction.
  using Views = uint64_t;
  struct Node {
    MovingBox box;
    Views views;             // directions towards which its normals lean
    uint32_t first, count;   // range of triangles in order_
    uint32_t second;         // index of the second child; 0: a leaf. The first child is the next node
    uint32_t leaf = 0;       // leaf: index in leaves_
    uint32_t fresh = 0;      // leaf: lanes that were fitted last; branch: whether a leaf below was fitted
    bool connected = false;  // whether its triangles are one connected piece

    bool leans() const { return connected && views != 0; }  // whether all normals lie in one half-space
  };

  /// All triangles around a point.
  struct Star {
    uint32_t first, count;  // range in around_, which has places in order_
    bool simple;            // whether it is one fan that cannot overlap itself while its normals lean enough
    bool leans = false;     // whether it is simple and its normals lie in one half-space
    Views views = 0;        // directions towards which its normals lean steeply; 0 unless it is simple
  };
  /// The unit normals of a triangle at both ends of its path.
  struct Normals {
    std::array<Vec4, 2> at;
    Views views, steep_views;
  };
  /// The triangles of a leaf that are within two rings around some triangle.
  struct RingPart {
    uint32_t leaf, lanes;
  };

  void build_stars(std::span<const Vec4> rest);
  void build_rings();
  static Normals normals_of(const std::array<Vec4, 2>& at);
  void fit_star(Star& star) const;
  void fit_rings();
  bool in_leaning_star(const Triangle& a, const Triangle& b) const {
    for (uint32_t i : a)
      if ((i == b[0] || i == b[1] || i == b[2]) && stars_[i].leans) return true;
    return false;
  }
  void fit_triangle(uint32_t place, std::span<const Vec4> from, std::span<const Vec4> to,
                    std::span<const Real> margin);
  void fit_node(uint32_t at);
  void fit_above();
  uint32_t build_below(const std::vector<Vec4>& centres, uint32_t first, uint32_t count);
  void halve(const std::vector<Vec4>& centres, uint32_t first, uint32_t count, uint32_t half);
  template <class Visit>
  void within(std::span<const Vec4> points, uint32_t node, Visit& visit) const;
  template <class Visit>
  void look(const Node& own, uint32_t lane, const Node& other, uint32_t lanes, Visit& visit) const;
  bool outline_crosses(std::span<const Vec4> points, const Node& node) const;
  template <class Visit>
  void between(uint32_t a, uint32_t b, Visit& visit) const;

  std::vector<Triangle> triangles_;
  std::vector<uint32_t> order_;
  std::vector<uint32_t> place_;                  // by triangle: its place in order_
  std::vector<uint32_t> piece_;                  // by triangle: its connected piece
  std::vector<std::array<uint32_t, 3>> beside_;  // by triangle: the neighbour across each edge
  std::vector<MovingBox> boxes_;                 // by place in order_, as normals_
  std::vector<Normals> normals_;
  std::vector<uint8_t> ring_leans_;      // by place: whether the two rings around it cannot cross themselves
  std::vector<RingPart> ring_;           // rings of all triangles, one after the other
  std::vector<uint32_t> first_in_ring_;  // by place: start of its ring in ring_; and the end
  std::vector<Views> views_around_;      // by point: views of its two rings
  std::vector<Star> stars_;              // by point
  std::vector<uint32_t> around_;
  std::vector<Node> nodes_;
  std::vector<uint32_t> leaf_;  // by place in order_: the leaf's node
  std::vector<EightBoxes> leaves_;
};

template <class Visit>
void ClothTree::pairs(std::span<const Vec4> points, Visit&& visit) const {
  if (!nodes_.empty()) within(points, 0, visit);
}

template <class Visit>
void ClothTree::within(std::span<const Vec4> points, uint32_t at, Visit& visit) const {
  const Node& node = nodes_[at];
  if (node.fresh == 0 || (node.leans() && !outline_crosses(points, node))) return;
  if (node.second != 0) {
    within(points, at + 1, visit);
    within(points, node.second, visit);
    between(at + 1, node.second, visit);
    return;
  }
  for (uint32_t i = 0; i < node.count; ++i) look(node, i, node, ~1u << i, visit);
}

/// Visits the pairs of one triangle with those triangles of a leaf that are in `lanes`.
template <class Visit>
void ClothTree::look(const Node& own, uint32_t lane, const Node& other, uint32_t lanes, Visit& visit) const {
  if ((own.fresh >> lane & 1) == 0) lanes &= other.fresh;
  const uint32_t at = own.first + lane;
  if (ring_leans_[at])
    for (uint32_t k = first_in_ring_[at]; k < first_in_ring_[at + 1]; ++k)
      if (ring_[k].leaf == other.leaf) lanes &= ~ring_[k].lanes;
  if (lanes == 0) return;
  const uint32_t a = order_[at];
  for (lanes &= leaves_[other.leaf].overlapping(boxes_[at]); lanes != 0; lanes &= lanes - 1) {
    const uint32_t b = order_[other.first + static_cast<uint32_t>(std::countr_zero(lanes))];
    if (!in_leaning_star(triangles_[a], triangles_[b])) visit(a, b);
  }
}

template <class Visit>
void ClothTree::between(uint32_t at_a, uint32_t at_b, Visit& visit) const {
  const Node &a = nodes_[at_a], &b = nodes_[at_b];
  if ((a.fresh | b.fresh) == 0 || !a.box.may_overlap(b.box)) return;
  if (a.second == 0 && b.second == 0) {
    for (uint32_t i = 0; i < a.count; ++i) look(a, i, b, ~0u, visit);
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
void ClothTree::overlapping(const Aabb& bounds, Visit&& visit) const {
  if (nodes_.empty()) return;
  const Vec4 low = padded(bounds.min()), high = padded(bounds.max());
  const MovingBox box = MovingBox::around(low, high, low, high);
  std::vector<uint32_t> open{0};
  while (!open.empty()) {
    const uint32_t at = open.back();
    const Node& node = nodes_[at];
    open.pop_back();
    if (!node.box.may_overlap(box)) continue;
    if (node.second != 0) {
      open.push_back(node.second);
      open.push_back(at + 1);
      continue;
    }
    for (uint32_t lanes = leaves_[node.leaf].overlapping(box); lanes != 0; lanes &= lanes - 1)
      visit(order_[node.first + static_cast<uint32_t>(std::countr_zero(lanes))]);
  }
}

}  // namespace offstage::sim
