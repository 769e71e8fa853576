#include "engine/state/state.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/state/bit_hash.hpp"

namespace trocar::engine {

namespace {

/// At rest, thrown as the scene says; what is pinned stays.
fem::TissueState make_tissue_state(const BodyModel& body) {
    const fem::TissueModel& tissue = *body.tissue;
    fem::TissueState state = fem::make_rest_state(tissue);
    if (body.velocity.isZero(0.0) && body.spin.isZero(0.0)) return state;
    Vec3 centre = Vec3::Zero();
    for (std::size_t node = 0; node < tissue.node_count(); ++node) centre += tissue.node_mass[node] / tissue.mass * tissue.rest_position[node];
    for (std::size_t node = 0; node < tissue.node_count(); ++node)
        if (tissue.inv_mass[node] > 0.0)
            state.velocity[node] = body.velocity + body.spin.cross(tissue.rest_position[node] - centre);
    return state;
}

BodyState make_body_state(const BodyModel& body) {
    BodyState state;
    if (body.tissue) state.tissue = make_tissue_state(body);
    state.surface = body.surface.vertices;
    if (body.hollow && body.moves_by_links_alone()) state.lumen.mark_still(*body.lumen, body.links->vertex_blend);
    return state;
}

InstrumentState make_instrument_state(const InstrumentModel& instrument) {
    InstrumentState state;
    const DriveCommand start = instrument.path.empty() ? DriveCommand{instrument.inserted, 0.0} : evaluate_path(instrument.path, 0.0);
    fem::place_rod(instrument.rod, instrument.port, start.insertion, start.rotation, state.rod);
    state.skin.resize(instrument.skin.vertex_count());
    std::vector<Vec3> axis(instrument.rod.node_count());
    fem::place_rod_skin(instrument.rod, instrument.skin, state.rod, instrument.port, axis, state.skin);
    state.follow.best_insertion = start.insertion;
    return state;
}

template <class List>
std::optional<std::size_t> find_named(const List& list, std::string_view name) noexcept {
    for (std::size_t i = 0; i < list.size(); ++i)
        if (list[i].name == name) return i;
    return std::nullopt;
}

} // namespace

State make_initial_state(const SceneModel& model) {
    State state;
    for (const BodyModel& body : model.bodies) state.bodies.push_back(make_body_state(body));
    for (std::size_t i = 0; i < model.bodies.size(); ++i) // as they stand: the first step starts from there
        if (const std::optional<fem::RigidLinks>& links = model.bodies[i].links)
            (void)fem::turn_frames(*links, state.bodies[owner_of(model, i)].tissue.position, state.bodies[i].frames);
    for (const InstrumentModel& instrument : model.instruments) state.instruments.push_back(make_instrument_state(instrument));
    for (const AddedEffect& added : model.effects.added)
        state.effects.emplace_back(added.effect->memory != nullptr ? added.effect->memory(model) : 0, 0.0);
    return state;
}

std::uint64_t hash_state(const State& state) noexcept {
    BitHash hash;
    hash.add(state.step);
    for (const BodyState& body : state.bodies) {
        hash.add(body.tissue.position);
        hash.add(body.tissue.velocity);
        for (const double strain : body.tissue.relaxed) hash.add(strain);
        hash.add(body.surface);
    }
    for (const InstrumentState& instrument : state.instruments) {
        hash.add(instrument.rod.position);
        hash.add(instrument.rod.velocity);
        hash.add(instrument.rod.insertion);
        hash.add(instrument.rod.rotation);
        for (const double angle : instrument.rod.angle) hash.add(angle);
        for (const double spin : instrument.rod.spin) hash.add(spin);
        if (!instrument.rod.root.isZero(0.0)) hash.add(instrument.rod.root);
    }
    for (const std::vector<double>& memory : state.effects)
        for (const double value : memory) hash.add(value);
    return hash.value();
}

std::size_t count_bodies(const SceneModel& model) noexcept { return model.bodies.size(); }

std::size_t count_instruments(const SceneModel& model) noexcept { return model.instruments.size(); }

std::optional<std::size_t> find_body(const SceneModel& model, std::string_view name) noexcept { return find_named(model.bodies, name); }

std::optional<std::size_t> find_instrument(const SceneModel& model, std::string_view name) noexcept {
    return find_named(model.instruments, name);
}

BodyView view_body(const SceneModel& model, const State& state, std::size_t body) noexcept {
    const BodyModel& of = model.bodies[body];
    const BodyState& now = state.bodies[body];
    return {of.name, now.surface, of.surface.triangles, now.tissue.position, now.tissue.velocity};
}

InstrumentView view_instrument(const SceneModel& model, const State& state, std::size_t instrument) noexcept {
    const InstrumentModel& of = model.instruments[instrument];
    const InstrumentState& now = state.instruments[instrument];
    return {of.name, now.rod.position, now.rod.velocity, now.skin, of.skin.triangles, now.rod.insertion, now.rod.rotation};
}

} // namespace trocar::engine
