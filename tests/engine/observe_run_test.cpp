#include "observe_fixture.hpp"

#include "engine/report/statistics.hpp"
#include "engine/report/step_table.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <limits>

#include <sys/wait.h>
#include <unistd.h>

namespace trocar::engine::test {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

namespace {

const char* const kContractColumns =
    "step,time_s,substeps,fem_ms,steer_ms,descend_ms,exact_ms,respond_ms,total_ms,budget_ms,pairs_tested,pairs_open,leaf_contacts,"
    "level_reached,exact_ran,exact_contacts,unresolved,min_volume_ratio,inverted_tets,kinetic_j,elastic_j,tip_x,tip_y,tip_z,insertion_m,"
    "rotation_rad";

std::vector<std::string> fields_of(const std::string& line) {
    std::vector<std::string> fields(1);
    for (const char c : line) {
        if (c == ',')
            fields.emplace_back();
        else
            fields.back() += c;
    }
    return fields;
}

} // namespace

class RunFolder : public Folder {};

TEST_F(RunFolder, HoldsARowPerStepUnderTheContractsColumns) {
    const auto summary = tube_run().into(out, 20);
    ASSERT_TRUE(summary.ok()) << summary.error().to_string();
    const std::vector<std::string> lines = lines_of("steps.csv");
    ASSERT_EQ(lines.size(), 21u);
    EXPECT_THAT(lines[0], StartsWith(std::string(kContractColumns) + ","));
    const std::vector<std::string> head = fields_of(lines[0]);
    for (std::size_t k = 1; k < lines.size(); ++k) {
        const std::vector<std::string> fields = fields_of(lines[k]);
        ASSERT_EQ(fields.size(), head.size());
        EXPECT_EQ(fields[0], std::to_string(k));
        EXPECT_EQ(std::stod(fields[1]), 0.01 * static_cast<double>(k));
        EXPECT_EQ(fields[9], "inf") << "exact: no limit in milliseconds";
    }
    EXPECT_THAT(names(), Not(Contains("steps.csv.partial")));
    EXPECT_THAT(names(), Not(Contains(".trocar.lock")));
}

TEST_F(RunFolder, HoldsASummaryWithEveryKeyOfTheContract) {
    const auto done = tube_run().into(out, 20);
    ASSERT_TRUE(done.ok());
    const nlohmann::json json = summary();
    for (const char* key : {"scene",
                            "steps",
                            "mode",
                            "budget",
                            "budget_scope",
                            "simulated_s",
                            "wall_s",
                            "realtime_factor",
                            "step_ms",
                            "collision_ms",
                            "budget_kept",
                            "realtime_kept",
                            "worst_overrun_ms",
                            "substeps",
                            "stable_step_s",
                            "min_volume_ratio",
                            "inverted_tets_max",
                            "exact_steps",
                            "contacts_total",
                            "unresolved_total",
                            "assumed_total",
                            "lumen_exits",
                            "energy_j",
                            "stages_ms",
                            "effects",
                            "state_hash"})
        EXPECT_TRUE(json.contains(key)) << key;
    for (const char* series : {"step_ms", "collision_ms"}) {
        const nlohmann::json& p = json[series];
        EXPECT_LE(p["p50"].get<double>(), p["p95"].get<double>());
        EXPECT_LE(p["p95"].get<double>(), p["p99"].get<double>());
        EXPECT_LE(p["p99"].get<double>(), p["max"].get<double>());
        EXPECT_GT(p["p50"].get<double>(), 0.0);
    }
    EXPECT_EQ(json["steps"], 20);
    EXPECT_EQ(json["mode"], "exact");
    EXPECT_EQ(json["budget"], "exact");
    EXPECT_EQ(json["budget_scope"], "collision");
    EXPECT_NEAR(json["simulated_s"].get<double>(), 0.2, 1e-12);
    EXPECT_NEAR(json["realtime_factor"].get<double>() * json["wall_s"].get<double>(), 0.2, 1e-12);
    EXPECT_EQ(json["budget_kept"], 1.0);
    EXPECT_EQ(json["lumen_exits"], 0);
    EXPECT_EQ(json["exact_steps"], 20);
    EXPECT_EQ(json["effects"], (nlohmann::json{"coarse_contact", "exact_contact"}));
    EXPECT_THAT(json["state_hash"].get<std::string>(), ::testing::MatchesRegex("[0-9a-f]{16}"));
    EXPECT_EQ(done->state_hash, json["state_hash"]);
    EXPECT_EQ(json["bodies"][0]["name"], "tube");
}

TEST_F(RunFolder, CountsWholeStepsAgainstTheTimeTheySimulate) {
    ASSERT_TRUE(tube_run().into(out, 20).ok());
    const std::vector<std::string> lines = lines_of("steps.csv");
    std::uint64_t slower = 0;
    for (std::size_t k = 1; k < lines.size(); ++k) slower += std::stod(fields_of(lines[k])[8]) > 10.0; // total_ms
    EXPECT_EQ(summary()["realtime_overruns"], slower);
    EXPECT_DOUBLE_EQ(summary()["realtime_kept"].get<double>(), 1.0 - static_cast<double>(slower) / 20.0);
}

TEST_F(RunFolder, SaysTheSameTwiceExceptForTimes) {
    const auto clean = [&] {
        nlohmann::json json = summary();
        for (const char* timing : {"wall_s", "realtime_factor", "step_ms", "collision_ms", "charged_ms", "stages_ms", "observe_s", "prepare_s",
                                   "realtime_kept", "realtime_overruns"})
            json.erase(timing);
        return json;
    };
    ASSERT_TRUE(tube_run().into(out, 15).ok());
    const nlohmann::json first = clean();
    ASSERT_TRUE(tube_run().into(out, 15, true).ok());
    EXPECT_EQ(first, clean());
}

TEST_F(RunFolder, NamesTheSceneByItsPathInTheProject) {
    write("project/CMakePresets.json", "{}");
    write("project/assets/scenes/tiny.json", kTubeScene);
    TinyRun run(kTubeScene, (out / "project" / "assets" / "scenes" / "tiny.json").string());
    out /= "run";
    ASSERT_TRUE(run.into(out, 1).ok());
    EXPECT_EQ(summary()["scene"], "assets/scenes/tiny.json");
}

TEST_F(RunFolder, OfNoStepsIsWhole) {
    const auto done = tube_run().into(out, 0);
    ASSERT_TRUE(done.ok()) << done.error().to_string();
    EXPECT_EQ(lines_of("steps.csv").size(), 1u);
    EXPECT_EQ(summary()["steps"], 0);
    EXPECT_THAT(text_of("report.html"), HasSubstr("No step was taken"));
}

TEST_F(RunFolder, KeepsTheOutputsOfAnEarlierRunWhereAnXraySourceIsRefused) {
    const TinyRun inside(R"({"name": "ball", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.2},
        "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "radius": 30, "subdivisions": 2}}},
        "outputs": {"fluoroscopy": {"views": [{"name": "ap", "isocentre": [0, 750, 0], "sid": 1050, "sod": 750, "pixels": [64, 64]}]}}})");
    write("summary.json", "of an earlier run");
    const auto refused = inside.into(out, 1, true);
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().message, HasSubstr("stands inside \"ball\""));
    EXPECT_EQ(text_of("summary.json"), "of an earlier run");
}

