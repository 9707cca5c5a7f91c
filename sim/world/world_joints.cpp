/// Joints in the interface of the world: their checks, and their state.

#include <cmath>
#include <stdexcept>

#include "sim/world/world_impl.h"

namespace offstage::sim {
namespace {

[[noreturn]] void refuse(const JointDef& def, const std::string& what) {
  throw std::invalid_argument((def.name.empty() ? "joint" : "joint \"" + def.name + '"') + ": " + what);
}

void check_not_negative(const JointDef& def, const char* field, Real value) {
  if (!(value >= 0)) refuse(def, std::string(field) + " is " + std::to_string(value) + ", allowed is >= 0");
}

/// Checks the fields that gears, racks, screws and pulleys need.
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
    refuse(def, "pulley_a and pulley_b must be finite");
  if (!((def.anchor - def.pulley_a).norm() > 1e-9) || !((def.anchor_b - def.pulley_b).norm() > 1e-9))
    refuse(def, "an anchor is at its pulley; both strands of the rope need a length");
}

void check(const JointDef& def) {
  for (const auto& [field, v] : {std::pair("anchor", def.anchor),
                                 {"anchor_b", def.anchor_b},
                                 {"axis", def.axis},
                                 {"second_axis", def.second_axis}})
    if (!v.allFinite()) refuse(def, std::string(field) + " must be finite");
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
                    ", allowed is a range that contains 0, the coordinate at creation");
  check_not_negative(def, "swing", def.swing);
  if (def.has_limits() && def.type == JointType::fixed)
    refuse(def, "limits have no effect on a fixed joint; remove them");
  if (def.swing < JointDef::kFree && def.type != JointType::spherical && def.type != JointType::universal)
    refuse(def, "swing limits only spherical and universal joints; remove it or change the type");
  check_not_negative(def, "friction", def.friction);
  check_not_negative(def, "damping", def.damping);
  check_not_negative(def, "stiffness", def.stiffness);
  if (def.stiffness > 0 && def.type != JointType::spherical)
    refuse(def, "stiffness acts only on spherical joints; give other joints a motor with a stiffness");
  check_not_negative(def, "max_force", def.max_force);
  check_not_negative(def, "max_torque", def.max_torque);
  check_not_negative(def, "motor.max_effort", def.motor.max_effort);
  check_not_negative(def, "motor.stiffness", def.motor.stiffness);
  check_not_negative(def, "motor.damping", def.motor.damping);
  const bool can_drive = def.type == JointType::revolute || def.type == JointType::prismatic ||
                         def.type == JointType::distance || def.type == JointType::screw;
  if (def.motor.mode != Motor::Mode::none && !can_drive)
    refuse(
        def,
        "a motor drives only revolute, prismatic, screw and distance joints; remove it or change the type");
  if ((def.friction > 0 || def.damping > 0) && !def.has_free_coordinate())
    refuse(
        def,
        "friction and damping have no effect on a joint without a free coordinate, such as a fixed joint or "
        "a rod without limits and motor; remove them");
  for (std::size_t i = 0; i < def.motor.targets.size(); ++i)
    if (const Motor::Key& key = def.motor.targets[i]; !std::isfinite(key.time) ||
                                                      !std::isfinite(key.target) ||
                                                      (i > 0 && key.time <= def.motor.targets[i - 1].time))
      refuse(def, "motor.targets must be finite, with strictly increasing times");
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
    const Real fraction = (time - from.time) / (to.time - from.time);
    return from.target + fraction * fraction * (3 - 2 * fraction) * (to.target - from.target);
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
  if (joint->a == joint->b) refuse(def, "a and b are the same body; a joint connects two bodies");
  if (def.type == JointType::pulley && !def.has_limits()) joint->def.upper = 0;
  fit(*joint);
  if (!(def.appear_at >= 0) || !(def.remove_at > def.appear_at))
    refuse(def, "appear_at must be >= 0 and remove_at later than appear_at");
  joint->is_absent = def.appear_at > 0 || (joint->a && joint->a->absent) || (joint->b && joint->b->absent);
  impl_->has_lifetimes |= joint->is_absent || std::isfinite(def.remove_at);
  for (Body* end : {joint->a, joint->b})
    if (end) impl_->active.wake(*end);
  const JointHandle handle = impl_->joints.insert(std::move(joint));
  impl_->joints[handle]->handle = handle;
  impl_->joint_groups.note_change();
  return handle;
}

bool World::remove(JointHandle handle) {
  const auto* found = impl_->joints.find(handle);
  if (!found) return false;
  for (Body* end : {(*found)->a, (*found)->b})
    if (end) impl_->active.wake(*end);
  impl_->joints.erase(handle);
  impl_->joint_groups.note_change();
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

}  // namespace offstage::sim
