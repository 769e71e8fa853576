// The search of the step loop: the same contacts as every pair tested by itself, interrupted or not, without
// allocating.
#include "collision/search/interruptible_search.hpp"

#include "collision/search/contact_search.hpp"
#include "collision/ccd/ccd.hpp"
#include "collision/proximity/proximity.hpp"
#include "tests/collision/allocations.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::Surface;

/// Body and ids of both features, and the time: enough to tell contacts apart, the same for both orders of the bodies.
using Key = std::array<double, 8>;

Key key_of(const Contact& c) {
    const auto part = [](Thing body, const Index* feature, std::size_t count) {
        std::array<Index, 3> ids{kNoIndex, kNoIndex, kNoIndex};
        std::copy(feature, feature + count, ids.begin());
        std::sort(ids.begin(), ids.end());
        return std::array<double, 4>{double(body.code()), double(ids[0]), double(ids[1]), double(ids[2])};
    };
    auto a = part(c.a, c.feature_a, 2), b = part(c.b, c.feature_b, 3);
    if (b < a) std::swap(a, b);
    return {a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]};
}

std::multiset<Key> keys_of(std::span<const Contact> contacts) {
    std::multiset<Key> keys;
    for (const Contact& c : contacts) keys.insert(key_of(c));
    return keys;
}

struct Options {
    Thing a, b = Thing::body(1);
    PairOptions pair = {};
    TreeOptions tree = {};
};

struct Found {
    std::vector<Contact> contacts;
    ExactStats stats;
};

DopTree make_tree(const Surface& s, const TreeOptions& options = {}) {
    DopTree tree;
    tree.build(s.topology, s.t0, options);
    tree.refit(s.motion());
    return tree;
}

Found find_between(const Surface& a, const Surface& b, const Options& options, WorkBudget budget = WorkBudget()) {
    DopTree tree_a = make_tree(a, options.tree), tree_b = make_tree(b, options.tree);
    InterruptibleSearch search;
    Found found;
    found.stats =
        search.find({options.a, &tree_a, a.motion()}, {options.b, &tree_b, b.motion()}, options.pair, budget, found.contacts);
    return found;
}

Found find_within(const Surface& a, const Options& options) {
    DopTree tree = make_tree(a, options.tree);
    InterruptibleSearch search;
    WorkBudget budget;
    Found found;
    const SearchSide side{options.a, &tree, a.motion()};
    found.stats = search.find(side, side, options.pair, budget, found.contacts);
    return found;
}

SweptPoint swept(const Surface& s, Index v) { return {s.t0[v], s.t1[v]}; }

/// Every pair of features, no tree.
void add_vertex_face_keys(const Surface& a, const Surface& b, Thing body_a, Thing body_b, const PairOptions& options, bool self,
                          std::multiset<Key>& keys) {
    const SweepLimits limits{.distance = options.distance, .tolerance = options.tolerance};
    for (Index v = 0; v < a.t0.size(); ++v)
        for (const Triangle& t : b.triangles) {
            if (self && (t[0] == v || t[1] == v || t[2] == v)) continue;
            const std::array<SweptPoint, 3> face{swept(b, t[0]), swept(b, t[1]), swept(b, t[2])};
            if (!(options.distance > 0.0 ? sweep_vertex_face(swept(a, v), face, limits).hit() : ccd_vertex_face(swept(a, v), face).meets))
                continue;
            Contact c{.a = body_a, .b = body_b};
            c.feature_a[0] = v;
            std::copy(t.begin(), t.end(), c.feature_b);
            keys.insert(key_of(c));
        }
}

std::multiset<Key> brute_force(const Surface& a, const Surface& b, const Options& options, bool self) {
    std::multiset<Key> keys;
    const Thing body_b = self ? options.a : options.b;
    const SweepLimits limits{.distance = options.pair.distance, .tolerance = options.pair.tolerance};
    add_vertex_face_keys(a, b, options.a, body_b, options.pair, self, keys);
    if (!self) add_vertex_face_keys(b, a, options.b, options.a, options.pair, self, keys);
    for (Index i = 0; i < a.topology.edges.size(); ++i)
        for (Index k = self ? i + 1 : 0; k < b.topology.edges.size(); ++k) {
            const Edge &e = a.topology.edges[i], &f = b.topology.edges[k];
            if (self && (e[0] == f[0] || e[0] == f[1] || e[1] == f[0] || e[1] == f[1])) continue;
            const std::array<SweptPoint, 2> edge_a{swept(a, e[0]), swept(a, e[1])}, edge_b{swept(b, f[0]), swept(b, f[1])};
            if (!(limits.distance > 0.0 ? sweep_edge_edge(edge_a, edge_b, limits).hit() : ccd_edge_edge(edge_a, edge_b).meets)) continue;
            Contact c{.a = options.a, .b = body_b};
            std::copy(e.begin(), e.end(), c.feature_a);
            std::copy(f.begin(), f.end(), c.feature_b);
            keys.insert(key_of(c));
        }
    return keys;
}

