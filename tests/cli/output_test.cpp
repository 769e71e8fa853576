// The files a run leaves: a contract that scripts read.
#include "program.hpp"

#include <algorithm>
#include <cstring>

namespace trocar::cli_test {
namespace {

class Output : public Program {};

/// Until the run in `out` has a file of this name; false: it never came.
bool wait_for_file(const fs::path& file) {
    for (int wait = 0; wait < 3000 && !fs::exists(file); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return fs::exists(file);
}

/// Steps have been taken: some of their rows have reached the disk.
bool wait_for_rows(const fs::path& table) {
    constexpr std::uintmax_t kFirstLine = 4096; // bytes, more than its first line has
    const auto has_rows = [&] { return fs::exists(table) && fs::file_size(table) > kFirstLine; };
    for (int wait = 0; wait < 6000 && !has_rows(); ++wait) std::this_thread::sleep_for(std::chrono::milliseconds(10));
    return has_rows();
}

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
    for (const char* key : {"steps", "simulated_s", "wall_s", "realtime_factor", "budget_kept", "realtime_kept", "worst_overrun_ms",
                            "substeps", "stable_step_s", "min_volume_ratio", "inverted_tets_max", "exact_steps", "contacts_total",
                            "unresolved_total", "assumed_total", "lumen_exits"})
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
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
        fs::remove_all(out());
        const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "--force", "-n", "100000000"});
        ASSERT_TRUE(wait_for_steps(out()));
        ASSERT_EQ(send_signal(child, signal), 0);
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
    ASSERT_TRUE(wait_for_file(out() / "steps.csv.partial")) << "killed before it began it would leave nothing either";
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    ASSERT_EQ(send_signal(child, SIGKILL), 0);
    EXPECT_EQ(wait_for(child, 30.0).signal, SIGKILL);
    EXPECT_TRUE(fs::exists(out() / "steps.csv.partial"));
    EXPECT_FALSE(fs::exists(out() / "summary.json"));
    EXPECT_FALSE(fs::exists(out() / "steps.csv"));
}

class Checkpoints : public Program {
protected:
    /// Final state of `run -n steps` with these arguments, into a folder of its own.
    std::string state_of(const fs::path& out, const std::vector<std::string>& more, const std::string& steps = "60") {
        std::vector<std::string> arguments = {"run", scene, "--out", out, "--no-pictures", "-n", steps};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const Ended ended = call(arguments);
        EXPECT_TRUE(ended_with(ended, 0));
        const Json json = Json::parse(text_of(out / "summary.json"), nullptr, false);
        return json.is_object() ? json["state_hash"].get<std::string>() : "";
    }
    fs::path scene = write("tube.json", with(kTube, "\"exact\"", "\"work:300\""));
};

TEST_F(Checkpoints, ARunThatStoppedInTheMiddleAndGoesOnEndsInTheBitsOfOneThatDidNot) {
    const std::string whole = state_of(folder / "whole", {});
    (void)state_of(folder / "first", {"--checkpoint-every", "10"}, "25");
    const std::string later = state_of(folder / "later", {"--resume", folder / "first"});
    EXPECT_EQ(later, whole);
    const Json json = Json::parse(text_of(folder / "later/summary.json"), nullptr, false);
    EXPECT_EQ(json["resumed_from_step"], 25) << "the last step has a checkpoint, whatever the interval";
    EXPECT_EQ(json["steps"], 35);
    std::istringstream rows(text_of(folder / "later/steps.csv"));
    std::string head, first;
    std::getline(rows, head), std::getline(rows, first);
    EXPECT_EQ(first.substr(0, 3), "26,") << "the table goes on where the other one ended";
    EXPECT_EQ(state_of(folder / "named", {"--resume", folder / "first/checkpoint.bin"}), whole) << "by the file's own name";
    EXPECT_EQ(state_of(folder / "first", {"--resume", folder / "first", "--force"}), whole) << "into the same folder";
    EXPECT_TRUE(fs::exists(folder / "first/checkpoint.bin")) << "what it went on from stays";
}

