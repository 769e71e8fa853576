// `sweep`: many runs, one table; nothing is lost and nothing is done twice, whatever happens to those who do the work.
#include "sweep_command.hpp"

#include <random>
#include <set>

#include <sys/stat.h>

namespace trocar::cli_test {
namespace {

TEST_F(SweepCommand, RunsTheCartesianProductInThePlansOrder) {
    write_sweep();
    const Rows rows = rows_of(table_of("a"));
    ASSERT_EQ(rows.size(), 13u);
    EXPECT_EQ(rows[0], (std::vector<std::string>{"/budget", "/instruments/wire/friction", "repeat", "status", "exits", "force", "hash", "peak"}));
    std::size_t k = 1;
    for (const char* budget : {"work:10", "work:100", "exact"})
        for (const char* friction : {"0", "0.2"})
            for (const char* repeat : {"0", "1"}) {
                EXPECT_EQ(rows[k][0], budget);
                EXPECT_EQ(rows[k][1], friction);
                EXPECT_EQ(rows[k][2], repeat);
                EXPECT_EQ(rows[k][3], "done");
                EXPECT_EQ(rows[k][6].size(), 16u) << "a state's hash";
                ++k;
            }
}

TEST_F(SweepCommand, EveryRowIsThatOfTheSameSceneRunByHand) {
    write_sweep();
    const Rows rows = rows_of(table_of("a", {"--jobs", "2"}));
    ASSERT_EQ(rows.size(), 13u);
    for (const std::size_t k : {1u, 6u, 12u}) {
        std::string text = with(kTube, R"("budget": "exact")", R"("budget": ")" + rows[k][0] + "\"");
        text = with(text, R"("lumen": "tube")", R"("lumen": "tube", "friction": )" + rows[k][1]);
        ASSERT_TRUE(ended_with(run(write("by_hand.json", text), {"-n", "6", "--force"}), 0));
        const Json figures = summary();
        EXPECT_EQ(figures["state_hash"], rows[k][6]);
        EXPECT_EQ(figures["lumen_exits"].dump(), rows[k][4]);
        EXPECT_EQ(figures["largest_contact_force_n"].dump(), rows[k][5]);
        EXPECT_EQ(std::stod(rows[k][7]), figures["largest_contact_force_n"].get<double>()) << "the largest of all steps";
    }
}

TEST_F(SweepCommand, TheTableIsTheSameForAnyNumberOfJobs) {
    write_sweep();
    const std::string table = table_of("one");
    EXPECT_EQ(table_of("two", {"--jobs", "2"}), table);
    EXPECT_EQ(table_of("five", {"--jobs", "5"}), table);
}

/// Processes whose command line names this folder.
std::vector<pid_t> processes_of(const fs::path& folder, const std::string& word) {
    std::vector<pid_t> found;
    std::error_code none;
    for (const auto& entry : fs::directory_iterator("/proc", none)) {
        const std::string name = entry.path().filename().string();
        if (name.find_first_not_of("0123456789") != std::string::npos) continue;
        const std::string words = text_of(entry.path() / "cmdline");
        if (words.find(folder.string()) != std::string::npos && words.find(word) != std::string::npos) found.push_back(std::stoi(name));
    }
    return found;
}

TEST_F(SweepCommand, KilledWorkersAndSubmittersLoseNothing) {
    const std::string longer = with(with(kSweep, R"("-n", "6")", R"("-n", "2000")"), R"("repeat": 2)", R"("repeat": 4)");
    write_sweep(with(longer, R"("scene": "scenes/tube.json")", R"("scene": "scenes/long.json")"));
    write("scenes/long.json", with(kTube, R"("duration": 0.2)", R"("duration": 30)"));
    const std::string table = table_of("whole", {"--jobs", "2"});
    std::mt19937 random(7);
    const std::string out = (folder / "cut").string();
    const std::vector<std::string> command{"sweep", (folder / "sweep.json").string(), "--out", out, "--jobs", "2", "--resume"};
    for (int round = 0; round < 6; ++round) {
        const pid_t submitter = start(command);
        std::this_thread::sleep_for(std::chrono::milliseconds(100 + random() % 500));
        if (round % 2 == 0) {
            send_signal(submitter, SIGKILL);
        } else {
            for (const pid_t worker : processes_of(out, "sweep-worker")) send_signal(worker, SIGKILL);
        }
        const Ended ended = wait_for(submitter, kPatience);
        EXPECT_FALSE(ended.timed_out);
        const Ended status = sweep_into("cut", {"--status"});
        EXPECT_TRUE(ended_with(status, 0));
        EXPECT_TRUE(status.says("24 runs:")) << status;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    EXPECT_TRUE(processes_of(out, "sweep-worker").empty()) << "workers end with their submitter";
    ASSERT_TRUE(ended_with(sweep_into("cut", {"--resume", "--jobs", "2", "--collect", (folder / "cut.csv").string()}), 0));
    EXPECT_EQ(text_of(folder / "cut.csv"), table);
    EXPECT_TRUE(sweep_into("cut", {"--status"}).says("24 done, 0 failed, 0 running, 0 missing"));
    for (const auto& entry : fs::recursive_directory_iterator(folder / "cut"))
        EXPECT_EQ(entry.path().filename().string().find(".part"), std::string::npos) << entry.path() << ": nothing half-written stays";
    EXPECT_FALSE(fs::exists(folder / "cut" / "scratch"));
}

TEST_F(SweepCommand, WhatAKilledWorkerLeftOfAWholeChunkIsRemovedOnResume) {
    write_sweep();
    (void)table_of("a");
    const fs::path left = folder / "a" / "results" / "chunk-0000000.elsewhere-1-0.part";
    write("a/results/chunk-0000000.elsewhere-1-0.part", "half a li");
    const std::vector<fs::path> half_written{folder / "a" / ".plan.json.1.0.part", folder / "a" / "results" / ".chunk-0000001.jsonl.gz.1.0.part"};
    for (const fs::path& file : half_written) std::ofstream(file) << "half";
    ASSERT_TRUE(ended_with(sweep_into("a", {"--status"}), 0));
    EXPECT_TRUE(fs::exists(left)) << "who only asks removes nothing";
    ASSERT_TRUE(ended_with(sweep_into("a", {"--resume"}), 0));
    EXPECT_FALSE(fs::exists(left));
    for (const fs::path& file : half_written) EXPECT_FALSE(fs::exists(file)) << file;
}

/// A wire that stands before two targets, and follows neither.
std::string two_targets() {
    return with(with(kTube, R"("path": [[0, 20, 0], [0.2, 26, 0.4]])", R"("inserted": 20)"), R"("effects":)",
                R"("targets": {"near": {"position": [0, 0, 40]}, "far": {"position": [0, 0, 60]}}, "effects":)");
}

TEST_F(SweepCommand, PlansGoWhereTheirOwnSceneSendsThem) {
    write("scenes/targets.json", two_targets());
    for (const char* vary : {R"({"--to": ["near", "far"]})", R"({"/instruments/wire/follow": [{"target": "near"}, {"target": "far"}]})"}) {
        write_sweep(R"({"scene": "scenes/targets.json", "command": "plan", "vary": )" + std::string(vary) + "}");
        EXPECT_TRUE(ended_with(sweep_into("a", {"--dry-run"}), 0)) << vary;
    }
}

TEST_F(SweepCommand, ResumeRunsExactlyWhatIsMissing) {
    write_sweep();
    const std::string table = table_of("a");
    std::vector<fs::path> packed;
    for (const auto& entry : fs::directory_iterator(folder / "a" / "results")) packed.push_back(entry.path());
    std::sort(packed.begin(), packed.end());
    ASSERT_EQ(packed.size(), 12u);
    std::map<fs::path, std::string> before;
    for (const fs::path& file : packed) before[file] = text_of(file);
    fs::remove(packed[3]);
    const Ended status = sweep_into("a", {"--status"});
    EXPECT_TRUE(status.says("11 done, 0 failed, 0 running, 1 missing")) << status;
    const Ended collected = sweep_into("a", {"--collect", (folder / "part.csv").string()});
    EXPECT_TRUE(ended_with(collected, 0)) << "a table of what is there";
    EXPECT_EQ(rows_of(text_of(folder / "part.csv"))[4][3], "missing");
    ASSERT_TRUE(ended_with(sweep_into("a", {"--resume", "--collect", (folder / "again.csv").string()}), 0));
    EXPECT_EQ(text_of(folder / "again.csv"), table);
    for (const fs::path& file : packed)
        if (file != packed[3]) {
            EXPECT_EQ(text_of(file), before[file]) << file << ": not run again";
        }
}

TEST_F(SweepCommand, ARunThatSomebodyKilledIsMissingAndNotFailed) {
    write_sweep(R"({"scene": "scenes/long.json", "collect": {"hash": "/state_hash"}})");
    write("scenes/long.json", with(kTube, R"("duration": 0.2)", R"("duration": 600)"));
    const pid_t submitter = start({"sweep", (folder / "sweep.json").string(), "--out", (folder / "a").string()});
    for (int wait = 0; wait < 1000 && processes_of(folder / "a", "--no-report").empty(); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    for (const pid_t run : processes_of(folder / "a", "--no-report")) send_signal(run, SIGKILL);
    EXPECT_TRUE(refuses(wait_for(submitter, kPatience), "--resume"));
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("0 done, 0 failed, 0 running, 1 missing"));
}

TEST_F(SweepCommand, ARunBeyondItsTimeLimitFails) {
    write_sweep(R"({"scene": "scenes/long.json", "time_limit": 0.3})");
    write("scenes/long.json", with(kTube, R"("duration": 0.2)", R"("duration": 3000)"));
    EXPECT_EQ(table_of("a"), "repeat,status\n0,failed: took longer than 0.3 s\n");
}

TEST_F(SweepCommand, WorkersAreStartedByHandAsWell) {
    write_sweep();
    ASSERT_TRUE(ended_with(sweep_into("a", {"--plan"}), 0));
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("12 missing"));
    ASSERT_TRUE(ended_with(call({"sweep-worker", (folder / "a").string(), "--chunk", "3,0"}), 0));
    ASSERT_TRUE(ended_with(call({"sweep-worker", (folder / "a").string(), "--prepare"}), 0));
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("2 done, 0 failed, 0 running, 10 missing"));
    EXPECT_TRUE(refuses(call({"sweep-worker", (folder / "a").string(), "--chunk", "12"}), "0 to 11"));
    EXPECT_TRUE(refuses(call({"sweep-worker", (folder / "a").string()}), "--chunk"));
    EXPECT_TRUE(refuses(call({"sweep-worker", (folder / "none").string(), "--chunk", "0"}), "plan.json"));
}

