// A rod that is wholly out of its port: nothing holds it there any more.
#include "base/trig.hpp"
#include "fem/rod/rod.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <limits>
#include <random>

namespace trocar::fem {
namespace {

struct FreeRod {
    RodModel model;
    RodState state;
    RodDrive drive;
    RodWorkspace work;

    FreeRod(const Vec3& direction, double drag, double angle) {
        RodDesign design;
        design.length = 0.04;
        design.segment = 1e-3;
        design.radius = 0.2e-3;
        design.tip = TipShape::Pigtail;
        design.tip_length = 0.035;
        design.tip_angle = angle;
        design.tip_stiffness = 1.0;
        design.young_modulus = 50e6;
        design.drag = drag;
        design.transverse_drag = 0.0;
        design.torsion = true;
        model = make_rod_model(design).value();
        drive.port = {Vec3(0.01, -0.02, 0.03), direction};
        drive.insertion = design.length;
        place_rod(model, drive.port, drive.insertion, 0.7, state);
        drive.rotation = 0.7;
    }
    RodReport step(double dt) { return solve_rod(model, state, dt, 1, drive, {}, work); }
    [[nodiscard]] Vec3 momentum() const {
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < model.node_count(); ++i) sum += model.mass[i] * state.velocity[i];
        return sum;
    }
    [[nodiscard]] Vec3 centre() const {
        Vec3 sum = Vec3::Zero();
        double mass = 0.0;
        for (std::size_t i = 0; i < model.node_count(); ++i) sum += model.mass[i] * state.position[i], mass += model.mass[i];
        return sum / mass;
    }
    [[nodiscard]] Vec3 angular_momentum() const {
        const Vec3 about = centre();
        Vec3 sum = Vec3::Zero();
        for (std::size_t i = 0; i < model.node_count(); ++i) sum += model.mass[i] * (state.position[i] - about).cross(state.velocity[i]);
        return sum;
    }
    [[nodiscard]] std::vector<Vec3> material() const {
        std::vector<Vec3> axis(model.node_count());
        carry_material_axis(model, state, drive.port, axis);
        return axis;
    }
};

struct Random {
    std::mt19937 bits;
    explicit Random(unsigned seed) : bits(seed) {}
    double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(bits()) / 4294967296.0); }
    Vec3 vector() {
        const double x = uniform(-1.0, 1.0), y = uniform(-1.0, 1.0);
        return {x, y, uniform(-1.0, 1.0)};
    }
};

void throw_it(FreeRod& rod, const Vec3& velocity, const Vec3& spin) {
    const Vec3 centre = rod.centre();
    for (std::size_t i = 0; i < rod.model.node_count(); ++i) rod.state.velocity[i] = velocity + spin.cross(rod.state.position[i] - centre);
}

TEST(RodFree, KeepsItsMomentumWhateverItsShapeDoes) {
    Random random(5);
    for (int k = 0; k < 12; ++k) {
        FreeRod rod(random.vector().normalized(), 0.0, 6.0);
        throw_it(rod, 0.1 * random.vector(), 10.0 * random.vector());
        const double dt = std::pow(2.0, -k % 4) * 4e-3;
        int settled = 0;
        for (int step = 0; step < 60; ++step) {
            const Vec3 before = rod.momentum();
            if (rod.step(dt).unconverged > 0) continue; // it is said, and slowed
            EXPECT_LT((rod.momentum() - before).norm(), 1e-6 * before.norm()) << k << ' ' << step;
            ++settled;
        }
        EXPECT_GE(settled, 50) << k;
    }
}

/// What is lost in a tenth of a second goes to 0 with the step.
TEST(RodFree, SpinsOn) {
    Random random(8);
    for (int k = 0; k < 4; ++k) {
        const Vec3 direction = random.vector().normalized(), spin = 15.0 * random.vector();
        double last = 0.2;
        for (const double dt : {2e-3, 1e-3, 5e-4, 2.5e-4}) {
            FreeRod rod(direction, 0.0, 0.5);
            (void)rod.step(1e-9);
            throw_it(rod, Vec3::Zero(), spin);
            const Vec3 before = rod.angular_momentum();
            for (int step = 0; step < std::lround(0.1 / dt); ++step) (void)rod.step(dt);
            const double lost = (rod.angular_momentum() - before).norm() / before.norm();
            std::printf("margin: steps of %g ms: loses %.4f of its angular momentum in 0.1 s\n", 1e3 * dt, lost);
            EXPECT_LT(lost, 0.7 * last) << k << ' ' << dt;
            last = lost;
        }
        EXPECT_LT(last, 0.02) << k;
    }
}