TEST_F(Checkpoints, OfAKilledRunAreWholeAndGoOnToTheSameBits) {
    const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "-n", "100000000", "--checkpoint-every", "7"});
    ASSERT_TRUE(wait_for_file(out() / "checkpoint.bin"));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ASSERT_EQ(send_signal(child, SIGKILL), 0);
    EXPECT_EQ(wait_for(child, 30.0).signal, SIGKILL);
    EXPECT_FALSE(fs::exists(out() / "summary.json")) << "nothing that looks finished";
    std::istringstream rows(text_of(out() / "steps.csv.partial"));
    std::size_t columns = 0, lines = 0;
    for (std::string row; std::getline(rows, row) && !rows.eof();) { // the last row may be cut
        const auto commas = static_cast<std::size_t>(std::count(row.begin(), row.end(), ','));
        if (columns == 0) columns = commas;
        EXPECT_EQ(commas, columns) << row;
        ++lines;
    }
    EXPECT_GT(columns, 20u) << "the rows that reached the disk can be read";
    const std::string steps = std::to_string(lines + 5000); // beyond its last checkpoint: rows reach the disk some thousands at a time
    const std::string whole = state_of(folder / "whole", {}, steps);
    ASSERT_TRUE(ended_with(call({"run", scene, "--out", folder / "on", "--no-pictures", "-n", steps, "--resume", out()}), 0));
    EXPECT_EQ(Json::parse(text_of(folder / "on/summary.json"), nullptr, false)["state_hash"], whole);
}

TEST_F(Checkpoints, OfAnInterruptedRunHoldItsLastStep) {
    const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "-n", "100000000", "--checkpoint-every", "1000000000"});
    ASSERT_TRUE(wait_for_rows(out() / "steps.csv.partial"));
    ASSERT_EQ(send_signal(child, SIGINT), 0);
    EXPECT_TRUE(ended_with(wait_for(child, 30.0), 130));
    const Json json = summary();
    ASSERT_TRUE(json.contains("checkpoint_step")) << json;
    EXPECT_GT(json["steps"], 0);
    EXPECT_EQ(json["checkpoint_step"], json["steps"]);
    EXPECT_TRUE(fs::exists(out() / "checkpoint.bin"));
}

TEST_F(Checkpoints, ThatDoNotFitAreRefusedBeforeAnythingIsWritten) {
    (void)state_of(folder / "first", {"--checkpoint-every", "10"}, "20");
    const fs::path file = folder / "first/checkpoint.bin";
    const auto resume_with = [&](const fs::path& of, const fs::path& from, const std::string& steps = "60") {
        return call({"run", of, "--out", folder / "never", "--no-pictures", "-n", steps, "--resume", from});
    };
    EXPECT_TRUE(
        refuses(resume_with(write("other.json", with(text_of(scene), "\"radius\": 0.5", "\"radius\": 0.6")), file), "another scene"));
    EXPECT_TRUE(refuses(resume_with(scene, write("cut.bin", text_of(file).substr(0, 500))), "cut off"));
    std::string changed = text_of(file);
    changed[changed.size() / 2] = static_cast<char>(changed[changed.size() / 2] ^ 4);
    EXPECT_TRUE(refuses(resume_with(scene, write("changed.bin", changed)), "its hash does not fit"));
    EXPECT_TRUE(refuses(resume_with(scene, write("text.bin", "some text")), "is no checkpoint"));
    EXPECT_TRUE(refuses(resume_with(scene, folder), "checkpoint.bin"));
    EXPECT_TRUE(refuses(resume_with(scene, file, "20"), "is of step 20"));
    EXPECT_FALSE(fs::exists(folder / "never"));
}

