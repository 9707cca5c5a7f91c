/// Removes objects, and lets bodies, joints and cloths appear or disappear at given times. Their handles are
/// valid before they appear and after they disappear, so that other objects can refer to them.

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// Times of sub-steps that differ by less than this are equal [s].
constexpr Real kSameTime = 1e-9;

bool has_come(Real time, Real now) {
  return now >= time - kSameTime;
}

}  // namespace

bool World::is_present(BodyHandle body) const {
  return !impl_->bodies[body]->absent;
}

bool World::is_present(ClothHandle cloth) const {
  return !impl_->cloths[cloth]->absent;
}

void World::Impl::update_presence(Real time) {
  if (!has_lifetimes) return;
  std::vector<Body*> gone;
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    const bool exists = has_come(body->def.appear_at, time) && !has_come(body->def.remove_at, time);
    if (exists && body->absent) appear(*body, time);
    if (!exists && !body->absent) gone.push_back(body.get());
  });
  for (Body* body : gone) take_out(*body);
  update_joint_presence(time);
  bool changed = false;
  cloths.for_each([&](ClothHandle, const std::unique_ptr<Cloth>& cloth) {
    const bool exists = has_come(cloth->def.appear_at, time) && !has_come(cloth->def.remove_at, time);
    if (cloth->absent != exists) return;
    changed = true;
    cloth->absent = !exists;
    if (exists) cloth_motion.place_pins(*cloth);
  });
  if (!changed) return;
  active.wake_all();
  cloth_motion.arrange();
}

void World::Impl::appear(Body& body, Real time) {
  body.absent = false;
  body.was_present = true;
  body.type = body.def.motion;
  if (body.is_kinematic()) body.pose = body.def.track.at(time, body.def.pose).pose;
  body.before_step = body.before_substep = body.start_pose = body.pose;
  cloth_motion.place_pins(body);
  contacts.add(body);
  wake_overlapped(body, body.pose);
  wake_at_springs(body);
  if (body.is_dynamic() || body.is_kinematic()) active.add_stepped(body);
  active.note_new_set();
  joint_groups.note_change();
}

/// Removes a body from the simulation, with everything that is fastened to it. Its handle stays valid.
void World::Impl::take_out(Body& body) {
  detach(body);
  cloth_motion.detach(body.handle);
  joints.for_each([&](JointHandle, const std::unique_ptr<Joint>& joint) {
    if (joint->a != &body && joint->b != &body) return;
    for (Body* end : {joint->a, joint->b})
      if (end && end != &body) active.wake(*end);
  });
  body.absent = true;
  body.type = MotionType::static_body;
  body.rigid.momentum.setZero();
  body.rigid.angular_momentum.setZero();
  reactions.forget(body);
  contacts.remove(body);
  active.note_change();
  joint_groups.note_change();
  remove_dead_springs();
}

void World::Impl::update_joint_presence(Real time) {
  joints.for_each([&](JointHandle, const std::unique_ptr<Joint>& joint) {
    const auto exists = [](const Body* body) { return !body || !body->absent; };
    const bool acts = has_come(joint->def.appear_at, time) && !has_come(joint->def.remove_at, time) &&
                      exists(joint->a) && exists(joint->b);
    if (acts != joint->is_absent) return;
    for (Body* end : {joint->a, joint->b})
      if (end) active.wake(*end);
    if (acts && now > 0) place_at_bodies(*joint);
    joint->is_absent = !acts;
    joint_groups.note_change();
  });
}

void World::Impl::wake_neighbours(Body& body) {
  contacts.for_each([&](ContactPair& pair) {
    if (&pair.a() == &body) active.wake(pair.b());
    if (&pair.b() == &body) active.wake(pair.a());
  });
}

/// Wakes the sleeping bodies that a body may overlap when it appears at a place or jumps to it.
void World::Impl::wake_overlapped(const Body& body, const Pose& pose) {
  if (!body.collides()) return;
  const Aabb box = bounds(body.solid, pose);
  bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& other) {
    if (other->asleep && bounds(other->solid, other->pose).intersects(box)) active.wake(*other);
  });
}

/// Wakes the sleeping bodies that springs connect to a body that appears.
void World::Impl::wake_at_springs(const Body& body) {
  springs.for_each([&](SpringHandle, const Spring& s) {
    for (const auto& [own, other] : {std::pair(&s.def.a, &s.def.b), {&s.def.b, &s.def.a}}) {
      const auto *at = std::get_if<BodyPoint>(own), *end = std::get_if<BodyPoint>(other);
      if (at && end && at->body == body.handle && acts(s)) active.wake(*bodies[end->body]);
    }
  });
}

/// Wakes the bodies that rest on a body that is removed.
void World::Impl::detach(Body& body) {
  active.wake(body);
  wake_neighbours(body);
  contacts.forget(body);
  active.forget(body);
  islands.clear();
}

/// Removes springs that have lost an end, and wakes the bodies at their other ends.
void World::Impl::remove_dead_springs() {
  std::vector<SpringHandle> dead;
  springs.for_each([&](SpringHandle handle, const Spring& s) {
    if (!is_alive(s.def.a) || !is_alive(s.def.b)) dead.push_back(handle);
  });
  for (SpringHandle handle : dead) {
    const SpringDef& def_ = springs[handle].def;
    for (const Attachment* end : {&def_.a, &def_.b})
      if (const auto* point = std::get_if<BodyPoint>(end); point && is_alive(*end))
        active.wake(*bodies[point->body]);
    springs.erase(handle);
  }
}

}  // namespace offstage::sim
