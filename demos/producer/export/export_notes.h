#pragma once
/// Notes on the properties of a film that an export format cannot hold.

#include <initializer_list>
#include <string>
#include <vector>

#include "producer/export/film_parts.h"

namespace offstage::producer {

/// Properties of materials that some formats cannot hold.
enum class LookFeature {
  pattern,        ///< procedural patterns
  fabric,         ///< threads, sheen and translucency of cloths
  triplanar,      ///< textures that are projected along three axes
  texture,        ///< textures of the base colour
  glow_texture,   ///< textures of the emission
  normal_map,     ///< normal maps
  surface_map,    ///< textures of roughness, metal and occlusion
  specular_map,   ///< textures of transmission and specular colour
  vertex_colors,  ///< colours of the vertices
  mask,           ///< alpha masks
  glass,          ///< transmission and refraction of light
  lacquer,        ///< layers of lacquer
  sheen,          ///< layers of sheen
  surface         ///< roughness, metal and emission
};

/// Properties of a film, besides those of its materials, that some formats cannot hold.
enum class FilmFeature { sky, camera, lens };

/// Returns a note for each property that the film uses and the format does not hold. `format`: name of the
/// format. `looks`, `rest`: the properties that it holds.
std::vector<std::string> export_notes(const FilmParts& parts, const std::string& format,
                                      std::initializer_list<LookFeature> looks,
                                      std::initializer_list<FilmFeature> rest);

}  // namespace offstage::producer
