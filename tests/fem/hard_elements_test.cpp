// Tissue where it is hard: sizes a thousand times apart, frames of any length, stiffness and push at the edge of the step.
#include "fem/integrate.hpp"
#include "tests/fem/bodies.hpp"

#include <gtest/gtest.h>

namespace seldinger::fem {

using namespace test;

namespace {

double energy_of(const IntegrateReport& report) { return report.kinetic_j + report.elastic_j; }

/// A bar whose cells along x grow from 1 to `contrast` times the first.
TetMesh make_graded_bar(double contrast) {
    TetMesh mesh = make_bar(8, 2, 2, 0.01);
    const double growth = std::pow(contrast, 1.0 / 7.0);
    double at[9] = {0.0}, cell = 0.01 / contrast;
    for (int i = 0; i < 8; ++i, cell *= growth) at[i + 1] = at[i] + cell;
    for (Vec3& x : mesh.vertices) x[0] = at[static_cast<int>(std::lround(x[0] / 0.01))];
    return mesh;
}

} // namespace

TEST(HardElements, SizesAThousandTimesApartAreStableAndTheThinOneIsNamed) {
    const TetMesh mesh = make_graded_bar(1000.0);
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean, 0.45), nodes_at(mesh, 0, 0.0));
    StableStepWorkspace stable;
    const StableStep step = find_stable_step(model, model.rest_position, nullptr, stable);
    const double uniform_step = 2e-3; // of 10 mm cells, about
    EXPECT_LT(step.step, 0.01 * uniform_step);
    for (const Index node : model.tet_nodes[step.worst_tet]) EXPECT_LT(model.rest_position[node][0], 3e-4) << "the thin end";
    TissueState state = make_rest_state(model);
    RkWorkspace workspace;
    const auto done = advance(model, state, 0.005, {.gravity = Vec3(0, 0, -9.81)}, {.max_substeps = 20000}, workspace, stable);
    EXPECT_TRUE(done.integrate.finite() && !done.refused);
    EXPECT_EQ(done.integrate.inverted, 0u);
}

TEST(HardElements, FramesThatAlternateBetweenShortAndLongPumpNoEnergyIntoRk4) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.45));
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < model.node_count(); ++node)
        state.velocity[node] = Vec3(0, 0, 2.0 * model.rest_position[node][0] * model.rest_position[node][0] / 0.06);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    double first = 0.0, most = 0.0;
    for (int frame = 0; frame < 1000; ++frame) {
        const auto done = advance(model, state, frame % 2 == 0 ? 1e-4 : 1e-2, {}, {}, workspace, stable);
        ASSERT_TRUE(done.integrate.finite() && !done.refused) << frame;
        if (frame == 0) first = energy_of(done.integrate);
        most = std::max(most, energy_of(done.integrate));
    }
    EXPECT_LT(most, first * 1.01);
}

TEST(HardElements, LeapfrogHoldsItsEnergyOverEqualFramesWithDerivedSteps) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.45));
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < model.node_count(); ++node)
        state.velocity[node] = Vec3(0, 0, 2.0 * model.rest_position[node][0] * model.rest_position[node][0] / 0.06);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    double first = 0.0, most = 0.0;
    for (int frame = 0; frame < 1000; ++frame) {
        const auto done = advance(model, state, 1e-2, {}, {.integrator = Integrator::Leapfrog}, workspace, stable);
        ASSERT_TRUE(done.integrate.finite() && !done.refused) << frame;
        if (frame == 0) first = energy_of(done.integrate);
        most = std::max(most, energy_of(done.integrate));
    }
    EXPECT_LT(most, first * 1.2);
}

TEST(HardElements, LeapfrogRecoversNeoHookeanFromAPlaneAndFromRandomPlaces) {
    const TetMesh mesh = make_bar(3, 3, 3, 0.01);
    Material material = make_material(MaterialLaw::NeoHookean, 0.4);
    material.mass_damping = 20.0;
    material.viscosity = 0.3;
    const auto model = make_model(mesh, material, nodes_at(mesh, 2, 0.0));
    std::mt19937_64 random(3);
    for (const bool flat : {true, false}) {
        TissueState state = make_rest_state(model);
        for (std::size_t node = 0; node < model.node_count(); ++node) {
            if (model.inv_mass[node] == 0.0) continue;
            if (flat) state.position[node][2] = 0.0;
            else state.position[node] = 0.03 * random_vec(random, 1.0);
        }
        RkWorkspace workspace;
        StableStepWorkspace stable;
        SubstepLimits limits;
        limits.integrator = Integrator::Leapfrog;
        limits.max_substeps = 100000;
        IntegrateReport last;
        for (int frame = 0; frame < 300; ++frame) {
            const auto done = advance(model, state, 0.01, {}, limits, workspace, stable);
            ASSERT_TRUE(done.integrate.finite() && !done.refused) << frame;
            last = done.integrate;
        }
        EXPECT_EQ(last.inverted, 0u);
        for (std::size_t node = 0; node < model.node_count(); ++node)
            EXPECT_LT((state.position[node] - model.rest_position[node]).norm(), 1e-3) << (flat ? "flat " : "random ") << node;
    }
}

TEST(HardElements, ASceneThatForbidsSubstepsIsToldTheStepThatWorks) {
    const auto model = make_model(make_bar(6, 2, 2, 0.01), make_material(MaterialLaw::NeoHookean, 0.45));
    TissueState state = make_rest_state(model);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    const auto refused = advance(model, state, 0.05, {}, {.max_substeps = 1}, workspace, stable);
    ASSERT_TRUE(refused.refused);
    EXPECT_GT(refused.tightest.step, 0.0);
    EXPECT_LT(refused.tightest.step, 0.05);
    const auto fine = advance(model, state, 0.99 * refused.tightest.step, {}, {.max_substeps = 1}, workspace, stable);
    EXPECT_FALSE(fine.refused);
    EXPECT_EQ(fine.integrate.substeps_done, 1u);
}

} // namespace seldinger::fem
