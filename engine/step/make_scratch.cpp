#include "engine/step/make_scratch.hpp"

#include "engine/prepare/body_pairs.hpp"

#include "engine/step/instrument/cull_stage.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/solid/solid_stage.hpp"

namespace trocar::engine {

namespace {

/// Contacts that the step's lists hold without growing.
constexpr std::size_t kReservedContacts = 4096;
/// Planes from corrections beside those of the wall.
constexpr std::size_t kSparePlanes = 4096;

void reserve_springs(fem::ContactSprings& springs) {
    springs.springs.reserve(kReservedContacts);
    springs.entries.reserve(4 * fem::kMostLinkNodes * kReservedContacts); // a vertex and a triangle's three
}

/// For loads that begin, or begin to change, in whatever step.
void reserve_loads(const BodyModel& body, TissueScratch& scratch) {
    if (!body.tissue || body.loads.empty()) return;
    std::size_t springs = 0, faces = 0;
    for (const BodyLoad& load : body.loads) {
        springs += load.kind == LoadKind::Spring ? 6 * load.nodes.size() : 0;
        faces += load.kind == LoadKind::Pressure ? load.faces.size() : 0;
    }
    scratch.force.reserve(body.tissue->node_count());
    scratch.force_rate.reserve(body.tissue->node_count());
    scratch.pressures.reserve(faces);
    scratch.springs.springs.reserve(springs + (springs > 0 ? kReservedContacts : 0));
    scratch.springs.entries.reserve(springs + (springs > 0 ? 4 * fem::kMostLinkNodes * kReservedContacts : 0)); // those of contact follow them
}

/// Memory for image-space culling of the skins and their walls, where exact contacts may be culled.
void reserve_culling(const SceneModel& model, RodsScratch& rods) {
    if (!model.effects.exact_contact || model.contact.culling == Culling::Never) return;
    for (const InstrumentModel& instrument : model.instruments)
        rods.cull->reserve(instrument.topology.triangles.size(), model.bodies[instrument.lumen].topology.triangles.size());
    if (!model.instruments.empty()) rods.search.reserve_two_stages(kReservedCullCandidates);
}

void prepare_bodies(const SceneModel& model, BodiesScratch& bodies) {
    bodies.start.resize(model.bodies.size());
    bodies.tissue.resize(model.bodies.size());
    prepare_contact(model, bodies.contact);
    bodies.islands.body.resize(model.bodies.size());
    bodies.islands.members.reserve(model.bodies.size());
    bodies.islands.lockstep.reserve(model.bodies.size());
    bodies.islands.solver.reserve(bodies.contact.solved.capacity(), model.bodies.size());
    bodies.islands.joined.reserve(bodies.contact.rows.capacity());
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        reserve_springs(bodies.tissue[i].contact);
        reserve_loads(body, bodies.tissue[i]);
        bodies.start[i].may_wait = body.moves_by_links_alone() && !body.hollow && !can_touch_any(model, i);
    }
}

void prepare_walls(const SceneModel& model, const State& state, const RodsScratch* like, RodsScratch& rods) {
    rods.walls.resize(model.bodies.size());
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].hollow) continue;
        if (model.bodies[i].host_body) rods.walls[i].node_presses.reserve(model.bodies[*model.bodies[i].host_body].node_give.size());
        if (like != nullptr) {
            rods.walls[i].tree = like->walls[i].tree;
            rods.walls[i].inside = like->walls[i].inside;
            if (model.bodies[i].moves()) rods.walls[i].inside.start_following(state.bodies[i].surface);
            continue;
        }
        rods.walls[i].inside = InsideTest(model.bodies[i].surface);
        if (model.bodies[i].moves()) rods.walls[i].inside.start_following(state.bodies[i].surface);
    }
}

/// Of instruments that may be solved together.
std::size_t count_meeting_nodes(const SceneModel& model) {
    std::size_t nodes = 0;
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        if (may_be_joined(model, i)) nodes += model.instruments[i].rod.node_count();
    return nodes;
}

/// [-] the longest segment over the shortest, of instruments of which one has play in the other's bore.
double find_segment_ratio(const SceneModel& model) {
    double ratio = 1.0;
    for (const InstrumentModel& inner : model.instruments) {
        if (!(inner.play > 0.0)) continue;
        const double a = inner.rod.segment, b = model.instruments[*inner.inside].rod.segment;
        ratio = std::max(ratio, std::max(a, b) / std::min(a, b));
    }
    return ratio;
}

