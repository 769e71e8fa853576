#include "engine/state/state_bytes.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/state/bit_hash.hpp"
#include "engine/state/byte_stream.hpp"
#include "engine/state/visit_state.hpp"
#include "fem/tissue/relaxation.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

// Checks of what was read: ids that would reach beyond a list, sizes of another model.

bool are_finite(const std::vector<Vec3>& points) {
    return std::all_of(points.begin(), points.end(), [](const Vec3& p) { return is_finite(p); });
}
bool is_none_or(std::size_t count, std::size_t wanted) { return count == 0 || count == wanted; }
bool is_id(Index id, std::size_t count) { return id == kNoIndex || id < count; }

bool keeps_relaxation(const BodyModel& model, const fem::TissueState& tissue) {
    const std::size_t wanted = model.tissue ? fem::relaxation_size(*model.tissue) : 0;
    return is_none_or(tissue.relaxed.size(), wanted) && // none before the first step
           std::all_of(tissue.relaxed.begin(), tissue.relaxed.end(), [](double strain) { return std::isfinite(strain); });
}

bool body_fits(const BodyModel& model, const BodyState& body) {
    const fem::StableStepWorkspace& stable = body.stable;
    const std::size_t tissue_nodes = model.tissue ? model.tissue->node_count() : 0;
    const std::size_t batches = model.tissue ? model.tissue->plan.batches.size() : 0, tets = model.tissue ? model.tissue->tet_count() : 0;
    return body.tissue.position.size() == tissue_nodes && body.tissue.velocity.size() == tissue_nodes &&
           body.surface.size() == model.surface.vertices.size() && are_finite(body.tissue.position) && are_finite(body.tissue.velocity) &&
           keeps_relaxation(model, body.tissue) &&
           are_finite(body.surface) && body.frames.frame.size() == (model.links ? model.links->frame_count() : 0) &&
           is_none_or(stable.mode.size(), tissue_nodes) && is_none_or(stable.damping_mode.size(), tissue_nodes) &&
           are_finite(stable.mode) && are_finite(stable.damping_mode) && is_none_or(stable.notes.size(), batches) &&
           std::isfinite(body.contact_work) && is_id(stable.rates.worst_tet, tets) && stable.rounds_ahead >= 0 && stable.rounds_ahead < 2 * stable.warm_rounds &&
           is_none_or(body.flow_frames.frame.size(), model.blood && model.blood->links ? model.blood->links->frame_count() : 0);
}

bool plane_is_finite(const fem::RodPlane& p) {
    return is_finite(p.normal) && is_finite(p.wall_velocity) && is_finite(p.drag) && is_finite(p.start_drag) && std::isfinite(p.offset) &&
           std::isfinite(p.weight) && std::isfinite(p.force) && std::isfinite(p.start_force) && std::isfinite(p.give) && is_finite(p.felt) &&
           std::isfinite(p.other_weight) && std::isfinite(p.friction_share);
}

bool meeting_fits(const SceneModel& model, const fem::RodMeeting& meeting) {
    const auto holds = [&](Index rod, Index node) {
        return rod < model.instruments.size() && may_be_joined(model, rod) && node < model.instruments[rod].rod.node_count() - 1;
    };
    const bool fits = plane_is_finite(meeting.plane) && holds(meeting.rod, meeting.plane.node) && holds(meeting.other_rod, meeting.plane.other);
    if (!fits || !is_finite(meeting.along) || !is_finite(meeting.beside)) return false;
    if (meeting.play == 0.0) return meeting.rod < meeting.other_rod;
    const InstrumentModel& inner = model.instruments[meeting.rod];
    return inner.inside == meeting.other_rod && inner.play == meeting.play;
}

/// A unit vector where the rod has left its port, and none where it has not.
bool root_fits(const InstrumentModel& own, const fem::RodState& rod) {
    if (rod.root.isZero(0.0)) return true;
    return own.detachable && is_finite(rod.root) && std::abs(rod.root.squaredNorm() - 1.0) < 1e-6 && fem::is_free(own.rod, rod.insertion);
}

