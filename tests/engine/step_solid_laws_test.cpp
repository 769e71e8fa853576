// Laws of contact between solids, over random shapes, orientations, steps, meshers and budgets: what is conserved, what is never gained, and
// where friction holds.
#include "fem/tissue/integrate.hpp"
#include "step_fixture.hpp"

#include <Eigen/Geometry>

namespace trocar::engine {
namespace {

constexpr unsigned kSeed = 20281;

/// In m, kPa.
struct SolidScene {
    std::string bodies, contact, budget = "exact", integrator = "rk4";
    double step = 0.005;
    Vec3 gravity = Vec3::Zero();
};

PreparedScene prepare_solids_of(const SolidScene& s) {
    return test::prepare(fmt::format(
        R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 100, "integrator": "{}"}}, "budget": "{}",
        "gravity": [{}, {}, {}], "bodies": {{{}}}, "contact": {{{}}}, "effects": ["elasticity", "gravity", "damping", "coarse_contact",
        "friction"]}})",
        s.step, s.integrator, s.budget, s.gravity.x(), s.gravity.y(), s.gravity.z(), s.bodies, s.contact));
}

struct Flesh {
    double kpa = 10.0, viscosity = 0.001, mass_damping = 0.0;
    std::string mesher = "lattice";
    int triangles = 300;
};

std::string deformable(const std::string& name, const std::string& surface, const Flesh& flesh) {
    return fmt::format(R"("{}": {{"kind": "deformable", "surface": {}, "material": {{"young_modulus": {}, "poisson_ratio": 0.4,
        "density": 1000, "viscosity": {}, "mass_damping": {}}}, "coarse": {{"mesher": "{}", "surface_triangles": {}}}}})",
                       name, surface, flesh.kpa, flesh.viscosity, flesh.mass_damping, flesh.mesher, flesh.triangles);
}

std::string ball(const Vec3& c, double radius = 0.02, int subdivisions = 3) {
    return fmt::format(R"({{"shape": "sphere", "centre": [{}, {}, {}], "radius": {}, "subdivisions": {}}})", c.x(), c.y(), c.z(), radius,
                       subdivisions);
}

std::string box(const Vec3& c, const Vec3& extent, int cells) {
    return fmt::format(R"({{"shape": "box", "centre": [{}, {}, {}], "extent": [{}, {}, {}], "cells": {}}})", c.x(), c.y(), c.z(),
                       extent.x(), extent.y(), extent.z(), cells);
}

std::string table(int cells) {
    return fmt::format(R"("table": {{"kind": "static", "surface": {}}})", box({0, 0, -0.01}, {0.3, 0.3, 0.02}, cells));
}

struct Sums {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double mass_speed = 0.0, arm_speed = 0.0; // of what each part of them is compared with
};

Sums find_sums(const SceneModel& model, const State& state) {
    Sums sums;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].tissue) continue;
        for (std::size_t n = 0; n < model.bodies[i].tissue->node_count(); ++n) {
            const Vec3& x = state.bodies[i].tissue.position[n];
            const Vec3 p = model.bodies[i].tissue->node_mass[n] * state.bodies[i].tissue.velocity[n];
            sums.linear += p;
            sums.angular += x.cross(p);
            sums.mass_speed += p.norm();
            sums.arm_speed += x.norm() * p.norm();
        }
    }
    return sums;
}

Vec3 mass_centre(const fem::TissueModel& tissue, const fem::TissueState& state) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t n = 0; n < tissue.node_count(); ++n) sum += tissue.node_mass[n] * state.position[n];
    return sum / tissue.mass;
}

double energy_of(const StepReport& report) { return report.kinetic_j + report.elastic_j; }

