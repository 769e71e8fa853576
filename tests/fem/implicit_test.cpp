// Implicit steps of tissue: the laws that hold for any body, law, and length of step.
#include "fem/mesh/bar_mesh.hpp"
#include "fem/mesh/mapped_mesh.hpp"
#include "fem/mesh/wall_mesh.hpp"
#include "fem/tissue/implicit.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/statics.hpp"
#include "tests/fem/bodies.hpp"

#include <gtest/gtest.h>

#include <numbers>

namespace trocar::fem {

using namespace test;

namespace {

ImplicitSystem make_system(const TissueModel& model, double step) {
    auto system = make_implicit_system(model, step);
    if (!system.ok()) throw std::runtime_error(system.error().to_string());
    return std::move(system).value();
}

/// A body and what advances it.
struct Body {
    TissueModel model;
    double step; // s
    ImplicitSystem system = make_system(model, step);
    TissueState state = make_rest_state(model);
    RkWorkspace workspace = {};
    ImplicitWorkspace implicit = {};
    unsigned substeps = 1;

    Body(TissueModel of, double length) : model(std::move(of)), step(length) {}
    ImplicitReport advance(const IntegrateInputs& inputs = {}) {
        return advance_implicitly(model, system, state, step, substeps, inputs, workspace, implicit);
    }
};

/// As make_material, with elements that are asked for.
Material material_of(MaterialLaw law, double nu, TetElements elements) {
    Material material = make_material(law, nu);
    material.elements = elements;
    return material;
}

double farthest(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double most = 0.0;
    for (std::size_t node = 0; node < a.size(); ++node) most = std::max(most, (a[node] - b[node]).norm());
    return most;
}

} // namespace

TEST(Implicit, AFactorSolvesWhatItWasMadeOf) {
    std::mt19937_64 random(3);
    for (int trial = 0; trial < 30; ++trial) {
        const std::size_t rows = 1 + random() % 40;
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(3 * rows), static_cast<Eigen::Index>(3 * rows));
        std::vector<std::vector<bool>> joined(rows, std::vector<bool>(rows, false));
        for (std::size_t i = 0; i < rows; ++i) {
            joined[i][i] = true;
            for (int k = 0; k < 3; ++k) {
                const std::size_t j = random() % rows;
                joined[i][j] = joined[j][i] = true;
            }
        }
        BlockMatrix matrix;
        matrix.row_begin.assign(1, 0);
        for (std::size_t i = 0; i < rows; ++i)
            for (std::size_t j = 0; j <= i; ++j) {
                if (!joined[i][j]) continue;
                Mat3 block;
                for (int k = 0; k < 3; ++k) block.col(k) = random_vec(random, 1.0);
                if (i == j) block = Mat3(block * block.transpose()) + 60.0 * Mat3::Identity();
                dense.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) = block;
                dense.block<3, 3>(static_cast<Eigen::Index>(3 * j), static_cast<Eigen::Index>(3 * i)) = block.transpose();
            }
        for (std::size_t i = 0; i < rows; ++i) {
            for (std::size_t j = 0; j < rows; ++j) {
                if (!joined[i][j]) continue;
                matrix.column.push_back(static_cast<Index>(j));
                matrix.block.push_back(dense.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)));
            }
            matrix.row_begin.push_back(static_cast<Index>(matrix.column.size()));
        }
        const auto factor = make_block_factor(matrix);
        ASSERT_TRUE(factor.has_value());
        std::vector<Vec3> right(rows), out(rows);
        std::vector<std::array<float, 4>> scratch(rows);
        for (Vec3& v : right) v = random_vec(random, 1.0);
        factor->solve(right, out, scratch);
        Eigen::VectorXd x(static_cast<Eigen::Index>(3 * rows)), b(static_cast<Eigen::Index>(3 * rows));
        for (std::size_t i = 0; i < rows; ++i)
            for (int axis = 0; axis < 3; ++axis) {
                x(static_cast<Eigen::Index>(3 * i) + axis) = out[i][axis];
                b(static_cast<Eigen::Index>(3 * i) + axis) = right[i][axis];
            }
        EXPECT_LT((dense * x - b).norm(), 1e-5 * b.norm());
        matrix.block[0] = -matrix.block[0];
        EXPECT_FALSE(make_block_factor(matrix).has_value());
    }
}