/// The host body of a surface, the blend distance of its motion, whether a body touches itself: nothing of it shows in a mesh.
TEST_F(Checkpoints, OfASceneOfWhichOneKeyWasChangedAreRefusedWithASentence) {
    const std::string organ = R"("bodies": {"organ": {"kind": "deformable", "coarse": {"mesher": "lattice", "surface_triangles": 60},
        "surface": {"shape": "box", "centre": [0, 0, 60], "extent": [30, 30, 60], "cells": 2}, "self_contact": true},
        "tube": {"embedded_in": "organ", "blend": 5, )";
    const std::string text =
        with(with(text_of(scene), R"("bodies": {"tube": {)", organ), R"("effects": [)", R"("effects": ["elasticity", "self_contact", )");
    const fs::path carried = write("carried.json", text), first = folder / "first";
    ASSERT_TRUE(ended_with(call({"run", carried, "--out", first, "--no-pictures", "-n", "4", "--checkpoint-every", "2"}), 0));
    const auto resume_with = [&](const fs::path& of, const std::string& out) {
        return call({"run", of, "--out", folder / out, "--no-pictures", "-n", "6", "--resume", first / "checkpoint.bin"});
    };
    for (const auto& [key, other] : {std::pair(R"("blend": 5)", R"("blend": 6)"), std::pair(R"("embedded_in": "organ", "blend": 5, )", ""),
                                     std::pair(R"("self_contact": true)", R"("self_contact": false)")})
        EXPECT_TRUE(refuses(resume_with(write("other.json", with(text, key, other)), "never"), "was made of another scene")) << key;
    EXPECT_FALSE(fs::exists(folder / "never"));
    EXPECT_TRUE(ended_with(resume_with(write("again.json", text), "on"), 0)) << "what was not changed goes on";
}

TEST_F(Output, TenLaunchesOfAProgramGiveTheSameBits) {
    const fs::path scene = write("tube.json", kTube);
    std::string first;
    for (int launch = 0; launch < 10; ++launch) {
        const fs::path folder_of = folder / std::to_string(launch);
        ASSERT_TRUE(ended_with(call({"run", scene, "--out", folder_of, "--no-pictures", "--budget", "work:300"}), 0));
        const Json json = Json::parse(text_of(folder_of / "summary.json"), nullptr, false);
        if (launch == 0) first = json["state_hash"];
        EXPECT_EQ(json["state_hash"], first) << launch;
    }
}

TEST_F(Output, TwoRunsIntoOneFolderAreNotMixed) {
    const fs::path scene = write("tube.json", kTube);
    const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "-n", "100000000"});
    ASSERT_TRUE(wait_for_file(out() / "steps.csv.partial"));
    std::string command = std::string(TROCAR_PROGRAM) + " run " + scene.string() + " --force --no-pictures --out " + out().string() +
                          " > " + (folder / "second").string() + " 2>&1";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 2);
    EXPECT_NE(text_of(folder / "second").find("another run is writing"), std::string::npos) << text_of(folder / "second");
    ASSERT_EQ(send_signal(child, SIGINT), 0);
    EXPECT_TRUE(ended_with(wait_for(child, 30.0), 130));
}

/// A limit on the size of files is a disk that is full: write fails in the middle.
TEST_F(Output, ADiskThatIsFullIsExit2AndNothingLooksFinished) {
    const fs::path scene = write("tube.json", kTube);
    const std::string command = "ulimit -f 8; trap '' XFSZ; exec " + std::string(TROCAR_PROGRAM) + " run " + scene.string() +
                                " --no-pictures -n 2000 --checkpoint-every 100 --out " + out().string() + " > " +
                                (folder / "full").string() + " 2>&1";
    EXPECT_EQ(WEXITSTATUS(std::system(("bash -c \"" + command + "\"").c_str())), 2) << text_of(folder / "full");
    EXPECT_NE(text_of(folder / "full").find("cannot be written"), std::string::npos) << text_of(folder / "full");
    EXPECT_TRUE(names_as_missing("steps.csv")) << "a run whose rows are lost does not look whole";
    EXPECT_FALSE(fs::exists(out() / "steps.csv"));
}