bool instrument_fits(const SceneModel& model, const InstrumentModel& own, const InstrumentState& state) {
    const std::size_t nodes = own.rod.node_count(), triangles = model.bodies[own.lumen].surface.triangles.size();
    const auto plane_fits = [&](const fem::RodPlane& p) { return plane_is_finite(p) && p.node + 1 < nodes; };
    const auto wall_plane_fits = [&](const fem::RodPlane& p) { return plane_fits(p) && p.other == kNoIndex; };
    const auto self_plane_fits = [&](const fem::RodPlane& p) { return plane_fits(p) && p.other < nodes && p.other + 1 < nodes; };
    const auto press_fits = [&](const WallPress& p) { return is_id(p.triangle, triangles) && std::isfinite(p.give) && p.give >= 0.0; };
    const std::size_t angles = own.rod.twist_stiffness.empty() ? 0 : nodes;
    for (const std::vector<double>* list : {&state.rod.angle, &state.rod.spin})
        if (list->size() != angles || !std::all_of(list->begin(), list->end(), [](double value) { return std::isfinite(value); }))
            return false;
    const FollowState& f = state.follow;
    const bool follow_finite = std::isfinite(f.progress + f.best_progress + f.best_insertion + f.astray_insertion + f.fork +
                                             f.retract_from + f.turned_for + f.missing);
    return state.rod.position.size() == nodes && state.rod.velocity.size() == nodes && state.skin.size() == own.skin.vertex_count() &&
           are_finite(state.rod.position) && are_finite(state.rod.velocity) && are_finite(state.skin) && state.rod.insertion >= 0.0 &&
           state.rod.insertion <= own.rod.design.length && std::isfinite(state.rod.rotation) && root_fits(own, state.rod) && f.mode <= FollowMode::Arrived &&
           follow_finite && is_none_or(state.route.points.size(), own.route ? own.route->points.size() : 0) &&
           are_finite(state.route.points) &&
           is_none_or(state.route_frames.frame.size(), own.route_links ? own.route_links->frame_count() : 0) &&
           is_none_or(state.chain.hint.size(), own.chain.capacity()) && state.presses.size() == state.planes.size() &&
           std::all_of(state.planes.begin(), state.planes.end(), wall_plane_fits) &&
           std::all_of(state.self_planes.begin(), state.self_planes.end(), self_plane_fits) &&
           std::all_of(state.presses.begin(), state.presses.end(), press_fits);
}

bool contact_fits(const SceneModel& model, const SolidContact& contact) {
    const Contact& touch = contact.touch;
    const std::size_t bodies = model.bodies.size();
    if (!is_between_bodies(touch)) return false;
    const std::size_t a = touch.a.index(), b = touch.b.index();
    if (a >= bodies || b >= bodies) return false;
    if (a == b ? !touches_itself(model, a) : !are_solid_pair(model, a, b)) return false;
    const std::size_t own = model.bodies[a].surface.vertices.size(), other = model.bodies[b].surface.vertices.size();
    return touch.feature_a[0] < own && is_id(touch.feature_a[1], own) &&
           touch.feature_b[0] < other && touch.feature_b[1] < other && (touch.between_edges() || touch.feature_b[2] < other) &&
           is_finite(touch.point) &&
           is_finite(touch.normal) && is_finite(touch.force) && is_finite(contact.warm) && std::isfinite(touch.gap) &&
           std::isfinite(contact.recovery) && std::isfinite(contact.room) && std::isfinite(touch.bary_a[0] + touch.bary_a[1]) &&
           std::isfinite(touch.bary_b[0] + touch.bary_b[1] + touch.bary_b[2]);
}

bool solids_fit(const SceneModel& model, const State& state) {
    const std::size_t bodies = model.bodies.size();
    const auto is_leaf = [&](std::size_t body, Index sphere) {
        const spheretree::SphereTree& tree = model.bodies[body].covering.tree;
        return sphere < tree.sphere_count() && tree.is_leaf(sphere);
    };
    const SolidContactState& s = state.solids;
    return std::all_of(s.touching.begin(), s.touching.end(),
                       [&](const LeafPair& p) {
                           return p.a < bodies && p.b < bodies && is_leaf(p.a, p.leaf_a) && is_leaf(p.b, p.leaf_b) &&
                                  (p.a != p.b || touches_itself(model, p.a));
                       }) &&
           std::all_of(s.entries.begin(), s.entries.end(),
                       [&](const SolidEntry& e) {
                           return e.own < bodies && e.other < bodies && are_solid_pair(model, e.own, e.other) &&
                                  meet_by_surface(model, e.own, e.other) && e.vertex < model.bodies[e.own].surface.vertices.size() &&
                                  e.by < model.bodies[e.other].surface.triangles.size() && std::isfinite(e.depth);
                       }) &&
           std::is_sorted(s.entries.begin(), s.entries.end(), [](const SolidEntry& x, const SolidEntry& y) { return x.key() < y.key(); }) &&
           std::all_of(s.contacts.begin(), s.contacts.end(), [&](const SolidContact& c) { return contact_fits(model, c); }) &&
           std::is_sorted(s.contacts.begin(), s.contacts.end(), [](const SolidContact& x, const SolidContact& y) { return x.key() < y.key(); });
}

} // namespace

