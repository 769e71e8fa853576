// Exact verdicts against rational arithmetic, on pairs constructed to be hard.
#include "collision/ccd/ccd.hpp"

#include "base/closest_point.hpp"
#include "tests/collision/rational.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::RationalPair;
using testing::Verdict;

struct Pair {
    bool vertex_face;
    std::array<SweptPoint, 4> p;

    CcdResult meet() const {
        if (vertex_face) return ccd_vertex_face(p[0], {p[1], p[2], p[3]});
        return ccd_edge_edge({p[0], p[1]}, {p[2], p[3]});
    }
    Pair reordered(std::array<std::size_t, 4> order) const { return {vertex_face, {p[order[0]], p[order[1]], p[order[2]], p[order[3]]}}; }
    Pair scaled(double factor) const {
        Pair out = *this;
        for (SweptPoint& q : out.p) q = {factor * q.t0, factor * q.t1};
        return out;
    }
    Pair reversed() const {
        Pair out = *this;
        for (SweptPoint& q : out.p) std::swap(q.t0, q.t1);
        return out;
    }
};

Vec3 whole_vector(Random& random, int reach) {
    Vec3 v;
    for (int axis = 0; axis < 3; ++axis)
        v[axis] = static_cast<double>(static_cast<int>(random.bits() % static_cast<unsigned>(2 * reach + 1)) - reach);
    return v;
}

/// Small integers: coplanar, parallel, touching and degenerate pairs are common.
Pair whole_pair(Random& random, int reach) {
    Pair pair{random.bits() % 2 == 0, {}};
    const bool resting = random.bits() % 3 == 0;
    for (SweptPoint& q : pair.p) {
        q.t0 = whole_vector(random, reach);
        q.t1 = resting && random.bits() % 2 == 0 ? q.t0 : whole_vector(random, reach);
    }
    return pair;
}

/// Meets at a random time on a corner, border or inside, but for a few ulps either way.
Pair nearly_touching_pair(Random& random) {
    Pair pair{random.bits() % 2 == 0, {}};
    for (SweptPoint& q : pair.p) q = {random.vector(1.0), random.vector(1.0)};
    const double t = random.real(0.05, 0.95);
    const auto middle = [&](std::size_t i) { return Vec3((1.0 - t) * pair.p[i].t0 + t * pair.p[i].t1); };
    const auto weight = [&] { return random.bits() % 3 == 0 ? 0.0 : random.bits() % 3 == 0 ? 1.0 : random.real(0.0, 1.0); };
    const double w1 = weight(), w2 = pair.vertex_face ? weight() * (1.0 - w1) : weight();
    const Vec3 on_a = pair.vertex_face ? middle(0) : Vec3((1.0 - w1) * middle(0) + w1 * middle(1));
    const Vec3 on_b = pair.vertex_face ? Vec3((1.0 - w1 - w2) * middle(1) + w1 * middle(2) + w2 * middle(3))
                                       : Vec3((1.0 - w2) * middle(2) + w2 * middle(3));
    const Vec3 shift = on_b - on_a + random.vector(random.bits() % 2 == 0 ? 0.0 : 3e-16);
    for (std::size_t i = 0; i < (pair.vertex_face ? 1u : 2u); ++i) pair.p[i] = {pair.p[i].t0 + shift, pair.p[i].t1 + shift};
    return pair;
}

struct Counts {
    std::size_t meets = 0, apart = 0, unknown = 0, exact = 0;
};

void compare(const Pair& pair, Counts& counts, std::uint64_t seed, std::size_t trial) {
    const CcdResult ccd = pair.meet();
    counts.exact += ccd.decided_by == Decision::Exact;
    const Verdict truth = RationalPair(pair.vertex_face, pair.p).verdict();
    if (truth == Verdict::Unknown)
        ++counts.unknown;
    else if (truth == Verdict::Meets)
        ++counts.meets;
    else
        ++counts.apart;
    if (truth == Verdict::Unknown) return;
    EXPECT_EQ(ccd.meets, truth == Verdict::Meets) << "seed " << seed << " trial " << trial;
}

/// More trials on request: TROCAR_LONG_TESTS=1 asks for millions (hours), a larger number for that many times the usual.
std::size_t trials(std::size_t usual) {
    const char* wanted = std::getenv("TROCAR_LONG_TESTS");
    const unsigned long times = wanted != nullptr ? std::strtoul(wanted, nullptr, 10) : 0;
    return times == 0 ? usual : times == 1 ? 1000 * usual : times * usual;
}

/// Against the rational test, with counts.
/// make   (random, trial) -> Pair
Counts compare_all(const char* what, std::size_t count, std::uint64_t seed, const auto& make) {
    Random random(seed);
    Counts c;
    for (std::size_t trial = 0; trial < count; ++trial) compare(make(random, trial), c, seed, trial);
    std::printf("%s: %zu meet, %zu apart, %zu not known to the rational test; %zu decided in exact arithmetic\n", what, c.meets, c.apart,
                c.unknown, c.exact);
    return c;
}

