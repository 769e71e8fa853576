#include "engine/step/solid/spring_sink.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/tissue/surface_spring.hpp"

#include <algorithm>

namespace trocar::engine {

Vec3 Place::motion(const SceneModel& model, const State& state, const SolidScratch& solids) const {
    Vec3 moved = Vec3::Zero();
    if (!model.bodies[body].moves()) return moved;
    for (std::size_t k = 0; k < vertices.size(); ++k)
        moved += weights[k] * (state.bodies[body].surface[vertices[k]] - solids.bodies[body].surface_t0[vertices[k]]);
    return moved;
}

namespace {

/// [-]; the heavier of two bodies takes at least so much of the way apart: less would make its springs that much stiffer, and their
/// stable step shorter.
constexpr double kLeastShare = 0.1;

/// Does it hang on nodes that a force moves? What stands still, or goes its scripted way, takes any.
bool gives_way(const SceneModel& model, const Place& place) {
    const std::optional<fem::RigidLinks>& links = model.bodies[place.body].links;
    return links && std::any_of(place.vertices.begin(), place.vertices.end(), [&](Index v) { return links->vertex_frame[v] != kNoIndex; });
}

/// Of the gap between two places, so much is the first one's to close.
double share_of(const SceneModel& model, const Place& place, const Place& other) {
    if (!gives_way(model, place) || !gives_way(model, other)) return 1.0;
    const double own = model.bodies[owner_of(model, place.body)].tissue->mass;
    const double others = model.bodies[owner_of(model, other.body)].tissue->mass;
    return std::clamp(others / (own + others), kLeastShare, 1.0 - kLeastShare);
}

/// What one body gets of a push.
struct Side {
    const Place& place;
    Vec3 direction;        // unit, its own
    double share;          // of the gap
    double rate;           // m/s, of its share of the gap, by what does not hang on its nodes
    Index load = kNoIndex; // its spring of Push::under
};

SurfacePush make_push(const Place& place, const Push& push, double gap_share, double rate, Index load) {
    return {place.body,
            place.vertices,
            place.weights,
            push.direction,
            gap_share * push.gap,
            push.stiffness / gap_share,
            push.damping / gap_share,
            push.limit,
            rate,
            load,
            push.friction};
}

/// Index of the spring among its owner's.
Index push_side(const SceneModel& model, const Side& side, const Push& push, State& state) {
    const Place& place = side.place;
    if (!model.bodies[place.body].links) return kNoIndex;
    SurfacePush own = make_push(place, push, side.share, side.rate, side.load);
    own.direction = side.direction;
    if (!add_surface_spring(model, own, state)) return kNoIndex;
    return static_cast<Index>(state.bodies[owner_of(model, place.body)].springs.springs.size() - 1);
}

/// m/s; how the mass centre of two bodies moves, where nothing holds any.
Vec3 find_common_drift(const SceneModel& model, std::size_t a, std::size_t b, const SolidScratch& solids) {
    const std::optional<fem::TissueModel>&own = model.bodies[a].tissue, &other = model.bodies[b].tissue;
    if (!own || !other) return Vec3::Zero();
    return (own->mass * solids.drift[a] + other->mass * solids.drift[b]) / (own->mass + other->mass);
}

/// Both places hang on the nodes of one body: one spring between them.
void push_within(const SceneModel& model, const Place& a, const Place& b, const Push& push, State& state) {
    const SurfacePush on_a = make_push(a, push, 1.0, 0.0, push.under != nullptr ? push.under->spring_a : kNoIndex);
    const bool made = add_balanced_spring(model, on_a, {b.body, b.vertices, b.weights}, state);
    const std::size_t last = state.bodies[owner_of(model, a.body)].springs.springs.size();
    state.solids.springs.push_back({a.body, b.body, made ? static_cast<Index>(last - 1) : kNoIndex, kNoIndex, push.direction});
}

} // namespace

/// Each body is integrated against the other as it stands at the step's start. If each took the whole gap for its own, both would close
/// it, and go as far into one another as it was wide: energy from nowhere. So each has its share of it, the lighter one the larger, and
/// a spring as much stiffer: where they overlap both feel the same force as before, which fades as it does between two free masses.
/// What they go too far by, d_a and d_b, has cost them k (d_a^2 / share_a + d_b^2 / share_b) / 2, never less than the k (d_a + d_b)^2 / 2
/// that the next step's springs start with: energy is lost, not found. The price: something that stands in the way and does not move is
/// felt before it is reached, by half of what the two came nearer in the step.
/// Where nothing holds any body, two are seen from their common mass centre: what flies along together stands still there. (Where something
/// does, planes that move would do work on what is pressed against it.)
/// What a script moves is known ahead: the springs go along with it during the step. If it stood still and jumped at the step's end, each
/// spring would begin with k (v h)^2 / 2 from nowhere, for a speed v and a step h: stiff ones would throw off what is pressed slowly.
void SpringSink::push(const Place& a, const Place& b, const Push& push) {
    const std::size_t owner_a = owner_of(model, a.body), owner_b = owner_of(model, b.body);
    if (owner_a == owner_b && model.bodies[a.body].links && model.bodies[b.body].links)
        return push_within(model, a, b, push, state);
    const double rate = push.direction.dot(solids.bodies[a.body].coming - solids.bodies[b.body].coming) / model.step_s;
    const double drift = push.direction.dot(find_common_drift(model, owner_a, owner_b, solids));
    const double share_a = share_of(model, a, b), share_b = share_of(model, b, a);
    const SpringPair load = push.under != nullptr ? *push.under : SpringPair{};
    const Index on_a = push_side(model, {a, push.direction, share_a, share_a * rate - drift, load.spring_a}, push, state);
    const Index on_b = push_side(model, {b, -push.direction, share_b, share_b * rate + drift, load.spring_b}, push, state);
    state.solids.springs.push_back({a.body, b.body, on_a, on_b, push.direction});
}

} // namespace trocar::engine
