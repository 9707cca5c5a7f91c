#pragma once
/// An independent check of a cloth's self-collision: counts the pairs of its triangles that intersect and
/// have no common corner. The two sides of a tear count as having a common corner, because their points were
/// the same before the tear.

#include <vector>

#include "sim/cloth/cloth.h"
#include "sim/collision/bounding_tree.h"
#include "sim/geometry/intersection.h"

namespace offstage::sim {

inline std::size_t crossings(const ClothView& cloth) {
  std::vector<Aabb> boxes;
  for (const Triangle& t : cloth.triangles) {
    Aabb& box = boxes.emplace_back();
    for (uint32_t corner : t) box.extend(cloth.points[corner]);
  }
  const AabbTree tree(boxes);
  const auto corners = [&](const Triangle& t) {
    return TriangleVertices{cloth.points[t[0]], cloth.points[t[1]], cloth.points[t[2]]};
  };
  std::size_t count = 0;
  for (uint32_t i = 0; i < boxes.size(); ++i)
    tree.overlapping(boxes[i], [&](uint32_t j) {
      const Triangle &a = cloth.triangles[i], &b = cloth.triangles[j];
      for (uint32_t p : a)
        for (uint32_t q : b)
          if (cloth.sources[p] == cloth.sources[q]) return;
      count += j > i && boxes[i].intersects(boxes[j]) && triangles_intersect(corners(a), corners(b));
    });
  return count;
}

}  // namespace offstage::sim
