#include "sim/dynamics/stiffness.h"

#include <type_traits>

#include "sim/dynamics/adaptive.h"
#include "sim/dynamics/implicit_euler.h"

namespace offstage::sim {
namespace {

template <class Effect>
Stiffness stiffness_of(const Effect& f) {
  if constexpr (requires { f.drag; })
    return {0, f.drag};
  else if constexpr (std::is_same_v<Effect, Grab>)
    return {f.stiffness, f.damping};
  else
    return {};
}

}  // namespace

Stiffness stiffness(const ForceDef& def) {
  return std::visit([](const auto& effect) { return stiffness_of(effect); }, def.effect);
}

bool is_stable(const Integrator& integrator, const Stiffness& stiffness, Real h) {
  if (dynamic_cast<const ImplicitIntegrator*>(&integrator)) return true;
  if (dynamic_cast<const AdaptiveIntegrator*>(&integrator)) h *= AdaptiveIntegrator::kShortest;
  // Explicit methods follow a decay of the rate k up to h k = 2, but reverse the velocity or hardly damp it
  // from h k = 1 on. Oscillations of the frequency w are bounded up to h w = 2.
  return h * stiffness.by_velocity <= 1 && h * h * stiffness.by_position < 4;
}

const Integrator& stable_integrator(const Integrator& wanted, const Stiffness& stiffness, Real h) {
  static const StiffRungeKutta stiff;
  return is_stable(wanted, stiffness, h) ? wanted : stiff;
}

}  // namespace offstage::sim
