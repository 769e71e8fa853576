// `bench`: the tables of the sphere trees come out whole, and the guaranteed figures are in them.
#include "program.hpp"

#include <map>

namespace trocar::cli_test {
namespace {

/// Percent of the surface; parts shorter than 1e-4 of the body that lie in no single sphere count as uncovered, since nothing proves
/// them covered: a few of them along the seams of spheres.
constexpr double kUndecided = 1e-5;

class BenchCommand : public Program {
protected:
    Json measure(const std::string& name, std::vector<std::string> more = {}) {
        const fs::path file = folder / (name + ".json");
        more.insert(more.begin(), {"bench", name, "--quick", "--json", file.string()});
        EXPECT_TRUE(ended_with(call(more), 0));
        return Json::parse(text_of(file), nullptr, false);
    }
};

TEST_F(BenchCommand, AnInterruptedDescentMissesNothingAndCallsLessTouchingTheMoreItMayDo) {
    const Json table = measure("interruptible", {"--scene", std::string(TROCAR_SOURCE_DIR) + "/assets/scenes/spikes.json"});
    ASSERT_TRUE(table.contains("rows"));
    double last = 0.0;
    std::string bodies;
    int frames = 0;
    for (const Json& row : table["rows"]) {
        if (row.contains("steps_per_s")) { // whole steps
            ++frames;
            EXPECT_GT(row["steps_per_s"].get<double>(), 0.0) << row;
            EXPECT_FALSE(row.contains("fps")) << row;
            continue;
        }
        EXPECT_EQ(row["fps"], row["descents_per_s"]) << "a deprecated alias, until the next version";
        EXPECT_EQ(row["missed"], 0.0) << row;
        EXPECT_GE(row["called_touching"].get<double>(), row["touching"].get<double>()) << row;
        EXPECT_GT(row["touching"].get<double>(), 0.0) << "nothing to find: " << row;
        if (!row["budget"].get<std::string>().starts_with("work")) continue;
        if (row["bodies"] == bodies) {
            EXPECT_LE(row["called_touching"].get<double>(), last) << row;
        }
        bodies = row["bodies"];
        last = row["called_touching"];
    }
    EXPECT_EQ(frames, 5);
    EXPECT_EQ(table["rows"].size(), 3u * (5 + 1 + 4) + 5);
}

TEST_F(BenchCommand, EveryTreeCoversItsSurface) {
    const Json table = measure("spheretree");
    ASSERT_TRUE(table.contains("rows"));
    int trees = 0;
    for (const Json& row : table["rows"]) {
        if (!row.contains("leaves")) continue;
        ++trees;
        EXPECT_LT(row["uncovered_percent"].get<double>(), kUndecided) << row;
        EXPECT_GT(row["reachable_percent"].get<double>(), 100.0 - kUndecided) << row;
        EXPECT_LE(row["leaves"], 512) << row;
    }
    EXPECT_GE(trees, 2);
    EXPECT_GT(table["rows"].back()["million_tests_per_s"].get<double>(), 0.0);
}

TEST_F(BenchCommand, SetBasedCullingFindsWhatTheHierarchyFindsAndTestsLess) {
    const Json table = measure("chromatic");
    ASSERT_TRUE(table.contains("rows"));
    std::map<std::string, double> hits, tests; // of the hierarchy, by scene
    int compared = 0;
    for (const Json& row : table["rows"]) {
        if (!row.contains("hits")) continue; // trees tested pair by pair count pairs of features more than once
        const std::string scene = row["scene"];
        if (row["method"] == "this library's hierarchy") {
            hits[scene] = row["hits"];
            tests[scene] = row["tests"];
            EXPECT_GT(row["hits"].get<double>(), 0.0) << row;
        } else if (hits.count(scene) > 0) {
            ++compared;
            EXPECT_EQ(row["hits"], hits[scene]) << row;
            EXPECT_LE(row["tests"].get<double>(), tests[scene]) << row;
            EXPECT_LE(row["pcs_after_II"].get<double>(), row["pcs_after_I"].get<double>()) << row;
        }
    }
    EXPECT_GE(compared, 6);
}

TEST_F(BenchCommand, AnUnknownNameIsRefusedWithTheKnownOnes) {
    const Ended ended = call({"bench", "spheretrees"});
    EXPECT_TRUE(ended_with(ended, 2));
    EXPECT_NE(ended.err.find("interruptible"), std::string::npos);
    EXPECT_NE(ended.err.find("python"), std::string::npos);
}

/// A program that was copied alone, or a build of the demo, which makes no benches.
TEST_F(BenchCommand, WithoutTheBenchesSaysHowTheyAreMade) {
    const fs::path alone = folder / "trocar";
    fs::copy_file(TROCAR_PROGRAM, alone);
    const Ended ended = wait_for(start({"bench", "laws"}, alone), kPatience);
    EXPECT_TRUE(ended_with(ended, 2)) << ended;
    EXPECT_TRUE(ended.says((folder / "trocar-bench").string() + " is not there")) << ended;
    EXPECT_TRUE(ended.says("./start build")) << ended;
    EXPECT_TRUE(ended_with(wait_for(start({"--version"}, alone), kPatience), 0)) << "all else goes on";
}

TEST_F(BenchCommand, PythonIsListedAndTakesNoOptionOfATable) {
    const Ended listed = call({"bench"});
    EXPECT_TRUE(ended_with(listed, 0));
    EXPECT_NE(listed.out.find("\npython "), std::string::npos);
    const Ended ended = call({"bench", "python", "--page", "page.html"});
    EXPECT_TRUE(ended_with(ended, 2));
    EXPECT_NE(ended.err.find("--quick"), std::string::npos);
}

} // namespace
} // namespace trocar::cli_test
