// Exit codes, options and what they refuse.
#include "program.hpp"

namespace trocar::cli_test {
namespace {

class Usage : public Program {};
class Run : public Program {};
class Budget : public Program {};
class PathFile : public Program {};
class Explain : public Program {};
class Schema : public Program {};

TEST_F(Usage, HelpAndVersionEndWell) {
    EXPECT_TRUE(ended_with(call({"--help"}), 0));
    EXPECT_TRUE(ended_with(call({"run", "--help"}), 0));
    EXPECT_EQ(call({"help"}).out, call({"--help"}).out);
    EXPECT_EQ(call({"help", "run"}).out, call({"run", "--help"}).out);
    const Ended version = call({"--version"});
    EXPECT_TRUE(ended_with(version, 0));
    EXPECT_TRUE(version.says("trocar 1.")) << version;
}

TEST_F(Usage, WrongCommandLinesEndWithTwo) {
    const std::string scene = write("tube.json", kTube);
    EXPECT_TRUE(refuses(call({}), "subcommand"));
    EXPECT_TRUE(refuses(call({"rnu", scene}), "nearest known command: \"run\""));
    EXPECT_TRUE(refuses(call({"run"}), "scene"));
    EXPECT_TRUE(refuses(call({"explain"}), "scene"));
    EXPECT_TRUE(refuses(call({"run", scene, "--nonsense"}), "--nonsense"));
    EXPECT_TRUE(refuses(call({"run", scene, "-n"}), "--steps"));
    EXPECT_TRUE(refuses(call({"run", scene, "-n", "-5"}), "--steps"));
    EXPECT_TRUE(refuses(call({"run", scene, "-n", "many"}), "many"));
    EXPECT_TRUE(refuses(call({"run", scene, "-n", "1e3"}), "1e3"));
    EXPECT_TRUE(refuses(call({"run", scene, "-n", "99999999999999999999"}), "--steps"));
}

TEST_F(Usage, EveryErrorBeginsWithErrorAndNamesTheNearestWord) {
    const std::string scene = write("tube.json", kTube);
    const std::vector<std::pair<std::vector<std::string>, std::string>> wrong{
        {{}, "error: "},
        {{"rnu", scene}, "nearest known command: \"run\""},
        {{"run", scene, "--bugdet", "1ms"}, "nearest known option: \"--budget\""},
        {{"run", "--frce"}, "nearest known option: \"--force\""},
        {{"run", scene, "--bugdet=1ms"}, "the unknown option \"--bugdet\""},
        {{"run", scene, "another.json"}, "\"another.json\" beyond those that it takes"},
        {{"import", "vesel", "a.stl"}, "nearest known kind: \"vessel\""},
        {{"--hlep"}, "nearest known option: \"--help\""},
        {{"run"}, "`trocar run --help` shows what it takes"},
        {{"run", scene, "-n", "many"}, "many"},
        {{"docs", "comands"}, "nearest known page: \"commands\""},
        {{"bench", "lwas"}, "laws"},
        {{"run", scene, "--budget"}, "--budget: found another number of values"},
    };
    for (const auto& [arguments, piece] : wrong) {
        const Ended ended = call(arguments);
        EXPECT_TRUE(refuses(ended, piece)) << piece;
        EXPECT_EQ(ended.err.rfind("error: ", 0), 0u) << ended;
        EXPECT_TRUE(ended.out.empty()) << ended;
    }
}

TEST_F(Usage, EveryCommandHasAnExample) {
    const Ended all = call({"docs", "commands"});
    ASSERT_TRUE(ended_with(all, 0));
    std::istringstream page(all.out);
    std::size_t commands = 0, examples = 0;
    for (std::string line; std::getline(page, line);) {
        commands += (line.starts_with("## ") && line != "## Exit codes") || line.starts_with("### ");
        examples += line.starts_with("Example: `trocar ");
    }
    EXPECT_GE(commands, 20u);
    EXPECT_EQ(examples, commands);
    for (const char* command : {"run", "view", "import"}) EXPECT_TRUE(call({command, "--help"}).says("Example: trocar ")) << command;
}

TEST_F(Usage, CompletionsKnowEveryCommandAndTheManualEveryOption) {
    const std::string bash = call({"docs", "bash"}).out, zsh = call({"docs", "zsh"}).out, manual = call({"docs", "man"}).out;
    EXPECT_TRUE(manual.starts_with(".TH TROCAR 1"));
    for (const char* word : {"run", "explain", "segmentation", "--budget", "--anatomy-seed"}) {
        EXPECT_NE(bash.find(word), std::string::npos) << word;
        EXPECT_NE(zsh.find(word), std::string::npos) << word;
    }
    EXPECT_EQ(bash.find("sweep-worker"), std::string::npos) << "what the program alone calls is not offered";
    write("completion", bash);
    EXPECT_EQ(std::system(("bash -n '" + (folder / "completion").string() + "'").c_str()), 0);
    write("words", ". '" + (folder / "completion").string() + "'\nCOMP_WORDS=(trocar run --bud)\nCOMP_CWORD=2\n_trocar\n[[ ${COMPREPLY[*]} == --budget ]]\n");
    EXPECT_EQ(std::system(("bash '" + (folder / "words").string() + "'").c_str()), 0);
}

TEST_F(Usage, ASceneThatIsNotThereIsNamed) {
    EXPECT_TRUE(refuses(call({"run", "nowhere.json", "--out", out()}), "nowhere.json"));
    EXPECT_TRUE(refuses(call({"explain", "nowhere.json"}), "nowhere.json"));
    EXPECT_TRUE(refuses(call({"run", folder.string(), "--out", out()}), folder.string())) << "a folder is no scene";
    EXPECT_FALSE(fs::exists(out())) << "nothing is left behind";
}

TEST_F(Run, EndsWithZeroAndSaysWhatItDid) {
    const Ended ended = run(write("tube.json", kTube));
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("20 steps in ")) << ended;
    EXPECT_TRUE(ended.says("real-time factor")) << ended;
    EXPECT_TRUE(ended.says("p50/p95/p99/max")) << ended;
    EXPECT_TRUE(ended.says("budget kept in 100")) << ended;
    EXPECT_TRUE(ended.says("of 20 whole steps took longer than the 10 ms they simulate")) << ended;
    for (const char* name : {"summary.json", "steps.csv", "report.html"}) EXPECT_TRUE(fs::exists(out() / name)) << name;
}

TEST_F(Run, TakesAsManyStepsAsAskedOnAnyScene) {
    const fs::path tube = write("tube.json", kTube);
    for (const int steps : {0, 1, 7, 45}) { // fewer and more than the scene's 20
        ASSERT_TRUE(ended_with(run(tube, {"-n", std::to_string(steps), "--force"}), 0)) << steps;
        EXPECT_EQ(summary()["steps"], steps);
    }
    const std::string scenes = std::string(TROCAR_SOURCE_DIR) + "/assets/scenes/";
    for (const char* name : {"straight_tube.json", "falling_sphere.json"}) {
        ASSERT_TRUE(ended_with(run(scenes + name, {"-n", "3", "--force"}), 0)) << name;
        EXPECT_EQ(summary()["steps"], 3) << name;
        EXPECT_EQ(summary()["scene"], std::string("assets/scenes/") + name);
    }
}

TEST_F(Run, RefusesABusyFolderUnlessForced) {
    const fs::path scene = write("tube.json", kTube);
    fs::create_directories(out());
    ASSERT_TRUE(ended_with(run(scene, {"-n", "2"}), 0)) << "an empty folder is fine";
    EXPECT_TRUE(refuses(run(scene, {"-n", "2"}), "--force"));
    EXPECT_TRUE(ended_with(run(scene, {"-n", "3", "--force"}), 0));
    EXPECT_EQ(summary()["steps"], 3);
}

TEST_F(Run, RefusesAnOutputThatIsAFileOrCannotBeMade) {
    const fs::path scene = write("tube.json", kTube);
    write("out", "not a folder");
    EXPECT_TRUE(refuses(run(scene, {"-n", "1"}), "out"));
    EXPECT_EQ(text_of(out()), "not a folder");
    EXPECT_TRUE(refuses(call({"run", scene, "--out", "/proc/no/such/place", "-n", "1"}), "/proc/no/such/place"));
}

TEST_F(Run, AMissedBudgetIsFourOnlyWhenAskedFor) {
    const fs::path scene = write("tube.json", kTube);
    EXPECT_TRUE(ended_with(run(scene, {"--budget", "1ns"}), 0));
    EXPECT_LT(summary()["budget_kept"], 1.0);
    EXPECT_TRUE(ended_with(run(scene, {"--budget", "1ns", "--fail-on-overrun", "--force"}), 4));
    EXPECT_EQ(summary()["mode"], "wall");
    EXPECT_TRUE(ended_with(run(scene, {"--budget", "1us", "--fail-on-overrun", "--force"}), 4));
    EXPECT_TRUE(ended_with(run(scene, {"--budget", "10s", "--fail-on-overrun", "--force"}), 0));
    EXPECT_TRUE(ended_with(run(scene, {"--budget", "work:0", "--fail-on-overrun", "--force"}), 0)) << "work has no deadline";
}

TEST_F(Run, AStateThatLeavesItsBoundsIsThreeWithTheLastGoodOneSaved) {
    const fs::path scene = write("thick.json", R"({
        "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1},
        "bodies": {"ball": {"kind": "deformable", "surface": {"shape": "sphere", "radius": 30, "subdivisions": 2},
            "material": {"young_modulus": 5, "density": 1000, "viscosity": 90, "cap_viscosity": false}, "coarse": {"surface_triangles": 80}}},
        "effects": ["elasticity", "damping"]})");
    const Ended ended = run(scene);
    ASSERT_TRUE(ended_with(ended, 3));
    EXPECT_TRUE(ended.says("ball")) << "names the body";
    EXPECT_TRUE(ended.says("tetrahedron")) << "and the element";
    const Json json = summary();
    EXPECT_EQ(json["finite"], false);
    EXPECT_FALSE(json["failure"].get<std::string>().empty());
    EXPECT_TRUE(fs::exists(out() / json["last_good_state"].get<std::string>()));
}

