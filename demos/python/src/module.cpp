// The Python module offstage._offstage.

#include "bindings.h"
#include "producer/base/error.h"
#include "producer/base/version.h"
#include "producer/build/simulation.h"
#include "render/error.h"

namespace offstage::python {
namespace {

// Owned by the module for the life of the process.
PyObject *scene_error = nullptr, *diverged_error = nullptr;

PyObject* new_exception(py::module_& m, const char* name, PyObject* base, const char* doc) {
  PyObject* type = PyErr_NewExceptionWithDoc((std::string("offstage.") + name).c_str(), doc, base, nullptr);
  m.add_object(name, type);
  return type;
}

void throw_with(PyObject* type, const char* what, const char* attribute, const py::object& value) {
  const py::object error = py::reinterpret_borrow<py::object>(type)(py::str(what));
  error.attr(attribute) = value;
  PyErr_SetObject(type, error.ptr());
}

void translate(std::exception_ptr error) {
  try {
    if (error) std::rethrow_exception(error);
  } catch (const SceneError& e) {
    throw_with(scene_error, e.what(), "problems", py::cast(e.problems()));
  } catch (const producer::DivergedError& e) {
    throw_with(diverged_error, e.what(), "state", py::str(e.state()));
  }
}

void bind_errors(py::module_& m) {
  py::class_<Problem>(m, "Problem", "One problem of a scene: its place and a message.")
      .def_property_readonly("file", [](const Problem& p) { return p.where.file; })
      .def_property_readonly(
          "line", [](const Problem& p) { return p.where.line; }, "From 1; 0: not from a file.")
      .def_property_readonly("column", [](const Problem& p) { return p.where.column; })
      .def_property_readonly(
          "path", [](const Problem& p) { return p.where.path; }, "JSON pointer, such as /emitters/0/rate.")
      .def_property_readonly("what", [](const Problem& p) { return p.what; })
      .def("__str__", &Problem::describe)
      .def("__repr__", &Problem::describe);
  scene_error = new_exception(m, "SceneError", PyExc_ValueError,
                              "A scene that cannot be used. `problems` lists the errors with their places.");
  diverged_error =
      new_exception(m, "DivergedError", PyExc_ArithmeticError,
                    "The simulation is no longer finite. `state` is the last state as JSON text.");
  py::register_exception<render::FileError>(m, "FileError", PyExc_OSError);
  py::register_exception<render::UnavailableError>(m, "UnavailableError", PyExc_RuntimeError);
  py::register_exception_translator(translate);
}

}  // namespace
}  // namespace offstage::python

PYBIND11_MODULE(_offstage, m) {
  using namespace offstage::python;
  m.doc() = "Deterministic simulation and drawing of scenes; see the package offstage.";
  m.attr("__version__") = std::string(offstage::producer::version());
  bind_errors(m);
  bind_scene(m);
  bind_film(m);
  bind_world(m);
  bind_stage(m);
}
