// The exact stage of an instrument: planes from the wall, then continuous tests of the skin until none hits; and the trees of both.
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/effects/registry.hpp"
#include "engine/time/phase.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace trocar::engine {

collision::SurfaceMotion wall_motion(const SceneModel& model, std::size_t body, const State& state, const RodsScratch& rods) {
    const BodyModel& wall = model.bodies[body];
    const std::vector<Vec3>& now = state.bodies[body].surface;
    return {&wall.topology, wall.moves() ? rods.walls[body].surface_t0 : now, now};
}

namespace {

/// Round after which the hand is stopped: the first one has planes from the wall, the second one contacts as well.
constexpr unsigned kDriveStopRound = 1;
/// Of planes of corrections: a side of its own, after those that the wall's planes of a place may have.
constexpr std::uint8_t kCorrectionSide = kPlanesPerPlace;

collision::SurfaceMotion skin_motion(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) {
    return {&model.instruments[index].topology, rods.instruments[index].skin_t0, state.instruments[index].skin};
}

/// Place on the rod of a skin vertex, and of a point between two of them.
double rod_place(const InstrumentModel& instrument, const Index* vertices, const double* weights, int count) {
    double place = 0.0;
    for (int k = 0; k < count; ++k) place += weights[k] * static_cast<double>(instrument.skin.vertex_node[vertices[k]]);
    return place;
}

/// A triangle of the wall that holds a vertex, all weight on that vertex.
WallPress press_at_vertex(const collision::SurfaceTopology& wall, Index vertex) {
    WallPress press{wall.vertex_owner[vertex], {0.0, 0.0, 0.0}};
    for (std::size_t corner = 0; corner < 3; ++corner)
        if (wall.triangles[press.triangle][corner] == vertex) press.bary[corner] = 1.0;
    return press;
}

/// A contact that the planes did not prevent becomes one more plane, exactly where it happened.
void add_contact_plane(const SceneModel& model, std::size_t index, const Contact& contact, State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentScratch& scratch = rods.instruments[index];
    const bool skin_is_a = contact.a == Thing::instrument(index);
    const collision::SurfaceMotion wall = wall_motion(model, instrument.lumen, state, rods);
    const int count_a = contact.origin == ContactOrigin::ExactVF ? 1 : 2;
    const int count_b = contact.origin == ContactOrigin::ExactVF ? 3 : 2;
    const Index* skin_features = skin_is_a ? contact.feature_a : contact.feature_b;
    const Index* wall_features = skin_is_a ? contact.feature_b : contact.feature_a;
    const double* skin_weights = skin_is_a ? contact.bary_a : contact.bary_b;
    const double* wall_weights = skin_is_a ? contact.bary_b : contact.bary_a;
    const double place = rod_place(instrument, skin_features, skin_weights, skin_is_a ? count_a : count_b);
    Vec3 wall_before = Vec3::Zero(), wall_point = Vec3::Zero();
    for (int k = 0; k < (skin_is_a ? count_b : count_a); ++k) {
        wall_before += wall_weights[k] * wall.t0[wall_features[k]];
        wall_point += wall_weights[k] * wall.t1[wall_features[k]];
    }
    const Index last_segment = static_cast<Index>(instrument.rod.node_count() - 2);
    const Index node = std::min(static_cast<Index>(std::max(place, 0.0)), last_segment);
    const double weight = std::clamp(place - static_cast<double>(node), 0.0, 1.0);
    // Away from the wall, and across the rod: from the wall's point to the rod's axis, both before they moved.
    const auto& rod = scratch.rod_t0.position;
    const Vec3 axis_point = (1.0 - weight) * rod[node] + weight * rod[node + 1];
    Vec3 normal = axis_point - wall_before;
    const double length = std::sqrt(normal.squaredNorm());
    normal = length > 0.0 ? Vec3(normal / length) : Vec3(skin_is_a ? contact.normal : Vec3(-contact.normal));
    const double room = instrument.rod.design.radius + model.contact.clearance;
    state.instruments[index].planes.push_back({node, weight, normal, normal.dot(wall_point) + room, 0.0, (wall_point - wall_before) / model.step_s});
    state.instruments[index].planes.back().friction_share = instrument.rod.friction_at(node, weight);
    WallPress press = press_at_vertex(model.bodies[instrument.lumen].topology, wall_features[0]);
    press.give = find_wall_give(model, instrument.lumen, press, rods);
    state.instruments[index].planes.back().give = press.give;
    state.instruments[index].planes.back().side = kCorrectionSide;
    state.instruments[index].presses.push_back(press);
}

} // namespace

