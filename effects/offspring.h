#pragma once
/// Counts of splits, trails and sub-emitters since their start.

#include <cstdint>

namespace offstage::effects {

struct OffspringReport {
  uint64_t released = 0;
  uint64_t skipped = 0;    ///< particles that were not released because max_alive or max_per_step was reached
  uint64_t triggered = 0;  ///< number of splits, or of events that triggered particles; 0 for trails
};

}  // namespace offstage::effects
