#pragma once
/// Drawable data on the CPU: meshes, materials, and models that combine them. All colours are linear.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "render/image.h"
#include "render/mesh.h"
#include "render/model_rig.h"

namespace offstage::render {

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

/// Weave of a fabric. `none`: no threads, as in leather and rubber.
enum class Weave { none, plain, twill, satin };

/// Additional properties of a material for cloth.
struct Fabric {
  Weave weave = Weave::plain;
  float thread = 0.001f;  ///< width of a thread [m], > 0
  float relief = 0.5f;    ///< how strongly threads stand out, in [0, 1]
  float sheen = 0.2f;  ///< strength of the light scattered by protruding fibres at grazing angles, in [0, 1]
  Vector3f sheen_color = {1, 1, 1};
  float translucency = 0.15f;               ///< fraction of the diffuse light that passes through, in [0, 1]
  std::optional<Vector3f> back_color = {};  ///< colour of the back; empty: the same as the front
};

enum class Wrap { repeat, mirror, clamp };

/// A texture of a material and its mapping.
struct TextureMap {
  int image = -1;  ///< index into Model::textures, -1: none
  int uv_set = 0;  ///< set of texture coordinates: 0 is Mesh::uvs, 1 is Mesh::second_uvs
  Wrap wrap_u = Wrap::repeat, wrap_v = Wrap::repeat;
  bool nearest = false;  ///< whether enlarged texels are squares instead of being interpolated
  bool mip_maps = true;  ///< whether minified texels are averaged
  /// Transform of the texture coordinates by rows: (u, v, 1) to the place in the image, v downwards.
  std::array<Vector3f, 2> rows = {Vector3f(1, 0, 0), Vector3f(0, 1, 0)};

  bool is_plain() const;  ///< whether the map uses the first set of coordinates without a transform
};

/// Metallic/roughness material, with the parameters of glTF 2.0 and some of its extensions.
struct Material {
  std::string name = {};
  Vector4f color = {0.8f, 0.8f, 0.8f, 1};  ///< base colour; alpha below 1 blends
  float metallic = 0;                      ///< in [0, 1]
  float roughness = 0.5f;                  ///< in [0, 1]
  Vector3f emission = Vector3f::Zero();    ///< radiance [arbitrary units, 1 = sunlit white]
  float transmission = 0;   ///< fraction of the light that enters the surface and passes through, in [0, 1]
  float refraction = 1.5f;  ///< index of refraction, in [1, 3]
  Pattern pattern = Pattern::none;
  Vector3f pattern_color = {0.4f, 0.4f, 0.4f};  ///< second colour of the pattern
  float pattern_scale = 1;                      ///< size of one cell [m], > 0
  bool two_sided = false;
  Fabric fabric = {};                  ///< used for cloths only
  TextureMap base_color_texture = {};  ///< sRGB colour and alpha, times `color`
  /// Whether `base_color_texture` is projected along the three axes of the mesh instead of being placed by
  /// texture coordinates. The projections are blended where the surface turns from one axis to the next, and
  /// one unit of the coordinates is a metre.
  bool triplanar = false;
  TextureMap metallic_roughness_texture = {};  ///< G: roughness, B: metallic, times the factors
  TextureMap emission_texture = {};            ///< sRGB, times `emission`
  TextureMap normal_texture = {};              ///< tangent space, X towards +u, Y towards -v of the image
  TextureMap occlusion_texture = {};           ///< R: fraction of the sky that is visible
  TextureMap transmission_texture = {};        ///< R, times `transmission`
  TextureMap specular_texture = {};            ///< sRGB, times `specular`; alpha: see `glossiness`
  float normal_scale = 1;                      ///< factor of the slope of `normal_texture`
  float occlusion_strength = 1;                ///< in [0, 1]
  /// Alpha mask: points with a smaller alpha are holes, and all others are opaque. 0: alpha blends.
  float alpha_cutoff = 0;
  bool unlit = false;          ///< whether the base colour is shown as it is, without light
  bool thin = false;           ///< whether the surface is a sheet that transmits and does not refract
  bool vertex_colors = false;  ///< whether Mesh::colors multiply the base colour
  bool vertex_alpha = false;   ///< whether some vertex colours are translucent
  /// Reflectance of a dielectric at perpendicular incidence: ((n - 1) / (n + 1))^2 for the index of
  /// refraction n.
  Vector3f specular = {0.04f, 0.04f, 0.04f};
  /// Alpha of `specular_texture` is the glossiness: roughness = 1 - glossiness * alpha. Negative: not used.
  float glossiness = -1;
  float clearcoat = 0;  ///< strength of a layer of lacquer, in [0, 1]
  float clearcoat_roughness = 0;
  Vector3f sheen_color = Vector3f::Zero();  ///< colour of light scattered at grazing angles, as by velvet

  /// Returns whether the material needs more than its first three textures, or a transform of texture
  /// coordinates.
  bool is_detailed() const;
};

/// Calls `each` for all textures of a material, in the order of the shader's texture units.
template <class M, class Each>
void for_each_texture(M& material, Each each) {
  each(material.base_color_texture);
  each(material.metallic_roughness_texture);
  each(material.emission_texture);
  each(material.normal_texture);
  each(material.occlusion_texture);
  each(material.transmission_texture);
  each(material.specular_texture);
}
inline constexpr int kTextureMaps = 7;  ///< number of calls of for_each_texture()

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
  /// An animation of the file that a body can play.
  struct Clip {
    std::string name;
    float duration = 0;  ///< [s]
  };
  std::vector<Clip> clips;
  ModelRig rig;  ///< the moving parts of the file, if they were requested
  /// The place of a camera or light in the file.
  struct Place {
    std::string name;  ///< name of the node, unique among cameras or lights
    int node = -1;     ///< index of the node in `rig`, if the rig was read; -1: none
    /// Transform in the rest pose; cameras and lights look along -z.
    Eigen::Matrix4f model_from_place = Eigen::Matrix4f::Identity();
  };
  struct Camera : Place {
    bool perspective = true;  ///< whether the projection is perspective; false: orthographic
    float fov_deg = 0;        ///< vertical
  };
  struct Light : Place {
    enum class Kind { directional, point, spot };
    Kind kind = Kind::point;
    Vector3f color = Vector3f::Ones();
    float intensity = 1;  ///< illuminance of a directional light [lx], or intensity of another light [cd]
    float inner_deg = 0, outer_deg = 45;  ///< half angles of a spot's cone: full light, no light
    float range_m = 0;                    ///< distance beyond which the light has no effect; 0: no limit
  };
  std::vector<Camera> cameras;
  std::vector<Light> lights;
  std::string unit;  ///< unit of length in the file, and how it was found, as text
  enum class UnitSource { stated, none, millimetres };
  UnitSource unit_source = UnitSource::none;  ///< `millimetres`: not stated, but usual (STL); read as metres
  /// Longest side of the box around the content of the whole file [m]; empty if only a node was read (see
  /// read_file_size()).
  std::optional<float> file_size;
  std::vector<std::string> warnings;  ///< repaired or ignored elements, one line each

  Eigen::AlignedBox3f bounds() const;
  std::size_t triangle_count() const;
  std::size_t vertex_count() const;
};

}  // namespace offstage::render
