#include "base/inside.hpp"
#include "shapes.hpp"
#include "spheretree/covering_tree.hpp"
#include "spheretree/descent.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace seldinger::spheretree {
namespace {

using test::make_icosphere;
using test::make_tube;
using test::Random;

bool is_beneath(const SphereTree& tree, Index leaf, Index sphere) {
    return tree.item_begin[sphere] <= tree.item_begin[leaf] && tree.item_end[leaf] <= tree.item_end[sphere];
}

struct SolidPairFixture {
    CoveringTree a = build_covering_tree(make_icosphere(Vec3::Zero(), 0.05, 3));
    CoveringTree b = build_covering_tree(make_icosphere(Vec3(0.09, 0.01, 0), 0.05, 3));
    std::vector<Sphere> spheres_a = nested(a, make_icosphere(Vec3::Zero(), 0.05, 3));
    std::vector<Sphere> spheres_b = nested(b, make_icosphere(Vec3(0.09, 0.01, 0), 0.05, 3));
    SolidView view_a{1, &a.tree, spheres_a}, view_b{2, &b.tree, spheres_b};

    /// Updated spheres hold their children; rest spheres hold the surface alone, and children may poke out.
    static std::vector<Sphere> nested(const CoveringTree& covering, const TriMesh& mesh) {
        std::vector<Sphere> spheres;
        update_covering_spheres(covering, mesh.vertices, mesh.vertices, spheres);
        return spheres;
    }