TEST_F(Run, RecordsStatesForParaView) {
    ASSERT_TRUE(ended_with(run(write("tube.json", kTube), {"-n", "3", "--record"}), 0));
    bool pvd = false, vtp = false;
    for (const auto& entry : fs::recursive_directory_iterator(out())) {
        pvd = pvd || entry.path().extension() == ".pvd";
        vtp = vtp || entry.path().extension() == ".vtp";
    }
    EXPECT_TRUE(pvd && vtp);
}

TEST_F(Budget, ThatIsNoneIsRefusedWithWhatWouldBeRight) {
    const fs::path scene = write("tube.json", kTube);
    for (const char* budget : {"-1ms", "5", "1e300s", "9999999h", "nan", "nanms", "inf", "infs", "-0.5us", "work:-1", "work:", "work:1.5",
                               "work:99999999999999999999", "soon", "8 parsecs", "ms", "1ms2", "exactly"}) {
        const Ended ended = run(scene, {std::string("--budget=") + budget});
        EXPECT_TRUE(refuses(ended, "--budget")) << budget;
        EXPECT_TRUE(ended.says("work:20000")) << budget << ": " << ended;
        EXPECT_FALSE(fs::exists(out())) << budget;
    }
}

TEST_F(Budget, OfAnySizeRunsAndShowsInTheSummary) {
    const fs::path scene = write("tube.json", kTube);
    for (const auto& [budget, mode] : std::vector<std::pair<std::string, std::string>>{{"1ms", "wall"},
                                                                                       {"250us", "wall"},
                                                                                       {"0ms", "wall"},
                                                                                       {"2s", "wall"},
                                                                                       {"work:0", "work"},
                                                                                       {"work:1", "work"},
                                                                                       {"work:20000", "work"},
                                                                                       {"exact", "exact"}}) {
        ASSERT_TRUE(ended_with(run(scene, {"--budget", budget, "--force"}), 0)) << budget;
        EXPECT_EQ(summary()["mode"], mode) << budget;
        EXPECT_EQ(summary()["lumen_exits"], 0) << budget;
    }
}

