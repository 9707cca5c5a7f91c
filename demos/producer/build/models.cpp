#include "producer/build/models.h"

#include <algorithm>
#include <chrono>
#include <set>

#include <fmt/format.h>
#include <xxhash.h>

#include "producer/base/interrupt.h"
#include "producer/base/shipped_files.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/mesh_io.h"
#include "sim/geometry/mesh.h"

namespace offstage::producer {
namespace {

std::string hex(XXH128_hash_t h) {
  return fmt::format("{:016x}{:016x}", h.high64, h.low64);
}

template <class T>
void add_to(XXH3_state_t* hash, const std::vector<T>& values) {
  XXH3_128bits_update(hash, values.data(), values.size() * sizeof(T));
}

void add_to(XXH3_state_t* hash, const render::Image& image) {
  const int size[] = {image.width_px, image.height_px};
  XXH3_128bits_update(hash, size, sizeof size);
  add_to(hash, image.rgba);
}

void add_to(XXH3_state_t* hash, const render::TextureMap& map) {
  const int choices[] = {map.image,   map.uv_set,  static_cast<int>(map.wrap_u), static_cast<int>(map.wrap_v),
                         map.nearest, map.mip_maps};
  XXH3_128bits_update(hash, choices, sizeof choices);
  for (const Eigen::Vector3f& row : map.rows) XXH3_128bits_update(hash, row.data(), 3 * sizeof(float));
}

/// Adds all data read from the model's own file and from the files to which it refers (materials, textures)
/// to the digest.
void add_to(XXH3_state_t* hash, const render::Model& model) {
  for (const render::Model::Part& part : model.parts) {
    XXH3_128bits_update(hash, &part.material, sizeof part.material);
    add_to(hash, part.mesh.positions);
    add_to(hash, part.mesh.normals);
    add_to(hash, part.mesh.uvs);
    add_to(hash, part.mesh.second_uvs);
    add_to(hash, part.mesh.colors);
    add_to(hash, part.mesh.tangents);
    add_to(hash, part.mesh.indices);
  }
  for (const render::Model::Node& node : model.nodes) {
    XXH3_128bits_update(hash, node.name.data(), node.name.size());
    XXH3_128bits_update(hash, &node.parent, sizeof node.parent);
    XXH3_128bits_update(hash, node.position.data(), 3 * sizeof(float));
    XXH3_128bits_update(hash, node.orientation.coeffs().data(), 4 * sizeof(float));
  }
  for (const render::Material& m : model.materials) {
    const float numbers[] = {m.color.x(),          m.color.y(),       m.color.z(),      m.color.w(),
                             m.metallic,           m.roughness,       m.emission.x(),   m.emission.y(),
                             m.emission.z(),       m.transmission,    m.refraction,     m.normal_scale,
                             m.occlusion_strength, m.alpha_cutoff,    m.specular.x(),   m.specular.y(),
                             m.specular.z(),       m.glossiness,      m.clearcoat,      m.clearcoat_roughness,
                             m.sheen_color.x(),    m.sheen_color.y(), m.sheen_color.z()};
    const int choices[] = {m.two_sided, m.unlit, m.thin, m.vertex_colors};
    render::for_each_texture(m, [&](const render::TextureMap& map) { add_to(hash, map); });
    XXH3_128bits_update(hash, numbers, sizeof numbers);
    XXH3_128bits_update(hash, choices, sizeof choices);
  }
  for (const render::Image& texture : model.textures) add_to(hash, texture);
}

/// All files named by a scene, with the first place that names each.
struct Files {
  std::map<std::string, Where> models, textures;
};

Files files_of(const Scene& scene) {
  Files files;
  for (const Body& body : scene.bodies) {
    if (const auto* mesh = std::get_if<MeshFile>(&body.shape)) files.models.emplace(mesh->file, body.where);
    if (body.model) files.models.emplace(body.model->file, body.where);
  }
  for (const Cloth& cloth : scene.cloths)
    if (const auto* mesh = std::get_if<MeshFile>(&cloth.shape)) files.models.emplace(mesh->file, cloth.where);
  for (const Emitter& emitter : scene.emitters)
    if (const auto* mesh = std::get_if<MeshSurface>(&emitter.surface))
      files.models.emplace(mesh->file, emitter.where);
  for (const Material& material : scene.materials)
    if (!material.texture.empty()) files.textures.emplace(material.texture, material.where);
  return files;
}

/// Bodies whose convex parts are needed, for collisions with a dynamic body or for an overlay, with the first
/// place that needs them.
std::map<std::string, Where> bodies_in_parts(const Scene& scene) {
  std::map<std::string, Where> names;
  const auto need = [&](const std::string& body, const Where& where) { names.emplace(body, where); };
  const auto falls = [](const Body& body) {
    return body.collides && body.motion == sim::MotionType::dynamic;
  };
  if (scene.bodies.size() > 1 && std::ranges::any_of(scene.bodies, falls))
    for (const Body& body : scene.bodies)
      if (body.collides) need(body.name, body.where);
  for (const Overlay& overlay : scene.overlays) {
    if (const auto* parts = std::get_if<PartsOverlay>(&overlay)) need(parts->body, parts->where);
    if (const auto* closest = std::get_if<ClosestOverlay>(&overlay)) {
      need(closest->a, closest->where);
      need(closest->b, closest->where);
    }
    if (const auto* contacts = std::get_if<ContactsOverlay>(&overlay)) {
      if (contacts->a.empty())
        for (const Body& body : scene.bodies)
          if (body.collides) need(body.name, contacts->where);
      need(contacts->a, contacts->where);
      need(contacts->b, contacts->where);
    }
  }
  return names;
}

}  // namespace

ModelLibrary::ModelLibrary(const Scene& scene, const SceneFolder& folder, const DecompositionCache& cache,
                           std::vector<Problem>& warnings, const StepCallback& on_step) {
  std::vector<Problem> problems;
  XXH3_state_t* hash = XXH3_createState();
  XXH3_128bits_reset(hash);
  const Files files = files_of(scene);
  for (const auto& [file, where] : files.models) {
    try {
      const render::Model& model =
          models_
              .emplace(file, render::read_model(model_file(file, folder), folder.inputs(), interrupt_signal))
              .first->second;
      for (const std::string& warning : model.warnings) warnings.push_back({where, file + ": " + warning});
      add_to(hash, model);
    } catch (const render::FileError& error) {
      problems.push_back({where, error.what()});
    }
  }
  for (const auto& [file, where] : files.textures) {
    try {
      add_to(hash,
             textures_.emplace(file, render::read_texture(folder / file, folder.inputs(), interrupt_signal))
                 .first->second);
    } catch (const render::FileError& error) {
      problems.push_back({where, error.what()});
    }
  }
  digest_ = hex(XXH3_128bits_digest(hash));
  XXH3_freeState(hash);
  if (!problems.empty()) throw SceneError(std::move(problems));
  decompose_models(scene, cache, warnings, on_step);
}

void ModelLibrary::decompose_models(const Scene& scene, const DecompositionCache& cache,
                                    std::vector<Problem>& warnings, const StepCallback& on_step) {
  const std::map<std::string, Where> needed = bodies_in_parts(scene);
  std::set<std::string> warned;
  for (const Body& body : scene.bodies) {
    const auto* mesh = std::get_if<MeshFile>(&body.shape);
    const auto need = needed.find(body.name);
    if (!mesh || need == needed.end()) continue;
    if (!parts_.contains(mesh->file)) {
      const std::size_t triangles = model(mesh->file).triangle_count();
      if (on_step)
        on_step(fmt::format("decomposing {} ({} triangles) into convex parts", mesh->file, triangles));
      const auto start = std::chrono::steady_clock::now();
      const auto& parts =
          parts_.emplace(mesh->file, cache.decompose(sim::weld(collision_mesh(model(mesh->file), 1))))
              .first->second;
      const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
      decomposed_.push_back({mesh->file, triangles, parts.parts.size(), time.count()});
      if (on_step) on_step("");
    }
    const sim::ConvexDecomposition& parts = parts_.at(mesh->file);
    // A body that is not dynamic then collides by its triangles.
    const bool matters = body.motion == sim::MotionType::dynamic;
    if (matters && !parts.note.empty() && warned.insert(mesh->file).second)
      warnings.push_back({need->second, mesh->file + ": the convex parts are approximate: " + parts.note});
  }
}

sim::ConvexDecomposition scaled(sim::ConvexDecomposition decomposition, double scale) {
  for (sim::ConvexPolyhedron& part : decomposition.parts) {
    std::vector<Vec3> vertices(part.vertices().begin(), part.vertices().end());
    for (Vec3& v : vertices) v *= scale;
    std::vector<std::vector<uint32_t>> faces(part.face_count());
    for (uint32_t f = 0; f < part.face_count(); ++f)
      faces[f].assign(part.face_vertices(f).begin(), part.face_vertices(f).end());
    part = {std::move(vertices), faces};
  }
  return decomposition;
}

Real fitted_scale(Real scale, const std::optional<Vec3>& fit, const render::Model& model) {
  if (!fit) return scale;
  const Vec3 size = model.bounds().sizes().cast<Real>();
  Real factor = std::numeric_limits<Real>::infinity();
  for (int k = 0; k < 3; ++k)
    if (size[k] > 1e-9 * size.maxCoeff()) factor = std::min(factor, (*fit)[k] / size[k]);
  return std::isfinite(factor) ? scale * factor : scale;
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
