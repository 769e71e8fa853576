// Contact in whole scenes, where other simulators' users saw it break: walls one triangle thin, cords in a channel, a cable on a
// floor, rising speed, a minute at rest, heaps under no budget.
#include "bench/hard_scenes.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

void tip_against_a_wall_one_triangle_thin(HardReport& report) {
    struct Run {
        double speed;
        const char* budget;
    };
    for (const Run& r : {Run{35.0, "exact"}, Run{35.0, "work:0"}, Run{3500.0, "exact"}, Run{3500.0, "work:0"}, Run{3500.0, "1us"}}) {
        const auto prepared = prepare_hard_scene(report, tube_scene({.budget = r.budget, .from = 85.0, .to = 115.0, .speed = r.speed}));
        if (!prepared) return;
        double wall = 0.0;
        for (const Vec3& p : prepared->model.bodies[0].surface.vertices) wall = std::max(wall, p.z());
        Simulator simulator(prepared->model);
        std::uint64_t exits = 0, shortened = 0;
        double highest = 0.0;
        if (!run_hard(report, simulator, r.speed < 100.0 ? 60 : 30, [&](const StepReport& step) {
                exits += step.lumen_exits;
                shortened += step.drive_limited;
                for (const Vec3& p : simulator.state().instruments[0].skin) highest = std::max(highest, p.z());
            }))
            return;
        const std::string what = fmt::format("straight at an end wall, {:g} mm/s, budget {}", r.speed, r.budget);
        report.equal(what + ": vertices ever outside", static_cast<double>(exits), 0);
        report.above(what + ": nearest to the wall", wall - highest, 0.0, "m");
        report.below(what + ": the same, it did arrive", wall - highest, 1e-3, "m");
        if (shortened > 0) report.note(fmt::format("{}: the drive command was shortened to 1 mm in {} steps: reported", what, shortened));
    }
}

void two_cords_in_a_channel(HardReport& report) {
    const auto cord = [](const char* name, double x, double speed) {
        return fmt::format(R"("{}": {{"length": 320, "radius": 1.2, "young_modulus": 5000, "segment": 3, "skin_triangles": 2000,
            "tip": {{"shape": "straight"}}, "lumen": "channel", "entry": {{"position": [{}, 0, 3], "direction": [{}, 0.03, 1]}},
            "limits": {{"speed": 60, "rotation": 3}}, "path": [[0, 20, 0], [5, {}, 0]]}})",
                           name, x, x > 0.0 ? 0.05 : -0.05, 20.0 + 5.0 * speed);
    };
    for (const char* budget : {"exact", "work:500"}) {
        const auto prepared = prepare_hard_scene(report, fmt::format(R"({{"name": "channel", "units": {{"length": "mm", "pressure": "kPa"}},
                "time": {{"step": 0.0041666666666666666, "duration": 5}}, "budget": "{}", "bodies": {{"channel": {{"kind": "static",
                "hollow": true, "surface": {{"shape": "box", "centre": [0, 0, 100], "extent": [8, 8, 200], "cells": 10}}}}}},
                "instruments": {{{}, {}}}, "effects": ["coarse_contact", "exact_contact", "friction"]}})",
                                                                     budget, cord("fast", 1.8, 50.0), cord("slow", -1.8, 20.0)));
        if (!prepared) return;
        Simulator simulator(prepared->model);
        std::uint64_t exits = 0;
        double farthest = 0.0, nearest_axes = 1.0, deepest = 0.0;
        if (!run_hard(report, simulator, 1200, [&](const StepReport& step) {
                exits += step.lumen_exits;
                for (const Contact& press : simulator.contacts()) deepest = std::max(deepest, -press.gap);
                for (const InstrumentState& cord_state : simulator.state().instruments)
                    for (const Vec3& p : cord_state.rod.position)
                        if (p.z() > 0.0) farthest = std::max({farthest, std::abs(p.x()), std::abs(p.y())});
                const Vec3& tip = simulator.state().instruments[1].rod.position.back();
                for (const Vec3& p : simulator.state().instruments[0].rod.position) nearest_axes = std::min(nearest_axes, (p - tip).norm());
            }))
            return;
        const std::string what = fmt::format("two cords, 8 x 8 mm, 50 and 20 mm/s, dt 1/240, budget {}", budget);
        report.equal(what + ": vertices ever outside", static_cast<double>(exits), 0);
        report.below(what + ": farthest that an axis came from the middle", farthest, 2.8e-3 + deepest,
                     "m"); // 4 mm less the cords' radius, and the penetration depth of the strongest press into its plane's spring
        report.above(what + ": deepest press, the walls were felt", deepest, 0.0, "m");
        report.below(what + ": the same, less than a cord's radius", deepest, 1.2e-3, "m");
        report.note(fmt::format("{}: the axes come as near as {:.2f} mm to each other: instruments meet their vessel, not one another",
                                what, 1e3 * nearest_axes));
    }
}