/// Combinations that change what is culled, never what is found.
std::vector<TreeOptions> some_trees() {
    return {{},
            {.fine = true},
            {.dop = 18, .arity = 4, .cluster_size = 1, .builder = TreeBuilder::Middle, .fine = true},
            {.dop = 26, .arity = 2}};
}

TEST(InterruptibleSearch, FindsWhatEveryPairTestedByItselfFinds) {
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Surface a = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.3),
                      b = testing::make_triangle_soup(random, 80, 1.0, 0.3, 0.3);
        Options options{.pair = {.distance = seed % 2 ? 0.0 : 0.02}};
        const Found found = find_between(a, b, options);
        EXPECT_GT(found.contacts.size(), 50u);
        EXPECT_TRUE(found.stats.finished);
        EXPECT_EQ(keys_of(found.contacts), brute_force(a, b, options, false));
        EXPECT_EQ(found.stats.hits_vf + found.stats.hits_ee, found.contacts.size());
        const Found swapped = find_between(b, a, {.a = Thing::body(1), .b = Thing(), .pair = options.pair});
        EXPECT_EQ(keys_of(found.contacts), keys_of(swapped.contacts));
        for (const TreeOptions& tree : some_trees()) {
            options.tree = tree;
            const Found other = find_between(a, b, options);
            ASSERT_EQ(other.contacts.size(), found.contacts.size());
            for (std::size_t i = 0; i < found.contacts.size(); ++i) {
                EXPECT_EQ(key_of(found.contacts[i]), key_of(other.contacts[i]));
                EXPECT_EQ(found.contacts[i].time, other.contacts[i].time);
                EXPECT_EQ(found.contacts[i].normal, other.contacts[i].normal);
            }
            EXPECT_EQ(found.stats.safe_fraction, other.stats.safe_fraction);
        }
    }
}

TEST(InterruptibleSearch, FindsWithinOneSurfaceWhatEveryPairTestedByItselfFinds) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        Surface tube = testing::make_bent_tube(1.0, 0.1, 20, 8, 2.0);
        for (std::size_t v = 0; v < tube.t0.size(); ++v) tube.t1[v] = tube.t0[v] + random.vector(0.08);
        tube.triangles.push_back({0, 0, 5});         // repeated corner
        tube.triangles.push_back({3, 3, 3});         // a point
        tube.triangles.push_back(tube.triangles[7]); // duplicate
        tube.close();
        for (const double distance : {0.0, 0.01}) {
            Options options{.pair = {.distance = distance, .tolerance = 1e-3 * distance}};
            const auto expected = brute_force(tube, tube, options, true);
            EXPECT_GT(expected.size(), 20u);
            for (const TreeOptions& tree : some_trees()) {
                options.tree = tree;
                EXPECT_EQ(keys_of(find_within(tube, options).contacts), expected);
            }
        }
    }
}

TEST(InterruptibleSearch, TellsTheFeaturesThatContactsStandOn) {
    Random random(31);
    const Surface a = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.2), b = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.2);
    const Options options{.a = Thing::body(4), .b = Thing::body(7), .pair = {.distance = 0.05, .tolerance = 1e-4}};
    for (const Contact& c : find_between(a, b, options).contacts) {
        const Surface& body_a = c.a.index() == 4 ? a : b;
        const Surface& body_b = c.b.index() == 7 ? b : a;
        EXPECT_NE(c.a, c.b);
        const auto place = [&](const Surface& s, const Index* feature, const double* bary, int count, double t) {
            Vec3 p = Vec3::Zero();
            double sum = 0.0;
            for (int k = 0; k < count; ++k) {
                if (feature[k] == kNoIndex) continue;
                p += bary[k] * ((1.0 - t) * s.t0[feature[k]] + t * s.t1[feature[k]]);
                sum += bary[k];
            }
            EXPECT_NEAR(sum, 1.0, 1e-12);
            return p;
        };
        const Vec3 on_a = place(body_a, c.feature_a, c.bary_a, 2, c.time), on_b = place(body_b, c.feature_b, c.bary_b, 3, c.time);
        EXPECT_NEAR((on_b - c.point).norm(), 0.0, 1e-12);
        EXPECT_LE((on_a - on_b).norm(), 0.0501 + 1e-9);
        EXPECT_NEAR((on_a - on_b).normalized().dot(c.normal), 1.0, 1e-6);
        const Vec3 end = place(body_a, c.feature_a, c.bary_a, 2, 1.0) - place(body_b, c.feature_b, c.bary_b, 3, 1.0);
        EXPECT_NEAR(c.gap, c.normal.dot(end), 1e-12);
    }
}

