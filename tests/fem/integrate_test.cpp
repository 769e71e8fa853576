#include "fem/tissue/integrate.hpp"
#include "fem/tissue/stable_step.hpp"
#include "tests/fem/bodies.hpp"

#include <gtest/gtest.h>

namespace trocar::fem {

using namespace test;

namespace {

double stable_step(const TissueModel& model, const std::vector<Vec3>& position) {
    StableStepWorkspace workspace;
    return find_stable_step(model, position, nullptr, workspace).step;
}

/// A bar that tumbles and wobbles.
TissueState thrown_bar(const TissueModel& model) {
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < model.node_count(); ++node) {
        const Vec3& x = model.rest_position[node];
        state.velocity[node] = Vec3(0.3, -0.2, 0.5) + Vec3(3, 5, -4).cross(x) + Vec3(0, 8 * x[0] * x[0] / 0.04, 4 * x[1]);
    }
    return state;
}

IntegrateReport run(const TissueModel& model, TissueState& state, double duration, int steps, const IntegrateInputs& inputs = {}) {
    RkWorkspace workspace;
    return integrate_rk4(model, state, duration, static_cast<unsigned>(steps), inputs, workspace);
}

double distance(const TissueState& a, const TissueState& b) {
    double most = 0.0;
    for (std::size_t node = 0; node < a.position.size(); ++node) most = std::max(most, (a.position[node] - b.position[node]).norm());
    return most;
}

} // namespace

TEST(Integrate, FreeFlightKeepsMomentumToRounding) {
    for (const MaterialLaw law : kLaws) {
        Material material = make_material(law, 0.4);
        material.viscosity = 0.5;
        const auto model = make_model(make_bar(6, 2, 2, 0.01), material);
        TissueState state = thrown_bar(model);
        const Momentum before = find_momentum(model, state);
        run(model, state, 0.2, static_cast<int>(0.2 / stable_step(model, state.position)) + 1);
        const Momentum after = find_momentum(model, state);
        EXPECT_LT((after.linear - before.linear).norm(), 1e-12 * before.linear.norm());
        EXPECT_LT((after.angular - before.angular).norm(), 2e-5 * before.angular.norm()) << "order 4 only, see below";
    }
}

TEST(Integrate, AngularMomentumErrorFallsWithOrderFour) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.4));
    const int coarse = static_cast<int>(0.1 / stable_step(model, model.rest_position)) + 1;
    double error[2];
    for (int level = 0; level < 2; ++level) {
        TissueState state = thrown_bar(model);
        const Momentum before = find_momentum(model, state);
        run(model, state, 0.1, coarse << (level + 1));
        error[level] = (find_momentum(model, state).angular - before.angular).norm();
    }
    EXPECT_GT(error[0] / error[1], 14.0);
}

TEST(Integrate, IsOfOrderFourInTheStep) {
    const auto model = make_model(make_bar(4, 1, 1, 0.01), make_material(MaterialLaw::NeoHookean, 0.3), {0, 5});
    const int coarse = 4 * static_cast<int>(0.05 / stable_step(model, model.rest_position)) + 2;
    TissueState exact = thrown_bar(model);
    run(model, exact, 0.05, coarse * 32, {.gravity = Vec3(0, 0, -9.81)});
    double error[3];
    for (int level = 0; level < 3; ++level) {
        TissueState state = thrown_bar(model);
        run(model, state, 0.05, coarse << level, {.gravity = Vec3(0, 0, -9.81)});
        error[level] = distance(state, exact);
    }
    EXPECT_GT(std::log2(error[0] / error[1]), 3.7) << error[0] << " " << error[1];
    EXPECT_GT(std::log2(error[1] / error[2]), 3.7) << error[1] << " " << error[2];
}

TEST(Integrate, UndampedFreeBarKeepsItsEnergyForTenSeconds) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.3));
    TissueState state = thrown_bar(model);
    RkWorkspace workspace;
    const double step = 0.01;
    const auto substeps = static_cast<unsigned>(step / stable_step(model, state.position)) + 1;
    const double first = integrate_rk4(model, state, 1e-6, 1, {}, workspace).kinetic_j;
    double most = 0.0, last = 0.0;
    for (int frame = 0; frame < 1000; ++frame) {
        const IntegrateReport report = integrate_rk4(model, state, step, substeps, {}, workspace);
        last = report.kinetic_j + report.elastic_j;
        most = std::max(most, last);
    }
    RecordProperty("relative_drift", std::to_string((last - first) / first));
    EXPECT_LT(most, first * (1.0 + 1e-4)) << "RK4 may lose, never gain";
    EXPECT_GT(last, 0.97 * first);
}

