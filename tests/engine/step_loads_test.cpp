// What a scene pulls its bodies with, what it moves them by, and how they start.
#include "engine/io/write_mesh.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/report/statistics.hpp"
#include "engine/scene/presets.hpp"
#include "engine/step/checkpoint.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/integrate.hpp"
#include "step_fixture.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace trocar::engine {
namespace {

/// A cube of 20 mm; more: further keys of the body.
std::string cube_scene(const std::string& more, const std::string& effects = R"("elasticity", "damping", "loads")", double nu = 0.3) {
    return fmt::format(R"({{
    "units": {{"length": "mm", "pressure": "kPa", "angle": "deg"}},
    "time": {{"step": 0.005, "duration": 2}},
    "budget": "exact",
    "bodies": {{"cube": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0, 0, 0], "extent": [20, 20, 20], "cells": 4}},
        "material": {{"young_modulus": 10, "poisson_ratio": {}, "density": 1000, "viscosity": 0.01, "mass_damping": 40}},
        "coarse": {{"mesher": "lattice", "surface_triangles": 200}}, {}}}}},
    "effects": [{}]
}})",
                       nu, more, effects);
}

constexpr const char* kThrown = R"("velocity": [1, 0, 0])";
constexpr const char* kHeldBelow = R"("fixed": [{"direction": [0, 0, -1], "fraction": 0.1}])";

Simulator run(const PreparedScene& prepared, int steps) {
    Simulator simulator(prepared.model);
    for (int k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        if (!report.finite) throw std::runtime_error(report.failure);
    }
    return simulator;
}

const std::vector<Vec3>& nodes_of(Simulator& simulator) { return simulator.state().bodies[0].tissue.position; }

Vec3 mean_shift(const PreparedScene& prepared, Simulator& simulator) {
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    Vec3 sum = Vec3::Zero();
    for (std::size_t n = 0; n < tissue.node_count(); ++n)
        sum += tissue.node_mass[n] / tissue.mass * (nodes_of(simulator)[n] - tissue.rest_position[n]);
    return sum;
}

/// Of the effect, in one step.
std::uint64_t count_of(const StepReport& report, const char* name) { return report.effects.of(*find_effect(name)); }

} // namespace

/// A rod of 0.5 mm, 1 GPa, 50 mm of it in a tube that it nowhere reaches; more: further keys of the rod.
static std::string rod_scene(const std::string& more, const std::string& effects = R"("coarse_contact", "exact_contact", "loads")") {
    return fmt::format(R"({{
    "units": {{"length": "mm", "pressure": "MPa"}}, "time": {{"step": 0.005, "duration": 2}}, "budget": "exact",
    "bodies": {{"tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "sides": 16,
        "axis": [[0, 0, -5, 20], [0, 0, 30, 20], [0, 0, 60, 20], [0, 0, 90, 20]]}}}}}},
    "instruments": {{"rod": {{"length": 120, "radius": 0.5, "young_modulus": 1000, "density": 1100, "segment": 2.5, "skin_triangles": 2000, "drag": 100, "stiffness": [[0, 1]],
        "tip": {{"shape": "straight"}}, "inserted": 50, "friction": 0, "lumen": "tube", "entry": {{"position": [0, 0, 0], "direction": [0, 0, 1]}},
        "path": [[0, 50, 0], [10, 50, 0]]{}}}}},
    "effects": [{}]
}})",
                       more, effects);
}

TEST(Loads, AForceOnATipBendsItsRodAsACantileverForAsLongAsItActs) {
    const PreparedScene prepared = test::prepare(rod_scene(R"(, "tip_load": {"force": [0, 0.001, 0], "over": [[0, 1], [1, 1], [1.01, 0]]})"));
    Simulator simulator = run(prepared, 200);
    const double stiffness = 1e9 * 3.14159265 * std::pow(0.5e-3, 4) / 4.0;
    const double bent = 0.001 * std::pow(0.05, 3) / (3.0 * stiffness);
    EXPECT_NEAR(simulator.report().tip.y(), bent, 0.02 * bent);
    EXPECT_NEAR(simulator.report().tip.x(), 0.0, 1e-3 * bent);
    EXPECT_EQ(count_of(simulator.report(), "loads"), 1u);
    for (int k = 0; k < 200; ++k) simulator.step();
    EXPECT_NEAR(simulator.report().tip.y(), 0.0, 0.01 * bent);
}

