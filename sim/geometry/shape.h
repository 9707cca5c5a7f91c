#pragma once
/// Shapes of bodies. Primitives keep their exact implicit form; a mesh shape refers to a mesh that was
/// registered with the World. All are given in the body's own frame. Primitives are centred at its origin,
/// with axes of revolution along Y. For meshes, the origin need not be the centre of mass, which registration
/// computes.

#include <variant>

#include "sim/core/handle.h"
#include "sim/core/types.h"

namespace offstage::sim {

struct MeshTag {};
using MeshHandle = Handle<MeshTag>;

struct Sphere {
  Real radius = 0.5;  ///< [m], > 0
};
struct Box {
  Vec3 size = Vec3::Ones();  ///< full edge lengths [m], > 0
};
/// A cylinder of the given height between the centres of its two hemispherical caps.
struct Capsule {
  Real radius = 0.25;  ///< [m], > 0
  Real height = 0.5;   ///< distance of the cap centres [m], >= 0
};
struct Cylinder {
  Real radius = 0.5;  ///< [m], > 0
  Real height = 1;    ///< [m], > 0
};
/// Base circle at y = -height/2, apex at y = +height/2.
struct Cone {
  Real radius = 0.5;  ///< radius of the base [m], > 0
  Real height = 1;    ///< [m], > 0
};
/// A cone with its tip cut off: the base circle at y = -height/2, the top circle at y = +height/2.
struct Frustum {
  Real radius = 0.5;       ///< radius of the base [m], > 0
  Real top_radius = 0.25;  ///< [m], > 0
  Real height = 1;         ///< [m], > 0
};
struct Ellipsoid {
  Vec3 radii = Vec3(0.5, 0.25, 0.25);  ///< half axes along x, y and z [m], > 0
};
/// The half-space y <= 0 of the body's frame; only for bodies that are not dynamic.
struct Plane {};
struct MeshShape {
  MeshHandle mesh;
};

using Shape = std::variant<Sphere, Box, Capsule, Cylinder, Cone, Plane, MeshShape, Frustum, Ellipsoid>;

/// Whether a shape is a solid of revolution about the y axis that can rest on a line of its surface: a
/// capsule, cylinder, cone or frustum.
inline bool is_round_about_axis(const Shape& shape) {
  return std::holds_alternative<Capsule>(shape) || std::holds_alternative<Cylinder>(shape) ||
         std::holds_alternative<Cone>(shape) || std::holds_alternative<Frustum>(shape);
}

}  // namespace offstage::sim
