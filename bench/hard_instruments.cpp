// Instruments where it is hard: jams, dead ends, reversals, soft walls, and scenes that ask for the impossible.
#include "bench/hard_scenes.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::engine {

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

/// Too narrow for the wire from 54 to 61 mm.
constexpr const char* kStenosis = "[0, 0, 0, 3], [0, 0, 40, 3], [0, 0, 55, 0.35], [0, 0, 60, 0.35], [0, 0, 75, 3], [0, 0, 100, 3]";

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
    const double stiffness = 60e6 * 0.25 * std::numbers::pi * std::pow(0.5e-3, 4);
    return 0.5 * stiffness * length / (bend_radius * bend_radius);
}

/// What some steps came to.
struct Tally {
    double energy = 0.0, force = 0.0, farthest_tip = -1.0; // J, N, m: largest
    double volume_ratio = 1.0;                             // smallest
    std::uint64_t exits = 0, inverted = 0;
    StepReport last;
};

/// Steps in which every vertex stays in the lumen. False: it stopped.
bool drive(HardReport& report, Simulator& simulator, std::uint64_t steps, Tally& tally) {
    tally = {};
    return run_hard(report, simulator, steps, [&](const StepReport& step) {
        tally.energy = std::max(tally.energy, step.kinetic_j + step.elastic_j);
        tally.force = std::max(tally.force, step.contact_force_n);
        tally.farthest_tip = std::max(tally.farthest_tip, step.tip.z());
        tally.volume_ratio = std::min(tally.volume_ratio, step.min_volume_ratio);
        tally.inverted += step.inverted_tets;
        tally.exits += step.lumen_exits;
        tally.last = step;
    });
}

void stay_inside(HardReport& report, const std::string& what, std::uint64_t exits) {
    report.equal(what + ": vertices ever outside", static_cast<double>(exits), 0);
}

void knot_that_is_attempted(HardReport& report) {
    Hard hard;
    hard.axis = "[0, 0, 0, 3], [0, 0, 28, 3], [0, 0, 34, 12], [0, 0, 60, 12], [0, 0, 66, 12]";
    hard.effects += R"(, "twist")";
    hard.path = "[[0, 15, 0], [4, 150, 12.5], [5, 150, 15.6], [9, 15, 15.6]]";
    const auto prepared = prepare_hard_scene(report, hard_scene(hard));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Tally pushed, drawn;
    if (!drive(report, simulator, 500, pushed) || !drive(report, simulator, 450, drawn)) return;
    const std::string what = "knot attempted, 150 mm and 2.5 turns into a sac of 12 mm";
    stay_inside(report, what, pushed.exits + drawn.exits);
    report.below(what + ": energy", pushed.energy, bent_energy(0.15, 6e-3), "J");
    report.below(what + ": insertion left when drawn back", drawn.last.insertion_m, 0.020, "m");
}

void catheter_longer_than_the_vessel(HardReport& report) {
    Hard hard;
    hard.length = 500.0;
    hard.path = "[[0, 40, 0], [9, 350, 0]]";
    const auto prepared = prepare_hard_scene(report, hard_scene(hard));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Tally tally;
    if (!drive(report, simulator, 800, tally)) return;
    const std::string what = "500 mm of catheter asked into 90 mm of vessel";
    stay_inside(report, what, tally.exits);
    report.below(what + ": energy", tally.energy, bent_energy(tally.last.insertion_m, 1.5e-3), "J"); // as tight as half the lumen
    report.note(fmt::format("{}: {:.0f} mm fold up in it", what, 1e3 * tally.last.insertion_m));
}