TEST(Loads, AForceOnATipGivesAFreeRodItsIntegralOverTimeWhateverTheStep) {
    test::Random random(34);
    double worst = 0.0;
    for (const double step : {0.001, 0.004, 0.0073})
        for (int trial = 0; trial < 5; ++trial) {
            double given = 0.0, most = 0.0, last = random.between(-1.0, 1.0), time = 0.0; // s, of the rows' integral; at most
            std::string rows = fmt::format("[0, {}]", last);
            for (int k = 1; k < 12; ++k) {
                const double value = random.between(-1.0, 1.0), length = k % 3 == 0 ? 1e-6 : random.between(0.1, 2.5) * 0.004; // jumps, too
                given += 0.5 * length * (last + value), most += 0.5 * length * (std::abs(last) + std::abs(value));
                time += length, last = value;
                rows += fmt::format(", [{}, {}]", time, value);
            }
            rows += fmt::format(", [{}, 0]", time + 0.001);
            given += 0.0005 * last, most += 0.0005 * std::abs(last);
            std::string text = rod_scene(fmt::format(R"(, "detachable": true, "tip_load": {{"force": [0, 0, 4e-5], "over": [{}]}})", rows));
            const auto replace = [&](std::string_view old, std::string_view now) { text.replace(text.find(old), old.size(), now); };
            replace(R"("step": 0.005)", fmt::format(R"("step": {})", step));
            replace(R"("length": 120)", R"("length": 50)");
            replace(R"("drag": 100)", R"("drag": 0)");
            const PreparedScene prepared = test::prepare(text);
            Simulator simulator = run(prepared, static_cast<int>(time / step + 2.0));
            double momentum = 0.0; // kg m/s
            for (std::size_t i = 0; i < prepared.model.instruments[0].rod.node_count(); ++i)
                momentum += prepared.model.instruments[0].rod.mass[i] * simulator.state().instruments[0].rod.velocity[i].z();
            worst = std::max(worst, std::abs(momentum - 4e-5 * given) / (4e-5 * most));
        }
    std::printf("margin: momentum less the rows' integral, of the integral of their size, at most %.2g\n", worst);
    EXPECT_LT(worst, 1e-8);
}

TEST(Loads, AForceOnATipWithoutTheEffectIsNone) {
    const PreparedScene prepared =
        test::prepare(rod_scene(R"(, "tip_load": {"force": [0, 0.001, 0]})", R"("coarse_contact", "exact_contact")"));
    Simulator simulator = run(prepared, 20);
    EXPECT_NEAR(simulator.report().tip.y(), 0.0, 1e-9);
    EXPECT_EQ(count_of(simulator.report(), "loads"), 0u);
}

constexpr const char* kTwistingEffects = R"("coarse_contact", "exact_contact", "loads", "twist")";
constexpr double kRodStiffness = 1e9 * 3.14159265358979 * 0.25e-3 * 0.25e-9 * 0.25; // E I, N m^2: radius 0.5 mm

TEST(Loads, ATorqueOnATipTwistsItsRodAndTheHandleHoldsAgainstIt) {
    const PreparedScene prepared = test::prepare(rod_scene(R"(, "tip_load": {"torque": 0.5, "over": [[0, 0], [0.2, 1]]})", kTwistingEffects));
    Simulator simulator = run(prepared, 300);
    EXPECT_NEAR(simulator.report().handle_torque_nm, -0.0005, 1e-7); // 0.5 N mm
    const double turn = 0.0005 * 0.05 * 1.4 / kRodStiffness;
    EXPECT_NEAR(simulator.state().instruments[0].rod.angle.back(), turn, 0.01 * turn);
    EXPECT_EQ(count_of(simulator.report(), "loads"), 1u);
}

TEST(TipClamp, HoldsMovesAndTurnsATipAsItsRowsSay) {
    const PreparedScene prepared =
        test::prepare(rod_scene(R"(, "tip_clamp": {"moves": [[0, 0, 0, 0], [0.5, 2, 0, -1]], "turns": [[0, 0], [0.5, 0.3]],
                                   "turn_point": [0, 0, 50], "turn_axis": [0, 1, 0], "rotation": [[0, 0], [0.5, 0.4]]})",
                                kTwistingEffects));
    Simulator simulator = run(prepared, 160);
    const fem::RodState& rod = simulator.state().instruments[0].rod;
    EXPECT_LT((simulator.report().tip - Vec3(0.002, 0, 0.049)).norm(), 1e-12);
    const Vec3 along = (rod.position.back() - rod.position[rod.position.size() - 2]).normalized();
    EXPECT_LT((along - Vec3(std::sin(0.3), 0, std::cos(0.3))).norm(), 1e-9);
    EXPECT_NEAR(simulator.report().handle_torque_nm, -0.4 * kRodStiffness / 1.4 / 0.04875, 0.1 * 0.4 * kRodStiffness / 1.4 / 0.04875);
    EXPECT_LT(simulator.report().balance_n, 1e-3);
}

TEST(TipClamp, ARodThatIsDrawnBackFromItSaysByHowMuchItIsStretched) {
    std::string scene = rod_scene(R"(, "tip_clamp": {})");
    scene.replace(scene.find("[[0, 50, 0], [10, 50, 0]]"), 25, "[[0, 50, 0], [2, 1, 0]]");
    const PreparedScene prepared = test::prepare(scene);
    Simulator simulator = run(prepared, 10);
    EXPECT_GT(simulator.report().rod_stretch, 0.005);
    EXPECT_LT(simulator.report().rod_stretch, 0.1);
    for (int k = 0; k < 190; ++k) (void)simulator.step();
    EXPECT_GT(simulator.report().rod_stretch, 0.9);
    RunStatistics statistics;
    statistics.add(simulator.report(), 1e9, 0);
    EXPECT_EQ(statistics.stretched_steps, 1u);
}

