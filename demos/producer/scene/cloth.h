#pragma once
/// The cloths of a scene; see scene.h. Pins, seams and cords select vertices by positions on the undeformed
/// cloth, in the cloth's own frame. All copies of a cloth therefore have the same pins.

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "effects/fabric.h"
#include "producer/scene/values.h"
#include "sim/cloth/cloth.h"

namespace offstage::producer {

/// A rectangle in the plane y = 0 of the cloth's frame, centred on the origin. Its front faces +Y. Left to
/// right is along +X, top to bottom along +Z.
struct GridShape {
  Eigen::Vector2d size = {1, 1};
  Eigen::Vector2i cells = {40, 40};
};
/// A closed sphere around the origin of the cloth's frame.
struct SphereCloth {
  Real radius = 0.1;
  int divisions = 3;  ///< how often each triangle of an icosahedron is divided into four
};
using ClothShape = std::variant<GridShape, MeshFile, SphereCloth>;

/// Values of a cloth that replace values of its fabric. A value that is not set stays as in the fabric.
struct FabricChanges {
  std::optional<Real> areal_density, stretch, shear, bend, damping, friction, self_friction, thickness, drag,
      lift, max_stretch, max_shear, bend_damping, stretch_damping, shear_damping, bend_spring_damping,
      min_bend_radius;
  std::optional<effects::BendModel> bend_model;
};

enum class Side { left, right, top, bottom };
enum class Corner { top_left, top_right, bottom_left, bottom_right };

/// The object to which a pin attaches the selected vertices.
struct PinScope {
  Where where;
  std::string body;   ///< name of the body; empty: the vertices are fixed in the world
  Real until = 1e30;  ///< time at which the pin releases its vertices [s]
};
struct CornerPin : PinScope {
  std::vector<Corner> corners = {Corner::top_left, Corner::top_right, Corner::bottom_left,
                                 Corner::bottom_right};
};
struct SidePin : PinScope {
  Side side = Side::top;
  int every = 1;  ///< the pin holds every n-th vertex of the side, starting with the first
};
/// Holds the vertex nearest to a point.
struct NearestPin : PinScope {
  Vec3 point = Vec3::Zero();
};
/// Holds all vertices inside a box whose edges are parallel to the axes of the cloth's frame.
struct BoxPin : PinScope {
  Vec3 centre = Vec3::Zero();
  Vec3 size = Vec3::Ones();
};
using ClothPin = std::variant<CornerPin, SidePin, NearestPin, BoxPin>;

/// Two sides of a grid that are sewn together, vertex by vertex.
struct SideSeam {
  Where where;
  Side a = Side::left, b = Side::right;
  bool reversed = false;  ///< whether the first vertex of `a` is sewn to the last vertex of `b`
};
/// A seam between the two vertices nearest to the points `a` and `b`.
struct PointSeam {
  Where where;
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
};
using ClothSeam = std::variant<SideSeam, PointSeam>;

/// A cord. One end is attached to the vertex nearest to `from`. Points are in the cloth's frame.
struct ClothCord {
  Where where;
  Vec3 from = Vec3::Zero();
  Vec3 to = Vec3(0, -1, 0);  ///< position of the other end at time 0
  bool held = true;          ///< whether the other end is fixed in the world or on the body
  std::string body;
  Real until = 1e30;
  Real length = 0;
  int segments = 10;
  Real stiffness = 50, mass_per_length = 0.002, damping = 0.1;
  bool visible = true;
  Real radius = 0.002;  ///< radius of the drawn cord
  std::string material;
};

struct Cloth {
  Where where;
  std::string name;
  ClothShape shape = GridShape{};
  std::string fabric = "cotton";
  FabricChanges changes;  ///< in the file, these keys are keys of the cloth itself
  std::string material;   ///< name of the material; empty: the look of the fabric
  Vec3 position = Vec3::Zero();
  Quat orientation = Quat::Identity();
  Vec3 velocity = Vec3::Zero();
  std::vector<ClothPin> pins;
  std::vector<ClothSeam> seams;
  std::vector<ClothCord> cords;
  Real seam_time = 1;
  bool collides = true;
  bool self_collision = true;
  Real tear = 0;
  Real pressure = 0, ram_pressure = 0;
  Real inflate_time = 0;
  Real air_density = 1.2;
  std::optional<Real> gas_density;
  sim::ClothIntegrator integrator = sim::ClothIntegrator::relaxed;
  Real substep = 1.0 / 960;
  bool soften = false;
  Real appear_at = 0;
  Real remove_at = 1e30;
  bool visible = true;
  bool casts_shadow = true;
  Placement placement;  ///< in the file, these keys are keys of the cloth itself
};

}  // namespace offstage::producer
