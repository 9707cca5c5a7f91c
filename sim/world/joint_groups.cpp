#include "sim/world/joint_groups.h"

#include <algorithm>
#include <map>
#include <set>

#include "sim/core/disjoint_sets.h"

namespace offstage::sim {
namespace {

JointFrame in_body(const Body* body, const Vec3& point, const Mat3& axes) {
  if (!body) return {point, axes};
  return {body->pose.point_to_body(point), body->pose.orientation.toRotationMatrix().transpose() * axes};
}

bool is_dynamic(const Body* body) {
  return body && body->is_dynamic();
}

/// Returns the slots of a component's colliding bodies, except immovable ones. Bodies connected by a joint
/// are adjacent where possible.
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

/// Whether a joint keeps its bodies moving: by a motor that moves now or later, or by a kinematic link that
/// moves.
bool drives(const Joint& joint, Real time) {
  const Motor& motor = joint.def.motor;
  const bool has_keys_left = motor.targets.size() > 1 && motor.targets.back().time > time;
  const bool turns_on = motor.mode == Motor::Mode::speed && motor.target(time) != 0;
  if (motor.mode != Motor::Mode::none && (has_keys_left || turns_on)) return true;
  const auto moves = [](const Body* body) { return body && body->is_kinematic() && body->def.track.moves(); };
  return moves(joint.a) || moves(joint.b);
}

}  // namespace

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

void place_at_bodies(Joint& joint) {
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
bool JointGroups::update() {
  if (std::exchange(is_current_, true)) return false;
  const std::size_t slots = world_.bodies.slot_count();
  world_.articulations.clear();
  colliding_.clear();
  apart_.clear();
  DisjointSets sets(slots);
  std::vector<Joint*> holding;
  world_.joints.for_each([&](JointHandle, const std::unique_ptr<Joint>& joint) {
    joint->articulation = nullptr;
    if (joint->is_broken || joint->is_absent || (!is_dynamic(joint->a) && !is_dynamic(joint->b))) return;
    holding.push_back(joint.get());
    if (joint->a && joint->b && !joint->def.collide)
      apart_.push_back(std::minmax(joint->a->handle.index, joint->b->handle.index));
    if (!is_dynamic(joint->a) || !is_dynamic(joint->b)) return;
    sets.join(joint->a->handle.index, joint->b->handle.index);
  });
  std::sort(apart_.begin(), apart_.end());
  std::vector<std::size_t> number(slots, SIZE_MAX);
  std::vector<std::vector<Joint*>> components;
  for (Joint* joint : holding) {
    std::size_t& n = number[sets.find((is_dynamic(joint->a) ? joint->a : joint->b)->handle.index)];
    if (n == SIZE_MAX) {
      n = components.size();
      components.emplace_back();
    }
    components[n].push_back(joint);
  }
  for (std::vector<Joint*>& component : components) {
    colliding_.push_back(colliding_links(component));
    world_.articulations.push_back(std::make_unique<Articulation>(std::move(component)));
  }
  links_.assign(slots, {});
  articulation_of_.assign(slots, nullptr);
  for (const auto& articulation : world_.articulations)
    for (uint32_t k = 0; k < articulation->bodies().size(); ++k) {
      const uint32_t slot = articulation->bodies()[k]->handle.index;
      links_[slot] = {articulation.get(), k};
      articulation_of_[slot] = articulation.get();
    }
  return true;
}

void JointGroups::break_overloaded(Real h, StepReport& report) {
  for (const auto& articulation : world_.articulations) {
    if (!articulation->bodies().front()->is_awake()) continue;
    for (Joint* joint : articulation->joints()) {
      const Wrench impact = std::exchange(joint->impact_impulse, {});
      joint->borne = {joint->load.force + impact.force / h, joint->load.torque + impact.torque / h};
      if (!(joint->borne.force.norm() > joint->def.max_force) &&
          !(joint->borne.torque.norm() > joint->def.max_torque))
        continue;
      joint->is_broken = true;
      note_change();
      report.joints_broken.push_back(joint->handle);
    }
  }
}

void JointGroups::detach(const Body& body, ActiveBodies& active) {
  std::vector<JointHandle> gone;
  world_.joints.for_each([&](JointHandle handle, const std::unique_ptr<Joint>& joint) {
    if (joint->a == &body || joint->b == &body) gone.push_back(handle);
  });
  for (JointHandle handle : gone) {
    const Joint& joint = *world_.joints[handle];
    for (Body* end : {joint.a, joint.b})
      if (end && end != &body) active.wake(*end);
    world_.joints.erase(handle);
  }
  if (!gone.empty()) note_change();
}

bool is_driven(const Island& island, Real time) {
  return std::any_of(island.articulations.begin(), island.articulations.end(), [&](const Articulation* a) {
    return std::any_of(a->joints().begin(), a->joints().end(),
                       [&](const Joint* joint) { return drives(*joint, time); });
  });
}

bool JointGroups::is_collision_disabled(const Body& a, const Body& b) const {
  return std::binary_search(apart_.begin(), apart_.end(),
                            std::pair<uint32_t, uint32_t>(std::minmax(a.handle.index, b.handle.index)));
}

Articulation* JointGroups::articulation_of(uint32_t slot) const {
  return slot < articulation_of_.size() ? articulation_of_[slot] : nullptr;
}

}  // namespace offstage::sim
