// Contrast agent: what is injected is in the vessels or has left, branches share it by flow, a pulse arrives when the blood does.
#include "engine/effects/contrast/contrast.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state_bytes.hpp"
#include "engine/step/simulator.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace trocar::engine {
namespace {

using effects::advect;
using effects::piece_volume;

/// A tree of straight pieces: each point's parent is before it.
BloodFlow make_flow(const std::vector<Vec3>& points, const std::vector<Index>& parents, double radius, double speed) {
    spheretree::CentrelineTree tree;
    tree.points = points;
    tree.radii.assign(points.size(), radius);
    tree.parents = parents;
    return make_blood_flow(tree, speed);
}

BloodFlow straight_flow(std::size_t count, double length, double radius, double speed) {
    std::vector<Vec3> points;
    std::vector<Index> parents;
    for (std::size_t k = 0; k < count; ++k) {
        points.emplace_back(0.0, 0.0, length * static_cast<double>(k) / static_cast<double>(count - 1));
        parents.push_back(k == 0 ? kNoIndex : static_cast<Index>(k - 1));
    }
    return make_flow(points, parents, radius, speed);
}

double mass_in(const BloodFlow& flow, const std::vector<double>& iodine) {
    double mass = 0.0;
    for (Index i = 0; i < flow.point_count(); ++i) mass += piece_volume(flow, i) * iodine[i];
    return mass;
}

TEST(Contrast, NothingIsLostInRandomTrees) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> unit(0.0, 1.0);
    for (int tree = 0; tree < 30; ++tree) {
        std::vector<Vec3> points{Vec3::Zero()};
        std::vector<Index> parents{kNoIndex};
        for (int k = 1; k < 200; ++k) {
            const auto parent = static_cast<Index>(std::max(0.0, k - 1 - std::floor(5.0 * unit(random) * unit(random))));
            parents.push_back(parent);
            points.push_back(points[parent] + 0.01 * Vec3(unit(random) - 0.5, unit(random) - 0.5, unit(random)));
        }
        const BloodFlow flow = make_flow(points, parents, 1e-3 + 4e-3 * unit(random), 0.01 + unit(random));
        std::vector<double> iodine(points.size(), 0.0), passing(points.size(), 0.0);
        const auto at = static_cast<std::size_t>(1 + 150 * unit(random));
        double injected = 0.0, washed = 0.0;
        for (int step = 0; step < 2000; ++step) {
            const double rate = step < 500 ? 1e-6 * (1.0 + 20.0 * unit(random)) : 0.0, beat = 2.0 * unit(random), dt = 0.02 * unit(random);
            washed += advect(flow, iodine, passing, beat, at, rate, 300.0, dt);
            // where the heart rests, nothing carries what is injected: it stays, and none is lost
            injected += rate * 300.0 * dt;
            for (const double c : iodine) ASSERT_GE(c, 0.0);
        }
        EXPECT_NEAR(mass_in(flow, iodine) + washed, injected, 1e-12 * injected);
    }
}

TEST(Contrast, NoPieceHoldsMoreThanWhatIsInjected) {
    const BloodFlow flow = straight_flow(100, 0.2, 2e-3, 0.05);
    std::vector<double> iodine(100, 0.0), passing(100, 0.0);
    for (int step = 0; step < 500; ++step) {
        (void)advect(flow, iodine, passing, 1.0, 20, 20e-6, 300.0, 0.01); // 20 ml/s into 0.6 ml/s of blood
        for (const double c : iodine) ASSERT_LE(c, 300.0 * (1.0 + 1e-12));
    }
    const double blood = std::numbers::pi * 2e-3 * 2e-3 * 0.05;
    EXPECT_NEAR(iodine[50], 300.0 * 20e-6 / (20e-6 + blood), 1e-6) << "mixed with the blood that comes";
    EXPECT_EQ(iodine[19], 0.0) << "nothing goes upstream";
}

TEST(Contrast, BranchesShareItAsTheyShareTheBlood) {
    std::vector<Vec3> points;
    std::vector<Index> parents;
    const auto add = [&](const Vec3& p, Index parent) { points.push_back(p), parents.push_back(parent); return static_cast<Index>(points.size() - 1); };
    Index at = add(Vec3::Zero(), kNoIndex);
    for (int k = 1; k <= 20; ++k) at = add(Vec3(0, 0, 0.002 * k), at);
    const Index fork = at;
    Index left = fork, right = fork;
    for (int k = 1; k <= 20; ++k) left = add(Vec3(-0.002 * k, 0, 0.04), left);
    for (int k = 1; k <= 20; ++k) right = add(Vec3(0.002 * k, 0, 0.04), right);
    spheretree::CentrelineTree tree;
    tree.points = points, tree.parents = parents;
    tree.radii.assign(points.size(), 3e-3);
    for (std::size_t i = fork + 1; i < points.size(); ++i) tree.radii[i] = i <= left ? 2e-3 : 1e-3;
    const BloodFlow flow = make_blood_flow(tree, 0.2);
    std::vector<double> iodine(points.size(), 0.0), passing(points.size(), 0.0);
    double to_left = 0.0, to_right = 0.0;
    for (int step = 0; step < 3000; ++step) {
        (void)advect(flow, iodine, passing, 1.0, 5, step < 200 ? 1e-6 : 0.0, 300.0, 0.005);
        to_left += passing[left] * iodine[left] * 0.005;
        to_right += passing[right] * iodine[right] * 0.005;
    }
    EXPECT_NEAR(to_left / to_right, 8.0, 1e-9) << "by the cubes of the radii";
    EXPECT_NEAR(to_left + to_right, 200 * 0.005 * 1e-6 * 300.0, 1e-10 * (to_left + to_right));
}