TEST(Integrate, PinnedNodesArriveAtTheirTargetOnAStraightLine) {
    const TetMesh mesh = make_bar(3, 1, 1, 0.01);
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean), nodes_at(mesh, 0, 0.0));
    TissueState state = make_rest_state(model);
    std::vector<Vec3> target;
    for (const Index node : model.pinned) target.push_back(mesh.vertices[node] + Vec3(0.001, 0.002, 0));
    const auto report = run(model, state, 0.01, 40, {.gravity = Vec3(0, 0, -9.81), .pinned_target = target});
    ASSERT_TRUE(report.finite());
    for (std::size_t k = 0; k < target.size(); ++k) {
        EXPECT_EQ(state.position[model.pinned[k]], target[k]);
        EXPECT_LT((state.velocity[model.pinned[k]] - Vec3(0.1, 0.2, 0)).norm(), 1e-12);
    }
    run(model, state, 0.01, 40, {});
    for (std::size_t k = 0; k < target.size(); ++k) EXPECT_EQ(state.position[model.pinned[k]], target[k]);
}

TEST(Integrate, StateThatIsNotFiniteIsReportedAndNotSpread) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean));
    TissueState state = make_rest_state(model);
    state.velocity[17][1] = std::numeric_limits<double>::quiet_NaN();
    const IntegrateReport arrived = run(model, state, 0.001, 4);
    EXPECT_EQ(arrived.first_bad_node, 17U);
    EXPECT_EQ(arrived.substeps_done, 0U);
    for (const Vec3& x : state.position) EXPECT_TRUE(is_finite(x));
}

TEST(Integrate, BlowUpStopsAtTheLastFiniteSubstepAndNamesNodeAndTet) {
    const auto model = make_model(make_bar(3, 1, 1, 0.01), make_material(MaterialLaw::StVK));
    TissueState state = thrown_bar(model);
    const auto report = run(model, state, 40.0, 400); // far beyond the stable step
    EXPECT_FALSE(report.finite());
    EXPECT_LT(report.substeps_done, 400U);
    EXPECT_LT(report.first_bad_tet, model.tet_count());
    for (std::size_t node = 0; node < model.node_count(); ++node)
        EXPECT_TRUE(is_finite(state.position[node]) && is_finite(state.velocity[node]));
}

TEST(Integrate, NeoHookeanRecoversFromPlanesPointsTwistsAndChaos) {
    Material material = make_material(MaterialLaw::NeoHookean, 0.45);
    material.viscosity = 1.0;
    material.mass_damping = 4.0;
    const TetMesh mesh = make_bar(3, 3, 3, 0.01);
    const auto model = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
    const auto squash = [&](int kind) {
        std::mt19937_64 random(7);
        TissueState state = make_rest_state(model);
        for (std::size_t node = 0; node < model.node_count(); ++node) {
            Vec3& x = state.position[node];
            if (model.inv_mass[node] == 0.0) continue;
            if (kind == 0) x[2] = 0.0;                                // a plane
            if (kind == 1) x = Vec3(0.015, 0.015, 0.01);              // a point
            if (kind == 2) x = Vec3(0.03 - x[0], 0.03 - x[1], -x[2]); // inside out
            if (kind == 3) x += random_vec(random, 0.02);             // twice the cell: most tets inverted
            x += random_vec(random, 1e-6);
        }
        return state;
    };
    for (int kind = 0; kind < 4; ++kind) {
        TissueState state = squash(kind);
        RkWorkspace workspace;
        StableStepWorkspace stable;
        IntegrateReport report;
        for (int frame = 0; frame < 300 && report.finite(); ++frame) {
            const AdvanceReport advanced = advance(model, state, 0.01, {}, {}, workspace, stable);
            ASSERT_FALSE(advanced.refused) << kind << " frame " << frame << " step " << advanced.tightest.step;
            report = advanced.integrate;
        }
        EXPECT_TRUE(report.finite()) << kind;
        EXPECT_EQ(report.inverted, 0U) << kind;
        double off = 0.0;
        for (std::size_t node = 0; node < model.node_count(); ++node)
            off = std::max(off, (state.position[node] - model.rest_position[node]).norm());
        EXPECT_LT(off, 1e-3) << kind;
    }
}

