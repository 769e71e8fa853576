#include "engine/observe/cost_run.hpp"

#include "engine/observe/statistics.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace seldinger::engine {

namespace {

/// States of the exact run that are kept to be compared with: this many, or as many as this memory holds.
constexpr std::uint64_t kMostStates = 40, kFewestStates = 4;
constexpr std::uint64_t kStateBytes = std::uint64_t{256} << 20;

/// What is compared of a state: surfaces of bodies that move, skins of instruments.
struct Shape {
    std::vector<std::vector<Vec3>> surfaces, skins;
};

struct ExactRun {
    std::uint64_t every = 1;             // steps between kept states
    std::uint64_t steps = 0;             // taken
    std::vector<Shape> shapes;           // after every such step
    std::vector<std::vector<Vec3>> tips; // [step][instrument] m
    std::string failure;
};

Shape shape_of(const SceneModel& model, const State& state) {
    Shape shape;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].moves()) shape.surfaces.push_back(state.bodies[i].surface);
    for (const InstrumentState& instrument : state.instruments) shape.skins.push_back(instrument.skin);
    return shape;
}

std::vector<Vec3> tips_of(const State& state) {
    std::vector<Vec3> tips;
    for (const InstrumentState& instrument : state.instruments) tips.push_back(instrument.rod.position.back());
    return tips;
}

std::uint64_t states_kept(const SceneModel& model) {
    std::uint64_t bytes = 1;
    for (const BodyModel& body : model.bodies) bytes += body.moves() ? sizeof(Vec3) * body.surface.vertices.size() : 0;
    for (const InstrumentModel& instrument : model.instruments) bytes += sizeof(Vec3) * instrument.skin.vertex_count();
    return std::clamp(kStateBytes / bytes, kFewestStates, kMostStates);
}

SurfaceDistance compare_shapes(const SceneModel& model, const State& state, const Shape& exact) {
    SurfaceDistance distance;
    std::size_t k = 0;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].moves())
            distance.join(measure_distance(model.bodies[i].surface.triangles, state.bodies[i].surface, exact.surfaces[k++]));
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        distance.join(measure_distance(model.instruments[i].skin.triangles, state.instruments[i].skin, exact.skins[i]));
    return distance;
}

/// Resultant contact force on every deformable body and on every instrument, N.
void find_forces(const Simulator& simulator, std::vector<Vec3>& forces, std::vector<Vec3>& nodal, std::vector<Vec3>& rest) {
    const SceneModel& model = simulator.model();
    forces.clear();
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].tissue) continue;
        const std::vector<Vec3>& position = simulator.state().bodies[i].tissue.position;
        nodal.assign(position.size(), Vec3::Zero());
        rest.assign(position.size(), Vec3::Zero());
        fem::add_spring_forces(simulator.context().bodies[i].springs, position, rest, nodal);
        Vec3 sum = Vec3::Zero();
        for (const Vec3& f : nodal) sum += f;
        forces.push_back(sum);
    }
    for (const InstrumentScratch& instrument : simulator.context().instruments) {
        Vec3 sum = Vec3::Zero();
        for (const fem::RodPlane& plane : instrument.planes) sum += std::max(plane.force, 0.0) * plane.normal;
        forces.push_back(sum);
    }
}

/// Runs of the same scene: curves have the same points.
class CurveBuilder {
public:
    explicit CurveBuilder(std::uint64_t steps) : every_(std::max<std::uint64_t>(1, (steps + kCurvePoints - 1) / kCurvePoints)) {}
    void add(const StepReport& report, double tip_distance, std::vector<CostPoint>& curve) {
        const CostPoint now{report.time_s, static_cast<double>(report.level_reached), static_cast<double>(report.pairs_open), tip_distance,
                            report.ms.total};
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
    }

private:
    std::uint64_t every_, count_ = 0;
};

ExactRun run_exactly(const SceneModel& model, const CostOptions& options) {
    ExactRun run;
    run.every = std::max<std::uint64_t>(1, options.steps / states_kept(model));
    Simulator simulator(model, BudgetLimits{});
    for (std::uint64_t k = 0; k < options.steps && !options.interrupted(); ++k) {
        const StepReport& report = simulator.step();
        options.progress(fmt::format("exact run, step {}/{}", k + 1, options.steps));
        run.failure = report.failure;
        if (!report.finite) break;
        ++run.steps;
        run.tips.push_back(tips_of(simulator.state()));
        if (run.steps % run.every == 0) run.shapes.push_back(shape_of(model, simulator.state()));
    }
    return run;
}