void thin_cable_dropped_on_a_floor(HardReport& report) {
    for (const char* budget : {"exact", "work:100"}) {
        const auto prepared = prepare_hard_scene(
            report,
            solid_scene({.bodies = soft_body("cable", R"({"shape": "box", "centre": [0, 0, 32], "extent": [100, 4, 4], "cells": 4})", 220),
                         .budget = budget,
                         .contact = R"("solid_friction": 0.3)"}));
        if (!prepared) return;
        Simulator simulator(prepared->model);
        double first = 0.0, most = 0.0, lowest = 1.0;
        std::uint32_t inverted = 0;
        if (!run_hard(report, simulator, 500, [&](const StepReport& step) {
                if (step.step == 1) first = energy_of(simulator);
                most = std::max(most, energy_of(simulator));
                lowest = std::min(lowest, lowest_of(simulator.state().bodies[0].surface));
                inverted += step.inverted_tets;
            }))
            return;
        const std::string what = fmt::format("cable of 4 mm dropped from 30 mm, budget {}", budget);
        report.below(what + ": most energy over that at the start", most / first, 1.002); // integration's own, of the fall
        if (std::string_view(budget) == "exact") report.below(what + ": energy at the end over that at the start", energy_of(simulator) / first, 0.2);
        report.above(what + ": lowest place, the floor at 0", lowest, -2e-3, "m"); // half its thickness
        report.equal(what + ": tets ever inverted", inverted, 0);
    }
}

/// cells   of the block's sides: its corners alone, or more vertices than the coarse mesh beneath them has nodes
void rest_on_a_table(HardReport& report, int cells, double seconds) {
    const auto prepared = prepare_hard_scene(
        report,
        solid_scene({.bodies = soft_body("block", fmt::format(R"({{"shape": "box", "centre": [3, 5, 10.2], "extent": [40, 30, 20], "cells": {}}})", cells), 100),
                     .budget = "work:200000",
                     .contact = R"("solid_friction": 0.3)"}));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    Vec3 settled = Vec3::Zero();
    double farthest = 0.0, kinetic = 0.0, most = 0.0, least = 1e9, lowest = 1.0;
    if (!run_hard(report, simulator, 1000 + static_cast<std::uint64_t>(200.0 * seconds), [&](const StepReport& step) {
            if (step.step < 1000) return; // 5 s to come to rest
            const Vec3 middle = middle_of(simulator.state().bodies[0].surface);
            if (step.step == 1000) settled = middle;
            farthest = std::max(farthest, (middle - settled).norm());
            kinetic = std::max(kinetic, step.kinetic_j);
            most = std::max(most, energy_of(simulator));
            least = std::min(least, energy_of(simulator));
            lowest = std::min(lowest, lowest_of(simulator.state().bodies[0].surface));
        }))
        return;
    const double mass = prepared->model.bodies[0].tissue->mass;
    const std::string block = fmt::format("block of {} cells, {:g} s at rest: ", cells, seconds);
    report.below(block + "how far it creeps", farthest, 1e-5, "m"); // stick is zero slip; the solver's tolerance is left
    report.below(block + "fastest it ever moves", std::sqrt(2.0 * kinetic / mass), 4e-4, "m/s");
    report.below(block + "how far its energy strays, over m g times 1 mm", (most - least) / (mass * 9.81 * 1e-3), 0.1);
    report.above(block + "lowest place", lowest, -1e-3, "m");
}

void sixty_seconds_at_rest(HardReport& report) {
    rest_on_a_table(report, 4, 60.0);
    for (const int cells : {1, 2, 6}) rest_on_a_table(report, cells, 10.0);
}

void a_heap_under_any_budget(HardReport& report) {
    for (const char* budget : {"work:0", "work:1", "1us", "exact"}) {
        const auto prepared =
            prepare_hard_scene(report, solid_scene({.bodies = heap_bodies(14), .budget = budget, .contact = R"("solid_friction": 0.2)"}));
        if (!prepared) return;
        Simulator simulator(prepared->model);
        double first = 0.0, most = 0.0;
        std::uint32_t inverted = 0;
        if (!run_hard(report, simulator, 200, [&](const StepReport& step) {
                if (step.step == 1) first = energy_of(simulator);
                most = std::max(most, energy_of(simulator));
                inverted += step.inverted_tets;
            }))
            return;
        double lowest = 1.0, aside = 0.0;
        for (std::size_t i = 0; i < 14; ++i) {
            const Vec3 middle = middle_of(simulator.state().bodies[i].surface);
            lowest = std::min(lowest, middle.z());
            aside = std::max({aside, std::abs(middle.x()), std::abs(middle.y())});
        }
        const std::string what = fmt::format("14 balls in a tray, budget {}", budget);
        report.below(what + ": most energy over that at the start", most / first, 1.01);
        report.above(what + ": lowest middle of a ball of 10 mm", lowest, 5e-3, "m");
        report.below(what + ": farthest middle from the tray's, walls at 32.5 mm", aside, 27.5e-3, "m");
        report.equal(what + ": tets inverted", inverted, 0);
    }
}

constexpr HardCase kContactsCases[] = {
    {"contact", "ATipAgainstAWallOneTriangleThinNeverPassesIt", "no vertex outside, whatever the speed and the budget",
     tip_against_a_wall_one_triangle_thin},
    {"contact", "TwoCordsInAChannelStayInside", "no vertex outside; the axes keep their radius from the walls", two_cords_in_a_channel},
    {"contact", "AThinCableDroppedOnAFloorLosesEnergy",
     "energy never above 1.002 of the first, and falls; no deeper than half its thickness", thin_cable_dropped_on_a_floor},
    {"contact", "SixtySecondsAtRestAreRest", "it creeps by less than 10 micrometres in a minute, and its energy stays", sixty_seconds_at_rest},
    {"contact", "AHeapLiesInItsTrayUnderAnyBudget", "all balls in the tray; energy never above 1.01 of the first", a_heap_under_any_budget},
};

} // namespace

std::span<const HardCase> hard_contacts() noexcept { return kContactsCases; }

} // namespace trocar::engine
