// Rods that meet one another: laws over random pairs of rods, radii, step lengths and stiffnesses, with and without torsion and friction.
#include "tests/fem/rods_of_a_test.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <numbers>
#include <random>

namespace trocar::fem {
namespace {

/// Gauss' integral of one polyline about another one: it changes by 1 where they pass through each other.
double linking(const std::vector<Vec3>& x, const std::vector<Vec3>& y) {
    double sum = 0.0;
    const auto unit = [](const Vec3& v) { const double l = v.norm(); return l > 0.0 ? Vec3(v / l) : Vec3(Vec3::Zero()); };
    const auto arc = [](double s) { return std::asin(std::clamp(s, -1.0, 1.0)); };
    for (std::size_t i = 0; i + 1 < x.size(); ++i)
        for (std::size_t j = 0; j + 1 < y.size(); ++j) {
            const Vec3 r13 = y[j] - x[i], r14 = y[j + 1] - x[i], r23 = y[j] - x[i + 1], r24 = y[j + 1] - x[i + 1];
            const Vec3 n1 = unit(r13.cross(r14)), n2 = unit(r14.cross(r24)), n3 = unit(r24.cross(r23)), n4 = unit(r23.cross(r13));
            const double area = arc(n1.dot(n2)) + arc(n2.dot(n3)) + arc(n3.dot(n4)) + arc(n4.dot(n1));
            const double sign = (y[j + 1] - y[j]).cross(x[i + 1] - x[i]).dot(r13);
            sum += sign > 0.0 ? area : sign < 0.0 ? -area : 0.0;
        }
    return sum / (4.0 * std::numbers::pi);
}

/// Of it, between two of many moments of a straight motion of both.
double largest_change(const std::vector<Vec3>& a, const std::vector<Vec3>& b, const std::vector<Vec3>& to_a, const std::vector<Vec3>& to_b) {
    double last = linking(a, b), change = 0.0;
    const int moments = std::abs(linking(to_a, to_b) - last) < 0.2 ? 1 : 40;
    std::vector<Vec3> x(a.size()), y(b.size());
    for (int m = 1; m <= moments; ++m) {
        const double t = double(m) / moments;
        for (std::size_t i = 0; i < x.size(); ++i) x[i] = (1.0 - t) * a[i] + t * to_a[i];
        for (std::size_t i = 0; i < y.size(); ++i) y[i] = (1.0 - t) * b[i] + t * to_b[i];
        const double now = linking(x, y);
        change = std::max(change, std::abs(now - last));
        last = now;
    }
    return change;
}

RodDesign random_design(Dice& dice, bool torsion) {
    RodDesign design;
    design.length = 0.08;
    design.radius = dice.between(0.3e-3, 1e-3);
    design.segment = dice.between(1.5e-3, 3e-3);
    design.young_modulus = std::pow(10.0, dice.between(6.5, 8.5));
    design.tip = TipShape::Straight;
    design.torsion = torsion;
    return design;
}

/// Rods from two sides, pulled across one another by a point that wanders.
void cross_and_check(bool torsion, unsigned seed) {
    Dice dice(seed);
    std::size_t steps = 0, held = 0, pressing = 0, unsettled = 0, pressed_steps = 0;
    double nearest = 10.0, third_law = 0.0;
    for (int k = 0; k < 6; ++k) {
        RodsOfATest pair;
        const double friction = k % 2 == 0 ? 0.0 : dice.between(0.05, 0.4), dt = std::pow(10.0, dice.between(-3.0, -2.0));
        const RodDesign one = random_design(dice, torsion), other = random_design(dice, torsion && k % 3 != 0);
        pair.add(one, {Vec3(0, 0, -0.035), Vec3::UnitZ()}, 0.07, friction);
        pair.add(other, {Vec3(-0.03, 0.004, 0), Vec3::UnitX()}, 0.07, friction);
        Vec3 centre(0, 0, 0);
        for (int step = 0; step < 150; ++step) {
            if (dice.between(0, 1) < 0.05) centre = dice.point(0.015);
            for (std::size_t r = 0; r < 2; ++r) {
                RodAlone& rod = *pair.rods[r];
                const double ei = rod.model.design.young_modulus * std::pow(rod.model.design.radius, 4.0);
                const Vec3 towards = r == 0 ? centre : Vec3(-centre);
                for (std::size_t i = 0; i < rod.force.size(); ++i) rod.force[i] = 400.0 * ei / 0.02 * (towards - rod.state.position[i]);
            }
            const std::vector<Vec3> a = pair.outside(0), b = pair.outside(1);
            pair.step(dt);
            for (auto& rod : pair.rods) {
                ASSERT_EQ(rod->report.first_bad_node, kNoIndex) << k << ", " << step;
                unsettled += rod->report.unconverged;
            }
            const double apart = pair.nearest();
            nearest = std::min(nearest, apart);
            ASSERT_GE(apart, 0.99) << "pair " << k << ", step " << step;
            ASSERT_LT(largest_change(a, b, pair.outside(0), pair.outside(1)), 0.5) << "pair " << k << ", step " << step;
            const Vec3 on_a = pair.rods[0]->report.contact_force, on_b = pair.rods[1]->report.contact_force;
            if (pair.share >= 1.0 && on_a.norm() > 0.0) third_law = std::max(third_law, (on_a + on_b).norm() / on_a.norm());
            ++steps, held += pair.share < 1.0, pressing += pair.pressing(), pressed_steps += pair.pressing() > 0;
        }
    }
    std::printf("margin: nearest %.4f sums of radii; %zu of %zu steps press (%zu places), %zu held, %zu stages unsettled; third law %.1e\n", nearest,
                pressed_steps, steps, pressing, held, unsettled, third_law);
    EXPECT_GT(pressed_steps, steps / 4);
    EXPECT_LT(held, steps / 10);
    EXPECT_LT(unsettled, 2 * steps); // of four stages a step
    EXPECT_LT(third_law, 1e-10);
}

TEST(RodsTogether, NoneOfRandomPairsPassesThroughTheOther) { cross_and_check(false, 21); }
TEST(RodsTogether, NorDoThoseThatTwist) { cross_and_check(true, 22); }

/// Solved together, rods that nothing couples are solved alone: to the same bits.
TEST(RodsTogether, WithoutMeetingsEachIsSolvedAsIfItWereAlone) {
    Dice dice(23);
    for (int k = 0; k < 6; ++k) {
        const RodDesign design = random_design(dice, k % 2 == 1);
        RodAlone alone(design, {Vec3(0, 0, 0), Vec3::UnitZ()}, 0.06, 0.1);
        RodAlone one(design, {Vec3(0, 0, 0), Vec3::UnitZ()}, 0.06, 0.1);
        TogetherWorkspace work;
        for (RodAlone* rod : {&alone, &one}) {
            rod->drive.gravity = Vec3(0, -9.81, 0);
            rod->planes.push_back({Index(rod->model.node_count() - 2), 1.0, Vec3::UnitY(), -1e-4});
        }
        for (int step = 0; step < 60; ++step) {
            alone.drive.insertion = one.drive.insertion = alone.state.insertion + 1e-4;
            alone.report = solve_rod(alone.model, alone.state, 0.01, count_substeps(0.005), alone.drive, alone.planes, alone.work);
            const SolvedRod solved{one.model, one.state, one.drive, one.planes, one.work, one.report, {}, 3};
            solve_together({&solved, 1}, {}, 0.01, work);
            ASSERT_EQ(alone.state.position, one.state.position) << k << ", " << step;
            ASSERT_EQ(alone.report.iterations, one.report.iterations) << k << ", " << step;
            ASSERT_EQ(alone.report.handle_force, one.report.handle_force) << k << ", " << step;
        }
        EXPECT_GT(one.planes[0].force, 0.0);
    }
}

/// What one place takes of a push and of a turn is what the other one gives: forces and their moments about any point add up to nothing,
/// friction's included. Of rods that twist; a rod that does not hands torque about its axis to its handle.
TEST(RodsTogether, BothFeelTheSameForceAtTheSamePlace) {
    Dice dice(24);
    for (int k = 0; k < 50; ++k) {
        std::array<RodAlone, 2> rods{RodAlone(random_design(dice, true), {dice.point(0.01), Vec3::UnitZ()}, 0.08, 0.3),
                                     RodAlone(random_design(dice, true), {dice.point(0.01), Vec3::UnitX()}, 0.08, 0.3)};
        std::array<std::optional<RodStages>, 2> stages;
        std::array<std::optional<RodPartOf<kTwistedCoordinates>>, 2> parts;
        for (std::size_t r = 0; r < 2; ++r) {
            RodAlone& rod = rods[r];
            for (Vec3& p : rod.state.position) p += dice.point(3e-4);
            stages[r].emplace(rod.model, rod.state, rod.drive, 0.01, 1, rod.work);
            stages[r]->begin(0);
            parts[r].emplace(rod.model, rod.state, rod.drive, std::span<RodPlane>(), std::span<RodPlane>(), stages[r]->dt(), stages[r]->first(),
                             stages[r]->share(), rod.work, &stages[r]->twist());
        }
        const std::array<Index, 2> node{Index(dice.between(2, 20)), Index(dice.between(2, 20))};
        std::array<Vec3, 2> axis;
        std::array<double, 2> weight{dice.between(0, 1), dice.between(0, 1)};
        for (std::size_t r = 0; r < 2; ++r) axis[r] = (1.0 - weight[r]) * rods[r].state.position[node[r]] + weight[r] * rods[r].state.position[node[r] + 1];
        const Vec3 meeting = 0.4 * axis[0] + 0.6 * axis[1], force = dice.point(1.0);
        Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
        for (std::size_t r = 0; r < 2; ++r) {
            const SurfacePlace place = parts[r]->place(node[r], weight[r], meeting - axis[r]);
            const Vec3 own = r == 0 ? force : Vec3(-force);
            std::vector<double> out(parts[r]->size(), 0.0);
            parts[r]->take_force(place, own, out);
            const Index first = stages[r]->first();
            for (std::size_t i = first; i < rods[r].model.node_count(); ++i) {
                const double* at = out.data() + kTwistedCoordinates * (i - first);
                const Vec3 f(at[0], at[1], at[2]);
                sum += f, moment += rods[r].state.position[i].cross(f);
                const Vec3 edge = rods[r].state.position[node[r] + 1] - rods[r].state.position[node[r]];
                moment += at[3] * edge.normalized();
            }
        }
        EXPECT_LT(sum.norm(), 1e-12 * force.norm());
        EXPECT_LT(moment.norm(), 1e-10 * force.norm() * 0.01) << k;
    }
}

/// A free rod is thrown at a free one that rests.
TEST(RodsTogether, OfAFreePairMomentumIsKeptAndNoEnergyGained) {
    Dice dice(25);
    for (int k = 0; k < 8; ++k) {
        RodsOfATest pair;
        const double friction = k % 2 == 0 ? 0.0 : 0.3, dt = std::pow(10.0, dice.between(-3.0, -2.0));
        for (int r = 0; r < 2; ++r) {
            RodDesign design = random_design(dice, k % 4 > 1);
            design.drag = design.transverse_drag = 0.0;
            if (r == 0)
                pair.add(design, {Vec3(0, 0, -0.04), Vec3::UnitZ()}, 0.08, friction);
            else
                pair.add(design, {Vec3(-0.04, 0.003, dice.between(-0.01, 0.01)), Vec3(1, 0, 0)}, 0.08, friction);
        }
        const Vec3 speed(dice.between(-0.05, 0.05), 0.1, 0.0);
        for (Vec3& v : pair.rods[0]->state.velocity) v = speed;
        const auto momentum = [&] {
            Vec3 sum = Vec3::Zero();
            for (const auto& rod : pair.rods)
                for (std::size_t i = 0; i < rod->model.node_count(); ++i) sum += rod->model.mass[i] * rod->state.velocity[i];
            return sum;
        };
        const auto energy = [&] {
            double sum = 0.0;
            for (const auto& rod : pair.rods) sum += rod->report.kinetic_j + rod->report.bend_j + rod->report.stretch_j + rod->report.twist_j;
            return sum;
        };
        const Vec3 before = momentum();
        const double energy_before = pair.rods[0]->kinetic_j();
        std::size_t pressed = 0;
        double lost = 0.0, gained = 0.0;
        int taken = 0;
        while (pressed < 10 && ++taken < 100 && pair.rods[0]->state.position[5].y() < 0.02) {
            pair.step(dt);
            pressed += pair.pressing() > 0;
            lost = std::max(lost, (momentum() - before).norm() / before.norm());
        }
        for (int step = 0; step < 3; ++step) pair.step(dt); // the step of an impact has nodes of both methods in it
        gained = energy() / energy_before - 1.0;
        std::printf("margin: steps of %.1f ms: momentum to %.1e, energy gained %.1e\n", 1e3 * dt, lost, gained);
        EXPECT_GT(pressed, 0u) << k;
        EXPECT_LT(lost, 0.05) << k; // nodes that are touched go on in another method than their neighbours: RodStages
        EXPECT_LT(gained, 1e-3) << k;
    }
}

/// A weight of friction: a rod is laid across two stiff ones and pressed; pulled along itself it slides when the pull passes mu times what presses.
TEST(RodsTogether, ACrossedRodSlidesOnceItsPullPassesFrictionsBound) {
    for (const double mu : {0.1, 0.3}) {
        for (const double pull : {0.8, 1.2}) {
            RodsOfATest pair;
            RodDesign post;
            post.length = 0.04, post.radius = 1e-3, post.segment = 2e-3, post.young_modulus = 200e9, post.tip = TipShape::Straight;
            RodDesign laid = post;
            laid.radius = 0.5e-3, laid.young_modulus = 50e9;
            for (const double x : {-0.01, 0.01}) pair.add(post, {Vec3(x, 0, -0.02), Vec3::UnitZ()}, 0.038, mu);
            RodAlone& rod = pair.add(laid, {Vec3(-0.02, 1.505e-3, 0), Vec3::UnitX()}, 0.04, mu);
            const double press = 0.02; // N, shared out so that it stays level
            const double total = std::accumulate(rod.model.mass.begin(), rod.model.mass.end(), 0.0);
            for (std::size_t i = 0; i < rod.force.size(); ++i) rod.force[i] = rod.model.mass[i] / total * Vec3(0, -press, 0);
            for (int step = 0; step < 100; ++step) pair.step(0.005);
            const double x0 = rod.state.position[10].x();
            for (std::size_t i = 0; i < rod.force.size(); ++i) rod.force[i] = rod.model.mass[i] / total * Vec3(pull * mu * press, -press, 0);
            for (int step = 0; step < 20; ++step) pair.step(0.005);
            const double moved = rod.state.position[10].x() - x0;
            if (pull < 1.0)
                EXPECT_LT(std::abs(moved), 2e-5) << mu;
            else
                EXPECT_GT(moved, 5e-5) << mu;
        }
    }
}

} // namespace
} // namespace trocar::fem
