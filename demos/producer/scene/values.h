#pragma once
/// Values that several kinds of scene objects use: colours, shapes, model files, and placements of copies.

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

/// A time from this value on means "never" [s]. The default of `remove_at` is greater.
inline constexpr Real kForever = 1e29;

/// Returns whether an object exists at `time` [s]: from `appear_at` until just before `remove_at`. A
/// tolerance of 1e-9 s absorbs rounding errors.
inline bool exists(Real appear_at, Real remove_at, Real time) {
  constexpr Real kRounding = 1e-9;
  return time >= appear_at - kRounding && time < remove_at - kRounding;
}

/// A linear colour with straight alpha. In files, it is a text in sRGB ("#rrggbb", "#rrggbbaa", "#rgb" or
/// "#rgba") or a list of linear values ([r, g, b] or [r, g, b, a]).
struct Color {
  Eigen::Vector4f rgba = {1, 1, 1, 1};
  Eigen::Vector3f rgb() const { return rgba.head<3>(); }
};

/// Scale factor of a model file. If `automatic` is set, `factor` is multiplied by the factor that converts
/// the file's likely unit to metres; see automatic_scale() in producer/build/models.h.
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

/// Settings for the decomposition of a model into convex parts; see sim::DecompositionSettings.
struct MeshDecomposition {
  sim::DecompositionMethod method = sim::DecompositionMethod::automatic;
  Real max_error = sim::DecompositionSettings().max_error;
  std::optional<int> max_parts;  ///< greatest number of parts; default: see sim::DecompositionSettings
  Real min_angle_deg = 20;
  Real min_distance = sim::DecompositionSettings().min_distance;
};
/// Converts the settings for the simulation; returns the defaults if there are none.
sim::DecompositionSettings settings_of(const std::optional<MeshDecomposition>& decomposition);

/// A model file as a shape. The triangles of a body determine its collisions and its mass. For a cloth, they
/// are the triangles of the cloth.
struct MeshFile {
  std::string file;
  ModelScale scale = {};
  std::optional<Vec3> fit =
      {};  ///< size of the box into which the model is fitted before `scale` applies [m]
  std::optional<MeshDecomposition> decomposition = {};  ///< only for bodies
};

/// Shape of one part of a compound.
using PartShape = std::variant<sim::Sphere, sim::Box, sim::Capsule, sim::Cylinder, sim::Cone, sim::Frustum,
                               sim::Ellipsoid, sim::Torus, sim::Tube, sim::OpenBox>;
struct CompoundPart {
  Where where;
  PartShape shape = sim::Box{};
  Vec3 position = Vec3::Zero();  ///< position of the part, in the body's frame
  Quat orientation = Quat::Identity();
  std::optional<Real> density;  ///< density of the part; default: the density of the body
  std::string material;         ///< name of the material; empty: material of the body
};
/// A shape that consists of several solids, which form one rigid body.
struct Compound {
  std::vector<CompoundPart> parts;
};

using Shape =
    std::variant<sim::Sphere, sim::Box, sim::Capsule, sim::Cylinder, sim::Cone, sim::Plane, MeshFile,
                 sim::Frustum, sim::Ellipsoid, sim::Torus, sim::Tube, sim::OpenBox, Compound>;

/// Copies in a row or a ring. Copy i is first rotated by i * turn_deg about the vertical axis through
/// `pivot`, then displaced by i * offset.
struct Repeat {
  int count = 2;
  Vec3 offset = Vec3::Zero();
  Real turn_deg = 0;
  Vec3 pivot = Vec3::Zero();
};
/// Copies on a grid. The grid is centred on the original in x and z. Its lowest layer is at the original's
/// height.
struct Grid {
  Eigen::Vector3i count = {1, 1, 1};
  Vec3 spacing = Vec3::Ones();
};
/// Copies at random places in a rectangle centred on the original.
struct Scatter {
  int count = 10;
  Eigen::Vector2d size = {10, 10};  ///< size of the rectangle along x and z
  Real min_distance = 0;            ///< least distance between copies; copies without room are omitted
  bool turn = true;                 ///< whether each copy has a random rotation about the vertical axis
  Varying scale = 1.0;              ///< factor of a body's shape and model
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
/// The interior of a closed model. The model's origin is at Fill::position.
struct MeshFill {
  std::string file;
  ModelScale scale = {};
  std::optional<Vec3> fit = {};  ///< see MeshFile::fit
  sim::TriangleMesh solid = {};  ///< after loading: the scaled model, with normals that point out
};
enum class Packing { hexagonal, cubic, random };
/// Fills a volume with copies or particles. Their centres are at least half the spacing away from the surface
/// of the volume.
struct Fill {
  std::variant<BoxFill, CylinderFill, SphereFill, MeshFill> shape = BoxFill{};
  Vec3 position =
      Vec3::Zero();  ///< centre of the volume: relative to the original, or in the world for particles
  Real spacing = 0;  ///< distance of neighbours [m]; 0: the diameter of the particles
  Packing packing = Packing::hexagonal;
  uint64_t seed = 1;  ///< seed of the packing `random`
};
/// Copies of an object. The kinds multiply: each copy of one kind is copied by the next.
struct Placement {
  std::optional<Fill> fill;
  std::optional<Repeat> repeat;
  std::optional<Grid> grid;
  std::optional<Scatter> scatter;
};

}  // namespace offstage::producer
