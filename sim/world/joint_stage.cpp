/// Joints of the world: checks, and the articulations that they form (physics A1, A2).

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

#include "sim/core/disjoint_sets.h"
#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

[[noreturn]] void refuse(const JointDef& def, const std::string& what) {
  throw std::invalid_argument((def.name.empty() ? "joint" : "joint \"" + def.name + '"') + ": " + what);
}

void check_not_negative(const JointDef& def, const char* field, Real value) {
  if (!(value >= 0)) refuse(def, std::string(field) + " is " + std::to_string(value) + ", allowed is >= 0");
}

/// Checks what gears, racks, screws and pulleys need.
void check_kind(const JointDef& def) {
  using enum JointType;
  const bool has_ratio = def.is_coupling() || def.type == screw || def.type == pulley;
  if (has_ratio && (!std::isfinite(def.ratio) || def.ratio == 0))
    refuse(def, "ratio is " + std::to_string(def.ratio) + ", allowed is a finite number other than 0");
  if (def.is_coupling() && (!def.a || !def.b)) refuse(def, "a gear or rack needs two bodies");
  if (def.is_coupling() && !(def.second_axis.norm() > 1e-9))
    refuse(def, "second_axis is 0 0 0, allowed is any direction");
  if (def.is_coupling() && (def.has_limits() || def.motor.mode != Motor::Mode::none))
    refuse(def, "a gear or rack has no limits and no motor; give them to the joints of its bodies");
  if (def.type != pulley) return;
  if (!(def.ratio > 0))
    refuse(def, "ratio is " + std::to_string(def.ratio) + ", allowed is > 0 for a pulley");
  if (!def.pulley_a.allFinite() || !def.pulley_b.allFinite())
    refuse(def, "pulley_a or pulley_b is not finite");
  if (!((def.anchor - def.pulley_a).norm() > 1e-9) || !((def.anchor_b - def.pulley_b).norm() > 1e-9))
    refuse(def, "an anchor is at its pulley; both strands of the rope need a length");
}

void check(const JointDef& def) {
  for (const auto& [field, v] : {std::pair("anchor", def.anchor),
                                 {"anchor_b", def.anchor_b},
                                 {"axis", def.axis},
                                 {"second_axis", def.second_axis}})
    if (!v.allFinite()) refuse(def, std::string(field) + " is not finite");
  if (!(def.axis.norm() > 1e-9)) refuse(def, "axis is 0 0 0, allowed is any direction");
  if (def.type == JointType::universal && !(def.axis.normalized().cross(def.second_axis).norm() > 1e-6))
    refuse(def, "second_axis is along axis, allowed is any direction across it");
  if (def.type == JointType::distance && !((def.anchor - def.anchor_b).norm() > 1e-9))
    refuse(def, "anchor and anchor_b are at the same place; a rod needs a length");
  check_kind(def);
  if (!(def.restitution >= 0 && def.restitution <= 1))
    refuse(def, "restitution is " + std::to_string(def.restitution) + ", allowed is 0 to 1");
  if (!(def.lower <= def.upper) || def.lower > 0 || def.upper < 0)
    refuse(def, "limits are " + std::to_string(def.lower) + " to " + std::to_string(def.upper) +
                    ", allowed is a range that contains 0, where the joint is made");
  check_not_negative(def, "swing", def.swing);
  if (def.has_limits() && def.type == JointType::fixed) refuse(def, "a fixed joint has nothing to limit");
  if (def.swing < JointDef::kFree && def.type != JointType::spherical && def.type != JointType::universal)
    refuse(def, "swing is for spherical and universal joints only");
  check_not_negative(def, "friction", def.friction);
  check_not_negative(def, "damping", def.damping);
  check_not_negative(def, "stiffness", def.stiffness);
  if (def.stiffness > 0 && def.type != JointType::spherical)
    refuse(def, "stiffness is for spherical joints; use a motor with a stiffness for the others");
  check_not_negative(def, "max_force", def.max_force);
  check_not_negative(def, "max_torque", def.max_torque);
  check_not_negative(def, "motor.max_effort", def.motor.max_effort);
  check_not_negative(def, "motor.stiffness", def.motor.stiffness);
  check_not_negative(def, "motor.damping", def.motor.damping);
  const bool can_drive = def.type == JointType::revolute || def.type == JointType::prismatic ||
                         def.type == JointType::distance || def.type == JointType::screw;
  if (def.motor.mode != Motor::Mode::none && !can_drive)
    refuse(def, "a motor drives revolute, prismatic, screw and distance joints only");
  if ((def.friction > 0 || def.damping > 0) && !def.has_free_coordinate())
    refuse(def,
           "friction and damping act where a joint may move: not on a fixed one, nor on a rod without "
           "limits and motor");
  for (std::size_t i = 0; i < def.motor.targets.size(); ++i)
    if (const Motor::Key& key = def.motor.targets[i]; !std::isfinite(key.time) ||
                                                      !std::isfinite(key.target) ||
                                                      (i > 0 && key.time <= def.motor.targets[i - 1].time))
      refuse(def, "motor.targets: must be finite, with strictly increasing times");
}

