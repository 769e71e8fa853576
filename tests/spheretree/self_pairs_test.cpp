// A body against itself: nothing that meets far from where it grew is missed, whatever the budget; neighbours are left alone.
#include "base/self_intersection.hpp"
#include "shapes.hpp"
#include "spheretree/update/covering_tree.hpp"
#include "spheretree/traverse/descent.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {
namespace {

/// A tube of 0.3 m, rolled up into a spiral that passes through itself in its second turn.
struct Spiral {
    TriMesh rest = test::make_straight_tube(0.01, 0.3, 12, 60);
    CoveringTree covering = build_covering_tree(rest);
    std::vector<Vec3> now;
    std::vector<Sphere> spheres;
    std::vector<Index> leaf_of;

    Spiral() {
        for (const Vec3& p : rest.vertices) {
            const double angle = p.z() / 0.03, radius = 0.03 + p.x() + 0.008 * angle / 6.28;
            now.emplace_back(radius * std::cos(angle), p.y(), radius * std::sin(angle));
        }
        update_covering_spheres(covering, now, now, spheres);
        leaf_of.resize(rest.triangles.size());
        for (Index s = 0; s < covering.tree.sphere_count(); ++s)
            if (covering.tree.is_leaf(s))
                for (const Index t : covering.tree.items_of(s)) leaf_of[t] = s;
    }
    [[nodiscard]] bool lay_apart(Index s, Index t) const {
        const Sphere &a = covering.tree.spheres[s], &b = covering.tree.spheres[t];
        return (a.centre - b.centre).norm() > a.radius + b.radius;
    }
    [[nodiscard]] bool is_beneath(Index leaf, Index sphere) const {
        const SphereTree& tree = covering.tree;
        return tree.item_begin[sphere] <= tree.item_begin[leaf] && tree.item_end[leaf] <= tree.item_end[sphere];
    }
    [[nodiscard]] std::vector<Contact> run(std::uint64_t units, DescentStats& stats) const {
        Descent descent;
        descent.begin(0.0);
        descent.add_self_pair({Thing::body(7), &covering.tree, spheres});
        WorkBudget budget(units);
        descent.run(budget);
        std::vector<Contact> contacts;
        descent.add_contacts(contacts);
        stats = descent.stats();
        return contacts;
    }
};

TEST(SelfPairs, AtAnyBudgetEveryCrossingOfLeavesThatLayApartIsBeneathAReportedPair) {
    const Spiral spiral;
    TriMesh rolled = spiral.rest;
    rolled.vertices = spiral.now;
    const SelfIntersections crossings = find_self_intersections(rolled);
    std::size_t looked_at = 0;
    for (const std::uint64_t units : {0u, 1u, 2u, 9u, 40u, 150u, 600u, 3000u, 20000u, 1000000u}) {
        DescentStats stats;
        const std::vector<Contact> contacts = spiral.run(units, stats);
        for (const auto& [t, u] : crossings.pairs) {
            const Index a = spiral.leaf_of[t], b = spiral.leaf_of[u];
            if (a == b || !spiral.lay_apart(a, b)) continue;
            ++looked_at;
            EXPECT_TRUE(std::any_of(contacts.begin(), contacts.end(),
                                    [&](const Contact& c) {
                                        const Index s = c.feature_a[0], r = c.feature_b[0];
                                        return (spiral.is_beneath(a, s) && spiral.is_beneath(b, r)) ||
                                               (spiral.is_beneath(a, r) && spiral.is_beneath(b, s));
                                    }))
                << "triangles " << t << " and " << u << " under " << units;
        }
    }
    EXPECT_GT(looked_at, 1000u);
}

TEST(SelfPairs, AreThoseOfBruteForceEachOnce) {
    const Spiral spiral;
    DescentStats stats;
    const std::vector<Contact> contacts = spiral.run(WorkBudget::kUnlimited, stats);
    std::vector<std::pair<Index, Index>> found, wanted;
    for (const Contact& c : contacts) {
        EXPECT_EQ(c.a, Thing::body(7));
        EXPECT_EQ(c.b, Thing::body(7));
        EXPECT_EQ(c.origin, ContactOrigin::TestedSpheres);
        found.emplace_back(std::minmax(c.feature_a[0], c.feature_b[0]));
    }
    const SphereTree& tree = spiral.covering.tree;
    for (Index s = 0; s < tree.sphere_count(); ++s)
        for (Index t = s + 1; t < tree.sphere_count(); ++t)
            if (tree.is_leaf(s) && tree.is_leaf(t) && spiral.lay_apart(s, t) &&
                (spiral.spheres[s].centre - spiral.spheres[t].centre).norm() <= spiral.spheres[s].radius + spiral.spheres[t].radius)
                wanted.emplace_back(s, t);
    std::sort(found.begin(), found.end());
    EXPECT_EQ(found, wanted);
    EXPECT_GT(wanted.size(), 50u);
    EXPECT_EQ(stats.pairs_open, 0u);
    EXPECT_LT(stats.pairs_tested, tree.sphere_count() * tree.sphere_count() / 4) << "it is a hierarchy";
}

TEST(SelfPairs, OfABodyAtRestThereAreNone) {
    const Spiral spiral;
    Descent descent;
    descent.begin(0.0);
    descent.add_self_pair({Thing::body(0), &spiral.covering.tree, spiral.covering.tree.spheres});
    WorkBudget budget;
    EXPECT_TRUE(descent.run(budget));
    EXPECT_EQ(descent.stats().leaf_contacts, 0u);
    const CoveringTree small = build_covering_tree({{Vec3::Zero(), Vec3::UnitX(), Vec3::UnitY()}, {{0, 1, 2}}});
    descent.begin(0.0);
    descent.add_self_pair({Thing::body(0), &small.tree, small.tree.spheres});
    WorkBudget nothing(0);
    EXPECT_TRUE(descent.run(nothing)) << "one leaf: nothing to test";
}

} // namespace
} // namespace trocar::spheretree