void tip_against_a_closed_end(HardReport& report) {
    Hard hard;
    hard.tip = R"({"shape": "straight"})";
    hard.axis = "[0, 0, 0, 1.2], [0, 0, 30, 1.2], [0, 0, 60, 1.2]"; // narrow: it cannot give way far
    hard.path = "[[0, 30, 0], [1, 50, 0], [3, 58, 0]]";
    const auto prepared = prepare_hard_scene(report, hard_scene(hard));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Tally before, pressed, harder;
    if (!drive(report, simulator, 90, before) || !drive(report, simulator, 60, pressed) || !drive(report, simulator, 150, harder)) return;
    const std::string what = "tip at a closed end";
    stay_inside(report, what, before.exits + pressed.exits + harder.exits);
    report.below(what + ": its place, the dome is as high as wide at most", harder.last.tip.z(), 0.0612, "m");
    report.above(what + ": force pressed over that before", pressed.force / std::max(1e-9, before.force), 1.0);
    report.above(what + ": force later over force sooner", harder.force / std::max(1e-9, pressed.force), 1.0);
    report.below(what + ": force, 60 places at 2 N each", harder.force, 120.0, "N");
}

void dead_stop_and_reversal(HardReport& report) {
    Hard hard;
    hard.path = "[[0, 30, 0], [1, 65, 3.14], [2, 65, 3.14], [3, 30, 0], [4, 65, 3.14], [5, 30, 0]]"; // 35 mm/s and 3.14 rad/s
    const auto prepared = prepare_hard_scene(report, hard_scene(hard));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Tally moving, stopping, resting, reversed;
    if (!drive(report, simulator, 100, moving) || !drive(report, simulator, 10, stopping) || !drive(report, simulator, 80, resting) ||
        !drive(report, simulator, 310, reversed))
        return;
    stay_inside(report, "dead stop and reversals at 35 mm/s and 3.14 rad/s",
                moving.exits + stopping.exits + resting.exits + reversed.exits);
    const double mass = 1100.0 * std::numbers::pi * 0.25e-6 * 0.065, scale = 0.5 * mass * 0.035 * 0.035;
    report.below("dead stop at 35 mm/s: kinetic energy after 0.9 s over that of full speed", resting.last.kinetic_j / scale, 1e-3);
    report.below("reversals at full speed: energy over that of the way in", reversed.energy / moving.energy, 1.5);
    report.below("reversals at full speed: how far the insertion is from the drive command",
                 std::abs(reversed.last.insertion_m - 0.030), 1e-6, "m");
}

void wall_softer_than_blood_pressure(HardReport& report) {
    Hard hard;
    hard.others = R"("organ": {"kind": "deformable", "surface": {"shape": "box", "centre": [0, 0, 60], "extent": [60, 40, 90], "cells": 4},
        "material": {"young_modulus": 2, "poisson_ratio": 0.4, "density": 1000, "viscosity": 0.001, "mass_damping": 5},
        "coarse": {"surface_triangles": 120}, "fixed": [{"direction": [0, 1, 0], "fraction": 0.1}]},)";
    hard.body = R"("kind": "static", "embedded_in": "organ", "blend": 5)";
    hard.path = "[[0, 40, 0], [2, 105, 3]]";
    hard.effects += R"(, "elasticity", "damping")";
    const auto prepared = prepare_hard_scene(report, hard_scene(hard));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Tally tally;
    if (!drive(report, simulator, 300, tally)) return;
    const std::string what = "wall of 2 kPa, blood's pressure is 13";
    stay_inside(report, what, tally.exits);
    report.above(what + ": smallest volume ratio", tally.volume_ratio, 0.2);
    report.equal(what + ": tets ever inverted", static_cast<double>(tally.inverted), 0);
}

void lumen_narrower_than_the_catheter(HardReport& report) {
    Hard hard;
    hard.axis = kStenosis;
    hard.tip = R"({"shape": "straight"})";
    hard.path = "[[0, 20, 0], [2, 80, 0]]";
    const auto prepared = prepare_hard_scene(report, hard_scene(hard));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Tally tally;
    if (!drive(report, simulator, 300, tally)) return;
    const std::string what = "stenosis of 0.7 mm before a catheter of 1 mm";
    stay_inside(report, what, tally.exits);
    // The cone is as wide as the catheter with its clearance at 54 mm.
    report.below(what + ": the tip's farthest place", tally.farthest_tip, 0.0545, "m");
    report.above(what + ": the same, it did arrive", tally.farthest_tip, 0.052, "m");
}

