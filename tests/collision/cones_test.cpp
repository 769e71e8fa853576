// What the cones promise: joined cones hold all directions, inflated bounds all motions, and an outline that passes means no contact.
#include "proximity_shapes.hpp"

#include <gtest/gtest.h>

namespace trocar::collision {
namespace {

using testing::Random;

Vec3 near_direction(Random& random, const Vec3& axis, double spread) { return axis + random.vector(spread); }

TEST(Cones, AJoinedConeHoldsEveryDirectionOfItsParts) {
    std::size_t narrow = 0, open = 0;
    for (std::uint64_t seed = 1; seed <= 400; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        const Vec3 axis = random.vector(1.0).normalized();
        const double spread = random.real(0.0, 1.7) * random.real(0.0, 1.0);
        std::vector<Vec3> directions;
        std::vector<Cone> cones;
        for (int i = 0; i < 64; ++i) {
            directions.push_back(random.real(1e-3, 1e3) * near_direction(random, axis, i % 9 == 0 ? 1e-9 * spread : spread));
            cones.push_back(Cone::around(directions.back()));
        }
        while (cones.size() > 1) { // a binary tree
            for (std::size_t i = 0; i + 1 < cones.size(); i += 2) cones[i / 2] = join(cones[i], cones[i + 1]);
            cones.resize(cones.size() / 2);
        }
        open += cones[0].kind == Cone::Kind::Everything;
        if (cones[0].kind == Cone::Kind::Everything) continue;
        ++narrow;
        EXPECT_NEAR(cones[0].axis.norm(), 1.0, 1e-14);
        EXPECT_NEAR(cones[0].cosine * cones[0].cosine + cones[0].sine * cones[0].sine, 1.0, 1e-14);
        double farthest = 1.0;
        for (const Vec3& d : directions) farthest = std::min(farthest, cones[0].axis.dot(d.normalized()));
        EXPECT_GE(farthest, cones[0].cosine);
    }
    EXPECT_GT(narrow, 100u);
    EXPECT_GT(open, 50u);
}

TEST(Cones, TwoConesThatAgreeOrOpposeAreJoinedWithoutNaN) {
    const Cone up = Cone::around(Vec3::UnitZ()), almost = Cone::around(Vec3(1e-12, 0.0, 1.0)), down = Cone::around(-Vec3::UnitZ());
    EXPECT_LT(join(up, up).sine, 1e-6);
    EXPECT_LT(join(up, almost).sine, 1e-6);
    Random random(5);
    for (int i = 0; i < 1000; ++i) { // axes whose length rounds to a little less than 1 too
        const Cone one = Cone::around(random.vector(1.0)), same = join(join(one, one), one);
        EXPECT_EQ(same.kind, Cone::Kind::Some);
        EXPECT_LT(same.sine, 1e-6);
    }
    EXPECT_EQ(join(up, down).kind, Cone::Kind::Everything);
    EXPECT_EQ(join(up, Cone::everything()).kind, Cone::Kind::Everything);
    EXPECT_EQ(join(up, Cone()).kind, Cone::Kind::Some);
    EXPECT_EQ(Cone::around(Vec3::Zero()).kind, Cone::Kind::Everything);
}

struct Vertices {
    std::vector<Vec3> displacement;
    VelocityCone cone;
};

/// A node's vertices: a stream with some spread, still ones among them.
Vertices make_vertices(Random& random, double significance, double still_share = 0.2) {
    Vertices node;
    const Vec3 stream = random.vector(1.0);
    const double spread = random.real(0.0, 0.8) * random.real(0.0, 1.0);
    for (int i = 0; i < 12; ++i) {
        const double share = random.real(0.0, 1.0) < still_share ? random.real(0.0, 0.01) : random.real(0.2, 1.0);
        node.displacement.push_back(share * near_direction(random, stream, spread));
        const VelocityCone one = make_velocity_cone(node.displacement.back(), significance);
        node.cone = i == 0 ? one : join(node.cone, one);
    }
    return node;
}

TEST(Cones, SafeInflationHoldsEveryMotionWithinTheConeAndThePapersDoesNot) {
    std::size_t lost_by_paper = 0, tighter = 0;
    for (std::uint64_t seed = 1; seed <= 500; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        const Vertices node = make_vertices(random, seed % 3 == 0 ? 0.0 : 0.05);
        for (const auto& n : kCornerDirections) {
            const Vec3 unit = Vec3(n[0], n[1], n[2]) / direction_length(n);
            const double cosine = unit.dot(node.cone.heading.axis);
            const Reach safe = oriented_reach(node.cone, cosine, Inflation::OrientedSafe);
            const Reach paper = oriented_reach(node.cone, cosine, Inflation::OrientedPaper);
            tighter += std::min(safe.ahead, safe.behind) < 0.5 * node.cone.fastest;
            for (const Vec3& way : node.displacement)
                for (const double share : {0.3, 1.0}) {
                    EXPECT_LE(unit.dot(share * way), safe.ahead);
                    EXPECT_LE(-unit.dot(share * way), safe.behind);
                    lost_by_paper += unit.dot(share * way) > paper.ahead || -unit.dot(share * way) > paper.behind;
                }
        }
    }
    EXPECT_GT(lost_by_paper, 1000u); // why it is called a heuristic
    EXPECT_GT(tighter, 1000u);       // else the plain inflation would do
}

TEST(Cones, NoTwoVerticesMoveFartherRelativeToEachOtherThanTheBound) {
    std::size_t useful = 0;
    for (std::uint64_t seed = 1; seed <= 500; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        const double still_share = seed % 3 == 0 ? 0.2 : 0.0;
        const Vertices a = make_vertices(random, 0.05, still_share);
        const Vertices b = seed % 2 == 0 ? make_vertices(random, 0.05, still_share) : a;
        const double bound = relative_motion_bound(a.cone, b.cone);
        for (const Vec3& x : a.displacement)
            for (const Vec3& y : b.displacement) EXPECT_LE((x - y).norm(), bound);
        useful += bound < a.cone.fastest + b.cone.fastest;
    }
    EXPECT_GT(useful, 50u);
}

/// The whole tree against motions sampled in time: rows of every slot hold its faces' vertices.
TEST(Cones, BoundsOfEverySlotHoldItsFacesDuringTheStepHoweverLazy) {
    for (const Inflation inflation : {Inflation::Plain, Inflation::OrientedSafe, Inflation::Swept})
        for (const double tolerance : {0.0, 0.02}) {
            ProximityOptions options;
            options.inflation = inflation;
            options.lazy_tolerance = tolerance;
            const testing::Sequence sequence = testing::make_rolling_sheet(11, 8, 6);
            ConeTree tree;
            tree.build(sequence.surfaces[0], sequence.frames[0][0], options, true);
            for (std::size_t k = 0; k < sequence.steps(); ++k) {
                const SurfaceMotion motion = sequence.motions(k)[0];
                tree.refit(motion);
                const Directions directions = directions_of(options.dop);
                for (double time = 0.0; time <= 1.0; time += 0.25)
                    for (std::size_t s = 0; s < directions.size(); ++s) {
                        const auto& n = directions[s];
                        double lo = 1e9, hi = -1e9;
                        for (std::size_t v = 0; v < motion.t0.size(); ++v) {
                            const Vec3 p = (1.0 - time) * motion.t0[v] + time * motion.t1[v];
                            lo = std::min(lo, p.dot(Vec3(n[0], n[1], n[2])));
                            hi = std::max(hi, p.dot(Vec3(n[0], n[1], n[2])));
                        }
                        const float* bounds = tree.bounds(ConeTree::kRoot);
                        const double reach = tree.constant_inflation() * direction_length(n) + 1e-15;
                        EXPECT_LE(bounds[s * tree.arity()] - reach, lo);
                        EXPECT_LE(bounds[(s + tree.slabs()) * tree.arity()] - reach, -hi);
                    }
            }
        }
}

/// A flat strip around a circle, from angle 0 on, its inner radius 0.6: a ring, a C, or more than once around as a ramp.
struct Ring {
    testing::Surface surface;

