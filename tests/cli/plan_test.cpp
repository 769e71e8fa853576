// `plan`: the route, the motion that was found, and the reason where there is none.
#include "program.hpp"

namespace trocar::cli_test {
namespace {

/// A wire in a tube with one bend and two named targets.
const std::string kBend = R"({
    "name": "bend",
    "units": {"length": "mm", "pressure": "MPa"},
    "time": {"step": 0.01, "duration": 0.2},
    "budget": "work:100000",
    "bodies": {"tube": {"kind": "static", "hollow": true, "surface": {"shape": "tube", "sides": 24, "axis":
        [[0, 0, 0, 4], [0, 0, 40, 4], [2.7, 0, 50, 4], [10, 0, 57.3, 4], [20, 0, 60, 4], [70, 0, 60, 4]]}}},
    "instruments": {"wire": {"length": 150, "radius": 0.5, "young_modulus": 60, "segment": 2.5, "skin_triangles": 600,
        "tip": {"shape": "J", "length": 8, "angle": 0.6}, "lumen": "tube", "inserted": 10,
        "entry": {"position": [0, 0, 8], "direction": [0, 0, 1]}}},
    "targets": {"end": {"position": [50, 0, 60]}, "near": {"position": [0, 0, 35]}},
    "effects": ["coarse_contact", "exact_contact", "friction"]
})";

class PlanCommand : public Program {
protected:
    Ended plan(const fs::path& scene, const std::string& target, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {"plan", scene.string(), "--to", target, "--out", out().string()};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return call(arguments);
    }
    [[nodiscard]] Json plan_json() const { return Json::parse(text_of(out() / "plan.json"), nullptr, false); }
    [[nodiscard]] std::vector<std::vector<double>> rows_of(const char* name, const std::string& header) const {
        std::istringstream in(text_of(out() / name));
        std::string line;
        std::getline(in, line);
        EXPECT_EQ(line, header);
        std::vector<std::vector<double>> rows;
        while (std::getline(in, line)) {
            std::istringstream cells(line);
            std::vector<double>& row = rows.emplace_back();
            for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
        }
        return rows;
    }
};

TEST_F(PlanCommand, FindsAMotionThatReachesTheTargetAlsoWhenItIsReplayed) {
    const fs::path scene = write("bend.json", kBend);
    ASSERT_TRUE(ended_with(plan(scene, "end"), 0));
    const Json plan = plan_json();
    EXPECT_EQ(plan["target"], "end");
    EXPECT_EQ(plan["arrived"], true);
    EXPECT_EQ(plan["lumen_exits"], 0);
    EXPECT_NEAR(plan["route"]["length_m"].get<double>(), 0.094, 0.006) << "32 mm, a quarter circle of 20 mm, 30 mm";
    EXPECT_NEAR(plan["route"]["min_radius_m"].get<double>(), 0.004, 0.0012) << "a lower bound";
    EXPECT_GT(plan["route"]["max_curvature_per_m"].get<double>(), 25.0);

    const auto path = rows_of("path.csv", "t,insertion,rotation");
    ASSERT_GT(path.size(), 100u);
    EXPECT_DOUBLE_EQ(path.front()[0], 0.0);
    EXPECT_DOUBLE_EQ(path.front()[1], 10.0) << "mm, as the scene";
    for (std::size_t k = 1; k < path.size(); ++k) {
        EXPECT_GT(path[k][0], path[k - 1][0]);
        EXPECT_LE(std::abs(path[k][1] - path[k - 1][1]), 0.35 + 1e-9) << "35 mm/s";
    }
    const fs::path csv = folder / "path.csv";
    fs::copy_file(out() / "path.csv", csv);
    ASSERT_TRUE(ended_with(run(scene, {"--path", csv.string(), "-n", std::to_string(path.size()), "--force"}), 0));
    const Json end = summary();
    const double dx = end["tip_m"][0].get<double>() - 0.05, dz = end["tip_m"][2].get<double>() - 0.06;
    EXPECT_LT(std::sqrt(dx * dx + dz * dz), 0.0045) << end["tip_m"];
}

