#include <algorithm>
#include <cmath>
#include <map>

#include <assimp/GltfMaterial.h>
#include <assimp/scene.h>

#include "render/error.h"
#include "render/file_io.h"
#include "render/height_map.h"
#include "render/image_io.h"
#include "render/mesh_import.h"
#include "render/model_files.h"
#include "render/mtl_file.h"
#include "render/tone_map.h"

namespace offstage::render {
namespace {

float clamped(float value, float high = 1) {
  return std::isfinite(value) ? std::clamp(value, 0.0f, high) : 0;
}

Image decode_embedded(const aiTexture& texture, const std::string& name) {
  if (texture.mHeight == 0) {  // a compressed file of mWidth bytes
    return decode_image({reinterpret_cast<const uint8_t*>(texture.pcData), texture.mWidth}, name,
                        kMaxTexturePixels);
  }
  Image image{static_cast<int>(texture.mWidth), static_cast<int>(texture.mHeight), {}};
  image.rgba.reserve(image.pixel_count() * 4);
  for (std::size_t i = 0; i < image.pixel_count(); ++i) {
    const aiTexel& texel = texture.pcData[i];
    image.rgba.insert(image.rgba.end(), {texel.r, texel.g, texel.b, texel.a});
  }
  return image;
}

class MaterialImporter {
 public:
  MaterialImporter(const aiScene& scene, const std::filesystem::path& folder, const InputFolders& folders,
                   Model& model)
      : scene_(scene), folder_(folder), folders_(folders), model_(model) {}

  /// Adds the properties of an MTL file that assimp does not read to the material that was appended last.
  void add_mtl(const MtlMaterial& source) {
    Material& look = model_.materials.back();
    if (source.roughness) look.roughness = clamped(*source.roughness);
    if (source.metallic) look.metallic = clamped(*source.metallic);
    for (const auto& [key, map] : source.maps) {
      if (key == "map_kd") lay(map, look.base_color_texture);
      if (key == "map_ke") add_glow(map, look);
    }
    for (const std::string& key : source.ignored)
      model_.warnings.push_back("material '" + look.name + "': " + key + " is ignored");
    if (const auto mask = source.maps.find("map_d"); mask != source.maps.end()) add_mask(mask->second, look);
    for (const char* key : {"bump", "norm"})
      if (const auto map = source.maps.find(key); map != source.maps.end()) add_bumps(map->second, look);
  }

  /// Appends the material; returns the number of its set of texture coordinates.
  unsigned add(const aiMaterial& source) {
    Material material;
    aiString text;
    if (source.Get(AI_MATKEY_NAME, text) == aiReturn_SUCCESS) material.name = text.C_Str();
    const bool gltf = source.Get(AI_MATKEY_GLTF_ALPHAMODE, text) == aiReturn_SUCCESS;
    const bool opaque = gltf && std::string(text.C_Str()) == "OPAQUE";

    read_color(source, gltf, opaque, material);
    read_surface(source, material);
    read_emission(source, gltf, material);
    int two_sided = 0;
    if (source.Get(AI_MATKEY_TWOSIDED, two_sided) == aiReturn_SUCCESS) material.two_sided = two_sided != 0;

    unsigned uv_set = 0;
    material.base_color_texture.image =
        texture(source, {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE}, opaque, &uv_set);
    material.emission_texture.image =
        texture(source, {aiTextureType_EMISSION_COLOR, aiTextureType_EMISSIVE}, true);
    // glTF has one image for metal and roughness. Formats with two separate images are not supported.
    if (gltf) material.metallic_roughness_texture.image = texture(source, {aiTextureType_UNKNOWN}, true);
    if (material.name.empty() && material.base_color_texture.image < 0 &&
        material.color == Vector4f::Ones()) {
      give_default_look(material);
    }
    // Many programs write the transparency in place of the opacity.
    if (!gltf && material.color.w() < 1e-3f) {
      material.color.w() = 1;
      model_.warnings.push_back("material '" + material.name + "': opacity 0 is read as opaque");
    }
    name_ignored(source, material.name);
    model_.materials.push_back(std::move(material));
    return uv_set;
  }

