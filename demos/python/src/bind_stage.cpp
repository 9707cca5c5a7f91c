// Stage: draws the objects of a World, without a scene.

#include <atomic>
#include <condition_variable>
#include <functional>
#include <future>
#include <mutex>
#include <thread>

#include "bindings.h"
#include "film.h"
#include "render/primitives.h"
#include "render/stage.h"
#include "render/tone_map.h"

namespace offstage::python {
namespace {

using Released = py::call_guard<py::gil_scoped_release>;

/// A context belongs to one thread, but a Python object may be used by any thread. The stage therefore has a
/// thread of its own, and calls wait for it.
class ThreadStage {
 public:
  ThreadStage(int width_px, int height_px) {
    if (width_px < 1 || height_px < 1 || width_px > 16384 || height_px > 16384)
      throw std::invalid_argument("width and height: must be 1 to 16384 px");
    std::promise<void> ready;
    std::future<void> made = ready.get_future();
    thread_ = std::jthread([this, width_px, height_px, &ready] {
      std::optional<render::Context> context;
      std::optional<render::Stage> stage;
      try {
        context.emplace();
        stage.emplace(*context, render::StageDef{.width_px = width_px, .height_px = height_px});
      } catch (...) {
        ready.set_exception(std::current_exception());
        return;
      }
      ready.set_value();
      serve(*stage);
    });
    made.get();
  }
  ~ThreadStage() {
    const std::lock_guard lock(mutex_);
    ended_ = true;
    changed_.notify_all();
  }

  /// Runs work(stage) on the stage's thread, waits, and returns the result. Throws the exceptions of `work`.
  template <class F>
  auto with(F&& work) {
    using Result = std::invoke_result_t<F, render::Stage&>;
    std::packaged_task<Result(render::Stage&)> task(std::forward<F>(work));
    std::future<Result> result = task.get_future();
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return !work_; });
      work_ = [&task](render::Stage& stage) { task(stage); };
      changed_.notify_all();
    }
    return result.get();
  }

  std::set<render::MaterialHandle> materials;
  std::set<render::InstanceHandle> instances;
  std::set<render::PointsHandle> points;

 private:
  void serve(render::Stage& stage) {
    while (true) {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [&] { return ended_ || work_; });
      if (ended_) return;
      const auto work = std::exchange(work_, nullptr);
      changed_.notify_all();
      lock.unlock();
      work(stage);
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  std::function<void(render::Stage&)> work_;
  bool ended_ = false;
  std::jthread thread_;  // declared last, because it uses the other members
};

template <class H>
H known(const std::set<H>& handles, H handle, const char* kind) {
  if (!handles.contains(handle))
    throw std::invalid_argument(std::string("this ") + kind + " is not one of this stage");
  return handle;
}

Eigen::Vector3f float_vec(const Triple& v) {
  return vec(v).cast<float>();
}

render::MaterialHandle add_material(ThreadStage& stage, const Triple& color, float alpha, float metallic,
                                    float roughness, float transmission, const Triple& emission) {
  render::Material m{.metallic = metallic,
                     .roughness = roughness,
                     .emission = float_vec(emission),
                     .transmission = transmission};
  m.color << float_vec(color), alpha;
  return *stage.materials.insert(stage.with([&](render::Stage& s) { return s.add_material(m); })).first;
}

render::InstanceHandle add_instance(ThreadStage& stage, const render::Mesh& mesh,
                                    render::MaterialHandle material, uint32_t object) {
  known(stage.materials, material, "material");
  return *stage.instances
              .insert(stage.with([&](render::Stage& s) {
                const render::InstanceHandle h = s.add_instance(s.add_mesh(mesh), material, !mesh.endless);
                s.set_object(h, object);
                return h;
              }))
              .first;
}

