// Nothing of a State is left out of its bytes: whatever single bit of a member changes, the bytes change.
#include "engine/state/bit_hash.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/state/visit_state.hpp"
#include "step_fixture.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <functional>

namespace trocar::engine {
namespace {

std::string bytes_of(const State& state) {
    std::string bytes;
    append_state(state, bytes);
    return bytes;
}

/// A state with one of everything that lists hold, of no model in particular.
State one_of_each() {
    State state;
    BodyState& body = state.bodies.emplace_back();
    body.tissue.position = body.tissue.velocity = body.surface = {Vec3(1, 2, 3)};
    body.frames.frame.resize(1);
    body.flow_frames.frame.resize(1);
    body.stable.mode = body.stable.damping_mode = {Vec3(4, 5, 6)};
    body.stable.notes.resize(1);
    InstrumentState& instrument = state.instruments.emplace_back();
    instrument.rod.position = instrument.rod.velocity = instrument.skin = instrument.route.points = {Vec3(7, 8, 9)};
    instrument.rod.angle = instrument.rod.spin = {0.5};
    instrument.route_frames.frame.resize(1);
    instrument.chain.hint = {3};
    instrument.planes.resize(1);
    instrument.self_planes.resize(1);
    instrument.presses.resize(1);
    state.meetings.resize(1);
    state.solids.touching.resize(1);
    state.solids.entries.resize(1);
    state.solids.contacts.resize(1);
    return state;
}

/// Flips the lowest bit of every byte of a plain struct in the state; counts bytes of which none is seen: padding, and no more.
template <class T>
void expect_every_byte(T& (*place)(State&), std::size_t member_bytes, const char* what) {
    State state = one_of_each();
    T& value = place(state);
    const std::string before = bytes_of(state);
    std::size_t seen = 0;
    for (std::size_t k = 0; k < sizeof(T); ++k) {
        auto* byte = reinterpret_cast<unsigned char*>(&value) + k;
        *byte ^= 1U;
        seen += bytes_of(state) != before;
        *byte ^= 1U;
    }
    EXPECT_EQ(seen, member_bytes) << what;
}
template <class... Members>
constexpr std::size_t sum_of_sizes(const Members&...) {
    return (sizeof(Members) + ...);
}

// A bool's other bits are no values, but its byte's lowest is: one byte each, as sizeof says.
TEST(StateBytes, EveryByteOfThePlainStructsChangesThem) {
    State state = one_of_each();
    {
        const auto& [a, b, c, d, e] = state.solids.touching[0];
        expect_every_byte<LeafPair>([](State& s) -> LeafPair& { return s.solids.touching[0]; }, sum_of_sizes(a, b, c, d, e), "LeafPair");
    }
    {
        const auto& [a, b, c, d, e] = state.solids.entries[0];
        expect_every_byte<SolidEntry>([](State& s) -> SolidEntry& { return s.solids.entries[0]; }, sum_of_sizes(a, b, c, d, e), "SolidEntry");
    }
    {
        const auto& [touch, b, c, p] = state.solids.contacts[0];
        const auto& [d, e, f, g, h, i, j, k, l, m, n, o] = touch;
        expect_every_byte<SolidContact>([](State& s) -> SolidContact& { return s.solids.contacts[0]; },
                                        sum_of_sizes(b, c, p, d, e, f, g, h, i, j, k, l, m, n, o), "SolidContact");
    }
    {
        const auto& [a, b, c] = state.instruments[0].presses[0];
        expect_every_byte<WallPress>([](State& s) -> WallPress& { return s.instruments[0].presses[0]; }, sum_of_sizes(a, b, c), "WallPress");
    }
    {
        const auto& [a, b, c, d, e, f, g, h, i, j, k, l, m, n, o] = state.instruments[0].planes[0];
        const std::size_t size = sum_of_sizes(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o);
        expect_every_byte<fem::RodPlane>([](State& s) -> fem::RodPlane& { return s.instruments[0].planes[0]; }, size, "RodPlane");
        expect_every_byte<fem::RodPlane>([](State& s) -> fem::RodPlane& { return s.instruments[0].self_planes[0]; }, size, "RodPlane of the rod");
        const auto& [plane, rod, other_rod, play, along, beside] = state.meetings[0];
        (void)plane;
        expect_every_byte<fem::RodMeeting>([](State& s) -> fem::RodMeeting& { return s.meetings[0]; }, size + sum_of_sizes(rod, other_rod, play, along, beside), "RodMeeting");
    }
    {
        const auto& [a, b, c, d, e, f, g, h, i, j] = state.instruments[0].follow;
        expect_every_byte<FollowState>([](State& s) -> FollowState& { return s.instruments[0].follow; },
                                       sum_of_sizes(a, b, c, d, e, f, g, h, i, j), "FollowState");
    }
}

TEST(StateBytes, EveryOtherMemberChangesThem) {
    const std::string before = bytes_of(one_of_each());
    const std::pair<const char*, std::function<void(State&)>> edits[] = {
        {"step", [](State& s) { ++s.step; }},
        {"time", [](State& s) { s.time += 1.0; }},
        {"position", [](State& s) { s.bodies[0].tissue.position[0].x() += 1.0; }},
        {"velocity", [](State& s) { s.bodies[0].tissue.velocity[0].y() += 1.0; }},
        {"surface", [](State& s) { s.bodies[0].surface[0].z() += 1.0; }},
        {"frames", [](State& s) { s.bodies[0].frames.frame[0].turn[2][1] += 1.0; }},
        {"frames' displacement", [](State& s) { s.bodies[0].frames.frame[0].displacement[1][0] += 1.0; }},
        {"flow_frames", [](State& s) { s.bodies[0].flow_frames.frame[0].turn[0][2] += 1.0; }},
        {"stable.mode", [](State& s) { s.bodies[0].stable.mode[0].x() += 1.0; }},
        {"stable.damping_mode", [](State& s) { s.bodies[0].stable.damping_mode[0].x() += 1.0; }},
        {"stable.notes", [](State& s) { s.bodies[0].stable.notes[0].per_tangent[0] += 1.0F; }},
        {"stable.notes' size", [](State& s) { s.bodies[0].stable.notes[0].per_size[0] += 1.0F; }},
        {"stable.rates.elastic", [](State& s) { s.bodies[0].stable.rates.elastic += 1.0; }},
        {"stable.rates.viscous", [](State& s) { s.bodies[0].stable.rates.viscous += 1.0; }},
        {"stable.rates.worst_tet", [](State& s) { s.bodies[0].stable.rates.worst_tet = 5; }},
        {"stable.rates_age", [](State& s) { ++s.bodies[0].stable.rates_age; }},
        {"stable.rates_hold", [](State& s) { s.bodies[0].stable.rates_hold = !s.bodies[0].stable.rates_hold; }},
        {"stable.warm", [](State& s) { s.bodies[0].stable.warm = !s.bodies[0].stable.warm; }},
        {"stable.rounds_ahead", [](State& s) { ++s.bodies[0].stable.rounds_ahead; }},
        {"rod.position", [](State& s) { s.instruments[0].rod.position[0].x() += 1.0; }},
        {"rod.velocity", [](State& s) { s.instruments[0].rod.velocity[0].x() += 1.0; }},
        {"rod.insertion", [](State& s) { s.instruments[0].rod.insertion += 1.0; }},
        {"rod.rotation", [](State& s) { s.instruments[0].rod.rotation += 1.0; }},
        {"rod.angle", [](State& s) { s.instruments[0].rod.angle[0] += 1.0; }},
        {"rod.spin", [](State& s) { s.instruments[0].rod.spin[0] += 1.0; }},
        {"skin", [](State& s) { s.instruments[0].skin[0].x() += 1.0; }},
        {"drive_stopped", [](State& s) { s.instruments[0].drive_stopped = true; }},
        {"kept_inside", [](State& s) { s.instruments[0].kept_inside = true; }},
        {"route", [](State& s) { s.instruments[0].route.points[0].x() += 1.0; }},
        {"route_frames", [](State& s) { s.instruments[0].route_frames.frame[0].turn[1][1] += 1.0; }},
        {"chain.hint", [](State& s) { ++s.instruments[0].chain.hint[0]; }},
        {"exact_candidates", [](State& s) { ++s.instruments[0].exact_candidates; }},
        {"contact_work", [](State& s) { s.bodies[0].contact_work += 1.0; }},
        {"a plane", [](State& s) { s.instruments[0].planes.pop_back(); }},
        {"a meeting", [](State& s) { s.meetings.pop_back(); }},
        {"a plane of the rod itself", [](State& s) { s.instruments[0].self_planes.pop_back(); }},
    };
    for (const auto& [what, edit] : edits) {
        State state = one_of_each();
        edit(state);
        EXPECT_NE(bytes_of(state), before) << what;
    }
}

} // namespace
} // namespace trocar::engine
