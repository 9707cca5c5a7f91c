#include "render/gltf_rig.h"

#include <algorithm>
#include <cmath>

#include "render/error.h"
#include "render/part_builder.h"

namespace offstage::render {
namespace {

std::string animation_name(const GltfValue& animation, std::size_t index) {
  const std::string name = animation.text("name");
  return name.empty() ? std::to_string(index) : name;
}

RigNode rig_node(const GltfValue& source, std::size_t index) {
  RigNode node;
  node.name = source.text("name");
  if (node.name.empty()) node.name = "nodes[" + std::to_string(index) + "]";
  if (source.has("matrix")) {
    node.has_matrix = true;
    const Eigen::Matrix<double, 16, 1> columns =
        source.numbers<16>("matrix", Eigen::Matrix<double, 16, 1>::Zero());
    node.matrix = Eigen::Map<const Eigen::Matrix4d>(columns.data()).cast<float>();
    node.matrix.row(3) << 0, 0, 0, 1;
  }
  const Eigen::Vector4d turn = source.numbers<4>("rotation", Eigen::Vector4d::UnitW());
  if (turn.norm() > 1e-12) node.rotation = Eigen::Quaterniond(turn.normalized()).cast<float>();
  node.translation = source.numbers<3>("translation", Eigen::Vector3d::Zero()).cast<float>();
  node.scale = source.numbers<3>("scale", Eigen::Vector3d::Ones()).cast<float>();
  return node;
}

/// Removes triangles that cannot be drawn.
void keep_good_triangles(Mesh& mesh) {
  std::vector<uint32_t> good;
  const auto fine = [&](uint32_t v) { return v < mesh.positions.size() && mesh.positions[v].allFinite(); };
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const auto t = mesh.indices.begin() + static_cast<std::ptrdiff_t>(i);
    if (std::all_of(t, t + 3, fine)) good.insert(good.end(), t, t + 3);
  }
  mesh.indices = std::move(good);
  for (Vector3f& p : mesh.positions)
    if (!p.allFinite()) p.setZero();
}

/// Gives each corner of each triangle a vertex of its own.
void separate_corners(RigSurface& surface) {
  Mesh& mesh = surface.mesh;
  const std::vector<uint32_t> corners = mesh.indices;
  const auto spread = [&](auto& values) {
    if (values.empty()) return;
    std::decay_t<decltype(values)> result;
    for (const uint32_t v : corners) result.push_back(values[v]);
    values = std::move(result);
  };
  std::vector<uint32_t> joints;
  std::vector<float> weights;
  for (const uint32_t v : corners)
    for (std::size_t k = v * surface.influences; k < (v + 1) * surface.influences; ++k) {
      joints.push_back(surface.joints[k]);
      weights.push_back(surface.weights[k]);
    }
  surface.joints = std::move(joints);
  surface.weights = std::move(weights);
  for (RigTarget& target : surface.targets) spread(target.positions);
  spread(mesh.uvs);
  spread(mesh.second_uvs);
  spread(mesh.colors);
  spread(mesh.positions);
  mesh.normals.clear();
  mesh.tangents.clear();
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) mesh.indices[i] = static_cast<uint32_t>(i);
}

}  // namespace

GltfRig::GltfRig(GltfFile& file, GltfGeometry& geometry, std::span<const int> parents,
                 std::span<const std::size_t> order)
    : file_(file), geometry_(geometry), rig_index_(parents.size(), -1) {
  for (const std::size_t i : order) {
    RigNode node = rig_node(file.item("nodes", i), i);
    if (parents[i] >= 0) node.parent = rig_index_[static_cast<std::size_t>(parents[i])];
    rig_index_[i] = static_cast<int>(rig_.nodes.size());
    rig_.nodes.push_back(std::move(node));
  }
}

