// The command validate: checks a scene and estimates its cost.

#include <algorithm>
#include <cmath>
#include <memory>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "producer/base/log.h"
#include "producer/build/simulation.h"
#include "producer/cli/command_line.h"
#include "producer/cli/commands.h"
#include "producer/cli/options.h"
#include "producer/format/scene_check_particles.h"
#include "producer/run/cost.h"
#include "producer/run/progress.h"
#include "render/context.h"

namespace offstage::producer {
namespace {

struct ValidateOptions {
  SceneOptions scene;
  bool json = false;
  bool no_estimate = false;  ///< whether to omit the estimate of the cost, which needs a short trial
  render::GlPlatform gl = render::GlPlatform::automatic;
};

using Json = nlohmann::ordered_json;

/// Returns the greatest number of particles of a scene, in total and for each particle system.
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

/// Adds warnings for bodies that overlap at the start, the deepest overlap first. The simulation pushes such
/// bodies apart, which changes their motion.
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
    warnings.push_back({place(name), fmt::format("body '{}' overlaps body '{}' by {:.3g} mm at time 0; they "
                                                 "are pushed apart. Move one of them",
                                                 name, other, 1e3 * depth)});
  }
  if (overlaps.size() > kMost)
    warnings.back().what += fmt::format(", and {} more pairs of bodies overlap", overlaps.size() - kMost);
}

Json problem_json(const Problem& p) {
  return {{"file", p.where.file},
          {"line", p.where.line},
          {"column", p.where.column},
          {"path", p.where.path},
          {"message", p.what}};
}

Json cost_json(const CostEstimate& cost) {
  const auto rounded = [](double value) { return std::round(1e4 * value) / 1e4; };
  Json json = {{"trial_film_s", rounded(cost.trial_film_s)},
               {"simulation_s_per_film_s", rounded(cost.simulation_s_per_s)},
               {"drawing_s_per_frame", cost.frame_s ? Json(rounded(*cost.frame_s)) : Json()},
               {"film_s", rounded(cost.film_s)},
               {"most_film_s", rounded(cost.most_film_s)},
               {"objects", Json::array()}};
  if (!cost.not_drawn.empty()) json["not_drawn"] = cost.not_drawn;
  for (const ObjectCost& object : cost.objects)
    json["objects"].push_back({{"kind", object.kind},
                               {"name", object.name},
                               {"count", object.count},
                               {"size", object.size},
                               {"fraction", rounded(object.fraction)},
                               {"advice", object.advice}});
  return json;
}

/// Returns a text such as "about 12 s", or "about 12 s, up to 30 s with all particles".
std::string film_text(const CostEstimate& cost) {
  constexpr double kWorthSaying = 1.3;
  std::string text = "about " + duration_text(cost.film_s);
  if (cost.most_film_s > kWorthSaying * cost.film_s)
    text += ", up to " + duration_text(cost.most_film_s) + " with all particles";
  return text;
}

void print_cost(const Scene& scene, const CostEstimate& cost) {
  fmt::print("time on this machine, from a trial of {:.3g} s of film:\n", cost.trial_film_s);
  fmt::print("  simulation  {:.3g} s per second of film\n", cost.simulation_s_per_s);
  if (cost.frame_s)
    fmt::print("  drawing     {:.3g} s per frame\n", *cost.frame_s);
  else
    fmt::print("  drawing     not tried: {}\n", cost.not_drawn);
  fmt::print("  whole film  {} ({} frames)\n", film_text(cost), scene.frame_count());
  constexpr std::size_t kRows = 6;
  constexpr double kWorthARow = 0.005;
  for (std::size_t i = 0; i < std::min(kRows, cost.objects.size()); ++i)
    if (cost.objects[i].fraction >= kWorthARow)
      fmt::print("  {:>4.0f} %  {}\n", 100 * cost.objects[i].fraction, describe(cost.objects[i]));
  if (!cost.objects.empty() && cost.objects.front().fraction > 0)
    fmt::print("most expensive: {}; cheaper with {}\n", describe(cost.objects.front()),
               cost.objects.front().advice);
}

