// From attenuation along rays to the grey values of a frame: scattered radiation, the detector's point spread, counted photons, and how
// the console shows it.
#pragma once

#include "engine/fluoroscopy/cone_beam.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace trocar::engine {

/// Rows from top to bottom.
struct GreyFrame {
    unsigned width = 0, height = 0;
    unsigned bits = 8;                 // 8 or 16: full scale is 2^bits - 1
    std::vector<std::uint16_t> values; // [height * width]
};

/// Of the open beam, where nothing is in its way.
using Transmission = std::vector<double>;

/// exp(-attenuation), then scatter, point spread and noise as the view has them. The noise of a pixel depends on the view's seed, the
/// frame's number and the pixel alone.
/// frame     of the run: a step's number
void detect(const XrayView& view, std::span<const double> attenuation, std::uint64_t frame, Transmission& out);

/// The number of photons counted where `expected` are, by a stream of bits: exact below 30 (inversion), a rounded normal beyond.
[[nodiscard]] double count_photons(double expected, std::uint64_t stream) noexcept;

/// Gaussian, separable, edges continued; sigma in pixels, nothing below a twentieth of one.
void blur(std::vector<double>& values, unsigned width, unsigned height, double sigma_x, double sigma_y);

/// What the console keeps from frame to frame.
struct Console {
    std::optional<std::array<double, 2>> window; // of attenuation: white, black
    std::vector<double> mask;                    // attenuation of the mask frame; empty: none yet
    std::vector<double> filled;                  // largest attenuation above the mask's so far: the roadmap
    bool fills = true;                           // filled grows with this frame
};

/// The frame as it is shown.
/// time      s, of the frame: the first one not before XrayView::mask is the mask
[[nodiscard]] GreyFrame show(const XrayView& view, const Transmission& transmission, double time, Console& console);

[[nodiscard]] inline unsigned bits_of(const XrayView& view) noexcept {
    return view.bits != 0 ? view.bits : view.display == XrayDisplay::Linear ? 16 : 8;
}

} // namespace trocar::engine
