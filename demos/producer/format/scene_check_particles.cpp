#include "producer/format/scene_check_particles.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>

#include <fmt/format.h>

#include "producer/build/emitter_defs.h"
#include "producer/build/placement.h"
#include "producer/format/scene_checker.h"

namespace offstage::producer {
namespace {

constexpr Real kMostParticles = 2e7;
constexpr Real kTolerance = 1.01;  // a particle that ends when another one begins may be counted, too
constexpr Real kSmallest = 1e-6;   // radius [m]

Real film_end(const Scene& scene) {
  return scene.output.start + scene.output.duration;
}

/// Returns the smallest width of a surface [m]; infinity for a model, because model files are not read here.
Real spread_of(const EmitterSurface& surface) {
  return std::visit(
      []<class S>(const S& s) {
        if constexpr (std::is_same_v<S, PlaneSurface>)
          return s.size.minCoeff();
        else if constexpr (requires { s.radius; })
          return 2 * s.radius;
        else
          return std::numeric_limits<Real>::infinity();
      },
      surface);
}

class ParticleChecker : CheckBase {
 public:
  ParticleChecker(const Scene& scene, const Scene& flat, Findings& findings)
      : CheckBase(findings), scene_(scene), flat_(flat) {}

  void run() {
    for (const ParticleGroup& group : flat_.particles) check_group(group);
    for (const Emitter& emitter : scene_.emitters) check_emitter(emitter);
    check_names();
    if (!too_many_) check_sum();
  }

 private:
  /// Checks that names are unique among all groups and sources, because forces refer to both by name.
  void check_names() {
    std::map<std::string, std::string> owners;
    std::set<std::string> reported;
    const auto claim = [&](const std::string& name, const std::string& path) {
      const auto [it, fresh] = owners.emplace(name, path);
      if (!fresh && it->second != path && reported.insert(path).second)
        fail(path + "/name", "the name '" + name + "' is already used by " + it->second);
    };
    for (const ParticleGroup& group : scene_.particles) claim(group.name, group.where.path);
    for (const Emitter& emitter : flat_.emitters)
      for_each_source(emitter,
                      [&](const ParticleSource& source, const ParticleSource*, const std::string& name,
                          const Emission&) { claim(name, source.where.path); });
  }

  // --- Looks and groups ---

  template <class V>
  void check_ages(const std::vector<std::pair<Real, V>>& ramp, const std::string& path) {
    for (std::size_t i = 1; i < ramp.size(); ++i)
      if (ramp[i].first < ramp[i - 1].first) fail(path + step(i), "ages must not decrease");
  }
  void check_pictures(const ParticleLook& look, const std::string& path) {
    if (!look.texture.empty() && look.style != LookStyle::sprite)
      warn(path + "/texture", "has no effect: it is for sprites");
    if (look.sheet && (look.texture.empty() || look.style != LookStyle::sprite))
      warn(path + "/sheet", "has no effect: it divides the texture of sprites, and there is none");
    if (look.sheet && look.sheet->columns * look.sheet->rows > render::kMostSheetPictures)
      fail(path + "/sheet", fmt::format("has {} pictures (columns x rows); a sheet has at most {}",
                                        look.sheet->columns * look.sheet->rows, render::kMostSheetPictures));
    const auto moves = [](const Varying& v) {
      return effects::lower_bound(v) != 0 || effects::upper_bound(v) != 0;
    };
    if (!look.turns() && (moves(look.angle_deg) || moves(look.spin_deg_per_s)))
      warn(path + (moves(look.angle_deg) ? "/angle_deg" : "/spin_deg_per_s"),
           "has no effect: it turns sprites with a texture, flakes and meshes");
    if (look.mesh && look.style != LookStyle::mesh)
      warn(path + "/mesh", "has no effect: it is for the style `mesh`");
  }
  void check_mesh(const ParticleLook& look, const std::string& path) {
    if (!look.mesh) return fail(path + "/mesh", "is missing: the style `mesh` needs an object to draw");
    if (std::holds_alternative<sim::Plane>(look.mesh->shape))
      fail(path + "/mesh/shape", "a plane is infinite; use a flat box");
    const auto* mesh = std::get_if<MeshFile>(&look.mesh->shape);
    if (mesh && (mesh->fit || mesh->scale != ModelScale()))
      warn(path + "/mesh/shape", "its size has no effect: the mesh gets the size of the particle");
    if (look.color.rgba != Eigen::Vector4f::Ones() || !look.color_over_age.empty() ||
        !look.temperature_over_age.empty())
      warn(path + (look.color_over_age.empty() ? "/color" : "/color_over_age"),
           "has no effect: a mesh has the colour of its material");
  }
  void check_look(const ParticleLook& look, const std::string& path) {
    if (look.style == LookStyle::sphere) {
      const bool fades =
          look.color.rgba.w() < 1 ||
          std::ranges::any_of(look.color_over_age, [](const auto& key) { return key.second.rgba.w() < 1; });
      if (fades) warn(path + "/color", "alpha has no effect: spheres are opaque");
      if (look.additive.value_or(false)) warn(path + "/additive", "has no effect: spheres are opaque");
    } else if (look.metallic || look.roughness) {
      warn(path + (look.metallic ? "/metallic" : "/roughness"), "has no effect: it is for spheres only");
    }
    check_pictures(look, path);
    if (look.style == LookStyle::mesh) check_mesh(look, path);
    check_ages(look.color_over_age, path + "/color_over_age");
    check_ages(look.temperature_over_age, path + "/temperature_over_age");
    check_ages(look.size_over_age, path + "/size_over_age");
  }
  void check_group(const ParticleGroup& group) {
    check_look(group.look, group.where.path + "/look");
    check_lifetime(group.where.path, group.appear_at, group.remove_at);
    for (std::size_t i = 0; i < group.places.size(); ++i)
      if (const auto problem = outside(scene_, group.places[i].position)) {
        // The points of a file have no places in the scene.
        if (!group.file.empty()) return fail(group.where.path + "/file", "a point " + *problem);
        fail(group.where.path + "/places" + step(i) + "/position", *problem);
      }
  }

