// The commands schema and info, and functions that several commands share.

#include <cerrno>
#include <map>
#include <memory>

#include <CLI/CLI.hpp>
#include <fcntl.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/interrupt.h"
#include "producer/base/log.h"
#include "producer/build/simulation.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/run/fingerprint.h"
#include "producer/run/output.h"
#include "render/error.h"
#include "render/file_io.h"
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
  Json json = {{"method", method_name(decomposition.method)},
               {"count", decomposition.parts.size()},
               {"volume_error", decomposition.volume_error},
               {"difference", decomposition.difference}};
  if (!decomposition.note.empty()) json["note"] = decomposition.note;
  return json;
}

/// Returns advice for a model of an unlikely size; an empty text for a model of a likely size.
std::string size_hint(float largest_side) {
  constexpr float kHuge = 100, kTiny = 0.005f;  // [m]
  if (largest_side > kHuge)
    return fmt::format(
        "it is {:.4g} m large; if its unit is the centimetre or millimetre, \"scale\": 0.01 or 0.001 "
        "corrects it (\"auto\" chooses), or \"fit\" gives it a size",
        largest_side);
  if (largest_side < kTiny)
    return fmt::format("it is {:.3g} m small; \"scale\" or \"fit\" gives it a size", largest_side);
  return "";
}

Json cameras_json(const render::Model& model) {
  Json cameras = Json::array();
  for (const render::Model::Camera& camera : model.cameras) {
    cameras.push_back(
        {{"name", camera.name}, {"projection", camera.perspective ? "perspective" : "orthographic"}});
    if (camera.perspective) cameras.back()["fov_deg"] = camera.fov_deg;
  }
  return cameras;
}

Json lights_json(const render::Model& model) {
  using Kind = render::Model::Light::Kind;
  static const std::map<Kind, const char*> names = {
      {Kind::directional, "directional"}, {Kind::point, "point"}, {Kind::spot, "spot"}};
  Json lights = Json::array();
  for (const render::Model::Light& light : model.lights) {
    lights.push_back({{"name", light.name}, {"type", names.at(light.kind)}, {"color", json_of(light.color)}});
    lights.back()[light.kind == Kind::directional ? "lux" : "candela"] = light.intensity;
    if (light.kind == Kind::spot) lights.back()["cone_half_angles_deg"] = {light.inner_deg, light.outer_deg};
    if (light.range_m > 0) lights.back()["range"] = light.range_m;
  }
  return lights;
}

Json describe_model(const std::filesystem::path& path, const DecompositionCache& cache) {
  render::Model model = render::read_model(path, {}, interrupt_signal);
  if (!model.file_size) model.file_size = render::read_file_size(path, {}, interrupt_signal);
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
               {"unit", model.unit},
               {"bounds", {json_of(bounds.min()), json_of(bounds.max())}},
               {"closed", topology.defects().closed()},
               {"defects", defects.empty() ? "none" : defects}};
  if (topology.defects().closed()) {
    json["volume"] = mass.volume;
    json["centre"] = json_of(mass.centre);
    const sim::PrincipalInertia principal = sim::diagonalise(mass.inertia);
    json["principal_moments_per_density"] = json_of(principal.moments);
  }
  const StepNotice notice(
      ProgressStyle::automatic,
      fmt::format("decomposing {} ({} triangles) into convex parts", path.string(), model.triangle_count()));
  json["convex_parts"] = describe(cache.decompose(mesh));
  Json nodes = Json::array();
  for (const render::Model::Node& node : model.nodes) {
    nodes.push_back({{"name", node.name}, {"position", json_of(node.position)}});
    if (node.parent >= 0) nodes.back()["parent"] = model.nodes[static_cast<std::size_t>(node.parent)].name;
  }
  json["nodes"] = nodes;
  Json clips = Json::array();
  for (const render::Model::Clip& clip : model.clips)
    clips.push_back({{"name", clip.name}, {"duration", clip.duration}});
  json["animations"] = clips;
  json["cameras"] = cameras_json(model);
  json["lights"] = lights_json(model);
  const ChosenScale likely = automatic_scale(model);
  json["automatic_scale"] = {{"scale", likely.factor}, {"reason", likely.reason}};
  if (const std::string hint = size_hint(bounds.sizes().maxCoeff()); !hint.empty()) json["hint"] = hint;
  std::vector<std::string> warnings = model.warnings;
  if (!model.cameras.empty() || !model.lights.empty())
    warnings.push_back(
        "the file's cameras and lights are not used unless the scene has a \"camera\" or \"lights\" of the "
        "type \"model\"");
  for (const render::Model::Light& light : model.lights)
    if (light.range_m > 0)
      warnings.push_back(
          "the light '" + light.name +
          "': its range is ignored; light decreases with the square of the distance, without an end");
  json["warnings"] = warnings;
  return json;
}

