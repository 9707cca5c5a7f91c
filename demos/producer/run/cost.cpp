#include "producer/run/cost.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "producer/base/interrupt.h"
#include "producer/build/cloth_defs.h"
#include "producer/build/picture.h"
#include "producer/format/scene_check_particles.h"
#include "render/context.h"

namespace offstage::producer {
namespace {

using std::chrono::steady_clock;

// Time of one unit of work on one core [s], from tests/bench/RESULTS.md.
constexpr double kBody_s = 3e-6;                   // a sub-step of a body in contact
constexpr double kPart_s = 2e-6;                   // a sub-step of each further convex part of the body
constexpr double kJoint_s = 5e-6;                  // a sub-step of a joint
constexpr double kVertex_s = 0.10e-6;              // a sub-step of a cloth's vertex
constexpr double kFoldingVertex_s = 0.16e-6;       // a sub-step of a vertex with self-collision
constexpr double kFreeParticle_s = 0.015e-6;       // a sub-step of a particle
constexpr double kParticle_s = 0.1e-6;             // a sub-step of a particle that collides with bodies
constexpr double kPackedParticle_s = 1e-6;         // a sub-step of a particle that collides with particles
constexpr double kTriangle_s = 0.1e-6;             // a sub-frame of a triangle with its shadow
constexpr double kClothPicture_s = 0.09;           // time per sub-frame of a cloth, independent of its mesh
constexpr double kPixel_s = 40e-3 / (1280 * 720);  // a sub-frame of a pixel of ground

/// Returns the time to draw a particle of this look in a sub-frame [s]. Smoke and fire take longest, because
/// their particles cover many pixels.
double drawn_particle_s(const ParticleLook& look) {
  constexpr double kStreak = 2.4e-6, kBall = 5e-6, kPuff = 60e-6;
  switch (look.style) {
    case LookStyle::sphere:
    case LookStyle::flake:
      return kBall;
    case LookStyle::streak:
    case LookStyle::drop:
    case LookStyle::spark:
      return kStreak;
    default:
      return kPuff;
  }
}

std::string with_spaces(uint64_t number) {
  std::string digits = std::to_string(number);
  for (std::size_t i = digits.size(); i > 3; i -= 3) digits.insert(i - 3, " ");
  return digits;
}

/// Computes the costs of a scene's objects. Copies are counted with their original.
class CostTable {
 public:
  CostTable(const Scene& scene, const ModelLibrary& models)
      : scene_(scene),
        models_(models),
        substeps_(std::ceil(scene.output.fps.seconds(1) / scene.world.max_step * (1 - 1e-12)) *
                  scene.output.fps.per_second()),
        subframes_(subframes(scene.render.quality)),
        pixels_(static_cast<double>(scene.render.size.x()) * scene.render.size.y()) {}

  std::vector<ObjectCost> run() {
    add_picture();
    for (const Body& body : scene_.bodies) add_body(body);
    for (const Cloth& cloth : scene_.cloths) add_cloth(cloth);
    for (const ParticleGroup& group : scene_.particles)
      add_particles(group.where, "particles", group.name, group.behaviour, group.look, group.places.size());
    const std::vector<ParticleBound> bounds = particle_bounds(scene_);
    for (const Emitter& emitter : scene_.emitters) {
      uint64_t alive = 0;
      for (const ParticleBound& bound : bounds)
        if (bound.name == emitter.name || bound.name.starts_with(emitter.name + "/")) alive += bound.alive;
      add_particles(emitter.where, "emitter", emitter.name, emitter.behaviour, emitter.look, alive);
    }
    if (!scene_.joints.empty()) {
      ObjectCost& joints = entry({}, "joints", "");
      joints.count = scene_.joints.size();
      joints.size = with_spaces(joints.count);
      joints.advice = "fewer joints";
      joints.simulation_s = substeps_ * kJoint_s * static_cast<double>(joints.count);
    }
    return std::move(costs_);
  }

 private:
  ObjectCost& entry(const Where& where, const std::string& kind, const std::string& name) {
    const std::string key = kind + (where.path.empty() ? name : where.path);
    if (const auto [it, fresh] = index_.emplace(key, costs_.size()); !fresh) {
      ++costs_[it->second].count;
      return costs_[it->second];
    }
    return costs_.emplace_back(ObjectCost{.kind = kind, .name = name, .size = {}, .advice = {}});
  }