void stop_drive(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    for (const std::size_t one : solved_with(model, rods, index)) {
        InstrumentScratch& scratch = rods.instruments[one];
        scratch.command = {std::min(scratch.command.insertion, scratch.rod_t0.insertion), scratch.rod_t0.rotation};
        state.instruments[one].drive_stopped = true;
    }
}

ExactForecast forecast_exact(const SceneModel& model, std::size_t index, const State& state, const RodsScratch& rods) noexcept {
    ExactForecast forecast;
    for (const std::size_t one : solved_with(model, rods, index)) forecast.triangles += model.instruments[one].topology.triangles.size();
    forecast.candidates = state.instruments[index].exact_candidates;
    return forecast;
}

/// m; longest way of a vertex of a wall in this step, its rounded sums allowed for.
static double way_of_wall(const SceneModel& model, std::size_t body, const collision::SurfaceMotion& motion) {
    const fem::RigidLinks* links = model.bodies[body].moves_by_links_alone() ? &*model.bodies[body].links : nullptr;
    return longest_way(motion.t0, motion.t1, links) * (1.0 + 0x1p-40);
}

void follow_wall(const SceneModel& model, std::size_t body, const State& state, RodsScratch& rods, StepBudget* budget) {
    WallScratch& wall = rods.walls[body];
    if (!model.bodies[body].moves() || wall.last_step == state.step) return;
    const Phase phase(budget, StepPart::Walls);
    const collision::SurfaceMotion motion = wall_motion(model, body, state, rods);
    wall.way = way_of_wall(model, body, motion);
    if (wall.last_step != kNoStep && wall.last_step + 1 == state.step)
        wall.tree.follow(motion, wall.way);
    else
        wall.tree.refit(motion);
    wall.last_step = state.step;
}

void follow_walls(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods, StepBudget* budget) {
    for (const std::size_t one : solved_with(model, rods, index)) follow_wall(model, model.instruments[one].lumen, state, rods, budget);
}

/// An instrument meets its wall along a line: smaller clusters than a search over whole surfaces wants leave less to refit.
constexpr collision::TreeOptions kExactTree{.cluster_size = 16, .fine = true};

/// The skin of the whole rod, straight ahead. Rings that wait at the port are stacked on each other there: clusters made of those would
/// be strips along the rod, each of them near half of the wall once the rod is in.
static std::vector<Vec3> lay_out_skin(const InstrumentModel& instrument) {
    fem::RodState rod;
    fem::place_rod(instrument.rod, instrument.port, instrument.rod.design.length, 0.0, rod);
    std::vector<Vec3> skin(instrument.skin.vertex_count()), axis(instrument.rod.node_count());
    fem::place_rod_skin(instrument.rod, instrument.skin, rod, instrument.port, axis, skin);
    return skin;
}

void build_exact_trees(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods) {
    if (!model.effects.exact_contact && !model.effects.coarse_contact) return;
    const InstrumentModel& instrument = model.instruments[index];
    const std::vector<Vec3>& wall = state.bodies[instrument.lumen].surface;
    collision::DopTree& wall_tree = rods.walls[instrument.lumen].tree;
    if (wall_tree.empty()) {
        wall_tree.build(model.bodies[instrument.lumen].topology, wall, kExactTree);
        wall_tree.refit({&model.bodies[instrument.lumen].topology, wall, wall});
    }
    if (model.effects.exact_contact && rods.instruments[index].tree.empty()) rods.instruments[index].tree.build(instrument.topology, lay_out_skin(instrument), kExactTree);
}

static void refit_skin(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods) {
    rods.instruments[index].tree.refit(skin_motion(model, index, state, rods));
}

/// Of boxes that are those of this motion.
static collision::ExactStats search_skin(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods,
                                         double distance, WorkBudget& budget, bool culled) {
    const InstrumentModel& instrument = model.instruments[index];
    const collision::SurfaceMotion skin = skin_motion(model, index, state, rods);
    const collision::SurfaceMotion wall = wall_motion(model, instrument.lumen, state, rods);
    const collision::PairOptions options{.distance = distance, .tolerance = 0.1 * distance};
    const collision::SearchSide skin_side{Thing::instrument(index), &rods.instruments[index].tree, skin};
    const collision::SearchSide wall_side{Thing::body(instrument.lumen), &rods.walls[instrument.lumen].tree, wall};
    if (culled) return rods.search.find(skin_side, wall_side, options, *rods.cull, budget, rods.hits);
    return rods.search.find(skin_side, wall_side, options, budget, rods.hits);
}

