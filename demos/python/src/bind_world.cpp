// World: construction, steps and state, as numpy arrays.

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include "bindings.h"
#include "keywords.h"
#include "live_world.h"

namespace offstage::python {
namespace {

using Released = py::call_guard<py::gil_scoped_release>;

const std::map<std::string, sim::IntegratorKind> kIntegrators = {
    {"explicit_euler", sim::IntegratorKind::explicit_euler},
    {"symplectic_euler", sim::IntegratorKind::symplectic_euler},
    {"leapfrog", sim::IntegratorKind::leapfrog},
    {"midpoint", sim::IntegratorKind::midpoint},
    {"rk4", sim::IntegratorKind::rk4},
    {"implicit_euler", sim::IntegratorKind::implicit_euler},
    {"adaptive_euler", sim::IntegratorKind::adaptive_euler},
    {"adaptive_midpoint", sim::IntegratorKind::adaptive_midpoint},
    {"adaptive_rk4", sim::IntegratorKind::adaptive_rk4},
    {"dormand_prince", sim::IntegratorKind::dormand_prince}};
const std::map<std::string, sim::SolverKind> kSolvers = {{"exact", sim::SolverKind::exact},
                                                         {"fast", sim::SolverKind::fast},
                                                         {"auto", sim::SolverKind::automatic},
                                                         {"lcp", sim::SolverKind::lcp}};
const std::map<std::string, sim::ImpactLaw> kImpacts = {{"simultaneous", sim::ImpactLaw::simultaneous},
                                                        {"sequential", sim::ImpactLaw::sequential}};
using Methods = sim::CollisionMethods;
const std::map<std::string, Methods::NarrowPhase> kNarrowPhases = {{"gjk", Methods::NarrowPhase::gjk},
                                                                   {"vclip", Methods::NarrowPhase::vclip}};
const std::map<std::string, Methods::BroadPhase> kBroadPhases = {
    {"multi_grid", Methods::BroadPhase::multi_grid}, {"grid", Methods::BroadPhase::grid}};
const std::map<std::string, Methods::ImpactTime> kImpactTimes = {
    {"advancement", Methods::ImpactTime::advancement}, {"bisection", Methods::ImpactTime::bisection}};
const std::map<std::string, Methods::Trees> kTrees = {{"aabb", Methods::Trees::aabb},
                                                      {"obb", Methods::Trees::obb},
                                                      {"sphere", Methods::Trees::sphere},
                                                      {"mixed", Methods::Trees::mixed}};
const std::map<std::string, sim::TreeSplit> kTreeSplits = {{"mean", sim::TreeSplit::mean},
                                                           {"surface_area", sim::TreeSplit::surface_area}};
const std::map<std::string, Methods::MeshPairs> kMeshPairs = {{"parts", Methods::MeshPairs::parts},
                                                              {"triangles", Methods::MeshPairs::triangles}};
const std::map<std::string, sim::ParticleContactMethod> kParticleContacts = {
    {"relaxation", sim::ParticleContactMethod::relaxation}, {"lcp", sim::ParticleContactMethod::lcp}};

void take_methods(Keywords& k, sim::WorldDef& def) {
  k.choose("narrow_phase", kNarrowPhases, def.collision.narrow_phase);
  k.choose("broad_phase", kBroadPhases, def.collision.broad_phase);
  k.take("cell_factor", def.collision.cell_factor);
  k.choose("impact_time", kImpactTimes, def.collision.impact_time);
  k.choose("trees", kTrees, def.collision.trees);
  k.choose("tree_split", kTreeSplits, def.collision.tree_split);
  k.choose("mesh_pairs", kMeshPairs, def.collision.mesh_pairs);
  k.choose("particle_contacts", kParticleContacts, def.particle_contacts);
  k.take("particle_cluster", def.particle_cluster);
  if (!(def.collision.cell_factor > 0)) throw std::invalid_argument("cell_factor: must be > 0");
  if (def.particle_cluster < 1 || def.particle_cluster > 64)
    throw std::invalid_argument("particle_cluster: must be 1 to 64");
}

/// Adds the figures (statistics) of a part to a dict. A key is the name of the part and the name of the
/// figure, joined by an underscore.
template <sim::HasFigures Part>
void add_figures(const Part& part, const std::string& prefix, py::dict& d) {
  sim::for_each_figure(part, [&](std::string_view name, const auto& value) {
    const std::string key = prefix + std::string(name);
    if constexpr (sim::HasFigures<std::remove_cvref_t<decltype(value)>>)
      add_figures(value, name.empty() ? prefix : key + "_", d);
    else
      d[py::str(key)] = value;
  });
}

py::dict to_dict(const sim::StepReport& r) {
  py::dict d;
  add_figures(r, "", d);
  d["bodies_retired"] = r.bodies_retired;
  d["joints_broken"] = r.joints_broken;
  d["rough_contacts"] = r.rough_contacts.size();
  d["finite"] = r.finite;
  return d;
}

py::dict step(LiveWorld& w, double sampling_time, const py::object& before) {
  if (!(sampling_time > 0)) throw std::invalid_argument("sampling_time: must be > 0");
  sim::StepReport report;
  if (before.is_none()) {
    const py::gil_scoped_release released;
    report = w.world.step(sampling_time);
  } else {
    report = w.world.step(sampling_time, [&](double start, double end) { before(start, end); });
  }
  return to_dict(report);
}

/// Steps several worlds in parallel, each on one thread.
std::vector<bool> step_all(const std::vector<LiveWorld*>& worlds, double sampling_time, int threads) {
  if (!(sampling_time > 0)) throw std::invalid_argument("sampling_time: must be > 0");
  if (std::set<LiveWorld*>(worlds.begin(), worlds.end()).size() != worlds.size())
    throw std::invalid_argument("worlds: a world is listed twice");
  std::vector<char> finite(worlds.size(), 1);
  {
    const py::gil_scoped_release released;
    tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
    arena.execute([&] {
      tbb::parallel_for(std::size_t{0}, worlds.size(),
                        [&](std::size_t i) { finite[i] = worlds[i]->world.step(sampling_time).finite; });
    });
  }
  return {finite.begin(), finite.end()};
}

py::dict body_dict(const LiveWorld& w, sim::BodyHandle body) {
  const sim::BodyState s = w.world.body(w.body(body));
  py::dict d;
  d["position"] = array(s.pose.position);
  d["orientation"] = array(s.pose.orientation);
  d["centre"] = array(s.centre);
  d["velocity"] = array(s.velocity);
  d["angular_velocity"] = array(s.angular_velocity);
  d["angular_momentum"] = array(s.angular_momentum);
  d["mass"] = s.mass;
  return d;
}

/// Returns the states of bodies as an (n, 13) array with the columns position [m], orientation [w, x, y, z],
/// velocity [m/s] and angular velocity [rad/s].
py::array_t<double> body_states(const LiveWorld& w, const std::vector<sim::BodyHandle>& bodies) {
  py::array_t<double> out({static_cast<py::ssize_t>(bodies.size()), py::ssize_t{13}});
  double* row = out.mutable_data();
  for (const sim::BodyHandle body : bodies) {
    const sim::BodyState s = w.world.body(w.body(body));
    const sim::Quat& q = s.pose.orientation;
    for (int i = 0; i < 3; ++i)
      row[i] = s.pose.position[i], row[7 + i] = s.velocity[i], row[10 + i] = s.angular_velocity[i];
    row[3] = q.w(), row[4] = q.x(), row[5] = q.y(), row[6] = q.z();
    row += 13;
  }
  return out;
}

py::dict joint_dict(const LiveWorld& w, sim::JointHandle joint) {
  const sim::JointState s = w.world.joint(w.joint(joint));
  py::dict d;
  d["anchor_a"] = array(s.anchor_a);
  d["anchor_b"] = array(s.anchor_b);
  d["axis"] = array(s.axis);
  d["force"] = array(s.force);
  d["torque"] = array(s.torque);
  d["coordinate"] = s.coordinate;
  d["speed"] = s.speed;
  d["error"] = s.error;
  d["broken"] = s.broken;
  return d;
}

py::dict particle_dict(const LiveWorld& w, sim::ParticleSystemHandle system) {
  const sim::ParticleArrays& p = w.world.particles(w.system(system));
  py::dict d;
  d["position"] = rows<double>(p.position);
  d["velocity"] = rows<double>(p.velocity);
  d["id"] = numbers(std::span<const uint64_t>(p.id));
  d["angular_velocity"] = rows<double>(p.angular_velocity);
  for (const auto& [name, column] :
       {std::pair("mass", &p.mass), std::pair("radius", &p.radius), std::pair("age", &p.age),
        std::pair("lifespan", &p.lifespan), std::pair("charge", &p.charge)})
    d[name] = numbers(std::span<const double>(*column));
  return d;
}

py::dict cloth_dict(const LiveWorld& w, sim::ClothHandle cloth) {
  const sim::ClothView c = w.world.cloth(w.cloth(cloth));
  py::array_t<uint32_t> triangles({static_cast<py::ssize_t>(c.triangles.size()), py::ssize_t{3}});
  for (std::size_t i = 0; i < c.triangles.size(); ++i)
    std::copy(c.triangles[i].begin(), c.triangles[i].end(),
              triangles.mutable_data(static_cast<py::ssize_t>(i), 0));
  py::dict d;
  d["position"] = rows<double>(c.points);
  d["velocity"] = rows<double>(c.velocities);
  d["triangles"] = triangles;
  d["sources"] = numbers(c.sources);
  d["version"] = c.version;
  d["max_strain"] = w.world.cloth_report(cloth).max_strain;
  d["max_bend"] = w.world.cloth_report(cloth).max_bend;
  const sim::ClothGasState gas = w.world.cloth_gas(w.cloth(cloth));
  d["volume"] = gas.volume;
  d["pressure"] = gas.pressure;
  return d;
}

py::list contact_list(const LiveWorld& w) {
  py::list out;
  for (const sim::ContactState& c : w.world.contacts()) {
    py::dict d;
    d["a"] = c.a;
    d["b"] = c.b;
    d["point"] = array(c.point);
    d["normal"] = array(c.normal);
    d["force"] = array(c.force);
    d["separation"] = c.separation;
    out.append(d);
  }
  return out;
}

py::list event_list(const LiveWorld& w) {
  py::list out;
  for (const sim::ParticleEvent& e : w.world.particle_events()) {
    py::dict d;
    d["kind"] = e.kind == sim::ParticleEvent::Kind::collision ? "collision" : "death";
    d["system"] = e.system;
    d["id"] = e.id;
    d["time"] = e.time;
    d["position"] = array(e.position);
    d["velocity"] = array(e.velocity);
    d["normal"] = array(e.normal);
    out.append(d);
  }
  return out;
}

std::unique_ptr<LiveWorld> make_world(const py::kwargs& kwargs) {
  Keywords k(kwargs);
  sim::WorldDef def;
  k.take("gravity", def.gravity);
  k.take("wind", def.wind);
  k.take("max_step", def.max_step);
  k.choose("integrator", kIntegrators, def.integrator);
  k.take("integration_error", def.integration_error);
  k.choose("solver", kSolvers, def.solver);
  k.choose("impact", kImpacts, def.impact);
  k.take("collision_speed", def.collision_speed);
  take_methods(k, def);
  k.take("sleep", def.sleep);
  double bounds = def.bounds.max().x();
  k.take("bounds", bounds);
  def.bounds = sim::Aabb(sim::Vec3::Constant(-bounds), sim::Vec3::Constant(bounds));
  k.finish("World");
  if (!(def.max_step > 0)) throw std::invalid_argument("max_step: must be > 0");
  if (!(def.collision_speed > 0)) throw std::invalid_argument("collision_speed: must be > 0");
  return std::make_unique<LiveWorld>(def);
}

template <class H>
void bind_handle(py::module_& m, const char* name) {
  py::class_<H>(m, name, "Handle of an object of a World.")
      .def("__bool__", [](H h) { return static_cast<bool>(h); })
      .def("__eq__", [](H a, H b) { return a == b; })
      .def("__hash__", [](H h) { return (uint64_t{h.generation} << 32) | h.index; })
      .def("__repr__",
           [name = std::string(name)](H h) { return "<" + name + " " + std::to_string(h.index) + ">"; });
}

void bind_state(py::class_<LiveWorld>& world) {
  world
      .def("step", &step, py::arg("sampling_time"), py::arg("before") = py::none(),
           "Advances by a time [s] and returns the statistics of the step as a dict. `before(start, end)` is "
           "called before each\nsub-step. Without `before`, other Python threads can run during the step.")
      .def(
          "prewarm", [](LiveWorld& w, double from, double to) { return to_dict(w.world.prewarm(from, to)); },
          py::arg("start"), py::arg("end"),
          "Advances only the particles from `start` to `end` [s]. Must be called before the first step.")
      .def(
          "set_velocity",
          [](LiveWorld& w, sim::BodyHandle body, const Triple& v, const Triple& omega) {
            w.world.set_velocity(w.body(body), vec(v), vec(omega));
          },
          py::arg("body"), py::arg("velocity"), py::arg("angular_velocity") = Triple{0, 0, 0})
      .def("body", &body_dict, py::arg("body"),
           "Returns the state of a body as a dict: position, orientation [w, x, y, z], centre of mass and "
           "velocities.")
      .def("bodies", &body_states, py::arg("bodies"),
           "Returns the states of many bodies, (n, 13) float64: position, orientation [w, x, y, z], velocity "
           "and angular velocity.")
      .def(
          "body_motion",
          [](const LiveWorld& w, sim::BodyHandle body, double time) {
            const sim::Motion motion = w.world.body_motion(w.body(body), time);
            return py::make_tuple(array(motion.pose.position), array(motion.pose.orientation),
                                  array(motion.velocity), array(motion.angular_velocity));
          },
          py::arg("body"), py::arg("time"))
      .def("joint", &joint_dict, py::arg("joint"))
      .def("particles", &particle_dict, py::arg("system"),
           "Returns the particles of a system as a dict of arrays, in the order of their creation: position "
           "(n, 3), ...")
      .def("particle_events", &event_list,
           "Returns the collisions and deaths of particles in the last sub-step, for the systems that report "
           "them.")
      .def("cloth", &cloth_dict, py::arg("cloth"),
           "Returns the state of a cloth as a dict: position (n, 3), velocity (n, 3), triangles (t, 3), "
           "sources, version, max_strain and max_bend.")
      .def("contacts", &contact_list, "Returns the contact points at the end of the last step.")
      .def(
          "overlaps",
          [](const LiveWorld& w, double least) {
            if (!(least > 0)) throw std::invalid_argument("least: must be > 0");
            py::list out;
            for (const sim::BodyOverlap& o : w.world.overlaps(least))
              out.append(py::make_tuple(o.a, o.b, o.depth));
            return out;
          },
          py::arg("least") = 1e-9,
          "Returns (a, b, depth [m]) for each pair of bodies that overlap by at least `least` [m].")
      .def(
          "moved",
          [](const LiveWorld& w) {
            std::vector<sim::BodyHandle> moved;
            for (const sim::MovedBody& m : w.world.moved()) moved.push_back(m.body);
            return moved;
          },
          "Returns the bodies whose pose changed during the last step.")
      .def(
          "island", [](const LiveWorld& w, sim::BodyHandle body) { return w.world.island(w.body(body)); },
          py::arg("body"))
      .def(
          "is_asleep",
          [](const LiveWorld& w, sim::BodyHandle body) { return w.world.is_asleep(w.body(body)); },
          py::arg("body"))
      .def_property_readonly(
          "time", [](const LiveWorld& w) { return w.world.time(); }, "Time of the simulation [s].")
      .def_property_readonly("body_count", [](const LiveWorld& w) { return w.world.body_count(); })
      .def_property_readonly("particle_count", [](const LiveWorld& w) { return w.world.particle_count(); })
      .def_property_readonly(
          "energy",
          [](const LiveWorld& w) {
            const sim::Energy e = w.world.energy();
            return py::dict(py::arg("kinetic") = e.kinetic, py::arg("potential") = e.potential,
                            py::arg("elastic") = e.elastic);
          },
          "Energy of the world: a dict with kinetic, potential and elastic energy [J].")
      .def_property_readonly("state_hash", [](const LiveWorld& w) { return w.world.state_hash().hex(); });
}

}  // namespace

void bind_world(py::module_& m) {
  bind_handle<sim::BodyHandle>(m, "BodyHandle");
  bind_handle<sim::ParticleSystemHandle>(m, "ParticleSystemHandle");
  bind_handle<sim::SpringHandle>(m, "SpringHandle");
  bind_handle<sim::JointHandle>(m, "JointHandle");
  bind_handle<sim::ClothHandle>(m, "ClothHandle");
  bind_handle<sim::ForceHandle>(m, "ForceHandle");
  bind_shapes(m);
  py::class_<LiveWorld> world(m, "World",
                              "A simulation that is built object by object. Units are m, kg, s and rad; Y is "
                              "up. Only one thread at a "
                              "time\nmay use a world.");
  world.def(
      py::init(&make_world),
      "Keywords: gravity, wind, max_step, integrator, integration_error, solver ('exact', 'fast', 'auto',\n"
      "'lcp'), impact ('simultaneous', 'sequential'), collision_speed, sleep, bounds. Further keywords "
      "select\n"
      "algorithms of the book instead of the default ones: narrow_phase ('gjk', 'vclip'), broad_phase "
      "('multi_grid', 'grid'), "
      "cell_factor,\n"
      "impact_time ('advancement', 'bisection'), trees ('aabb', 'obb', 'sphere', 'mixed'), tree_split "
      "('mean',\n"
      "'surface_area'), mesh_pairs ('parts', 'triangles'), particle_contacts ('relaxation', 'lcp'), "
      "particle_cluster.");
  bind_building(world);
  bind_state(world);
  m.def("step_all", &step_all, py::arg("worlds"), py::arg("sampling_time"), py::arg("threads") = 0,
        "Steps many worlds in parallel without the interpreter lock. Returns for each world whether its "
        "state is finite.");
}

}  // namespace offstage::python
