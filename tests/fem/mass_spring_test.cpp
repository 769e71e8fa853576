// The mass-spring chain of Govindaraju et al. 2005: it hangs like the rod, is stable at its derived sub-step, and its cost is printed.
#include "fem/rod/mass_spring.hpp"
#include "rod_rest.hpp"

#include <gtest/gtest.h>

#include <ctime>
#include <random>

namespace trocar::fem {
namespace {

RodDesign soft_catheter() {
    RodDesign design = test::bare_design(0.1, 2.5e-3);
    design.young_modulus = 20e6;
    design.drag = 40.0;
    design.tip = TipShape::J;
    return design;
}

RodState hang(const RodModel& model, bool mass_spring, double& seconds_a_step) {
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.05;
    drive.gravity = Vec3(0, 0, -9.81);
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    RodWorkspace workspace;
    const unsigned substeps = count_mass_spring_substeps(model, 0.0, 0.01).value();
    constexpr int kSteps = 300;
    const std::clock_t start = std::clock();
    for (int k = 0; k < kSteps; ++k)
        mass_spring ? solve_mass_spring(model, state, 0.01, substeps, drive, {}, workspace)
                    : solve_rod(model, state, 0.01, 2, drive, {}, workspace);
    seconds_a_step = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / kSteps;
    return state;
}

TEST(MassSpring, HangsLikeTheRodAndCostsSoMuchMore) {
    RodDesign design = soft_catheter();
    design.tip = TipShape::Straight;
    design.tip_stiffness = 1.0;
    const RodModel model = make_rod_model(design).value();
    double rod_cost = 0.0, chain_cost = 0.0;
    const RodState rod = hang(model, false, rod_cost), chain = hang(model, true, chain_cost);
    double apart = 0.0;
    for (std::size_t i = 0; i < rod.position.size(); ++i) apart = std::max(apart, (rod.position[i] - chain.position[i]).norm());
    const double sag = -rod.position.back().z();
    std::printf(
        "margin: the chain hangs within %.3g m of the rod, which sags by %.3g m; it costs %.3g ms a step of 10 ms, the rod %.3g ms: "
        "%.0f times\n",
        apart, sag, 1e3 * chain_cost, 1e3 * rod_cost, chain_cost / rod_cost);
    EXPECT_GT(sag, 3e-4);
    const double expected = std::pow(1.0 + 0.5 * model.segment / 0.05, 4); // the chain's clamp is half a segment behind the port
    EXPECT_NEAR(-chain.position.back().z() / sag, expected, 0.03 * expected);
}

/// Largest speed after a tenth of a second that began with random speeds of a millimetre a second.
double shake(double faster) {
    RodDesign design = soft_catheter();
    design.drag = 0.0;
    design.tip = TipShape::Straight;
    const RodModel model = make_rod_model(design).value();
    RodDrive drive;
    drive.port = {Vec3::Zero(), Vec3::UnitX()};
    drive.insertion = 0.09;
    RodState state;
    place_rod(model, drive.port, drive.insertion, 0.0, state);
    std::mt19937 random(7);
    for (Vec3& v : state.velocity)
        for (int axis = 0; axis < 3; ++axis) v[axis] = 1e-3 * (static_cast<double>(random() % 2001) / 1000.0 - 1.0);
    RodWorkspace workspace;
    const auto substeps = static_cast<unsigned>(0.1 / (faster * mass_spring_substep(model, 0.0)));
    solve_mass_spring(model, state, 0.1, substeps, drive, {}, workspace);
    double fastest = 0.0;
    for (const Vec3& v : state.velocity) fastest = std::max(fastest, std::isfinite(v.norm()) ? v.norm() : 1e300);
    return fastest;
}

TEST(MassSpring, IsStableAtItsDerivedSubstepAndNotFarBeyond) {
    const double derived = shake(1.0), beyond = shake(1.3);
    std::printf("margin: speeds of 1 mm/s are %.3g mm/s after 0.1 s at the derived sub-step, %.3g mm/s at 1.3 of it\n", 1e3 * derived,
                1e3 * beyond);
    EXPECT_LT(derived, 1e-2);
    EXPECT_GT(beyond, 1.0);
}

TEST(MassSpring, TellsWhenItsStiffnessAsksForTooManySubsteps) {
    RodDesign design = soft_catheter();
    design.young_modulus = 200e9;
    design.segment = 0.25e-3;
    design.density = 7900.0;
    const RodModel model = make_rod_model(design).value();
    const auto count = count_mass_spring_substeps(model, 2e4, 0.1);
    ASSERT_FALSE(count.ok());
    for (const char* piece : {"sub-steps", "at most 20000", "kind rod"})
        EXPECT_NE(count.error().message.find(piece), std::string::npos) << count.error().message;
    EXPECT_TRUE(count_mass_spring_substeps(model, 2e4, 2e-4).ok());
}

} // namespace
} // namespace trocar::fem
