#include "sim/articulation/joint_energy.h"

#include <algorithm>

#include <Eigen/LU>

#include "sim/articulation/joint_rows.h"

namespace offstage::sim {
namespace {

template <class Is>
bool any_end(const Articulation& articulation, Is&& is) {
  return std::any_of(articulation.joints().begin(), articulation.joints().end(),
                     [&](const Joint* joint) { return is(joint->a) || is(joint->b); });
}

CommonMotion frame_of(const Articulation& articulation) {
  return is_held(articulation) ? CommonMotion{} : common_motion(articulation.bodies());
}

}  // namespace

CommonMotion common_motion(std::span<Body* const> bodies) {
  CommonMotion common;
  Real mass = 0;
  for (const Body* body : bodies) {
    mass += body->rigid.mass;
    common.centre += body->rigid.mass * body->rigid.position;
    common.velocity += body->rigid.momentum;
  }
  common.centre /= mass;
  common.velocity /= mass;
  Mat3 inertia = Mat3::Zero();
  for (const Body* body : bodies) {
    const RigidBody& r = body->rigid;
    const Vec3 arm = r.position - common.centre;
    const Mat3 axes = r.orientation.toRotationMatrix();
    common.angular_momentum += arm.cross(r.momentum) + r.angular_momentum;
    inertia += axes * r.inertia * axes.transpose() +
               r.mass * (arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose());
  }
  common.inverse_inertia = inertia.inverse();
  common.angular_velocity = common.inverse_inertia * common.angular_momentum;
  return common;
}

Real joint_gap(const Articulation& articulation, Real time) {
  Real gap = 0;
  JointRows rows;
  for (const Joint* joint : articulation.joints()) {
    const LinkMotion a = link_motion(joint->a, time), b = link_motion(joint->b, time);
    const JointFrame on_a = link_frame(joint->a, joint->on_a), on_b = link_frame(joint->b, joint->on_b);
    set_joint_rows(joint->def, JointPlace(a, on_a, b, on_b), joint->length, rows);
    gap = std::max(gap, rows.error.cwiseAbs().maxCoeff());
  }
  return gap;
}

Real spring_energy(const Joint& joint, Real time) {
  if (joint.is_broken || joint.is_absent) return 0;
  const JointDef& def = joint.def;
  const Motor& motor = def.motor;
  const bool servo = motor.mode == Motor::Mode::position && motor.stiffness > 0 && def.has_free_coordinate();
  if (!servo && !(def.stiffness > 0)) return 0;
  const LinkMotion a = link_motion(joint.a, time), b = link_motion(joint.b, time);
  const JointFrame on_a = link_frame(joint.a, joint.on_a), on_b = link_frame(joint.b, joint.on_b);
  const JointPlace place(a, on_a, b, on_b);
  Real energy = 0;
  if (def.stiffness > 0) energy += def.stiffness * rotation_vector(place).squaredNorm() / 2;
  if (servo) {
    const Real coordinate = counts_turns(joint) ? joint.coordinate : free_row(def, place, joint.length).error;
    // The effort k d grows until it reaches its limit at the distance d = effort / k, and is constant beyond.
    const Real missing = std::abs(motor.target(time) - coordinate);
    const Real yielding = std::min(missing, motor.max_effort / motor.stiffness);
    energy += motor.stiffness * yielding * (missing - yielding / 2);
  }
  return energy;
}

bool is_held(const Articulation& articulation) {
  return any_end(articulation, [](const Body* body) { return !body || !body->is_dynamic(); });
}

bool has_kinematic_end(const Articulation& articulation) {
  return any_end(articulation, [](const Body* body) { return body && body->is_kinematic(); });
}

Real internal_energy(const Articulation& articulation) {
  const CommonMotion common = frame_of(articulation);
  Real sum = 0;
  for (const Body* body : articulation.bodies()) {
    const RigidBody& r = body->rigid;
    const Vec3 v = r.velocity() - common.velocity_at(r.position),
               w = r.angular_velocity() - common.angular_velocity;
    sum += (r.mass * v.squaredNorm() + w.dot(r.spin_momentum(r.orientation, w))) / 2;
  }
  return sum;
}

void slow_down(const Articulation& articulation, Real fraction) {
  const CommonMotion common = frame_of(articulation);
  for (Body* body : articulation.bodies()) {
    RigidBody& r = body->rigid;
    const Vec3 v = common.velocity_at(r.position), w = common.angular_velocity;
    r.set_velocity(v + fraction * (r.velocity() - v), w + fraction * (r.angular_velocity() - w));
  }
}

void keep_angular_momentum(std::span<Body* const> bodies, const CommonMotion& before) {
  const CommonMotion now = common_motion(bodies);
  const Vec3 w = now.inverse_inertia * (before.angular_momentum - now.angular_momentum);
  for (Body* body : bodies) {
    RigidBody& r = body->rigid;
    r.set_velocity(r.velocity() + w.cross(r.position - now.centre), r.angular_velocity() + w);
  }
}

}  // namespace offstage::sim
