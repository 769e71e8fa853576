// X-ray frames as arrays.
#pragma once

#include "engine/fluoroscopy/observation.hpp"

#include <pybind11/numpy.h>

namespace trocar::python {

namespace py = pybind11;

/// (rows, columns) uint8 or uint16, of its own.
[[nodiscard]] py::array picture_array(const engine::GreyFrame& frame);

/// image, device, vessel, depth, projection (3, 4), primary, secondary (rad), tips (devices, 2), centrelines [(N, 2)]: what trocar.XrayFrame is made of.
[[nodiscard]] py::dict picture_dict(const engine::XrayObservation& observation);

} // namespace trocar::python
