#include "producer/build/force_defs.h"

#include <limits>
#include <type_traits>

namespace offstage::producer {
namespace {

template <class F>
typename F::Effect effect_of(const F& force) {
  return force;
}
sim::Grab effect_of(const Grab& f) {
  sim::Grab grab{
      .point = f.point, .track = {}, .stiffness = f.stiffness, .damping = f.damping, .reach = f.reach};
  grab.track.interpolation = f.interpolation;
  for (const HandKey& key : f.keyframes)
    grab.track.keys.push_back({key.time, {key.position, Quat::Identity()}, key.interpolation});
  return grab;
}
sim::AppliedForce effect_of(const AppliedForce& f) {
  sim::AppliedForce applied{.keys = {}, .point = f.point, .body_axes = f.axes == ForceAxes::body};
  for (const AppliedKey& key : f.keyframes)
    applied.keys.push_back({key.time, key.force, key.torque, key.interpolation.value_or(f.interpolation)});
  if (applied.keys.empty()) applied.keys.push_back({0, f.force, f.torque});
  return applied;
}
}  // namespace

sim::ForceDef force_def(const Force& force) {
  return std::visit(
      []<class F>(const F& f) {
        sim::ForceDef def{.name = f.name, .effect = effect_of(f)};
        if constexpr (std::is_same_v<F, Explosion>)
          def.start = f.time;
        else
          def.start = f.start, def.end = f.end;
        return def;
      },
      force);
}

ForceTargets targets_of(const Force& force) {
  return std::visit(
      []<class F>(const F& f) {
        ForceTargets targets;
        if constexpr (requires { f.particles; }) targets.particles = f.particles;
        if constexpr (requires { f.cloths; }) targets.cloths = f.cloths;
        if constexpr (requires { f.bodies; }) targets.bodies = f.bodies;
        if constexpr (requires { f.body; })
          if (!f.body.empty()) targets.bodies.push_back(f.body);
        return targets;
      },
      force);
}

}  // namespace offstage::producer
