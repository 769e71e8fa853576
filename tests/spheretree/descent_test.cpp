// The descent of solid bodies into one another.
#include "shapes.hpp"
#include "spheretree/update/covering_tree.hpp"
#include "spheretree/traverse/descent.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

namespace trocar::spheretree {
namespace {

using test::make_icosphere;

bool is_beneath(const SphereTree& tree, Index leaf, Index sphere) {
    return tree.item_begin[sphere] <= tree.item_begin[leaf] && tree.item_end[leaf] <= tree.item_end[sphere];
}

struct SolidPairFixture {
    Vec3 away = Vec3::Zero(); // m, where the two stand
    CoveringTree a = build_covering_tree(make_icosphere(away, 0.05, 3));
    CoveringTree b = build_covering_tree(make_icosphere(away + Vec3(0.09, 0.01, 0), 0.05, 3));
    std::vector<Sphere> spheres_a = nested(a, make_icosphere(away, 0.05, 3));
    std::vector<Sphere> spheres_b = nested(b, make_icosphere(away + Vec3(0.09, 0.01, 0), 0.05, 3));
    SolidView view_a{Thing::body(1), &a.tree, spheres_a}, view_b{Thing::body(2), &b.tree, spheres_b};

    /// Updated spheres hold their children; rest spheres hold the surface alone, and children may extend beyond them.
    static std::vector<Sphere> nested(const CoveringTree& covering, const TriMesh& mesh) {
        std::vector<Sphere> spheres;
        update_covering_spheres(covering, mesh.vertices, mesh.vertices, spheres);
        return spheres;
    }

