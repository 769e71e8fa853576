// What a run's steps need beside its state, with room for all of it: a step allocates nothing.
#include "engine/prepare/body_pairs.hpp"
#include "engine/step/make_context.hpp"

#include "engine/step/cull_stage.hpp"
#include "engine/step/instrument_stage.hpp"
#include "engine/step/solid_stage.hpp"

namespace trocar::engine {

namespace {

/// Contacts that the step's lists hold without growing.
constexpr std::size_t kReservedContacts = 4096;
/// Planes from corrections beside those of the wall.
constexpr std::size_t kSparePlanes = 4096;

void reserve_springs(fem::ContactSprings& springs) {
    springs.springs.reserve(kReservedContacts);
    springs.entries.reserve(12 * kReservedContacts); // a vertex and a triangle's three, of three nodes each
}

void reserve_pairs(const SceneModel& model, const State& state, StepContext& context) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::size_t wire = model.instruments[i].wire;
        if (wire == SIZE_MAX) continue;
        const std::size_t planes = state.instruments[i].planes.capacity() + state.instruments[wire].planes.capacity();
        fem::reserve_coaxial(model.instruments[i].rod, model.instruments[wire].rod, planes, context.instruments[i].coaxial);
    }
}

/// Room for looks at the skins and their walls, where exact contacts may be culled by pictures.
void reserve_culling(const SceneModel& model, StepContext& context) {
    if (!model.effects.exact_contact || model.contact.culling == Culling::Never) return;
    for (const InstrumentModel& instrument : model.instruments)
        context.cull->reserve(instrument.topology.triangles.size(), model.bodies[instrument.lumen].topology.triangles.size());
    if (!model.instruments.empty()) context.search.reserve_two_stages(kReservedCullCandidates);
}

} // namespace

StepContext make_step_context(const SceneModel& model, State& state) {
    StepContext context;
    context.bodies.resize(model.bodies.size());
    context.instruments.resize(model.instruments.size());
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (const BodyModel& body = model.bodies[i]; body.hollow) {
            context.bodies[i].inside = InsideTest(body.surface);
            if (body.moves()) context.bodies[i].inside.start_following(state.bodies[i].surface);
        }
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        context.bodies[i].may_wait = body.moves_by_links_alone() && !body.hollow && !can_touch_any(model, i);
    }
    prepare_solids(model, state, context);
    if (!model.instruments.empty()) context.cull = std::make_unique<CullStage>(model.contact.culling);
    context.coarse.reserve(kReservedContacts);
    context.exact.reserve(kReservedContacts);
    context.contacts.reserve(kReservedContacts);
    for (BodyScratch& body : context.bodies) reserve_springs(body.other_springs);
    reserve_state(model, state);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        context.instruments[i].axis.resize(model.instruments[i].rod.node_count());
        context.instruments[i].rod_t0 = state.instruments[i].rod;
        build_exact_trees(model, i, state, context);
        const std::size_t places = 2 * model.instruments[i].rod.node_count();
        context.instruments[i].links_t0.reserve(places);
        context.instruments[i].links_t1.reserve(places);
        context.instruments[i].wall_distance.reserve(places);
    }
    reserve_pairs(model, state, context);
    reserve_culling(model, context);
    return context;
}

void reserve_state(const SceneModel& model, State& state) {
    std::size_t vertices = 0; // of surfaces whose depths decide
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        reserve_springs(state.bodies[i].springs);
        if (can_touch_any(model, i) && meet_by_surface(model, i, i)) vertices += model.bodies[i].surface.vertices.size();
    }
    state.solids.entries.reserve(vertices);
    state.solids.vertex_springs.reserve(vertices);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::size_t places = 2 * model.instruments[i].rod.node_count();
        InstrumentState& own = state.instruments[i];
        own.chain.links_t0.reserve(places);
        own.chain.links_t1.reserve(places);
        own.planes.reserve(places * kPlanesPerPlace + kSparePlanes);
        own.presses.reserve(places * kPlanesPerPlace + kSparePlanes);
    }
}

void forget_scratch(StepContext& context) noexcept {
    for (BodyScratch& body : context.bodies) body.wall_age = {};
}

} // namespace trocar::engine
