// World: shapes, and the calls that add objects to a world.

#include "bindings.h"
#include "effects/cloth.h"
#include "keywords.h"
#include "live_world.h"

namespace offstage::python {
namespace {

const std::map<std::string, sim::MotionType> kMotions = {{"static", sim::MotionType::static_body},
                                                         {"kinematic", sim::MotionType::kinematic},
                                                         {"dynamic", sim::MotionType::dynamic}};
const std::map<std::string, sim::Interpolation> kInterpolations = {{"monotone", sim::Interpolation::monotone},
                                                                   {"smooth", sim::Interpolation::smooth},
                                                                   {"linear", sim::Interpolation::linear},
                                                                   {"step", sim::Interpolation::step}};
const std::map<std::string, sim::JointType> kJoints = {
    {"spherical", sim::JointType::spherical}, {"fixed", sim::JointType::fixed},
    {"revolute", sim::JointType::revolute},   {"prismatic", sim::JointType::prismatic},
    {"universal", sim::JointType::universal}, {"distance", sim::JointType::distance},
    {"gear", sim::JointType::gear},           {"rack", sim::JointType::rack},
    {"screw", sim::JointType::screw},         {"pulley", sim::JointType::pulley}};
const std::map<std::string, sim::Motor::Mode> kMotors = {{"none", sim::Motor::Mode::none},
                                                         {"speed", sim::Motor::Mode::speed},
                                                         {"position", sim::Motor::Mode::position}};
const std::map<std::string, sim::ClothIntegrator> kClothIntegrators = {
    {"relaxed", sim::ClothIntegrator::relaxed},
    {"implicit", sim::ClothIntegrator::implicit},
    {"symplectic", sim::ClothIntegrator::symplectic},
    {"rk4", sim::ClothIntegrator::rk4}};
const std::map<std::string, effects::BendModel> kBendModels = {{"plate", effects::BendModel::plate},
                                                               {"springs", effects::BendModel::springs}};

sim::KeyframeTrack track_of(Keywords& k) {
  sim::KeyframeTrack track;
  const py::object keys = k.take_object("keyframes");  // [(time, position, orientation), ...]
  if (!keys.is_none())
    for (const py::handle key : keys) {
      const auto [time, position, orientation] = key.cast<std::tuple<double, Triple, Quadruple>>();
      track.keys.push_back({time, {vec(position), quat(orientation)}, {}});
    }
  k.choose("interpolation", kInterpolations, track.interpolation);
  k.take("loop", track.loop);
  k.take("spin", track.spin);
  return track;
}

void take_optional(Keywords& k, const char* name, std::optional<sim::Vec3>& value) {
  std::optional<Triple> numbers;
  k.take(name, numbers);
  if (numbers) value = vec(*numbers);
}

/// Reads `inertia` [kg m^2]: three moments about the axes of the body's frame, or a 3 x 3 matrix; nothing if
/// it is not given.
std::optional<sim::Mat3> take_inertia(Keywords& k) {
  const py::object given = k.take_object("inertia");
  if (given.is_none()) return {};
  const auto a = DoubleArray::ensure(given);
  const bool moments = a && a.ndim() == 1 && a.shape(0) == 3;
  if (!moments && !(a && a.ndim() == 2 && a.shape(0) == 3 && a.shape(1) == 3))
    throw std::invalid_argument("inertia: must be 3 moments, or have the shape (3, 3)");
  if (moments) return sim::Mat3(sim::Vec3(a.data()[0], a.data()[1], a.data()[2]).asDiagonal());
  return sim::Mat3(Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(a.data()));
}

sim::BodyHandle add_body(LiveWorld& w, const sim::Shape& shape, const py::kwargs& kwargs) {
  Keywords k(kwargs);
  sim::BodyDef def{.shape = shape};
  if (const auto* mesh = std::get_if<sim::MeshShape>(&shape)) LiveWorld::live(w.meshes, mesh->mesh, "mesh");
  k.take("name", def.name);
  k.choose("motion", kMotions, def.motion);
  k.take("position", def.pose.position);
  k.take("orientation", def.pose.orientation);
  k.take("velocity", def.velocity);
  k.take("angular_velocity", def.angular_velocity);
  k.take("density", def.density);
  k.take("mass", def.mass);
  take_optional(k, "centre", def.centre);
  def.inertia = take_inertia(k);
  k.take("linear_drag", def.linear_drag);
  k.take("angular_drag", def.angular_drag);
  k.take("material", def.material);
  k.take("restitution", def.restitution);
  k.take("friction", def.friction);
  k.take("static_friction", def.static_friction);
  k.take("cross_friction", def.cross_friction);
  k.take("friction_axis", def.friction_axis);
  k.take("rolling_friction", def.rolling_friction);
  k.take("spinning_friction", def.spinning_friction);
  k.take("surface_velocity", def.surface_velocity);
  k.take("collides", def.collides);
  k.take("appear_at", def.appear_at);
  k.take("remove_at", def.remove_at);
  def.track = track_of(k);
  k.finish("add_body");
  return *w.bodies.insert(w.world.add_body(def)).first;
}

sim::ParticleSystemHandle add_particle_system(LiveWorld& w, const py::kwargs& kwargs) {
  Keywords k(kwargs);
  sim::ParticleSystemDef def;
  k.take("name", def.name);
  k.take("linear_drag", def.linear_drag);
  k.take("gravity", def.gravity);
  k.take("force", def.force);
  k.take("collides", def.collides);
  k.take("internal", def.internal);
  k.take("external", def.external);
  k.take("rotates", def.rotates);
  k.take("dies_on_hit", def.dies_on_hit);
  k.take("report_collisions", def.report_collisions);
  k.take("report_deaths", def.report_deaths);
  k.choose("integrator", kIntegrators, def.integrator);
  k.finish("add_particle_system");
  return *w.systems.insert(w.world.add_particle_system(def)).first;
}

/// Returns n values, one for each particle. `value` is a number for all particles, an array, or None, which
/// selects `otherwise`.
std::vector<double> per_particle(const py::object& value, double otherwise, std::size_t n, const char* name) {
  if (value.is_none()) return std::vector<double>(n, otherwise);
  const auto a = DoubleArray::ensure(value);
  if (!a) throw std::invalid_argument(std::string(name) + ": must be numbers");
  if (a.size() == 1) return std::vector<double>(n, a.data()[0]);
  if (a.ndim() != 1 || static_cast<std::size_t>(a.size()) != n)
    throw std::invalid_argument(std::string(name) + ": must be one number, or one for each particle");
  return {a.data(), a.data() + n};
}

py::array_t<uint64_t> add_particles(LiveWorld& w, sim::ParticleSystemHandle system,
                                    const DoubleArray& positions, const py::kwargs& kwargs) {
  Keywords k(kwargs);
  const std::vector<sim::Vec3> p = vectors(positions, "positions");
  const py::object velocities = k.take_object("velocities");
  const std::vector<sim::Vec3> v = velocities.is_none()
                                       ? std::vector<sim::Vec3>(p.size(), sim::Vec3::Zero())
                                       : vectors(velocities.cast<DoubleArray>(), "velocities");
  if (v.size() != p.size()) throw std::invalid_argument("velocities: must have as many rows as positions");
  const sim::Particle d;
  const auto column = [&](const char* name, double otherwise) {
    return per_particle(k.take_object(name), otherwise, p.size(), name);
  };
  const auto mass = column("mass", d.mass), radius = column("radius", d.radius),
             life = column("lifespan", d.lifespan), restitution = column("restitution", d.restitution),
             friction = column("friction", d.friction), charge = column("charge", d.charge);
  k.finish("add_particles");
  for (std::size_t i = 0; i < p.size(); ++i) {
    if (!(mass[i] > 0 && radius[i] > 0)) throw std::invalid_argument("mass and radius: must be > 0");
    if (!p[i].allFinite() || !v[i].allFinite())
      throw std::invalid_argument("positions and velocities: must be finite");
  }
  w.system(system);
  std::vector<uint64_t> ids;
  for (std::size_t i = 0; i < p.size(); ++i)
    ids.push_back(w.world.add_particle(
        system, {p[i], v[i], mass[i], radius[i], life[i], restitution[i], friction[i], charge[i]}));
  return numbers(std::span<const uint64_t>(ids));
}

sim::JointHandle add_joint(LiveWorld& w, const std::string& type, sim::BodyHandle a,
                           std::optional<sim::BodyHandle> b, const py::kwargs& kwargs) {
  Keywords k(kwargs);
  sim::JointDef def{.type = chosen(kJoints, type, "type"), .a = w.body(a)};
  if (b) def.b = w.body(*b);
  k.take("name", def.name);
  k.take("anchor", def.anchor);
  k.take("anchor_b", def.anchor_b);
  k.take("axis", def.axis);
  if (def.type == sim::JointType::gear) def.second_axis = def.axis;
  k.take("second_axis", def.second_axis);
  k.take("ratio", def.ratio);
  k.take("pulley_a", def.pulley_a);
  k.take("pulley_b", def.pulley_b);
  k.take("restitution", def.restitution);
  k.take("stiffness", def.stiffness);
  k.take("lower", def.lower);
  k.take("upper", def.upper);
  k.take("swing", def.swing);
  k.take("friction", def.friction);
  k.take("damping", def.damping);
  k.take("max_force", def.max_force);
  k.take("max_torque", def.max_torque);
  k.take("collide", def.collide);
  k.take("appear_at", def.appear_at);
  k.take("remove_at", def.remove_at);
  k.choose("motor", kMotors, def.motor.mode);
  double target = 0;
  k.take("motor_target", target);
  def.motor.targets = {{.target = target}};
  k.take("motor_effort", def.motor.max_effort);
  k.take("motor_stiffness", def.motor.stiffness);
  k.take("motor_damping", def.motor.damping);
  k.finish("add_joint");
  return *w.joints.insert(w.world.add_joint(def)).first;
}

sim::Attachment attachment(LiveWorld& w, const py::object& end) {
  // (body, point), (system, id) or a world point
  if (py::isinstance<py::tuple>(end) && py::len(end) == 2) {
    const auto pair = end.cast<py::tuple>();
    if (py::isinstance<sim::BodyHandle>(pair[0]))
      return sim::BodyPoint{w.body(pair[0].cast<sim::BodyHandle>()), vec(pair[1].cast<Triple>())};
    if (py::isinstance<sim::ParticleSystemHandle>(pair[0])) {
      const auto system = w.system(pair[0].cast<sim::ParticleSystemHandle>());
      const auto id = pair[1].cast<uint64_t>();
      const std::vector<uint64_t>& ids = w.world.particles(system).id;
      if (!std::binary_search(ids.begin(), ids.end(), id))
        throw std::invalid_argument("there is no particle with this id");
      return sim::ParticlePoint{system, id};
    }
  }
  return sim::WorldPoint{vec(end.cast<Triple>())};
}

sim::SpringHandle add_spring(LiveWorld& w, const py::object& a, const py::object& b, double stiffness,
                             double damping, std::optional<double> rest_length) {
  return w.world.add_spring({.a = attachment(w, a),
                             .b = attachment(w, b),
                             .stiffness = stiffness,
                             .damping = damping,
                             .rest_length = rest_length.value_or(-1)});
}

template <class Field>
void take_region(Keywords& k, Field& field) {
  const py::object sphere = k.take_object("sphere"), box = k.take_object("box");
  if (!sphere.is_none()) {
    const auto [centre, radius] = sphere.cast<std::tuple<Triple, double>>();
    field.region = sim::SphereRegion{vec(centre), radius};
  } else if (!box.is_none()) {
    const auto [centre, size] = box.cast<std::tuple<Triple, Triple>>();
    field.region = sim::BoxRegion{vec(centre), vec(size)};
  }
  k.take("drop_rate", field.drop_rate);
}

sim::ForceDef::Effect effect_of(const std::string& type, Keywords& k) {
  const auto with_region = [&](auto field, auto&& fill) -> sim::ForceDef::Effect {
    fill(field);
    take_region(k, field);
    return field;
  };
  if (type == "constant")
    return with_region(sim::ConstantField{}, [&](auto& f) { k.take("force", f.force); });
  if (type == "point")
    return with_region(sim::PointField{},
                       [&](auto& f) { k.take("point", f.point), k.take("force", f.force); });
  if (type == "wind")
    return with_region(sim::WindField{}, [&](auto& f) { k.take("wind", f.wind), k.take("drag", f.drag); });
  if (type == "vortex")
    return with_region(sim::Vortex{}, [&](auto& f) {
      k.take("point", f.point), k.take("axis", f.axis), k.take("circulation", f.circulation);
      k.take("radius", f.radius), k.take("drag", f.drag);
    });
  if (type == "turbulence")
    return with_region(sim::Turbulence{}, [&](auto& f) {
      k.take("speed", f.speed), k.take("scale", f.scale), k.take("octaves", f.octaves),
          k.take("lifetime", f.lifetime);
      k.take("drift", f.drift), k.take("seed", f.seed), k.take("drag", f.drag);
    });
  if (type == "gravitation")
    return with_region(sim::MutualGravitation{}, [&](auto& f) {
      k.take("constant", f.constant), k.take("softening", f.softening), k.take("cut_off", f.cut_off);
    });
  if (type == "coulomb")
    return with_region(sim::Coulomb{}, [&](auto& f) {
      k.take("constant", f.constant), k.take("softening", f.softening), k.take("cut_off", f.cut_off);
    });
  if (type == "lennard_jones")
    return with_region(sim::LennardJones{}, [&](auto& f) {
      k.take("epsilon", f.epsilon), k.take("sigma", f.sigma), k.take("cut_off", f.cut_off);
    });
  if (type == "explosion") {
    sim::Explosion e;
    k.take("point", e.point), k.take("impulse", e.impulse), k.take("radius", e.radius),
        k.take("drop_rate", e.drop_rate);
    return e;
  }
  if (type == "applied") {
    sim::AppliedForce a;
    sim::AppliedForce::Key key;
    k.take("force", key.force), k.take("torque", key.torque), k.take("body_axes", a.body_axes);
    if (const py::object point = k.take_object("point"); !point.is_none())
      a.point = vec(point.cast<Triple>());
    a.keys.push_back(key);
    return a;
  }
  if (type == "grab") {
    sim::Grab g;
    sim::Vec3 hand = sim::Vec3::Zero();
    k.take("hand", hand), k.take("point", g.point), k.take("stiffness", g.stiffness);
    k.take("damping", g.damping), k.take("reach", g.reach);
    g.track.keys.push_back({0, {hand, sim::Quat::Identity()}, {}});
    return g;
  }
  throw std::invalid_argument("type: '" + type +
                              "' is none of 'constant', 'point', 'wind', 'vortex', 'turbulence', "
                              "'gravitation', 'coulomb', 'lennard_jones', 'explosion', 'grab'");
}

sim::ForceHandle add_force(LiveWorld& w, const std::string& type, const py::kwargs& kwargs) {
  Keywords k(kwargs);
  sim::ForceDef def;
  k.take("name", def.name);
  k.take("bodies", def.bodies);
  k.take("systems", def.systems);
  k.take("cloths", def.cloths);
  k.take("start", def.start);
  k.take("end", def.end);
  def.effect = effect_of(type, k);
  k.finish("add_force");
  for (const auto b : def.bodies) w.body(b);
  for (const auto s : def.systems) w.system(s);
  for (const auto c : def.cloths) w.cloth(c);
  return w.world.add_force(def);
}

sim::ClothHandle finish_cloth(LiveWorld& w, sim::ClothDef def, Keywords& k, const char* function) {
  k.take("name", def.name);
  k.take("velocity", def.velocity);
  k.take("collides", def.collides);
  k.take("self_collision", def.self_collision);
  k.take("tear", def.tear);
  k.take("pressure", def.pressure);
  k.take("inflate_time", def.inflate_time);
  k.take("gas_density", def.gas_density);
  k.take("ram_pressure", def.ram_pressure);
  k.take("air_density", def.air.density);
  k.choose("integrator", kClothIntegrators, def.integrator);
  k.take("soften", def.soften);
  k.take("appear_at", def.appear_at);
  k.take("remove_at", def.remove_at);
  k.take("substep", def.substep);
  const py::object pins = k.take_object("pins");  // vertices, or (vertex, body)
  if (!pins.is_none())
    for (const py::handle pin : pins) {
      sim::ClothPin p;
      if (py::isinstance<py::tuple>(pin)) {
        const auto [vertex, body] = pin.cast<std::tuple<uint32_t, sim::BodyHandle>>();
        p.vertex = vertex;
        p.body = w.body(body);
      } else {
        p.vertex = pin.cast<uint32_t>();
      }
      if (p.vertex >= def.vertices.size()) throw std::invalid_argument("pins: there is no such vertex");
      const sim::Vec3& at = def.vertices[p.vertex];
      p.position = p.body ? w.world.body(p.body).pose.point_to_body(at) : at;
      def.pins.push_back(p);
    }
  k.finish(function);
  return *w.cloths.insert(w.world.add_cloth(def)).first;
}

/// Reads the fabric: the preset with the name `fabric`, changed by the other keywords that are given.
effects::Fabric take_fabric(Keywords& k) {
  std::string name = "cotton";
  k.take("fabric", name);
  const effects::FabricPreset* preset = effects::find_fabric(name);
  if (!preset) throw std::invalid_argument("fabric: there is none called '" + name + "'");
  effects::Fabric f = preset->fabric;
  const std::pair<const char*, double*> values[] = {{"areal_density", &f.areal_density},
                                                    {"stretch", &f.stretch},
                                                    {"shear", &f.shear},
                                                    {"bend", &f.bend},
                                                    {"bend_damping", &f.bend_damping},
                                                    {"damping", &f.damping},
                                                    {"friction", &f.friction},
                                                    {"self_friction", &f.self_friction},
                                                    {"thickness", &f.thickness},
                                                    {"drag", &f.drag},
                                                    {"lift", &f.lift},
                                                    {"max_stretch", &f.max_stretch},
                                                    {"max_shear", &f.max_shear},
                                                    {"min_bend_radius", &f.min_bend_radius}};
  for (const auto& [key, value] : values) k.take(key, *value);
  k.take("stretch_damping", f.stretch_damping);
  k.take("shear_damping", f.shear_damping);
  k.take("bend_spring_damping", f.bend_spring_damping);
  k.choose("bend_model", kBendModels, f.bend_model);
  return f;
}

sim::Pose take_pose(Keywords& k) {
  sim::Pose pose;
  k.take("position", pose.position);
  k.take("orientation", pose.orientation);
  return pose;
}

sim::ClothHandle add_grid_cloth(LiveWorld& w, std::array<double, 2> size, std::array<uint32_t, 2> cells,
                                const py::kwargs& kwargs) {
  Keywords k(kwargs);
  const effects::Fabric fabric = take_fabric(k);
  return finish_cloth(w, effects::grid_cloth({size[0], size[1], cells[0], cells[1]}, take_pose(k), fabric), k,
                      "add_grid_cloth");
}

sim::TriangleMesh mesh_of(const DoubleArray& vertices, const IndexArray& triangles) {
  if (triangles.ndim() != 2 || triangles.shape(1) != 3)
    throw std::invalid_argument("triangles: must have the shape (n, 3)");
  sim::TriangleMesh mesh{vectors(vertices, "vertices"), {}};
  for (py::ssize_t i = 0; i < triangles.shape(0); ++i) {
    const uint32_t* t = triangles.data(i, 0);
    for (int k = 0; k < 3; ++k)
      if (t[k] >= mesh.vertices.size()) throw std::invalid_argument("triangles: a vertex does not exist");
    mesh.triangles.push_back({t[0], t[1], t[2]});
  }
  return mesh;
}

sim::ClothHandle add_mesh_cloth(LiveWorld& w, const DoubleArray& vertices, const IndexArray& triangles,
                                const py::kwargs& kwargs) {
  Keywords k(kwargs);
  const effects::Fabric fabric = take_fabric(k);
  return finish_cloth(w, effects::mesh_cloth(mesh_of(vertices, triangles), take_pose(k), fabric), k,
                      "add_mesh_cloth");
}
sim::MeshShape add_mesh(LiveWorld& w, const DoubleArray& vertices, const IndexArray& triangles) {
  return sim::MeshShape{*w.meshes.insert(w.world.add_mesh(mesh_of(vertices, triangles))).first};
}

void add_contact_rule(LiveWorld& w, const std::string& a, const std::string& b,
                      std::optional<double> restitution, std::optional<double> friction,
                      std::optional<double> static_friction, std::optional<double> rolling_friction,
                      std::optional<double> spinning_friction) {
  w.world.add_contact_rule(
      {a, b, restitution, friction, static_friction, rolling_friction, spinning_friction});
}

}  // namespace

void bind_shapes(py::module_& m) {
  py::class_<sim::Sphere>(m, "Sphere", "A ball: radius [m].")
      .def(py::init([](double radius) { return sim::Sphere{radius}; }), py::arg("radius") = 0.5);
  py::class_<sim::Box>(m, "Box", "A cuboid: full lengths of the edges [m].")
      .def(py::init([](const Triple& size) { return sim::Box{vec(size)}; }),
           py::arg("size") = Triple{1, 1, 1});
  const auto round = [&](auto shape, const char* name, const char* doc) {
    using S = decltype(shape);
    py::class_<S>(m, name, doc)
        .def(py::init([](double radius, double height) {
               return S{radius, height};
             }),
             py::arg("radius") = shape.radius, py::arg("height") = shape.height);
  };
  round(sim::Capsule{}, "Capsule",
        "A capsule along Y: radius, and distance between the centres of the caps [m].");
  round(sim::Cylinder{}, "Cylinder", "A cylinder along Y: radius and height [m].");
  round(sim::Cone{}, "Cone", "A cone along Y with its apex at +Y: radius of the base and height [m].");
  py::class_<sim::Frustum>(
      m, "Frustum",
      "A cone along Y with its tip cut off: radius of the base, radius of the top and height [m].")
      .def(py::init([](double radius, double top_radius, double height) {
             return sim::Frustum{radius, top_radius, height};
           }),
           py::arg("radius") = 0.5, py::arg("top_radius") = 0.25, py::arg("height") = 1);
  py::class_<sim::Ellipsoid>(m, "Ellipsoid", "An ellipsoid: half axes along x, y and z [m].")
      .def(py::init([](const Triple& radii) { return sim::Ellipsoid{vec(radii)}; }),
           py::arg("radii") = Triple{0.5, 0.25, 0.25});
  py::class_<sim::Plane>(m, "Plane", "The half-space y <= 0 of the body's frame; not for dynamic bodies.")
      .def(py::init<>());
  py::class_<sim::MeshShape>(m, "MeshShape", "A mesh that World.add_mesh() registered.");
}

void bind_building(py::class_<LiveWorld>& world) {
  world
      .def("add_mesh", &add_mesh, py::arg("vertices"), py::arg("triangles"),
           "Registers a mesh of (n, 3) vertices [m] and (m, 3) indices. Returns its shape for add_body().")
      .def("add_body", &add_body, py::arg("shape"),
           "Adds a body. Keywords, as in docs/python.md: name, motion ('static', 'kinematic', 'dynamic'), "
           "position,\n"
           "orientation [w, x, y, z], velocity, angular_velocity, density or mass, centre, inertia (3 "
           "moments or a "
           "3 x 3 matrix), linear_drag, "
           "angular_drag, material,\n"
           "restitution, friction, static_friction, cross_friction, friction_axis, "
           "rolling_friction,\n"
           "spinning_friction, surface_velocity, collides, appear_at, remove_at;\n"
           "keyframes [(time, position, orientation)], interpolation, loop, spin of kinematic bodies.")
      .def("add_particle_system", &add_particle_system,
           "Adds a particle system. Keywords: name, linear_drag, gravity, force, collides, internal, "
           "external, rotates, "
           "dies_on_hit, report_collisions,\n"
           "report_deaths, integrator.")
      .def("add_particles", &add_particles, py::arg("system"), py::arg("positions"),
           "Adds particles at (n, 3) positions and returns their ids. Keywords, each with one or n numbers: "
           "velocities\n"
           "(n, 3), mass, radius, lifespan, restitution, friction, charge.")
      .def("add_joint", &add_joint, py::arg("type"), py::arg("a"), py::arg("b") = py::none(),
           "Adds a joint between two bodies, or a body and the world. Types: spherical, fixed, revolute, "
           "prismatic,\n"
           "universal, distance, gear, rack, screw, pulley. Keywords: name, anchor, anchor_b, axis, "
           "second_axis, ratio, pulley_a, pulley_b, restitution, stiffness, lower, upper, swing, "
           "friction,\n"
           "damping, max_force, max_torque, collide, appear_at, remove_at; motor ('speed', 'position'), "
           "motor_target, "
           "motor_effort,\n"
           "motor_stiffness, motor_damping.")
      .def("add_spring", &add_spring, py::arg("a"), py::arg("b"), py::arg("stiffness") = 100,
           py::arg("damping") = 0, py::arg("rest_length") = py::none(),
           "Adds a damped spring. Each end is (body, point in its frame), (system, particle id) or a point "
           "of the world.")
      .def("add_force", &add_force, py::arg("type"),
           "Adds a force. Types and keywords are the same as for forces of a scene (docs/python.md). Further "
           "keywords: "
           "bodies,\nsystems, cloths, start, end.")
      .def("add_grid_cloth", &add_grid_cloth, py::arg("size"), py::arg("cells"),
           "Adds a rectangular cloth. Keywords: position, orientation, fabric, pins, name, velocity, "
           "collides,\n"
           "self_collision, tear, pressure, inflate_time, gas_density, ram_pressure, air_density, "
           "integrator, soften,\n"
           "substep, appear_at, remove_at; instead of the fabric's values: areal_density, stretch, shear, "
           "bend,\n"
           "bend_damping, bend_model ('plate', 'springs'), min_bend_radius, damping, stretch_damping, "
           "shear_damping,\n"
           "bend_spring_damping, friction, self_friction, thickness, drag, lift, max_stretch, max_shear. "
           "A pin is a\n"
           "vertex, or (vertex, body).")
      .def("add_mesh_cloth", &add_mesh_cloth, py::arg("vertices"), py::arg("triangles"),
           "Adds a cloth from a mesh; keywords as for add_grid_cloth.")
      .def("add_contact_rule", &add_contact_rule, py::arg("a"), py::arg("b"),
           py::arg("restitution") = py::none(), py::arg("friction") = py::none(),
           py::arg("static_friction") = py::none(), py::arg("rolling_friction") = py::none(),
           py::arg("spinning_friction") = py::none(),
           "Sets the coefficients for contacts of a pair of materials.");
  const auto removal = [&]<class H>(H) {
    world.def(
        "remove", [](LiveWorld& w, H handle) { return w.remove(handle); }, py::arg("object"),
        "Removes an object; False if it was removed before. Removing a body also removes its springs and "
        "joints.");
  };
  removal(sim::BodyHandle{});
  removal(sim::ParticleSystemHandle{});
  removal(sim::JointHandle{});
  removal(sim::ClothHandle{});
  removal(sim::SpringHandle{});
  removal(sim::ForceHandle{});
}

}  // namespace offstage::python
