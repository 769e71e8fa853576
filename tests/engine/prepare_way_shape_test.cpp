#include "engine/prepare/way_shape.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <vector>

namespace trocar::engine {

namespace {

/// Straight for ten radii, then another way for as long: n points each.
std::vector<Vec3> make_corner(double turn, double radius, std::size_t n) {
    std::vector<Vec3> points;
    const double step = 10.0 * radius / static_cast<double>(n);
    for (std::size_t k = 0; k <= n; ++k) points.push_back(step * static_cast<double>(k) * Vec3::UnitZ());
    const Vec3 way = std::cos(turn) * Vec3::UnitZ() + std::sin(turn) * Vec3::UnitX();
    for (std::size_t k = 1; k <= n; ++k) points.push_back(points[n] + step * static_cast<double>(k) * way);
    return points;
}

} // namespace

TEST(WayShape, ACornerTurnsByItsAngleWhateverItsSizeAndItsPoints) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> any(0.0, 1.0);
    for (int round = 0; round < 200; ++round) {
        const double turn = 0.99 * std::numbers::pi * any(random), radius = std::pow(10.0, -4.0 + 3.0 * any(random));
        const std::size_t n = 4 + random() % 60;
        const std::vector<Vec3> points = make_corner(turn, radius, n);
        std::vector<double> radii(points.size(), radius);
        EXPECT_NEAR(measure_place(points, radii, n).turn, turn, 1e-7);
        EXPECT_NEAR(measure_place(points, radii, 0).turn, 0.0, 1e-7) << "an end has nothing before it";
        radii[0] = radii.back() = 0.1 * radius; // out of reach
        radii[n - 1] = 0.5 * radius, radii[n + 1] = 2.0 * radius;
        const WayPlace place = measure_place(points, radii, n);
        EXPECT_DOUBLE_EQ(place.narrowest, 0.5 * radius);
        EXPECT_DOUBLE_EQ(place.widest, 2.0 * radius);
    }
}

TEST(WayShape, ATipReachesWhereItsArcGoes) {
    std::mt19937_64 random(4);
    std::uniform_real_distribution<double> any(0.0, 1.0);
    for (int round = 0; round < 100; ++round) {
        const double length = 1e-3 + 0.05 * any(random), angle = std::numbers::pi * any(random);
        constexpr int kPieces = 2000;
        double aside = 0.0;
        for (int k = 0; k < kPieces; ++k) aside += length / kPieces * std::sin(angle * (k + 0.5) / kPieces);
        EXPECT_NEAR(tip_reach(length, angle), aside, 1e-6 * length) << angle;
        EXPECT_GE(tip_reach(length, angle + 4.0), 0.0);
    }
    EXPECT_EQ(tip_reach(0.01, 0.0), 0.0);
}

} // namespace trocar::engine