TEST(InterruptibleSearch, SaysWhenItWasInterrupted) {
    Random random(32);
    const Surface a = testing::make_triangle_soup(random, 100, 1.0, 0.3, 0.2), b = testing::make_triangle_soup(random, 100, 1.0, 0.3, 0.2);
    const Found whole = find_between(a, b, {});
    const std::uint64_t cost = whole.stats.cluster_pairs + whole.stats.candidates_vf + whole.stats.candidates_ee;
    for (const std::uint64_t units : {std::uint64_t{0}, std::uint64_t{1}, cost / 2, cost - 1}) {
        const Found part = find_between(a, b, {}, WorkBudget(units));
        EXPECT_FALSE(part.stats.finished) << units;
        EXPECT_EQ(part.stats.safe_fraction, 0.0) << units;
        EXPECT_LE(part.contacts.size(), whole.contacts.size()) << units;
        if (units <= cost / 2) {
            EXPECT_LT(part.contacts.size(), whole.contacts.size()) << units;
        }
    }
    const Found enough = find_between(a, b, {}, WorkBudget(cost));
    EXPECT_TRUE(enough.stats.finished);
    EXPECT_EQ(enough.contacts.size(), whole.contacts.size());
}

TEST(InterruptibleSearch, TakesEmptyAndTinyBodies) {
    Surface empty, one;
    empty.close();
    one.t0 = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    one.t1 = one.t0;
    one.triangles = {{0, 1, 2}};
    one.close();
    Surface other = one;
    for (Vec3& p : other.t0) p += Vec3(0.1, 0.1, 0.5);
    for (Vec3& p : other.t1) p += Vec3(0.1, 0.1, -0.5);
    EXPECT_TRUE(find_between(empty, one, {}).contacts.empty());
    EXPECT_TRUE(find_within(empty, {}).contacts.empty());
    EXPECT_FALSE(find_between(one, other, {}).contacts.empty());
}

TEST(InterruptibleSearch, AVertexThatIsNotFiniteHidesNothing) {
    const Options options{.pair = {.distance = 1e-3}};
    Random random(33);
    Surface a = testing::make_triangle_soup(random, 40, 1.0, 0.3, 0.2), b = testing::make_triangle_soup(random, 40, 1.0, 0.3, 0.2);
    const auto before = keys_of(find_between(a, b, options).contacts);
    a.t1[7][1] = std::numeric_limits<double>::quiet_NaN();
    const auto after = keys_of(find_between(a, b, options).contacts);
    EXPECT_TRUE(std::includes(after.begin(), after.end(), before.begin(), before.end()));
}

TEST(Proximity, FindsTheTrianglesWithinARadius) {
    Random random(35);
    const Surface a = testing::make_triangle_soup(random, 300, 1.0, 0.2, 0.2);
    for (int trial = 0; trial < 200; ++trial) {
        DopTree tree = make_tree(a, some_trees()[static_cast<std::size_t>(trial) % some_trees().size()]);
        const Vec3 p = random.vector(1.0);
        std::set<Index> found, expected;
        for_each_close_triangle(tree, a.motion(), p, 0.3, [&](Index id, const PointOnTriangle& on) {
            EXPECT_LE(on.distance_sq, 0.09);
            EXPECT_TRUE(found.insert(id).second);
        });
        for (Index id = 0; id < a.triangles.size(); ++id) {
            const Triangle& t = a.triangles[id];
            if (closest_on_triangle(p, a.t1[t[0]], a.t1[t[1]], a.t1[t[2]]).distance_sq <= 0.09) expected.insert(id);
        }
        EXPECT_EQ(found, expected);
    }
}

