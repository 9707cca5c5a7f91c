#include "tests/generator/random_scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "effects/cloth.h"
#include "tests/convex_samples.h"
#include "tests/meshes.h"
#include "tests/solids.h"

namespace offstage::sim {
namespace {

constexpr Real kWall = 1;          ///< thickness of the walls [m]
constexpr Real kGap = 0.01;        ///< distance between bodies at the start [m]
constexpr int kTries = 40;         ///< attempts to find a free place
constexpr Real kFrame = 1.0 / 60;  ///< sampling time [s]

/// Makes one scene from a sequence of random numbers.
class Generator {
 public:
  explicit Generator(uint64_t seed) : dice_(seed) { scene_.seed = seed; }

  RandomScene make(Parts parts) {
    make_rules();
    if (scene_.room > 0) make_room();
    const uint32_t count = 2 + dice_.index(11);
    for (uint32_t i = 0; i < count; ++i) add_body();
    if (parts == Parts::bodies) return std::move(scene_);
    if (dice_.chance(0.35)) add_joints();
    if (dice_.chance(0.25)) add_springs();
    if (scene_.room > 0 && dice_.chance(0.15)) add_drive();
    if (scene_.room > 0 && dice_.chance(0.2)) add_particles();
    if (scene_.room > 0 && dice_.chance(0.12)) add_cloth();
    return std::move(scene_);
  }

 private:
  template <class T, std::size_t N>
  T pick(const T (&values)[N]) {
    return values[dice_.index(N)];
  }

  void make_rules() {
    WorldDef& w = scene_.world;
    w.solver = pick({SolverKind::exact, SolverKind::fast, SolverKind::automatic});
    w.max_step = pick({1.0 / 240, 1.0 / 240, 1.0 / 120, 1.0 / 60});
    w.impact = dice_.chance(0.7) ? ImpactLaw::simultaneous : ImpactLaw::sequential;
    w.integrator = dice_.chance(0.8) ? IntegratorKind::rk4 : IntegratorKind::dormand_prince;
    w.sleep = dice_.chance(0.5);
    scene_.room = dice_.chance(0.8) ? dice_.uniform(0.8, 2) : 0;
    if (scene_.room == 0) w.gravity = Vec3::Zero();
    size_ = dice_.uniform(0.08, 0.3);
    restitution_ = pick({0.0, 0.3, 0.5, 0.9, 1.0});
    friction_ = pick({0.0, 0.1, 0.3, 0.5, 1.0});
    thin_ = dice_.chance(0.4);
  }

  BodyDef surface() {
    return {.restitution = dice_.chance(0.8) ? restitution_ : 0.0,
            .friction = dice_.chance(0.8) ? friction_ : 0.5};
  }

  void make_room() {
    const Real r = scene_.room, all = 2 * r + 2 * kWall;
    for (int axis = 0; axis < 3; ++axis)
      for (const Real side : {-1.0, 1.0}) {
        Vec3 size = Vec3::Constant(all);
        size[axis] = kWall;
        RandomScene::Body wall{surface(), {}};
        wall.def.name = "wall" + std::to_string(scene_.bodies.size());
        wall.def.motion = MotionType::static_body;
        wall.def.shape = Box{size};
        wall.def.pose.position = side * (r + kWall / 2) * Vec3::Unit(axis);
        scene_.bodies.push_back(wall);
      }
  }

  /// Returns a place where a ball of radius `reach` overlaps no other body. Returns nothing if no such place
  /// is found; the scene then omits the body.
  std::optional<Vec3> free_place(Real reach) {
    const Real half = (scene_.room > 0 ? scene_.room : 1.2) - reach - kGap;
    if (half <= 0) return std::nullopt;
    for (int i = 0; i < kTries; ++i) {
      const Vec3 at = half * dice_.in_cube();
      if (std::all_of(taken_.begin(), taken_.end(),
                      [&](const Taken& t) { return (t.at - at).norm() > t.reach + reach + kGap; })) {
        taken_.push_back({at, reach});
        return at;
      }
    }
    return std::nullopt;
  }

