#pragma once
/// Describes problems and notable events of a simulation in sentences.

#include <string>
#include <vector>

#include "producer/build/simulation.h"

namespace offstage::producer {

/// Returns one text for each problem or event. It begins with "warning: " or "note: " and names the object.
std::vector<std::string> notes_of(const SimulationTotals& totals);

}  // namespace offstage::producer
