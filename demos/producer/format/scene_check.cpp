#include "producer/format/scene_check.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <string>

#include <fmt/format.h>

#include "producer/base/shipped_files.h"
#include "producer/base/suggest.h"
#include "producer/build/body_shapes.h"
#include "producer/format/scene_check_cloths.h"
#include "producer/format/scene_check_film.h"
#include "producer/format/scene_check_joints.h"
#include "producer/format/scene_check_particles.h"
#include "producer/format/scene_checker.h"
#include "producer/format/spring_net.h"
#include "sim/geometry/mass_properties.h"

namespace offstage::producer {
namespace {

constexpr Real kUnlimited = std::numeric_limits<Real>::infinity();

/// Returns the mass that resists a force on a body [kg]: infinity for a body that is not dynamic, and nothing
/// for a mesh, because model files are not read here.
std::optional<Real> mass_of(const Body& body) {
  if (body.motion != sim::MotionType::dynamic) return kUnlimited;
  if (body.mass > 0) return body.mass;
  if (std::holds_alternative<sim::Plane>(body.shape)) return 0;
  const auto mass = mass_by_shape(body);
  return mass ? std::optional(mass->mass) : std::nullopt;
}

class Checker : SceneChecker {
 public:
  Checker(const Scene& scene, const Scene& flat, const SceneFolder& folder, Findings& findings)
      : SceneChecker(scene, flat, folder, findings) {
    systems_ = particle_names(flat);
    for (const std::string& name : particle_names(scene))
      if (std::ranges::find(systems_, name) == systems_.end()) systems_.push_back(name);
  }

  void run() {
    check_names();
    check_algorithms();
    check_materials();
    check_contact_rules();
    for (const Body& body : scene_.bodies) check_body(body);
    check_particles(scene_, flat_, findings_);
    check_cloths(scene_, flat_, folder_, findings_);
    check_joints(scene_, flat_, findings_);
    for (const Emitter& emitter : scene_.emitters) check_emitter(emitter);
    for (const Spring& spring : scene_.springs) check_spring(spring);
    check_spring_net();
    for (const Force& force : scene_.forces)
      std::visit(
          [&](const auto& f) {
            // An empty path means that the type of the force was invalid, so that it was not read.
            if (!f.where.path.empty()) check_force(f);
          },
          force);
    check_film(scene_, flat_, folder_, findings_);
  }

 private:
  // --- Choices of algorithms that have no effect together ---

  void check_algorithms() {
    const WorldSettings& w = scene_.world;
    const sim::CollisionMethods &c = w.collision, usual = {};
    if (c.cell_factor != usual.cell_factor && c.broad_phase != sim::CollisionMethods::BroadPhase::grid)
      fail("/world/collision/cell_factor",
           "is for \"broad_phase\": \"grid\"; \"multi_grid\" chooses its cells by the size of each body");
    if (w.particle_cluster != WorldSettings().particle_cluster &&
        w.particle_contacts != sim::ParticleContactMethod::lcp)
      fail("/world/particle_cluster", "is for \"particle_contacts\": \"lcp\"");
    std::size_t meshes = 0;
    for (const Body& body : flat_.bodies) meshes += is_mesh(body);
    if (c.mesh_pairs != usual.mesh_pairs && meshes < 2)
      fail("/world/collision/mesh_pairs",
           fmt::format("has no effect: it needs two bodies with the shape of a mesh; there {} {}",
                       meshes == 1 ? "is" : "are", meshes));
    if (c.trees != usual.trees && meshes == 0)
      fail("/world/collision/trees", "has no effect: no body has the shape of a mesh or a compound");
    if (c.tree_split != usual.tree_split && meshes == 0)
      fail("/world/collision/tree_split", "has no effect: no body has the shape of a mesh or a compound");
    if (w.solver != sim::SolverKind::lcp) return;
    for (const Material& m : scene_.materials)
      if (m.rolling_friction > 0 || m.spinning_friction > 0)
        warn("/world/solver",
             "\"lcp\" has no rolling and spinning friction; the exact solver takes over groups "
             "of bodies with the material '" +
                 m.name + "'");
  }

