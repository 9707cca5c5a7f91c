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

RayMaterial::RayMaterial(const Material& material, std::span<const Image> textures)
    : emission(material.emission),
      metallic(material.metallic),
      roughness(material.roughness),
      transmission(material.transmission),
      refraction(std::max(material.refraction, 1.0f)),
      thin(material.thin),
      unlit(material.unlit),
      vertex_colors(material.vertex_colors),
      color_(material.color),
      pattern_(material.pattern),
      pattern_scale_(std::max(material.pattern_scale, 1e-4f)),
      alpha_cutoff_(material.alpha_cutoff),
      triplanar_(material.triplanar),
      map_(material.base_color_texture) {
  pattern_color_ = material.pattern_color;
  mean_color_ = pattern_color(pattern_, Vector3f::Zero(), Vector3f::UnitY(), 1e3f * pattern_scale_,
                              color_.head<3>(), pattern_color_, pattern_scale_);
  opaque_ = material.color.w() >= 1 && !material.vertex_alpha && transmission <= 0;
  if (map_.image < 0 || static_cast<std::size_t>(map_.image) >= textures.size()) return;
  const Image& image = textures[static_cast<std::size_t>(map_.image)];
  if (image.pixel_count() == 0) return;
  texture_ = std::make_shared<const Image>(reduced(image, kMostTexels));
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int y = 0; y < texture_->height_px; ++y)
    for (int x = 0; x < texture_->width_px; ++x) sum += linear_texel(*texture_, x, y).cast<double>();
  mean_texel_ = (sum / static_cast<double>(texture_->pixel_count())).cast<float>();
  opaque_ = opaque_ && mean_texel_.w() >= 1;
}

Vector4f RayMaterial::texel(const Vector2f& uv) const {
  if (!texture_) return {1, 1, 1, 1};
  const Vector3f place(uv.x(), uv.y(), 1);
  const float x = map_.rows[0].dot(place) * static_cast<float>(texture_->width_px) - 0.5f;
  const float y = map_.rows[1].dot(place) * static_cast<float>(texture_->height_px) - 0.5f;
  if (!(std::abs(x) < 1e8f && std::abs(y) < 1e8f)) return mean_texel_;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float s = x - static_cast<float>(x0), t = y - static_cast<float>(y0);
  const auto at = [&](int dx, int dy) {
    return linear_texel(*texture_, wrapped(x0 + dx, texture_->width_px, map_.wrap_u),
                        wrapped(y0 + dy, texture_->height_px, map_.wrap_v));
  };
  return (1 - t) * ((1 - s) * at(0, 0) + s * at(1, 0)) + t * ((1 - s) * at(0, 1) + s * at(1, 1));
}

// As triplanar_color() in shaders/mesh.frag.
Vector4f RayMaterial::triplanar_texel(const Vector3f& p, const Vector3f& n) const {
  const Vector3f weight = n.array().square().square();
  const Vector2f x(n.x() < 0 ? p.z() : -p.z(), -p.y()), y(n.y() < 0 ? -p.x() : p.x(), p.z()),
      z(n.z() < 0 ? -p.x() : p.x(), -p.y());
  return (weight.x() * texel(x) + weight.y() * texel(y) + weight.z() * texel(z)) /
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
  if (texture_)
    result = result.cwiseProduct(triplanar_ ? triplanar_texel(hit.object_position, hit.object_normal)
                                            : texel(hit.uv));
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
