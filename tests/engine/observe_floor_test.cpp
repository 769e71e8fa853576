// The floor: what a step is charged under a budget of nothing, measured beside a run and shown by it.
#include "engine/experiments/cost_page.hpp"
#include "engine/experiments/explain.hpp"
#include "engine/prepare/process.hpp"
#include "engine/report/floor.hpp"
#include "engine/state/state_bytes.hpp"
#include "observe_fixture.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

namespace trocar::engine::test {

using ::testing::HasSubstr;
using ::testing::Not;

namespace floor_test {
namespace {

/// A ball that lies on a table.
std::string ball_on_table(const std::string& budget) {
    return fmt::format(R"({{"name": "ball", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 1}},
        "gravity": [0, 0, -9810], "budget": "{}",
        "bodies": {{
            "ball": {{"kind": "deformable", "surface": {{"shape": "sphere", "centre": [0, 0, 30], "radius": 30, "subdivisions": 3}},
                      "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000}},
                      "coarse": {{"mesher": "lattice", "surface_triangles": 200}}}},
            "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 8}}}}}},
        "effects": ["elasticity", "gravity", "damping", "coarse_contact"]}})",
                       budget);
}

std::string explanation_of(const TinyRun& run) {
    std::string text;
    explain_scene(run.scene, run.prepared, [&](const std::string& part) { text += part; }, [](const std::string&) {});
    return text;
}

} // namespace
} // namespace floor_test

class FloorOfAStep : public Folder {};

TEST_F(FloorOfAStep, IsMeasuredPartByPartAndChangesNothing) {
    const TinyRun run(floor_test::ball_on_table("exact"));
    Simulator simulator(run.prepared.model);
    for (int k = 0; k < 10; ++k) ASSERT_TRUE(simulator.step().finite);
    const std::uint64_t before = hash_whole_state(simulator.state());
    const State from = simulator.state();
    const auto floor = measure_floor(simulator, &from, 15);
    ASSERT_TRUE(floor.has_value());
    EXPECT_GE(floor->steps, 1u);
    EXPECT_LE(floor->steps, 15u);
    EXPECT_GT(floor->ms, 0.0);
    EXPECT_EQ(hash_whole_state(simulator.state()), before);
    EXPECT_TRUE(simulator.step().finite) << "and the run goes on under its own budget";
    EXPECT_EQ(simulator.report().left_pairs, 0u);
}

TEST_F(FloorOfAStep, IsInEveryReportOfABudgetOfTime) {
    std::vector<std::string> notices;
    ASSERT_TRUE(TinyRun(floor_test::ball_on_table("1us")).into(out, 20, false, false, &notices).ok());
    EXPECT_THAT(text_of("summary.json"), HasSubstr("\"floor_ms\""));
    EXPECT_THAT(text_of("report.html"), HasSubstr("Budget below the floor"));
    EXPECT_THAT(text_of("report.html"), HasSubstr("is below the floor of"));
    EXPECT_THAT(notices, ::testing::Contains(HasSubstr("the budget of 0.001 ms is below the floor of")));
    if (!find_program("gnuplot", "").ok()) return;
    EXPECT_THAT(text_of("report.html"), HasSubstr(">floor<"));
    EXPECT_THAT(text_of("report.html"), HasSubstr("is what a step from the run&#39;s end takes under a budget of nothing"));
}

/// Whatever law and preset a material has, its moduli are told; laws of their own constants tell their tangents as well.
TEST_F(FloorOfAStep, ExplainTellsWhatAMaterialComesTo) {
    const struct {
        const char *material, *law;
        bool tangent;
    } cases[] = {{R"("young_modulus": 20, "poisson_ratio": 0.4)", "neo-Hookean: Young's modulus 20 kPa, Poisson's ratio 0.4 at small strain; linear tetrahedra", false},
                 {R"("young_modulus": 20, "poisson_ratio": 0.48)", "Poisson's ratio 0.48 at small strain; patched tetrahedra", false},
                 {R"("preset": "artery_media")", "Holzapfel-Gasser-Ogden (artery_media): Young's modulus", true},
                 {R"("preset": "brain")", "Ogden (brain): Young's modulus", true}};
    for (const auto& each : cases) {
        std::string text = floor_test::ball_on_table("exact");
        const std::string plain = R"("young_modulus": 20, "poisson_ratio": 0.4)";
        text.replace(text.find(plain), plain.size(), each.material);
        const std::string told = floor_test::explanation_of(TinyRun(text));
        EXPECT_THAT(told, HasSubstr(each.law));
        EXPECT_EQ(told.find("its tangent is") != std::string::npos, each.tangent) << each.material;
    }
}

TEST_F(FloorOfAStep, IsNotSpokenOfWhereNoBudgetOfTimeIs) {
    std::vector<std::string> notices;
    ASSERT_TRUE(TinyRun(floor_test::ball_on_table("exact")).into(out, 5, false, false, &notices).ok());
    EXPECT_THAT(text_of("summary.json"), Not(HasSubstr("floor_ms")));
    EXPECT_TRUE(notices.empty());
}

TEST_F(FloorOfAStep, IsListedEffectByEffectByExplain) {
    const std::string solids = floor_test::explanation_of(TinyRun(floor_test::ball_on_table("1us")));
    EXPECT_THAT(solids, HasSubstr("floor: what a step runs under a budget of nothing"));
    EXPECT_THAT(solids, HasSubstr("coarse_contact  the root spheres of 2 solids"));
    EXPECT_THAT(solids, HasSubstr("whatever the number of triangles"));
    EXPECT_THAT(solids, HasSubstr("not charged     tissue"));
    EXPECT_THAT(solids, HasSubstr("under work:0 from the start"));
    EXPECT_THAT(solids, HasSubstr("the scene's budget of 0.001 ms is below the floor of"));
    const std::string tube = floor_test::explanation_of(tube_run());
    EXPECT_THAT(tube, HasSubstr("exact_contact   no continuous test, but the planes of the walls"));
    EXPECT_THAT(tube, Not(HasSubstr("below the floor")));
}

TEST_F(FloorOfAStep, IsDrawnInThePlotsOfCost) {
    if (!find_program("gnuplot", "").ok()) GTEST_SKIP() << "gnuplot is not installed: apt-get install gnuplot-nox";
    const TinyRun run(floor_test::ball_on_table("exact"));
    CostOptions options;
    options.budgets = {{"work:0", {BudgetMode::Work, 0.0, 0}}, {"exact", {}}};
    options.steps = 10;
    auto table = measure_cost(run.prepared, {.patch = 0.012, .tolerance = 0.3e-3}, options);
    ASSERT_TRUE(table.ok());
    EXPECT_THAT(cost_page(run.scene, *table, {}), Not(HasSubstr(">floor<"))) << "where it was not measured";
    table->floor_ms = 0.0123; // whatever the runs took
    const std::string page = cost_page(run.scene, *table, {});
    EXPECT_THAT(page, HasSubstr(">floor<"));
    EXPECT_THAT(page, HasSubstr("The floor, 0.0123 ms, is the charge under a budget of 0"));
}

} // namespace trocar::engine::test
