#pragma once
/// Values and parts of several kinds of objects in a scene: colours, and copies.

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "effects/distribution.h"
#include "producer/base/error.h"
#include "sim/core/types.h"
#include "sim/geometry/convex_decomposition.h"
#include "sim/geometry/shape.h"
#include "sim/geometry/solid_mesh.h"

namespace offstage::producer {

using effects::Varying;
using sim::Quat;
using sim::Real;
using sim::Vec3;

/// Times from here on mean "never" [s]; the default of `remove_at` is later than this.
inline constexpr Real kForever = 1e29;

/// Whether an object with these times exists at a time; a rounding error before does not matter.
inline bool exists(Real appear_at, Real remove_at, Real time) {
  constexpr Real kRounding = 1e-9;
  return time >= appear_at - kRounding && time < remove_at - kRounding;
}

/// Linear colour with straight alpha. In files "#rrggbb", "#rrggbbaa", "#rgb", "#rgba" (sRGB) or linear [r,
/// g, b] or [r, g, b, a].
struct Color {
  Eigen::Vector4f rgba = {1, 1, 1, 1};
  Eigen::Vector3f rgb() const { return rgba.head<3>(); }
};

/// Scale factor of a model file. `automatic`: `factor` times the factor from the file's likely unit to metres
/// (automatic_scale() in producer/build/models.h).
struct ModelScale {
  Real factor = 1;
  bool automatic = false;

  ModelScale(Real number = 1) : factor(number) {}
  ModelScale& operator*=(Real k) {
    factor *= k;
    return *this;
  }
  bool operator==(const ModelScale&) const = default;
};

/// Criteria of the decomposition of a model into convex parts; see sim::DecompositionSettings for the
/// defaults.
struct MeshDecomposition {
  sim::DecompositionMethod method = sim::DecompositionMethod::automatic;
  Real max_error = sim::DecompositionSettings().max_error;
  std::optional<int> max_parts;  ///< default: those of sim::DecompositionSettings
  Real min_angle_deg = 20;
  Real min_distance = sim::DecompositionSettings().min_distance;
};
sim::DecompositionSettings settings_of(const std::optional<MeshDecomposition>& decomposition);

/// A model file as a shape: its triangles collide and determine the mass; for a cloth, they are the cloth.
struct MeshFile {
  std::string file;
  ModelScale scale = {};
  std::optional<Vec3> fit = {};  ///< edges of the box that the model just fits into before `scale` [m]
  std::optional<MeshDecomposition> decomposition = {};  ///< criteria of the convex parts; only for bodies
};

/// A solid in a compound.
using PartShape = std::variant<sim::Sphere, sim::Box, sim::Capsule, sim::Cylinder, sim::Cone, sim::Frustum,
                               sim::Ellipsoid, sim::Torus, sim::Tube, sim::OpenBox>;
struct CompoundPart {
  Where where;
  PartShape shape = sim::Box{};
  Vec3 position = Vec3::Zero();  ///< position of the part, in the body's frame
  Quat orientation = Quat::Identity();
  std::optional<Real> density;  ///< default: the body's
  std::string material;         ///< name of its material; empty: the body's
};
/// Solids that form one body.
struct Compound {
  std::vector<CompoundPart> parts;
};

using Shape =
    std::variant<sim::Sphere, sim::Box, sim::Capsule, sim::Cylinder, sim::Cone, sim::Plane, MeshFile,
                 sim::Frustum, sim::Ellipsoid, sim::Torus, sim::Tube, sim::OpenBox, Compound>;

/// Copies in a row or a ring: copy i is displaced by i * offset and rotated by i * turn_deg about the
/// vertical through `pivot`.
struct Repeat {
  int count = 2;
  Vec3 offset = Vec3::Zero();
  Real turn_deg = 0;
  Vec3 pivot = Vec3::Zero();
};
/// Copies on a grid that is centred on the original in x and z, and starts at it in y.
struct Grid {
  Eigen::Vector3i count = {1, 1, 1};
  Vec3 spacing = Vec3::Ones();
};
/// Copies at random places in a rectangle centred on the original.
struct Scatter {
  int count = 10;
  Eigen::Vector2d size = {10, 10};  ///< size of the rectangle along x and z
  Real min_distance = 0;  ///< smallest distance of copies; those without room are omitted with a warning
  bool turn = true;       ///< whether each copy is rotated about the vertical at random
  Varying scale = 1.0;    ///< factor of a body's shape and model
  uint64_t seed = 1;
};
struct BoxFill {
  Vec3 size = Vec3::Ones();
};
struct CylinderFill {
  Real radius = 0.5, height = 1;  ///< size of a cylinder whose axis is vertical
};
struct SphereFill {
  Real radius = 0.5;
};
/// The inside of a closed model, with the model's origin at the centre of the volume.
struct MeshFill {
  std::string file;
  ModelScale scale = {};
  std::optional<Vec3> fit = {};  ///< see MeshFile::fit
  sim::TriangleMesh solid = {};  ///< after loading: the scaled model, with normals that point out
};
enum class Packing { hexagonal, cubic, random };
/// Places that fill a volume, each at half the spacing or more from its surface.
struct Fill {
  std::variant<BoxFill, CylinderFill, SphereFill, MeshFill> shape = BoxFill{};
  Vec3 position = Vec3::Zero();  ///< centre: relative to the original, or of particles in the world
  Real spacing = 0;              ///< distance between neighbouring places; 0: the diameter of the particles
  Packing packing = Packing::hexagonal;
  uint64_t seed = 1;  ///< seed of random places
};
struct Placement {
  std::optional<Fill> fill;
  std::optional<Repeat> repeat;
  std::optional<Grid> grid;
  std::optional<Scatter> scatter;
};

}  // namespace offstage::producer
