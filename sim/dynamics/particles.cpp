#include "sim/dynamics/particles.h"

namespace offstage::sim {

Vec3 collision_impulse(Real m12, const Vec3& u, const Vec3& n, Real restitution, Real friction) {
  const Real approach = -u.dot(n);
  const Vec3 sliding = u + approach * n;
  const Real normal_impulse = (1 + restitution) * m12 * approach;
  const Real to_stick = m12 * sliding.norm(), limit = friction * normal_impulse;
  const Real share = to_stick > limit ? limit / to_stick : 1;
  return normal_impulse * n - share * m12 * sliding;
}

}  // namespace offstage::sim