TEST(TipClamp, LetsATipThatSlidesComeNearerAndSavesAndForksToTheSameBits) {
    const PreparedScene prepared = test::prepare(
        rod_scene(R"(, "tip_clamp": {"slides": true, "spins": true}, "tip_load": {"force": [0, 0, 0.2], "torque": 0.1})", kTwistingEffects));
    Simulator one = run(prepared, 50), other(prepared.model);
    ASSERT_TRUE(other.restore(*one.save()).ok());
    for (int k = 0; k < 50; ++k) (void)one.step(), (void)other.step();
    EXPECT_EQ(hash_state(one.state()), hash_state(other.state()));
    EXPECT_NEAR(one.report().tip.x(), 0.0, 1e-9);
    EXPECT_NEAR(one.report().handle_force_n, -0.2, 1e-3);
}

TEST(TipClamp, IsRefusedWhereItCannotHold) {
    const auto refusal = [](const std::string& more, const std::string& effects) {
        const auto scene = parse_scene(rod_scene(more, effects), "scenes/test.json");
        if (!scene.ok()) return scene.error().to_string();
        const auto prepared = make_prepared_scene(*scene);
        return prepared.ok() ? std::string() : prepared.error().to_string();
    };
    const std::string plain = R"("coarse_contact", "exact_contact", "loads")";
    EXPECT_NE(refusal(R"(, "tip_clamp": {"rotation": [[0, 0], [1, 1]]})", plain).find("twist"), std::string::npos);
    EXPECT_NE(refusal(R"(, "tip_load": {"torque": 1})", plain).find("twist"), std::string::npos);
    EXPECT_NE(refusal(R"(, "tip_load": {"over": [[0, 1]]})", plain).find("neither force nor torque"), std::string::npos);
    EXPECT_NE(refusal(R"(, "tip_clamp": {"turn_axis": [0, 0, 1]})", plain).find("nothing turns"), std::string::npos);
    EXPECT_NE(refusal(R"(, "tip_clamp": {"spins": true, "rotation": [[0, 0], [1, 1]]})", kTwistingEffects).find("beside spins"), std::string::npos);
    EXPECT_NE(refusal(R"(, "tip_clamp": {}, "kind": "mass_spring")", plain).find("tip_clamp"), std::string::npos);
    EXPECT_EQ(refusal(R"(, "tip_clamp": {})", plain), "");
}

TEST(NodeSets, APlaneANearSurfaceAndAListNameTheNodesThatAnyOtherMeansNames) {
    const auto pinned_by = [](const std::string& region) {
        return test::prepare(cube_scene(fmt::format(R"("fixed": [{}])", region))).model.bodies[0].tissue->pinned;
    };
    const std::vector<Index> box = pinned_by(R"({"box": [[-100, -100, -100], [100, 100, -6]]})");
    ASSERT_FALSE(box.empty());
    EXPECT_EQ(pinned_by(R"({"plane": {"point": [3, 3, -6], "normal": [0, 0, -4]}})"), box);
    EXPECT_EQ(pinned_by(R"({"plane": {"point": [0, 0, -56], "normal": [0, 0, 1], "within": 50}})"), box);
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "nodes.txt";
    std::ofstream out(file);
    out << "# the lower nodes\n";
    for (const Index node : box) out << node << (node % 2 == 0 ? "\n" : " ");
    out.close();
    EXPECT_EQ(pinned_by(fmt::format(R"({{"nodes": "{}"}})", file.string())), box);
    const PreparedScene near = test::prepare(cube_scene(R"("fixed": [{"near": {"surface": "cube", "distance": 1}}])"));
    const fem::TissueModel& tissue = *near.model.bodies[0].tissue;
    ASSERT_FALSE(tissue.pinned.empty());
    std::vector<Index> expected;
    for (Index node = 0; node < tissue.node_count(); ++node) { // by the box's own formula
        const Vec3 out_of = (tissue.rest_position[node].cwiseAbs() - Vec3::Constant(0.01)).cwiseMax(0.0);
        const double inside = 0.01 - tissue.rest_position[node].cwiseAbs().maxCoeff();
        if (inside >= 0.0 ? inside <= 0.001 : out_of.norm() <= 0.001) expected.push_back(node);
    }
    EXPECT_EQ(tissue.pinned, expected);
}

