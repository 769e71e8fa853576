// The model against analytic answers: modes, wave speeds, beams, compression; both integrators at their edges.
#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/statics.hpp"
#include "fem/tissue/validation.hpp"
#include "tests/fem/bodies.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>

namespace trocar::fem {

using namespace test;

namespace {

constexpr double kYoung = 20000.0, kDensity = 1000.0;

Material stiff(MaterialLaw law, double poisson_ratio) {
    return {.law = law, .young_modulus = kYoung, .poisson_ratio = poisson_ratio, .density = kDensity};
}

double stable_step(const TissueModel& model, Integrator integrator) {
    StableStepWorkspace workspace;
    return find_stable_step(model, model.rest_position, nullptr, workspace, integrator).step;
}

/// Energy after `steps` of leapfrog from a small random push, over the energy at the start.
double leapfrog_growth(const TissueModel& model, double step, int steps) {
    std::mt19937_64 random(4);
    TissueState state = make_rest_state(model);
    for (Vec3& v : state.velocity) v = random_vec(random, 1e-7);
    RkWorkspace workspace;
    double first = 0.0;
    for (std::size_t node = 0; node < state.velocity.size(); ++node)
        first += 0.5 * model.node_mass[node] * state.velocity[node].squaredNorm();
    const IntegrateReport report = integrate_leapfrog(model, state, steps * step, static_cast<unsigned>(steps), {}, workspace);
    return report.finite() ? (report.kinetic_j + report.elastic_j) / first : 1e300;
}

} // namespace

TEST(Validation, PatchIsUniformToRounding) {
    for (const MaterialLaw law : kLaws) EXPECT_LT(patch_error(law), 1e-12) << static_cast<int>(law);
}

TEST(Validation, FirstAxialModeIsWithinAThousandth) {
    for (const MaterialLaw law : kLaws) EXPECT_NEAR(axial_mode_ratio(law, 40), 1.0, 1e-3) << static_cast<int>(law);
}

TEST(Validation, WavesTravelAtTheSpeedsOfTheContinuum) {
    for (const double nu : {0.0, 0.3, 0.45})
        for (const Wave wave : {Wave::Pressure, Wave::Shear}) EXPECT_NEAR(wave_speed_ratio(wave, nu), 1.0, 0.03) << nu;
}

TEST(Validation, CantileverConvergesToTimoshenkoWithAnOrderThatRises) {
    double error[3];
    for (const Index level : {0u, 1u, 2u}) {
        error[level] = 1.0 - cantilever_ratio(2u << level, 0.3);
        std::printf("cantilever, nu 0.3, %2u cells across: tip over Timoshenko %.4f\n", 2u << level, 1.0 - error[level]);
    }
    // Two in the limit; these meshes still lock in shear: 1.16, then 1.45.
    EXPECT_GT(std::log2(error[0] / error[1]), 1.0);
    EXPECT_GT(std::log2(error[1] / error[2]), 1.3);
    EXPECT_LT(error[2], 0.1);
}

TEST(Validation, LinearTetsLockAsIsKnown) {
    // 0.88, 0.71 and 0.29 were measured elsewhere on 41K tets; 12K lock more.
    const double usual[4][2] = {{0.3, 0.85}, {0.45, 0.70}, {0.49, 0.45}, {0.499, 0.10}};
    double before = 1.0;
    for (const auto& [nu, least] : usual) {
        const double ratio = cantilever_ratio(8, nu);
        std::printf("locking, 12288 tets, nu %.3f: tip over Timoshenko %.3f\n", nu, ratio);
        EXPECT_LT(ratio, before) << nu;
        EXPECT_GT(ratio, least) << nu;
        before = ratio;
    }
}

TEST(Validation, HydrostaticCompressionNeedsTheBulkModulus) {
    for (const MaterialLaw law : kLaws) EXPECT_NEAR(bulk_ratio(law), 1.0, 1e-4) << static_cast<int>(law);
}

TEST(Validation, FreeFlightKeepsLinearMomentumToRoundingAndAngularWithOrderFour) {
    for (const MaterialLaw law : kLaws) {
        const FreeFlight coarse = free_flight_error(law, 0.5), fine = free_flight_error(law, 0.25);
        EXPECT_LT(fine.linear, 1e-12) << static_cast<int>(law);
        EXPECT_GT(std::log2(coarse.angular / fine.angular), 3.9) << static_cast<int>(law); // four in the limit
    }
}

TEST(Validation, IntegratorsAreOfTheirOrderInTheStep) {
    for (const auto& [integrator, order] : {std::pair{Integrator::Rk4, 4.0}, std::pair{Integrator::Leapfrog, 2.0}}) {
        const std::vector<StepError> errors = step_errors(integrator, 2);
        for (std::size_t level = 1; level < errors.size(); ++level)
            EXPECT_NEAR(std::log2(errors[level - 1].error / errors[level].error), order, 0.2) << level;
    }
}

TEST(Validation, FreeBarKeepsItsEnergyWithinAThousandth) {
    for (const auto& [integrator, share] : {std::pair{Integrator::Rk4, 0.125}, std::pair{Integrator::Leapfrog, 0.25}}) {
        const std::vector<double> energy = energy_over_time(integrator, share, 10.0);
        EXPECT_EQ(energy.size(), 101u);
        EXPECT_GT(*std::min_element(energy.begin(), energy.end()), 1.0 - 1e-3) << static_cast<int>(integrator);
        EXPECT_LT(*std::max_element(energy.begin(), energy.end()), 1.0 + 1e-3) << static_cast<int>(integrator);
    }
}

TEST(Validation, BothSidesOfTheEdgeForEveryLawAndIntegrator) {
    for (const MaterialLaw law : kLaws)
        for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog}) {
            EXPECT_LT(growth_at_edge(law, integrator, 0.97, 3000), 20.0) << static_cast<int>(law);
            EXPECT_GT(growth_at_edge(law, integrator, 1.03, 3000), 1000.0) << static_cast<int>(law);
        }
}

