// Small scenes that the hard cases of contact and of whole runs share.
#pragma once

#include "bench/hard_cases.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// Nothing, and a case that does not hold, where the scene is refused.
[[nodiscard]] std::optional<PreparedScene> prepare_hard_scene(HardReport& report, const std::string& text);

struct StraightTube {
    std::string budget = "exact";
    double from = 20.0, to = 40.0; // mm of insertion, at the drive's maximum speed from the start
    double speed = 35.0;           // mm/s, of the drive command
    std::string effects = R"("coarse_contact", "exact_contact", "friction")";
    bool bent = false; // the second half goes to the side
    double away = 0.0; // mm, all of it, along x
};
/// A wire of 0.5 mm in a tube of 3 mm that is closed 100 mm above.
[[nodiscard]] std::string tube_scene(const StraightTube& tube);

/// A wire in a bent tube embedded in tissue, driven round the bend at 150 mm/s: 60 steps.
[[nodiscard]] std::string organ_scene(const std::string& budget);

/// Soft solids over a table of 120 mm: more bodies in front of it, settings of contact.
struct SolidScene {
    std::string bodies; // "name": {...},
    std::string budget = "exact";
    std::string contact;
    double step = 0.005; // s
    bool gravity = true, table = true;
    double away = 0.0; // mm, the table along x
};
[[nodiscard]] std::string solid_scene(const SolidScene& scene);
/// "name": {...}, of a soft body; surface as in a scene
[[nodiscard]] std::string soft_body(const std::string& name, const std::string& surface, int triangles = 150);
/// Balls in layers of 3 x 3, 2 x 2 and 1 over the table, with walls around: a tray of 65 mm.
[[nodiscard]] std::string heap_bodies(int balls, int triangles = 150);

[[nodiscard]] bool all_finite(const State& state);

/// A run that is examined after every step. False: it stopped.
template <class Look>
bool run_hard(HardReport& report, Simulator& simulator, std::uint64_t steps, Look&& look) {
    for (std::uint64_t k = 0; k < steps; ++k) {
        const StepReport& step = simulator.step();
        if (!report.require(step.finite, "every step is finite: " + step.failure)) return false;
        look(step);
    }
    return report.require(all_finite(simulator.state()), "the state is finite");
}

/// Kinetic, elastic and potential energy of all tissue, the table's top at zero. J
[[nodiscard]] double energy_of(Simulator& simulator);
[[nodiscard]] Vec3 middle_of(const std::vector<Vec3>& points);
[[nodiscard]] double lowest_of(const std::vector<Vec3>& points); // z, m

} // namespace trocar::engine