TEST(NodeSets, MistakesAreNamedWithWhatIsExpected) {
    const auto refusal = [](const std::string& region) {
        const auto scene = parse_scene(cube_scene(fmt::format(R"("fixed": [{}])", region)), "scenes/test.json");
        if (!scene.ok()) return scene.error().to_string();
        const auto prepared = make_prepared_scene(*scene);
        return prepared.ok() ? std::string() : prepared.error().to_string();
    };
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "bad_nodes.txt";
    const auto with_list = [&](const char* text) {
        std::ofstream(file) << text;
        return refusal(fmt::format(R"({{"nodes": "{}"}})", file.string()));
    };
    EXPECT_NE(with_list("1 2\n3 x\n").find("line 2: found \"x\""), std::string::npos);
    EXPECT_NE(with_list("# none\n").find("lists no node"), std::string::npos);
    EXPECT_NE(with_list("4 999999\n").find("lists node 999999; expected at most"), std::string::npos);
    EXPECT_NE(refusal(R"({"nodes": "no_such_file.txt"})").find("no_such_file.txt"), std::string::npos);
    EXPECT_NE(refusal(R"({"near": {"surface": "bone", "distance": 1}})").find("bone"), std::string::npos);
    EXPECT_NE(refusal(R"({"plane": {"point": [0, 0, 0], "normal": [0, 0, 0]}})").find("normal"), std::string::npos);
}

TEST(Loads, AForceInAllAcceleratesAFreeBodyByItsMass) {
    const PreparedScene prepared = test::prepare(cube_scene(R"("loads": [{"force": [0.004, 0, 0]}])", R"("elasticity", "loads")"));
    Simulator simulator = run(prepared, 20);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    const double wanted = 0.5 * 0.004 / tissue.mass * 0.1 * 0.1;
    EXPECT_NEAR(mean_shift(prepared, simulator).x(), wanted, 1e-9 + 1e-6 * wanted);
}

TEST(Loads, TractionsAndForcesOnAnEndStretchABarAsHookeSays) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "loaded.vtu";
    TetMesh mesh = fem::make_bar_mesh({4, 4, 4}, 0.005, 0.0); // its faces are flat, a lattice's not quite
    for (Vec3& v : mesh.vertices) v -= Vec3::Constant(0.01);
    ASSERT_TRUE(write_vtu(file, mesh).ok());
    for (const char* load : {R"({"traction": [0, 0, 0.1], "where": {"direction": [0, 0, 1], "fraction": 0.02}})",
                             R"({"pressure": -0.1, "where": {"direction": [0, 0, 1], "fraction": 0.02}})",
                             R"({"force": [0, 0, 0.04], "where": {"direction": [0, 0, 1], "fraction": 0.02}})"}) {
        std::string scene = cube_scene(fmt::format(R"({}, "loads": [{}])", kHeldBelow, load), R"("elasticity", "damping", "loads")", 0.0);
        const std::string lattice = R"({"mesher": "lattice", "surface_triangles": 200})";
        scene.replace(scene.find(lattice), lattice.size(), fmt::format(R"({{"file": "{}", "unit": "m"}})", file.string()));
        const PreparedScene prepared = test::prepare(scene);
        Simulator simulator = run(prepared, 200);
        double moved = 0.0, count = 0.0; // of the end's nodes, on average: a force is shared by mass, and pulls some farther than others
        for (std::size_t n = 0; n < nodes_of(simulator).size(); ++n) {
            const double rest = prepared.model.bodies[0].tissue->rest_position[n].z();
            if (rest > 0.0099) moved += nodes_of(simulator)[n].z() - rest, count += 1.0;
        }
        const double off = load[2] == 'f' ? 0.1 : 0.02;
        EXPECT_NEAR(moved / count, 0.01 * 0.02, off * 0.01 * 0.02) << load; // 0.1 kPa of 10 kPa over 20 mm
    }
}

TEST(Loads, PressureAllRoundPushesNowhere) {
    const PreparedScene prepared = test::prepare(cube_scene(R"("loads": [{"pressure": 1}])"));
    Simulator simulator = run(prepared, 40);
    EXPECT_LT(mean_shift(prepared, simulator).norm(), 1e-7);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    EXPECT_LT(fem::measure_tets(tissue, nodes_of(simulator)).min_volume_ratio, 0.95); // 3 (1 - 2 nu) p / E = 0.12
}

TEST(Loads, FollowTheirRowsOverTime) {
    const std::vector<LoadRow> rows{{0.1, 0.0}, {0.2, 1.0}, {0.4, -1.0}};
    EXPECT_EQ(evaluate_rows(rows, 0.0), 0.0);
    EXPECT_DOUBLE_EQ(evaluate_rows(rows, 0.15), 0.5);
    EXPECT_NEAR(evaluate_rows(rows, 0.3), 0.0, 1e-15);
    EXPECT_EQ(evaluate_rows(rows, 9.0), -1.0);
    const PreparedScene prepared = test::prepare(
        cube_scene(R"("loads": [{"acceleration": [1000, 0, 0], "over": [[0, 0], [0.049, 0], [0.05, 1]]}])", R"("elasticity", "loads")"));
    Simulator simulator = run(prepared, 9);
    EXPECT_LT(mean_shift(prepared, simulator).norm(), 1e-15); // until then it rests
    for (int k = 0; k < 10; ++k) (void)simulator.step();
    EXPECT_GT(mean_shift(prepared, simulator).x(), 1e-4);
}

