// Patches of tetrahedra: what they are, and that nearly incompressible bodies bend as they should.
#include "fem/tissue/patches.hpp"

#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/statics.hpp"
#include "fem/tissue/validation.hpp"
#include "tests/fem/bodies.hpp"

#include <cmath>
#include <cstdio>
#include <Eigen/Dense>
#include <functional>
#include <gtest/gtest.h>
#include <numeric>
#include <set>

namespace trocar::fem {

using namespace test;

namespace {

Material patched(MaterialLaw law, double poisson_ratio) {
    Material material = make_material(law, poisson_ratio);
    material.elements = TetElements::Patched;
    return material;
}

double tip_over_timoshenko(Index cells, double poisson_ratio) { return cantilever_ratio(cells, poisson_ratio, TetElements::Patched); }

/// Cubes split in five, alternately: the least stiff of the usual grids.
TetMesh make_five_split(Index nx, Index ny, Index nz, const std::function<Vec3(double, double, double)>& place) {
    TetMesh mesh;
    const auto id = [&](Index i, Index j, Index k) { return (k * (ny + 1) + j) * (nx + 1) + i; };
    for (Index k = 0; k <= nz; ++k)
        for (Index j = 0; j <= ny; ++j)
            for (Index i = 0; i <= nx; ++i) mesh.vertices.push_back(place(double(i) / nx, double(j) / ny, double(k) / nz));
    constexpr int kCorners[5][4] = {{0, 3, 5, 6}, {1, 0, 3, 5}, {2, 0, 3, 6}, {4, 0, 5, 6}, {7, 3, 5, 6}};
    for (Index k = 0; k < nz; ++k)
        for (Index j = 0; j < ny; ++j)
            for (Index i = 0; i < nx; ++i)
                for (const auto& corners : kCorners) {
                    Tet tet{};
                    for (std::size_t c = 0; c < 4; ++c) {
                        const Index corner = static_cast<Index>(corners[c]) ^ ((i + j + k) & 1);
                        tet[c] = id(i + (corner & 1), j + (corner >> 1 & 1), k + (corner >> 2));
                    }
                    Mat3 edges;
                    for (int e = 0; e < 3; ++e) edges.col(e) = mesh.vertices[tet[static_cast<std::size_t>(e) + 1]] - mesh.vertices[tet[0]];
                    if (edges.determinant() < 0.0) std::swap(tet[2], tet[3]);
                    mesh.tets.push_back(tet);
                }
    return mesh;
}

} // namespace

TEST(Patches, HoldEveryTetOnceAndHangTogetherAndKeepStiffnessesApart) {
    const TetMesh mesh = make_bar_mesh({7, 5, 4}, 0.01, 0.15);
    std::vector<double> stiffness(mesh.tets.size());
    for (std::size_t tet = 0; tet < stiffness.size(); ++tet) stiffness[tet] = mesh.vertices[mesh.tets[tet][0]][0] < 0.035 ? 1.0 : 7.0;
    std::vector<Index> order(mesh.tets.size());
    std::iota(order.begin(), order.end(), 0);
    const std::vector<Index> rows = make_patches(mesh.tets, stiffness, order);
    ASSERT_EQ(rows.size() % kPatch, 0u);
    std::vector<int> met(mesh.tets.size(), 0);
    for (std::size_t first = 0; first < rows.size(); first += kPatch) {
        ASSERT_NE(rows[first], kNoIndex);
        for (std::size_t k = first; k < first + kPatch && rows[k] != kNoIndex; ++k) {
            ++met[rows[k]];
            EXPECT_EQ(stiffness[rows[k]], stiffness[rows[first]]);
            bool joined = k == first;
            for (std::size_t other = first; other < k; ++other) {
                int shared = 0;
                for (const Index node : mesh.tets[rows[k]])
                    shared += std::find(mesh.tets[rows[other]].begin(), mesh.tets[rows[other]].end(), node) != mesh.tets[rows[other]].end();
                joined = joined || shared == 3;
            }
            EXPECT_TRUE(joined);
        }
    }
    EXPECT_EQ(std::count(met.begin(), met.end(), 1), static_cast<long>(met.size()));
    EXPECT_LT(rows.size(), 1.15 * static_cast<double>(mesh.tets.size())); // nearly all are full
}

TEST(Patches, AreTheDefaultAboveAPoissonsRatioOfFourTenths) {
    EXPECT_FALSE(uses_patches(make_material(MaterialLaw::NeoHookean, 0.4)));
    EXPECT_TRUE(uses_patches(make_material(MaterialLaw::NeoHookean, 0.41)));
    Material linear = make_material(MaterialLaw::NeoHookean, 0.49);
    linear.elements = TetElements::Linear;
    EXPECT_FALSE(uses_patches(linear));
}

TEST(Patches, CantileversOfSixCellsAreWithinThreePerCentOfTimoshenkoUpTo049) {
    for (const double nu : {0.3, 0.45, 0.49, 0.495}) {
        const double two = tip_over_timoshenko(2, nu), four = tip_over_timoshenko(4, nu), six = tip_over_timoshenko(6, nu);
        std::printf("patched cantilever, nu %.3f: tip over Timoshenko %.4f %.4f %.4f with 2, 4, 6 cells\n", nu, two, four, six);
        EXPECT_NEAR(two, 1.0, 0.15);
        EXPECT_NEAR(four, 1.0, 0.05);
        EXPECT_NEAR(six, 1.0, 0.03);
    }
}

TEST(Patches, CooksMembraneComesToTheReference) {
    // Plane stress in the limit of a thin plate: nu 1/3, E = F = 1, tip 23.96. Here a plate 1 thick, whose faces are free.
    const auto place = [](double u, double v, double w) { return Vec3(48.0 * u, 44.0 * u + v * (44.0 - 28.0 * u), w); };
    double last = 0.0;
    for (const Index cells : {8u, 16u}) {
        const TetMesh mesh = make_five_split(cells, cells, 1, place);
        Material material{.law = MaterialLaw::NeoHookean, .young_modulus = 1.0, .poisson_ratio = 1.0 / 3.0, .density = 1000.0};
        material.elements = TetElements::Patched;
        const TissueModel model = make_model(mesh, material, nodes_at(mesh, 0, 0.0));
        std::vector<Vec3> force = zeros(model.node_count());
        const std::vector<Index> end = nodes_at(mesh, 0, 48.0);
        for (const Index node : end) {
            const bool edge = mesh.vertices[node][1] < 44.01 || mesh.vertices[node][1] > 59.99;
            force[node][1] = (edge ? 0.25 : 0.5) / cells; // 1 in all, over both faces
        }
        const std::vector<Vec3> u = solve_small_strain(model, force);
        double tip = 0.0;
        for (const Index node : end)
            if (std::abs(mesh.vertices[node][1] - 52.0) < 0.01) tip += 0.5 * u[node][1];
        std::printf("Cook's membrane, %u cells: tip %.3f\n", cells, tip);
        last = tip;
    }
    EXPECT_NEAR(last, 23.96, 0.03 * 23.96);
}

TEST(Patches, ABlockUnderALoadOnItsMiddleDoesNotLockUpTo04999) {
    // The nearly incompressible block: held below, pressed on the middle quarter of its top; linear tets lose all of it.
    const Index cells = 6;
    std::vector<double> sinks[2];
    for (const double nu : {0.49, 0.499, 0.4999})
        for (const TetElements elements : kElements) {
            const TetMesh mesh = make_bar(cells, cells, cells, 1.0 / cells);
            Material material = make_material(MaterialLaw::NeoHookean, nu);
            material.young_modulus = 5000.0;
            material.elements = elements;
            const TissueModel model = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
            std::vector<Vec3> force = zeros(model.node_count());
            for (const Index node : nodes_at(mesh, 2, 1.0))
                if ((mesh.vertices[node] - Vec3(0.5, 0.5, 1.0)).cwiseAbs().maxCoeff() < 0.26) force[node][2] = -1.0;
            const std::vector<Vec3> u = solve_small_strain(model, force);
            double sink = 0.0;
            for (std::size_t node = 0; node < u.size(); ++node) sink = std::max(sink, -u[node][2]);
            sinks[elements == TetElements::Patched].push_back(sink);
        }
    std::printf("block, nu 0.49 0.499 0.4999: sinks %.4g %.4g %.4g linear, %.4g %.4g %.4g patched\n", sinks[0][0], sinks[0][1], sinks[0][2],
                sinks[1][0], sinks[1][1], sinks[1][2]);
    EXPECT_NEAR(sinks[1][2] / sinks[1][0], 1.0, 0.06); // what is nearly incompressible already hardly stiffens
    EXPECT_LT(sinks[0][2] / sinks[0][0], 0.75);        // linear tets: they lock
    EXPECT_LT(sinks[0][2] / sinks[1][2], 0.5);
}

TEST(Patches, KeepMomentumToRoundingAndPullNothingRound) {
    std::mt19937_64 random(34);
    for (const MaterialLaw law : kAllLaws)
        for (int trial = 0; trial < 10; ++trial) {
            const TissueModel model = make_model(make_bar_mesh({3, 3, 2}, 0.01, 0.15), patched(law, 0.3 + 0.019 * trial));
            std::vector<Vec3> position = model.rest_position, force = zeros(model.node_count());
            for (Vec3& x : position) x = 1.2 * x + random_vec(random, 0.004);
            (void)add_tet_forces(model, position, zeros(model.node_count()), force);
            Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
            double size = 0.0;
            for (std::size_t node = 0; node < force.size(); ++node) {
                sum += force[node];
                moment += position[node].cross(force[node]);
                size += force[node].norm();
            }
            EXPECT_LT(sum.norm(), 1e-13 * size);
            EXPECT_LT(moment.norm(), 1e-12 * size * 0.03);
        }
}

TEST(Patches, AThrownBodyGainsNoEnergy) {
    std::mt19937_64 random(35);
    for (const MaterialLaw law : kAllLaws)
        for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog}) {
            const TissueModel model = make_model(make_bar_mesh({4, 2, 2}, 0.01, 0.15), patched(law, 0.45));
            TissueState state = make_rest_state(model);
            for (Vec3& v : state.velocity) v = Vec3(0.2, 0, 0) + random_vec(random, 0.05);
            RkWorkspace workspace;
            StableStepWorkspace stable;
            double first = 0.0, most = 0.0;
            for (std::size_t node = 0; node < model.node_count(); ++node)
                first += 0.5 * model.node_mass[node] * state.velocity[node].squaredNorm();
            const Momentum before = find_momentum(model, state);
            for (int frame = 0; frame < 100; ++frame) {
                const AdvanceReport report = advance(model, state, 0.005, {}, {.integrator = integrator}, workspace, stable);
                ASSERT_TRUE(report.integrate.finite() && !report.refused);
                most = std::max(most, report.integrate.kinetic_j + report.integrate.elastic_j);
            }
            EXPECT_LT(most, (integrator == Integrator::Rk4 ? 1.001 : 1.02) * first) << kLawNames[static_cast<int>(law)];
            EXPECT_LT((find_momentum(model, state).linear - before.linear).norm(), 1e-12 * before.linear.norm());
        }
}

TEST(Patches, TheirStableStepHoldsAndIsLongerThanThatOfLinearTets) {
    for (const double nu : {0.4, 0.45, 0.49}) {
        Material material = make_material(MaterialLaw::NeoHookean, nu);
        const TetMesh mesh = make_bar_mesh({6, 4, 4}, 0.01, 0.15);
        double step[2];
        for (const TetElements elements : kElements) {
            material.elements = elements;
            StableStepWorkspace workspace;
            const TissueModel model = make_model(mesh, material);
            step[elements == TetElements::Patched] =
                find_stable_step(model, model.rest_position, nullptr, workspace, Integrator::Leapfrog).step;
        }
        EXPECT_GT(step[1], 1.1 * step[0]) << nu;
    }
}

} // namespace trocar::fem
