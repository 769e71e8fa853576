// cost, verify, and runs that are recorded and replayed: their outputs and what they refuse.
#include "program.hpp"

#include <algorithm>
#include <chrono>
#include <csignal>
#include <thread>

namespace trocar::cli_test {
namespace {

class Cost : public Program {};
class Grants : public Program {};
class Pace : public Program {};
class Verify : public Program {};

/// A soft ball that falls on a table: a budget shows here.
const std::string kBall = R"({
    "name": "ball",
    "units": {"length": "mm", "pressure": "kPa"},
    "time": {"step": 0.005, "duration": 0.2},
    "gravity": [0, 0, -9810],
    "bodies": {
        "ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 31], "radius": 30, "subdivisions": 2},
            "material": {"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000, "mass_damping": 1}, "coarse": {"surface_triangles": 80}},
        "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -5], "extent": [200, 200, 10], "cells": 8}}},
    "effects": ["elasticity", "gravity", "damping", "coarse_contact"]
})";

std::vector<std::vector<std::string>> rows_of(const std::string& csv) {
    std::vector<std::vector<std::string>> rows;
    std::istringstream lines(csv);
    for (std::string line; std::getline(lines, line);) {
        std::vector<std::string>& row = rows.emplace_back();
        std::istringstream cells(line);
        for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    }
    return rows;
}

TEST_F(Cost, WritesATableWithARowPerBudgetAndAPage) {
    const fs::path scene = write("ball.json", kBall);
    const Ended ended = call({"cost", scene, "--budgets", "work:0,work:400, 1ms,250us,exact", "-n", "30", "--out", out()});
    ASSERT_TRUE(ended_with(ended, 0));
    const auto rows = rows_of(text_of(out() / "cost.csv"));
    ASSERT_EQ(rows.size(), 6u);
    EXPECT_EQ(rows[0].front(), "budget");
    EXPECT_EQ(rows[0].size(), 19u) << "the contract's 13, and six more";
    const char* names[] = {"work:0", "work:400", "1ms", "250us", "exact"};
    for (std::size_t k = 0; k < 5; ++k) {
        ASSERT_EQ(rows[k + 1].size(), 19u);
        EXPECT_EQ(rows[k + 1][0], names[k]) << "as it was written";
        EXPECT_EQ(rows[k + 1][7], "0") << "missed contacts of " << names[k];
    }
    EXPECT_GT(std::stoi(rows[1][8]), std::stoi(rows[2][8])) << "false contacts fall with the budget";
    for (std::size_t column = 7; column < 13; ++column) EXPECT_EQ(rows[5][column], "0") << "exact: " << rows[0][column];
    EXPECT_TRUE(fs::exists(out() / "report.html"));
    EXPECT_TRUE(Json::parse(text_of(out() / "cost.json"), nullptr, false).is_object());
    EXPECT_TRUE(ended.says("work:400")) << ended;
}

/// Column of a table by its head.
std::vector<std::string> column_of(const std::vector<std::vector<std::string>>& rows, const std::string& head) {
    const auto at = static_cast<std::size_t>(std::find(rows[0].begin(), rows[0].end(), head) - rows[0].begin());
    std::vector<std::string> cells;
    for (std::size_t k = 1; k < rows.size(); ++k) cells.push_back(at < rows[k].size() ? rows[k][at] : "");
    return cells;
}

TEST_F(Cost, ComparesOtherAnswersAndSharesTheWorkAmongProcesses) {
    const fs::path scene = write("ball.json", kBall);
    const auto table = [&](const std::vector<std::string>& more) {
        std::vector<std::string> words{"cost", scene,   "--budgets", "work:0,work:400", "--variants", "wrapped,spheres", "-n",
                                       "20",   "--out", out(),       "--force"};
        words.insert(words.end(), more.begin(), more.end());
        EXPECT_TRUE(ended_with(call(words), 0));
        return rows_of(text_of(out() / "cost.csv"));
    };
    const auto alone = table({}), shared = table({"--jobs", "2"});
    ASSERT_EQ(alone.size(), 7u);
    EXPECT_EQ(column_of(alone, "variant"), (std::vector<std::string>{"", "", "wrapped", "wrapped", "spheres", "spheres"}));
    for (const char* head : {"false_contacts", "force_error_rel", "surface_rms_m", "surface_hausdorff_m", "pairs_open_mean"})
        EXPECT_EQ(column_of(alone, head), column_of(shared, head)) << head << ": no clock has a say in it";
    EXPECT_FALSE(fs::exists(out() / "parts")) << "nothing is left of the sharing";
    EXPECT_TRUE(refuses(call({"cost", scene, "--variants", "wrapped,covering", "--out", out(), "--force"}), "--variants"));
    EXPECT_TRUE(refuses(call({"cost", scene, "--variants", "quick", "--out", out(), "--force"}), "known"));
    EXPECT_TRUE(refuses(call({"cost", scene, "--jobs", "0", "--out", out()}), "--jobs"));
}

TEST_F(Cost, ThatIsInterruptedLeavesNoTableAndGoesOnWhereItWas) {
    const fs::path scene = write("ball.json", kBall);
    const pid_t child = start({"cost", scene, "--budgets", "work:0,exact", "-n", "100000", "--out", out()});
    for (int wait = 0; wait < 3000 && !fs::exists(out() / "parts"); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    ASSERT_EQ(send_signal(child, SIGINT), 0);
    EXPECT_TRUE(ended_with(wait_for(child, 60.0), 130));
    EXPECT_FALSE(fs::exists(out() / "cost.csv")) << "rows that were not measured are no zeros";
    EXPECT_TRUE(fs::exists(out() / "parts"));
    const Ended other = call({"cost", scene, "--budgets", "work:0,exact", "-n", "4", "--out", out(), "--resume"});
    ASSERT_TRUE(ended_with(other, 0));
    EXPECT_TRUE(other.says("from the beginning")) << "other steps, another measurement: " << other;
    EXPECT_TRUE(fs::exists(out() / "cost.csv"));
    EXPECT_FALSE(fs::exists(out() / "parts"));
}

TEST_F(Cost, HasBudgetsOfItsOwnAndTakesScenesWithInstruments) {
    ASSERT_TRUE(ended_with(call({"cost", write("tube.json", kTube), "-n", "3", "--out", out()}), 0));
    const auto rows = rows_of(text_of(out() / "cost.csv"));
    ASSERT_EQ(rows.size(), 6u);
    EXPECT_EQ(rows[1][0], "0.1ms");
    EXPECT_EQ(rows[5][0], "exact");
    EXPECT_TRUE(refuses(call({"cost", folder / "tube.json", "-n", "0", "--out", out(), "--force"}), "--steps")) << "a table of zeros is none";
}

TEST_F(Cost, RefusesBudgetsThatAreNone) {
    const fs::path scene = write("ball.json", kBall);
    for (const char* budgets : {"soon", "1ms,,exact", "1ms,", "-1ms", "1ms,work:-3", "5", "exact,1e300s", "1ms,1ms"}) {
        EXPECT_TRUE(refuses(call({"cost", scene, std::string("--budgets=") + budgets, "--out", out()}), "--budgets")) << budgets;
        EXPECT_FALSE(fs::exists(out())) << budgets;
    }
    EXPECT_TRUE(ended_with(call({"cost", scene, "--budgets=", "--out", out()}), 2));
    EXPECT_TRUE(refuses(call({"cost", folder / "none.json", "--out", out()}), "none.json"));
    EXPECT_TRUE(refuses(call({"cost", scene, "-n", "-2", "--out", out()}), "--steps"));
}

TEST_F(Cost, RefusesABusyFolderUnlessForced) {
    const fs::path scene = write("ball.json", kBall);
    ASSERT_TRUE(ended_with(call({"cost", scene, "--budgets", "exact", "-n", "1", "--out", out()}), 0));
    EXPECT_TRUE(refuses(call({"cost", scene, "--budgets", "exact", "-n", "1", "--out", out()}), "--force"));
    EXPECT_TRUE(ended_with(call({"cost", scene, "--budgets", "exact", "-n", "1", "--out", out(), "--force"}), 0));
}

/// A laptop is closed, a debugger stops the process: the run goes on as if time had stood still, and reports that it was late.
TEST_F(Pace, ARunThatIsSuspendedGoesOnInSlowMotionAndSaysSo) {
    const fs::path scene = write("tube.json", kTube);
    const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "--budget", "1ms", "--pace", "1", "-n", "200"});
    ASSERT_TRUE(wait_for_steps(out()));
    ASSERT_EQ(send_signal(child, SIGSTOP), 0);
    std::this_thread::sleep_for(std::chrono::milliseconds(600));
    ASSERT_EQ(send_signal(child, SIGCONT), 0);
    ASSERT_TRUE(ended_with(wait_for(child, kPatience), 0));
    const Json json = summary();
    EXPECT_EQ(json["steps"], 200);
    EXPECT_GE(json["pace"]["late_steps"], 1) << json["pace"];
    EXPECT_GE(json["pace"]["slow_motion_s"], 0.4) << json["pace"];
    EXPECT_GE(json["pace"]["worst_late_ms"], 400.0) << json["pace"];
    EXPECT_EQ(json["lumen_exits"], 0) << json;
}

TEST_F(Grants, OfAWallRunAreReplayedToTheSameHash) {
    const fs::path scene = write("tube.json", kTube), grants = folder / "grants.txt";
    ASSERT_TRUE(ended_with(run(scene, {"--budget", "1ms", "--record-grants", grants}), 0));
    const Json first = summary();
    const Ended again = run(scene, {"--replay", grants, "--force"});
    ASSERT_TRUE(ended_with(again, 0));
    EXPECT_TRUE(again.says("bit for bit")) << again;
    EXPECT_EQ(summary()["state_hash"], first["state_hash"]);
    EXPECT_EQ(summary()["budget"], first["budget"]);
    EXPECT_EQ(summary()["steps"], 20);
    const Ended part = run(scene, {"--replay", grants, "-n", "7", "--force"});
    ASSERT_TRUE(ended_with(part, 0));
    EXPECT_NE(part.out.find("replayed 7 of "), std::string::npos) << part;
    EXPECT_EQ(summary()["steps"], 7);
}

TEST_F(Grants, OfAnotherSceneOrPathAreRefused) {
    const fs::path scene = write("tube.json", kTube), grants = folder / "grants.txt";
    ASSERT_TRUE(ended_with(run(scene, {"--budget", "1ms", "-n", "5", "--record-grants", grants}), 0));
    EXPECT_TRUE(refuses(run(write("ball.json", kBall), {"--replay", grants, "--force"}), "another scene"));
    EXPECT_TRUE(refuses(run(write("thick.json", with(kTube, "\"radius\": 0.5", "\"radius\": 0.6")), {"--replay", grants, "--force"}),
                        "another scene"));
    EXPECT_TRUE(refuses(run(scene, {"--replay", grants, "--force", "--path", write("path.csv", "0,20,0\n0.2,25,0\n")}), "another scene"));
    EXPECT_TRUE(refuses(run(scene, {"--replay", grants, "-n", "6", "--force"}), "5 steps"));
    EXPECT_TRUE(refuses(run(scene, {"--replay", grants, "--budget", "1ms", "--force"}), "--budget"));
}

TEST_F(Grants, ThatAreCutOffForeignOrMissingAreRefused) {
    const fs::path scene = write("tube.json", kTube), grants = folder / "grants.txt";
    ASSERT_TRUE(ended_with(run(scene, {"--budget", "1ms", "-n", "5", "--record-grants", grants}), 0));
    const std::string whole = text_of(grants);
    EXPECT_TRUE(refuses(run(scene, {"--replay", write("half.txt", whole.substr(0, whole.size() / 2)), "--force"}), "half.txt"));
    EXPECT_TRUE(refuses(run(scene, {"--replay", scene, "--force"}), "no record of grants"));
    EXPECT_TRUE(refuses(run(scene, {"--replay", write("empty.txt", ""), "--force"}), "empty.txt"));
    EXPECT_TRUE(refuses(run(scene, {"--replay", folder / "none.txt", "--force"}), "none.txt"));
    EXPECT_TRUE(refuses(run(scene, {"--record-grants", folder / "no" / "such" / "place", "--force"}), "--record-grants"));
    EXPECT_TRUE(refuses(run(scene, {"--record-grants", folder, "--force"}), "--record-grants"));
    EXPECT_TRUE(refuses(run(scene, {"--record-grants", out() / "summary.json", "--force"}), "--record-grants"));
}

TEST_F(Verify, WritesReferencesOnlyWhenAskedAndFindsThemTheSame) {
    write("tube.json", kTube);
    write("ball.json", kBall);
    const fs::path list = write("list.txt", "# two scenes\ntube.json 10 1e-9 work:5000\nball.json 8 0\n");
    EXPECT_TRUE(refuses(call({"verify", list}), "no reference"));
    EXPECT_FALSE(fs::exists(folder / "references"));
    ASSERT_TRUE(ended_with(call({"verify", list, "--write-references"}), 0));
    EXPECT_TRUE(fs::exists(folder / "references" / "tube.json.gz"));
    const Ended same = call({"verify", list});
    ASSERT_TRUE(ended_with(same, 0));
    EXPECT_TRUE(same.says("same")) << same;
}

TEST_F(Verify, ADifferenceIsFiveAndNamed) {
    write("tube.json", kTube);
    const fs::path list = write("list.txt", "tube.json 10 1e-9\n");
    ASSERT_TRUE(ended_with(call({"verify", list, "--write-references"}), 0));
    write("tube.json", with(kTube, "[0.2, 26, 0.4]", "[0.2, 26.1, 0.4]"));
    const Ended differs = call({"verify", list, "--page", folder / "page.html"});
    ASSERT_TRUE(ended_with(differs, 5));
    EXPECT_NE(text_of(folder / "page.html").find("1 of 1 scenes differ"), std::string::npos);
    EXPECT_TRUE(differs.says("tube")) << differs;
    EXPECT_TRUE(differs.says("step 1")) << differs;
    EXPECT_TRUE(differs.says("wire")) << differs;
}

TEST_F(Verify, APageThatCannotBeWrittenIsTwoUnlessSomethingDiffers) {
    write("tube.json", kTube);
    const fs::path list = write("list.txt", "tube.json 2 1e-9\n");
    ASSERT_TRUE(ended_with(call({"verify", list, "--write-references"}), 0));
    EXPECT_TRUE(refuses(call({"verify", list, "--page", "/dev/full"}), "/dev/full: cannot be written: No space left on device"));
    const Ended nowhere = call({"verify", list, "--page", folder / "nowhere/x.html"});
    EXPECT_TRUE(refuses(nowhere, "nowhere/x.html: --page: its folder does not exist"));
    EXPECT_FALSE(nowhere.says("same")) << "refused before the runs";
    write("tube.json", with(kTube, "[0.2, 26, 0.4]", "[0.2, 26.1, 0.4]"));
    EXPECT_TRUE(ended_with(call({"verify", list, "--page", "/dev/full"}), 5));
}

TEST_F(Verify, BadListsScenesAndReferencesAreTwo) {
    write("tube.json", kTube);
    EXPECT_TRUE(refuses(call({"verify", folder / "none.txt"}), "none.txt"));
    EXPECT_TRUE(refuses(call({"verify", write("list.txt", "nowhere.json 10 0\n")}), "list.txt:1"));
    EXPECT_TRUE(refuses(call({"verify", write("list.txt", "tube.json many 0\n")}), "list.txt:1"));
    EXPECT_TRUE(refuses(call({"verify", write("list.txt", "tube.json 10 0 8ms\n"), "--write-references"}), "depends on the machine"));
    write("broken.json", "{");
    EXPECT_TRUE(refuses(call({"verify", write("list.txt", "broken.json 10 0\n"), "--write-references"}), "broken.json"));
    const fs::path list = write("list.txt", "tube.json 4 0\n");
    ASSERT_TRUE(ended_with(call({"verify", list, "--write-references"}), 0));
    const fs::path reference = folder / "references" / "tube.json.gz";
    const std::string whole = text_of(reference);
    write("references/tube.json.gz", whole.substr(0, whole.size() - 20));
    EXPECT_TRUE(refuses(call({"verify", list}), "tube.json.gz"));
    write("references/tube.json.gz", whole);
    ASSERT_TRUE(ended_with(call({"verify", list}), 0));
    write("list.txt", "tube.json 5 0\n");
    EXPECT_TRUE(refuses(call({"verify", list}), "4 steps"));
}

} // namespace
} // namespace trocar::cli_test
