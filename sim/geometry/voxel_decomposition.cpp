#include "sim/geometry/voxel_decomposition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/hull_merge.h"
#include "sim/geometry/winding_number.h"

namespace offstage::sim {
namespace {

using Index3 = Eigen::Array3i;

/// Lower bounds of the mean winding number of the inside: for a solid, and for both sides of a surface
/// together.
constexpr Real kHardlyInside = 0.6, kSurelyInside = 0.9;
/// Accepted excess of the hulls' volume, as a share of the volume.
constexpr Real kGoodEnough = 0.01;
/// Number of planes tried along each axis before the refinement around the best one.
constexpr int kCoarse = 20;
/// Number of planes of flat sides tried along each axis.
constexpr std::size_t kFlatSides = 4;
/// Penalty for halves of different size, as a share of the volume.
constexpr Real kBalance = 0.03;
/// A surface that extends less than this into a box, in voxels, only touches it.
constexpr Real kTouch = 1e-5;
/// How far a corner of a box is moved inwards for the test whether the solid is there, as a share of the way.
constexpr Real kNearby = 0.01;
/// Factor by which there are more boxes than wanted parts, before the parts that cost least are merged.
constexpr std::size_t kExcess = 2;
/// Share of the volume that a merger may add although there are few enough parts.
constexpr Real kFreeGain = 2e-4;

/// Voxels from `low` to `high`, without `high`.
struct Range {
  Index3 low, high;
};

/// The voxels of a mesh's box, and whether the centre of each is inside.
class VoxelGrid {
 public:
  VoxelGrid(const TriangleMesh& mesh, const Aabb& box, uint32_t resolution) : winding_(mesh) {
    size_ = box.sizes().maxCoeff() / resolution;
    counts_ = (box.sizes().array() / size_ - 1e-9).ceil().max(1).cast<int>();
    low_ = box.center() - size_ / 2 * counts_.matrix().cast<Real>();
    find_inside();
  }

  Range all() const { return {Index3::Zero(), counts_}; }
  Real voxel_volume() const { return size_ * size_ * size_; }
  Real size() const { return size_; }
  Vec3 node(const Index3& i) const { return low_ + size_ * i.matrix().cast<Real>(); }
  Vec3 centre(const Index3& i) const { return node(i) + Vec3::Constant(size_ / 2); }
  bool voxel_inside(const Index3& i) const { return inside_[slot(i)] != 0; }
  bool point_inside(const Vec3& p) const { return std::abs(winding_.at(p)) > 0.5; }

  std::vector<Index3> inside(const Range& range) const {
    std::vector<Index3> voxels;
    Index3 i;
    for (i.z() = range.low.z(); i.z() < range.high.z(); ++i.z())
      for (i.y() = range.low.y(); i.y() < range.high.y(); ++i.y())
        for (i.x() = range.low.x(); i.x() < range.high.x(); ++i.x())
          if (voxel_inside(i)) voxels.push_back(i);
    return voxels;
  }

 private:
  std::size_t slot(const Index3& i) const {
    return static_cast<std::size_t>(i.x() + counts_.x() * (i.y() + counts_.y() * i.z()));
  }

  /// A solid has winding numbers near 1 inside, or -1 if its surface is inside out. Near an open sheet they
  /// are just over 1/2 on hollow sides, possibly on both.
  void find_inside() {
    struct Sum {
      Real positive = 0, negative = 0;
      int count = 0;
    };
    inside_.resize(static_cast<std::size_t>(counts_.prod()));
    std::vector<Sum> sums(static_cast<std::size_t>(counts_.z()));
    tbb::parallel_for(0, counts_.z(), [&](int z) {
      Sum& sum = sums[static_cast<std::size_t>(z)];
      for (int y = 0; y < counts_.y(); ++y)
        for (int x = 0; x < counts_.x(); ++x) {
          const Index3 i(x, y, z);
          const Real w = winding_.at(centre(i));
          if (std::abs(w) <= 0.5) continue;
          inside_[slot(i)] = true;
          (w > 0 ? sum.positive : sum.negative) += std::abs(w);
          ++sum.count;
        }
    });
    Sum all;
    for (const Sum& s : sums)
      all = {all.positive + s.positive, all.negative + s.negative, all.count + s.count};
    const auto [less, more] = std::minmax(all.positive, all.negative);
    if (less + more < (less > more / 4 ? kSurelyInside : kHardlyInside) * all.count)
      std::fill(inside_.begin(), inside_.end(), false);
  }

