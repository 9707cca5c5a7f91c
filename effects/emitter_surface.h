#pragma once
/// The surfaces particles leave from (physics F1), and the places on them that a release takes: cells that
/// keep newborns apart on the plane, the sphere and the disc; places drawn evenly by area on a mesh.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "effects/random.h"
#include "sim/geometry/mesh.h"

namespace offstage::effects {

enum class SurfaceKind {
  plane,   ///< a rectangle, normal +Y
  sphere,  ///< all around, outwards
  disc,    ///< a circle, normal +Y
  mesh,    ///< a triangle mesh, along its faces' normals
};

/// A surface in the frame of the body it is attached to, or of the world. Particles leave along its normal.
struct EmitterSurface {
  SurfaceKind kind = SurfaceKind::plane;
  sim::Pose pose;
  Eigen::Vector2d size = {0.1, 0.1};  ///< of the plane, along X and Z of `pose` [m], > 0
  Real radius = 0.1;                  ///< of the sphere and the disc [m], > 0
  sim::TriangleMesh mesh;             ///< of the mesh, in the frame of `pose`; with some area
};

/// A point of a surface with its unit normal and a unit tangent, in the frame of the surface's pose.
struct Place {
  Vec3 point, normal, tangent;
};

/// How a surface is divided for particles of some diameter; cells are equal in area. A sphere and a disc have
/// one row.
struct Cells {
  Real diameter = 0;
  uint64_t nx = 1, nz = 1;

  uint64_t count() const { return nx * nz; }
};

class ReleaseSurface {
 public:
  /// Throws std::invalid_argument, saying what is wrong, for a surface without area.
  explicit ReleaseSurface(const EmitterSurface& surface);

  /// Whether places come from cells. Those on a mesh must be kept apart by looking.
  bool has_cells() const { return kind_ != SurfaceKind::mesh; }
  /// As many cells as keep particles of this diameter apart, at least one.
  Cells cells(Real diameter) const;
  /// The middle of a cell. Cells of the sphere and the disc lie on a spiral that is turned by three uniform
  /// numbers, so that no direction is preferred however few they are.
  Place cell(const Cells& cells, uint64_t i, const std::array<Real, 3>& turn) const;
  /// A place drawn evenly by area, from three uniform numbers.
  Place anywhere(const std::array<Real, 3>& u) const;

  Real area() const { return area_; }  ///< [m^2]

 private:
  struct Face {
    Vec3 corner, edge1, edge2, normal;
    Real area_before;  // of the faces before this one
  };

  void add_faces(const sim::TriangleMesh& mesh);
  Place on_sphere(Real height, Real angle) const;
  Place on_disc(Real r, Real angle) const;
  Place on_mesh(const std::array<Real, 3>& u) const;

  SurfaceKind kind_;
  Eigen::Vector2d size_;
  Real radius_, area_ = 0;
  std::vector<Face> faces_;
};

/// A unit vector perpendicular to a unit vector, continuous but for one direction (Duff et al., "Building an
/// orthonormal basis, revisited", JCGT 2017).
Vec3 perpendicular(const Vec3& n);

}  // namespace offstage::effects
