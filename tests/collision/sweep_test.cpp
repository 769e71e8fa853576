#include "collision/ccd/sweep.hpp"

#include "base/closest_point.hpp"
#include "collision/ccd/sweep_batch.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::collision {
namespace {

using testing::Random;

/// Four moving points: vertex and face, or edge and edge.
struct Pair {
    bool vertex_face;
    std::array<SweptPoint, 4> p;

    Sweep sweep(const SweepLimits& limits) const {
        if (vertex_face) return sweep_vertex_face(p[0], {p[1], p[2], p[3]}, limits);
        return sweep_edge_edge({p[0], p[1]}, {p[2], p[3]}, limits);
    }
    double distance(double t) const {
        std::array<Vec3, 4> x;
        for (int i = 0; i < 4; ++i) x[i] = (1.0 - t) * p[i].t0 + t * p[i].t1;
        if (vertex_face) return std::sqrt(closest_on_triangle(x[0], x[1], x[2], x[3]).distance_sq);
        return std::sqrt(closest_on_segments({x[0], x[1]}, {x[2], x[3]}).distance_sq);
    }
    double fastest() const {
        double speed = 0.0;
        for (const SweptPoint& a : p)
            for (const SweptPoint& b : p) speed = std::max(speed, ((a.t1 - a.t0) - (b.t1 - b.t0)).norm());
        return speed;
    }
    Pair mapped(const auto& map) const {
        Pair out = *this;
        for (SweptPoint& q : out.p) q = {map(q.t0), map(q.t1)};
        return out;
    }
    Pair reversed() const {
        Pair out = *this;
        for (SweptPoint& q : out.p) std::swap(q.t0, q.t1);
        return out;
    }
    Pair reordered(std::array<int, 4> order) const {
        Pair out = *this;
        for (int i = 0; i < 4; ++i) out.p[i] = p[order[i]];
        return out;
    }
    std::vector<std::array<int, 4>> orders() const {
        if (vertex_face) return {{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {0, 2, 1, 3}, {0, 1, 3, 2}, {0, 3, 2, 1}};
        return {{0, 1, 2, 3}, {1, 0, 2, 3}, {0, 1, 3, 2}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 0, 1}, {2, 3, 1, 0}, {3, 2, 1, 0}};
    }
};

Pair random_pair(Random& random, double reach, double motion) {
    Pair pair{random.real(0.0, 1.0) < 0.5, {}};
    for (SweptPoint& q : pair.p) {
        q.t0 = random.vector(reach);
        q.t1 = q.t0 + random.vector(motion);
    }
    return pair;
}

/// A pair that meets at time 1/2 with the given weights, crossing there; exact up to the rounding of the construction.
Pair crossing_pair(Random& random, bool vertex_face, double w1, double w2) {
    Pair pair = random_pair(random, 1.0, 1.0);
    pair.vertex_face = vertex_face;
    const auto middle = [&pair](int i) { return Vec3(0.5 * (pair.p[i].t0 + pair.p[i].t1)); };
    const Vec3 on_a = vertex_face ? middle(0) : Vec3((1.0 - w1) * middle(0) + w1 * middle(1));
    const Vec3 on_b =
        vertex_face ? Vec3((1.0 - w1 - w2) * middle(1) + w1 * middle(2) + w2 * middle(3)) : Vec3((1.0 - w2) * middle(2) + w2 * middle(3));
    for (int i = 0; i < (vertex_face ? 1 : 2); ++i) pair.p[i] = {pair.p[i].t0 + on_b - on_a, pair.p[i].t1 + on_b - on_a};
    return pair;
}

TEST(Sweep, AgreesWithDenseSampling) {
    constexpr std::uint64_t kSeed = 20;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    int hits = 0, apart = 0, undecided = 0;
    for (int trial = 0; trial < 8000; ++trial) {
        const Pair pair = random_pair(random, 1.0, random.real(0.0, 2.0));
        const SweepLimits limits{.distance = random.real(0.0, 0.3), .tolerance = 1e-3};
        const Sweep sweep = pair.sweep(limits);
        EXPECT_NE(sweep.outcome, SweepOutcome::Unresolved);
        constexpr int kSamples = 200;
        double smallest = 1e300;
        for (int k = 0; k <= kSamples; ++k) {
            const double t = static_cast<double>(k) / kSamples, d = pair.distance(t);
            smallest = std::min(smallest, d);
            if (t < sweep.time) {
                EXPECT_GT(d, limits.distance * (1.0 - 1e-12)) << trial;
            }
            if (t <= sweep.safe_time && sweep.hit()) {
                EXPECT_GE(d, kKeptGap * std::min(sweep.gap, limits.distance) * (1.0 - 1e-9)) << trial;
            }
        }
        if (smallest <= limits.distance) {
            ++hits;
            EXPECT_TRUE(sweep.hit()) << trial;
        } else if (smallest - pair.fastest() / kSamples > limits.distance + limits.tolerance) {
            ++apart;
            EXPECT_FALSE(sweep.hit()) << trial;
        } else {
            ++undecided;
        }
        if (sweep.hit()) {
            EXPECT_NEAR(sweep.gap, pair.distance(sweep.time), 1e-9) << trial;
            EXPECT_LE(sweep.gap, limits.distance + limits.tolerance + 1e-12) << trial;
            EXPECT_NEAR(sweep.normal.norm(), 1.0, 1e-12) << trial;
        }
    }
    EXPECT_GT(hits, 1200);
    EXPECT_GT(apart, 1200);
    EXPECT_LT(undecided, 1200);
}

TEST(Sweep, FindsEveryCrossingAtEveryScaleAndFarFromTheOrigin) {
    constexpr std::uint64_t kSeed = 21;
    Random random(kSeed);
    int unresolved = 0;
    for (int trial = 0; trial < 40000; ++trial) {
        const bool vertex_face = trial % 2 == 0;
        const double w1 = random.real(0.05, 0.45), w2 = random.real(0.05, 0.45);
        const double scale = std::pow(10.0, random.real(-9.0, 6.0));
        const Vec3 far = trial % 3 == 0 ? Vec3(random.vector(1e4 * scale)) : Vec3::Zero();
        const Pair pair = crossing_pair(random, vertex_face, w1, w2).mapped([&](const Vec3& x) { return Vec3(scale * x + far); });
        const Sweep sweep = pair.sweep({});
        EXPECT_TRUE(sweep.hit()) << "seed " << kSeed << " trial " << trial;
        EXPECT_LE(sweep.time, 0.5 + 1e-6) << "seed " << kSeed << " trial " << trial;
        unresolved += sweep.outcome == SweepOutcome::Unresolved;
    }
    std::printf("%d of 40000 crossings unresolved\n", unresolved);
    EXPECT_LT(unresolved, 400);
}

/// Features that are to touch are aimed at where they will lie in one plane: without that all of these, which turn as much as they move,
/// take more than six advances, and half of them more than twelve.
TEST(Sweep, ReachesATouchInFewAdvances) {
    constexpr std::uint64_t kSeed = 27;
    Random random(kSeed);
    int beyond_six = 0, beyond_twelve = 0;
    for (int trial = 0; trial < 20000; ++trial) {
        const Pair pair = crossing_pair(random, trial % 2 == 0, random.real(0.05, 0.45), random.real(0.05, 0.45));
        beyond_six += pair.sweep({.max_steps = 6}).outcome == SweepOutcome::Unresolved;
        beyond_twelve += pair.sweep({.max_steps = 12}).outcome == SweepOutcome::Unresolved;
    }
    std::printf("of 20000 crossings %d take more than 6 advances, %d more than 12\n", beyond_six, beyond_twelve);
    EXPECT_LT(beyond_six, 4000);
    EXPECT_LT(beyond_twelve, 1000);
}

/// Small integers: these contacts are exact.
Pair whole(bool vertex_face, std::array<std::array<double, 3>, 4> t0, std::array<std::array<double, 3>, 4> t1) {
    Pair pair{vertex_face, {}};
    for (int i = 0; i < 4; ++i) pair.p[i] = {Vec3(t0[i].data()), Vec3(t1[i].data())};
    return pair;
}

TEST(Sweep, FindsDegenerateContactsInEveryOrderScaleAndDirectionOfTime) {
    const std::array<std::array<double, 3>, 3> face{{{0, 0, 0}, {4, 0, 0}, {0, 4, 0}}};
    const auto against_face = [&](std::array<double, 3> from, std::array<double, 3> to) {
        return whole(true, {from, face[0], face[1], face[2]}, {to, face[0], face[1], face[2]});
    };
    const std::vector<std::pair<const char*, Pair>> cases = {
        {"resting in the face", against_face({1, 1, 0}, {1, 1, 0})},
        {"resting on a corner", against_face({4, 0, 0}, {4, 0, 0})},
        {"through a corner", against_face({0, 0, 2}, {0, 0, -2})},
        {"through an edge", against_face({2, 2, 2}, {2, 2, -2})},
        {"ends in the face", against_face({1, 1, 3}, {1, 1, 0})},
        {"starts in the face and leaves", against_face({1, 1, 0}, {1, 1, 3})},
        {"slides in the plane, into the face", against_face({-4, 1, 0}, {4, 1, 0})},
        {"slides in the plane, through a corner", against_face({-4, 0, 0}, {8, 0, 0})},
        {"grazes an edge in the plane", against_face({-2, 6, 0}, {6, -2, 0})},
        {"parabola tangent to the face: both move",
         whole(true, {{{1, 1, 1}, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}}}, {{{1, 1, 1}, {0, 0, 2}, {4, 0, 2}, {0, 4, 2}}})},
        {"face is a segment", whole(true, {{{1, 0, 2}, {0, 0, 0}, {4, 0, 0}, {2, 0, 0}}}, {{{1, 0, -2}, {0, 0, 0}, {4, 0, 0}, {2, 0, 0}}})},
        {"face is a point", whole(true, {{{0, 0, 2}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}, {{{0, 0, -2}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}})},
        {"face opens from a point over the vertex",
         whole(true, {{{1, 1, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}}}, {{{1, 1, 0}, {0, 0, 0}, {4, 0, 0}, {0, 4, 0}}})},
        {"motion of ten thousand edges", against_face({1, 1, 40000}, {1, 1, -40000})},
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
        {"both edges are points",
         whole(false, {{{0, 0, 2}, {0, 0, 2}, {0, 0, 0}, {0, 0, 0}}}, {{{0, 0, -2}, {0, 0, -2}, {0, 0, 0}, {0, 0, 0}}})},
        {"nothing moves, edges cross",
         whole(false, {{{-2, 0, 0}, {2, 0, 0}, {0, -2, 0}, {0, 2, 0}}}, {{{-2, 0, 0}, {2, 0, 0}, {0, -2, 0}, {0, 2, 0}}})},
    };
    for (const auto& [name, pair] : cases) {
        const bool expected = std::string_view(name).substr(0, 8) != "parabola";
        for (const auto& order : pair.orders())
            for (const double scale : {1.0, 0x1p-30, 0x1p20})
                for (const bool backwards : {false, true}) {
                    const Pair shown = pair.reordered(order).mapped([&](const Vec3& x) { return Vec3(scale * x); });
                    const Sweep sweep = (backwards ? shown.reversed() : shown).sweep({});
                    EXPECT_TRUE(sweep.hit() || !expected) << name << " scale " << scale << " backwards " << backwards;
                    EXPECT_TRUE(sweep.normal.allFinite()) << name;
                    EXPECT_GE(sweep.time, 0.0);
                    EXPECT_LE(sweep.time, 1.0);
                }
    }
}

TEST(Sweep, AnswersTheSameForEveryOrderAndScaleOfTwo) {
    constexpr std::uint64_t kSeed = 22;
    Random random(kSeed);
    for (int trial = 0; trial < 5000; ++trial) {
        const Pair pair = random_pair(random, 1.0, 1.0);
        const SweepLimits limits{.distance = 0.05, .tolerance = 0.0};
        const Sweep sweep = pair.sweep(limits);
        for (const auto& order : pair.orders()) {
            const Sweep other = pair.reordered(order).sweep(limits);
            EXPECT_EQ(sweep.hit(), other.hit()) << "seed " << kSeed << " trial " << trial;
            EXPECT_NEAR(sweep.time, other.time, 1e-6) << "seed " << kSeed << " trial " << trial;
        }
        const Sweep backwards = pair.reversed().sweep(limits);
        EXPECT_EQ(sweep.hit(), backwards.hit()) << "seed " << kSeed << " trial " << trial;
        const double scale = 0x1p-17;
        const Sweep scaled = pair.mapped([&](const Vec3& x) { return Vec3(scale * x); }).sweep({.distance = 0.05 * scale});
        EXPECT_EQ(sweep.outcome, scaled.outcome) << "seed " << kSeed << " trial " << trial;
        EXPECT_EQ(sweep.time, scaled.time) << "seed " << kSeed << " trial " << trial;
    }
}

TEST(Sweep, StartingWithinTheDistanceMayLeaveButNotPass) {
    const auto above = [](double from, double to) {
        return sweep_vertex_face({{0.2, 0.2, from}, {0.2, 0.2, to}},
                                 {{{Vec3(0, 0, 0), Vec3(0, 0, 0)}, {Vec3(1, 0, 0), Vec3(1, 0, 0)}, {Vec3(0, 1, 0), Vec3(0, 1, 0)}}},
                                 {.distance = 0.1});
    };
    const Sweep leaving = above(0.05, 0.5);
    EXPECT_EQ(leaving.outcome, SweepOutcome::StartsTouching);
    EXPECT_EQ(leaving.safe_time, 1.0);
    const Sweep resting = above(0.05, 0.05);
    EXPECT_EQ(resting.safe_time, 1.0);
    const Sweep passing = above(0.05, -0.05);
    EXPECT_GT(passing.safe_time, 0.4);
    EXPECT_LT(passing.safe_time, 0.5);
    const Sweep arriving = above(1.0, -1.0);
    EXPECT_EQ(arriving.outcome, SweepOutcome::Hit);
    EXPECT_NEAR(arriving.time, 0.45, 1e-12);
    EXPECT_GT(arriving.safe_time, 0.49);
    EXPECT_LT(arriving.safe_time, 0.5);
    EXPECT_NEAR(arriving.normal[2], 1.0, 1e-12);
}

TEST(Sweep, WhatIsNotANumberIsNeverSeparated) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    Random random(23);
    for (const double bad : {nan, infinity, -infinity})
        for (int trial = 0; trial < 200; ++trial) {
            Pair pair = random_pair(random, 1.0, 1.0);
            SweptPoint& victim = pair.p[random.bits() % 4];
            (random.bits() % 2 ? victim.t0 : victim.t1)[static_cast<int>(random.bits() % 3)] = bad;
            const Sweep sweep = pair.sweep({.distance = 0.01});
            EXPECT_TRUE(sweep.hit()) << bad << " trial " << trial;
            EXPECT_TRUE(sweep.normal.allFinite()) << bad << " trial " << trial;
            EXPECT_EQ(sweep.safe_time, 0.0) << bad << " trial " << trial;
        }
}

