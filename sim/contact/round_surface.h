#pragma once
/// The round surface of a body at a contact: that of its shape, or of a round part of its compound.

#include "sim/dynamics/body.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

struct RoundSurface {
  const Shape* shape = nullptr;  ///< a primitive; MeshShape for a part that is not round
  Pose place;                    ///< pose of the shape in the body's frame
  Real around = 0;               ///< distance of the surface from the shape, for a torus [m]
  Vec3 centre = Vec3::Zero();    ///< the body's centre of mass in the shape's frame [m]

  /// Whether it is round about an axis and has a rim: a cylinder, cone, frustum or torus.
  bool is_revolved() const;
  /// Radius around the core of a sphere or capsule, and 0 for other shapes [m].
  Real round_radius() const;
  const Ellipsoid* ellipsoid() const { return std::get_if<Ellipsoid>(shape); }
  /// Vector from the axis to the body's centre of mass, in the shape's frame [m].
  Vec3 centre_off_axis() const { return {centre.x(), 0, centre.z()}; }
};

/// Returns the surface of a body at a piece of its collision shape (Manifold::piece_a).
RoundSurface round_surface(const Body& body, uint32_t piece);

/// Whether any part of a body has a rim or a round side.
bool has_revolved_part(const Body& body);

}  // namespace offstage::sim
