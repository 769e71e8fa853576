// What moves by a script or a period: kinematic bodies, breath, pulse.
#pragma once

#include "engine/prepare/model.hpp"

namespace trocar::engine {

/// Displacement of a kinematic body: linear between rows, held outside.
[[nodiscard]] Vec3 evaluate_motion(const std::vector<MotionRow>& path, double time) noexcept;

/// Linear between rows, held outside. rows: not empty.
[[nodiscard]] double evaluate_rows(const std::vector<LoadRow>& rows, double time) noexcept;

/// A straight line over a time.
struct LoadLine {
    double first = 1.0, rate = 0.0; // at its start; 1/s
};

/// What has the rows' integral over this time, and its first moment: a free body that it pushes ends where the rows would push it, with their momentum.
/// A jump within the time makes the line steep enough to begin or end beyond the rows.
[[nodiscard]] LoadLine fit_rows(const std::vector<LoadRow>& rows, double from, double to) noexcept;

/// Where held nodes are that move as told. target [pinned_count] m, or empty, which is filled with the rest places first.
void move_held_nodes(const BodyModel& body, double time, std::vector<Vec3>& target);

/// Where a rod's tip is held at a time.
[[nodiscard]] fem::RodClamp find_tip_clamp(const InstrumentModel& instrument, double time) noexcept;

/// Share of a breath or a beat at a time, 0 at the start of a period, 1 in its middle; smooth, and free of libm.
/// source   amplitude (1 - cos) / 2
[[nodiscard]] double wave_at(double period, double time) noexcept;

} // namespace trocar::engine