  /// Extents of a body: compact, or as thin as a fiftieth of its length.
  Vec3 extents() {
    Vec3 e = size_ * Vec3(dice_.uniform(0.5, 1.5), dice_.uniform(0.5, 1.5), dice_.uniform(0.5, 1.5));
    if (!thin_ || dice_.chance(0.5)) return e;
    const int axis = static_cast<int>(dice_.index(3));
    if (dice_.chance(0.5)) {  // plate
      e *= 1.5;
      e[axis] *= dice_.uniform(0.03, 0.2);
    } else {  // rod
      e *= dice_.uniform(0.05, 0.3);
      e[axis] = size_ * dice_.uniform(1, 3);
    }
    return e;
  }

  void add_body() {
    const Vec3 e = extents();
    RandomScene::Body body{surface(), {}};
    BodyDef& d = body.def;
    Real reach = e.norm() / 2;
    switch (dice_.index(7)) {
      case 0:
        d.shape = Sphere{e.x() / 2};
        reach = e.x() / 2;
        break;
      case 1:
        d.shape = Capsule{e.x() / 2, e.y()};
        reach = e.x() / 2 + e.y() / 2;
        break;
      case 2:
        d.shape = Cylinder{e.x() / 2, e.y()};
        break;
      case 3:
        d.shape = Cone{e.x() / 2, e.y()};
        break;
      case 4:
        body.mesh = add_mesh(e);
        reach *= 1.1;
        break;
      default:
        d.shape = Box{e};
    }
    const auto place = free_place(reach);
    if (!place) return;
    d.name = "body" + std::to_string(scene_.bodies.size());
    body.reach = reach;
    d.pose = {*place, dice_.rotation()};
    d.mass = std::pow(10, dice_.uniform(-1.5, 1.5));
    d.velocity = dice_.uniform(0, 6) * dice_.direction();
    d.angular_velocity = dice_.uniform(0, 10) * dice_.direction();
    scene_.bodies.push_back(body);
    movable_.push_back(scene_.bodies.size() - 1);
  }

  /// Adds the mesh of a box or an L about its centre.
  std::size_t add_mesh(const Vec3& e) {
    TriangleMesh mesh = dice_.chance(0.5)
                            ? box_mesh(Vec3::Ones())
                            : cubes(2, 2, 1, [](int i, int j, int) { return i == 0 || j == 0; });
    const bool is_box = mesh.vertices.size() == 8;
    for (Vec3& v : mesh.vertices)
      v = is_box ? Vec3(v.cwiseProduct(e)) : Vec3((v - Vec3(1, 1, 0.5)).cwiseProduct(e) / 2);
    scene_.meshes.push_back(std::move(mesh));
    return scene_.meshes.size() - 1;
  }

  std::size_t any_body() { return movable_[dice_.index(movable_.size())]; }

  /// Connects some of the existing bodies to a chain, each by a joint half-way to the previous one.
  void add_joints() {
    const std::size_t count = std::min<std::size_t>(movable_.size(), 2 + dice_.index(3));
    for (std::size_t i = 1; i < count; ++i) {
      RandomScene::Joint joint;
      joint.a = movable_[i - 1];
      joint.b = movable_[i];
      JointDef& d = joint.def;
      d.name = "joint" + std::to_string(i);
      d.type = pick({JointType::spherical, JointType::revolute, JointType::prismatic, JointType::fixed,
                     JointType::universal, JointType::distance});
      const Vec3 a = scene_.bodies[joint.a].def.pose.position, b = scene_.bodies[*joint.b].def.pose.position;
      d.anchor = d.type == JointType::distance ? a : Vec3((a + b) / 2);
      d.anchor_b = b;
      d.axis = dice_.direction();
      d.second_axis = d.axis.cross(dice_.direction()).normalized();
      if (d.has_free_coordinate()) {
        if (dice_.chance(0.5)) d.damping = dice_.uniform(0, 0.02);
        if (dice_.chance(0.3)) d.friction = dice_.uniform(0, 0.1);
      }
      if (dice_.chance(0.4) && (d.type == JointType::revolute || d.type == JointType::prismatic)) {
        d.lower = -dice_.uniform(0.1, 1);
        d.upper = dice_.uniform(0.1, 1);
      }
      scene_.joints.push_back(joint);
    }
  }