TEST_F(SweepCommand, WithoutSlurmItIsSaidWhatIsMissing) {
    write_sweep();
    const std::string path = std::getenv("PATH");
    setenv("PATH", "/nowhere", 1);
    const Ended ended = sweep_into("a", {"--slurm", "--no-forecast"});
    setenv("PATH", path.c_str(), 1);
    EXPECT_TRUE(refuses(ended, "sbatch"));
    EXPECT_TRUE(refuses(sweep_into("b", {"--slurm", "--collect", (folder / "t.csv").string()}), "come later"));
    EXPECT_TRUE(refuses(sweep_into("b", {"--partition", "main"}), "--slurm"));
}

TEST_F(SweepCommand, ACutLineIsNoResult) {
    write_sweep();
    const std::string table = table_of("a");
    const fs::path packed = folder / "a" / "results" / "chunk-0000002.jsonl.gz";
    const std::string bytes = text_of(packed);
    for (const std::size_t size : {std::size_t{0}, bytes.size() / 2, bytes.size() - 3}) {
        std::ofstream(packed, std::ios::binary) << bytes.substr(0, size);
        EXPECT_TRUE(sweep_into("a", {"--status"}).says("11 done, 0 failed, 0 running, 1 missing"));
    }
    ASSERT_EQ(mkfifo((folder / "a" / "results" / "chunk-0000002.other-1-0.part").c_str(), 0600), 0) << "a pipe that nobody writes into";
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("11 done, 0 failed, 0 running, 1 missing"));
    ASSERT_TRUE(ended_with(sweep_into("a", {"--resume", "--collect", (folder / "again.csv").string()}), 0));
    EXPECT_EQ(text_of(folder / "again.csv"), table);
}

