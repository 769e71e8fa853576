#include "engine/step/instrument/carry_response.hpp"

#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
#include "engine/time/phase.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// One of so many places gets new planes, whatever the time. With 3 the demo's rod leaves its lumen: on its way through a bend a place goes by
/// up to kCarriedAdvance in a step, and finds walls that its planes do not tell of.
constexpr std::size_t kStagger = 2;
/// Of the radius: nearer to its wall no place is left, and one that came farther than that in a step is tested for where it went.
constexpr double kDeepest = 0.8;
/// m; a rod that is driven farther than this in a step is answered in whole: planes that are two steps old know nothing of where it is then.
constexpr double kCarriedAdvance = 0.5e-3;
/// Planes that are made anew tell of so many times the motion of this step, and of so much more, m.
constexpr double kStepsAhead = 4.0, kSpareWay = 1e-4;

/// Marks the places that get new planes: those whose turn it is, then as many more as there is time for. Returns how many keep theirs.
std::size_t choose_places(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods, StepBudget& budget) {
    InstrumentScratch& own = rods.instruments[index];
    const Index nodes = static_cast<Index>(model.instruments[index].rod.node_count());
    const std::size_t begin = 2 * std::size_t{first_walled_node(model, index, rods)}, end = 2 * (std::size_t{nodes} - 1);
    own.fresh.assign(2 * std::size_t{nodes}, 0); // reserved
    std::size_t marked = 0;
    for (std::size_t slot = begin; slot < end; ++slot) marked += own.fresh[slot] = (slot + state.step) % kStagger == 0;
    std::size_t more = budget.grant_places(end - begin);
    more = more > marked ? more - marked : 0;
    for (std::size_t slot = end; slot-- > begin && more > 0;)
        if (own.fresh[slot] == 0) own.fresh[slot] = 1, --more, ++marked;
    return end - begin - marked;
}

} // namespace

bool carry_response(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepReport& report, StepBudget& budget) {
    for (const std::size_t one : solved_with(model, rods, index))
        if (rods.instruments[one].is_met) return false; // its motion is known to touch
    for (const std::size_t one : solved_with(model, rods, index))
        if (std::abs(state.instruments[one].rod.insertion - rods.instruments[one].rod_t0.insertion) > kCarriedAdvance) return false;
    for (const std::size_t one : solved_with(model, rods, index)) {
        const double radius = model.instruments[one].rod.design.radius;
        if (has_swept_into_wall(model, one, kDeepest * radius, (1.0 - kDeepest) * radius, state, rods)) return false;
    }
    std::size_t carried = 0;
    for (const std::size_t one : solved_with(model, rods, index)) {
        InstrumentState& now = state.instruments[one];
        InstrumentScratch& own = rods.instruments[one];
        now.kept_inside = false; // not tested
        if (!own.wall_distance.empty()) continue; // an exact stage that was given up has made them
        carry_planes(model, one, state, rods);
        carried += choose_places(model, one, state, rods, budget);
        {
            Phase phase(budget, StepPart::Renew);
            const double reach = std::min(kPlaneReach, kStepsAhead * longest_approach(model, one, state, rods) + kSpareWay);
            const std::size_t made = plane_from_wall(model, one, state, rods, reach, true);
            phase.end();
            budget.learn_places(StepPart::Renew, made);
        }
        for (fem::RodPlane& plane : now.planes)
            if (own.fresh[slot_of(plane.node, plane.weight)] != 0) plane.force = plane.start_force, plane.drag = plane.start_drag;
        for (std::size_t slot = 0; slot < own.fresh.size(); ++slot)
            if (own.fresh[slot] != 0 && own.wall_distance[slot] >= 0.0 && own.wall_distance[slot] < kDeepest * model.instruments[one].rod.design.radius) {
                own.wall_distance.clear();
                return false;
            }
    }
    report.carried_places += carried;
    report.carried_instruments += static_cast<unsigned>(solved_with(model, rods, index).count);
    return true;
}

} // namespace trocar::engine