/// The bend within tissue that breathes, for 5 s.
std::string breathing_bend() {
    std::string text = with(kBend, R"("tube": {"kind": "static", "hollow": true,)", R"("organ": {"kind": "deformable",
        "surface": {"shape": "box", "centre": [25, 0, 40], "extent": [70, 40, 80], "cells": 4},
        "material": {"young_modulus": 0.005, "poisson_ratio": 0.4, "density": 1000, "viscosity": 1e-6, "mass_damping": 5},
        "coarse": {"mesher": "lattice", "surface_triangles": 200}, "fixed": [{"direction": [0, 0, 1], "fraction": 0.2}]},
        "tube": {"kind": "static", "hollow": true, "embedded_in": "organ", "blend": 5,)");
    text = with(text, R"("duration": 0.2)", R"("duration": 5)");
    text = with(text, R"("budget": "work:100000")", R"("budget": "exact")");
    return with(text, R"("effects": ["coarse_contact", "exact_contact", "friction"])",
                R"("effects": {"elasticity": true, "damping": true, "coarse_contact": true, "exact_contact": true, "friction": true,
                               "breathing": {"amplitude": 2, "period": 2, "direction": [0, 0, 1]}})");
}

TEST_F(PlanCommand, StatesTheDistanceThatARunOfItsPathThenShowsWhileTheOrganBreathes) {
    const fs::path scene = write("breathing.json", breathing_bend());
    const Ended planned = plan(scene, "near");
    ASSERT_TRUE(ended_with(planned, 0));
    const Json replay = plan_json()["replay"];
    ASSERT_TRUE(replay.is_object()) << planned;
    EXPECT_TRUE(planned.says("amplitude 2 mm, period 2 s")) << planned;
    EXPECT_LE(replay["least_m"].get<double>(), replay["target_distance_m"].get<double>());
    EXPECT_GE(replay["most_m"].get<double>(), replay["target_distance_m"].get<double>());
    EXPECT_LT(replay["target_distance_m"].get<double>(), 1.2 * 0.003) << "the path holds the drive's responses to breathing";
    const fs::path csv = folder / "path.csv";
    fs::copy_file(out() / "path.csv", csv);
    const Ended ran = run(scene, {"--path", csv.string(), "--to", "near", "-n", std::to_string(replay["steps"].get<int>()), "--force"});
    ASSERT_TRUE(ended_with(ran, 0));
    EXPECT_EQ(summary()["target_distance_m"]["last"], replay["target_distance_m"]) << "the same numbers, to the last digit";
    char said[64];
    std::snprintf(said, sizeof said, "%.2f mm", 1e3 * replay["target_distance_m"].get<double>());
    EXPECT_TRUE(planned.says("tip " + std::string(said) + " from near")) << planned;
    EXPECT_TRUE(ran.says("tip to target " + std::string(said))) << ran;
}

TEST_F(PlanCommand, AReplayedPathIsMeasuredAgainstTheOnlyTargetUnasked) {
    const fs::path csv = write("path.csv", "t,insertion,rotation\n0,10,0\n0.2,14,0\n");
    const std::string all = R"("targets": {"end": {"position": [50, 0, 60]}, "near": {"position": [0, 0, 35]}},)";
    const auto scene = [&](const char* targets) { return write("bend.json", with(kBend, all, targets)); };
    const Ended named = run(scene(R"("targets": {"near": {"position": [0, 0, 35]}},)"), {"--path", csv.string(), "--to", "near"});
    ASSERT_TRUE(ended_with(named, 0));
    ASSERT_TRUE(named.says("tip to target ")) << named;
    const double there = summary()["target_distance_m"]["last"];
    const Ended guessed = run(scene(R"("targets": {"near": {"position": [0, 0, 35]}},)"), {"--path", csv.string(), "--force"});
    ASSERT_TRUE(ended_with(guessed, 0));
    EXPECT_TRUE(guessed.says("tip to target ")) << guessed;
    EXPECT_NEAR(summary()["target_distance_m"]["last"].get<double>(), there, 1e-9);
    const Ended outside = run(scene(R"("targets": {"far": {"position": [500, 0, 0]}},)"), {"--path", csv.string(), "--force"});
    EXPECT_TRUE(ended_with(outside, 0) && !outside.says("tip to target")) << "not one that the wire can come to: " << outside;
    const Ended several = run(scene(all.c_str()), {"--path", csv.string(), "--force"});
    EXPECT_TRUE(ended_with(several, 0) && !several.says("tip to target")) << several;
}

TEST_F(PlanCommand, LeadsTheCentrelineFromTheEntryToTheTarget) {
    ASSERT_TRUE(ended_with(plan(write("bend.json", kBend), "end", {"--time", "0.02"}), 2)) << "too short a trial to arrive";
    EXPECT_EQ(plan_json()["arrived"], false);
    const auto line = rows_of("centreline.csv", "x,y,z,radius");
    ASSERT_GT(line.size(), 20u);
    EXPECT_NEAR(line.front()[2], 8.0, 1e-6);
    EXPECT_NEAR(line.back()[0], 50.0, 1e-6);
    EXPECT_NEAR(line.back()[2], 60.0, 1e-6);
    for (const auto& row : line) EXPECT_GT(row[3], 1.0);
}

