// Scene, Simulation and Snapshot.

#include <nlohmann/json.hpp>

#include "bindings.h"
#include "film.h"
#include "producer/build/simulation.h"
#include "producer/run/cache_folder.h"
#include "producer/run/frame_list.h"
#include "producer/run/production.h"

namespace offstage::python {
namespace {

using producer::Snapshot;
using SnapshotPointer = std::shared_ptr<const Snapshot>;

/// Converts a dict such as {"emitters.0.rate": 200} to overrides in the form of the command line.
std::vector<std::string> overrides_of(const py::dict& set) {
  const py::object dumps = py::module_::import("json").attr("dumps");
  std::vector<std::string> overrides;
  for (const auto& [path, value] : set)
    overrides.push_back(py::str(path).cast<std::string>() + "=" + dumps(value).cast<std::string>());
  return overrides;
}

std::shared_ptr<const SharedScene> finished(producer::LoadedScene loaded) {
  auto scene = std::make_shared<SharedScene>();
  scene->loaded = std::move(loaded);
  scene->models = producer::ModelLibrary(scene->loaded.scene, scene->loaded.folder,
                                         producer::DecompositionCache::of_user(), scene->loaded.warnings);
  return scene;
}

std::shared_ptr<const SharedScene> load(const std::string& file, const py::dict& set,
                                        const std::vector<std::string>& allow) {
  const std::vector<std::string> overrides = overrides_of(set);
  const py::gil_scoped_release released;
  return finished(producer::load_scene(file, overrides, allow));
}

std::shared_ptr<const SharedScene> parse(const std::string& json, const std::string& name,
                                         const std::string& folder, const py::dict& set,
                                         const std::vector<std::string>& allow) {
  const std::vector<std::string> overrides = overrides_of(set);
  const py::gil_scoped_release released;
  return finished(producer::parse_scene(json, name, producer::SceneFolder(folder, allow), overrides));
}

std::vector<std::string> names_of_point_sets(const producer::Scene& scene) {
  std::vector<std::string> names;
  const producer::ObjectTable objects(scene);
  for (const auto& [name, look, id] : objects.point_sets) names.push_back(name);
  return names;
}

std::vector<std::string> names_of_moving_bodies(const producer::Scene& scene) {
  const producer::ObjectTable objects(scene);
  std::vector<std::string> names(objects.slots);
  for (const auto& [body, slot, id] : objects.bodies)
    if (slot) names[*slot] = body->name;
  return names;
}

std::vector<std::string> names_of_cloths(const producer::Scene& scene) {
  std::vector<std::string> names;
  for (const producer::Cloth& cloth : scene.cloths) names.push_back(cloth.name);
  return names;
}

/// Returns an array that shows one field of all elements of a list in a snapshot, without a copy. `first`:
/// the field of the first element; `width`: numbers per element.
template <class Element, class Scalar>
py::array fields(const std::vector<Element>& list, const Scalar* first, py::ssize_t width, py::handle owner) {
  const auto n = static_cast<py::ssize_t>(list.size());
  constexpr auto kStride = static_cast<py::ssize_t>(sizeof(Element));
  if (width == 1) return view<Scalar>({n}, {kStride}, first, owner);
  return view<Scalar>({n, width}, {kStride, static_cast<py::ssize_t>(sizeof(Scalar))}, first, owner);
}

py::dict points_of(const producer::PointSet& set, py::handle owner) {
  static const render::Point kNone{};
  const render::Point& p = set.points.empty() ? kNone : set.points.front();
  py::dict out;
  out["position"] = fields(set.points, p.position.data(), 3, owner);
  out["velocity"] = fields(set.points, p.velocity.data(), 3, owner);
  out["radius"] = fields(set.points, &p.radius, 1, owner);
  out["color"] = fields(set.points, p.color.data(), 4, owner);
  out["age"] = fields(set.points, &p.age, 1, owner);
  out["id"] = fields(set.points, &p.id, 1, owner);
  return out;
}

py::dict cloth_of(const producer::ClothSample& cloth, py::handle owner) {
  static const Eigen::Vector3f kNone = Eigen::Vector3f::Zero();
  py::dict out;
  out["position"] = fields(cloth.points, (cloth.points.empty() ? kNone : cloth.points[0]).data(), 3, owner);
  out["velocity"] =
      fields(cloth.velocities, (cloth.velocities.empty() ? kNone : cloth.velocities[0]).data(), 3, owner);
  out["version"] = cloth.version;
  out["triangles"] = numbers(std::span<const uint32_t>(cloth.triangles))
                         .reshape({static_cast<py::ssize_t>(cloth.triangles.size() / 3), py::ssize_t{3}});
  out["sources"] = numbers(std::span<const uint32_t>(cloth.sources));
  return out;
}

py::array bodies_of(const py::object& self, bool orientations) {
  const auto& bodies = self.cast<const Snapshot&>().bodies;
  static const producer::BodySample kNone{Eigen::Vector3f::Zero(), Eigen::Quaternionf::Identity()};
  const producer::BodySample& first = bodies.empty() ? kNone : bodies.front();
  return orientations ? fields(bodies, first.orientation.coeffs().data(), 4, self)
                      : fields(bodies, first.position.data(), 3, self);
}

void bind_snapshot(py::module_& m) {
  py::class_<Snapshot, std::shared_ptr<Snapshot>>(
      m, "Snapshot",
      "The state of the simulation at one frame. Arrays are read-only views without a copy, which keep the "
      "snapshot alive.\nNumbers are float32 in metres and seconds; Y is up.")
      .def_readonly("frame", &Snapshot::frame)
      .def_readonly("time", &Snapshot::time, "Time of the film [s].")
      .def_property_readonly(
          "state_hash", [](const Snapshot& s) { return s.state_hash.hex(); },
          "Hash of the whole state: 32 hexadecimal digits. The command line prints the same hash.")
      .def_property_readonly(
          "positions", [](const py::object& self) { return bodies_of(self, false); },
          "Origins of the moving bodies, (n, 3) [m], in the order of Scene.moving_bodies.")
      .def_property_readonly(
          "orientations_xyzw", [](const py::object& self) { return bodies_of(self, true); },
          "Rotations of the moving bodies from body to world, (n, 4): unit quaternions [x, y, z, w].")
      .def_property_readonly(
          "orientations",
          [](const Snapshot& s) {
            py::array_t<float> out({static_cast<py::ssize_t>(s.bodies.size()), py::ssize_t{4}});
            auto rows = out.mutable_unchecked<2>();
            for (std::size_t i = 0; i < s.bodies.size(); ++i) {
              const Eigen::Quaternionf& q = s.bodies[i].orientation;
              const float wxyz[] = {q.w(), q.x(), q.y(), q.z()};
              for (py::ssize_t k = 0; k < 4; ++k) rows(static_cast<py::ssize_t>(i), k) = wxyz[k];
            }
            return out;
          },
          "Rotations of the moving bodies from body to world, (n, 4): unit quaternions [w, x, y, z]. The "
          "array is a copy.")
      .def_property_readonly(
          "point_sets",
          [](const py::object& self) {
            py::list out;
            for (const producer::PointSet& set : self.cast<const Snapshot&>().point_sets)
              out.append(points_of(set, self));
            return out;
          },
          "Particles: one dict for each entry of Scene.point_sets, with the arrays position (n, 3), velocity "
          "(n, 3), radius, color (n, 4), age and id.")
      .def_property_readonly(
          "cloths",
          [](const py::object& self) {
            py::list out;
            for (const producer::ClothSample& cloth : self.cast<const Snapshot&>().cloths)
              out.append(cloth_of(cloth, self));
            return out;
          },
          "Cloths: one dict for each entry of Scene.cloths, with the arrays position (n, 3) and velocity (n, "
          "3). A torn cloth also has triangles (t, 3) and sources.")
      .def(
          "to_bytes",
          [](const Snapshot& s) {
            const std::vector<uint8_t> bytes = producer::serialize(s);
            return py::bytes(reinterpret_cast<const char*>(bytes.data()), bytes.size());
          },
          "Returns the bytes of a snapshot file (docs/cache.md).");
}

void bind_scene_class(py::module_& m) {
  py::class_<SharedScene, std::shared_ptr<SharedScene>>(
      m, "Scene",
      "A scene that was read and checked. It cannot be changed; override its values when you load it.")
      .def_property_readonly("name", [](const SharedScene& s) { return s.loaded.scene.name; })
      .def_property_readonly("frame_count", [](const SharedScene& s) { return s.loaded.scene.frame_count(); })
      .def_property_readonly("fps",
                             [](const SharedScene& s) { return s.loaded.scene.output.fps.per_second(); })
      .def_property_readonly(
          "size",
          [](const SharedScene& s) {
            return py::make_tuple(s.loaded.scene.render.size.x(), s.loaded.scene.render.size.y());
          },
          "Size of the pictures: (width, height) [px].")
      .def_property_readonly(
          "moving_bodies", [](const SharedScene& s) { return names_of_moving_bodies(s.loaded.scene); },
          "Names of the bodies that are not static, in the order of Snapshot.positions.")
      .def_property_readonly("point_sets",
                             [](const SharedScene& s) { return names_of_point_sets(s.loaded.scene); })
      .def_property_readonly("cloths", [](const SharedScene& s) { return names_of_cloths(s.loaded.scene); })
      .def_property_readonly("warnings", [](const SharedScene& s) { return s.loaded.warnings; })
      .def_property_readonly(
          "simulation_key", [](const SharedScene& s) { return producer::simulation_key(s.loaded, s.models); },
          "Hash of everything that affects the simulation. A cache of this scene has the same key.")
      .def(
          "to_dict",
          [](const SharedScene& s) { return py::module_::import("json").attr("loads")(s.loaded.canonical); },
          "Returns the scene with all overrides and defaults as a dict.")
      .def("__repr__", [](const SharedScene& s) {
        return "<offstage.Scene '" + s.loaded.scene.name + "', " +
               std::to_string(s.loaded.scene.frame_count()) + " frames>";
      });
  m.def("load", &load, py::arg("file"), py::arg("set") = py::dict(),
        py::arg("allow") = std::vector<std::string>{},
        "Reads a scene file. `set` overrides values: {\"emitters.0.rate\": 200}. `allow`: folders, besides "
        "the\nscene's own, from which it may read files. Raises SceneError with every problem.");
  m.def("_parse", &parse);
}

/// The simulation of a scene, frame by frame.
class SceneSimulation {
 public:
  explicit SceneSimulation(std::shared_ptr<const SharedScene> scene)
      : scene_(std::move(scene)), simulation_(scene_->loaded.scene, scene_->models) {}

