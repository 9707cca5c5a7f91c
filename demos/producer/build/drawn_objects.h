#pragma once
/// The appearance of a scene's objects: meshes of shapes, and materials. Used by the stage (picture.h) and by
/// the exporters.

#include <optional>
#include <string>
#include <type_traits>
#include <vector>

#include "producer/build/body_shapes.h"
#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/model.h"

namespace offstage::producer {

/// Returns the mesh of a primitive, centred as in the simulation. A plane is a very large square.
render::Mesh mesh_of(const sim::Sphere& s);
/// `bevel`: radius of the edges [m]; default: 0.04 of the smallest edge, at most 0.05 m. Round edges reflect
/// light.
render::Mesh mesh_of(const sim::Box& s, std::optional<Real> bevel = {});
render::Mesh mesh_of(const sim::Capsule& s);
render::Mesh mesh_of(const sim::Cylinder& s);
render::Mesh mesh_of(const sim::Cone& s);
render::Mesh mesh_of(const sim::Frustum& s);
render::Mesh mesh_of(const sim::Ellipsoid& s);
render::Mesh mesh_of(const sim::Torus& s);
render::Mesh mesh_of(const sim::Tube& s);
render::Mesh mesh_of(const sim::OpenBox& s);
render::Mesh mesh_of(const sim::Plane& s);
render::Mesh mesh_of(const sim::ConvexPolyhedron& part);

/// A primitive of a body, as it is drawn.
template <class S>
struct DrawnShape {
  const S& shape;
  std::optional<Real> bevel;  ///< see mesh_of(const sim::Box&)

  render::Mesh mesh() const {
    if constexpr (std::is_same_v<S, sim::Box>)
      return mesh_of(shape, bevel);
    else
      return mesh_of(shape);
  }
  /// Returns numbers that are equal for equal meshes.
  std::vector<float> key() const {
    std::vector<float> result = shape_key(shape);
    if constexpr (std::is_same_v<S, sim::Box>) result.push_back(bevel ? static_cast<float>(*bevel) : -1);
    return result;
  }
};

/// Returns a material of the scene by its name, or the default material. Adds its texture, if any, to
/// `textures`.
render::Material material_of(const Scene& scene, const std::string& name, const ModelLibrary& models,
                             std::vector<render::Image>& textures);
/// Returns the material of a cloth: the material of its fabric, changed by the scene's material.
render::Material material_of(const Scene& scene, const Cloth& cloth, const ModelLibrary& models,
                             std::vector<render::Image>& textures);

}  // namespace offstage::producer
