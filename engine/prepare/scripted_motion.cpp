#include "engine/prepare/scripted_motion.hpp"

#include "base/trig.hpp"
#include "fem/rod/rod_frames.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

Vec3 evaluate_motion(const std::vector<MotionRow>& path, double time) noexcept {
    if (path.empty()) return Vec3::Zero();
    if (time <= path.front().time) return path.front().displacement;
    const auto next = std::lower_bound(path.begin() + 1, path.end(), time, [](const MotionRow& row, double t) { return row.time < t; });
    if (next == path.end()) return path.back().displacement;
    const MotionRow &from = *(next - 1), &to = *next;
    const double span = to.time - from.time;
    const double s = span > 0.0 ? (time - from.time) / span : 1.0;
    return from.displacement + s * (to.displacement - from.displacement);
}

double evaluate_rows(const std::vector<LoadRow>& rows, double time) noexcept {
    if (time <= rows.front().time) return rows.front().value;
    const auto next = std::upper_bound(rows.begin(), rows.end(), time, [](double t, const LoadRow& row) { return t < row.time; });
    if (next == rows.end()) return rows.back().value;
    const LoadRow &from = *(next - 1), &to = *next;
    return from.value + (time - from.time) / (to.time - from.time) * (to.value - from.value);
}

LoadLine fit_rows(const std::vector<LoadRow>& rows, double from, double to) noexcept {
    constexpr double kSame = 1e-9; // [-] of the time: rows so near its ends are at them
    const double length = to - from, first = evaluate_rows(rows, from), last = evaluate_rows(rows, to), middle = 0.5 * (from + to);
    double area = 0.0, moment = 0.0, start = from, value = first;
    const auto add = [&](double end, double end_value) { // Simpson's rule is exact
        area += 0.5 * (end - start) * (value + end_value);
        moment += (end - start) / 6.0 * (value * (start - middle) + (value + end_value) * (start + end - 2.0 * middle) + end_value * (end - middle));
        start = end, value = end_value;
    };
    const auto inner = std::upper_bound(rows.begin(), rows.end(), from + kSame * length, [](double t, const LoadRow& row) { return t < row.time; });
    const auto is_inner = [&](auto row) { return row != rows.end() && row->time < to - kSame * length; };
    if (!is_inner(inner)) return {first, (last - first) / length};
    for (auto row = inner; is_inner(row); ++row) add(row->time, row->value);
    add(to, last);
    const double rate = 12.0 * moment / (length * length * length);
    return {area / length - 0.5 * length * rate, rate};
}

static Mat3 turn_at(const Vec3& axis, const std::vector<LoadRow>& turns, double time) noexcept {
    return turns.empty() ? Mat3(Mat3::Identity()) : rotation_about(axis, evaluate_rows(turns, time));
}

void move_held_nodes(const BodyModel& body, double time, std::vector<Vec3>& target) {
    if (body.held.empty()) return;
    const fem::TissueModel& tissue = *body.tissue;
    if (target.empty())
        for (const Index node : tissue.pinned) target.push_back(tissue.rest_position[node]);
    for (const HeldNodes& held : body.held) {
        const Vec3 moved = evaluate_motion(held.moves, time);
        const Mat3 turn = turn_at(held.axis, held.turns, time);
        for (const Index k : held.pinned)
            target[k] = held.point + turn * (tissue.rest_position[tissue.pinned[k]] - held.point) + moved;
    }
}

fem::RodClamp find_tip_clamp(const InstrumentModel& instrument, double time) noexcept {
    const TipHold& hold = *instrument.tip_hold;
    const fem::RodPort& port = instrument.port;
    const double start = instrument.path.empty() ? 0.0 : instrument.path.front().rotation;
    const Vec3 rest = port.position + instrument.inserted * port.direction;
    const Vec3 across = rotation_about(port.direction, start) * fem::perpendicular_axis(port.direction);
    const Mat3 turn = turn_at(hold.axis, hold.turns, time);
    fem::RodClamp clamp;
    clamp.position = hold.point + turn * (rest - hold.point) + evaluate_motion(hold.moves, time);
    clamp.direction = turn * port.direction;
    clamp.axis = turn * (turn_at(port.direction, hold.rotation, time) * across);
    clamp.slides = hold.slides, clamp.spins = hold.spins;
    return clamp;
}

double wave_at(double period, double time) noexcept {
    const double turns = time / period;
    const double phase = 2.0 * std::numbers::pi * (turns - std::floor(turns));
    return 0.5 * (1.0 - sin_cos(phase).cos);
}

} // namespace trocar::engine