  // --- Emitters ---

  void check_source(const ParticleSource& source) {
    const std::string& path = source.where.path;
    check_look(source.look, path + "/look");
    if (effects::upper_bound(source.radius) < kSmallest)
      fail(path + "/radius", fmt::format("must be at least {:g} m", kSmallest));
    check_lifespan(source);
    const sim::ParticleSystemDef& b = source.behaviour;
    const bool hits = b.collides || b.internal || b.external;
    if (!source.on_collision.empty() && !hits)
      warn(path + "/on_collision", "has no effect: its particles do not collide");
    if (b.rotates && !hits) warn(path + "/rotates", "has no effect: its particles do not collide");
    if (b.dies_on_hit && !hits) warn(path + "/dies_on_hit", "has no effect: its particles do not collide");
  }

  /// Reports ages that no particle reaches.
  void check_lifespan(const ParticleSource& source) {
    const std::string& path = source.where.path;
    const Real longest = effects::upper_bound(source.lifespan);
    const auto check_age = [&](Real age, const std::string& where, const char* what) {
      if (age >= longest)
        fail(path + where, fmt::format("is {:g} s, but the lifespan is at most {:g} s, so particles never "
                                       "{}; it must be less than the lifespan",
                                       age, longest, what));
    };
    const auto is_usual = [](const effects::Varying& delay) {
      return delay.index() == 0 && std::get<0>(delay) == std::get<0>(effects::SplitDef().delay);
    };
    if (source.split && source.split->delay_steps > 0 && !is_usual(source.split->delay))
      fail(path + "/split/delay", "is replaced by \"delay_steps\"; remove one of them");
    if (source.split && source.split->enabled && effects::upper_bound(source.split->count) >= 0.5)
      check_age(effects::lower_bound(source.split->age), "/split/age", "split");
    for (std::size_t i = 0; i < source.trails.size(); ++i)
      check_age(source.trails[i].start_age, "/trails" + step(i) + "/start_age", "leave a trail");
    for (std::size_t i = 0; i < source.on_age.size(); ++i)
      check_age(source.on_age[i].age, "/on_age" + step(i) + "/age", "reach that age");
  }

  void check_room(const Emitter& emitter) {
    const Real room = spread_of(emitter.surface), smallest = 2 * effects::lower_bound(emitter.radius);
    if (emitter.overlap) return;
    if (smallest > room) {
      fail(emitter.where.path + "/surface",
           fmt::format("is {} m wide, too small for the smallest particle, {:.3g} m; make it larger, or set "
                       "\"overlap\" to true",
                       room, smallest));
    } else if (2 * effects::upper_bound(emitter.radius) > room) {
      warn(emitter.where.path + "/surface",
           fmt::format(
               "is {} m wide, too small for the largest particles, which will be released late or not at all",
               room));
    }
  }

