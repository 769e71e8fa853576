// The whole-step search against every pair decided in rational arithmetic, and against itself with each technique changed.
#include "collision/search/contact_search.hpp"

#include "base/box.hpp"
#include "tests/collision/rational.hpp"
#include "tests/collision/search_all.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::search_all;
using testing::RationalPair;
using testing::Surface;
using testing::Verdict;

/// Vertex-face or edge-edge, bodies, ids: edges by their number, faces too.
using Key = std::array<Index, 5>;

Key key_of(const SearchContact& c) {
    return {c.contact.origin == ContactOrigin::ExactVF, static_cast<Index>(c.contact.a.index()), c.id_a, static_cast<Index>(c.contact.b.index()), c.id_b};
}

struct Found {
    std::vector<SearchContact> contacts;
    ExactStats stats;
    std::set<Key> keys() const {
        std::set<Key> out;
        for (const SearchContact& c : contacts) EXPECT_TRUE(out.insert(key_of(c)).second) << "found twice";
        return out;
    }
};

Found find(std::span<const Surface* const> surfaces, const SearchOptions& options) {
    Found found;
    found.stats = search_all(surfaces, options, found.contacts);
    return found;
}

SweptPoint swept(const Surface& s, Index v) { return {s.t0[v], s.t1[v]}; }

/// Every pair in rational arithmetic; what that does not know is left out of the comparison.
struct Truth {
    std::set<Key> meets, unknown;

    void add(const Key& key, bool vertex_face, const std::array<SweptPoint, 4>& points) {
        if (boxes_apart(vertex_face ? 1 : 2, points)) return;
        const Verdict verdict = RationalPair(vertex_face, points).verdict();
        if (verdict == Verdict::Meets) meets.insert(key);
        if (verdict == Verdict::Unknown) unknown.insert(key);
    }
    /// Along an axis all of the first `count` points stay on one side of all others: no need to compute more.
    static bool boxes_apart(std::size_t count, const std::array<SweptPoint, 4>& points) {
        Box3 first, second;
        for (std::size_t i = 0; i < 4; ++i)
            for (const Vec3& p : {points[i].t0, points[i].t1}) (i < count ? first : second).add(p);
        return !first.overlaps(second);
    }
    void add_vertex_face(const Surface& a, SurfaceIndex body_a, const Surface& b, SurfaceIndex body_b) {
        for (Index v = 0; v < a.t0.size(); ++v)
            for (Index f = 0; f < b.triangles.size(); ++f) {
                const Triangle& t = b.triangles[f];
                if (body_a == body_b && (t[0] == v || t[1] == v || t[2] == v)) continue;
                if (a.topology.vertex_owner[v] == kNoIndex) continue;
                add({1, body_a, v, body_b, f}, true, {swept(a, v), swept(b, t[0]), swept(b, t[1]), swept(b, t[2])});
            }
    }
    void add_edge_edge(const Surface& a, SurfaceIndex body_a, const Surface& b, SurfaceIndex body_b) {
        for (Index i = 0; i < a.topology.edges.size(); ++i)
            for (Index k = body_a == body_b ? i + 1 : 0; k < b.topology.edges.size(); ++k) {
                const Edge &e = a.topology.edges[i], &f = b.topology.edges[k];
                if (body_a == body_b && (e[0] == f[0] || e[0] == f[1] || e[1] == f[0] || e[1] == f[1])) continue;
                add({0, body_a, i, body_b, k}, false, {swept(a, e[0]), swept(a, e[1]), swept(b, f[0]), swept(b, f[1])});
            }
    }
};

std::set<Key> without(const std::set<Key>& keys, const std::set<Key>& left_out) {
    std::set<Key> out;
    std::set_difference(keys.begin(), keys.end(), left_out.begin(), left_out.end(), std::inserter(out, out.end()));
    return out;
}

TEST(ContactSearch, FindsWhatRationalArithmeticFindsOfEveryPair) {
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Surface a = testing::make_triangle_soup(random, 14, 1.0, 0.7, 0.7),
                      b = testing::make_triangle_soup(random, 12, 1.0, 0.7, 0.7);
        const std::array<const Surface*, 2> surfaces{&a, &b};
        Truth truth;
        truth.add_vertex_face(a, 0, b, 1);
        truth.add_vertex_face(b, 1, a, 0);
        truth.add_edge_edge(a, 0, b, 1);
        truth.add_vertex_face(a, 0, a, 0);
        truth.add_edge_edge(a, 0, a, 0);
        truth.add_vertex_face(b, 1, b, 1);
        truth.add_edge_edge(b, 1, b, 1);
        EXPECT_GT(truth.meets.size(), 25u);
        EXPECT_EQ(truth.unknown.size(), 0u);
        EXPECT_EQ(find(surfaces, {}).keys(), truth.meets);
    }
}

TEST(ContactSearch, FindsDegenerateContactsAsRationalArithmeticDoes) {
    std::size_t meets = 0, unknown = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
        SCOPED_TRACE(seed);
        Random random(seed);
        const Surface a = testing::make_lattice_soup(random, 12, 8);
        const std::array<const Surface*, 1> surfaces{&a};
        Truth truth;
        truth.add_vertex_face(a, 0, a, 0);
        truth.add_edge_edge(a, 0, a, 0);
        meets += truth.meets.size();
        unknown += truth.unknown.size();
        EXPECT_EQ(without(find(surfaces, {}).keys(), truth.unknown), truth.meets);
    }
    std::printf("%zu meet, %zu not known to the rational test\n", meets, unknown);
    EXPECT_GT(meets, 100u);
    EXPECT_LT(unknown, meets / 2);
}