TEST_F(SweepCommand, AnInterruptionEndsWith130AndIsResumed) {
    write_sweep(with(with(kSweep, R"("-n", "6")", R"("-n", "3000")"), "scenes/tube.json", "scenes/long.json"));
    write("scenes/long.json", with(kTube, R"("duration": 0.2)", R"("duration": 60)"));
    const pid_t submitter = start({"sweep", (folder / "sweep.json").string(), "--out", (folder / "a").string(), "--jobs", "2"});
    for (int wait = 0; wait < 1000 && processes_of(folder / "a", "sweep-worker").empty(); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    send_signal(submitter, SIGINT);
    const Ended ended = wait_for(submitter, kPatience);
    EXPECT_TRUE(ended_with(ended, 130));
    EXPECT_TRUE(ended.says("--resume")) << ended;
    EXPECT_TRUE(ended_with(sweep_into("a", {"--resume", "--jobs", "2"}), 0));
}

TEST_F(SweepCommand, AFailedRunIsARowWithItsReasonAndIsNotRunAgain) {
    write("scenes/tube.json", with(kTube, R"("sides": 16)", R"("sides": 16)"));
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "3"],
        "vary": {"/instruments/wire/entry/position": [[0, 0, 10], [50, 0, 10]]}, "collect": {"hash": "/state_hash"}})");
    const Ended ended = sweep_into("a", {"--collect", (folder / "a.csv").string()});
    EXPECT_TRUE(ended_with(ended, 0)) << "the sweep has done what it was asked for";
    EXPECT_TRUE(ended.says("1 failed")) << ended;
    const std::string table = text_of(folder / "a.csv");
    EXPECT_NE(table.find("failed: exit 2: "), std::string::npos) << table;
    EXPECT_EQ(table.find(folder.string() + "/a"), std::string::npos) << "no place of this run alone: " << table;
    const Ended status = sweep_into("a", {"--status"});
    EXPECT_TRUE(status.says("1 done, 1 failed, 0 running, 0 missing")) << status;
    EXPECT_TRUE(ended_with(sweep_into("a", {"--resume", "--collect", (folder / "b.csv").string()}), 0));
    EXPECT_EQ(text_of(folder / "b.csv"), table);
    EXPECT_TRUE(ended_with(sweep_into("a", {"--resume", "--retry-failed"}), 0));
    EXPECT_TRUE(sweep_into("a", {"--status"}).says("1 done, 1 failed, 0 running, 0 missing"));
}