TEST(ExactCcd, AgreesWithRationalArithmeticOnSmallIntegers) {
    const Counts counts = compare_all("integers", trials(1200), 31, [](Random& random, std::size_t trial) {
        return whole_pair(random, 1 + static_cast<int>(trial % 4));
    });
    EXPECT_GT(counts.meets, counts.unknown);
    EXPECT_GT(counts.apart, counts.unknown);
    EXPECT_GT(counts.exact, 100u);
}

/// At the time from exact integer arithmetic, the features are together; before it they never are.
TEST(ExactCcd, IntegerArithmeticGivesTheTimeOfImpact) {
    constexpr std::uint64_t kSeed = 36;
    Random random(kSeed);
    const auto gap = [](const Pair& pair, double time) {
        std::array<Vec3, 4> x;
        for (std::size_t i = 0; i < 4; ++i) x[i] = (1.0 - time) * pair.p[i].t0 + time * pair.p[i].t1;
        return std::sqrt(pair.vertex_face ? closest_on_triangle(x[0], x[1], x[2], x[3]).distance_sq
                                          : closest_on_segments({x[0], x[1]}, {x[2], x[3]}).distance_sq);
    };
    std::size_t decided = 0, later = 0;
    for (std::size_t trial = 0; trial < 6000; ++trial) {
        const Pair pair = whole_pair(random, 1 + static_cast<int>(trial % 4));
        const CcdResult m = pair.meet();
        if (!m.meets || m.decided_by != Decision::Exact) continue;
        ++decided;
        later += m.time > 0.0;
        EXPECT_LT(gap(pair, m.time), 1e-6) << "seed " << kSeed << " trial " << trial << " time " << m.time;
        for (double time = 0.0; time < m.time - 1e-3; time += 1.0 / 256.0)
            EXPECT_GT(gap(pair, time), 1e-9) << "seed " << kSeed << " trial " << trial << " time " << m.time << " at " << time;
    }
    EXPECT_GT(decided, 500u);
    EXPECT_GT(later, 200u);
}

TEST(ExactCcd, AgreesWithRationalArithmeticAFewUlpsFromTouching) {
    const Counts counts =
        compare_all("nearly touching", trials(400), 32, [](Random& random, std::size_t) { return nearly_touching_pair(random); });
    EXPECT_GT(counts.meets, 100u);
    EXPECT_GT(counts.apart, 50u);
    EXPECT_GT(counts.exact, 100u);
}

/// Anything anywhere, so that their cubics have one root, three or none: the verdict of crossing.hpp, and what it leaves undecided.
TEST(ExactCcd, AgreesWithRationalArithmeticOnWhatCrosses) {
    const Counts counts = compare_all("crossing", trials(2400), 37, [](Random& random, std::size_t trial) {
        Pair pair{trial % 2 == 0, {}};
        const double motion = trial % 4 == 0 ? 0.3 : 3.0;
        for (SweptPoint& q : pair.p) {
            q.t0 = random.vector(1.0);
            q.t1 = q.t0 + random.vector(motion);
        }
        return pair;
    });
    EXPECT_GT(counts.meets, 100u);
    EXPECT_GT(counts.apart, 500u);
    EXPECT_LT(counts.exact, 5u);
}

TEST(ExactCcd, WhatIsNotFiniteIsAContactAtTimeZeroAndReachesNoIntegers) {
    const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
    Random random(37);
    for (const double bad : {nan, infinity, -infinity})
        for (int trial = 0; trial < 200; ++trial) {
            Pair pair = trial % 2 == 0 ? whole_pair(random, 3) : nearly_touching_pair(random);
            SweptPoint& victim = pair.p[random.bits() % 4];
            (random.bits() % 2 ? victim.t0 : victim.t1)[static_cast<int>(random.bits() % 3)] = bad;
            const CcdResult ccd = pair.meet();
            EXPECT_TRUE(ccd.meets) << bad << " trial " << trial;
            EXPECT_EQ(ccd.time, 0.0) << bad << " trial " << trial;
            EXPECT_NE(ccd.decided_by, Decision::Exact) << bad << " trial " << trial;
            EXPECT_TRUE(ccd.normal.allFinite()) << bad << " trial " << trial;
        }
}

