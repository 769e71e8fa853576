#include "engine/step/step_memory.hpp"

#include "engine/step/byte_stream.hpp"
#include "engine/step/self_touch.hpp"
#include "engine/step/solid_stage.hpp"
#include "engine/step/solid_touch.hpp"
#include "engine/step/surface_spring.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

namespace trocar::engine {

namespace {

// One description for both ways: Stream is a ByteWriter over constant data, or a ByteReader over data that it fills.

template <class Stream, class List>
void pass_points(Stream& stream, List& points) {
    stream.list(points, [&](auto& p) { stream.vector(p); });
}

template <class Stream, class Frames>
void pass_frames(Stream& stream, Frames& frames) {
    stream.list(frames.frame, [&](auto& frame) {
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row) {
                stream.number(frame.displacement[column][row]);
                stream.number(frame.turn[column][row]);
            }
    });
}

template <class Stream, class Springs>
void pass_springs(Stream& stream, Springs& springs) {
    stream.list(springs.springs, [&](auto& s) {
        stream.number(s.first_entry), stream.number(s.entry_count), stream.number(s.balanced), stream.number(s.load),
            stream.number(s.friction);
        stream.number(s.offset), stream.number(s.rate), stream.number(s.stiffness), stream.number(s.damping), stream.number(s.limit);
    });
    stream.list(springs.entries, [&](auto& e) {
        stream.number(e.node);
        stream.vector(e.g);
    });
}

template <class Stream, class Stable>
void pass_stable_step(Stream& stream, Stable& stable) {
    pass_points(stream, stable.mode);
    pass_points(stream, stable.damping_mode);
    stream.list(stable.notes, [&](auto& note) {
        for (auto& value : note.per_tangent) stream.number(value);
        for (auto& value : note.per_size) stream.number(value);
    });
    stream.number(stable.rates.elastic), stream.number(stable.rates.viscous), stream.number(stable.rates.worst_tet);
    stream.number(stable.rates_age), stream.number(stable.rates_hold), stream.number(stable.warm);
    stream.number(stable.rounds_ahead);
}

template <class Stream, class Body, class Scratch, class Balls>
void pass_body(Stream& stream, Body& body, Scratch& scratch, Balls& balls) {
    pass_points(stream, body.tissue.position);
    pass_points(stream, body.tissue.velocity);
    pass_points(stream, body.surface);
    pass_frames(stream, scratch.frames);
    pass_stable_step(stream, scratch.stable);
    pass_springs(stream, scratch.springs);
    stream.list(balls, [&](auto& ball) {
        stream.vector(ball.centre);
        stream.number(ball.radius), stream.number(ball.measured);
    });
}

template <class Stream, class Follow>
void pass_follow(Stream& stream, Follow& f) {
    stream.number(f.mode);
    stream.number(f.progress), stream.number(f.best_progress), stream.number(f.best_insertion), stream.number(f.astray_insertion);
    stream.number(f.fork), stream.number(f.retract_from), stream.number(f.turned_for), stream.number(f.missing);
    stream.number(f.attempts);
}

template <class Stream, class Instrument, class Scratch>
void pass_instrument(Stream& stream, Instrument& instrument, Scratch& scratch) {
    pass_points(stream, instrument.rod.position);
    pass_points(stream, instrument.rod.velocity);
    stream.number(instrument.rod.insertion), stream.number(instrument.rod.rotation);
    stream.list(instrument.rod.angle, [&](auto& angle) { stream.number(angle); });
    stream.list(instrument.rod.spin, [&](auto& spin) { stream.number(spin); });
    pass_points(stream, instrument.skin);
    pass_follow(stream, instrument.follow);
    stream.number(scratch.hand_stopped), stream.number(scratch.kept_inside);
    pass_points(stream, scratch.route.points);
    pass_frames(stream, scratch.route_frames);
    stream.list(scratch.chain.hint, [&](auto& leaf) { stream.number(leaf); });
    stream.list(scratch.planes, [&](auto& plane) {
        stream.number(plane.node), stream.number(plane.weight);
        stream.vector(plane.normal);
        stream.number(plane.offset), stream.number(plane.force);
        stream.vector(plane.wall_velocity);
        stream.vector(plane.drag);
    });
    stream.list(scratch.presses, [&](auto& press) {
        stream.number(press.triangle);
        for (auto& b : press.bary) stream.number(b);
    });
    stream.number(scratch.forecast.candidates);
}

template <class Stream, class Solids>
void pass_solids(Stream& stream, Solids& solids) {
    stream.list(solids.remembered, [&](auto& pair) {
        stream.number(pair.a), stream.number(pair.b), stream.number(pair.leaf_a), stream.number(pair.leaf_b), stream.number(pair.gap);
    });
    stream.list(solids.holds, [&](auto& hold) {
        stream.number(hold.body_a), stream.number(hold.body_b), stream.number(hold.sphere_a), stream.number(hold.sphere_b);
        stream.number(hold.tested), stream.vector(hold.normal), stream.number(hold.gap);
        stream.vector(hold.anchor), stream.number(hold.hold), stream.vector(hold.aside);
    });
    stream.list(solids.entries, [&](auto& entry) {
        stream.number(entry.own), stream.number(entry.other), stream.number(entry.vertex), stream.number(entry.by);
    });
    stream.list(solids.springs, [&](auto& pair) {
        stream.number(pair.body_a), stream.number(pair.body_b), stream.number(pair.spring_a), stream.number(pair.spring_b);
        stream.vector(pair.normal);
    });
    stream.list(solids.sprung, [&](auto& place) {
        stream.number(place.own), stream.number(place.other), stream.number(place.vertex);
        stream.number(place.spring_a), stream.number(place.spring_b), stream.number(place.pressed), stream.number(place.scale);
        stream.vector(place.drawn);
    });
}

template <class Stream, class Value, class Pass>
void pass_optional(Stream& stream, std::optional<Value>& value, Pass&& pass) {
    bool there = false;
    stream.number(there);
    if (there) pass(value.emplace());
}
template <class Stream, class Value, class Pass>
void pass_optional(Stream& stream, const std::optional<Value>& value, Pass&& pass) {
    stream.number(value.has_value());
    if (value) pass(*value);
}

/// What people do while it runs: a scene knows nothing of it.
template <class Stream, class Context>
void pass_hands(Stream& stream, Context& context) {
    for (auto& instrument : context.instruments)
        pass_optional(stream, instrument.hand, [&](auto& hand) { stream.number(hand.insertion), stream.number(hand.rotation); });
    pass_optional(stream, context.pull, [&](auto& pull) {
        stream.number(pull.body), stream.number(pull.vertex);
        stream.vector(pull.target);
    });
}

template <class Stream, class StateT, class Context, class Balls>
void pass_all(Stream& stream, StateT& state, Context& context, Balls& balls) {
    stream.number(state.step), stream.number(state.time);
    for (std::size_t i = 0; i < state.bodies.size(); ++i) pass_body(stream, state.bodies[i], context.bodies[i], balls[i]);
    for (std::size_t i = 0; i < state.instruments.size(); ++i) pass_instrument(stream, state.instruments[i], context.instruments[i]);
    pass_solids(stream, context.solids);
    pass_hands(stream, context);
}

using Balls = std::vector<std::vector<spheretree::KeptBall>>; // [body_count]

// Checks of what was read: ids that would reach beyond a list, sizes of another model.

bool are_finite(const std::vector<Vec3>& points) {
    return std::all_of(points.begin(), points.end(), [](const Vec3& p) { return is_finite(p); });
}
bool is_none_or(std::size_t count, std::size_t wanted) { return count == 0 || count == wanted; }
bool is_id(Index id, std::size_t count) { return id == kNoIndex || id < count; }

bool springs_fit(const fem::ContactSprings& springs, std::size_t nodes) {
    for (Index index = 0; index < springs.springs.size(); ++index) {
        const fem::ContactSpring& s = springs.springs[index];
        if (s.load != kNoIndex && (s.load >= index || springs.springs[s.load].load != kNoIndex)) return false;
        if (!std::isfinite(s.friction) || !(s.friction >= 0.0)) return false;
        if (std::size_t{s.first_entry} + s.entry_count > springs.entries.size()) return false;
        if (!std::isfinite(s.offset) || !std::isfinite(s.rate) || !std::isfinite(s.stiffness) || !(s.stiffness >= 0.0)) return false;
        if (!std::isfinite(s.damping) || !(s.damping >= 0.0) || !(s.limit >= 0.0)) return false;
    }
    return std::all_of(springs.entries.begin(), springs.entries.end(),
                       [&](const fem::SpringEntry& e) { return e.node < nodes && is_finite(e.g); });
}

bool body_fits(const BodyModel& model, std::size_t nodes, const BodyState& body, const BodyScratch& scratch,
               const std::vector<spheretree::KeptBall>& balls) {
    const fem::StableStepWorkspace& stable = scratch.stable;
    const std::size_t tissue_nodes = model.tissue ? model.tissue->node_count() : 0;
    const std::size_t batches = model.tissue ? model.tissue->plan.batches.size() : 0, tets = model.tissue ? model.tissue->tet_count() : 0;
    return body.tissue.position.size() == tissue_nodes && body.tissue.velocity.size() == tissue_nodes &&
           body.surface.size() == model.surface.vertices.size() && are_finite(body.tissue.position) && are_finite(body.tissue.velocity) &&
           are_finite(body.surface) && is_none_or(scratch.frames.frame.size(), model.links ? model.links->frame_nodes.size() : 0) &&
           is_none_or(stable.mode.size(), tissue_nodes) && is_none_or(stable.damping_mode.size(), tissue_nodes) &&
           are_finite(stable.mode) && are_finite(stable.damping_mode) && is_none_or(stable.notes.size(), batches) &&
           is_id(stable.rates.worst_tet, tets) && stable.rounds_ahead >= 0 && stable.rounds_ahead < 2 * stable.warm_rounds &&
           springs_fit(scratch.springs, nodes) && is_none_or(balls.size(), model.lumen ? model.lumen->ball_count() : 0);
}

bool instrument_fits(const SceneModel& model, const InstrumentModel& own, const InstrumentState& state, const InstrumentScratch& scratch) {
    const std::size_t nodes = own.rod.node_count(), triangles = model.bodies[own.lumen].surface.triangles.size();
    const auto plane_fits = [&](const fem::RodPlane& p) {
        return p.node + 1 < nodes && is_finite(p.normal) && is_finite(p.wall_velocity) && is_finite(p.drag) && std::isfinite(p.offset) &&
               std::isfinite(p.weight) && std::isfinite(p.force);
    };
    const auto press_fits = [&](const WallPress& p) { return is_id(p.triangle, triangles); };
    const std::size_t angles = own.rod.twist_stiffness.empty() ? 0 : nodes;
    for (const std::vector<double>* list : {&state.rod.angle, &state.rod.spin})
        if (list->size() != angles || !std::all_of(list->begin(), list->end(), [](double value) { return std::isfinite(value); }))
            return false;
    const FollowState& f = state.follow;
    const bool follow_finite = std::isfinite(f.progress + f.best_progress + f.best_insertion + f.astray_insertion + f.fork +
                                             f.retract_from + f.turned_for + f.missing);
    return state.rod.position.size() == nodes && state.rod.velocity.size() == nodes && state.skin.size() == own.skin.vertex_count() &&
           are_finite(state.rod.position) && are_finite(state.rod.velocity) && are_finite(state.skin) && state.rod.insertion >= 0.0 &&
           state.rod.insertion <= own.rod.design.length && std::isfinite(state.rod.rotation) && f.mode <= FollowMode::Arrived &&
           follow_finite && is_none_or(scratch.route.points.size(), own.route ? own.route->points.size() : 0) &&
           are_finite(scratch.route.points) &&
           is_none_or(scratch.route_frames.frame.size(), own.route_links ? own.route_links->frame_nodes.size() : 0) &&
           is_none_or(scratch.chain.hint.size(), own.chain.capacity()) && scratch.presses.size() == scratch.planes.size() &&
           std::all_of(scratch.planes.begin(), scratch.planes.end(), plane_fits) &&
           std::all_of(scratch.presses.begin(), scratch.presses.end(), press_fits);
}

bool solids_fit(const SceneModel& model, const StepContext& context) {
    const std::size_t bodies = model.bodies.size();
    const auto is_leaf = [&](std::size_t body, Index sphere) {
        const spheretree::SphereTree& tree = model.bodies[body].covering.tree;
        return sphere < tree.sphere_count() && tree.is_leaf(sphere);
    };
    const auto is_spring = [&](std::size_t body, Index spring) {
        return is_id(spring, context.bodies[owner_of(model, body)].springs.springs.size());
    };
    const SolidScratch& s = context.solids;
    return std::all_of(s.remembered.begin(), s.remembered.end(),
                       [&](const LeafPair& p) {
                           return p.a < bodies && p.b < bodies && is_leaf(p.a, p.leaf_a) && is_leaf(p.b, p.leaf_b) &&
                                  (p.a != p.b || touches_itself(model, p.a));
                       }) &&
           std::all_of(s.holds.begin(), s.holds.end(),
                       [&](const SphereHold& h) { return h.body_a < bodies && h.body_b < bodies && is_finite(h.normal); }) &&
           std::all_of(s.entries.begin(), s.entries.end(),
                       [&](const SolidEntry& e) {
                           return e.own < bodies && e.other < bodies && are_solid_pair(model, e.own, e.other) &&
                                  meet_by_surface(model, e.own, e.other) && e.vertex < model.bodies[e.own].surface.vertices.size() &&
                                  e.by < model.bodies[e.other].surface.triangles.size();
                       }) &&
           std::is_sorted(s.entries.begin(), s.entries.end(), [](const SolidEntry& x, const SolidEntry& y) { return x.key() < y.key(); }) &&
           std::all_of(s.springs.begin(), s.springs.end(),
                       [&](const SpringPair& p) {
                           return p.body_a < bodies && p.body_b < bodies && is_spring(p.body_a, p.spring_a) &&
                                  is_spring(p.body_b, p.spring_b);
                       }) &&
           std::all_of(s.sprung.begin(), s.sprung.end(),
                       [&](const SprungPlace& p) {
                           return p.own < bodies && p.other < bodies && p.vertex < model.bodies[p.own].surface.vertices.size() &&
                                  is_spring(p.own, p.spring_a) && is_spring(p.other, p.spring_b) && std::isfinite(p.pressed) &&
                                  p.scale > 0.0 && is_finite(p.drawn);
                       }) &&
           std::is_sorted(s.sprung.begin(), s.sprung.end(), [](const SprungPlace& x, const SprungPlace& y) { return x.key() < y.key(); });
}

std::string find_misfit(const SceneModel& model, const State& state, const StepContext& context, const Balls& balls) {
    if (!std::isfinite(state.time) || state.time < 0.0) return "its time is not a number";
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const std::size_t nodes = state.bodies[i].tissue.position.size(); // springs sit with the body whose nodes they push
        if (!body_fits(model.bodies[i], nodes, state.bodies[i], context.bodies[i], balls[i]))
            return fmt::format("what it holds of the body \"{}\" does not fit the scene's", model.bodies[i].name);
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        if (!instrument_fits(model, model.instruments[i], state.instruments[i], context.instruments[i]))
            return fmt::format("what it holds of the instrument \"{}\" does not fit the scene's", model.instruments[i].name);
    if (!solids_fit(model, context)) return "its contacts name what the scene does not have";
    if (context.pull &&
        (context.pull->body >= model.bodies.size() || context.pull->vertex >= model.bodies[context.pull->body].surface.vertices.size() ||
         !is_finite(context.pull->target)))
        return "its pull is at no point of the scene";
    return {};
}

/// The rest of a route's description is the model's.
void complete_routes(const SceneModel& model, StepContext& context) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        Route& now = context.instruments[i].route;
        if (now.points.empty() || !model.instruments[i].route) continue;
        std::vector<Vec3> points = std::move(now.points);
        now = *model.instruments[i].route;
        now.points = std::move(points);
    }
}

} // namespace