TEST(Implicit, AFreeBodyFallsAsTheFormulaSaysAtAnyStep) {
    for (const double step : {0.00001, 0.001, 0.01, 0.1}) {
        Body body(make_model(make_bar(3, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.45)), step);
        const Vec3 throw_at(0.3, -0.2, 0.1), gravity(0, 0, -9.81);
        for (Vec3& v : body.state.velocity) v = throw_at;
        for (int k = 0; k < 10; ++k) ASSERT_EQ(body.advance({.gravity = gravity}).advance.time_done, step);
        const double t = 10.0 * step;
        for (std::size_t node = 0; node < body.state.position.size(); ++node) {
            EXPECT_LT((body.state.position[node] - body.model.rest_position[node] - t * throw_at - 0.5 * t * t * gravity).norm(), 0.5e-6 * t * t * gravity.norm() + 1e-12);
            EXPECT_LT((body.state.velocity[node] - throw_at - t * gravity).norm(), 1e-6 * t * gravity.norm() + 1e-9);
        }
    }
}

TEST(Implicit, AThrownBodyKeepsItsMomentumAndGainsNoEnergy) {
    std::mt19937_64 random(35);
    for (const MaterialLaw law : kAllLaws)
        for (const TetElements elements : kElements)
            for (const double step : {0.0005, 0.005, 0.03}) {
                Body body(make_model(make_bar_mesh({4, 2, 2}, 0.01, 0.15), material_of(law, 0.45, elements)), step);
                for (std::size_t node = 0; node < body.state.position.size(); ++node) {
                    body.state.position[node] = 1.05 * body.state.position[node] + random_vec(random, 0.0008);
                    body.state.velocity[node] = Vec3(0.2, 0, 0) + Vec3(3, 5, -4).cross(body.state.position[node]) + random_vec(random, 0.3);
                }
                const Momentum before = find_momentum(body.model, body.state);
                double last = measure_tets(body.model, body.state.position).elastic_energy;
                for (std::size_t node = 0; node < body.state.position.size(); ++node)
                    last += 0.5 * body.model.node_mass[node] * body.state.velocity[node].squaredNorm();
                const double first = last;
                for (int k = 0; k < 40; ++k) {
                    const ImplicitReport report = body.advance();
                    ASSERT_TRUE(report.advance.integrate.finite() && !report.advance.refused) << kLawNames[static_cast<int>(law)] << step;
                    const double now = report.advance.integrate.kinetic_j + report.advance.integrate.elastic_j;
                    EXPECT_LT(now, last + 1e-3 * first) << kLawNames[static_cast<int>(law)] << " at " << step << " in step " << k;
                    last = now;
                }
                EXPECT_LT((find_momentum(body.model, body.state).linear - before.linear).norm(), 1e-6 * before.linear.norm()) << step;
            }
}

TEST(Implicit, ComesToTheEquilibriumOfTheStaticSolver) {
    for (const MaterialLaw law : kAllLaws)
        for (const TetElements elements : kElements) {
            const TetMesh mesh = make_bar(6, 2, 2, 0.01);
            Material material = material_of(law, 0.4, elements);
            material.mass_damping = 20.0;
            Body body(make_model(mesh, material, nodes_at(mesh, 0, 0.0)), 0.02);
            std::vector<Vec3> force(body.model.node_count());
            for (std::size_t node = 0; node < force.size(); ++node) force[node] = body.model.node_mass[node] * Vec3(0, 1.0, -3.0);
            for (int k = 0; k < 150; ++k) ASSERT_FALSE(body.advance({.external_force = force}).advance.refused);
            std::vector<Vec3> left = force;
            (void)add_tet_forces(body.model, body.state.position, zeros(left.size()), left);
            double most = 0.0;
            for (std::size_t node = 0; node < left.size(); ++node)
                if (body.model.inv_mass[node] > 0.0) most = std::max(most, left[node].norm() / force[node].norm());
            EXPECT_LT(most, 1e-3) << kLawNames[static_cast<int>(law)];
            if (law == MaterialLaw::Hgo) continue; // fibres that begin to pull: the static solver's Newton steps do not settle
            const Equilibrium at_rest = find_equilibrium(body.model, force, 4);
            ASSERT_LT(at_rest.residual, 1e-6) << kLawNames[static_cast<int>(law)];
            const double way = farthest(at_rest.position, body.model.rest_position);
            EXPECT_GT(way, 0.001);
            EXPECT_LT(farthest(at_rest.position, body.state.position), 1e-4 * way) << kLawNames[static_cast<int>(law)];
        }
}

