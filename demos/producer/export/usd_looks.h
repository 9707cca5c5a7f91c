#pragma once
/// Private: materials of USD files, as UsdPreviewSurface.

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "producer/export/film_parts.h"

namespace offstage::producer {

class UsdLooks {
 public:
  /// `folder`, `stem`: the folder of the film and its name without the ending, for the files of textures.
  UsdLooks(const FilmParts& parts, std::filesystem::path folder, std::string stem)
      : parts_(parts), folder_(std::move(folder)), stem_(std::move(stem)) {}

  /// Writes the textures into files, and returns the scope with all materials as text. Throws
  /// render::FileError.
  std::string write();

  /// Returns the path of a material, which exists after write().
  const std::string& path(std::size_t material) const { return paths_[material]; }

 private:
  /// A texture node of a material.
  struct Node {
    std::string name;
    const render::TextureMap& map;
    bool is_color = false;  ///< whether the picture is sRGB
    Eigen::Vector4f scale = {1, 1, 1, 1}, bias = {0, 0, 0, 0};
  };
  std::string material(const FilmMaterial& source, const std::string& name) const;
  std::string inputs(const render::Material& look, const std::string& path) const;
  std::string texture(const render::Material& look, const std::string& material, const Node& node) const;
  static std::vector<Node> nodes(const render::Material& look);

  const FilmParts& parts_;
  std::filesystem::path folder_;
  std::string stem_;
  std::vector<std::string> paths_;
};

}  // namespace offstage::producer
