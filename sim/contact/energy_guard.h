#pragma once
/// What keeps an approximate solution of contacts from adding energy.

#include <span>

#include "sim/contact/contact_graph.h"
#include "sim/contact/relaxation.h"

namespace offstage::sim {

/// The share of an island's contact and joint impulses that adds no kinetic energy to its free motion, which
/// is that of Body::rigid: 1 unless they add more than a fiftieth of it. Contacts and joints take energy, but
/// for the part of their velocity terms that a step does not follow; where a thin body turns far in a step
/// that part has no bound. Impulses scaled by one factor keep the momenta. Of an island that is driven, by a
/// body on keys, a surface that moves or a motor, 1.
Real kept_share(const Island& island, std::span<const RelaxedBody> relaxed);

}  // namespace offstage::sim