TEST(SolidLaws, AFreeSystemKeepsMomentumAndAngularMomentumAndGainsNoEnergyWhateverTouches) {
    test::Random random(kSeed);
    for (int k = 0; k < 12; ++k) {
        SolidScene scene;
        scene.step = random.step();
        scene.integrator = "leapfrog"; // Runge-Kutta 4 alone keeps the angular momentum of a body to the fourth power of its sub-steps
        const char* const budgets[] = {"exact", "exact", "work:1000", "exact", "work:0", "work:30000"};
        scene.budget = budgets[k % 6];
        const double friction = k % 2 ? random.between(0.1, 0.8) : 0.0;
        scene.contact = fmt::format("\"solid_friction\": {}", friction);
        const Flesh flesh{.kpa = random.between(5.0, 40.0), .mesher = k % 4 < 2 ? "lattice" : "tetgen"};
        const Vec3 towards = random.direction();
        const Vec3 at = 0.0425 * towards + 0.01 * random.direction();
        scene.bodies = deformable("first", ball(Vec3::Zero()), flesh) + ", " +
                       (k % 2 ? deformable("second", ball(at), flesh)
                              : deformable("second", box(0.05 * towards, {0.03, 0.025, 0.035}, 5), flesh));
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s, friction {:g}, {}", kSeed, k, scene.step, friction, scene.budget));
        const PreparedScene prepared = prepare_solids_of(scene);
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        State thrown = simulator.state();
        const Vec3 spin = 2.0 * random.direction(), along = random.between(0.2, 0.5) * towards;
        for (std::size_t n = 0; n < thrown.bodies[0].tissue.velocity.size(); ++n)
            thrown.bodies[0].tissue.velocity[n] = along + spin.cross(thrown.bodies[0].tissue.position[n]);
        ASSERT_TRUE(simulator.restore(thrown).ok());
        const Sums before = find_sums(prepared.model, thrown);
        double first = -1.0;
        std::uint64_t touches = 0, held = 0;
        for (int step = 0; step < static_cast<int>(0.12 / scene.step); ++step) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            held += report.held_pairs;
            if (first < 0.0) first = energy_of(report);
            EXPECT_LE(energy_of(report), first * 1.002) << "step " << step << ": what leapfrog's own energy swings by";
            touches += report.solid_touches;
        }
        const Sums after = find_sums(prepared.model, simulator.state());
        EXPECT_TRUE(scene.budget == "exact" ? touches > 0 : touches + held > 0);
        EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * before.mass_speed);
        EXPECT_LT((after.angular - before.angular).norm(), 1e-9 * before.arm_speed);
    }
}

/// Two bodies that press, with others in the same scene and without. What begins inside another body is pushed out with energy that contact has
/// taken: with none that it took a metre away.
TEST(SolidLaws, WhatTouchesElsewhereChangesNothing) {
    test::Random random(kSeed + 2);
    for (int k = 0; k < 6; ++k) {
        SolidScene scene;
        scene.step = random.step();
        scene.contact = fmt::format("\"solid_friction\": {}", k % 2 ? 0.3 : 0.0);
        const Flesh flesh{.kpa = random.between(5.0, 40.0)};
        const Vec3 towards = random.direction(), away = random.direction();
        const double inside = k % 3 == 0 ? 0.001 : -0.001; // m, in which they begin
        const std::string here = deformable("a", ball(Vec3::Zero()), flesh) + ", " + deformable("b", ball((0.04 - inside) * towards), flesh);
        const std::string there = deformable("c", ball(away), flesh) + ", " + deformable("d", ball(away + 0.0402 * random.direction()), flesh);
        const double speed = random.between(0.05, 0.3);
        const auto run = [&](const std::string& bodies, std::size_t first) {
            scene.bodies = bodies;
            const PreparedScene prepared = prepare_solids_of(scene);
            Simulator simulator(prepared.model);
            State thrown = simulator.state();
            for (std::size_t i = 0; i < thrown.bodies.size(); i += 2) // one of each pair
                for (std::size_t n = 0; n < thrown.bodies[i].tissue.velocity.size(); ++n) {
                    const Vec3 other = mass_centre(*prepared.model.bodies[i + 1].tissue, thrown.bodies[i + 1].tissue);
                    const Vec3 own = mass_centre(*prepared.model.bodies[i].tissue, thrown.bodies[i].tissue);
                    thrown.bodies[i].tissue.velocity[n] = (i == first && inside > 0.0 ? 0.0 : speed) * (other - own).normalized();
                }
            EXPECT_TRUE(simulator.restore(thrown).ok());
            std::size_t touches = 0;
            for (double time = 0.0; time < 0.1; time += scene.step) {
                EXPECT_TRUE(simulator.step().finite);
                for (const Contact& contact : simulator.contacts()) touches += contact.a.index() == first;
            }
            EXPECT_GT(touches, 0u);
            BitHash hash;
            for (const std::size_t i : {first, first + 1}) {
                hash.add(simulator.state().bodies[i].tissue.position);
                hash.add(simulator.state().bodies[i].tissue.velocity);
            }
            return hash.value();
        };
        const std::uint64_t alone = run(here, 0);
        EXPECT_EQ(run(here + ", " + there, 0), alone) << "case " << k;
        EXPECT_EQ(run(there + ", " + here, 2), alone) << "case " << k;
    }
}