/// Whatever the rows, jumps among them, the step and the integrator: what a load gives a free body is its integral over time.
TEST(Loads, GiveAFreeBodyTheirIntegralOverTime) {
    test::Random random(31);
    for (const char* integrator : {"rk4", "leapfrog", "implicit"})
        for (const double step : {0.001, 0.004, 0.01})
            for (const char* kind : {R"("force": [0.004, 0.001, 0])", R"("acceleration": [500, 100, 0])"}) {
                std::string rows;
                double given = 0.0, way = 0.0, last = random.between(-1.0, 1.0), time = 0.0; // of a unit mass
                for (int k = 0; k <= 6; ++k) {
                    const double value = k == 0 ? last : random.between(-1.0, 1.0), length = k == 0 ? 0.0 : k % 3 == 2 ? 1e-6 : step * random.between(0.1, 2.5);
                    way += length * given + length * length * (2.0 * last + value) / 6.0;
                    given += 0.5 * length * (last + value), time += length, last = value;
                    rows += fmt::format("{}[{:.17g}, {:.17g}]", k == 0 ? "" : ", ", time, value);
                }
                std::string scene = cube_scene(fmt::format(R"("loads": [{{{}, "over": [{}]}}])", kind, rows), R"("elasticity", "loads")");
                scene.replace(scene.find(R"("step": 0.005)"), 13, fmt::format(R"("step": {}, "integrator": "{}")", step, integrator));
                const PreparedScene prepared = test::prepare(scene);
                const int steps = static_cast<int>(std::ceil(time / step - 1e-9));
                const double rest = steps * step - time;
                way += rest * given + 0.5 * rest * rest * last, given += rest * last;
                Simulator simulator = run(prepared, steps);
                const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
                const Vec3 unit = kind[1] == 'f' ? Vec3(Vec3(0.004, 0.001, 0.0) / tissue.mass) : Vec3(0.5, 0.1, 0.0);
                const Vec3 speed = fem::find_momentum(tissue, simulator.state().bodies[0].tissue).linear / tissue.mass;
                EXPECT_LT((speed - given * unit).norm(), 1e-6 * step * unit.norm()) << integrator << " " << step << " " << kind;
                if (integrator[0] == 'r') EXPECT_LT((mean_shift(prepared, simulator) - way * unit).norm(), 1e-6 * step * step * unit.norm()) << step << " " << kind;
            }
}

/// Long steps follow a ramp as short ones do.
TEST(Loads, ThatRampDoSoInLongStepsAsInShortOnes) {
    const auto end_of = [](double step) {
        std::string scene = cube_scene(fmt::format(R"({}, "loads": [{{"force": [0.3, 0, 0], "where": {{"direction": [0, 0, 1], "fraction": 0.1}}, "over": [[0, 0], [0.1, 1]]}},
                                                       {{"pressure": 0.5, "where": {{"direction": [1, 0, 0], "fraction": 0.4}}, "over": [[0, 0], [0.1, 1]]}}])", kHeldBelow));
        scene.replace(scene.find(R"("step": 0.005)"), 13, fmt::format(R"("step": {})", step));
        const PreparedScene prepared = test::prepare(scene);
        Simulator simulator = run(prepared, static_cast<int>(std::lround(0.1 / step)));
        return mean_shift(prepared, simulator);
    };
    const Vec3 exact = end_of(0.0005);
    const double coarse = (end_of(0.02) - exact).norm(), fine = (end_of(0.005) - exact).norm();
    std::printf("a ramp of 0.1 s: %.3g of the way off in steps of 20 ms, %.3g in steps of 5 ms\n", coarse / exact.norm(), fine / exact.norm());
    EXPECT_LT(coarse, 2e-4 * exact.norm());
    EXPECT_LT(fine, 2e-4 * exact.norm());
}

TEST(Loads, OnHeldNodesAloneAreSaidToMoveNothing) {
    const auto notices_of = [](double fraction) {
        return test::prepare(cube_scene(fmt::format(R"({}, "loads": [{{"force": [0, 0, 1], "where": {{"direction": [0, 0, -1], "fraction": {}}}}}])", kHeldBelow, fraction))).notices;
    };
    const auto says = [](const std::vector<std::string>& notices) {
        return std::any_of(notices.begin(), notices.end(), [](const std::string& text) { return text.find("bodies.cube.loads[0] moves nothing") != std::string::npos; });
    };
    EXPECT_TRUE(says(notices_of(0.1)));
    EXPECT_FALSE(says(notices_of(0.6)));
}

