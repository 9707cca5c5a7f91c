#include "producer/build/models.h"

#include <algorithm>
#include <chrono>
#include <set>

#include <fmt/format.h>
#include <xxhash.h>

#include "producer/base/interrupt.h"
#include "producer/base/shipped_files.h"
#include "producer/base/suggest.h"
#include "producer/base/to_float.h"
#include "producer/build/animated_bodies.h"
#include "producer/build/shown_model.h"
#include "render/error.h"
#include "render/image_io.h"
#include "render/mesh_io.h"
#include "sim/geometry/mesh.h"
#include "sim/geometry/solid_check.h"

namespace offstage::producer {
namespace {

std::string hex(XXH128_hash_t h) {
  return fmt::format("{:016x}{:016x}", h.high64, h.low64);
}

template <class T>
void add_to(XXH3_state_t* hash, const std::vector<T>& values) {
  XXH3_128bits_update(hash, values.data(), values.size() * sizeof(T));
}

void add_to(XXH3_state_t* hash, const render::Mesh& mesh) {
  add_to(hash, mesh.positions);
  add_to(hash, mesh.normals);
  add_to(hash, mesh.uvs);
  add_to(hash, mesh.second_uvs);
  add_to(hash, mesh.colors);
  add_to(hash, mesh.tangents);
  add_to(hash, mesh.indices);
}

void add_to(XXH3_state_t* hash, const render::ModelRig& rig) {
  for (const render::RigNode& node : rig.nodes) {
    XXH3_128bits_update(hash, &node.parent, sizeof node.parent);
    for (const auto* v : {&node.translation, &node.scale})
      XXH3_128bits_update(hash, v->data(), 3 * sizeof(float));
    XXH3_128bits_update(hash, node.rotation.coeffs().data(), 4 * sizeof(float));
    XXH3_128bits_update(hash, node.matrix.data(), 16 * sizeof(float));
    add_to(hash, node.weights);
  }
  for (const render::RigClip& clip : rig.clips)
    for (const render::RigChannel& channel : clip.channels) {
      const int choices[] = {channel.node, static_cast<int>(channel.path),
                             static_cast<int>(channel.interpolation)};
      XXH3_128bits_update(hash, choices, sizeof choices);
      add_to(hash, channel.times);
      add_to(hash, channel.values);
    }
  for (const render::RigSkin& skin : rig.skins) {
    add_to(hash, skin.joints);
    add_to(hash, skin.unbind);
  }
  for (const render::RigSurface& surface : rig.surfaces) {
    const int choices[] = {surface.node, surface.skin, surface.material, surface.flat};
    XXH3_128bits_update(hash, choices, sizeof choices);
    add_to(hash, surface.mesh);
    add_to(hash, surface.joints);
    add_to(hash, surface.weights);
    for (const render::RigTarget& target : surface.targets) {
      add_to(hash, target.positions);
      add_to(hash, target.normals);
    }
  }
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
    add_to(hash, part.mesh);
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
  add_to(hash, model.rig);
  const auto add_place = [&](const render::Model::Place& place) {
    XXH3_128bits_update(hash, place.name.data(), place.name.size());
    XXH3_128bits_update(hash, place.model_from_place.data(), 16 * sizeof(float));
  };
  for (const render::Model::Camera& camera : model.cameras) {
    add_place(camera);
    XXH3_128bits_update(hash, &camera.fov_deg, sizeof camera.fov_deg);
    XXH3_128bits_update(hash, &camera.perspective, sizeof camera.perspective);
  }
  for (const render::Model::Light& light : model.lights) {
    add_place(light);
    const float numbers[] = {light.color.x(),
                             light.color.y(),
                             light.color.z(),
                             light.intensity,
                             light.inner_deg,
                             light.outer_deg,
                             static_cast<float>(light.kind)};
    XXH3_128bits_update(hash, numbers, sizeof numbers);
  }
  // The automatic scale depends on the whole file, but this model may be a single node of it.
  const float file_size = model.file_size.value_or(0);
  XXH3_128bits_update(hash, &file_size, sizeof file_size);
  XXH3_128bits_update(hash, &model.unit_source, sizeof model.unit_source);
  for (const render::Image& texture : model.textures) add_to(hash, texture);
}

/// Returns whether the convex parts differ from the model so much that the user gets a warning.
bool is_inaccurate(const sim::ConvexDecomposition& parts, const sim::DecompositionSettings& settings) {
  using Method = sim::ConvexDecomposition::Method;
  return parts.method == Method::none ||
         (parts.method == Method::approximate &&
          (parts.difference > settings.max_error || settings.method == sim::DecompositionMethod::exact));
}

std::string inaccuracy(const sim::ConvexDecomposition& parts) {
  if (parts.parts.empty()) return "there are no convex parts, so its triangles collide: " + parts.note;
  return fmt::format(
      "its {} convex parts differ from the model in {:.1f} % of its volume ({}). More parts reduce the "
      "difference: "
      "`decomposition.max_parts`, at most 1024",
      parts.parts.size(), 100 * parts.difference, parts.note);
}

/// Returns the model file that a look draws, or null.
const MeshFile* mesh_file(const ParticleLook& look) {
  return look.style == LookStyle::mesh && look.mesh ? std::get_if<MeshFile>(&look.mesh->shape) : nullptr;
}

/// Calls visit(look, place) for all looks of a scene.
template <class Visit>
void for_each_look(const Scene& scene, Visit visit) {
  for (const ParticleGroup& group : scene.particles) visit(group.look, group.where);
  for (const Emitter& emitter : scene.emitters)
    for_each_source(emitter,
                    [&](const ParticleSource& source, const auto&...) { visit(source.look, source.where); });
}

/// All files that a scene names. Each file is stored with the first place in the scene that names it.
struct Files {
  std::map<std::string, Where> models, textures;
  std::set<std::string> animated;   ///< model files that are read with their animations
  std::set<std::string> automatic;  ///< model files used with an automatic scale and without `fit`
};

Files files_of(const Scene& scene) {
  Files files;
  const auto add_model = [&](const auto& use, const Where& where) {
    files.models.emplace(use.file, where);
    bool fitted = false;
    if constexpr (requires { use.fit; }) fitted = use.fit.has_value();
    if (use.scale.automatic && !fitted) files.automatic.insert(use.file);
  };
  for (const Body& body : scene.bodies) {
    if (const auto* mesh = std::get_if<MeshFile>(&body.shape)) add_model(*mesh, body.where);
    if (body.model) add_model(*body.model, body.where);
    if (body.animation) files.animated.insert(animated_file(body));
  }
  for (const Cloth& cloth : scene.cloths)
    if (const auto* mesh = std::get_if<MeshFile>(&cloth.shape)) add_model(*mesh, cloth.where);
  for (const Emitter& emitter : scene.emitters)
    if (const auto* mesh = std::get_if<MeshSurface>(&emitter.surface)) add_model(*mesh, emitter.where);
  const auto add_look = [&](const ParticleLook& look, const Where& where) {
    if (look.style == LookStyle::sprite && !look.texture.empty()) files.textures.emplace(look.texture, where);
    if (const auto* mesh = mesh_file(look)) add_model(*mesh, where);
  };
  for_each_look(scene, add_look);
  for (const Material& material : scene.materials)
    if (!material.texture.empty()) files.textures.emplace(material.texture, material.where);
  return files;
}

/// Returns the names of the bodies whose convex parts are needed, for collisions with a dynamic body or for
/// an overlay. Each has the first place in the scene that needs its parts.
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
  std::map<std::filesystem::path, std::optional<float>> file_sizes;
  for (const auto& [file, where] : files.models) {
    try {
      const std::filesystem::path path = model_file(file, folder);
      render::Model& model = models_
                                 .emplace(file, render::read_model(path, folder.inputs(), interrupt_signal,
                                                                   files.animated.contains(file)))
                                 .first->second;
      if (files.automatic.contains(file) && !model.file_size) {  // once for all nodes of a file
        const std::filesystem::path whole = render::split_node(path).file;
        auto& side = file_sizes[whole];
        if (!side) side = render::read_file_size(whole, folder.inputs(), interrupt_signal);
        model.file_size = side;
      }
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
  add_to(hash, read_sky(scene, folder, problems, warnings));
  for (const ParticleGroup& group : scene.particles)  // the points of its file are not in the scene's text
    for (const ParticlePlace& place : group.file.empty() ? std::vector<ParticlePlace>{} : group.places) {
      const Color color = place.color.value_or(Color{});
      XXH3_128bits_update(hash, place.position.data(), 3 * sizeof(Real));
      XXH3_128bits_update(hash, color.rgba.data(), 4 * sizeof(float));
    }
  XXH3_128bits_update(hash, scene.fill_digest.data(), scene.fill_digest.size());
  check_sheets(scene, problems);
  if (problems.empty()) read_animations(scene, cache, problems);
  if (problems.empty()) check_cameras_and_lights(scene, *this, problems, warnings);
  digest_ = hex(XXH3_128bits_digest(hash));
  XXH3_freeState(hash);
  if (problems.empty()) check_solids(scene, problems);
  if (!problems.empty()) throw SceneError(std::move(problems));
  decompose_models(scene, cache, warnings, on_step);
}

std::vector<float> ModelLibrary::read_sky(const Scene& scene, const SceneFolder& folder,
                                          std::vector<Problem>& problems, std::vector<Problem>& warnings) {
  if (!scene.environment.picture) return {};
  const std::string& file = scene.environment.picture->file;
  const Where& where = scene.environment.picture->where;
  try {
    render::LightImage light = render::read_light_image(folder / file, folder.inputs(), interrupt_signal);
    for (const std::string& warning : light.warnings) warnings.push_back({where, file + ": " + warning});
    sky_ = std::make_shared<const render::SkyPicture>(light.image,
                                                      to_float(scene.environment.picture->blur_deg));
    return std::move(light.image.rgba);
  } catch (const render::FileError& error) {
    problems.push_back({where, error.what()});
  } catch (const std::invalid_argument& error) {
    problems.push_back({where, file + ": " + error.what()});
  }
  return {};
}

std::string ModelLibrary::animation_key(const Body& body) {
  return animated_file(body) + "\n" + body.animation.value().clip;
}

void ModelLibrary::read_animations(const Scene& scene, const DecompositionCache& cache,
                                   std::vector<Problem>& problems) {
  for (const Body& body : scene.bodies) {
    if (!body.animation) continue;
    const std::string& file = animated_file(body);
    const render::ModelRig& rig = model(file).rig;
    const int clip = rig.clip(body.animation->clip);
    Where where = body.where;
    where.path += "/animation";
    if (rig.clips.empty()) {
      problems.push_back(
          {where, file + ": has no animation that can be played; use a glTF 2.0 file with an animation"});
    } else if (clip < 0) {
      std::vector<std::string> names;
      for (const render::RigClip& known : rig.clips) names.push_back(known.name);
      problems.push_back({where, fmt::format("{}: has no animation '{}'{}", file, body.animation->clip,
                                             suggestion(body.animation->clip, names))});
    } else if (body.has_animated_shape() && !pieces_.contains(animation_key(body))) {
      pieces_[animation_key(body)] = collision_pieces(rig, clip, cache);
    }
  }
}

void ModelLibrary::check_sheets(const Scene& scene, std::vector<Problem>& problems) const {
  const auto check = [&](const ParticleLook& look, const Where& where) {
    const auto image = textures_.find(look.texture);
    if (look.style != LookStyle::sprite || !look.sheet || image == textures_.end()) return;
    const int width = image->second.width_px, height = image->second.height_px;
    if (width % look.sheet->columns == 0 && height % look.sheet->rows == 0) return;
    problems.push_back(
        {where, fmt::format("{}: {}x{} pixels cannot be divided into {} columns and {} rows of "
                            "equal pictures",
                            look.texture, width, height, look.sheet->columns, look.sheet->rows)});
  };
  for_each_look(scene, check);
}

std::string ModelLibrary::parts_key(const MeshFile& mesh) {
  const sim::DecompositionSettings s = settings_of(mesh.decomposition);
  return fmt::format("{}\n{} {} {} {} {} {}", mesh.file, static_cast<int>(s.method), s.max_error, s.max_parts,
                     s.most_parts, s.min_dihedral, s.min_distance);
}

void ModelLibrary::check_solids(const Scene& scene, std::vector<Problem>& problems) const {
  std::map<std::string, std::string> known;  // by file
  for (const Body& body : scene.bodies) {
    const auto* mesh = std::get_if<MeshFile>(&body.shape);
    if (!mesh || body.motion != sim::MotionType::dynamic || body.has_animated_shape()) continue;
    const auto [at, is_new] = known.try_emplace(mesh->file);
    if (is_new) {
      const sim::TriangleMesh welded = sim::weld(collision_mesh(model(mesh->file), 1));
      at->second = sim::problem_of_solid(sim::MeshTopology(welded).defects());
    }
    if (!at->second.empty())
      problems.push_back({body.where, fmt::format("body \"{}\": {}", body.name, at->second)});
  }
}

void ModelLibrary::decompose_models(const Scene& scene, const DecompositionCache& cache,
                                    std::vector<Problem>& warnings, const StepCallback& on_step) {
  const std::map<std::string, Where> needed = bodies_in_parts(scene);
  std::set<std::string> warned;
  for (const Body& body : scene.bodies) {
    const auto* mesh = std::get_if<MeshFile>(&body.shape);
    const auto need = needed.find(body.name);
    if (body.has_animated_shape()) continue;  // the pieces of its animation collide instead
    if (!mesh || need == needed.end()) continue;
    if (!parts_.contains(parts_key(*mesh))) {
      const std::size_t triangles = model(mesh->file).triangle_count();
      if (on_step)
        on_step(fmt::format("decomposing {} ({} triangles) into convex parts", mesh->file, triangles));
      const auto start = std::chrono::steady_clock::now();
      const auto& parts =
          parts_
              .emplace(parts_key(*mesh), cache.decompose(sim::weld(collision_mesh(model(mesh->file), 1)),
                                                         settings_of(mesh->decomposition)))
              .first->second;
      const std::chrono::duration<double> time = std::chrono::steady_clock::now() - start;
      decomposed_.push_back({mesh->file, triangles, &parts, time.count()});
      if (on_step) on_step("");
    }
    const sim::ConvexDecomposition& parts = parts_.at(parts_key(*mesh));
    // Inexact parts matter only for dynamic bodies: other bodies collide by their triangles instead.
    const bool matters = body.motion == sim::MotionType::dynamic;
    if (matters && is_inaccurate(parts, settings_of(mesh->decomposition)) &&
        warned.insert(parts_key(*mesh)).second)
      warnings.push_back({need->second, mesh->file + ": " + inaccuracy(parts)});
  }
}

std::string method_name(sim::ConvexDecomposition::Method method) {
  using Method = sim::ConvexDecomposition::Method;
  switch (method) {
    case Method::convex:
      return "convex";
    case Method::exact:
      return "exact";
    case Method::approximate:
      return "approximate";
    case Method::hull:
      return "hull";
    case Method::none:
      break;
  }
  return "none";
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

const std::string& animated_file(const Body& body) {
  return body.model ? body.model->file : std::get<MeshFile>(body.shape).file;
}

ChosenScale automatic_scale(Real largest_side, render::Model::UnitSource unit) {
  using Source = render::Model::UnitSource;
  constexpr Real kLeastPart_mm = 5;
  if (unit == Source::millimetres)
    return largest_side >= kLeastPart_mm
               ? ChosenScale{0.001, "STL files are usually in millimetres"}
               : ChosenScale{1, fmt::format("{:.3g} mm would be too small for a part", largest_side)};
  const Real largest_m = unit == Source::stated ? 100 : 10;
  const std::string size = fmt::format("the longest side of {:.4g}", largest_side);
  if (largest_side <= largest_m) return {1, size + fmt::format(" is at most {:g} m", largest_m)};
  if (0.01 * largest_side <= largest_m)
    return {0.01, size + fmt::format(" is likely in centimetres, because in metres it would exceed {:g} m",
                                     largest_m)};
  return {0.001,
          size + fmt::format(" is likely in millimetres, because in larger units it would exceed {:g} m",
                             largest_m)};
}

ChosenScale automatic_scale(const render::Model& model) {
  return automatic_scale(static_cast<Real>(model.file_size.value()), model.unit_source);
}

Real fitted_scale(const ModelScale& scale, const std::optional<Vec3>& fit, const render::Model& model) {
  const Real likely = scale.automatic && !fit ? automatic_scale(model).factor : 1;
  return fitted_scale(scale, fit, Vec3(model.bounds().sizes().cast<Real>()), likely);
}

Real fitted_scale(const ModelScale& scale_of_use, const std::optional<Vec3>& fit, const Vec3& size,
                  Real likely) {
  const Real scale = scale_of_use.automatic && !fit ? scale_of_use.factor * likely : scale_of_use.factor;
  if (!fit) return scale;
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

std::string mesh_hash(const sim::TriangleMesh& mesh) {
  XXH3_state_t* hash = XXH3_createState();
  XXH3_128bits_reset(hash);
  add_to(hash, mesh.vertices);
  add_to(hash, mesh.triangles);
  const std::string text = hex(XXH3_128bits_digest(hash));
  XXH3_freeState(hash);
  return text;
}

std::string text_hash(const std::string& text) {
  return hex(XXH3_128bits(text.data(), text.size()));
}

}  // namespace offstage::producer
