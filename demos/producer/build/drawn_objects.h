#pragma once
/// How the objects of a scene look: meshes of shapes, and materials. Both the stage (picture.h) and the
/// exporters take them from here.

#include <string>
#include <vector>

#include "producer/build/models.h"
#include "producer/scene/scene.h"
#include "render/model.h"

namespace offstage::producer {

/// The mesh of a primitive, centred as the simulation has it. Boxes get a small bevel, so that their edges
/// catch light. A plane is a very large square.
render::Mesh mesh_of(const sim::Sphere& s);
render::Mesh mesh_of(const sim::Box& s);
render::Mesh mesh_of(const sim::Capsule& s);
render::Mesh mesh_of(const sim::Cylinder& s);
render::Mesh mesh_of(const sim::Cone& s);
render::Mesh mesh_of(const sim::Plane& s);
render::Mesh mesh_of(const sim::ConvexPolyhedron& part);

/// A material of the scene by its name, or the default material. A texture that it needs is added to
/// `textures`.
render::Material material_of(const Scene& scene, const std::string& name, const ModelLibrary& models,
                             std::vector<render::Image>& textures);
/// The material of a cloth: that of its fabric, with what the scene's material changes.
render::Material material_of(const Scene& scene, const Cloth& cloth, const ModelLibrary& models,
                             std::vector<render::Image>& textures);

}  // namespace offstage::producer
