// What the engine knows of one effect, in one place: its key in a scene, what it acts on, the model without it, what it does in a step,
// what `explain` says of it. engine/effects/<name> defines one, engine/effects/registry.hpp lists them, a line each; docs/extending.md
// walks through an addition.
//
// An effect acts on a step by loads: on tissue, on the rods of instruments, and on surfaces. Effects that are stages of the step
// themselves (elasticity, contact) have none.
#pragma once

#include "base/result.hpp"
#include "engine/scene/settings.hpp"
#include "engine/scene/table.hpp"
#include "fem/rod/rod_design.hpp"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::fem {
struct ContactSprings;
struct FacePressure;
}

namespace trocar::engine {

struct Scene;
struct SceneModel;
struct State;
struct EffectPreparation;
struct EffectDescriptor;

/// Effects that a program can have at most, its own included.
inline constexpr std::size_t kMostEffects = 32;

/// In the order in which reports list them: those of engine/effects, then those that add_effect added.
[[nodiscard]] std::span<const EffectDescriptor* const> registered_effects() noexcept;

/// Into registered_effects(), of one of them.
[[nodiscard]] std::size_t index_of(const EffectDescriptor& effect) noexcept;

/// nullptr: there is none of that name.
[[nodiscard]] const EffectDescriptor* find_effect(std::string_view name) noexcept;

/// An effect of the program's own; `effect` outlives everything. Before the first scene is read, and from one thread: scenes then have
/// its key.
/// fails  BadValue: no name, one that there is, or more than kMostEffects in all
[[nodiscard]] Result<void> add_effect(const EffectDescriptor& effect);

/// How often each effect's code was entered: what a scene does not call for stays at 0.
struct EffectCounts {
    std::array<std::uint64_t, kMostEffects> entered{}; // as registered_effects()
    void note(const EffectDescriptor& effect) noexcept { ++entered[index_of(effect)]; }
    [[nodiscard]] std::uint64_t of(const EffectDescriptor& effect) const noexcept { return entered[index_of(effect)]; }
    EffectCounts& operator+=(const EffectCounts& other) noexcept {
        for (std::size_t k = 0; k < kMostEffects; ++k) entered[k] += other.entered[k];
        return *this;
    }
};

/// An effect that is known by its descriptor alone, with what a scene says of it.
struct AddedEffect {
    const EffectDescriptor* effect = nullptr;
    std::vector<double> settings; // SI, the numbers of its keys in their order, three of a vector
};

/// Only what is set here has code that runs.
struct EffectSet {
    bool elasticity = true;      // off: deformable bodies stay at rest
    bool coarse_contact = true;  // sphere trees
    bool self_contact = false;   // solid bodies against themselves
    bool instrument_contact = false; // instruments against one another
    bool loads = false;          // of the bodies' key loads
    bool exact_contact = true;   // continuous tests, when the budget allows
    std::optional<Vec3> gravity; // m/s^2
    std::optional<BreathingSpec> breathing;
    std::optional<PulseSpec> pulse;
    std::optional<Blood> blood_drag; // of instruments
    std::vector<AddedEffect> added;  // of the program's own
};

/// What an effect sees of a step.
struct EffectStep {
    const SceneModel& model;
    const EffectSet& live;            // what this step simulates
    std::span<const double> settings; // of an effect of the program's own: the numbers of its keys, in their order
    double time_t1;                   // s, at the step's end
    EffectCounts& counts;
    std::size_t added = 0; // of an effect of the program's own: which of SceneModel::effects.added, and of State::effects, it is
};

/// What effects do to the tissue of one body in a step; they add to it.
struct TissueLoads {
    Vec3 acceleration = Vec3::Zero();  // m/s^2, of every node
    std::vector<Vec3>& pinned_target;  // [pinned_count] m, where held nodes are at the step's end; empty: they stay
    std::vector<Vec3>& force;          // [node_count] N, at the step's start; empty: none
    std::vector<Vec3>& force_rate;     // [node_count] N/s, all through the step; empty: forces are constant
    std::vector<fem::FacePressure>& pressures; // as the faces stand in every sub-step
    fem::ContactSprings& springs;      // besides contact's; integrated with the tissue
};

/// The same of an instrument's rod.
struct RodLoads {
    Vec3 acceleration = Vec3::Zero(); // m/s^2, of every node
    double friction = 0.0;            // Coulomb mu, against every wall
    std::vector<fem::RodFlow>& flow;  // [node_count] of the fluid around it; empty: none
    std::vector<Vec3>& force;         // [node_count] N, constant over the step; empty: none
    fem::RodTipLoad tip = {};         // on top of that
    std::vector<Vec3>& scratch;       // of the effects, for each lumen one
};

/// What `explain` says: does it run in this scene, and with what, or why not?
struct EffectLine {
    bool runs = false;
    std::string why;
};

/// Functions that are null do nothing.
struct EffectDescriptor {
    std::string_view name;  // key under "effects" of a scene
    std::string_view label; // for people: the viewer's switch
    std::string_view doc;   // of the key, for schema and docs/scene.md
    /// Keys of its object, all of them numbers, vectors, or choices (of which the first is the default) with defaults, for effects of the program's own; `true` in a scene takes the
    /// defaults. Empty: a flag.
    std::vector<FieldSpec> settings = {};

    /// Has the model the effect, and a body or an instrument that it acts on? Null: of an effect of the program's own, if the scene names it.
    bool (*acts_on)(const SceneModel&) = nullptr;
    /// What preparing the same scene without the effect gives.
    void (*remove)(SceneModel&) = nullptr;
    EffectLine (*explain)(const Scene&, const SceneModel&) = nullptr;
    /// What of it a step runs under a budget of nothing, and what bounds that, for `explain`. Null: nothing that a budget for collision pays for.
    std::string (*floor)(const SceneModel&) = nullptr;

    /// What a step simulates where the effect is there by a share in [0, 1] only; null: it is fixed for a run.
    void (*scale)(EffectSet&, double share) = nullptr;
    bool fades = false;  // switched at once it would throw something: a switch takes a second
    bool in_step = true; // some of its code runs in steps

    /// Numbers that it keeps in the State from step to step (State::effects), 0 at the start; after prepare. Null: none.
    std::size_t (*memory)(const SceneModel&) = nullptr;
    /// After bodies and instruments have been prepared.
    Result<void> (*prepare)(const EffectPreparation&) = nullptr;
    void (*load_tissue)(const EffectStep&, std::size_t body, const State&, TissueLoads&) = nullptr;
    void (*load_rod)(const EffectStep&, std::size_t instrument, State&, RodLoads&) = nullptr;
    /// After embedded and kinematic surfaces have moved.
    void (*move_surface)(const EffectStep&, std::size_t body, std::span<Vec3> surface) = nullptr;
};

} // namespace trocar::engine
