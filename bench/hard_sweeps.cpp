// Elementary continuous tests where they are hard: contacts that touch at a corner, slide in a plane, start in contact, of faces
// without area; in every order, direction of time, scale and place.
#include "bench/hard_bodies.hpp"
#include "bench/hard_cases.hpp"

#include "collision/ccd/ccd.hpp"
#include "collision/ccd/sweep.hpp"

#include <array>
#include <utility>

namespace trocar::engine {

using collision::SweptPoint;

namespace {

struct Pair {
    bool vertex_face = true; // p[0] against p[1..3]; otherwise p[0..1] against p[2..3]
    std::array<SweptPoint, 4> p;

    [[nodiscard]] bool meets() const {
        return vertex_face ? collision::ccd_vertex_face(p[0], {p[1], p[2], p[3]}).meets
                           : collision::ccd_edge_edge({p[0], p[1]}, {p[2], p[3]}).meets;
    }
    [[nodiscard]] collision::Sweep sweep(const collision::SweepLimits& limits) const {
        return vertex_face ? collision::sweep_vertex_face(p[0], {p[1], p[2], p[3]}, limits)
                           : collision::sweep_edge_edge({p[0], p[1]}, {p[2], p[3]}, limits);
    }
    [[nodiscard]] Pair reordered(const std::array<std::size_t, 4>& order) const {
        return {vertex_face, {p[order[0]], p[order[1]], p[order[2]], p[order[3]]}};
    }
    template <class Map>
    [[nodiscard]] Pair mapped(Map&& map) const {
        Pair other = *this;
        for (SweptPoint& q : other.p) q = {map(q.t0), map(q.t1)};
        return other;
    }
    [[nodiscard]] Pair reversed() const {
        Pair other = *this;
        for (SweptPoint& q : other.p) std::swap(q.t0, q.t1);
        return other;
    }
    /// Six orders of a triangle's corners; both directions of both edges and the edges swapped.
    [[nodiscard]] std::vector<std::array<std::size_t, 4>> orders() const {
        if (vertex_face) return {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {0, 1, 3, 2}, {0, 3, 2, 1}, {0, 2, 1, 3}};
        return {{0, 1, 2, 3}, {1, 0, 2, 3}, {0, 1, 3, 2}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 0, 1}, {2, 3, 1, 0}, {3, 2, 1, 0}};
    }
};

using Points = std::array<std::array<double, 3>, 4>;

/// Small integers: these contacts are exact.
Pair whole(bool vertex_face, const Points& t0, const Points& t1) {
    Pair pair{vertex_face, {}};
    for (std::size_t i = 0; i < 4; ++i) pair.p[i] = {Vec3(t0[i].data()), Vec3(t1[i].data())};
    return pair;
}

Pair against_face(const std::array<double, 3>& from, const std::array<double, 3>& to) {
    return whole(true, {from, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}}, {to, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}});
}

