#include "producer/build/model_articulation.h"

#include <algorithm>
#include <utility>

#include "producer/base/interrupt.h"
#include "producer/base/shipped_files.h"
#include "producer/build/articulation_builder.h"
#include "producer/build/models.h"
#include "render/error.h"
#include "render/mesh_io.h"
#include "render/point_cloud.h"
#include "sim/geometry/mesh.h"

namespace offstage::producer {

namespace {

void append_cloud(const render::PointCloud& cloud, ParticleGroup& group) {
  sim::Aabb box;
  for (const Eigen::Vector3f& p : cloud.positions) box.extend(p.cast<Real>());
  const Real likely = automatic_scale(box.sizes().maxCoeff(), render::Model::UnitSource::none).factor;
  const Real scale = fitted_scale(group.scale, group.fit, box.sizes(), likely);
  const std::size_t n = cloud.positions.size(),
                    taken = std::min(n, static_cast<std::size_t>(group.max_points));
  for (std::size_t k = 0; k < taken; ++k) {
    // The product does not overflow, because both factors are at most 2e7.
    const std::size_t i = k * n / taken;
    ParticlePlace place;
    place.position = group.position + group.orientation * (scale * cloud.positions[i].cast<Real>());
    if (!cloud.colors.empty()) place.color = Color{cloud.colors[i]};
    group.places.push_back(place);
  }
}

/// Reads the model of a fill and adds it to the scene's digest.
void read_fill(const SceneFolder& folder, std::string& digest, MeshFill& fill) {
  const render::Model model =
      render::read_model(model_file(fill.file, folder), folder.inputs(), interrupt_signal);
  fill.solid = sim::weld(collision_mesh(model, fitted_scale(fill.scale, fill.fit, model)));
  const sim::MeshDefects defects = sim::MeshTopology(fill.solid).defects();
  if (!defects.closed())
    throw render::FileError(fill.file + ": is not closed, so it cannot be filled: " + defects.describe());
  if (defects.inverted)
    for (sim::Triangle& t : fill.solid.triangles) std::swap(t[1], t[2]);
  digest += fill.file + " " + mesh_hash(fill.solid) + "\n";
}

}  // namespace

void read_fills(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors) {
  const auto read = [&](std::optional<Fill>& fill, Where where) {
    auto* mesh = fill ? std::get_if<MeshFill>(&fill->shape) : nullptr;
    if (!mesh || mesh->file.empty()) return;
    try {
      read_fill(folder, scene.fill_digest, *mesh);
    } catch (const render::FileError& error) {
      where.path += "/fill/shape/file";
      errors.push_back({where, error.what()});
      fill.reset();
    }
  };
  for (Body& body : scene.bodies) read(body.placement.fill, body.where);
  for (Cloth& cloth : scene.cloths) read(cloth.placement.fill, cloth.where);
  for (Emitter& emitter : scene.emitters) read(emitter.placement.fill, emitter.where);
  for (ParticleGroup& group : scene.particles) read(group.fill, group.where);
}

void read_clouds(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors) {
  for (ParticleGroup& group : scene.particles) {
    if (group.file.empty()) continue;
    try {
      append_cloud(render::read_points(folder / group.file, folder.inputs(), interrupt_signal), group);
    } catch (const render::FileError& error) {
      Where where = group.where;
      where.path += "/file";
      errors.push_back({where, error.what()});
    }
  }
}

void read_links(Scene& scene, const SceneFolder& folder, std::vector<Problem>& errors) {
  for (ArticulationTemplate& articulation : scene.articulations) {
    auto* tree = std::get_if<ModelTree>(&articulation);
    if (!tree || tree->file.empty()) continue;
    try {
      const render::Model model =
          render::read_model(model_file(tree->file, folder), folder.inputs(), interrupt_signal);
      tree->scale = fitted_scale(tree->scale, {}, model);
      for (const render::Model::Node& node : model.nodes)
        tree->links.push_back({node.name,
                               node.parent,
                               {node.position.cast<Real>(), node.orientation.cast<Real>().normalized()}});
    } catch (const render::FileError& error) {
      Where where = tree->where;
      where.path += "/file";
      errors.push_back({where, error.what()});
    }
  }
}

Parts build(const ModelTree& tree) {
  ArticulationBuilder make(tree.where, tree.name);
  for (const ModelTree::Link& link : tree.links) {
    Body& body = make.body(link.name, tree.material);
    body.shape = MeshFile{tree.file + "#" + link.name, tree.scale};
    body.position = tree.position + tree.orientation * (tree.scale.factor * link.pose.position);
    body.orientation = (tree.orientation * link.pose.orientation).normalized();
    body.velocity = tree.velocity;
    body.density = tree.density;
    body.collides = tree.collides;
    if (link.parent < 0 && tree.base.empty()) continue;
    const std::string above = link.parent >= 0
                                  ? make.own(tree.links[static_cast<std::size_t>(link.parent)].name)
                              : tree.base == "world" ? ""
                                                     : tree.base;
    const Quat orientation = body.orientation;
    Joint& joint = make.joint(link.name, body.name, above, body.position);
    const auto own = std::ranges::find(tree.joints, link.name, &NodeJoint::node);
    if (own != tree.joints.end()) {
      joint.behaviour = own->behaviour;
      joint.behaviour.axis = orientation * own->behaviour.axis;
      if (own->behaviour.second_axis) joint.behaviour.second_axis = orientation * *own->behaviour.second_axis;
    } else {
      joint.behaviour.friction = tree.friction;
      joint.behaviour.damping = tree.damping;
    }
  }
  return std::move(make.parts);
}

}  // namespace offstage::producer
