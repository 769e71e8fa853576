// The parts of the module trocar._engine.
#pragma once

#include <pybind11/pybind11.h>

namespace trocar::python {

void bind_scene(pybind11::module_& module);
void bind_simulator(pybind11::module_& module);
void bind_functions(pybind11::module_& module);
void bind_episodes(pybind11::module_& module);

} // namespace trocar::python