TEST(Implicit, IsOfSecondOrder) {
    for (const TetElements elements : kElements) {
        Material material = material_of(MaterialLaw::NeoHookean, 0.45, elements);
        material.viscosity = 2.0;
        const TetMesh mesh = make_bar(5, 2, 2, 0.01);
        const TissueModel model = make_model(mesh, material, nodes_at(mesh, 0, 0.0));
        const double whole = 0.08;
        const IntegrateInputs inputs{.gravity = Vec3(0, 0, -9.81)};
        TissueState exact = make_rest_state(model);
        RkWorkspace workspace;
        (void)integrate_rk4(model, exact, whole, 4000, inputs, workspace);
        double last = 0.0;
        for (const unsigned parts : {16u, 32u, 64u, 128u}) {
            Body body(model, whole / parts);
            for (unsigned k = 0; k < parts; ++k) (void)body.advance(inputs);
            const double error = farthest(exact.position, body.state.position);
            if (last > 0.0) {
                EXPECT_GT(last / error, parts == 32u ? 2.2 : 3.2) << parts;
            }
            last = error;
        }
        EXPECT_LT(last, 5e-4 * farthest(exact.position, model.rest_position));
    }
}

TEST(Implicit, ABodyOnSpringsRestsWithItsWeightOnThemAtAnyStep) {
    for (const double step : {0.002, 0.01, 0.03}) {
        Material material = make_material(MaterialLaw::NeoHookean, 0.45);
        material.mass_damping = 10.0;
        const TetMesh mesh = make_bar(3, 3, 3, 0.01);
        Body body(make_model(mesh, material), step);
        ContactSprings springs;
        const double stiffness = 500.0;
        for (const Index node : nodes_at(mesh, 2, 0.0)) {
            springs.springs.push_back({.first_entry = static_cast<Index>(springs.entries.size()), .entry_count = 1, .offset = 0.002, .stiffness = stiffness, .damping = 0.5});
            springs.entries.push_back({node, Vec3(0, 0, 1)});
        }
        double sum = 0.0;
        for (int k = 0; k < static_cast<int>(2.0 / step); ++k)
            ASSERT_FALSE(body.advance({.gravity = Vec3(0, 0, -9.81), .springs = &springs}).advance.refused) << step;
        for (const SpringEntry& entry : springs.entries) {
            const double gap = 0.002 + body.state.position[entry.node].z();
            sum += stiffness * std::max(0.0, -gap);
        }
        EXPECT_NEAR(sum / (9.81 * body.model.mass), 1.0, 1e-3) << step;
    }
}

TEST(Implicit, AStiffThinWallUnderPressureWidensAsLameSaysInLongSteps) {
    // 2 MPa, 0.2 mm around 10 mm: explicit steps of 10 ms would take some 3,000 sub-steps.
    TriMesh ball = make_octasphere(12);
    for (Vec3& v : ball.vertices) v *= 0.01;
    const double thick = 0.0002, pressure = 1000.0;
    const auto wall = make_wall_mesh(ball, {.thickness = thick, .layers = 1});
    ASSERT_TRUE(wall.ok() && !wall->folds);
    for (const double step : {0.002, 0.03}) {
        Material material = material_of(MaterialLaw::NeoHookean, 0.45, TetElements::Patched);
        material.young_modulus = 2e6;
        material.mass_damping = 20.0;
        Body body(make_model(wall->tets, material), step);
        std::vector<FacePressure> faces;
        for (const Triangle& t : ball.triangles) faces.push_back({{t[0], t[2], t[1]}, pressure});
        ImplicitReport report;
        for (int k = 0; k < static_cast<int>(0.9 / step); ++k) {
            report = body.advance({.pressures = faces});
            ASSERT_FALSE(report.advance.refused) << step;
            ASSERT_EQ(report.advance.rejected, 0u) << step;
        }
        double sum = 0.0;
        for (std::size_t v = 0; v < ball.vertices.size(); ++v) sum += body.state.position[v].norm() - 0.01;
        const double a3 = 1.0, b3 = std::pow(1.0 + thick / 0.01, 3);
        const double lame = pressure / 2e6 * 0.01 * ((1.0 - 0.9) * a3 + 1.45 * 0.5 * b3) / (b3 - a3);
        EXPECT_NEAR(sum / static_cast<double>(ball.vertices.size()) / lame, 1.0, 0.05) << step;
        EXPECT_LT(report.iterations, 20u) << step;
    }
}

