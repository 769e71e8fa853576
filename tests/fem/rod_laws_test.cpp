// Laws of a rod in contact, over random rods and steps of 0.2 to 10 ms: weight, stick, the capstan, hysteresis of torsion, what is blocked;
// and of a rod that nothing touches: the clamp at its port, its slow decay, and the balance of its forces.
#include "rod_rest.hpp"

#include <gtest/gtest.h>

#include <random>

namespace trocar::fem {
namespace {

using test::bare_design;
using test::bending_stiffness;
using test::settle;

constexpr double kPi = std::numbers::pi;
constexpr double kSteps[] = {2e-4, 1e-3, 5e-3, 1e-2}; // s

double weight_of(const RodDesign& design, double gravity) { // N/m
    return design.density * kPi * design.radius * design.radius * gravity;
}

/// One rod and what it is solved with.
struct Bench {
    RodModel model;
    RodDrive drive;
    RodState state;
    RodWorkspace workspace;
    std::vector<RodPlane> planes;

    Bench(const RodDesign& design, double insertion) : model(make_rod_model(design).value()) {
        drive.port = {Vec3::Zero(), Vec3::UnitX()};
        drive.insertion = insertion;
        drive.contact_stiffness = 1e6;
        place_rod(model, drive.port, insertion, 0.0, state);
    }
    RodReport step(double dt) { return solve_rod(model, state, dt, 1, drive, planes, workspace); }
    /// A plane at the middle and the end of every segment beyond the port.
    template <class MakePlane>
    void plane_along(const MakePlane& make) {
        for (Index node = first_inserted_node(model, drive.insertion) - 1; node + 1 < model.node_count(); ++node)
            for (const double weight : {0.5, 1.0}) planes.push_back(make(node, weight));
    }
};

class RandomRods {
public:
    explicit RandomRods(unsigned seed) : random_(seed) { std::printf("seed %u\n", seed); }
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    RodDesign design(double length) {
        RodDesign design = bare_design(length, between(2e-3, 3e-3));
        design.radius = between(0.3e-3, 0.6e-3);
        design.young_modulus = between(30e6, 200e6);
        design.drag = 40.0;
        return design;
    }

private:
    std::mt19937 random_;
};

/// Sum of the normal forces on a floor.
double floor_force(const Bench& bench) {
    double sum = 0.0;
    for (const RodPlane& plane : bench.planes) sum += plane.force;
    return sum;
}

TEST(RodLaws, ARodThatRestsPressesWithItsWeightAtEveryStepLength) {
    RandomRods random(281);
    double worst = 0.0, scatter = 0.0;
    for (const double dt : kSteps) {
        Bench bench(random.design(0.14), 0.1);
        bench.drive.gravity = Vec3(0, 0, -random.between(2.0, 9.81));
        bench.drive.friction = random.between(0.0, 0.3);
        bench.plane_along([](Index node, double weight) { return RodPlane{node, weight, Vec3::UnitZ(), 0.0}; });
        double weight = 0.0, sum = 0.0, squares = 0.0;
        for (Index i = first_inserted_node(bench.model, 0.1); i < bench.model.node_count(); ++i)
            weight += bench.model.mass[i] * -bench.drive.gravity.z();
        for (double t = 0.0; t < 1.0; t += dt) (void)bench.step(dt);
        constexpr int kSamples = 100;
        for (int k = 0; k < kSamples; ++k) {
            (void)bench.step(dt);
            const double share = floor_force(bench) / weight;
            sum += share, squares += share * share;
        }
        const double mean = sum / kSamples;
        worst = std::max(worst, std::abs(mean - 1.0));
        scatter = std::max(scatter, std::sqrt(std::max(0.0, squares / kSamples - mean * mean)));
    }
    std::printf("law e: sum of normal forces off the weight by %.2e at most, standard deviation %.2e\n", worst, scatter);
    EXPECT_LT(worst, 0.01);
    EXPECT_LT(scatter, 0.02);
}

/// Of the handle's pull over the load at the other end, for a thin rod that is drawn over a post through `angle`.
double measure_capstan(double mu, double angle, double dt) {
    const double post = 20e-3, lead = 10e-3; // m, radius of the post; straight parts
    RodDesign design = bare_design(2.0 * lead + post * angle + 40e-3, 1e-3);
    design.radius = 0.1e-3;
    design.young_modulus = 100e6;
    design.drag = 40.0;
    const double inside = 2.0 * lead + post * angle;
    Bench bench(design, inside);
    bench.drive.friction = mu;
    const std::size_t nodes = bench.model.node_count();
    const auto place = [&](double s, Vec3& normal) { // arc length from the port
        const double turned = std::clamp((s - lead) / post, 0.0, angle);
        normal = Vec3(std::sin(turned), -std::cos(turned), 0.0);
        const Vec3 tangent(std::cos(turned), std::sin(turned), 0.0), centre(lead, post, 0.0);
        if (s <= lead) return Vec3(s, 0.0, 0.0);
        return Vec3(centre + post * normal + std::max(0.0, s - lead - post * angle) * tangent);
    };
    Vec3 normal;
    for (std::size_t i = 0; i < nodes; ++i)
        bench.state.position[i] = place(inside - static_cast<double>(nodes - 1 - i) * bench.model.segment, normal);
    const double load = 5e-3; // N, against the tip's direction: it holds back
    std::vector<Vec3> force(nodes, Vec3::Zero());
    (void)place(inside, normal);
    force.back() = load * Vec3(-normal.y(), normal.x(), 0.0);
    bench.drive.force = force;
    // The post as planes on the nodes, renewed where they are: as the engine's from a wall. Forces stay with the place.
    const Index first = first_inserted_node(bench.model, inside);
    for (Index node = first - 1; node + 1 < nodes; ++node) bench.planes.push_back({node, 1.0, Vec3::UnitX(), -1.0});
    RodReport report;
    double sum = 0.0;
    const int steps = static_cast<int>(1.2 / dt);
    for (int k = 0; k < steps; ++k) {
        if (k > steps / 3) bench.drive.insertion -= 1e-3 * dt;
        for (RodPlane& plane : bench.planes) {
            const Vec3 out = bench.state.position[plane.node + 1] - Vec3(lead, post, 0.0);
            const Vec3 flat(out.x(), out.y(), 0.0);
            plane.normal = flat.normalized();
            plane.offset = plane.normal.dot(Vec3(lead, post, 0.0)) + post;
        }
        report = bench.step(dt);
        if (k >= steps - 20) sum += -report.handle_force.x() / 20.0;
    }
    return sum / load;
}

TEST(RodLaws, ARodDrawnOverAPostNeedsTheCapstansForce) {
    const struct {
        double mu, angle;
    } cases[] = {{0.1, kPi}, {0.2, kPi}, {0.3, 1.5 * kPi}};
    for (const auto& [mu, angle] : cases)
        for (const double dt : {1e-3, 1e-2}) {
            const double measured = measure_capstan(mu, angle, dt), expected = std::exp(mu * angle);
            std::printf("law g: mu %.1f, angle %.2f pi, step %g ms: handle over load %.4f, exp(mu theta) %.4f: %.2f %% off\n", mu, angle / kPi,
                        1e3 * dt, measured, expected, 1e2 * (measured / expected - 1.0));
            EXPECT_NEAR(measured / expected, 1.0, 0.03) << mu << " " << angle << " " << dt;
        }
}

TEST(RodLaws, TurnedToAndFroAgainstFrictionTheHandlesTorqueClosesItsLoop) {
    RandomRods random(285);
    double worst = 0.0;
    for (const double dt : {1e-3, 1e-2}) {
        RodDesign design = random.design(0.2);
        design.torsion = true;
        Bench bench(design, 0.15);
        bench.drive.friction = 0.3;
        const Index last = static_cast<Index>(bench.model.node_count() - 2);
        for (const double side : {-1.0, 1.0}) bench.planes.push_back({last, 1.0, Vec3(0, side, 0), 0.01 / bench.drive.contact_stiffness});
        const double torque = 2.0 * 0.3 * 0.01 * design.radius, gj = bending_stiffness(design) / (1.0 + design.poisson_ratio);
        const double wound = torque * 0.15 / gj;
        std::vector<double> loop[2];
        constexpr int kQuarter = 50;
        for (int k = 0; k < 3 * 4 * kQuarter; ++k) { // triangles of twice what makes it slip
            const int phase = k % (4 * kQuarter);
            const double turn = phase < kQuarter       ? phase
                                : phase < 3 * kQuarter ? 2 * kQuarter - phase
                                                       : phase - 4 * kQuarter;
            bench.drive.rotation = 2.0 * wound * turn / kQuarter;
            const RodReport report = bench.step(dt);
            if (k >= 4 * kQuarter) loop[k / (8 * kQuarter)].push_back(report.handle_torque);
        }
        double largest = 0.0;
        for (std::size_t k = 0; k < loop[1].size(); ++k) {
            worst = std::max(worst, std::abs(loop[0][k] - loop[1][k]) / torque);
            largest = std::max(largest, std::abs(loop[1][k]));
        }
        std::printf("law h: step %g ms: the handle's largest torque is %.4f of the friction's\n", 1e3 * dt, largest / torque);
        EXPECT_NEAR(largest / torque, 1.0, 0.05); // the shaft rings where it slips
    }
    std::printf("law h: second and third loop apart by %.2e of the friction's torque\n", worst);
    EXPECT_LT(worst, 0.01);
}

TEST(RodLaws, ABlockedTipIsPressedSteadilyAndWithoutSpikesWhileItIsPushed) {
    RandomRods random(286);
    for (const double dt : kSteps) {
        const RodDesign design = random.design(0.3);
        Bench bench(design, 0.1);
        bench.drive.friction = 0.2;
        constexpr double kRoom = 1e-3; // m, about it in the tube
        bench.plane_along([](Index node, double weight) { return RodPlane{node, weight, Vec3::UnitZ(), -kRoom}; });
        for (const Vec3& wall : {Vec3(-Vec3::UnitZ()), Vec3(Vec3::UnitY()), Vec3(-Vec3::UnitY())})
            bench.plane_along([&](Index node, double weight) { return RodPlane{node, weight, wall, -kRoom}; });
        bench.drive.gravity = Vec3(0, 0, -1.0);
        bench.planes.push_back({static_cast<Index>(bench.model.node_count() - 2), 1.0, -Vec3::UnitX(), -0.1});
        std::vector<double> course;
        const auto press = [&] { return bench.planes.back().force; };
        const double push = 1.9e-3; // m, less than a segment: the planes stay those of the free part
        for (double t = 0.0; t < 0.5; t += dt) {
            bench.drive.insertion += push * dt / 0.5;
            (void)bench.step(dt);
            course.push_back(press());
        }
        const double pushed = press();
        double spike = 0.0;
        for (std::size_t k = 0; k < course.size(); ++k) {
            double before = 0.0; // the largest so far but for the last 50 ms
            for (std::size_t j = 0; j <= k; ++j) before = std::max(before, j + static_cast<std::size_t>(0.05 / dt) < k ? course[j] : 0.0);
            spike = std::max(spike, course[k] / std::max(pushed, before));
        }
        for (double t = 0.0; t < 1.0; t += dt) (void)bench.step(dt);
        double least = 1e9, most = 0.0;
        for (double t = 0.0; t < 1.0; t += dt) {
            (void)bench.step(dt);
            least = std::min(least, press()), most = std::max(most, press());
        }
        std::printf("law j: step %g ms: %.4g N while pushed, highest %.3f of it; held between %.4g and %.4g N\n", 1e3 * dt, pushed, spike, least,
                    most);
        EXPECT_LT(spike, 1.5) << dt;
        EXPECT_LT(most / least, 1.05) << dt;
        EXPECT_GT(pushed, 1e-3);
    }
}

TEST(RodLaws, TheStiffnessBehindThePlanesDoesNotChangeForces) {
    RandomRods random(287);
    const RodDesign design = random.design(0.2);
    double reference = 0.0, worst = 0.0;
    for (const double stiffness : {1e5, 1e6, 1e7}) {
        Bench bench(design, 0.1);
        bench.drive.contact_stiffness = stiffness;
        bench.drive.gravity = Vec3(0, 0, -9.81);
        bench.plane_along([](Index node, double weight) { return RodPlane{node, weight, Vec3::UnitZ(), 0.0}; });
        bench.planes.push_back({static_cast<Index>(bench.model.node_count() - 2), 1.0, Vec3::UnitY(), 3e-3}); // aside
        for (int k = 0; k < 300; ++k) (void)bench.step(1e-2);
        const double force = bench.planes.back().force;
        if (reference > 0.0) worst = std::max(worst, std::abs(force / reference - 1.0));
        if (reference == 0.0) reference = force;
    }
    std::printf("law i, of the rod's side: over a factor 100 of stiffness the force changes by %.2e\n", worst);
    EXPECT_LT(worst, 0.05);
}

TEST(RodLaws, ACantileverIsClampedAtThePortWhateverStandsThere) {
    double worst = 0.0, jump = 0.0, last = 0.0;
    for (double length = 0.03; length <= 0.1; length += 0.35e-3) { // past 28 nodes of 2.5 mm
        Bench bench(bare_design(0.12, 2.5e-3), length);
        std::vector<Vec3> force(bench.model.node_count(), Vec3::Zero());
        force.back() = Vec3(0, 0, 0.003 * bending_stiffness(bench.model.design) * 3.0 / std::pow(length, 2)); // small: 0.3 % of its length
        bench.drive.force = force;
        settle(bench.model, bench.state, bench.drive, {}, 0.05, 2000, 1e-10);
        const double expected = 0.003 * length, share = bench.state.position.back().z() / expected;
        worst = std::max(worst, std::abs(share - 1.0));
        if (last > 0.0) jump = std::max(jump, std::abs(share - last));
        last = share;
    }
    std::printf("law: tip deflection off Euler-Bernoulli by %.2e at most from 30 to 100 mm, from one 0.35 mm to the next by %.2e\n", worst, jump);
    EXPECT_LT(worst, 0.01);
    EXPECT_LT(jump, 0.005);
}

TEST(RodLaws, TheFirstBendingModeOfACantileverHardlyDecaysByNumerics) {
    for (const double dt : {1e-3, 1e-2}) {
        const double length = 0.05;
        const RodDesign design = bare_design(0.07, 2.5e-3);
        Bench bench(design, length);
        bench.drive.gravity = Vec3(0, 0, -0.1);
        settle(bench.model, bench.state, bench.drive);
        bench.drive.gravity.setZero();
        const double period = 2.0 * kPi / 3.516 / std::sqrt(bending_stiffness(design) / weight_of(design, 1.0)) * length * length;
        double early = 0.0, late = 0.0;
        for (int k = 0; k < static_cast<int>(10.0 * period / dt); ++k) {
            const RodReport report = bench.step(dt);
            if (k == static_cast<int>(2.0 * period / dt)) early = report.kinetic_j + report.bend_j;
            late = report.kinetic_j + report.bend_j;
        }
        const double decrement = 0.5 * std::log(early / late) / 8.0;
        std::printf("law: step %g ms: log decrement %.4f a period of %.1f ms\n", 1e3 * dt, decrement, 1e3 * period);
        EXPECT_LT(decrement, dt < 5e-3 ? 0.02 : 0.05);
        EXPECT_GT(decrement, -0.005) << "never gains";
    }
}

TEST(RodLaws, HandleContactsLoadsAndInertiaAddUpToNothing) {
    RandomRods random(288);
    double worst = 0.0;
    unsigned open = 0;
    for (const double dt : kSteps)
        for (int rod = 0; rod < 2; ++rod) {
            RodDesign design = random.design(0.2);
            Bench bench(design, 0.1);
            bench.drive.gravity = Vec3(0, 1.0, -5.0);
            bench.drive.friction = 0.3;
            bench.plane_along([](Index node, double weight) { return RodPlane{node, weight, Vec3::UnitZ(), -1e-3}; });
            for (int k = 0; k < 100; ++k) {
                bench.drive.insertion += 20e-3 * dt * (k < 50 ? 1.0 : -1.0) * 0.1;
                bench.drive.rotation += 1.0 * dt;
                const RodReport report = bench.step(dt);
                open += report.unconverged > 0;
                if (report.unconverged > 0) continue;
                const double sum = (report.handle_force + report.contact_force + report.body_force).norm();
                worst = std::max(worst, sum / (report.contact_force.norm() + weight_of(design, 5.0) * 0.1));
            }
        }
    std::printf("law: what is left of the balance of forces is %.2e of the largest of them; %u of 800 steps had not settled\n", worst, open);
    EXPECT_LT(worst, 1e-3);
}

} // namespace
} // namespace trocar::fem
