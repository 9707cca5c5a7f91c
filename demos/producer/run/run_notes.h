#pragma once
/// Problems and notable events of a simulation, as sentences.

#include <string>
#include <vector>

#include "producer/build/simulation.h"

namespace offstage::producer {

/// One sentence each, beginning with "warning: " or "note: " and naming the object concerned.
std::vector<std::string> notes_of(const SimulationTotals& totals);

}  // namespace offstage::producer
