#include "render/model_rig.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "render/model.h"

namespace offstage::render {
namespace {

using Eigen::Affine3f;
using Path = RigChannel::Path;
using Step = RigChannel::Interpolation;

std::size_t width_of(const RigChannel& channel, std::size_t targets) {
  return channel.path == Path::weights ? targets : channel.path == Path::rotation ? 4 : 3;
}

/// Returns the value of a channel at a time (appendix C of the glTF specification).
std::vector<float> value_at(const RigChannel& channel, std::size_t width, float time) {
  const std::vector<float>& times = channel.times;
  const bool cubic = channel.interpolation == Step::cubic;
  const std::size_t stride = cubic ? 3 * width : width, own = cubic ? width : 0;
  const auto at = [&](std::size_t key, std::size_t part, std::size_t c) {
    return channel.values[key * stride + part + c];
  };
  const auto next = std::upper_bound(times.begin(), times.end(), time);
  const auto upper = static_cast<std::size_t>(next - times.begin());
  std::vector<float> result(width);
  if (upper == 0 || upper == times.size() || channel.interpolation == Step::step) {
    const std::size_t key = upper == 0 ? 0 : upper - 1;
    for (std::size_t c = 0; c < width; ++c) result[c] = at(key, own, c);
    return result;
  }
  const std::size_t a = upper - 1, b = upper;
  const float dt = times[b] - times[a], s = (time - times[a]) / dt, s2 = s * s, s3 = s2 * s;
  if (cubic) {
    for (std::size_t c = 0; c < width; ++c)
      result[c] = (2 * s3 - 3 * s2 + 1) * at(a, own, c) + (s3 - 2 * s2 + s) * dt * at(a, 2 * width, c) +
                  (3 * s2 - 2 * s3) * at(b, own, c) + (s3 - s2) * dt * at(b, 0, c);
  } else if (channel.path == Path::rotation) {
    const Eigen::Quaternionf from(Eigen::Map<const Vector4f>(&channel.values[a * stride])),
        to(Eigen::Map<const Vector4f>(&channel.values[b * stride]));
    Eigen::Map<Vector4f>(result.data()) = from.normalized().slerp(s, to.normalized()).coeffs();
  } else {
    for (std::size_t c = 0; c < width; ++c) result[c] = at(a, 0, c) + s * (at(b, 0, c) - at(a, 0, c));
  }
  return result;
}

Affine3f local_transform(const RigNode& node) {
  Affine3f local = Affine3f::Identity();
  if (node.has_matrix)
    local.matrix() = node.matrix;
  else
    local.translate(node.translation).rotate(node.rotation).scale(node.scale);
  return local;
}

/// Gives each triangle its own normal. The mesh must not have shared vertices.
void make_flat(Mesh& mesh) {
  mesh.normals.assign(mesh.positions.size(), Vector3f::UnitY());
  for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
    const uint32_t* t = mesh.indices.data() + i;
    const Vector3f& a = mesh.positions[t[0]];
    const Vector3f normal = (mesh.positions[t[1]] - a).cross(mesh.positions[t[2]] - a);
    if (!(normal.norm() > 0)) continue;
    for (int k = 0; k < 3; ++k) mesh.normals[t[k]] = normal.normalized();
  }
}

void add_targets(const RigSurface& surface, const std::vector<float>& weights, Mesh& mesh) {
  for (std::size_t t = 0; t < std::min(surface.targets.size(), weights.size()); ++t) {
    if (weights[t] == 0) continue;
    const RigTarget& target = surface.targets[t];
    for (std::size_t i = 0; i < target.positions.size(); ++i)
      mesh.positions[i] += weights[t] * target.positions[i];
    for (std::size_t i = 0; i < std::min(target.normals.size(), mesh.normals.size()); ++i)
      mesh.normals[i] += weights[t] * target.normals[i];
  }
  for (Vector3f& normal : mesh.normals)
    if (normal.norm() > 1e-12f) normal.normalize();
}

void apply_skin(const RigSurface& surface, const std::vector<Eigen::Matrix4f>& joints, Mesh& mesh) {
  for (std::size_t i = 0; i < mesh.positions.size(); ++i) {
    Eigen::Matrix4f sum = Eigen::Matrix4f::Zero();
    float total = 0;
    for (std::size_t k = i * surface.influences; k < (i + 1) * surface.influences; ++k) {
      if (surface.weights[k] == 0 || surface.joints[k] >= joints.size()) continue;
      sum += surface.weights[k] * joints[surface.joints[k]];
      total += surface.weights[k];
    }
    if (!(total > 0)) continue;  // no joint moves this vertex
    Affine3f pose;
    pose.matrix() = sum / total;
    mesh.positions[i] = pose * mesh.positions[i];
    const Eigen::Matrix3f m = pose.linear();
    const float sign = m.determinant() < 0 ? -1.f : 1.f;
    if (!mesh.normals.empty()) {
      Eigen::Matrix3f cofactor;
      cofactor << m.col(1).cross(m.col(2)), m.col(2).cross(m.col(0)), m.col(0).cross(m.col(1));
      const Vector3f normal = sign * (cofactor * mesh.normals[i]);
      if (normal.norm() > 1e-20f) mesh.normals[i] = normal.normalized();
    }
    if (!mesh.tangents.empty()) {
      const Vector3f tangent = m * mesh.tangents[i].head<3>();
      if (tangent.norm() > 1e-20f) mesh.tangents[i].head<3>() = tangent.normalized();
      mesh.tangents[i].w() *= sign;
    }
  }
}

bool refers(int index, std::size_t size) {
  return index >= 0 && static_cast<std::size_t>(index) < size;
}
bool finite(const std::vector<float>& values) {
  return std::ranges::all_of(values, [](float x) { return std::isfinite(x); });
}
bool finite(const std::vector<Vector3f>& values) {
  return std::ranges::all_of(values, [](const Vector3f& v) { return v.allFinite(); });
}

bool is_whole(const RigNode& node, std::size_t own) {
  return (node.parent == -1 || refers(node.parent, own)) && node.translation.allFinite() &&
         node.rotation.coeffs().allFinite() && node.scale.allFinite() && node.matrix.allFinite() &&
         finite(node.weights);
}

bool is_whole(const RigChannel& channel, const std::vector<RigNode>& nodes) {
  const auto known = [](auto value, auto last) {
    return static_cast<unsigned>(value) <= static_cast<unsigned>(last);
  };
  if (!refers(channel.node, nodes.size()) || !known(channel.path, Path::weights) ||
      !known(channel.interpolation, Step::cubic) || channel.times.empty())
    return false;
  const std::size_t width = width_of(channel, nodes[static_cast<std::size_t>(channel.node)].weights.size());
  const std::size_t per_key = channel.interpolation == Step::cubic ? 3 * width : width;
  return channel.values.size() == channel.times.size() * per_key && finite(channel.times) &&
         finite(channel.values) && std::ranges::is_sorted(channel.times);
}

bool is_whole(const RigSurface& surface, const ModelRig& rig, std::size_t materials) {
  const Mesh& mesh = surface.mesh;
  const std::size_t n = mesh.positions.size();
  const auto fits = [&](const auto& values) { return values.empty() || values.size() == n; };
  return refers(surface.node, rig.nodes.size()) &&
         (surface.skin == -1 || refers(surface.skin, rig.skins.size())) &&
         refers(surface.material, materials) && fits(mesh.normals) && fits(mesh.uvs) &&
         fits(mesh.second_uvs) && fits(mesh.colors) && fits(mesh.tangents) && mesh.indices.size() % 3 == 0 &&
         finite(mesh.positions) &&
         std::ranges::all_of(mesh.indices, [&](uint32_t index) { return index < n; }) &&
         surface.influences <= 64 && surface.joints.size() == n * surface.influences &&
         surface.weights.size() == surface.joints.size() && finite(surface.weights) &&
         std::ranges::all_of(surface.targets, [&](const RigTarget& target) {
           return fits(target.positions) && fits(target.normals) && finite(target.positions);
         });
}

}  // namespace

