#include "producer/build/force_defs.h"

#include <limits>
#include <type_traits>

namespace offstage::producer {
namespace {

uint32_t whole_world(int n) {
  return static_cast<uint32_t>(n);
}

sim::ConstantField effect_of(const ConstantField& f) {
  return {f.force, f.region, whole_world(f.drop_rate)};
}
sim::PointField effect_of(const PointField& f) {
  return {f.point, f.force, f.region, whole_world(f.drop_rate)};
}
sim::WindField effect_of(const WindField& f) {
  return {f.wind, f.drag, f.region, whole_world(f.drop_rate)};
}
sim::Vortex effect_of(const VortexField& f) {
  return {f.point, f.axis, f.circulation, f.radius, f.drag, f.region, whole_world(f.drop_rate)};
}
sim::Turbulence effect_of(const TurbulenceField& f) {
  return {.speed = f.speed,
          .scale = f.scale,
          .octaves = whole_world(f.octaves),
          .lifetime = f.lifetime,
          .drift = f.drift,
          .seed = whole_world(f.seed),
          .drag = f.drag,
          .region = f.region,
          .drop_rate = whole_world(f.drop_rate)};
}
sim::MutualGravitation effect_of(const GravitationForce& f) {
  return {f.constant, f.softening, f.cut_off, f.region, whole_world(f.drop_rate)};
}
sim::Coulomb effect_of(const CoulombForce& f) {
  return {f.constant, f.softening, f.cut_off, f.region, whole_world(f.drop_rate)};
}
sim::LennardJones effect_of(const LennardJonesForce& f) {
  return {f.epsilon, f.sigma, f.cut_off, f.region, whole_world(f.drop_rate)};
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
sim::Explosion effect_of(const Explosion& f) {
  return {f.point, f.impulse, f.radius, whole_world(f.drop_rate)};
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