/// Farthest tip of any instrument from where it is in the exact run.
double tip_distance(const State& state, const std::vector<Vec3>& exact) {
    double farthest = 0.0;
    for (std::size_t i = 0; i < exact.size(); ++i)
        farthest = std::max(farthest, (state.instruments[i].rod.position.back() - exact[i]).norm());
    return farthest;
}

/// What a run by itself adds up, step by step.
struct OwnRun {
    std::vector<double> total_ms, charged_ms;
    std::uint64_t overruns = 0;
    double tip_sq = 0.0;

    void add(const StepReport& report, double tip, CostRow& row) {
        total_ms.push_back(report.ms.total);
        charged_ms.push_back(report.ms.budget);
        overruns += !report.budget_kept;
        tip_sq += tip * tip;
        row.tip_distance_max_m = std::max(row.tip_distance_max_m, tip);
        row.exact_steps += report.exact_ran;
        row.lumen_exits += report.lumen_exits;
        row.dropped_steps += report.dropped != 0;
        ++row.steps;
    }
    void finish(CostRow& row) {
        row.step_ms = find_percentiles(total_ms);
        row.charged_ms = find_percentiles(charged_ms);
        if (row.steps == 0) return;
        const auto steps = static_cast<double>(row.steps);
        row.budget_kept = 1.0 - static_cast<double>(overruns) / steps;
        row.tip_distance_rms_m = std::sqrt(tip_sq / steps);
    }
};

void run_by_itself(const SceneModel& model, const CostOptions& options, const ExactRun& exact, CostRow& row) {
    Simulator simulator(model, row.budget.limits);
    CurveBuilder curve(exact.steps);
    OwnRun own;
    for (std::uint64_t k = 0; k < exact.steps && !options.interrupted(); ++k) {
        const StepReport& report = simulator.step();
        options.progress(fmt::format("{} by itself, step {}/{}", row.budget.name, k + 1, exact.steps));
        row.failure = report.failure;
        if (!report.finite) break;
        const double tip = tip_distance(simulator.state(), exact.tips[k]);
        own.add(report, tip, row);
        curve.add(report, tip, row.curve);
        if (row.steps % exact.every == 0)
            row.surface.join(compare_shapes(model, simulator.state(), exact.shapes[row.steps / exact.every - 1]));
    }
    own.finish(row);
    row.state_hash = fmt::format("{:016x}", hash_state(simulator.state()));
}

/// Sums over the steps of one budget along the exact states.
struct Along {
    std::unique_ptr<Simulator> simulator;
    double open = 0.0, leaves = 0.0, levels = 0.0, assumed = 0.0, force_sq = 0.0;
    std::uint64_t steps = 0;

    void finish(double exact_force_sq, CostRow& row) const {
        const double count = steps > 0 ? static_cast<double>(steps) : 1.0;
        row.pairs_open_mean = open / count;
        row.leaf_contacts_mean = leaves / count;
        row.level_reached_mean = levels / count;
        row.assumed_mean = assumed / count;
        // Without any force in the exact run the error has no scale: a force where there should be none is all wrong.
        row.force_error_rel = exact_force_sq > 0.0 ? std::sqrt(force_sq / exact_force_sq) : (force_sq > 0.0 ? 1.0 : 0.0);
    }
};

class AlongExactStates {
public:
    AlongExactStates(const SceneModel& model, const CostSpec& cost, CostTable& table)
        : table_(table), finder_(model, cost), exact_(model, BudgetLimits{}), along_(table.rows.size()) {
        for (std::size_t k = 0; k < along_.size(); ++k)
            along_[k].simulator = std::make_unique<Simulator>(model, table.rows[k].budget.limits);
        table.tolerance_m = finder_.tolerance();
        for (std::size_t i = 0; i < model.bodies.size(); ++i) table.patch_m.push_back(finder_.patch_size(i));
    }

