#pragma once
/// The interval that contacts are solved for.

#include "sim/core/types.h"

namespace offstage::sim {

/// What all solutions of an interval share.
struct ContactInterval {
  Real duration;  ///< [s], > 0
  Real end;       ///< the world's time [s]
  Real substep;   ///< of which the interval is all or a part [s]; penetration is pushed out at its pace
  /// A sub-step as if nothing had hit anything: its forces are what the next one begins with. Else it is the
  /// part before or after an impact. What stops a body in such a moment takes a force that would throw it far
  /// if it lasted, and a part that is made anew after each of many impacts would add to its forces each time.
  bool is_whole = true;
};

}  // namespace offstage::sim