    [[nodiscard]] std::set<std::pair<Index, Index>> brute_force() const {
        std::set<std::pair<Index, Index>> pairs;
        for (Index i = 0; i < a.tree.sphere_count(); ++i)
            for (Index k = 0; k < b.tree.sphere_count(); ++k) {
                const Sphere &s = spheres_a[i], &t = spheres_b[k];
                if (a.tree.is_leaf(i) && b.tree.is_leaf(k) && (s.centre - t.centre).norm() <= s.radius + t.radius) pairs.emplace(i, k);
            }
        return pairs;
    }
    [[nodiscard]] std::vector<Contact> run(std::uint64_t units, DescentStats* stats = nullptr,
                                           DescentOrder order = DescentOrder::Breadth) const {
        Descent descent;
        descent.begin(0.0, order, 1);
        descent.add_solid_pair(view_a, view_b);
        WorkBudget budget(units);
        descent.run(budget);
        std::vector<Contact> contacts;
        descent.add_contacts(contacts);
        if (stats != nullptr) *stats = descent.stats();
        return contacts;
    }
};

bool is_known(const SolidPairFixture& f, const std::vector<Contact>& contacts, const std::pair<Index, Index>& pair) {
    return std::any_of(contacts.begin(), contacts.end(), [&](const Contact& c) {
        return is_beneath(f.a.tree, pair.first, c.feature_a[0]) && is_beneath(f.b.tree, pair.second, c.feature_b[0]);
    });
}

TEST(Descent, FindsWhatBruteForceFinds) {
    const SolidPairFixture f;
    const auto expected = f.brute_force();
    ASSERT_GT(expected.size(), 20U);
    std::set<std::pair<Index, Index>> found;
    for (const Contact& c : f.run(WorkBudget::kUnlimited)) {
        EXPECT_EQ(c.origin, ContactOrigin::TestedSpheres);
        EXPECT_EQ(c.body_a, 1);
        EXPECT_LE(c.gap, 0.0);
        EXPECT_GT(c.normal.dot(f.spheres_a[c.feature_a[0]].centre - f.spheres_b[c.feature_b[0]].centre), 0.0);
        EXPECT_TRUE(found.emplace(c.feature_a[0], c.feature_b[0]).second) << "twice";
    }
    EXPECT_EQ(found, expected);
}

TEST(Descent, NeverDropsATrueContactAtAnyBudget) {
    const SolidPairFixture f;
    const auto expected = f.brute_force();
    for (const std::uint64_t units : {0U, 1U, 2U, 5U, 17U, 60U, 200U, 700U, 2000U, 5000U}) {
        DescentStats stats;
        const auto contacts = f.run(units, &stats);
        EXPECT_LE(stats.pairs_tested, units);
        for (const auto& pair : expected) ASSERT_TRUE(is_known(f, contacts, pair)) << "budget " << units;
    }
}

TEST(Descent, EveryOrderKnowsEveryTrueContactAtAnyBudgetAndEndsWithTheSameOnes) {
    const SolidPairFixture f;
    const auto expected = f.brute_force();
    for (const DescentOrder order : {DescentOrder::Breadth, DescentOrder::Deepest, DescentOrder::Depth, DescentOrder::DepthCapped}) {
        for (const std::uint64_t units : {0U, 1U, 3U, 9U, 100U, 101U, 1500U, 4000U})
            for (const auto& pair : expected)
                ASSERT_TRUE(is_known(f, f.run(units, nullptr, order), pair)) << int(order) << ", budget " << units;
        std::set<std::pair<Index, Index>> found;
        DescentStats stats;
        for (const Contact& c : f.run(WorkBudget::kUnlimited, &stats, order)) found.emplace(c.feature_a[0], c.feature_b[0]);
        EXPECT_EQ(stats.pairs_open, 0u);
        if (order != DescentOrder::DepthCapped) {
            EXPECT_EQ(found, expected) << int(order);
        }
    }
}

TEST(Descent, DepthFirstLeavesPairsAtTheRootThatBreadthFirstHasRefined) {
    const SolidPairFixture f;
    DescentStats breadth, deepest, depth;
    (void)f.run(800, &breadth);
    (void)f.run(800, &deepest, DescentOrder::Deepest);
    (void)f.run(800, &depth, DescentOrder::Depth);
    EXPECT_GT(breadth.level_reached, depth.level_reached);
    EXPECT_EQ(breadth.level_reached, deepest.level_reached) << "the order within a round is no reason to leave one out";
}

TEST(Descent, InterruptedAtEveryTestItGoesOnToTheSameList) {
    const SolidPairFixture f;
    for (const DescentOrder order : {DescentOrder::Breadth, DescentOrder::Deepest, DescentOrder::Depth, DescentOrder::DepthCapped}) {
        Descent descent;
        descent.begin(0.0, order, 1);
        descent.add_solid_pair(f.view_a, f.view_b);
        std::uint64_t tests = 0;
        for (bool finished = false; !finished; ++tests) {
            WorkBudget one(1);
            finished = descent.run(one);
            ASSERT_LE(one.spent(), 1u);
            if (!finished) {
                ASSERT_EQ(descent.stats().pairs_tested, tests + 1);
            }
        }
        std::vector<Contact> bit_by_bit, at_once = f.run(WorkBudget::kUnlimited, nullptr, order);
        descent.add_contacts(bit_by_bit);
        ASSERT_EQ(bit_by_bit.size(), at_once.size()) << int(order);
        for (std::size_t k = 0; k < at_once.size(); ++k) {
            ASSERT_EQ(bit_by_bit[k].feature_a[0], at_once[k].feature_a[0]) << int(order) << ", contact " << k;
            ASSERT_EQ(bit_by_bit[k].feature_b[0], at_once[k].feature_b[0]) << int(order) << ", contact " << k;
        }
    }
}

TEST(Descent, MoreBudgetIsNeverCoarser) {
    const SolidPairFixture f;
    std::vector<Contact> coarse = f.run(0);
    for (std::uint64_t units = 50; units < 4000; units += 250) {
        const std::vector<Contact> fine = f.run(units);
        for (const Contact& c : fine) // every pair seen now lies beneath one seen before
            ASSERT_TRUE(std::any_of(coarse.begin(), coarse.end(),
                                    [&](const Contact& o) {
                                        return is_beneath(f.a.tree, c.feature_a[0], o.feature_a[0]) &&
                                               is_beneath(f.b.tree, c.feature_b[0], o.feature_b[0]);
                                    }))
                << "budget " << units;
        coarse = fine;
    }
}

TEST(Descent, LevelReachedIsTheCoarsestOpenLevelAndTheLeafDepthAtTheEnd) {
    const SolidPairFixture f;
    const int depth = std::max(f.a.tree.leaf_depth(), f.b.tree.leaf_depth());
    int last = 0;
    bool between = false;
    for (std::uint64_t units = 0; units < 6000; units += 37) {
        DescentStats stats;
        const std::vector<Contact> contacts = f.run(units, &stats);
        int expected = depth;
        for (const Contact& c : contacts) {
            if (c.origin != ContactOrigin::AssumedSpheres) continue;
            int level = depth;
            if (!f.a.tree.is_leaf(c.feature_a[0])) level = f.a.tree.level[c.feature_a[0]];
            if (!f.b.tree.is_leaf(c.feature_b[0])) level = std::min<int>(level, f.b.tree.level[c.feature_b[0]]);
            expected = std::min(expected, level);
        }
        EXPECT_EQ(stats.level_reached, expected) << "budget " << units;
        EXPECT_GE(stats.level_reached, last) << "budget " << units;
        last = stats.level_reached;
        between = between || (last > 0 && last < depth);
    }
    EXPECT_EQ(last, depth);
    EXPECT_TRUE(between);
}

TEST(Descent, SameRunGivesTheSameListsAndSmallGrantsAddUp) {
    const SolidPairFixture f;
    const auto once = f.run(WorkBudget::kUnlimited), again = f.run(WorkBudget::kUnlimited);
    Descent descent;
    descent.begin(0.0);
    descent.add_solid_pair(f.view_a, f.view_b);
    for (bool done = false; !done;) {
        WorkBudget budget(7);
        done = descent.run(budget);
    }
    std::vector<Contact> granted;
    descent.add_contacts(granted);
    ASSERT_EQ(once.size(), again.size());
    ASSERT_EQ(once.size(), granted.size());
    for (std::size_t i = 0; i < once.size(); ++i)
        for (const Contact& other : {again[i], granted[i]}) {
            EXPECT_EQ(once[i].feature_a[0], other.feature_a[0]);
            EXPECT_EQ(once[i].feature_b[0], other.feature_b[0]);
            EXPECT_EQ(once[i].gap, other.gap);
        }
}

TEST(Descent, PairsShareATightBudgetLevelByLevel) {
    const SolidPairFixture f;
    Descent descent;
    descent.begin(0.0);
    for (int i = 0; i < 6; ++i) descent.add_solid_pair({static_cast<BodyId>(10 + i), &f.a.tree, f.spheres_a}, f.view_b);
    WorkBudget budget(6 * 9);
    EXPECT_FALSE(descent.run(budget));
    std::vector<Contact> contacts;
    descent.add_contacts(contacts);
    int deepest = 0, coarsest = 9;
    for (const Contact& c : contacts) {
        const int level = f.a.tree.level[c.feature_a[0]] + f.b.tree.level[c.feature_b[0]];
        deepest = std::max(deepest, level);
        coarsest = std::min(coarsest, level);
        EXPECT_EQ(c.origin, ContactOrigin::AssumedSpheres);
        EXPECT_LE(c.gap, 0.0);
    }
    EXPECT_LE(deepest - coarsest, 1);
}

TEST(Descent, FarBodiesCostOneTest) {
    const SolidPairFixture f;
    std::vector<Sphere> far = f.spheres_b;
    for (Sphere& s : far) s.centre[0] += 10.0;
    Descent descent;
    descent.begin(0.0);
    descent.add_solid_pair(f.view_a, {2, &f.b.tree, far});
    WorkBudget budget(1);
    EXPECT_TRUE(descent.run(budget));
    EXPECT_EQ(descent.stats().leaf_contacts, 0U);
}

/// 64 bodies in a heap: every pair stands in every other's way.
TEST(Descent, AHeapOf64BodiesUnderABudgetOfOneTestAssumesEveryPairButTheOneTested) {
    const SolidPairFixture f;
    std::vector<std::vector<Sphere>> spheres(64, f.spheres_a);
    for (std::size_t i = 0; i < spheres.size(); ++i)
        for (Sphere& s : spheres[i]) s.centre += 0.03 * Vec3(double(i % 4), double(i / 4 % 4), double(i / 16));
    Descent descent;
    descent.begin(0.0);
    const auto add_all = [&] {
        for (std::size_t i = 0; i < spheres.size(); ++i)
            for (std::size_t k = i + 1; k < spheres.size(); ++k)
                descent.add_solid_pair({static_cast<BodyId>(i), &f.a.tree, spheres[i]}, {static_cast<BodyId>(k), &f.a.tree, spheres[k]});
    };
    add_all();
    WorkBudget one(1);
    EXPECT_FALSE(descent.run(one));
    EXPECT_EQ(descent.stats().pairs_tested, 1u);
    EXPECT_EQ(descent.stats().level_reached, 0);
    std::vector<Contact> contacts;
    descent.add_contacts(contacts);
    std::set<std::pair<BodyId, BodyId>> reported;
    for (const Contact& c : contacts) {
        EXPECT_EQ(c.origin, ContactOrigin::AssumedSpheres);
        EXPECT_TRUE(c.normal.allFinite());
        reported.emplace(c.body_a, c.body_b);
    }
    EXPECT_EQ(reported.size(), 64u * 63u / 2u) << "the first pair's roots overlap: its children stand for it";
    for (const std::uint64_t units : {64u * 63u / 2u, 20000u}) { // all roots tested: nobody is behind by more than a level
        descent.begin(0.0);
        add_all();
        WorkBudget budget(units);
        (void)descent.run(budget);
        contacts.clear();
        descent.add_contacts(contacts);
        int least = 99, most = 0;
        for (const Contact& c : contacts) {
            const int level = f.a.tree.level[c.feature_a[0]] + f.a.tree.level[c.feature_b[0]];
            least = std::min(least, level), most = std::max(most, level);
        }
        EXPECT_LE(most - least, 1) << units;
    }
}

TEST(Descent, BodiesInsideOneAnotherCoincidentCentresAndZeroRadiiAreReportedWithFiniteNormals) {
    const SolidPairFixture f;
    std::vector<Sphere> small = f.spheres_a; // the same tree, a tenth as large, inside the other: same centre
    for (Sphere& s : small) s = {f.spheres_a[0].centre + 0.1 * (s.centre - f.spheres_a[0].centre), 0.1 * s.radius};
    std::vector<Sphere> points = f.spheres_a; // and shrunk to its centres
    for (Sphere& s : points) s.radius = 0.0;
    std::vector<Sphere> one(f.spheres_a.size(), Sphere{f.spheres_a[0].centre, 0.0}); // collapsed to one place
    const auto run = [&](std::span<const Sphere> a, std::span<const Sphere> b, std::uint64_t units) {
        Descent descent;
        descent.begin(0.0);
        descent.add_solid_pair({1, &f.a.tree, a}, {2, &f.a.tree, b});
        WorkBudget budget(units);
        descent.run(budget);
        std::vector<Contact> contacts;
        descent.add_contacts(contacts);
        for (const Contact& c : contacts) {
            EXPECT_TRUE(c.normal.allFinite());
            EXPECT_NEAR(c.normal.norm(), 1.0, 1e-12);
            EXPECT_TRUE(std::isfinite(c.gap));
            EXPECT_TRUE(c.point.allFinite());
        }
        return contacts;
    };
    EXPECT_EQ(run(f.spheres_a, f.spheres_a, 0).size(), 1u) << "one on the other: centres coincide";
    const std::size_t leaves = static_cast<std::size_t>(std::count(f.a.tree.child_count.begin(), f.a.tree.child_count.end(), 0));
    EXPECT_GE(run(f.spheres_a, f.spheres_a, WorkBudget::kUnlimited).size(), leaves) << "every leaf meets itself";
    EXPECT_EQ(run(f.spheres_a, small, 0).size(), 1u) << "inside: assumed until the leaves are seen to be apart";
    EXPECT_EQ(run(f.spheres_a, small, WorkBudget::kUnlimited).size(), 0u) << "surfaces that do not meet, whatever is inside what";
    EXPECT_EQ(run(points, points, WorkBudget::kUnlimited).size(), 0u)
        << "roots of no size at the same place meet, their children nowhere else";
    EXPECT_EQ(run(one, one, WorkBudget::kUnlimited).size(), leaves * leaves) << "all at one place: every pair touches";
}

/// A catheter in a winding vessel: mostly inside, partly through the wall.
struct CatheterFixture {
    static Vec3 axis(double t) { return {0.02 * std::sin(5 * t), 0.015 * std::cos(4 * t), 0.2 * t}; }
    static const TriMesh& shared_wall() {
        static const TriMesh mesh = make_tube({axis, [](double t) { return 6e-3 * std::pow(1.0 / 3.0, t); }, 32, 120});
        return mesh;
    }
    static const LumenTree& shared_lumen() {
        static const LumenTree tree = build_lumen_tree(shared_wall()).value();
        return tree;
    }
    const TriMesh& wall = shared_wall();
    const LumenTree& lumen = shared_lumen();
    LumenState lumen_state;
    ChainTree chain = make_chain_tree(250);
    ChainState chain_state;
    std::vector<Sphere> t0, t1;
    static constexpr double kMargin = 3e-4;