TEST(ExactCcd, FourAtATimeAnswerAsOneAtATimeToTheBit) {
    constexpr std::uint64_t kSeed = 38;
    Random random(kSeed);
    const testing::Surface a = testing::make_triangle_soup(random, 40, 1.0, 0.8, 1.0),
                           b = testing::make_triangle_soup(random, 41, 1.0, 0.8, 1.0);
    std::vector<FeaturePair> pairs;
    for (Index i = 0; i < 120; ++i)
        for (Index k = 0; k < 41; ++k) pairs.push_back({i, k});
    std::vector<CcdResult> ccd_results(pairs.size());
    std::size_t met = 0;
    const auto expect_same = [&](const CcdResult& one, std::size_t i) {
        ASSERT_EQ(one.meets, ccd_results[i].meets) << "seed " << kSeed << " pair " << i;
        EXPECT_EQ(one.decided_by, ccd_results[i].decided_by) << "seed " << kSeed << " pair " << i;
        if (!one.meets) return;
        ++met;
        EXPECT_EQ(one.time, ccd_results[i].time) << "seed " << kSeed << " pair " << i;
        EXPECT_EQ(one.bary, ccd_results[i].bary) << "seed " << kSeed << " pair " << i;
        EXPECT_EQ(one.normal, ccd_results[i].normal) << "seed " << kSeed << " pair " << i;
    };
    const auto point = [](const testing::Surface& s, Index v) { return SweptPoint{s.t0[v], s.t1[v]}; };
    ccd_vertex_faces(a.motion(), b.motion(), pairs, ccd_results);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Triangle& t = b.triangles[pairs[i].b];
        expect_same(ccd_vertex_face(point(a, pairs[i].a), {point(b, t[0]), point(b, t[1]), point(b, t[2])}), i);
    }
    ccd_edge_edges(a.motion(), b.motion(), pairs, ccd_results);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        const Edge &e = a.topology.edges[pairs[i].a], &f = b.topology.edges[pairs[i].b];
        expect_same(ccd_edge_edge({point(a, e[0]), point(a, e[1])}, {point(b, f[0]), point(b, f[1])}), i);
    }
    EXPECT_GT(met, 100u);
}

TEST(ExactCcd, IsTheSameForEveryOrderScaleAndDirectionOfTime) {
    constexpr std::uint64_t kSeed = 33;
    Random random(kSeed);
    const std::vector<std::array<std::size_t, 4>> faces{{0, 1, 2, 3}, {0, 2, 3, 1}, {0, 3, 1, 2}, {0, 2, 1, 3}, {0, 1, 3, 2}, {0, 3, 2, 1}};
    const std::vector<std::array<std::size_t, 4>> edges{{0, 1, 2, 3}, {1, 0, 2, 3}, {0, 1, 3, 2}, {1, 0, 3, 2}, {2, 3, 0, 1}, {3, 2, 0, 1}};
    for (std::size_t trial = 0; trial < trials(2000); ++trial) {
        const Pair pair = trial % 2 == 0 ? whole_pair(random, 2) : nearly_touching_pair(random);
        const CcdResult one = pair.meet();
        for (const auto& order : pair.vertex_face ? faces : edges) {
            const CcdResult other = pair.reordered(order).meet();
            EXPECT_EQ(one.meets, other.meets) << "seed " << kSeed << " trial " << trial;
            if (one.meets && other.meets) {
                EXPECT_NEAR(one.time, other.time, 2.0 * kTimeOfImpactError) << "seed " << kSeed << " trial " << trial;
            }
        }
        EXPECT_EQ(one.meets, pair.scaled(0x1p-300).meet().meets) << "seed " << kSeed << " trial " << trial;
        EXPECT_EQ(one.meets, pair.scaled(0x1p200).meet().meets) << "seed " << kSeed << " trial " << trial;
        EXPECT_EQ(one.meets, pair.reversed().meet().meets) << "seed " << kSeed << " trial " << trial;
    }
}

TEST(ExactCcd, TellsTimePlaceAndNormal) {
    constexpr std::uint64_t kSeed = 34;
    Random random(kSeed);
    std::size_t checked = 0;
    for (std::size_t trial = 0; trial < 20000; ++trial) {
        Pair pair{trial % 2 == 0, {}};
        for (SweptPoint& q : pair.p) q = {random.vector(1.0), random.vector(1.0)};
        const CcdResult m = pair.meet();
        if (!m.meets) continue;
        ++checked;
        std::array<Vec3, 4> x;
        for (std::size_t i = 0; i < 4; ++i) x[i] = (1.0 - m.time) * pair.p[i].t0 + m.time * pair.p[i].t1;
        const Vec3 a = pair.vertex_face ? x[0] : Vec3((1.0 - m.bary[0]) * x[0] + m.bary[0] * x[1]);
        const Vec3 b = pair.vertex_face ? Vec3(m.bary[0] * x[1] + m.bary[1] * x[2] + m.bary[2] * x[3])
                                        : Vec3((1.0 - m.bary[1]) * x[2] + m.bary[1] * x[3]);
        EXPECT_LT((a - b).norm(), 1e-8) << "seed " << kSeed << " trial " << trial;
        EXPECT_NEAR(m.normal.norm(), 1.0, 1e-12) << "seed " << kSeed << " trial " << trial;
        for (const double w : m.bary) EXPECT_TRUE(w >= -1e-12 && w <= 1.0 + 1e-12) << "seed " << kSeed << " trial " << trial;
        // the sweep has proven everything before its own time, and that is close
        const Sweep sweep = pair.vertex_face ? sweep_vertex_face(pair.p[0], {pair.p[1], pair.p[2], pair.p[3]}, {})
                                             : sweep_edge_edge({pair.p[0], pair.p[1]}, {pair.p[2], pair.p[3]}, {});
        EXPECT_GE(m.time, sweep.time - 1e-12) << "seed " << kSeed << " trial " << trial;
    }
    EXPECT_GT(checked, 1500u);
}

} // namespace
} // namespace trocar::collision
