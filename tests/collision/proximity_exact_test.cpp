// Every switch that is called exact, on or off, gives what testing all faces against all others gives, to the bit.
#include "collision/search/contact_search.hpp"
#include "proximity_shapes.hpp"

#include <gtest/gtest.h>

#include <set>

namespace trocar::collision {
namespace {

using testing::Sequence;

struct Variant {
    std::string name;
    ProximityOptions options;
};

/// Every exact value of every switch, one at a time and all together.
std::vector<Variant> exact_variants(const ProximityOptions& base) {
    std::vector<Variant> all{{"as it is", base}};
    const auto add = [&](const std::string& name, auto change) {
        Variant variant{name, base};
        change(variant.options);
        all.push_back(variant);
    };
    for (const std::size_t dop : {6u, 14u, 26u}) add("k " + std::to_string(dop), [&](auto& o) { o.dop = dop; });
    for (const std::size_t arity : {2u, 8u}) add("arity " + std::to_string(arity), [&](auto& o) { o.arity = arity; });
    add("plain inflation", [](auto& o) { o.inflation = Inflation::Plain; });
    add("extrapolated vertices", [](auto& o) { o.inflation = Inflation::Swept; });
    for (const double tolerance : {1e-4, 0.01, 0.3})
        for (const Inflation inflation : {Inflation::Plain, Inflation::OrientedSafe, Inflation::Swept})
            add("lazy " + std::to_string(tolerance), [&](auto& o) {
                o.lazy_tolerance = tolerance;
                o.inflation = inflation;
            });
    add("significant velocities", [](auto& o) { o.significance = 0.01; });
    add("no cones", [](auto& o) { o.normal_cones = NormalCones::Off; });
    add("separation list", [](auto& o) { o.coherence = Coherence::SeparationList; });
    add("no SIMD", [](auto& o) { o.simd = false; });
    add("all together", [](auto& o) {
        o.coherence = Coherence::SeparationList;
        o.rebuild_after = 3;
        o.lazy_tolerance = 0.005;
        o.significance = 0.004;
        o.arity = 8;
        o.dop = 14;
    });
    return all;
}

/// returns   how many proximities there were
std::size_t expect_brute_force(const Sequence& sequence, const ProximityOptions& base) {
    std::vector<std::vector<Proximity>> truth(sequence.steps());
    std::size_t count = 0;
    for (std::size_t k = 0; k < sequence.steps(); ++k) {
        find_all_proximities(sequence.motions(k), base, truth[k]);
        count += truth[k].size();
    }
    for (const Variant& variant : exact_variants(base)) {
        SCOPED_TRACE(sequence.name + ", " + variant.name);
        if (variant.options.normal_cones == NormalCones::Off || base.self_distance == 0.0) {
            EXPECT_EQ(exactness_of(variant.options), Exactness::Exact);
        }
        ProximitySearch search;
        EXPECT_TRUE(sequence.build(search, variant.options).ok());
        std::vector<Proximity> found;
        ProximityStats stats;
        for (std::size_t k = 0; k < sequence.steps(); ++k) {
            const auto motions = sequence.motions(k);
            EXPECT_TRUE(search.refit(motions).ok());
            search.find(found);
            stats.add(search.stats());
            EXPECT_TRUE(std::equal(found.begin(), found.end(), truth[k].begin(), truth[k].end(), testing::same_bits))
                << "step " << k << ": " << found.size() << " instead of " << truth[k].size();
        }
        if (sequence.smooth && variant.options.normal_cones == NormalCones::Contour) {
            EXPECT_GT(stats.cone_skips, 0u) << "outlines were never believed: nothing is tested";
        }
    }
    return count;
}

TEST(Proximity, EveryExactSwitchGivesWhatBruteForceGivesOnASheetThatSinks) {
    for (const std::uint64_t seed : {1u, 2u}) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        const Sequence sequence = testing::make_sinking_sheet(seed, 7, 8);
        for (const double distance : {0.0, 1e-3, 0.03}) EXPECT_GT(expect_brute_force(sequence, {.distance = distance}), 30u);
        EXPECT_GT(expect_brute_force(sequence, {.distance = 0.02, .during_step = false}), 30u);
    }
}

TEST(Proximity, EveryExactSwitchGivesWhatBruteForceGivesOnASheetThatRollsThroughItself) {
    for (const std::uint64_t seed : {3u, 4u}) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        const Sequence sequence = testing::make_rolling_sheet(seed, 9, 8);
        EXPECT_GT(expect_brute_force(sequence, {}), 30u);
        EXPECT_GT(expect_brute_force(sequence, {.during_step = false}), 10u);
        EXPECT_GT(expect_brute_force(sequence, {.self_distance = 0.02, .normal_cones = NormalCones::Off}), 100u);
    }
}