  // --- Names and references ---

  void check_names() {
    check_unique(scene_.materials);
    check_unique(flat_.bodies, flat_.cloths);  // the columns `object` of traces name both
    check_unique(scene_.springs);
    std::vector<NamedForce> forces;
    for (const Force& force : scene_.forces) forces.push_back(named(force));
    check_unique(forces);
  }

  void check_material_name(const std::string& path, const std::string& name) {
    used_materials_.insert(name);
    if (!name.empty() && !find_named(scene_.materials, name))
      fail(path, "there is no material '" + name + "'" + suggestion(name, names_of(scene_.materials)));
  }
  /// Checks the file of a model. The file is in a folder of the scene, or it comes with offstage.
  void check_model(const std::string& path, const std::string& file) {
    const std::string wrong = file.empty() ? "" : folder_.wrong_file(model_file(file, folder_));
    if (!wrong.empty()) fail(path, wrong);
  }
  void check_part_materials(const Shape& shape) {
    if (const auto* compound = std::get_if<Compound>(&shape))
      for (const CompoundPart& part : compound->parts)
        check_material_name(part.where.path + "/material", part.material);
  }
  void check_texture(const Material& material) {
    check_file(material.where.path + "/texture", material.texture);
    const bool triplanar = material.texture_projection == TextureProjection::triplanar;
    for (const Cloth& cloth : scene_.cloths)
      if (triplanar && cloth.material == material.name)
        fail(material.where.path + "/texture_projection",
             "the cloth '" + cloth.name + "' has this material; \"triplanar\" is for bodies");
    const char* key = triplanar                         ? "/texture_projection"
                      : material.texture_scale != 1     ? "/texture_scale"
                      : material.texture_angle_deg != 0 ? "/texture_angle_deg"
                                                        : nullptr;
    if (key && material.texture.empty())
      warn(material.where.path + key, "has no effect: the material has no \"texture\"");
  }
  void check_materials() {
    for (const Material& material : scene_.materials) check_texture(material);
    for (const Body& body : scene_.bodies) {
      check_material_name(body.where.path + "/material", body.material);
      check_part_materials(body.shape);
    }
    for (const Spring& spring : scene_.springs)
      check_material_name(spring.where.path + "/material", spring.material);
    for (const Cloth& cloth : scene_.cloths)
      check_material_name(cloth.where.path + "/material", cloth.material);
    for (const Cloth& cloth : scene_.cloths)
      for (const ClothCord& cord : cloth.cords)
        check_material_name(cord.where.path + "/material", cord.material);
    for (const Joint& joint : scene_.joints)
      check_material_name(joint.where.path + "/material", joint.material);
    check_materials_of_articulations();
    for (const ParticleGroup& group : scene_.particles) {
      check_look(group.where.path + "/look", group.look);
      check_file(group.where.path + "/file", group.file);
    }
    for (const Emitter& emitter : scene_.emitters)
      for_each_source(emitter, [&](const ParticleSource& source, const auto&...) {
        check_look(source.where.path + "/look", source.look);
      });
    for (const Material& material : scene_.materials)
      if (!used_materials_.contains(material.name))
        warn(material.where.path, "the material '" + material.name + "' is not used");
      else
        check_cross_friction(material);
  }
  /// Checks the files and the material of a look.
  void check_look(const std::string& path, const ParticleLook& look) {
    check_file(path + "/texture", look.texture);
    if (!look.mesh) return;
    check_material_name(path + "/mesh/material", look.mesh->material);
    check_part_materials(look.mesh->shape);
    if (const auto wrong = problem(look.mesh->shape)) fail(path + "/mesh/shape" + wrong->key, wrong->what);
    if (const auto* mesh = std::get_if<MeshFile>(&look.mesh->shape)) {
      check_model(path + "/mesh/shape/file", mesh->file);
      if (mesh->decomposition)
        fail(path + "/mesh/shape/decomposition", "is for bodies; particles have no convex parts");
    }
  }
  /// Checks `cross_friction`, which has an effect only if a body with a `friction_axis` has the material.
  void check_cross_friction(const Material& material) {
    bool any = false;
    for (const Body& body : scene_.bodies) any = any || (body.material == material.name && has_grain(body));
    if (material.cross_friction && !any)
      warn(material.where.path + "/cross_friction",
           "has no effect: no body of this material has a friction_axis");
    if (any && material.cross_friction.value_or(0) > 0 && material.friction == 0)
      fail(material.where.path + "/cross_friction",
           "needs a \"friction\" above 0, such as 0.001: friction across the axis is a multiple of friction "
           "along it");
  }
  static bool has_grain(const Body& body) { return !body.friction_axis.isZero(0); }