TEST_F(SweepCommand, AMissedBudgetIsARowThatSaysSo) {
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "3", "--budget", "1ns", "--fail-on-overrun"]})");
    EXPECT_EQ(table_of("a"), "repeat,status\n0,failed: exit 4: 3 of 3 steps missed the budget\n");
}

TEST_F(SweepCommand, DrawsAreTheSameEveryTimeAndWithinTheirBounds) {
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "0"], "draws": {"count": 5, "seed": 3},
        "vary": {"/instruments/wire/friction": {"uniform": [0.1, 0.3]}, "/instruments/wire/young_modulus": {"log_uniform": [10, 100]}}})");
    const std::string table = table_of("a");
    EXPECT_EQ(table_of("b", {"--jobs", "2"}), table);
    const Rows rows = rows_of(table);
    ASSERT_EQ(rows.size(), 6u);
    std::set<std::string> values;
    for (std::size_t k = 1; k < rows.size(); ++k) {
        EXPECT_GE(std::stod(rows[k][0]), 0.1);
        EXPECT_LE(std::stod(rows[k][0]), 0.3);
        EXPECT_GE(std::stod(rows[k][1]), 10.0);
        EXPECT_LE(std::stod(rows[k][1]), 100.0);
        values.insert(rows[k][0]);
    }
    EXPECT_EQ(values.size(), 5u) << "five draws";
}

TEST_F(SweepCommand, RowsOfACsvAreRunAsTheyStand) {
    write("cases.csv", "/budget,/instruments/wire/friction\nwork:10,0.05\nexact,0.1\n");
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "2"], "rows": "cases.csv"})");
    EXPECT_EQ(table_of("a"), "/budget,/instruments/wire/friction,repeat,status\nwork:10,0.05,0,done\nexact,0.1,0,done\n");
}

TEST_F(SweepCommand, CostPlanAndVerifyAreRunAsWell) {
    write_sweep(R"({"scene": "scenes/tube.json", "command": "cost", "options": ["-n", "3", "--budgets", "work:10,exact"],
        "vary": {"/instruments/wire/friction": [0, 0.1]}, "collect": {"missed": "/rows/0/missed_contacts", "steps": "/steps"}})");
    const Rows costs = rows_of(table_of("cost"));
    ASSERT_EQ(costs.size(), 3u);
    EXPECT_EQ(costs[1][2], "done");
    EXPECT_EQ(costs[1][4], "3");
    EXPECT_FALSE(costs[1][3].empty());
    write("scenes/list.txt", "tube.json 3 0\n");
    write_sweep(R"({"scene": "scenes/list.txt", "command": "verify"})");
    const std::string verified = table_of("verify");
    EXPECT_NE(verified.find("failed: exit 2"), std::string::npos) << "there is no reference: " << verified;
}

TEST_F(SweepCommand, SeveralScenesHaveAColumn) {
    write("scenes/other.json", with(kTube, R"("name": "tube")", R"("name": "other")"));
    write_sweep(R"({"scene": ["scenes/tube.json", "scenes/other.json"], "options": ["-n", "1"], "repeat": 2, "keep": "folder"})");
    EXPECT_EQ(table_of("a"), "scene,repeat,status\nscenes/tube.json,0,done\nscenes/tube.json,1,done\nscenes/other.json,0,done\nscenes/other.json,1,done\n");
    std::size_t kept = 0;
    for (const auto& entry : fs::directory_iterator(folder / "a" / "runs")) kept += fs::exists(entry.path() / "report.html");
    EXPECT_EQ(kept, 4u);
    EXPECT_NE(text_of(folder / "a.html").find("href=\"a/runs/"), std::string::npos) << "the page leads to each run's report";
}

TEST_F(SweepCommand, RunsFromAnyFolderAndLeavesNothingElsewhere) {
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "2", "--path", "path.csv"]})");
    write("path.csv", "t,insertion,rotation\n0,20,0\n0.2,22,0\n");
    const fs::path before = fs::current_path();
    fs::current_path("/");
    const std::string table = table_of("a");
    fs::current_path(before);
    EXPECT_EQ(table, "repeat,status\n0,done\n") << "options' files are relative to the sweep";
}