/// A run with every kind of output, of which some cannot be written: a folder stands in their place.
class Missing : public Program {
protected:
    Ended run_with(const std::vector<fs::path>& blocked, const fs::path& grants = "/dev/null") {
        fs::remove_all(out());
        for (const fs::path& path : blocked) fs::create_directories(out() / path / "of somebody");
        return call({"run", scene, "--out", out(), "--no-pictures", "--force", "--trace", "--record", "--checkpoint-every", "7",
                     "--record-grants", grants});
    }
    /// All but `missing` are there, and the summary names that one alone.
    void expect_all_but(const fs::path& missing) {
        for (const fs::path& other : all)
            if (other != missing) {
                EXPECT_TRUE(fs::is_regular_file(out() / other)) << other << " without " << missing;
            }
        if (missing == "summary.json") return;
        ASSERT_EQ(summary()["missing_outputs"].size(), 1u) << missing;
        EXPECT_EQ(summary()["missing_outputs"][0].get<std::string>().find(missing.string() + " is missing: "), 0u) << summary();
    }
    fs::path scene = write("tube.json", with(kTube, "\"exact\"", "\"work:300\""));
    const std::vector<fs::path> all{"steps.csv", "report.html", "checkpoint.bin", "trace.json", "summary.json", "record/states.pvd"};
};

TEST_F(Missing, OneOutputThatCannotBeWrittenLosesNoOther) {
    ASSERT_TRUE(ended_with(run_with({}), 0));
    EXPECT_EQ(summary()["missing_outputs"], Json::array());
    const std::string hash = summary()["state_hash"];
    for (const fs::path& blocked : all) {
        if (blocked == "record/states.pvd") continue; // seen before the first step, when nothing is lost yet
        const Ended ended = run_with({blocked});
        EXPECT_TRUE(ended_with(ended, 2)) << blocked;
        EXPECT_TRUE(ended.says("error: " + blocked.string() + " is missing: ")) << ended;
        EXPECT_TRUE(ended.says("20 steps in ") && ended.says("the other outputs of the 20 steps are in " + out().string())) << ended;
        expect_all_but(blocked);
        if (blocked != "summary.json") {
            EXPECT_EQ(summary()["state_hash"], hash) << blocked;
        }
    }
    const Ended ended = run_with({}, "/dev/full");
    EXPECT_TRUE(ended_with(ended, 2));
    EXPECT_TRUE(ended.says("error: /dev/full is missing: /dev/full: cannot be written: No space left on device")) << ended;
    expect_all_but("/dev/full");
}

TEST_F(Missing, IsWrittenInTheSummaryAlsoWhereNobodyCanReadTheNotice) {
    fs::create_directories(out() / "checkpoint.bin" / "of somebody");
    const std::string command = std::string(TROCAR_PROGRAM) + " run " + scene.string() + " --no-pictures --force --checkpoint-every 7 --out " +
                                out().string() + " > /dev/null 2> /dev/full";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 2);
    ASSERT_TRUE(fs::exists(out() / "summary.json"));
    EXPECT_EQ(summary()["steps"], 20);
    EXPECT_TRUE(names_as_missing("checkpoint.bin"));
}

TEST_F(Missing, SeveralAreNamedOneByOne) {
    const Ended ended = run_with({"report.html", "trace.json"});
    ASSERT_TRUE(ended_with(ended, 2));
    EXPECT_EQ(summary()["missing_outputs"].size(), 2u);
    EXPECT_TRUE(ended.says("error: report.html is missing: ") && ended.says("error: trace.json is missing: ")) << ended;
    EXPECT_EQ(ended.out.find("report.html"), std::string::npos) << "no pointer to what is not there: " << ended;
}

