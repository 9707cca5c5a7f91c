#pragma once
/// Traversal of two bounding trees of the same or of different kinds, each in the frame of its own mesh. The
/// caller gives only the pose of one frame in the other; volumes are transformed during the descent (physics
/// H8). Nothing is allocated.

#include <algorithm>
#include <array>
#include <concepts>
#include <cstdint>
#include <utility>

#include "sim/collision/bounding_tree.h"
#include "sim/collision/volume_pair.h"

namespace offstage::sim {

/// Numbers of tests in queries.
struct TestCounts {
  uint64_t volumes = 0;  ///< pairs of volumes of the trees
  uint64_t pieces = 0;   ///< pairs of items, such as triangles or convex parts

  void add(const TestCounts& more) {
    volumes += more.volumes;
    pieces += more.pieces;
  }
};

/// A pair of nodes to be visited; `gap` is a lower bound of the distance of their items.
template <class A, class B>
struct NodePair {
  const typename BoundingTree<A>::Node* a;
  const typename BoundingTree<B>::Node* b;
  Real gap = 0;
};

/// Stack of pairs of nodes that remain to be visited. Each step down replaces a pair by two, one of which is
/// visited next. Therefore the size never exceeds the sum of the depths of both trees.
template <class A, class B>
class NodePairStack {
 public:
  bool empty() const { return size_ == 0; }
  void push(const NodePair<A, B>& pair) { pairs_[size_++] = pair; }
  NodePair<A, B> pop() { return pairs_[--size_]; }

 private:
  std::array<NodePair<A, B>, 2 * kMaxTreeDepth + 2> pairs_;
  std::size_t size_ = 0;
};

/// Splits a pair of nodes, not both leaves, into two by the children of the larger node.
template <class A, class B>
std::pair<NodePair<A, B>, NodePair<A, B>> descend(const BoundingTree<A>& tree_a,
                                                  const BoundingTree<B>& tree_b, const NodePair<A, B>& pair) {
  const auto& [a, b, gap] = pair;
  if (b->is_leaf() || (!a->is_leaf() && squared_size(a->volume) > squared_size(b->volume)))
    return {{&tree_a.first_child(*a), b}, {&tree_a.second_child(*a), b}};
  return {{a, &tree_b.first_child(*b)}, {a, &tree_b.second_child(*b)}};
}

/// Calls visit(item of a, item of b) for every pair of items whose leaves' volumes are within the placement's
/// margin, in an order that depends only on the trees. If visit returns bool, false ends the traversal.
/// Returns whether the traversal was complete. The tests are added to `counts`.
template <class A, class B, class Visit>
bool for_each_pair(const BoundingTree<A>& tree_a, const BoundingTree<B>& tree_b, const Placement& a_from_b,
                   Visit&& visit, TestCounts& counts) {
  const auto go_on = [&](uint32_t i, uint32_t j) {
    ++counts.pieces;
    if constexpr (std::same_as<decltype(visit(i, j)), bool>) return visit(i, j);
    visit(i, j);
    return true;
  };
  if (tree_a.empty() || tree_b.empty()) return true;
  NodePairStack<A, B> stack;
  stack.push({&tree_a.nodes()[0], &tree_b.nodes()[0]});
  while (!stack.empty()) {
    const NodePair<A, B> pair = stack.pop();
    ++counts.volumes;
    if (!overlap(pair.a->volume, pair.b->volume, a_from_b)) continue;
    if (pair.a->is_leaf() && pair.b->is_leaf()) {
      for (uint32_t i : tree_a.items(*pair.a))
        for (uint32_t j : tree_b.items(*pair.b))
          if (!go_on(i, j)) return false;
      continue;
    }
    const auto [first, second] = descend(tree_a, tree_b, pair);
    stack.push(second);
    stack.push(first);
  }
  return true;
}

template <class A, class B, class Visit>
bool for_each_pair(const BoundingTree<A>& tree_a, const BoundingTree<B>& tree_b, const Placement& a_from_b,
                   Visit&& visit) {
  TestCounts counts;
  return for_each_pair(tree_a, tree_b, a_from_b, visit, counts);
}

/// Search for the nearest pair of items by branch and bound. distance(item of a, item of b) must return the
/// distance of two items [m]. It is called for every pair that may be nearer than the smallest distance so
/// far, which is `limit` at first; nearer volumes are visited first. The placement's margin is not used. The
/// tests are added to `counts`.
template <class A, class B, class Distance>
void nearest_pair(const BoundingTree<A>& tree_a, const BoundingTree<B>& tree_b, const Placement& a_from_b,
                  Real limit, Distance&& distance, TestCounts& counts) {
  if (tree_a.empty() || tree_b.empty()) return;
  const auto bounded = [&](NodePair<A, B> pair) {
    ++counts.volumes;
    pair.gap = std::max(gap(pair.a->volume, pair.b->volume, a_from_b) - a_from_b.slack, 0.0);
    return pair;
  };
  NodePairStack<A, B> stack;
  stack.push(bounded({&tree_a.nodes()[0], &tree_b.nodes()[0]}));
  while (!stack.empty()) {
    const NodePair<A, B> pair = stack.pop();
    if (pair.gap >= limit) continue;
    if (pair.a->is_leaf() && pair.b->is_leaf()) {
      for (uint32_t i : tree_a.items(*pair.a))
        for (uint32_t j : tree_b.items(*pair.b)) {
          ++counts.pieces;
          limit = std::min(limit, distance(i, j));
        }
      continue;
    }
    auto [near, far] = descend(tree_a, tree_b, pair);
    near = bounded(near);
    far = bounded(far);
    if (far.gap < near.gap) std::swap(near, far);
    stack.push(far);
    stack.push(near);
  }
}

template <class A, class B, class Distance>
void nearest_pair(const BoundingTree<A>& tree_a, const BoundingTree<B>& tree_b, const Placement& a_from_b,
                  Real limit, Distance&& distance) {
  TestCounts counts;
  nearest_pair(tree_a, tree_b, a_from_b, limit, distance, counts);
}

}  // namespace offstage::sim
