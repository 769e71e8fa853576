#include "engine/report/lettered_frame.hpp"

#include "engine/render/orientation.hpp"

namespace trocar::engine {

GreyFrame lettered_frame(const GreyFrame& frame, const ConeBeam& beam) {
    const unsigned shift = frame.bits - 8;
    Picture marks{static_cast<int>(frame.width), static_cast<int>(frame.height), std::vector<std::uint8_t>(3 * frame.values.size())};
    for (std::size_t k = 0; k < frame.values.size(); ++k)
        for (std::size_t c = 0; c < 3; ++c) marks.rgb[3 * k + c] = static_cast<std::uint8_t>(frame.values[k] >> shift);
    const Picture before = marks;
    const ViewAxes axes{beam.right, -beam.down, -beam.along}; // seen from the detector
    draw_orientation_cube(axes, marks);
    draw_edge_letters(axes, marks);
    GreyFrame out = frame;
    for (std::size_t k = 0; k < out.values.size(); ++k) { // what no mark lies on keeps all its bits
        const std::uint8_t green = marks.rgb[3 * k + 1];
        if (green != before.rgb[3 * k + 1]) out.values[k] = static_cast<std::uint16_t>(shift == 8 ? 257 * green : green);
    }
    return out;
}

} // namespace trocar::engine
