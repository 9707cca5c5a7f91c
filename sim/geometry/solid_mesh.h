#pragma once
/// Solids as closed meshes with the convex solids that fill them: the primitives, and the concave shapes
/// torus, tube and open box, whose mass properties have closed forms (physics N7). They are the parts of
/// compounds.

#include <optional>
#include <variant>
#include <vector>

#include "sim/core/types.h"
#include "sim/geometry/convex_polyhedron.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/shape.h"

namespace offstage::sim {

/// A ring about Y, centred at the origin.
struct Torus {
  Real radius = 0.4;       ///< distance of the tube's centre line from the axis [m], > tube_radius
  Real tube_radius = 0.1;  ///< [m], > 0
};
/// A hollow cylinder about Y, open at both ends.
struct Tube {
  Real radius = 0.5;     ///< radius of the outside [m], > thickness
  Real height = 1;       ///< [m], > 0
  Real thickness = 0.1;  ///< thickness of the wall [m], > 0
};
/// A cuboid without its top at +Y, centred at the origin.
struct OpenBox {
  Vec3 size = Vec3::Ones();  ///< size of the outside [m], > 0
  Real thickness =
      0.05;  ///< thickness of the floor and the walls [m], less than half of the x and z sizes and the height
};

MassProperties mass_properties(const Torus& torus);
MassProperties mass_properties(const Tube& tube);
MassProperties mass_properties(const OpenBox& box);

/// A sector of a ring about Y, around +X: the convex hull of an arc at `radius` and its two ends at `inner`,
/// extended by `half_height` along Y to both sides, and by `around` in all directions. Its outside is that of
/// a tube (`around` = 0) or of a torus (`half_height` = 0, `inner` = `radius`); its inside is flat.
struct RingSector {
  Real radius = 0, inner = 0, half_height = 0, around = 0;  ///< [m]
  Real sine = 0, cosine = 1;                                ///< of half of the sector's angle
};
/// The convex hull of a torus: all points within `around` of a disc about Y.
struct RoundedDisc {
  Real radius = 0, around = 0;  ///< [m]
};
/// A round solid that a polyhedron approximates.
struct RoundSolid {
  std::variant<Shape, RingSector, RoundedDisc> shape;
  Pose pose;
};

/// A closed mesh, and convex solids without overlap that fill it.
struct SolidMesh {
  TriangleMesh mesh;
  std::vector<ConvexPolyhedron> parts;
  /// For each part the exact solid, if the part approximates one; empty: all parts are exact.
  std::vector<std::optional<RoundSolid>> round_parts = {};
  std::optional<RoundSolid> round_hull =
      {};  ///< the convex hull of the exact solid; nothing: that of the mesh
};

/// Vertices are on the surface of the shape. A torus has 48 parts with 24 corners around the tube; a tube has
/// 48. Flat faces deviate from the round surface by at most 0.9 % of the tube_radius plus 0.3 % of the
/// radius.
SolidMesh solid_mesh(const Torus& torus);
SolidMesh solid_mesh(const Tube& tube);
SolidMesh solid_mesh(const OpenBox& box);
/// Returns the surface of a primitive as one convex part. A sphere has 32 x 16 faces, and a round side has 48
/// faces around its axis. Plane and MeshShape are not accepted.
SolidMesh solid_mesh(const Shape& primitive);
/// Returns the solid moved to a pose.
SolidMesh placed(SolidMesh solid, const Pose& pose);

/// Mass, centre of mass and inertia of a body.
struct BodyMass {
  Real mass = 0;                ///< [kg]
  Vec3 centre = Vec3::Zero();   ///< [m]
  Mat3 inertia = Mat3::Zero();  ///< inertia about the centre of mass [kg m^2]
};

/// A uniform solid at a pose in a compound.
struct MassPart {
  MassProperties solid;
  Pose pose;
  Real density = 1000;  ///< [kg/m^3], > 0
};

/// Returns the mass, centre of mass and inertia of all parts together, in the frame of the compound; inertias
/// are added by the parallel axis theorem (the book's appendix D). Overlaps of parts count several times.
BodyMass sum_of(const std::vector<MassPart>& parts);

}  // namespace offstage::sim