  void check_contact_rules() {
    std::map<std::pair<std::string, std::string>, std::string> owners;
    for (const ContactRule& rule : scene_.contacts) {
      const std::string& path = rule.where.path;
      const auto& [a, b] = rule.materials;
      if (a.empty() || b.empty()) continue;  // reported by another check
      for (std::size_t i = 0; i < 2; ++i)
        if (const std::string& name = rule.materials[i]; !find_named(scene_.materials, name))
          fail(path + "/materials" + step(i),
               "there is no material '" + name + "'" + suggestion(name, names_of(scene_.materials)));
      const auto [it, fresh] = owners.emplace(std::minmax(a, b), path);
      if (!fresh)
        fail(path + "/materials", "are the same pair as in " + it->second + "; remove one of the two rules");
      if (!rule.restitution && !rule.friction && !rule.static_friction && !rule.rolling_friction &&
          !rule.spinning_friction)
        warn(path, "has no effect: it has neither restitution nor friction");
    }
  }

  // --- Bodies ---

  void check_body(const Body& body) {
    const std::string& path = body.where.path;
    const bool dynamic = body.motion == sim::MotionType::dynamic,
               kinematic = body.motion == sim::MotionType::kinematic;
    if (const MeshFile* mesh = std::get_if<MeshFile>(&body.shape))
      check_model(path + "/shape/file", mesh->file);
    if (body.model) check_model(path + "/model/file", body.model->file);
    check_animation(body);
    if (dynamic && std::holds_alternative<sim::Plane>(body.shape))
      fail(path + "/shape", "a plane cannot be dynamic; give the body \"motion\": \"static\"");
    if (!kinematic && !body.keyframes.empty())
      fail(path + "/keyframes",
           "only kinematic bodies follow keyframes; give the body \"motion\": \"kinematic\"");
    if (!kinematic && !body.spin.isZero(0))
      fail(path + "/spin", "only kinematic bodies have a spin; give the body \"motion\": \"kinematic\"");
    if (const auto wrong = problem(body.shape)) fail(path + "/shape" + wrong->key, wrong->what);
    if (!body.inertia && !body.inertia_products.isZero(0))
      fail(path + "/inertia_products", "need \"inertia\"");
    if (!dynamic && (body.centre || body.inertia))
      warn(path + (body.centre ? "/centre" : "/inertia"), "has no effect: the body is not dynamic");
    check_lifetime(path, body.appear_at, body.remove_at);
    check_times(body.keyframes, path + "/keyframes");
    check_place(body.position, path + "/position");
    if (!dynamic && !body.velocity.isZero(0))
      warn(path + "/velocity", "has no effect: the body is not dynamic");
    if (!dynamic && !body.angular_velocity.isZero(0))
      warn(path + "/angular_velocity", "has no effect: the body is not dynamic");
    if (body.mass > 0 && body.density != Body{}.density)
      warn(path + "/density", "has no effect: \"mass\" is given");
    if (body.bevel && (body.model || !has_box(body.shape)))
      warn(path + "/bevel", "has no effect: the body is not drawn as a box");
    const Material* material = find_named(scene_.materials, body.material);
    if (has_grain(body) && !(material && material->cross_friction))
      warn(path + "/friction_axis", "has no effect: the body's material has no cross_friction");
  }

