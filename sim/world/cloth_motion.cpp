#include "sim/world/cloth_motion.h"

#include <algorithm>
#include <utility>

#include "sim/linear/rigid_mobility.h"
#include "sim/world/obstacle_set.h"
#include "sim/world/resting_bodies.h"

namespace offstage::sim {
namespace {

/// Cloth is at rest under a body if it moves there at less than this [m/s].
constexpr Real kClothRest = 0.05;
/// A change of a body's speed in a sub-step counts as an impact above this [m/s]. Gravity changes the speed
/// by about a fifth of it.
constexpr Real kImpact = 0.2;
/// Cloth is still between two sleeping bodies if it is at most this far from the middle between them, in
/// thicknesses.
constexpr Real kStillThere = 4;

}  // namespace

void ClothMotion::arrange() {
  std::vector<Cloth*> all;
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    if (!cloth->absent) all.push_back(cloth.get());
  });
  system_.assign(std::move(all));
}

void ClothMotion::place_pins(const Body& body) {
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    if (cloth->absent) return;
    for (ClothPin& pin : cloth->pins)
      if (pin.body == body.handle) pin.position = body.pose.point_to_body(cloth->points[pin.vertex]);
  });
}

void ClothMotion::place_pins(Cloth& cloth) {
  for (ClothPin& pin : cloth.pins) {
    if (!pin.body) continue;
    const Body& body = *world_.bodies[pin.body];
    if (!body.absent) pin.position = body.pose.point_to_body(cloth.points[pin.vertex]);
  }
}

void ClothMotion::detach(BodyHandle body) {
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    std::erase_if(cloth->pins, [&](const ClothPin& pin) { return pin.body == body; });
  });
  loads_.erase(body.index);
}

void ClothMotion::begin_step() {
  world_.cloths.for_each(
      [](ClothHandle, const std::unique_ptr<Cloth>& cloth) { cloth->report = {.finite = !cloth->stopped}; });
}

void ClothMotion::begin_substep(Real time, Real h, BodyReactions& reactions, StepReport& report) {
  for (const Push& push : std::exchange(pushes_, {}))
    reactions.add_force(push.body, {push.impulse.force / h, push.impulse.torque / h});
  std::erase_if(loads_, [&](const auto& entry) { return !world_.body_at(entry.first).is_awake(); });
  std::vector<Reaction> leads;
  for (auto& [slot, load] : loads_) {
    const Body& body = world_.body_at(slot);
    const bool is_over = system_.empty() || std::ranges::binary_search(resting_, slot);
    is_over ? load.force.expect_nothing() : load.force.expect(body.rigid);
    reactions.add_force(body.handle, load.force.expected());
    if (!is_zero(load.lead)) leads.push_back({slot, load.lead.force, load.lead.torque});
  }
  reactions.apply(leads, time, report);
  if (system_.empty()) loads_.clear();
}

/// Returns by slot whether a body holds pins, or cloth has pulled it in the last sub-steps.
std::vector<uint8_t> ClothMotion::loaded_bodies() const {
  std::vector<uint8_t> loaded(world_.bodies.slot_count(), 0);
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    for (const ClothPin& pin : cloth->pins)
      if (pin.body) loaded[pin.body.index] = 1;
  });
  for (const auto& entry : loads_) loaded[entry.first] = 1;
  return loaded;
}

/// Returns the bodies that cloths may touch in a sub-step of length h, and the bodies that hold pins.
std::vector<ClothBody> ClothMotion::bodies_near_cloths(Real h) const {
  const std::vector<uint8_t> holds = loaded_bodies();
  const Aabb around = system_.reach(h);
  std::vector<ClothBody> near;
  world_.bodies.for_each([&](BodyHandle handle, const std::unique_ptr<Body>& body) {
    if (body->absent || (!body->def.collides && !holds[handle.index])) return;
    Obstacle obstacle = swept_obstacle(*body, h);
    if (!holds[handle.index] && !std::holds_alternative<Plane>(*obstacle.solid.shape) &&
        !obstacle.swept_bounds().intersects(around))
      return;
    Vec3 velocity = obstacle.velocity, spin = obstacle.angular_velocity;
    if (body->is_awake()) {
      velocity = body->rigid.velocity();
      spin = body->rigid.angular_velocity();
    } else {
      obstacle.inverse_mass = 0;  // asleep: cloth does not move the body until it wakes
    }
    near.emplace_back(obstacle, h, velocity, spin);
    near.back().collides = body->def.collides;
    if (const auto load = loads_.find(handle.index); load != loads_.end() && body->is_awake())
      near.back().expect(h * load->second.force.expected(), load->second.lead);
  });
  return near;
}

