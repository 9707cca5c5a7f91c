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
  py::class_<PythonFrame>(m, "Frame", "A frame of a film. Rows run from the top down.")
      .def_readonly("number", &PythonFrame::number, "From 1.")
      .def_readonly("time", &PythonFrame::time, "[s]")
      .def_readonly("snapshot", &PythonFrame::snapshot, "The state that it shows.")
      .def_readonly("image", &PythonFrame::image,
                    "(height, width, 4) uint8: RGBA, sRGB, straight alpha; or None.")
      .def_readonly("depth", &PythonFrame::depth,
                    "(height, width) float32 [m], infinite without a surface; or None.")
      .def_readonly("normal", &PythonFrame::normal, "(height, width, 3) float32, world axes; or None.")
      .def_readonly("id", &PythonFrame::id,
                    "(height, width) uint32: number of the object, 0 for none; or None.")
      .def_readonly("motion", &PythonFrame::motion,
                    "(height, width, 2) float32 [px] since the previous frame; or None.");
  py::class_<Film>(m, "Film",
                   "An iterator over the frames of a film, which a separate thread renders in advance.")
      .def("__iter__", [](py::object self) { return self; })
      .def("__next__", &next_frame)
      .def("__len__", &Film::total)
      .def("cancel", &Film::cancel, "Ends the film; the iterator then stops.")
      .def_property_readonly("done", &Film::done, "Number of frames that the iterator has returned.")
      .def_property_readonly("total", &Film::total);
  m.def("_film", &make_film, py::arg("scene"), py::arg("frames"), py::arg("images"), py::arg("channels"),
        py::arg("cache"), py::arg("threads"), py::arg("gl"), py::call_guard<py::gil_scoped_release>());
}

}  // namespace offstage::python
