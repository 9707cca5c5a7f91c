#pragma once
/// Stiffness of forces, and the integrator that is stable with it (physics N2).

#include "sim/dynamics/force_field.h"
#include "sim/dynamics/integrator.h"

namespace offstage::sim {

/// How strongly forces oppose a displacement and a velocity: upper bounds of the negative derivatives of a
/// force by position [N/m] and by velocity [N s/m]; or, per mass, of an acceleration [1/s^2], [1/s].
struct Stiffness {
  Real by_position = 0, by_velocity = 0;

  Stiffness& operator+=(const Stiffness& s) {
    by_position += s.by_position;
    by_velocity += s.by_velocity;
    return *this;
  }
};
inline Stiffness operator*(Real factor, const Stiffness& s) {
  return {factor * s.by_position, factor * s.by_velocity};
}

/// Returns the greatest stiffness of a force anywhere [N/m], [N s/m]. Fields are never stiff by position.
Stiffness stiffness(const ForceDef& def);

/// Whether a step of length h [s] is stable with accelerations of this stiffness.
bool is_stable(const Integrator& integrator, const Stiffness& stiffness, Real h);
/// Returns the integrator itself or, if a step of length h [s] would be unstable with it, an implicit method
/// of second order that is stable for any stiffness and damps all motions that are faster than the step.
const Integrator& stable_integrator(const Integrator& wanted, const Stiffness& stiffness, Real h);

}  // namespace offstage::sim
