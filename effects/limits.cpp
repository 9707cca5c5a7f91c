#include "effects/limits.h"

#include <cmath>

namespace offstage::effects {

void check(const std::string& owner, const char* field, const Varying& v, const Limits& limits) {
  const auto refuse = [&](const std::string& what) {
    throw std::invalid_argument(owner + ": " + field + ' ' + what);
  };
  if (const auto* n = std::get_if<Normal>(&v)) {
    if (!(n->deviation >= 0)) refuse("has a negative deviation");
    if (!(n->min <= n->max)) refuse("has min > max");
  }
  if (const auto* u = std::get_if<Uniform>(&v); u && !(u->low <= u->high))
    refuse("has a range whose first value is greater than its second");
  if (const auto* c = std::get_if<Curve>(&v)) {
    if (c->keys.empty()) refuse("is a curve without keys");
    for (std::size_t i = 1; i < c->keys.size(); ++i)
      if (!(c->keys[i - 1].first < c->keys[i].first)) refuse("is a curve whose times do not increase");
  }
  const Real low = lower_bound(v), high = upper_bound(v);
  if (std::isnan(low) || std::isnan(high)) refuse("must be a number");
  if (limits.low_open && !(low > limits.low))
    refuse("can be " + std::to_string(low) + ", but must be > " + std::to_string(limits.low) +
           "; give it a min");
  if (high < limits.low || low > limits.high)
    refuse("is outside " + std::to_string(limits.low) + " to " + std::to_string(limits.high));
}

}  // namespace offstage::effects
