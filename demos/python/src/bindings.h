#pragma once
/// Functions that add the parts of the module.

#include <pybind11/pybind11.h>

#include "arrays.h"

namespace offstage::python {

class LiveWorld;

void bind_scene(py::module_& m);  ///< adds Scene, Simulation, Snapshot and the functions of caches
void bind_film(py::module_& m);   ///< render()
void bind_world(py::module_& m);  ///< World, handles, step_all()
void bind_shapes(py::module_& m);
void bind_building(py::class_<LiveWorld>& world);  ///< methods of World that add objects
void bind_stage(py::module_& m);                   ///< Stage

}  // namespace offstage::python
