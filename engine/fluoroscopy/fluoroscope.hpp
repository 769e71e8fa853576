// One C-arm: frames of states. What does not move is projected once, as long as the arm stands still.
#pragma once

#include "engine/fluoroscopy/detector.hpp"
#include "engine/fluoroscopy/patient.hpp"

namespace trocar::engine {

/// What a frame is made of, before the detector. Pixels, rows from top to bottom.
struct XrayFrame {
    ConeBeam beam;
    ArmAngles angles;
    std::vector<double> attenuation; // along each ray
    std::vector<double> contrast;    // of that what contrast agent adds; empty: there is none
};

class Fluoroscope {
public:
    /// view     outlives it
    Fluoroscope(const XrayView& view, unsigned threads = 1) : view_(view), threads_(threads) {}

    [[nodiscard]] const XrayFrame& project(XrayPatient& patient, const State& state);
    /// Of the projected frame, as the detector and the console show it.
    [[nodiscard]] GreyFrame frame(std::uint64_t step, double time);

    /// What the console keeps: a new mask, a new window. The roadmap fills while there is contrast: a device that moves without it leaves no trace.
    [[nodiscard]] Console& console() noexcept { return console_; }

    /// Where an instrument attenuates, and where a vessel does: 255 there, 0 elsewhere. After project.
    [[nodiscard]] GreyFrame device_mask() const;
    [[nodiscard]] GreyFrame vessel_mask(XrayPatient& patient, const State& state);
    /// Where rays first meet a body: 16 bits, of the source-detector distance; 0: nowhere.
    [[nodiscard]] GreyFrame depth(XrayPatient& patient, const State& state);

    [[nodiscard]] const XrayFrame& last() const noexcept { return now_; } // that was projected
    [[nodiscard]] const XrayView& view() const noexcept { return view_; }

private:
    const XrayView& view_;
    unsigned threads_;
    XrayFrame now_;
    AttenuationSums still_, sums_, device_, contrast_;
    AttenuationSums still_vessels_;   // of vessels that never move; empty: not drawn yet, or the arm has moved since
    std::vector<double> still_depth_; // likewise of all bodies
    bool has_still_ = false;
    Transmission transmission_;
    Console console_;
};

} // namespace trocar::engine
