// `episode`, and sweeps of it.
#include "sweep_command.hpp"

#include "engine/state/bit_hash.hpp"

#include <cstdio>
#include <cstdlib>
#include <map>

namespace trocar::cli_test {
namespace {

class EpisodeCommand : public SweepCommand {};

/// A navigation task: a wire in a tube with two targets.
const std::string kNavigation = with(with(kTube, R"("instruments")", R"("targets": {"near": {"position": [0, 0, 50]}, "far": {"position": [0, 0, 90]}},
    "instruments")"), R"("duration": 0.2)", R"("duration": 20)");

/// Two policies in Python that need no package.
constexpr const char* kPolicies = R"(
limits = []
def reset(task):
    limits[:] = task["limits"]
def act(observation):
    return [[limits[0][0], 0.5 * observation[-1]]]
def tired(observation):
    raise RuntimeError("no more")
)";

TEST_F(EpisodeCommand, EpisodesOfPoliciesAreRows) {
    write("scenes/navigation.json", kNavigation);
    write("policy.py", kPolicies);
    write_sweep(R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--to", "near", "--time", "8"],
        "vary": {"--policy": ["random", "advance", "policy.py", "policy.py:tired"], "--seed": [1, 2]},
        "collect": {"return": "/return", "success": "/success", "length": "/length", "hash": "/state_hash",
            "force": {"column": "contact_force_n", "take": "max"}, "closest": {"column": "distance_m", "take": "min"}}})");
    const std::string table = table_of("a");
    const Rows rows = rows_of(table);
    ASSERT_EQ(rows.size(), 9u);
    for (const std::size_t k : {3u, 4u, 5u, 6u}) {
        EXPECT_EQ(rows[k][3], "done") << table;
        EXPECT_EQ(rows[k][5], "true") << "straight ahead arrives";
        EXPECT_LT(std::stod(rows[k][9]), 5e-3);
    }
    EXPECT_NE(text_of(folder / "a.html").find("<td>success</td><td>6</td>"), std::string::npos) << "its share stands on the page";
    EXPECT_NE(rows[1][7], rows[2][7]) << "another seed is another episode";
    for (const std::size_t k : {7u, 8u}) EXPECT_NE(rows[k][3].find("the policy raised RuntimeError: no more"), std::string::npos) << table;
    EXPECT_EQ(table_of("b", {"--jobs", "3"}), table);
    fs::remove(folder / "b" / "results" / "chunk-0000002.jsonl.gz");
    ASSERT_TRUE(ended_with(sweep_into("b", {"--resume", "--collect", (folder / "c.csv").string()}), 0));
    EXPECT_EQ(text_of(folder / "c.csv"), table);
    write("policy.py", std::string(kPolicies) + "# another\n");
    EXPECT_TRUE(refuses(sweep_into("b", {"--resume"}), "policy.py has changed since"));
}

TEST_F(EpisodeCommand, AnEpisodesRowIsThatOfTheSameCommandByHand) {
    write("scenes/navigation.json", kNavigation);
    write_sweep(R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--time", "2"],
        "vary": {"/instruments/wire/friction": [0.1], "--seed": [7]}, "collect": {"return": "/return", "target": "/target", "hash": "/state_hash"}})");
    const Rows rows = rows_of(table_of("a"));
    ASSERT_TRUE(ended_with(call({"episode", (folder / "scenes" / "navigation.json").string(), "--set", "/instruments/wire/friction=0.1", "--seed", "7", "--time", "2",
                                 "--out", out().string()}),
                           0));
    EXPECT_EQ(rows[1][4], summary()["return"].dump());
    EXPECT_EQ(rows[1][5], summary()["target"]);
    EXPECT_EQ(rows[1][6], summary()["state_hash"]);
    EXPECT_EQ(summary()["budget"], "exact");
}