  SnapshotPointer advance() {
    const int wanted = simulation_.frame() + 1;
    while (simulation_.frame() < wanted) simulation_.advance();
    return std::make_shared<const Snapshot>(simulation_.snapshot());
  }
  SnapshotPointer snapshot() const { return std::make_shared<const Snapshot>(simulation_.snapshot()); }
  int frame() const { return simulation_.frame(); }
  sim::Energy energy() const { return simulation_.energy(); }
  std::string state_hash() const { return simulation_.world().state_hash().hex(); }
  const SharedScene& scene() const { return *scene_; }

 private:
  std::shared_ptr<const SharedScene> scene_;
  producer::Simulation simulation_;
};

void bind_simulation(py::module_& m) {
  using Released = py::call_guard<py::gil_scoped_release>;
  py::class_<SceneSimulation>(
      m, "Simulation",
      "The simulation of a scene, without drawing. Different threads may use different simulations at the "
      "same\ntime, but only one thread at a time may use a simulation.")
      .def(py::init<std::shared_ptr<SharedScene>>(), py::arg("scene"), Released())
      .def(
          "advance", [](SceneSimulation& s) { return std::const_pointer_cast<Snapshot>(s.advance()); },
          Released(),
          "Advances to the next frame and returns its Snapshot; the first call gives frame 1. Raises "
          "DivergedError.")
      .def("snapshot",
           [](const SceneSimulation& s) { return std::const_pointer_cast<Snapshot>(s.snapshot()); })
      .def_property_readonly("frame", &SceneSimulation::frame)
      .def_property_readonly("state_hash", &SceneSimulation::state_hash)
      .def_property_readonly(
          "energy",
          [](const SceneSimulation& s) {
            const sim::Energy e = s.energy();
            return py::dict(py::arg("kinetic") = e.kinetic, py::arg("potential") = e.potential,
                            py::arg("elastic") = e.elastic);
          },
          "Energy of the bodies, particles and cloths: a dict with kinetic, potential and elastic energy "
          "[J].");
}

void bind_cache(py::module_& m) {
  m.def("_cache_info", [](const std::string& folder) {
    const producer::CacheInfo info = producer::read_cache_info(folder);
    return py::dict(py::arg("format") = info.format, py::arg("frames") = info.frames,
                    py::arg("key") = info.key, py::arg("generation") = info.generation,
                    py::arg("bytes") = info.bytes, py::arg("problem") = info.problem);
  });
  m.def("_cache_snapshot", [](const std::string& folder, int frame) {
    const py::gil_scoped_release released;
    return std::make_shared<Snapshot>(producer::read_cached_snapshot(folder, frame));
  });
}

}  // namespace

void bind_scene(py::module_& m) {
  bind_snapshot(m);
  bind_scene_class(m);
  bind_simulation(m);
  bind_cache(m);
  m.def("parse_frames", &producer::parse_frames, py::arg("text"), py::arg("count"),
        "Returns the frame numbers that a text selects, such as \"1-30,40,50-90x2\" in a film of `count` "
        "frames.");
}

}  // namespace offstage::python
