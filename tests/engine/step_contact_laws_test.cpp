// What must hold for every contact, whatever the shapes, orientations, steps and budgets: what touches nothing moves as without contact,
// a free system keeps its momentum and angular momentum, and a scene that flies as a whole goes on as one at rest.
#include "engine/io/write_mesh.hpp"
#include "step_fixture.hpp"

#include <Eigen/Geometry>

namespace trocar::engine {
namespace {

constexpr unsigned kLawSeed = 20261;

/// Two parallel arms, joined by half a circle, in m.
struct UTube {
    double radius = 5e-3, half_gap = 0.6e-3, arm = 40e-3;
    std::size_t sides = 16;
};

TriMesh make_u_tube(const UTube& u, const Mat3& turn) {
    const double axis = u.radius + u.half_gap;
    std::vector<Vec3> points;
    const int along = static_cast<int>(u.arm / 3e-3), around = 14;
    for (int k = 0; k < along; ++k) points.emplace_back(-axis, 0.0, u.arm - u.arm * k / along);
    for (int k = 0; k <= around; ++k) {
        const double a = 3.14159265358979 * (1.0 + static_cast<double>(k) / around);
        points.emplace_back(axis * std::cos(a), 0.0, axis * std::sin(a));
    }
    for (int k = 1; k <= along; ++k) points.emplace_back(axis, 0.0, u.arm * k / along);
    TriMesh mesh;
    const auto n = static_cast<Index>(u.sides), rings = static_cast<Index>(points.size());
    for (std::size_t k = 0; k < points.size(); ++k) {
        const Vec3 tangent = (points[std::min(k + 1, points.size() - 1)] - points[k > 0 ? k - 1 : 0]).normalized();
        const Vec3 side = tangent.cross(Vec3::UnitY());
        for (std::size_t s = 0; s < u.sides; ++s) {
            const double a = 2.0 * 3.14159265358979 * static_cast<double>(s) / static_cast<double>(u.sides);
            mesh.vertices.push_back(turn * (points[k] + u.radius * (std::cos(a) * side + std::sin(a) * Vec3::UnitY())));
        }
    }
    for (Index k = 0; k + 1 < rings; ++k)
        for (Index s = 0; s < n; ++s) {
            const Index a = k * n + s, b = k * n + (s + 1) % n;
            mesh.triangles.push_back({a, b, b + n});
            mesh.triangles.push_back({a, b + n, a + n});
        }
    const auto first = static_cast<Index>(mesh.vertices.size()), last = first + 1;
    mesh.vertices.push_back(turn * points.front());
    mesh.vertices.push_back(turn * points.back());
    for (Index s = 0; s < n; ++s) {
        mesh.triangles.push_back({first, (s + 1) % n, s});
        mesh.triangles.push_back({last, (rings - 1) * n + s, (rings - 1) * n + (s + 1) % n});
    }
    double volume = 0.0;
    for (const Triangle& t : mesh.triangles) volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
    if (volume < 0.0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

std::string write_mesh(const std::string& name, const TriMesh& mesh) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / name;
    EXPECT_TRUE(write_obj(file, mesh).ok());
    return file.string();
}

struct FreeScene {
    std::string bodies; // members of "bodies"
    double step = 0.005;
    Vec3 gravity = Vec3::Zero();
    std::string effects, contact, budget = "exact", substeps = "\"auto\"";
};

std::string text_of(const FreeScene& s) {
    return fmt::format(
        R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 10, "substeps": {}}}, "budget": "{}",
        "gravity": [{}, {}, {}], "bodies": {{{}}}, "contact": {{{}}}, "effects": ["elasticity", "gravity"{}]}})",
        s.step, s.substeps, s.budget, s.gravity.x(), s.gravity.y(), s.gravity.z(), s.bodies, s.contact, s.effects);
}

std::string deformable(const std::string& name, const std::string& surface, double kpa, const std::string& mesher = "lattice",
                       int triangles = 300) {
    return fmt::format(R"("{}": {{"kind": "deformable", "surface": {}, "material": {{"young_modulus": {}, "poisson_ratio": 0.4,
        "density": 1000}}, "coarse": {{"mesher": "{}", "surface_triangles": {}}}}})",
                       name, surface, kpa, mesher, triangles);
}

constexpr const char* kAllContact = R"(, "coarse_contact", "self_contact", "friction")";

void expect_same_bits(const State& a, const State& b, std::uint64_t step) {
    for (std::size_t i = 0; i < a.bodies.size(); ++i)
        for (std::size_t n = 0; n < a.bodies[i].tissue.position.size(); ++n) {
            ASSERT_EQ(a.bodies[i].tissue.position[n], b.bodies[i].tissue.position[n]) << "body " << i << " node " << n << " step " << step;
            ASSERT_EQ(a.bodies[i].tissue.velocity[n], b.bodies[i].tissue.velocity[n]) << "body " << i << " node " << n << " step " << step;
        }
}

