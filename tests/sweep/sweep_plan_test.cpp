// The plan of a sweep: its runs follow from their numbers, its text from the sweep, the scenes and the program.
#include "engine/experiments/sweep/result_store.hpp"
#include "engine/experiments/sweep/slurm.hpp"
#include "engine/experiments/sweep/sweep_page.hpp"
#include "sweep_fixture.hpp"

#include <set>

#include <sys/resource.h>

namespace trocar::engine {
namespace {

class SweepPlanTest : public SweepFolder {
protected:
    SweepPlan plan_of(const std::string& sweep) const {
        write("ball.json", kBall);
        const auto spec = read_sweep(write("sweep.json", sweep));
        EXPECT_TRUE(spec.ok()) << (spec.ok() ? "" : spec.error().to_string());
        const auto plan = make_plan(*spec);
        EXPECT_TRUE(plan.ok()) << (plan.ok() ? "" : plan.error().to_string());
        return *plan;
    }
};

const std::string kSweep = R"({"scene": "ball.json", "repeat": 3,
    "vary": {"/budget": ["exact", "work:5"], "/bodies/ball/surface/radius": {"from": 1, "to": 100, "count": 3, "scale": "log"}},
    "collect": {"hash": "/state_hash"}})";

TEST_F(SweepPlanTest, RunsAreTheProductWithTheFirstPointerSlowest) {
    const SweepPlan plan = plan_of(kSweep);
    ASSERT_EQ(plan.run_count(), 18u);
    const PlannedRun run = plan.run(3 * (1 * 3 + 2) + 1);
    EXPECT_EQ(run.settings[0].first, "/budget");
    EXPECT_EQ(run.settings[0].second, "\"work:5\"");
    EXPECT_EQ(run.settings[1].second, "100");
    EXPECT_EQ(run.repeat, 1u);
    EXPECT_EQ(plan.run(3).settings[1].second, "10");
}

TEST_F(SweepPlanTest, PicturesAndPagesAreMadeOnlyWhereTheyAreKept) {
    SweepPlan plan = plan_of(kSweep);
    const auto has = [&](const char* word) {
        const std::vector<std::string> words = plan.command_line(plan.run(0), "out");
        return std::count(words.begin(), words.end(), word);
    };
    EXPECT_EQ(has("--no-pictures"), 1);
    EXPECT_EQ(has("--no-report"), 1);
    plan.options = {"--no-pictures"};
    EXPECT_EQ(has("--no-pictures"), 1);
    plan.options.clear();
    plan.command = SweepCommand::Episode;
    EXPECT_EQ(has("--no-pictures") + has("--no-report"), 0) << "it makes none";
    plan.command = SweepCommand::Run, plan.keeps_folders = true;
    EXPECT_EQ(has("--no-pictures") + has("--no-report"), 0);
}

TEST_F(SweepPlanTest, EveryRunHasAKeyOfItsOwn) {
    const SweepPlan plan = plan_of(kSweep);
    std::set<std::string> keys;
    for (std::uint64_t k = 0; k < plan.run_count(); ++k) keys.insert(plan.run(k).key);
    EXPECT_EQ(keys.size(), plan.run_count());
}

TEST_F(SweepPlanTest, AKeyChangesWithTheSceneTheProgramAndWhatIsCollected) {
    const SweepPlan plan = plan_of(kSweep);
    const std::string key = plan.run(0).key;
    SweepPlan other = plan;
    other.program += "x";
    EXPECT_NE(other.run(0).key, key);
    other = plan;
    other.scenes[0].hash[0] = other.scenes[0].hash[0] == 'a' ? 'b' : 'a';
    EXPECT_NE(other.run(0).key, key);
    other = plan;
    other.collect[0].pointer = "/steps";
    EXPECT_NE(other.run(0).key, key);
    other = plan;
    other.chunk_runs = 7;
    EXPECT_EQ(other.run(0).key, key) << "how results are packed does not matter";
}

TEST_F(SweepPlanTest, ItsTextReadsBackTheSame) {
    const SweepPlan plan = plan_of(kSweep);
    const auto again = read_plan(write("plan.json", plan.text()));
    ASSERT_TRUE(again.ok()) << again.error().to_string();
    EXPECT_EQ(again->text(), plan.text());
    for (std::uint64_t k = 0; k < plan.run_count(); ++k) EXPECT_EQ(again->run(k).key, plan.run(k).key);
}

