// render(): returns a film as an iterator over its frames.

#include "bindings.h"
#include "film.h"
#include "producer/run/frame_list.h"

namespace offstage::python {
namespace {

/// A frame as Python sees it. Its pictures are numpy arrays that take over the memory of the C++ frame.
struct PythonFrame {
  int number;
  double time;
  std::shared_ptr<producer::Snapshot> snapshot;
  py::object image = py::none(), depth = py::none(), normal = py::none(), id = py::none(),
             motion = py::none();
};

void take_channels(render::Channels&& c, PythonFrame& frame) {
  const py::ssize_t h = c.height_px, w = c.width_px;
  frame.depth = taken<float>(std::move(c.depth), {h, w});
  frame.normal = taken<float>(std::move(c.normal), {h, w, 3});
  frame.id = taken<uint32_t>(std::move(c.id), {h, w});
  frame.motion = taken<float>(std::move(c.motion), {h, w, 2});
}

PythonFrame to_python(FilmFrame&& film_frame) {
  PythonFrame frame{film_frame.number, film_frame.time_s,
                    std::const_pointer_cast<producer::Snapshot>(film_frame.snapshot)};
  if (film_frame.image) {
    const py::ssize_t h = film_frame.image->height_px, w = film_frame.image->width_px;
    frame.image = taken<uint8_t>(std::move(film_frame.image->rgba), {h, w, 4});
  }
  if (film_frame.channels) take_channels(std::move(*film_frame.channels), frame);
  return frame;
}

PythonFrame next_frame(Film& film) {
  std::optional<FilmFrame> frame;
  {
    // Ctrl-C takes effect between two frames.
    const py::gil_scoped_release released;
    frame = film.next();
  }
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  if (!frame) throw py::stop_iteration();
  return to_python(std::move(*frame));
}

std::unique_ptr<Film> make_film(const std::shared_ptr<SharedScene>& scene, const std::string& frames,
                                bool images, bool channels, const std::optional<std::string>& cache,
                                int threads, const std::string& gl) {
  FilmJob job{.frames = producer::parse_frames(frames, scene->loaded.scene.frame_count()),
              .images = images,
              .channels = channels,
              .cache = {}};
  if (cache) job.cache = *cache;
  pin_environment_once(threads, gl.empty() ? render::gl_platform_of_environment() : render::gl_platform(gl));
  return std::make_unique<Film>(scene, std::move(job));
}

}  // namespace

void bind_film(py::module_& m) {
  py::class_<PythonFrame>(
      m, "Frame", "A frame of a film. The rows of its arrays run from the top of the picture to the bottom.")
      .def_readonly("number", &PythonFrame::number, "Number of the frame, from 1.")
      .def_readonly("time", &PythonFrame::time, "Time of the film [s].")
      .def_readonly("snapshot", &PythonFrame::snapshot,
                    "Snapshot with the state of the simulation that the frame shows.")
      .def_readonly(
          "image", &PythonFrame::image,
          "Picture, (height, width, 4) uint8: RGBA in sRGB with straight alpha. None without `images`.")
      .def_readonly("depth", &PythonFrame::depth,
                    "Distance along the view direction, (height, width) float32 [m]; infinite where no "
                    "surface is visible. None without `channels`.")
      .def_readonly("normal", &PythonFrame::normal,
                    "Unit normals of the visible surfaces in world axes, (height, width, 3) float32. None "
                    "without `channels`.")
      .def_readonly(
          "id", &PythonFrame::id,
          "Numbers of the visible objects, (height, width) uint32; 0: no object. None without `channels`.")
      .def_readonly("motion", &PythonFrame::motion,
                    "Motion on the picture since the previous frame, (height, width, 2) float32 [px]. None "
                    "without `channels`.");
  py::class_<Film>(m, "Film",
                   "An iterator over the frames of a film, which a separate thread renders in advance.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &next_frame)
      .def("__len__", &Film::total)
      .def("cancel", &Film::cancel, "Ends the film. The iterator returns no further frames.")
      .def_property_readonly("done", &Film::done, "Number of frames that the iterator has returned.")
      .def_property_readonly("total", &Film::total);
  m.def("_film", &make_film, py::arg("scene"), py::arg("frames"), py::arg("images"), py::arg("channels"),
        py::arg("cache"), py::arg("threads"), py::arg("gl"), py::call_guard<py::gil_scoped_release>());
}

}  // namespace offstage::python
