// Heuristic switches are called so, lose what they are said to lose and no more; hostile steps and inputs.
#include "allocations.hpp"
#include "proximity_shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>

namespace trocar::collision {
namespace {

using testing::Sequence;
using FacePair = std::array<Index, 4>;

std::set<FacePair> pairs_of(const std::vector<Proximity>& all) {
    std::set<FacePair> pairs;
    for (const Proximity& p : all) pairs.insert({p.surface_a, p.surface_b, p.face_a, p.face_b});
    return pairs;
}

struct Loss {
    std::size_t true_ones = 0, found = 0, lost = 0, invented = 0;
    double nearest_lost = std::numeric_limits<double>::infinity(); // m, at any of the times that are known
};

Loss measure_loss(const Sequence& sequence, const ProximityOptions& options) {
    Loss loss;
    ProximitySearch search;
    EXPECT_TRUE(sequence.build(search, options).ok());
    std::vector<Proximity> found, truth;
    for (std::size_t k = 0; k < sequence.steps(); ++k) {
        const auto motions = sequence.motions(k);
        EXPECT_TRUE(search.refit(motions).ok());
        search.find(found);
        ProximityOptions exact = options;
        exact.leaf_test = LeafTest::Faces;
        find_all_proximities(motions, exact, truth);
        const auto have = pairs_of(found), want = pairs_of(truth);
        loss.true_ones += want.size();
        loss.found += have.size();
        for (const FacePair& pair : have) loss.invented += !want.contains(pair);
        for (const Proximity& p : truth)
            if (!have.contains({p.surface_a, p.surface_b, p.face_a, p.face_b})) {
                ++loss.lost;
                loss.nearest_lost = std::min(loss.nearest_lost, p.found.points.distance);
            }
    }
    return loss;
}

TEST(ProximityHeuristics, LoseSomeInventNothingAndAreCalledHeuristic) {
    const Sequence sinking = testing::make_sinking_sheet(21, 8, 8), rolling = testing::make_rolling_sheet(22, 10, 10);
    const auto expect_loss = [](const char* name, const Sequence& sequence, const ProximityOptions& options) {
        const Loss loss = measure_loss(sequence, options);
        std::printf("%-28s lost %zu of %zu\n", name, loss.lost, loss.true_ones);
        EXPECT_EQ(exactness_of(options), Exactness::Heuristic) << name;
        EXPECT_EQ(loss.invented, 0u) << name;
        EXPECT_LT(loss.lost, loss.true_ones) << name;
        return loss.lost;
    };
    EXPECT_GT(expect_loss("vertices against faces", sinking, {.distance = 0.004, .leaf_test = LeafTest::Vertices}), 0u);
    EXPECT_GT(expect_loss("angle of leaf faces", rolling, {.self_distance = 0.12, .normal_cones = NormalCones::Off, .leaf_angle = 0.5}),
              0u);
    EXPECT_GT(expect_loss("cones alone, proximities", rolling, {.self_distance = 0.12, .normal_cones = NormalCones::Alone}), 0u);
    EXPECT_GT(expect_loss("cones and groups", rolling, {.self_distance = 0.12, .normal_cones = NormalCones::Groups}), 0u);
    EXPECT_GT(expect_loss("cones and contours", rolling, {.self_distance = 0.12}), 0u);
    const Sequence soups = testing::make_flying_soups(23, 60, 0.5, 4); // corners of one face fly apart
    EXPECT_GT(expect_loss("oriented inflation, paper", soups, {.distance = 0.02, .within = 0, .inflation = Inflation::OrientedPaper}), 0u);
    expect_loss("velocity cones' reuse", sinking, {.distance = 0.03, .coherence = Coherence::VelocityCones, .reuse_limit = 0.02});
}

/// A C of flat strip whose arms are pushed over each other: figure 5 of Mezger et al. 2003. Cones alone see a flat piece.
TEST(ProximityHeuristics, AFlatPieceWithAConcaveOutlineIsMissedByConesAndFoundWithContoursOrGroups) {
    Sequence s{.name = "C", .surfaces = {}, .frames = {}};
    std::vector<Vec3> open;
    constexpr Index kParts = 24;
    std::vector<Triangle> triangles;
    for (Index i = 0; i <= kParts; ++i)
        for (const double radius : {0.6, 1.0}) {
            const double angle = 5.6 * static_cast<double>(i) / kParts;
            open.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0.05 * std::sin(2.0 * angle));
        }
    for (Index i = 0; i < kParts; ++i) {
        const Index a = 2 * i, b = a + 1, c = a + 2, d = a + 3;
        triangles.push_back({a, b, d});
        triangles.push_back({a, d, c});
    }
    std::vector<Vec3> shut = open;
    for (std::size_t v = 40; v < open.size(); ++v) shut[v] += Vec3(0.1, 0.7, v % 2 == 0 ? 0.0 : 0.12);
    s.surfaces.push_back(make_topology(triangles, open.size()));
    s.frames = {{open}, {shut}, {shut}};
    EXPECT_GT(measure_loss(s, {.normal_cones = NormalCones::Alone}).lost, 0u);
    EXPECT_EQ(measure_loss(s, {.normal_cones = NormalCones::Contour}).lost, 0u);
    EXPECT_EQ(measure_loss(s, {.normal_cones = NormalCones::Groups, .group_count = 8}).lost, 0u);
    EXPECT_GT(measure_loss(s, {}).true_ones, 0u);
}

TEST(ProximityHeuristics, ReuseLosesNothingNearerThanItsBound) {
    for (const std::uint64_t seed : {31u, 32u, 33u}) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        for (const double limit : {0.002, 0.01, 0.014}) {
            const ProximityOptions options{.distance = 0.03,
                                           .during_step = false,
                                           .inflation = Inflation::Plain,
                                           .coherence = Coherence::VelocityCones,
                                           .reuse_limit = limit};
            Sequence slow = testing::make_sinking_sheet(seed, 8, 2);
            const auto first = slow.frames[0], last = slow.frames[2];
            slow.frames.clear();
            for (int k = 0; k <= 24; ++k) { // a slow way from one to the other
                slow.frames.push_back(first);
                for (std::size_t v = 0; v < first[1].size(); ++v) slow.frames.back()[1][v] += k / 24.0 * (last[1][v] - first[1][v]);
            }
            for (auto& frame : slow.frames)
                for (Vec3& p : frame[1]) p[2] -= 0.07;
            const Loss loss = measure_loss(slow, options);
            std::printf("limit %.3f: lost %zu of %zu, nearest %.4f\n", limit, loss.lost, loss.true_ones, loss.nearest_lost);
            EXPECT_EQ(loss.invented, 0u);
            EXPECT_GT(loss.true_ones, 100u);
            EXPECT_GE(loss.nearest_lost, 0.03 - 2.0 * limit);
        }
    }
}

