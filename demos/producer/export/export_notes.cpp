#include "producer/export/export_notes.h"

#include <algorithm>
#include <array>
#include <set>
#include <variant>

#include <fmt/format.h>

namespace offstage::producer {
namespace {

struct FeatureText {
  LookFeature feature;
  const char* things;  ///< what the format does not have
  const char* fate;    ///< what happens to them
};
constexpr const char* kLost = "not exported";
constexpr std::array kFeatures = {
    FeatureText{LookFeature::pattern, "procedural patterns", "replaced by their first colour"},
    FeatureText{LookFeature::fabric, "threads, sheen and translucency of fabrics", kLost},
    FeatureText{LookFeature::triplanar, "triplanar textures",
                "placed by the texture coordinates of their shapes"},
    FeatureText{LookFeature::texture, "textures", "replaced by the colour of the material"},
    FeatureText{LookFeature::glow_texture, "emission textures", kLost},
    FeatureText{LookFeature::normal_map, "normal maps", kLost},
    FeatureText{LookFeature::surface_map, "textures of roughness, metal and occlusion", kLost},
    FeatureText{LookFeature::specular_map, "textures of transmission and specular colour", kLost},
    FeatureText{LookFeature::vertex_colors, "vertex colours", kLost},
    FeatureText{LookFeature::mask, "alpha masks", kLost},
    FeatureText{LookFeature::glass, "refraction and transmission", "replaced by opacity"},
    FeatureText{LookFeature::lacquer, "layers of lacquer", kLost},
    FeatureText{LookFeature::sheen, "layers of sheen", kLost},
    FeatureText{LookFeature::surface, "roughness, metal and emission", kLost}};

bool uses(const render::Material& look, bool on_cloth, LookFeature feature) {
  const render::Material plain;
  switch (feature) {
    case LookFeature::pattern:
      return look.pattern != render::Pattern::none;
    case LookFeature::fabric:
      return on_cloth && (look.fabric.weave != render::Weave::none || look.fabric.sheen > 0 ||
                          look.fabric.translucency > 0 || look.fabric.back_color);
    case LookFeature::triplanar:
      return look.triplanar;
    case LookFeature::texture:
      return look.base_color_texture.image >= 0;
    case LookFeature::glow_texture:
      return look.emission_texture.image >= 0;
    case LookFeature::normal_map:
      return look.normal_texture.image >= 0;
    case LookFeature::surface_map:
      return look.metallic_roughness_texture.image >= 0 || look.occlusion_texture.image >= 0;
    case LookFeature::specular_map:
      return look.transmission_texture.image >= 0 || look.specular_texture.image >= 0;
    case LookFeature::vertex_colors:
      return look.vertex_colors;
    case LookFeature::mask:
      return look.alpha_cutoff > 0;
    case LookFeature::glass:
      return look.transmission > 0;
    case LookFeature::lacquer:
      return look.clearcoat > 0;
    case LookFeature::sheen:
      return look.sheen_color != Eigen::Vector3f::Zero();
    case LookFeature::surface:
      break;
  }
  return look.roughness != plain.roughness || look.metallic != plain.metallic ||
         look.emission != plain.emission;
}

/// Returns "material 'a'", "materials 'a', 'b'", or "materials 'a', 'b', 'c' and 4 others".
std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 3;
  std::string out = names.size() == 1 ? "material" : "materials";
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i)
    out += fmt::format("{} '{}'", i > 0 ? "," : "", names[i]);
  if (const std::size_t rest = names.size() - std::min(names.size(), kMost))
    out += fmt::format(" and {} other{}", rest, rest == 1 ? "" : "s");
  return out;
}

template <class T>
bool holds(std::initializer_list<T> list, T feature) {
  return std::ranges::find(list, feature) != list.end();
}

void add_look_notes(const FilmParts& parts, const std::string& format,
                    std::initializer_list<LookFeature> held, std::vector<std::string>& notes) {
  std::set<std::size_t> on_cloths;
  for (const FilmCloth& cloth : parts.cloths) on_cloths.insert(cloth.material);
  for (const FeatureText& text : kFeatures) {
    if (holds(held, text.feature)) continue;
    std::vector<std::string> names;
    for (std::size_t i = 0; i < parts.materials.size(); ++i)
      if (uses(parts.materials[i].look, on_cloths.contains(i), text.feature))
        names.push_back(parts.materials[i].name);
    if (!names.empty())
      notes.push_back(
          fmt::format("{} has no {}; those of {} are {}", format, text.things, listed(names), text.fate));
  }
}

bool has_depth_of_field(const Camera& camera) {
  return std::visit([](const Lens& lens) { return lens.aperture > 0; }, camera);
}

void add_film_notes(const Scene& scene, const std::string& format, std::initializer_list<FilmFeature> held,
                    std::vector<std::string>& notes) {
  const EnvironmentSettings& sky = scene.environment;
  if (!holds(held, FilmFeature::camera)) notes.push_back(format + " has no camera and no lights");
  if (sky.picture)
    notes.push_back("the environment picture is not exported; load " + sky.picture->file +
                    " in the other program");
  else if (holds(held, FilmFeature::camera) && !holds(held, FilmFeature::sky) && sky.intensity > 0)
    notes.push_back(format + " has no light of the sky; add a sky in the other program");
  if (sky.fog > 0) notes.push_back("fog is not exported");
  if (sky.clouds > 0) notes.push_back("clouds are not exported");
  if (holds(held, FilmFeature::camera) && !holds(held, FilmFeature::lens) && has_depth_of_field(scene.camera))
    notes.push_back(format + " has no depth of field: all objects are in focus");
  if (!scene.overlays.empty()) notes.push_back("overlays are not exported");
}

}  // namespace

std::vector<std::string> export_notes(const FilmParts& parts, const std::string& format,
                                      std::initializer_list<LookFeature> looks,
                                      std::initializer_list<FilmFeature> rest) {
  std::vector<std::string> notes;
  add_look_notes(parts, format, looks, notes);
  add_film_notes(parts.scene, format, rest, notes);
  std::size_t animated = 0;
  for (const Body& body : parts.scene.bodies)
    if (body.visible && body.animation) ++animated;
  if (animated > 0)
    notes.push_back(fmt::format("animations of models are not exported: {} bod{} the pose of the file",
                                animated, animated == 1 ? "y keeps" : "ies keep"));
  return notes;
}

}  // namespace offstage::producer
