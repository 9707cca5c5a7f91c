#pragma once
/// Private: materials for ray tracing. Shaders shade the visible surfaces; these materials are for surfaces
/// that rays hit.

#include <memory>
#include <span>

#include "render/model.h"

namespace offstage::render {

struct Hit;

class RayMaterial {
 public:
  /// Copies the textures of colour and emission at a reduced size.
  explicit RayMaterial(const Material& material, std::span<const Image> textures);

  float metallic = 0, roughness = 0.5f;
  float transmission = 0;  ///< fraction of the light that is refracted
  float refraction = 1.5f;
  float translucency = 0;  ///< cloth: fraction of the scattered light that leaves on the other side
  bool thin = false, unlit = false, vertex_colors = false;

  /// Returns the linear colour and the opacity (w) at a point. `footprint`: width of the averaged area [m].
  Vector4f color(const Hit& hit, float footprint) const;
  /// Returns the radiance that the surface emits at these texture coordinates.
  Vector3f emission_at(const Vector2f& uv) const;
  /// Returns the mean of the emitted radiance over the texture.
  const Vector3f& mean_emission() const { return mean_emission_; }
  /// Returns whether the whole surface blocks light.
  bool is_opaque() const { return opaque_; }
  /// Returns the fraction of the light that passes the surface along a shadow ray, per channel.
  Vector3f transmittance(const Hit& hit, const Vector3f& direction) const;

 private:
  /// A reduced copy of a texture.
  struct Texels {
    std::shared_ptr<const Image> image;  ///< pixels of the texture; null: white
    TextureMap map;
    Vector4f mean = {1, 1, 1, 1};

    Texels(const TextureMap& texture_map, std::span<const Image> textures);
    Vector4f at(const Vector2f& uv) const;
  };
  Vector4f triplanar_texel(const Vector3f& place, const Vector3f& normal) const;

  Vector4f color_;
  Vector3f emission_, mean_emission_;
  Vector3f pattern_color_, mean_color_;
  Pattern pattern_ = Pattern::none;
  float pattern_scale_ = 1;
  float alpha_cutoff_ = 0;
  bool opaque_ = true, triplanar_ = false;
  Texels texels_, glowing_texels_;
};

}  // namespace offstage::render