TEST(Implicit, HeldNodesArriveWhereTheyAreSentAndBitsDoNotDependOnThreads) {
    const TetMesh mesh = make_bar(8, 3, 3, 0.01);
    Material material = make_material(MaterialLaw::NeoHookean, 0.45);
    material.viscosity = 1.0;
    const TissueModel model = make_model(mesh, material, nodes_at(mesh, 0, 0.0));
    std::vector<Vec3> ends[2];
    for (const unsigned threads : {1u, 2u}) {
        Body body(model, 0.01);
        body.workspace.threads = threads;
        std::vector<Vec3> target;
        for (int k = 1; k <= 20; ++k) {
            target.clear();
            for (const Index node : model.pinned) target.push_back(model.rest_position[node] + k * Vec3(0.0005, 0, 0.0002));
            ASSERT_FALSE(body.advance({.gravity = Vec3(0, 0, -9.81), .pinned_target = target}).advance.refused);
            for (std::size_t i = 0; i < target.size(); ++i) ASSERT_EQ(body.state.position[model.pinned[i]], target[i]);
        }
        ends[threads - 1] = body.state.position;
    }
    EXPECT_EQ(ends[0], ends[1]);
}

TEST(Implicit, CrushedAndTurnedInsideOutItComesBackOrSaysWhatIsLeft) {
    std::mt19937_64 random(4);
    for (const MaterialLaw law : kAllLaws)
        for (const TetElements elements : kElements) {
            Material material = material_of(law, 0.45, elements);
            material.mass_damping = 20.0;
            Body body(make_model(make_bar(4, 2, 2, 0.01), material), 0.02);
            for (Vec3& x : body.state.position) x = Vec3(0.3 * x.x(), x.y(), x.z()) + random_vec(random, 0.004);
            bool refused = false;
            for (int k = 0; k < 100 && !refused; ++k) {
                const ImplicitReport report = body.advance();
                ASSERT_TRUE(report.advance.integrate.finite());
                refused = report.advance.refused;
                if (refused) {
                    EXPECT_GT(report.unsolved, 0.0);
                }
            }
            EXPECT_FALSE(refused) << kLawNames[static_cast<int>(law)];
        }
}

TEST(Implicit, StressRelaxesAsExplicitly) {
    Material material = make_material(MaterialLaw::NeoHookean, 0.4);
    material.g1 = 1.5, material.tau1 = 0.1;
    material.mass_damping = 30.0;
    const TetMesh mesh = make_bar(4, 2, 2, 0.01);
    const TissueModel model = make_model(mesh, material, nodes_at(mesh, 0, 0.0));
    std::vector<Vec3> force(model.node_count());
    for (std::size_t node = 0; node < force.size(); ++node) force[node] = model.node_mass[node] * Vec3(4.0, 0, -2.0);
    TissueState exact = make_rest_state(model);
    exact.relaxed.resize(relaxation_size(model), 0.0);
    RkWorkspace workspace;
    (void)integrate_rk4(model, exact, 0.2, 4000, {.external_force = force}, workspace);
    double last = 0.0;
    for (const unsigned parts : {20u, 40u, 80u}) {
        Body body(model, 0.2 / parts);
        for (unsigned k = 0; k < parts; ++k) ASSERT_FALSE(body.advance({.external_force = force}).advance.refused);
        const double error = farthest(exact.position, body.state.position);
        if (last > 0.0) {
            EXPECT_GT(last / error, 1.6) << parts;
        }
        last = error;
    }
    EXPECT_LT(last, 0.02 * farthest(exact.position, model.rest_position));
}

TEST(Implicit, TooManyNodesAreRefused) {
    const auto system = make_implicit_system(make_model(make_bar(30, 26, 26, 0.01), make_material(MaterialLaw::NeoHookean)), 0.01);
    ASSERT_FALSE(system.ok());
    EXPECT_NE(system.error().message.find("expected at most 20000"), std::string::npos);
}

} // namespace trocar::fem
