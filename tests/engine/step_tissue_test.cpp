// Bodies without instruments: a ball falls and rests, plates move, tissue breathes, and a state that leaves its bounds stops.
#include "engine/step/tissue/tissue_stage.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "step_fixture.hpp"

#include <limits>

namespace trocar::engine {
namespace {

using test::Tally;

std::string ball_scene(const std::string& effects, const std::string& ball_extra = "", const std::string& budget = "exact") {
    return fmt::format(R"({{
    "units": {{"length": "mm", "pressure": "kPa"}},
    "time": {{"step": 0.005, "duration": 2}},
    "budget": "{}",
    "gravity": [0, 0, -9810],
    "bodies": {{
        "ball": {{"kind": "deformable", "surface": {{"shape": "sphere", "centre": [0, 0, 45], "radius": 30, "subdivisions": 4}},
                 "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01, "cap_viscosity": false, "mass_damping": 4}},
                 "coarse": {{"mesher": "tetgen", "surface_triangles": 200}}{}}},
        "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 48}}}}
    }},
    "effects": [{}]
}})",
                       budget, ball_extra, effects);
}

double lowest_vertex(const std::vector<Vec3>& points) {
    double z = std::numeric_limits<double>::infinity();
    for (const Vec3& p : points) z = std::min(z, p.z());
    return z;
}

Vec3 middle_of_surface(const std::vector<Vec3>& points) {
    Vec3 sum = Vec3::Zero();
    for (const Vec3& p : points) sum += p;
    return sum / static_cast<double>(points.size());
}

/// Kinetic, elastic and potential energy, J; the last over the table's top.
double energy_of_tissue(Simulator& simulator) {
    const fem::TissueModel& tissue = *simulator.model().bodies[0].tissue;
    const std::vector<Vec3>& nodes = simulator.state().bodies[0].tissue.position;
    double potential = 0.0;
    for (std::size_t n = 0; n < nodes.size(); ++n)
        if (tissue.inv_mass[n] > 0.0) potential += 9.81 * nodes[n].z() / tissue.inv_mass[n];
    const StepReport& report = simulator.report();
    return potential + report.kinetic_j + report.elastic_j;
}

TEST(FallingBall, ComesToRestOnTheTableAndGainsNoEnergy) {
    const PreparedScene prepared = test::prepare(ball_scene(R"("elasticity", "gravity", "damping", "coarse_contact")"));
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    ASSERT_TRUE(simulator.step().finite);
    const double first = energy_of_tissue(simulator);
    double largest = first, deepest = 0.0;
    for (int k = 1; k < 600; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite) << report.failure;
        ASSERT_EQ(report.inverted_tets, 0u) << "step " << report.step;
        largest = std::max(largest, energy_of_tissue(simulator));
        deepest = std::min(deepest, lowest_vertex(simulator.state().bodies[0].surface));
    }
    EXPECT_TRUE(test::all_finite(simulator.state()));
    EXPECT_LE(largest, 1.02 * first);
    EXPECT_GT(deepest, -3e-3) << "half of the table's thickness is the end of it";
    const double height = middle_of_surface(simulator.state().bodies[0].surface).z();
    EXPECT_GT(height, 0.025) << "E = 20 kPa: it flattens under its weight";
    EXPECT_LT(height, 0.0301);
    EXPECT_LT(std::abs(lowest_vertex(simulator.state().bodies[0].surface)), 1e-3) << "it rests where its surface touches the table";
    EXPECT_LT(simulator.report().kinetic_j, 2e-5) << "below 20 mm/s: without friction it slides on";
}

TEST(FallingBall, UnderATinyBudgetIsNotThrownAway) {
    for (const char* budget : {"work:0", "work:1", "work:50"}) {
        const PreparedScene prepared = test::prepare(ball_scene(R"("elasticity", "gravity", "damping", "coarse_contact")", "", budget));
        Simulator simulator(prepared.model);
        const Tally tally = test::run_steps(simulator, 200);
        EXPECT_EQ(tally.steps, 200u) << budget << ": " << tally.last.failure;
        EXPECT_TRUE(test::all_finite(simulator.state())) << budget;
        EXPECT_GT(tally.assumed, 0u) << budget;
        const Vec3 at = middle_of_surface(simulator.state().bodies[0].surface);
        EXPECT_LT(at.z(), 0.0451) << budget;
        EXPECT_GT(at.z(), 0.026) << budget;
        EXPECT_LT(std::abs(at.x()) + std::abs(at.y()), 5e-3) << budget;
    }
}

