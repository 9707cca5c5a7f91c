#pragma once
/// Shapes of bodies that are made of several solids, for the simulation; keys and sizes of all shapes. See
/// scene.h.

#include <optional>
#include <vector>

#include "producer/scene/scene.h"
#include "sim/geometry/solid_mesh.h"

namespace offstage::producer {

/// Numbers that identify the mesh of a shape: shapes with equal numbers share a mesh. Not for MeshFile and
/// Compound.
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

/// Half the size of the box around a shape, in its frame [m].
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

/// The solids of a torus, tube, open box or compound; none for other shapes.
std::vector<sim::SolidMesh> solids_of(const Shape& shape);

/// Whether a body collides by the parts or triangles of a mesh: mesh files and the shapes of solids_of().
bool is_mesh(const Body& body);

/// Numbers that identify the solids of a shape: shapes with equal numbers have equal solids.
std::vector<float> solids_key(const Shape& shape);

/// The inertia matrix of a body that has `inertia`.
std::optional<sim::Mat3> inertia_of(const Body& body);

/// Mass, centre and inertia of a body by its shape and densities, with the body's own mass, centre and
/// inertia in place of these if it has them. None for a mesh file, which is not read here, and for a plane.
std::optional<sim::BodyMass> mass_by_shape(const Body& body);

/// Returns the first error in the sizes of a shape or of its parts, with the key relative to the shape; empty
/// if there is none.
struct ShapeProblem {
  std::string key, what;
};
std::optional<ShapeProblem> problem(const Shape& shape);

}  // namespace offstage::producer