TEST(Integrate, SlabUnderSuddenGravityCollapsesWithStVKAndSaysSo) {
    // rho g H / E = 0.24: silently wrong but for the count of inverted tets. 0.12 is fine.
    for (const double load : {0.12, 0.30}) {
        Material material = make_material(MaterialLaw::StVK, 0.3);
        material.young_modulus = 1000.0 * 9.81 * 0.04 / load;
        material.mass_damping = 2.0;
        const TetMesh mesh = make_bar(6, 6, 4, 0.01);
        const auto model = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
        TissueState state = make_rest_state(model);
        RkWorkspace workspace;
        StableStepWorkspace stable;
        std::uint32_t inverted = 0;
        double least = 1.0;
        for (int frame = 0; frame < 60; ++frame) {
            const unsigned substeps = count_substeps(0.01, find_stable_step(model, state.position, nullptr, stable), 5000);
            ASSERT_GT(substeps, 0U);
            const auto report = integrate_rk4(model, state, 0.01, substeps, {.gravity = Vec3(0, 0, -9.81)}, workspace);
            ASSERT_TRUE(report.finite());
            inverted = std::max(inverted, report.inverted);
            least = std::min(least, report.min_volume_ratio);
        }
        if (load < 0.2) {
            EXPECT_GT(least, 0.4);
        }
        if (load > 0.2) {
            EXPECT_GT(inverted, 0U) << least;
        }
    }
}

TEST(Integrate, SmallestVolumeAndInvertedTetsAreOfTheStateThatIsLeft) {
    // From places so wild that sub-steps are rejected and stages within them invert what the end has upright again.
    std::mt19937_64 random(16);
    std::size_t inverted = 0, upright = 0, only_within = 0;
    for (const MaterialLaw law : kLaws)
        for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog})
            for (int k = 0; k < 25; ++k) {
                const TetMesh mesh = make_bar(2, 2, 2, 0.01);
                Material material = make_material(law, 0.3);
                material.viscosity = 1e-3;
                const auto model = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
                TissueState state = make_rest_state(model);
                const double wild = std::uniform_real_distribution<double>(0.0, 0.008)(random);
                for (Vec3& x : state.position) x += random_vec(random, wild);
                for (Vec3& v : state.velocity) v += random_vec(random, 2.0);
                RkWorkspace workspace;
                StableStepWorkspace stable;
                const auto done = advance(model, state, 0.003, {}, {.integrator = integrator, .max_substeps = 20000}, workspace, stable);
                const IntegrateReport& report = done.integrate;
                const TetReport end = measure_tets(model, state.position);
                EXPECT_EQ(report.min_volume_ratio <= 0.0, report.inverted > 0);
                EXPECT_EQ(report.inverted, end.inverted);
                EXPECT_NEAR(report.min_volume_ratio, end.min_volume_ratio, 1e-12);
                EXPECT_LE(report.least_stage_ratio, report.min_volume_ratio);
                inverted += report.inverted > 0;
                upright += report.inverted == 0;
                only_within += report.inverted == 0 && report.least_stage_ratio <= 0.0;
            }
    EXPECT_GT(inverted, 5u);
    EXPECT_GT(upright, 5u);
    EXPECT_GT(only_within, 0u) << "the case that the two numbers contradicted each other in";
}

TEST(Advance, RefusesWithTheStepThatWouldWorkAndLeavesTheStateFinite) {
    const auto model = make_model(make_bar(3, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean));
    TissueState state = thrown_bar(model);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    const AdvanceReport report = advance(model, state, 10.0, {}, {.max_substeps = 50}, workspace, stable);
    EXPECT_TRUE(report.refused);
    EXPECT_GT(report.tightest.step, 1e-4);
    EXPECT_LT(report.tightest.worst_tet, model.tet_count());
    EXPECT_EQ(report.time_done, 0.0);
    const AdvanceReport fine = advance(model, state, 0.02, {}, {}, workspace, stable);
    EXPECT_FALSE(fine.refused);
    EXPECT_EQ(fine.time_done, 0.02);
    EXPECT_GE(fine.integrate.substeps_done, 0.02 / fine.tightest.step / 1.5);
}

TEST(Advance, MovesPinnedNodesLinearlyThroughUnequalSubsteps) {
    const TetMesh mesh = make_bar(3, 1, 1, 0.01);
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean), nodes_at(mesh, 0, 0.0));
    TissueState state = make_rest_state(model);
    std::vector<Vec3> target;
    for (const Index node : model.pinned) target.push_back(mesh.vertices[node] + Vec3(-0.004, 0.002, 0));
    RkWorkspace workspace;
    StableStepWorkspace stable;
    ASSERT_EQ(advance(model, state, 0.05, {.pinned_target = target}, {}, workspace, stable).time_done, 0.05);
    for (std::size_t k = 0; k < target.size(); ++k) EXPECT_EQ(state.position[model.pinned[k]], target[k]);
}