  static bool has_box(const Shape& shape) {
    if (std::holds_alternative<sim::Box>(shape)) return true;
    const auto* compound = std::get_if<Compound>(&shape);
    return compound && std::ranges::any_of(compound->parts, [](const CompoundPart& part) {
             return std::holds_alternative<sim::Box>(part.shape);
           });
  }

  void check_animation(const Body& body) {
    if (!body.animation) return;
    const std::string path = body.where.path + "/animation";
    const MeshFile* shape = std::get_if<MeshFile>(&body.shape);
    if (!body.model && !shape)
      return fail(path, "needs a model file: as the body's `model`, or as its shape");
    if (!body.model && body.motion == sim::MotionType::dynamic)
      fail(path,
           "the parts of a dynamic body cannot be moved by an animation; make the body kinematic, or give it "
           "a simple "
           "shape and draw the file as its `model`");
    if (body.has_animated_shape() && shape->decomposition)
      fail(body.where.path + "/shape/decomposition",
           "has no effect: each moving part of an animated model is divided on its own");
    const std::string& file = body.model ? body.model->file : shape->file;
    if (file.find('#') != std::string::npos)
      fail(path, fmt::format("needs a whole file, but '{}' selects one node; omit #NODE", file));
  }

  void check_place(const Vec3& position, const std::string& path) {
    if (const auto problem = outside(scene_, position)) fail(path, *problem);
  }

  void check_emitter(const Emitter& emitter) {
    const std::string& path = emitter.where.path;
    if (!emitter.body.empty()) check_body_name(path + "/body", emitter.body);
    if (const auto* mesh = std::get_if<MeshSurface>(&emitter.surface))
      check_model(path + "/surface/file", mesh->file);
  }

  // --- Springs ---

  /// Returns the mass at an end of a spring [kg]; nothing if the mass is unknown or invalid.
  std::optional<Real> check_end(const SpringEnd& end, const std::string& path) {
    if (!end.body.empty() && !end.particles.empty()) {
      fail(path, "must name a body or a particle, not both");
      return {};
    }
    if (end.particles.empty()) {
      if (end.index != 0) warn(path + "/index", "has no effect: this end is not at a particle");
      if (end.body.empty()) return kUnlimited;
      check_body_name(path + "/body", end.body);
      const auto body = bodies_.find(end.body);
      return body == bodies_.end() ? std::nullopt : mass_of(*body->second);
    }
    if (!end.position.isZero(0))
      warn(path + "/position", "has no effect: this end is at a particle, which has its own position");
    const ParticleGroup* group = find_named(scene_.particles, end.particles);
    if (!group) {
      fail(path + "/particles", "there are no particles '" + end.particles + "'" +
                                    suggestion(end.particles, names_of(scene_.particles)));
      return {};
    }
    if (static_cast<std::size_t>(end.index) < group->places.size()) return group->mass;
    fail(path + "/index", fmt::format("must be less than {}, the number of particles of '{}', got {}",
                                      group->places.size(), group->name, end.index));
    return {};
  }

  /// Checks the materials of bodies that articulations made. These bodies exist only in the flat scene.
  void check_materials_of_articulations() {
    std::set<std::pair<std::string, std::string>> seen;
    for (const Body& body : flat_.bodies)
      if (body.where.path.starts_with("/articulations/") && !body.material.empty() &&
          seen.emplace(body.where.path, body.material).second)
        check_material_name(body.where.path, body.material);
  }

  void check_spring(const Spring& spring) {
    const std::string& path = spring.where.path;
    const auto a = check_end(spring.a, path + "/a"), b = check_end(spring.b, path + "/b");
    if (!spring.a.particles.empty() && spring.a.particles == spring.b.particles &&
        spring.a.index == spring.b.index)
      fail(path, "has the same particle at both ends");
    if (!a || !b || *a <= 0 || *b <= 0) return;
    if (std::isinf(*a) && std::isinf(*b)) return warn(path, "has no effect: neither end can move");
    // Stability of a single spring between two point masses. Ends away from a centre of mass only reduce the
    // stable step, so a spring that fails here fails in the scene; see also check_spring_net().
    const Real reduced = 1 / (1 / *a + 1 / *b);
    check_stiffness(spring.stiffness, reduced, path, "the spring '" + spring.name + "'");
  }
  void check_stiffness(Real stiffness, Real mass, const std::string& path, const std::string& what) {
    const Real largest = largest_stable_step(scene_.world.integrator, stiffness, mass);
    const Real used = sub_step();
    if (used >= largest)
      fail(path, fmt::format(
                     "{} is too stiff for this sub-step: /world/step must be less than {:.3g} s, is {:.3g} s",
                     what, 0.995 * largest, used));
  }

