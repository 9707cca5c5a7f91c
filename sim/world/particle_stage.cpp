/// Collisions between particles, and the effect of particles on bodies (physics P3-P8).

#include <algorithm>

#include "sim/world/coupled_system.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// A sleeping body wakes if an impact would make it faster than this [m/s].
constexpr Real kNudge = 1e-4;

}  // namespace

/// Whether a system is paused while others are prewarmed.
bool World::Impl::waits(ParticleSystemHandle system) const {
  return prewarming && std::find(waiting.begin(), waiting.end(), system) != waiting.end();
}

StepReport World::Impl::prewarm(Real from, Real to, const BeforeSubStep& before) {
  StepReport report;
  if (now == 0)
    systems.for_each([&](ParticleSystemHandle handle, const ParticleSystem& system) {
      if (system.arrays.size() > 0) waiting.push_back(handle);
    });
  update_lists();
  prewarming = fixed_changed = true;
  now = from;
  if (from == to && before) before(from, to);
  const CoupledSystem still(*this, std::span<Body* const>{});
  report.substeps = from < to ? substep_count(to - from, def.max_step) : 0;
  for (uint32_t i = 0; i < report.substeps; ++i) {
    const Real start = now, share = static_cast<Real>(i + 1) / report.substeps;
    const Real end = i + 1 < report.substeps ? from + share * (to - from) : to;
    if (before) before(start, end);
    begin_kinematic(start, end);
    update_obstacles(end - start);
    step_particles(start, end - start, still, report);
    now = end;
  }
  if (to == 0) {
    systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
      if (!waits(handle)) system.admit_newborn(forces(system));
    });
    waiting.clear();
  }
  prewarming = false;
  fixed_changed = true;
  report.particles_born = std::exchange(born, 0);
  return report;
}

/// Moves the particles that collide with particles, of all systems together. Returns the work of pivoting.
ContactWork World::Impl::collide_particles(const ParticleStage& stage, const CoupledSystem& coupled) {
  std::vector<ParticleSystem*> colliding;
  systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
    if (!system.hits_particles() || waits(handle)) return;
    system.fly_all(stage, forces(system), coupled.holds(system));
    colliding.push_back(&system);
  });
  if (colliding.empty()) return {};
  const bool by_lcp = def.particle_contacts == ParticleContactMethod::lcp;
  particle_collisions.step(colliding, stage, def.impact, def.collision_speed,
                           by_lcp ? def.particle_cluster : 0);
  return particle_collisions.lcp_work();
}

/// Appends the events of a system, ordered by particle.
void World::Impl::add_events(std::vector<ParticleEvent>& events) {
  std::stable_sort(events.begin(), events.end(), [](const ParticleEvent& a, const ParticleEvent& b) {
    return a.id != b.id ? a.id < b.id : a.time < b.time;
  });
  particle_events.insert(particle_events.end(), events.begin(), events.end());
}

/// Applies the impulses of particles and cloths in a sub-step that ends at `time` to the momenta of bodies,
/// and through joints to whole articulations. They act from the next sub-step on.
void World::Impl::push_bodies(std::span<const Reaction> reactions, Real time) {
  std::vector<uint32_t> pushed;
  for (const Reaction& r : reactions) {
    Reaction& sum =
        pending_impulses.try_emplace(r.body, Reaction{r.body, Vec3::Zero(), Vec3::Zero()}).first->second;
    sum.impulse += r.impulse;
    sum.angular_impulse += r.angular_impulse;
  }
  std::erase_if(pending_impulses, [&](const auto& entry) {
    const Reaction& sum = entry.second;
    const std::unique_ptr<Body>& body = bodies[bodies.at_slot(sum.body)];
    if (!body->is_dynamic()) return true;
    const Vec3 turn = body->rigid.angular_velocity(body->rigid.orientation, sum.angular_impulse);
    const Real speed = sum.impulse.norm() / body->rigid.mass + turn.norm() * body->extent;
    if (body->asleep && speed < kNudge) return false;
    if (body->asleep) wake(*body);
    body->rigid.momentum += sum.impulse;
    body->rigid.angular_momentum += sum.angular_impulse;
    pushed.push_back(sum.body);
    return true;
  });
  for (const uint32_t slot : pushed) {
    Articulation* articulation = slot < articulation_of.size() ? articulation_of[slot] : nullptr;
    if (!articulation) continue;
    articulation->transmit_impulses(time, joint_tally);
    for (Body* link : articulation->bodies()) link->pose = link->rigid.pose();
  }
}

}  // namespace offstage::sim