TEST_F(RunFolder, OfAKilledRunCanBeRead) {
    const TinyRun& run = tube_run();
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
        ObserveOptions options;
        options.out = out;
        auto observer = RunObserver::open(run.scene, run.prepared, options);
        StepReport report;
        Simulator simulator(run.prepared.model);
        for (int k = 1; k < 5000; ++k) { // more rows than any buffer holds
            report.step = static_cast<std::uint64_t>(k);
            (void)(*observer)->after_step(simulator, report);
        }
        raise(SIGKILL);
    }
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    const std::vector<std::string> lines = lines_of("steps.csv.partial");
    EXPECT_GT(lines.size(), 1000u);
    EXPECT_FALSE(fs::exists(out / "steps.csv"));
    EXPECT_FALSE(fs::exists(out / "summary.json"));
    EXPECT_TRUE(tube_run().into(out, 2, true).ok()) << "and a new run takes its place";
    EXPECT_THAT(names(), Not(Contains("steps.csv.partial")));
}

TEST_F(RunFolder, OfAStoppedRunHoldsTheLastGoodStateAndSaysWhy) {
    const TinyRun& run = tube_run();
    ObserveOptions options;
    options.out = out;
    auto observer = RunObserver::open(run.scene, run.prepared, options);
    ASSERT_TRUE(observer.ok());
    Simulator simulator(run.prepared.model);
    ASSERT_TRUE((*observer)->after_step(simulator, simulator.step()).ok());
    StepReport bad = simulator.step();
    bad.finite = false;
    bad.kinetic_j = std::nan("");
    bad.failure = "wire: node 7 is <not> finite";
    ASSERT_TRUE((*observer)->after_step(simulator, bad).ok());
    const RunSummary done = (*observer)->finish(simulator, 0.1, false);
    EXPECT_THAT(done.missing_outputs, testing::IsEmpty());
    EXPECT_FALSE(done.finite);
    EXPECT_EQ(done.failure, bad.failure);
    EXPECT_EQ(lines_of("steps.csv").size(), 2u) << "the step that failed was not done";
    const nlohmann::json json = summary();
    EXPECT_EQ(json["finite"], false);
    EXPECT_EQ(json["failed_step"], 2);
    EXPECT_EQ(json["last_good_state"], "last_good_state");
    EXPECT_TRUE(fs::exists(out / "last_good_state" / "00_tube.vtp"));
    EXPECT_TRUE(fs::exists(out / "last_good_state" / "01_wire.vtp"));
    EXPECT_THAT(text_of("report.html"), HasSubstr("wire: node 7 is &lt;not&gt; finite"));
}

