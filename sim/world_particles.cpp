/// Particles among themselves and what they do to bodies (physics P3-P8).

#include <algorithm>

#include "sim/coupled_system.h"
#include "sim/world_impl.h"

namespace offstage::sim {
namespace {

/// A sleeping body wakes when what hits it would make it faster than this [m/s].
constexpr Real kNudge = 1e-4;

}  // namespace

/// Particles that collide with particles fly and go through their collisions, of all systems together.
void World::Impl::collide_particles(const ParticleStage& stage, const CoupledSystem& coupled) {
  std::vector<ParticleSystem*> colliding;
  systems.for_each([&](ParticleSystemHandle, ParticleSystem& system) {
    if (!system.hits_particles()) return;
    system.fly_all(stage, forces(system), coupled.holds(system));
    colliding.push_back(&system);
  });
  if (!colliding.empty()) particle_collisions.step(colliding, stage, def.impact, def.collision_speed);
}

/// Appends the events of a system, by particle.
void World::Impl::add_events(std::vector<ParticleEvent>& events) {
  std::stable_sort(events.begin(), events.end(), [](const ParticleEvent& a, const ParticleEvent& b) {
    return a.id != b.id ? a.id < b.id : a.time < b.time;
  });
  particle_events.insert(particle_events.end(), events.begin(), events.end());
}

/// What particles did to bodies changes their momenta from the next sub-step on.
void World::Impl::push_bodies(std::span<const Reaction> reactions) {
  for (const Reaction& r : reactions) {
    Reaction& sum = nudges.try_emplace(r.body, Reaction{r.body, Vec3::Zero(), Vec3::Zero()}).first->second;
    sum.impulse += r.impulse;
    sum.angular_impulse += r.angular_impulse;
  }
  std::erase_if(nudges, [&](const auto& entry) {
    const Reaction& sum = entry.second;
    const std::unique_ptr<Body>& body = bodies[bodies.at_slot(sum.body)];
    if (!body->is_dynamic()) return true;
    const Vec3 turn = body->rigid.angular_velocity(body->rigid.orientation, sum.angular_impulse);
    const Real speed = sum.impulse.norm() / body->rigid.mass + turn.norm() * body->extent;
    if (body->asleep && speed < kNudge) return false;
    if (body->asleep) wake(*body);
    body->rigid.momentum += sum.impulse;
    body->rigid.angular_momentum += sum.angular_impulse;
    return true;
  });
}

}  // namespace offstage::sim
