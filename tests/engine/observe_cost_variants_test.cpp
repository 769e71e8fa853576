// The price of accuracy, with other variants; parts of a measurement that outlive its process.
#include "engine/experiments/cost_page.hpp"
#include "engine/experiments/cost_parts.hpp"
#include "engine/experiments/cost_run.hpp"
#include "engine/experiments/cost_variants.hpp"
#include "observe_fixture.hpp"
#include "step_fixture.hpp"

#include <algorithm>
#include <fstream>
#include <limits>
#include <random>

namespace trocar::engine {
namespace {

const std::string kBoxOnTable = R"({
    "name": "box-on-table",
    "units": {"length": "mm", "pressure": "kPa"},
    "time": {"step": 0.005, "duration": 1},
    "gravity": [0, 0, -9810],
    "bodies": {
        "box": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 30.5], "extent": [60, 60, 60], "cells": 4},
            "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.01, "mass_damping": 1},
            "coarse": {"mesher": "tetgen", "surface_triangles": 160}},
        "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -5], "extent": [200, 200, 10], "cells": 16}}
    },
    "contact": {"solid_stiffness": 1},
    "cost": {"patch": 12, "tolerance": 0.3},
    "effects": ["elasticity", "gravity", "damping", "coarse_contact"]
})";

Scene scene_of(const std::string& text) {
    Result<Scene> scene = parse_scene(text, "scenes/box.json");
    EXPECT_TRUE(scene.ok());
    return std::move(*scene);
}

PreparedScene prepare_variant(const std::string& text, const std::string& name) {
    const Result<Scene> variant = make_variant(scene_of(text), name);
    EXPECT_TRUE(variant.ok()) << name;
    auto prepared = make_prepared_scene(*variant);
    EXPECT_TRUE(prepared.ok());
    return std::move(*prepared);
}

CostOptions options_of(const std::vector<std::string>& budgets, std::uint64_t steps) {
    CostOptions options;
    for (const std::string& budget : budgets) options.budgets.push_back({budget, parse_budget(budget)->limits});
    options.steps = steps;
    return options;
}

constexpr CostSpec kCost{12e-3, 0.3e-3};

TEST(Variants, ChangeOneThingAndRefuseWhatTheSceneSaysAlready) {
    const Scene scene = scene_of(kBoxOnTable);
    for (const VariantWord& word : list_variants()) {
        const Result<Scene> variant = make_variant(scene, word.name);
        const bool said = word.name == "covering" || word.name == "surface" || word.name == "coarse";
        EXPECT_EQ(variant.ok(), !said) << word.name;
        if (said) {
            EXPECT_NE(variant.error().message.find("already"), std::string::npos);
        }
    }
    const Result<Scene> unknown = make_variant(scene, "fastest");
    ASSERT_FALSE(unknown.ok());
    EXPECT_NE(unknown.error().message.find("heuristic"), std::string::npos) << "the message lists what is known";
}

TEST(Variants, WithTreesThatHoldTheirSurfaceMissNothingAtAnyBudget) {
    const PreparedScene own = test::prepare(kBoxOnTable);
    const PreparedScene wrapped = prepare_variant(kBoxOnTable, "wrapped"), spheres = prepare_variant(kBoxOnTable, "spheres");
    CostOptions options = options_of({"work:100", "exact"}, 40);
    options.variants = {{"wrapped", &wrapped.model}, {"spheres", &spheres.model}};
    const CostTable table = *measure_cost(own, kCost, options);
    ASSERT_EQ(table.rows.size(), 6u);
    EXPECT_EQ(table.rows[2].name(), "work:100 wrapped");
    EXPECT_EQ(table.rows[5].name(), "exact spheres");
    for (const CostRow& row : table.rows) {
        EXPECT_EQ(row.contacts.missed, 0u) << row.name();
        EXPECT_GT(row.contacts.reference, 0u);
        EXPECT_EQ(row.steps, 40u);
    }
    const CostTable alone = *measure_cost(own, kCost, options_of({"work:100", "exact"}, 40));
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(table.rows[k].contacts.reference, alone.rows[k].contacts.reference) << "as many steps are compared as without variants";
        EXPECT_EQ(table.rows[k].contacts.spurious, alone.rows[k].contacts.spurious);
    }
    EXPECT_EQ(table.rows[5].contacts.reference, alone.rows[1].contacts.reference);
    EXPECT_GT(table.rows[5].trajectory.hausdorff, 0.0) << "spheres overlap before surfaces do";
    EXPECT_NE(table.rows[3].leaf_contacts_mean, table.rows[1].leaf_contacts_mean) << "other trees have other leaves";
    const std::string csv = cost_csv(table);
    EXPECT_NE(csv.find(",variant\n"), std::string::npos);
    EXPECT_NE(csv.find(",wrapped\n"), std::string::npos);
}