 private:
  /// For MTL files, assimp only gets the textures that are drawn.
  void name_ignored(const aiMaterial& source, const std::string& name) {
    constexpr std::pair<aiTextureType, const char*> kIgnoredTextures[] = {
        {aiTextureType_NORMALS, "normal map"},        {aiTextureType_NORMAL_CAMERA, "normal map"},
        {aiTextureType_HEIGHT, "bump map"},           {aiTextureType_DISPLACEMENT, "displacement map"},
        {aiTextureType_METALNESS, "metal map"},       {aiTextureType_DIFFUSE_ROUGHNESS, "roughness map"},
        {aiTextureType_SPECULAR, "specular map"},     {aiTextureType_SHININESS, "shininess map"},
        {aiTextureType_OPACITY, "opacity map"},       {aiTextureType_AMBIENT_OCCLUSION, "occlusion map"},
        {aiTextureType_REFLECTION, "reflection map"}, {aiTextureType_LIGHTMAP, "light map"}};
    for (const auto& [type, what] : kIgnoredTextures)
      if (source.GetTextureCount(type) > 0)
        model_.warnings.push_back("material '" + name + "': its " + what + " is ignored");
  }

  /// Gives the default look of offstage to the material of a file without materials. assimp gives such a file
  /// an unnamed white material, which for glTF is rough metal.
  static void give_default_look(Material& material) {
    material.color = Material{}.color;
    if (material.metallic == 1 && material.roughness == 1) {
      material.metallic = 0;
      material.roughness = Material{}.roughness;
    }
  }

  /// Reads the base colour. Colours of classic materials are sRGB; colours of physically based materials are
  /// linear.
  static void read_color(const aiMaterial& source, bool gltf, bool opaque, Material& material) {
    aiColor4D color(0.8f, 0.8f, 0.8f, 1);
    float opacity = 1, gloss = 0;
    const bool has_gloss = source.Get(AI_MATKEY_GLOSSINESS_FACTOR, gloss) == aiReturn_SUCCESS;
    const bool physical = !has_gloss && source.Get(AI_MATKEY_BASE_COLOR, color) == aiReturn_SUCCESS;
    if (!physical) source.Get(AI_MATKEY_COLOR_DIFFUSE, color);
    if (!gltf) {
      source.Get(AI_MATKEY_OPACITY, opacity);
      color.a = opacity;
    }
    const bool linear = physical || gltf;
    material.color = {decoded(color.r, linear), decoded(color.g, linear), decoded(color.b, linear),
                      opaque ? 1 : clamped(color.a)};
  }

  /// A Blinn-Phong lobe of exponent n is about as wide as a GGX lobe with alpha^2 = roughness^4 = 2 / (n + 2)
  /// (Karis, "Specular BRDF reference", 2013); without a highlight the surface is matt.
  static void read_surface(const aiMaterial& source, Material& material) {
    float value = 0;
    if (source.Get(AI_MATKEY_METALLIC_FACTOR, value) == aiReturn_SUCCESS) material.metallic = clamped(value);
    if (source.Get(AI_MATKEY_ROUGHNESS_FACTOR, value) == aiReturn_SUCCESS) {
      material.roughness = clamped(value);
    } else if (source.Get(AI_MATKEY_GLOSSINESS_FACTOR, value) == aiReturn_SUCCESS) {
      material.roughness = 1 - clamped(value);
    } else if (source.Get(AI_MATKEY_SHININESS, value) == aiReturn_SUCCESS) {
      aiColor3D highlight(0, 0, 0);
      source.Get(AI_MATKEY_COLOR_SPECULAR, highlight);
      const float exponent = highlight.IsBlack() ? 0 : clamped(value, 1e6f);
      material.roughness = std::sqrt(std::sqrt(2 / (exponent + 2)));
    }
  }

  static void read_emission(const aiMaterial& source, bool gltf, Material& material) {
    aiColor3D color(0, 0, 0);
    float strength = 1;
    source.Get(AI_MATKEY_COLOR_EMISSIVE, color);
    source.Get(AI_MATKEY_EMISSIVE_INTENSITY, strength);
    material.emission = clamped(strength, 1e4f) *
                        Vector3f(decoded(color.r, gltf), decoded(color.g, gltf), decoded(color.b, gltf));
  }

  static float decoded(float value, bool linear) {
    return linear ? clamped(value) : srgb_decode(clamped(value));
  }

  /// Applies the options of a texture in an MTL file, whose coordinates start at the bottom.
  static void lay(const MtlMap& map, TextureMap& texture) {
    texture.rows[0] = {map.scale.x(), 0, map.offset.x()};
    texture.rows[1] = {0, map.scale.y(), 1 - map.scale.y() - map.offset.y()};
    if (map.clamp) texture.wrap_u = texture.wrap_v = Wrap::clamp;
  }

  void add_glow(const MtlMap& map, Material& look) {
    if (look.emission_texture.image < 0) look.emission_texture.image = load(map.file, true);
    if (look.emission_texture.image >= 0 && look.emission.isZero()) look.emission = Vector3f::Ones();
    lay(map, look.emission_texture);
  }