void GltfRig::add_mesh(std::size_t index, std::size_t mesh, std::span<const Eigen::Affine3d> instances) {
  const GltfValue node = file_.item("nodes", index), source = file_.item("meshes", mesh);
  const auto skin_index = node.index("skin", file_.count("skins"));
  std::size_t targets = 0;
  for (std::size_t k = 0; k < geometry_.primitive_count(mesh); ++k) {
    RigSurface surface = surface_of(geometry_.primitive(mesh, k));
    if (surface.mesh.indices.empty()) continue;
    surface.node = rig_index_[index];
    if (skin_index && surface.influences > 0) surface.skin = skin(*skin_index);
    read_targets(source.item("primitives", k), surface);
    targets = std::max(targets, surface.targets.size());
    if (!surface.deforms()) {
      add_rigid(std::move(surface), instances);
      continue;
    }
    if (instances.size() > 1)
      file_.warn(node.place() + ": only one of its instances is drawn, because the mesh deforms");
    surface.flat = surface.mesh.normals.size() != surface.mesh.positions.size();
    if (surface.flat) separate_corners(surface);
    rig_.surfaces.push_back(std::move(surface));
  }
  const GltfValue& owner = node.count("weights") > 0 ? node : source;
  std::vector<float>& weights = rig_.nodes[static_cast<std::size_t>(rig_index_[index])].weights;
  weights.assign(targets, 0);
  for (std::size_t t = 0; t < std::min(targets, owner.count("weights")); ++t)
    weights[t] = static_cast<float>(owner.number_at("weights", t));
}

RigSurface GltfRig::surface_of(const GltfPrimitive& primitive) {
  RigSurface surface;
  surface.material = primitive.surface.material;
  surface.mesh = primitive.surface.mesh;
  surface.influences = primitive.influences;
  surface.joints = primitive.joints;
  surface.weights = primitive.weights;
  keep_good_triangles(surface.mesh);
  return surface;
}

/// Adds a rigid surface, in the same way as PartBuilder adds the surfaces of a model without animation.
void GltfRig::add_rigid(RigSurface surface, std::span<const Eigen::Affine3d> instances) {
  Model collected;
  PartBuilder builder(collected);
  const FileSurface source{std::move(surface.mesh), surface.material};
  for (const Eigen::Affine3d& instance : instances) builder.add(source, instance);
  for (Model::Part& part : collected.parts) {
    if (part.mesh.indices.empty()) continue;
    if (part.mesh.normals.empty()) compute_normals(part.mesh, 0);
    RigSurface rigid;
    rigid.node = surface.node;
    rigid.material = surface.material;
    rigid.mesh = std::move(part.mesh);
    rig_.surfaces.push_back(std::move(rigid));
  }
}

void GltfRig::read_targets(const GltfValue& primitive, RigSurface& surface) {
  const std::size_t n = surface.mesh.positions.size();
  for (std::size_t t = 0; t < primitive.count("targets"); ++t) {
    const GltfValue source = primitive.item("targets", t);
    const auto offsets = [&](const char* name) {
      std::vector<Vector3f> result;
      const auto accessor = source.index(name, file_.count("accessors"));
      if (!accessor) return result;
      const GltfNumbers numbers = file_.numbers(*accessor, 3);
      if (numbers.count != n) throw source.wrong(name, "must have one element for each vertex");
      for (std::size_t i = 0; i < n; ++i) {
        const Vector3f offset = Eigen::Map<const Vector3f>(numbers.at(i));
        result.push_back(offset.allFinite() ? offset : Vector3f(Vector3f::Zero()));
      }
      return result;
    };
    surface.targets.push_back({offsets("POSITION"), offsets("NORMAL")});
    for (const char* name : {"TANGENT", "COLOR_0", "TEXCOORD_0", "TEXCOORD_1"})
      if (source.has(name))
        file_.warn("morph targets of " + std::string(name) + " are ignored while an animation plays");
  }
}

int GltfRig::skin(std::size_t index) {
  const auto [known, is_new] = skins_.try_emplace(index, static_cast<int>(rig_.skins.size()));
  if (!is_new) return known->second;
  const GltfValue source = file_.item("skins", index);
  const auto accessor = source.index("inverseBindMatrices", file_.count("accessors"));
  const GltfNumbers inverse = accessor ? file_.numbers(*accessor, 16) : GltfNumbers{};
  RigSkin skin;
  for (std::size_t k = 0; k < source.count("joints"); ++k) {
    skin.joints.push_back(rig_index_[source.index_at("joints", k, rig_index_.size())]);
    Eigen::Matrix4f unbind = Eigen::Matrix4f::Identity();
    if (inverse.count > k) unbind = Eigen::Map<const Eigen::Matrix4f>(inverse.at(k));
    if (!unbind.allFinite()) throw source.wrong("inverseBindMatrices", "has a matrix that is not finite");
    skin.unbind.push_back(unbind);
  }
  if (inverse.count > 0 && inverse.count < skin.joints.size())
    throw source.wrong("inverseBindMatrices", "has fewer matrices than joints");
  rig_.skins.push_back(std::move(skin));
  return known->second;
}