TEST_F(Budget, OfWorkGivesTheSameHashTwice) {
    const fs::path scene = write("tube.json", kTube);
    ASSERT_TRUE(ended_with(run(scene, {"--budget", "work:300"}), 0));
    const Json first = summary();
    ASSERT_TRUE(ended_with(run(scene, {"--budget", "work:300", "--force"}), 0));
    EXPECT_EQ(summary()["state_hash"], first["state_hash"]);
    EXPECT_EQ(first["state_hash"].get<std::string>().size(), 16u);
}

TEST_F(PathFile, ReplacesTheScript) {
    const fs::path scene = write("tube.json", kTube);
    for (const char* text : {"t,insertion,rotation\n0,20,0\n0.2,25,0.1\n", "0,20,0\n0.2,25,0.1\n",
                             "# by hand\nt, insertion, rotation\n0, 20, 0\n0.2, 25, 0.1\n"}) {
        const fs::path csv = write("path.csv", text);
        ASSERT_TRUE(ended_with(run(scene, {"--path", csv, "--force"}), 0)) << text;
        EXPECT_NEAR(summary()["insertion_m"].get<double>(), 0.025, 1e-9) << text;
    }
}

TEST_F(PathFile, ThatIsWrongIsNamedWithItsLine) {
    const fs::path scene = write("tube.json", kTube);
    const auto refused = [&](const std::string& text, const std::string& piece) {
        return refuses(run(scene, {"--path", write("bad.csv", text)}), piece);
    };
    EXPECT_TRUE(refused("0,20,0\n0.2,25,0\n0.1,26,0\n", "bad.csv:3")) << "time goes back";
    EXPECT_TRUE(refused("0,20,0\nnan,25,0\n", "bad.csv:2"));
    EXPECT_TRUE(refused("0,20,0\n0.2,inf,0\n", "bad.csv:2"));
    EXPECT_TRUE(refused("0,20,0\n0.2,25\n", "bad.csv:2"));
    EXPECT_TRUE(refused("t,insertion,rotation\n0,20,0\n0.2,twenty,0\n", "bad.csv:3"));
    EXPECT_TRUE(refused("time,depth,turn\n0,20,0\n", "bad.csv"));
    EXPECT_TRUE(refused("t,insertion,rotation\n", "bad.csv"));
    EXPECT_TRUE(refused("", "bad.csv"));
    EXPECT_TRUE(refused("0,20,0\n0.2,2500,0\n", "bad.csv")) << "longer than the wire, or faster than the drive";
    EXPECT_TRUE(refused("0,20,0\n0.01,90,0\n", "mm/s")) << "faster than the drive";
    EXPECT_TRUE(refuses(run(scene, {"--path", (folder / "none.csv").string()}), "none.csv"));
}

