// validate, schema and info, and what the commands share.

#include <algorithm>
#include <map>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/command_line.h"
#include "producer/commands.h"
#include "producer/fingerprint.h"
#include "producer/scene_check_particles.h"
#include "producer/simulation.h"
#include "producer/talk.h"
#include "render/image_io.h"
#include "render/mesh_io.h"
#include "sim/geometry/mass_properties.h"
#include "sim/geometry/mesh.h"

namespace offstage::producer {
namespace {

using Json = nlohmann::ordered_json;

template <class V>
Json json_of(const V& v) {
  Json array = Json::array();
  for (Eigen::Index i = 0; i < v.size(); ++i) array.push_back(v[i]);
  return array;
}

Json describe(const sim::ConvexDecomposition& decomposition) {
  using Method = sim::ConvexDecomposition::Method;
  static const std::map<Method, const char*> names = {{Method::convex, "convex"},
                                                      {Method::exact, "exact"},
                                                      {Method::approximate, "approximate"},
                                                      {Method::none, "none"}};
  Json json = {{"method", names.at(decomposition.method)}, {"count", decomposition.parts.size()}};
  if (decomposition.method == Method::approximate) json["volume_error"] = decomposition.volume_error;
  if (!decomposition.note.empty()) json["note"] = decomposition.note;
  return json;
}

Json describe_model(const std::filesystem::path& path, const DecompositionCache& cache) {
  const render::Model model = render::read_model(path);
  const sim::TriangleMesh mesh = sim::weld(collision_mesh(model, 1));
  const sim::MeshTopology topology(mesh);
  const sim::MassProperties mass = sim::mass_properties(mesh);
  const auto bounds = model.bounds();
  const std::string defects = topology.defects().describe();
  Json json = {{"file", path.string()},
               {"parts", model.parts.size()},
               {"triangles", model.triangle_count()},
               {"vertices", model.vertex_count()},
               {"welded_vertices", mesh.vertices.size()},
               {"materials", model.materials.size()},
               {"textures", model.textures.size()},
               {"bounds", {json_of(bounds.min()), json_of(bounds.max())}},
               {"closed", topology.defects().closed()},
               {"defects", defects.empty() ? "none" : defects}};
  if (topology.defects().closed()) {
    json["volume"] = mass.volume;
    json["centre"] = json_of(mass.centre);
    const sim::PrincipalInertia principal = sim::diagonalise(mass.inertia);
    json["principal_moments_per_density"] = json_of(principal.moments);
  }
  json["convex_parts"] = describe(cache.decompose(mesh));
  Json nodes = Json::array();
  for (const render::Model::Node& node : model.nodes) {
    nodes.push_back({{"name", node.name}, {"position", json_of(node.position)}});
    if (node.parent >= 0) nodes.back()["parent"] = model.nodes[static_cast<std::size_t>(node.parent)].name;
  }
  json["nodes"] = nodes;
  json["warnings"] = model.warnings;
  return json;
}

Json describe_scene(const LoadedScene& loaded, const DecompositionCache& cache) {
  const Scene& scene = loaded.scene;
  std::vector<Problem> warnings;
  const ModelLibrary models(scene, loaded.folder, cache, warnings);
  const Simulation simulation(scene, models);
  std::size_t placed = 0;
  for (const ParticleGroup& group : scene.particles) placed += group.places.size();
  Json moving = Json::array();
  for (const auto& [name, handle] : simulation.moving_bodies()) {
    const sim::BodyState s = simulation.world().body(handle);
    moving.push_back({{"name", name}, {"position", json_of(s.pose.position)}, {"mass", s.mass}});
  }
  return {{"scene", scene.name},
          {"description", scene.description},
          {"bodies", scene.bodies.size()},
          {"moving", moving},
          {"particles", placed},
          {"emitters", scene.emitters.size()},
          {"springs", scene.springs.size()},
          {"cloths", scene.cloths.size()},
          {"materials", scene.materials.size()},
          {"frames", scene.frame_count()},
          {"fps", scene.output.fps},
          {"duration", scene.output.duration},
          {"size", {scene.render.size.x(), scene.render.size.y()}},
          {"settings", settings_key(loaded, models)}};
}

/// How many particles a scene can have at most, in all and of each name.
struct MostParticles {
  uint64_t alive = 0;
  Json by_name = Json::object();
};
MostParticles most_particles(const Scene& scene) {
  MostParticles most;
  for (const ParticleBound& bound : particle_bounds(scene)) {
    most.alive += bound.alive;
    most.by_name[bound.name] = bound.alive;
  }
  return most;
}

}  // namespace

void print_readable(const Json& json, int indent) {
  for (const auto& [key, value] : json.items()) {
    const bool nested =
        value.is_object() || (value.is_array() && !value.empty() && value.front().is_structured());
    fmt::print("{:{}}{}:{}", "", indent, key, nested ? "\n" : " ");
    if (nested)
      print_readable(value, indent + 2);
    else
      fmt::print("{}\n", value.is_string() ? value.get<std::string>() : value.dump());
  }
}

std::vector<std::string> SceneOptions::overrides() const {
  std::vector<std::string> all;
  if (quality) all.push_back("/render/quality=" + *quality);
  if (size) {
    const std::size_t x = size->find('x');
    if (x == std::string::npos)
      throw std::invalid_argument("size: '" + *size + "' is not WxH, such as 1280x720");
    all.push_back("/render/size=[" + size->substr(0, x) + "," + size->substr(x + 1) + "]");
  }
  if (fps) all.push_back(fmt::format("/output/fps={}", *fps));
  if (duration) all.push_back(fmt::format("/output/duration={}", *duration));
  if (seed) all.push_back(fmt::format("/world/seed={}", *seed));
  if (!channels.empty())
    all.push_back(fmt::format("/output/channels=[\"{}\"]", fmt::join(channels, "\",\"")));
  if (channel_format) all.push_back("/output/channel_format=" + *channel_format);
  all.insert(all.end(), set.begin(), set.end());
  return all;
}

int threads_or_all(int threads) {
  return threads > 0 ? threads : available_processors();
}

tbb::global_control simulation_threads(int threads) {
  return {tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads_or_all(threads))};
}