std::vector<std::pair<std::string, Pair>> known_contacts() {
    return {
        {"resting in the face, zero motion", against_face({1, 1, 0}, {1, 1, 0})},
        {"resting on a corner, zero motion", against_face({4, 0, 0}, {4, 0, 0})},
        {"vertex through a vertex", against_face({0, 0, 2}, {0, 0, -2})},
        {"vertex through an edge", against_face({2, 2, 2}, {2, 2, -2})},
        {"ends in the face", against_face({1, 1, 3}, {1, 1, 0})},
        {"starts in the face and leaves", against_face({1, 1, 0}, {1, 1, 3})},
        {"coplanar, slides into the face", against_face({-4, 1, 0}, {4, 1, 0})},
        {"coplanar, slides along an edge", against_face({-4, 0, 0}, {8, 0, 0})},
        {"coplanar, grazes an edge", against_face({-2, 6, 0}, {6, -2, 0})},
        {"face is a segment", whole(true, {{{1, 0, 2}, {0, 0, 0}, {4, 0, 0}, {2, 0, 0}}}, {{{1, 0, -2}, {0, 0, 0}, {4, 0, 0}, {2, 0, 0}}})},
        {"face is a point", whole(true, {{{0, 0, 2}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}, {{{0, 0, -2}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}})},
        {"motion of ten thousand edge lengths", against_face({1, 1, 40000}, {1, 1, -40000})},
        {"edges cross", whole(false, {{{-2, 0, 2}, {2, 0, 2}, {0, -2, 0}, {0, 2, 0}}}, {{{-2, 0, -2}, {2, 0, -2}, {0, -2, 0}, {0, 2, 0}}})},
        {"edges touch at their ends",
         whole(false, {{{0, 0, 2}, {2, 0, 2}, {0, 0, 0}, {0, 2, 0}}}, {{{0, 0, 0}, {2, 0, 0}, {0, 0, 0}, {0, 2, 0}}})},
        {"parallel edges meet",
         whole(false, {{{0, 0, 2}, {4, 0, 2}, {2, 0, 0}, {6, 0, 0}}}, {{{0, 0, -2}, {4, 0, -2}, {2, 0, 0}, {6, 0, 0}}})},
        {"collinear edges run into each other",
         whole(false, {{{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {6, 0, 0}}}, {{{4, 0, 0}, {6, 0, 0}, {4, 0, 0}, {6, 0, 0}}})},
        {"parallel edges slide along each other",
         whole(false, {{{0, 0, 0}, {4, 0, 0}, {4, 0, 0}, {8, 0, 0}}}, {{{2, 0, 0}, {6, 0, 0}, {4, 0, 0}, {8, 0, 0}}})},
        {"coplanar edges sweep across",
         whole(false, {{{-2, 0, 0}, {-2, 4, 0}, {0, 1, 0}, {4, 1, 0}}}, {{{2, 0, 0}, {2, 4, 0}, {0, 1, 0}, {4, 1, 0}}})},
        {"duplicate edges at rest",
         whole(false, {{{0, 0, 0}, {4, 0, 0}, {0, 0, 0}, {4, 0, 0}}}, {{{0, 0, 0}, {4, 0, 0}, {0, 0, 0}, {4, 0, 0}}})},
        {"both edges are points",
         whole(false, {{{0, 0, 2}, {0, 0, 2}, {0, 0, 0}, {0, 0, 0}}}, {{{0, 0, -2}, {0, 0, -2}, {0, 0, 0}, {0, 0, 0}}})},
    };
}

/// Pairs that come near and do not touch, as exactly known.
std::vector<std::pair<std::string, Pair>> known_misses() {
    return {
        {"parallel to the face above it", against_face({-9, 1, 1}, {9, 1, 1})},
        {"coplanar, passes beside the face", against_face({-1, 6, 0}, {6, -1 + 0x1p-20, 0})},
        {"stops above the face", against_face({1, 1, 40000}, {1, 1, 0x1p-10})},
        {"parallel edges pass beside each other",
         whole(false, {{{0, 1, 2}, {4, 1, 2}, {2, 0, 0}, {6, 0, 0}}}, {{{0, 1, -2}, {4, 1, -2}, {2, 0, 0}, {6, 0, 0}}})},
    };
}

/// Every way to write the same question: orders, direction of time, scales of 1e-9 to 1e6, the origin and 1e4 body sizes away.
template <class See>
void for_each_writing(const Pair& pair, See&& see) {
    for (const auto& order : pair.orders())
        for (const double scale : {1.0, 0x1p-30, 0x1p20})
            for (const double away : {0.0, 0x1p15}) // integer multiples of the scale: still exact
                for (const bool backwards : {false, true}) {
                    const Pair shown =
                        pair.reordered(order).mapped([&](const Vec3& x) { return Vec3(scale * (x + away * Vec3(1.0, -2.0, 1.0))); });
                    see(backwards ? shown.reversed() : shown);
                }
}

void known_answers(HardReport& report) {
    for (const auto& [name, pair] : known_contacts()) {
        int missed = 0, let_by = 0;
        for_each_writing(pair, [&](const Pair& shown) {
            missed += !shown.meets();
            let_by += !shown.sweep({}).hit();
        });
        report.equal(name + ": variants that the exact test misses", missed, 0);
        report.equal(name + ": variants that the conservative test misses", let_by, 0);
    }
    for (const auto& [name, pair] : known_misses()) {
        int invented = 0;
        for_each_writing(pair, [&](const Pair& shown) { invented += shown.meets(); });
        report.equal(name + ": variants with a false contact by the exact test", invented, 0);
    }
}

Pair random_pair(std::mt19937_64& random, bool integers_only) {
    Pair pair{(random() & 1) != 0, {}};
    const auto at = [&] {
        if (!integers_only) return random_vec(random, 1.0);
        const auto number = [&] { return static_cast<double>(random() % 5); };
        const double x = number(), y = number(), z = number();
        return Vec3(x, y, z);
    };
    for (SweptPoint& q : pair.p) {
        q.t0 = at();
        q.t1 = at();
    }
    return pair;
}

void same_answer_however_it_is_written(HardReport& report) {
    std::mt19937_64 random(31);
    int differing = 0, colliding = 0;
    constexpr int kPairs = 1500;
    for (int k = 0; k < kPairs; ++k) {
        const Pair pair = random_pair(random, true); // on a grid of five: most touch at a corner, in a plane, or begin in contact
        const bool answer = pair.meets();
        colliding += answer;
        for_each_writing(pair, [&](const Pair& shown) { differing += shown.meets() != answer; });
    }
    report.note(fmt::format("{} of {} pairs collide", colliding, kPairs));
    report.equal("pairs on a grid of five: answers that differ between variants", differing, 0);
}

/// A vertex flies at a face (or an edge at an edge) through its middle, from near to 1e9 edge lengths in a step.
void tunnelling_at_rising_speed(HardReport& report) {
    std::mt19937_64 random(5);
    for (const double way : {1.0, 1e2, 1e4, 1e6, 1e9}) {
        int missed = 0, missed_exactly = 0, unresolved = 0;
        constexpr int kTrials = 2000;
        for (int k = 0; k < kTrials; ++k) {
            Pair pair = random_pair(random, false);
            const Vec3 flight = way * random_vec(random, 1.0);
            const auto middle = [&](std::size_t i) { return Vec3(0.5 * (pair.p[i].t0 + pair.p[i].t1)); };
            const Vec3 on_a = pair.vertex_face ? middle(0) : Vec3(0.5 * (middle(0) + middle(1)));
            const Vec3 on_b = pair.vertex_face ? Vec3((middle(1) + middle(2) + middle(3)) / 3.0) : Vec3(0.5 * (middle(2) + middle(3)));
            for (std::size_t i = 0; i < (pair.vertex_face ? 1u : 2u); ++i)
                pair.p[i] = {pair.p[i].t0 + on_b - on_a - flight, pair.p[i].t1 + on_b - on_a + flight};
            const collision::Sweep swept = pair.sweep({});
            missed += !swept.hit();
            unresolved += swept.outcome == collision::SweepOutcome::Unresolved;
            missed_exactly += !pair.meets();
        }
        report.equal(fmt::format("motion of about {:g} edge lengths: crossings missed by the conservative test", way), missed, 0);
        // Far off rounding has moved the crossing itself, by 1e-16 of the way: the exact test decides a different input.
        if (way <= 1e6) report.equal(fmt::format("motion of about {:g} edge lengths: by the exact test", way), missed_exactly, 0);
        report.below(fmt::format("motion of about {:g} edge lengths: share left unresolved, treated as hits", way),
                     unresolved / static_cast<double>(kTrials), 0.01);
    }
}

constexpr HardCase kSweepsCases[] = {
    {"sweeps", "KnownContactsAndMissesInEveryOrderPlaceScaleAndDirectionOfTime",
     "exactly the known answer in all variants: six vertex orders, both edge orders, bodies swapped, time reversed, scales 2^-30 to 2^20, "
     "3e4 sizes away",
     known_answers},
    {"sweeps", "TheAnswerIsTheSameHoweverThePairIsWritten", "no answer differs: they are exact", same_answer_however_it_is_written},
    {"sweeps", "NoSpeedTunnelsThroughAnElementaryTest", "no crossing missed at any speed; fewer than 1 % left unresolved",
     tunnelling_at_rising_speed},
};

} // namespace

std::span<const HardCase> hard_sweeps() noexcept { return kSweepsCases; }

} // namespace trocar::engine