  void add_picture() {
    ObjectCost& picture = entry({}, "picture", "");
    picture.size = fmt::format("{}x{}, {} sub-frame{}", scene_.render.size.x(), scene_.render.size.y(),
                               subframes_, subframes_ > 1 ? "s" : "");
    picture.advice = scene_.render.quality == Quality::draft ? "a smaller --size, or fewer --frames"
                                                             : "a smaller --size, or --quality draft";
    picture.drawing_s = subframes_ * pixels_ * kPixel_s;
  }

  void add_body(const Body& body) {
    ObjectCost& cost = entry(body.where, "body", body.name);
    const auto* mesh = std::get_if<MeshFile>(&body.shape);
    const sim::ConvexDecomposition* parts = mesh ? models_.parts(*mesh) : nullptr;
    const std::size_t part_count = parts ? parts->parts.size() : 1;
    constexpr std::size_t kPrimitiveTriangles = 500;
    std::size_t triangles = kPrimitiveTriangles;
    if (mesh) triangles = models_.model(mesh->file).triangle_count();
    if (body.model) triangles = models_.model(body.model->file).triangle_count();
    cost.size = mesh ? fmt::format("{} triangles{}", with_spaces(triangles),
                                   parts ? fmt::format(" in {} convex parts", part_count) : "")
                     : "a primitive";
    const bool moves = body.motion == sim::MotionType::dynamic;
    if (moves)
      cost.simulation_s +=
          substeps_ * (kBody_s + (body.collides ? kPart_s * static_cast<double>(part_count - 1) : 0));
    if (body.visible) cost.drawing_s += subframes_ * kTriangle_s * static_cast<double>(triangles);
    constexpr std::size_t kManyParts = 8;
    cost.advice = moves && part_count > kManyParts
                      ? "a primitive as its \"shape\", with the file as its \"model\""
                  : moves && cost.count > 1 ? "fewer copies, a longer world.step, or world.solver \"fast\""
                                            : "fewer triangles";
  }

  void add_cloth(const Cloth& cloth) {
    ObjectCost& cost = entry(cloth.where, "cloth", cloth.name);
    const auto* mesh = std::get_if<MeshFile>(&cloth.shape);
    const std::size_t vertices = vertex_count(cloth, mesh ? &models_.model(mesh->file) : nullptr);
    const double step = std::min(cloth.substep, scene_.world.max_step);
    cost.size = fmt::format("{} vertices, steps of {:.2g} ms", with_spaces(vertices), 1e3 * step);
    cost.simulation_s +=
        (cloth.self_collision ? kFoldingVertex_s : kVertex_s) * static_cast<double>(vertices) / step;
    if (cloth.visible) cost.drawing_s += subframes_ * kClothPicture_s * pixels_ / (1280 * 720);
    cost.advice = fmt::format("fewer \"cells\"{}, or a longer \"substep\"",
                              cloth.self_collision ? ", \"self_collision\": false" : "");
  }

  void add_particles(const Where& where, const std::string& kind, const std::string& name,
                     const sim::ParticleSystemDef& behaviour, const ParticleLook& look, uint64_t alive) {
    ObjectCost& cost = entry(where, kind, name);
    cost.particles += alive;
    cost.size = fmt::format("up to {} particles at once", with_spaces(cost.particles));
    const double one = behaviour.internal || behaviour.external ? kPackedParticle_s
                       : behaviour.collides                     ? kParticle_s
                                                                : kFreeParticle_s;
    cost.simulation_s += substeps_ * one * static_cast<double>(alive);
    const double puff_scale = std::min(1.0, pixels_ / (1280 * 720));
    cost.drawing_s += subframes_ * drawn_particle_s(look) * puff_scale * static_cast<double>(alive);
    cost.advice = "a lower rate, or a shorter lifespan";
  }

