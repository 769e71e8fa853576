// A wire in a catheter: both stiffnesses where they overlap, the wire alone beyond the tip, each with its own drive.
#include "fem/rod/coaxial.hpp"
#include "rod_rest.hpp"

#include <gtest/gtest.h>

namespace trocar::fem {
namespace {

using test::bare_design;
using test::bending_stiffness;

struct Pair {
    RodModel outer, inner;
    RodState outer_state, inner_state;
    RodDrive outer_drive, inner_drive;
    RodWorkspace outer_work, inner_work;
    CoaxialWorkspace work;

    Pair(const RodDesign& outer_design, const RodDesign& inner_design, double outer_in, double inner_in)
        : outer(make_rod_model(outer_design).value()), inner(make_rod_model(inner_design).value()) {
        outer_drive.port = inner_drive.port = {Vec3::Zero(), Vec3::UnitX()};
        outer_drive.insertion = outer_in;
        inner_drive.insertion = inner_in;
        place_rod(outer, outer_drive.port, outer_in, 0.0, outer_state);
        place_rod(inner, inner_drive.port, inner_in, 0.0, inner_state);
    }
    RodReport step(double dt, unsigned substeps = 1) {
        return solve_coaxial({outer, outer_state, outer_drive, {}, outer_work}, {inner, inner_state, inner_drive, {}, inner_work}, dt,
                             substeps, work);
    }
    void rest(int steps = 400, double dt = 0.05) {
        for (int k = 0; k < steps; ++k) step(dt);
    }
};

double tip_angle(const RodState& state) {
    const std::size_t last = state.position.size() - 1;
    const Vec3 tangent = (state.position[last] - state.position[last - 1]).normalized();
    return std::acos(std::clamp(tangent.x(), -1.0, 1.0));
}

RodDesign j_catheter() {
    RodDesign design = bare_design(0.12, 2e-3);
    design.young_modulus = 60e6;
    design.tip = TipShape::J;
    return design;
}

RodDesign straight_wire(double modulus) {
    RodDesign design = bare_design(0.15, 1.7e-3);
    design.radius = 0.2e-3;
    design.young_modulus = modulus;
    return design;
}

TEST(Coaxial, AStraightWireStraightensAJTipInTheRatioOfTheStiffnesses) {
    for (const double modulus : {0.5e9, 2e9, 20e9}) {
        Pair pair(j_catheter(), straight_wire(modulus), 0.06, 0.08);
        pair.rest();
        const double catheter = bending_stiffness(j_catheter()), wire = bending_stiffness(straight_wire(modulus));
        const double expected = 0.8 * catheter / (catheter + wire);
        // The tip's own nodes turn by its rest angle but for the last one, as without a wire.
        Pair empty(j_catheter(), straight_wire(modulus), 0.06, 0.0);
        empty.rest();
        const double ratio = tip_angle(pair.outer_state) / tip_angle(empty.outer_state);
        std::printf("margin: wire of %.2f times the catheter's stiffness: the tip keeps %.4f of its angle, analytic %.4f\n",
                    wire / catheter, ratio, expected / 0.8);
        EXPECT_NEAR(ratio, expected / 0.8, 0.02 * expected / 0.8 + 1e-3);
        EXPECT_NEAR(tip_angle(empty.outer_state), 0.8, 0.08);
    }
}

TEST(Coaxial, EachRodCarriesWhatPullsOnItAndBothTogetherWhatTheJointOneCarries) {
    for (const double in : {0.0649, 0.0661, 0.08, 0.0605, 0.05}) // a wire that ends beyond the catheter's tip by a few segments, by many, by none, and in the bore
        for (const Vec3& pull : {Vec3(0.05, 0, 0), Vec3(-0.02, 0, 0)}) {
            RodDesign straight = j_catheter();
            straight.tip = TipShape::Straight;
            Pair pair(straight, straight_wire(20e9), 0.06, in);
            const Vec3 own(0.03, 0, 0);
            pair.outer_drive.tip.force = own;
            pair.inner_drive.tip.force = pull;
            pair.rest();
            RodInternalForces outer = find_internal_forces(pair.outer, pair.outer_state, pair.outer_drive.port);
            RodInternalForces inner = find_internal_forces(pair.inner, pair.inner_state, pair.inner_drive.port);
            const std::size_t middle = pair.outer.node_count() - 12; // before the wire's tip
            const double joint = outer.tension[middle];
            EXPECT_NEAR(joint, own.x() + pull.x(), 1e-6);
            part_tension(pair.outer, pair.outer_state, pair.inner, pair.inner_state, outer, inner);
            const bool beyond = in > 0.064;
            EXPECT_NEAR(outer.tension[middle], beyond ? own.x() : joint, 2e-3 * own.x()) << in;
            const Index free = first_free_node(pair.inner, in, 0.06);
            for (std::size_t i = first_inserted_node(pair.inner, in); i < std::min<std::size_t>(free, pair.inner.node_count() - 1); ++i)
                EXPECT_NEAR(inner.tension[i], beyond ? pull.x() : 0.0, 2e-3 * own.x()) << in << ' ' << i;
        }
}

TEST(Coaxial, WithdrawnBehindTheTipTheWireLetsItBendAgain) {
    Pair pair(j_catheter(), straight_wire(20e9), 0.06, 0.08);
    pair.rest();
    const double straightened = tip_angle(pair.outer_state);
    for (int k = 0; k < 200; ++k) {
        pair.inner_drive.insertion = std::max(0.035, 0.08 - 0.35e-3 * k);
        const RodReport report = pair.step(0.01, 2);
        ASSERT_EQ(report.first_bad_node, kNoIndex);
    }
    pair.rest();
    Pair empty(j_catheter(), straight_wire(20e9), 0.06, 0.0);
    empty.rest();
    EXPECT_LT(straightened, 0.1);
    EXPECT_NEAR(tip_angle(pair.outer_state), tip_angle(empty.outer_state), 1e-3);
    for (const Vec3& p : pair.inner_state.position) EXPECT_LT(std::abs(p.y()) + std::abs(p.z()), 1e-3) << "inside the straight shaft";
}

TEST(Coaxial, ACatheterWithAWireBeyondItSagsAsASteppedCantilever) {
    RodDesign catheter = j_catheter();
    catheter.tip = TipShape::Straight;
    const RodDesign wire = straight_wire(2e9);
    Pair pair(catheter, wire, 0.04 - 1e-12, 0.07);
    const double gravity = 0.5;
    pair.outer_drive.gravity = pair.inner_drive.gravity = Vec3(0, 0, -gravity);
    pair.rest(1500);
    // Euler-Bernoulli by summing up: moment of the weight beyond, over the stiffness there.
    const auto area = [](const RodDesign& d) { return std::numbers::pi * d.radius * d.radius; };
    const double both = bending_stiffness(catheter) + bending_stiffness(wire), alone = bending_stiffness(wire);
    const double clamp = 0.0, end = 0.07, seam = 0.04;
    const auto load = [&](double s) {
        return gravity * (wire.density * area(wire) + (s < seam ? catheter.density * area(catheter) : 0.0));
    };
    constexpr int kParts = 2000;
    const double ds = (end - clamp) / kParts;
    double slope = 0.0, sag_seam = 0.0, sag = 0.0;
    for (int i = 0; i < kParts; ++i) {
        const double s = clamp + (i + 0.5) * ds;
        double moment = 0.0;
        for (int j = i; j < kParts; j += 10) { // the load's own sum may be coarser
            const double u = clamp + (j + 5.0) * ds;
            moment += load(u) * (u - s) * std::min(10.0 * ds, end - clamp - j * ds);
        }
        slope += moment / (s < seam ? both : alone) * ds;
        sag += slope * ds;
        if (s < seam) sag_seam = sag;
    }
    std::printf("margin: sag of the seam %.5f of the analytic, of the wire's tip %.5f\n", -pair.outer_state.position.back().z() / sag_seam,
                -pair.inner_state.position.back().z() / sag);
    EXPECT_NEAR(-pair.outer_state.position.back().z() / sag_seam, 1.0, 0.02);
    EXPECT_NEAR(-pair.inner_state.position.back().z() / sag, 1.0, 0.02);
}

TEST(Coaxial, AWireThatIsPushedOutAndDrawnBackMovesWithoutAJoltAndStaysOnTheCathetersAxis) {
    RodDesign catheter = j_catheter(), wire = straight_wire(2e9);
    catheter.drag = wire.drag = 40.0;
    catheter.transverse_drag = wire.transverse_drag = 10.0;
    Pair pair(catheter, wire, 0.06, 0.03);
    pair.rest(300, 0.01);
    double fastest = 0.0;
    for (int k = 1; k <= 400; ++k) {
        const Vec3 wire_tip = pair.inner_state.position.back(), tip = pair.outer_state.position.back();
        pair.inner_drive.insertion = 0.03 + 0.35e-3 * (k <= 200 ? k : 400 - k);
        pair.inner_drive.rotation = 0.0314 * k;
        const RodReport report = pair.step(0.01, 2);
        ASSERT_EQ(report.first_bad_node, kNoIndex) << k;
        fastest =
            std::max({fastest, (pair.inner_state.position.back() - wire_tip).norm(), (pair.outer_state.position.back() - tip).norm()});
        const Index free = first_free_node(pair.inner, pair.inner_state.insertion, pair.outer_state.insertion);
        for (std::size_t j = 0; j < free; ++j) {
            double nearest = 1.0;
            for (std::size_t i = 0; i + 1 < pair.outer.node_count(); ++i) {
                const Vec3 a = pair.outer_state.position[i], edge = pair.outer_state.position[i + 1] - a;
                const double t = std::clamp((pair.inner_state.position[j] - a).dot(edge) / edge.squaredNorm(), 0.0, 1.0);
                nearest = std::min(nearest, (a + t * edge - pair.inner_state.position[j]).norm());
            }
            // A node may lead the tip by a quarter of a segment, and a longer wire begins further behind the port.
            if (pair.inner_state.position[j].x() <= 0.0) continue;
            ASSERT_LT(nearest, 0.26 * pair.inner.segment) << k << " node " << j;
        }
    }
    std::printf("margin: tips move by %.2f of the drive's 0.35 mm in a step at most\n", fastest / 0.35e-3);
    EXPECT_LT(fastest, 3.0 * 0.35e-3);
}

TEST(Coaxial, AWireOfNoStiffnessLeavesTheCatheterAsItIs) {
    RodDesign wire = straight_wire(1e3);
    wire.density = 1e-3;
    Pair pair(j_catheter(), wire, 0.06, 0.055);
    pair.outer_drive.gravity = Vec3(0, 0, -1.0);
    RodState alone;
    RodWorkspace workspace;
    place_rod(pair.outer, pair.outer_drive.port, 0.06, 0.0, alone);
    for (int k = 0; k < 600; ++k) { // until both rest: their methods differ on the way
        pair.step(0.01, 2);
        solve_rod(pair.outer, alone, 0.01, 2, pair.outer_drive, {}, workspace);
    }
    for (std::size_t i = 0; i < alone.position.size(); ++i) EXPECT_LT((alone.position[i] - pair.outer_state.position[i]).norm(), 2e-6) << i;
}

} // namespace
} // namespace trocar::fem