TEST_F(PlanCommand, NamesTheTargetsThatThereAre) {
    const fs::path scene = write("bend.json", kBend);
    EXPECT_TRUE(refuses(plan(scene, "heart"), "known: end, near"));
    EXPECT_TRUE(refuses(
        plan(write("none.json", with(kBend, R"("targets": {"end": {"position": [50, 0, 60]}, "near": {"position": [0, 0, 35]}},)", "")),
             "end"),
        "names none"));
    EXPECT_TRUE(refuses(call({"plan", scene.string()}), "--to"));
    const fs::path csv = write("path.csv", "t,insertion,rotation\n0,10,0\n1,12,0\n");
    EXPECT_TRUE(refuses(run(scene, {"--path", csv.string(), "--to", "heart"}), "known: end, near"));
    EXPECT_TRUE(refuses(run(scene, {"--to", "end"}), "--path"));
    EXPECT_FALSE(fs::exists(out())) << "nothing is left behind";
}

TEST_F(PlanCommand, SaysWhyThereIsNoWay) {
    const fs::path narrow = write("narrow.json", with(kBend, "[10, 0, 57.3, 4]", "[10, 0, 57.3, 0.45]"));
    EXPECT_TRUE(refuses(plan(narrow, "end"), "wide"));
    const fs::path stiff = write("stiff.json", with(kBend, R"("segment": 2.5,)", R"("segment": 2.5, "min_bend_radius": 60,)"));
    EXPECT_TRUE(refuses(plan(stiff, "end"), "bends to a radius of"));
    EXPECT_TRUE(refuses(plan(write("outside.json", with(kBend, "[50, 0, 60]", "[50, 30, 60]")), "end"), "end"));
}

TEST_F(PlanCommand, ATrialThatFailsNamesThePlaceItsRadiusAndWhatWouldHelp) {
    const fs::path scene = write("bend.json", kBend);
    const Ended short_trial = plan(scene, "end", {"--time", "0.3"});
    ASSERT_TRUE(ended_with(short_trial, 2));
    for (const char* piece : {"there is a way, but the drive did not come past", "the lumen's radius is", "the way turns by", "0 attempts there", "a longer --time"})
        EXPECT_NE(short_trial.err.find(piece), std::string::npos) << piece << short_trial;
    const std::string straight = with(kBend, R"("tip": {"shape": "J", "length": 8, "angle": 0.6})", R"("tip": {"shape": "straight"})");
    const Ended no_bend = plan(write("straight.json", straight), "end", {"--time", "0.3", "--force"});
    ASSERT_TRUE(ended_with(no_bend, 2));
    EXPECT_NE(no_bend.err.find("mm to the side instead of 0 mm"), std::string::npos) << no_bend;
}

TEST_F(PlanCommand, GoesToTheTargetThatTheInstrumentFollowsOrToTheOnlyOneWhereNoneIsGiven) {
    const auto unasked = [&](const std::string& text) {
        return call({"plan", write("bend.json", text).string(), "--out", out().string(), "--time", "0.02", "--force"});
    };
    const std::string all = R"("targets": {"end": {"position": [50, 0, 60]}, "near": {"position": [0, 0, 35]}},)";
    ASSERT_TRUE(ended_with(unasked(with(kBend, R"("lumen": "tube",)", R"("lumen": "tube", "follow": {"target": "near"},)")), 2)) << "too short a trial";
    EXPECT_EQ(plan_json()["target"], "near");
    ASSERT_TRUE(ended_with(unasked(with(kBend, all, R"("targets": {"end": {"position": [50, 0, 60]}},)")), 2));
    EXPECT_EQ(plan_json()["target"], "end");
}

TEST_F(PlanCommand, RefusesABusyFolderUnlessForced) {
    const fs::path scene = write("bend.json", kBend);
    fs::create_directories(out());
    std::ofstream(out() / "mine.txt") << "mine";
    EXPECT_TRUE(refuses(plan(scene, "near"), "mine.txt"));
    EXPECT_TRUE(ended_with(plan(scene, "near", {"--force"}), 0));
    EXPECT_TRUE(fs::exists(out() / "mine.txt"));
}

} // namespace
} // namespace trocar::cli_test
