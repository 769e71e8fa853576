// The whole-step search on equivalent inputs: corners of triangles turned and flipped, bodies swapped, everything
// moved and scaled so that no number is rounded. The answer may not differ by one pair.
#include "collision/search/contact_search.hpp"

#include "tests/collision/search_all.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::search_all;
using testing::Surface;

/// Body and vertices of either side, however its triangle was written: two vertices of an edge, one, or the three of a face, sorted.
using Side = std::array<Index, 4>;
using Key = std::pair<Side, Side>;

Side side_of(SurfaceIndex body, std::vector<Index> vertices) {
    std::sort(vertices.begin(), vertices.end());
    Side side{body, kNoIndex, kNoIndex, kNoIndex};
    std::copy(vertices.begin(), vertices.end(), side.begin() + 1);
    return side;
}

/// `first` of the two is called body 0 in the keys; the lesser side comes first, since an edge pair has no order.
std::set<Key> find_keys(const Surface& a, const Surface& b, bool swapped) {
    const std::array<const Surface*, 2> surfaces = swapped ? std::array{&b, &a} : std::array{&a, &b};
    std::vector<SearchContact> contacts;
    search_all(surfaces, {}, contacts);
    std::set<Key> keys;
    for (const SearchContact& c : contacts) {
        const auto body = [&](Thing of) { return static_cast<SurfaceIndex>(swapped ? 1 - of.index() : of.index()); };
        const Surface &one = *surfaces[c.contact.a.index()], &other = *surfaces[c.contact.b.index()];
        const auto edge = [](const Surface& s, Index id) {
            return std::vector<Index>(s.topology.edges[id].begin(), s.topology.edges[id].end());
        };
        const auto face = [](const Surface& s, Index id) { return std::vector<Index>(s.triangles[id].begin(), s.triangles[id].end()); };
        const bool vertex_face = c.contact.origin == ContactOrigin::ExactVF;
        Side x = side_of(body(c.contact.a), vertex_face ? std::vector<Index>{c.id_a} : edge(one, c.id_a));
        Side y = side_of(body(c.contact.b), vertex_face ? face(other, c.id_b) : edge(other, c.id_b));
        if (!vertex_face && y < x) std::swap(x, y);
        keys.emplace(x, y);
    }
    return keys;
}

/// The same triangles, each with its corners turned or flipped.
Surface rewritten(Surface s, Random& random) {
    for (Triangle& t : s.triangles) {
        std::rotate(t.begin(), t.begin() + static_cast<std::ptrdiff_t>(random.bits() % 3), t.end());
        if (random.bits() % 2 == 0) std::swap(t[1], t[2]);
    }
    s.close();
    return s;
}

Surface mapped(Surface s, double scale, const Vec3& away) {
    for (auto* list : {&s.t0, &s.t1})
        for (Vec3& p : *list) p = scale * (p + away);
    s.close();
    return s;
}

Surface backwards(Surface s) {
    std::swap(s.t0, s.t1);
    return s;
}

TEST(SearchSymmetry, OfLatticeSurfacesNoWritingChangesAPair) {
    std::size_t found = 0;
    for (std::uint64_t seed = 1; seed <= 6; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        const Surface a = testing::make_lattice_soup(random, 14, 12), b = testing::make_lattice_soup(random, 14, 12);
        const std::set<Key> keys = find_keys(a, b, false);
        found += keys.size();
        EXPECT_GT(keys.size(), 20u);
        EXPECT_EQ(find_keys(a, b, true), keys) << "bodies swapped";
        EXPECT_EQ(find_keys(backwards(a), backwards(b), false), keys) << "time reversed";
        for (int k = 0; k < 4; ++k) EXPECT_EQ(find_keys(rewritten(a, random), rewritten(b, random), false), keys) << "corners " << k;
        for (const double scale : {1.0, 0x1p20, 0x1p-40})
            for (const double away : {0.0, 0x1p15}) {
                const Vec3 shift = away * Vec3(1.0, -2.0, 1.0); // integers below 2^53: nothing is rounded
                EXPECT_EQ(find_keys(mapped(a, scale, shift), mapped(b, scale, shift), false), keys) << scale << ", " << away;
                EXPECT_EQ(find_keys(mapped(rewritten(a, random), scale, shift), mapped(rewritten(b, random), scale, shift), true), keys)
                    << "all at once, " << scale << ", " << away;
            }
    }
    std::printf("%zu pairs in 18 writings each\n", found);
}

} // namespace
} // namespace trocar::collision
