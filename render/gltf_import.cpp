#include "render/gltf_import.h"

#include <algorithm>

#include "render/error.h"
#include "render/file_io.h"
#include "render/gltf_file.h"
#include "render/gltf_geometry.h"
#include "render/gltf_material.h"
#include "render/gltf_places.h"
#include "render/gltf_rig.h"
#include "render/part_builder.h"

namespace offstage::render {
namespace {

using Eigen::Affine3d;

/// Returns the rotation of a quaternion [x, y, z, w]. Zero counts as no rotation.
Eigen::Quaterniond gltf_rotation(const Eigen::Vector4d& q) {
  const Eigen::Quaterniond rotation(q.w(), q.x(), q.y(), q.z());
  return q.norm() > 1e-12 ? rotation.normalized() : Eigen::Quaterniond::Identity();
}

Affine3d local_transform(const GltfValue& node) {
  Affine3d result = Affine3d::Identity();
  if (node.has("matrix")) {
    const Eigen::Matrix<double, 16, 1> columns =
        node.numbers<16>("matrix", Eigen::Matrix<double, 16, 1>::Zero());
    result.matrix() = Eigen::Map<const Eigen::Matrix4d>(columns.data());
    result.makeAffine();
    return result;
  }
  const Eigen::Vector4d rotation = node.numbers<4>("rotation", Eigen::Vector4d::UnitW());
  result.translate(node.numbers<3>("translation", Eigen::Vector3d::Zero()));
  result.rotate(gltf_rotation(rotation));
  result.scale(node.numbers<3>("scale", Eigen::Vector3d::Ones()));
  return result;
}

/// The tree of nodes with the transforms to the scene's frame.
class GltfNodes {
 public:
  explicit GltfNodes(GltfFile& file)
      : children_(file.count("nodes")), parents_(children_.size(), -1), world_(children_.size()) {
    std::vector<int>& parents = parents_;
    for (std::size_t i = 0; i < children_.size(); ++i) {
      const GltfValue node = file.item("nodes", i);
      for (std::size_t k = 0; k < node.count("children"); ++k) {
        const std::size_t child = node.index_at("children", k, children_.size());
        if (parents[child] >= 0)
          throw FileError(node.place() + ": its child " + std::to_string(child) + " has another parent");
        parents[child] = static_cast<int>(i);
        children_[i].push_back(child);
      }
    }
    std::vector<std::size_t> stack;
    for (std::size_t i = 0; i < parents.size(); ++i)
      if (parents[i] < 0) stack.push_back(i);
    while (!stack.empty()) {  // explicit, because the depth depends on the file
      const std::size_t i = stack.back();
      stack.pop_back();
      order_.push_back(i);
      const Affine3d local = local_transform(file.item("nodes", i));
      world_[i] = parents[i] < 0 ? local : world_[static_cast<std::size_t>(parents[i])] * local;
      stack.insert(stack.end(), children_[i].begin(), children_[i].end());
    }
    if (order_.size() < children_.size()) throw FileError("nodes: the hierarchy is recursive");
  }

  std::size_t size() const { return children_.size(); }
  const std::vector<std::size_t>& children(std::size_t node) const { return children_[node]; }
  const Affine3d& world(std::size_t node) const { return world_[node]; }
  const std::vector<int>& parents() const { return parents_; }
  /// Returns all nodes in an order in which parents precede their children.
  const std::vector<std::size_t>& order() const { return order_; }

 private:
  std::vector<std::vector<std::size_t>> children_;
  std::vector<int> parents_;
  std::vector<Affine3d> world_;
  std::vector<std::size_t> order_;
};

class GltfImporter {
 public:
  GltfImporter(GltfFile& file, std::string wanted, bool with_rig)
      : file_(file),
        wanted_(std::move(wanted)),
        with_rig_(with_rig),
        materials_(file, model_),
        builder_(model_) {}

  Model import() {
    materials_.read();
    const GltfNodes nodes(file_);
    nodes_ = &nodes;
    geometry_.emplace(file_, materials_, model_);
    model_.clips = gltf_clips(file_);
    if (with_rig_ && !model_.clips.empty()) rig_.emplace(file_, *geometry_, nodes.parents(), nodes.order());
    visit(roots());
    for (Model::Part& part : model_.parts)  // faces without normals are flat (section 3.7.2.1)
      if (part.mesh.normals.empty() && !part.mesh.indices.empty()) compute_normals(part.mesh, 0);
    if (rig_) model_.rig = rig_->finish();
    warn_of_ignored();
    model_.unit = "1 m, as the format defines (glTF)";
    model_.unit_source = Model::UnitSource::stated;
    model_.warnings = file_.take_warnings();
    const std::vector<std::string> left_out = builder_.left_out();
    model_.warnings.insert(model_.warnings.end(), left_out.begin(), left_out.end());
    if (!wanted_.empty()) {  // cameras and lights belong to the whole file
      model_.cameras.clear();
      model_.lights.clear();
    }
    drop_unused_default();
    return std::move(model_);
  }

