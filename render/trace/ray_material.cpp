#include "render/trace/ray_material.h"

#include <algorithm>
#include <cmath>

#include "render/image.h"
#include "render/smooth_surface.h"
#include "render/tone_map.h"
#include "render/trace/ray_scene.h"

namespace offstage::render {
namespace {

constexpr float kMeanCells = 2;    // footprint, in cells of a pattern, from which on its mean is used
constexpr float kMeanThreads = 3;  // footprint, in threads, from which on their mean is used
constexpr int kMostTexels = 1024;  // width of the copy of a texture

const std::array<float, 256>& linear_values() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> values;
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = srgb_decode(static_cast<float>(i) / 255);
    return values;
  }();
  return table;
}

int wrapped(int k, int size, Wrap wrap) {
  if (wrap == Wrap::clamp) return std::clamp(k, 0, size - 1);
  const int period = wrap == Wrap::mirror ? 2 * size : size;
  k %= period;
  if (k < 0) k += period;
  return k < size ? k : period - 1 - k;
}

}  // namespace

RayMaterial::Texels::Texels(const TextureMap& texture_map, std::span<const Image> textures, Content meaning)
    : map(texture_map), content(meaning) {
  if (map.image < 0 || static_cast<std::size_t>(map.image) >= textures.size()) return;
  const Image& source = textures[static_cast<std::size_t>(map.image)];
  if (source.pixel_count() == 0) return;
  image = std::make_shared<const Image>(reduced(source, kMostTexels));
  map.nearest = map.nearest && image->width_px == source.width_px;
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  for (int y = 0; y < image->height_px; ++y)
    for (int x = 0; x < image->width_px; ++x) sum += texel(x, y).cast<double>();
  mean = (sum / static_cast<double>(image->pixel_count())).cast<float>();
}

Vector4f RayMaterial::Texels::texel(int x, int y) const {
  const uint8_t* pixel = image->rgba.data() + 4 * (static_cast<std::ptrdiff_t>(y) * image->width_px + x);
  if (content == Content::data) return Vector4f(pixel[0], pixel[1], pixel[2], pixel[3]) / 255;
  const std::array<float, 256>& table = linear_values();
  return {table[pixel[0]], table[pixel[1]], table[pixel[2]], static_cast<float>(pixel[3]) / 255};
}

Vector4f RayMaterial::Texels::at(const Vector2f& uv) const {
  if (!image) return mean;
  const Vector3f place(uv.x(), uv.y(), 1);
  const float shift = map.nearest ? 0.0f : 0.5f;
  const float x = map.rows[0].dot(place) * static_cast<float>(image->width_px) - shift;
  const float y = map.rows[1].dot(place) * static_cast<float>(image->height_px) - shift;
  if (!(std::abs(x) < 1e8f && std::abs(y) < 1e8f)) return mean;
  const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
  const float s = x - static_cast<float>(x0), t = y - static_cast<float>(y0);
  const auto texel_at = [&](int dx, int dy) {
    return texel(wrapped(x0 + dx, image->width_px, map.wrap_u),
                 wrapped(y0 + dy, image->height_px, map.wrap_v));
  };
  if (map.nearest) return texel_at(0, 0);
  return (1 - t) * ((1 - s) * texel_at(0, 0) + s * texel_at(1, 0)) +
         t * ((1 - s) * texel_at(0, 1) + s * texel_at(1, 1));
}