TEST_F(SweepCommand, ADryRunListsAndWritesNothing) {
    write_sweep();
    const Ended ended = sweep({"--dry-run", "--no-forecast"});
    EXPECT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("12 runs")) << ended;
    EXPECT_TRUE(ended.says("--set '/budget=")) << ended;
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(folder)) files += entry.path().filename() != "stdout" && entry.path().filename() != "stderr";
    EXPECT_EQ(files, 2u) << "the sweep and its scenes";
}

TEST_F(SweepCommand, AnOptionOfTheCommandIsVariedAsAPointerIs) {
    write_sweep(R"({"scene": "scenes/tube.json", "vary": {"--steps": [2, 5]}, "collect": {"steps": "/steps"}})");
    EXPECT_EQ(table_of("a"), "--steps,repeat,status,steps\n2,0,done,2\n5,0,done,5\n");
    write_sweep(R"({"scene": "scenes/tube.json", "vary": {"--steps": [2, "many"]}})");
    EXPECT_TRUE(refuses(sweep_into("b"), "--steps: found many; expected an integer from 0 to 1000000000"));
    write_sweep(R"({"scene": "scenes/tube.json", "vary": {"--out": ["x"]}})");
    EXPECT_TRUE(refuses(sweep_into("b"), "the sweep's own affair"));
}

TEST_F(SweepCommand, EveryShippedSweepIsListedByADryRun) {
    std::size_t count = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(TROCAR_SOURCE_DIR) / "assets" / "sweeps")) {
        const Ended ended = call({"sweep", entry.path().string(), "--dry-run", "--no-forecast"});
        EXPECT_TRUE(ended_with(ended, 0)) << entry.path();
        EXPECT_TRUE(ended.says(" runs, results packed by")) << ended;
        ++count;
    }
    EXPECT_EQ(count, 3u);
}

TEST_F(SweepCommand, ADryRunForecastsTimeAndMemory) {
    write_sweep();
    const Ended ended = sweep({"--dry-run"});
    EXPECT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("in all on one core")) << ended;
    EXPECT_TRUE(ended.says("MB")) << ended;
}

TEST_F(SweepCommand, ThePageStandsBesideTheTableAndNeedsNothingElse) {
    write_sweep();
    ASSERT_FALSE(table_of("a").empty());
    const std::string page = text_of(folder / "a.html");
    EXPECT_NE(page.find("12 runs of"), std::string::npos);
    EXPECT_NE(page.find("/instruments/wire/friction"), std::string::npos);
    for (const char* piece : {"src=", "http://cdn", "https://", "@import"}) EXPECT_EQ(page.find(piece), std::string::npos) << piece;
    ASSERT_FALSE(table_of("b", {"--jobs", "2"}).empty());
    EXPECT_EQ(text_of(folder / "b.html"), page);
}

TEST_F(SweepCommand, AnotherPlanInTheFolderIsRefused) {
    write_sweep();
    ASSERT_TRUE(ended_with(sweep_into("a"), 0));
    EXPECT_TRUE(refuses(sweep_into("a"), "--resume"));
    write_sweep(with(kSweep, R"("repeat": 2)", R"("repeat": 3)"));
    EXPECT_TRUE(refuses(sweep_into("a", {"--resume"}), "12 runs"));
    write_sweep();
    write("scenes/tube.json", with(kTube, R"("young_modulus": 60)", R"("young_modulus": 61)"));
    EXPECT_TRUE(refuses(sweep_into("a", {"--resume"}), "has changed since"));
    write("scenes/tube.json", kTube);
    const fs::path plan = folder / "a" / "plan.json";
    const std::string text = text_of(plan);
    std::ofstream(plan, std::ios::binary) << with(text, "trocar 1.0.0", "trocar 0.0.9");
    EXPECT_TRUE(refuses(sweep_into("a", {"--resume"}), "trocar 0.0.9"));
    EXPECT_TRUE(refuses(call({"sweep-worker", (folder / "a").string(), "--chunk", "0"}), "trocar 0.0.9"));
    for (const std::string& damaged : {std::string(), std::string("{}"), text.substr(0, text.size() / 2), std::string("[1]"), with(text, "\"runs\": 12", "\"runs\": 13"),
                                       with(text, "\"chunk_runs\": 1,", "\"chunk_runs\": 18446744073709551615,"), with(text, "\"command\": \"run\"", "\"command\": \"fly\"")}) {
        std::ofstream(plan, std::ios::binary) << damaged;
        EXPECT_TRUE(refuses(sweep_into("a", {"--resume"}), "plan")) << damaged.substr(0, 40);
    }
    fs::create_directory(folder / "full");
    write("full/letter.txt", "dear");
    EXPECT_TRUE(refuses(sweep_into("full"), "letter.txt"));
    EXPECT_TRUE(refuses(sweep_into("sweep.json"), "is a file"));
    EXPECT_TRUE(refuses(sweep_into("none", {"--status"}), "no sweep"));
}