TEST(Statics, EquilibriumLeavesNoForceAndIsTheSmallStrainOneUnderALittleLoad) {
    const TetMesh mesh = make_bar_mesh({8, 2, 2}, 0.01, 0.1);
    for (const MaterialLaw law : kLaws) {
        const auto model = make_model(mesh, stiff(law, 0.3), nodes_at(mesh, 0, 0.0));
        auto force = zeros(model.node_count());
        for (const Index node : nodes_at(mesh, 0, 0.08)) force[node] = Vec3(0, 0, 1e-7);
        const auto u = solve_small_strain(model, force);
        const Equilibrium little = find_equilibrium(model, force, 1);
        EXPECT_LT(little.residual, 1e-6); // 0.1 uN beside element forces of 1 N: what rounding leaves
        for (std::size_t node = 0; node < u.size(); ++node)
            EXPECT_LT((little.position[node] - model.rest_position[node] - u[node]).norm(), 1e-9) << node;
        for (Vec3& f : force) f *= 1e5; // the tip goes a third of the length
        const Equilibrium large = find_equilibrium(model, force, 4);
        EXPECT_LT(large.residual, 1e-8) << static_cast<int>(law);
        EXPECT_GT(large.position.back()[2], 0.02) << static_cast<int>(law);
    }
}

TEST(Leapfrog, ViscousBodiesAreBoundedAtTheirStep) {
    for (const double viscosity : {0.1, 1.0, 10.0}) {
        Material material = stiff(MaterialLaw::NeoHookean, 0.3);
        material.viscosity = viscosity;
        const auto model = make_model(make_bar(2, 2, 1, 0.01), material);
        const double step = stable_step(model, Integrator::Leapfrog);
        EXPECT_LT(leapfrog_growth(model, step / kStepSafety * 0.97, 2000), 1.0) << viscosity;
        EXPECT_GT(leapfrog_growth(model, step * 2.5, 2000), 10.0) << viscosity << ": the limit is not idle";
    }
}

TEST(Leapfrog, KeepsTheEnergyOfAFreeBarWithinAThousandthForTenSeconds) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.3));
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < model.node_count(); ++node)
        state.velocity[node] = Vec3(0, 0, 2.0 * model.rest_position[node][0]).cross(Vec3::UnitX());
    RkWorkspace workspace;
    const auto substeps = static_cast<unsigned>(0.01 / (0.25 * stable_step(model, Integrator::Leapfrog))) + 1;
    double first = 0.0, least = 1e300, most = 0.0;
    for (int frame = 0; frame < 1000; ++frame) {
        const IntegrateReport report = integrate_leapfrog(model, state, 0.01, substeps, {}, workspace);
        const double energy = report.kinetic_j + report.elastic_j;
        if (frame == 0) first = energy;
        least = std::min(least, energy);
        most = std::max(most, energy);
    }
    EXPECT_LT((most - least) / first, 1e-3);
}

TEST(Leapfrog, IsOfOrderTwoInTheStep) {
    const auto model = make_model(make_bar(4, 1, 1, 0.01), make_material(MaterialLaw::NeoHookean, 0.3), {0, 5});
    const auto run = [&](unsigned substeps, bool rk4) {
        TissueState state = make_rest_state(model);
        RkWorkspace workspace;
        const IntegrateInputs inputs{.gravity = Vec3(0, 0, -9.81)};
        if (rk4)
            (void)integrate_rk4(model, state, 0.05, substeps, inputs, workspace);
        else
            (void)integrate_leapfrog(model, state, 0.05, substeps, inputs, workspace);
        return state.position;
    };
    const unsigned coarse = 4 * static_cast<unsigned>(0.05 / stable_step(model, Integrator::Leapfrog)) + 2;
    const auto exact = run(32 * coarse, true);
    double error[2] = {0.0, 0.0};
    for (unsigned level = 0; level < 2; ++level) {
        const auto position = run(coarse << level, false);
        for (std::size_t node = 0; node < position.size(); ++node)
            error[level] = std::max(error[level], (position[node] - exact[node]).norm());
    }
    EXPECT_NEAR(std::log2(error[0] / error[1]), 2.0, 0.15) << error[0] << " " << error[1];
}

TEST(Viscosity, CappedCostsATenthOfTheStepAndNoMore) {
    for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog}) {
        Material material = stiff(MaterialLaw::NeoHookean, 0.45);
        const TetMesh mesh = make_bar_mesh({8, 4, 4}, 0.01, 0.15);
        const double free = stable_step(make_model(mesh, material), integrator);
        material.viscosity = 50.0;
        StableStepWorkspace workspace;
        auto model = make_model(mesh, material);
        const StableStep asked = find_stable_step(model, model.rest_position, nullptr, workspace, integrator);
        EXPECT_LT(asked.step, 0.5 * free);
        material.viscosity = cap_viscosity(model, asked, integrator);
        EXPECT_LT(material.viscosity, 50.0);
        const double undamped = integrator == Integrator::Leapfrog ? 1.0 - kUndampedShare : 1.0; // which is shorter
        EXPECT_NEAR(stable_step(make_model(mesh, material), integrator) / free, (1.0 - kViscousStepShare) / undamped, 0.02);
        material.viscosity *= 0.5;
        model = make_model(mesh, material);
        workspace.warm = false;
        EXPECT_EQ(cap_viscosity(model, find_stable_step(model, model.rest_position, nullptr, workspace, integrator), integrator),
                  material.viscosity);
    }
}

} // namespace trocar::fem
