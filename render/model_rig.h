#pragma once
/// The moving parts of a model file: nodes with their animations, skins and morph targets, as glTF 2.0
/// defines them. Section numbers refer to its specification (Khronos Group, 2021). Units: metres, seconds,
/// radians.

#include <cstdint>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "render/mesh.h"

namespace offstage::render {

struct RigNode {
  std::string name;
  int parent = -1;  ///< index of the parent, which comes before this node; -1: none
  /// Local transform in the rest pose: translation * rotation * scale, or `matrix` if the file has one.
  Vector3f translation = Vector3f::Zero();
  Eigen::Quaternionf rotation = Eigen::Quaternionf::Identity();
  Vector3f scale = Vector3f::Ones();
  bool has_matrix = false;
  Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
  std::vector<float> weights;  ///< weights of the morph targets of the node's mesh
};

/// One property of one node over time (section 3.11).
struct RigChannel {
  enum class Path { translation, rotation, scale, weights };
  enum class Interpolation { linear, step, cubic };
  int node = 0;
  Path path = Path::translation;
  Interpolation interpolation = Interpolation::linear;
  std::vector<float> times;   ///< times of the keys in ascending order [s]
  std::vector<float> values;  ///< values of each key; with `cubic`: tangent in, value, tangent out
};

struct RigClip {
  std::string name;
  float duration = 0;  ///< time of the last key [s]
  std::vector<RigChannel> channels;
};

struct RigSkin {
  std::vector<int> joints;              ///< index of the node of each joint
  std::vector<Eigen::Matrix4f> unbind;  ///< inverse bind matrix of each joint
};

struct RigTarget {
  std::vector<Vector3f> positions, normals;  ///< offset of each vertex of the mesh; empty: none
};

/// A mesh with one material that moves with a node or a skin.
struct RigSurface {
  int node = 0;
  int skin = -1;               ///< index of the skin; -1: none, the triangles are in the node's frame
  int material = 0;            ///< index into Model::materials
  Mesh mesh;                   ///< the mesh without morph targets and skin
  bool flat = false;           ///< whether the file has no normals, so that each face has a normal of its own
  std::size_t influences = 0;  ///< joints per vertex
  std::vector<uint32_t> joints;  ///< indices into RigSkin::joints; indices out of range are ignored
  std::vector<float> weights;    ///< weight of each entry of `joints`
  std::vector<RigTarget> targets;

  bool deforms() const { return skin >= 0 || !targets.empty(); }
};

struct ModelRig {
  std::vector<RigNode> nodes;
  std::vector<RigClip> clips;
  std::vector<RigSkin> skins;
  std::vector<RigSurface> surfaces;

  /// Returns the index of a clip. `name`: its name, or its number from 0, or empty for the first clip.
  /// Returns -1 if there is none.
  int clip(const std::string& name) const;
};

/// The state of all nodes at one time.
struct RigPose {
  std::vector<Eigen::Affine3f> world;       ///< transform of each node, in the model's frame
  std::vector<std::vector<float>> weights;  ///< weights of the morph targets of each node
};
/// Returns the pose at a time of a clip [s], or the rest pose for `clip` -1. Before its first and after its
/// last key, each channel keeps its value.
RigPose pose_at(const ModelRig& rig, int clip, float time);

/// Returns the mesh of a surface in a pose, with its morph targets and skin applied (section 3.7.3.3). With a
/// skin it is in the model's frame, otherwise in the frame of its node.
Mesh deformed(const ModelRig& rig, const RigSurface& surface, const RigPose& pose);

/// Returns whether all indices are in range, all sizes agree and all numbers are finite. `materials`: number
/// of materials.
bool is_whole(const ModelRig& rig, std::size_t materials);

}  // namespace offstage::render
