#include "sim/geometry/hull_merge.h"

#include <algorithm>
#include <limits>
#include <span>
#include <utility>

#include <tbb/parallel_for.h>

#include "sim/geometry/convex_hull.h"
#include "sim/geometry/mass_properties.h"

namespace offstage::sim {
namespace {

constexpr Real kApart = std::numeric_limits<Real>::infinity();

ConvexPolyhedron common_hull(const ConvexPolyhedron& a, const ConvexPolyhedron& b) {
  std::vector<Vec3> points(a.vertices().begin(), a.vertices().end());
  points.insert(points.end(), b.vertices().begin(), b.vertices().end());
  return convex_hull(points);
}

class Merger {
 public:
  explicit Merger(std::vector<ConvexPolyhedron> parts) : parts_(std::move(parts)) {
    for (const ConvexPolyhedron& p : parts_) volumes_.push_back(hull_volume(p));
    find_gains(false);
  }

  std::vector<ConvexPolyhedron> run(std::size_t max_parts, Real room) {
    while (parts_.size() > 1) {
      Pair best = cheapest();
      if (best.gain > room && parts_.size() <= max_parts) break;
      if (best.gain == kApart) {
        find_gains(true);
        best = cheapest();
      }
      room -= std::max(best.gain, 0.0);
      join(best);
    }
    return std::move(parts_);
  }

 private:
  struct Pair {
    std::size_t a = 0, b = 1;
    Real gain = kApart;
  };

  Real gain(std::size_t a, std::size_t b, bool even_apart) const {
    if (!even_apart && !parts_[a].box().intersects(parts_[b].box())) return kApart;
    return hull_volume(common_hull(parts_[a], parts_[b])) - volumes_[a] - volumes_[b];
  }

  void find_gains(bool even_apart) {
    const std::size_t n = parts_.size();
    gains_.assign(n, std::vector<Real>(n, kApart));
    tbb::parallel_for(std::size_t{0}, n, [&](std::size_t a) {
      for (std::size_t b = a + 1; b < n; ++b) gains_[a][b] = gain(a, b, even_apart);
    });
  }

  Pair cheapest() const {
    Pair best;
    for (std::size_t a = 0; a < parts_.size(); ++a)
      for (std::size_t b = a + 1; b < parts_.size(); ++b)
        if (gains_[a][b] < best.gain) best = {a, b, gains_[a][b]};
    return best;
  }

  /// The hull replaces the first part; the second is removed.
  void join(const Pair& pair) {
    const auto erase = [&](auto& list) { list.erase(list.begin() + static_cast<std::ptrdiff_t>(pair.b)); };
    parts_[pair.a] = common_hull(parts_[pair.a], parts_[pair.b]);
    volumes_[pair.a] = hull_volume(parts_[pair.a]);
    erase(parts_);
    erase(volumes_);
    erase(gains_);
    for (std::vector<Real>& row : gains_) erase(row);
    tbb::parallel_for(std::size_t{0}, parts_.size(), [&](std::size_t k) {
      const std::size_t a = std::min(k, pair.a), b = std::max(k, pair.a);
      if (a != b) gains_[a][b] = gain(a, b, false);
    });
  }

  std::vector<ConvexPolyhedron> parts_;
  std::vector<Real> volumes_;
  std::vector<std::vector<Real>> gains_;  // gain of joining a and b at [a][b], a < b
};

}  // namespace

Real hull_volume(const ConvexPolyhedron& p) {
  return p.dimension() == 3 ? mass_properties(p.triangles()).volume : 0;
}

std::vector<ConvexPolyhedron> merge_hulls(std::vector<ConvexPolyhedron> parts, std::size_t max_parts,
                                          Real room) {
  return Merger(std::move(parts)).run(max_parts, room);
}

}  // namespace offstage::sim
