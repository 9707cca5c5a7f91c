#include "producer/models.h"

#include <fstream>
#include <iterator>
#include <set>

#include <fmt/format.h>
#include <xxhash.h>

#include "render/error.h"
#include "render/image_io.h"
#include "render/mesh_io.h"

namespace offstage::producer {
namespace {

std::string hex(XXH128_hash_t h) {
  return fmt::format("{:016x}{:016x}", h.high64, h.low64);
}

/// Every file a scene names, with the first place that names it.
struct Files {
  std::map<std::string, Where> models, textures;
};

Files files_of(const Scene& scene) {
  Files files;
  for (const Body& body : scene.bodies) {
    if (const auto* mesh = std::get_if<MeshFile>(&body.shape)) files.models.emplace(mesh->file, body.where);
    if (body.model) files.models.emplace(body.model->file, body.where);
  }
  for (const Material& material : scene.materials)
    if (!material.texture.empty()) files.textures.emplace(material.texture, material.where);
  return files;
}

}  // namespace

ModelLibrary::ModelLibrary(const Scene& scene, const std::filesystem::path& folder,
                           std::vector<Problem>& warnings) {
  std::vector<Problem> problems;
  XXH3_state_t* hash = XXH3_createState();
  XXH3_128bits_reset(hash);
  const auto digest = [&](const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    XXH3_128bits_update(hash, bytes.data(), bytes.size());
  };
  const Files files = files_of(scene);
  for (const auto& [file, where] : files.models) {
    try {
      const render::Model& model = models_.emplace(file, render::read_model(folder / file)).first->second;
      for (const std::string& warning : model.warnings) warnings.push_back({where, file + ": " + warning});
      digest(folder / file);
    } catch (const render::FileError& error) {
      problems.push_back({where, error.what()});
    }
  }
  for (const auto& [file, where] : files.textures) {
    try {
      textures_.emplace(file, render::read_image(folder / file));
      digest(folder / file);
    } catch (const render::FileError& error) {
      problems.push_back({where, error.what()});
    }
  }
  digest_ = hex(XXH3_128bits_digest(hash));
  XXH3_freeState(hash);
  if (!problems.empty()) throw SceneError(std::move(problems));
}

sim::TriangleMesh collision_mesh(const render::Model& model, double scale) {
  sim::TriangleMesh mesh;
  mesh.vertices.reserve(model.vertex_count());
  mesh.triangles.reserve(model.triangle_count());
  for (const render::Model::Part& part : model.parts) {
    const auto base = static_cast<uint32_t>(mesh.vertices.size());
    for (const Eigen::Vector3f& p : part.mesh.positions) mesh.vertices.push_back(p.cast<double>() * scale);
    for (std::size_t i = 0; i + 2 < part.mesh.indices.size(); i += 3)
      mesh.triangles.push_back(
          {base + part.mesh.indices[i], base + part.mesh.indices[i + 1], base + part.mesh.indices[i + 2]});
  }
  return mesh;
}

std::string text_hash(const std::string& text) {
  return hex(XXH3_128bits(text.data(), text.size()));
}

}  // namespace offstage::producer