/// Returns whether the cloth is still between two sleeping bodies.
bool ClothMotion::is_between(const PressedCloth& pressed) const {
  return std::ranges::any_of(pressed.places, [&](const PairLayer::Place& place) {
    const std::unique_ptr<Cloth>* const found = world_.cloths.find(world_.cloths.at_slot(place.cloth));
    if (!found) return false;
    const Cloth& cloth = **found;
    if (cloth.absent || cloth.stopped || place.number >= cloth.triangles.size()) return false;
    const Triangle& t = cloth.triangles[place.number];
    const LayerTriangle triangle{{cloth.points[t[0]], cloth.points[t[1]], cloth.points[t[2]]},
                                 Vec3::Zero(),
                                 cloth.def.thickness,
                                 cloth.def.friction,
                                 place.cloth,
                                 place.number};
    return std::abs(crossing(triangle, place.middle, place.normal)) < kStillThere * cloth.def.thickness;
  });
}

/// Finds the bodies that press cloth. While both bodies are asleep, they press it as before. They wake when
/// the cloth is no longer between them.
void ClothMotion::find_pressed(std::span<ContactPair* const> pairs) {
  std::vector<PressedCloth> now;
  for (const ContactPair* pair : pairs) {
    const PairLayer* layer = pair->layer();
    if (!layer) continue;
    Real force = 0;
    for (const PlacedManifold& m : pair->manifolds())
      for (uint32_t k = 0; k < m.manifold.count; ++k) force += std::max(m.forces[k].now.x(), 0.0);
    now.push_back({pair->a().handle, pair->b().handle, force, layer->slides || layer->holds_by_a,
                   layer->slides || !layer->holds_by_a, layer->places});
  }
  std::vector<Body*> uncovered;
  for (PressedCloth& before : pressed_) {
    const std::unique_ptr<Body>*a = world_.bodies.find(before.a), *b = world_.bodies.find(before.b);
    if (!a || !b || (*a)->is_awake() || (*b)->is_awake() || (*a)->absent || (*b)->absent) continue;
    const auto is_same = [&](const PressedCloth& p) { return p.a == before.a && p.b == before.b; };
    if (std::ranges::any_of(now, is_same)) continue;
    if (!is_between(before)) {
      for (Body* body : {a->get(), b->get()})
        if (body->asleep) uncovered.push_back(body);
      continue;
    }
    now.push_back(std::move(before));
  }
  pressed_ = std::move(now);
  for (Body* body : uncovered) active_.wake(*body);
}

/// Lets bodies with joints that hold cloth, or that cloth pulled in the last sub-step, move as the joints
/// permit. Pins pull from the first sub-step on, when no load is known yet: a light body that moved freely in
/// this sub-step would be far from where the joints hold it.
void ClothMotion::set_joints(std::span<ClothBody> near, Real h, const BodyReactions& reactions) const {
  const std::vector<uint8_t> loaded = loaded_bodies();
  for (ClothBody& at : near) {
    const uint32_t slot = at.obstacle().body;
    if (!loaded[slot] || !at.is_dynamic()) continue;
    const auto load = loads_.find(slot);
    const Vec6 push =
        load == loads_.end() ? Vec6(Vec6::Zero()) : Vec6(h * stacked(load->second.force.last()));
    std::vector<ClothBody::Connected> connected;
    const std::map<uint32_t, Mat6> responses = reactions.link_responses(slot, push);
    if (responses.empty()) continue;
    for (ClothBody& other : near)
      if (const auto of = responses.find(other.obstacle().body); of != responses.end() && &other != &at)
        connected.push_back({&other, of->second});
    at.set_joints(responses.at(slot), std::move(connected));
  }
}

void ClothMotion::step(Real start, Real h, std::span<ContactPair* const> pairs, BodyReactions& reactions,
                       StepReport& report) {
  find_pressed(pairs);
  std::vector<ClothBody> near = bodies_near_cloths(h);
  for (const auto& articulation : world_.articulations) articulation->begin_impulses(start + h);
  set_joints(near, h, reactions);
  set_resting_contacts(world_, pairs, h, near);
  for (const PressedCloth& pressed : pressed_) {
    const auto at = [&](BodyHandle body) {
      return std::ranges::find(near, body.index, [](const ClothBody& n) { return n.obstacle().body; });
    };
    const auto a = at(pressed.a), b = at(pressed.b);
    if (a == near.end() || b == near.end()) continue;
    a->loads.push_back({pressed.b.index, pressed.force * h, pressed.has_friction_a});
    b->loads.push_back({pressed.a.index, pressed.force * h, pressed.has_friction_b});
  }
  const std::vector<const ForceDef*> forces = world_.active_forces();
  system_.step({start, h, world_.def.gravity, world_.def.wind, forces}, near);
  name_first_tears(start);
  wake_unpinned(near);
  reactions.apply(answer(near, h, reactions), start + h, report);
  record_loads(near, h);
}

/// Completes the handles of the bodies that tore cloths since the time `start`. ClothSystem knows the slots.
void ClothMotion::name_first_tears(Real start) {
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    std::optional<ClothTear>& tear = cloth->first_tear;
    if (!tear || !tear->touches_body || tear->body || !(tear->time > start)) return;
    tear->body = world_.bodies.at_slot(tear->body.index);
    cloth->report.first_tear = tear;
  });
}

