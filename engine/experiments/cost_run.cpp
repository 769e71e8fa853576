#include "engine/experiments/cost_run.hpp"

#include "engine/experiments/cost_along.hpp"
#include "engine/experiments/cost_exact.hpp"
#include "engine/experiments/cost_parts.hpp"
#include "engine/render/attach_culler.hpp"
#include "engine/report/statistics.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Runs of the same scene: curves have the same points.
class CurveBuilder {
public:
    explicit CurveBuilder(std::uint64_t steps) : every_(std::max<std::uint64_t>(1, (steps + kCurvePoints - 1) / kCurvePoints)) {}
    void add(const StepReport& report, double tip_distance, std::vector<CostPoint>& curve) {
        const CostPoint now{report.time_s,
                            static_cast<double>(report.level_reached),
                            static_cast<double>(report.pairs_open),
                            tip_distance,
                            report.ms.total,
                            report.ms.budget};
        if (count_++ % every_ == 0) {
            curve.push_back(now);
            return;
        }
        CostPoint& point = curve.back();
        point.time_s = now.time_s;
        point.level = std::min(point.level, now.level);
        point.pairs_open = std::max(point.pairs_open, now.pairs_open);
        point.tip_distance_m = std::max(point.tip_distance_m, now.tip_distance_m);
        point.step_ms = std::max(point.step_ms, now.step_ms);
        point.charged_ms = std::max(point.charged_ms, now.charged_ms);
    }

private:
    std::uint64_t every_, count_ = 0;
};

/// Sums over a run by itself, step by step.
struct OwnRun {
    double step_ms = 0.0; // that a step simulates
    std::vector<double> total_ms, charged_ms;
    std::uint64_t overruns = 0, slower = 0;
    double tip_sq = 0.0;

    void add(const StepReport& report, double tip, CostOwnRun& row) {
        total_ms.push_back(report.ms.total);
        charged_ms.push_back(report.ms.budget);
        overruns += !report.budget_kept;
        slower += report.ms.total > step_ms;
        tip_sq += tip * tip;
        row.tip_distance_max_m = std::max(row.tip_distance_max_m, tip);
        row.exact_steps += report.exact_ran;
        row.lumen_exits += report.lumen_exits;
        row.dropped_steps += report.dropped != 0;
        ++row.steps;
    }
    void finish(CostOwnRun& row) {
        row.step_ms = find_percentiles(total_ms);
        row.charged_ms = find_percentiles(charged_ms);
        if (row.steps == 0) return;
        const auto steps = static_cast<double>(row.steps);
        row.budget_kept = 1.0 - static_cast<double>(overruns) / steps;
        row.realtime_kept = 1.0 - static_cast<double>(slower) / steps;
        row.tip_distance_rms_m = std::sqrt(tip_sq / steps);
    }
};

/// model   the scene's, or a variant of it
CostOwnRun run_by_itself(const SceneModel& scene, const SceneModel& model, const CostOptions& options, const ExactRun& exact, const CostRow& of) {
    CostOwnRun row;
    Simulator simulator(model, of.budget.limits);
    (void)attach_culler(simulator); // the table says which
    if (!go_to_start(simulator, options, scene)) {
        row.failure = kForeignStart;
        return row;
    }
    CurveBuilder curve(exact.steps);
    OwnRun own{.step_ms = 1e3 * model.step_s};
    for (std::uint64_t k = 0; k < exact.steps && !options.interrupted(); ++k) {
        const StepReport& report = simulator.step();
        options.progress(fmt::format("{} by itself, step {}/{}", of.name(), k + 1, exact.steps));
        row.failure = report.failure;
        if (!report.finite) break;
        const double tip = tip_distance(simulator.state(), exact.tips[k]);
        own.add(report, tip, row);
        curve.add(report, tip, row.curve);
        if (row.steps % exact.every == 0)
            row.trajectory.join(compare_shapes(model, shape_of(model, simulator.state()), exact.shapes[row.steps / exact.every - 1]));
    }
    own.finish(row);
    row.state_hash = fmt::format("{:016x}", hash_state(simulator.state()));
    return row;
}