  /// Adds springs between body centres that are soft enough for all integrators at the longest step.
  void add_springs() {
    const uint32_t count = 1 + dice_.index(3);
    for (uint32_t i = 0; i < count && !movable_.empty(); ++i) {
      RandomScene::Spring spring;
      spring.a = any_body();
      if (movable_.size() > 1 && (scene_.room == 0 || dice_.chance(0.7))) do
          spring.b = any_body();
        while (*spring.b == spring.a);
      Real mass = scene_.bodies[spring.a].def.mass;
      if (spring.b) mass = std::min(mass, scene_.bodies[*spring.b].def.mass);
      const Real omega = dice_.uniform(3, 15);
      spring.def.name = "spring" + std::to_string(i);
      spring.def.stiffness = mass * omega * omega;
      spring.def.damping = dice_.chance(0.5) ? 0.2 * mass * omega : 0;
      if (!spring.b) spring.def.b = WorldPoint{0.5 * scene_.room * dice_.in_cube()};
      scene_.springs.push_back(spring);
    }
  }

  /// Adds a rotating paddle or a box that moves back and forth in the middle of the room's floor.
  void add_drive() {
    scene_.is_driven = true;
    RandomScene::Body drive{surface(), {}};
    BodyDef& d = drive.def;
    d.name = "drive";
    d.motion = MotionType::kinematic;
    const Real r = scene_.room;
    d.pose.position = Vec3(0, -r + 0.08, 0);
    d.shape = Box{Vec3(r, 0.1, 0.1)};
    if (dice_.chance(0.5)) {
      d.track.spin = Vec3(0, dice_.uniform(0.5, 4), 0);
    } else {
      const Pose at = d.pose, to{at.position + Vec3(0, 0, 0.6 * r), at.orientation};
      d.track.keys = {{0, at}, {dice_.uniform(0.5, 2), to}};
    }
    const Real reach = std::hypot(r, 0.1) / 2 + 0.6 * r;
    const bool is_free = std::all_of(taken_.begin(), taken_.end(), [&](const Taken& t) {
      return (t.at - d.pose.position).norm() > t.reach + reach + kGap;
    });
    if (is_free) scene_.bodies.push_back(drive);
  }

  void add_particles() {
    ParticleSystemDef& d = scene_.particle_system;
    d.name = "particles";
    d.internal = dice_.chance(0.3);
    const uint32_t count = 5 + dice_.index(40);
    const Real radius = 0.02;
    for (uint32_t i = 0; i < count; ++i)
      if (const auto place = free_place(radius))
        scene_.particles.push_back({.position = *place,
                                    .velocity = dice_.uniform(0, 4) * dice_.direction(),
                                    .mass = 0.01,
                                    .radius = radius,
                                    .restitution = restitution_,
                                    .friction = friction_});
  }

  void add_cloth() {
    const Real side = 0.4;
    const auto place = free_place(side);
    if (!place) return;
    const effects::GridSize grid{side, side, 8, 8};
    scene_.cloth =
        effects::grid_cloth(grid, {*place, dice_.rotation()}, effects::find_fabric("cotton")->fabric);
    scene_.cloth->name = "cloth";
    scene_.cloth->air.density = 0;
    if (dice_.chance(0.5))
      for (const uint32_t column : {0u, 8u}) {
        const uint32_t vertex = effects::grid_vertex(grid, column, 0);
        scene_.cloth->pins.push_back({.vertex = vertex, .position = scene_.cloth->vertices[vertex]});
      }
  }

