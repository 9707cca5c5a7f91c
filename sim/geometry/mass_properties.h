#pragma once
/// Volume, centre of mass and inertia of solids (physics N7). For meshes the integrals over the polyhedron
/// are exact: sums over the signed tetrahedra between its faces and a point. They equal the surface integrals
/// of Mirtich, "Fast and accurate computation of polyhedral mass properties" (1996).

#include "sim/core/types.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

/// Mass properties of a uniform solid of density 1 kg/m^3.
struct MassProperties {
  Real volume = 0;              ///< [m^3]; negative for an inverted mesh
  Vec3 centre = Vec3::Zero();   ///< centre of mass in the shape's frame [m]
  Mat3 inertia = Mat3::Zero();  ///< inertia about the centre of mass, axes of the shape's frame [m^5]
};

/// Inertia in its principal axes: inertia = R diag(moments) R^T, moments ascending.
struct PrincipalInertia {
  Vec3 moments;
  Quat orientation;  ///< shape frame from principal frame
};

/// Volume integrals over the solid that the triangles bound. The mesh should be closed (see MeshDefects),
/// otherwise the result is meaningless.
MassProperties mass_properties(const TriangleMesh& mesh);

/// Mass properties of a primitive in closed form. A Plane has the volume 0. MeshShape is not allowed, because
/// its mesh is not known here.
MassProperties mass_properties(const Shape& primitive);

PrincipalInertia diagonalise(const Mat3& inertia);

}  // namespace offstage::sim
