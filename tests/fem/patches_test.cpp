// Patches of tetrahedra: what they are, and that nearly incompressible bodies bend as they should.
#include "fem/tissue/patches.hpp"

#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/classical_cases.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/validation.hpp"
#include "tests/fem/bodies.hpp"

#include <cmath>
#include <cstdio>
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

} // namespace

TEST(Patches, HoldEveryTetOnceAndHangTogetherAndKeepStiffnessesApart) {
    const TetMesh mesh = make_bar_mesh({7, 5, 4}, 0.01, 0.15);
    std::vector<double> stiffness(mesh.tets.size());
    for (std::size_t tet = 0; tet < stiffness.size(); ++tet) stiffness[tet] = mesh.vertices[mesh.tets[tet][0]][0] < 0.035 ? 1.0 : 7.0;
    std::vector<Index> order(mesh.tets.size());
    std::iota(order.begin(), order.end(), 0);
    const std::vector<Index> rows = make_patches(mesh.tets, mesh.vertices, stiffness, order);
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

/// Sets of tets.
static std::set<std::set<Index>> patches_of(const std::vector<Vec3>& position, std::span<const Tet> tets, std::span<const Index> order) {
    std::set<std::set<Index>> patches;
    const std::vector<Index> rows = make_patches(tets, position, std::vector<double>(tets.size(), 1.0), order);
    for (std::size_t first = 0; first < rows.size(); first += kPatch) {
        std::set<Index> patch(rows.begin() + static_cast<std::ptrdiff_t>(first), rows.begin() + static_cast<std::ptrdiff_t>(first + kPatch));
        patch.erase(kNoIndex);
        patches.insert(std::move(patch));
    }
    return patches;
}

TEST(Patches, AreTheSameHoweverAMeshIsTurnedMovedScaledAndSorted) {
    std::mt19937_64 random(36);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int trial = 0; trial < 40; ++trial) {
        const auto count = [&] { return static_cast<Index>(1 + random() % 6); };
        TetMesh mesh = make_bar_mesh({count(), count(), count()}, 0.01, 0.0);
        for (Vec3& x : mesh.vertices) x += random_vec(random, 0.0015); // no two tets are alike
        std::vector<Index> order(mesh.tets.size());
        std::iota(order.begin(), order.end(), 0);
        const auto patches = patches_of(mesh.vertices, mesh.tets, order);
        const Mat3 turn = random_rotation(random);
        const double scale = std::pow(10.0, 4.0 * unit(random) - 2.0);
        const Vec3 move = random_vec(random, 0.1);
        for (Vec3& x : mesh.vertices) x = scale * (turn * x + move);
        std::shuffle(order.begin(), order.end(), random);
        EXPECT_EQ(patches_of(mesh.vertices, mesh.tets, order), patches) << "trial " << trial;
    }
}

/// However many tets share a face, and however unequal they are.
TEST(Patches, HoldEveryTetOfOverlappingAndUnequalOnes) {
    std::mt19937_64 random(38);
    for (int trial = 0; trial < 40; ++trial) {
        TetMesh mesh = make_bar_mesh({3, 2, 2}, 0.01, 0.15);
        const std::size_t whole = mesh.vertices.size();
        for (int k = 0; k < 150; ++k) { // some on faces that have two already
            const Tet& on = mesh.tets[random() % mesh.tets.size()];
            mesh.vertices.push_back(mesh.vertices[on[3]] + random_vec(random, 0.002));
            const Index apex = k % 3 == 0 ? static_cast<Index>(random() % whole) : static_cast<Index>(mesh.vertices.size() - 1);
            if (std::find(on.begin(), on.end(), apex) == on.end()) mesh.tets.push_back({on[0], on[1], on[2], apex});
        }
        std::vector<Index> order(mesh.tets.size());
        std::iota(order.begin(), order.end(), 0);
        std::size_t held = 0;
        for (const std::set<Index>& patch : patches_of(mesh.vertices, mesh.tets, order)) held += patch.size();
        EXPECT_EQ(held, mesh.tets.size()) << "trial " << trial;
    }
}

TEST(Patches, OfMeshesWithTinyPartsAreTheSameHoweverTheyAreTurned) {
    std::mt19937_64 random(39);
    for (const double tiny : {1e-2, 1e-4}) {
        TetMesh mesh = make_bar_mesh({3, 3, 8}, tiny, 0.0);
        for (Vec3& x : mesh.vertices) x += random_vec(random, 0.15 * tiny);
        const Tet on = mesh.tets.back();
        for (const double size : {1.0, 1.3}) { // two large ones on a face of it
            mesh.vertices.push_back(mesh.vertices[on[0]] + size * Vec3(0.3, 0.8, 1.0));
            mesh.tets.push_back({on[0], on[1], size > 1.0 ? static_cast<Index>(mesh.vertices.size() - 2) : on[2], static_cast<Index>(mesh.vertices.size() - 1)});
        }
        std::vector<Index> order(mesh.tets.size());
        std::iota(order.begin(), order.end(), 0);
        const auto patches = patches_of(mesh.vertices, mesh.tets, order);
        for (int turn = 0; turn < 5; ++turn) {
            std::vector<Vec3> turned;
            const Mat3 rotation = random_rotation(random);
            for (const Vec3& x : mesh.vertices) turned.push_back(rotation * x);
            std::shuffle(order.begin(), order.end(), random);
            EXPECT_EQ(patches_of(turned, mesh.tets, order), patches) << tiny;
        }
    }
}

/// Regular meshes have tets that are alike by symmetry: what is chosen among them depends on how the mesh lies, how stiff the body is hardly does.
TEST(Patches, CantileversBendAlikeHoweverTheirMeshesLie) {
    std::mt19937_64 random(37);
    for (const auto& [cells, spread] : {std::pair{2u, 0.40}, {3u, 0.10}, {4u, 0.03}, {6u, 0.015}}) {
        double least = 1e9, most = 0.0;
        for (int turn = 0; turn < (cells < 6 ? 12 : 6); ++turn) {
            const double tip = cantilever_ratio(cells, 0.45, TetElements::Patched, turn == 0 ? Mat3(Mat3::Identity()) : random_rotation(random));
            least = std::min(least, tip), most = std::max(most, tip);
        }
        std::printf("patched cantilever of %u cells, turned at rest: tip over Timoshenko %.4f to %.4f\n", cells, least, most);
        EXPECT_LT(most / least, 1.0 + spread) << cells;
        EXPECT_GT(least, 0.96) << cells;
        EXPECT_LT(most, cells == 2 ? 1.45 : 1.12) << cells;
    }
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
    for (const Index cells : {8u, 16u}) {
        const double tip = cook_tip(cells, TetElements::Patched);
        std::printf("Cook's membrane, %u cells: tip %.3f\n", cells, tip);
        EXPECT_NEAR(tip, kCookTip, (cells > 8 ? 0.03 : 0.05) * kCookTip);
    }
}

TEST(Patches, ABlockUnderALoadOnItsMiddleDoesNotLockUpTo04999) {
    // The nearly incompressible block: held below, pressed on the middle quarter of its top; linear tets lose all of it.
    const Index cells = 8;
    std::vector<double> sinks[2];
    for (const double nu : {0.49, 0.499, 0.4999})
        for (const TetElements elements : kElements) sinks[elements == TetElements::Patched].push_back(block_sink(cells, nu, elements));
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