TEST(SolidLaws, EqualBallsLeaveAnImpactAsTheShortestStepSaysAtEveryStep) {
    constexpr double kSpeed = 0.196;
    for (const char* mesher : {"lattice", "tetgen"}) {
        Vec3 reference[2] = {};
        for (const double step : {2e-4, 1e-3, 2e-3, 5e-3, 1e-2}) {
            SCOPED_TRACE(fmt::format("{} at {:g} s", mesher, step));
            SolidScene scene;
            scene.step = step;
            const Flesh flesh{.mesher = mesher};
            scene.bodies =
                deformable("first", ball({-0.0205, 0, 0}), flesh) + ", " + deformable("second", ball({0.0205, 0.005, 0}), flesh);
            const PreparedScene prepared = prepare_solids_of(scene);
            ASSERT_EQ(prepared.model.bodies.size(), 2u);
            Simulator simulator(prepared.model);
            State thrown = simulator.state();
            for (Vec3& v : thrown.bodies[0].tissue.velocity) v = Vec3(kSpeed, 0, 0);
            ASSERT_TRUE(simulator.restore(thrown).ok());
            for (int k = 0; k < static_cast<int>(0.2 / step); ++k) ASSERT_TRUE(simulator.step().finite);
            for (std::size_t i = 0; i < 2; ++i) {
                const fem::TissueModel& tissue = *prepared.model.bodies[i].tissue;
                const Vec3 speed = fem::find_momentum(tissue, simulator.state().bodies[i].tissue).linear / tissue.mass;
                if (step == 2e-4)
                    reference[i] = speed;
                else
                    EXPECT_LT((speed - reference[i]).norm(), 0.05 * kSpeed) << "body " << i;
            }
            EXPECT_GT(reference[1].x(), 0.8 * kSpeed) << "nearly elastic: the moving one stops";
        }
    }
}

TEST(SolidLaws, ATurnedSceneGoesOnTurned) {
    test::Random random(kSeed);
    for (int k = 0; k < 3; ++k) {
        SolidScene scene;
        scene.step = random.step();
        scene.contact = "\"solid_friction\": 0.3";
        const Flesh flesh{.mesher = k == 0 ? "tetgen" : "lattice"};
        scene.bodies = deformable("first", ball({-0.0205, 0, 0}), flesh) + ", " + deformable("second", ball({0.0205, 0.006, 0}), flesh);
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s", kSeed, k, scene.step));
        const PreparedScene prepared = prepare_solids_of(scene);
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        const Mat3 turn = Eigen::AngleAxisd(random.between(0.5, 3.0), random.direction()).toRotationMatrix();
        State end[2];
        for (int turned = 0; turned < 2; ++turned) {
            Simulator simulator(prepared.model);
            State start = simulator.state();
            for (Vec3& v : start.bodies[0].tissue.velocity) v = Vec3(0.3, 0, 0);
            if (turned == 1)
                for (BodyState& body : start.bodies) {
                    for (auto* list : {&body.tissue.position, &body.tissue.velocity, &body.surface})
                        for (Vec3& v : *list) v = turn * v;
                }
            ASSERT_TRUE(simulator.restore(start).ok());
            for (int step = 0; step < static_cast<int>(0.03 / scene.step); ++step) ASSERT_TRUE(simulator.step().finite);
            end[turned] = simulator.state();
        }
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t n = 0; n < end[0].bodies[i].tissue.position.size(); ++n)
                ASSERT_LT((end[1].bodies[i].tissue.position[n] - turn * end[0].bodies[i].tissue.position[n]).norm(), 1e-6 * 0.02);
    }
}

TEST(SolidLaws, AFrictionlessPlaneOfAnyTessellationPushesAlongItsNormalAlone) {
    test::Random random(kSeed);
    for (const int cells : {1, 3, 16, 40}) {
        SolidScene scene;
        scene.step = random.step();
        scene.budget = cells == 16 ? "work:1000" : "exact";
        scene.gravity = {0, 0, -9.81};
        scene.bodies =
            deformable("ball", ball({0.003, 0.002, 0.024}), {.mass_damping = 2.0, .mesher = cells == 3 ? "tetgen" : "lattice"}) + ", " +
            table(cells);
        SCOPED_TRACE(fmt::format("seed {}: {} cells, step {:g} s", kSeed, cells, scene.step));
        const PreparedScene prepared = prepare_solids_of(scene);
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        Simulator simulator(prepared.model);
        const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
        const Vec3 start = mass_centre(tissue, simulator.state().bodies[0].tissue);
        double sideways = 0.0;
        for (int k = 0; k < static_cast<int>(0.5 / scene.step); ++k) {
            ASSERT_TRUE(simulator.step().finite);
            const Vec3 moved = mass_centre(tissue, simulator.state().bodies[0].tissue) - start;
            sideways = std::max(sideways, std::hypot(moved.x(), moved.y()));
        }
        EXPECT_LT(sideways, 1e-6);
        const StepReport& end = simulator.report();
        EXPECT_GT(scene.budget == "exact" ? end.solid_touches : end.solid_touches + end.held_pairs, 0u);
    }
}

