#include "python/binding/pictures.hpp"

#include <algorithm>

namespace trocar::python {

namespace {

py::array_t<double> places(const std::vector<engine::PixelPlace>& of) {
    py::array_t<double> array({static_cast<py::ssize_t>(of.size()), py::ssize_t{2}});
    for (std::size_t k = 0; k < of.size(); ++k) std::copy(of[k].begin(), of[k].end(), array.mutable_data() + 2 * k);
    return array;
}

} // namespace

py::array picture_array(const engine::GreyFrame& frame) {
    const std::vector<py::ssize_t> shape{static_cast<py::ssize_t>(frame.height), static_cast<py::ssize_t>(frame.width)};
    if (frame.bits == 16) return py::array_t<std::uint16_t>(shape, frame.values.data());
    py::array_t<std::uint8_t> bytes(shape);
    std::transform(frame.values.begin(), frame.values.end(), bytes.mutable_data(), [](std::uint16_t v) { return static_cast<std::uint8_t>(v); });
    return bytes;
}

py::dict picture_dict(const engine::XrayObservation& observation) {
    py::dict out;
    out["image"] = picture_array(observation.image), out["device"] = picture_array(observation.device);
    out["vessel"] = picture_array(observation.vessel), out["depth"] = picture_array(observation.depth);
    py::array_t<double> projection({py::ssize_t{3}, py::ssize_t{4}});
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 4; ++c) projection.mutable_at(r, c) = observation.projection(r, c);
    out["projection"] = projection;
    out["primary"] = observation.angles.primary, out["secondary"] = observation.angles.secondary;
    out["tips"] = places(observation.tips);
    py::list lines;
    for (const auto& line : observation.centrelines) lines.append(places(line));
    out["centrelines"] = lines;
    return out;
}

} // namespace trocar::python