/// Tissue that stiffens within a step takes as many sub-steps as it needs, whatever number the scene asks for.
TEST(Loads, WhatStiffensIsAsStableWithANumberOfSubstepsAsWithout) {
    const auto end_of = [](const std::string& substeps) {
        std::string scene = cube_scene(fmt::format(R"({}, "loads": [{{"traction": [0, 0, 30], "where": {{"direction": [0, 0, 1], "fraction": 0.3}}}}])", kHeldBelow), R"("elasticity", "damping", "loads")");
        scene.replace(scene.find(R"("step": 0.005)"), 13, R"("step": 0.02, "integrator": "rk4")" + substeps);
        const std::string plain = R"("young_modulus": 10, "poisson_ratio": 0.3)";
        scene.replace(scene.find(plain), plain.size(), R"("law": "ogden", "mu1": 3, "alpha1": 8, "poisson_ratio": 0.3)");
        const PreparedScene prepared = test::prepare(scene);
        Simulator simulator = run(prepared, 40);
        std::printf("%s: %u sub-steps, %.6g mm\n", substeps.c_str(), simulator.report().substeps, 1e3 * mean_shift(prepared, simulator).z());
        return std::pair{mean_shift(prepared, simulator).z(), simulator.report()};
    };
    const auto [free, report] = end_of("");
    for (const int number : {40, 100}) {
        const auto [told, own] = end_of(fmt::format(R"(, "substeps": {})", number));
        EXPECT_NEAR(told, free, 1e-3 * free);
        EXPECT_GE(own.substeps, static_cast<unsigned>(number));
        EXPECT_EQ(own.raised_bodies > 0, own.substeps > static_cast<unsigned>(number));
    }
}

/// As many sub-steps as there may be at most are not too many, in contact either.
TEST(Loads, AsManySubstepsAsAreAllowedMayBeAskedFor) {
    for (const int count : {33, 37, 100})
        for (const bool touching : {false, true}) {
            std::string scene = cube_scene(kThrown, R"("elasticity", "coarse_contact")");
            scene.replace(scene.find(R"("step": 0.005)"), 13, fmt::format(R"("step": 0.005, "substeps": {}, "max_substeps": {})", count, count));
            std::string other = scene.substr(scene.find(R"("cube")"), scene.find("}},\n    \"effects\"") + 1 - scene.find(R"("cube")"));
            other.replace(other.find("cube"), 4, "other"), other.replace(other.find(R"([0, 0, 0])"), 9, touching ? "[20.1, 0, 0]" : "[90, 0, 0]");
            other.replace(other.find(R"([1, 0, 0])"), 9, "[-99, 0, 0]");
            scene.replace(scene.find(R"("cube")"), 0, other + ", ");
            const PreparedScene prepared = test::prepare(scene);
            Simulator simulator = run(prepared, 4);
            EXPECT_EQ(simulator.report().substeps, static_cast<unsigned>(count));
            EXPECT_EQ(simulator.report().raised_bodies, 0u);
        }
}

/// Lists name nodes as the file does, which may have some that no tetrahedron has.
TEST(NodeSets, AListNamesTheNodesOfTheFile) {
    const std::filesystem::path folder = testing::TempDir();
    TetMesh mesh = fem::make_bar_mesh({4, 4, 4}, 0.005, 0.0);
    for (Vec3& v : mesh.vertices) v -= Vec3::Constant(0.01);
    mesh.vertices.insert(mesh.vertices.begin(), Vec3(0.0, 0.0, 0.0));
    mesh.vertices.insert(mesh.vertices.begin() + 40, Vec3(0.001, 0.0, 0.0));
    for (Tet& tet : mesh.tets)
        for (Index& node : tet) node += node + 1 >= 40 ? 2 : 1;
    ASSERT_TRUE(write_vtu(folder / "with_unused.vtu", mesh).ok());
    const auto scene_of = [&](const std::string& nodes) {
        std::ofstream(folder / "listed.txt") << nodes;
        std::string scene = cube_scene(fmt::format(R"("fixed": [{{"nodes": "{}"}}])", (folder / "listed.txt").string()));
        const std::string lattice = R"({"mesher": "lattice", "surface_triangles": 200})";
        return scene.replace(scene.find(lattice), lattice.size(), fmt::format(R"({{"file": "{}", "unit": "m"}})", (folder / "with_unused.vtu").string()));
    };
    std::string below;
    std::vector<Vec3> wanted;
    for (Index node = 1; node < mesh.vertices.size(); ++node)
        if (node != 40 && mesh.vertices[node].z() < -0.0099) below += fmt::format("{} ", node), wanted.push_back(mesh.vertices[node]);
    const PreparedScene prepared = test::prepare(scene_of(below));
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    ASSERT_EQ(tissue.pinned.size(), wanted.size());
    for (std::size_t k = 0; k < wanted.size(); ++k) EXPECT_EQ(tissue.rest_position[tissue.pinned[k]], wanted[k]);
    for (const char* unused : {"0", "40"}) {
        const auto scene = parse_scene(scene_of(unused), "scenes/test.json");
        ASSERT_TRUE(scene.ok());
        const auto refused = make_prepared_scene(*scene);
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.error().to_string().find(fmt::format("lists node {}, which no tetrahedron", unused)), std::string::npos) << refused.error().to_string();
    }
}

