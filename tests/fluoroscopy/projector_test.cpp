// What holds of every projection: landmarks where a pinhole has them, thicknesses of closed surfaces, nothing through edges.
#include "assets/anatomy/shapes.hpp"
#include "engine/fluoroscopy/projector.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace trocar::engine {
namespace {

XrayView view_at(double primary_deg, double secondary_deg) {
    XrayView view;
    view.primary = primary_deg * std::numbers::pi / 180.0;
    view.secondary = secondary_deg * std::numbers::pi / 180.0;
    view.pixels = {256, 256};
    return view;
}

ConeBeam beam_of(const XrayView& view) { return make_cone_beam(view, find_angles(view, 0.0)); }

std::array<double, 2> seen(const XrayView& view, const Vec3& p) {
    const auto at = project(beam_of(view).projection(), p);
    EXPECT_TRUE(at.has_value());
    return at.value_or(std::array{-1.0, -1.0});
}

/// A sphere of latitudes and longitudes.
TriMesh make_sphere(const Vec3& middle, double radius, unsigned parts) {
    TriMesh mesh;
    const unsigned rings = parts, sides = 2 * parts;
    mesh.vertices.push_back(middle + radius * Vec3::UnitZ());
    for (unsigned i = 1; i < rings; ++i)
        for (unsigned k = 0; k < sides; ++k) {
            const double polar = std::numbers::pi * i / rings, turn = 2.0 * std::numbers::pi * k / sides;
            mesh.vertices.push_back(middle + radius * Vec3(std::sin(polar) * std::cos(turn), std::sin(polar) * std::sin(turn), std::cos(polar)));
        }
    mesh.vertices.push_back(middle - radius * Vec3::UnitZ());
    const auto at = [&](unsigned ring, unsigned k) { return static_cast<Index>(1 + (ring - 1) * sides + k % sides); };
    const auto last = static_cast<Index>(mesh.vertices.size() - 1);
    for (unsigned k = 0; k < sides; ++k) {
        mesh.triangles.push_back({0, at(1, k), at(1, k + 1)});
        for (unsigned i = 1; i + 1 < rings; ++i) {
            mesh.triangles.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
            mesh.triangles.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
        }
        mesh.triangles.push_back({at(rings - 1, k), last, at(rings - 1, k + 1)});
    }
    return mesh;
}

TriMesh make_box(const Vec3& least, const Vec3& most) {
    TriMesh mesh;
    for (int k = 0; k < 8; ++k) mesh.vertices.emplace_back(k & 1 ? most.x() : least.x(), k & 2 ? most.y() : least.y(), k & 4 ? most.z() : least.z());
    mesh.triangles = {{0, 2, 1}, {1, 2, 3}, {4, 5, 6}, {5, 7, 6}, {0, 1, 4}, {1, 5, 4}, {2, 6, 3}, {3, 6, 7}, {0, 4, 2}, {2, 4, 6}, {1, 3, 5}, {3, 7, 5}};
    return mesh;
}

std::vector<double> attenuation(const ConeBeam& beam, const TriMesh& mesh, double mu, unsigned threads = 1) {
    Projector projector(beam, threads);
    AttenuationSums sums;
    projector.add({mesh.vertices, mesh.triangles, mu}, sums);
    std::vector<double> out;
    projector.attenuations(sums, out);
    return out;
}

TEST(CArm, AtZeroThePatientsRightIsLeftAndTheHeadIsUp) {
    const XrayView ap = view_at(0, 0);
    EXPECT_NEAR(seen(ap, Vec3::Zero())[0], 128.0, 1e-9);
    EXPECT_NEAR(seen(ap, Vec3::Zero())[1], 128.0, 1e-9);
    EXPECT_LT(seen(ap, Vec3(0.05, 0, 0))[0], 128.0) << "+x is the patient's right, and is on the picture's left";
    EXPECT_LT(seen(ap, Vec3(0, 0, 0.05))[1], 128.0) << "+z is the head, and is up";
    EXPECT_GT(seen(ap, Vec3(-0.05, -0.05, 0))[0], seen(ap, Vec3(-0.05, 0.05, 0))[0]) << "the back is nearer to the source: larger";
    EXPECT_LT(beam_of(ap).source.y(), 0.0) << "the source is behind the patient";
}

TEST(CArm, LaoTakesTheDetectorToThePatientsLeftAndCraToTheHead) {
    EXPECT_LT(beam_of(view_at(30, 0)).along.x(), 0.0);
    EXPECT_GT(beam_of(view_at(-30, 0)).along.x(), 0.0);
    EXPECT_GT(beam_of(view_at(0, 20)).along.z(), 0.0);
    EXPECT_LT(beam_of(view_at(0, -20)).along.z(), 0.0);
    const Vec3 lateral = beam_of(view_at(90, 0)).along;
    EXPECT_NEAR((lateral - Vec3(-1, 0, 0)).norm(), 0.0, 1e-12) << "at LAO 90 the detector is at the patient's left side";
    EXPECT_LT(seen(view_at(90, 0), Vec3(0, 0.05, 0))[0], 128.0) << "seen from the left side, the front is on the left";
}

TEST(CArm, LandmarksLieWhereAPinholeHasThem) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> angle(-90.0, 90.0), place(-0.08, 0.08);
    for (int k = 0; k < 500; ++k) {
        XrayView view = view_at(angle(random), angle(random));
        view.isocentre = Vec3(place(random), place(random), place(random));
        view.table = Vec3(place(random), place(random), place(random));
        const Vec3 p(place(random), place(random), place(random));
        // by turning the patient instead: primary about the body's axis, then secondary about the picture's row
        const Vec3 moved = p + view.table - view.isocentre;
        const double a = view.primary, b = view.secondary;
        const double anterior = std::cos(a) * moved.y() - std::sin(a) * moved.x(), left = -std::cos(a) * moved.x() - std::sin(a) * moved.y();
        const double depth = view.sod + std::cos(b) * anterior + std::sin(b) * moved.z();
        const double up = std::cos(b) * moved.z() - std::sin(b) * anterior;
        const double pitch = view.detector[0] / view.pixels[0];
        const auto at = seen(view, p);
        EXPECT_NEAR(at[0], 128.0 + view.sid / depth * left / pitch, 1e-6);
        EXPECT_NEAR(at[1], 128.0 - view.sid / depth * up / pitch, 1e-6);
    }
}

