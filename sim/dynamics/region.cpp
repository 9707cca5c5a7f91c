#include "sim/dynamics/region.h"

#include "sim/dynamics/flat.h"

namespace offstage::sim {
namespace {

/// Returns the depth in a region: 1 in its middle, 0 at its border, linear values in between, and negative
/// values outside.
template <class Point>
Real depth(const Everywhere&, const Point&) {
  return 1;
}
template <class Point>
Real depth(const SphereRegion& s, const Point& point) {
  return 1 - (point - s.centre).norm() / s.radius;
}
template <class Point>
Real depth(const BoxRegion& b, const Point& point) {
  return 1 - ((point - b.centre).cwiseAbs().array() / (b.size / 2).array()).maxCoeff();
}

/// Returns an integer power by multiplication. Unlike std::pow, it gives the same bits on every machine.
Real power(Real base, uint32_t exponent) {
  Real result = 1;
  for (; exponent > 0; exponent /= 2, base *= base)
    if (exponent % 2) result *= base;
  return result;
}

}  // namespace

Real strength_at_depth(Real depth, uint32_t drop_rate) {
  return depth > 0 ? power(depth, drop_rate) : 0;
}

Real strength(const Region& region, uint32_t drop_rate, const Vec3& point) {
  return std::visit([&](const auto& r) { return strength_at_depth(depth(r, point), drop_rate); }, region);
}

bool strengths(const Region& region, uint32_t drop_rate, std::span<const Real> points, std::span<Real> out) {
  return std::visit(
      [&](const auto& r) {
        bool any = false;
        for (std::size_t i = 0; i < out.size(); ++i) {
          out[i] = strength_at_depth(depth(r, vec3(points, 3 * i)), drop_rate);
          any |= out[i] != 0;
        }
        return any;
      },
      region);
}

}  // namespace offstage::sim