TEST_F(SweepCommand, TheTableMayLieInItsFolderButOnNothingThatTheSweepReads) {
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "1"]})");
    const std::string sweep_text = text_of(folder / "sweep.json");
    ASSERT_TRUE(ended_with(sweep_into("a", {"--collect", (folder / "a" / "table.csv").string()}), 0)) << "a folder that is made just now";
    EXPECT_EQ(text_of(folder / "a" / "table.csv"), "repeat,status\n0,done\n");
    for (const fs::path& taken : {folder / "sweep.json", folder / "scenes" / "tube.json", folder / "a" / "plan.json", folder / "a" / ".." / "sweep.json"})
        EXPECT_TRUE(refuses(sweep_into("a", {"--collect", taken.string()}), "would overwrite a file that the sweep reads")) << taken;
    write("table.csv", "/budget\n\"work:10\"\n");
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "1"], "rows": "table.csv"})");
    EXPECT_TRUE(refuses(sweep_into("b", {"--collect", (folder / "table.csv").string()}), "would overwrite a file that the sweep reads"));
    write_sweep(R"({"scene": "scenes/tube.json", "options": ["-n", "1"]})");
    EXPECT_EQ(text_of(folder / "sweep.json"), sweep_text);
    EXPECT_TRUE(ended_with(sweep_into("a", {"--status"}), 0));
}

TEST_F(SweepCommand, AVerifySweepNoticesScenesAndReferencesAndLeavesNoPage) {
    write("scenes/list.txt", "tube.json 3 0\n");
    ASSERT_TRUE(ended_with(call({"verify", (folder / "scenes" / "list.txt").string(), "--write-references"}), 0));
    write_sweep(R"({"scene": "scenes/list.txt", "command": "verify", "keep": "folder"})");
    EXPECT_EQ(table_of("same"), "repeat,status\n0,done\n");
    write("scenes/tube.json", with(kTube, R"("young_modulus": 60)", R"("young_modulus": 61)"));
    EXPECT_TRUE(refuses(sweep_into("same", {"--resume"}), "tube.json has changed since"));
    EXPECT_NE(table_of("other").find("failed: exit 5: 1 of 1 scenes differ from their references"), std::string::npos);
    EXPECT_FALSE(fs::exists(folder / "out")) << "the page of what differs is the run's";
    for (const auto& entry : fs::directory_iterator(folder / "other" / "runs")) EXPECT_TRUE(fs::exists(entry.path() / "verify.html"));
}