TEST_F(RunFolder, HoldsStatesForParaViewOnRequest) {
    ASSERT_TRUE(tube_run().into(out, 20, false, true).ok());
    const std::string collection = text_of("record/states.pvd");
    for (const int step : {0, 1, 7, 20}) {
        const std::string file = fmt::format("01_wire_{:06}.vtp", step);
        EXPECT_THAT(collection, HasSubstr(file));
        EXPECT_TRUE(fs::exists(out / "record" / file)) << file;
    }
    EXPECT_THAT(collection, HasSubstr("00_tube.vtp"));
    EXPECT_TRUE(fs::exists(out / "record" / "00_tube.vtp"));
}

TEST(StepTableRows, KeepAllDigits) {
    StepReport report;
    report.time_s = 0.1 + 0.2;
    report.tip.x() = 1.0 / 3.0;
    report.kinetic_j = 5e-324;
    report.pairs_tested = 12345678901234567ULL;
    std::string row;
    append_step_row(report, std::numeric_limits<double>::infinity(), row);
    const std::vector<std::string> fields = fields_of(row);
    EXPECT_EQ(std::stod(fields[1]), 0.1 + 0.2);
    EXPECT_EQ(fields[10], "12345678901234567");
    EXPECT_EQ(fields[19], "5e-324");
    EXPECT_EQ(std::stod(fields[21]), 1.0 / 3.0);
}

TEST(Percentile, IsAMeasuredValueOfTheNearestRank) {
    std::vector<double> values;
    for (int k = 200; k >= 1; --k) values.push_back(k);
    const Percentiles p = find_percentiles(values);
    EXPECT_EQ(p.p50, 100.0);
    EXPECT_EQ(p.p95, 190.0);
    EXPECT_EQ(p.p99, 198.0);
    EXPECT_EQ(p.max, 200.0);
    std::vector<double> one{3.0}, none;
    EXPECT_EQ(find_percentiles(one).p50, 3.0);
    EXPECT_EQ(find_percentiles(one).max, 3.0);
    EXPECT_EQ(find_percentiles(none).max, 0.0);
}

TEST(Curves, StaySmallAndLoseNoSpike) {
    Curve curve;
    StepReport report;
    constexpr int kSteps = 100'000;
    for (int k = 1; k <= kSteps; ++k) {
        report.time_s = k;
        report.ms.total = k == 54'321 ? 99.0 : 1.0;
        report.exact_ran = k % 2 == 0;
        curve.add(report);
    }
    EXPECT_LE(curve.points().size(), Curve::kMaxPoints);
    EXPECT_GT(curve.points().size(), Curve::kMaxPoints / 4);
    std::uint64_t steps = 0, exact = 0;
    double largest = 0.0, last = 0.0;
    for (const CurvePoint& point : curve.points()) {
        EXPECT_GT(point.time_s, last);
        last = point.time_s;
        steps += point.steps;
        exact += point.exact_steps;
        largest = std::max(largest, point.total_ms.max);
    }
    EXPECT_EQ(steps, kSteps);
    EXPECT_EQ(exact, kSteps / 2);
    EXPECT_EQ(largest, 99.0);
    EXPECT_EQ(last, kSteps);
}

TEST(Statistics, CountOverrunsAndWhatTheyCost) {
    RunStatistics statistics;
    StepReport report;
    for (const double charged : {1.0, 2.5, 1.5, 4.0}) {
        report.ms.budget = charged;
        report.budget_kept = charged <= 2.0;
        statistics.add(report, 2.0, 0);
    }
    EXPECT_EQ(statistics.overruns, 2u);
    EXPECT_EQ(statistics.worst_overrun_ms, 2.0);
    EXPECT_EQ(statistics.worst_charged_ms, 4.0);
}

TEST(Statistics, CountStepsSlowerThanRealTimeWhateverTheBudgetSays) {
    std::uint64_t seed = 7;
    RunStatistics statistics;
    StepReport report;
    std::uint64_t slower = 0;
    for (int k = 0; k < 1000; ++k) {
        seed = seed * 6364136223846793005ULL + 1442695040888963407ULL;
        report.ms.total = static_cast<double>(seed >> 60); // 0..15 ms, many of them just 10
        report.budget_kept = k % 3 != 0;
        statistics.add(report, 1.0, 0);
        slower += report.ms.total > 10.0;
    }
    EXPECT_EQ(statistics.count_slower_than_real_time(0.01), slower);
    EXPECT_EQ(statistics.count_slower_than_real_time(0.015), 0u);
    EXPECT_EQ(RunStatistics{}.count_slower_than_real_time(0.01), 0u);
}

} // namespace trocar::engine::test
