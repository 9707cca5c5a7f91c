#include "sim/collision/bounding_tree.h"

#include <cmath>

#include <tbb/parallel_for.h>

namespace offstage::sim {
namespace {

Aabb triangle_box(const TriangleMesh& mesh, uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
  return {p.cwiseMin(q).cwiseMin(r), p.cwiseMax(q).cwiseMax(r)};
}

std::vector<TreeItem> triangle_items(const TriangleMesh& mesh) {
  std::vector<TreeItem> items(mesh.triangles.size());
  for (uint32_t i = 0; i < items.size(); ++i) {
    const auto& [a, b, c] = mesh.triangles[i];
    items[i] = {triangle_box(mesh, i), (mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c]) / 3, i};
  }
  return items;
}

std::vector<TreeItem> box_items(std::span<const Aabb> boxes) {
  std::vector<TreeItem> items(boxes.size());
  for (uint32_t i = 0; i < items.size(); ++i) items[i] = {boxes[i], boxes[i].center(), i};
  return items;
}

void fit(Obb& box, std::span<const Vec3> points, bool fresh) {
  box = fresh ? fit_obb(points) : fit_obb(points, box.axes);
}

void fit(BoundingSphere& sphere, std::span<const Vec3> points, bool) {
  sphere = fit_sphere(points);
}

/// Fits each branch to its children, from the leaves up.
template <class ItemBox>
void fit_boxes(AabbTree& tree, std::span<AabbTree::Node> nodes, ItemBox&& item_box) {
  for (auto node = nodes.rbegin(); node != nodes.rend(); ++node) {
    Aabb box;
    if (node->is_leaf())
      for (uint32_t item : tree.items(*node)) box.extend(item_box(item));
    else
      box = tree.first_child(*node).volume.merged(tree.second_child(*node).volume);
    node->volume = box;
  }
}

/// Fits each oriented box or sphere to all points of its subtree. The result is tighter than a fit to the
/// volumes of the children.
template <class Tree>
void fit_points(Tree& tree, std::span<typename Tree::Node> nodes, const TriangleMesh& mesh, bool fresh) {
  std::vector<Vec3> points;
  points.reserve(3 * tree.items().size());
  for (uint32_t item : tree.items())
    for (uint32_t v : mesh.triangles[item]) points.push_back(mesh.vertices[v]);
  tbb::parallel_for(std::size_t{0}, nodes.size(), [&](std::size_t i) {
    fit(nodes[i].volume, std::span(points).subspan(3 * nodes[i].first, 3 * nodes[i].count), fresh);
  });
}

template <class Tree>
void fit_sets(const Tree& tree, std::span<typename Tree::Node> nodes,
              std::span<const std::span<const Vec3>> sets) {
  std::vector<Vec3> points;
  for (typename Tree::Node& node : nodes) {
    points.clear();
    for (const uint32_t item : tree.items(node))
      points.insert(points.end(), sets[item].begin(), sets[item].end());
    fit(node.volume, points, true);
  }
}

Real reach_of(const Aabb& v) {
  return v.min().cwiseAbs().cwiseMax(v.max().cwiseAbs()).norm();
}
Real reach_of(const Obb& v) {
  return v.centre.norm() + v.half.norm();
}
Real reach_of(const BoundingSphere& v) {
  return v.centre.norm() + v.radius;
}

}  // namespace

template <class Volume>
BoundingTree<Volume>::BoundingTree(const TriangleMesh& mesh, TreeSplit split) {
  build(triangle_items(mesh), split);
  fit_to(mesh, true);
}

template <class Volume>
BoundingTree<Volume>::BoundingTree(std::span<const Aabb> boxes,
                                   TreeSplit split) requires std::same_as<Volume, Aabb> {
  build(box_items(boxes), split);
  if constexpr (std::same_as<Volume, Aabb>) refit(boxes);
}

template <class Volume>
BoundingTree<Volume>::BoundingTree(std::span<const std::span<const Vec3>> items, TreeSplit split) {
  std::vector<Aabb> boxes(items.size());
  for (std::size_t i = 0; i < items.size(); ++i)
    for (const Vec3& p : items[i]) boxes[i].extend(p);
  build(box_items(boxes), split);
  if constexpr (std::same_as<Volume, Aabb>)
    refit(boxes);
  else
    fit_sets(*this, std::span<Node>(nodes_), items);
}

template <class Volume>
BoundingTree<Volume> BoundingTree<Volume>::of_one(const Volume& volume) {
  BoundingTree tree;
  tree.nodes_ = {{volume, 1, 0, 1}};
  tree.items_ = {0};
  return tree;
}

template <class Volume>
void BoundingTree<Volume>::build(std::vector<TreeItem> items, TreeSplit split) {
  const std::vector<TreeRange> ranges = split_tree(items, split);
  nodes_.reserve(ranges.size());
  for (const auto& [size, first, count] : ranges) nodes_.push_back({Volume(), size, first, count});
  items_.reserve(items.size());
  for (const TreeItem& item : items) items_.push_back(item.index);
}

template <class Volume>
void BoundingTree<Volume>::refit(const TriangleMesh& mesh) {
  fit_to(mesh, false);
}

template <class Volume>
void BoundingTree<Volume>::refit(std::span<const Aabb> boxes) requires std::same_as<Volume, Aabb> {
  if constexpr (std::same_as<Volume, Aabb>)
    fit_boxes(*this, nodes_, [&](uint32_t i) -> const Aabb& { return boxes[i]; });
}

template <class Volume>
void BoundingTree<Volume>::fit_to(const TriangleMesh& mesh, bool fresh) {
  if constexpr (std::same_as<Volume, Aabb>)
    fit_boxes(*this, nodes_, [&](uint32_t i) { return triangle_box(mesh, i); });
  else
    fit_points(*this, std::span<Node>(nodes_), mesh, fresh);
}

template <class Volume>
Real BoundingTree<Volume>::reach() const {
  return nodes_.empty() ? 0 : reach_of(nodes_.front().volume);
}

template class BoundingTree<Aabb>;
template class BoundingTree<Obb>;
template class BoundingTree<BoundingSphere>;

}  // namespace offstage::sim