/// N, mean over bodies and steps; forces below it are rounding.
constexpr double kLoaded = 1e-12;

/// Zeros without meaning: there was no contact to compare.
void add_empty_notices(CostTable& table, const SceneModel& model) {
    if (table.steps == 0 || table.interrupted || table.force_rms_n > kLoaded) return;
    const std::string more =
        model.step_count > table.from + table.steps ? fmt::format("; -n {} goes to the end of the scene", model.step_count - table.from) : std::string();
    if (table.touched())
        table.notices.push_back(fmt::format("nothing was loaded: no contact force acts in the {} steps, so errors of forces and of what "
                                            "forces do to surfaces are 0 under any budget{}",
                                            table.steps, more));
    else
        table.notices.push_back(fmt::format("nothing touched: the exact run has no contact in its {} steps, so missed contacts and "
                                            "errors of depth, force and surface are 0 for want of contacts, not for the budget's sake{}",
                                            table.steps, more));
}

void add_notices(CostTable& table, const SceneModel& model, const ExactRun& exact) {
    add_empty_notices(table, model);
    if (!exact.failure.empty())
        table.notices.push_back(fmt::format("the exact run was stopped after {} steps: {}", exact.steps, exact.failure));
    for (const CostRow& row : table.rows)
        if (!row.failure.empty())
            table.notices.push_back(fmt::format("the run under {} was stopped after {} steps: {}", row.name(), row.steps, row.failure));
    if (table.near_uncovered > 0)
        table.notices.push_back(fmt::format("{} of {} patches nearer than the tolerance lie beneath no leaf contact of the exact "
                                            "descent: surfaces that are deeper in one another than their leaf spheres reach",
                                            table.near_uncovered, table.near_patches));
}

/// From the parts, or measured and kept there.
ExactRun find_exact_run(const SceneModel& model, const CostOptions& options, std::vector<std::string>& notices) {
    if (options.parts != nullptr)
        if (auto known = options.parts->exact_run()) return std::move(*known);
    ExactRun run = run_exactly(model, options);
    if (options.parts != nullptr && !options.interrupted())
        if (const auto kept = options.parts->keep(run); !kept) notices.push_back(kept.error().to_string());
    return run;
}

CostOwnRun find_own_run(const SceneModel& model, const CostOptions& options, const ExactRun& exact, const CostRow& row, std::size_t index,
                        std::vector<std::string>& notices) {
    if (options.parts != nullptr)
        if (auto known = options.parts->own_run(index)) return std::move(*known);
    const SceneModel& own = model_of(model, options, row);
    CostOwnRun run = run_by_itself(model, own, options, exact, row);
    if (options.parts != nullptr && !options.interrupted())
        if (const auto kept = options.parts->keep(index, run); !kept) notices.push_back(kept.error().to_string());
    return run;
}

/// From the parts, or found and kept there; nothing where the compared stretch begins with the scene.
std::optional<State> find_start(const SceneModel& model, const CostOptions& options) {
    if (options.from == 0) return std::nullopt;
    if (options.parts != nullptr)
        if (auto known = options.parts->start(model)) return known;
    State start = run_to_start(model, options);
    if (options.parts != nullptr && !options.interrupted()) (void)options.parts->keep_start(start); // else whoever needs it finds it again
    return start;
}

/// Options with the state that the compared stretch begins with.
struct StartedOptions {
    StartedOptions(const SceneModel& model, const CostOptions& asked) : options(asked), start(find_start(model, asked)) {
        if (start) options.start = &*start;
    }
    StartedOptions(const StartedOptions&) = delete;
    StartedOptions& operator=(const StartedOptions&) = delete;
    CostOptions options;
    std::optional<State> start;
};

} // namespace

bool CostTable::touched() const noexcept {
    return near_patches > 0 || std::any_of(rows.begin(), rows.end(), [](const CostRow& row) { return row.contacts.reference > 0; });
}