/// Whatever drives, and whatever was drawn: what summary.json says is what the rows of actions.csv come to.
TEST_F(EpisodeCommand, TheFiguresOfAnEpisodeAreThoseOfItsActions) {
    const std::string scene = write("scenes/navigation.json", kNavigation).string();
    for (const char* policy : {"random", "advance"})
        for (int seed = 1; seed <= 5; ++seed) {
            SCOPED_TRACE(policy + std::string(", seed ") + std::to_string(seed));
            ASSERT_TRUE(ended_with(call({"episode", scene, "--policy", policy, "--seed", std::to_string(seed), "--time", "6", "--reward", "10,1,-0.1,-0.005",
                                         "--out", out().string(), "--force"}),
                                   0));
            const Rows rows = rows_of(text_of(out() / "actions.csv"));
            const auto figures = summary();
            ASSERT_EQ(rows.size(), figures["length"].get<std::size_t>() + 1);
            double reward = 0.0, force = 0.0, closest = 1.0;
            for (std::size_t k = 1; k < rows.size(); ++k) {
                ASSERT_EQ(rows[k].size(), rows[0].size());
                EXPECT_EQ(rows[k][0], std::to_string(k));
                reward += std::stod(rows[k][2]);
                closest = std::min(closest, std::stod(rows[k][4]));
                force = std::max(force, std::stod(rows[k][5]));
            }
            EXPECT_NEAR(figures["return"].get<double>(), reward, 1e-12);
            const auto terms = figures["reward_terms"].get<std::map<std::string, double>>();
            EXPECT_NEAR(terms.at("progress") + terms.at("target") + terms.at("force") + terms.at("step"), reward, 1e-12);
            EXPECT_EQ(figures["largest_contact_force_n"].get<double>(), force);
            EXPECT_LE(figures["closest_m"].get<double>(), closest); // it may have begun nearer
            EXPECT_EQ(figures["distance_m"].get<double>(), std::stod(rows.back()[4]));
            EXPECT_EQ(figures["success"].get<bool>(), std::stod(rows.back()[4]) <= 5e-3);
        }
}

TEST_F(EpisodeCommand, AFolderThatIsKeptIsARecordThatScoreJudgesTheSame) {
    write("scenes/navigation.json", kNavigation);
    write("policy.py", kPolicies);
    write_sweep(R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--time", "6", "--reward", "10,1,-0.1,-0.005"], "keep": "folder",
        "vary": {"--policy": ["random", "advance", "policy.py"], "/instruments/wire/friction": [0, 0.2], "--budget": ["exact", "work:20"], "--seed": [1, 2]}})");
    (void)table_of("a");
    std::size_t count = 0, arrived = 0;
    fs::path one;
    for (const auto& entry : fs::directory_iterator(folder / "a" / "runs")) {
        one = entry.path();
        const Json figures = Json::parse(text_of(one / "summary.json"));
        const Ended scored = call({"score", one.string()});
        ASSERT_TRUE(ended_with(scored, 0)) << scored;
        const bool success = figures["success"].get<bool>();
        for (const std::string& piece : {"state " + figures["state_hash"].get<std::string>(), std::to_string(figures["length"].get<int>()) + " actions",
                                         std::string(success ? "success yes" : "success no"), "to " + figures["target"].get<std::string>() + ":"})
            EXPECT_TRUE(scored.says(piece)) << piece << "\n" << scored;
        arrived += success;
        ++count;
    }
    EXPECT_EQ(count, 24u);
    EXPECT_GT(arrived, 0u);
    for (const char* file : {"actions.csv", "summary.json", "manifest.json", "manifest.hash"}) {
        const std::string text = text_of(one / file);
        std::string edited = text;
        edited[edited.size() / 2] ^= 1;
        std::ofstream(one / file, std::ios::binary) << edited;
        EXPECT_TRUE(ended_with(call({"score", one.string()}), 5)) << file;
        std::ofstream(one / file, std::ios::binary) << text;
    }
    EXPECT_TRUE(ended_with(call({"score", one.string()}), 0));
}

