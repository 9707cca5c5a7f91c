#include "sim/world/world_state.h"

namespace offstage::sim {

std::vector<const ForceDef*> WorldState::active_forces() const {
  std::vector<const ForceDef*> active;
  force_defs.for_each([&](ForceHandle, const ForceDef& f) {
    if (!f.is_explosion() && acts(f)) active.push_back(&f);
  });
  return active;
}

ParticleForces WorldState::forces(const ParticleSystem& system) const {
  std::vector<const ForceDef*> acting;
  force_defs.for_each([&](ForceHandle, const ForceDef& f) {
    if (!f.is_explosion() && !f.is_pairwise() && acts(f) && f.acts_on(system.handle)) acting.push_back(&f);
  });
  return {system.def, def.gravity, def.wind, std::move(acting)};
}

bool WorldState::has_pair_forces() const {
  bool any = false;
  force_defs.for_each([&](ForceHandle, const ForceDef& f) { any |= f.is_pairwise(); });
  return any;
}

bool WorldState::is_alive(const Attachment& a) const {
  if (const auto* b = std::get_if<BodyPoint>(&a)) {
    const auto* body = bodies.find(b->body);
    return body && !((*body)->absent && (*body)->was_present);
  }
  if (const auto* p = std::get_if<ParticlePoint>(&a)) {
    const ParticleSystem* system = systems.find(p->system);
    return system && system->find(p->id);
  }
  return true;
}

bool WorldState::acts(const Spring& spring) const {
  const auto exists = [&](const Attachment& end) {
    const auto* point = std::get_if<BodyPoint>(&end);
    return !point || !bodies[point->body]->absent;
  };
  return exists(spring.def.a) && exists(spring.def.b);
}

Vec3 WorldState::position(const Attachment& a) const {
  if (const auto* b = std::get_if<BodyPoint>(&a)) return bodies[b->body]->pose.point_to_world(b->position);
  if (const auto* p = std::get_if<ParticlePoint>(&a)) {
    const ParticleSystem& system = systems[p->system];
    return system.arrays.position[*system.find(p->id)];
  }
  return std::get<WorldPoint>(a).position;
}

}  // namespace offstage::sim