  struct Taken {
    Vec3 at;
    Real reach;
  };
  Dice dice_;
  RandomScene scene_;
  std::vector<Taken> taken_;
  std::vector<std::size_t> movable_;
  Real size_ = 0, restitution_ = 0, friction_ = 0;
  bool thin_ = false;
};

std::string text(const Vec3& v) {
  std::ostringstream out;
  out.precision(17);
  out << '[' << v.x() << ", " << v.y() << ", " << v.z() << ']';
  return out.str();
}

std::string text(const Quat& q) {
  std::ostringstream out;
  out.precision(17);
  out << '[' << q.w() << ", " << q.x() << ", " << q.y() << ", " << q.z() << ']';
  return out.str();
}

std::string text(const Shape& shape) {
  std::ostringstream out;
  out.precision(17);
  const auto round = [&](const char* name, Real radius, Real height) {
    out << "{\"type\": \"" << name << "\", \"radius\": " << radius << ", \"height\": " << height << '}';
  };
  if (const auto* box = std::get_if<Box>(&shape))
    out << "{\"type\": \"box\", \"size\": " << text(box->size) << '}';
  if (const auto* s = std::get_if<Sphere>(&shape))
    out << "{\"type\": \"sphere\", \"radius\": " << s->radius << '}';
  if (const auto* s = std::get_if<Capsule>(&shape)) round("capsule", s->radius, s->height);
  if (const auto* s = std::get_if<Cylinder>(&shape)) round("cylinder", s->radius, s->height);
  if (const auto* s = std::get_if<Cone>(&shape)) round("cone", s->radius, s->height);
  return out.str();
}

/// Meshes of one kind differ only in the corners of their bounding boxes.
std::string text(const TriangleMesh& mesh) {
  Vec3 size = Vec3::Zero();
  for (const Vec3& v : mesh.vertices) size = size.cwiseMax(2 * v.cwiseAbs());
  return "{\"type\": \"mesh\", \"vertices\": " + std::to_string(mesh.vertices.size()) +
         ", \"size\": " + text(size) + '}';
}

const char* name_of(SolverKind kind) {
  return kind == SolverKind::exact ? "exact" : kind == SolverKind::fast ? "fast" : "auto";
}

const char* name_of(JointType type) {
  constexpr std::array kNames = {"spherical", "fixed", "revolute", "prismatic", "universal", "distance"};
  return kNames[static_cast<std::size_t>(type)];
}

}  // namespace

RandomScene random_scene(uint64_t seed, Parts parts) {
  return Generator(seed).make(parts);
}

std::string text(const RandomScene& scene) {
  std::ostringstream out;
  out.precision(17);
  const WorldDef& w = scene.world;
  out << "// seed " << scene.seed << ", " << scene.duration << " s"
      << (scene.room > 0 ? ", room of " + std::to_string(2 * scene.room) + " m" : std::string(", no room"))
      << '\n'
      << "\"world\": {\"solver\": \"" << name_of(w.solver) << "\", \"step\": " << w.max_step
      << ", \"gravity\": " << text(w.gravity) << ", \"impact\": \""
      << (w.impact == ImpactLaw::sequential ? "sequential" : "simultaneous")
      << "\", \"sleep\": " << (w.sleep ? "true" : "false") << "}\n";
  for (const RandomScene::Body& body : scene.bodies) {
    const BodyDef& d = body.def;
    out << "{\"name\": \"" << d.name << "\", \"motion\": \""
        << (d.motion == MotionType::static_body ? "static"
            : d.motion == MotionType::kinematic ? "kinematic"
                                                : "dynamic")
        << "\", \"shape\": " << (body.mesh ? text(scene.meshes[*body.mesh]) : text(d.shape))
        << ", \"position\": " << text(d.pose.position) << ", \"orientation\": " << text(d.pose.orientation)
        << ", \"mass\": " << d.mass << ", \"velocity\": " << text(d.velocity)
        << ", \"angular_velocity\": " << text(d.angular_velocity) << ", \"restitution\": " << d.restitution
        << ", \"friction\": " << d.friction << "}\n";
  }
  for (const RandomScene::Joint& joint : scene.joints)
    out << "{\"name\": \"" << joint.def.name << "\", \"type\": \"" << name_of(joint.def.type)
        << "\", \"a\": \"" << scene.bodies[joint.a].def.name << "\", \"b\": \""
        << (joint.b ? scene.bodies[*joint.b].def.name : "") << "\", \"anchor\": " << text(joint.def.anchor)
        << ", \"axis\": " << text(joint.def.axis) << ", \"lower\": " << joint.def.lower
        << ", \"upper\": " << joint.def.upper << "}\n";
  for (const RandomScene::Spring& spring : scene.springs)
    out << "{\"name\": \"" << spring.def.name << "\", \"a\": \"" << scene.bodies[spring.a].def.name
        << "\", \"b\": \"" << (spring.b ? scene.bodies[*spring.b].def.name : "")
        << "\", \"stiffness\": " << spring.def.stiffness << ", \"damping\": " << spring.def.damping << "}\n";
  out << "// " << scene.particles.size() << " particles, " << (scene.cloth ? 1 : 0) << " cloths\n";
  return out.str();
}

World make_world(const RandomScene& scene) {
  World world(scene.world);
  std::vector<MeshHandle> meshes;
  for (const TriangleMesh& mesh : scene.meshes) meshes.push_back(world.add_mesh(mesh));
  std::vector<BodyHandle> bodies;
  for (const RandomScene::Body& body : scene.bodies) {
    BodyDef def = body.def;
    if (body.mesh) def.shape = MeshShape{meshes[*body.mesh]};
    bodies.push_back(world.add_body(def));
  }
  for (const RandomScene::Joint& joint : scene.joints) {
    JointDef def = joint.def;
    def.a = bodies[joint.a];
    if (joint.b) def.b = bodies[*joint.b];
    world.add_joint(def);
  }
  for (const RandomScene::Spring& spring : scene.springs) {
    SpringDef def = spring.def;
    def.a = BodyPoint{bodies[spring.a]};
    if (spring.b) def.b = BodyPoint{bodies[*spring.b]};
    world.add_spring(def);
  }
  if (!scene.particles.empty()) {
    const ParticleSystemHandle system = world.add_particle_system(scene.particle_system);
    for (const Particle& particle : scene.particles) world.add_particle(system, particle);
  }
  if (scene.cloth) world.add_cloth(*scene.cloth);
  return world;
}

namespace {

/// Total momentum and angular momentum of all moving objects, and the sums of the magnitudes of their parts.
struct Momenta {
  Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
  Real linear_size = 0, angular_size = 0;