    Ring(std::size_t parts, double turns, double rise) {
        const bool closed = turns == 1.0 && rise == 0.0;
        const Index columns = static_cast<Index>(closed ? parts : parts + 1);
        for (Index i = 0; i < columns; ++i) {
            const double angle = 6.283185307179586 * turns * static_cast<double>(i) / static_cast<double>(parts);
            for (const double radius : {0.6, 0.8, 1.0})
                surface.t0.emplace_back(radius * std::cos(angle), radius * std::sin(angle), rise * static_cast<double>(i));
        }
        for (Index i = 0; i < parts; ++i)
            for (Index k = 0; k < 2; ++k) {
                const Index a = 3 * i + k, b = a + 1, c = 3 * ((i + 1) % columns) + k, d = c + 1;
                surface.triangles.push_back({a, b, d});
                surface.triangles.push_back({a, d, c});
            }
        surface.t1 = surface.t0;
        surface.close();
    }
};

struct Verdict {
    bool flat, simple, meets;
};

Verdict judge(const testing::Surface& s) {
    ConeTree tree;
    tree.build(s.topology, s.t0, {}, true);
    const SurfaceMotion motion = s.motion();
    tree.refit(motion);
    ContourTest test;
    const ContourView contour = tree.contour(ConeTree::kRoot);
    const Cone& cone = tree.normal_cone(ConeTree::kRoot);
    Verdict verdict{.flat = cone.kind == Cone::Kind::Some, .simple = false, .meets = false};
    verdict.simple = verdict.flat && !contour.vertices.empty() && test.is_simple(contour, motion, cone.axis);
    std::vector<Proximity> truth;
    find_all_proximities({&motion, 1}, {}, truth);
    verdict.meets = !truth.empty();
    return verdict;
}

TEST(Contours, OfARingOfACAndOfARampThatGoesAroundTwice) {
    const Verdict ring = judge(Ring(24, 1.0, 0.0).surface); // two loops, the inner one concave
    EXPECT_TRUE(ring.flat && ring.simple && !ring.meets);
    const Verdict c = judge(Ring(24, 0.8, 0.0).surface); // one concave loop
    EXPECT_TRUE(c.flat && c.simple && !c.meets);
    const Verdict ramp = judge(Ring(24, 1.3, 0.01).surface); // over itself, but apart
    EXPECT_TRUE(ramp.flat && !ramp.simple && !ramp.meets) << ramp.flat << ramp.simple << ramp.meets;
    testing::Surface pressed = Ring(24, 1.3, 0.01).surface; // its upper end goes down through the lower one
    for (std::size_t v = 60; v < pressed.t0.size(); ++v) pressed.t1[v][2] -= 0.4;
    const Verdict through = judge(pressed);
    EXPECT_TRUE(through.meets);
    EXPECT_FALSE(through.simple);
}

TEST(Contours, TwoPiecesSideBySideArePassedAndOneOverTheOtherAreNot) {
    testing::Surface pieces = Ring(12, 0.8, 0.0).surface;
    const std::size_t vertices = pieces.t0.size(), faces = pieces.triangles.size();
    const auto with_second_at = [&](const Vec3& offset) {
        testing::Surface both = pieces;
        for (std::size_t v = 0; v < vertices; ++v) both.t0.push_back(pieces.t0[v] + offset);
        for (std::size_t f = 0; f < faces; ++f) {
            const Triangle t = pieces.triangles[f];
            const auto n = static_cast<Index>(vertices);
            both.triangles.push_back({t[0] + n, t[1] + n, t[2] + n});
        }
        both.t1 = both.t0;
        both.close();
        return judge(both);
    };
    EXPECT_TRUE(with_second_at({2.5, 0.0, 0.0}).simple);
    EXPECT_FALSE(with_second_at({0.0, 0.0, 0.1}).simple);
    EXPECT_FALSE(with_second_at({0.3, 0.1, 0.1}).simple);
    EXPECT_TRUE(with_second_at({0.3, 0.1, 0.0}).meets);
}

TEST(Contours, WherePassedBruteForceFindsNothing) {
    std::size_t passed = 0, refused = 0, met = 0;
    for (std::uint64_t seed = 1; seed <= 600; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        Ring ring(10 + seed % 5, seed % 4 == 0 ? 1.0 : random.real(0.7, 1.25), seed % 4 == 0 ? 0.0 : random.real(0.0, 0.01));
        const double shake = 0.12 * random.real(0.0, 1.0) * random.real(0.0, 1.0);
        for (std::size_t v = 0; v < ring.surface.t0.size(); ++v) {
            ring.surface.t0[v] += random.vector(shake);
            ring.surface.t1[v] = ring.surface.t0[v] + random.vector(shake);
        }
        const Verdict verdict = judge(ring.surface);
        passed += verdict.simple;
        refused += verdict.flat && !verdict.simple;
        met += verdict.flat && verdict.meets;
        EXPECT_FALSE(verdict.simple && verdict.meets);
    }
    std::printf("outlines: %zu passed, %zu refused; %zu flat regions met themselves\n", passed, refused, met);
    EXPECT_GT(passed, 50u);
    EXPECT_GT(refused, 50u);
    EXPECT_GT(met, 20u);
}

TEST(Contours, ABorderThatIsNoSetOfSimpleLoopsIsRefused) {
    const auto contour_of = [](const std::vector<Triangle>& triangles, std::size_t vertices, Contour& out) {
        const SurfaceTopology topology = make_topology(triangles, vertices);
        std::vector<Index> faces;
        for (Index i = 0; i < triangles.size(); ++i) faces.push_back(i);
        return make_contour(topology, faces, out);
    };
    Contour contour;
    EXPECT_TRUE(contour_of({{0, 1, 2}, {2, 1, 3}}, 4, contour));
    EXPECT_EQ(contour.vertices.size(), 4u);
    EXPECT_EQ(contour.loop_ends, std::vector<Index>{4});
    EXPECT_FALSE(contour_of({{0, 1, 2}, {1, 2, 3}}, 4, contour));                       // turned differently
    EXPECT_FALSE(contour_of({{0, 1, 2}, {0, 3, 4}}, 5, contour));                       // one vertex in common
    EXPECT_FALSE(contour_of({{0, 1, 2}, {2, 1, 3}, {1, 2, 4}}, 5, contour));            // three at an edge
    EXPECT_FALSE(contour_of({{0, 1, 1}}, 2, contour));                                  // a corner repeated
    EXPECT_FALSE(contour_of({{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}, 4, contour)); // closed
    EXPECT_TRUE(contour_of({{0, 1, 2}, {3, 4, 5}}, 6, contour));                        // two pieces
    EXPECT_EQ(contour.loop_ends.size(), 2u);
}

TEST(FaceGroups, CoverTheSurfaceAndKnowTheirNeighbours) {
    const SurfaceTopology topology = make_topology(testing::sheet_triangles(12), 169);
    const FaceGroups groups = make_face_groups(topology, 16);
    EXPECT_EQ(groups.count(), 16u);
    std::vector<std::size_t> size(groups.count(), 0);
    for (std::size_t i = 0; i < groups.of.size(); ++i) {
        ++size[groups.of[i]];
        for (std::size_t k = 0; k < groups.of.size(); ++k) {
            bool meet = false;
            for (const Index v : topology.triangles[i])
                for (const Index w : topology.triangles[k]) meet = meet || v == w;
            if (meet) {
                EXPECT_TRUE(groups.adjacent[groups.of[i]] >> groups.of[k] & 1u);
            }
        }
    }
    for (const std::size_t s : size) EXPECT_GT(s, 0u);
    EXPECT_FALSE(groups.all_adjacent(0xffff));
    EXPECT_TRUE(groups.all_adjacent(1));
    EXPECT_EQ(make_face_groups(make_topology({}, 0), 8).count(), 0u);
    EXPECT_EQ(make_face_groups(make_topology(testing::sheet_triangles(1), 4), 64).count(), 2u);
}

} // namespace
} // namespace trocar::collision