/// The figures of `prepare`, `plan` and `contacts` likewise: each file by itself.
TEST_F(Missing, OfOtherCommandsTheOtherFilesAreThereToo) {
    const fs::path cube = write("cube.off", "OFF\n8 12 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n1 0 1\n1 1 1\n0 1 1\n"
                                            "3 0 2 1\n3 0 3 2\n3 4 5 6\n3 4 6 7\n3 0 1 5\n3 0 5 4\n"
                                            "3 1 2 6\n3 1 6 5\n3 2 3 7\n3 2 7 6\n3 3 0 4\n3 3 4 7\n");
    for (const char* blocked : {"spheres.sph", "prepare.json"}) {
        fs::remove_all(out());
        fs::create_directories(out() / blocked / "of somebody");
        const Ended ended = call({"prepare", cube, "--out", out(), "--force", "--depth", "1"});
        EXPECT_TRUE(ended_with(ended, 2));
        EXPECT_TRUE(ended.says("1 of 2 outputs are missing, see above; the others are written to ")) << ended;
        for (const char* other : {"spheres.sph", "prepare.json"})
            EXPECT_EQ(fs::is_regular_file(out() / other), std::string(other) != blocked);
    }
    const Ended ended = call({"contacts", cube, cube, "--out", "/dev/full", "--stats", folder / "stats.json"});
    EXPECT_TRUE(ended_with(ended, 2));
    EXPECT_TRUE(fs::exists(folder / "stats.json")) << ended;
}

/// Under a limit on the size of files no picture fits and the summary does.
TEST_F(Missing, PicturesOnAFullDiskLoseNeitherTheSummaryNorTheTable) {
    const fs::path pictures =
        write("pictures.json", with(kTube, "\"budget\"", "\"outputs\": {\"pictures\": 2, \"size\": [640, 480]}, \"budget\""));
    const Ended fine = call({"run", pictures, "--out", folder / "fine"});
    ASSERT_TRUE(ended_with(fine, 0));
    if (fine.says("no pictures")) GTEST_SKIP() << "no OpenGL draws here";
    const std::string command = "ulimit -f 16; trap '' XFSZ; exec " + std::string(TROCAR_PROGRAM) + " run " + pictures.string() +
                                " --out " + out().string() + " > " + (folder / "full").string() + " 2>&1";
    EXPECT_EQ(WEXITSTATUS(std::system(("bash -c \"" + command + "\"").c_str())), 2) << text_of(folder / "full");
    EXPECT_TRUE(names_as_missing("pictures")) << text_of(folder / "full");
    EXPECT_TRUE(fs::exists(out() / "summary.json")) << text_of(folder / "full");
    EXPECT_TRUE(fs::exists(out() / "steps.csv"));
}

/// A scene that is refused only when it is prepared: an error reported instead was found before.
TEST_F(Output, AnOccupiedFolderOrABadCheckpointIsFoundBeforeAnythingIsPrepared) {
    const std::string broken = with(kTube, "\"position\": [0, 0, 10]", "\"position\": [0, 50, 10]");
    const fs::path scene = write("outside.json", broken);
    ASSERT_TRUE(refuses(call({"run", scene, "--out", out()}), "such as [")) << "preparation refuses it";
    EXPECT_FALSE(fs::exists(out()));
    fs::create_directories(out());
    write("out/mine.txt", "some text");
    write("file", "some text");
    for (const std::string command : {"run", "cost"}) {
        EXPECT_TRUE(refuses(call({command, scene, "--out", out()}), "it holds mine.txt")) << command;
        EXPECT_TRUE(refuses(call({command, scene, "--out", folder / "file"}), "is a file")) << command;
        EXPECT_TRUE(refuses(call({command, scene, "--out", folder / "file/below"}), "cannot be made")) << command;
    }
    const auto resumed = [&](const fs::path& from) { return call({"run", scene, "--out", folder / "never", "--resume", from.string()}); };
    EXPECT_TRUE(refuses(resumed(folder / "nowhere.bin"), "nowhere.bin"));
    EXPECT_TRUE(refuses(resumed(write("text.bin", "some text")), "is no checkpoint"));
    ASSERT_TRUE(ended_with(
        call({"run", write("tube.json", kTube), "--out", folder / "first", "--no-pictures", "-n", "5", "--checkpoint-every", "5"}), 0));
    EXPECT_TRUE(refuses(resumed(folder / "first"), "such as [")) << "a good one is no reason";
    const fs::path other = write("other.json", with(broken, "\"name\": \"tube\"", "\"name\": \"pipe\""));
    EXPECT_TRUE(refuses(call({"run", other, "--out", folder / "never", "--resume", folder / "first"}), "another scene, \"tube\""));
    EXPECT_TRUE(refuses(call({"run", scene, "--out", folder / "never", "--resume", folder / "first", "-n", "5"}), "is of step 5"));
    EXPECT_FALSE(fs::exists(folder / "never"));
}