TEST(CoarseFiles, WithThreeTetrahedraOnAFaceAreRefusedByName) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "three.vtu";
    TetMesh mesh = fem::make_bar_mesh({2, 2, 2}, 0.01, 0.0);
    for (Vec3& v : mesh.vertices) v -= Vec3::Constant(0.01);
    const Tet on = mesh.tets[20];
    for (const double off : {0.001, 0.002}) {
        mesh.vertices.push_back(mesh.vertices[on[3]] + Vec3(off, 0.5 * off, 0.0));
        mesh.tets.push_back({on[0], on[1], on[2], static_cast<Index>(mesh.vertices.size() - 1)});
    }
    ASSERT_TRUE(write_vtu(file, mesh).ok());
    std::string scene = cube_scene("");
    scene.replace(scene.find("}, }}"), 5, "}}}");
    const std::string lattice = R"({"mesher": "lattice", "surface_triangles": 200})";
    scene.replace(scene.find(lattice), lattice.size(), fmt::format(R"({{"file": "{}", "unit": "m"}})", file.string()));
    const auto parsed = parse_scene(scene, "scenes/test.json");
    ASSERT_TRUE(parsed.ok()) << parsed.error().to_string();
    const auto prepared = make_prepared_scene(*parsed);
    ASSERT_FALSE(prepared.ok());
    EXPECT_NE(prepared.error().to_string().find("three.vtu: tetrahedra 7, 20 and 48 share the face of nodes"), std::string::npos) << prepared.error().to_string();
}

TEST(CoarseFiles, OneCellThickAreSaidToBendTooMuchWhereTheyArePatched) {
    const auto is_said = [](Index across, double nu) {
        const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "sheet.vtu";
        TetMesh mesh = fem::make_bar_mesh({4, 4, across}, 0.005, 0.0);
        for (Vec3& v : mesh.vertices) v = v - Vec3(0.01, 0.01, 0.0025 * across);
        EXPECT_TRUE(write_vtu(file, mesh).ok());
        std::string scene = cube_scene(kThrown, R"("elasticity")", nu);
        const std::string lattice = R"({"mesher": "lattice", "surface_triangles": 200})";
        scene.replace(scene.find(lattice), lattice.size(), fmt::format(R"({{"file": "{}", "unit": "m"}})", file.string()));
        const std::vector<std::string> notes = test::prepare(scene).bodies[0].notes;
        return std::any_of(notes.begin(), notes.end(), [](const std::string& note) { return note.find("no node of the coarse mesh lies inside it") == 0; });
    };
    EXPECT_TRUE(is_said(1, 0.45));
    EXPECT_FALSE(is_said(2, 0.45));
    EXPECT_FALSE(is_said(1, 0.3)); // linear
}

/// What stability asks for beyond time.substeps is taken, and said.
TEST(Loads, SubstepsBeyondWhatTheSceneAsksForAreCounted) {
    for (const bool stiff : {false, true}) {
        std::string scene = cube_scene(stiff ? R"("loads": [{"spring": 4000}])" : R"("loads": [{"spring": 0.04}])");
        scene.replace(scene.find(R"("step": 0.005)"), 13, R"("step": 0.005, "substeps": 20)");
        const PreparedScene prepared = test::prepare(scene);
        Simulator simulator = run(prepared, 2);
        EXPECT_EQ(simulator.report().substeps > 20, stiff) << simulator.report().substeps;
        EXPECT_EQ(simulator.report().raised_bodies, stiff ? 1u : 0u);
    }
}

TEST(Loads, SpringsToTheGroundHoldABodyAgainstItsWeight) {
    const PreparedScene prepared = test::prepare(cube_scene(R"("loads": [{"spring": 0.04}, {"acceleration": [0, 0, -9810]}])"));
    Simulator simulator = run(prepared, 400);
    const double wanted = 9.81 * prepared.model.bodies[0].tissue->mass / 40.0;
    const Vec3 shift = mean_shift(prepared, simulator);
    EXPECT_NEAR(-shift.z(), wanted, 0.02 * wanted);
    EXPECT_LT(std::abs(shift.x()) + std::abs(shift.y()), 1e-9);
}

TEST(Loads, AreAbsentWhereTheEffectIsNotNamedAndCountedWhereItIs) {
    const std::string load = R"("loads": [{"force": [1, 0, 0]}])";
    const PreparedScene without = test::prepare(cube_scene(load, R"("elasticity")")), with = test::prepare(cube_scene(load));
    EXPECT_TRUE(without.model.bodies[0].loads.empty());
    Simulator a = run(without, 3), b = run(with, 3);
    EXPECT_LT(mean_shift(without, a).norm(), 1e-15);
    EXPECT_EQ(count_of(a.report(), "loads"), 0u);
    EXPECT_GT(count_of(b.report(), "loads"), 0u);
}

