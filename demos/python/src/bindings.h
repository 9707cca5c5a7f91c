#pragma once
/// The parts of the module.

#include <pybind11/pybind11.h>

#include "arrays.h"

namespace offstage::python {

void bind_scene(py::module_& m);  ///< Scene, Simulation, Snapshot, caches
void bind_film(py::module_& m);   ///< render()
void bind_world(py::module_& m);  ///< World and what it is made of
void bind_stage(py::module_& m);  ///< Stage

}  // namespace offstage::python
