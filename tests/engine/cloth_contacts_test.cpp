// Two frames of a cloth that falls on a ball, with lists of the pairs of triangles that cross in each: what crosses in one frame and
// not in the other came to cross, or ceased to, in between; that takes a contact of a vertex and a face or of two edges of the pair.
#include "base/self_intersection.hpp"
#include "collision/search/contact_search.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/read_surface.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <set>
#include <sstream>

namespace trocar::engine {
namespace {

using CrossingPair = std::array<Index, 2>;
using Feature = std::array<Index, 3>; // vertex ids ascending; kNoIndex for what it has not

std::set<CrossingPair> read_pairs(const std::filesystem::path& file) {
    const auto text = read_file_bytes(file);
    EXPECT_TRUE(text.ok());
    std::set<CrossingPair> pairs;
    if (!text) return pairs;
    std::istringstream lines(*text);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream numbers(line);
        CrossingPair pair{};
        if (line.starts_with('#') || !(numbers >> pair[0] >> pair[1])) continue;
        pairs.insert({std::min(pair[0], pair[1]), std::max(pair[0], pair[1])});
    }
    return pairs;
}

Feature feature(std::initializer_list<Index> ids) {
    Feature f{kNoIndex, kNoIndex, kNoIndex};
    std::copy(ids.begin(), ids.end(), f.begin());
    std::sort(f.begin(), f.end());
    return f;
}

using Hits = std::set<std::array<Feature, 2>>;

bool any_contact(const Triangle& s, const Triangle& t, const Hits& hits) {
    const auto hit = [&](const Feature& a, const Feature& b) { return hits.contains({a, b}) || hits.contains({b, a}); };
    for (std::size_t i = 0; i < 3; ++i) {
        if (hit(feature({s[i]}), feature({t[0], t[1], t[2]})) || hit(feature({t[i]}), feature({s[0], s[1], s[2]}))) return true;
        for (std::size_t k = 0; k < 3; ++k)
            if (hit(feature({s[i], s[(i + 1) % 3]}), feature({t[k], t[(k + 1) % 3]}))) return true;
    }
    return false;
}

/// Two frames of one surface, and the pairs of triangles that cross in each.
struct Frames {
    TriMesh t0, t1;
    std::set<CrossingPair> before, after;
};

void expect_explained(const Frames& frames, std::size_t least_contacts, std::size_t least_changed) {
    const auto topology = collision::make_topology(frames.t0.triangles, frames.t0.vertices.size());
    collision::ContactSearch search;
    const collision::SurfaceTopology* surface = &topology;
    const std::span<const Vec3> shape = frames.t0.vertices;
    search.build({&surface, 1}, {&shape, 1}, {});
    const collision::SurfaceMotion motion{&topology, frames.t0.vertices, frames.t1.vertices};
    search.refit({&motion, 1});
    search.find_candidates();
    std::vector<collision::SearchContact> contacts;
    search.decide(contacts);
    EXPECT_GT(contacts.size(), least_contacts);

    Hits hits;
    for (const collision::SearchContact& c : contacts) {
        const Contact& k = c.contact;
        if (k.origin == ContactOrigin::ExactVF)
            hits.insert({feature({k.feature_a[0]}), feature({k.feature_b[0], k.feature_b[1], k.feature_b[2]})});
        else
            hits.insert({feature({k.feature_a[0], k.feature_a[1]}), feature({k.feature_b[0], k.feature_b[1]})});
    }
    std::vector<CrossingPair> changed;
    std::set_symmetric_difference(frames.before.begin(), frames.before.end(), frames.after.begin(), frames.after.end(),
                                  std::back_inserter(changed));
    EXPECT_GT(changed.size(), least_changed);
    std::size_t unexplained = 0;
    const std::vector<Triangle>& triangles = frames.t0.triangles;
    for (const CrossingPair& pair : changed) unexplained += !any_contact(triangles[pair[0]], triangles[pair[1]], hits);
    std::printf("%zu contacts, %zu pairs of triangles changed, %zu of them without a contact\n", contacts.size(), changed.size(),
                unexplained);
    EXPECT_EQ(unexplained, 0u);
}

std::set<CrossingPair> crossing_pairs(const TriMesh& mesh) {
    std::set<CrossingPair> pairs;
    for (const auto& pair : find_self_intersections(mesh, 10'000'000).pairs) pairs.insert({pair[0], pair[1]});
    return pairs;
}

/// A cloth whose folds close on one another, ever more of them crossing.
TEST(ClothContacts, OfAMadeClothExplainEveryPairOfTrianglesThatCameToCrossOrCeasedTo) {
    for (const double fold : {0.9, 1.1, 1.5}) {
        SCOPED_TRACE(fold);
        Frames frames{made::make_drape(70, fold), made::make_drape(70, 1.1 * fold), {}, {}};
        frames.before = crossing_pairs(frames.t0);
        frames.after = crossing_pairs(frames.t1);
        expect_explained(frames, 100, 100);
    }
}

TEST(ClothContacts, ExplainEveryPairOfTrianglesThatCameToCrossOrCeasedTo) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    const std::filesystem::path folder = std::filesystem::path(data) / "cloth";
    if (!std::filesystem::exists(folder / "cloth_ball92.ply.gz")) GTEST_SKIP() << folder << " has no cloth_ball92.ply.gz";
    const auto t0 = read_surface(folder / "cloth_ball92.ply.gz"), t1 = read_surface(folder / "cloth_ball93.ply.gz");
    ASSERT_TRUE(t0.ok() && t1.ok());
    expect_explained({*t0, *t1, read_pairs(folder / "cloth_ball92.selfpairs.txt.gz"), read_pairs(folder / "cloth_ball93.selfpairs.txt.gz")},
                     100000, 10000);
}

} // namespace
} // namespace trocar::engine
