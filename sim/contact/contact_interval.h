#pragma once
/// The time interval for which contacts are solved.

#include "sim/core/types.h"

namespace offstage::sim {

/// Parameters common to all solutions of an interval.
struct ContactInterval {
  Real duration;  ///< length [s], > 0
  Real end;       ///< end of the interval, world time [s]
  /// Length of the sub-step that contains the interval [s]. It sets the rate at which penetration is removed.
  Real substep;
  /// Contacts that approach faster than this are impacts [m/s]; equals WorldDef::collision_speed.
  Real impact_speed;
  /// Whether the interval is a whole sub-step without impacts. Only the forces of whole sub-steps are stored
  /// as the initial guess of the next one. A force that stops a body in a short part before or after an
  /// impact would be far too large for a whole sub-step. Forces would also accumulate if a part were solved
  /// again after each of many impacts.
  bool is_whole = true;
  /// Whether SolverKind::automatic uses the fast solver in any case.
  bool is_cheap = false;
};

}  // namespace offstage::sim
