// Vessel trees from axes and radii: closed surfaces of one piece, as wide as asked for, or an error with the reason.
#include "assets/anatomy/vessels.hpp"

#include "base/inside.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"

#include <gtest/gtest.h>

namespace trocar::anatomy {
namespace {

constexpr double kHalfTurn = 3.14159265358979323846;

const VesselBranch kTrunk{{{0, 0, 0}, {0, 0, 0.08}}, {0.004, 0.004}};

void expect_lumen(const TriMesh& mesh) {
    const SurfaceReport report = inspect_surface(mesh);
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
    EXPECT_EQ(report.components, 1u);
    EXPECT_EQ(find_self_intersections(mesh, 1).count, 0u);
}

TEST(Vessels, AStraightOneIsATubeWithRoundEnds) {
    const auto mesh = make_vessels(std::vector{kTrunk}, 0.0, 8000);
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    expect_lumen(*mesh);
    const double volume = kHalfTurn * 0.004 * 0.004 * 0.08 + 4.0 / 3.0 * kHalfTurn * 0.004 * 0.004 * 0.004;
    EXPECT_NEAR(inspect_surface(*mesh).signed_volume, volume, 0.02 * volume);
    EXPECT_NEAR(static_cast<double>(mesh->triangles.size()), 8000.0, 2000.0);
}

TEST(Vessels, AForkIsOnePieceThatHoldsEveryAxis) {
    const std::vector<VesselBranch> fork{kTrunk,
                                         {{{0, 0, 0.075}, {-0.01, 0, 0.1}, {-0.03, 0, 0.12}}, {0.003, 0.003, 0.002}},
                                         {{{0, 0, 0.075}, {0.01, 0, 0.1}, {0.03, 0.01, 0.12}}, {0.003, 0.003, 0.002}}};
    const auto mesh = make_vessels(fork, 0.003, 12000);
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    expect_lumen(*mesh);
    const InsideTest inside(*mesh);
    for (const VesselBranch& branch : fork)
        for (std::size_t i = 0; i < branch.axis.size(); ++i) {
            EXPECT_TRUE(inside.inside(branch.axis[i]));
            EXPECT_LE(inside.signed_distance(branch.axis[i]), -0.9 * branch.radii[i]) << "a blend only widens";
        }
}

TEST(Vessels, ANarrowingIsAsNarrowAsItSays) {
    const VesselBranch stenosis{{{0, 0, 0}, {0, 0, 0.03}, {0, 0, 0.04}, {0, 0, 0.05}, {0, 0, 0.08}}, {0.004, 0.004, 0.001, 0.004, 0.004}};
    const auto mesh = make_vessels(std::vector{stenosis}, 0.0, 8000);
    ASSERT_TRUE(mesh.ok()) << mesh.error().message;
    expect_lumen(*mesh);
    EXPECT_NEAR(-InsideTest(*mesh).signed_distance({0, 0, 0.04}), 0.001, 1.5e-4);
}

TEST(Vessels, ThatCannotBeMadeSayWhy) {
    const VesselBranch apart{{{0.1, 0, 0}, {0.1, 0, 0.05}}, {0.004, 0.004}};
    const auto two = make_vessels(std::vector{kTrunk, apart}, 0.001, 4000);
    ASSERT_FALSE(two.ok());
    EXPECT_NE(two.error().message.find("2 separate pieces"), std::string::npos) << two.error().message;
    const VesselBranch hair{{{0, 0, 0}, {5, 5, 5}}, {1e-4, 1e-4}};
    EXPECT_FALSE(make_vessels(std::vector{hair}, 0.0, 4000).ok()) << "a grid that no memory holds";
    EXPECT_FALSE(make_vessels({}, 0.0, 4000).ok());
    EXPECT_FALSE(make_vessels(std::vector{VesselBranch{{{0, 0, 0}, {0, 0, 0}}, {1e-3, 1e-3}}}, 0.0, 4000).ok());
    EXPECT_FALSE(make_vessels(std::vector{VesselBranch{{{0, 0, 0}, {0, 0, 0.1}}, {1e-3, 0.0}}}, 0.0, 4000).ok());
}

} // namespace
} // namespace trocar::anatomy
