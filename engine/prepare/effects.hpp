// The effects that a scene can call for, one by one: which of them a model has, and the same model without one.
#pragma once

#include "engine/prepare/model.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace trocar::engine {

/// Effects whose code runs in the step, or around it in every step. Fluoroscopy is of pictures alone.
enum class Effect : std::uint8_t {
    Elasticity,
    Damping,
    Gravity,
    Breathing,
    Pulse,
    CoarseContact,
    SelfContact,
    ExactContact,
    Friction,
    Twist,
    BloodDrag
};
inline constexpr std::array<std::string_view, 11> kEffectNames{"elasticity", "damping",        "gravity",      "breathing",
                                                               "pulse",      "coarse_contact", "self_contact", "exact_contact",
                                                               "friction",   "twist",          "blood_drag"};
inline constexpr std::size_t kEffectCount = kEffectNames.size();

[[nodiscard]] constexpr std::string_view effect_name(Effect effect) noexcept { return kEffectNames[static_cast<std::size_t>(effect)]; }

/// How often each effect's code was entered: what a scene does not call for stays at 0.
struct EffectCounts {
    std::array<std::uint64_t, kEffectCount> entered{};
    void note(Effect effect) noexcept { ++entered[static_cast<std::size_t>(effect)]; }
    [[nodiscard]] std::uint64_t of(Effect effect) const noexcept { return entered[static_cast<std::size_t>(effect)]; }
    EffectCounts& operator+=(const EffectCounts& other) noexcept {
        for (std::size_t k = 0; k < kEffectCount; ++k) entered[k] += other.entered[k];
        return *this;
    }
};

/// Has torsion because the scene asks for it; a pigtail has it in any case.
[[nodiscard]] bool twists_by_effect(const InstrumentModel& instrument) noexcept;

/// Does the model have it, and a body or instrument that it acts on?
[[nodiscard]] bool has_effect(const SceneModel& model, Effect effect) noexcept;

/// What preparing the same scene without the effect gives, but for self_contact without coarse_contact, which goes with it.
[[nodiscard]] SceneModel without_effect(const SceneModel& model, Effect effect);

} // namespace trocar::engine