  /// A mask is often the alpha of the base colour's own picture.
  void add_mask(const MtlMap& map, Material& look) {
    const int mask = load(map.file, false);
    if (mask < 0) return;
    const auto at = [this](int index) -> const Image& {
      return model_.textures[static_cast<std::size_t>(index)];
    };
    const int base = look.base_color_texture.image;
    const auto [entry, is_new] = masked_.try_emplace({base, mask}, static_cast<int>(model_.textures.size()));
    if (is_new) model_.textures.push_back(with_mask(base >= 0 ? at(base) : Image{}, at(mask)));
    look.alpha_cutoff = is_cut_out(at(entry->second)) ? 0.5f : 0.0f;
    if (base < 0) lay(map, look.base_color_texture);
    look.base_color_texture.image = entry->second;
  }

  /// Many programs write normal maps where the format has height maps.
  void add_bumps(const MtlMap& map, Material& look) {
    const int picture = load(map.file, true);
    if (picture < 0) return;
    look.normal_scale = map.bump;
    look.normal_texture.image = picture;
    lay(map, look.normal_texture);
    const Image& image = model_.textures[static_cast<std::size_t>(picture)];
    if (is_normal_map(image)) return;
    look.normal_scale = 1;  // 8 bits are too coarse to scale the slope afterwards
    const auto [entry, is_new] =
        bumps_.try_emplace({picture, map.bump}, static_cast<int>(model_.textures.size()));
    look.normal_texture.image = entry->second;
    if (!is_new) return;
    Image normals = normals_of_heights(image, map.bump);
    model_.textures.push_back(std::move(normals));
  }

  /// Returns the index of the first texture of the material among `types`; -1 if there is none.
  int texture(const aiMaterial& source, std::initializer_list<aiTextureType> types, bool opaque,
              unsigned* uv_set = nullptr) {
    for (const aiTextureType type : types) {
      aiString name;
      unsigned set = 0;
      if (source.GetTexture(type, 0, &name, nullptr, &set) != aiReturn_SUCCESS || name.length == 0) continue;
      if (uv_set && set < AI_MAX_NUMBER_OF_TEXTURECOORDS) *uv_set = set;
      return load(name.C_Str(), opaque);
    }
    return -1;
  }

  /// Loads each image once; with `opaque` its alpha channel is removed, because the material must not use it.
  int load(const std::string& name, bool opaque) {
    const auto [entry, is_new] = loaded_.try_emplace({name, opaque}, -1);
    if (!is_new) return entry->second;
    try {
      Image image = read(name);
      for (std::size_t i = 3; opaque && i < image.rgba.size(); i += 4) image.rgba[i] = 255;
      entry->second = static_cast<int>(model_.textures.size());
      model_.textures.push_back(std::move(image));
    } catch (const FileError& error) {
      model_.warnings.push_back(one_line(error.what()));
    }
    return entry->second;
  }

  Image read(const std::string& name) const {
    if (const aiTexture* embedded = scene_.GetEmbeddedTexture(name.c_str())) {
      return decode_embedded(*embedded, "embedded texture " + name);
    }
    const std::filesystem::path path = find_beside(folder_, name);
    if (path.empty()) throw FileError("texture '" + name + "' does not exist");
    if (!folders_.contain(path))
      throw FileError("texture '" + name +
                      "' is outside of the folders that may be read; allow its folder with --allow DIR");
    return read_image(path, kMaxTexturePixels);
  }

  const aiScene& scene_;
  std::filesystem::path folder_;
  const InputFolders& folders_;
  Model& model_;
  std::map<std::pair<std::string, bool>, int> loaded_;
  std::map<std::pair<int, int>, int> masked_;   ///< keys: indices of the base colour and the mask
  std::map<std::pair<int, float>, int> bumps_;  ///< normal maps; keys: index of the height map, and strength
};

}  // namespace

std::vector<unsigned> import_materials(const aiScene& scene, const std::filesystem::path& folder,
                                       const InputFolders& folders,
                                       const std::map<std::string, MtlMaterial>& mtl, Model& model) {
  MaterialImporter importer(scene, folder, folders, model);
  std::vector<unsigned> uv_sets;
  for (unsigned i = 0; i < scene.mNumMaterials; ++i) {
    uv_sets.push_back(importer.add(*scene.mMaterials[i]));
    const auto found = mtl.find(model.materials.back().name);
    if (found != mtl.end()) importer.add_mtl(found->second);
  }
  return uv_sets;
}

}  // namespace offstage::render