/// Preparing the scene must end with an error of that key that names `what`, and the line.
void refuses(HardReport& report, const Hard& hard, std::string_view key, std::string_view what) {
    const auto judge = [&](const Error& error) {
        report.require(error.key == key && error.message.find(what) != std::string::npos && error.line > 0,
                       fmt::format("refused at {} with \"{}\" and a line; it says: {}", key, what, error.to_string()));
    };
    const Result<Scene> scene = parse_scene(hard_scene(hard), "scenes/hard.json");
    if (!scene.ok()) return judge(scene.error());
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    if (!prepared.ok()) return judge(prepared.error());
    report.require(false, fmt::format("refused with \"{}\"; it was prepared", what));
}

void entry_outside_the_vessel(HardReport& report) {
    Hard hard;
    hard.entry = R"({"position": [0, 20, 10], "direction": [0, 0, 1]})";
    refuses(report, hard, "instruments.wire.entry", "outside of tube, the instrument's radius is 0.5 mm; expected a place with more");
    hard.entry = R"({"position": [0, 2.8, 10], "direction": [0, 0, 1]})";
    refuses(report, hard, "instruments.wire.entry", "mm of clearance inside tube, the instrument's radius is 0.5 mm");
}

void catheter_thicker_than_its_vessel(HardReport& report) {
    Hard hard;
    hard.radius = 3.5;
    refuses(report, hard, "instruments.wire.entry", "mm of clearance inside tube, the instrument's radius is 3.5 mm");
}

void target_that_cannot_be_reached(HardReport& report) {
    Hard hard;
    hard.path = "";
    hard.more = R"("follow": {"target": "far"})";
    hard.targets = R"("far": {"position": [0, 60, 50]})";
    refuses(report, hard, "targets.far", "outside of tube, and no place within the tolerance");
    hard.targets = R"("far": {"position": [0, 0, 90]})";
    hard.axis = kStenosis;
    refuses(report, hard, "instruments.wire.follow", "no way from the entry to far");
}

constexpr HardCase kInstrumentsCases[] = {
    {"instruments", "AKnotThatIsAttemptedCoilsInTheSacAndComesOutAgain",
     "no vertex outside; energy below that of a coil of half the sac's radius; drawn back it comes out whole", knot_that_is_attempted},
    {"instruments", "ACatheterLongerThanTheVesselStopsAndStaysInside",
     "it folds up inside; energy below that of bends as tight as half the lumen", catheter_longer_than_the_vessel},
    {"instruments", "ATipAgainstAClosedEndIsStoppedWhileTheForceGrows",
     "not beyond the dome; the force grows while it is pushed; 2 N a place at most", tip_against_a_closed_end},
    {"instruments", "ADeadStopAndAReversalAtFullSpeedLeaveNoSwing",
     "a thousandth of the kinetic energy after 0.9 s; energy 1.5 times that of the way in", dead_stop_and_reversal},
    {"instruments", "AWallSofterThanBloodPressureYieldsButIsNotLeft", "no vertex outside, no tet inverts, volume ratio above 0.2",
     wall_softer_than_blood_pressure},
    {"instruments", "ALumenThatIsNarrowerThanTheCatheterStopsIt", "the tip stops where the cone is as wide as its clearance",
     lumen_narrower_than_the_catheter},
    {"instruments", "AnEntryOutsideTheVesselIsRefusedWithTheClearanceThereIs", "refused before the run, with line, key and the clearance",
     entry_outside_the_vessel},
    {"instruments", "ACatheterThickerThanItsVesselIsRefused", "refused before the run, with line, key and the clearance",
     catheter_thicker_than_its_vessel},
    {"instruments", "ATargetThatCannotBeReachedIsRefused",
     "refused before the run, with line and key, beside the vessel and behind a stenosis", target_that_cannot_be_reached},
};

} // namespace

std::span<const HardCase> hard_instruments() noexcept { return kInstrumentsCases; }

} // namespace trocar::engine
