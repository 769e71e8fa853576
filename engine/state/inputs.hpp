// What somebody does during a step. A step without any is that of the scene's script.
#pragma once

#include "base/vec.hpp"
#include "engine/scene/effect.hpp"
#include "engine/scene/settings.hpp"

#include <array>
#include <optional>
#include <vector>

namespace trocar::engine {

/// Somebody holds a point of a surface and pulls it towards a place.
struct Pull {
    std::size_t body = 0;       // of the model
    Index vertex = 0;           // of its surface
    Vec3 target = Vec3::Zero(); // m
};

/// Effects of the scene that a run does without, wholly or in part, for a while: those with an EffectDescriptor::scale. What the scene does
/// not have is not switched on.
class LiveEffects {
public:
    LiveEffects() noexcept { share_.fill(1.0); }
    /// share   [0, 1]; 0: off
    void set(const EffectDescriptor& effect, double share) noexcept { share_[index_of(effect)] = share; }
    [[nodiscard]] double share(const EffectDescriptor& effect) const noexcept { return share_[index_of(effect)]; }

private:
    std::array<double, kMostEffects> share_; // as registered_effects()
};

/// It is no part of the scene: only the same inputs at the same steps repeat such a run.
struct Inputs {
    /// [instrument_count], or empty: nobody drives. In place of an instrument's script; it moves as fast as the instrument's limits allow,
    /// towards any finite place.
    std::vector<std::optional<DriveCommand>> drive;
    std::optional<Pull> pull; // of a vertex that no tissue carries: it is held, and does not move
    LiveEffects live;
    std::optional<BudgetLimits> budget; // of this step, in place of the simulator's
};

} // namespace trocar::engine