    explicit CatheterFixture(double offset = 2e-3, double speed = 2e-4) {
        for (int i = 0; i < 200; ++i) {
            const double t = 0.02 + 0.96 * i / 199.0;
            const Vec3 aside(offset * std::cos(0.1 * i), offset * std::sin(0.07 * i), 0.0);
            t0.push_back({axis(t) + aside, 5e-4});
            t1.push_back({axis(t) + aside + Vec3(speed * std::sin(i), speed * std::cos(2 * i), 0.0), 5e-4});
        }
        lumen_state.update(lumen, {}, {});
        update_chain(chain, t0, t1, chain_state);
    }
    bool run(Descent& descent, std::uint64_t units, std::vector<Contact>& contacts) {
        descent.begin(kMargin);
        descent.add_hollow_pair({1, &chain, &chain_state}, {2, &lumen, &lumen_state});
        WorkBudget budget(units);
        const bool done = descent.run(budget);
        contacts.clear();
        descent.add_contacts(contacts);
        return done;
    }
    [[nodiscard]] double swept_room(std::size_t link) const { // brute force over all balls
        double best = -1.0;
        for (Index b = 0; b < lumen.ball_count(); ++b) {
            const Sphere& ball = lumen.ball(b);
            best = std::max(best, ball.radius - t0[link].radius -
                                      std::max((t0[link].centre - ball.centre).norm(), (t1[link].centre - ball.centre).norm()));
        }
        return best;
    }
};

TEST(HollowDescent, ProvesFreeWhatBruteForceProvesAndReportsTheRest) {
    CatheterFixture f;
    Descent descent;
    std::vector<Contact> contacts;
    ASSERT_TRUE(f.run(descent, WorkBudget::kUnlimited, contacts));
    std::vector<int> reported(f.t1.size(), 0);
    for (const Contact& c : contacts) ++reported[f.chain.link_of_leaf(c.feature_a[0])];
    std::size_t touching = 0;
    for (std::size_t i = 0; i < f.t1.size(); ++i) {
        const bool free = f.swept_room(i) >= f.kMargin;
        EXPECT_EQ(descent.link_status(0)[i], free ? LinkStatus::Free : LinkStatus::Contact) << "link " << i;
        EXPECT_EQ(reported[i], free ? 0 : 1) << "link " << i;
        touching += !free;
    }
    EXPECT_GT(touching, 20U);
    EXPECT_LT(touching, 180U);
    EXPECT_EQ(descent.stats().proven_free, f.t1.size() - touching);
}

TEST(HollowDescent, GapIsALowerBoundOfTheRoomAndTheNormalLeadsToMore) {
    CatheterFixture f;
    const InsideTest inside(f.wall);
    Descent descent;
    std::vector<Contact> contacts;
    f.run(descent, WorkBudget::kUnlimited, contacts);
    double worst = 0.0;
    for (const Contact& c : contacts) {
        const Sphere& link = f.t1[f.chain.link_of_leaf(c.feature_a[0])];
        const double room = -inside.signed_distance(link.centre) - link.radius;
        EXPECT_GE(c.gap, f.swept_room(f.chain.link_of_leaf(c.feature_a[0])) - 1e-12);
        EXPECT_LE(c.gap, room + 1e-9) << "never promises more than there is";
        if (room > -4e-4) worst = std::max(worst, room - c.gap);
        EXPECT_NEAR(c.normal.norm(), 1.0, 1e-12);
        const double step = 1e-4;
        EXPECT_LT(inside.signed_distance(link.centre + step * c.normal), inside.signed_distance(link.centre) - 0.7 * step);
        EXPECT_TRUE(f.lumen.tree.is_leaf(c.feature_b[0]));
    }
    EXPECT_LT(worst, 3.5e-4) << "the union follows the wall closely";
}

TEST(HollowDescent, NeverMissesAtAnyBudget) {
    for (const std::uint64_t units : {0U, 1U, 3U, 10U, 40U, 150U, 400U, 1000U, 3000U}) {
        CatheterFixture f;
        Descent descent;
        std::vector<Contact> contacts;
        f.run(descent, units, contacts);
        std::vector<int> known(f.t1.size(), 0);
        for (const Contact& c : contacts)
            for (const Index link : f.chain.tree.items_of(c.feature_a[0]))
                if (link < known.size()) {
                    ++known[link];
                    EXPECT_EQ(descent.link_status(0)[link] == LinkStatus::Open, c.origin == ContactOrigin::AssumedSpheres);
                }
        for (std::size_t i = 0; i < f.t1.size(); ++i) {
            EXPECT_EQ(known[i] == 0, descent.link_status(0)[i] == LinkStatus::Free) << "link " << i << " budget " << units;
            if (descent.link_status(0)[i] == LinkStatus::Free) {
                EXPECT_GE(f.swept_room(i), f.kMargin);
            }
        }
    }
}

/// Balls of a moving wall cost hundreds of units each: none is measured before it is paid for, and in pieces they cost what they cost in
/// one go.
TEST(HollowDescent, OfAMovingWallNothingIsDoneOnCredit) {
    CatheterFixture f, g;
    std::vector<Vec3> moved = f.lumen.rest_vertices;
    for (Vec3& v : moved) v += 1e-4 * Vec3(std::sin(100.0 * v[0]), std::cos(130.0 * v[1]), 0.5);
    std::vector<Contact> whole, pieces;
    const auto begin = [&](CatheterFixture& fixture, Descent& descent) {
        fixture.lumen_state.update(fixture.lumen, fixture.lumen.rest_vertices, moved);
        descent.begin(fixture.kMargin);
        descent.add_hollow_pair({1, &fixture.chain, &fixture.chain_state}, {2, &fixture.lumen, &fixture.lumen_state});
    };
    Descent once, by_piece;
    begin(f, once);
    WorkBudget all;
    ASSERT_TRUE(once.run(all));
    once.add_contacts(whole);
    begin(g, by_piece);
    std::uint64_t spent = 0, largest = 0;
    for (bool done = false; !done;) {
        const std::uint64_t least = by_piece.next_cost();
        const std::size_t before = g.lumen_state.balls_updated();
        WorkBudget too_little(least - 1);
        if (least > 1) {
            EXPECT_FALSE(by_piece.run(too_little));
            EXPECT_EQ(too_little.spent(), 0u);
            EXPECT_EQ(g.lumen_state.balls_updated(), before);
        }
        WorkBudget enough(std::max<std::uint64_t>(least, 5));
        done = by_piece.run(enough);
        ASSERT_GT(enough.spent(), 0u);
        spent += enough.spent();
        largest = std::max(largest, least);
    }
    by_piece.add_contacts(pieces);
    EXPECT_GT(largest, 20u) << "a ball with its triangles";
    EXPECT_EQ(spent, all.spent());
    ASSERT_EQ(whole.size(), pieces.size());
    for (std::size_t k = 0; k < whole.size(); ++k) {
        EXPECT_EQ(whole[k].gap, pieces[k].gap) << k;
        EXPECT_EQ(whole[k].normal, pieces[k].normal) << k;
    }
}

TEST(HollowDescent, HintsAndGrantsChangeTheWorkNotTheResult) {
    CatheterFixture f, g;
    Descent cold, warm, granted;
    std::vector<Contact> first, second, third;
    f.run(cold, WorkBudget::kUnlimited, first);
    f.run(warm, WorkBudget::kUnlimited, second);
    EXPECT_LT(warm.stats().pairs_tested, cold.stats().pairs_tested);
    granted.begin(g.kMargin);
    granted.add_hollow_pair({1, &g.chain, &g.chain_state}, {2, &g.lumen, &g.lumen_state});
    for (bool done = false; !done;) {
        WorkBudget budget(std::max<std::uint64_t>(3, granted.next_cost()));
        done = granted.run(budget);
        ASSERT_GT(budget.spent(), 0u) << "what it asked for is enough to go on";
    }
    granted.add_contacts(third);
    ASSERT_EQ(first.size(), second.size());
    ASSERT_EQ(first.size(), third.size());
    for (const auto& other : {second, third})
        for (const Contact& c : other)
            EXPECT_TRUE(std::any_of(first.begin(), first.end(), [&](const Contact& o) {
                return o.feature_a[0] == c.feature_a[0] && o.feature_b[0] == c.feature_b[0] && o.gap == c.gap && o.normal == c.normal;
            }));
}

TEST(HollowDescent, AFastLinkDoesNotJumpTheWallUnseen) {
    CatheterFixture f(0.0, 0.0);
    for (Sphere& link : f.t1) link.centre[0] += 0.2; // far outside at t1
    f.t1[50].centre = f.axis(0.9);                   // inside at both ends, through the wall between
    f.t0[50].centre = f.axis(0.1);
    update_chain(f.chain, f.t0, f.t1, f.chain_state);
    Descent descent;
    std::vector<Contact> contacts;
    f.run(descent, WorkBudget::kUnlimited, contacts);
    for (const LinkStatus status : descent.link_status(0)) EXPECT_EQ(status, LinkStatus::Contact);
    EXPECT_EQ(contacts.size(), f.t1.size());
}

TEST(HollowDescent, MovesWithTheWall) {
    CatheterFixture rest, moved;
    const Vec3 shift(0.01, 0.02, -0.03);
    std::vector<Vec3> t0 = rest.wall.vertices, t1 = rest.wall.vertices;
    for (Vec3& v : t0) v += shift;
    for (Vec3& v : t1) v += 1.1 * shift; // wall and catheter travel together
    for (Sphere& s : moved.t0) s.centre += shift;
    for (Sphere& s : moved.t1) s.centre += 1.1 * shift;
    moved.lumen_state.update(moved.lumen, t0, t1);
    update_chain(moved.chain, moved.t0, moved.t1, moved.chain_state);
    Descent a, b;
    std::vector<Contact> still, travelling;
    rest.run(a, WorkBudget::kUnlimited, still);
    moved.run(b, WorkBudget::kUnlimited, travelling);
    ASSERT_GE(travelling.size(), still.size());
    for (const Contact& c : still) { // radii of moving balls are measured to 1 %
        const auto same =
            std::find_if(travelling.begin(), travelling.end(), [&](const Contact& o) { return o.feature_a[0] == c.feature_a[0]; });
        ASSERT_NE(same, travelling.end());
        EXPECT_LE(same->gap, c.gap + 1e-9);
        EXPECT_GE(same->gap, c.gap - 0.02 * 6e-3);
    }
    EXPECT_LT(moved.lumen_state.balls_updated(), moved.lumen.ball_count()) << "only balls that were asked for";
}

TEST(HollowDescent, WallPointIsTheNearestOfTheWall) {
    CatheterFixture f;
    const InsideTest inside(f.wall);
    Descent descent;
    std::vector<Contact> contacts;
    f.run(descent, WorkBudget::kUnlimited, contacts);
    std::size_t same = 0;
    for (const Contact& c : contacts) {
        const WallPoint wall = find_wall_point(f.lumen, {}, f.lumen.ball_of_leaf(c.feature_b[0]), c.point);
        ASSERT_NE(wall.triangle, kNoIndex);
        same += std::abs(wall.distance - inside.tree().closest(c.point)->distance) < 1e-12;
    }
    EXPECT_GT(same, contacts.size() * 8 / 10) << "a ball's links hold the wall that a contact presses on";
}

} // namespace
} // namespace seldinger::spheretree