/// Runs the scene with and without everything that contact is, while nothing touches.
void expect_as_without_contact(FreeScene scene, int steps) {
    scene.effects = "";
    const PreparedScene without = test::prepare(text_of(scene));
    scene.effects = kAllContact;
    const PreparedScene with = test::prepare(text_of(scene));
    ASSERT_FALSE(with.model.bodies.empty());
    Simulator free(without.model), touching(with.model);
    for (int k = 0; k < steps; ++k) {
        ASSERT_TRUE(free.step().finite);
        const StepReport& report = touching.step();
        ASSERT_TRUE(report.finite) << report.failure;
        EXPECT_EQ(report.substeps, free.report().substeps);
        ASSERT_EQ(report.solid_touches, 0u) << "step " << k;
        ASSERT_NO_FATAL_FAILURE(expect_same_bits(free.state(), touching.state(), report.step));
    }
}

TEST(ContactLaws, AFallingTubeThatComesNearItselfMovesAsWithoutContactToTheBit) {
    test::Random random(kLawSeed);
    for (int k = 0; k < 6; ++k) {
        const UTube u{.half_gap = random.between(0.2e-3, 6e-3)};
        const double step = std::pow(10.0, random.between(-3.3, -2.0));
        SCOPED_TRACE(fmt::format("seed {} case {}: gap {:g} m, step {:g} s", kLawSeed, k, 2.0 * u.half_gap, step));
        const std::string file = write_mesh(fmt::format("u_tube_{}.obj", k), make_u_tube(u, random.turn()));
        const std::string budget = k % 3 == 2 ? "work:1000" : "exact";
        expect_as_without_contact(
            {.bodies = deformable("u", fmt::format("\"{}\"", file), random.between(3.0, 30.0), k % 2 ? "lattice" : "tetgen"),
             .step = step,
             .gravity = 9.81 * random.direction(),
             .budget = budget},
            25);
    }
}

TEST(ContactLaws, BodiesThatFallTogetherMoveAsWithoutContactToTheBit) {
    test::Random random(kLawSeed);
    for (int k = 0; k < 6; ++k) {
        const double gap = std::pow(10.0, random.between(-5.0, -2.5)), step = std::pow(10.0, random.between(-3.3, -2.0));
        SCOPED_TRACE(fmt::format("seed {} case {}: gap {:g} m, step {:g} s", kLawSeed, k, gap, step));
        const Vec3 apart = (40e-3 + gap) * random.direction();
        const auto ball = [&](const Vec3& c) {
            return fmt::format(R"({{"shape": "sphere", "centre": [{}, {}, {}], "radius": 0.02, "subdivisions": 3}})", c.x(), c.y(), c.z());
        };
        const std::string table = R"("table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -2],
            "extent": [3, 3, 0.01], "cells": 2}})";
        expect_as_without_contact({.bodies = deformable("first", ball(Vec3::Zero()), 10.0) + ", " +
                                             deformable("second", ball(apart), random.between(3.0, 30.0)) + (k % 2 ? ", " + table : ""),
                                   .step = step,
                                   .gravity = 9.81 * random.direction()},
                                  25);
    }
}

TEST(ContactLaws, AnInstrumentThatTouchesNothingMovesAsWithoutContactToTheBit) {
    test::Random random(kLawSeed);
    for (int k = 0; k < 3; ++k) {
        const double step = std::pow(10.0, random.between(-3.0, -2.0)), tip = random.between(0.0, 1.2);
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s, tip {:g} rad", kLawSeed, k, step, tip));
        const auto scene = [&](const std::string& effects) {
            return test::prepare(fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 1}},
                "budget": "{}", "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube",
                "axis": [[0, 0, 0, 30], [0, 0, 200, 30]], "sides": 24}}}}}},
                "instruments": {{"wire": {{"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5,
                "tip": {{"shape": "J", "length": 12, "angle": {}}}, "lumen": "tube",
                "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "path": [[0, 20, 0], [1, 50, 1]]}}}}, "effects": [{}]}})",
                                             step, k == 1 ? "work:2000" : "exact", tip, effects));
        };
        const PreparedScene without = scene(R"("twist")"), with = scene(R"("twist", "coarse_contact", "exact_contact", "friction")");
        ASSERT_EQ(with.model.instruments.size(), 1u);
        Simulator free(without.model), touching(with.model);
        for (int n = 0; n < 60; ++n) {
            ASSERT_TRUE(free.step().finite && touching.step().finite);
            const fem::RodState &a = free.state().instruments[0].rod, &b = touching.state().instruments[0].rod;
            ASSERT_EQ(a.position, b.position) << "step " << n;
            ASSERT_EQ(a.velocity, b.velocity) << "step " << n;
            ASSERT_EQ(a.angle, b.angle) << "step " << n;
        }
    }
}