TEST_F(EpisodeCommand, ARecordWhoseManifestHasAValueOfAnotherTypeIsRefused) {
    for (const auto& [manifest, says] : {std::pair{R"({"kind": 5, "version": 1})", "is no manifest of an episode"},
                                         {R"({"kind": null, "version": 1})", "is no manifest of an episode"},
                                         {R"({"kind": "trocar-episode", "version": "one"})", "is of version \"one\"; expected version 1"},
                                         {R"({"kind": "trocar-episode"})", "is of version null; expected version 1"}}) {
        engine::BitHash hash;
        hash.add_bytes(manifest);
        char line[20];
        std::snprintf(line, sizeof line, "%016llx\n", static_cast<unsigned long long>(hash.value()));
        write("record/manifest.json", manifest);
        write("record/manifest.hash", line);
        const Ended scored = call({"score", (folder / "record").string()});
        EXPECT_TRUE(ended_with(scored, 5)) << manifest;
        EXPECT_TRUE(scored.says(says)) << scored;
    }
}

TEST_F(EpisodeCommand, AnEpisodeOfABudgetOfTimeIsNoRecord) {
    const std::string scene = write("scenes/navigation.json", kNavigation).string();
    const Ended played = call({"episode", scene, "--time", "2", "--budget", "1ms", "--out", out().string()});
    ASSERT_TRUE(ended_with(played, 0)) << played;
    EXPECT_TRUE(played.says("notice: budget 1ms")) << played;
    EXPECT_TRUE(played.says("no record for `trocar score`")) << played;
    EXPECT_FALSE(fs::exists(out() / "manifest.json"));
    const Ended scored = call({"score", out().string()});
    EXPECT_TRUE(ended_with(scored, 5));
    EXPECT_TRUE(scored.says("is no recorded episode")) << scored;
}

TEST_F(EpisodeCommand, BadPoliciesAreRefusedBeforeAnythingRuns) {
    write("scenes/navigation.json", kNavigation);
    write("policy.py", "import no_such_module\n");
    write("other.py", "act = 5\n");
    const Broken broken[] = {
        {R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--policy", "fly"]})", "1:70: options: found \"fly\"; expected random, advance"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--policy=none.py"]})", "does not exist"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--policy", "policy.py"]})", "No module named 'no_such_module'"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--policy", "other.py"]})", "act is no function"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "vary": {"--policy": ["random", "other.py:fly"]}})", "1:91: --policy"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--steps", "5"]})", "options: episode does not take them"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "vary": {"--seed": [1, -1]}})", "1:82: --seed: found -1; expected an integer from 0 to 9223372036854775808"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "vary": {"--sed": [1]}})", "1:68: --sed: episode does not take it: found the unknown option \"--sed\"; nearest known option: \"--seed\""},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "vary": {"--seed": [1e23]}})", "; expected an integer from 0 to 9223372036854775808"},
        {R"({"scene": "scenes/navigation.json", "command": "episode", "collect": {"x": {"column": "tip_x", "take": "max"}}})", "column"},
    };
    for (const Broken& one : broken) {
        write_sweep(one.text);
        EXPECT_TRUE(refuses(sweep_into("a"), one.says)) << one.text;
        EXPECT_FALSE(fs::exists(folder / "a")) << one.text;
    }
    write("policy.py", kPolicies);
    write_sweep(R"({"scene": "scenes/navigation.json", "command": "episode", "options": ["--policy", "policy.py"]})");
    setenv("TROCAR_PYTHON", "/nowhere/python3", 1);
    const Ended ended = sweep_into("a");
    unsetenv("TROCAR_PYTHON");
    EXPECT_TRUE(refuses(ended, "/nowhere/python3 is not installed")) << "no Python";
}

} // namespace
} // namespace trocar::cli_test