render::Mesh mesh_of(const sim::Shape& shape) {
  return std::visit(
      [](const auto& s) -> render::Mesh {
        using S = std::decay_t<decltype(s)>;
        if constexpr (std::is_same_v<S, sim::Sphere>)
          return render::make_sphere(static_cast<float>(s.radius));
        if constexpr (std::is_same_v<S, sim::Box>)
          return render::make_box(s.size.template cast<float>(),
                                  0.04f * static_cast<float>(s.size.minCoeff()));
        if constexpr (std::is_same_v<S, sim::Capsule>)
          return render::make_capsule(static_cast<float>(s.radius), static_cast<float>(s.height));
        if constexpr (std::is_same_v<S, sim::Cylinder>)
          return render::make_cylinder(static_cast<float>(s.radius), static_cast<float>(s.height));
        if constexpr (std::is_same_v<S, sim::Cone>)
          return render::make_cone(static_cast<float>(s.radius), static_cast<float>(s.height));
        if constexpr (std::is_same_v<S, sim::Frustum>)
          return render::make_frustum(static_cast<float>(s.radius), static_cast<float>(s.top_radius),
                                      static_cast<float>(s.height));
        if constexpr (std::is_same_v<S, sim::Ellipsoid>)
          return render::make_ellipsoid(s.radii.template cast<float>());
        if constexpr (std::is_same_v<S, sim::Plane>) return render::make_ground(256'000);
        throw std::invalid_argument("shape: give the vertices of a mesh to add_mesh");
      },
      shape);
}

render::Mesh mesh_of(const std::vector<sim::Vec3>& vertices,
                     const py::array_t<uint32_t, py::array::c_style | py::array::forcecast>& triangles) {
  if (triangles.ndim() != 2 || triangles.shape(1) != 3)
    throw std::invalid_argument("triangles: must have the shape (n, 3)");
  render::Mesh mesh;
  for (const sim::Vec3& v : vertices) mesh.positions.push_back(v.cast<float>());
  mesh.indices.assign(triangles.data(), triangles.data() + triangles.size());
  for (const uint32_t index : mesh.indices)
    if (index >= vertices.size()) throw std::invalid_argument("triangles: a vertex does not exist");
  render::compute_normals(mesh);
  return mesh;
}

py::array_t<uint8_t> image(ThreadStage& stage, int samples, float exposure) {
  if (samples < 1 || samples > 256) throw std::invalid_argument("samples: must be 1 to 256");
  render::Image picture;
  {
    const py::gil_scoped_release released;
    picture = stage.with([&](render::Stage& s) {
      render::HdrImage sum;
      for (int i = 0; i < samples; ++i) s.draw(render::sample_offsets(i, samples), sum);
      return render::tone_map(sum, {.exposure = exposure, .sample_weight = 1 / static_cast<float>(samples)});
    });
  }
  const py::ssize_t h = picture.height_px, w = picture.width_px;
  return taken<uint8_t>(std::move(picture.rgba), {h, w, 4});
}

py::dict channels(ThreadStage& stage) {
  render::Channels c;
  {
    const py::gil_scoped_release released;
    c = stage.with([](render::Stage& s) {
      s.store_previous_transforms();
      return s.channels(0);
    });
  }
  const py::ssize_t h = c.height_px, w = c.width_px;
  py::dict d;
  d["depth"] = taken<float>(std::move(c.depth), {h, w});
  d["normal"] = taken<float>(std::move(c.normal), {h, w, 3});
  d["id"] = taken<uint32_t>(std::move(c.id), {h, w});
  return d;
}

void set_points(ThreadStage& stage, render::PointsHandle handle,
                const py::array_t<double, py::array::c_style | py::array::forcecast>& positions, float radius,
                const Triple& color) {
  known(stage.points, handle, "set of points");
  std::vector<render::Point> points;
  uint64_t id = 0;
  for (const sim::Vec3& p : vectors(positions, "positions")) {
    render::Point point{.position = p.cast<float>(),
                        .velocity = Eigen::Vector3f::Zero(),
                        .radius = radius,
                        .color = {},
                        .id = id++};
    point.color << float_vec(color), 1;
    points.push_back(point);
  }
  const py::gil_scoped_release released;
  stage.with([&](render::Stage& s) { s.set_points(handle, points); });
}

}  // namespace

