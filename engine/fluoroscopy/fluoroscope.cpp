#include "engine/fluoroscopy/fluoroscope.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::engine {

namespace {

GreyFrame mask_of(const XrayView& view, const AttenuationSums& sums) {
    GreyFrame frame{view.pixels[0], view.pixels[1], 8, std::vector<std::uint16_t>(view.pixel_count(), 0)};
    for (std::size_t k = 0; k < sums.size(); ++k) frame.values[k] = sums[k] != 0 ? 255 : 0;
    return frame;
}

} // namespace

const XrayFrame& Fluoroscope::project(XrayPatient& patient, const State& state) {
    const ArmAngles angles = find_angles(view_, state.time);
    if (angles.primary != now_.angles.primary || angles.secondary != now_.angles.secondary) {
        has_still_ = false;
        still_vessels_.clear(), still_depth_.clear();
    }
    now_.angles = angles;
    now_.beam = make_cone_beam(view_, angles);
    Projector projector(now_.beam, threads_);
    const auto draw = [&](bool moving, AttenuationSums& sums) {
        for (std::size_t i = 0; i < patient.bodies().size(); ++i) {
            if (patient.bodies()[i].moves != moving) continue;
            projector.add(patient.body(state, i), sums);
            if (patient.bodies()[i].wall != 0.0) projector.add(patient.wall(state, i), sums);
        }
    };
    if (!has_still_) {
        still_.assign(view_.pixel_count(), 0);
        draw(false, still_);
        has_still_ = true;
    }
    sums_ = still_;
    draw(true, sums_);
    device_.assign(sums_.size(), 0);
    for (std::size_t i = 0; i < patient.instruments().size(); ++i) projector.add(patient.instrument(state, i), device_);
    contrast_.assign(sums_.size(), 0);
    const XraySurface iodine = patient.contrast(state);
    if (!iodine.triangles.empty()) projector.add(iodine, contrast_);
    for (std::size_t k = 0; k < sums_.size(); ++k) sums_[k] += device_[k] + contrast_[k];
    projector.attenuations(sums_, now_.attenuation);
    now_.contrast.clear();
    if (!iodine.triangles.empty()) projector.attenuations(contrast_, now_.contrast);
    return now_;
}

GreyFrame Fluoroscope::frame(std::uint64_t step, double time) {
    detect(view_, now_.attenuation, step, transmission_);
    console_.fills = !now_.contrast.empty();
    return show(view_, transmission_, time, console_);
}

GreyFrame Fluoroscope::device_mask() const { return mask_of(view_, device_); }

GreyFrame Fluoroscope::vessel_mask(XrayPatient& patient, const State& state) {
    Projector projector(now_.beam, threads_);
    const auto draw = [&](bool moving, AttenuationSums& sums) {
        for (std::size_t i = 0; i < patient.bodies().size(); ++i) {
            if (!patient.bodies()[i].vessel || patient.bodies()[i].moves != moving) continue;
            XraySurface surface = patient.body(state, i);
            surface.attenuation = 1.0;
            projector.add(surface, sums);
        }
    };
    if (still_vessels_.empty()) {
        still_vessels_.assign(view_.pixel_count(), 0);
        draw(false, still_vessels_);
    }
    AttenuationSums sums = still_vessels_;
    draw(true, sums);
    return mask_of(view_, sums);
}

GreyFrame Fluoroscope::depth(XrayPatient& patient, const State& state) {
    Projector projector(now_.beam, threads_);
    const auto draw = [&](bool moving, std::vector<double>& nearest) {
        for (std::size_t i = 0; i < patient.bodies().size(); ++i)
            if (patient.bodies()[i].moves == moving) projector.add_depth(patient.body(state, i), nearest);
    };
    if (still_depth_.empty()) {
        still_depth_.assign(view_.pixel_count(), std::numeric_limits<double>::infinity());
        draw(false, still_depth_);
    }
    std::vector<double> nearest = still_depth_;
    draw(true, nearest);
    for (std::size_t i = 0; i < patient.instruments().size(); ++i) projector.add_depth(patient.instrument(state, i), nearest);
    GreyFrame frame{view_.pixels[0], view_.pixels[1], 16, std::vector<std::uint16_t>(nearest.size(), 0)};
    for (std::size_t k = 0; k < nearest.size(); ++k)
        if (std::isfinite(nearest[k])) frame.values[k] = static_cast<std::uint16_t>(std::clamp(nearest[k] / view_.sid, 0.0, 1.0) * 65535.0 + 0.5);
    return frame;
}

} // namespace trocar::engine
