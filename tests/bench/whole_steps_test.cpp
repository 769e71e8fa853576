// The benches of whole steps: what they count, and that measuring changes nothing of a step. No time is tested.
#include "bench/bench.hpp"
#include "bench/headlines.hpp"
#include "bench/whole_steps/growth_curve.hpp"
#include "bench/whole_steps/growth_scenes.hpp"
#include "bench/whole_steps/part_meter.hpp"
#include "bench/whole_steps/roofline.hpp"
#include "bench/whole_steps/step_work.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/prepare/process.hpp"
#include "engine/step/simulator.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <linux/perf_event.h>

#include <algorithm>
#include <array>
#include <map>

namespace trocar::engine {
namespace {

PreparedScene prepare(const GrownScene& grown) {
    const Result<Scene> scene = parse_scene(grown.text, "grown.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    Result<PreparedScene> prepared = make_prepared_scene(*scene);
    EXPECT_TRUE(prepared.ok()) << (prepared.ok() ? "" : prepared.error().to_string());
    return prepared.ok() ? std::move(*prepared) : PreparedScene{};
}

const Bench& bench_named(std::string_view name) {
    const auto all = benches();
    return *std::find_if(all.begin(), all.end(), [&](const Bench& bench) { return bench.name == name; });
}

BenchTable measure_quick(std::string_view name) {
    std::filesystem::current_path(TROCAR_SOURCE_DIR); // the shipped scenes are found from there
    auto table = bench_named(name).run(BenchOptions{.quick = true});
    EXPECT_TRUE(table.ok()) << (table.ok() ? "" : table.error().to_string());
    return table.ok() ? std::move(*table) : BenchTable{};
}

TEST(Growth, TheExponentIsThatOfAPowerLaw) {
    std::vector<GrowthPoint> points;
    for (const std::size_t n : {10u, 100u, 1000u, 5000u}) points.push_back({n, 0.3 * std::pow(static_cast<double>(n), 1.15), 1000.0 + 64.0 * static_cast<double>(n)});
    EXPECT_NEAR(*fit_exponent(points), 1.15, 1e-12);
    EXPECT_NEAR(*bytes_per_element(points), 64.0, 1e-9) << "what every size has alike is no element's";
    EXPECT_FALSE(fit_exponent(std::span(points).first(1)).has_value());
    EXPECT_FALSE(bytes_per_element(std::span(points).first(1)).has_value());
}

TEST(Growth, OfAStaticWallAStepLooksAtTheSameTrianglesWhateverLiesBeyond) {
    auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    std::array<std::uint64_t, 2> candidates{}, places{};
    std::array<std::size_t, 2> walls{};
    for (const std::size_t k : {0u, 1u}) {
        const auto grown = make_wall_scene(k == 0 ? 12'000 : 48'000, false, folder->path());
        ASSERT_TRUE(grown.ok());
        const PreparedScene prepared = prepare(*grown);
        walls[k] = grown->elements;
        Simulator simulator(prepared.model);
        for (int step = 0; step < 90; ++step) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            candidates[k] += report.candidates;
            places[k] += report.pressing_contacts;
        }
    }
    EXPECT_GT(walls[1], 3 * walls[0]);
    EXPECT_GT(places[0], 0u) << "the wire must meet the wall";
    EXPECT_NEAR(static_cast<double>(candidates[1]), static_cast<double>(candidates[0]), 0.05 * static_cast<double>(candidates[0]));
    EXPECT_NEAR(static_cast<double>(places[1]), static_cast<double>(places[0]), 0.05 * static_cast<double>(places[0]));
}

/// Counts what it is told.
class PartCounter final : public StepProbe {
public:
    void begin(ProbedPart part) noexcept override {
        ++begun[static_cast<std::size_t>(part)];
        ++open;
        deepest = std::max(deepest, open);
    }
    void end(ProbedPart part) noexcept override { ++ended[static_cast<std::size_t>(part)], --open; }
    std::array<unsigned, kProbedParts> begun{}, ended{};
    int open = 0, deepest = 0;
};

TEST(Probe, IsToldOfEveryPartOnceAStepAndChangesNoBit) {
    const PreparedScene prepared = prepare(make_instruments_scene(2, true));
    Simulator alone(prepared.model), watched(prepared.model);
    PartCounter counter;
    watched.set_probe(&counter);
    constexpr unsigned kSteps = 30;
    for (unsigned k = 0; k < kSteps; ++k) alone.step(), watched.step();
    EXPECT_EQ(alone.hash(), watched.hash());
    EXPECT_EQ(counter.begun, counter.ended);
    EXPECT_EQ(counter.open, 0);
    EXPECT_GE(counter.deepest, 2) << "parts within parts";
    for (std::size_t k = 0; k < kFirstInnerPart; ++k) EXPECT_EQ(counter.begun[k], kSteps) << k;
    for (const ProbedPart part : {ProbedPart::Planes, ProbedPart::RodSolve, ProbedPart::Skin, ProbedPart::Tests})
        EXPECT_GE(counter.begun[static_cast<std::size_t>(part)], kSteps) << static_cast<int>(part);
    const Simulator other = watched.fork();
    watched.set_probe(nullptr);
    watched.step();
    EXPECT_EQ(counter.begun[0], kSteps) << "nobody is told any more";
}

TEST(Probe, OfSolidsIsToldOfTheirImpulses) {
    const PreparedScene prepared = prepare(make_heap_scene(2));
    Simulator simulator(prepared.model);
    PartCounter counter;
    simulator.set_probe(&counter);
    for (int k = 0; k < 20; ++k) simulator.step();
    EXPECT_GT(counter.begun[static_cast<std::size_t>(ProbedPart::Solver)], 0u);
    EXPECT_EQ(counter.begun, counter.ended);
}

TEST(PartMeter, KeepsATimeForEveryStepAndForgetsAWarmUp) {
    const PreparedScene prepared = prepare(make_scattered_scene(1));
    const PerfCounters none({});
    EXPECT_TRUE(none.counts()) << "of no event all are counted";
    Simulator simulator(prepared.model);
    PartMeter meter(none, 8);
    simulator.set_probe(&meter);
    for (int k = 0; k < 3; ++k) simulator.step(), meter.end_step();
    meter.forget();
    for (int k = 0; k < 5; ++k) simulator.step(), meter.end_step();
    EXPECT_EQ(meter.of(ProbedPart::Tissue).ms.size(), 5u);
    EXPECT_EQ(meter.of(ProbedPart::Tissue).times, 5u);
    EXPECT_EQ(meter.of(ProbedPart::Planes).times, 0u);
}

TEST(PerfCounters, CountWhatTheKernelLetsThemOrSayWhyNot) {
    const PerfEvent faults[] = {{"page faults", PERF_TYPE_SOFTWARE, PERF_COUNT_SW_PAGE_FAULTS}, {"minor page faults", PERF_TYPE_SOFTWARE, PERF_COUNT_SW_PAGE_FAULTS_MIN}};
    const PerfCounters counters(faults);
    if (!counters.counts()) GTEST_SKIP() << counters.refusal();
    const CounterValues before = counters.read();
    std::vector<char> touched(std::size_t{16} << 20, 'x'); // fresh pages
    const CounterValues after = counters.read();
    EXPECT_EQ(touched.back(), 'x');
    EXPECT_GT(after[0], before[0]);
    EXPECT_GT(after[1], before[1]);
    const PerfEvent unknown[] = {{"nothing", PERF_TYPE_SOFTWARE, 9999}};
    const PerfCounters refused(unknown);
    EXPECT_FALSE(refused.counts());
    EXPECT_NE(refused.refusal().find("'nothing'"), std::string::npos) << refused.refusal();
    EXPECT_EQ(refused.read(), CounterValues{});
}

TEST(Roofline, TheLevelIsTheOneThatHoldsTheArraysAndTheRoofTheLowerOfTwo) {
    Roofline roofline{{{"near", 50, 100, 200.0}, {"far", 5000, 10000, 40.0}, {"memory", 50000, static_cast<std::size_t>(-1), 10.0}}, 100.0};
    EXPECT_EQ(roofline.level_of(100).name, "near");
    EXPECT_EQ(roofline.level_of(101).name, "far");
    EXPECT_EQ(roofline.level_of(20000).name, "memory");
    EXPECT_DOUBLE_EQ(roofline.roof(2.0, 101), 80.0) << "bandwidth bounds it";
    EXPECT_DOUBLE_EQ(roofline.roof(2.0, 50), 100.0) << "arithmetic bounds it";
}

TEST(StepWork, OfTissueGrowsWithTheForcesThatWereEvaluatedAndOfOtherLawsIsUnknown) {
    PreparedScene prepared = prepare(make_scattered_scene(2));
    Simulator simulator(prepared.model);
    const StepReport& report = simulator.step();
    std::size_t tets = 0;
    for (const BodyModel& body : prepared.model.bodies) tets += body.tissue->tet_count();
    EXPECT_GE(report.tet_evaluations, tets * report.substeps);
    EXPECT_EQ(report.tet_evaluations % (tets / 2), 0u) << "whole passes over a body";
    const auto once = find_tissue_work(prepared.model, report.tet_evaluations), twice = find_tissue_work(prepared.model, 2 * report.tet_evaluations);
    ASSERT_TRUE(once && twice);
    EXPECT_DOUBLE_EQ(twice->bytes, 2.0 * once->bytes);
    EXPECT_DOUBLE_EQ(twice->flops, 2.0 * once->flops);
    EXPECT_EQ(twice->working_set, once->working_set);
    EXPECT_GT(find_surface_work(prepared.model, simulator.raw_state())->flops, 0.0);
    prepared.model.bodies[1].tissue->material.law = fem::MaterialLaw::Ogden;
    EXPECT_FALSE(find_tissue_work(prepared.model, 1000).has_value());
}

TEST(StepBench, PartsAddUpToTheStepAndTheRooflineIsThere) {
    const BenchTable table = measure_quick("step");
    double whole = 0.0, sum = 0.0;
    int levels = 0;
    bool has_roof = false;
    for (const BenchRow& row : table.rows) {
        levels += row.contains("gb_per_s");
        has_roof = has_roof || row.contains("of_roof");
        if (row["scene"] == "roofline" || row["within"] != "") continue;
        (row["part"] == "step" ? whole : sum) += row["ms_mean"].get<double>();
    }
    EXPECT_EQ(levels, 4);
    EXPECT_TRUE(has_roof);
    EXPECT_GT(whole, 0.0);
    EXPECT_NEAR(sum, whole, 1e-9 * whole);
    EXPECT_FALSE(headlines_of("step", table).empty());
}

TEST(GrowthBench, EveryCurveHasItsSizesAndAVerdict) {
    const BenchTable table = measure_quick("growth");
    std::map<std::string, int> sizes;
    int verdicts = 0;
    for (const BenchRow& row : table.rows) {
        if (row.contains("step_ms_p50")) {
            ++sizes[row["curve"]];
            EXPECT_GT(row["step_ms_p50"].get<double>(), 0.0) << row;
        }
        if (row.contains("met")) {
            ++verdicts;
            EXPECT_EQ(row["met"].get<bool>(), row["exponent"].get<double>() <= row["wanted"].get<double>()) << row;
        }
    }
    EXPECT_EQ(sizes.size(), 7u);
    for (const auto& [curve, count] : sizes) EXPECT_EQ(count, 2) << curve;
    EXPECT_EQ(verdicts, 7);
    EXPECT_EQ(headlines_of("growth", table).size(), 7u);
}

} // namespace
} // namespace trocar::engine