std::string find_misfit(const SceneModel& model, const State& state) {
    if (state.bodies.size() != model.bodies.size())
        return fmt::format("bodies: found {}, expected {}", state.bodies.size(), model.bodies.size());
    if (state.instruments.size() != model.instruments.size())
        return fmt::format("instruments: found {}, expected {}", state.instruments.size(), model.instruments.size());
    if (!std::isfinite(state.time) || state.time < 0.0) return "its time is not a number";
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!body_fits(model.bodies[i], state.bodies[i]))
            return fmt::format("what it holds of the body \"{}\" does not fit the scene's", model.bodies[i].name);
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        if (!instrument_fits(model, model.instruments[i], state.instruments[i]))
            return fmt::format("what it holds of the instrument \"{}\" does not fit the scene's", model.instruments[i].name);
    if (state.effects.size() != model.effects.added.size()) return "what it holds of effects does not fit the scene's";
    for (std::size_t i = 0; i < state.effects.size(); ++i) {
        const auto& [effect, settings] = model.effects.added[i];
        const std::vector<double>& kept = state.effects[i];
        if (kept.size() != (effect->memory != nullptr ? effect->memory(model) : 0) ||
            !std::all_of(kept.begin(), kept.end(), [](double value) { return std::isfinite(value); }))
            return fmt::format("what it holds of the effect \"{}\" does not fit the scene's", effect->name);
    }
    if (!std::all_of(state.meetings.begin(), state.meetings.end(), [&](const fem::RodMeeting& meeting) { return meeting_fits(model, meeting); }))
        return "what it holds of instruments against one another does not fit the scene's";
    if (!solids_fit(model, state)) return "its contacts name what the scene does not have";
    return {};
}

namespace {

/// The rest of a route's description is the model's.
void complete_routes(const SceneModel& model, State& state) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        Route& now = state.instruments[i].route;
        if (now.points.empty() || !model.instruments[i].route) continue;
        std::vector<Vec3> points = std::move(now.points);
        now = *model.instruments[i].route;
        now.points = std::move(points);
    }
}

template <class Visitor, class Balls>
void visit_balls(Visitor& visitor, Balls& balls) {
    visitor.list(balls, [&](auto& ball) {
        auto& [centre, radius, measured] = ball;
        visitor.vector(centre);
        visit_numbers(visitor, radius, measured);
    });
}

} // namespace

void append_state(const State& state, std::string& bytes) {
    ByteWriter writer(bytes);
    visit_state(writer, state, [&](const BodyState& body) {
        std::vector<spheretree::KeptBall> balls = body.lumen.kept();
        const bool missed = body.lumen_step != kNoStep && body.lumen_step + 1 != state.step;
        if (missed)
            for (spheretree::KeptBall& ball : balls) ball.measured = false;
        visit_balls(writer, std::as_const(balls));
    });
}

Result<State> read_state(const SceneModel& model, std::string_view bytes) {
    const auto wrong = [](std::string message) { return Error{ErrorCode::BadValue, std::move(message)}; };
    State state = make_initial_state(model);
    ByteReader reader(bytes);
    std::vector<std::vector<spheretree::KeptBall>> balls;
    visit_state(reader, state, [&](BodyState&) { visit_balls(reader, balls.emplace_back()); });
    if (!reader.ok()) return wrong("it ends too early");
    if (!reader.at_end()) return wrong(fmt::format("{} bytes are left over", reader.left()));
    if (std::string misfit = find_misfit(model, state); !misfit.empty()) return wrong(std::move(misfit));
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!is_none_or(balls[i].size(), model.bodies[i].lumen ? model.bodies[i].lumen->ball_count() : 0))
            return wrong(fmt::format("what it holds of the body \"{}\" does not fit the scene's", model.bodies[i].name));
        if (!balls[i].empty()) state.bodies[i].lumen.keep(*model.bodies[i].lumen, balls[i]);
    }
    complete_routes(model, state);
    return state;
}

std::uint64_t hash_whole_state(const State& state) {
    std::string bytes;
    append_state(state, bytes);
    BitHash hash;
    hash.add_bytes(bytes);
    return hash.value();
}

} // namespace trocar::engine
