#include "render/gltf_material.h"

#include <algorithm>
#include <cmath>

#include "render/error.h"
#include "render/file_io.h"
#include "render/gltf_packed.h"
#include "render/image_io.h"
#include "render/thin_film.h"

namespace offstage::render {
namespace {

constexpr int kNearest = 9728, kLinear = 9729, kNearestMipNearest = 9984, kNearestMipLinear = 9986;
constexpr int kClamp = 33071, kMirror = 33648;
constexpr double kBrightestEmission = 1e4;

float fraction(double value) {
  return static_cast<float>(std::clamp(value, 0.0, 1.0));
}

Vector3f color_of(const GltfValue& source, const char* key, double missing, double most = 1) {
  const Eigen::Vector3d color = source.numbers<3>(key, Eigen::Vector3d::Constant(missing));
  return color.cwiseMax(0).cwiseMin(most).cast<float>();
}

/// Gives the default look of offstage to a material without properties. By the defaults of the format, an
/// unnamed white material would be rough metal.
void give_usual_look(Material& look) {
  look.color = Material{}.color;
  if (look.metallic != 1 || look.roughness != 1) return;
  look.metallic = 0;
  look.roughness = Material{}.roughness;
}

/// KHR_texture_transform: scale, then rotation (positive turns the image clockwise), then offset.
void transform_uvs(const GltfValue& transform, TextureMap& map) {
  constexpr double kMost = 1e6;  // greatest value with which the sums in the shader stay finite
  const auto pair = [&](const char* key, double missing) {
    return transform.numbers<2>(key, Eigen::Vector2d::Constant(missing))
        .cwiseMax(-kMost)
        .cwiseMin(kMost)
        .eval();
  };
  const Eigen::Vector2d offset = pair("offset", 0), scale = pair("scale", 1);
  const double angle = transform.number("rotation", 0), c = std::cos(angle), s = std::sin(angle);
  map.rows[0] = Eigen::Vector3d(c * scale.x(), s * scale.y(), offset.x()).cast<float>();
  map.rows[1] = Eigen::Vector3d(-s * scale.x(), c * scale.y(), offset.y()).cast<float>();
}

}  // namespace

void GltfMaterials::read() {
  for (std::size_t i = 0; i < file_.count("materials"); ++i) {
    GltfUvSets sets = {-1, -1};
    model_.materials.push_back(material(file_.item("materials", i), sets));
    uv_sets_.push_back(sets);
  }
  model_.materials.emplace_back();
  uv_sets_.push_back({0, -1});
}

Material GltfMaterials::material(const GltfValue& source, GltfUvSets& sets) {
  Material look;
  look.name = source.text("name");
  look.two_sided = source.flag("doubleSided");
  read_alpha(source, look);
  if (source.extension("KHR_materials_pbrSpecularGlossiness").exists())
    read_glossiness(source, look, sets);
  else
    read_metallic(source, look, sets);
  if (source.text("alphaMode", "OPAQUE") != "BLEND" && look.alpha_cutoff == 0) look.color.w() = 1;
  if (look.name.empty() && !source.has("pbrMetallicRoughness") && !source.has("extensions"))
    give_usual_look(look);

  const double strength = source.extension("KHR_materials_emissive_strength").number("emissiveStrength", 1);
  look.emission = color_of(source, "emissiveFactor", 0) *
                  static_cast<float>(std::clamp(strength, 0.0, kBrightestEmission));
  look.emission_texture = map(source, "emissiveTexture", Alpha::drop, sets);
  look.normal_texture = map(source, "normalTexture", Alpha::drop, sets);
  look.normal_scale =
      static_cast<float>(std::clamp(source.child("normalTexture").number("scale", 1), -1e3, 1e3));
  look.occlusion_texture = map(source, "occlusionTexture", Alpha::drop, sets);
  look.occlusion_strength = fraction(source.child("occlusionTexture").number("strength", 1));
  look.unlit = source.extension("KHR_materials_unlit").exists();
  read_transmission(source, look, sets);
  read_layers(source, look, sets);
  read_iridescence(source, look);
  if (sets[0] < 0) sets[0] = 0;
  return look;
}

void GltfMaterials::read_alpha(const GltfValue& source, Material& look) {
  const std::string mode = source.text("alphaMode", "OPAQUE");
  if (mode == "MASK")
    look.alpha_cutoff = static_cast<float>(std::max(source.number("alphaCutoff", 0.5), 0.0));
  else if (mode != "OPAQUE" && mode != "BLEND")
    file_.warn(source.place() + ": alphaMode '" + one_line(mode.substr(0, 20)) +
               "' is unknown; drawn opaque");
}

void GltfMaterials::read_metallic(const GltfValue& source, Material& look, GltfUvSets& sets) {
  const GltfValue pbr = source.child("pbrMetallicRoughness");
  look.color =
      pbr.numbers<4>("baseColorFactor", Eigen::Vector4d::Ones()).cwiseMax(0).cwiseMin(1).cast<float>();
  look.metallic = fraction(pbr.number("metallicFactor", 1));
  look.roughness = fraction(pbr.number("roughnessFactor", 1));
  const bool uses_alpha = look.alpha_cutoff > 0 || source.text("alphaMode", "OPAQUE") == "BLEND";
  look.base_color_texture = map(pbr, "baseColorTexture", uses_alpha ? Alpha::keep : Alpha::drop, sets);
  look.metallic_roughness_texture = map(pbr, "metallicRoughnessTexture", Alpha::drop, sets);
}

/// KHR_materials_pbrSpecularGlossiness. The shader takes the specular colour from the diffuse one.
void GltfMaterials::read_glossiness(const GltfValue& source, Material& look, GltfUvSets& sets) {
  const GltfValue pbr = source.extension("KHR_materials_pbrSpecularGlossiness");
  look.color = pbr.numbers<4>("diffuseFactor", Eigen::Vector4d::Ones()).cwiseMax(0).cwiseMin(1).cast<float>();
  look.metallic = 0;
  look.specular = color_of(pbr, "specularFactor", 1);
  look.glossiness = fraction(pbr.number("glossinessFactor", 1));
  look.roughness = 1 - look.glossiness;
  const bool uses_alpha = look.alpha_cutoff > 0 || source.text("alphaMode", "OPAQUE") == "BLEND";
  look.base_color_texture = map(pbr, "diffuseTexture", uses_alpha ? Alpha::keep : Alpha::drop, sets);
  look.specular_texture = map(pbr, "specularGlossinessTexture", Alpha::keep, sets);
}

void GltfMaterials::read_transmission(const GltfValue& source, Material& look, GltfUvSets& sets) {
  const GltfValue index = source.extension("KHR_materials_ior"),
                  volume = source.extension("KHR_materials_volume");
  const GltfValue transmission = source.extension("KHR_materials_transmission");
  if (index.exists() && look.glossiness < 0) {
    const double n = index.number("ior", 1.5);
    const double f0 = n == 0 ? 1 : std::pow((n - 1) / (n + 1), 2);  // an index of 0 stands for infinity
    look.specular = Vector3f::Constant(fraction(f0));
    look.refraction = static_cast<float>(n == 0 ? 3 : std::clamp(n, 1.0, 3.0));
  }
  look.transmission = fraction(transmission.number("transmissionFactor", 0));
  if (look.transmission == 0) return;
  if (source.text("alphaMode") == "BLEND")
    file_.warn(source.place() +
               ": the transmission is ignored at the translucent places of the alphaMode BLEND");
  look.transmission_texture = map(transmission, "transmissionTexture", Alpha::drop, sets);
  const double thickness = volume.number("thicknessFactor", 0);
  look.thin = thickness <= 0;
  if (look.thin) return;
  const double distance = volume.number("attenuationDistance", 0);
  if (distance > 0) {  // absorption over the nominal thickness tints the transmitted light
    const Vector3f color = color_of(volume, "attenuationColor", 1);
    for (int k = 0; k < 3; ++k)
      look.color[k] *=
          1 - look.transmission * (1 - fraction(std::pow(double{color[k]}, thickness / distance)));
  }
  file_.warn("KHR_materials_volume is approximated by the thickness of the whole part");
  warn_of_textures(volume, {"thicknessTexture"});
}

void GltfMaterials::read_layers(const GltfValue& source, Material& look, GltfUvSets& sets) {
  const GltfValue coat = source.extension("KHR_materials_clearcoat"),
                  sheen = source.extension("KHR_materials_sheen");
  const GltfValue specular = source.extension("KHR_materials_specular");
  look.clearcoat = fraction(coat.number("clearcoatFactor", 0));
  look.clearcoat_roughness = fraction(coat.number("clearcoatRoughnessFactor", 0));
  warn_of_textures(coat, {"clearcoatTexture", "clearcoatRoughnessTexture", "clearcoatNormalTexture"});
  look.sheen_color = color_of(sheen, "sheenColorFactor", 0);
  if (sheen.exists() && sheen.number("sheenRoughnessFactor", 0) != 0.5)
    file_.warn(sheen.place() + ".sheenRoughnessFactor is drawn as 0.5");
  warn_of_textures(sheen, {"sheenColorTexture", "sheenRoughnessTexture"});
  if (!specular.exists() || look.glossiness >= 0) return;
  const Vector3f tint = color_of(specular, "specularColorFactor", 1, 100);
  look.specular =
      fraction(specular.number("specularFactor", 1)) * look.specular.cwiseProduct(tint).cwiseMin(1);
  look.specular_texture = map(specular, "specularColorTexture", Alpha::drop, sets);
  warn_of_textures(specular, {"specularTexture"});
}

void GltfMaterials::read_iridescence(const GltfValue& source, Material& look) {
  const GltfValue film = source.extension("KHR_materials_iridescence");
  const float strength = fraction(film.number("iridescenceFactor", 0));
  if (strength == 0) return;
  const double n = std::clamp(film.number("iridescenceIor", 1.3), 1.0, 5.0);
  const double thickness_nm = std::clamp(film.number("iridescenceThicknessMaximum", 400), 0.0, 1e5);
  const Vector3f metal = film_reflectance(n, thickness_nm, look.color.head<3>());
  const float of_metal = strength * look.metallic;
  look.color.head<3>() += of_metal * (metal - look.color.head<3>());
  look.specular += strength * (film_reflectance(n, thickness_nm, look.specular) - look.specular);
  file_.warn(
      "KHR_materials_iridescence is approximated: its colours of a perpendicular view are drawn at all "
      "angles");
  warn_of_textures(film, {"iridescenceTexture", "iridescenceThicknessTexture"});
}

void GltfMaterials::warn_of_textures(const GltfValue& source, std::initializer_list<const char*> names) {
  for (const char* name : names)
    if (source.has(name)) file_.warn(source.place() + "." + name + " is ignored; its factor is used");
}

TextureMap GltfMaterials::map(const GltfValue& owner, const char* name, Alpha alpha, GltfUvSets& sets) {
  const GltfValue info = owner.child(name);
  TextureMap result;
  if (!info.exists()) return result;
  const std::optional<std::size_t> index = info.index("index", file_.count("textures"));
  if (!index) throw info.wrong("index", "is missing");
  const GltfValue texture = file_.item("textures", *index);
  result.image = image(texture, alpha);
  if (result.image < 0) return {};
  const GltfValue transform = info.extension("KHR_texture_transform");
  if (transform.exists()) transform_uvs(transform, result);
  result.uv_set = slot(transform.size("texCoord", info.size("texCoord", 0)), sets, info.place());
  read_sampler(texture, result);
  return result;
}

void GltfMaterials::read_sampler(const GltfValue& texture, TextureMap& result) {
  const std::optional<std::size_t> index = texture.index("sampler", file_.count("samplers"));
  if (!index) return;
  const GltfValue sampler = file_.item("samplers", *index);
  const auto wrap = [&](const char* key) {
    const std::size_t code = sampler.size(key, 0);
    return code == kClamp ? Wrap::clamp : code == kMirror ? Wrap::mirror : Wrap::repeat;
  };
  result.wrap_u = wrap("wrapS");
  result.wrap_v = wrap("wrapT");
  result.nearest = sampler.size("magFilter", kLinear) == kNearest;
  const std::size_t reduced = sampler.size("minFilter", 0);
  result.mip_maps = reduced != kNearest && reduced != kLinear;
  if (reduced == kNearestMipNearest || reduced == kNearestMipLinear)
    file_.warn("reduced textures are averaged, not taken from the nearest texel");
}

int GltfMaterials::slot(std::size_t set, GltfUvSets& sets, const std::string& place) {
  for (std::size_t k = 0; k < sets.size(); ++k) {
    if (sets[k] < 0) sets[k] = static_cast<int>(std::min<std::size_t>(set, 1000));
    if (sets[k] == static_cast<int>(set)) return static_cast<int>(k);
  }
  file_.warn(place +
             ": a third set of texture coordinates in one material is not supported; the first is used");
  return 0;
}

int GltfMaterials::image(const GltfValue& texture, Alpha alpha) {
  std::optional<std::size_t> index = texture.index("source", file_.count("images"));
  const GltfValue webp = texture.extension("EXT_texture_webp");
  if (webp.exists() && has_webp()) index = webp.index("source", file_.count("images"));
  if (!index) {
    file_.warn(texture.place() + " is ignored: none of its images has a supported format (PNG, JPEG, WebP)");
    return -1;
  }
  const auto [entry, is_new] = images_.try_emplace({*index, alpha}, -1);
  if (!is_new) return entry->second;
  try {
    Image picture = decoded(*index);
    if (alpha == Alpha::drop)
      for (std::size_t i = 3; i < picture.rgba.size(); i += 4) picture.rgba[i] = 255;
    entry->second = static_cast<int>(model_.textures.size());
    model_.textures.push_back(std::move(picture));
  } catch (const FileError& error) {
    file_.warn(one_line(error.what()));
  }
  return entry->second;
}

Image GltfMaterials::decoded(std::size_t index) {
  const GltfValue source = file_.item("images", index);
  if (source.has("uri"))
    return decode_image(file_.resource(source.text("uri"), source.place()), source.place(),
                        kMaxTexturePixels);
  const std::optional<std::size_t> view = source.index("bufferView", file_.count("bufferViews"));
  if (!view) throw FileError(source.place() + ": has neither a uri nor a buffer view");
  return decode_image(file_.view(*view), source.place(), kMaxTexturePixels);
}

}  // namespace offstage::render
