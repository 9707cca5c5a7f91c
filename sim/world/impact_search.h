#pragma once
/// Search for the time at which two bodies will touch on their paths in a sub-step (physics E7).

#include <optional>

#include "sim/contact/contact_pair.h"
#include "sim/world.h"

namespace offstage::sim {

/// Intervals shorter than this fraction of the sub-step are skipped.
inline constexpr Real kInstant = 1e-9;

/// Time at which the bodies of a pair will touch on their current paths in a sub-step of length h, since its
/// start. If they touch already and approach, it is the current time.
std::optional<Real> impact_time(const ContactPair& pair, const WorldDef& def, Real h, TestCounts& tests);

/// Whether a body of the pair turns so fast in the time h that its rotation is divided into pieces.
bool turns_fast(const ContactPair& pair, Real h);
/// Number of pieces into which the rotation is divided for the search.
uint32_t search_pieces(const ContactPair& pair, Real h);

}  // namespace offstage::sim