int ModelRig::clip(const std::string& name) const {
  if (name.empty()) return clips.empty() ? -1 : 0;
  for (std::size_t i = 0; i < clips.size(); ++i)
    if (clips[i].name == name) return static_cast<int>(i);
  std::size_t number = 0;
  const auto [end, error] = std::from_chars(name.data(), name.data() + name.size(), number);
  const bool is_number = error == std::errc() && end == name.data() + name.size();
  return is_number && number < clips.size() ? static_cast<int>(number) : -1;
}

RigPose pose_at(const ModelRig& rig, int clip, float time) {
  std::vector<RigNode> nodes = rig.nodes;
  if (clip >= 0) {
    for (const RigChannel& channel : rig.clips[static_cast<std::size_t>(clip)].channels) {
      RigNode& node = nodes[static_cast<std::size_t>(channel.node)];
      const std::vector<float> value = value_at(channel, width_of(channel, node.weights.size()), time);
      switch (channel.path) {
        case Path::translation:
          node.translation = Eigen::Map<const Vector3f>(value.data());
          break;
        case Path::rotation: {
          const Eigen::Quaternionf turn(Eigen::Map<const Vector4f>(value.data()));
          node.rotation = turn.norm() > 1e-12f ? turn.normalized() : Eigen::Quaternionf::Identity();
          break;
        }
        case Path::scale:
          node.scale = Eigen::Map<const Vector3f>(value.data());
          break;
        case Path::weights:
          node.weights = value;
          break;
      }
    }
  }
  RigPose pose;
  for (RigNode& node : nodes) {
    const Affine3f local = local_transform(node);
    pose.world.push_back(node.parent < 0 ? local : pose.world[static_cast<std::size_t>(node.parent)] * local);
    pose.weights.push_back(std::move(node.weights));
  }
  return pose;
}