void bind_stage(py::module_& m) {
  py::class_<render::MaterialHandle>(m, "Material", "Handle of a material of a Stage.");
  py::class_<render::InstanceHandle>(m, "Instance", "Handle of a mesh that a Stage draws.");
  py::class_<render::PointsHandle>(m, "Points", "Handle of a set of balls that a Stage draws.");
  py::class_<ThreadStage>(
      m, "Stage",
      "Draws objects, for example those of a World. Handles name the objects, and set_pose() moves them.")
      .def(py::init([](int width_px, int height_px) {
             pin_environment_once(0, render::gl_platform_of_environment());
             return std::make_unique<ThreadStage>(width_px, height_px);
           }),
           py::arg("width") = 640, py::arg("height") = 360, Released())
      .def("add_material", &add_material, py::arg("color") = Triple{0.8, 0.8, 0.8}, py::arg("alpha") = 1,
           py::arg("metallic") = 0, py::arg("roughness") = 0.5, py::arg("transmission") = 0,
           py::arg("emission") = Triple{0, 0, 0},
           "Adds a material and returns its handle. Colours are linear.")
      .def(
          "add_shape",
          [](ThreadStage& stage, const sim::Shape& shape, render::MaterialHandle material, uint32_t object) {
            return add_instance(stage, mesh_of(shape), material, object);
          },
          py::arg("shape"), py::arg("material"), py::arg("object") = 0,
          "Adds a shape and returns its handle. `object`: number of the object in the channel `id`.")
      .def(
          "add_mesh",
          [](ThreadStage& stage,
             const py::array_t<double, py::array::c_style | py::array::forcecast>& vertices,
             const py::array_t<uint32_t, py::array::c_style | py::array::forcecast>& triangles,
             render::MaterialHandle material, uint32_t object) {
            return add_instance(stage, mesh_of(vectors(vertices, "vertices"), triangles), material, object);
          },
          py::arg("vertices"), py::arg("triangles"), py::arg("material"), py::arg("object") = 0)
      .def(
          "set_pose",
          [](ThreadStage& stage, render::InstanceHandle h, const Triple& position,
             const Quadruple& orientation) {
            known(stage.instances, h, "instance");
            const Eigen::Affine3f placed =
                Eigen::Translation3f(float_vec(position)) * quat(orientation).cast<float>();
            stage.with([&](render::Stage& s) { s.set_transform(h, placed); });
          },
          py::arg("instance"), py::arg("position"), py::arg("orientation") = Quadruple{1, 0, 0, 0})
      .def(
          "add_points",
          [](ThreadStage& stage) {
            return *stage.points
                        .insert(stage.with([](render::Stage& s) {
                          return s.add_points({.style = render::PointStyle::sphere});
                        }))
                        .first;
          },
          "Adds a set of balls and returns its handle; set_points() sets their positions.")
      .def("set_points", &set_points, py::arg("points"), py::arg("positions"), py::arg("radius"),
           py::arg("color") = Triple{0.8, 0.8, 0.8})
      .def(
          "set_camera",
          [](ThreadStage& stage, const Triple& eye, const Triple& target, float fov_deg) {
            if (!(fov_deg > 0 && fov_deg < 180)) throw std::invalid_argument("fov_deg: must be in (0, 180)");
            stage.with([&](render::Stage& s) {
              s.set_camera({.eye = float_vec(eye), .target = float_vec(target), .fov_deg = fov_deg});
            });
          },
          py::arg("eye"), py::arg("target") = Triple{0, 0, 0}, py::arg("fov_deg") = 40,
          "Sets the camera. `fov_deg`: vertical field of view [degrees].")
      .def("image", &image, py::arg("samples") = 4, py::arg("exposure") = 1,
           "Draws the picture: (height, width, 4) uint8, RGBA. `samples`: number of sub-frames.")
      .def("channels", &channels,
           "Draws the channels: a dict with depth (height, width) [m], normal (height, width, 3) and id "
           "(height, width).");
}

}  // namespace offstage::python