TEST(Contrast, APulseArrivesWhenTheBloodDoesAndLeaves) {
    constexpr std::size_t kCount = 401;
    const double length = 0.4, speed = 0.2, dt = 0.001;
    const BloodFlow flow = straight_flow(kCount, length, 2e-3, speed);
    std::vector<double> iodine(kCount, 0.0), passing(kCount, 0.0);
    const Index watched = 301;
    // the first piece is filled at once: it is a pulse at 0.5 mm
    iodine[1] = 100.0;
    double sum = 0.0, first = 0.0, second = 0.0;
    for (int step = 1; step <= 4000; ++step) {
        (void)advect(flow, iodine, passing, 1.0, 1, 0.0, 0.0, dt);
        const double t = step * dt;
        sum += iodine[watched], first += iodine[watched] * t, second += iodine[watched] * t * t;
    }
    const double arrival = first / sum, spread = second / sum - arrival * arrival;
    const double piece = length / (kCount - 1) / speed; // s, for the blood to pass one
    EXPECT_NEAR(arrival, 301 * piece, 0.001 * 301 * piece) << "300 pieces on, with the one that it was put in";
    EXPECT_NEAR(spread, 301 * (piece * piece + piece * dt), 0.01 * 301 * piece * piece) << "the scheme's dispersion, as docs/fluoroscopy.md has it";
    EXPECT_LT(mass_in(flow, iodine), 1e-12 * 100.0 * piece_volume(flow, 1)) << "washed out";
}

std::string scene_text(const std::string& effects, const std::string& more = "") {
    return fmt::format(R"({{
    "name": "contrast", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 2}}, "budget": "exact",
    "bodies": {{"vessel": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [[0, 0, 0, 3], [0, 0, 40, 3], [0, 0, 80, 3]], "sides": 24}}}}}},
    "instruments": {{"wire": {{"length": 120, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 800,
        "tip": {{"shape": "straight"}}, "friction": 0, "lumen": "vessel", "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "inserted": 20}}}},
    "effects": {{"coarse_contact": true, "exact_contact": true{}}}{}
}})",
                       effects, more);
}

Result<PreparedScene> prepared(const std::string& text) {
    Result<Scene> scene = parse_scene(text, "scenes/contrast.json");
    if (!scene.ok()) return scene.error();
    return make_prepared_scene(*scene);
}

TEST(Contrast, FlowsInAScenesVesselAndIsPartOfTheState) {
    const auto scene = prepared(scene_text(R"(, "contrast": {"rate": 2, "start": 0.05, "duration": 0.1, "speed": 100})"));
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    Simulator simulator(scene->model);
    for (int k = 0; k < 4; ++k) simulator.step();
    EXPECT_EQ(effects::measure_contrast(scene->model, simulator.state()).injected, 0.0) << "not yet";
    for (int k = 4; k < 10; ++k) simulator.step();
    std::string bytes;
    append_state(simulator.state(), bytes);
    const Result<State> again = read_state(scene->model, bytes);
    ASSERT_TRUE(again.ok()) << again.error().to_string();
    EXPECT_EQ(again->effects, simulator.state().effects);
    for (int k = 10; k < 20; ++k) simulator.step();
    const effects::ContrastBalance balance = effects::measure_contrast(scene->model, simulator.state());
    EXPECT_NEAR(balance.injected, 0.2e-6 * 300.0, 1e-15) << "2 ml/s for 0.1 s of 300 mg/ml";
    EXPECT_NEAR(balance.in_vessels + balance.washed_out, balance.injected, 1e-12 * balance.injected);
    EXPECT_GT(effects::find_iodine(scene->model, simulator.state(), Vec3(0, 0, 0.045)), 0.0) << "beyond the tip at 30 mm";
    EXPECT_EQ(effects::find_iodine(scene->model, simulator.state(), Vec3(0, 0, 0.015)), 0.0) << "before it";
}

TEST(Contrast, MovesNothing) {
    const auto with = prepared(scene_text(R"(, "contrast": true)")), without = prepared(scene_text(""));
    ASSERT_TRUE(with.ok() && without.ok());
    Simulator a(with->model), b(without->model);
    for (int k = 0; k < 20; ++k) a.step(), b.step();
    EXPECT_EQ(a.state().instruments[0].rod.position, b.state().instruments[0].rod.position);
    EXPECT_EQ(a.state().instruments[0].skin, b.state().instruments[0].skin);
}

TEST(Contrast, ThatCannotFlowIsRefused) {
    const auto still = prepared(scene_text(R"(, "contrast": true, "blood_drag": {"speed": 0})"));
    ASSERT_FALSE(still.ok());
    EXPECT_NE(still.error().message.find("no outlet"), std::string::npos) << still.error().message;
    EXPECT_EQ(still.error().key, "effects.contrast");
    const auto ghost = prepared(R"({"name": "x", "units": {"length": "mm"}, "time": {"step": 0.01, "duration": 1},
        "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "centre": [0,0,0], "radius": 10}}}, "effects": {"contrast": true}})");
    ASSERT_FALSE(ghost.ok());
    EXPECT_NE(ghost.error().message.find("no instrument"), std::string::npos) << ghost.error().message;
    for (const char* settings : {R"({"rate": -1})", R"({"iodine": 0})", R"({"duration": 0})", R"({"at": "liver"})", R"({"speed": "fast"})", R"({"colour": 1})"})
        EXPECT_FALSE(prepared(scene_text(fmt::format(R"(, "contrast": {})", settings))).ok()) << settings;
}

} // namespace
} // namespace trocar::engine