collision::ExactStats test_skin_at(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods, double distance,
                                   WorkBudget& budget) {
    refit_skin(model, index, state, rods);
    return search_skin(model, index, state, rods, distance, budget, false);
}

/// Planes of the walls as a part of the budget's account.
static void make_planes(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, double reach,
                        StepBudget* budget) {
    const Phase phase(budget, StepPart::Planes);
    plane_from_walls(model, index, state, rods, reach);
}

/// One solve and the continuous tests of its motion, each only if the budget has room for it. Not finished: it had not.
/// reach   m, of the planes when they are those of the walls alone; the solve went farther: they are made anew
static collision::ExactStats solve_and_test(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods,
                                            const ExactForecast& forecast, StepBudget* budget, std::optional<double> reach) {
    collision::ExactStats stats;
    if (budget != nullptr && !budget->round_fits()) {
        stats.finished = false;
        return stats;
    }
    solve_instrument(model, index, state, rods);
    if (reach && solve_left_reach(model, index, *reach, state, rods)) {
        make_planes(model, index, state, rods, farthest_reach(model, index, rods), budget);
        solve_instrument(model, index, state, rods);
    }
    if (reach) keep_within_reach(model, index, state, rods);
    if (budget != nullptr) budget->end_solve();
    Phase phase(budget, StepPart::Skin);
    for (const std::size_t one : solved_with(model, rods, index)) refit_skin(model, one, state, rods);
    phase.end();
    WorkBudget grant = budget != nullptr ? budget->grant_tests(forecast) : WorkBudget();
    const bool culled = rods.cull->wanted(state.instruments[index].exact_candidates, budget);
    for (const std::size_t one : solved_with(model, rods, index))
        if (stats.finished) stats.add(search_skin(model, one, state, rods, model.contact.exact_distance, grant, culled));
    if (budget != nullptr) budget->settle_tests(forecast, grant);
    return stats;
}

ExactOutcome find_exact_contacts(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, StepReport& report,
                                 StepBudget* budget) {
    report.effects.note(effects::exact_contact);
    const std::size_t known = rods.hits.size();
    const double reach = suggest_plane_reach(model, index, state, rods);
    make_planes(model, index, state, rods, reach, budget);
    std::array<std::size_t, fem::kMostTogether> base_planes{};
    InstrumentState& now = state.instruments[index];
    const ExactForecast forecast{now.exact_candidates, rods.instruments[index].forecast.triangles}; // of a round
    ExactOutcome outcome;
    std::uint64_t seen = 0;
    for (unsigned round = 0;; ++round) {
        rods.hits.resize(known);
        const collision::ExactStats stats =
            solve_and_test(model, index, state, rods, forecast, budget, round == 0 ? std::optional(reach) : std::nullopt);
        if (round == 0)
            for (std::size_t k = 0; k < solved_with(model, rods, index).count; ++k)
                base_planes[k] = state.instruments[solved_with(model, rods, index).index[k]].planes.size();
        const std::uint64_t candidates = stats.candidates_vf + stats.candidates_ee;
        seen += candidates + stats.cluster_pairs;
        now.exact_candidates = stats.finished ? seen : std::max(seen, now.exact_candidates);
        report.candidates += candidates;
        outcome.finished = stats.finished;
        outcome.safe_fraction = stats.safe_fraction;
        for (const std::size_t one : solved_with(model, rods, index)) {
            bool& is_met = rods.instruments[one].is_met;
            is_met = rods.hits.size() > known || stats.safe_fraction < 1.0 || (is_met && !stats.finished);
        }
        if (!stats.finished) return outcome;
        outcome.unresolved = stats.unresolved;
        report.exact_contacts += rods.hits.size() - known;
        if (rods.hits.size() == known || round == kMaxCorrections) return outcome;
        ++report.corrections;
        if (round == kDriveStopRound) { // a jam: more planes would only squeeze harder
            stop_drive(model, index, state, rods);
            ++report.drive_stops;
            for (std::size_t k = 0; k < solved_with(model, rods, index).count; ++k) {
                InstrumentState& one = state.instruments[solved_with(model, rods, index).index[k]];
                one.planes.resize(base_planes[k]);
                one.presses.resize(base_planes[k]);
            }
            continue;
        }
        for (std::size_t k = known; k < rods.hits.size(); ++k) {
            const Thing a = rods.hits[k].a, b = rods.hits[k].b;
            add_contact_plane(model, a.is_body() ? b.index() : a.index(), rods.hits[k], state, rods);
        }
    }
}

} // namespace trocar::engine
