// Arrays between numpy and the engine: views that keep their owner alive, and checked inputs.
#pragma once

#include "base/vec.hpp"

#include <pybind11/numpy.h>

#include <span>
#include <vector>

namespace trocar::python {

namespace py = pybind11;

static_assert(sizeof(Vec3) == 3 * sizeof(double));

/// [n, 3] float64, read-only, in place. owner   what keeps the memory alive: the array's base
inline py::array view_points(std::span<const Vec3> points, const py::handle& owner) {
    const auto count = static_cast<py::ssize_t>(points.size());
    py::array_t<double> view({count, py::ssize_t{3}}, reinterpret_cast<const double*>(points.data()), owner);
    view.attr("setflags")(py::arg("write") = false);
    return view;
}

/// [n, 3] float64, of its own.
inline py::array_t<double> copy_points(std::span<const Vec3> points) {
    return py::array_t<double>({static_cast<py::ssize_t>(points.size()), py::ssize_t{3}}, reinterpret_cast<const double*>(points.data()));
}
inline py::array_t<double> copy_vector(const Vec3& v) { return py::array_t<double>(py::ssize_t{3}, v.data()); }

/// Of an array that the Python side has made float64, contiguous and [n, 3].
inline std::vector<Vec3> take_points(const py::array_t<double, py::array::c_style>& array) {
    const auto* first = reinterpret_cast<const Vec3*>(array.data());
    return {first, first + array.shape(0)};
}

} // namespace trocar::python
