// What a run's steps need beside its state, with room for all of it: a step allocates nothing.
#include "engine/step/context.hpp"

#include "engine/step/cull_stage.hpp"
#include "engine/step/instrument_stage.hpp"
#include "engine/step/solid_stage.hpp"

namespace trocar::engine {

namespace {

/// Contacts that the step's lists hold without growing.
constexpr std::size_t kReservedContacts = 4096;
/// Planes from corrections beside those of the wall.
constexpr std::size_t kSparePlanes = 4096;

/// Room for every place of the rod, so that pushing it in allocates nothing.
void reserve_lists(const InstrumentModel& instrument, InstrumentScratch& scratch) {
    const std::size_t places = 2 * instrument.rod.node_count();
    scratch.links_t0.reserve(places);
    scratch.links_t1.reserve(places);
    scratch.chain.links_t0.reserve(places);
    scratch.chain.links_t1.reserve(places);
    scratch.planes.reserve(places * kPlanesPerPlace + kSparePlanes);
    scratch.presses.reserve(places * kPlanesPerPlace + kSparePlanes);
    scratch.wall_distance.reserve(places);
}

void reserve_pairs(const SceneModel& model, StepContext& context) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::size_t wire = model.instruments[i].wire;
        if (wire == SIZE_MAX) continue;
        const std::size_t planes = context.instruments[i].planes.capacity() + context.instruments[wire].planes.capacity();
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

StepContext make_step_context(const SceneModel& model, const State& state) {
    StepContext context;
    context.bodies.resize(model.bodies.size());
    context.instruments.resize(model.instruments.size());
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (const BodyModel& body = model.bodies[i]; body.hollow) {
            context.bodies[i].inside = InsideTest(body.surface);
            if (body.moves()) context.bodies[i].inside.start_following(state.bodies[i].surface);
            if (body.moves_by_links_alone()) context.bodies[i].lumen.mark_still(*body.lumen, body.links->vertex_blend);
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
    for (BodyScratch& body : context.bodies) {
        for (fem::ContactSprings* springs : {&body.springs, &body.other_springs}) {
            springs->springs.reserve(kReservedContacts);
            springs->entries.reserve(12 * kReservedContacts); // a vertex and a triangle's three, of three nodes each
        }
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        context.instruments[i].axis.resize(model.instruments[i].rod.node_count());
        context.instruments[i].rod_t0 = state.instruments[i].rod;
        build_exact_trees(model, i, state, context);
        reserve_lists(model.instruments[i], context.instruments[i]);
    }
    reserve_pairs(model, context);
    reserve_culling(model, context);
    return context;
}

} // namespace trocar::engine