TEST(ProximityHeuristics, ReuseForgetsWhatATeleportOrAnUnseenStepMovedAway) {
    Sequence s = testing::make_sinking_sheet(41, 8, 6);
    for (std::size_t k = 1; k < s.frames.size(); ++k) { // static, but for one jump between steps
        s.frames[k] = s.frames[0];
        for (Vec3& p : s.frames[k][1]) p[2] -= k >= 3 ? 0.2 : 0.05;
    }
    const ProximityOptions options{
        .distance = 0.03, .during_step = false, .inflation = Inflation::Plain, .coherence = Coherence::VelocityCones, .reuse_limit = 0.01};
    ProximitySearch search;
    ASSERT_TRUE(s.build(search, options).ok());
    std::vector<Proximity> found, truth;
    for (const std::size_t k : {1u, 1u, 4u, 4u, 1u}) {
        const std::vector<SurfaceMotion> still{{&s.surfaces[0], s.frames[k][0], s.frames[k][0]},
                                               {&s.surfaces[1], s.frames[k][1], s.frames[k][1]}};
        ASSERT_TRUE(search.refit(still).ok());
        search.find(found);
        find_all_proximities(still, options, truth);
        EXPECT_EQ(pairs_of(found), pairs_of(truth)) << "frame " << k;
    }
    const auto moving = s.motions(2); // refitted without a find(): then a static step at its end
    ASSERT_TRUE(search.refit(moving).ok());
    const std::vector<SurfaceMotion> after{{&s.surfaces[0], s.frames[3][0], s.frames[3][0]},
                                           {&s.surfaces[1], s.frames[3][1], s.frames[3][1]}};
    ASSERT_TRUE(search.refit(after).ok());
    search.find(found);
    find_all_proximities(after, options, truth);
    EXPECT_EQ(pairs_of(found), pairs_of(truth));
    EXPECT_EQ(search.stats().kept_nodes, 0u);
}

/// Every exact way of coherence against brute force, on one sequence.
void expect_exact(const Sequence& sequence, const ProximityOptions& base) {
    for (const Inflation inflation : {Inflation::Plain, Inflation::OrientedSafe, Inflation::Swept})
        for (const double lazy : {0.0, 0.05})
            for (const Coherence coherence : {Coherence::None, Coherence::SeparationList}) {
                ProximityOptions options = base;
                options.inflation = inflation;
                options.lazy_tolerance = lazy;
                options.coherence = coherence;
                ASSERT_EQ(exactness_of(options), Exactness::Exact);
                const Loss loss = measure_loss(sequence, options);
                EXPECT_EQ(loss.lost + loss.invented, 0u) << sequence.name;
                EXPECT_GT(loss.true_ones, 0u) << sequence.name;
            }
}

