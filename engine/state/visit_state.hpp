// The one list of what a State holds. Saving, loading and hashing are visits of it; a member that is added to a struct and not named
// here does not compile.
//
// Visitor: number(x), vector(v), list(values, each); ByteWriter over a constant State, ByteReader over one that it
// fills.
#pragma once

#include "engine/state/state.hpp"

namespace trocar::engine {

template <class Visitor, class List>
void visit_points(Visitor& visitor, List& points) {
    visitor.list(points, [&](auto& p) { visitor.vector(p); });
}

template <class Visitor, class... Numbers>
void visit_numbers(Visitor& visitor, Numbers&... numbers) {
    (visitor.number(numbers), ...);
}

/// The turns stand for what they were last: those of triangles that have collapsed since are kept. The rest is made anew in each step.
template <class Visitor, class Frames>
void visit_frames(Visitor& visitor, Frames& frames) {
    auto& [frame, node, threads, leave_static] = frames;
    visitor.list(frame, [&](auto& of) {
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row) visit_numbers(visitor, of.displacement[column][row], of.turn[column][row]);
    });
}

template <class Visitor, class Memory>
void visit_stable_step(Visitor& visitor, Memory& memory) {
    auto& [mode, damping_mode, notes, rates, rates_age, rates_hold, warm, rounds_ahead] = memory;
    visit_points(visitor, mode), visit_points(visitor, damping_mode);
    visitor.list(notes, [&](auto& note) {
        for (auto& value : note.per_tangent) visitor.number(value);
        for (auto& value : note.per_size) visitor.number(value);
    });
    auto& [elastic, viscous, worst_tet] = rates;
    visit_numbers(visitor, elastic, viscous, worst_tet, rates_age, rates_hold, warm, rounds_ahead);
}

/// A lumen's inscribed spheres travel as what its next update takes over (LumenState::kept): visit_lumen(body) is theirs.
template <class Visitor, class Body, class Lumen>
void visit_body(Visitor& visitor, Body& body, Lumen&& visit_lumen) {
    auto& [tissue, surface, surface_deferred, frames, flow_frames, stable, lumen, lumen_step, contact_work] = body; // evaluated: it does not wait
    auto& [position, velocity, relaxed] = tissue;
    visit_points(visitor, position), visit_points(visitor, velocity), visit_points(visitor, surface);
    visitor.list(relaxed, [&](auto& strain) { visitor.number(strain); });
    visit_frames(visitor, frames), visit_frames(visitor, flow_frames);
    visit_stable_step(visitor, stable.memory());
    visitor.number(contact_work);
    visit_lumen(body);
}

template <class Visitor, class Follow>
void visit_follow(Visitor& visitor, Follow& follow) {
    auto& [mode, progress, best_progress, best_insertion, astray_insertion, fork, retract_from, turned_for, missing, attempts] = follow;
    visit_numbers(visitor, mode, progress, best_progress, best_insertion, astray_insertion, fork, retract_from, turned_for, missing, attempts);
}

template <class Visitor, class Plane>
void visit_plane(Visitor& visitor, Plane& plane) {
    auto& [node, weight, normal, offset, force, wall_velocity, drag, friction_share, start_force, start_drag, side, give, felt, other, other_weight] =
        plane;
    visit_numbers(visitor, node, weight, offset, force, friction_share, start_force, side, give, other, other_weight);
    visitor.vector(normal), visitor.vector(wall_velocity), visitor.vector(drag), visitor.vector(start_drag), visitor.vector(felt);
}

template <class Visitor, class Instrument>
void visit_instrument(Visitor& visitor, Instrument& instrument) {
    auto& [rod, skin, follow, drive_stopped, kept_inside, route, route_frames, chain, planes, presses, self_planes, exact_candidates] =
        instrument;
    auto& [position, velocity, insertion, rotation, angle, spin, root] = rod;
    visit_points(visitor, position), visit_points(visitor, velocity), visit_points(visitor, skin);
    visit_numbers(visitor, insertion, rotation);
    visitor.vector(root);
    for (auto* values : {&angle, &spin}) visitor.list(*values, [&](auto& value) { visitor.number(value); });
    visit_follow(visitor, follow);
    visit_numbers(visitor, drive_stopped, kept_inside, exact_candidates);
    visit_points(visitor, route.points); // radii and lengths are the model's
    visit_frames(visitor, route_frames);
    visitor.list(chain.hint, [&](auto& leaf) { visitor.number(leaf); });
    for (auto* list : {&planes, &self_planes})
        visitor.list(*list, [&](auto& plane) { visit_plane(visitor, plane); });
    visitor.list(presses, [&](auto& press) {
        auto& [triangle, bary, give] = press;
        visitor.number(triangle);
        for (auto& b : bary) visitor.number(b);
        visitor.number(give);
    });
}

template <class Visitor, class ContactT>
void visit_contact(Visitor& visitor, ContactT& contact) {
    auto& [a, b, origin, point, normal, gap, time, feature_a, feature_b, bary_a, bary_b, force] = contact;
    visit_numbers(visitor, a, b, origin, gap, time);
    visitor.vector(point), visitor.vector(normal), visitor.vector(force);
    for (auto& index : feature_a) visitor.number(index);
    for (auto& index : feature_b) visitor.number(index);
    for (auto& weight : bary_a) visitor.number(weight);
    for (auto& weight : bary_b) visitor.number(weight);
}

template <class Visitor, class Solids>
void visit_solids(Visitor& visitor, Solids& solids) {
    auto& [touching, entries, contacts] = solids;
    visitor.list(touching, [&](auto& pair) {
        auto& [a, b, leaf_a, leaf_b, gap] = pair;
        visit_numbers(visitor, a, b, leaf_a, leaf_b, gap);
    });
    visitor.list(entries, [&](auto& entry) {
        auto& [own, other, vertex, by, depth] = entry;
        visit_numbers(visitor, own, other, vertex, by, depth);
    });
    visitor.list(contacts, [&](auto& place) {
        auto& [touch, recovery, warm, room] = place;
        visit_contact(visitor, touch);
        visitor.number(recovery), visitor.vector(warm), visitor.number(room);
    });
}

template <class Visitor, class StateT, class Lumen>
void visit_state(Visitor& visitor, StateT& state, Lumen&& visit_lumen) {
    auto& [step, time, bodies, instruments, solids, meetings, effects] = state;
    visit_numbers(visitor, step, time);
    for (auto& body : bodies) visit_body(visitor, body, visit_lumen);
    for (auto& instrument : instruments) visit_instrument(visitor, instrument);
    visit_solids(visitor, solids);
    visitor.list(meetings, [&](auto& meeting) {
        auto& [plane, rod, other_rod, play, along, beside] = meeting;
        visit_plane(visitor, plane);
        visit_numbers(visitor, rod, other_rod, play);
        visitor.vector(along), visitor.vector(beside);
    });
    for (auto& memory : effects) visitor.list(memory, [&](auto& value) { visitor.number(value); });
}

} // namespace trocar::engine
