// A run in numbers: what each step adds to the summary, and a curve of bounded size for the plots.
#pragma once

#include "engine/report/run_summary.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <array>
#include <vector>

namespace trocar::engine {

/// %; of a share in [0, 1] to two digits, never rounded up: 100 is all of them.
[[nodiscard]] double percent_of(double share) noexcept;

/// Nearest-rank percentiles: values that were measured, none in between. Reorders `values`; empty: zeros.
[[nodiscard]] Percentiles find_percentiles(std::vector<double>& values);

/// A number over several steps: plots show the range, so that no spike is lost.
struct Spread {
    double min = 0.0, max = 0.0, last = 0.0;
    void join(const Spread& later) noexcept;
};

/// Neighbouring steps in one point of a plot.
struct CurvePoint {
    std::uint64_t steps = 0;
    double time_s = 0.0; // of the last step
    Spread total_ms, charged_ms, force_n, kinetic_j, elastic_j, volume_ratio;
    Spread insertion_m, target_distance_m, level, pairs_open;
    std::uint64_t exact_steps = 0, assumed = 0, scaled_step_count = 0;
    Vec3 tip = Vec3::Zero();
};

/// At most kMaxPoints points, whatever the number of steps: when they are full, neighbours are joined.
class Curve {
public:
    static constexpr std::size_t kMaxPoints = 1600;
    void add(const StepReport& report);
    [[nodiscard]] const std::vector<CurvePoint>& points() const noexcept { return points_; }
    [[nodiscard]] std::uint64_t steps_per_point() const noexcept { return steps_per_point_; }

private:
    std::vector<CurvePoint> points_;
    std::uint64_t steps_per_point_ = 1;
};

enum class Stage : std::uint8_t { Script, Fem, EmbeddedSurfaces, Descend, Exact, Respond };
inline constexpr std::size_t kStageCount = 6;
inline constexpr std::array<const char*, kStageCount> kStageNames{"script", "fem", "steer", "descend", "exact", "respond"};
[[nodiscard]] std::array<double, kStageCount> stage_times(const StageTimes& ms) noexcept;

struct EnergyRange {
    double first = 0.0, last = 0.0, max = 0.0; // J, kinetic and elastic
};

/// Everything that is counted step by step. One double per step and series is kept for the percentiles.
struct RunStatistics {
    std::vector<double> total_ms, collision_ms, charged_ms;
    std::array<std::vector<double>, kStageCount> stage_ms;
    Curve curve;
    EnergyRange energy;
    EffectCounts effects;
    std::uint64_t within_distance = 0; // steps
    double worst_overrun_ms = 0.0, worst_charged_ms = 0.0, smallest_safe_fraction = 1.0;
    double min_volume_ratio = 1.0, stable_step_s = 0.0;
    double deepest_touch_m = 0.0, deepest_share = 0.0;
    double largest_force_n = 0.0, largest_handle_n = 0.0, largest_torque_nm = 0.0, largest_imbalance_n = 0.0, largest_exchange_gap_n = 0.0, target_distance_m = -1.0, closest_target_m = -1.0;
    double insertion_m = 0.0, rotation_rad = 0.0;
    Vec3 tip = Vec3::Zero();
    unsigned substeps = 0;
    std::uint32_t inverted_tets = 0;
    int coarsest_level = 0;
    std::uint64_t steps = 0, overruns = 0, exact_steps = 0, exact_abandoned = 0, scaled_step_count = 0, open_steps = 0;
    std::uint64_t exact_contacts = 0, pressing_contacts = 0; // what continuous tests found; places where instruments press on their walls
    std::uint64_t contacts = 0, unresolved = 0, assumed = 0, lumen_exits = 0, exit_steps = 0, unproven_steps = 0;
    std::uint64_t passed_places = 0, passed_steps = 0, softened = 0, deep_steps = 0, unconverged_solves = 0,
                  unconverged_steps = 0, unproven_solids = 0, unproven_solid_steps = 0, unsettled_rods = 0, unsettled_steps = 0, slowed_steps = 0, stretched_steps = 0, self_contacts = 0,
                  self_held_steps = 0, instrument_contacts = 0, instrument_held_steps = 0;
    double packing_density = -1.0, largest_self_n = 0.0; // [-] last; N, sum of normal forces of instruments on themselves
    double largest_instrument_n = 0.0;                // N, the same on one another
    double largest_bore_excess_m = 0.0;               // m
    double largest_stretch = 0.0;                     // [-] of a rod's segment
    std::uint64_t beyond_bore_steps = 0;
    std::uint64_t raised_steps = 0; // in which a body took more sub-steps than time.substeps asks for
    std::uint64_t explicit_bodies = 0, explicit_steps = 0; // implicit steps that did not converge; steps with any
    std::uint64_t left_pairs = 0, left_steps = 0, floor_steps = 0;
    std::uint64_t inverted_steps = 0, work_units = 0, corrections = 0;
    std::uint64_t carried_steps = 0, drive_limited_steps = 0, drive_stop_steps = 0, clamped_steps = 0, exact_forced = 0, dropped_steps = 0;

    /// [-], of the thinner body's thickness: solids that lie deeper in one another than that visibly penetrate.
    static constexpr double kDeep = 0.25;
    /// [-] of a rod's segment; metals and polymers of devices break, or fold, before.
    static constexpr double kMostStretch = 0.1;

    void reserve(std::uint64_t step_count);
    /// budget_ms  limit of a step, infinity where the budget is no time
    /// pushed     places that the step's response pushed against (Simulator::contacts)
    void add(const StepReport& report, double budget_ms, std::size_t pushed);
    /// Whole steps that took longer than the time they simulate, whatever the budget covers.   step_s  s, what a step simulates
    [[nodiscard]] std::uint64_t count_slower_than_real_time(double step_s) const noexcept;
};

} // namespace trocar::engine