Mesh deformed(const ModelRig& rig, const RigSurface& surface, const RigPose& pose) {
  Mesh mesh = surface.mesh;
  add_targets(surface, pose.weights[static_cast<std::size_t>(surface.node)], mesh);
  if (surface.skin >= 0 && surface.influences > 0) {
    const RigSkin& skin = rig.skins[static_cast<std::size_t>(surface.skin)];
    std::vector<Eigen::Matrix4f> joints;
    for (std::size_t k = 0; k < skin.joints.size(); ++k)
      joints.push_back(pose.world[static_cast<std::size_t>(skin.joints[k])].matrix() * skin.unbind[k]);
    apply_skin(surface, joints, mesh);
  }
  if (surface.flat) make_flat(mesh);
  return mesh;
}

bool is_whole(const ModelRig& rig, std::size_t materials) {
  for (std::size_t i = 0; i < rig.nodes.size(); ++i)
    if (!is_whole(rig.nodes[i], i)) return false;
  for (const RigClip& clip : rig.clips)
    if (!std::isfinite(clip.duration) ||
        !std::ranges::all_of(clip.channels, [&](const RigChannel& c) { return is_whole(c, rig.nodes); }))
      return false;
  const auto whole_skin = [&](const RigSkin& skin) {
    return skin.unbind.size() == skin.joints.size() &&
           std::ranges::all_of(skin.joints, [&](int joint) { return refers(joint, rig.nodes.size()); }) &&
           std::ranges::all_of(skin.unbind, [](const Eigen::Matrix4f& m) { return m.allFinite(); });
  };
  return std::ranges::all_of(rig.skins, whole_skin) &&
         std::ranges::all_of(rig.surfaces, [&](const RigSurface& s) { return is_whole(s, rig, materials); });
}

}  // namespace offstage::render
