#include "engine/viewer/recording.hpp"

#include "engine/report/places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace trocar::engine::viewer {

namespace {

constexpr std::array<const char*, kSpoilerCount> kReasons = {
    "its budget was a time: another run stops its tests elsewhere. A work budget repeats",
    "the budget was changed on the way",
    "an effect was switched on the way",
    "tissue was pulled by the user: a path holds drive commands alone",
    "contrast was injected a second time: a scene has one injection",
    "contrast was injected, and the scene lists its effects by name: a start has no place there. \"effects\" as an object has one",
    "the recording was full; what came later is missing",
    "the run stopped: its state left its bounds",
};

/// Of a run: the injection's start, in the scene's units. Empty: as the scene says.
std::string injection_option(const Scene& scene, double start) {
    if (start < 0.0) return {};
    const auto inside = scene.positions.lower_bound("effects.contrast.");
    if (inside != scene.positions.end() && inside->first.starts_with("effects.contrast.")) return fmt::format(" --set /effects/contrast/start={}", start);
    return fmt::format(" --set '/effects/contrast={{\"start\": {}}}'", start);
}

} // namespace

Recording::Recording(const Units& units, const DriveCommand& start, const BudgetLimits& limits)
    : time_unit_(units.time), length_unit_(units.length), angle_unit_(units.angle), limits_(limits), rows_(kCapacity + 1), count_(1) {
    rows_[0] = row_of(0.0, start);
    if (limits.mode == BudgetMode::Wall) spoil(Spoiler::WallBudget);
}

Recording::Recording(const Recording& run, const Mark& from)
    : time_unit_(run.time_unit_), length_unit_(run.length_unit_), angle_unit_(run.angle_unit_), limits_(run.limits_), rows_(kCapacity + 1),
      count_(from.steps + 1), spoilers_(from.spoilers), injection_(from.injection) {
    std::copy_n(run.rows_.begin(), from.steps + 1, rows_.begin());
}

Recording::Mark Recording::mark() const noexcept {
    return {steps(), spoilers_.load(std::memory_order_relaxed), injection_.load(std::memory_order_relaxed)};
}

DriveCommand Recording::position_of(const PathRow& row) const noexcept {
    return {row.insertion * length_unit_, row.rotation * angle_unit_};
}

/// Not before `time`.
double Recording::in_units(double time) const noexcept {
    double value = time / time_unit_;
    while (value * time_unit_ < time) value = std::nextafter(value, std::numeric_limits<double>::infinity());
    return value;
}

/// With a time that lay before its own a reader would already interpolate towards the next row.
PathRow Recording::row_of(double time, const DriveCommand& position) const noexcept {
    return {in_units(time), position.insertion / length_unit_, position.rotation / angle_unit_};
}

double Recording::add_injection(double time) noexcept {
    const double start = in_units(time);
    injection_.store(start, std::memory_order_relaxed);
    return start * time_unit_;
}

DriveCommand Recording::add(double time, const DriveCommand& wanted) noexcept {
    const std::size_t count = count_.load(std::memory_order_relaxed);
    if (count > kCapacity) {
        spoil(Spoiler::Full);
        return wanted;
    }
    rows_[count] = row_of(time, wanted);
    count_.store(count + 1, std::memory_order_release);
    // Through the same function as a run's script, between the same two rows.
    const auto drive_row = [this](const PathRow& row) {
        const DriveCommand position = position_of(row);
        return DriveRow{seconds(row), position.insertion, position.rotation};
    };
    const std::array<DriveRow, 2> last{drive_row(rows_[count - 1]), drive_row(rows_[count])};
    return evaluate_path(last, time);
}

std::string Recording::text(const Scene& scene, std::size_t steps, std::uint64_t state_hash) const {
    BudgetSpec budget;
    budget.limits = limits_;
    std::string out = fmt::format("# Drive positions of an interactive run of {}, {} steps.\n", project_path(scene.file), steps);
    if (repeatable())
        out += fmt::format("# Bit for bit: trocar run {} --budget {} -n {}{} --path THIS_FILE\n", shell_quoted(project_path(scene.file)),
                           budget.to_string(), steps, injection_option(scene, injection_.load(std::memory_order_relaxed)));
    for (std::size_t i = 0; i < kSpoilerCount; ++i)
        if (spoiled(static_cast<Spoiler>(i))) out += fmt::format("# Not repeated bit for bit by this file: {}.\n", kReasons[i]);
    out += fmt::format("# state_hash {:016x}\nt,insertion,rotation\n", state_hash);
    for (std::size_t k = 0; k <= steps && k < count_.load(std::memory_order_acquire); ++k)
        fmt::format_to(std::back_inserter(out), "{},{},{}\n", rows_[k].time, rows_[k].insertion, rows_[k].rotation);
    return out;
}

} // namespace trocar::engine::viewer