/// Estimates the cost of the scene. If the trial diverges, adds a warning.
std::optional<CostEstimate> tried(const LoadedScene& loaded, const ModelLibrary& models,
                                  Simulation& simulation, std::vector<Problem>& warnings) {
  try {
    return estimate_cost(loaded, models, simulation);
  } catch (const DivergedError& error) {
    warnings.push_back({{"", 0, 0, ""}, error.what()});
    return {};
  }
}

void print_models(const ModelLibrary& models) {
  constexpr double kSlow_s = 1;
  for (const ModelLibrary::Decomposed& model : models.decomposed())
    fmt::print("model {}: {} triangles, convex parts: {}, {}; volume error {:.2g} %, difference {:.2g} %{}\n",
               model.file, model.triangles, model.parts->parts.size(), method_name(model.parts->method),
               100 * model.parts->volume_error, 100 * model.parts->difference,
               model.seconds > kSlow_s ? fmt::format("; made in {:.1f} s", model.seconds) : "");
}

Json convex_models_json(const ModelLibrary& models) {
  Json list = Json::array();
  for (const ModelLibrary::Decomposed& model : models.decomposed())
    list.push_back({{"file", model.file},
                    {"triangles", model.triangles},
                    {"method", method_name(model.parts->method)},
                    {"parts", model.parts->parts.size()},
                    {"volume_error", model.parts->volume_error},
                    {"difference", model.parts->difference}});
  return list;
}

int validate_command(const ValidateOptions& options) {
  const std::string& file = options.scene.file;
  Json result = {{"file", file}, {"valid", true}, {"errors", Json::array()}, {"warnings", Json::array()}};
  try {
    LoadedScene loaded = load_scene(file, options.scene.overrides(), options.scene.allow);
    const LogOptions log_options{.progress = ProgressStyle::automatic, .quiet = options.json};
    const ModelLibrary models = load_models(loaded, options.scene, log_options, loaded.warnings);
    Simulation simulation(loaded.scene, models);  // throws for errors that only the construction finds
    add_overlaps(loaded.scene, simulation, loaded.warnings);
    std::optional<CostEstimate> cost;
    if (!options.no_estimate) {
      render::pin_environment(threads_or_all(0), options.gl);
      cost = tried(loaded, models, simulation, loaded.warnings);
    }
    for (const Problem& warning : loaded.warnings) result["warnings"].push_back(problem_json(warning));
    const MostParticles most = most_particles(loaded.scene);
    result["most_particles"] = most.alive;
    result["most_particles_by_name"] = most.by_name;
    result["models"] = convex_models_json(models);
    if (cost) result["cost"] = cost_json(*cost);
    if (!options.json) {
      print_warnings(loaded.warnings);
      fmt::print("{}: valid, {} frames, {} bodies, {} emitters, at most {} particles at once\n", file,
                 loaded.scene.frame_count(), loaded.scene.bodies.size(), loaded.scene.emitters.size(),
                 most.alive);
      if (cost) print_cost(loaded.scene, *cost);
      print_models(models);
    }
  } catch (const SceneError& error) {
    if (!options.json) throw;
    result["valid"] = false;
    for (const Problem& problem : error.problems()) result["errors"].push_back(problem_json(problem));
  }
  if (options.json) fmt::print("{}\n", result.dump(2));
  return result["valid"].get<bool>() ? kOk : kSceneInvalid;
}

}  // namespace

Command add_validate(CLI::App& app) {
  const auto options = std::make_shared<ValidateOptions>();
  ValidateOptions& validate = *options;
  CLI::App* command =
      app.add_subcommand("validate", "Check a scene, report every problem, and estimate the rendering time");
  add_scene(*command, validate.scene);
  command->add_flag("--json", validate.json, "Print the result as JSON");
  command->add_flag("--no-estimate,--quick", validate.no_estimate,
                    "Skip the estimate, which takes about two seconds");
  add_gl(*command, validate.gl);
  return {command, [options] { return validate_command(*options); }};
}

}  // namespace offstage::producer
