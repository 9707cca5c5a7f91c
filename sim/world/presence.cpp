/// Bodies, joints and cloths that exist for some time only. Their handles are valid all the time, so that
/// other objects can refer to them.

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

/// Times of sub-steps that differ by less than this are equal [s].
constexpr Real kSameTime = 1e-9;

bool has_come(Real time, Real now) {
  return now >= time - kSameTime;
}

}  // namespace

bool WorldState::acts(const Spring& spring) const {
  const auto exists = [&](const Attachment& end) {
    const auto* point = std::get_if<BodyPoint>(&end);
    return !point || !bodies[point->body]->absent;
  };
  return exists(spring.def.a) && exists(spring.def.b);
}

bool World::is_present(BodyHandle body) const {
  return !impl_->bodies[body]->absent;
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
    changed |= cloth->absent == exists;
    cloth->absent = !exists;
  });
  if (!changed) return;
  wake_all();
  arrange_cloths();
}

void World::Impl::appear(Body& body, Real time) {
  body.absent = false;
  body.was_present = true;
  body.type = body.def.motion;
  if (body.is_kinematic()) body.pose = body.def.track.at(time, body.def.pose).pose;
  body.before_step = body.before_substep = body.start_pose = body.pose;
  if (body.def.collides)
    broad_phase.insert(body.handle.index, bounds(body.solid, body.pose), !body.is_dynamic());
  if (body.is_dynamic() || body.is_kinematic()) stepped.push_back(&body);
  fixed_changed = lists_changed = ranks_changed = joints_changed = pairs_changed = true;
}

/// Removes a body from the simulation, with everything that is fastened to it. Its handle stays valid.
void World::Impl::take_out(Body& body) {
  detach(body);
  detach_cloths(body.handle);
  joints.for_each([&](JointHandle, const std::unique_ptr<Joint>& joint) {
    if (joint->a != &body && joint->b != &body) return;
    for (Body* end : {joint->a, joint->b})
      if (end && end != &body) wake(*end);
  });
  body.absent = true;
  body.type = MotionType::static_body;
  body.rigid.momentum.setZero();
  body.rigid.angular_momentum.setZero();
  pending_impulses.erase(body.handle.index);
  if (broad_phase.contains(body.handle.index)) broad_phase.remove(body.handle.index);
  fixed_changed = lists_changed = joints_changed = true;
  remove_dead_springs();
}

void World::Impl::update_joint_presence(Real time) {
  joints.for_each([&](JointHandle, const std::unique_ptr<Joint>& joint) {
    const auto exists = [](const Body* body) { return !body || !body->absent; };
    const bool acts = has_come(joint->def.appear_at, time) && !has_come(joint->def.remove_at, time) &&
                      exists(joint->a) && exists(joint->b);
    if (acts != joint->is_absent) return;
    for (Body* end : {joint->a, joint->b})
      if (end) wake(*end);
    if (acts && now > 0) place(*joint);
    joint->is_absent = !acts;
    joints_changed = true;
  });
}

}  // namespace offstage::sim