  explicit Momenta(const World& world) {
    world.for_each_body([&](BodyHandle handle) {
      const BodyState s = world.body(handle);
      linear += s.mass * s.velocity;
      angular += s.centre.cross(s.mass * s.velocity) + s.angular_momentum;
      linear_size += s.mass * s.velocity.norm();
      angular_size += s.centre.norm() * s.mass * s.velocity.norm() + s.angular_momentum.norm();
    });
  }
};

/// The allowed penetration of bodies, derived from their motion. Both solvers treat the places where two
/// bodies touch, or may touch, as points with constant velocity, and stop these to within kSolved. A point at
/// distance R from the centre of a body that turns by the angle w h in a sub-step deviates from its tangent
/// by R (w h)^2 / 2, at most by the piece length of the collision detection, a quarter of the body; two
/// bodies may penetrate by as much. Each sub-step removes a fifth of the penetration, so the remainders of
/// earlier sub-steps accumulate. If the limit of trace-backs in a sub-step was reached, or bodies spin fast,
/// two bodies may also penetrate by their relative motion in the sub-step.
class Overlap {
 public:
  Overlap(const RandomScene& scene, std::span<const BodyHandle> bodies) : scene_(scene), bodies_(bodies) {}

  /// Called after each step.
  void add(const World& world, const StepReport& report) {
    const Real h = kFrame / static_cast<Real>(report.substeps);
    Motions now;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const RandomScene::Body& body = scene_.bodies[i];
      if (body.def.motion == MotionType::static_body) continue;
      const Motion motion = world.body_motion(bodies_[i], world.time());
      const Real angle = h * motion.angular_velocity.norm();
      const bool is_ball = !body.mesh && std::holds_alternative<Sphere>(body.def.shape);
      now.add(is_ball ? 0 : body.reach * std::min(angle * angle / 2, kPiece),
              motion.velocity.norm() + angle / h * body.reach);
    }
    const Real turning = std::max(now.turning(), before_.turning()),
               speed = std::max(now.speed(), before_.speed());
    before_ = now;
    Real added = kSolved + turning;
    if (report.impacts.toi_limit_reached + report.impacts.restitution_suppressed > 0) added += h * speed;
    for (uint64_t i = 0; i < report.substeps; ++i) left_ = (1 - kPushedOut) * left_ + added;
  }
  Real allowed() const { return left_; }

 private:
  static constexpr Real kSolved = 5e-4, kPiece = 0.25, kPushedOut = 0.2;

