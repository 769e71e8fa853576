// The rod pushed through narrow winding tubes, whose walls are planes round every place: the iteration ends in a balance of forces.
#include "fem/rod/rod.hpp"
#include "rod_rest.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace trocar::fem {
namespace {

/// A tube along z that winds in x and y and has a narrowing. m
struct WindingTube {
    double radius = 1.5e-3, wave = 30e-3, swing = 4e-3, phase = 0.0, narrow_at = 50e-3, narrow_share = 0.5;

    [[nodiscard]] Vec3 centre(double z) const {
        const double grown = std::min(1.0, z / 20e-3); // straight where the rod enters
        const double angle = z / wave + phase;
        return {grown * swing * (std::sin(angle) - std::sin(phase)), grown * swing * (std::cos(angle) - std::cos(phase)), z};
    }
    [[nodiscard]] double radius_at(double z) const {
        const double off = (z - narrow_at) / 6e-3;
        return radius * (1.0 - narrow_share * std::exp(-off * off));
    }
};

void add_planes(const RodModel& model, const RodState& state, const WindingTube& tube, std::vector<RodPlane>& planes) {
    planes.clear();
    for (Index node = first_inserted_node(model, state.insertion); node + 1 < model.node_count(); ++node)
        for (const double weight : {0.5, 1.0}) {
            const Vec3 p = (1.0 - weight) * state.position[node] + weight * state.position[node + 1];
            const Vec3 centre = tube.centre(p.z());
            const Vec3 along = (tube.centre(p.z() + 1e-4) - tube.centre(p.z() - 1e-4)).normalized();
            const Vec3 side = perpendicular_axis(along);
            for (int k = 0; k < 6; ++k) {
                const double angle = 1.0471975511965976 * k;
                const Vec3 normal = std::cos(angle) * side + std::sin(angle) * along.cross(side);
                planes.push_back({node, weight, normal, normal.dot(centre) - (tube.radius_at(p.z()) - model.design.radius), 0.0});
            }
        }
}

/// A rod that flies freely at a floor farther off than the planes that an iteration begins with: it comes to it, and no farther.
TEST(RodContact, PlanesThatAreReachedOnlyWithinAnIterationHold) {
    std::mt19937_64 random(7);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    for (int k = 0; k < 50; ++k) {
        const double gap = between(1.5e-4, 2e-3), step = between(1e-3, 1e-2), speed = between(1.5, 5.0) * gap / step;
        const RodModel model = make_rod_model(test::bare_design(0.06, 2e-3)).value();
        RodDrive drive;
        drive.port = {Vec3::Zero(), Vec3::UnitX()};
        drive.insertion = model.design.length + 0.01; // all of it is beyond the port
        RodState state;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        state.velocity.assign(model.node_count(), Vec3(0, 0, -speed));
        std::vector<RodPlane> planes;
        for (Index node = 0; node + 1 < model.node_count(); ++node) planes.push_back({.node = node, .weight = node == 0 ? 0.0 : 1.0, .offset = -gap});
        for (RodPlane& plane : planes) plane.normal = Vec3::UnitZ();
        RodWorkspace workspace;
        (void)solve_rod(model, state, step, 2, drive, planes, workspace);
        for (std::size_t node = 2; node < model.node_count(); ++node) {
            EXPECT_GT(state.position[node].z(), -gap - 2e-5) << k << " " << node << ": freely it goes " << speed * step;
            EXPECT_LT(state.position[node].z(), -0.5 * gap) << k;
        }
    }
}

/// Planes that are not evaluated, for nothing is met there, would have added nothing: with `felt` a plane is always evaluated, and where its wall
/// stands it says nothing else.
TEST(RodContact, EvaluatingEveryPlaneGivesTheSameBits) {
    std::mt19937_64 random(36);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    std::size_t pressed = 0, met = 0, let_go = 0;
    for (int k = 0; k < 60; ++k) {
        RodDesign design = test::bare_design(0.08, 2e-3);
        design.radius = between(0.25e-3, 1e-3);
        design.young_modulus = std::pow(10.0, between(6.5, 9.3)); // Pa
        design.torsion = k % 2 == 0;
        const RodModel model = make_rod_model(design).value();
        RodDrive drive;
        drive.port = {Vec3::Zero(), Vec3::UnitZ()};
        drive.insertion = 0.05;
        drive.friction = k % 3 == 0 ? 0.0 : between(0.0, 0.5);
        drive.gravity = Vec3(between(-20, 20), between(-20, 20), 0.0);
        RodState state, other;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        other = state;
        std::vector<RodPlane> planes, all;
        RodWorkspace workspace, other_workspace;
        for (int step = 0; step < 12; ++step) {
            if (step % 4 == 0) { // the wall's planes are made anew; some go on with the forces of those before
                const std::vector<RodPlane> last = planes;
                planes.clear();
                for (Index node = first_inserted_node(model, state.insertion); node + 1 < model.node_count(); ++node)
                    for (int side = static_cast<int>(between(0.0, 6.0)); side > 0; --side) {
                        const double turn = between(0.0, 6.28), weight = side % 2 == 0 ? 0.5 : 1.0;
                        RodPlane plane{.node = node, .weight = weight, .normal = Vec3(std::cos(turn), std::sin(turn), 0.0)};
                        plane.offset = plane.normal.dot((1.0 - weight) * state.position[node] + weight * state.position[node + 1]) - between(-2e-5, 8e-4);
                        if (!last.empty()) plane.force = plane.start_force = last[random() % last.size()].force;
                        planes.push_back(plane);
                    }
                all = planes;
                for (RodPlane& plane : all) plane.felt = Vec3(1e-30, 0.0, 0.0);
            }
            drive.insertion += between(-2e-4, 3e-4);
            drive.rotation += between(-0.2, 0.2);
            const std::vector<RodPlane> before = planes;
            const RodReport one = solve_rod(model, state, 0.01, 1, drive, planes, workspace);
            const RodReport two = solve_rod(model, other, 0.01, 1, drive, all, other_workspace);
            ASSERT_EQ(one.iterations, two.iterations) << k << " " << step;
            ASSERT_EQ(state.position, other.position) << k << " " << step;
            ASSERT_EQ(state.velocity, other.velocity);
            ASSERT_EQ(state.angle, other.angle);
            for (std::size_t p = 0; p < planes.size(); ++p) {
                ASSERT_EQ(planes[p].force, all[p].force);
                ASSERT_EQ(planes[p].drag, all[p].drag);
                pressed += planes[p].force > 0.0;
                met += planes[p].force > 0.0 && !(before[p].force > 0.0);
                let_go += before[p].force > 0.0 && !(planes[p].force > 0.0);
            }
        }
    }
    std::printf("%zu presses, %zu met, %zu let go\n", pressed, met, let_go);
    EXPECT_GT(met, 100u);
    EXPECT_GT(let_go, 100u);
}

/// A rod is pushed against facets of a wall that gives way as one, whatever they look along, however much it gives, and whatever it pushed with:
/// they push where they touch, pull nowhere, and the wall has gone by give (felt - sum of what they push with).
TEST(RodContact, FacetsOfAPlaceThatGivesPushWhereTheyTouchAndNowhereElse) {
    std::mt19937_64 random(28);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    std::size_t solves = 0, unsettled = 0, pressing = 0;
    double deepest = 0.0;
    for (int k = 0; k < 300; ++k) {
        RodDesign design = test::bare_design(0.06, 2e-3);
        design.radius = between(0.25e-3, 1e-3);
        design.young_modulus = std::pow(10.0, between(7.0, 9.3)); // Pa
        const RodModel model = make_rod_model(design).value();
        RodDrive drive;
        drive.port = {Vec3::Zero(), Vec3::UnitZ()};
        drive.insertion = 0.05;
        RodState state;
        place_rod(model, drive.port, drive.insertion, 0.0, state);
        const double give = std::pow(10.0, between(-6.0, -1.0)), force = std::pow(10.0, between(-3.0, 0.0)); // m/N, N
        const Vec3 felt(between(-force, force), between(-force, force), between(-force, 0.0));
        const auto tip = static_cast<Index>(model.node_count() - 2);
        std::vector<RodPlane> planes;
        for (auto left = static_cast<int>(between(1.0, 13.0)); left > 0; --left) {
            const double turn = between(0.0, 6.28), lean = between(0.0, 1.55);
            RodPlane plane{.node = tip, .weight = 1.0, .normal = Vec3(std::sin(lean) * std::cos(turn), std::sin(lean) * std::sin(turn), -std::cos(lean))};
            plane.offset = plane.normal.dot(state.position.back()) + between(-5e-4, 0.0);
            plane.give = give, plane.felt = felt;
            planes.push_back(plane);
        }
        RodWorkspace workspace;
        for (int step = 0; step < 10; ++step) {
            drive.insertion += between(0.0, 2e-4);
            const RodReport report = solve_rod(model, state, 0.01, 2, drive, planes, workspace);
            ASSERT_EQ(report.first_bad_node, kNoIndex);
            ++solves, unsettled += report.unconverged > 0;
            if (report.unconverged > 0) continue;
            Vec3 sum = Vec3::Zero();
            for (const RodPlane& plane : planes) sum += plane.force * plane.normal;
            for (const RodPlane& plane : planes) {
                const double gap = plane.normal.dot(state.position.back()) - plane.offset - plane.normal.dot(Vec3(give * (felt - sum))) + plane.force / drive.contact_stiffness;
                EXPECT_GE(plane.force, 0.0);
                deepest = std::max({deepest, -gap, plane.force > 0.0 ? gap : 0.0});
                pressing += plane.force > 0.0;
            }
        }
    }
    std::printf("margin: %zu of %zu solves unsettled, %zu facets pressed; off by %.3g m at most\n", unsettled, solves, pressing, deepest);
    EXPECT_LE(unsettled, solves / 50);
    EXPECT_LT(deepest, 1e-5) << "m; as near as a settled solve comes";
    EXPECT_GT(pressing, solves / 4);
}

TEST(RodContact, EndsInABalanceOfForcesInNarrowWindingTubes) {
    std::mt19937 random(19);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    std::size_t steps = 0, open = 0, iterations = 0, unconverged = 0;
    double worst = 0.0;
    for (int k = 0; k < 12; ++k) {
        RodDesign design;
        design.length = 0.15;
        design.radius = between(0.25e-3, 0.5e-3);
        design.segment = 2.5e-3;
        design.young_modulus = between(30e6, 400e6);
        const auto model = make_rod_model(design);
        ASSERT_TRUE(model);
        const WindingTube tube{between(1.2e-3, 2.5e-3), between(8e-3, 30e-3),  between(2e-3, 6e-3),
                               between(0.0, 6.0),       between(40e-3, 80e-3), between(0.0, 0.5)};
        RodState state;
        place_rod(*model, {}, 8e-3, 0.0, state);
        RodWorkspace work;
        std::vector<RodPlane> planes;
        RodDrive drive;
        drive.insertion = state.insertion;
        drive.friction = 0.05;
        for (int step = 0; step < 400; ++step) {
            drive.insertion += 0.25e-3;
            drive.rotation += between(-0.03, 0.03);
            add_planes(*model, state, tube, planes);
            const RodReport report = solve_rod(*model, state, 0.01, 2, drive, planes, work);
            ASSERT_EQ(report.first_bad_node, kNoIndex);
            ++steps;
            open += report.largest_residual > 1e-5;
            worst = std::max(worst, report.largest_residual);
            iterations += report.iterations;
            unconverged += report.unconverged;
            if (report.unconverged) std::printf("%d %d: %g m %g N\n", k, step, report.largest_residual, report.force_error);
        }
    }
    std::printf("margin: %.2f iterations a step of two sub-steps; %zu sub-steps of %zu did not converge\n",
                static_cast<double>(iterations) / static_cast<double>(steps), unconverged, 2 * steps);
    EXPECT_EQ(open, 0u) << "of " << steps << " steps, the worst by " << 1e3 * worst << " mm";
}

} // namespace
} // namespace trocar::fem
