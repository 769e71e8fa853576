// A scene made ready to be planned in: which target its first instrument is driven to, and what a plan of it may take.
#pragma once

#include "engine/experiments/plan.hpp"
#include "engine/scene/scene.hpp"

#include <optional>
#include <string>

namespace trocar::engine {

/// The target that the first instrument follows, or the only one; none where neither is.
[[nodiscard]] std::optional<std::string> usual_target(const Scene& scene);

/// The first instrument follows this target, with the settings that the scene gives for following, or their defaults.
/// fails     BadUsage: no instrument, or no target of that name (the message lists those there are)
[[nodiscard]] Result<void> aim_first_instrument(Scene& scene, const std::string& target);

/// The scene as it is planned in: its first instrument driven to the target, whatever script it has, and no clock, so that a plan does not
/// depend on the machine. What a wall budget leaves out when it is not kept is not planned for.
/// fails     as aim_first_instrument
[[nodiscard]] Result<void> aim_to_plan(Scene& scene, const std::string& target);

/// Too sharp a bend is a reason that there is no way, where the scene says how far the instrument bends.
/// fails     BadValue
[[nodiscard]] Result<void> check_bends(const Scene& scene, const RouteReport& route, const std::string& target);

/// s of simulated time that a trial takes at most where nobody says how long.
[[nodiscard]] double usual_trial_time(const RouteReport& route, const InstrumentModel& instrument) noexcept;

/// Why a trial did not arrive: the place along the way, the lumen's radius and the way's turn there, and what would help.
[[nodiscard]] std::string describe_failure(const Plan& plan, const InstrumentModel& instrument, const std::string& target);

} // namespace trocar::engine
