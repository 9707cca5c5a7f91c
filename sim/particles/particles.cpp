#include "sim/particles/particles.h"

#include <algorithm>
#include <cmath>

namespace offstage::sim {

Vec3 collision_impulse(Real m12, const Vec3& u, const Vec3& n, Real restitution, Real friction) {
  return collision_impulse(m12, m12, u, n, restitution, friction);
}

Vec3 collision_impulse(Real m12, Real across, const Vec3& u, const Vec3& n, Real restitution, Real friction) {
  const Real approach = -u.dot(n);
  const Vec3 sliding = u + approach * n;
  const Real normal_impulse = (1 + restitution) * m12 * approach;
  const Real to_stick = across * sliding.norm(), limit = friction * normal_impulse;
  const Real fraction = to_stick > limit ? limit / to_stick : 1;
  return normal_impulse * n - fraction * across * sliding;
}

Vec3 velocity_after_shift(const Vec3& v, const Vec3& a, const Vec3& shift) {
  const Real speed2 = v.squaredNorm();
  return speed2 > 0 ? Vec3(std::sqrt(std::max(0.0, 1 + 2 * a.dot(shift) / speed2)) * v) : v;
}

std::optional<Real> meeting_time(const Vec3& d, const Vec3& u, Real distance) {
  // Solves |d + u t| = distance. For accuracy the larger form of the quadratic's solution is used, and the
  // discriminant is computed from the distance at which the centres would pass each other.
  const Real approach = -d.dot(u);
  if (!(approach > 0)) return std::nullopt;
  const Real gap = d.squaredNorm() - distance * distance;
  if (gap <= 0) return 0;
  const Real discriminant = distance * distance * u.squaredNorm() - d.cross(u).squaredNorm();
  if (discriminant < 0) return std::nullopt;
  return gap / (approach + std::sqrt(discriminant));
}

}  // namespace offstage::sim