/// Records the forces of cloths on bodies, and which of these rest on other bodies.
void ClothMotion::record_loads(std::span<const ClothBody> near, Real h) {
  resting_.clear();
  std::map<uint32_t, Wrench> forces;
  for (const ClothBody& at : near) {
    const uint32_t slot = at.obstacle().body;
    if (!at.resting().empty()) resting_.push_back(slot);
    Wrench impulse = at.contained();
    impulse += {at.reaction().impulse, at.reaction().angular_impulse};
    if (!at.is_dynamic() || is_zero(impulse)) continue;
    forces[slot] = (1 / h) * impulse;
    loads_[slot].lead = at.resting().empty() ? at.lead() : Wrench{};
  }
  std::ranges::sort(resting_);
  for (auto& [slot, load] : loads_) {
    const auto force = forces.find(slot);
    load.force.record(force == forces.end() ? Wrench{} : force->second);
    if (force == forces.end()) load.lead = {};
  }
  std::erase_if(loads_, [](const auto& entry) { return entry.second.force.is_over(); });
}

/// Wakes sleeping bodies that no longer hold cloth by pins.
void ClothMotion::wake_unpinned(std::span<const ClothBody> near) {
  std::vector<Body*> released;
  active_.for_each_asleep([&](Body& body) {
    if (!body.sleep.pins) return;
    const bool is_held = std::any_of(near.begin(), near.end(), [&](const ClothBody& at) {
      return at.obstacle().body == body.handle.index && at.pin_load();
    });
    if (!is_held) released.push_back(&body);
  });
  for (Body* body : released) active_.wake(*body);
}

/// Applies the displacements of bodies by cloths in this sub-step, and returns the impulses on the bodies.
std::vector<Reaction> ClothMotion::answer(std::span<const ClothBody> near, Real h, BodyReactions& reactions) {
  std::vector<Reaction> answers;
  std::map<uint32_t, Vec6> jointed;  // by slot: what has displaced a body with joints
  for (const ClothBody& at : near) {
    Body& body = world_.body_at(at.obstacle().body);
    const bool left = std::exchange(body.on_cloth, at.touched) && !at.touched;
    if (!body.is_dynamic()) continue;
    // A body on cloth sleeps while the cloth is at rest. The body wakes when the cloth moves or no longer
    // touches the body.
    if (left || at.touching_speed > kClothRest) active_.wake(body);
    if (body.asleep && at.pin_load()) {
      const Wrench pull{at.pin_load()->impulse / h, at.pin_load()->angular_impulse / h};
      if (!body.sleep.pins) body.sleep.pins = pull;
      if (is_pushed(body, pull, *body.sleep.pins)) active_.wake(body);
    }
    if ((!at.touched && is_zero(at.contained())) || body.asleep) continue;
    // The body stays where cloth touched it. If the body returned to its position without cloth, it would
    // drag the cloth along each time. Cloth that is pinched between two bodies acts only on their velocities,
    // unless there is an impact.
    if (!at.pinches || at.reaction().impulse.norm() > kImpact * body.rigid.mass) {
      if (at.is_jointed()) {
        jointed[body.handle.index] = at.displacing_impulse();
      } else {
        body.pose = at.own_end();
        body.rigid.place(body.pose);
      }
    }
    answers.push_back(at.reaction());
    push_supports(at, answers);
  }
  reactions.displace_links(jointed);
  return answers;
}

/// Passes on what the contacts of a body with others have balanced of the impulses of cloth.
void ClothMotion::push_supports(const ClothBody& at, std::vector<Reaction>& reactions) {
  Wrench held;
  const std::span<const RestingContact> contacts = at.resting().contacts();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const RestingContact& c = contacts[k];
    const Vec3 impulse = -at.resting().impulse(k);
    if (impulse == Vec3::Zero()) continue;
    if (c.yield > 0) {
      const Vec3 arm = at.centre() + c.arm - world_.body_at(c.other).rigid.position;
      reactions.push_back({c.other, impulse, arm.cross(impulse)});
    } else {
      held += {impulse, c.arm.cross(impulse)};
    }
  }
  const BodyHandle body = world_.bodies.at_slot(at.obstacle().body);
  if (!is_zero(held)) pushes_.push_back({body, held});
}

void ClothMotion::report(StepReport& report) {
  system_.measure();
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    const ClothReport& r = cloth->report;
    ClothFigures& all = report.cloth;
    all.strain = std::max(all.strain, r.max_strain);
    all.penetration = std::max(all.penetration, r.penetration);
    all.contacts += r.contacts;
    all.self_contacts += r.self_contacts;
    all.springs_clamped += r.clamped;
    all.moves_limited += r.limited;
    all.moves_held_back += r.held_back;
    all.crossings += r.crossings;
    all.springs_torn += r.torn;
    all.unconverged += r.unconverged;
    if (!r.finite && report.finite)
      report.non_finite = {.object = cloth->def.name, .position_before = cloth->points[0]};
    report.finite &= r.finite;
  });
}

}  // namespace offstage::sim
