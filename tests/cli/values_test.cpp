// Values that once passed silently: empty ones, names that are paths or terminal codes, files named twice, settings that are
// not taken as they stand.
#include "program.hpp"

namespace trocar::cli_test {
namespace {

class Values : public Program {
protected:
    /// In a folder of its own, as a user who gives no --out.
    Ended call_in_folder(const std::string& arguments) const {
        const std::string command = "cd '" + folder.string() + "' && exec '" TROCAR_PROGRAM "' " + arguments + " > stdout 2> stderr";
        Ended ended;
        ended.exit_code = WEXITSTATUS(std::system(command.c_str()));
        ended.out = text_of(folder / "stdout");
        ended.err = text_of(folder / "stderr");
        return ended;
    }
    [[nodiscard]] std::string notes() const { return summary()["bodies"][0]["notes"].dump(); }
    fs::path scene = write("tube.json", kTube);
};

std::string named(const std::string& name) { return with(kTube, "\"name\": \"tube\"", "\"name\": \"" + name + "\""); }

TEST_F(Values, ThatAreEmptyAreRefusedByTheirOptionsName) {
    const std::string file = scene.string();
    for (const char* option : {"--resume", "--replay", "--path", "--budget", "--record-grants", "--out", "--steps", "--pace"})
        EXPECT_TRUE(refuses(call({"run", file, option, ""}), option));
    for (const char* option : {"--resume", "--path", "--out"})
        EXPECT_TRUE(refuses(call({"run", file, option, ""}),
                            std::string("error: ") + option + ": found an empty value; give it one, or leave it out"));
    for (const char* option : {"--port", "--address", "--budget", "--page"}) EXPECT_TRUE(refuses(call({"view", file, option, ""}), option));
    EXPECT_TRUE(refuses(call({"verify", "--page", ""}), "--page"));
    EXPECT_TRUE(refuses(call({"prepare", "x.obj", "--repair", ""}), "--repair"));
    EXPECT_TRUE(refuses(call({"contacts", "a.obj", ""}), "meshes"));
    EXPECT_TRUE(refuses(call({"run", ""}), "scene: found an empty value"));
    EXPECT_TRUE(refuses(call({"explain", ""}), "scene: found an empty value"));
    EXPECT_TRUE(refuses(call({"cost", file, "--variants", ""}), "--variants"));
}

TEST_F(Values, OfNumbersAreRefusedWithTheirRange) {
    const std::string file = scene.string();
    EXPECT_TRUE(refuses(call({"view", file, "--port", "65536"}), "--port: found 65536; expected an integer from 0 to 65535"));
    const Ended none = call({"run", file, "--checkpoint-every", "0"});
    EXPECT_TRUE(refuses(none, "--checkpoint-every: found 0; expected an integer from 1 to 1000000000"));
    EXPECT_LT(none.all().size(), 200u) << none;
    EXPECT_TRUE(refuses(call({"episode", file, "--seed", "1.5"}), "--seed: found 1.5; expected an integer from 0 to 9223372036854775808"));
    EXPECT_TRUE(refuses(call({"episode", file, "--reward", "1", "2"}), "--reward: found another number of values than it takes; expected 4 values"));
    EXPECT_TRUE(refuses(call({"run", file, "--anatomy-seed", "-1"}), "--anatomy-seed: found -1; expected an integer of at least 0"));
    EXPECT_TRUE(refuses(call({"run", file, "--budget", "wrk:3"}), "--budget: budget \"wrk:3\": not understood"));
    for (const char* pace : {"1e-300", "1e-4", "1001", "-1", "nan", "inf", "fast", "1x"})
        EXPECT_TRUE(refuses(call({"run", file, std::string("--pace=") + pace}), "expected 0, or 0.001 to 1000")) << pace;
    for (const char* pace : {"0", "1000"}) EXPECT_TRUE(ended_with(run(scene, {"-n", "1", "--force", "--pace", pace}), 0)) << pace;
    EXPECT_FALSE(fs::exists(folder / "x"));
}

TEST_F(Values, ANameIsNoPath) {
    write("far.json", named("../../evil name"));
    ASSERT_TRUE(ended_with(call_in_folder("run far.json -n 1 --no-pictures --quiet"), 0));
    EXPECT_TRUE(fs::exists(folder / "out/______evil_name/summary.json"));
    write("long.json", named(std::string(300, 'a')));
    ASSERT_TRUE(ended_with(call_in_folder("run long.json -n 1 --no-pictures --quiet"), 0));
    EXPECT_TRUE(fs::exists(folder / "out" / std::string(64, 'a') / "summary.json"));
    ASSERT_TRUE(ended_with(call_in_folder("cost far.json -n 1 --budgets exact --quiet"), 0));
    EXPECT_TRUE(fs::exists(folder / "out/______evil_name-cost/cost.json"));
}

TEST_F(Values, ControlCharactersReachNoTerminal) {
    for (const auto& [written, shown] : std::vector<std::pair<std::string, std::string>>{
             {"\\u001b[31m", "\"\\u001b[31m\""}, {"a\\nb", "\"a\\u000ab\""}, {"\\u0000a", "\"\\u0000a\""}, {"\\u009bA", "\"\\u009bA\""}}) {
        const Ended ended = call({"run", write("name.json", named(written)), "--out", out()});
        EXPECT_TRUE(refuses(ended, "name.json:2:13: name: found " + shown + "; expected text without control characters"));
    }
    const Ended key = call({"run", write("key.json", with(kTube, "\"name\"", "\"\\u001b[31mname\"")), "--out", out()});
    EXPECT_TRUE(refuses(key, "\\u001b[31mname"));
    EXPECT_EQ(key.err.find('\x1b'), std::string::npos);
    EXPECT_EQ(call({"run", "no\x1b[31mfile.json"}).err.find('\x1b'), std::string::npos);
    EXPECT_TRUE(ended_with(call({"run", write("name.json", named("Läufer 7")), "--out", out(), "-n", "1", "--no-pictures"}), 0));
}

TEST_F(Values, ARecordIsNotWrittenOverWhatTheRunReads) {
    const fs::path path = write("path.csv", "t,insertion,rotation\n0,20,0\n0.2,26,0.4\n");
    fs::create_symlink(scene, folder / "link.json");
    for (const fs::path& file : {scene, folder / "link.json", folder / "./tube.json", path}) {
        EXPECT_TRUE(refuses(run(scene, {"-n", "1", "--path", path, "--record-grants", file}),
                            "--record-grants: " + file.string() + " is read, or written as something else"));
        EXPECT_FALSE(fs::exists(out()));
    }
    EXPECT_EQ(text_of(scene), kTube);
    ASSERT_TRUE(ended_with(run(scene, {"-n", "2", "--record-grants", folder / "grants"}), 0));
    const std::string grants = text_of(folder / "grants");
    EXPECT_TRUE(refuses(run(scene, {"--force", "--replay", folder / "grants", "--record-grants", folder / "grants"}), "--record-grants"));
    EXPECT_EQ(text_of(folder / "grants"), grants);
}

/// A wire in a tube, and a target for it.
std::string with_target() {
    return with(with(kTube, R"("path": [[0, 20, 0], [0.2, 26, 0.4]])", R"("inserted": 20)"), R"("effects")",
                R"("targets": {"end": {"position": [0, 0, 60]}}, "effects")");
}

TEST_F(Values, AnOutputFolderThatHoldsWhatIsReadUnderAnOutputsNameIsRefused) {
    const std::string rows = "t,insertion,rotation\n0,20,0\n0.2,26,0.4\n";
    const fs::path path = write("out/path.csv", rows), plan = write("out/plan.json", with_target()), spheres = write("out/spheres.sph", "1 1\n");
    fs::create_symlink(path, folder / "link.csv");
    for (const fs::path& file : {path, folder / "link.csv", folder / "out/../out/path.csv"})
        EXPECT_TRUE(refuses(run(scene, {"-n", "1", "--force", "--path", file}), file.string() + ": --out: is read, and lies in " + out().string()));
    const fs::path own = write("own.json", with(kTube, "[[0, 20, 0], [0.2, 26, 0.4]]", "\"out/path.csv\""));
    EXPECT_TRUE(refuses(run(own, {"-n", "1", "--force"}), "path.csv: --out: is read"));
    EXPECT_TRUE(refuses(run(own, {"-n", "1", "--force", "--path", write("other.csv", rows)}), "path.csv: --out: is read")) << "another path drives";
    for (const char* command : {"run", "plan", "cost", "episode"})
        EXPECT_TRUE(refuses(call({command, plan, "--out", out(), "--force"}), "plan.json: --out: is read")) << command;
    const fs::path mesh = write("tetrahedron.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    EXPECT_TRUE(refuses(call({"prepare", mesh, "--spheres", spheres, "--out", out(), "--force"}), "spheres.sph: --out: is read"));
    EXPECT_EQ(text_of(path), rows);
    EXPECT_EQ(text_of(plan), with_target());
    EXPECT_EQ(text_of(spheres), "1 1\n");
    fs::rename(path, folder / "out/mine.csv");
    EXPECT_TRUE(ended_with(run(scene, {"-n", "1", "--force", "--path", folder / "out/mine.csv"}), 0)) << "under a name that no output has";
    EXPECT_EQ(text_of(folder / "out/mine.csv"), rows);
}

TEST_F(Values, AFilmOrAPageIsNotWrittenOverWhatIsRead) {
    const std::string file = scene.string(), like = write("view.dcm", "a view").string(), list = write("list.txt", "tube.json 2 1e-9\n").string();
    for (const std::string& taken : {file, like})
        EXPECT_TRUE(refuses(call({"film", file, "-n", "1", "--like", like, "--out", taken}),
                            "--out: " + taken + " is read, or written as something else"));
    ASSERT_TRUE(ended_with(call({"verify", list, "--write-references"}), 0));
    for (const std::string& page : {list, file, (folder / "references/tube.json.gz").string()}) {
        const std::string before = text_of(page);
        EXPECT_TRUE(refuses(call({"verify", list, "--page", page}), "--page: " + page + " is read, or written as something else"));
        EXPECT_EQ(text_of(page), before);
    }
    EXPECT_EQ(text_of(scene), kTube);
    EXPECT_EQ(text_of(like), "a view");
}

TEST_F(Values, ANameOfAFileMayHoldAnyBytes) {
    const std::string file = write("t\xff" "be.json", with(with_target(), "\"name\": \"tube\",", "")).string(); // the scene's name is the file's
    const std::string list = write("list.txt", "t\xff" "be.json 2 1e-9\n").string();
    const Ended planned = call({"plan", file, "--to", "end", "--out", folder / "way", "--no-report", "--quiet"});
    EXPECT_EQ(planned.signal, 0) << planned;
    EXPECT_TRUE(Json::parse(text_of(folder / "way/plan.json"), nullptr, false).is_object());
    ASSERT_TRUE(ended_with(call({"episode", file, "--time", "1", "--out", out()}), 0));
    EXPECT_EQ(summary()["scene"], "t\xef\xbf\xbd" "be");
    ASSERT_TRUE(ended_with(call({"verify", list, "--write-references"}), 0));
    EXPECT_TRUE(ended_with(call({"verify", list}), 0)) << "and its reference is its own";
}

TEST_F(Values, ARecordThatCannotBeWrittenIsToldAndTheSummaryNamesItAsMissing) {
    EXPECT_TRUE(refuses(run(scene, {"-n", "2", "--record-grants", "/dev/full"}), "/dev/full"));
    const std::string summary = text_of(out() / "summary.json");
    const std::size_t missing = summary.find("\"missing_outputs\"");
    ASSERT_NE(missing, std::string::npos) << summary;
    EXPECT_NE(summary.substr(missing, 200).find("full"), std::string::npos) << summary.substr(missing, 200);
    EXPECT_TRUE(fs::exists(out() / "steps.csv"));
}

TEST_F(Values, ThatAreNotTakenAsTheyStandAreTold) {
    const std::string wide = "\"contact\": {\"clearance\": 0.3, \"exact_distance\": 0.1}, \"budget\": \"exact\"";
    const std::string deep = with(with(kTube, "\"budget\": \"exact\"", wide), "[0.2, 26, 0.4]", "[10, 100, 0.4]");
    const fs::path file = write("deep.json", deep);
    const std::vector<std::string> told = {
        "contact.clearance 0.3 mm lowered to 0.125 mm, 0.25 of the radius of wire: ",
        "contact.exact_distance 0.1 mm lowered to 0.025 mm, 0.2 of the clearance of 0.125 mm: ",
        "wire is to be inserted 100 mm, and 90 mm are taken: two segments of 5 mm of its length of 100 mm stay at the port"};
    ASSERT_TRUE(ended_with(run(file, {"-n", "1"}), 0));
    const std::string report = text_of(out() / "report.html");
    for (const std::string& note : told) {
        EXPECT_NE(notes().find(note), std::string::npos) << notes();
        EXPECT_NE(report.find(note), std::string::npos) << note;
    }
    const Ended explained = call({"explain", file});
    ASSERT_TRUE(ended_with(explained, 0));
    for (const std::string& note : told) EXPECT_NE(explained.out.find(note), std::string::npos) << explained;
    ASSERT_TRUE(ended_with(run(scene, {"-n", "1", "--force"}), 0));
    EXPECT_EQ(notes().find("lowered"), std::string::npos) << notes();
    EXPECT_EQ(notes().find("inserted"), std::string::npos) << notes();
}

TEST_F(Values, BeyondAnyMeasureAreSaidInFewDigits) {
    write("far.vtk", "# vtk DataFile Version 3.0\nfar\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1e308\n"
                     "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n");
    const Ended ended = call({"explain", write("far.json", R"({"units": {"length": "mm", "pressure": "kPa"},
        "time": {"step": 0.01, "duration": 0.02}, "bodies": {"cube": {"kind": "deformable", "surface": {"shape": "box",
        "extent": [20, 20, 20]}, "material": {"young_modulus": 20, "density": 1000}, "coarse": {"file": "far.vtk", "unit": "m"}}},
        "effects": ["elasticity"]})")});
    EXPECT_TRUE(refuses(ended, "tet 0 (nodes 0, 1, 2, 3) is too large"));
    EXPECT_LT(ended.err.size(), 250u) << ended;
}

} // namespace
} // namespace trocar::cli_test
