#include "render/trace/ray_material.h"

#include <algorithm>
#include <cmath>

#include "render/image.h"
#include "render/tone_map.h"
#include "render/trace/patterns.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {
namespace {

constexpr float kMeanCells = 2;    // footprint, in cells of a pattern, from which on its mean is used
constexpr int kMostTexels = 1024;  // width of the copy of a texture

const std::array<float, 256>& linear_values() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> values;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = srgb_decode(static_cast<float>(i) / 255);
    return values;
  }();
  return table;
}

Vector4f linear_texel(const Image& image, int x, int y) {
  const uint8_t* pixel = image.rgba.data() + 4 * (static_cast<std::ptrdiff_t>(y) * image.width_px + x);
  const std::array<float, 256>& table = linear_values();
  return {table[pixel[0]], table[pixel[1]], table[pixel[2]], static_cast<float>(pixel[3]) / 255};
}

int wrapped(int k, int size, Wrap wrap) {
  if (wrap == Wrap::clamp) return std::clamp(k, 0, size - 1);
  const int period = wrap == Wrap::mirror ? 2 * size : size;
  k %= period;
  if (k < 0) k += period;
  return k < size ? k : period - 1 - k;
}

}  // namespace

RayMaterial::Texels::Texels(const TextureMap& texture_map, std::span<const Image> textures)
    : map(texture_map) {
  if (map.image < 0 || static_cast<std::size_t>(map.image) >= textures.size()) return;
  const Image& source = textures[static_cast<std::size_t>(map.image)];
  if (source.pixel_count() == 0) return;
  image = std::make_shared<const Image>(reduced(source, kMostTexels));
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int y = 0; y < image->height_px; ++y)
    for (int x = 0; x < image->width_px; ++x) sum += linear_texel(*image, x, y).cast<double>();
  mean = (sum / static_cast<double>(image->pixel_count())).cast<float>();
}

Vector4f RayMaterial::Texels::at(const Vector2f& uv) const {
  if (!image) return mean;
  const Vector3f place(uv.x(), uv.y(), 1);
  const float x = map.rows[0].dot(place) * static_cast<float>(image->width_px) - 0.5f;
  const float y = map.rows[1].dot(place) * static_cast<float>(image->height_px) - 0.5f;
  if (!(std::abs(x) < 1e8f && std::abs(y) < 1e8f)) return mean;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float s = x - static_cast<float>(x0), t = y - static_cast<float>(y0);
  const auto texel = [&](int dx, int dy) {
    return linear_texel(*image, wrapped(x0 + dx, image->width_px, map.wrap_u),
                        wrapped(y0 + dy, image->height_px, map.wrap_v));
  };
  return (1 - t) * ((1 - s) * texel(0, 0) + s * texel(1, 0)) + t * ((1 - s) * texel(0, 1) + s * texel(1, 1));
}

RayMaterial::RayMaterial(const Material& material, std::span<const Image> textures)
    : metallic(material.metallic),
      roughness(material.roughness),
      transmission(material.transmission),
      refraction(std::max(material.refraction, 1.0f)),
      translucency(material.fabric.translucency),
      thin(material.thin),
      unlit(material.unlit),
      vertex_colors(material.vertex_colors),
      color_(material.color),
      emission_(material.emission),
      pattern_(material.pattern),
      pattern_scale_(std::max(material.pattern_scale, 1e-4f)),
      alpha_cutoff_(material.alpha_cutoff),
      triplanar_(material.triplanar),
      texels_(material.base_color_texture, textures),
      glowing_texels_(material.emission.isZero() ? TextureMap{} : material.emission_texture, textures) {
  pattern_color_ = material.pattern_color;
  mean_color_ = pattern_color(pattern_, Vector3f::Zero(), Vector3f::UnitY(), 1e3f * pattern_scale_,
                              color_.head<3>(), pattern_color_, pattern_scale_);
  mean_emission_ = emission_.cwiseProduct(glowing_texels_.mean.head<3>());
  opaque_ = material.color.w() >= 1 && !material.vertex_alpha && transmission <= 0 && texels_.mean.w() >= 1;
}

Vector3f RayMaterial::emission_at(const Vector2f& uv) const {
  return emission_.cwiseProduct(glowing_texels_.at(uv).head<3>());
}

// Equal to triplanar_color() in shaders/mesh.frag.
Vector4f RayMaterial::triplanar_texel(const Vector3f& p, const Vector3f& n) const {
  const Vector3f weight = n.array().square().square();
  const Vector2f x(n.x() < 0 ? p.z() : -p.z(), -p.y()), y(n.y() < 0 ? -p.x() : p.x(), p.z()),
      z(n.z() < 0 ? -p.x() : p.x(), -p.y());
  return (weight.x() * texels_.at(x) + weight.y() * texels_.at(y) + weight.z() * texels_.at(z)) /
         std::max(weight.sum(), 1e-12f);
}

Vector4f RayMaterial::color(const Hit& hit, float footprint) const {
  Vector4f result = color_;
  if (pattern_ != Pattern::none)
    result.head<3>() = footprint > kMeanCells * pattern_scale_
                           ? mean_color_
                           : pattern_color(pattern_, hit.object_position, hit.object_normal, footprint,
                                           color_.head<3>(), pattern_color_, pattern_scale_);
  result = result.cwiseProduct(hit.color);
  if (texels_.image)
    result = result.cwiseProduct(triplanar_ ? triplanar_texel(hit.object_position, hit.object_normal)
                                            : texels_.at(hit.uv));
  if (alpha_cutoff_ > 0) result.w() = result.w() < alpha_cutoff_ ? 0.0f : 1.0f;
  return result;
}

Vector3f RayMaterial::transmittance(const Hit& hit, const Vector3f& direction) const {
  const Vector4f value = color(hit, 0);
  const float cosine = std::max(std::abs(hit.face.dot(direction)), 0.02f);
  const float m = 1 - cosine, fresnel = 0.04f + 0.96f * m * m * m * m * m;
  const Vector3f glass = (1 - fresnel) * transmission * value.head<3>().cwiseMax(0);
  return Vector3f::Constant(1 - value.w()) + value.w() * glass;
}

}  // namespace offstage::render