  /// Adds a valid spring to `net`, unless an end of it is at a joint, which makes the body heavier along some
  /// directions, or exists only for a time.
  void add_to_net(std::size_t index, const std::set<std::string>& jointed, SpringNet& net) const {
    const Spring& spring = scene_.springs[index];
    std::array<SpringNet::End, 2> ends;
    for (const auto& [end, out] : {std::pair(&spring.a, &ends[0]), {&spring.b, &ends[1]}}) {
      *out = {"", kUnlimited, end->position};
      if (!end->particles.empty()) {
        const ParticleGroup* group = find_named(scene_.particles, end->particles);
        const auto place = static_cast<std::size_t>(end->index);
        if (!group || place >= group->places.size() || group->appear_at > 0 || group->remove_at < kForever)
          return;
        *out = {group->name + step(place), group->mass, group->places[place].position};
      } else if (!end->body.empty()) {
        const auto it = bodies_.find(end->body);
        if (it == bodies_.end()) return;
        const Body& body = *it->second;
        const auto mass = mass_of(body);
        if (!mass || !(*mass > 0) || body.appear_at > 0 || body.remove_at < kForever) return;
        if (jointed.contains(body.name)) return;
        *out = {body.name, *mass, body.position + body.orientation * end->position};
      }
    }
    net.add(index, ends[0], ends[1], spring.stiffness);
  }

  /// Checks the springs together: several at the same object are stiffer than each of them.
  void check_spring_net() {
    if (!findings_.errors.empty()) return;
    std::set<std::string> jointed;
    for (const Joint& joint : flat_.joints) jointed.insert({joint.a, joint.b});
    SpringNet net;
    for (std::size_t i = 0; i < scene_.springs.size(); ++i) add_to_net(i, jointed, net);
    const SpringNet::Fastest stiffest = net.stiffest();
    const Real largest = largest_stable_step(scene_.world.integrator, stiffest.rate, 1), used = sub_step();
    if (used < largest) return;
    const Spring& spring = scene_.springs[stiffest.spring];
    fail(spring.where.path,
         fmt::format("the spring '{}' and others at the same objects are together too stiff "
                     "for this sub-step: /world/step must be less than {:.3g} s, is {:.3g} s",
                     spring.name, 0.995 * largest, used));
  }
  Real sub_step() const { return std::min(scene_.world.max_step, scene_.output.fps.seconds(1)); }

  // --- Forces ---