void print_warnings(const std::vector<Problem>& warnings) {
  for (const Problem& warning : warnings) say("warning: {}\n", warning.describe());
}

LoadedScene load(const SceneOptions& options, bool quiet, const std::vector<std::string>& more_overrides) {
  std::vector<std::string> overrides = options.overrides();
  overrides.insert(overrides.begin(), more_overrides.begin(), more_overrides.end());
  LoadedScene loaded = load_scene(options.file, overrides);
  if (!quiet) print_warnings(loaded.warnings);
  return loaded;
}

void write_text_file(const std::string& path, const std::string& text) {
  render::write_file_atomically(path, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

/// Bodies that begin in each other, the deepest first: they will be pushed apart, which moves them.
void add_overlaps(const Scene& scene, const Simulation& simulation, std::vector<Problem>& warnings) {
  constexpr double kVisible = 1e-3;
  constexpr std::size_t kMost = 5;
  const sim::World& world = simulation.world();
  std::vector<sim::BodyOverlap> overlaps = world.overlaps(kVisible);
  std::ranges::stable_sort(overlaps, std::ranges::greater{}, &sim::BodyOverlap::depth);
  const auto place = [&](const std::string& name) {
    const auto body = std::ranges::find(scene.bodies, name, &Body::name);
    return body == scene.bodies.end() ? Where{} : body->where;
  };
  for (std::size_t i = 0; i < std::min(overlaps.size(), kMost); ++i) {
    const auto& [a, b, depth] = overlaps[i];
    const std::string &name = world.body_def(a).name, &other = world.body_def(b).name;
    warnings.push_back(
        {place(name), fmt::format("\"{}\" begins {:.3g} mm inside \"{}\"", name, 1e3 * depth, other)});
  }
  if (overlaps.size() > kMost)
    warnings.back().what += fmt::format(", and {} more pairs of bodies overlap", overlaps.size() - kMost);
}

int validate_command(const SceneOptions& options, bool json) {
  Json result = {
      {"file", options.file}, {"valid", true}, {"errors", Json::array()}, {"warnings", Json::array()}};
  const auto list = [](const Problem& p) {
    return Json{{"file", p.where.file},
                {"line", p.where.line},
                {"column", p.where.column},
                {"path", p.where.path},
                {"message", p.what}};
  };
  try {
    LoadedScene loaded = load_scene(options.file, options.overrides());
    const ModelLibrary models(loaded.scene, loaded.folder, options.decompositions(), loaded.warnings);
    const Simulation simulation(loaded.scene, models);  // what only building shows
    add_overlaps(loaded.scene, simulation, loaded.warnings);
    for (const Problem& warning : loaded.warnings) result["warnings"].push_back(list(warning));
    const MostParticles most = most_particles(loaded.scene);
    result["most_particles"] = most.alive;
    result["most_particles_by_name"] = most.by_name;
    if (!json) {
      print_warnings(loaded.warnings);
      fmt::print("{}: valid, {} frames, {} bodies, {} emitters, at most {} particles at once\n", options.file,
                 loaded.scene.frame_count(), loaded.scene.bodies.size(), loaded.scene.emitters.size(),
                 most.alive);
    }
  } catch (const SceneError& error) {
    if (!json) throw;
    result["valid"] = false;
    for (const Problem& problem : error.problems()) result["errors"].push_back(list(problem));
  }
  if (json) fmt::print("{}\n", result.dump(2));
  return result["valid"].get<bool>() ? kOk : kSceneInvalid;
}

int schema_command(bool reference) {
  fmt::print("{}", reference ? scene_reference() : scene_schema());
  return kOk;
}

int info_command(const SceneOptions& options, bool json) {
  const bool is_scene = std::filesystem::path(options.file).extension() == ".json";
  const DecompositionCache cache = options.decompositions();
  const Json info =
      is_scene ? describe_scene(load(options, false), cache) : describe_model(options.file, cache);
  if (json)
    fmt::print("{}\n", info.dump(2));
  else
    print_readable(info);
  return kOk;
}

}  // namespace offstage::producer
