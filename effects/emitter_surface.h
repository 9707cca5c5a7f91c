#pragma once
/// The surfaces from which particles are released (physics F1), and the positions of new particles. Cells
/// keep new particles apart on the plane, the sphere and the disc; places on a mesh are distributed uniformly
/// over its area.

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

/// A surface in the frame of its body, or of the world. Particles are released along its normal.
struct EmitterSurface {
  SurfaceKind kind = SurfaceKind::plane;
  sim::Pose pose;
  Eigen::Vector2d size = {0.1, 0.1};  ///< size of the plane along X and Z of `pose` [m], > 0
  Real radius = 0.1;                  ///< radius of the sphere and the disc [m], > 0
  sim::TriangleMesh mesh;             ///< mesh in the frame of `pose`; its area must not be zero
};

/// A point of a surface with its unit normal and a unit tangent, in the frame of the surface's pose.
struct Place {
  Vec3 point, normal, tangent;
};

/// Division of a surface into cells of equal area for particles of some diameter. A sphere and a disc have
/// one row.
struct Cells {
  Real diameter = 0;
  uint64_t nx = 1, nz = 1;

  uint64_t count() const { return nx * nz; }
};

class ReleaseSurface {
 public:
  /// Throws std::invalid_argument with the reason for a surface without area.
  explicit ReleaseSurface(const EmitterSurface& surface);

  /// Whether the surface has cells. On a mesh, the distances of particles must be checked instead.
  bool has_cells() const { return kind_ != SurfaceKind::mesh; }
  /// Returns the division with the greatest number of cells in which particles of this diameter [m] do not
  /// overlap; at least one cell.
  Cells cells(Real diameter) const;
  /// Returns the centre of cell i. Cells of the sphere and the disc are on a spiral, which is rotated by
  /// `turn`, three uniform random numbers, so that no direction is preferred even with few cells.
  Place cell(const Cells& cells, uint64_t i, const std::array<Real, 3>& turn) const;
  /// Returns a uniformly distributed place for three uniform random numbers in (0, 1). On a plane and a disc
  /// its distance from the border is at least `margin` [m], or as large as possible.
  Place anywhere(const std::array<Real, 3>& u, Real margin = 0) const;

  Real area() const { return area_; }    ///< [m^2]
  Real reach() const { return reach_; }  ///< greatest distance of a point from the origin [m]

 private:
  struct Face {
    Vec3 corner, edge1, edge2, normal;
    Real area_before;  // total area of the faces before this one
  };

  void add_faces(const sim::TriangleMesh& mesh);
  Place on_sphere(Real height, Real angle) const;
  Place on_disc(Real r, Real angle) const;
  Place on_mesh(const std::array<Real, 3>& u) const;

  SurfaceKind kind_;
  Eigen::Vector2d size_;
  Real radius_, area_ = 0, reach_ = 0;
  std::vector<Face> faces_;
};

/// Returns a unit vector perpendicular to a unit vector. It is a continuous function of n except at one
/// direction (Duff et al., "Building an orthonormal basis, revisited", JCGT 2017).
Vec3 perpendicular(const Vec3& n);

}  // namespace offstage::effects
