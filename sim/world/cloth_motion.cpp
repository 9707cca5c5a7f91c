#include "sim/world/cloth_motion.h"

#include <algorithm>
#include <utility>

#include "sim/world/obstacle_set.h"

namespace offstage::sim {
namespace {

/// Cloth is at rest under a body if it moves there at less than this [m/s].
constexpr Real kClothRest = 0.05;
/// A change of a body's speed in a sub-step counts as an impact above this [m/s]. Gravity changes the speed
/// by about a fifth of it.
constexpr Real kImpact = 0.2;

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
}

void ClothMotion::begin_step() {
  world_.cloths.for_each(
      [](ClothHandle, const std::unique_ptr<Cloth>& cloth) { cloth->report = {.finite = !cloth->stopped}; });
}

/// Returns the bodies that cloths may touch in a sub-step of length h, and the bodies that hold pins.
std::vector<ClothBody> ClothMotion::bodies_near_cloths(Real h) const {
  std::vector<uint8_t> holds(world_.bodies.slot_count(), 0);
  world_.cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    for (const ClothPin& pin : cloth->pins)
      if (pin.body) holds[pin.body.index] = 1;
  });
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
    near.emplace_back(obstacle, h, velocity, spin, body->def.surface_velocity);
    near.back().collides = body->def.collides;
  });
  return near;
}

std::vector<Reaction> ClothMotion::step(Real start, Real h) {
  std::vector<ClothBody> near = bodies_near_cloths(h);
  const std::vector<const ForceDef*> forces = world_.active_forces();
  system_.step({start, h, world_.def.gravity, world_.def.wind, forces}, near);
  wake_unpinned(near);
  return answer(near, h);
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
std::vector<Reaction> ClothMotion::answer(std::span<const ClothBody> near, Real h) {
  std::vector<Reaction> reactions;
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
    if (!at.touched || body.asleep) continue;
    // The body stays where cloth touched it. If the body returned to its position without cloth, it would
    // drag the cloth along each time. Cloth that is pinched between two bodies acts only on their velocities,
    // unless there is an impact.
    if (!at.pinches || at.reaction().impulse.norm() > kImpact * body.rigid.mass) {
      body.pose = at.end();
      body.rigid.place(body.pose);
    }
    reactions.push_back(at.reaction());
  }
  return reactions;
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
