// The bounds that skipping frames depends on: relative drifts of clusters, distances of features; and how long a contact has lasted.
#include "base/closest_point.hpp"
#include "collision/search/session_bounds.hpp"
#include "collision/search/session_drift.hpp"
#include "tests/collision/shapes.hpp"

#include <gtest/gtest.h>

namespace trocar::collision {
namespace {

using testing::Random;
using testing::Surface;

/// Brings points of two clusters no closer than it says: random clusters that share most of their motion, a turn included.
TEST(ClusterDrift, BoundsHowMuchCloserPointsCome) {
    Random random(21);
    double least_share = 1.0;
    for (int round = 0; round < 400; ++round) {
        const Vec3 turn = random.vector(round % 2 == 0 ? 0.1 : 2.0), move = random.vector(1.0);
        const double noise = std::pow(10.0, random.real(-9.0, -1.0));
        std::vector<Vec3> t0, t1;
        for (int v = 0; v < 24; ++v) {
            t0.push_back(random.vector(0.3) + Vec3(v < 12 ? 0.0 : 0.5, 100.0, 0.0));
            t1.push_back(t0.back() + move + turn.cross(t0.back() - Vec3(0.0, 100.0, 0.0)) + random.vector(noise));
        }
        std::vector<Index> first(12), second(12);
        for (Index v = 0; v < 12; ++v) {
            first[v] = v;
            second[v] = v + 12;
        }
        const ClusterDrift a = find_drift(t0, t1, first), b = find_drift(t0, t1, second);
        for (const double bound : {relative_drift(a, b), relative_drift(b, a)})
            for (int pair = 0; pair < 200; ++pair) {
                const auto v = static_cast<std::size_t>(random.bits() % 12), w = 12 + static_cast<std::size_t>(random.bits() % 12);
                const double s = random.real(0.0, 1.0), before = (t0[v] - t0[w]).norm();
                const double after = ((1 - s) * (t0[v] - t0[w]) + s * (t1[v] - t1[w])).norm();
                ASSERT_LE(before - after, bound + 1e-15 * before);
                least_share = std::min(least_share, bound / noise);
            }
    }
    EXPECT_LT(least_share, 30.0); // close to what is not shared
}

TEST(FeatureBounds, AreBelowTheDistanceAndCloseToIt) {
    Random random(22);
    const Surface a = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.0), b = testing::make_triangle_soup(random, 60, 1.0, 0.3, 0.0);
    std::vector<FeaturePair> vertex_faces, edge_edges;
    for (int i = 0; i < 2000; ++i) {
        vertex_faces.push_back({static_cast<Index>(random.bits() % a.t0.size()), static_cast<Index>(random.bits() % b.triangles.size())});
        edge_edges.push_back(
            {static_cast<Index>(random.bits() % a.topology.edges.size()), static_cast<Index>(random.bits() % b.topology.edges.size())});
    }
    std::vector<double> bounds(vertex_faces.size());
    bound_vertex_faces(a.motion(), b.motion(), vertex_faces, bounds);
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        const Triangle& t = b.triangles[vertex_faces[i].b];
        const double distance = std::sqrt(closest_on_triangle(a.t0[vertex_faces[i].a], b.t0[t[0]], b.t0[t[1]], b.t0[t[2]]).distance_sq);
        ASSERT_LE(bounds[i], distance);
        ASSERT_GT(bounds[i], 0.999999 * distance - 1e-9);
    }
    bound_edge_edges(a.motion(), b.motion(), edge_edges, bounds);
    for (std::size_t i = 0; i < bounds.size(); ++i) {
        const Edge &e = a.topology.edges[edge_edges[i].a], &f = b.topology.edges[edge_edges[i].b];
        const double distance = std::sqrt(closest_on_segments({a.t0[e[0]], a.t0[e[1]]}, {b.t0[f[0]], b.t0[f[1]]}).distance_sq);
        ASSERT_LE(bounds[i], distance);
        ASSERT_GT(bounds[i], 0.999999 * distance - 1e-9);
    }
}

} // namespace
} // namespace trocar::collision