    [[nodiscard]] std::set<std::pair<Index, Index>> brute_force(double margin = 0.0) const {
        std::set<std::pair<Index, Index>> pairs;
        for (Index i = 0; i < a.tree.sphere_count(); ++i)
            for (Index k = 0; k < b.tree.sphere_count(); ++k) {
                const Sphere &s = spheres_a[i], &t = spheres_b[k];
                if (a.tree.is_leaf(i) && b.tree.is_leaf(k) && (s.centre - t.centre).norm() <= s.radius + t.radius + margin)
                    pairs.emplace(i, k);
            }
        return pairs;
    }
    [[nodiscard]] std::vector<Contact> run(std::uint64_t units, DescentStats* stats = nullptr, DescentOrder order = DescentOrder::Breadth,
                                           double margin = 0.0) const {
        Descent descent;
        descent.begin(margin, order, 1);
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
        EXPECT_EQ(c.a, Thing::body(1));
        EXPECT_LE(c.gap, 0.0);
        EXPECT_GT(c.normal.dot(f.spheres_a[c.feature_a[0]].centre - f.spheres_b[c.feature_b[0]].centre), 0.0);
        EXPECT_TRUE(found.emplace(c.feature_a[0], c.feature_b[0]).second) << "twice";
    }
    EXPECT_EQ(found, expected);
}

TEST(Descent, FindsWhatComesAsNearAsTheMargin) {
    const SolidPairFixture f;
    for (const double margin : {1e-4, 1e-3, 5e-3}) {
        const auto expected = f.brute_force(margin);
        EXPECT_GT(expected.size(), f.brute_force().size()) << margin;
        std::set<std::pair<Index, Index>> found;
        for (const Contact& c : f.run(WorkBudget::kUnlimited, nullptr, DescentOrder::Breadth, margin)) {
            EXPECT_LE(c.gap, margin);
            found.emplace(c.feature_a[0], c.feature_b[0]);
        }
        EXPECT_EQ(found, expected) << margin;
    }
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

TEST(Descent, TenThousandBodySizesFromTheOriginItDropsNoTrueContactEither) {
    const SolidPairFixture here, f{.away = Vec3(1000.0, -2000.0, 1000.0)};
    const auto expected = f.brute_force();
    EXPECT_NEAR(static_cast<double>(expected.size()), static_cast<double>(here.brute_force().size()), 2.0)
        << "places are rounded to 1e-13 m there: a pair that just touched may have moved apart";
    for (const std::uint64_t units : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{17}, std::uint64_t{700}, WorkBudget::kUnlimited}) {
        const auto contacts = f.run(units);
        for (const auto& pair : expected) ASSERT_TRUE(is_known(f, contacts, pair)) << "budget " << units;
        if (units == WorkBudget::kUnlimited) EXPECT_EQ(contacts.size(), expected.size());
    }
}

TEST(Descent, OfTwoBodiesSwappedFindsTheMirroredPairs) {
    const SolidPairFixture f;
    using Pairs = std::set<std::pair<Index, Index>>;
    for (const DescentOrder order : {DescentOrder::Breadth, DescentOrder::Deepest, DescentOrder::Depth})
        for (const bool complete : {true, false}) {
            Pairs found, mirrored;
            for (const bool swapped : {false, true}) {
                Descent descent;
                descent.begin(0.0, order, 1);
                descent.add_solid_pair(swapped ? f.view_b : f.view_a, swapped ? f.view_a : f.view_b);
                WorkBudget budget(complete ? WorkBudget::kUnlimited : 300);
                EXPECT_EQ(descent.run(budget), complete);
                std::vector<Contact> contacts;
                descent.add_contacts(contacts);
                for (const Contact& c : contacts) {
                    EXPECT_EQ(c.a, Thing::body(swapped ? 2 : 1));
                    const Index a = swapped ? c.feature_b[0] : c.feature_a[0], b = swapped ? c.feature_a[0] : c.feature_b[0];
                    (swapped ? mirrored : found).emplace(a, b);
                }
                if (!complete)
                    for (const auto& [a, b] : f.brute_force())
                        EXPECT_TRUE(std::any_of(
                            (swapped ? mirrored : found).begin(), (swapped ? mirrored : found).end(),
                            [&](const auto& seen) { return is_beneath(f.a.tree, a, seen.first) && is_beneath(f.b.tree, b, seen.second); }))
                            << "what a tight budget leaves open differs, and still holds every true pair";
            }
            if (complete) EXPECT_EQ(found, mirrored) << int(order);
        }
}

/// A body of one triangle has one sphere, one without triangles none.
TEST(Descent, TakesBodiesOfOneTriangleAndOfNoneAtAnyBudget) {
    const SolidPairFixture f;
    TriMesh near_mesh, far_mesh;
    near_mesh.vertices = {Vec3(0.05, 0, 0), Vec3(0.06, 0, 0), Vec3(0.05, 0.01, 0)}; // touches the first ball
    near_mesh.triangles = {{0, 1, 2}};
    far_mesh = near_mesh;
    for (Vec3& v : far_mesh.vertices) v += Vec3(0, 0, 3);
    const CoveringTree one = build_covering_tree(near_mesh), apart = build_covering_tree(far_mesh), none = build_covering_tree({});
    ASSERT_EQ(one.tree.sphere_count(), 1u);
    ASSERT_EQ(none.tree.sphere_count(), 0u);
    const std::vector<Sphere> of_one = SolidPairFixture::nested(one, near_mesh), of_far = SolidPairFixture::nested(apart, far_mesh),
                              of_none = SolidPairFixture::nested(none, {});
    const SolidView triangle{Thing::body(3), &one.tree, of_one}, far_triangle{Thing::body(4), &apart.tree, of_far}, empty{Thing::body(5), &none.tree, of_none};
    struct Case {
        const char* what;
        SolidView a, b;
        bool meets;
    };
    for (const Case& c :
         {Case{"a triangle and a ball", triangle, f.view_a, true}, Case{"a ball and a triangle", f.view_a, triangle, true},
          Case{"a triangle and itself", triangle, triangle, true}, Case{"two triangles", triangle, far_triangle, false},
          Case{"an empty body and a ball", empty, f.view_a, false}, Case{"a ball and an empty body", f.view_a, empty, false},
          Case{"an empty body and a triangle", empty, triangle, false}, Case{"two empty bodies", empty, empty, false}})
        for (const std::uint64_t units : {std::uint64_t{0}, std::uint64_t{1}, WorkBudget::kUnlimited}) {
            SCOPED_TRACE(::testing::Message() << c.what << ", budget " << units);
            Descent descent;
            descent.begin(0.0);
            descent.add_solid_pair(c.a, c.b);
            WorkBudget budget(units);
            const bool finished = descent.run(budget);
            const bool nothing = c.a.spheres.empty() || c.b.spheres.empty();
            EXPECT_TRUE(finished || units <= 1);
            EXPECT_TRUE(finished || !nothing) << "nothing to do is done";
            std::vector<Contact> contacts;
            descent.add_contacts(contacts);
            if (nothing) EXPECT_TRUE(contacts.empty());
            if (c.meets) EXPECT_FALSE(contacts.empty()) << "never dropped";
            if (finished && !c.meets) EXPECT_TRUE(contacts.empty());
            if (units == 0 && !nothing) EXPECT_EQ(contacts.size(), 1u) << "assumed";
            for (const Contact& contact : contacts) EXPECT_TRUE(contact.normal.allFinite() && std::isfinite(contact.gap));
        }
    Descent descent; // against itself: one leaf is never a pair
    descent.begin(0.0);
    for (const SolidView& body : {triangle, empty}) descent.add_self_pair(body);
    WorkBudget nothing(0);
    EXPECT_TRUE(descent.run(nothing));
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
    for (int i = 0; i < 6; ++i) descent.add_solid_pair({Thing::body(static_cast<std::size_t>(10 + i)), &f.a.tree, f.spheres_a}, f.view_b);
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
    descent.add_solid_pair(f.view_a, {Thing::body(2), &f.b.tree, far});
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
                descent.add_solid_pair({Thing::body(static_cast<std::size_t>(i)), &f.a.tree, spheres[i]}, {Thing::body(static_cast<std::size_t>(k)), &f.a.tree, spheres[k]});
    };
    add_all();
    WorkBudget one(1);
    EXPECT_FALSE(descent.run(one));
    EXPECT_EQ(descent.stats().pairs_tested, 1u);
    EXPECT_EQ(descent.stats().level_reached, 0);
    std::vector<Contact> contacts;
    descent.add_contacts(contacts);
    std::set<std::pair<Thing, Thing>> reported;
    for (const Contact& c : contacts) {
        EXPECT_EQ(c.origin, ContactOrigin::AssumedSpheres);
        EXPECT_TRUE(c.normal.allFinite());
        reported.emplace(c.a, c.b);
    }
    EXPECT_EQ(reported.size(), 64u * 63u / 2u) << "the first pair's roots overlap: its children stand for it";
    for (const std::uint64_t units : {64u * 63u / 2u, 20000u}) { // all roots tested: no pair is behind by more than a level
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
        descent.add_solid_pair({Thing::body(1), &f.a.tree, a}, {Thing::body(2), &f.a.tree, b});
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

} // namespace
} // namespace trocar::spheretree
