// Flesh between solids that close on it: gently and at many times the speed of sound in it, by soft contact and by contact a hundred
// thousand times as stiff, to a third of its height and to a sixtieth. What presses brings work; once it rests it may bring no more.
#include "bench/hard_scenes.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

struct Press {
    double stiffness = 0.2;  // N/mm, of a place that touches
    double seconds = 0.1;    // during which the press moves
    double left = 20.0;      // mm of the ball's 60
    double thickness = 10.0; // mm, of the table and of the press
    double step = 0.005;     // s
};

/// Nothing damps it: what heats it shows.
std::string press_scene(const Press& p) {
    const double way = 65.0 - p.left;
    return fmt::format(R"({{"name": "press", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 10}},
        "budget": "exact", "contact": {{"solid_stiffness": {}}}, "bodies": {{
        "ball": {{"kind": "deformable", "surface": {{"shape": "sphere", "centre": [0, 0, 30], "radius": 30, "subdivisions": 2}},
            "material": {{"young_modulus": 20, "density": 1000}}, "coarse": {{"mesher": "lattice", "surface_triangles": 100}}}},
        "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, {}], "extent": [200, 200, {}]}}}},
        "press": {{"kind": "kinematic", "surface": {{"shape": "box", "centre": [0, 0, {}], "extent": [200, 200, {}]}},
            "motion": [[0, 0, 0, 0], [{}, 0, 0, {}], [10, 0, 0, {}]]}}}}, "effects": ["elasticity", "coarse_contact"]}})",
                       p.step, p.stiffness, -0.5 * p.thickness, p.thickness, 65.0 + 0.5 * p.thickness, p.thickness, p.seconds, -way, -way);
}

constexpr double kRest = 1.0; // s, that the press stays where it came to

/// [-]; energy over what there was when the press came to rest: at any time, and a second later.
struct Bounds {
    double most, at_end;
};

void press(HardReport& report, const Press& p, const Bounds& bounds) {
    const auto prepared = prepare_hard_scene(report, press_scene(p));
    if (!prepared) return;
    Simulator simulator(prepared->model);
    double at_stop = 0.0, most = 0.0;
    const auto steps = static_cast<std::uint64_t>((p.seconds + kRest) / p.step);
    const std::string what =
        fmt::format("ball of 60 mm pressed to {:g} in {:g} s by {:g} N/mm, step {:g} ms", p.left, p.seconds, p.stiffness, 1e3 * p.step);
    std::uint32_t inverted = 0;
    if (!run_hard(report, simulator, steps, [&](const StepReport& step) {
            const double energy = energy_of(simulator);
            if (step.time_s <= p.seconds + p.step) at_stop = energy; // its springs go on until the end of the step
            most = std::max(most, energy);
            inverted = std::max(inverted, step.inverted_tets);
        }))
        return;
    report.above(what + ": energy when it stops", at_stop, 0.1, "J");
    report.below(what + ": most over that", most / at_stop, bounds.most);
    report.below(what + ": at the end over that, a second later", energy_of(simulator) / at_stop, bounds.at_end);
    if (inverted > 0) report.note(fmt::format("{}: up to {} tets inverted", what, inverted));
}

/// What lies still between solids: a hundredth is what springs get for places that came in unopposed, up to their depth.
void flesh_between_solids(HardReport& report) {
    for (const double stiffness : {0.2, 20.0, 2000.0})
        for (const double seconds : {0.1, 1.0})
            for (const double step : {0.001, 0.005})
                // what sank into the plates while it was pressed comes out again, at 2 mm/s
                press(report, {.stiffness = stiffness, .seconds = seconds, .step = step}, {1.25, 1.25});
}

void flesh_pressed_flat(HardReport& report) {
    for (const double thickness : {10.0, 200.0})
        for (const double seconds : {0.01, 0.1, 1.0})
            for (const double step : {0.001, 0.005})
                press(report, {.seconds = seconds, .left = 1.0, .thickness = thickness, .step = step}, {1.4, 1.01});
}

constexpr HardCase kPressesCases[] = {
    {"contact", "FleshHeldBetweenSolidsIsNotHeated",
     "pressed to a third, undamped, whatever solid_stiffness says (0.2 to 2000 N/mm): its energy never above 1.25 of what it had when the "
     "press stopped",
     flesh_between_solids},
    {"contact", "FleshPressedFlatDoesNotBurst",
     "pressed to a sixtieth, at up to 6.4 m/s (sound in it: 4.5), through solids of 10 mm: never above 1.4 of that, and no more a "
     "second later",
     flesh_pressed_flat},
};

} // namespace

std::span<const HardCase> hard_presses() noexcept { return kPressesCases; }

} // namespace trocar::engine