TEST(ProximityHardCases, StepsOfTenBodySizesAlternatingWithStillness) {
    Sequence s = testing::make_sinking_sheet(51, 5, 7);
    s.name = "ten body sizes, every other step";
    for (std::size_t k = 1; k < s.frames.size(); ++k)
        if (k % 4 >= 2) // moves away in one step, stays, comes back in one step, stays
            for (auto& body : s.frames[k])
                for (Vec3& p : body) p += Vec3(10.0, -4.0, 3.0);
    expect_exact(s, {.distance = 0.02});
}

TEST(ProximityHardCases, OneBodyFliesThroughTheOther) {
    Sequence s = testing::make_sinking_sheet(52, 5, 5);
    s.name = "flying through";
    for (std::size_t k = 0; k < s.frames.size(); ++k)
        for (Vec3& p : s.frames[k][1]) p += Vec3(0.0, 0.0, k % 2 == 0 ? 10.0 : -10.0);
    expect_exact(s, {.distance = 0.02});
}

TEST(ProximityHardCases, DistanceLargerThanTheBodies) {
    const Sequence s = testing::make_sinking_sheet(53, 4, 2);
    expect_exact(s, {.distance = 25.0});
    EXPECT_EQ(measure_loss(s, {.distance = 25.0}).true_ones, 2u * 32u * 32u);
}

TEST(ProximityHardCases, EverythingStill) {
    Sequence s = testing::make_sinking_sheet(54, 5, 6);
    for (auto& frame : s.frames) frame = s.frames[6];
    expect_exact(s, {.distance = 0.02});
}

TEST(ProximityHardCases, DegenerateAndRepeatedFacesAndFarAwayCoordinates) {
    Sequence s = testing::make_sinking_sheet(55, 4, 3);
    s.name = "degenerate";
    std::vector<Triangle> triangles = s.surfaces[0].triangles;
    triangles.push_back({3, 3, 3});
    triangles.push_back({0, 7, 7});
    triangles.push_back(triangles[5]);
    triangles.push_back({0, 12, 24});
    s.surfaces[0] = make_topology(triangles, 25);
    for (auto& frame : s.frames) frame[0][6] = frame[0][7]; // a face without area
    expect_exact(s, {.distance = 0.02});
    for (auto& frame : s.frames)
        for (auto& body : frame)
            for (Vec3& p : body) p = 1e6 * p + Vec3(1e9, 0.0, -3e9);
    expect_exact(s, {.distance = 2e4});
}

TEST(ProximityHardCases, FacesAtAllScalesFromTheSmallestToTheLargest) {
    Sequence s{.name = "all scales", .surfaces = {}, .frames = {}};
    std::vector<Triangle> triangles;
    std::vector<Vec3> at;
    for (double scale = 1e-30; scale < 1e30; scale *= 2.0) { // each cut through the middle splits off one face
        const auto first = static_cast<Index>(at.size());
        for (const Vec3& corner : {Vec3(1.0, 0.0, 0.0), Vec3(1.0, 0.3, 0.0), Vec3(1.0, 0.0, 0.3)}) at.push_back(scale * corner);
        triangles.push_back({first, first + 1, first + 2});
    }
    for (int i = 0; i < 2; ++i) s.surfaces.push_back(make_topology(triangles, at.size()));
    std::vector<Vec3> moved = at;
    for (Vec3& p : moved) p[1] += 0.1 * p[0];
    s.frames = {{at, moved}, {moved, at}, {at, at}};
    expect_exact(s, {.distance = 1e-3, .within = 0});
    expect_exact(s, {.distance = 1e20, .within = 0});
}

TEST(ProximityHardCases, NothingAndOneFace) {
    Sequence s{.name = "nothing", .surfaces = {make_topology({}, 0), make_topology(std::vector<Triangle>{{0, 1, 2}}, 3)}, .frames = {}};
    s.frames.assign(2, {{}, {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)}});
    for (const Coherence coherence : {Coherence::None, Coherence::SeparationList, Coherence::VelocityCones})
        EXPECT_EQ(measure_loss(s, {.distance = 1.0, .coherence = coherence, .reuse_limit = 0.1}).found, 0u);
    ProximitySearch search;
    ASSERT_TRUE(search.build({}, {}, {}).ok());
    ASSERT_TRUE(search.refit({}).ok());
    std::vector<Proximity> found;
    search.find(found);
    EXPECT_TRUE(found.empty());
}