TEST(Variants, WithoutTheExactStageLoseIt) {
    const std::string text = test::bent_tube_scene({.host_body = test::kOrgan});
    const PreparedScene own = test::prepare(text), coarse = prepare_variant(text, "coarse");
    CostOptions options = options_of({"exact"}, 60);
    options.variants = {{"coarse", &coarse.model}};
    const CostTable table = *measure_cost(own, {}, options);
    ASSERT_EQ(table.rows.size(), 2u);
    EXPECT_EQ(table.rows[0].exact_steps, 60u);
    EXPECT_EQ(table.rows[1].exact_steps, 0u);
}

TEST(Variants, WithCulledCandidatesAnswerTheSame) {
    const std::string text = test::bent_tube_scene({.host_body = test::kOrgan});
    const PreparedScene own = test::prepare(text), by_cpu = prepare_variant(text, "culled-cpu"), by_gl = prepare_variant(text, "culled-gl");
    CostOptions options = options_of({"exact"}, 60);
    options.variants = {{"culled-cpu", &by_cpu.model}, {"culled-gl", &by_gl.model}};
    const CostTable table = *measure_cost(own, {}, options);
    ASSERT_EQ(table.rows.size(), 3u);
    EXPECT_GT(table.rows[0].contacts.reference, 0u);
    EXPECT_EQ(std::count_if(table.notices.begin(), table.notices.end(), [](const std::string& n) { return n.starts_with("culled-gl: culling by "); }), 1);
    for (const std::size_t culled : {1u, 2u}) {
        EXPECT_EQ(table.rows[culled].contacts.missed + table.rows[culled].contacts.spurious, 0u);
        EXPECT_EQ(table.rows[culled].force_error_rel, 0.0);
        EXPECT_EQ(table.rows[culled].state_hash, table.rows[0].state_hash);
    }
}

class Parts : public test::Folder {};

bool same_run(const CostOwnRun& a, const CostOwnRun& b) {
    return a.steps == b.steps && a.state_hash == b.state_hash && a.trajectory.sum_sq == b.trajectory.sum_sq &&
           a.trajectory.hausdorff == b.trajectory.hausdorff && a.curve.size() == b.curve.size() && a.step_ms.p99 == b.step_ms.p99 &&
           a.failure == b.failure && a.tip_distance_max_m == b.tip_distance_max_m;
}

TEST_F(Parts, GoOnWhereAMeasurementWasInterrupted) {
    const PreparedScene prepared = test::prepare(kBoxOnTable);
    CostOptions options = options_of({"work:0", "work:300", "exact"}, 25);
    CostParts parts(out / "parts", CostParts::key_of(prepared.model, options));
    options.parts = &parts;
    int rows_begun = 0;
    options.progress = [&](const std::string& what) { rows_begun += what.find("by itself, step 1/") != std::string::npos; };
    options.interrupted = [&] { return rows_begun == 3; }; // in the first steps of the third row
    const CostTable first = *measure_cost(prepared, kCost, options);
    EXPECT_TRUE(first.interrupted);
    EXPECT_EQ(parts.count(3), 3u) << "the exact run and two rows";
    rows_begun = 0;
    options.interrupted = [] { return false; };
    const CostTable second = *measure_cost(prepared, kCost, options);
    EXPECT_EQ(rows_begun, 1) << "only the row that was not finished";
    EXPECT_FALSE(second.interrupted);
    for (std::size_t k = 0; k < 2; ++k) EXPECT_TRUE(same_run(first.rows[k], second.rows[k])) << k << ": down to its times";
    options.parts = nullptr;
    const CostTable whole = *measure_cost(prepared, kCost, options);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(second.rows[k].state_hash, whole.rows[k].state_hash);
        EXPECT_EQ(second.rows[k].trajectory.sum_sq, whole.rows[k].trajectory.sum_sq);
        EXPECT_EQ(second.rows[k].contacts.spurious, whole.rows[k].contacts.spurious);
    }
    parts.remove(3);
    EXPECT_FALSE(std::filesystem::exists(out / "parts"));
}

