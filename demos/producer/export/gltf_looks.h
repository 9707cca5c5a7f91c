#pragma once
/// Private: materials and textures of glTF files. render/gltf_material.cpp reads the same properties, so that
/// an exported film that is loaded again looks the same.

#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "producer/export/film_parts.h"
#include "producer/export/gltf_buffer.h"

namespace offstage::producer {

/// The lists of a glTF file that describe its materials.
class GltfLooks {
 public:
  using Json = nlohmann::ordered_json;

  GltfLooks(const FilmParts& parts, GltfBuffer& buffer) : parts_(parts), buffer_(buffer) {}

  /// Fills the lists with the materials of the film, in the order of FilmParts::materials.
  void write();

  Json materials = Json::array(), textures = Json::array(), images = Json::array(), samplers = Json::array();
  std::set<std::string> used;  ///< names of the extensions that the lists use

 private:
  Json material(const FilmMaterial& source, float thickness);
  void add_alpha(const render::Material& look, Json& out) const;
  void add_surface(const render::Material& look, Json& out);
  void add_specular(const render::Material& look, Json& out);
  void add_emission(const render::Material& look, Json& out);
  void add_relief(const render::Material& look, Json& out);
  void add_transmission(const render::Material& look, float thickness, Json& out);
  void add_layers(const render::Material& look, Json& out);
  /// Adds an extension to a material or texture.
  void extend(Json& owner, const std::string& name, Json content);
  /// Adds a texture of a material, if the map has one.
  void add_texture(Json& owner, const char* key, const render::Material& look, const render::TextureMap& map);
  Json texture_info(const render::Material& look, const render::TextureMap& map);

  const FilmParts& parts_;
  GltfBuffer& buffer_;
  std::map<int, std::size_t> images_done_;            // keys: indices in FilmParts::textures
  std::map<std::string, std::size_t> samplers_done_;  // keys: the samplers as text
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> textures_done_;  // keys: image and sampler
};

}  // namespace offstage::producer
