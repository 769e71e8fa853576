#include "engine/step/instrument/carry_response.hpp"

#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
#include "engine/time/phase.hpp"
#include "fem/rod/coaxial.hpp"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace trocar::engine {

namespace {

/// Planes that are made anew tell of so many times the motion of this step, and of so much more, m.
constexpr double kStepsAhead = 4.0, kSpareWay = 1e-4;

template <class Visit>
void for_each_place(const SceneModel& model, std::size_t index, const RodsScratch& rods, Visit&& visit) {
    const Index nodes = static_cast<Index>(model.instruments[index].rod.node_count());
    for (Index node = first_walled_node(model, index, rods); node + 1 < nodes; ++node)
        for (const double weight : {0.5, 1.0}) visit(node, weight);
}

/// Has the traversal proven more than the drive may take the place by in the next step?
bool is_proven_enough(const SceneModel& model, std::size_t index, Index node, double weight, const RodsScratch& rods) {
    const InstrumentScratch& own = rods.instruments[index];
    return proven_free(model, index, node, weight, rods) && std::abs(own.command.insertion - own.rod_t0.insertion) < model.contact.margin;
}

/// Marks the places that there is time for. Returns how many.
std::size_t choose_places(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepBudget& budget) {
    InstrumentState& now = state.instruments[index];
    InstrumentScratch& own = rods.instruments[index];
    own.order.clear(); // reserved, as all lists here
    for_each_place(model, index, rods, [&](Index node, double weight) {
        if (!is_proven_enough(model, index, node, weight, rods)) own.order.push_back(slot_of(node, weight));
    });
    own.fresh.assign(now.known.size(), 0);
    const std::size_t granted = budget.grant_places(own.order.size());
    const auto is_first = [&](std::size_t a, std::size_t b) { return now.known[a] < now.known[b] || (now.known[a] == now.known[b] && a > b); };
    if (granted < own.order.size()) std::nth_element(own.order.begin(), own.order.begin() + static_cast<std::ptrdiff_t>(granted), own.order.end(), is_first);
    for (std::size_t k = 0; k < granted; ++k) own.fresh[own.order[k]] = 1;
    return granted;
}

/// False: one of them is found in its wall.
bool renew_planes(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepReport& report, StepBudget& budget) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentScratch& own = rods.instruments[index];
    InstrumentState& now = state.instruments[index];
    const std::size_t granted = choose_places(model, index, state, rods, budget);
    report.carried_places += own.order.size() - granted;
    if (granted == 0) return true;
    Phase phase(budget, StepPart::Renew);
    const double reach = std::min(kPlaneReach, kStepsAhead * longest_approach(model, index, state, rods) + kSpareWay);
    (void)plane_from_wall(model, index, state, rods, reach, true);
    phase.end();
    budget.learn_places(StepPart::Renew, granted);
    for (fem::RodPlane& plane : now.planes)
        if (own.fresh[slot_of(plane.node, plane.weight)] != 0) plane.force = plane.start_force, plane.drag = plane.start_drag;
    for (std::size_t slot = 0; slot < own.fresh.size(); ++slot)
        if (own.fresh[slot] != 0 && own.wall_distance[slot] < instrument.rod.design.radius) return false;
    return true;
}

} // namespace

bool carry_response(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepReport& report, StepBudget& budget) {
    for (const std::size_t one : solved_with(model, rods, index)) {
        InstrumentState& now = state.instruments[one];
        if (!rods.instruments[one].wall_distance.empty()) continue; // an exact stage that was given up has made them
        carry_planes(model, one, state, rods);
        if (!renew_planes(model, one, state, rods, report, budget)) return false;
        now.kept_inside = false; // not tested
    }
    for (const std::size_t one : solved_with(model, rods, index)) state.instruments[one].carried = true, ++report.carried_instruments;
    return true;
}

void spend_known(const SceneModel& model, State& state, const RodsScratch& rods, bool is_limited, StepReport& report) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        InstrumentState& now = state.instruments[i];
        if (!is_limited) {
            now.known.clear();
            continue;
        }
        const std::vector<Vec3>&from = rods.instruments[i].rod_t0.position, &to = now.rod.position;
        const std::size_t lumen = model.instruments[i].lumen;
        Vec3 wall = Vec3::Zero(); // m, way of what is near
        std::size_t k = 0;
        for_each_place(model, i, rods, [&](Index node, double weight) {
            const Vec3 way = (1.0 - weight) * (to[node] - from[node]) + weight * (to[node + 1] - from[node + 1]);
            const auto place = std::pair(node, weight);
            while (k < now.planes.size() && std::pair(now.planes[k].node, now.planes[k].weight) < place) ++k;
            if (k < now.planes.size() && std::pair(now.planes[k].node, now.planes[k].weight) == place && now.presses[k].triangle != kNoIndex &&
                model.bodies[lumen].moves())
                wall = find_wall_way(model, lumen, now.presses[k], state, rods);
            double& known = now.known[slot_of(node, weight)];
            known -= std::sqrt((way - wall).squaredNorm());
            if (proven_free(model, i, node, weight, rods)) known = std::max(known, model.contact.margin); // at the step's end as well
            if (now.carried) report.unproven_links += known < 0.0;
        });
    }
}

bool is_way_known(const SceneModel& model, std::size_t index, const State& state, double advance) noexcept {
    const InstrumentState& now = state.instruments[index];
    if (!now.carried || now.known.empty()) return true;
    const Index first = fem::first_inserted_node(model.instruments[index].rod, now.rod.insertion);
    const auto places = std::span(now.known).subspan(2 * std::size_t{first > 0 ? first - 1 : 0});
    return std::all_of(places.begin(), places.end() - 2, [&](double known) { return known >= std::abs(advance); });
}

} // namespace trocar::engine
