#pragma once
/// Private: materials for ray tracing. Shaders shade the visible surfaces; these materials are for surfaces
/// that rays hit.

#include <array>
#include <memory>
#include <span>

#include "render/model.h"
#include "render/trace/patterns.h"

namespace offstage::render {

struct Hit;

/// A material at a point that a ray hits.
struct RaySurface {
  Vector4f color = {1, 1, 1, 1};  ///< linear base colour; w: opacity
  float metallic = 0, roughness = 0.5f;
  float transmission = 0;  ///< fraction of the light that is refracted
  float occlusion = 1;     ///< fraction of the indirect light that the occlusion map leaves
  Vector3f reflectance = Vector3f::Constant(0.04f);  ///< of a dielectric at perpendicular incidence
  Vector3f transmitted =
      Vector3f::Zero();  ///< cloth: colour of the light that is scattered to the other side
};

class RayMaterial {
 public:
  /// Copies the textures at a reduced size.
  explicit RayMaterial(const Material& material, std::span<const Image> textures);

  float metallic = 0, roughness = 0.5f;  ///< factors of the textures
  float transmission = 0;                ///< fraction of the light that is refracted, without its texture
  float refraction = 1.5f;
  float translucency = 0;  ///< cloth: fraction of the scattered light that leaves on the other side
  bool thin = false, unlit = false, vertex_colors = false;
  bool hides_back = false;                       ///< whether pictures do not show the back of the surface
  float clearcoat = 0, clearcoat_roughness = 0;  ///< see Material
  Vector3f sheen_color = Vector3f::Zero();
  Vector3f fabric_sheen = Vector3f::Zero();  ///< cloth: colour of the sheen

  /// Returns the linear colour and the opacity (w) at a point. `footprint`: width of the averaged area [m].
  Vector4f color(const Hit& hit, float footprint) const;
  /// Returns the material at a point. With `relief`, the relief of the surface tilts hit.normal.
  RaySurface surface(Hit& hit, float footprint, bool relief) const;
  /// Returns the texture of the normal map; null if there is none.
  const TextureMap* normal_map() const;
  /// Returns whether the surface has a normal map or the relief of a pattern.
  bool has_relief() const { return has_pattern() || normal_map() != nullptr; }
  /// Returns whether a cloth of this material has threads.
  bool has_threads() const { return fabric_.weave != Weave::none && fabric_.relief > 0; }
  /// Returns the radiance that the surface emits. `uvs`: both sets of texture coordinates of the point.
  Vector3f emission_at(const std::array<Vector2f, 2>& uvs) const;
  /// Returns the mean of the emitted radiance over the texture.
  const Vector3f& mean_emission() const { return mean_emission_; }
  /// Returns whether the colour of the surface differs from grey by more than a tenth or so.
  bool is_tinted() const;
  /// Returns whether the whole surface blocks light.
  bool is_opaque() const { return opaque_; }
  /// Returns the fraction of the light that passes the surface along a shadow ray, per channel.
  Vector3f transmittance(const Hit& hit, const Vector3f& direction) const;

 private:
  enum class Content { color, data };  ///< whether the texels are sRGB colours or linear values
  /// A reduced copy of a texture.
  struct Texels {
    std::shared_ptr<const Image> image;  ///< pixels of the texture; null: white
    TextureMap map;
    Content content = Content::color;
    Vector4f mean = {1, 1, 1, 1};

    Texels() = default;
    Texels(const TextureMap& texture_map, std::span<const Image> textures, Content content);
    Vector4f at(const Vector2f& uv) const;
    Vector4f at(const std::array<Vector2f, 2>& uvs) const { return at(uvs[map.uv_set == 1]); }

   private:
    Vector4f texel(int x, int y) const;
  };
  /// The properties of a material that only few materials have.
  struct Details {
    Texels metallic_roughness, normals, occlusion, transmission, specular;
    float normal_scale = 1, occlusion_strength = 1;
    Vector3f reflectance;
    float glossiness = -1;
  };
  bool has_pattern() const { return pattern_.pattern != Pattern::none; }
  Vector4f triplanar_texel(const Vector3f& place, const Vector3f& normal) const;
  Vector4f textured(const Vector3f& color, const Hit& hit) const;
  void add_fabric(const Hit& hit, float shade, RaySurface& surface) const;
  void add_details(const Hit& hit, RaySurface& surface) const;
  void add_relief(const Vector3f& slope, Hit& hit) const;

  Vector4f color_;
  Vector3f emission_, mean_emission_;
  PatternDef pattern_;
  Vector3f mean_color_;
  Fabric fabric_;
  float alpha_cutoff_ = 0;
  bool opaque_ = true, triplanar_ = false;
  Texels texels_, glowing_texels_;
  std::shared_ptr<const Details> details_;  ///< null: the material has no details
};

}  // namespace offstage::render