  void check_pushed(const std::string& path, const std::string& name, const Body* body) {
    if (body && body->motion != sim::MotionType::dynamic)
      warn(path, "has no effect: the body '" + name + "' is not dynamic");
  }
  void check_pushed(const NamedForce& force, const std::vector<std::string>& bodies) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Body* all_copies = find_named(scene_.bodies, bodies[i]);
      const std::string path = force.where.path + "/bodies" + step(i);
      check_pushed(path, bodies[i], all_copies ? all_copies : named_body(path, bodies[i]));
    }
  }
  void check_period(const NamedForce& force, Real start, Real end) {
    if (end <= start)
      fail(force.where.path + "/end", fmt::format("must be later than the start, {} s", start));
  }
  void check_systems(const NamedForce& force, const std::vector<std::string>& particles) {
    for (std::size_t i = 0; i < particles.size(); ++i)
      if (std::ranges::find(systems_, particles[i]) == systems_.end())
        fail(force.where.path + "/particles" + step(i),
             "there are no particles '" + particles[i] + "'" + suggestion(particles[i], systems_));
  }
  void check_cloth_names(const NamedForce& force, const std::vector<std::string>& cloths) {
    for (std::size_t i = 0; i < cloths.size(); ++i)
      if (!find_named(scene_.cloths, cloths[i]) && !find_named(flat_.cloths, cloths[i]))
        fail(force.where.path + "/cloths" + step(i),
             "there is no cloth '" + cloths[i] + "'" + suggestion(cloths[i], names_of(flat_.cloths)));
  }
  void check_region(const std::string& path, const sim::Region& region, uint32_t drop_rate) {
    if (drop_rate > 0 && std::holds_alternative<sim::Everywhere>(region))
      warn(path + "/drop_rate", "has no effect without a region");
  }
  template <class E>
  void check_force(const FieldOf<E>& field) {
    check_pushed(field, field.bodies);
    check_systems(field, field.particles);
    check_cloth_names(field, field.cloths);
    check_period(field, field.start, field.end);
    check_region(field.where.path, field.region, field.drop_rate);
  }
  template <class E>
  void check_force(const PairForceOf<E>& force) {
    check_systems(force, force.particles);
    check_period(force, force.start, force.end);
    check_region(force.where.path, force.region, force.drop_rate);
    if (force.particles.empty() && !force.where.path.empty())
      warn(force.where.path + "/particles", "has no effect: the list is empty");
  }
  void check_force(const Grab& grab) {
    const std::string& path = grab.where.path;
    check_systems(grab, grab.particles);
    check_cloth_names(grab, grab.cloths);
    if (grab.body.empty() && grab.particles.empty() && grab.cloths.empty())
      fail(path, "needs a \"body\", \"particles\" or \"cloths\"");
    if (!grab.body.empty()) check_pushed(path + "/body", grab.body, named_body(path + "/body", grab.body));
    check_period(grab, grab.start, grab.end);
    if (grab.keyframes.empty()) fail(path, "needs at least one entry in \"keyframes\"");
    check_times(grab.keyframes, path + "/keyframes");
  }
  void check_force(const AppliedForce& force) {
    const std::string& path = force.where.path;
    check_pushed(force, force.bodies);
    if (force.bodies.empty() && !path.empty()) fail(path + "/bodies", "is empty; the force needs a body");
    check_period(force, force.start, force.end);
    check_times(force.keyframes, path + "/keyframes");
    if (!force.keyframes.empty() && (!force.force.isZero(0) || !force.torque.isZero(0)))
      fail(path, "has both \"keyframes\" and a \"force\" or \"torque\"; give one of them");
    if (force.keyframes.empty() && force.force.isZero(0) && force.torque.isZero(0))
      warn(path, "has no effect: it has neither a force nor a torque nor keyframes");
  }
  void check_force(const Explosion& explosion) {
    check_pushed(explosion, explosion.bodies);
    check_systems(explosion, explosion.particles);
    check_cloth_names(explosion, explosion.cloths);
  }

  // --- Overlays ---

  std::vector<std::string> systems_;  // names of particle systems
  std::set<std::string> used_materials_;
};

}  // namespace

Findings check_scene(const Scene& scene, const Scene& flat, const SceneFolder& folder) {
  Findings findings;
  Checker(scene, flat, folder, findings).run();
  return findings;
}

Real largest_stable_step(sim::IntegratorKind integrator, Real k, Real m) {
  // x'' = -(k/m) x: limits of the stability region on the imaginary axis. For the Euler methods, leapfrog and
  // the midpoint rule this is 2; for Runge-Kutta 4 it is 2 sqrt(2). The implicit method has no limit, and the
  // following methods choose their own step.
  if (integrator >= sim::IntegratorKind::implicit_euler) return kUnlimited;
  return (integrator == sim::IntegratorKind::rk4 ? 2 * std::sqrt(2.0) : 2) * std::sqrt(m / k);
}

std::optional<std::string> outside(const Scene& scene, const Vec3& position) {
  if (position.cwiseAbs().maxCoeff() < scene.world.bounds.max().x()) return {};
  return fmt::format("is outside the world, which reaches {:g} m from the origin; enlarge /world/bounds",
                     scene.world.bounds.max().x());
}

}  // namespace offstage::producer
