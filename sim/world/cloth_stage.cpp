/// Cloths in the world (physics F6-F8). Cloths move after bodies and particles, among the bodies on the paths
/// of these. Their effect on bodies begins in the next sub-step.

#include <algorithm>
#include <stdexcept>

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// Cloth is at rest under a body that moves slower than this [m/s].
constexpr Real kClothRest = 0.05;
/// A larger change of speed in a sub-step is an impact; that by gravity is a fifth of it [m/s].
constexpr Real kImpact = 0.2;

}  // namespace

ClothHandle World::add_cloth(const ClothDef& def) {
  const std::string object = def.name.empty() ? "cloth" : "cloth \"" + def.name + '"';
  std::string wrong = problem(def);
  if (!(def.appear_at >= 0) || !std::isfinite(def.appear_at) || !(def.remove_at > def.appear_at))
    wrong = "remove_at must be later than appear_at, which is at least 0";
  if (!wrong.empty()) throw std::invalid_argument(object + ": " + wrong);
  for (std::size_t i = 0; i < def.pins.size(); ++i)
    if (def.pins[i].body && !impl_->bodies.find(def.pins[i].body))
      throw std::invalid_argument(object + ": pins[" + std::to_string(i) +
                                  "] is on a body that does not exist");
  const ClothHandle handle = impl_->cloths.insert(nullptr);
  impl_->cloths[handle] = std::make_unique<Cloth>(handle, def);
  impl_->cloths[handle]->absent = def.appear_at > impl_->now;
  impl_->has_lifetimes |= def.appear_at > impl_->now || std::isfinite(def.remove_at);
  impl_->arrange_cloths();
  return handle;
}

bool World::remove(ClothHandle cloth) {
  if (!impl_->cloths.erase(cloth)) return false;
  impl_->wake_all();
  impl_->arrange_cloths();
  return true;
}

ClothView World::cloth(ClothHandle cloth) const {
  return impl_->cloths[cloth]->view();
}
const ClothDef& World::cloth_def(ClothHandle cloth) const {
  return impl_->cloths[cloth]->def;
}
ClothGasState World::cloth_gas(ClothHandle cloth) const {
  return gas_state(*impl_->cloths[cloth]);
}

const ClothReport& World::cloth_report(ClothHandle cloth) const {
  return impl_->cloths[cloth]->report;
}
void World::for_each_cloth(const std::function<void(ClothHandle)>& f) const {
  impl_->cloths.for_each([&](ClothHandle handle, const auto&) { f(handle); });
}
std::size_t World::cloth_count() const {
  return impl_->cloths.size();
}

void World::Impl::arrange_cloths() {
  std::vector<Cloth*> all;
  cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    if (!cloth->absent) all.push_back(cloth.get());
  });
  cloth_system.assign(std::move(all));
}

/// Cloth pinned to a removed body is released.
void World::Impl::detach_cloths(BodyHandle body) {
  cloths.for_each([&](ClothHandle, std::unique_ptr<Cloth>& cloth) {
    std::erase_if(cloth->pins, [&](const ClothPin& pin) { return pin.body == body; });
  });
}

void World::Impl::begin_cloths() {
  cloths.for_each(
      [](ClothHandle, std::unique_ptr<Cloth>& cloth) { cloth->report = {.finite = !cloth->stopped}; });
}