TEST(HeldNodes, MoveAndTurnAsTheirRowsSay) {
    const PreparedScene prepared = test::prepare(cube_scene(
        R"("fixed": [{"direction": [0, 0, -1], "fraction": 0.1},
                     {"direction": [0, 0, 1], "fraction": 0.1, "moves": [[0, 0, 0, 0], [0.2, 0, 0, 3]],
                      "turns": [[0, 0], [0.2, 45]], "turn_axis": [0, 0, 2]}])",
        R"("elasticity", "damping")"));
    Simulator simulator = run(prepared, 60);
    const BodyModel& body = prepared.model.bodies[0];
    ASSERT_EQ(body.held.size(), 1u);
    for (const Index k : body.held[0].pinned) {
        const Index node = body.tissue->pinned[k];
        const Vec3& rest = body.tissue->rest_position[node];
        const double c = std::sqrt(0.5);
        EXPECT_LT((nodes_of(simulator)[node] - Vec3(c * rest.x() - c * rest.y(), c * rest.x() + c * rest.y(), rest.z() + 0.003)).norm(),
                  1e-12);
    }
    EXPECT_LT(body.held[0].pinned.size(), body.tissue->pinned.size());
}

TEST(InitialMotion, VelocityAndSpinAreThoseOfTheBodysCentre) {
    const PreparedScene prepared = test::prepare(cube_scene(R"("velocity": [100, 0, 0], "spin": [0, 0, 90])", R"("elasticity")"));
    Simulator simulator(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    const fem::Momentum momentum = fem::find_momentum(tissue, simulator.state().bodies[0].tissue);
    EXPECT_LT((momentum.linear / tissue.mass - Vec3(0.1, 0, 0)).norm(), 1e-12);
    EXPECT_GT(momentum.angular.z(), 0.0);
    (void)simulator.step();
    EXPECT_NEAR(mean_shift(prepared, simulator).x(), 0.1 * 0.005, 1e-9);
}

TEST(RelaxingTissue, ForksAndSavesGoOnToTheSameBits) {
    std::string scene = cube_scene(
        fmt::format(R"({}, "loads": [{{"force": [0.05, 0, 0], "where": {{"direction": [0, 0, 1], "fraction": 0.1}}}}])", kHeldBelow));
    scene.insert(scene.find("\"viscosity\""), R"("g1": 1.5, "tau1": 0.05, )");
    const PreparedScene prepared = test::prepare(scene);
    Simulator one = run(prepared, 10);
    EXPECT_FALSE(one.state().bodies[0].tissue.relaxed.empty());
    Simulator other = one.fork(), third(prepared.model);
    ASSERT_TRUE(third.restore(*one.save()).ok());
    for (int k = 0; k < 10; ++k) (void)one.step(), (void)other.step(), (void)third.step();
    EXPECT_EQ(hash_state(one.state()), hash_state(other.state()));
    EXPECT_EQ(hash_state(one.state()), hash_state(third.state()));
    EXPECT_EQ(one.state().bodies[0].tissue.relaxed, other.state().bodies[0].tissue.relaxed);
}

TEST(Presets, AreMaterialsThatPassTheirChecks) {
    for (const std::string_view name : preset_names()) {
        const std::optional<fem::Material> material = find_preset(name);
        ASSERT_TRUE(material) << name;
        EXPECT_TRUE(fem::check_material(*material).ok()) << name;
    }
    EXPECT_FALSE(find_preset("stone"));
}

/// Whatever the direction, and however its extent is rounded.
TEST(NodeSets, AFractionOfOneIsTheWholeBody) {
    test::Random random(26);
    for (int k = 0; k < 40; ++k) {
        const Vec3 d = random.direction();
        const PreparedScene prepared = test::prepare(cube_scene(fmt::format(R"("fixed": [{{"direction": [{:.17g}, {:.17g}, {:.17g}], "fraction": 1}}])", d.x(), d.y(), d.z())));
        ASSERT_EQ(prepared.model.bodies.size(), 1u);
        const std::vector<double>& inverse = prepared.model.bodies[0].tissue->inv_mass;
        EXPECT_EQ(std::count(inverse.begin(), inverse.end(), 0.0), static_cast<std::ptrdiff_t>(inverse.size())) << d.transpose();
    }
}

TEST(NodeSets, ARegionThatHoldsNothingBesideOthersIsSaid) {
    const PreparedScene prepared =
        test::prepare(cube_scene(R"("fixed": [{"direction": [0, 0, -1], "fraction": 0.1}, {"sphere": {"centre": [500, 0, 0], "radius": 1}}])"));
    ASSERT_EQ(prepared.notices.size(), 1u);
    EXPECT_NE(prepared.notices[0].find("bodies.cube.fixed[1] holds nothing"), std::string::npos) << prepared.notices[0];
}

TEST(Loads, OfABodyThatCannotMoveAreSaid) {
    for (const std::string& what : {std::string(R"("loads": [{"force": [0, 0, 1]}])"), std::string(kThrown)}) {
        const Result<Scene> scene = parse_scene(cube_scene(what, R"("loads")"), "scenes/step.json");
        ASSERT_TRUE(scene.ok()) << scene.error().to_string();
        EXPECT_TRUE(std::any_of(scene->questions.begin(), scene->questions.end(),
                                [](const std::string& q) { return q.find("without the effect elasticity no body moves") != std::string::npos; }))
            << what;
    }
}

} // namespace trocar::engine