TEST(SolidLaws, AtRestTheForcesOfContactCarryTheWeightAtEveryStep) {
    for (const char* mesher : {"lattice", "tetgen"})
        for (const double step : {2e-4, 1e-3, 5e-3, 1e-2}) {
            SCOPED_TRACE(fmt::format("{} at {:g} s", mesher, step));
            SolidScene scene;
            scene.step = step;
            scene.gravity = {0, 0, -9.81};
            scene.contact = "\"solid_friction\": 0.3";
            scene.bodies = deformable("block", box({0.002, 0.001, 0.0105}, {0.04, 0.03, 0.02}, 4),
                                      {.kpa = 30.0, .mass_damping = 20.0, .mesher = mesher}) +
                           ", " + table(8);
            const PreparedScene prepared = prepare_solids_of(scene);
            ASSERT_EQ(prepared.model.bodies.size(), 2u);
            Simulator simulator(prepared.model);
            const double weight = 9.81 * prepared.model.bodies[0].tissue->mass;
            double sum = 0.0, squares = 0.0;
            int count = 0;
            for (int k = 0; k < static_cast<int>(1.2 / step); ++k) {
                ASSERT_TRUE(simulator.step().finite);
                if (simulator.report().time_s < 1.0) continue;
                const double force = simulator.report().solid_force_n;
                sum += force, squares += force * force, ++count;
                double of_contacts = 0.0;
                for (const Contact& contact : simulator.contacts())
                    of_contacts += (contact.a == Thing::body(0) ? 1.0 : -1.0) * contact.force.z();
                ASSERT_NEAR(of_contacts, force, 1e-9 * weight) << "what contacts() says";
            }
            const double mean = sum / count;
            EXPECT_NEAR(mean, weight, 0.01 * weight);
            EXPECT_LT(std::sqrt(std::max(0.0, squares / count - mean * mean)), 0.02 * weight);
        }
}