/// A fast rod driven against and along a wall one triangle thin, its motion cut to the safe fraction: never on the
/// other side.
TEST(InterruptibleSearch, TheSafeFractionLetsNothingThroughAThinWall) {
    constexpr std::uint64_t kSeed = 36;
    Random random(kSeed);
    Surface wall;
    for (int i = 0; i <= 10; ++i)
        for (int k = 0; k <= 10; ++k) wall.t0.push_back({0.002 * (i - 5), 0.002 * (k - 5), 0.0});
    for (Index i = 0; i < 10; ++i)
        for (Index k = 0; k < 10; ++k) {
            const Index a = 11 * i + k;
            wall.triangles.push_back({a, a + 11, a + 1});
            wall.triangles.push_back({a + 1, a + 11, a + 12});
        }
    wall.t1 = wall.t0;
    wall.close();
    Surface rod = testing::make_bent_tube(0.01, 0.5e-3, 12, 8, 30.0);
    for (Vec3& p : rod.t0) p += Vec3(0.0, 0.0, 0.002);
    DopTree rod_tree = make_tree(rod), wall_tree = make_tree(wall);
    InterruptibleSearch search;
    std::vector<Contact> contacts;
    double moved = 0.0;
    int held = 0;
    for (int step = 0; step < 300; ++step) {
        const Vec3 push(random.real(-2e-3, 2e-3), random.real(-2e-3, 2e-3), random.real(-35e-3, 35e-3));
        for (std::size_t v = 0; v < rod.t0.size(); ++v) rod.t1[v] = rod.t0[v] + push + random.vector(2e-4);
        for (std::size_t v = 0; v < rod.t0.size(); ++v) // stays above the wall, and in reach
            rod.t1[v] = rod.t1[v].cwiseMax(Vec3(-8e-3, -8e-3, -1.0)).cwiseMin(Vec3(8e-3, 8e-3, 0.012));
        rod_tree.refit(rod.motion());
        WorkBudget budget;
        contacts.clear();
        const ExactStats stats = search.find({Thing::body(0), &rod_tree, rod.motion()}, {Thing::body(1), &wall_tree, wall.motion()},
                                             {.distance = 1e-4, .tolerance = 1e-6}, budget, contacts);
        held += stats.safe_fraction < 1.0;
        for (std::size_t v = 0; v < rod.t0.size(); ++v) {
            const Vec3 to = rod.t0[v] + stats.safe_fraction * (rod.t1[v] - rod.t0[v]);
            moved += (to - rod.t0[v]).norm();
            rod.t0[v] = to;
            ASSERT_GT(to[2], 0.0) << "seed " << kSeed << " step " << step << " vertex " << v;
        }
    }
    EXPECT_GT(moved, 0.1);
    EXPECT_GT(held, 50);
    rod.t1 = rod.t0;
    EXPECT_TRUE(find_between(rod, wall, {}).contacts.empty());
}

/// Phase by phase or all at once: the same contacts with the same bits.
TEST(InterruptibleSearch, GivesTheBitsOfContactSearch) {
    Random random(38);
    const Surface a = testing::make_triangle_soup(random, 200, 1.0, 0.2, 0.2), b = testing::make_triangle_soup(random, 250, 1.0, 0.2, 0.2);
    for (const double distance : {0.0, 0.02}) {
        SearchOptions options;
        options.distance = distance;
        options.within = false;
        const std::array<const SurfaceTopology*, 2> surfaces{&a.topology, &b.topology};
        const std::array<std::span<const Vec3>, 2> positions{a.t0, b.t0};
        const std::array<SurfaceMotion, 2> motions{a.motion(), b.motion()};
        ContactSearch search;
        search.build(surfaces, positions, options);
        search.refit(motions);
        search.find_candidates();
        std::vector<SearchContact> expected;
        search.decide(expected);
        const Found found = find_between(a, b, {.pair = {.distance = distance}});
        ASSERT_EQ(found.contacts.size(), expected.size());
        EXPECT_GT(expected.size(), 200u);
        for (std::size_t i = 0; i < expected.size(); ++i) {
            EXPECT_EQ(key_of(found.contacts[i]), key_of(expected[i].contact));
            EXPECT_EQ(found.contacts[i].time, expected[i].contact.time);
            EXPECT_EQ(found.contacts[i].point, expected[i].contact.point);
            EXPECT_EQ(found.contacts[i].gap, expected[i].contact.gap);
        }
        EXPECT_EQ(found.stats.safe_fraction, search.stats().safe_fraction);
        EXPECT_EQ(found.stats.candidates_ee, search.stats().candidates_ee);
    }
}

TEST(InterruptibleSearch, AllocatesNothingAfterTheFirstStep) {
    Random random(37);
    Surface a = testing::make_triangle_soup(random, 300, 1.0, 0.2, 0.2);
    const Surface b = testing::make_triangle_soup(random, 300, 1.0, 0.2, 0.2);
    DopTree tree_a = make_tree(a, {.fine = true}), tree_b = make_tree(b, {.fine = true});
    InterruptibleSearch search;
    std::vector<Contact> contacts;
    contacts.reserve(4096);
    std::size_t before = 0, first = 0;
    for (int step = 0; step < 4; ++step) {
        if (step == 1) before = testing::allocation_count();
        for (std::size_t v = 0; v < a.t0.size(); ++v) a.t1[v] += random.vector(0.02); // more contacts with every step
        contacts.clear();
        tree_a.refit(a.motion());
        tree_b.refit(b.motion());
        WorkBudget budget;
        (void)search.find({Thing::body(0), &tree_a, a.motion()}, {Thing::body(1), &tree_b, b.motion()}, {}, budget, contacts);
        if (step == 0) first = contacts.size();
    }
    EXPECT_EQ(testing::allocation_count() - before, 0u);
    EXPECT_GT(contacts.size(), first);
}

} // namespace
} // namespace trocar::collision
