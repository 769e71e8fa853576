#include "engine/report/statistics.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kMaxReserved = 1'000'000; // steps; longer runs grow as they go

double percentile(const std::vector<double>& sorted, double share) {
    const double rank = std::ceil(share * static_cast<double>(sorted.size()));
    return sorted[static_cast<std::size_t>(std::max(rank, 1.0)) - 1];
}

void join(CurvePoint& into, const CurvePoint& later) {
    into.steps += later.steps;
    into.time_s = later.time_s;
    for (Spread CurvePoint::*range :
         {&CurvePoint::total_ms, &CurvePoint::charged_ms, &CurvePoint::force_n, &CurvePoint::kinetic_j, &CurvePoint::elastic_j,
          &CurvePoint::volume_ratio, &CurvePoint::insertion_m, &CurvePoint::target_distance_m, &CurvePoint::level, &CurvePoint::pairs_open})
        (into.*range).join(later.*range);
    into.exact_steps += later.exact_steps;
    into.assumed += later.assumed;
    into.scaled_step_count += later.scaled_step_count;
    into.tip = later.tip;
}

CurvePoint make_point(const StepReport& report) {
    const auto at = [](double value) { return Spread{value, value, value}; };
    CurvePoint point;
    point.steps = 1;
    point.time_s = report.time_s;
    point.total_ms = at(report.ms.total);
    point.charged_ms = at(report.ms.budget);
    point.force_n = at(report.contact_force_n);
    point.kinetic_j = at(report.kinetic_j);
    point.elastic_j = at(report.elastic_j);
    point.volume_ratio = at(report.min_volume_ratio);
    point.insertion_m = at(report.insertion_m);
    point.target_distance_m = at(report.target_distance_m);
    point.level = at(report.level_reached);
    point.pairs_open = at(static_cast<double>(report.pairs_open));
    point.exact_steps = report.exact_ran;
    point.assumed = report.assumed;
    point.scaled_step_count = report.safe_fraction < 1.0;
    point.tip = report.tip;
    return point;
}

} // namespace

/// The tiny factor keeps what is a whole hundredth: 0.29 of binary digits is less.
double percent_of(double share) noexcept { return std::floor(1e4 * share * (1.0 + 1e-12)) / 100.0; }

Percentiles find_percentiles(std::vector<double>& values) {
    if (values.empty()) return {};
    std::sort(values.begin(), values.end());
    return {percentile(values, 0.50), percentile(values, 0.95), percentile(values, 0.99), values.back()};
}

void Spread::join(const Spread& later) noexcept {
    min = std::min(min, later.min);
    max = std::max(max, later.max);
    last = later.last;
}

void Curve::add(const StepReport& report) {
    const CurvePoint point = make_point(report);
    if (!points_.empty() && points_.back().steps < steps_per_point_) return join(points_.back(), point);
    if (points_.size() == kMaxPoints) {
        for (std::size_t i = 0; i < kMaxPoints / 2; ++i) {
            points_[i] = points_[2 * i];
            join(points_[i], points_[2 * i + 1]);
        }
        points_.resize(kMaxPoints / 2);
        steps_per_point_ *= 2;
    }
    points_.push_back(point);
}

std::array<double, kStageCount> stage_times(const StageTimes& ms) noexcept {
    return {ms.script, ms.fem, ms.steer, ms.descend, ms.exact, ms.respond};
}

void RunStatistics::reserve(std::uint64_t step_count) {
    const std::size_t count = static_cast<std::size_t>(std::min(step_count, kMaxReserved));
    total_ms.reserve(count);
    collision_ms.reserve(count);
    charged_ms.reserve(count);
    for (std::vector<double>& stage : stage_ms) stage.reserve(count);
}