TEST(FallingBall, UnderAWorkBudgetFallsTheSameWayTwice) {
    const PreparedScene prepared = test::prepare(ball_scene(R"("elasticity", "gravity", "damping", "coarse_contact")", "", "work:2000"));
    Simulator a(prepared.model), b(prepared.model);
    (void)test::run_steps(a, 100);
    (void)test::run_steps(b, 100);
    EXPECT_EQ(hash_state(a.state()), hash_state(b.state()));
}

TEST(Effects, LeftOutGravityLeavesTheBallWhereItIs) {
    const PreparedScene prepared = test::prepare(ball_scene(R"("elasticity", "damping", "coarse_contact")"));
    Simulator simulator(prepared.model);
    const std::vector<Vec3> start = simulator.state().bodies[0].surface;
    const Tally tally = test::run_steps(simulator, 50);
    EXPECT_LT(tally.largest_energy, 1e-12);
    for (std::size_t v = 0; v < start.size(); ++v) ASSERT_LT((simulator.state().bodies[0].surface[v] - start[v]).norm(), 1e-9);
}

TEST(Effects, LeftOutElasticityKeepsTissueAtRestWhateverPulls) {
    const PreparedScene prepared = test::prepare(ball_scene(R"("gravity", "coarse_contact")"));
    Simulator simulator(prepared.model);
    const std::uint64_t nodes = prepared.model.bodies[0].tissue->rest_position.size();
    const Tally tally = test::run_steps(simulator, 20);
    EXPECT_EQ(tally.last.substeps, 0u);
    for (std::size_t n = 0; n < nodes; ++n)
        ASSERT_EQ(simulator.state().bodies[0].tissue.position[n], prepared.model.bodies[0].tissue->rest_position[n]);
}

TEST(Effects, LeftOutDampingTakesViscosityFromTheModel) {
    const PreparedScene with = test::prepare(ball_scene(R"("elasticity", "damping")"));
    const PreparedScene without = test::prepare(ball_scene(R"("elasticity")"));
    EXPECT_GT(without.bodies[0].stable_step_s, with.bodies[0].stable_step_s);
}

TEST(Effects, LeftOutContactLetsTheBallFallThroughTheTable) {
    const PreparedScene prepared = test::prepare(ball_scene(R"("elasticity", "gravity", "damping")"));
    Simulator simulator(prepared.model);
    const Tally tally = test::run_steps(simulator, 120);
    EXPECT_EQ(tally.pairs_tested, 0u);
    EXPECT_LT(middle_of_surface(simulator.state().bodies[0].surface).z(), -0.1);
}

TEST(KinematicBody, MovesAsToldAndPushesWhatItMeets) {
    const PreparedScene prepared = test::prepare(R"({
        "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 1},
        "bodies": {
            "ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 0], "radius": 20, "subdivisions": 4},
                     "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01},
                     "coarse": {"surface_triangles": 200}},
            "plate": {"kind": "kinematic", "surface": {"shape": "box", "centre": [-36, 0, 0], "extent": [10, 60, 60], "cells": 24},
                      "motion": [[0, 0, 0, 0], [0.1, 0, 0, 0], [0.6, 35, 0, 0]]}},
        "effects": ["elasticity", "damping", "coarse_contact"]})");
    ASSERT_EQ(prepared.model.bodies.size(), 2u);
    Simulator simulator(prepared.model);
    const Tally before = test::run_steps(simulator, 20);
    EXPECT_LT((middle_of_surface(simulator.state().bodies[1].surface) - Vec3(-0.036, 0, 0)).norm(), 1e-9);
    EXPECT_LT(before.last.kinetic_j, 1e-10);
    const Tally after = test::run_steps(simulator, 120);
    EXPECT_EQ(after.steps, 120u) << after.last.failure;
    EXPECT_LT((middle_of_surface(simulator.state().bodies[1].surface) - Vec3(-0.001, 0, 0)).norm(), 1e-9);
    EXPECT_GT(middle_of_surface(simulator.state().bodies[0].surface).x(), 0.010) << "the plate's face now stands at 4 mm";
    EXPECT_TRUE(test::all_finite(simulator.state()));
}

TEST(KinematicBody, DisplacementIsLinearBetweenRowsAndHeldOutside) {
    const std::vector<MotionRow> rows = {{1.0, {0, 0, 0}}, {2.0, {0.01, 0, 0}}, {4.0, {0.01, 0.02, 0}}};
    EXPECT_EQ(evaluate_motion(rows, 0.0), Vec3(0, 0, 0));
    EXPECT_EQ(evaluate_motion(rows, 1.5), Vec3(0.005, 0, 0));
    EXPECT_EQ(evaluate_motion(rows, 3.0), Vec3(0.01, 0.01, 0));
    EXPECT_EQ(evaluate_motion(rows, 9.0), Vec3(0.01, 0.02, 0));
    EXPECT_EQ(evaluate_motion({}, 1.0), Vec3(0, 0, 0));
}

