#pragma once
/// Drawable data on the CPU: meshes, materials, and models that combine them. All colours are linear.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "render/image.h"

namespace offstage::render {

using Eigen::Vector2f;
using Eigen::Vector3f;
using Eigen::Vector4f;

/// Indexed triangles. `normals` and `uvs` are empty or as long as `positions`; meshes without normals are
/// shaded smooth.
struct Mesh {
  std::vector<Vector3f> positions;
  std::vector<Vector3f> normals;
  std::vector<Vector2f> uvs;
  std::vector<uint32_t> indices;  ///< three per triangle, counter-clockwise seen from outside
  /// A coarser surface with the same vertices, slightly inside the fine one and closed if that is. It is used
  /// for shadows and depth. Empty: none.
  std::vector<uint32_t> coarse_indices;
  /// Marks a mesh that stands for an infinite plane. It fades into the sky near its horizon, where it is seen
  /// at a grazing angle.
  bool endless = false;

  Eigen::AlignedBox3f bounds() const;
};

/// Fills `normals` with area-weighted means, split at edges sharper than `crease_deg` (vertices are
/// duplicated there).
void compute_normals(Mesh& mesh, float crease_deg = 40);

/// Procedural surface patterns. They are evaluated in object space and need no texture coordinates; on cloths
/// they follow the cloth.
enum class Pattern {
  none,
  checker,
  grid,
  noise,
  brick,
  wood,
  lawn,
  paving,
  stripes,
  gingham,
  concrete,
  sand,
  planks,
  water
};

/// How the threads of a fabric cross. `none`: no threads, as in leather and rubber.
enum class Weave { none, plain, twill, satin };

/// Additional properties of a material for cloth.
struct Fabric {
  Weave weave = Weave::plain;
  float thread = 0.001f;  ///< width of a thread [m], > 0
  float relief = 0.5f;    ///< how strongly threads stand out, in [0, 1]
  float sheen = 0.2f;  ///< strength of the light scattered by protruding fibres at grazing angles, in [0, 1]
  Vector3f sheen_color = {1, 1, 1};
  float translucency = 0.15f;               ///< share of the diffuse light that passes through, in [0, 1]
  std::optional<Vector3f> back_color = {};  ///< colour of the back; empty: the same as the front
};

/// Metallic/roughness material.
struct Material {
  std::string name = {};
  Vector4f color = {0.8f, 0.8f, 0.8f, 1};  ///< base colour; alpha below 1 blends
  float metallic = 0;                      ///< in [0, 1]
  float roughness = 0.5f;                  ///< in [0, 1]
  Vector3f emission = Vector3f::Zero();    ///< radiance [arbitrary units, 1 = sunlit white]
  float transmission = 0;   ///< share of the light that enters the surface and passes through, in [0, 1]
  float refraction = 1.5f;  ///< index of refraction, in [1, 3]
  Pattern pattern = Pattern::none;
  Vector3f pattern_color = {0.4f, 0.4f, 0.4f};  ///< second colour of the pattern
  float pattern_scale = 1;                      ///< size of one cell [m], > 0
  bool two_sided = false;
  Fabric fabric = {};           ///< used for cloths only
  int base_color_texture = -1;  ///< index into Model::textures, -1: none
  int metallic_roughness_texture = -1;
  int emission_texture = -1;
};

/// The content of a model file, with the node hierarchy already applied.
struct Model {
  /// A node that has triangles, with its pose (rotation and translation, without its scale). Parts of a model
  /// that move against each other are separate nodes.
  struct Node {
    std::string name;  ///< unique; repeated names get the suffix _2, _3 ...
    int parent = -1;   ///< index of the nearest node above that has triangles, -1: none
    Eigen::Vector3f position = Eigen::Vector3f::Zero();
    Eigen::Quaternionf orientation = Eigen::Quaternionf::Identity();
  };
  struct Part {
    Mesh mesh;
    int material = 0;  ///< index into `materials`
  };
  std::vector<Part> parts;
  std::vector<Node> nodes;  ///< parents first
  std::vector<Material> materials;
  std::vector<Image> textures;
  std::vector<std::string> warnings;  ///< repaired or ignored elements, one line each

  Eigen::AlignedBox3f bounds() const;
  std::size_t triangle_count() const;
  std::size_t vertex_count() const;
};

}  // namespace offstage::render
