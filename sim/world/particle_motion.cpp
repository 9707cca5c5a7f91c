#include "sim/world/particle_motion.h"

#include <algorithm>
#include <utility>

namespace offstage::sim {

void ParticleMotion::begin_prewarm(bool is_first) {
  is_prewarming_ = true;
  if (!is_first) return;
  world_.systems.for_each([&](ParticleSystemHandle handle, const ParticleSystem& system) {
    if (system.arrays.size() > 0) waiting_.push_back(handle);
  });
}

void ParticleMotion::end_prewarm(bool is_last) {
  if (is_last) {
    world_.systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
      if (!waits(handle)) system.admit_new_particles(world_.forces(system));
    });
    waiting_.clear();
  }
  is_prewarming_ = false;
}

/// Whether a system does not move, because other systems are being prewarmed.
bool ParticleMotion::waits(ParticleSystemHandle system) const {
  return is_prewarming_ && std::find(waiting_.begin(), waiting_.end(), system) != waiting_.end();
}

bool ParticleMotion::step(Real start, Real h, const CoupledSystem& coupled,
                          std::map<uint32_t, BodyImpulses::Load> expected, StepReport& report) {
  obstacles_.update(world_, active_, h, is_prewarming_);
  for (const auto& articulation : world_.articulations) articulation->begin_impulses(start + h);
  impulses_.begin(joints_.links(), std::move(expected));
  events_.clear();
  gather_cloths(h);
  const ParticleStage stage{start,     h,      obstacles_.fixed(), obstacles_.moving(), world_.def.bounds,
                            impulses_, cloths_};
  report.solvers.particle_lcp.add(collide(stage, coupled));
  impulses_.subtract_expected();
  const std::span<ParticleCollisions::Outcome> outcomes = collisions_.outcomes();
  bool any_removed = false;
  world_.systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
    if (waits(handle)) return;
    ParticleTally tally;
    const auto at = std::ranges::find(colliding_, &system);
    ParticleCollisions::Outcome* const collided =
        at == colliding_.end() ? nullptr : &outcomes[static_cast<std::size_t>(at - colliding_.begin())];
    if (collided) tally = std::move(collided->tally);
    if (system.hits_particles()) {
      system.meet_cloths(stage, world_.forces(system), collided->touched, tally);
      tally += system.end_step(stage, collided->touched, collided->trapped);
    } else {
      const std::span<const uint8_t> trapped = collided ? collided->trapped : std::span<const uint8_t>{};
      tally += system.step(stage, world_.forces(system), coupled.holds(system), trapped);
    }
    add(tally.events);
    report.particles.add(tally);
    any_removed |= tally.expired + tally.retired + tally.removed > 0;
    if (tally.lost && report.finite) {
      report.non_finite = *tally.lost;
      report.non_finite.object = system.def.name;
    }
    report.finite &= !tally.lost;
  });
  return_cloths();
  return any_removed;
}

Aabb ParticleMotion::colliding_bounds(Real h) const {
  Aabb bounds;
  world_.systems.for_each([&](ParticleSystemHandle handle, const ParticleSystem& system) {
    if (!system.def.collides || waits(handle)) return;
    if (system.hits_particles() || system.may_rest()) bounds.extend(system.reach(h, world_.def.gravity));
  });
  return bounds;
}

/// Collects the cloths with which particles collide. While particles are prewarmed, cloths stand still.
void ParticleMotion::gather_cloths(Real h) {
  cloths_.clear(impulses_);
  bool wanted = false;
  world_.systems.for_each([&](ParticleSystemHandle, const ParticleSystem& s) {
    wanted |= s.def.collides && s.arrays.size() > 0;
  });
  if (!wanted) return;
  std::vector<Real> inverse_masses;
  std::vector<ClothObstacles::Pin> held;
  std::map<uint32_t, uint32_t> holders;  // by slot
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    if (cloth->absent || !cloth->def.collides) return;
    inverse_masses.assign(cloth->points.size(), 0);
    held.clear();
    const bool moves = !cloth->stopped && !is_prewarming_;
    for (std::size_t i = 0; moves && i < cloth->points.size(); ++i) inverse_masses[i] = 1 / cloth->masses[i];
    for (const ClothPin& pin : cloth->pins) {
      inverse_masses[pin.vertex] = 0;
      const std::unique_ptr<Body>* body = world_.bodies.find(pin.body);
      if (!moves || !body || (*body)->absent || !(*body)->is_dynamic()) continue;
      const auto [holder, is_new] = holders.try_emplace(pin.body.index, 0);
      if (is_new) holder->second = cloths_.add_holder(swept_obstacle(**body, h));
      held.push_back({pin.vertex, holder->second, (*body)->asleep ? 0 : cloth->masses[pin.vertex]});
    }
    const std::vector<Vec3>& before = moves ? cloth->before : cloth->points;
    cloths_.add(before, cloth->points, cloth->velocities, inverse_masses, cloth->triangles,
                cloth->def.friction, held);
  });
  cloths_.build();
}

/// Changes the velocities of the cloths by the impulses of particles.
void ParticleMotion::return_cloths() {
  if (cloths_.empty() || is_prewarming_) return;
  cloths_.finish();
  std::size_t k = 0;
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    if (cloth->absent || !cloth->def.collides) return;
    std::ranges::copy(cloths_.velocities(k), cloth->velocities.begin());
    cloth->report.particle_hits += cloths_.hits(k++);
  });
}

/// Moves the particles that collide with other particles or may rest on dynamic bodies, of all systems
/// together. Returns the work of the solver.
ContactWork ParticleMotion::collide(const ParticleStage& stage, const CoupledSystem& coupled) {
  colliding_.clear();
  const auto may_move_bodies = [&](const ParticleSystem& system) {
    if (!system.may_rest() || system.arrays.size() == 0) return false;
    const Aabb reach = system.reach(stage.h, world_.def.gravity);
    for (const std::span<const Obstacle> obstacles : {stage.moving.all(), stage.fixed.all()})
      for (const Obstacle& o : obstacles)
        if (o.is_dynamic() && o.swept_bounds().intersects(reach)) return true;
    return false;
  };
  world_.systems.for_each([&](ParticleSystemHandle handle, ParticleSystem& system) {
    if (waits(handle)) return;
    const bool hits_particles = system.hits_particles();
    if (!hits_particles && !may_move_bodies(system)) return;
    system.fly_all(stage, world_.forces(system), coupled.holds(system));
    if (!hits_particles) system.find_on_bodies(stage);
    if (hits_particles || !system.on_bodies().empty()) colliding_.push_back(&system);
  });
  if (colliding_.empty()) {
    collisions_.forget();
    return {};
  }
  const WorldDef& def = world_.def;
  const bool by_lcp = def.particle_contacts == ParticleContactMethod::lcp;
  collisions_.step(colliding_, stage, def.impact, def.collision_speed, by_lcp ? def.particle_cluster : 0);
  return collisions_.lcp_work();
}

/// Appends the events of a system to the events of the sub-step, ordered by particle.
void ParticleMotion::add(std::vector<ParticleEvent>& events) {
  std::stable_sort(events.begin(), events.end(), [](const ParticleEvent& a, const ParticleEvent& b) {
    return a.id != b.id ? a.id < b.id : a.time < b.time;
  });
  events_.insert(events_.end(), events.begin(), events.end());
}

void ParticleMotion::forget(ParticleSystemHandle system) {
  std::erase_if(events_, [&](const ParticleEvent& e) { return e.system == system; });
}

}  // namespace offstage::sim