TEST(ProximityHardCases, InputThatIsNotFiniteOrOfAnotherConnectivityIsRefusedByName) {
    Sequence s = testing::make_sinking_sheet(61, 4, 3);
    ProximitySearch search;
    ASSERT_TRUE(s.build(search, {.distance = 0.05}).ok());
    const auto expect_refused = [&](std::span<const SurfaceMotion> motions, const std::string& part) {
        const auto refused = search.refit(motions);
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.error().to_string().find(part), std::string::npos) << refused.error().to_string();
    };
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), -1e31}) {
        Sequence broken = testing::make_sinking_sheet(61, 4, 3);
        broken.frames[1][1][7][2] = bad;
        auto motions = broken.motions(0);
        for (std::size_t i = 0; i < 2; ++i) motions[i].topology = &s.surfaces[i];
        expect_refused(motions, "body 1, vertex 7, z at t1");
        ProximitySearch other;
        broken.frames[0] = broken.frames[1];
        EXPECT_FALSE(broken.build(other, {}).ok());
    }
    auto motions = s.motions(0);
    const SurfaceTopology swapped = s.surfaces[1];
    motions[1].topology = &swapped;
    expect_refused(motions, "body 1 has another connectivity");
    motions = s.motions(0);
    motions[1].t1 = motions[1].t1.first(20);
    expect_refused(motions, "20 positions for 25 vertices");
    motions = s.motions(0);
    std::swap(s.surfaces[1].triangles[3], s.surfaces[1].triangles[4]); // the same object, changed
    expect_refused(motions, "body 1 has another connectivity");
    std::swap(s.surfaces[1].triangles[3], s.surfaces[1].triangles[4]);
    expect_refused(std::span(motions).first(1), "1 motions for 2 surfaces");
    ASSERT_TRUE(search.refit(motions).ok()); // none of them has harmed it
    std::vector<Proximity> found, truth;
    search.find(found);
    find_all_proximities(motions, search.options(), truth);
    EXPECT_EQ(pairs_of(found), pairs_of(truth));
}

TEST(ProximityHardCases, OptionsThatAreNotPossibleAreRefusedByName) {
    const Sequence s = testing::make_sinking_sheet(62, 2, 1);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto expect_refused = [&](const ProximityOptions& options, const std::string& key) {
        ProximitySearch search;
        const auto refused = s.build(search, options);
        ASSERT_FALSE(refused.ok()) << key;
        EXPECT_EQ(refused.error().key, key);
    };
    expect_refused({.distance = nan}, "distance");
    expect_refused({.distance = -1.0}, "distance");
    expect_refused({.self_distance = nan}, "self_distance");
    expect_refused({.dop = 16}, "dop");
    expect_refused({.arity = 3}, "arity");
    expect_refused({.lazy_tolerance = -1e-9}, "lazy_tolerance");
    expect_refused({.significance = nan}, "significance");
    expect_refused({.cone_half_angle = 1.6}, "cone_half_angle");
    expect_refused({.group_count = 65}, "group_count");
    expect_refused({.leaf_angle = nan}, "leaf_angle");
    expect_refused({.rebuild_after = 0}, "rebuild_after");
    expect_refused({.coherence = Coherence::VelocityCones}, "reuse_limit");
}

TEST(ProximityHardCases, AStepAllocatesNothingOnceTheListsHaveTheirCapacity) {
    const Sequence s = testing::make_sinking_sheet(71, 10, 6);
    for (const Coherence coherence : {Coherence::None, Coherence::SeparationList, Coherence::VelocityCones}) {
        ProximitySearch search;
        ASSERT_TRUE(s.build(search, {.distance = 0.03, .coherence = coherence, .rebuild_after = 2, .reuse_limit = 0.01}).ok());
        std::vector<Proximity> found;
        std::size_t before = 0;
        for (int round = 0; round < 3; ++round) {
            if (round == 2) before = testing::allocation_count();
            for (std::size_t k = 0; k < s.steps(); ++k) {
                const SurfaceMotion motions[] = {{&s.surfaces[0], s.frames[k][0], s.frames[k + 1][0]},
                                                 {&s.surfaces[1], s.frames[k][1], s.frames[k + 1][1]}};
                ASSERT_TRUE(search.refit(motions).ok());
                search.find(found);
            }
        }
        EXPECT_EQ(testing::allocation_count() - before, 0u);
        EXPECT_GT(search.memory(), 0u);
    }
}

} // namespace
} // namespace trocar::collision