  /// The greatest and the second greatest value of all bodies.
  struct GreatestTwo {
    Real first = 0, second = 0;
    void add(Real x) {
      if (x > first) std::swap(x, first);
      second = std::max(second, x);
    }
    Real sum() const { return first + second; }
  };
  struct Motions {
    GreatestTwo turns, speeds;
    void add(Real turn, Real speed) {
      turns.add(turn);
      speeds.add(speed);
    }
    Real turning() const { return turns.sum(); }
    Real speed() const { return speeds.sum(); }
  };

  const RandomScene& scene_;
  std::span<const BodyHandle> bodies_;
  Motions before_;
  Real left_ = 0;
};

/// Returns the counted work of a step, in solver operations on the contacts of the scene.
uint64_t counted_work(const StepReport& r) {
  return r.solvers.exact.iterations + r.solvers.exact.factorizations + r.solvers.impacts.iterations +
         r.solvers.impacts.factorizations + 50 * r.impacts.tracebacks;
}

}  // namespace

Findings simulate(const RandomScene& scene) {
  World world = make_world(scene);
  std::vector<BodyHandle> bodies;
  world.for_each_body([&](BodyHandle handle) { bodies.push_back(handle); });
  Overlap overlap(scene, bodies);
  Findings found;
  found.allowed_penetration = kInfinity;
  const Momenta before(world);
  Real least = world.energy().total(), mass = 0;
  for (const RandomScene::Body& body : scene.bodies)
    if (body.def.motion == MotionType::dynamic) mass += body.def.mass;
  found.energy_scale = world.energy().kinetic + mass * scene.world.gravity.norm() * 2 * scene.room;
  while (world.time() < scene.duration - kFrame / 2 && found.finite) {
    const StepReport r = world.step(kFrame);
    found.finite = r.finite;
    for (const BodyHandle lost : r.bodies_retired) found.lost.push_back(world.body_def(lost).name);
    const Real energy = world.energy().total();
    least = std::min(least, energy);
    if (energy - least > found.energy_gain) {
      found.energy_gain = energy - least;
      found.gained_at = world.time();
    }
    overlap.add(world, r);
    if (r.contacts.penetration - overlap.allowed() > found.penetration - found.allowed_penetration) {
      found.penetration = r.contacts.penetration;
      found.allowed_penetration = overlap.allowed();
    }
    found.work = std::max(found.work, counted_work(r));
    found.rough += r.rough_contacts.size();
  }
  if (scene.room > 0)
    world.for_each_body([&](BodyHandle handle) {
      const BodyDef& def = world.body_def(handle);
      if (def.motion == MotionType::dynamic &&
          world.body(handle).centre.cwiseAbs().maxCoeff() > scene.room + kWall / 4)
        found.lost.push_back(def.name);
    });
  const Momenta after(world);
  found.momentum_error = (after.linear - before.linear).norm() / std::max(before.linear_size, 1e-9);
  found.angular_momentum_error =
      (after.angular - before.angular).norm() / std::max(before.angular_size, 1e-9);
  found.allowed_work = 100'000 * static_cast<uint64_t>(std::ceil(kFrame / scene.world.max_step - 1e-9));
  found.hash = world.state_hash();
  return found;
}

std::string faults(const RandomScene& scene, const Findings& f) {
  constexpr Real kEnergy = 5e-3, kMomentum = 1e-7;
  std::ostringstream out;
  if (!f.finite) out << "not finite; ";
  for (const std::string& name : f.lost) out << name << " left; ";
  if (!scene.is_driven && !(f.energy_gain <= kEnergy * f.energy_scale))
    out << "energy grew by " << f.energy_gain << " J of " << f.energy_scale << " J before " << f.gained_at
        << " s; ";
  if (!(f.penetration <= f.allowed_penetration))
    out << "overlap of " << f.penetration << " m, allowed " << f.allowed_penetration << " m; ";
  if (scene.room == 0 && !(f.momentum_error <= kMomentum))
    out << "momentum off by " << f.momentum_error << "; ";
  if (scene.room == 0 && !(f.angular_momentum_error <= 1e-3))
    out << "angular momentum off by " << f.angular_momentum_error << "; ";
  if (f.work > f.allowed_work) out << "work " << f.work << ", allowed " << f.allowed_work << "; ";
  return out.str();
}

}  // namespace offstage::sim