/// Describes the models that are divided into convex parts.
Json models_json(const ModelLibrary& models) {
  Json list = Json::array();
  for (const ModelLibrary::Decomposed& model : models.decomposed()) {
    list.push_back({{"file", model.file}, {"triangles", model.triangles}});
    list.back()["convex_parts"] = describe(*model.parts);
  }
  return list;
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
          {"models", models_json(models)},
          {"materials", scene.materials.size()},
          {"frames", scene.frame_count()},
          {"fps", fps_json(scene.output.fps)},
          {"duration", scene.output.duration},
          {"size", {scene.render.size.x(), scene.render.size.y()}},
          {"settings", settings_key(loaded, models)}};
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
  if (fps) {
    const auto rate = render::parse_frame_rate(*fps);
    if (!rate) throw std::invalid_argument(wrong_frame_rate(*fps));
    all.push_back("/output/fps=" + rate->text());
  }
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
  for (const Problem& warning : warnings) log("warning: {}\n", warning.describe());
}

LoadedScene load(const SceneOptions& options, bool quiet, const std::vector<std::string>& more_overrides) {
  std::vector<std::string> overrides = options.overrides();
  overrides.insert(overrides.begin(), more_overrides.begin(), more_overrides.end());
  LoadedScene loaded = load_scene(options.file, overrides, options.allow);
  if (!options.camera.empty()) choose_camera(loaded, options.camera);
  if (!quiet) print_warnings(loaded.warnings);
  return loaded;
}

ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options,
                         const LogOptions& log_options, std::vector<Problem>& warnings) {
  const ProgressStyle style = log_options.quiet ? ProgressStyle::none : log_options.progress;
  std::optional<StepNotice> notice;
  ModelLibrary models(loaded.scene, loaded.folder, options.decompositions(), warnings,
                      [&](const std::string& step) {
                        notice.reset();
                        if (interrupt_signal()) throw Interrupted(interrupt_signal());
                        if (!step.empty()) notice.emplace(style, step);
                      });
  constexpr double kLong_s = 10;
  for (const ModelLibrary::Decomposed& part : models.decomposed())
    if (part.seconds > kLong_s && !log_options.quiet)
      log("note: it took {} to decompose '{}' ({} triangles) into {} convex parts{}; a simpler model, or a "
          "primitive as its shape, makes every run faster\n",
          duration_text(part.seconds), part.file, part.triangles, part.parts->parts.size(),
          options.no_cache ? "" : ", which are cached for later runs");
  return models;
}

ModelLibrary load_models(const LoadedScene& loaded, const SceneOptions& options,
                         const LogOptions& log_options) {
  std::vector<Problem> warnings;
  ModelLibrary models = load_models(loaded, options, log_options, warnings);
  if (!log_options.quiet) print_warnings(warnings);
  return models;
}

std::string write_numbered_file(const std::string& stem, const std::string& ending, const std::string& text) {
  constexpr int kMost = 10'000;
  for (int i = 1; i <= kMost; ++i) {
    const std::string name = stem + (i == 1 ? "" : "-" + std::to_string(i)) + ending;
    // With O_EXCL, opening fails if the file already exists.
    const render::Descriptor made(::open(name.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (!made && errno == EEXIST) continue;
    if (!made) render::throw_file_error(name, "cannot be created");
    write_text_file(name, text);
    return name;
  }
  throw render::FileError(stem + ending +
                          ": this name, and the same name with every number from 2 on, is in use");
}

void write_text_file(const std::string& path, const std::string& text) {
  render::write_file_atomically(path, {reinterpret_cast<const uint8_t*>(text.data()), text.size()});
}

Command add_schema(CLI::App& app) {
  const auto reference = std::make_shared<bool>(false);
  CLI::App* command = app.add_subcommand("schema", "Print the JSON Schema of the scene format");
  command->add_flag("--reference", *reference, "Print the scene reference in Markdown instead");
  return {command, [reference] {
            fmt::print("{}", *reference ? scene_reference() : scene_schema());
            return static_cast<int>(kOk);
          }};
}

namespace {

int info_command(const SceneOptions& options, bool json) {
  const bool is_scene =
      options.from_standard_input() || std::filesystem::path(options.file).extension() == ".json";
  const DecompositionCache cache = options.decompositions();
  const Json info =
      is_scene ? describe_scene(load(options, false), cache) : describe_model(options.file, cache);
  if (json)
    fmt::print("{}\n", info.dump(2));
  else
    print_readable(info);
  return kOk;
}

}  // namespace

Command add_info(CLI::App& app) {
  struct Options {
    SceneOptions scene;
    bool json = false;
  };
  const auto options = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("info", "Describe a scene or a model file");
  command->add_option("file", options->scene.file, "Scene (.json) or model file")->required();
  add_overrides(*command, options->scene);
  command->add_flag("--json", options->json, "Print as JSON");
  return {command, [options] { return info_command(options->scene, options->json); }};
}

}  // namespace offstage::producer
