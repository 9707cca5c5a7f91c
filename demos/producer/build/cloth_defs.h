#pragma once
/// Cloths of a scene as the simulation takes them, as they lie flat, and how their fabrics look.

#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "effects/fabric.h"
#include "producer/scene/scene.h"
#include "render/model.h"
#include "sim/cloth/cloth.h"

namespace offstage::producer {

/// Most vertices of a cloth.
inline constexpr std::size_t kMaxClothVertices = 250'000;

/// A cloth in its own frame, and placed in the world.
struct FlatCloth {
  sim::ClothDef def;                 ///< without pins, which need the bodies
  std::vector<Vec3> places;          ///< of its vertices in its own frame [m]
  std::vector<Eigen::Vector2f> uvs;  ///< along it [m]

  std::vector<uint32_t> triangles() const;  ///< three vertices each
};

/// `model`: of a mesh, else null. Throws std::invalid_argument for a shape or a fabric that cannot be.
FlatCloth flat_cloth(const Cloth& cloth, const render::Model* model);

/// The fabric a cloth is made of, with its changes. Throws std::invalid_argument if there is none of that
/// name.
effects::Fabric fabric_of(const Cloth& cloth);
/// Names of all fabrics.
std::vector<std::string> fabric_names();

/// The vertices that a pin holds, which may be none. Throws std::invalid_argument for a side or corner of
/// what is no grid.
std::vector<uint32_t> pinned_vertices(const ClothPin& pin, const Cloth& cloth, const FlatCloth& flat);
const PinScope& scope_of(const ClothPin& pin);
/// The pairs of vertices that a seam joins. Throws std::invalid_argument if its sides differ in length, or
/// are no grid's.
std::vector<sim::ClothSeam> sewn_vertices(const ClothSeam& seam, const Cloth& cloth, const FlatCloth& flat);

/// The look of a cloth without a material, and what materials without a fabric take from it.
render::Material fabric_look(const std::string& fabric);

/// Why an explicit integrator cannot step a cloth of this scene, naming the spring and the longest step.
std::optional<std::string> too_stiff(const Scene& scene, const sim::ClothDef& cloth);

}  // namespace offstage::producer