void prepare_instruments(const SceneModel& model, const State& state, const RodsScratch* like, RodsScratch& rods) {
    rods.instruments.resize(model.instruments.size());
    rods.hits.reserve(kReservedContacts);
    if (!model.instruments.empty()) rods.cull = std::make_unique<CullStage>(model.contact.culling);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        InstrumentScratch& own = rods.instruments[i];
        own.axis.resize(model.instruments[i].rod.node_count());
        own.rod_t0 = state.instruments[i].rod;
        if (like != nullptr) own.tree = like->instruments[i].tree;
        build_exact_trees(model, i, state, rods);
        const std::size_t places = 2 * model.instruments[i].rod.node_count();
        own.links_t0.reserve(places);
        own.links_t1.reserve(places);
        own.wall_distance.reserve(places);
        own.fresh.reserve(places);
        own.carried_planes.reserve(state.instruments[i].planes.capacity());
        own.carried_presses.reserve(state.instruments[i].planes.capacity());
        own.start.self_planes.reserve(state.instruments[i].self_planes.capacity());
        own.last_planes.reserve(state.instruments[i].planes.capacity());
        own.last_presses.reserve(state.instruments[i].planes.capacity());
        own.pushes.reserve(places + kSparePlanes);
        own.thicker = model.instruments[i].rod;
        own.taken.reserve(state.instruments[i].planes.capacity());
        own.rod.presses.reserve(state.instruments[i].planes.capacity());
        own.rod.self_presses.reserve(state.instruments[i].self_planes.capacity());
        if (model.instruments[i].self_contact && model.effects.self_contact) own.self.reserve(model.instruments[i].rod.node_count()),
                own.rod.couplings.reserve(state.instruments[i].self_planes.capacity());
        std::size_t planes = 0; // of a coaxial pair
        for (const std::size_t one : coaxial(model, i)) planes += state.instruments[one].planes.capacity();
        rods.solvers.push_back(make_solver(model, i, planes));
    }
    if (const std::size_t meeting_nodes = count_meeting_nodes(model); meeting_nodes > 0) {
        rods.together.reserve(fem::kMostTogether);
        rods.meetings_t0.reserve(state.meetings.capacity());
        rods.meetings.reserve(meeting_nodes);
        fem::reserve_together(meeting_nodes, state.meetings.capacity(), find_segment_ratio(model), rods.joint);
    }
    reserve_culling(model, rods);
}

} // namespace

StepScratch make_scratch(const SceneModel& model, State& state, const StepScratch* like) {
    StepScratch scratch;
    prepare_solids(model, state, scratch.solids);
    prepare_bodies(model, scratch.bodies);
    scratch.traversal.coarse.reserve(kReservedContacts);
    scratch.contacts.reserve(kReservedContacts);
    scratch.solids.touching_before.reserve(kReservedContacts);
    reserve_state(model, state);
    const RodsScratch* const rods_like = like != nullptr ? &like->rods : nullptr;
    prepare_walls(model, state, rods_like, scratch.rods);
    prepare_instruments(model, state, rods_like, scratch.rods);
    return scratch;
}

void reserve_state(const SceneModel& model, State& state) {
    std::size_t solid_places = 0; // of surfaces whose depths decide
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (can_touch_any(model, i) && meet_by_surface(model, i, i)) solid_places += reserved_places(model.bodies[i]);
    }
    state.solids.entries.reserve(solid_places);
    state.solids.contacts.reserve(solid_places);
    state.solids.touching.reserve(kReservedContacts);
    if (const std::size_t nodes = count_meeting_nodes(model); nodes > 0) state.meetings.reserve(fem::kMeetingsPerNode * nodes);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::size_t places = 2 * model.instruments[i].rod.node_count();
        InstrumentState& own = state.instruments[i];
        own.chain.links_t0.reserve(places);
        own.chain.links_t1.reserve(places);
        own.planes.reserve(places * kPlanesPerPlace + kSparePlanes);
        own.presses.reserve(places * kPlanesPerPlace + kSparePlanes);
        if (model.instruments[i].self_contact && model.effects.self_contact) own.self_planes.reserve(fem::kSelfPlanesPerNode * model.instruments[i].rod.node_count());
    }
}

void forget_walls(RodsScratch& rods) noexcept {
    for (WallScratch& wall : rods.walls) wall.last_step = kNoStep;
}

} // namespace trocar::engine
