#include <algorithm>
#include <cmath>

#include "sim/cloth/bending.h"
#include "sim/cloth/cloth.h"

namespace offstage::sim {

/// Returns the longest stable steps. The eigenvalues of M^-1 K are below the greatest K_a / m_a + K_b / m_b
/// over all springs, where K_i is the sum of the stiffnesses at point i (as for the Laplacian of a graph;
/// Anderson and Morley, 1985). The bound for damping has dampings in place of stiffnesses.
StableStep largest_stable_step(const ClothDef& def) {
  StableStep result;
  const bool is_rk4 = def.integrator == ClothIntegrator::rk4;
  if (!is_rk4 && def.integrator != ClothIntegrator::symplectic) return result;
  std::vector<Real> stiffness(def.vertices.size(), 0), damping(def.vertices.size(), 0);
  for (const ClothSpring& s : def.springs)
    for (uint32_t end : {s.a, s.b}) {
      stiffness[end] += s.stiffness / def.masses[end];
      damping[end] += s.damping / def.masses[end];
    }
  for (uint32_t i = 0; i < def.springs.size(); ++i) {
    const ClothSpring& s = def.springs[i];
    const Real omega2 = stiffness[s.a] + stiffness[s.b], delta = damping[s.a] + damping[s.b];
    // Symplectic Euler is stable for h^2 omega^2 + 2 h delta < 4. The region of stability of Runge-Kutta
    // contains the left half of a disc of radius 2.6.
    const Real step = is_rk4 ? 2.6 / std::max(std::sqrt(omega2), delta)
                             : 4 / (delta + std::sqrt(delta * delta + 4 * omega2));
    if (step < result.step) result = {step, i, false};
  }
  if (def.bend > 0) {
    ClothBending bending;
    bending.assign(def.rest_vertices.empty() ? def.vertices : def.rest_vertices, def.triangles, def.masses,
                   def.bend, def.bend_damping, def.rest_curvature);
    const Real omega2 = bending.fastest(), delta = def.bend_damping * omega2;
    const Real step = is_rk4 ? 2.6 / std::max(std::sqrt(omega2), delta)
                             : 4 / (delta + std::sqrt(delta * delta + 4 * omega2));
    if (step < result.step) result = {step, 0, true};
  }
  return result;
}

}  // namespace offstage::sim
