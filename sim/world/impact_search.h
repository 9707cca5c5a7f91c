#pragma once
/// Search for the time at which two bodies will touch on their paths in a sub-step (physics E7).

#include <optional>

#include "sim/contact/contact_pair.h"
#include "sim/world.h"

namespace offstage::sim {

/// Intervals shorter than this fraction of the sub-step are skipped.
inline constexpr Real kInstant = 1e-9;

/// Returns the time at which the bodies of a pair will touch on their current paths, counted from the start
/// of a sub-step of length h [s]. Returns nothing if they do not touch. If they touch already and approach,
/// returns the current time.
std::optional<Real> impact_time(const ContactPair& pair, const WorldDef& def, Real h, TestCounts& tests);

/// Whether a body of the pair turns so fast within the time h [s] that the search must divide its rotation
/// into pieces.
bool turns_fast(const ContactPair& pair, Real h);
/// Number of pieces into which the search divides the rotation within the time h [s].
uint32_t search_pieces(const ContactPair& pair, Real h);

}  // namespace offstage::sim