/// Refused with a place and the reason, before anything runs.
TEST_F(SweepCommand, BadSweepsAreRefusedWithTheirPlaceBeforeAnythingRuns) {
    const Broken broken[] = {
        {"", "empty"},
        {"[]", "1:1"},
        {R"({"command": "run"})", "scene"},
        {R"({"scene": 5})", "1:11: scene"},
        {R"({"scene": "none.json"})", "does not exist"},
        {R"({"scene": "sweep.json"})", "this file itself"},
        {R"({"scene": []})", "scene"},
        {R"({"scene": ["scenes/tube.json", "scenes/tube.json"]})", "twice"},
        {R"({"scene": "scenes/tube.json", "commnad": "run"})", "nearest known key: \"command\""},
        {R"({"scene": "scenes/tube.json", "command": "view"})", "nearest known value"},
        {R"({"scene": "scenes/tube.json", "repeat": 0})", "repeat"},
        {R"({"scene": "scenes/tube.json", "repeat": 1e6, "vary": {"/budget": ["exact", "work:1"]}})", "at most 1000000"},
        {R"({"scene": "scenes/tube.json", "vary": {"/budget": []}})", "1:51"},
        {R"({"scene": "scenes/tube.json", "vary": {"/budget": 5}})", "1:51"},
        {R"({"scene": "scenes/tube.json", "vary": {"budget": ["exact"]}})", "JSON pointer"},
        {R"({"scene": "scenes/tube.json", "vary": {"/budget~2": ["exact"]}})", "JSON pointer"},
        {R"({"scene": "scenes/tube.json", "vary": {"/budgt": ["exact"]}})", "1:40: /budgt: found the unknown key of a scene \"budgt\"; nearest known key of a scene: \"budget\""},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wier/friction": [0]}})", "\"wire\""},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/frictoin": [0]}})", "\"friction\""},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/path/7/0": [0]}})", "from 0 to 1"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/radius/x": [0]}})", "pointer to end there"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/radius": [0.5, -1]}})", "1:74: /instruments/wire/radius"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/radius": ["soft"]}})", "a number in mm"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/radius": [NaN]}})", "NaN"},
        {R"({"scene": "scenes/tube.json", "vary": {"/budget": ["exact"], "/budget": ["exact"]}})", "already given"},
        {R"({"scene": "scenes/tube.json", "vary": {"/bodies/tube": [{}], "/bodies/tube/kind": ["static"]}})", "a part of the other"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": 0, "to": 1, "count": 1e15}}})", "count"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": 0, "to": 1, "count": 3, "scale": "log"}}})", "above 0"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": -1.7e308, "to": 1.7e308, "count": 3}}})", "too long"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"uniform": [0, 1]}}})", "draws"},
        {R"({"scene": "scenes/tube.json", "draws": {"count": 3}})", "nothing is drawn"},
        {R"({"scene": "scenes/tube.json", "draws": {"count": 3}, "vary": {"/instruments/wire/friction": {"uniform": [1, 0]}}})", "smaller bound first"},
        {R"({"scene": "scenes/tube.json", "options": ["--out", "x"]})", "the sweep's own affair"},
        {R"({"scene": "scenes/tube.json", "options": ["--bugdet", "x"]})", "options"},
        {R"({"scene": "scenes/tube.json", "options": ["--budget", "1ms"], "vary": {"/budget": ["exact"]}})", "expected one of them"},
        {R"({"scene": "scenes/tube.json", "options": ["-n", "2"], "vary": {"--steps": [3]}})", "options"},
        {R"({"scene": "scenes/tube.json", "options": ["-n", "many"]})", "options"},
        {R"({"scene": "scenes/tube.json", "command": "plan"})", "--to"}, // it has no target
        {R"({"scene": "scenes/targets.json", "command": "plan"})", "expected one of them: near, far"},
        {R"({"scene": "scenes/falling.json", "vary": {"/gravity/2": [-9810, -9.81]}})", "sweep.json:1:65: /gravity/2: found a gravity of 9.81 mm/s^2"},
        {R"({"scene": "scenes/targets.json", "command": "plan", "options": ["--to", "fra"]})", R"(found the unknown target "fra"; nearest known target: "far" (known: near, far))"},
        {R"({"scene": "scenes/targets.json", "command": "plan", "options": ["--to=fra"]})", R"(unknown target "fra")"},
        {R"({"scene": "scenes/targets.json", "command": "plan", "vary": {"--to": ["near", "fra"]}})", R"(1:79: --to: found the unknown target "fra")"},
        {R"({"scene": "scenes/targets.json", "command": "episode", "options": ["--to", "fra"]})", R"(1:67: --to: found the unknown target "fra")"},
        {R"({"scene": "scenes/tube.json", "options": ["--budget=exact"], "vary": {"/budget": ["work:5"]}})", "found --budget, and /budget is varied"},
        {R"({"scene": "scenes/tube.json", "vary": {"--budget": ["exact"], "/budget": ["work:5"]}})", "1:63: /budget: --budget is varied, too"},
        {R"({"scene": "scenes/tube.json", "vary": {"--budget": ["exact", "wrk:5"]}})", "1:62: --budget: budget \"wrk:5\": not understood"},
        {R"({"scene": "scenes/tube.json", "command": "cost", "vary": {"--budgets": ["exact", "wrk:5"]}})", "1:82: --budgets: budget \"wrk:5\": not understood"},
        {R"({"scene": "scenes/tube.json", "vary": {"--path": ["none.csv"]}})", "1:51: --path: the file \"none.csv\" does not exist"},
        {R"({"scene": "scenes/tube.json", "options": ["--record-grants", "g.txt"]})", "every run would write the same file"},
        {R"({"scene": "scenes/tube.json", "options": ["-n", "3"], "vary": {"--stesp": [3]}})",
         "1:64: --stesp: run does not take it: found the unknown option \"--stesp\"; nearest known option: \"--steps\""},
        {R"({"scene": "scenes/tube.json", "vary": {"--steps": [1.5]}})", "1:52: --steps: found 1.5; expected an integer from 0 to 1000000000"},
        {R"({"scene": "scenes/tube.json", "vary": {"--steps": {"from": 0, "to": 1, "count": 3}}})", "1:40: --steps: found 0.5; expected an integer"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": 0.1, "to": 0.1, "count": 3}}})", "found 3 times 0.1; expected a count of 1"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": 0, "to": 1, "count": 0}}})", "count: found 0; expected 1 to"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": -1, "to": 1, "count": 3, "scale": "log"}}})", "above 0"},
        {R"({"scene": "scenes/tube.json", "collect": {"status": "/steps"}})", "another name"},
        {R"({"scene": "scenes/tube.json", "collect": {"x": "steps"}})", "JSON pointer"},
        {R"({"scene": "scenes/tube.json", "collect": {"x": {"column": "tip_w", "take": "max"}}})", "nearest known column"},
        {R"({"scene": "scenes/tube.json", "collect": {"x": {"column": "tip_x", "take": "p98"}}})", "nearest known value"},
        {R"({"scene": "scenes/tube.json", "command": "verify", "vary": {"/budget": ["exact"]}})", "verify"},
        {R"({"scene": "scenes/tube.json", "rows": "none.csv"})", "does not exist"},
        {R"({"scene": "scenes/tube.json", "repeat": NaN})", "NaN"},
        {R"({"scene": "scenes/tube.json", "repeat": -1})", "repeat"},
        {R"({"scene": "scenes/tube.json", "repeat": 1.5})", "repeat"},
        {R"({"scene": "scenes/tube.json", "repeat": 1e300})", "repeat"},
        {R"({"scene": "scenes/tube.json", "time_limit": -1})", "time_limit"},
        {R"({"scene": "../../../../../../etc", "vary": {"/budget": ["exact"]}})", "does not exist"},
        {R"({"scene": "/dev/zero"})", "does not exist"},
        {R"({"scene": "scenes/tube.json", "rows": "/dev/zero"})", "rows"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/path/18446744073709551616/0": [0]}})", "from 0 to 1"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/path/-1/0": [0]}})", "from 0 to 1"},
        {R"({"scene": "scenes/tube.json", "vary": {"": [{}]}})", "JSON pointer"},
        {R"({"scene": "scenes/tube.json", "vary": {"/instruments/wire/friction": {"from": 0, "to": 1, "count": 1000000},
             "/instruments/wire/radius": {"from": 0.1, "to": 1, "count": 1000000}, "/a": {"from": 0, "to": 1, "count": 1000000},
             "/b": {"from": 0, "to": 1, "count": 1000000}, "/c": {"from": 0, "to": 1, "count": 1000000}}})", "at most 4000000 in all"},
        {R"({"scene": "scenes/tube.json", "collect": {"a": "/steps", "a": "/steps"}})", "already given"},
        {R"({"scene": "scenes/tube.json", "collect": {"--steps": "/steps"}, "vary": {"--steps": [3]}})", "another name"},
    };
    write("scenes/targets.json", two_targets());
    write("scenes/falling.json", with(kTube, R"("budget": "exact")", R"("gravity": [0, 0, -9810])"));
    for (const Broken& one : broken) {
        write_sweep(one.text);
        EXPECT_TRUE(refuses(sweep_into("a"), one.says)) << one.text;
        EXPECT_FALSE(fs::exists(folder / "a")) << one.text;
    }
}