std::optional<RigChannel> GltfRig::channel(const GltfValue& animation, std::size_t index) {
  const GltfValue source = animation.item("channels", index), target = source.child("target");
  const std::string path = target.text("path");
  const auto node = target.index("node", rig_index_.size());
  const auto sampler_index = source.index("sampler", animation.count("samplers"));
  RigChannel channel;
  using Path = RigChannel::Path;
  if (path == "translation" || path == "rotation" || path == "scale")
    channel.path = path == "translation" ? Path::translation
                   : path == "rotation"  ? Path::rotation
                                         : Path::scale;
  else if (path == "weights")
    channel.path = Path::weights;
  else
    file_.warn(target.place() + ": the animation of '" + path + "' is ignored");
  const bool known = path == "translation" || path == "rotation" || path == "scale" || path == "weights";
  if (!known || !node || !sampler_index) return std::nullopt;
  channel.node = rig_index_[*node];
  const std::size_t targets = rig_.nodes[static_cast<std::size_t>(channel.node)].weights.size();
  // The node has no mesh with morph targets.
  if (channel.path == Path::weights && targets == 0) return std::nullopt;
  const GltfValue sampler = animation.item("samplers", *sampler_index);
  const std::string how = sampler.text("interpolation", "LINEAR");
  channel.interpolation = how == "STEP"          ? RigChannel::Interpolation::step
                          : how == "CUBICSPLINE" ? RigChannel::Interpolation::cubic
                                                 : RigChannel::Interpolation::linear;
  const auto input = sampler.index("input", file_.count("accessors")),
             output = sampler.index("output", file_.count("accessors"));
  if (!input || !output) throw FileError(sampler.place() + ": has no input or no output");
  const GltfNumbers times = file_.numbers(*input, 1), values = file_.numbers(*output);
  channel.times = times.values;
  channel.values = values.values;
  const std::size_t width = channel.path == Path::weights ? targets : channel.path == Path::rotation ? 4 : 3;
  const std::size_t per_key = channel.interpolation == RigChannel::Interpolation::cubic ? 3 * width : width;
  if (times.count == 0 || channel.values.size() != times.count * per_key)
    throw FileError(sampler.place() + ": its output has " + std::to_string(channel.values.size()) +
                    " numbers for " + std::to_string(times.count) + " keys of " + std::to_string(per_key));
  if (!std::ranges::is_sorted(channel.times))
    throw FileError(sampler.place() + ": its times do not increase");
  return channel;
}

RigClip GltfRig::clip(std::size_t index) {
  const GltfValue animation = file_.item("animations", index);
  RigClip clip;
  clip.name = animation_name(animation, index);
  for (std::size_t k = 0; k < animation.count("channels"); ++k)
    if (std::optional<RigChannel> read = channel(animation, k)) {
      clip.duration = std::max(clip.duration, read->times.back());
      RigNode& node = rig_.nodes[static_cast<std::size_t>(read->node)];
      if (node.has_matrix && read->path != RigChannel::Path::weights)
        file_.warn(
            animation.place() + ": the node '" + node.name +
            "' has a matrix in place of translation, rotation and scale, so its animation has no effect");
      clip.channels.push_back(std::move(*read));
    }
  return clip;
}

ModelRig GltfRig::finish() {
  for (std::size_t i = 0; i < file_.count("animations"); ++i) rig_.clips.push_back(clip(i));
  return std::move(rig_);
}

std::vector<Model::Clip> gltf_clips(GltfFile& file) {
  std::vector<Model::Clip> clips;
  for (std::size_t i = 0; i < file.count("animations"); ++i) {
    const GltfValue animation = file.item("animations", i);
    Model::Clip clip{animation_name(animation, i), 0};
    for (std::size_t k = 0; k < animation.count("samplers"); ++k)
      if (const auto input = animation.item("samplers", k).index("input", file.count("accessors")))
        for (const float time : file.numbers(*input, 1).values) clip.duration = std::max(clip.duration, time);
    if (!std::isfinite(clip.duration)) throw FileError(animation.place() + ": a time is not finite");
    clips.push_back(std::move(clip));
  }
  return clips;
}

}  // namespace offstage::render