 private:
  std::vector<std::size_t> roots() const {
    std::vector<std::size_t> result;
    // Without a scene, the file is a library of meshes: all nodes without a parent are used.
    if (file_.count("scenes") == 0) {
      std::vector<bool> is_child(nodes_->size(), false);
      for (std::size_t i = 0; i < nodes_->size(); ++i)
        for (const std::size_t child : nodes_->children(i)) is_child[child] = true;
      for (std::size_t i = 0; i < nodes_->size(); ++i)
        if (!is_child[i]) result.push_back(i);
      return result;
    }
    const std::size_t index = file_.root().index("scene", file_.count("scenes")).value_or(0);
    const GltfValue scene = file_.item("scenes", index);
    std::vector<bool> is_listed(nodes_->size(), false);
    for (std::size_t k = 0; k < scene.count("nodes"); ++k) {
      const std::size_t node = scene.index_at("nodes", k, nodes_->size());
      if (!is_listed[node]) result.push_back(node);
      is_listed[node] = true;
    }
    if (file_.count("scenes") > 1)
      file_.warn("only scene " + std::to_string(index) + " of " + std::to_string(file_.count("scenes")) +
                 " is drawn");
    return result;
  }

  void visit(const std::vector<std::size_t>& roots) {
    struct Item {
      std::size_t node;
      int parent;
    };
    std::vector<bool> seen(nodes_->size(), false);
    std::vector<Item> stack;
    for (std::size_t i = roots.size(); i-- > 0;) stack.push_back({roots[i], -1});
    while (!stack.empty()) {
      Item item = stack.back();
      stack.pop_back();
      if (seen[item.node]) throw FileError("scenes: a node is in the scene twice");
      seen[item.node] = true;
      const GltfValue node = file_.item("nodes", item.node);
      if (const auto mesh = node.index("mesh", file_.count("meshes"))) {
        add_mesh(item.node, node, *mesh, item.parent);
        item.parent = static_cast<int>(model_.nodes.size() - 1);
      }
      add_views_and_lights(item.node, node);
      const std::vector<std::size_t>& children = nodes_->children(item.node);
      for (std::size_t i = children.size(); i-- > 0;) stack.push_back({children[i], item.parent});
    }
  }

  void add_views_and_lights(std::size_t index, const GltfValue& node) {
    const auto add = [&](auto&& read, NodeNames& names, auto& list) {
      if (!read) return;
      read->name = names.next(read->name.empty() ? "node" : read->name);
      read->node = rig_ ? rig_->index_of(index) : -1;
      read->model_from_place = nodes_->world(index).matrix().cast<float>();
      list.push_back(std::move(*read));
    };
    add(gltf_camera(file_, node), camera_names_, model_.cameras);
    add(gltf_light(file_, node), light_names_, model_.lights);
  }

  void add_mesh(std::size_t index, const GltfValue& node, std::size_t mesh, int parent) {
    const auto skin = node.index("skin", file_.count("skins"));
    // The transform of a node with a skin is ignored (section 3.7.3.3).
    const Affine3d world = skin ? Affine3d::Identity() : nodes_->world(index);
    const Affine3d rigid = turned_and_moved(world);
    const std::string name = node.text("name", "nodes[" + std::to_string(index) + "]");
    model_.nodes.push_back(model_node(names_.next(name.empty() ? "node" : name), parent, rigid));
    if (!wanted_.empty() && wanted_ != model_.nodes.back().name) return;
    const Affine3d frame = wanted_.empty() ? world : rigid.inverse() * world;
    const std::vector<Affine3d> instances = instances_of(node);
    const std::vector<Affine3d> joints = skin ? joints_of(*skin) : std::vector<Affine3d>{};
    for (std::size_t k = 0; k < geometry_->primitive_count(mesh); ++k) {
      const GltfPrimitive& primitive = geometry_->primitive(mesh, k);
      builder_.count_skipped(primitive.points, primitive.lines);
      if (primitive.surface.mesh.indices.empty()) continue;
      std::optional<FileSurface> own = geometry_->morphed(mesh, k, node);
      if (skin && primitive.influences > 0)
        own = geometry_->posed(own ? *own : primitive.surface, primitive, joints);
      for (const Affine3d& instance : instances)
        builder_.add(own ? *own : primitive.surface, frame * instance);
    }
    if (rig_) rig_->add_mesh(index, mesh, instances);
  }

