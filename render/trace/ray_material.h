#pragma once
/// Private: materials as light rays see them. Primary surfaces are shaded by the shaders; what a ray meets
/// after them is shaded with the values from here.

#include <memory>
#include <span>

#include "render/model.h"

namespace offstage::render {

struct Hit;

class RayMaterial {
 public:
  /// Keeps a reduced copy of the colour texture.
  explicit RayMaterial(const Material& material, std::span<const Image> textures);

  Vector3f emission = {0, 0, 0};
  float metallic = 0, roughness = 0.5f;
  float transmission = 0;  ///< share of the light that is refracted
  float refraction = 1.5f;
  bool thin = false, unlit = false, vertex_colors = false;

  /// Colour and opacity at a point. `footprint`: width of what is averaged [m].
  Vector4f color(const Hit& hit, float footprint) const;
  /// Whether no light passes anywhere.
  bool is_opaque() const { return opaque_; }
  /// Share of the light that passes through the surface along a shadow ray.
  Vector3f transmittance(const Hit& hit, const Vector3f& direction) const;

 private:
  Vector4f texel(const Vector2f& uv) const;
  Vector4f triplanar_texel(const Vector3f& place, const Vector3f& normal) const;

  Vector4f color_;
  Vector3f pattern_color_, mean_color_;
  Pattern pattern_ = Pattern::none;
  float pattern_scale_ = 1;
  float alpha_cutoff_ = 0;
  bool opaque_ = true, triplanar_ = false;
  TextureMap map_;
  std::shared_ptr<const Image> texture_;
  Vector4f mean_texel_ = {1, 1, 1, 1};
};

}  // namespace offstage::render