TEST(ContactLaws, ABallMovesAsWithoutContactUntilItTouchesTheTable) {
    test::Random random(kLawSeed);
    for (int k = 0; k < 3; ++k) {
        FreeScene scene;
        scene.step = std::pow(10.0, random.between(-3.0, -2.0));
        scene.gravity = Vec3(0.0, 0.0, -9.81);
        const double height = random.between(2e-3, 20e-3);
        SCOPED_TRACE(fmt::format("seed {} case {}: height {:g} m, step {:g} s", kLawSeed, k, height, scene.step));
        scene.bodies =
            deformable("ball",
                       fmt::format(R"({{"shape": "sphere", "centre": [0, 0, {}], "radius": 0.02, "subdivisions": 3}})", 0.02 + height),
                       10.0) +
            R"(, "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -0.01], "extent": [0.2, 0.2, 0.02],
                           "cells": 4}})";
        const int until = static_cast<int>(std::sqrt(2.0 * height / 9.81) / scene.step) - 1; // the last step that ends above
        expect_as_without_contact(scene, until);
    }
}

TEST(ContactLaws, ContactCostsNoSubstepsAndARefusalNamesWhatHelps) {
    FreeScene scene;
    scene.gravity = Vec3(0.0, 0.0, -9.81);
    scene.effects = kAllContact;
    scene.bodies =
        deformable("ball", R"({"shape": "sphere", "centre": [0, 0, 0.021], "radius": 0.02, "subdivisions": 3})", 10.0, "tetgen") +
        R"(, "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -0.01], "extent": [0.2, 0.2, 0.02],
                       "cells": 4}})";
    PreparedScene prepared = test::prepare(text_of(scene));
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    const unsigned alone = simulator.step().substeps;
    unsigned most = 0;
    std::uint64_t touches = 0;
    for (int k = 0; k < 40; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        most = std::max(most, report.substeps);
        touches += report.solid_touches;
    }
    EXPECT_GT(touches, 0u);
    EXPECT_LE(most, 4 * alone) << "of one evaluation in place of four, and what the flesh itself stiffens";
    prepared.model.max_substeps = 1;
    Simulator soft(prepared.model);
    EXPECT_FALSE(soft.step().finite);
    for (const char* part : {"ball: the stable step is", "sub-steps of the step of 0.005 s", "tetrahedron", "volume", "coarse.mesher"})
        EXPECT_NE(soft.report().failure.find(part), std::string::npos) << part << " in " << soft.report().failure;
}

struct Sums {
    Vec3 linear = Vec3::Zero(), angular = Vec3::Zero();
    double mass_speed = 0.0, arm_speed = 0.0; // of what each part of them is compared with
};

Sums find_sums(const SceneModel& model, const State& state) {
    Sums sums;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].tissue) continue;
        const fem::TissueModel& tissue = *model.bodies[i].tissue;
        for (std::size_t n = 0; n < tissue.node_count(); ++n) {
            const Vec3& x = state.bodies[i].tissue.position[n];
            const Vec3 p = tissue.node_mass[n] * state.bodies[i].tissue.velocity[n];
            sums.linear += p;
            sums.angular += x.cross(p);
            sums.mass_speed += p.norm();
            sums.arm_speed += x.norm() * p.norm();
        }
    }
    return sums;
}

/// Throws the arms of a U tube together, and turns it as a whole.
State throw_arms(const SceneModel& model, const State& rest, const Mat3& turn, double speed, const Vec3& spin) {
    State state = rest;
    for (std::size_t n = 0; n < rest.bodies[0].tissue.position.size(); ++n) {
        const Vec3 own = turn.transpose() * rest.bodies[0].tissue.position[n];
        const double share = std::max(0.0, own.z()) / 40e-3;
        const Vec3 to_middle = turn * Vec3(own.x() < 0.0 ? speed * share : -speed * share, 0.0, 0.0);
        state.bodies[0].tissue.velocity[n] = to_middle + spin.cross(rest.bodies[0].tissue.position[n]);
    }
    (void)model;
    return state;
}