TEST_F(Output, WhatAnEarlierRunLeftStaysWhereTheNextOneIsRefused) {
    ASSERT_TRUE(ended_with(run(write("tube.json", kTube)), 0));
    const std::string before = text_of(out() / "steps.csv");
    const fs::path broken = write("outside.json", with(kTube, "\"position\": [0, 0, 10]", "\"position\": [0, 50, 10]"));
    for (const char* command : {"run", "cost"}) {
        EXPECT_TRUE(refuses(call({command, broken, "--out", out(), "--force"}), "such as [")) << command;
        EXPECT_EQ(text_of(out() / "steps.csv"), before) << command;
    }
    EXPECT_TRUE(refuses(call({"prepare", write("open.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "--out", out(), "--force"}), ""));
    EXPECT_EQ(text_of(out() / "steps.csv"), before);
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST_F(Output, UnderALimitOfAddressSpaceToolsAreStartedAsWithoutOne) {
    const fs::path scene = write("tube.json", kTube);
    ASSERT_TRUE(ended_with(run(scene), 0));
    const bool plots = text_of(out() / "report.html").find("<svg") != std::string::npos;
    for (const char* limit : {"8000000", "4000000", "1500000"}) { // KiB
        fs::remove_all(out());
        const std::string command = "ulimit -v " + std::string(limit) + "; exec " + std::string(TROCAR_PROGRAM) + " run " + scene.string() +
                                    " --no-pictures --out " + out().string() + " > " + (folder / "limited").string() + " 2>&1";
        EXPECT_EQ(WEXITSTATUS(std::system(("bash -c \"" + command + "\"").c_str())), 0) << limit << text_of(folder / "limited");
        EXPECT_EQ(text_of(folder / "limited").find("could not start"), std::string::npos) << limit << text_of(folder / "limited");
        EXPECT_EQ(text_of(out() / "report.html").find("<svg") != std::string::npos, plots) << limit;
    }
}
#endif

/// A VTK file whose blocks of raw numbers follow one another to its end, as many as it names.
testing::AssertionResult is_whole_vtk(const fs::path& file) {
    const std::string text = text_of(file), begin = "<AppendedData encoding=\"raw\">\n_", end = "\n</AppendedData>\n</VTKFile>\n";
    const std::size_t first = text.find(begin);
    if (text.rfind("<?xml", 0) != 0 || first == std::string::npos || text.size() < end.size() ||
        text.compare(text.size() - end.size(), end.size(), end) != 0)
        return testing::AssertionFailure() << file << " is cut off, " << text.size() << " bytes";
    const std::size_t data = first + begin.size(), stop = text.size() - end.size();
    std::size_t at = data;
    for (std::size_t name = text.find(" offset=\""); name < first; name = text.find(" offset=\"", name + 1)) {
        if (std::stoull(text.substr(name + 9)) != at - data) return testing::AssertionFailure() << file << ": an array begins elsewhere";
        std::uint64_t bytes = 0;
        if (at + sizeof bytes > stop) return testing::AssertionFailure() << file << ": an array is not there";
        std::memcpy(&bytes, text.data() + at, sizeof bytes);
        at += sizeof bytes + bytes;
    }
    if (at == stop) return testing::AssertionSuccess();
    return testing::AssertionFailure() << file << ": its arrays end at " << at << ", it at " << stop;
}

/// All that is there under its final name can be read, and the collection names nothing else. Returns how many states it has.
std::size_t expect_readable_states(const fs::path& folder) {
    std::size_t states = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder)) {
        const std::string name = entry.path().filename().string(), kind = entry.path().extension().string();
        if (name.front() == '.') continue; // not finished, and not called so
        if (kind == ".vtp" || kind == ".vtu") {
            EXPECT_TRUE(is_whole_vtk(entry.path()));
        }
        if (kind != ".pvd") continue;
        const std::string text = text_of(entry.path());
        EXPECT_EQ(text.rfind("<?xml", 0), 0u);
        EXPECT_NE(text.find("</VTKFile>\n"), std::string::npos) << entry.path() << " is cut off";
        for (std::size_t at = text.find(" file=\""); at != std::string::npos; at = text.find(" file=\"", at + 1), ++states) {
            const std::string file = text.substr(at + 7, text.find('"', at + 7) - at - 7);
            EXPECT_TRUE(fs::exists(entry.path().parent_path() / file)) << file << " is named and not there";
        }
    }
    return states;
}

TEST_F(Output, RecordedStatesOfAKilledRunCanBeReadAndTheCollectionNamesNoOthers) {
    const fs::path scene = write("tube.json", with(kTube, "\"budget\"", "\"outputs\": {\"record_every\": 2}, \"budget\""));
    std::size_t least = 1000;
    for (const int ms : {0, 7, 23, 61, 150}) { // after its first states are there: in the middle of something
        fs::remove_all(out());
        const pid_t child = start({"run", scene, "--out", out(), "--no-pictures", "--force", "--record", "-n", "100000000"});
        ASSERT_TRUE(wait_for_file(out() / "record/states.pvd")) << "no collection came";
        std::this_thread::sleep_for(std::chrono::milliseconds(ms));
        ASSERT_EQ(send_signal(child, SIGKILL), 0);
        EXPECT_EQ(wait_for(child, 30.0).signal, SIGKILL);
        EXPECT_FALSE(fs::exists(out() / "summary.json"));
        least = std::min(least, expect_readable_states(out()));
    }
    EXPECT_GT(least, 0u);
}

TEST_F(Output, OnAFullDiskWhatIsThereUnderItsFinalNameCanBeRead) {
    const fs::path scene = write("tube.json", kTube);
    for (const int kib : {8, 128}) { // no state fits; the states do, and the table of steps does not
        fs::remove_all(out());
        const std::string command = "ulimit -f " + std::to_string(kib) + "; trap '' XFSZ; exec " + std::string(TROCAR_PROGRAM) + " run " +
                                    scene.string() + " --no-pictures -n 2000 --record --out " + out().string() + " > " +
                                    (folder / "full").string() + " 2>&1";
        EXPECT_EQ(WEXITSTATUS(std::system(("bash -c \"" + command + "\"").c_str())), 2) << text_of(folder / "full");
        EXPECT_NE(text_of(folder / "full").find("cannot be written"), std::string::npos) << text_of(folder / "full");
        EXPECT_TRUE(names_as_missing("steps.csv")) << kib;
        EXPECT_FALSE(fs::exists(out() / "steps.csv"));
        const std::size_t states = expect_readable_states(out());
        EXPECT_EQ(states > 0, kib == 128) << kib << " KiB a file";
    }
}

} // namespace
} // namespace trocar::cli_test