    /// False: the exact run is stopped.
    bool step() {
        if (!exact_.begin_step()) return false;
        for (Along& along : along_) {
            along.simulator->join_step(exact_);
            along.simulator->finish_step();
        }
        exact_.finish_step();
        const PatchContacts near = finder_.find_near(exact_.state());
        const PatchContacts reference = finder_.find_answer(exact_);
        count_uncovered(near, reference);
        find_forces(exact_, exact_forces_, nodal_, rest_);
        for (const Vec3& f : exact_forces_) exact_force_sq_ += f.squaredNorm();
        ++steps_;
        for (std::size_t k = 0; k < along_.size(); ++k) compare(along_[k], reference, table_.rows[k]);
        return true;
    }

    void finish() {
        for (std::size_t k = 0; k < along_.size(); ++k) along_[k].finish(exact_force_sq_, table_.rows[k]);
        if (near_covered_ > 0) table_.near_depth_rms_m = std::sqrt(near_excess_sq_ / static_cast<double>(near_covered_));
        if (steps_ > 0 && !exact_forces_.empty())
            table_.force_rms_n = std::sqrt(exact_force_sq_ / static_cast<double>(steps_ * exact_forces_.size()));
    }

private:
    /// What the independent search found against what the exact answer says of the same surfaces.
    void count_uncovered(const PatchContacts& near, const PatchContacts& reference) {
        table_.near_patches += near.size();
        for (const PatchContact& c : near) {
            const auto at =
                std::lower_bound(reference.begin(), reference.end(), c, [](const auto& a, const auto& b) { return a.patch < b.patch; });
            const bool covered = at != reference.end() && at->patch == c.patch;
            table_.near_uncovered += !covered;
            if (!covered) continue;
            near_excess_sq_ += (at->depth - c.depth) * (at->depth - c.depth);
            ++near_covered_;
        }
    }

    void compare(Along& along, const PatchContacts& reference, CostRow& row) {
        const StepReport& report = along.simulator->context().report;
        row.contacts += compare_patches(reference, finder_.find_answer(*along.simulator));
        find_forces(*along.simulator, forces_, nodal_, rest_);
        for (std::size_t k = 0; k < forces_.size(); ++k) along.force_sq += (forces_[k] - exact_forces_[k]).squaredNorm();
        along.open += static_cast<double>(report.pairs_open);
        along.leaves += static_cast<double>(report.leaf_contacts);
        along.levels += report.level_reached;
        along.assumed += static_cast<double>(report.assumed);
        ++along.steps;
    }

    CostTable& table_;
    PatchFinder finder_;
    Simulator exact_;
    std::vector<Along> along_;
    std::vector<Vec3> exact_forces_, forces_, nodal_, rest_;
    double exact_force_sq_ = 0.0, near_excess_sq_ = 0.0;
    std::uint64_t steps_ = 0, near_covered_ = 0;
};

void add_notices(CostTable& table, const ExactRun& exact) {
    if (!exact.failure.empty())
        table.notices.push_back(fmt::format("the exact run was stopped after {} steps: {}", exact.steps, exact.failure));
    for (const CostRow& row : table.rows)
        if (!row.failure.empty())
            table.notices.push_back(
                fmt::format("the run under {} was stopped after {} steps: {}", row.budget.name, row.steps, row.failure));
    if (table.near_uncovered > 0)
        table.notices.push_back(fmt::format("{} of {} patches nearer than the tolerance lie beneath no leaf contact of the exact "
                                            "descent: surfaces that are deeper in one another than their leaf spheres reach",
                                            table.near_uncovered, table.near_patches));
}

} // namespace

double CostRow::depth_error_rms_m() const noexcept {
    return contacts.compared > 0 ? std::sqrt(contacts.depth_error_sq / static_cast<double>(contacts.compared)) : 0.0;
}

CostTable measure_cost(const PreparedScene& prepared, const CostSpec& cost, const CostOptions& options) {
    const SceneModel& model = prepared.model;
    CostTable table;
    for (const NamedBudget& budget : options.budgets) table.rows.emplace_back().budget = budget;
    const ExactRun exact = run_exactly(model, options);
    table.steps = exact.steps;
    table.compared_states = exact.shapes.size();
    for (CostRow& row : table.rows) run_by_itself(model, options, exact, row);
    AlongExactStates along(model, cost, table);
    for (std::uint64_t k = 0; k < exact.steps && !options.interrupted(); ++k) {
        options.progress(fmt::format("along the exact states, step {}/{}", k + 1, exact.steps));
        if (!along.step()) break;
    }
    along.finish();
    table.interrupted = options.interrupted();
    add_notices(table, exact);
    return table;
}

} // namespace seldinger::engine
