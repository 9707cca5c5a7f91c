#pragma once
/// The solids of which some shapes of bodies consist, and the sizes, masses and mesh keys of all shapes.
/// scene.h defines the shapes.

#include <optional>
#include <vector>

#include "producer/scene/scene.h"
#include "sim/geometry/solid_mesh.h"

namespace offstage::producer {

/// Returns numbers that identify the mesh of a shape. Shapes of one type with equal numbers share a mesh.
std::vector<float> shape_key(const sim::Sphere& s);
std::vector<float> shape_key(const sim::Box& s);
std::vector<float> shape_key(const sim::Capsule& s);
std::vector<float> shape_key(const sim::Cylinder& s);
std::vector<float> shape_key(const sim::Cone& s);
std::vector<float> shape_key(const sim::Plane& s);
std::vector<float> shape_key(const sim::Frustum& s);
std::vector<float> shape_key(const sim::Ellipsoid& s);
std::vector<float> shape_key(const sim::Torus& s);
std::vector<float> shape_key(const sim::Tube& s);
std::vector<float> shape_key(const sim::OpenBox& s);

/// Returns half the size of the shape's bounding box, in the frame of the shape [m].
Vec3 half_extent(const sim::Sphere& s);
Vec3 half_extent(const sim::Box& s);
Vec3 half_extent(const sim::Capsule& s);
Vec3 half_extent(const sim::Cylinder& s);
Vec3 half_extent(const sim::Cone& s);
Vec3 half_extent(const sim::Plane& s);
Vec3 half_extent(const sim::Frustum& s);
Vec3 half_extent(const sim::Ellipsoid& s);
Vec3 half_extent(const sim::Torus& s);
Vec3 half_extent(const sim::Tube& s);
Vec3 half_extent(const sim::OpenBox& s);
Vec3 half_extent(const Compound& s);

/// Returns the solids of which a torus, tube, open box or compound consists; none for other shapes.
std::vector<sim::SolidMesh> solids_of(const Shape& shape);

/// Returns whether the collision shape of a body is a mesh: a mesh file, or a shape for which solids_of() is
/// not empty.
bool is_mesh(const Body& body);

/// Returns numbers that identify the result of solids_of(). Shapes with equal numbers have equal solids.
std::vector<float> solids_key(const Shape& shape);

/// Returns the inertia matrix [kg m^2] that the scene gives for a body; nothing if it has no `inertia`.
std::optional<sim::Mat3> inertia_of(const Body& body);

/// Computes mass, centre of mass and inertia from the shape and the densities. Values that the scene gives
/// for the body replace the computed ones. Returns nothing for a plane and for a mesh file, which is not read
/// here.
std::optional<sim::BodyMass> mass_by_shape(const Body& body);

/// Returns the first error in the sizes of a shape or of its parts, with the key relative to the shape; empty
/// if there is none.
struct ShapeProblem {
  std::string key, what;
};
std::optional<ShapeProblem> problem(const Shape& shape);

}  // namespace offstage::producer
