#include "sim/geometry/voronoi_pieces.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <tbb/parallel_for.h>

namespace offstage::sim {
namespace {

/// Number of points on the surface for each centre, and number of iterations.
constexpr std::size_t kSamplesEach = 40;
constexpr int kLloyd = 40;

/// Returns points that are spread over the polygons in proportion to their areas.
std::vector<Vec3> surface_samples(const SolidPiece& solid, std::size_t count) {
  struct Corner3 {
    Vec3 a, b, c;
  };
  std::vector<Corner3> triangles;
  std::vector<Real> until;  // sums of areas
  Real total = 0;
  for (std::size_t k = 0; k < solid.polygon_count(); ++k)
    for (uint32_t i = solid.first[k] + 1; i + 1 < solid.first[k + 1]; ++i) {
      const auto corner = [&](uint32_t j) { return solid.points[solid.corners[j]]; };
      triangles.push_back({corner(solid.first[k]), corner(i), corner(i + 1)});
      const auto& [a, b, c] = triangles.back();
      until.push_back(total += (b - a).cross(c - a).norm());
    }
  std::vector<Vec3> samples;
  if (!(total > 0)) return samples;
  std::size_t at = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Real place = total * (static_cast<Real>(i) + 0.5) / static_cast<Real>(count);
    while (at + 1 < until.size() && until[at] < place) ++at;
    const auto& [a, b, c] = triangles[at];
    // The R2 sequence of Roberts fills the square evenly; the half beyond the diagonal is folded back.
    Real u = std::fmod(0.5 + 0.7548776662466927 * static_cast<Real>(i + 1), 1.0);
    Real v = std::fmod(0.5 + 0.5698402909980532 * static_cast<Real>(i + 1), 1.0);
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    samples.push_back(a + u * (b - a) + v * (c - a));
  }
  return samples;
}

/// Returns points, each of which is the farthest from all points before it.
std::vector<Vec3> far_points(const std::vector<Vec3>& samples, std::size_t count) {
  std::vector<Vec3> chosen = {samples.front()};
  std::vector<Real> distance(samples.size(), kInfinity);
  while (chosen.size() < count) {
    for (std::size_t i = 0; i < samples.size(); ++i)
      distance[i] = std::min(distance[i], (samples[i] - chosen.back()).squaredNorm());
    const auto farthest = std::max_element(distance.begin(), distance.end());
    if (!(*farthest > 0)) break;
    chosen.push_back(samples[static_cast<std::size_t>(farthest - distance.begin())]);
  }
  return chosen;
}

std::size_t nearest(const std::vector<Vec3>& centres, const Vec3& p) {
  std::size_t best = 0;
  Real least = kInfinity;
  for (std::size_t k = 0; k < centres.size(); ++k)
    if (const Real d = (centres[k] - p).squaredNorm(); d < least) {
      least = d;
      best = k;
    }
  return best;
}

/// Returns the cell of one centre. The bisecting planes with the other centres, in ascending order of
/// distance, cut off all points that are nearer to another centre.
SolidPiece cell_of(const SolidPiece& solid, const std::vector<Vec3>& centres, std::size_t k, Real tolerance) {
  const Vec3& centre = centres[k];
  std::vector<std::pair<Real, std::size_t>> others;
  for (std::size_t j = 0; j < centres.size(); ++j)
    if (j != k) others.emplace_back((centres[j] - centre).norm(), j);
  std::sort(others.begin(), others.end());
  SolidPiece cell = solid;
  for (const auto& [distance, j] : others) {
    if (cell.points.empty()) break;
    Real reach = 0;
    for (const Vec3& p : cell.points) reach = std::max(reach, (p - centre).norm());
    if (distance > 2 * reach) break;
    // The lower centre's side of the plane is always below, so that neighbours are cut by the same plane.
    const std::size_t low = std::min(j, k), high = std::max(j, k);
    const Vec3 normal = (centres[high] - centres[low]).normalized();
    const SolidPiece::Plane plane{normal, normal.dot(centres[low] + centres[high]) / 2};
    cell = std::move(cut(cell, plane, tolerance)[k == low ? 1 : 0]);
  }
  return cell;
}

}  // namespace

std::vector<Vec3> spread_centres(const SolidPiece& solid, std::size_t count) {
  const std::vector<Vec3> samples = surface_samples(solid, kSamplesEach * count);
  if (samples.empty()) return {};
  std::vector<Vec3> centres = far_points(samples, count);
  std::vector<std::size_t> owner(samples.size());
  for (int iteration = 0; iteration < kLloyd; ++iteration) {
    tbb::parallel_for(std::size_t{0}, samples.size(),
                      [&](std::size_t i) { owner[i] = nearest(centres, samples[i]); });
    std::vector<Vec3> sums(centres.size(), Vec3::Zero());
    std::vector<int> counts(centres.size(), 0);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      sums[owner[i]] += samples[i];
      ++counts[owner[i]];
    }
    for (std::size_t k = 0; k < centres.size(); ++k)
      if (counts[k] > 0) centres[k] = sums[k] / counts[k];
  }
  return centres;
}

Real surface_area(const SolidPiece& solid) {
  Real twice = 0;
  for (std::size_t k = 0; k < solid.polygon_count(); ++k) {
    const Vec3& origin = solid.points[solid.corners[solid.first[k]]];
    Vec3 sum = Vec3::Zero();
    for (uint32_t i = solid.first[k] + 1; i + 1 < solid.first[k + 1]; ++i)
      sum += (solid.points[solid.corners[i]] - origin).cross(solid.points[solid.corners[i + 1]] - origin);
    twice += sum.norm();
  }
  return twice / 2;
}

std::vector<SolidPiece> voronoi_pieces(const SolidPiece& solid, const std::vector<Vec3>& centres,
                                       Real tolerance) {
  std::vector<SolidPiece> pieces(centres.size());
  tbb::parallel_for(std::size_t{0}, centres.size(),
                    [&](std::size_t k) { pieces[k] = cell_of(solid, centres, k, tolerance); });
  return pieces;
}

}  // namespace offstage::sim