Result<CostStretch> choose_stretch(const SceneModel& model, double from_s, std::optional<std::uint64_t> steps, std::uint64_t usual) {
    constexpr double kLatest = 1e6; // s
    const auto refuse = [&](const std::string& expected) {
        return Error{ErrorCode::BadValue, fmt::format("found {:g} s, expected {}", from_s, expected), {}, 0, 0, "cost.from, or --from"};
    };
    if (!(from_s >= 0.0 && from_s <= kLatest)) return refuse(fmt::format("0 to {:g} s", kLatest));
    CostStretch stretch;
    stretch.from = static_cast<std::uint64_t>(std::llround(from_s / model.step_s));
    if (!steps && stretch.from >= model.step_count)
        return refuse(fmt::format("less than the {:g} s that the scene lasts, or a number of steps (-n)", static_cast<double>(model.step_count) * model.step_s));
    stretch.steps = steps ? *steps : std::min(model.step_count - stretch.from, usual);
    return stretch;
}

std::string start_text(const CostTable& table, double step_s) {
    return table.from > 0 ? fmt::format(" from {:g} s", static_cast<double>(table.from) * step_s) : std::string();
}

std::vector<CostRow> list_rows(const CostOptions& options) {
    std::vector<CostRow> rows;
    const auto add_budgets = [&](const std::string& variant) {
        for (const NamedBudget& budget : options.budgets) {
            CostRow& row = rows.emplace_back();
            row.budget = budget;
            row.variant = variant;
        }
    };
    add_budgets({});
    for (const CostVariant& variant : options.variants) add_budgets(variant.name);
    return rows;
}

Result<void> measure_own_run(const PreparedScene& prepared, const CostOptions& options, std::size_t row) {
    if (options.parts != nullptr && options.parts->own_run(row)) return {};
    std::vector<std::string> notices;
    const StartedOptions started(prepared.model, options);
    const ExactRun exact = find_exact_run(prepared.model, started.options, notices);
    [[maybe_unused]] const CostOwnRun run = find_own_run(prepared.model, started.options, exact, list_rows(options)[row], row, notices);
    if (!notices.empty()) return Error{ErrorCode::CannotWrite, notices.front()};
    return {};
}

Result<void> measure_exact_run(const PreparedScene& prepared, const CostOptions& options) {
    std::vector<std::string> notices;
    const StartedOptions started(prepared.model, options);
    [[maybe_unused]] const ExactRun exact = find_exact_run(prepared.model, started.options, notices);
    if (!notices.empty()) return Error{ErrorCode::CannotWrite, notices.front()};
    return {};
}

Result<CostTable> measure_cost(const PreparedScene& prepared, const CostSpec& cost, const CostOptions& asked) {
    const SceneModel& model = prepared.model;
    const StartedOptions started(model, asked);
    const CostOptions& options = started.options;
    CostTable table;
    table.from = options.from;
    table.model_hash = hash_model(model);
    table.rows = list_rows(options);
    for (const CostVariant& variant : options.variants)
        if (const std::string culler = describe_culler(*variant.model); !culler.empty()) table.notices.push_back(variant.name + ": " + culler);
    const ExactRun exact = find_exact_run(model, options, table.notices);
    table.steps = exact.steps;
    table.compared_states = exact.shapes.size();
    if (!options.elsewhere)
        for (std::size_t k = 0; k < table.rows.size(); ++k)
            static_cast<CostOwnRun&>(table.rows[k]) = find_own_run(model, options, exact, table.rows[k], k, table.notices);
    AlongExactStates along(model, cost, options, table);
    for (std::uint64_t k = 0; k < exact.steps && !options.interrupted(); ++k) {
        options.progress(fmt::format("along the exact states, step {}/{}", k + 1, exact.steps));
        if (!along.step(k + 1 == exact.busiest_step ? options.show : nullptr)) break;
        if ((k + 1) % exact.every == 0) along.compare_surfaces();
    }
    along.finish();
    for (std::size_t k = 0; options.elsewhere && k < table.rows.size(); ++k) {
        auto own = options.elsewhere(k);
        if (!own) return own.error();
        static_cast<CostOwnRun&>(table.rows[k]) = std::move(*own);
    }
    table.interrupted = options.interrupted();
    add_notices(table, model, exact);
    return table;
}

} // namespace trocar::engine