/// A stiff block on a table that is inclined by gravity. returns  m along the slope after `seconds`
double slide(double tangent, double friction, double step, double seconds, double& at_half) {
    SolidScene scene;
    scene.step = step;
    const double normal = 9.81 / std::hypot(1.0, tangent);
    scene.gravity = {tangent * normal, 0, -normal};
    scene.contact = fmt::format("\"solid_friction\": {}", friction);
    scene.bodies = deformable("block", box({-0.08, 0, 0.0051}, {0.03, 0.03, 0.01}, 3), {.kpa = 200.0, .viscosity = 0.02}) + ", " + table(8);
    const PreparedScene prepared = prepare_solids_of(scene);
    Simulator simulator(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    double start = 0.0;
    const int steps = static_cast<int>(seconds / step);
    for (int k = 0; k < steps; ++k) {
        EXPECT_TRUE(simulator.step().finite);
        const double x = mass_centre(tissue, simulator.state().bodies[0].tissue).x();
        if (k + 1 == steps / 4) start = x;
        if (k + 1 == steps / 2) at_half = x - start;
    }
    return mass_centre(tissue, simulator.state().bodies[0].tissue).x() - start;
}

TEST(SolidLaws, WhatBeginsOnASurfaceDoesNotSinkIntoItInTheFirstStep) {
    for (const double step : {0.0002, 0.002, 0.01})
        for (const auto& [budget, mesher, cells] : {std::tuple{"exact", "lattice", 2}, {"work:1000", "lattice", 2}, {"exact", "lattice", 5}, {"exact", "tetgen", 3}}) {
            Flesh flesh;
            flesh.mesher = mesher;
            SolidScene scene;
            scene.bodies = deformable("block", box({0, 0, 0.015}, {0.03, 0.03, 0.03}, cells), flesh) + "," + table(4);
            scene.budget = budget;
            scene.step = step;
            scene.gravity = Vec3(0, 0, -9.81);
            const PreparedScene prepared = prepare_solids_of(scene);
            Simulator simulator(prepared.model);
            ASSERT_TRUE(simulator.step().finite);
            double lowest = INFINITY;
            for (const Vec3& x : simulator.state().bodies[0].surface) lowest = std::min(lowest, x.z());
            EXPECT_GT(lowest, -2e-5 - 0.2 * 9.81 * step * step) << step << " " << budget << " " << mesher << " " << cells << ": freely it falls by " << 9.81 * step * step << " m";
        }
}

TEST(SolidLaws, OnASlopeFrictionHoldsBelowItsAngleAndAboveItTheBlockSlidesAsCoulombSays) {
    for (const double step : {1e-3, 5e-3, 1e-2}) {
        SCOPED_TRACE(fmt::format("step {:g} s", step));
        double half = 0.0;
        EXPECT_LT(std::abs(slide(0.3, 0.35, step, 1.0, half)), 2e-5) << "it stays";
        const double seconds = 0.4, tangent = 0.5, friction = 0.2;
        const double far = slide(tangent, friction, step, seconds, half);
        // from two differences of x = x0 + v t + a t^2 / 2 at 1/4, 1/2 and 1 of the time: a, whatever the landing left of v
        const double t1 = 0.25 * seconds, t2 = 0.75 * seconds;
        const double measured = 2.0 * (far / t2 - half / t1) / (t2 - t1);
        const double expected = 9.81 * (tangent - friction) / std::hypot(1.0, tangent);
        EXPECT_NEAR(measured, expected, 0.02 * expected);
    }
}

TEST(SolidLaws, WhatFrictionHoldsDoesNotCreepInAMinute) {
    SolidScene scene;
    scene.step = 1e-2;
    scene.gravity = {2.5, 0, -9.5};
    scene.contact = "\"solid_friction\": 0.4";
    scene.bodies = deformable("block", box({0, 0, 0.0101}, {0.03, 0.03, 0.02}, 3), {.kpa = 30.0, .viscosity = 0.01, .mass_damping = 5.0}) +
                   ", " + table(8);
    const PreparedScene prepared = prepare_solids_of(scene);
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    Vec3 settled = Vec3::Zero();
    for (int k = 0; k < 6100; ++k) {
        ASSERT_TRUE(simulator.step().finite);
        if (k == 100) settled = mass_centre(tissue, simulator.state().bodies[0].tissue);
    }
    EXPECT_LT((mass_centre(tissue, simulator.state().bodies[0].tissue) - settled).norm(), 3e-4) << "1 % of its 30 mm, in 60 s: what the solver's tolerance leaves";
}

TEST(SolidLaws, TenBlocksStandOnOneAnother) {
    for (const double step : {2e-3, 1e-2}) {
        SCOPED_TRACE(fmt::format("step {:g} s", step));
        SolidScene scene;
        scene.step = step;
        scene.gravity = {0, 0, -9.81};
        scene.contact = "\"solid_friction\": 0.5";
        for (int k = 0; k < 10; ++k)
            scene.bodies += deformable(fmt::format("block{}", k), box({0, 0, 0.0051 + 0.0101 * k}, {0.03, 0.03, 0.01}, 3),
                                       {.kpa = 150.0, .viscosity = 0.02, .mass_damping = 20.0, .triangles = 100}) +
                            ", ";
        scene.bodies += table(4);
        const PreparedScene prepared = prepare_solids_of(scene);
        ASSERT_EQ(prepared.model.bodies.size(), 11u);
        Simulator simulator(prepared.model);
        double weight = 0.0;
        for (std::size_t i = 0; i < 10; ++i) weight += 9.81 * prepared.model.bodies[i].tissue->mass;
        for (int k = 0; k < static_cast<int>(1.0 / step); ++k) ASSERT_TRUE(simulator.step().finite) << simulator.report().failure;
        const Vec3 top = mass_centre(*prepared.model.bodies[9].tissue, simulator.state().bodies[9].tissue);
        EXPECT_GT(top.z(), 0.085);
        EXPECT_LT(std::hypot(top.x(), top.y()), 3e-3) << "of blocks of 30 mm that fell on one another";
        double on_table = 0.0;
        for (const Contact& contact : simulator.contacts())
            if (contact.a == Thing::body(10) || contact.b == Thing::body(10)) on_table += std::abs(contact.force.z());
        EXPECT_NEAR(on_table, weight, 0.02 * weight);
    }
}

} // namespace
} // namespace trocar::engine
