#include "sim/contact/cloth_layer.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace offstage::sim {
namespace {

/// A line crosses a triangle if the cosine of its angle with the normal is at least this.
constexpr Real kLeastCosine = 0.3;
/// A line may pass beside a triangle by this weight, so that it cannot pass between two neighbours.
constexpr Real kOverhang = 0.01;
/// Crossings that are closer to each other than this belong to one layer, in thicknesses.
constexpr Real kSameLayer = 0.5;

}  // namespace

Real crossing(const LayerTriangle& triangle, const Vec3& middle, const Vec3& n) {
  const Vec3 to = triangle.at[0] - middle, ab = triangle.at[1] - triangle.at[0],
             ac = triangle.at[2] - triangle.at[0];
  const Vec3 cross = ab.cross(ac);
  const Real size2 = cross.squaredNorm(), along = cross.dot(n);
  if (!(along * along >= kLeastCosine * kLeastCosine * size2) || !(size2 > 0)) return kInfinity;
  const Real at = cross.dot(to) / along;
  const Vec3 hit = at * n - to;
  const Real s = hit.cross(ac).dot(cross) / size2, r = ab.cross(hit).dot(cross) / size2;
  return std::min({1 - s - r, s, r}) >= -kOverhang ? at : kInfinity;
}

ClothLayers layers_across(std::span<const LayerTriangle> triangles, const Vec3& middle, const Vec3& n,
                          Real reach) {
  struct Crossing {
    Real at;
    const LayerTriangle* triangle;
  };
  static thread_local std::vector<Crossing> found;
  found.clear();
  for (const LayerTriangle& t : triangles)
    if (const Real at = crossing(t, middle, n); std::abs(at) <= reach) found.push_back({at, &t});
  std::stable_sort(found.begin(), found.end(),
                   [](const Crossing& x, const Crossing& y) { return x.at < y.at; });
  ClothLayers layers;
  Real last = 0;  // crossing of the last layer
  const LayerTriangle* highest = nullptr;
  for (const Crossing& c : found) {
    if (highest && c.at - last < kSameLayer * c.triangle->thickness) continue;
    if (!layers.lowest) layers.lowest = c.triangle;
    layers.distance += c.triangle->thickness;
    last = c.at;
    highest = c.triangle;
  }
  if (highest) layers.distance += (layers.lowest->thickness + highest->thickness) / 2;
  return layers;
}

}  // namespace offstage::sim