TEST_F(SweepCommand, BadTablesOfRowsAreRefusedWithTheirLine) {
    write_sweep(R"({"scene": "scenes/tube.json", "rows": "cases.csv"})");
    const Broken broken[] = {{"", "no rows"},
                             {"/budget\n", "no rows"},
                             {"budget\nexact\n", "cases.csv:1:1: found \"budget\""},
                             {"/budget,/budget\nexact,exact\n", "cases.csv:1:9: the pointer /budget is varied twice"},
                             {"/budget\nexact\nexact,5\n", "cases.csv:3:7: found 2 cells"},
                             {"/budget,/instruments/wire/friction\nexact\n", "cases.csv:2:1: found 1 cells; expected 2"},
                             {"/budget,/instruments/wire/friction\n\"exact\",0\nexact,-1\n", "cases.csv:3:7: /instruments/wire/friction"},
                             {"/budget,/instruments/wire/friction\nexact,[0\n", "cases.csv:2:7: /instruments/wire/friction"},
                             {"/budget,--steps\nexact,3\nexact,1.5\n", "cases.csv:3:7: --steps: found 1.5; expected an integer"},
                             {"/budget\nexact\nnan\n", "cases.csv:3:1: /budget"},
                             {"/budget\nexact\n\"work:100\n", "cases.csv:3:1: found a quote that is never closed"},
                             {"/budgt\nexact\n", "\"budget\""},
                             {"/instruments/wire/friction\nnan\n", "cases.csv:2:1"}};
    for (const Broken& one : broken) {
        write("cases.csv", one.text);
        EXPECT_TRUE(refuses(sweep_into("a"), one.says)) << one.text;
    }
}

TEST_F(SweepCommand, SetGivesACommandTheSameValues) {
    const fs::path scene = folder / "scenes" / "tube.json";
    ASSERT_TRUE(ended_with(run(scene, {"--set", "/budget=work:10", "--set", "/instruments/wire/friction=0.1", "-n", "3"}), 0));
    EXPECT_EQ(summary()["budget"], "work:10");
    EXPECT_NE(summary()["command"].get<std::string>().find("--set"), std::string::npos);
    EXPECT_TRUE(refuses(run(scene, {"--set", "/budgt=5", "--force"}), "\"budget\""));
    EXPECT_TRUE(refuses(run(scene, {"--set", "budget", "--force"}), "POINTER=VALUE"));
    EXPECT_TRUE(refuses(run(scene, {"--set", "/instruments/wire/radius=-1", "--force"}), "/instruments/wire/radius"));
    EXPECT_TRUE(refuses(run(scene, {"--set", "/instruments/wire/radius=[1", "--force"}), "--set"));
}

} // namespace
} // namespace trocar::cli_test