TEST(ContactLaws, AFreeBodyThatMeetsItselfKeepsMomentumAndAngularMomentum) {
    test::Random random(kLawSeed);
    for (int k = 0; k < 5; ++k) {
        const Mat3 turn = random.turn();
        const UTube u{.half_gap = random.between(0.3e-3, 1e-3)};
        FreeScene scene;
        scene.step = std::pow(10.0, random.between(-3.3, -2.3));
        scene.effects = kAllContact;
        scene.contact = fmt::format("\"solid_friction\": {}", k % 2 ? 0.4 : 0.0);
        scene.budget = k == 3 ? "work:1000" : "exact";
        scene.substeps = "100";
        const std::string file = write_mesh(fmt::format("thrown_{}.obj", k), make_u_tube(u, turn));
        scene.bodies = deformable("u", fmt::format("\"{}\"", file), random.between(5.0, 20.0), "tetgen"); // a lattice would join the arms
        SCOPED_TRACE(fmt::format("seed {} case {}: gap {:g} m, step {:g} s", kLawSeed, k, 2.0 * u.half_gap, scene.step));
        const PreparedScene prepared = test::prepare(text_of(scene));
        ASSERT_EQ(prepared.model.bodies.size(), 1u);
        Simulator start(prepared.model), simulator(prepared.model);
        const State thrown = throw_arms(prepared.model, start.state(), turn, random.between(0.1, 0.4), 3.0 * random.direction());
        ASSERT_TRUE(simulator.restore(thrown).ok());
        const Sums before = find_sums(prepared.model, thrown);
        std::uint64_t touches = 0, left = 0;
        double smallest = 1.0;
        for (int step = 0; step < static_cast<int>(0.06 / scene.step); ++step) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            touches += report.solid_touches;
            left += report.left_pairs;
            smallest = std::min(smallest, report.min_volume_ratio);
        }
        const Sums after = find_sums(prepared.model, simulator.state());
        EXPECT_TRUE(touches > 0 || left > 0);
        if (scene.budget == "exact") EXPECT_GT(touches, 0u);
        EXPECT_GT(smallest, 0.3) << "it is not crushed";
        EXPECT_LT((after.linear - before.linear).norm(), 1e-9 * before.mass_speed);
        // Runge-Kutta 4 alone keeps the angular momentum of a turning body to the fourth power of its sub-steps.
        EXPECT_LT((after.angular - before.angular).norm(), 1e-8 * before.arm_speed);
    }
}

TEST(ContactLaws, TwoBodiesThatFlyAlongMeetAsTwoAtRest) {
    test::Random random(kLawSeed);
    for (int k = 0; k < 4; ++k) {
        FreeScene scene;
        scene.step = std::pow(10.0, random.between(-3.3, -2.3));
        scene.effects = kAllContact;
        const Vec3 towards = random.direction();
        const Vec3 to = 41e-3 * towards;
        const auto ball = [&](const Vec3& c) {
            return fmt::format(R"({{"shape": "sphere", "centre": [{}, {}, {}], "radius": 0.02, "subdivisions": 3}})", c.x(), c.y(), c.z());
        };
        scene.bodies = deformable("first", ball(Vec3::Zero()), 10.0) + ", " + deformable("second", ball(to), 10.0);
        SCOPED_TRACE(fmt::format("seed {} case {}: step {:g} s", kLawSeed, k, scene.step));
        const PreparedScene prepared = test::prepare(text_of(scene));
        ASSERT_EQ(prepared.model.bodies.size(), 2u);
        const double speed = random.between(0.1, 0.4);
        const Vec3 frame = 10.0 * random.direction();
        State end[2];
        std::uint64_t touches[2] = {};
        double force[2] = {};
        const int steps = static_cast<int>(0.05 / scene.step);
        for (int moving = 0; moving < 2; ++moving) {
            Simulator start(prepared.model), simulator(prepared.model);
            State thrown = start.state();
            for (Vec3& v : thrown.bodies[0].tissue.velocity) v = speed * towards;
            if (moving == 1)
                for (BodyState& body : thrown.bodies)
                    for (Vec3& v : body.tissue.velocity) v += frame;
            ASSERT_TRUE(simulator.restore(thrown).ok());
            for (int step = 0; step < steps; ++step) {
                const StepReport& report = simulator.step();
                ASSERT_TRUE(report.finite) << report.failure;
                touches[moving] += report.solid_touches;
                force[moving] = std::max(force[moving], report.solid_force_n);
            }
            end[moving] = simulator.state();
        }
        EXPECT_GT(touches[0], 0u);
        EXPECT_EQ(touches[0], touches[1]);
        EXPECT_NEAR(force[1], force[0], 1e-6 * force[0] + 1e-12);
        const Vec3 carried = steps * scene.step * frame;
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t n = 0; n < end[0].bodies[i].tissue.position.size(); ++n) {
                ASSERT_LT((end[1].bodies[i].tissue.position[n] - carried - end[0].bodies[i].tissue.position[n]).norm(), 1e-6 * 0.02);
                ASSERT_LT((end[1].bodies[i].tissue.velocity[n] - frame - end[0].bodies[i].tissue.velocity[n]).norm(), 1e-6 * speed);
            }
    }
}

} // namespace
} // namespace trocar::engine