RayMaterial::RayMaterial(const Material& material, std::span<const Image> textures)
    : metallic(material.metallic),
      roughness(material.roughness),
      transmission(material.transmission),
      refraction(std::max(material.refraction, 1.0f)),
      translucency(material.fabric.translucency),
      thin(material.thin),
      unlit(material.unlit && material.is_detailed()),
      vertex_colors(material.vertex_colors && material.is_detailed()),
      hides_back(!material.two_sided && material.transmission <= 0),
      fabric_sheen(material.fabric.sheen * material.fabric.sheen_color),
      color_(material.color),
      emission_(material.emission),
      pattern_{material.pattern, material.color.head<3>(), material.pattern_color,
               std::max(material.pattern_scale, 1e-4f), material.roughness},
      fabric_(material.fabric),
      alpha_cutoff_(material.alpha_cutoff),
      triplanar_(material.triplanar),
      texels_(material.base_color_texture, textures, Content::color),
      glowing_texels_(material.emission.isZero() ? TextureMap{} : material.emission_texture, textures,
                      Content::color) {
  fabric_.thread = std::max(fabric_.thread, 1e-6f);
  mean_color_ = pattern_point(pattern_, Vector3f::Zero(), Vector3f::UnitY(), 1e3f * pattern_.scale, 0).color;
  mean_emission_ = emission_.cwiseProduct(glowing_texels_.mean.head<3>());
  opaque_ = material.color.w() >= 1 && !material.vertex_alpha && transmission <= 0 && texels_.mean.w() >= 1;
  const bool detailed = material.is_detailed();
  if (!detailed && material.metallic_roughness_texture.image < 0) return;
  // Materials without details have only the first three textures; see make_gpu_material().
  const auto data = [&](const TextureMap& map) {
    return Texels(detailed ? map : TextureMap{}, textures, Content::data);
  };
  Details details{.metallic_roughness = Texels(material.metallic_roughness_texture, textures, Content::data),
                  .normals = data(material.normal_texture),
                  .occlusion = data(material.occlusion_texture),
                  .transmission = data(material.transmission_texture),
                  .specular = {},
                  .reflectance = Vector3f::Constant(0.04f)};
  if (detailed) {
    clearcoat = material.clearcoat;
    clearcoat_roughness = material.clearcoat_roughness;
    sheen_color = material.sheen_color;
    details.specular = Texels(material.specular_texture, textures, Content::color);
    details.normal_scale = material.normal_scale;
    details.occlusion_strength = material.occlusion_strength;
    details.reflectance = material.specular;
    details.glossiness = material.glossiness;
  }
  details_ = std::make_shared<const Details>(std::move(details));
}

const TextureMap* RayMaterial::normal_map() const {
  return details_ && details_->normals.image ? &details_->normals.map : nullptr;
}

Vector3f RayMaterial::emission_at(const std::array<Vector2f, 2>& uvs) const {
  return emission_.cwiseProduct(glowing_texels_.at(uvs).head<3>());
}

// Equal to triplanar_color() in shaders/mesh.frag.
Vector4f RayMaterial::triplanar_texel(const Vector3f& p, const Vector3f& n) const {
  const Vector3f weight = n.array().square().square();
  const Vector2f x(n.x() < 0 ? p.z() : -p.z(), -p.y()), y(n.y() < 0 ? -p.x() : p.x(), p.z()),
      z(n.z() < 0 ? -p.x() : p.x(), -p.y());
  return (weight.x() * texels_.at(x) + weight.y() * texels_.at(y) + weight.z() * texels_.at(z)) /
         std::max(weight.sum(), 1e-12f);
}

// Multiplies a colour by those of the vertices and the texture, and adds the opacity.
Vector4f RayMaterial::textured(const Vector3f& color, const Hit& hit) const {
  Vector4f result;
  result << color, color_.w();
  result = result.cwiseProduct(hit.color);
  if (texels_.image)
    result = result.cwiseProduct(triplanar_ ? triplanar_texel(hit.object_position, hit.object_normal)
                                            : texels_.at(hit.uvs));
  if (alpha_cutoff_ > 0) result.w() = result.w() < alpha_cutoff_ ? 0.0f : 1.0f;
  return result;
}

// As main() in shaders/cloth.frag. `shade`: of the threads. Light that the cloth transmits has a more
// saturated colour, because it has travelled farther in it.
void RayMaterial::add_fabric(const Hit& hit, float shade, RaySurface& surface) const {
  surface.transmitted = surface.color.head<3>();
  if (const std::optional<Vector3f>& back = fabric_.back_color) {
    surface.transmitted = surface.transmitted.cwiseProduct(*back).cwiseSqrt();
    if (!hit.front) surface.color.head<3>() = *back;
  }
  surface.color.head<3>() *= shade;
  const Vector3f albedo = surface.color.head<3>();
  surface.transmitted = surface.transmitted.cwiseProduct(albedo / std::max(albedo.maxCoeff(), 1e-3f));
}

Vector4f RayMaterial::color(const Hit& hit, float footprint) const {
  if (!has_pattern()) return textured(color_.head<3>(), hit);
  if (footprint > kMeanCells * pattern_.scale) return textured(mean_color_, hit);
  return textured(pattern_point(pattern_, hit.object_position, hit.object_normal, footprint, hit.time).color,
                  hit);
}