  WindingNumber winding_;
  Real size_ = 0;
  Index3 counts_;
  Vec3 low_;
  std::vector<char> inside_;  // not bool, because threads write neighbouring elements
};

/// Returns those voxels that can be corners of the hull: the outermost ones of their rows along every axis.
std::vector<Index3> outermost(const std::vector<Index3>& voxels, const Range& range) {
  std::array<std::vector<std::pair<int, int>>, 3> rows;
  const Index3 extent = range.high - range.low;
  const auto row_of = [&](const Index3& i, int axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    return static_cast<std::size_t>(i[u] - range.low[u] + extent[u] * (i[v] - range.low[v]));
  };
  for (int axis = 0; axis < 3; ++axis) {
    auto& row = rows[static_cast<std::size_t>(axis)];
    row.assign(static_cast<std::size_t>(extent.prod() / extent[axis]),
               {std::numeric_limits<int>::max(), std::numeric_limits<int>::min()});
    for (const Index3& i : voxels) {
      auto& [low, high] = row[row_of(i, axis)];
      low = std::min(low, i[axis]);
      high = std::max(high, i[axis]);
    }
  }
  std::vector<Index3> out;
  for (const Index3& i : voxels) {
    bool extreme = true;
    for (int axis = 0; axis < 3 && extreme; ++axis) {
      const auto& [low, high] = rows[static_cast<std::size_t>(axis)][row_of(i, axis)];
      extreme = i[axis] == low || i[axis] == high;
    }
    if (extreme) out.push_back(i);
  }
  return out;
}

/// Volume of the hull of whole voxels, in voxels, from the hull K of their centres: the Minkowski sum of K
/// and a unit cube has the volume V(K) + areas of the projections of K along the axes + widths of K along the
/// axes + 1.
Real voxel_hull_volume(const std::vector<Index3>& voxels, const Range& range) {
  std::vector<Vec3> centres;
  for (const Index3& i : outermost(voxels, range)) centres.push_back(i.matrix().cast<Real>());
  const ConvexPolyhedron hull = convex_hull(centres);
  const TriangleMesh surface = hull.triangles();
  Real shadows = 0;
  for (const Triangle& t : surface.triangles) {
    const Vec3& a = surface.vertices[t[0]];
    shadows += (surface.vertices[t[1]] - a).cross(surface.vertices[t[2]] - a).lpNorm<1>() / 4;
  }
  return hull_volume(hull) + shadows + hull.box().sizes().sum() + 1;
}

/// Appends the corners of the part of a triangle inside a box; none if the triangle only touches the box
/// within `margin`.
void clip(const std::array<Vec3, 3>& triangle, const Aabb& box, Real margin, std::vector<Vec3>& corners) {
  std::array<Vec3, 9> polygon, clipped;  // each plane adds at most one corner
  std::copy(triangle.begin(), triangle.end(), polygon.begin());
  std::size_t count = 3;
  for (int plane = 0; plane < 6; ++plane) {
    const int axis = plane / 2;
    const Real sign = plane % 2 == 0 ? 1 : -1, bound = plane % 2 == 0 ? box.min()[axis] : box.max()[axis];
    Real highest = 0;
    std::size_t kept = 0;
    for (std::size_t k = 0; k < count; ++k) {
      const Vec3 &a = polygon[k], &b = polygon[(k + 1) % count];
      const Real ha = sign * (a[axis] - bound), hb = sign * (b[axis] - bound);
      highest = std::max(highest, ha);
      if (ha >= 0) clipped[kept++] = a;
      if ((ha > 0 && hb < 0) || (ha < 0 && hb > 0)) {
        clipped[kept] = a + ha / (ha - hb) * (b - a);
        clipped[kept++][axis] = bound;
      }
    }
    if (highest <= margin) return;
    std::swap(polygon, clipped);
    count = kept;
  }
  corners.insert(corners.end(), polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(count));
}

/// A box, and the hull of the solid's part in it.
struct Cluster {
  Aabb box;
  Range range;  ///< voxels whose centre is in the box
  std::vector<Index3> voxels;
  std::vector<uint32_t> triangles;  ///< triangles that intersect the box
  ConvexPolyhedron hull;
  Real excess = 0;  ///< volume of the hull over that of the voxels [m^3]
};

class VoxelDecomposer {
 public:
  VoxelDecomposer(const TriangleMesh& mesh, const VoxelGrid& grid) : mesh_(mesh), grid_(grid) {}