TEST_F(SweepPlanTest, AChangedSceneIsNoticed) {
    const SweepPlan plan = plan_of(kSweep);
    EXPECT_TRUE(check_unchanged(plan).ok());
    write("ball.json", kBall + " ");
    EXPECT_FALSE(check_unchanged(plan).ok());
    std::filesystem::remove(folder / "ball.json");
    EXPECT_FALSE(check_unchanged(plan).ok());
}

TEST_F(SweepPlanTest, AMillionRunsArePlannedAndOneMoreIsRefused) {
    const std::string sweep = R"({"scene": "ball.json", "repeat": 1000, "vary": {"/bodies/ball/surface/radius": {"from": 1, "to": 10, "count": COUNT}}})";
    const auto with_count = [&](const char* count) {
        std::string text = sweep;
        return text.replace(text.find("COUNT"), 5, count);
    };
    EXPECT_EQ(plan_of(with_count("1000")).run_count(), kMostRuns);
    const auto more = read_sweep(write("sweep.json", with_count("1001")));
    ASSERT_FALSE(more.ok());
    EXPECT_NE(more.error().message.find("1000000"), std::string::npos);
}

TEST_F(SweepPlanTest, ResultLinesReadBackAndDamagedOnesDoNot) {
    const RunResult result{5, "key", "failed: exit 3: \"stopped\",\n", {"1.5", "", "\xc3\xa4"}, R"({"a":[1,null]})"};
    const std::string line = result_line(result);
    ASSERT_EQ(line.back(), '\n');
    ASSERT_EQ(line.find('\n'), line.size() - 1) << "one line";
    const auto read = parse_result_line(line.substr(0, line.size() - 1));
    ASSERT_TRUE(read);
    EXPECT_EQ(read->run, result.run);
    EXPECT_EQ(read->status, result.status);
    EXPECT_EQ(read->values, result.values);
    EXPECT_EQ(read->figures, result.figures);
    for (std::size_t size = 0; size + 1 < line.size(); ++size) EXPECT_FALSE(parse_result_line(line.substr(0, size))) << size;
    for (std::size_t at = 0; at + 1 < line.size(); ++at) {
        std::string damaged = line.substr(0, line.size() - 1);
        damaged[at] ^= 1;
        EXPECT_FALSE(parse_result_line(damaged)) << at;
    }
}

TEST_F(SweepPlanTest, ResultsOfAnotherKeyDoNotCount) {
    const SweepPlan plan = plan_of(kSweep);
    const std::filesystem::path out = folder / "out";
    {
        auto part = PartFile::create(out, 0);
        ASSERT_TRUE(part.ok());
        ASSERT_TRUE(part->add({0, "other", "done", {"x"}, "null"}).ok());
        EXPECT_TRUE(ResultStore(out, plan).read(0).is_worked_on);
    }
    EXPECT_FALSE(ResultStore(out, plan).read(0).is_worked_on);
    EXPECT_TRUE(ResultStore(out, plan).read(0).runs.empty());
    auto part = PartFile::create(out, 0);
    ASSERT_TRUE(part.ok());
    ASSERT_TRUE(part->add({0, plan.run(0).key, "done", {"x"}, "null"}).ok());
    EXPECT_EQ(ResultStore(out, plan).read(0).runs.size(), 1u);
}

/// kB, the most that this process has held at once.
long peak_memory() {
    rusage used{};
    getrusage(RUSAGE_SELF, &used);
    return used.ru_maxrss;
}