/// The compared stretch may begin late: the exact run goes there alone, and every row begins from its state.
TEST(Cost, FromLaterOnEveryRunBeginsWhereTheExactOneIs) {
    const PreparedScene prepared = test::prepare(kBoxOnTable);
    const CostTable whole = *measure_cost(prepared, kCost, options_of({"exact"}, 25));
    CostOptions options = options_of({"work:0", "exact"}, 10);
    options.variants.push_back({"same", &prepared.model});
    options.from = 15;
    const CostTable late = *measure_cost(prepared, kCost, options);
    EXPECT_EQ(late.from, 15u);
    EXPECT_EQ(late.steps, 10u);
    EXPECT_EQ(late.rows[1].state_hash, whole.rows[0].state_hash) << "15 and 10 steps are 25";
    EXPECT_EQ(late.rows[3].state_hash, whole.rows[0].state_hash) << "of a variant, too";
    for (const std::size_t exact : {std::size_t{1}, std::size_t{3}}) {
        EXPECT_EQ(late.rows[exact].trajectory.hausdorff, 0.0);
        EXPECT_EQ(late.rows[exact].force_error_rel, 0.0);
        EXPECT_EQ(late.rows[exact].contacts.missed + late.rows[exact].contacts.spurious, 0u);
    }
    EXPECT_GT(late.rows[1].contacts.reference, 0u) << "it lies on the table by then";
    EXPECT_GT(late.rows[0].curve.front().time_s, 15 * prepared.model.step_s);
    EXPECT_NE(CostParts::key_of(prepared.model, options), CostParts::key_of(prepared.model, options_of({"work:0", "exact"}, 10)));
}

/// The way to where the compared stretch begins is gone once, whoever needs the state and however often it is interrupted.
TEST_F(Parts, KeepWhereTheComparedStretchBegins) {
    const PreparedScene prepared = test::prepare(kBoxOnTable);
    CostOptions options = options_of({"work:0", "exact"}, 6);
    options.from = 9;
    const CostTable alone = *measure_cost(prepared, kCost, options);
    CostParts parts(out / "parts", CostParts::key_of(prepared.model, options));
    options.parts = &parts;
    std::size_t ways = 0;
    options.progress = [&](const std::string& what) { ways += what.find("begins, step 1/") != std::string::npos; };
    ASSERT_TRUE(measure_exact_run(prepared, options).ok());
    ASSERT_TRUE(measure_own_run(prepared, options, 0).ok());
    EXPECT_EQ(ways, 1u);
    const CostTable shared = *measure_cost(prepared, kCost, options);
    EXPECT_EQ(ways, 1u);
    for (std::size_t k = 0; k < 2; ++k) {
        EXPECT_EQ(shared.rows[k].state_hash, alone.rows[k].state_hash);
        EXPECT_EQ(shared.rows[k].force_error_rel, alone.rows[k].force_error_rel);
        EXPECT_EQ(shared.rows[k].trajectory.sum_sq, alone.rows[k].trajectory.sum_sq);
    }
    const std::string bytes = *read_file_bytes(out / "parts" / "start.bin");
    for (const std::size_t kept : {std::size_t{0}, std::size_t{20}, std::size_t{40}, bytes.size() / 2, bytes.size() - 1}) {
        std::ofstream(out / "parts" / "start.bin", std::ios::binary) << bytes.substr(0, kept);
        EXPECT_FALSE(parts.start(prepared.model).has_value()) << kept << " bytes of " << bytes.size();
    }
    parts.remove(2);
    EXPECT_FALSE(std::filesystem::exists(out / "parts"));
}