  std::vector<ConvexPolyhedron> run(std::size_t max_parts) {
    std::vector<uint32_t> all(mesh_.triangles.size());
    for (uint32_t t = 0; t < all.size(); ++t) all[t] = t;
    Aabb around(grid_.node(grid_.all().low), grid_.node(grid_.all().high));
    around.min().array() -= grid_.size();
    around.max().array() += grid_.size();
    std::vector<Cluster> clusters = {cluster(around, grid_.all(), all)};
    const Real whole = grid_.voxel_volume() * static_cast<Real>(clusters[0].voxels.size());
    while (clusters.size() < kExcess * max_parts) {
      Real excess = 0;
      for (const Cluster& c : clusters) excess += c.excess;
      const auto worst =
          std::max_element(clusters.begin(), clusters.end(),
                           [](const Cluster& a, const Cluster& b) { return a.excess < b.excess; });
      if (excess <= kGoodEnough * whole ||
          !halve(clusters, static_cast<std::size_t>(worst - clusters.begin())))
        break;
    }
    std::vector<ConvexPolyhedron> parts;
    for (Cluster& c : clusters)
      if (c.hull.dimension() == 3) parts.push_back(std::move(c.hull));
    return merge_hulls(std::move(parts), max_parts, kFreeGain * whole);
  }

 private:
  struct Plane {
    int axis = 0, position = 0;
    Real cost = std::numeric_limits<Real>::infinity();
  };

  Cluster cluster(const Aabb& box, const Range& range, const std::vector<uint32_t>& triangles) const {
    Cluster c{box, range, grid_.inside(range), {}, {}, 0};
    std::vector<Vec3> points;
    for (uint32_t t : triangles) {
      const std::array<Vec3, 3> corners = corners_of(t);
      Aabb around(corners[0]);
      if (!box.intersects(around.extend(corners[1]).extend(corners[2]))) continue;
      c.triangles.push_back(t);
      clip(corners, box, kTouch * grid_.size(), points);
    }
    for (int k = 0; k < 8; ++k) {
      const Vec3 corner = box.corner(static_cast<Aabb::CornerType>(k));
      // The corner itself may be on the surface.
      if (grid_.point_inside(corner + kNearby * (box.center() - corner))) points.push_back(corner);
    }
    // Where the surface has holes, only voxels show the inside.
    for (const Index3& i : outermost(c.voxels, range)) points.push_back(grid_.centre(i));
    c.hull = convex_hull(points);
    c.excess = std::max(0.0, hull_volume(c.hull) - grid_.voxel_volume() * static_cast<Real>(c.voxels.size()));
    return c;
  }

  std::array<Vec3, 3> corners_of(uint32_t t) const {
    const auto [i, j, k] = mesh_.triangles[t];
    return {mesh_.vertices[i], mesh_.vertices[j], mesh_.vertices[k]};
  }

  /// Position of a cut: that of the largest flat side within half a voxel of the plane, otherwise that of the
  /// plane.
  Real place(const Cluster& c, const Plane& plane) const {
    const Real middle = grid_.node(Index3::Constant(plane.position))[plane.axis];
    Real largest = 0, place = middle;
    for (uint32_t t : c.triangles) {
      const auto [p, q, r] = corners_of(t);
      const Real at = p[plane.axis], area = (q - p).cross(r - p).norm(), flat = kTouch * grid_.size();
      if (std::abs(at - middle) > grid_.size() / 2 || std::abs(q[plane.axis] - at) > flat ||
          std::abs(r[plane.axis] - at) > flat || area <= largest)
        continue;
      largest = area;
      place = at;
    }
    return place;
  }

  /// Halves a cluster; returns false if this gains nothing.
  bool halve(std::vector<Cluster>& clusters, std::size_t which) const {
    const Plane plane = best_plane(clusters[which]);
    if (!std::isfinite(plane.cost)) return false;
    Range low = clusters[which].range, high = low;
    low.high[plane.axis] = high.low[plane.axis] = plane.position;
    std::array<Aabb, 2> boxes = {clusters[which].box, clusters[which].box};
    boxes[0].max()[plane.axis] = boxes[1].min()[plane.axis] = place(clusters[which], plane);
    std::array<Cluster, 2> halves;
    tbb::parallel_for(std::size_t{0}, std::size_t{2}, [&](std::size_t k) {
      halves[k] = cluster(boxes[k], k == 0 ? low : high, clusters[which].triangles);
    });
    clusters[which] = std::move(halves[0]);
    clusters.push_back(std::move(halves[1]));
    return true;
  }