/// The bodies that cloths may touch in a sub-step of length h, and those that hold pins.
std::vector<ClothBody> World::Impl::bodies_near_cloths(Real h) const {
  std::vector<uint8_t> holds(bodies.slot_count(), 0);
  cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    for (const ClothPin& pin : cloth->pins)
      if (pin.body) holds[pin.body.index] = 1;
  });
  const Aabb around = cloth_system.reach(h);
  std::vector<ClothBody> near;
  bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    if (body->absent || (!body->def.collides && !holds[handle.index])) return;
    Obstacle way = swept_obstacle(*body, h);
    if (!holds[handle.index] && !std::holds_alternative<Plane>(*way.solid.shape) &&
        !way.swept_bounds().intersects(around))
      return;
    Vec3 velocity = way.velocity, spin = way.angular_velocity;
    if (body->is_awake()) {
      velocity = body->rigid.velocity();
      spin = body->rigid.angular_velocity();
    } else {
      way.inverse_mass = 0;  // asleep: cloth does not move it until the body wakes
    }
    near.emplace_back(way, h, velocity, spin, body->def.surface_velocity);
    near.back().collides = body->def.collides;
  });
  return near;
}

void World::Impl::step_cloths(Real start, Real h) {
  if (cloths.empty()) return;
  std::vector<ClothBody> near = bodies_near_cloths(h);
  const std::vector<const ForceDef*> forces = active_forces();
  cloth_system.step({start, h, def.gravity, def.wind, forces}, near);
  answer_cloths(near, start, h);
  hit_cloths(h);
}

/// Wakes sleeping bodies whose pins do not hold cloth any more.
void World::Impl::wake_unpinned(std::span<const ClothBody> near) {
  std::vector<Body*> released;
  for (const auto& [number, group] : sleeping)
    for (Body* body : group) {
      if (!body->rest_pins) continue;
      const bool is_held = std::any_of(near.begin(), near.end(), [&](const ClothBody& at) {
        return at.way().body == body->handle.index && at.pin_load();
      });
      if (!is_held) released.push_back(body);
    }
  for (Body* body : released) wake(*body);
}

/// Applies the effect of cloths on bodies: the displacement in this sub-step, and the change of velocity from
/// the next one on.
void World::Impl::answer_cloths(std::span<const ClothBody> near, Real start, Real h) {
  std::vector<Reaction> reactions;
  wake_unpinned(near);
  for (const ClothBody& at : near) {
    Body& body = *bodies[bodies.at_slot(at.way().body)];
    const bool left = std::exchange(body.on_cloth, at.touched) && !at.touched;
    if (!body.is_dynamic()) continue;
    // It sleeps while the cloth below it is at rest, and wakes when that moves or goes away.
    if (left || at.touching_speed > kClothRest) wake(body);
    if (body.asleep && at.pin_load()) {
      const Wrench pull{at.pin_load()->impulse / h, at.pin_load()->angular_impulse / h};
      if (!body.rest_pins) body.rest_pins = pull;
      if (is_pushed(body, pull, *body.rest_pins)) wake(body);
    }
    if (!at.touched || body.asleep) continue;
    // The body stays where cloth touched it. If it were put back to its position without cloth, it would drag
    // the cloth along each time. Cloth between two bodies acts only on their velocities, unless there is an
    // impact.
    if (!at.pinches || at.reaction().impulse.norm() > kImpact * body.rigid.mass) {
      body.pose = at.end();
      body.rigid.place(body.pose);
    }
    reactions.push_back(at.reaction());
  }
  push_bodies(reactions, start + h);
}

void World::Impl::report_cloths(StepReport& report) {
  cloth_system.measure();
  cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    const ClothReport& r = cloth->report;
    report.cloth_contacts += r.contacts;
    report.cloth_self_contacts += r.self_contacts;
    report.cloth_springs_clamped += r.clamped;
    report.cloth_strain = std::max(report.cloth_strain, r.max_strain);
    report.cloth_penetration = std::max(report.cloth_penetration, r.penetration);
    report.cloth_moves_limited += r.limited;
    report.cloth_moves_held_back += r.held_back;
    report.cloth_crossings += r.crossings;
    report.cloth_springs_torn += r.torn;
    report.cloth_unconverged += r.unconverged;
    if (!r.finite && report.finite)
      report.non_finite = {.object = cloth->def.name, .position_before = cloth->points[0]};
    report.finite &= r.finite;
  });
}

}  // namespace offstage::sim