void RunStatistics::add(const StepReport& report, double budget_ms, std::size_t pushed) {
    effects += report.effects;
    within_distance += report.within_distance;
    total_ms.push_back(report.ms.total);
    collision_ms.push_back(report.ms.descend + report.ms.exact);
    charged_ms.push_back(report.ms.budget);
    const std::array<double, kStageCount> times = stage_times(report.ms);
    for (std::size_t i = 0; i < kStageCount; ++i) stage_ms[i].push_back(times[i]);
    curve.add(report);

    const double energy_j = report.kinetic_j + report.elastic_j;
    if (steps == 0) energy = {energy_j, energy_j, energy_j};
    energy.last = energy_j;
    energy.max = std::max(energy.max, energy_j);

    overruns += !report.budget_kept;
    if (!report.budget_kept) worst_overrun_ms = std::max(worst_overrun_ms, report.ms.budget - budget_ms);
    worst_charged_ms = std::max(worst_charged_ms, report.ms.budget);
    smallest_safe_fraction = std::min(smallest_safe_fraction, report.safe_fraction);
    scaled_step_count += report.safe_fraction < 1.0;
    min_volume_ratio = std::min(min_volume_ratio, report.min_volume_ratio);
    inverted_tets = std::max(inverted_tets, report.inverted_tets);
    inverted_steps += report.inverted_tets > 0;
    if (report.stable_step_s > 0.0)
        stable_step_s = stable_step_s > 0.0 ? std::min(stable_step_s, report.stable_step_s) : report.stable_step_s;
    substeps = std::max(substeps, report.substeps);

    exact_steps += report.exact_ran;
    exact_abandoned += report.exact_abandoned;
    contacts += pushed;
    exact_contacts += report.exact_contacts;
    pressing_contacts += report.pressing_contacts;
    unresolved += report.unresolved;
    assumed += report.assumed;
    open_steps += report.pairs_open > 0;
    lumen_exits += report.lumen_exits;
    exit_steps += report.lumen_exits > 0;
    deepest_touch_m = std::max(deepest_touch_m, report.deepest_touch_m);
    deepest_share = std::max(deepest_share, report.deepest_share);
    deep_steps += report.deepest_share > kDeep;
    passed_places += report.passed_places;
    passed_steps += report.passed_places > 0;
    softened += report.softened;
    raised_steps += report.raised_bodies > 0;
    explicit_bodies += report.explicit_bodies;
    explicit_steps += report.explicit_bodies > 0;
    unconverged_solves += report.contact_unconverged;
    unconverged_steps += report.contact_unconverged > 0;
    unproven_solids += report.unproven_solids;
    unproven_solid_steps += report.unproven_solids > 0;
    left_pairs += report.left_pairs;
    left_steps += report.left_pairs > 0;
    floor_steps += report.below_floor;
    unproven_steps += report.unproven_links > 0;
    coarsest_level = steps == 0 ? report.level_reached : std::min(coarsest_level, report.level_reached);
    work_units += report.work_units;
    corrections += report.corrections;
    exact_forced += report.exact_forced;
    dropped_steps += report.dropped != 0;
    carried_steps += report.carried_instruments > 0;
    drive_limited_steps += report.drive_limited > 0;
    drive_stop_steps += report.drive_stops > 0;
    clamped_steps += report.clamped_forces > 0;

    largest_force_n = std::max(largest_force_n, report.contact_force_n);
    largest_handle_n = std::max(largest_handle_n, std::abs(report.handle_force_n));
    largest_torque_nm = std::max(largest_torque_nm, std::abs(report.handle_torque_nm));
    largest_imbalance_n = std::max(largest_imbalance_n, report.balance_n);
    largest_exchange_gap_n = std::max(largest_exchange_gap_n, report.exchange_gap_n);
    slowed_steps += report.slowed_rods > 0;
    stretched_steps += report.rod_stretch > kMostStretch;
    largest_stretch = std::max(largest_stretch, report.rod_stretch);
    self_contacts += report.self_contacts;
    self_held_steps += report.self_held > 0;
    instrument_contacts += report.instrument_contacts;
    instrument_held_steps += report.instrument_held > 0;
    largest_instrument_n = std::max(largest_instrument_n, report.instrument_force_n);
    beyond_bore_steps += report.beyond_bores > 0;
    largest_bore_excess_m = std::max(largest_bore_excess_m, report.bore_excess_m);
    largest_self_n = std::max(largest_self_n, report.self_force_n);
    unsettled_rods += report.unsettled_rods;
    unsettled_steps += report.unsettled_rods > 0;
    packing_density = report.packing_density;
    target_distance_m = report.target_distance_m;
    if (report.target_distance_m >= 0.0)
        closest_target_m = closest_target_m < 0.0 ? report.target_distance_m : std::min(closest_target_m, report.target_distance_m);
    insertion_m = report.insertion_m;
    rotation_rad = report.rotation_rad;
    tip = report.tip;
    ++steps;
}

std::uint64_t RunStatistics::count_slower_than_real_time(double step_s) const noexcept {
    const auto is_slower = [step_ms = 1e3 * step_s](double ms) { return ms > step_ms; };
    return static_cast<std::uint64_t>(std::count_if(total_ms.begin(), total_ms.end(), is_slower));
}

} // namespace trocar::engine