  /// Returns the transforms of a node's instances (EXT_mesh_gpu_instancing). Without the extension there is
  /// one instance, the node itself.
  std::vector<Affine3d> instances_of(const GltfValue& node) {
    const GltfValue instancing = node.extension("EXT_mesh_gpu_instancing");
    if (!instancing.exists()) return {Affine3d::Identity()};
    const GltfValue attributes = instancing.child("attributes");
    const auto numbers = [&](const char* name, int width) {
      const auto accessor = attributes.index(name, file_.count("accessors"));
      return accessor ? file_.numbers(*accessor, width) : GltfNumbers{};
    };
    const GltfNumbers places = numbers("TRANSLATION", 3), turns = numbers("ROTATION", 4),
                      sizes = numbers("SCALE", 3);
    const std::size_t count = std::max({places.count, turns.count, sizes.count});
    if (count == 0) {
      file_.warn(instancing.place() + " places no instance; the node is drawn once");
      return {Affine3d::Identity()};
    }
    std::vector<Affine3d> result(count, Affine3d::Identity());
    for (const GltfNumbers* list : {&places, &turns, &sizes})
      if (list->count > 0 && list->count != count)
        throw FileError(attributes.place() + ": its lists have different lengths");
    for (std::size_t i = 0; i < count; ++i) {
      if (places.count > 0) result[i].translate(Eigen::Map<const Vector3f>(places.at(i)).cast<double>());
      if (turns.count > 0)
        result[i].rotate(gltf_rotation(Eigen::Map<const Vector4f>(turns.at(i)).cast<double>()));
      if (sizes.count > 0) result[i].scale(Eigen::Map<const Vector3f>(sizes.at(i)).cast<double>());
    }
    return result;
  }

  std::vector<Affine3d> joints_of(std::size_t index) {
    const GltfValue skin = file_.item("skins", index);
    const auto accessor = skin.index("inverseBindMatrices", file_.count("accessors"));
    const GltfNumbers inverse = accessor ? file_.numbers(*accessor, 16) : GltfNumbers{};
    const std::size_t count = skin.count("joints");
    if (inverse.count > 0 && inverse.count < count)
      throw skin.wrong("inverseBindMatrices", "has fewer matrices than joints");
    std::vector<Affine3d> result;
    for (std::size_t k = 0; k < count; ++k) {
      Affine3d joint = nodes_->world(skin.index_at("joints", k, nodes_->size()));
      if (inverse.count > 0) {
        Affine3d unbind;
        unbind.matrix() = Eigen::Map<const Eigen::Matrix4f>(inverse.at(k)).cast<double>();
        unbind.makeAffine();
        joint = joint * unbind;
      }
      result.push_back(joint);
    }
    return result;
  }

  void warn_of_ignored() {
    const auto warn = [this](std::size_t n, const std::string& what) {
      if (n > 0) file_.warn(std::to_string(n) + " " + what);
    };
    if (!rig_)
      warn(file_.count("animations"),
           "animations are not played: the model is in its rest pose; `animation` of a body plays one");
    if (model_.cameras.empty())
      warn(file_.count("cameras"), "cameras are ignored: no node of the file's scene has a usable camera");
    if (model_.lights.empty())
      warn(file_.root().extension("KHR_lights_punctual").count("lights"),
           "lights are ignored: no node of the file's scene has a usable light");
  }

  /// Removes the default material, which is the last one, unless a part uses it or there is no other
  /// material.
  void drop_unused_default() {
    const auto last = static_cast<int>(model_.materials.size() - 1);
    const bool used =
        std::ranges::any_of(model_.parts, [&](const Model::Part& p) { return p.material == last; });
    if (!used && last > 0) model_.materials.pop_back();
  }

  GltfFile& file_;
  std::string wanted_;
  bool with_rig_;
  Model model_;
  GltfMaterials materials_;
  PartBuilder builder_;
  std::optional<GltfGeometry> geometry_;
  std::optional<GltfRig> rig_;
  const GltfNodes* nodes_ = nullptr;
  NodeNames names_, camera_names_, light_names_;
};

}  // namespace

std::optional<Model> import_gltf(const std::filesystem::path& path, const std::string& node,
                                 const InputFolders& folders, bool with_rig) {
  try {
    GltfFile file(path, folders);
    if (file.is_version_1()) return std::nullopt;
    file.check();
    return GltfImporter(file, node, with_rig).import();
  } catch (const FileError& error) {
    throw FileError("cannot be read as a model: " + one_line(error.what()));
  }
}

}  // namespace offstage::render
