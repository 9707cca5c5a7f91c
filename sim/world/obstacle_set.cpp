#include "sim/world/obstacle_set.h"

#include <cmath>
#include <vector>

namespace offstage::sim {

Obstacle swept_obstacle(const Body& body, Real h, bool is_fixed) {
  const Pose& from = body.can_move() ? body.before_substep : body.pose;
  Obstacle o(body.solid, from, body.pose, h, body.def.restitution, body.def.friction);
  o.body = body.handle.index;
  if (body.def.cross_friction >= 0 && body.def.friction > 0) {
    o.friction_axis = body.def.friction_axis;
    o.cross_friction = std::sqrt(body.def.cross_friction / body.def.friction);
  }
  o.surface_velocity = body.def.surface_velocity;
  if (!body.is_dynamic() || is_fixed) return o;
  const RigidBody& rigid = body.rigid;
  const Mat3 axes = rigid.orientation.toRotationMatrix();
  o.inverse_mass = 1 / rigid.mass;
  o.inverse_inertia = axes * rigid.inverse_inertia * axes.transpose();
  o.centre = rigid.centre;
  o.end_velocity = rigid.velocity();
  o.end_spin = rigid.angular_velocity();
  return o;
}

void ObstacleSet::update(const WorldState& world, const ActiveBodies& active, Real h, bool fixes_dynamic) {
  const bool keeps_fixed = is_current_ && version_ == active.version() && fixes_dynamic_ == fixes_dynamic;
  std::vector<Obstacle> fixed, moving;
  world.bodies.for_each([&](BodyHandle, const std::unique_ptr<Body>& body) {
    if (!body->collides()) return;
    if (body->can_move() && !(fixes_dynamic && body->is_dynamic()))
      moving.push_back(swept_obstacle(*body, h));
    else if (!keeps_fixed)
      fixed.push_back(swept_obstacle(*body, h, fixes_dynamic));
  });
  moving_ = Obstacles(std::move(moving));
  if (!keeps_fixed) fixed_ = Obstacles(std::move(fixed));
  is_current_ = true;
  version_ = active.version();
  fixes_dynamic_ = fixes_dynamic;
}

}  // namespace offstage::sim