TEST(Projector, ABallIsSeenWhereItsMiddleIsProjected) {
    for (const auto& [primary, secondary] : {std::pair(0.0, 0.0), std::pair(45.0, 0.0), std::pair(-30.0, 25.0), std::pair(90.0, -40.0)}) {
        const XrayView view = view_at(primary, secondary);
        const Vec3 middle(0.03, -0.02, 0.04);
        const std::vector<double> picture = attenuation(beam_of(view), make_sphere(middle, 0.004, 24), 100.0);
        double sum = 0.0, u = 0.0, v = 0.0;
        for (std::size_t k = 0; k < picture.size(); ++k) {
            sum += picture[k];
            u += picture[k] * (static_cast<double>(k % 256) + 0.5);
            v += picture[k] * (static_cast<double>(k / 256) + 0.5);
        }
        EXPECT_NEAR(u / sum, seen(view, middle)[0], 0.1);
        EXPECT_NEAR(v / sum, seen(view, middle)[1], 0.1);
    }
}

TEST(Projector, ThicknessOfASphereIsExactToAPercent) {
    const XrayView view = view_at(20, 10);
    const ConeBeam beam = beam_of(view);
    const double radius = 0.05, mu = 20.0;
    const std::vector<double> picture = attenuation(beam, make_sphere(Vec3::Zero(), radius, 80), mu);
    std::size_t tested = 0;
    for (unsigned y = 0; y < 256; ++y)
        for (unsigned x = 0; x < 256; ++x) {
            const Vec3 pixel = beam.source + beam.sid * beam.along + (x + 0.5 - 128.0) * beam.pitch[0] * beam.right + (y + 0.5 - 128.0) * beam.pitch[1] * beam.down;
            const Vec3 ray = (pixel - beam.source).normalized();
            const double miss_sq = beam.source.squaredNorm() - std::pow(ray.dot(beam.source), 2);
            if (miss_sq > 1.001 * radius * radius) {
                EXPECT_EQ(picture[y * 256 + x], 0.0);
            }
            if (miss_sq > 0.9 * radius * radius) continue;
            const double chord = 2.0 * std::sqrt(radius * radius - miss_sq);
            ASSERT_NEAR(picture[y * 256 + x] / mu, chord, 0.01 * chord) << x << ", " << y;
            ++tested;
        }
    EXPECT_GT(tested, 8000u);
}

TEST(Projector, ThicknessOfATubeIsExactToAPercent) {
    const XrayView view = view_at(25, 15);
    const ConeBeam beam = beam_of(view);
    const double radius = 0.008;
    const std::vector<Vec3> axis{Vec3(0.01, 0, -0.2), Vec3(0.01, 0, -0.1), Vec3(0.01, 0, 0.0), Vec3(0.01, 0, 0.1), Vec3(0.01, 0, 0.2)};
    const std::vector<double> picture = attenuation(beam, anatomy::make_tube(axis, std::vector<double>(5, radius), 96), 1.0);
    std::size_t tested = 0;
    for (unsigned y = 60; y < 196; ++y)
        for (unsigned x = 0; x < 256; ++x) {
            const Vec3 pixel = beam.source + beam.sid * beam.along + (x + 0.5 - 128.0) * beam.pitch[0] * beam.right + (y + 0.5 - 128.0) * beam.pitch[1] * beam.down;
            const Vec3 ray = (pixel - beam.source).normalized(), across = ray.cross(Vec3::UnitZ());
            const double miss = (axis[0] - beam.source).dot(across) / across.norm();
            if (std::abs(miss) > 0.9 * radius) continue;
            const double chord = 2.0 * std::sqrt(radius * radius - miss * miss) / across.norm();
            ASSERT_NEAR(picture[y * 256 + x], chord, 0.01 * chord) << x << ", " << y;
            ++tested;
        }
    EXPECT_GT(tested, 1500u);
}