void append_step_memory(const SceneModel& model, const State& state, const StepContext& context, std::string& bytes) {
    Balls balls;
    for (const BodyScratch& body : context.bodies) {
        balls.push_back(body.lumen.kept());
        const bool missed = body.lumen_step != kNoStep && body.lumen_step + 1 != state.step;
        if (missed)
            for (spheretree::KeptBall& ball : balls.back()) ball.measured = false;
    }
    balls.resize(model.bodies.size());
    ByteWriter stream(bytes);
    pass_all(stream, state, context, balls);
}

std::string read_step_memory(const SceneModel& model, std::string_view bytes, State& state, StepContext& context) {
    Balls balls(model.bodies.size());
    ByteReader stream(bytes);
    pass_all(stream, state, context, balls);
    if (!stream.ok()) return "it ends too early";
    if (!stream.at_end()) return fmt::format("{} bytes are left over", stream.left());
    if (std::string misfit = find_misfit(model, state, context, balls); !misfit.empty()) return misfit;
    complete_routes(model, context);
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        BodyScratch& body = context.bodies[i];
        body.surface_waits = false;
        body.wall_age = {};
        body.lumen_step = kNoStep;
        body.lumen.reset();
        if (!balls[i].empty()) body.lumen.keep(*model.bodies[i].lumen, balls[i]);
    }
    return {};
}

} // namespace trocar::engine