RaySurface RayMaterial::surface(Hit& hit, float footprint, bool relief) const {
  RaySurface result{.metallic = metallic, .roughness = roughness, .transmission = transmission};
  Vector3f slope = Vector3f::Zero();
  if (relief && has_pattern() && footprint <= kMeanCells * pattern_.scale) {
    const PatternPoint point =
        pattern_point(pattern_, hit.object_position, hit.object_normal, footprint, hit.time);
    result.color = textured(point.color, hit);
    result.roughness = std::clamp(roughness * point.roughness, 0.0f, 1.0f);
    slope = point.slope;
  } else {
    result.color = color(hit, footprint);
  }
  if (hit.is_cloth) {
    ThreadPoint threads;
    if (relief && has_threads() && footprint <= kMeanThreads * fabric_.thread)
      threads = thread_point(fabric_, hit.object_position.head<2>(),
                             footprint / std::max(-hit.face.dot(hit.direction), 0.1f));
    add_fabric(hit, threads.shade, result);
    slope.head<2>() += threads.slope;
  } else if (details_) {
    add_details(hit, result);
  }
  hit.smooth_normal = hit.lamp_normal = hit.normal;
  if (relief && (has_relief() || !slope.isZero())) add_relief(slope, hit);
  return result;
}

// Adds the details in the same way as main() in shaders/mesh.frag.
void RayMaterial::add_details(const Hit& hit, RaySurface& surface) const {
  const Details& details = *details_;
  if (details.metallic_roughness.image) {
    const Vector4f texel = details.metallic_roughness.at(hit.uvs);
    surface.roughness *= texel.y();
    surface.metallic *= texel.z();
  }
  surface.reflectance = details.reflectance;
  float glossiness = details.glossiness;
  if (details.specular.image) {
    const Vector4f texel = details.specular.at(hit.uvs);
    surface.reflectance = surface.reflectance.cwiseProduct(texel.head<3>());
    glossiness *= texel.w();
  }
  if (details.glossiness >= 0) {
    surface.color.head<3>() *= 1 - surface.reflectance.maxCoeff();
    surface.roughness = 1 - glossiness;
  }
  if (details.occlusion.image)
    surface.occlusion = 1 + details.occlusion_strength * (details.occlusion.at(hit.uvs).x() - 1);
  if (details.transmission.image) surface.transmission *= details.transmission.at(hit.uvs).x();
}

// Tilts the normal by the slope of a pattern or of threads, or by the normal map, as main() and
// mapped_normal() in shaders/mesh.frag, and main() in shaders/cloth.frag.
void RayMaterial::add_relief(const Vector3f& slope, Hit& hit) const {
  Vector3f normal = hit.normal;
  if (normal_map() != nullptr) {
    const Vector3f texel = 2 * details_->normals.at(hit.uvs).head<3>() - Vector3f::Ones();
    const Vector3f tilt = texel.x() * hit.along_u + texel.y() * hit.against_v;
    normal = (hit.front ? details_->normal_scale : -details_->normal_scale) * tilt +
             std::max(texel.z(), 0.01f) * normal;
  } else if (hit.is_cloth) {
    normal -= (hit.front ? 1.0f : -1.0f) * (slope.x() * hit.along_u - slope.y() * hit.against_v);
  } else if (hit.world_from_object != nullptr) {
    normal -= hit.world_from_object->linear().colwise().normalized() * slope;
  }
  hit.normal = normal.normalized();
  hit.turn_normal_to(-hit.direction);
  // The pass of surfaces, see MeshPass::surface_program(), draws the relief of patterns only on smooth
  // materials.
  if (normal_map() != nullptr || (is_smooth(roughness, metallic) && !hit.is_cloth))
    hit.lamp_normal = hit.normal;
}

bool RayMaterial::is_tinted() const {
  constexpr float kGrey = 0.8f;  // least ratio of two channels
  const Vector3f mean = mean_color_.cwiseProduct(texels_.mean.head<3>());
  return vertex_colors || mean.minCoeff() < kGrey * mean.maxCoeff();
}

Vector3f RayMaterial::transmittance(const Hit& hit, const Vector3f& direction) const {
  const Vector4f value = color(hit, 0);
  float transmitted = transmission;
  if (details_ && details_->transmission.image) transmitted *= details_->transmission.at(hit.uvs).x();
  const float cosine = std::max(std::abs(hit.face.dot(direction)), 0.02f);
  const float m = 1 - cosine, fresnel = 0.04f + 0.96f * m * m * m * m * m;
  // As in enter(): a solid piece applies the square root of its colour at each of two surfaces.
  const Vector3f tint = value.head<3>().cwiseMax(0);
  const Vector3f glass = (1 - fresnel) * transmitted * (thin ? tint : Vector3f(tint.cwiseSqrt()));
  return Vector3f::Constant(1 - value.w()) + value.w() * glass;
}

}  // namespace offstage::render
