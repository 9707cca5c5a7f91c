#pragma once
/// Converts cloths of a scene to undeformed cloths of the simulation, and gives the look of their fabrics.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "effects/fabric.h"
#include "producer/scene/scene.h"
#include "render/model.h"
#include "sim/cloth/cloth.h"

namespace offstage::producer {

/// Greatest number of vertices of a cloth.
inline constexpr std::size_t kMaxClothVertices = 250'000;

/// A cloth that is not deformed: its vertices in its own frame, and its definition in the world.
struct FlatCloth {
  sim::ClothDef def;  ///< definition of the cloth without its pins, because pins refer to bodies
  /// Positions of the vertices in the cloth's frame, without the vertices of cords [m].
  std::vector<Vec3> places;
  std::vector<Eigen::Vector2f> uvs;  ///< coordinates along the cloth for all vertices [m]
  std::vector<uint32_t> cord_ends;   ///< for each cord, the index of its last vertex

  std::vector<uint32_t> triangles() const;  ///< Returns the triangles as three vertices each.
};

/// Creates the flat cloth. `model` is the model file of a cloth that has one, otherwise null. Throws
/// std::invalid_argument for an impossible shape or fabric.
FlatCloth flat_cloth(const Cloth& cloth, const render::Model* model);

/// Returns the number of vertices of a cloth, without the vertices of its cords. `model`: see flat_cloth().
std::size_t vertex_count(const Cloth& cloth, const render::Model* model);

/// Returns the fabric that a cloth names, with the changes that the cloth makes to it. Throws
/// std::invalid_argument for an unknown name.
effects::Fabric fabric_of(const Cloth& cloth);
/// Returns the names of all fabrics.
std::vector<std::string> fabric_names();

/// Returns the vertices held by a pin, possibly none. Throws std::invalid_argument for a side or corner of a
/// cloth that is not a grid.
std::vector<uint32_t> pinned_vertices(const ClothPin& pin, const Cloth& cloth, const FlatCloth& flat);
const PinScope& scope_of(const ClothPin& pin);
/// Returns the error message for a pin that holds no vertex, with the extent of the cloth.
std::string selects_nothing(const FlatCloth& flat);
/// Returns the pairs of vertices that a seam joins. Throws std::invalid_argument if the sides have different
/// numbers of vertices, or if the cloth is not a grid.
std::vector<sim::ClothSeam> sewn_vertices(const ClothSeam& seam, const Cloth& cloth, const FlatCloth& flat);

/// Returns the look of a fabric, which cloths without a material have. A material that does not set `fabric`
/// uses the thread properties of this look.
render::Material fabric_look(const std::string& fabric);

/// Returns an error message if the cloth's explicit integrator is unstable, with the spring that causes this
/// and the longest stable step. Returns nothing if it is stable.
std::optional<std::string> instability_of(const Scene& scene, const sim::ClothDef& cloth);

}  // namespace offstage::producer
