// Closest points of faces against GJK and against sampling; coming near during a step against many instants.
#include "base/self_intersection.hpp"
#include "collision/proximity/convex_distance.hpp"
#include "collision/proximity/face_proximity.hpp"
#include "shapes.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace trocar::collision {
namespace {

using testing::Random;

FaceCorners make_face(Random& random, double apart) {
    const Vec3 centre = random.vector(apart);
    return {centre + random.vector(1.0), centre + random.vector(1.0), centre + random.vector(1.0)};
}

Vec3 point_of(const FaceCorners& f, const std::array<double, 3>& bary) { return bary[0] * f[0] + bary[1] * f[1] + bary[2] * f[2]; }

/// No point of the faces is nearer than by the answer, as far as a grid tells; its points are in the faces and as far apart as it says.
TEST(FaceProximity, ClosestPointsAreInTheFacesAndGjkFindsNoNearer) {
    std::size_t crossing = 0;
    for (std::uint64_t seed = 1; seed <= 3000; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        FaceCorners a = make_face(random, 1.0), b = make_face(random, 1.0);
        if (seed % 10 == 0) a[2] = a[1];                                               // a segment
        if (seed % 15 == 0) b[1] = b[2] = b[0];                                        // a point
        if (seed % 7 == 0) b = {a[0] + Vec3(0, 0, 0.3), a[1] + Vec3(0, 0, 0.3), b[2]}; // a parallel side
        const FacePoints closed = closest_on_faces(a, b);
        const ConvexDistance gjk = closest_on_convex(a, b);
        EXPECT_TRUE(gjk.converged);
        EXPECT_NEAR(closed.distance, gjk.distance, 1e-7);
        EXPECT_NEAR((gjk.point_a - gjk.point_b).norm(), gjk.distance, 1e-9);
        EXPECT_NEAR((point_of(a, closed.bary_a) - point_of(b, closed.bary_b)).norm(), closed.distance, 1e-9);
        for (const auto& bary : {closed.bary_a, closed.bary_b}) {
            EXPECT_NEAR(bary[0] + bary[1] + bary[2], 1.0, 1e-12);
            EXPECT_GE(*std::min_element(bary.begin(), bary.end()), -1e-12);
        }
        EXPECT_EQ(closed.distance == 0.0, triangles_cross(a, b, Crossing::Touching));
        crossing += closed.distance == 0.0;
        for (int i = 0; i < 20; ++i) {
            const double s = random.real(0.0, 1.0), t = random.real(0.0, 1.0 - s), u = random.real(0.0, 1.0), v = random.real(0.0, 1.0 - u);
            EXPECT_GE((point_of(a, {s, t, 1.0 - s - t}) - point_of(b, {u, v, 1.0 - u - v})).norm(), closed.distance - 1e-12);
        }
    }
    EXPECT_GT(crossing, 150u);
}

TEST(FaceProximity, GjkTakesPolygonsOfAnyNumberOfCorners) {
    for (std::uint64_t seed = 1; seed <= 300; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        const auto make_polygon = [&](std::size_t corners) {
            const Vec3 centre = random.vector(2.0), right = random.vector(1.0).normalized();
            const Vec3 up = right.cross(random.vector(1.0)).normalized();
            std::vector<Vec3> polygon;
            for (std::size_t i = 0; i < corners; ++i) {
                const double angle = 6.2831853 * static_cast<double>(i) / static_cast<double>(corners);
                polygon.push_back(centre + std::cos(angle) * right + std::sin(angle) * up);
            }
            return polygon;
        };
        const auto a = make_polygon(3 + seed % 6), b = make_polygon(4 + seed % 5);
        double nearest = 1e9; // of all pairs of triangles of two fans
        for (std::size_t i = 1; i + 1 < a.size(); ++i)
            for (std::size_t k = 1; k + 1 < b.size(); ++k)
                nearest = std::min(nearest, closest_on_faces({a[0], a[i], a[i + 1]}, {b[0], b[k], b[k + 1]}).distance);
        EXPECT_NEAR(closest_on_convex(a, b).distance, nearest, 1e-7);
    }
}

TEST(FaceProximity, WhatComesNearAtAnyOfManyInstantsIsFoundAndNothingElse) {
    std::size_t at_start = 0, later = 0, never = 0;
    for (std::uint64_t seed = 1; seed <= 2000; ++seed) {
        SCOPED_TRACE(::testing::Message() << "seed " << seed);
        Random random(seed);
        SweptFace a{make_face(random, 1.4), {}}, b{make_face(random, 1.4), {}};
        for (std::size_t k = 0; k < 3; ++k) {
            a.t1[k] = a.t0[k] + random.vector(1.5);
            b.t1[k] = b.t0[k] + random.vector(1.5);
        }
        const double distance = seed % 3 == 0 ? 0.0 : random.real(0.0, 0.4);
        FaceProximity near;
        const bool found = find_face_proximity(a, b, distance, true, near);
        double nearest = 1e9, first = 2.0;
        constexpr int kInstants = 100;
        for (int i = 0; i <= kInstants; ++i) {
            const double t = static_cast<double>(i) / kInstants;
            FaceCorners x, y;
            for (std::size_t k = 0; k < 3; ++k) {
                x[k] = (1.0 - t) * a.t0[k] + t * a.t1[k];
                y[k] = (1.0 - t) * b.t0[k] + t * b.t1[k];
            }
            const double now = closest_on_faces(x, y).distance;
            nearest = std::min(nearest, now);
            if (now <= distance) first = std::min(first, t);
        }
        if (first <= 1.0) {
            EXPECT_TRUE(found);
        }
        constexpr double kBetween = 5.2 / kInstants; // no distance changes more within half an instant
        if (found) {
            EXPECT_LE(nearest, distance + kBetween);
            EXPECT_LE(near.time, first + 1e-6);
            EXPECT_LE(near.points.distance, distance * (1.0 + 2.0 * kProximityTolerance) + 1e-12);
        }
        at_start += found && near.time == 0.0;
        later += found && near.time > 0.0;
        never += !found;
        FaceProximity now, turned;
        EXPECT_EQ(find_face_proximity(a, b, distance, false, now), closest_on_faces(a.t0, b.t0).distance <= distance);
        EXPECT_EQ(find_face_proximity(b, a, distance, true, turned), found);
        FaceProximity vertex;
        if (find_vertex_proximity(a, b, distance, true, true, vertex)) {
            EXPECT_TRUE(found);
        }
    }
    EXPECT_GT(at_start, 60u);
    EXPECT_GT(later, 200u);
    EXPECT_GT(never, 200u);
}

} // namespace
} // namespace trocar::collision