TEST(Proximity, EveryExactSwitchGivesWhatBruteForceGivesOnSoups) {
    for (const double speed : {0.0, 0.02, 0.5}) {
        const Sequence sequence = testing::make_flying_soups(5, 70, speed, 4);
        SCOPED_TRACE(::testing::Message() << "seed 5, speed " << speed);
        EXPECT_GT(expect_brute_force(sequence, {.distance = 0.04}), 30u);
        EXPECT_GT(expect_brute_force(sequence, {.distance = 0.05, .self_distance = 0.05, .normal_cones = NormalCones::Off}), 30u);
    }
}

using FacePair = std::array<Index, 2>;

bool holds(const Triangle& t, Index v) { return t[0] == v || t[1] == v || t[2] == v; }

/// Faces of one surface whose corners hold all these vertices.
std::vector<Index> faces_around(const SurfaceTopology& surface, std::span<const Index> vertices) {
    std::vector<Index> faces;
    for (Index f = 0; f < surface.triangles.size(); ++f)
        if (std::all_of(vertices.begin(), vertices.end(), [&](Index v) { return holds(surface.triangles[f], v); })) faces.push_back(f);
    return faces;
}

/// The other exact search of this project works on features, by another tree and another broad phase.
TEST(Proximity, FacesThatMeetAreThoseWhoseFeaturesTheContactSearchFinds) {
    const Sequence sequence = testing::make_rolling_sheet(8, 10, 8);
    const SurfaceTopology& surface = sequence.surfaces[0];
    ContactSearch contacts;
    const SurfaceTopology* surfaces[] = {&surface};
    const std::span<const Vec3> positions[] = {sequence.frames[0][0]};
    contacts.build(surfaces, positions, {});
    ProximitySearch search;
    ASSERT_TRUE(sequence.build(search, {}).ok());
    std::vector<SearchContact> features;
    std::vector<Proximity> faces;
    std::size_t both = 0;
    for (std::size_t k = 0; k < sequence.steps(); ++k) {
        SCOPED_TRACE(::testing::Message() << "seed 8, step " << k);
        const auto motions = sequence.motions(k);
        contacts.refit(motions);
        contacts.find_candidates();
        contacts.decide(features);
        ASSERT_TRUE(search.refit(motions).ok());
        search.find(faces);
        std::set<FacePair> found, explained;
        for (const Proximity& p : faces) found.insert({p.face_a, p.face_b});
        for (const SearchContact& c : features) {
            const bool vertex_face = c.contact.origin == ContactOrigin::ExactVF;
            const auto around_a =
                faces_around(surface, vertex_face ? std::span(&c.id_a, 1) : std::span<const Index>(surface.edges[c.id_a]));
            const auto around_b = vertex_face ? std::vector<Index>{c.id_b} : faces_around(surface, surface.edges[c.id_b]);
            for (const Index a : around_a)
                for (const Index b : around_b) {
                    const Triangle &ta = surface.triangles[a], &tb = surface.triangles[b];
                    if (holds(tb, ta[0]) || holds(tb, ta[1]) || holds(tb, ta[2])) continue;
                    explained.insert({std::min(a, b), std::max(a, b)});
                }
        }
        for (const FacePair& pair : explained) EXPECT_TRUE(found.contains(pair)) << pair[0] << ' ' << pair[1];
        for (const Proximity& p : faces)
            if (p.found.time > 0.0) {
                EXPECT_TRUE(explained.contains({p.face_a, p.face_b})) << p.face_a << ' ' << p.face_b;
            }
        both += explained.size();
    }
    EXPECT_GT(both, 30u);
}

} // namespace
} // namespace trocar::collision