TEST_F(SweepPlanTest, TheTableOfManyRunsIsNeverHeldWhole) {
    const SweepPlan plan = plan_of(R"({"scene": "ball.json", "repeat": 1000,
        "vary": {"/bodies/ball/surface/radius": {"from": 1, "to": 10, "count": 200}}, "collect": {"steps": "/steps", "text": "/text"}})");
    ASSERT_EQ(plan.run_count(), 200'000u);
    const ResultStore store(folder / "out", plan);
    std::filesystem::create_directories(folder / "out" / sweep_name::kResults);
    for (std::uint64_t chunk = 0; chunk < plan.chunk_count(); ++chunk) {
        ChunkResults results;
        for (std::uint64_t k = plan.chunk(chunk).first; k < plan.chunk(chunk).second; ++k)
            results.runs[k] = {k, plan.run(k).key, "done", {std::to_string(k), std::string(150, 'x')}, "null"};
        ASSERT_TRUE(store.pack(chunk, results).ok());
    }
    [[maybe_unused]] const long before = peak_memory();
    SweepPage page(column_names(plan), plan);
    std::uint64_t expected = 0, bytes = 0;
    const auto table = collect_table(folder / "out", plan, [&](std::uint64_t run, const std::vector<std::string>& row) -> Result<void> {
        EXPECT_EQ(run, expected++);
        EXPECT_EQ(row[3], std::to_string(run));
        page.add(run, row);
        bytes += csv_row(row).size();
        return {};
    });
    ASSERT_TRUE(table.ok());
    EXPECT_EQ(table->done, plan.run_count());
    const std::string text = page.text("many", *table, folder / "out", folder);
    EXPECT_NE(text.find("<td>steps</td><td>200000</td><td>99999.5</td><td>0</td><td>199999</td>"), std::string::npos) << "totals are of all rows";
    EXPECT_NE(text.find("drawn at random from all"), std::string::npos);
    EXPECT_GT(bytes, 30'000'000u);
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
    EXPECT_LT(peak_memory() - before, 48'000) << "kB";
#endif
}

TEST_F(SweepPlanTest, ThePageOfCostsBeginsWithErrorAgainstTime) {
    const auto page_of = [&](const std::string& command) {
        const SweepPlan plan = plan_of(R"({"scene": "ball.json", "command": ")" + command + R"(", "vary": {"/budget": ["exact", "work:5"]},
            "collect": {"kept": "/rows/0/budget_kept", "ms": "/rows/0/charged_ms/p50", "force": "/rows/0/force_error_rel"}})");
        SweepTable table;
        table.rows = plan.run_count();
        return SweepPage(column_names(plan), plan).text("page", table, folder / "out", folder);
    };
    EXPECT_NE(page_of("cost").find(R"("time":4,"error":5})"), std::string::npos);
    EXPECT_EQ(page_of("run").find(R"("time":)"), std::string::npos);
}

TEST_F(SweepPlanTest, ATableThatCannotBeWrittenEndsTheCollection) {
    const SweepPlan plan = plan_of(kSweep);
    const auto table = collect_table(folder / "out", plan, [](std::uint64_t run, const std::vector<std::string>& row) -> Result<void> {
        EXPECT_EQ(row.back(), "");
        if (run < 2) return {};
        return Error{ErrorCode::CannotWrite, "no space"};
    });
    ASSERT_FALSE(table.ok());
    EXPECT_EQ(table.error().message, "no space");
}

TEST_F(SweepPlanTest, TasksTakeEveryChunkOnceAndAreNoMoreThanAllowed) {
    const SweepPlan plan = plan_of(R"({"scene": "ball.json", "repeat": 100000})");
    std::vector<std::uint64_t> chunks(plan.chunk_count());
    for (std::size_t i = 0; i < chunks.size(); ++i) chunks[i] = i;
    for (const double run_s : {0.0, 1e-3, 0.1, 1.0, 1e4})
        for (const std::uint64_t most : {1u, 7u, 1000u}) {
            std::vector<std::uint64_t> taken;
            const auto tasks = group_chunks(plan, chunks, run_s, most);
            EXPECT_LE(tasks.size(), most);
            for (const auto& task : tasks) taken.insert(taken.end(), task.begin(), task.end());
            EXPECT_EQ(taken, chunks);
        }
}

TEST_F(SweepPlanTest, ScriptsQuoteFoldersAndAskForWhatTheForecastSays) {
    SweepForecast forecast;
    forecast.run_s = forecast.longest_s = 60.0;
    forecast.memory_mb = 1000.0;
    const SlurmScripts scripts = write_scripts("/data/my sweep", 1, "/opt/trocar", {{0, 1}, {2}}, forecast, {"long", ""});
    EXPECT_EQ(scripts.tasks, "0,1\n2\n");
    for (const char* piece : {"--array=1-2", "--requeue", "--partition=long", "--mem=1500M", "sweep-worker '/data/my sweep' --chunk \"$chunks\""})
        EXPECT_NE(scripts.array.find(piece), std::string::npos) << piece << "\n" << scripts.array;
    EXPECT_NE(scripts.prepare.find("--prepare"), std::string::npos);
    EXPECT_NE(write_scripts("/d", 1, "/t", {{0}}, forecast, {"", "1-00:00:00"}).array.find("--time=1-00:00:00"), std::string::npos);
}

} // namespace
} // namespace trocar::engine