  /// Tries planes throughout the box, then around the best of them with ever smaller steps.
  Plane best_plane(const Cluster& c) const {
    Index3 low = c.voxels.front(), high = low;
    for (const Index3& i : c.voxels) {
      low = low.min(i);
      high = high.max(i + 1);
    }
    std::vector<Plane> planes;
    int step = 1;
    for (int axis = 0; axis < 3; ++axis) {
      const int stride = std::max(1, (high[axis] - low[axis]) / kCoarse);
      step = std::max(step, stride);
      for (int at = low[axis] + stride; at < high[axis]; at += stride) planes.push_back({axis, at});
    }
    add_flat_sides(c, low, high, planes);
    Plane best = cheapest(c, planes);
    while (step > 1) {
      step = (step + 1) / 2;
      planes.clear();
      for (int at : {best.position - step, best.position + step})
        if (at > low[best.axis] && at < high[best.axis]) planes.push_back({best.axis, at});
      const Plane next = cheapest(c, planes);
      if (next.cost < best.cost) best = next;
    }
    return best;
  }

  /// Adds the planes that contain most of the surface. The volume of the hulls jumps there, so neighbouring
  /// planes do not lead the search to them.
  void add_flat_sides(const Cluster& c, const Index3& low, const Index3& high,
                      std::vector<Plane>& planes) const {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<Plane> sides;  // the cost field holds minus the area
      for (int at = low[axis] + 1; at < high[axis]; ++at) sides.push_back({axis, at, 0});
      Index3 step = Index3::Zero();
      step[axis] = 1;
      for (const Index3& i : c.voxels) {
        const auto k = static_cast<std::size_t>(i[axis] - low[axis]);
        if (k < sides.size() && !grid_.voxel_inside(i + step)) sides[k].cost -= 1;
        if (k > 0 && !grid_.voxel_inside(i - step)) sides[k - 1].cost -= 1;
      }
      std::stable_sort(sides.begin(), sides.end(),
                       [](const Plane& a, const Plane& b) { return a.cost < b.cost; });
      sides.resize(std::min(sides.size(), kFlatSides));
      planes.insert(planes.end(), sides.begin(), sides.end());
    }
  }

  Plane cheapest(const Cluster& c, std::vector<Plane>& planes) const {
    tbb::parallel_for(std::size_t{0}, planes.size(),
                      [&](std::size_t k) { planes[k].cost = cost(c, planes[k]); });
    Plane best;
    for (const Plane& p : planes)
      if (p.cost < best.cost) best = p;
    return best;
  }

  /// Volume of the two hulls plus a penalty for halves of different size.
  static Real cost(const Cluster& c, const Plane& plane) {
    std::array<std::vector<Index3>, 2> halves;
    for (const Index3& i : c.voxels) halves[i[plane.axis] < plane.position ? 0 : 1].push_back(i);
    if (halves[0].empty() || halves[1].empty()) return std::numeric_limits<Real>::infinity();
    const Real difference = static_cast<Real>(halves[0].size()) - static_cast<Real>(halves[1].size());
    return voxel_hull_volume(halves[0], c.range) + voxel_hull_volume(halves[1], c.range) +
           kBalance * std::abs(difference);
  }

  const TriangleMesh& mesh_;
  const VoxelGrid& grid_;
};

}  // namespace

VoxelDecomposition decompose_by_voxels(const TriangleMesh& mesh, uint32_t resolution, uint32_t max_parts) {
  Aabb box;
  for (const Vec3& v : mesh.vertices) box.extend(v);
  if (box.isEmpty() || !(box.sizes().maxCoeff() > 0)) return {};
  const VoxelGrid grid(mesh, box, resolution);
  const std::size_t inside = grid.inside(grid.all()).size();
  if (inside == 0) return {};
  return {VoxelDecomposer(mesh, grid).run(max_parts), grid.voxel_volume() * static_cast<Real>(inside)};
}

}  // namespace offstage::sim