JointFrame in_body(const Body* body, const Vec3& point, const Mat3& axes) {
  if (!body) return {point, axes};
  return {body->pose.point_to_body(point), body->pose.orientation.toRotationMatrix().transpose() * axes};
}

/// Joins the bodies at their poses, where the definition says.
void fit(Joint& joint) {
  const JointDef& def = joint.def;
  const bool is_rod = def.type == JointType::distance, is_pulley = def.type == JointType::pulley;
  const bool has_two_anchors = is_rod || is_pulley || def.type == JointType::rack;
  joint.on_a = in_body(joint.a, def.anchor, frame_axes(def, false));
  joint.on_b = in_body(joint.b, has_two_anchors ? def.anchor_b : def.anchor, frame_axes(def, true));
  joint.length = is_rod ? (def.anchor - def.anchor_b).norm() : 0;
  if (is_pulley)
    joint.length = (def.anchor - def.pulley_a).norm() + def.ratio * (def.anchor_b - def.pulley_b).norm();
}

bool is_dynamic(const Body* body) {
  return body && body->is_dynamic();
}

/// Slots of the colliding bodies of a component that can move, ordered so that joined bodies are adjacent.
std::vector<uint32_t> colliding_links(std::span<Joint* const> component) {
  std::map<const Body*, std::vector<const Body*>> neighbours;
  const Body* first = nullptr;
  for (const Joint* joint : component) {
    for (const Body* end : {joint->a, joint->b})
      if (is_dynamic(end) && (!first || end->handle.index < first->handle.index)) first = end;
    if (!is_dynamic(joint->a) || !is_dynamic(joint->b)) continue;
    neighbours[joint->a].push_back(joint->b);
    neighbours[joint->b].push_back(joint->a);
  }
  std::vector<uint32_t> slots;
  std::set<const Body*> seen;
  std::vector<const Body*> open = {first};
  while (!open.empty()) {
    const Body* body = open.back();
    open.pop_back();
    if (!seen.insert(body).second) continue;
    if (body->collides()) slots.push_back(body->handle.index);
    const std::vector<const Body*>& next = neighbours[body];
    open.insert(open.end(), next.rbegin(), next.rend());
  }
  return slots;
}

/// Whether the joint keeps its bodies moving: by a motor that moves now or later, or by a moving kinematic
/// link.
bool drives(const Joint& joint, Real time) {
  const Motor& motor = joint.def.motor;
  const bool has_keys_left = motor.targets.size() > 1 && motor.targets.back().time > time;
  const bool turns_on = motor.mode == Motor::Mode::speed && motor.target(time) != 0;
  if (motor.mode != Motor::Mode::none && (has_keys_left || turns_on)) return true;
  const auto moves = [](const Body* body) { return body && body->is_kinematic() && body->def.track.moves(); };
  return moves(joint.a) || moves(joint.b);
}

}  // namespace

Real Motor::target(Real time) const {
  if (targets.empty()) return 0;
  if (time < targets.front().time) return targets.front().target;
  if (time >= targets.back().time) return targets.back().target;
  const auto key = [&](std::size_t k) -> CurveKey<1> {
    const Key& at = targets[k];
    return {at.time, Eigen::Array<Real, 1, 1>(at.target), at.interpolation};
  };
  const std::size_t i = segment_at(
      targets.size(), [&](std::size_t k) { return targets[k].time; }, time);
  const Key &from = targets[i], &to = targets[i + 1];
  if (smooth && from.interpolation == Interpolation::monotone) {
    const Real share = (time - from.time) / (to.time - from.time);
    return from.target + share * share * (3 - 2 * share) * (to.target - from.target);
  }
  return sample_segment<1>(targets.size(), key, false, i, time).value[0];
}

