#include "engine/step/finish_report.hpp"

#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/stages.hpp"

#include <cmath>

namespace trocar::engine {

namespace {

void close_account(StepBudget& budget, StepReport& report) {
    budget.pause();
    report.ms.budget = 1e3 * budget.elapsed_s();
    report.ms.budget_cpu = 1e3 * budget.elapsed_cpu_s();
    report.budget_kept = !budget.overrun();
    const auto idle = [&](AccountPart part) { return report.account[static_cast<std::size_t>(part)].units == 0; };
    report.below_floor = !report.budget_kept && idle(AccountPart::Descent) && idle(AccountPart::Surfaces) && !report.exact_ran && !report.exact_forced &&
                         !report.exact_abandoned;
    report.work_units = budget.units_spent();
}

/// Volume of the instruments' segments that have passed the port and whose middle lies in the ball, over the ball's.
double find_packing(const SceneModel& model, const State& state) noexcept {
    double length_area = 0.0; // m^3 over pi
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const fem::RodModel& rod = model.instruments[i].rod;
        const std::vector<Vec3>& x = state.instruments[i].rod.position;
        for (std::size_t k = fem::first_inserted_node(rod, state.instruments[i].rod.insertion); k + 1 < x.size(); ++k)
            if ((0.5 * (x[k] + x[k + 1]) - model.packing->centre).squaredNorm() < model.packing->radius * model.packing->radius)
                length_area += rod.segment * rod.design.radius * rod.design.radius;
    }
    return 0.75 * length_area / (model.packing->radius * model.packing->radius * model.packing->radius);
}

void observe(const SceneModel& model, const State& state, RodsScratch& rods, StepReport& report) {
    const StopWatch watch;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].hollow && model.bodies[i].moves()) rods.walls[i].inside.follow(state.bodies[i].surface);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        report.lumen_exits += count_lumen_exits(model, i, state, rods);
        const fem::RodReport& rod = rods.instruments[i].rod_report;
        report.kinetic_j += rod.kinetic_j;
        report.elastic_j += rod.bend_j + rod.stretch_j + rod.twist_j;
    }
    if (model.packing) report.packing_density = find_packing(model, state);
    report.ms.observe = watch.elapsed_ms();
}

} // namespace

void report_first_instrument(const SceneModel& model, const State& state, StepReport& report) {
    if (model.instruments.empty()) return;
    const InstrumentState& first = state.instruments[kLeadInstrument];
    report.tip = first.rod.position.back();
    report.insertion_m = first.rod.insertion;
    report.rotation_rad = first.rod.rotation;
    if (!model.instruments[kLeadInstrument].route) return;
    const std::vector<Vec3>& moved = first.route.points; // empty before the first step
    const Vec3& target = moved.empty() ? model.instruments[kLeadInstrument].route->points.back() : moved.back();
    report.target_distance_m = std::sqrt((target - report.tip).squaredNorm());
}

const StepReport& finish_report(const SceneModel& model, State& state, const BodiesScratch& bodies, const SolidScratch& solids, RodsScratch& rods,
                                StepReport& report, StepBudget& budget) {
    close_account(budget, report);
    if (report.finite) {
        ++state.step;
        state.time = report.time_s;
        observe(model, state, rods, report);
    }
    report_first_instrument(model, state, report);
    if (!report.finite) restore_start(model, state, bodies, solids, rods); // the last good state
    return report;
}

} // namespace trocar::engine