  const Scene& scene_;
  const ModelLibrary& models_;
  double substeps_;  // number per second
  int subframes_;
  double pixels_;
  std::vector<ObjectCost> costs_;
  std::map<std::string, std::size_t> index_;
};

double seconds_since(steady_clock::time_point start) {
  return std::chrono::duration<double>(steady_clock::now() - start).count();
}

/// Thrown to end a trial within a frame, after the current sub-step.
struct TrialOver {};

/// Simulates until the computing time reaches `limit_s`, but at least one sub-step. Returns the film time and
/// the computing time [s].
std::pair<double, double> try_simulation(const Scene& scene, Simulation& simulation, double limit_s) {
  const auto start = steady_clock::now();
  double reached = 0;
  simulation.on_substep([&](double time) {
    reached = time;
    if (interrupt_signal()) throw Interrupted(interrupt_signal());
    if (time > 0 && seconds_since(start) > limit_s) throw TrialOver();
  });
  try {
    while (simulation.frame() < scene.frame_count()) {
      simulation.advance();
      reached = simulation.world().time();
    }
  } catch (const TrialOver&) {
  }
  simulation.on_substep({});
  return {reached, seconds_since(start)};
}

/// Returns the estimated computing time of a frame of the film [s]. Draws a draft of at most 1280x720 pixels
/// and scales its time to the size and quality of the film.
double try_drawing(const Scene& scene, const ModelLibrary& models, const Simulation& simulation) {
  constexpr double kMostPixels = 1280 * 720;
  Scene draft = scene;
  draft.render.quality = Quality::draft;
  const double pixels = static_cast<double>(scene.render.size.x()) * scene.render.size.y();
  const double scale = std::min(1.0, std::sqrt(kMostPixels / pixels));
  for (int i = 0; i < 2; ++i)
    draft.render.size[i] = std::max(1, static_cast<int>(std::lround(scale * scene.render.size[i])));
  render::Context context;
  Picture picture(draft, models, context);
  const Snapshot state = simulation.snapshot();
  // The first drawing is not measured, because it compiles shader programs, which a film does only once.
  picture.draw(state, state);
  const auto start = steady_clock::now();
  picture.draw(state, state);
  return seconds_since(start) * subframes(scene.render.quality) / (scale * scale);
}

/// Returns the factor by which the work grows if the number of particles grows from `alive` to the greatest
/// possible number.
double growth(const std::vector<ObjectCost>& objects, double ObjectCost::*work, uint64_t alive) {
  double all = 0, of_particles = 0;
  uint64_t most = 0;
  for (const ObjectCost& object : objects) {
    all += object.*work;
    if (object.particles > 0) of_particles += object.*work;
    most += object.particles;
  }
  if (most == 0 || all <= 0) return 1;
  const double there = std::min(1.0, static_cast<double>(alive) / static_cast<double>(most));
  return all / (all - of_particles * (1 - there));
}

}  // namespace

std::vector<ObjectCost> object_costs(const Scene& scene, const ModelLibrary& models) {
  return CostTable(scene, models).run();
}

CostEstimate estimate_cost(const LoadedScene& loaded, const ModelLibrary& models, Simulation& simulation) {
  const Scene& scene = loaded.scene;
  constexpr double kSimulationTrial_s = 1;
  CostEstimate cost{.not_drawn = {}, .objects = object_costs(scene, models)};
  const auto [film_s, took_s] = try_simulation(scene, simulation, kSimulationTrial_s);
  cost.trial_film_s = film_s;
  cost.simulation_s_per_s = film_s > 0 ? took_s / film_s : took_s / scene.output.fps.seconds(1);
  const uint64_t alive = simulation.world().particle_count();
  try {
    cost.frame_s = try_drawing(scene, models, simulation);
  } catch (const Interrupted&) {
    throw;
  } catch (const std::exception& error) {
    cost.not_drawn = error.what();
  }

  const double seconds = scene.output.start + scene.output.duration;
  const double simulating = cost.simulation_s_per_s * seconds,
               drawing = cost.frame_s.value_or(0) * scene.frame_count();
  cost.film_s = simulating + drawing;
  cost.most_film_s = simulating * growth(cost.objects, &ObjectCost::simulation_s, alive) +
                     drawing * growth(cost.objects, &ObjectCost::drawing_s, alive);

  double all_simulation = 0, all_drawing = 0;
  for (const ObjectCost& object : cost.objects) {
    all_simulation += object.simulation_s;
    all_drawing += object.drawing_s;
  }
  for (ObjectCost& object : cost.objects) {
    const double own = (all_simulation > 0 ? simulating * object.simulation_s / all_simulation : 0) +
                       (all_drawing > 0 ? drawing * object.drawing_s / all_drawing : 0);
    object.fraction = cost.film_s > 0 ? own / cost.film_s : 0;
  }
  std::ranges::stable_sort(cost.objects, std::ranges::greater{}, &ObjectCost::fraction);
  return cost;
}

std::string describe(const ObjectCost& object) {
  std::string text = object.kind;
  if (!object.name.empty()) text += " '" + object.name + "'";
  if (object.count > 1 && object.kind != "joints") text += fmt::format(" ({} copies)", object.count);
  return text + " (" + object.size + ")";
}

}  // namespace offstage::producer
