#pragma once
/// The interval that contacts are solved for.

#include "sim/core/types.h"

namespace offstage::sim {

/// Parameters common to all solutions of an interval.
struct ContactInterval {
  Real duration;  ///< length [s], > 0
  Real end;       ///< end, as the world's time [s]
  /// Length of the sub-step of which the interval is all or a part [s]; sets the rate at which penetration is
  /// removed.
  Real substep;
  /// Contacts that approach faster are impacts, WorldDef::collision_speed [m/s].
  Real impact_speed;
  /// Whether the interval is a whole sub-step without impacts. Only the forces of whole sub-steps are stored
  /// as the initial guess of the next one. The force that stops a body in a short part before or after an
  /// impact would be far too large for a whole sub-step, and forces would accumulate if a part were solved
  /// again after each of many impacts.
  bool is_whole = true;
};

}  // namespace offstage::sim