constexpr const char* kHeldBar = R"({
    "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 4},
    "bodies": {"bar": {"kind": "deformable", "surface": {"shape": "box", "extent": [60, 20, 20], "cells": 4},
        "material": {"law": "neo_hookean", "young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.005, "mass_damping": 5},
        "coarse": {"surface_triangles": 120}, "fixed": [{"direction": [1, 0, 0], "fraction": 0.1}]}},
    "effects": {"elasticity": true, "damping": true, "breathing": {"amplitude": 8, "period": 2, "direction": [0, 0, 2]}}})";

TEST(Breathing, TakesHeldNodesThereAndBackOnceAPeriod) {
    const PreparedScene prepared = test::prepare(kHeldBar);
    ASSERT_EQ(prepared.model.bodies.size(), 1u);
    Simulator simulator(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    ASSERT_FALSE(tissue.pinned.empty());
    const auto moved = [&] {
        const Index node = tissue.pinned.front();
        return Vec3(simulator.state().bodies[0].tissue.position[node] - tissue.rest_position[node]);
    };
    (void)test::run_steps(simulator, 100);
    EXPECT_LT((moved() - Vec3(0, 0, 0.008)).norm(), 1e-12) << "half a period";
    (void)test::run_steps(simulator, 100);
    EXPECT_LT(moved().norm(), 1e-12) << "a whole one";
    const Tally tally = test::run_steps(simulator, 200);
    EXPECT_LT(moved().norm(), 1e-12);
    EXPECT_TRUE(tally.last.finite);
    EXPECT_LT(middle_of_surface(simulator.state().bodies[0].surface).norm(), 0.01) << "the rest of the bar comes along and back";
}

TEST(Breathing, LeftOutMovesNothing) {
    std::string text = kHeldBar;
    text.replace(text.find("\"breathing\": {"), std::string::npos, "\"breathing\": false}}");
    const PreparedScene prepared = test::prepare(text);
    ASSERT_FALSE(prepared.model.effects.breathing);
    Simulator simulator(prepared.model);
    (void)test::run_steps(simulator, 100);
    EXPECT_TRUE(ScratchView::of(simulator).bodies.tissue[0].pinned_target.empty());
    EXPECT_LT(middle_of_surface(simulator.state().bodies[0].surface).norm(), 1e-9);
}

TEST(Breathing, IsSmoothFromNothingToAllAndBack) {
    const BreathingSpec breathing{0.01, 4.0, Vec3::UnitZ()};
    EXPECT_NEAR(wave_at(breathing.period, 0.0), 0.0, 1e-15);
    EXPECT_NEAR(wave_at(breathing.period, 1.0), 0.5, 1e-12);
    EXPECT_NEAR(wave_at(breathing.period, 2.0), 1.0, 1e-12);
    EXPECT_NEAR(wave_at(breathing.period, 4000.0), 0.0, 1e-9);
    for (double t = 0.0; t < 8.0; t += 0.01) ASSERT_LT(std::abs(wave_at(breathing.period, t + 0.01) - wave_at(breathing.period, t)), 0.01);
}

TEST(Stop, AViscosityThatNeedsEndlessSubStepsStopsWithTheNumberAndTheElement) {
    std::string text = kHeldBar;
    text.replace(text.find("\"viscosity\": 0.005"), 18, "\"viscosity\": 90, \"cap_viscosity\": false");
    const PreparedScene chosen = test::prepare(text);
    Simulator by_default(chosen.model); // implicit, which it does not keep from anything
    for (int k = 0; k < 3; ++k) EXPECT_EQ(by_default.step().substeps, 1u);
    text.replace(text.find("\"duration\": 4"), 13, "\"duration\": 4, \"integrator\": \"rk4\"");
    const PreparedScene prepared = test::prepare(text);
    ASSERT_EQ(prepared.model.bodies.size(), 1u);
    Simulator simulator(prepared.model);
    const std::uint64_t start = hash_state(simulator.state());
    const StepReport& report = simulator.step();
    EXPECT_FALSE(report.finite);
    EXPECT_NE(report.failure.find("bar"), std::string::npos) << report.failure;
    EXPECT_NE(report.failure.find("sub-steps"), std::string::npos) << report.failure;
    EXPECT_NE(report.failure.find("tetrahedron"), std::string::npos) << report.failure;
    EXPECT_EQ(hash_state(simulator.state()), start);
}

TEST(Stop, AForceBeyondAllBoundsStopsAndKeepsTheLastGoodState) {
    PreparedScene prepared = test::prepare(kHeldBar);
    ASSERT_EQ(prepared.model.bodies.size(), 1u);
    Simulator simulator(prepared.model);
    ASSERT_EQ(test::run_steps(simulator, 10).steps, 10u);
    const std::uint64_t good = hash_state(simulator.state());
    prepared.model.effects.gravity = Vec3(0, 0, -1e300);
    const StepReport failed = simulator.step();
    EXPECT_FALSE(failed.finite);
    EXPECT_NE(failed.failure.find("bar"), std::string::npos) << failed.failure;
    EXPECT_EQ(hash_state(simulator.state()), good);
    EXPECT_EQ(simulator.state().step, 10u);
    prepared.model.effects.gravity.reset();
    EXPECT_FALSE(simulator.step().finite) << "no more steps are taken";
    EXPECT_EQ(hash_state(simulator.state()), good);
    EXPECT_TRUE(test::all_finite(simulator.state()));
}

/// All of it: what effects remember, what instruments and contacts press with.
TEST(Stop, AStepThatFailsLeavesNothingBehind) {
    std::string text = test::bent_tube_scene({.host_body = test::kOrgan});
    const std::string list = R"(["coarse_contact", "exact_contact", "friction"])";
    ASSERT_NE(text.find(list), std::string::npos);
    text.replace(text.find(list), list.size(),
                 R"({"elasticity": true, "damping": true, "coarse_contact": true, "exact_contact": true, "friction": true,
                     "contrast": {"rate": 2, "speed": 100, "duration": 9}})");
    PreparedScene prepared = test::prepare(text);
    ASSERT_EQ(prepared.model.effects.added.size(), 1u);
    for (const unsigned steps : {1u, 40u, 150u}) {
        prepared.model.effects.gravity.reset();
        Simulator simulator(prepared.model);
        ASSERT_EQ(test::run_steps(simulator, steps).steps, steps);
        const State good = simulator.state();
        prepared.model.effects.gravity = Vec3(0, 0, -1e300);
        ASSERT_FALSE(simulator.step().finite);
        const State& now = simulator.state();
        EXPECT_EQ(hash_state(now), hash_state(good)) << steps;
        EXPECT_EQ(now.effects, good.effects) << steps;
        const InstrumentState &was = good.instruments[0], &is = now.instruments[0];
        EXPECT_EQ(is.kept_inside, was.kept_inside);
        EXPECT_EQ(is.exact_candidates, was.exact_candidates);
        ASSERT_EQ(is.planes.size(), was.planes.size());
        for (std::size_t k = 0; k < is.planes.size(); ++k) {
            EXPECT_EQ(is.planes[k].force, was.planes[k].force);
            EXPECT_EQ(is.planes[k].offset, was.planes[k].offset);
        }
        // It goes on as one that never failed, but for what its iterations start from.
        prepared.model.effects.gravity.reset();
        Simulator twin(prepared.model), again(prepared.model);
        ASSERT_TRUE(twin.restore(good).ok());
        ASSERT_TRUE(again.restore(now).ok());
        for (int k = 0; k < 20; ++k) {
            twin.step(), again.step();
            EXPECT_LT((twin.state().instruments[0].rod.position.back() - again.state().instruments[0].rod.position.back()).norm(), 1e-6) << steps << ", " << k;
        }
    }
}

