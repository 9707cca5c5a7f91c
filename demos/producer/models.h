#pragma once
/// The model and texture files of a scene, each read once and shared by the simulation and every stage.

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "producer/scene.h"
#include "render/model.h"
#include "sim/geometry/mesh.h"

namespace offstage::producer {

class ModelLibrary {
 public:
  ModelLibrary() = default;
  /// Reads every model and texture that the (flat) scene names, relative to `folder`. Throws SceneError with
  /// every file that cannot be used; what was repaired in a model is added to `warnings`.
  ModelLibrary(const Scene& scene, const std::filesystem::path& folder, std::vector<Problem>& warnings);

  const render::Model& model(const std::string& file) const { return models_.at(file); }
  const render::Image& texture(const std::string& file) const { return textures_.at(file); }
  /// Digest of everything that was read, so that a run knows when a file changed.
  const std::string& digest() const { return digest_; }

 private:
  std::map<std::string, render::Model> models_;
  std::map<std::string, render::Image> textures_;
  std::string digest_;
};

/// All triangles of a model as one mesh for the simulation, scaled.
sim::TriangleMesh collision_mesh(const render::Model& model, double scale);

/// XXH3-128 in hexadecimal of a text.
std::string text_hash(const std::string& text);

}  // namespace offstage::producer