TEST_F(PathFile, OnASceneWithoutInstrumentIsRefused) {
    const std::string ball = std::string(TROCAR_SOURCE_DIR) + "/assets/scenes/falling_sphere.json";
    EXPECT_TRUE(refuses(run(ball, {"--path", write("path.csv", "0,20,0\n1,25,0\n")}), "--path"));
}

TEST_F(Explain, SaysWhatRunsAndWhatDoesNot) {
    const Ended ended = call({"explain", write("tube.json", kTube)});
    ASSERT_TRUE(ended_with(ended, 0));
    const std::size_t not_simulated = ended.out.find("not simulated");
    ASSERT_NE(not_simulated, std::string::npos) << ended;
    for (const char* name : {"coarse_contact", "exact_contact"}) EXPECT_LT(ended.out.find(name), not_simulated) << name << " runs";
    for (const char* name : {"elasticity", "gravity", "breathing", "fluoroscopy"})
        EXPECT_GT(ended.out.find(name), not_simulated) << name << " does not";
    for (const char* word : {"wire", "tube", "memory", "predicted", "budget", "no tissue"}) EXPECT_TRUE(ended.says(word)) << word;
}

TEST_F(Schema, IsJsonAndTheOneInTheAssets) {
    const Ended ended = call({"schema"});
    ASSERT_TRUE(ended_with(ended, 0));
    const Json schema = Json::parse(ended.out, nullptr, false);
    ASSERT_TRUE(schema.is_object());
    EXPECT_TRUE(schema.contains("$schema"));
    EXPECT_TRUE(schema.contains("$defs") && schema["$defs"]["scene"]["properties"].contains("bodies"));
    EXPECT_EQ(schema, Json::parse(text_of(fs::path(TROCAR_SOURCE_DIR) / "assets/scene.schema.json"), nullptr, false));
}

} // namespace
} // namespace trocar::cli_test