TEST(Springs, PushOnlyAndHoldABodyAboveAFloor) {
    Material material = make_material(MaterialLaw::NeoHookean, 0.4);
    material.mass_damping = 8.0;
    const TetMesh mesh = make_bar(3, 3, 2, 0.01);
    const auto model = make_model(mesh, material);
    ContactSprings floor;
    for (Index node = 0; node < mesh.vertices.size(); ++node) {
        floor.springs.push_back({.first_entry = node, .entry_count = 1, .offset = 0.001, .stiffness = 20.0, .damping = 0.01});
        floor.entries.push_back({node, Vec3::UnitZ()});
    }
    TissueState state = make_rest_state(model);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    for (int frame = 0; frame < 200; ++frame) {
        const unsigned substeps = count_substeps(0.01, find_stable_step(model, state.position, &floor, stable), 500);
        ASSERT_GT(substeps, 0U);
        const IntegrateInputs inputs{.gravity = Vec3(0, 0, -9.81), .springs = &floor};
        ASSERT_TRUE(integrate_rk4(model, state, 0.01, substeps, inputs, workspace).finite());
    }
    auto force = zeros(model.node_count());
    const SpringReport report = add_spring_forces(floor, 0.0, state.position, state.velocity, force);
    Vec3 sum = Vec3::Zero();
    for (const Vec3& f : force) {
        EXPECT_GE(f[2], 0.0);
        sum += f;
    }
    EXPECT_NEAR(sum[2], model.mass * 9.81, 0.02 * model.mass * 9.81);
    EXPECT_GT(report.pressed, 0U);
    EXPECT_LT(report.deepest_gap, 0.0);
}

/// A floor that rises against a body at rest, and the body that falls on a floor at rest: the same, seen from elsewhere.
void falls_as_the_floor_rises(Integrator integrator, bool adaptive) {
    constexpr double kSpeed = 0.3, kStep = 0.02; // m/s, s
    const TetMesh mesh = make_bar(2, 2, 2, 0.01);
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean, 0.4));
    const auto run = [&](double floor_rises, double body_falls) {
        ContactSprings floor;
        for (Index node = 0; node < mesh.vertices.size(); ++node) {
            floor.springs.push_back(
                {.first_entry = node, .entry_count = 1, .offset = 0.001, .rate = -floor_rises, .stiffness = 50.0, .damping = 0.02});
            floor.entries.push_back({node, Vec3::UnitZ()});
        }
        TissueState state = make_rest_state(model);
        for (Vec3& v : state.velocity) v[2] = -body_falls;
        RkWorkspace workspace;
        StableStepWorkspace stable;
        const IntegrateInputs inputs{.springs = &floor};
        if (adaptive)
            EXPECT_EQ(advance(model, state, kStep, inputs, {.integrator = integrator}, workspace, stable).time_done, kStep);
        else
            EXPECT_TRUE(integrate(model, state, kStep, 64, inputs, integrator, workspace).finite());
        return state;
    };
    const TissueState pushed = run(kSpeed, 0.0), fallen = run(0.0, kSpeed);
    double fastest = 0.0;
    for (std::size_t n = 0; n < model.node_count(); ++n) {
        EXPECT_LT((pushed.position[n] - fallen.position[n] - Vec3(0, 0, kSpeed * kStep)).norm(), 1e-12) << n;
        EXPECT_LT((pushed.velocity[n] - fallen.velocity[n] - Vec3(0, 0, kSpeed)).norm(), 1e-9) << n;
        fastest = std::max(fastest, pushed.velocity[n][2]);
    }
    EXPECT_GT(fastest, 0.5 * kSpeed) << "it was pushed at all";
}

TEST(Springs, FollowAPrescribedMotionOfTheObstacle) {
    for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog})
        for (const bool adaptive : {false, true}) falls_as_the_floor_rises(integrator, adaptive);
}

