#include "producer/export/gltf_looks.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "render/image_io.h"

namespace offstage::producer {
namespace {

using Json = GltfLooks::Json;
using Eigen::Vector3f;

Json numbers(const auto& vector) {
  Json result = Json::array();
  for (const float number : vector) result.push_back(number);
  return result;
}

Json sampler_of(const render::TextureMap& map) {
  constexpr int kClamp = 33071, kMirror = 33648, kRepeat = 10497;
  constexpr int kNearest = 9728, kLinear = 9729, kLinearMipLinear = 9987;
  const auto code = [](render::Wrap wrap) {
    return wrap == render::Wrap::clamp ? kClamp : wrap == render::Wrap::mirror ? kMirror : kRepeat;
  };
  const int enlarged = map.nearest ? kNearest : kLinear;
  return {{"magFilter", enlarged},
          {"minFilter", map.mip_maps ? kLinearMipLinear : enlarged},
          {"wrapS", code(map.wrap_u)},
          {"wrapT", code(map.wrap_v)}};
}

/// Returns for each material the least side of the largest box around one of its meshes [m].
std::vector<float> thicknesses(const FilmParts& parts) {
  std::vector<float> result(parts.materials.size(), 0);
  const auto add = [&](std::size_t mesh, std::size_t material) {
    result[material] = std::max(result[material], parts.meshes[mesh].bounds().sizes().minCoeff());
  };
  for (const FilmBody& body : parts.bodies)
    for (const FilmPart& part : body.parts) add(part.mesh, part.material);
  for (const FilmRod& rod : parts.rods) add(rod.mesh, rod.material);
  return result;
}

}  // namespace

void GltfLooks::write() {
  const std::vector<float> thickness = thicknesses(parts_);
  for (std::size_t i = 0; i < parts_.materials.size(); ++i)
    materials.push_back(material(parts_.materials[i], thickness[i]));
}

Json GltfLooks::material(const FilmMaterial& source, float thickness) {
  const render::Material& look = source.look;
  Json out = {{"name", source.name}};
  add_alpha(look, out);
  if (look.two_sided) out["doubleSided"] = true;
  add_surface(look, out);
  add_specular(look, out);
  add_emission(look, out);
  add_relief(look, out);
  if (look.transmission > 0) add_transmission(look, thickness, out);
  add_layers(look, out);
  return out;
}

void GltfLooks::add_alpha(const render::Material& look, Json& out) const {
  if (look.alpha_cutoff > 0) {
    out["alphaMode"] = "MASK";
    out["alphaCutoff"] = look.alpha_cutoff;
    return;
  }
  const bool blends = look.color.w() < 1 || (look.vertex_colors && look.vertex_alpha) ||
                      parts_.has_alpha(look.base_color_texture);
  if (blends) out["alphaMode"] = "BLEND";
}

void GltfLooks::add_surface(const render::Material& look, Json& out) {
  Json pbr = {{"baseColorFactor", numbers(look.color)},
              {"metallicFactor", look.metallic},
              {"roughnessFactor", look.roughness}};
  add_texture(pbr, "baseColorTexture", look, look.base_color_texture);
  add_texture(pbr, "metallicRoughnessTexture", look, look.metallic_roughness_texture);
  out["pbrMetallicRoughness"] = std::move(pbr);
}

void GltfLooks::add_specular(const render::Material& look, Json& out) {
  if (look.glossiness >= 0) {
    Json glossy = {{"diffuseFactor", numbers(look.color)},
                   {"specularFactor", numbers(look.specular)},
                   {"glossinessFactor", look.glossiness}};
    add_texture(glossy, "diffuseTexture", look, look.base_color_texture);
    add_texture(glossy, "specularGlossinessTexture", look, look.specular_texture);
    return extend(out, "KHR_materials_pbrSpecularGlossiness", std::move(glossy));
  }
  constexpr float kUsualIndex = 1.5f, kTolerance = 1e-5f;
  if (look.refraction != kUsualIndex) extend(out, "KHR_materials_ior", {{"ior", look.refraction}});
  const float of_index = std::pow((look.refraction - 1) / (look.refraction + 1), 2.f);
  const bool has_texture = look.specular_texture.image >= 0;
  const bool follows = (look.specular - Vector3f::Constant(of_index)).cwiseAbs().maxCoeff() < kTolerance;
  if ((follows && !has_texture) || of_index < kTolerance) return;
  Json specular = {{"specularColorFactor", numbers(Vector3f(look.specular / of_index))}};
  add_texture(specular, "specularColorTexture", look, look.specular_texture);
  extend(out, "KHR_materials_specular", std::move(specular));
}

void GltfLooks::add_emission(const render::Material& look, Json& out) {
  const float glow = look.emission.maxCoeff();
  if (glow <= 0) return;
  out["emissiveFactor"] = numbers(Vector3f(look.emission / std::max(glow, 1.f)));
  add_texture(out, "emissiveTexture", look, look.emission_texture);
  if (glow > 1) extend(out, "KHR_materials_emissive_strength", {{"emissiveStrength", glow}});
}

void GltfLooks::add_relief(const render::Material& look, Json& out) {
  if (look.normal_texture.image >= 0) {
    out["normalTexture"] = texture_info(look, look.normal_texture);
    out["normalTexture"]["scale"] = look.normal_scale;
  }
  if (look.occlusion_texture.image >= 0) {
    out["occlusionTexture"] = texture_info(look, look.occlusion_texture);
    out["occlusionTexture"]["strength"] = look.occlusion_strength;
  }
}

void GltfLooks::add_transmission(const render::Material& look, float thickness, Json& out) {
  Json transmission = {{"transmissionFactor", look.transmission}};
  add_texture(transmission, "transmissionTexture", look, look.transmission_texture);
  extend(out, "KHR_materials_transmission", std::move(transmission));
  if (look.thin) return;
  // A material without a volume is a thin sheet that does not refract. The colour of the surface tints the
  // light, so the volume itself absorbs nothing. A thickness of 0 would mean a sheet, too.
  constexpr float kLeast = 1e-4f;
  extend(out, "KHR_materials_volume", {{"thicknessFactor", std::max(thickness, kLeast)}});
}

void GltfLooks::add_layers(const render::Material& look, Json& out) {
  if (look.unlit) extend(out, "KHR_materials_unlit", Json::object());
  if (look.clearcoat > 0)
    extend(out, "KHR_materials_clearcoat",
           {{"clearcoatFactor", look.clearcoat}, {"clearcoatRoughnessFactor", look.clearcoat_roughness}});
  constexpr float kSheenRoughness = 0.5f;  // the renderer has one lobe of sheen
  if (look.sheen_color.maxCoeff() > 0)
    extend(out, "KHR_materials_sheen",
           {{"sheenColorFactor", numbers(look.sheen_color)}, {"sheenRoughnessFactor", kSheenRoughness}});
}

void GltfLooks::extend(Json& owner, const std::string& name, Json content) {
  owner["extensions"][name] = std::move(content);
  used.insert(name);
}

void GltfLooks::add_texture(Json& owner, const char* key, const render::Material& look,
                            const render::TextureMap& map) {
  if (map.image >= 0) owner[key] = texture_info(look, map);
}

Json GltfLooks::texture_info(const render::Material& look, const render::TextureMap& map) {
  const auto [image, new_image] = images_done_.try_emplace(map.image, images.size());
  if (new_image)
    images.push_back({{"bufferView", buffer_.add_view(render::encode_png(*parts_.texture(map)))},
                      {"mimeType", "image/png"}});
  Json sampler = sampler_of(map);
  const auto [its_sampler, new_sampler] = samplers_done_.try_emplace(sampler.dump(), samplers.size());
  if (new_sampler) samplers.push_back(std::move(sampler));
  const auto [texture, new_texture] =
      textures_done_.try_emplace({image->second, its_sampler->second}, textures.size());
  if (new_texture) textures.push_back({{"sampler", its_sampler->second}, {"source", image->second}});

  Json info = {{"index", texture->second}};
  if (map.uv_set != 0) info["texCoord"] = map.uv_set;
  const UvTransform transform = uv_transform(look, map);
  if (!transform.is_identity())
    extend(info, "KHR_texture_transform",
           {{"offset", {transform.offset.x(), transform.offset.y()}},
            {"rotation", transform.angle},
            {"scale", {transform.scale.x(), transform.scale.y()}}});
  return info;
}

}  // namespace offstage::producer