TEST(Cost, TheComparedStretchLiesWithinTheSceneUnlessStepsAreAskedFor) {
    const PreparedScene prepared = test::prepare(kBoxOnTable); // 200 steps of 5 ms
    const SceneModel& model = prepared.model;
    std::mt19937_64 random(33);
    for (int k = 0; k < 200; ++k) {
        const std::uint64_t step = std::uniform_int_distribution<std::uint64_t>(0, 2 * model.step_count)(random), usual = 1 + random() % 300;
        const double from = static_cast<double>(step) * model.step_s;
        const auto chosen = choose_stretch(model, from, std::nullopt, usual);
        ASSERT_EQ(chosen.ok(), step < model.step_count) << step;
        if (chosen) {
            EXPECT_EQ(chosen->from, step) << "a time that was written comes back as its step";
            EXPECT_EQ(chosen->steps, std::min(usual, model.step_count - step));
        }
        EXPECT_EQ(choose_stretch(model, from, usual, 1)->steps, usual);
    }
    for (const double from : {-1.0, 1e7, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()})
        EXPECT_FALSE(choose_stretch(model, from, 10, 10).ok()) << from;
}

TEST(Cost, TheCommandThatRepeatsATableBeginsWhereItDid) {
    Scene scene = scene_of(kBoxOnTable);
    scene.cost.from = 0.5;
    CostTable table;
    EXPECT_NE(cost_command_text(scene, table).find(" --from 0 "), std::string::npos) << "else the scene's own would hold";
    table.from = 123457;
    EXPECT_NE(cost_command_text(scene, table).find(" --from 617.285 "), std::string::npos) << cost_command_text(scene, table);
    scene.cost.from = 0.0, table.from = 0;
    EXPECT_EQ(cost_command_text(scene, table).find("--from"), std::string::npos);
}

TEST_F(Parts, OfAnotherMeasurementOrDamagedAreNotThere) {
    const PreparedScene prepared = test::prepare(kBoxOnTable);
    const CostOptions options = options_of({"exact"}, 4);
    const CostParts parts(out, CostParts::key_of(prepared.model, options));
    ExactRun run = run_exactly(prepared.model, options);
    ASSERT_TRUE(parts.keep(run).ok());
    CostOwnRun own;
    own.trajectory.hausdorff = std::numeric_limits<double>::infinity();
    ASSERT_TRUE(parts.keep(0, own).ok());
    ASSERT_TRUE(parts.exact_run() && parts.own_run(0));
    EXPECT_EQ(parts.own_run(0)->trajectory.hausdorff, own.trajectory.hausdorff);
    EXPECT_EQ(parts.exact_run()->shapes.back().surfaces, run.shapes.back().surfaces);
    CostOptions longer = options;
    longer.steps = 5;
    EXPECT_EQ(CostParts(out, CostParts::key_of(prepared.model, longer)).count(1), 0u) << "another number of steps";
    const auto exact = out / "exact.bin";
    const std::string bytes = *read_file_bytes(exact);
    for (const std::size_t kept : {std::size_t{0}, std::size_t{10}, std::size_t{40}, bytes.size() / 2, bytes.size() - 1}) {
        std::ofstream(exact, std::ios::binary) << bytes.substr(0, kept);
        EXPECT_FALSE(parts.exact_run().has_value()) << kept << " bytes of " << bytes.size();
    }
    std::string huge = bytes;
    for (std::size_t k = 54; k < 62 && k < huge.size(); ++k) huge[k] = '\x7f'; // a count beyond all memory
    std::ofstream(exact, std::ios::binary) << huge;
    EXPECT_FALSE(parts.exact_run().has_value());
    std::ofstream(out / "row_0.json") << R"({"key": 1, "run": {}})";
    EXPECT_FALSE(parts.own_run(0).has_value());
}

} // namespace
} // namespace trocar::engine