TEST(Projector, RaysThroughVerticesAndEdgesCountOnce) {
    // pixels' centres fall on the box's corners, edges and diagonals
    XrayView view = view_at(0, 0);
    view.pixels = {64, 64};
    const ConeBeam beam = beam_of(view);
    const double far = view.sid, z = 0.75; // the box's plane nearest to the source lies at the isocentre's depth
    const double half = 16.0 * beam.pitch[0] * z / far, off = 0.5 * beam.pitch[0] * z / far;
    const TriMesh box = make_box(Vec3(-half + off, 0.0, -half + off), Vec3(half + off, 0.05, half + off));
    const std::vector<double> picture = attenuation(beam, box, 1.0);
    for (unsigned y = 0; y < 64; ++y)
        for (unsigned x = 0; x < 64; ++x) {
            const double at = picture[y * 64 + x];
            ASSERT_GE(at, -1e-9) << x << ", " << y;
            ASSERT_LE(at, 0.0525) << x << ", " << y;
            if (x > 20 && x < 44 && y > 20 && y < 44) {
                ASSERT_NEAR(at, 0.05 * beam.obliquity(x + 0.5, y + 0.5), 1e-6) << x << ", " << y;
            }
            if (x < 14 || x > 50) {
                ASSERT_EQ(at, 0.0);
            }
        }
}

TEST(Projector, NothingLeaksThroughRandomClosedSurfacesFromAnyside) {
    std::mt19937 random(11);
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int k = 0; k < 40; ++k) {
        TriMesh mesh = make_sphere(Vec3(0.05 * unit(random), 0.05 * unit(random), 0.05 * unit(random)), 0.03, 6 + k % 7);
        for (Vec3& v : mesh.vertices) v += 0.008 * Vec3(unit(random), unit(random), unit(random));
        const std::vector<double> picture = attenuation(beam_of(view_at(90 * unit(random), 90 * unit(random))), mesh, 1.0);
        for (const double t : picture) {
            ASSERT_GT(t, -0.05) << "a leak would add or take a depth of half a metre and more";
            ASSERT_LT(t, 0.15);
        }
    }
}

TEST(Projector, AnyNumberOfThreadsGivesTheSameBits) {
    const TriMesh mesh = make_sphere(Vec3(0.01, 0.0, 0.02), 0.06, 40);
    const ConeBeam beam = beam_of(view_at(33, -12));
    const std::vector<double> one = attenuation(beam, mesh, 21.0, 1);
    for (const unsigned threads : {2u, 3u, 7u, 64u, 1000u}) EXPECT_EQ(attenuation(beam, mesh, 21.0, threads), one);
}

TEST(Projector, AnOpenSheetAttenuatesAsAShell) {
    TriMesh sheet;
    sheet.vertices = {Vec3(-0.05, 0, -0.05), Vec3(0.05, 0, -0.05), Vec3(0.05, 0, 0.05), Vec3(-0.05, 0, 0.05)};
    sheet.triangles = {{0, 1, 2}, {0, 2, 3}};
    Projector projector(beam_of(view_at(0, 0)));
    AttenuationSums sums;
    projector.add({sheet.vertices, sheet.triangles, 20.0, {}, 1e-3}, sums);
    std::vector<double> picture;
    projector.attenuations(sums, picture);
    EXPECT_NEAR(picture[128 * 256 + 128], 0.02, 1e-4);
    EXPECT_EQ(picture[0], 0.0);
}

TEST(Projector, WhatLiesAtAndBehindTheSourceIsNotSeen) {
    const ConeBeam beam = beam_of(view_at(0, 0));
    const TriMesh behind = make_box(beam.source - Vec3(0.1, 0.5, 0.1), beam.source + Vec3(0.1, -0.2, 0.1));
    for (const double t : attenuation(beam, behind, 1.0)) ASSERT_EQ(t, 0.0);
    const TriMesh beside = make_box(beam.source + Vec3(0.3, -0.2, -0.1), beam.source + Vec3(0.5, 0.3, 0.1)); // passes the source's plane
    for (const double t : attenuation(beam, beside, 1.0)) {
        ASSERT_GE(t, -1e-6);
        ASSERT_LT(t, 1.0);
    }
}

} // namespace
} // namespace trocar::engine