JointHandle World::add_joint(const JointDef& def) {
  check(def);
  const auto body = [&](BodyHandle handle, const char* missing) -> Body* {
    if (!handle) return nullptr;
    const auto* found = impl_->bodies.find(handle);
    if (!found) refuse(def, missing);
    return found->get();
  };
  auto joint = std::make_unique<Joint>();
  joint->def = def;
  joint->a = body(def.a, "a does not exist");
  joint->b = body(def.b, "b does not exist");
  const auto becomes_dynamic = [](const Body* end) {
    return end && (end->is_dynamic() || (end->absent && end->def.motion == MotionType::dynamic));
  };
  if (!becomes_dynamic(joint->a) && !becomes_dynamic(joint->b))
    refuse(def, "at least one of its bodies must be dynamic");
  if (joint->a == joint->b) refuse(def, "a and b are the same");
  if (def.type == JointType::pulley && !def.has_limits()) joint->def.upper = 0;
  fit(*joint);
  if (!(def.appear_at >= 0) || !(def.remove_at > def.appear_at))
    refuse(def, "remove_at must be later than appear_at, which is at least 0");
  joint->is_absent = def.appear_at > 0 || (joint->a && joint->a->absent) || (joint->b && joint->b->absent);
  impl_->has_lifetimes |= joint->is_absent || std::isfinite(def.remove_at);
  for (Body* end : {joint->a, joint->b})
    if (end) impl_->wake(*end);
  const JointHandle handle = impl_->joints.insert(std::move(joint));
  impl_->joints[handle]->handle = handle;
  impl_->joints_changed = true;
  return handle;
}

bool World::remove(JointHandle handle) {
  const auto* found = impl_->joints.find(handle);
  if (!found) return false;
  for (Body* end : {(*found)->a, (*found)->b})
    if (end) impl_->wake(*end);
  impl_->joints.erase(handle);
  impl_->joints_changed = true;
  return true;
}

JointState World::joint(JointHandle handle) const {
  const Joint& joint = *impl_->joints[handle];
  const LinkMotion a = link_motion(joint.a, impl_->now), b = link_motion(joint.b, impl_->now);
  const JointFrame on_a = link_frame(joint.a, joint.on_a), on_b = link_frame(joint.b, joint.on_b);
  const JointPlace place(a, on_a, b, on_b);
  JointState state;
  state.anchor_a = a.position + place.arm_a;
  state.anchor_b = b.position + place.arm_b;
  state.axis = place.axes_b.col(2);
  state.force = joint.borne.force;
  state.torque = joint.borne.torque;
  state.broken = joint.is_broken || joint.is_absent;
  if (joint.def.has_free_coordinate()) {
    const JointRow row = free_row(joint.def, place, joint.length);
    Vec6 va, vb;
    va << a.velocity, a.angular_velocity;
    vb << b.velocity, b.angular_velocity;
    state.coordinate = counts_turns(joint) ? joint.coordinate : row.error;
    state.speed = row.on_a.dot(va) + row.on_b.dot(vb);
  }
  JointRows rows;
  set_joint_rows(joint.def, place, joint.length, rows);
  state.error = rows.error.head<3>().norm();
  return state;
}

const JointDef& World::joint_def(JointHandle joint) const {
  return impl_->joints[joint]->def;
}

void World::for_each_joint(const std::function<void(JointHandle)>& f) const {
  impl_->joints.for_each([&](JointHandle handle, const auto&) { f(handle); });
}

/// Joins the bodies of a joint that appears later at their poses of that time. Anchors and axes have moved
/// with them: those of a with a, or with b if there is no a.
void World::Impl::place(Joint& joint) {
  const auto world = [](const Body* body, const JointFrame& frame) -> JointFrame {
    if (!body) return frame;
    return {body->pose.point_to_world(frame.point), body->pose.orientation.toRotationMatrix() * frame.axes};
  };
  const JointFrame a = world(joint.a, joint.on_a), b = world(joint.b, joint.on_b);
  JointDef& moved_def = joint.def;
  const JointFrame& main = joint.a ? a : b;
  moved_def.anchor = main.point;
  moved_def.anchor_b = b.point;
  moved_def.axis = main.axes.col(2);
  if (moved_def.type == JointType::universal) moved_def.second_axis = main.axes.col(0);
  if (moved_def.type == JointType::gear) moved_def.second_axis = b.axes.col(2);
  joint.coordinate = 0;
  fit(joint);
}

