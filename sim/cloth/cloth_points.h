#pragma once
/// The points of all cloths of a world, as structures of arrays.

#include <algorithm>
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "sim/core/types.h"
#include "sim/geometry/mesh.h"

namespace offstage::sim {

class ClothBody;

/// x, y, z and 0; aligned, so that one instruction can process it.
using Vec4 = Eigen::Vector4d;

inline Vec4 padded(const Vec3& p) {
  return {p.x(), p.y(), p.z(), 0};
}

/// A body under a point that may touch it in a sub-step of the cloth. The integrators keep the point above
/// the plane that touches the body there, and let a dynamic body move with the impulses (support_bodies.h). A
/// point that was moved out of the body after the springs would compress them, and they would gain k h^2 / m
/// times the energy of its motion.
struct Support {
  uint32_t point;
  Vec4 normal;       ///< unit, from the body to the point
  Real gap;          ///< distance to the plane at the start of the sub-step, >= 0 [m]
  Vec4 surface;      ///< motion of the body's surface in the sub-step without this cloth's impulses [m]
  Real friction;     ///< coefficient of friction
  ClothBody* body;   ///< the body if it is dynamic; null: no impulse moves it
  Vec3 on_body;      ///< where the point touches it
  Real load = 0;     ///< force of another body that presses the point onto this one, times dt^2 [kg m]
  Real impulse = 0;  ///< along the normal in the last step of the integrator, times that step [kg m], >= 0

  /// Returns the smallest displacement along the normal after the fraction `part` of the sub-step [m].
  Real least(Real part) const { return part * normal.dot(surface) - gap; }
};

/// A feature of a body under a triangle: the support of the point with these weights in the triangle. Only
/// `relaxed` keeps it; after the other integrators, CornerContacts separates feature and triangle.
struct TriangleSupport : Support {
  Triangle corners;  ///< corners[0] == point
  std::array<Real, 3> weights;

  /// Returns the weighted sum of a value of the points.
  template <class ValueOfPoint>
  Vec4 sum(ValueOfPoint&& value) const {
    Vec4 all = weights[0] * value(corners[0]);
    for (std::size_t k = 1; k < 3; ++k) all += weights[k] * value(corners[k]);
    return all;
  }
};

struct ClothPoints {
  std::vector<Vec4> position;
  std::vector<Vec4> start;         ///< position at the start of the cloth's sub-step
  std::vector<Vec4> velocity;      ///< mean velocity over the last sub-step of the cloth
  std::vector<Vec4> outer;         ///< acceleration by all forces except springs, contacts and drag
  std::vector<Vec4> acceleration;  ///< acceleration including the drag of the air at a velocity (air_drag.h)
  std::vector<Vec4> flow;          ///< velocity of the air
  std::vector<Vec4> rest;          ///< position in the unstrained cloth
  std::vector<Vec4> moves;         ///< displacements in a step of the springs [m]
  std::vector<Vec4> step_start, step_velocity, step_gain;  ///< buffers of an integrator for its sub-step
  std::vector<Vec4> pin_impulse;   ///< impulse of the springs on pinned points, times the sub-step [kg m]
  std::vector<Real> field_drag;    ///< rate of linear drag by fields and hands [1/s]
  std::vector<Real> mass;          ///< [kg]
  std::vector<Real> inverse_mass;  ///< 0 for pinned points
  std::vector<ClothBody*>
      holder;                    ///< the body to which it is pinned; null: not pinned, or pinned to the world
  std::vector<uint8_t> carried;  ///< whether that body is dynamic, so that the point moves with it
  std::vector<Real> thickness, friction, self_friction;
  std::vector<uint32_t> cloth;  ///< index of the cloth of each point
  std::vector<uint8_t>
      applies_friction;           ///< by cloth: whether its integrator applies the friction of supports
  std::vector<Support> supports;  ///< of the sub-step, by point; at most one of a point
  std::vector<std::vector<TriangleSupport>> triangle_supports;  ///< of the sub-step, by cloth
  /// Whether a support pushed the point in the last sub-step, for the integrator `implicit`.
  std::vector<uint8_t> supported;

  std::size_t size() const { return position.size(); }
  Vec3 at(std::size_t i) const { return position[i].head<3>(); }
  Vec3 start_at(std::size_t i) const { return start[i].head<3>(); }
  /// Returns the position after a sub-step of length dt [s] without springs, contacts and pins.
  Vec4 free_end(std::size_t i, Real dt) const { return start[i] + dt * (velocity[i] + dt * acceleration[i]); }
};

/// A part of a point's move that must not count as velocity, such as the correction of a penetration.
struct VelocityCut {
  uint32_t point;
  Vec4 move;  // [m]
};

}  // namespace offstage::sim