TEST(RodFree, CurlsToItsRestShapeWhereverItPoints) {
    Random random(6);
    for (int k = 0; k < 6; ++k) {
        FreeRod rod(random.vector().normalized(), 40.0, 6.0);
        const double straight = rod.step(1e-9).bend_j;
        ASSERT_GT(straight, 0.0);
        double last = std::numeric_limits<double>::max();
        for (int step = 0; step < 500; ++step) last = rod.step(4e-3).bend_j;
        EXPECT_LT(last, 1e-9 * straight) << k;
    }
}

/// Turned as a whole it does the same, turned.
TEST(RodFree, FeelsNoDirectionOfSpace) {
    Random random(7);
    for (int k = 0; k < 6; ++k) {
        FreeRod one(Vec3::UnitX(), 40.0, 8.0), other(Vec3::UnitX(), 40.0, 8.0);
        throw_it(one, 0.05 * random.vector(), 10.0 * random.vector());
        (void)one.step(1e-3);
        const Mat3 turn = rotation_about(random.vector().normalized(), random.uniform(-3.0, 3.0));
        other.state = one.state;
        for (std::size_t i = 0; i < one.model.node_count(); ++i) {
            other.state.position[i] = turn * one.state.position[i];
            other.state.velocity[i] = turn * one.state.velocity[i];
        }
        other.state.root = turn * one.state.root;
        for (int step = 0; step < 100; ++step) {
            (void)one.step(4e-3), (void)other.step(4e-3);
            for (std::size_t i = 0; i < one.model.node_count(); ++i)
                ASSERT_LT((turn * one.state.position[i] - other.state.position[i]).norm(), 1e-7) << k << ' ' << step;
        }
    }
}

TEST(RodFree, IsNotPulledBackOrTurnedByItsDrive) {
    FreeRod one(Vec3::UnitY(), 40.0, 8.0), other(Vec3::UnitY(), 40.0, 8.0);
    (void)one.step(2e-3), (void)other.step(2e-3);
    other.drive.insertion = 0.02, other.drive.rotation = -2.0;
    for (int step = 0; step < 20; ++step) (void)one.step(2e-3), (void)other.step(2e-3);
    for (std::size_t i = 0; i < one.model.node_count(); ++i) EXPECT_EQ(one.state.position[i], other.state.position[i]);
    EXPECT_EQ(other.state.insertion, one.state.insertion);
}

/// Pushed out it does not jump: what it has of curl, and how its material is turned, is what it had.
TEST(RodFree, LeavesItsPortWithoutAJump) {
    for (const double dt : {1e-3, 4e-3}) {
        FreeRod rod(Vec3(1, 2, -1).normalized(), 40.0, 6.0);
        double out = 0.02;
        place_rod(rod.model, rod.drive.port, out, 0.7, rod.state);
        double moved_most = 0.0, turned_most = 0.0;
        while (!is_free(rod.model, out)) {
            const std::vector<Vec3> was = rod.state.position, axis = rod.material();
            rod.drive.insertion = out = std::min(out + 0.02 * dt, 0.04);
            (void)rod.step(dt);
            if (out < 0.035) continue;
            const std::vector<Vec3> now = rod.material();
            for (std::size_t i = 0; i < was.size(); ++i) {
                moved_most = std::max(moved_most, (rod.state.position[i] - was[i]).norm());
                turned_most = std::max(turned_most, (now[i] - axis[i]).norm());
            }
        }
        EXPECT_LT(moved_most, 0.5 * dt); // 0.5 m/s: the last segments hang on a hinge
        EXPECT_LT(turned_most, 0.5);
        const RodReport report = rod.step(dt);
        EXPECT_TRUE(report.handle_force.isZero(0.0)) << report.handle_force.transpose();
        EXPECT_EQ(report.handle_torque, 0.0);
    }
}

} // namespace
} // namespace trocar::fem