  void check_emitter(const Emitter& emitter) {
    const std::string& path = emitter.where.path;
    for_each_source(emitter, [&](const ParticleSource& source, const auto&...) { check_source(source); });
    check_room(emitter);
    if (emitter.end <= emitter.start)
      fail(path + "/end", fmt::format("must be later than the start, {} s", emitter.start));
    for (std::size_t i = 0; i < emitter.windows.size(); ++i)
      if (emitter.windows[i].end <= emitter.windows[i].start)
        fail(path + "/windows" + step(i) + "/end", "must be later than the start");
    const bool moves_along = effects::upper_bound(emitter.rate_per_metre) > 0;
    if (moves_along && emitter.body.empty())
      fail(path + "/rate_per_metre",
           "releases particles along the path of a body; the emitter needs a \"body\"");
    if (emitter.recoil && emitter.body.empty())
      fail(path + "/recoil", "pushes a body back; the emitter needs a \"body\"");
    const auto pushed = std::ranges::find(flat_.bodies, emitter.body, &Body::name);
    if (emitter.recoil && pushed != flat_.bodies.end() && pushed->motion != sim::MotionType::dynamic)
      fail(path + "/recoil", "pushes dynamic bodies only, and \"" + emitter.body + "\" is not dynamic");
    if (emitter.inherit_velocity != 1 && emitter.body.empty())
      fail(path + "/inherit_velocity",
           "is a fraction of the velocity of a body; the emitter needs a \"body\"");
    if (const auto* face = std::get_if<FaceSurface>(&emitter.surface);
        face && !emitter.body.empty() && (!face->position.isZero(0) || face->size != Vec3::Ones()))
      fail(
          path + "/surface",
          "has the faces of the emitter's body; \"position\" and \"size\" are for an emitter without a body");
    check_count(emitter);
  }

  void check_count(const Emitter& emitter) {
    const int copies = copy_count(emitter.placement);
    bool refused = false;  // after an error, the child particles are not checked
    bound_sources(emitter, film_end(scene_),
                  [&](const ParticleSource& source, const std::string&, const SourceBound& bound) {
                    if (!refused) refused = check_bound(emitter, source, bound, copies);
                  });
    too_many_ = too_many_ || refused;
  }

  /// Reports an error or warnings about the number of particles of a source. Returns whether there is an
  /// error.
  bool check_bound(const Emitter& emitter, const ParticleSource& source, const SourceBound& bound,
                   int copies) {
    const std::string& path = source.where.path;
    const bool is_emitter = &source == static_cast<const ParticleSource*>(&emitter);
    const auto possible = static_cast<Real>(bound.possible.alive);
    if (possible * copies > kMostParticles) {
      fail(path, fmt::format("could have {:.3g} particles at once, more than the limit of {:.3g}; reduce {}",
                             possible * copies, kMostParticles,
                             source.split ? "the count or depth of the split, rate, count or lifespan"
                                          : "rate, count or lifespan"));
      return true;
    }
    if (is_emitter && bound.possible.born == 0 && !(effects::upper_bound(emitter.rate_per_metre) > 0))
      warn(path,
           "releases no particles: rate, count and bursts are zero, or their times are outside the film");
    else if (possible > kTolerance * static_cast<Real>(source.max_alive))
      warn(path + "/max_alive",
           fmt::format("may prevent releases: up to {:.3g} particles could exist at once, {} are allowed",
                       possible, source.max_alive));
    return false;
  }

  void check_sum() {
    Real sum = 0;
    for (const ParticleBound& bound : particle_bounds(flat_)) sum += static_cast<Real>(bound.alive);
    if (sum > kMostParticles)
      fail("/emitters",
           fmt::format("together could have {:.3g} particles at once, more than the limit of {:.3g}", sum,
                       kMostParticles));
  }

  const Scene& scene_;
  const Scene& flat_;
  bool too_many_ = false;
};

}  // namespace

void check_particles(const Scene& scene, const Scene& flat, Findings& findings) {
  ParticleChecker(scene, flat, findings).run();
}

std::vector<std::string> particle_names(const Scene& scene) {
  std::vector<std::string> names;
  for (const ParticleGroup& group : scene.particles) names.push_back(group.name);
  for (const Emitter& emitter : scene.emitters)
    for_each_source(emitter, [&](const ParticleSource&, const ParticleSource*, const std::string& name,
                                 const Emission&) { names.push_back(name); });
  return names;
}

std::vector<ParticleBound> particle_bounds(const Scene& scene) {
  std::vector<ParticleBound> bounds;
  for (const ParticleGroup& group : scene.particles) bounds.push_back({group.name, group.places.size()});
  for (const Emitter& emitter : scene.emitters)
    bound_sources(emitter, film_end(scene),
                  [&](const ParticleSource&, const std::string& name, const SourceBound& bound) {
                    bounds.push_back({name, bound.alive});
                  });
  return bounds;
}

}  // namespace offstage::producer