void expect_same_bits(const Found& a, const Found& b) {
    ASSERT_EQ(a.contacts.size(), b.contacts.size());
    for (std::size_t i = 0; i < a.contacts.size(); ++i) {
        EXPECT_EQ(key_of(a.contacts[i]), key_of(b.contacts[i]));
        EXPECT_EQ(a.contacts[i].contact.time, b.contacts[i].contact.time);
        EXPECT_EQ(a.contacts[i].contact.normal, b.contacts[i].contact.normal);
        EXPECT_EQ(a.contacts[i].contact.point, b.contacts[i].contact.point);
    }
}

TEST(ContactSearch, TreeBuilderInstructionSetAndThreadsChangeNothing) {
    Random random(5);
    const Surface a = testing::make_triangle_soup(random, 400, 1.0, 0.15, 0.2), b = testing::make_bent_tube(2.0, 0.3, 40, 24, 1.0);
    Surface moved = b;
    for (Vec3& p : moved.t1) p += Vec3(0.05, 0.02, -0.1);
    const std::array<const Surface*, 2> surfaces{&a, &moved};
    for (const double distance : {0.0, 0.01}) {
        SearchOptions options;
        options.distance = distance;
        options.tolerance = 1e-9 * distance;
        const Found usual = find(surfaces, options);
        EXPECT_GT(usual.contacts.size(), 300u);
        std::size_t turn = 0; // builders and cluster sizes take turns
        for (const std::size_t dop : {6, 14, 18, 26})
            for (const std::size_t arity : {2, 4, 8}) {
                const TreeBuilder builder = std::array{TreeBuilder::Sah, TreeBuilder::Median, TreeBuilder::Middle}[turn % 3];
                const std::size_t cluster = std::array<std::size_t, 5>{1, 5, 16, 32, 64}[turn++ % 5];
                SCOPED_TRACE(::testing::Message() << "dop " << dop << " arity " << arity << " cluster " << cluster);
                options.tree = {dop, arity, cluster, builder, turn % 2 == 0};
                const Found other = find(surfaces, options);
                EXPECT_EQ(usual.keys(), other.keys());
                expect_same_bits(usual, other);
                SearchOptions plain = options;
                plain.simd = false;
                plain.threads = 2;
                const Found twin = find(surfaces, plain);
                expect_same_bits(other, twin);
                EXPECT_EQ(other.stats.candidates_ee, twin.stats.candidates_ee);
                EXPECT_EQ(other.stats.candidates_vf, twin.stats.candidates_vf);
            }
    }
}

TEST(ContactSearch, CullsNothingThatEveryPairWouldFind) {
    Random random(6);
    const Surface a = testing::make_triangle_soup(random, 120, 1.0, 0.2, 0.3);
    const std::array<const Surface*, 1> surfaces{&a};
    for (const double distance : {0.0, 0.02}) {
        SearchOptions options;
        options.distance = distance;
        options.tolerance = 1e-9 * distance;
        const Found usual = find(surfaces, options);
        options.all_pairs = true;
        const Found all = find(surfaces, options);
        EXPECT_EQ(usual.keys(), all.keys());
        EXPECT_GT(all.stats.candidates_ee, 10 * usual.stats.candidates_ee);
        EXPECT_EQ(all.stats.candidates_vf, 360u * 119u);
    }
}

TEST(ContactSearch, IsTheSameForTimeReversedBodiesSwappedAndPowersOfTwo) {
    Random random(7);
    Surface a = testing::make_triangle_soup(random, 150, 1.0, 0.2, 0.3), b = testing::make_triangle_soup(random, 150, 1.0, 0.2, 0.3);
    const std::array<const Surface*, 2> surfaces{&a, &b}, swapped{&b, &a};
    const Found one = find(surfaces, {});
    EXPECT_EQ(find(swapped, {}).contacts.size(), one.contacts.size());
    for (Surface* s : {&a, &b}) std::swap(s->t0, s->t1);
    EXPECT_EQ(find(surfaces, {}).keys(), one.keys());
    for (Surface* s : {&a, &b})
        for (auto* list : {&s->t0, &s->t1})
            for (Vec3& p : *list) p *= 0x1p-40;
    EXPECT_EQ(find(surfaces, {}).keys(), one.keys());
}

TEST(ContactSearch, TakesEmptySingleAndOverlappingSurfaces) {
    Surface empty, single;
    empty.close();
    single.t0 = single.t1 = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)};
    single.triangles = {{0, 1, 2}};
    single.close();
    const std::array<const Surface*, 3> surfaces{&empty, &single, &single};
    const Found found = find(surfaces, {});
    // two copies of one triangle: 2 x 3 vertices on faces, and all 9 pairs of edges touch
    EXPECT_EQ(found.stats.hits_vf, 6u);
    EXPECT_EQ(found.stats.hits_ee, 9u);
    for (const SearchContact& c : found.contacts) EXPECT_EQ(c.contact.time, 0.0);
}

} // namespace
} // namespace trocar::collision
