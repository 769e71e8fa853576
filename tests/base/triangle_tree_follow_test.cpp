// A tree that follows a moving surface against one that is fitted to it in every step: the same answers, whatever the motion.
#include "base/inside.hpp"
#include "base/triangle_tree.hpp"

#include "test_meshes.hpp"

#include <set>

using namespace trocar;
using namespace trocar::test;

namespace {

void expect_same_answers(const TriangleTree& a, const TriangleTree& b, Random& random) {
    for (int trial = 0; trial < 20; ++trial) {
        const Vec3 p = random.point(1.5);
        const int axis = trial % 3;
        const bool positive = trial % 2 == 0;
        ASSERT_EQ(a.ray_crossings(p, axis, positive), b.ray_crossings(p, axis, positive));
        ASSERT_EQ(a.ray_meets_any(p, axis, positive), b.ray_meets_any(p, axis, positive));
        const auto near_a = a.closest(p), near_b = b.closest(p);
        ASSERT_EQ(near_a.has_value(), near_b.has_value());
        if (near_a) {
            EXPECT_EQ(near_a->triangle, near_b->triangle);
            EXPECT_EQ(near_a->distance, near_b->distance);
        }
        Box3 box;
        box.add(p);
        box.add(p + 0.3 * random.point());
        std::set<Index> met_a, met_b;
        a.for_each_overlapping(box, [&](Index t) { met_a.insert(t); });
        b.for_each_overlapping(box, [&](Index t) { met_b.insert(t); });
        ASSERT_EQ(met_a, met_b);
    }
}

} // namespace

TEST(TriangleTree, FollowingAnswersAsARefitDoes) {
    Random random{31};
    SCOPED_TRACE(random.trace());
    const TriMesh rest = make_torus(24, 12);
    TriMesh mesh = rest;
    TriangleTree fitted(mesh), follows(mesh), loose(mesh);
    follows.start_following(mesh.vertices);
    loose.start_following(mesh.vertices, 0.1);
    // A triangle is some 0.25 wide: creeping, drifting for longer than a renewal, standing still, leaping.
    for (int step = 0; step < 600; ++step) {
        SCOPED_TRACE(step);
        const double length = step % 150 < 60 ? 1e-3 : step % 150 < 120 ? 1e-2 : step % 150 < 130 ? 0.0 : 0.2;
        const Vec3 drift = length * Vec3(1, -0.5, 0.25) * (step % 300 < 150 ? 1.0 : -1.0);
        for (Vec3& v : mesh.vertices) v += 0.2 * length * random.point() + drift;
        fitted.refit(mesh.vertices);
        follows.follow(mesh.vertices);
        loose.follow_loosely(mesh.vertices);
        if (step % 3 == 0) {
            Box3 some;
            some.add(random.point(1.5));
            some.add(random.point(1.5));
            loose.renew_within(some);
        }
        ASSERT_EQ(follows.bounds().lo, fitted.bounds().lo);
        ASSERT_EQ(follows.bounds().hi, fitted.bounds().hi);
        ASSERT_EQ(loose.bounds().hi, fitted.bounds().hi);
        expect_same_answers(follows, fitted, random);
        expect_same_answers(loose, fitted, random);
        if (step % 100 == 99) mesh.vertices = rest.vertices; // somewhere else altogether
    }
}

TEST(TriangleTree, FollowsThroughVerticesThatAreNotFinite) {
    Random random{32};
    TriMesh mesh = make_torus(16, 8);
    TriangleTree fitted(mesh), follows(mesh);
    follows.start_following(mesh.vertices);
    for (int step = 0; step < 60; ++step) {
        TriMesh bad = mesh;
        if (step % 7 == 3) bad.vertices[5].x() = std::numeric_limits<double>::quiet_NaN();
        if (step % 11 == 4) bad.vertices[9].z() = std::numeric_limits<double>::infinity();
        for (Vec3& v : mesh.vertices) v += 0.01 * random.point();
        fitted.refit(bad.vertices);
        follows.follow(bad.vertices);
        SCOPED_TRACE(step);
        expect_same_answers(follows, fitted, random);
    }
}

TEST(TriangleTree, RefitsAndFollowsInTurnAndWithoutPreparation) {
    Random random{34};
    SCOPED_TRACE(random.trace());
    const TriMesh rest = make_torus(24, 12);
    TriMesh mesh = rest;
    TriangleTree fitted(mesh), follows(mesh), unprepared(mesh);
    follows.start_following(mesh.vertices);
    for (int step = 0; step < 60; ++step) {
        if (step % 7 == 5) // away, and back to where it was followed last
            for (Vec3& v : mesh.vertices) v += Vec3(0.4, 0, 0);
        if (step % 7 == 6)
            for (Vec3& v : mesh.vertices) v -= Vec3(0.4, 0, 0);
        for (Vec3& v : mesh.vertices) v += 0.01 * random.point();
        fitted.refit(mesh.vertices);
        unprepared.follow(mesh.vertices);
        step % 7 == 5 ? follows.refit(mesh.vertices) : follows.follow(mesh.vertices);
        SCOPED_TRACE(step);
        expect_same_answers(follows, fitted, random);
        expect_same_answers(unprepared, fitted, random);
    }
    const TriMesh other = make_torus(10, 6); // built anew: nothing of the old surface is left
    follows.build(other.vertices, other.triangles);
    follows.follow(other.vertices);
    expect_same_answers(follows, TriangleTree(other), random);
}

TEST(TriangleTree, AnEmptySurfaceIsFollowed) {
    TriangleTree tree;
    tree.start_following({});
    tree.follow({});
    EXPECT_FALSE(tree.closest(Vec3::Zero()));
    EXPECT_EQ(tree.ray_crossings(Vec3::Zero(), 0, true), 0);
}

TEST(InsideTest, CountsPointsOutsideAsOneByOne) {
    Random random{33};
    SCOPED_TRACE(random.trace());
    const TriMesh torus = make_torus(24, 12);
    InsideTest test(torus);
    for (const double spread : {0.02, 0.3, 3.0})
        for (int trial = 0; trial < 60; ++trial) {
            const Vec3 middle = random.point(1.4);
            std::vector<Vec3> points;
            for (int k = 0; k < trial * 4; ++k) points.push_back(middle + spread * random.point()); // up to several packets
            if (trial % 5 == 0) points.push_back(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
            if (trial % 3 == 0) points.push_back(torus.vertices[static_cast<std::size_t>(trial)]); // on the surface
            std::size_t outside = 0;
            for (const Vec3& p : points) outside += !test.inside(p);
            EXPECT_LE(test.count_outside(points), outside + (trial % 3 == 0)); // on the surface either answer is right
            EXPECT_GE(test.count_outside(points) + (trial % 3 == 0), outside);
        }
    EXPECT_EQ(test.count_outside({}), 0u);
    EXPECT_EQ(InsideTest().count_outside(std::vector<Vec3>(3, Vec3::Zero())), 3u);
}