TEST(Springs, NeverStickToABodyThatLeaves) {
    ContactSprings springs{.springs = {{.first_entry = 0, .entry_count = 2, .offset = 0.0, .stiffness = 10.0, .damping = 100.0}},
                           .entries = {{0, Vec3(0, 0, 1)}, {1, Vec3(0, 0, -1)}}};
    const std::vector<Vec3> position{Vec3(0, 0, -0.01), Vec3(0, 0, 0)};
    std::vector<Vec3> leaving{Vec3(0, 0, 5), Vec3(0, 0, 0)}, coming{Vec3(0, 0, -5), Vec3(0, 0, 0)}, force = zeros(2);
    add_spring_forces(springs, 0.0, position, leaving, force);
    EXPECT_EQ(force[0], Vec3(0, 0, 0.1));
    EXPECT_EQ(force[0], -force[1]);
    force = zeros(2);
    add_spring_forces(springs, 0.0, position, coming, force);
    EXPECT_NEAR(force[0][2], 500.1, 1e-9);
    force = zeros(2);
    EXPECT_EQ(add_spring_forces(springs, 0.0, {leaving}, coming, force).pressed, 0U) << "apart: no force";
    EXPECT_EQ(force[0], Vec3(0, 0, 0));
}

TEST(TissueModel, RefusesBrokenMeshesByTetAndNode) {
    const TetMesh good = make_bar(1, 1, 1, 0.01);
    const Material material;
    const auto message = [&](auto&& change) {
        TetMesh mesh = good;
        change(mesh);
        const auto model = make_tissue_model(mesh, material, {});
        return model ? std::string("accepted") : model.error().message;
    };
    EXPECT_NE(message([](TetMesh& m) { std::swap(m.tets[3][0], m.tets[3][1]); }).find("tet 3 (nodes"), std::string::npos);
    EXPECT_NE(message([](TetMesh& m) { std::swap(m.tets[3][0], m.tets[3][1]); }).find("inverted"), std::string::npos);
    EXPECT_NE(message([](TetMesh& m) {
                  for (Vec3& v : m.vertices) v[2] = 0;
              }).find("tet 0 (nodes 0, 1, 3, 7) is flat"),
              std::string::npos);
    EXPECT_NE(message([](TetMesh& m) { m.tets[2][1] = 99; }).find("tet 2"), std::string::npos);
    EXPECT_NE(message([](TetMesh& m) { m.tets[2][1] = m.tets[2][0]; }).find("twice"), std::string::npos);
    EXPECT_NE(message([](TetMesh& m) { m.vertices[5][0] = std::nan(""); }).find("node 5 is not finite"), std::string::npos);
    EXPECT_NE(message([](TetMesh& m) { m.vertices.emplace_back(1, 1, 1); }).find("node 8 belongs to no tet"), std::string::npos);
    EXPECT_NE(message([](TetMesh& m) {
                  m.tets.push_back({m.tets[4][1], m.tets[4][2], m.tets[4][0], m.tets[4][3]});
              }).find("tet 6"),
              std::string::npos);
    EXPECT_NE(message([](TetMesh& m) {
                  m.tets.push_back({m.tets[4][1], m.tets[4][2], m.tets[4][0], m.tets[4][3]});
              }).find("is there already, as tet 4"),
              std::string::npos);
    EXPECT_NE(message([](TetMesh& m) {
                  for (const Vec3& v : {Vec3(5, 5, 5), Vec3(6, 5, 5), Vec3(5, 6, 5), Vec3(5, 5, 6)}) m.vertices.push_back(v);
                  m.tets.push_back({8, 9, 10, 11});
              }).find("tet 6 (nodes 8, 9, 10, 11) belongs to a part that shares no node"),
              std::string::npos);
    EXPECT_EQ(message([](TetMesh& m) { m.tets.clear(); }), "the mesh has no tetrahedra");
    const std::vector<Index> pins{3, 1, 3, 400};
    EXPECT_NE(make_tissue_model(good, material, pins).error().message.find("400"), std::string::npos);
    EXPECT_NE(make_tissue_model(good, {.poisson_ratio = 0.5}, {}).error().message.find("poisson_ratio"), std::string::npos);
    EXPECT_NE(make_tissue_model(good, {.poisson_ratio = -1.2}, {}).error().message.find("poisson_ratio"), std::string::npos);
    EXPECT_NE(make_tissue_model(good, {.young_modulus = 0.0}, {}).error().message.find("young_modulus"), std::string::npos);
    EXPECT_NE(make_tissue_model(good, {.density = 0.0}, {}).error().message.find("density"), std::string::npos);
    EXPECT_NE(make_tissue_model(good, {.density = -1.0}, {}).error().message.find("density"), std::string::npos);
    EXPECT_NEAR(make_model(good, material).mass, 1060.0 * 1e-6, 1e-15);
}

} // namespace trocar::fem
