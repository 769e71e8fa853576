// The files a run leaves: a contract that scripts read.
#include "program.hpp"

namespace seldinger::cli_test {
namespace {

class Output : public Program {};

TEST_F(Output, StepTableStartsWithTheContractsColumnsAndHasARowPerStep) {
    ASSERT_TRUE(ended_with(run(write("tube.json", kTube)), 0));
    std::ifstream table(out() / "steps.csv");
    std::string header, row;
    std::getline(table, header);
    const std::string contract =
        "step,time_s,substeps,fem_ms,steer_ms,descend_ms,exact_ms,respond_ms,total_ms,budget_ms,pairs_tested,pairs_open,"
        "leaf_contacts,level_reached,exact_ran,exact_contacts,unresolved,min_volume_ratio,inverted_tets,kinetic_j,elastic_j,"
        "tip_x,tip_y,tip_z,insertion_m,rotation_rad";
    EXPECT_EQ(header.substr(0, contract.size()), contract);
    const auto columns = [](const std::string& line) { return std::count(line.begin(), line.end(), ',') + 1; };
    int rows = 0;
    while (std::getline(table, row)) {
        EXPECT_EQ(columns(row), columns(header)) << row;
        EXPECT_EQ(row.substr(0, row.find(',')), std::to_string(++rows));
        EXPECT_EQ(row.find("nan"), std::string::npos) << row;
    }
    EXPECT_EQ(rows, 20);
}

TEST_F(Output, SummaryHasEveryKeyOfTheContractWithItsType) {
    ASSERT_TRUE(ended_with(run(write("tube.json", kTube), {"--budget", "2ms"}), 0));
    const Json json = summary();
    ASSERT_TRUE(json.is_object());
    for (const char* key : {"scene", "mode", "budget", "budget_scope", "state_hash"})
        EXPECT_TRUE(json.contains(key) && json[key].is_string()) << key;
    for (const char* key :
         {"steps", "simulated_s", "wall_s", "realtime_factor", "budget_kept", "worst_overrun_ms", "substeps", "stable_step_s",
          "min_volume_ratio", "inverted_tets_max", "exact_steps", "contacts_total", "unresolved_total", "assumed_total", "lumen_exits"})
        EXPECT_TRUE(json.contains(key) && json[key].is_number()) << key;
    for (const char* key : {"step_ms", "collision_ms"})
        for (const char* part : {"p50", "p95", "p99", "max"})
            EXPECT_TRUE(json.contains(key) && json[key].contains(part) && json[key][part].is_number()) << key << "." << part;
    for (const char* part : {"first", "last", "max"}) EXPECT_TRUE(json["energy_j"][part].is_number()) << part;
    EXPECT_TRUE(json["stages_ms"].is_object() && !json["stages_ms"].empty());
    EXPECT_EQ(json["effects"], Json({"coarse_contact", "exact_contact"}));
    EXPECT_EQ(json["mode"], "wall");
    EXPECT_EQ(json["budget"], "2ms");
    EXPECT_EQ(json["budget_scope"], "collision");
    EXPECT_GE(json["budget_kept"], 0.0);
    EXPECT_LE(json["budget_kept"], 1.0);
    EXPECT_EQ(json["lumen_exits"], 0);
}

TEST_F(Output, NoPartialFileIsLeftAfterAFinishedRun) {
    ASSERT_TRUE(ended_with(run(write("tube.json", kTube), {"--record"}), 0));
    for (const auto& entry : fs::recursive_directory_iterator(out())) {
        const std::string name = entry.path().filename().string();
        EXPECT_EQ(name.find(".tmp"), std::string::npos) << name;
        EXPECT_EQ(name.find("partial"), std::string::npos) << name;
    }
}

TEST_F(Output, AnInterruptedRunEndsWith130AndAReadableSummary) {
    const fs::path scene = write("long.json", kTube);
    for (const int signal : {SIGINT, SIGTERM}) {
        fs::remove_all(out());
        const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "--force", "-n", "100000000"});
        for (int wait = 0; wait < 2000; ++wait) { // until steps are being taken
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
            std::error_code none;
            bool started = false;
            for (const auto& entry : fs::directory_iterator(out(), none))
                started = started || (entry.path().filename().string().find("steps") != std::string::npos && entry.file_size(none) > 2000);
            if (started) break;
        }
        ASSERT_EQ(kill(child, signal), 0);
        const Ended ended = wait_for(child, 30.0);
        EXPECT_TRUE(ended_with(ended, 130));
        const Json json = summary();
        ASSERT_TRUE(json.is_object()) << ended;
        EXPECT_EQ(json["interrupted"], true);
        EXPECT_GT(json["steps"], 0);
        EXPECT_TRUE(fs::exists(out() / "steps.csv"));
    }
}

TEST_F(Output, ARunThatIsKilledLeavesNothingThatLooksFinished) {
    const pid_t child = start({"run", write("long.json", kTube), "--out", out(), "--no-pictures", "-n", "100000000"});
    for (int wait = 0; wait < 2000 && !fs::exists(out()); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    ASSERT_EQ(kill(child, SIGKILL), 0);
    EXPECT_EQ(wait_for(child, 30.0).signal, SIGKILL);
    EXPECT_FALSE(fs::exists(out() / "summary.json"));
    EXPECT_FALSE(fs::exists(out() / "steps.csv"));
}

} // namespace
} // namespace seldinger::cli_test