TEST(Stop, ACrushedSlabOfStVKIsReportedByItsInvertedTetsOrStops) {
    const PreparedScene prepared = test::prepare(R"({
        "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 1}, "gravity": [0, 0, -98100],
        "bodies": {"slab": {"kind": "deformable", "surface": {"shape": "box", "extent": [60, 60, 30], "cells": 4},
            "material": {"law": "stvk", "young_modulus": 2, "poisson_ratio": 0.3, "density": 1000, "viscosity": 0.001, "mass_damping": 5},
            "coarse": {"surface_triangles": 200}, "fixed": [{"direction": [0, 0, -1], "fraction": 0.05}]}},
        "effects": ["elasticity", "gravity", "damping"]})");
    ASSERT_EQ(prepared.model.bodies.size(), 1u);
    Simulator simulator(prepared.model);
    std::uint32_t inverted = 0;
    double least = 1.0;
    for (int k = 0; k < 200; ++k) {
        const StepReport& report = simulator.step();
        inverted = std::max(inverted, report.inverted_tets);
        least = std::min(least, report.min_volume_ratio);
        if (!report.finite) {
            EXPECT_FALSE(report.failure.empty());
            break;
        }
    }
    EXPECT_TRUE(inverted > 0 || !simulator.report().finite) << "smallest volume ratio " << least;
    EXPECT_TRUE(test::all_finite(simulator.state()));
}

} // namespace
} // namespace trocar::engine
