// Instruments where it is hard: jams, dead ends, reversals, soft walls, and scenes that ask for what cannot be.
#include "tests/engine/step_fixture.hpp"
#include "tests/hard_cases/margin.hpp"

namespace seldinger::engine {

using seldinger::test::print_margin;
using test::Tally;

namespace {

struct Hard {
    std::string body = R"("kind": "static")";
    std::string others = {}; // further bodies
    std::string axis = "[0, 0, 0, 3], [0, 0, 50, 3], [0, 0, 100, 3]";
    std::string entry = R"({"position": [0, 0, 10], "direction": [0, 0, 1]})";
    std::string tip = R"({"shape": "J", "length": 12, "angle": 0.8})";
    std::string path = "[[0, 40, 0], [2, 100, 0]]";
    std::string more = {};    // of the instrument
    std::string targets = {}; // of the scene
    double length = 220.0, radius = 0.5;
    std::string effects = R"("coarse_contact", "exact_contact", "friction")";
};

std::string hard_scene(const Hard& hard) {
    return fmt::format(R"({{
    "name": "hard-instrument",
    "units": {{"length": "mm", "pressure": "kPa"}},
    "time": {{"step": 0.01, "duration": 10}},
    "bodies": {{{} "tube": {{{}, "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 20}}}}}},
    "targets": {{{}}},
    "instruments": {{"wire": {{"length": {}, "radius": {}, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {}, "lumen": "tube", "entry": {}, {} {}}}}},
    "effects": [{}]
}})",
                       hard.others, hard.body, hard.axis, hard.targets, hard.length, hard.radius, hard.tip, hard.entry, hard.more,
                       hard.path.empty() ? "" : R"("path": )" + hard.path, hard.effects);
}

/// J: a rod of this kind bent to `bend_radius` all along `length`.
double bent_energy(double length, double bend_radius) {
    const double stiffness = 60e6 * 0.25 * 3.14159265358979 * std::pow(0.5e-3, 4);
    return 0.5 * stiffness * length / (bend_radius * bend_radius);
}

void expect_inside(const Tally& tally, std::uint64_t steps) {
    EXPECT_EQ(tally.steps, steps) << tally;
    EXPECT_EQ(tally.lumen_exits, 0u) << tally;
}

TEST(HardInstruments, AKnotThatIsAttemptedCoilsInTheSacAndComesOutAgain) {
    Hard hard;
    hard.axis = "[0, 0, 0, 3], [0, 0, 28, 3], [0, 0, 34, 12], [0, 0, 60, 12], [0, 0, 66, 12]";
    hard.effects += R"(, "twist")";
    hard.path = "[[0, 15, 0], [4, 150, 12.5], [5, 150, 15.6], [9, 15, 15.6]]";
    const PreparedScene prepared = test::prepare(hard_scene(hard));
    Simulator simulator(prepared.model);
    const Tally pushed = test::run_steps(simulator, 500);
    expect_inside(pushed, 500);
    // Coiled in the sac it bends to half of the sac's radius nowhere but in passing.
    const double bound = bent_energy(0.15, 6e-3);
    print_margin("knot attempted, 150 mm and 2.5 turns into a sac of 12 mm: energy", pushed.largest_energy, "<", bound, "J");
    EXPECT_LT(pushed.largest_energy, bound);
    const Tally drawn = test::run_steps(simulator, 450);
    expect_inside(drawn, 450);
    print_margin("knot attempted, drawn back: insertion left", 1e3 * drawn.insertion, "<", 20.0, "mm");
    EXPECT_LT(drawn.insertion, 0.020);
}

TEST(HardInstruments, ACatheterLongerThanTheVesselStopsAndStaysInside) {
    Hard hard;
    hard.length = 500.0;
    hard.path = "[[0, 40, 0], [9, 350, 0]]";
    const PreparedScene prepared = test::prepare(hard_scene(hard));
    Simulator simulator(prepared.model);
    Tally last;
    double first_half = 0.0;
    for (int k = 0; k < 2; ++k) {
        last = test::run_steps(simulator, 400);
        expect_inside(last, 400);
        if (k == 0) first_half = last.largest_energy;
    }
    std::cout << "500 mm of catheter asked into 90 mm of vessel: " << 1e3 * last.insertion << " mm fold up in it\n";
    // The hand asks for 315 mm by then; bends are as tight as the lumen at most.
    const double bound = bent_energy(last.insertion, 1.5e-3);
    print_margin("the same: energy", std::max(first_half, last.largest_energy), "<", bound, "J");
    EXPECT_LT(std::max(first_half, last.largest_energy), bound);
}

TEST(HardInstruments, ATipAgainstAClosedEndIsStoppedWhileTheForceGrows) {
    Hard hard;
    hard.tip = R"({"shape": "straight"})";
    hard.axis = "[0, 0, 0, 1.2], [0, 0, 30, 1.2], [0, 0, 60, 1.2]"; // narrow: it cannot give way far
    hard.path = "[[0, 30, 0], [1, 50, 0], [3, 58, 0]]";
    const PreparedScene prepared = test::prepare(hard_scene(hard));
    Simulator simulator(prepared.model);
    const Tally before = test::run_steps(simulator, 90);
    const Tally pressed = test::run_steps(simulator, 60), harder = test::run_steps(simulator, 150);
    for (const Tally& tally : {before, pressed, harder}) EXPECT_EQ(tally.lumen_exits, 0u) << tally;
    // The end is a dome over the last ring, as high as it is wide at most.
    print_margin("tip at a closed end: its place", 1e3 * harder.last.tip.z(), "<", 61.2, "mm");
    EXPECT_LT(harder.last.tip.z(), 0.0612);
    print_margin("the same: force later over force sooner", harder.largest_force / std::max(1e-9, pressed.largest_force), ">", 1.0);
    EXPECT_GT(pressed.largest_force, before.largest_force);
    EXPECT_GT(harder.largest_force, pressed.largest_force);
    // Per place the walls are pushed by 2 N at most: beyond it a vessel gives way. 60 places touch at most.
    print_margin("the same: force", harder.largest_force, "<", 120.0, "N");
    EXPECT_LT(harder.largest_force, 120.0);
}

TEST(HardInstruments, ADeadStopAndAReversalAtFullSpeedLeaveNoSwing) {
    Hard hard;
    hard.path = "[[0, 30, 0], [1, 65, 3.14], [2, 65, 3.14], [3, 30, 0], [4, 65, 3.14], [5, 30, 0]]"; // 35 mm/s and 3.14 rad/s
    const PreparedScene prepared = test::prepare(hard_scene(hard));
    Simulator simulator(prepared.model);
    const Tally moving = test::run_steps(simulator, 100);
    expect_inside(moving, 100);
    const Tally stopping = test::run_steps(simulator, 10), resting = test::run_steps(simulator, 80);
    // All of it at the hand's speed is the scale: a tenth of a second after the stop less than a thousandth is left.
    const double mass = 1100.0 * 3.14159265358979 * 0.25e-6 * 0.065, scale = 0.5 * mass * 0.035 * 0.035;
    print_margin("dead stop at 35 mm/s: kinetic energy after 0.9 s over that of full speed", resting.last.kinetic_j / scale, "<", 1e-3);
    EXPECT_LT(resting.last.kinetic_j, 1e-3 * scale);
    expect_inside(stopping, 10);
    const Tally reversed = test::run_steps(simulator, 310);
    expect_inside(reversed, 310);
    print_margin("reversals at full speed: energy over that of the way in", reversed.largest_energy / moving.largest_energy, "<", 1.5);
    EXPECT_LT(reversed.largest_energy, 1.5 * moving.largest_energy);
    EXPECT_NEAR(reversed.insertion, 0.030, 1e-6);
}

TEST(HardInstruments, AWallSofterThanBloodPressureYieldsButIsNotLeft) {
    Hard hard;
    hard.others = R"("organ": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 60], "extent": [60, 40, 90], "cells": 4},
        "material": {"young_modulus": 2, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.001, "mass_damping": 5},
        "coarse": {"surface_triangles": 120}, "fixed": [{"direction": [0, 1, 0], "fraction": 0.1}]},)";
    hard.body = R"("kind": "static", "embedded_in": "organ", "blend": 5)";
    hard.path = "[[0, 40, 0], [2, 105, 3]]";
    hard.effects += R"(, "elasticity", "damping")";
    const PreparedScene prepared = test::prepare(hard_scene(hard));
    Simulator simulator(prepared.model);
    Tally tally;
    std::uint32_t inverted = 0;
    double least = 1.0;
    for (int k = 0; k < 30; ++k) {
        tally = test::run_steps(simulator, 10);
        expect_inside(tally, 10);
        inverted = std::max(inverted, tally.last.inverted_tets);
        least = std::min(least, tally.last.min_volume_ratio);
    }
    print_margin("wall of 2 kPa, blood's pressure is 13: smallest volume ratio", least, ">", 0.2);
    EXPECT_GT(least, 0.2);
    EXPECT_EQ(inverted, 0u);
    EXPECT_TRUE(test::all_finite(simulator.state()));
}

TEST(HardInstruments, ALumenThatIsNarrowerThanTheCatheterStopsIt) {
    Hard hard;
    hard.axis = "[0, 0, 0, 3], [0, 0, 40, 3], [0, 0, 55, 0.35], [0, 0, 60, 0.35], [0, 0, 75, 3], [0, 0, 100, 3]";
    hard.tip = R"({"shape": "straight"})";
    hard.path = "[[0, 20, 0], [2, 80, 0]]";
    const PreparedScene prepared = test::prepare(hard_scene(hard));
    Simulator simulator(prepared.model);
    double farthest = 0.0;
    for (int k = 0; k < 300; ++k) {
        const Tally tally = test::run_steps(simulator, 1);
        expect_inside(tally, 1);
        farthest = std::max(farthest, tally.last.tip.z());
    }
    // The cone is as wide as the catheter with its clearance at 54 mm.
    print_margin("stenosis of 0.7 mm before a catheter of 1 mm: the tip's farthest place", 1e3 * farthest, "<", 54.5, "mm");
    EXPECT_LT(farthest, 0.0545);
    EXPECT_GT(farthest, 0.052);
}

/// What preparing a scene is refused with.
Error refused(const Hard& hard) {
    Result<Scene> scene = parse_scene(hard_scene(hard), "scenes/hard.json");
    if (!scene.ok()) return scene.error();
    Result<PreparedScene> prepared = prepare_scene(*scene);
    EXPECT_FALSE(prepared.ok());
    return prepared.ok() ? Error{} : prepared.error();
}

void expect_says(const Error& error, const std::string& key, const std::string& what) {
    EXPECT_EQ(error.key, key) << error.to_string();
    EXPECT_NE(error.message.find(what), std::string::npos) << error.to_string();
    EXPECT_GT(error.line, 0u) << error.to_string();
}

TEST(HardInstruments, AnEntryOutsideTheVesselIsRefusedWithTheRoomThereIs) {
    Hard hard;
    hard.entry = R"({"position": [0, 20, 10], "direction": [0, 0, 1]})";
    expect_says(refused(hard), "instruments.wire.entry", "the entry has -");
    hard.entry = R"({"position": [0, 2.8, 10], "direction": [0, 0, 1]})";
    expect_says(refused(hard), "instruments.wire.entry", "mm of room inside tube, the instrument's radius is 0.5 mm");
}

TEST(HardInstruments, ACatheterThickerThanItsVesselIsRefused) {
    Hard hard;
    hard.radius = 3.5;
    expect_says(refused(hard), "instruments.wire.entry", "mm of room inside tube, the instrument's radius is 3.5 mm");
}

TEST(HardInstruments, ATargetThatCannotBeReachedIsRefused) {
    Hard hard;
    hard.path = "";
    hard.more = R"("follow": {"target": "far"})";
    hard.targets = R"("far": {"position": [0, 60, 50]})";
    expect_says(refused(hard), "instruments.wire.follow", "no way from the entry to far");
    hard.targets = R"("far": {"position": [0, 0, 90]})";
    hard.axis = "[0, 0, 0, 3], [0, 0, 40, 3], [0, 0, 55, 0.35], [0, 0, 60, 0.35], [0, 0, 75, 3], [0, 0, 100, 3]"; // behind a stenosis
    expect_says(refused(hard), "instruments.wire.follow", "no way from the entry to far");
}

} // namespace
} // namespace seldinger::engine
