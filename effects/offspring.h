#pragma once
/// What those that let particles be born from particles have done so far.

#include <cstdint>

namespace offstage::effects {

struct OffspringReport {
  uint64_t released = 0;
  uint64_t skipped = 0;   ///< not released because max_alive or max_per_step was reached
  uint64_t answered = 0;  ///< splits that took place, events answered; of trails 0
};

}  // namespace offstage::effects
