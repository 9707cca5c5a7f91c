#pragma once
/// The appearance of a scene's objects: meshes of shapes, and materials. Used by the stage (picture.h) and by
/// the exporters.

#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/model.h"

namespace offstage::producer {

/// Returns the mesh of a primitive, centred as in the simulation. Boxes have a small bevel, whose edges
/// reflect light. A plane is a very large square.
render::Mesh mesh_of(const sim::Sphere& s);
render::Mesh mesh_of(const sim::Box& s);
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

/// Returns a material of the scene by its name, or the default material. Adds its texture, if any, to
/// `textures`.
render::Material material_of(const Scene& scene, const std::string& name, const ModelLibrary& models,
                             std::vector<render::Image>& textures);
/// Returns the material of a cloth: the material of its fabric, changed by the scene's material.
render::Material material_of(const Scene& scene, const Cloth& cloth, const ModelLibrary& models,
                             std::vector<render::Image>& textures);

}  // namespace offstage::producer