void expect_same(const Sweep& one, const Sweep& four) {
    EXPECT_EQ(one.outcome, four.outcome);
    if (!one.hit() || !four.hit()) return;
    EXPECT_NEAR(one.time, four.time, 1e-9);
    EXPECT_NEAR(one.safe_time, four.safe_time, 1e-9);
    EXPECT_NEAR(one.gap, four.gap, 1e-9);
    EXPECT_NEAR((one.normal - four.normal).norm(), 0.0, 1e-6);
}

TEST(Sweep, FourAtATimeAnswerAsOneAtATime) {
    constexpr std::uint64_t kSeed = 24;
    SCOPED_TRACE(kSeed);
    Random random(kSeed);
    for (const double distance : {0.0, 0.02, 0.2}) {
        const testing::Surface a = testing::make_triangle_soup(random, 40, 1.0, 0.5, 0.4),
                               b = testing::make_triangle_soup(random, 41, 1.0, 0.5, 0.4);
        const SweepLimits limits{.distance = distance, .tolerance = 0.01 * distance};
        std::vector<FeaturePair> pairs;
        for (Index i = 0; i < 120; ++i)
            for (Index k = 0; k < 41; ++k) pairs.push_back({i, k});
        std::vector<Sweep> sweeps(pairs.size());
        const auto point = [](const testing::Surface& s, Index v) { return SweptPoint{s.t0[v], s.t1[v]}; };
        sweep_vertex_faces(a.motion(), b.motion(), pairs, limits, sweeps);
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const Triangle& t = b.triangles[pairs[i].b];
            expect_same(sweep_vertex_face(point(a, pairs[i].a), {point(b, t[0]), point(b, t[1]), point(b, t[2])}, limits), sweeps[i]);
        }
        sweep_edge_edges(a.motion(), b.motion(), pairs, limits, sweeps);
        std::size_t hits = 0;
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            const Edge &e = a.topology.edges[pairs[i].a], &f = b.topology.edges[pairs[i].b];
            expect_same(sweep_edge_edge({point(a, e[0]), point(a, e[1])}, {point(b, f[0]), point(b, f[1])}, limits), sweeps[i]);
            hits += sweeps[i].hit();
        }
        EXPECT_GT(hits, 20u);
    }
}

} // namespace
} // namespace trocar::collision