/// Groups the intact joints by the bodies that they connect, in the order of their first joints.
void World::Impl::update_articulations() {
  if (!std::exchange(joints_changed, false)) return;
  articulations.clear();
  links.clear();
  articulation_of.clear();
  apart.clear();
  DisjointSets sets(bodies.slot_count());
  std::vector<Joint*> holding;
  joints.for_each([&](JointHandle, const std::unique_ptr<Joint>& joint) {
    joint->articulation = nullptr;
    if (joint->is_broken || joint->is_absent || (!is_dynamic(joint->a) && !is_dynamic(joint->b))) return;
    holding.push_back(joint.get());
    if (joint->a && joint->b && !joint->def.collide)
      apart.push_back(std::minmax(joint->a->handle.index, joint->b->handle.index));
    if (!is_dynamic(joint->a) || !is_dynamic(joint->b)) return;
    sets.join(joint->a->handle.index, joint->b->handle.index);
  });
  std::sort(apart.begin(), apart.end());
  std::vector<std::size_t> number(bodies.slot_count(), SIZE_MAX);
  std::vector<std::vector<Joint*>> components;
  for (Joint* joint : holding) {
    std::size_t& n = number[sets.find((is_dynamic(joint->a) ? joint->a : joint->b)->handle.index)];
    if (n == SIZE_MAX) {
      n = components.size();
      components.emplace_back();
    }
    components[n].push_back(joint);
  }
  std::vector<std::vector<uint32_t>> groups;
  for (std::vector<Joint*>& component : components) {
    groups.push_back(colliding_links(component));
    articulations.push_back(std::make_unique<Articulation>(std::move(component)));
  }
  broad_phase.set_groups(groups);
  links.assign(bodies.slot_count(), {});
  articulation_of.assign(bodies.slot_count(), nullptr);
  for (const auto& articulation : articulations)
    for (uint32_t k = 0; k < articulation->bodies().size(); ++k) {
      const uint32_t slot = articulation->bodies()[k]->handle.index;
      links[slot] = {articulation.get(), k};
      articulation_of[slot] = articulation.get();
    }
  pairs_changed = true;
}

/// Breaks the joints whose load in a sub-step of length h exceeded their limits.
void World::Impl::break_joints(Real h, StepReport& report) {
  for (const auto& articulation : articulations) {
    if (!articulation->bodies().front()->is_awake()) continue;
    for (Joint* joint : articulation->joints()) {
      const Wrench impact = std::exchange(joint->impact_impulse, {});
      joint->borne = {joint->load.force + impact.force / h, joint->load.torque + impact.torque / h};
      if (!(joint->borne.force.norm() > joint->def.max_force) &&
          !(joint->borne.torque.norm() > joint->def.max_torque))
        continue;
      joint->is_broken = joints_changed = true;
      report.joints_broken.push_back(joint->handle);
    }
  }
}

/// Removes the joints of a body that is removed.
void World::Impl::detach_joints(const Body& body) {
  std::vector<JointHandle> gone;
  joints.for_each([&](JointHandle handle, const std::unique_ptr<Joint>& joint) {
    if (joint->a == &body || joint->b == &body) gone.push_back(handle);
  });
  for (JointHandle handle : gone) {
    const Joint& joint = *joints[handle];
    for (Body* end : {joint.a, joint.b})
      if (end && end != &body) wake(*end);
    joints.erase(handle);
  }
  joints_changed |= !gone.empty();
}

/// Whether a joint prevents an island from falling asleep.
bool World::Impl::is_driven(const Island& island, Real time) const {
  return std::any_of(island.articulations.begin(), island.articulations.end(), [&](const Articulation* a) {
    return std::any_of(a->joints().begin(), a->joints().end(),
                       [&](const Joint* joint) { return drives(*joint, time); });
  });
}

bool World::Impl::are_jointed(const Body& a, const Body& b) const {
  return std::binary_search(apart.begin(), apart.end(),
                            std::pair<uint32_t, uint32_t>(std::minmax(a.handle.index, b.handle.index)));
}

}  // namespace offstage::sim
