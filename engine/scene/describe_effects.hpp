// Keys of "effects" and of those that have settings of their own.
#pragma once

#include "engine/scene/describe_place.hpp"
#include "engine/scene/settings.hpp"

namespace trocar::engine {

struct BreathingKeys {
    using Struct = BreathingSpec;
    static auto of(auto& s) {
        return described(
            {"breathing", "Moves the fixed nodes of every deformable body there and back once a period."},
            key(s.amplitude, number_field("amplitude", Dimension::Length, above(0.0, 0.1), "End to end.")),
            key(s.period, number_field("period", Dimension::Time, {0.5, 60.0, false, 2.0, 10.0, "adults at rest breathe in 3 to 6 s"},
                                       "Of a breath.")),
            direction_key(s.direction, vector_field("direction", Dimension::None, {}, "Of the movement; its length does not matter.")));
    }
};
static_assert(describes_all<BreathingKeys>);

struct PulseKeys {
    using Struct = PulseSpec;
    static auto of(auto& s) {
        return described(
            {"pulse", "The walls of hollow bodies widen and narrow, along their outward normals."},
            key(s.amplitude, number_field("amplitude", Dimension::None, {0.0, 0.3, false, 0.0, 0.1, "large arteries widen by 3 to 10 %"},
                                          "Share of the local radius, from diastole to systole.")),
            key(s.period, number_field("period", Dimension::Time, {0.2, 5.0, false, 0.4, 1.5, "40 to 150 beats a minute"}, "Of a beat.")));
    }
};
static_assert(describes_all<PulseKeys>);

/// Part of the keys of BloodSpec.
struct BloodPropertyKeys {
    using Struct = Blood;
    static auto of(auto& s) {
        return described(
            {"blood", "What the blood is like."},
            key(s.density, number_field("density", Dimension::Density,
                                        {500.0, 2000.0, false, 990.0, 1080.0, "water is 993, blood 1060 kg/m^3"}, "Of the blood.")),
            key(s.viscosity, number_field("viscosity", Dimension::Viscosity,
                                          {1e-5, 1.0, false, 7e-4, 1e-2, "water is 0.7, whole blood 3 to 4 mPa s"}, "Of the blood.")),
            key(s.pulsatility,
                number_field(
                    "pulsatility", Dimension::None, between(0.0, 3.0),
                    "Share of the mean speed by which the blood is faster and slower within a beat; needs the effect pulse, and is "
                    "fastest when that has widened the walls.")),
            no_key(s.period)); // of the pulse
    }
};
static_assert(describes_all<BloodPropertyKeys>);

struct BloodKeys {
    using Struct = BloodSpec;
    static auto of(auto& s) {
        return described(
            {"blood_drag",
             "Blood flows from the inlet into every branch of the vessels that instruments move in, and drags them along. Branches share "
             "it by the cubes of their ends' radii (Murray's law); it is twice as fast in a vessel's middle as on average (Poiseuille)."},
            key(s.speed,
                number_field("speed", Dimension::Speed, {0.0, 5.0, false, 0.005, 1.5, "means are 0.1 to 0.3 m/s in large arteries"},
                             "At the inlet, mean over the cross-section and over time.")),
            inline_keys<BloodPropertyKeys>(s.blood),
            custom_key(value_field("inlet", target_value(),
                                   "Where the blood comes in. When absent: the end of the vessel behind the instrument's entry, so that it "
                                   "flows along it."),
                       read_inlet, s.inlet));
    }
};
static_assert(describes_all<BloodKeys>);

/// An effect with settings: a flag, or their object.
template <class Keys>
[[nodiscard]] FieldSpec effect_field(std::string_view key, std::string_view doc) {
    return value_field(key, any_value({flag_field("", "").value, object_value(table_of<Keys>())}), doc).by_default(false);
}

struct EffectsKeys {
    using Struct = Effects;
    static auto of(auto& s) {
        return described(
            {"effects", "What is simulated, by name; whatever is not named is off."},
            key(s.elasticity, flag_field("elasticity", "Deformable bodies deform; off, they stay at rest.")),
            key(s.gravity, flag_field("gravity", "Weight, as the key gravity says.")),
            key(s.damping, flag_field("damping", "Viscosity and mass damping of the materials.")),
            key(s.loads, flag_field("loads", "Forces, tractions, pressures and springs of the bodies' key loads.")),
            key(s.coarse_contact, flag_field("coarse_contact", "Contacts by sphere trees, interrupted by the budget.")),
            key(s.exact_contact, flag_field("exact_contact", "Continuous contacts, when the budget allows.")),
            key(s.friction, flag_field("friction", "Coulomb friction of instruments on walls, by each instrument's key friction; the wall "
                                                   "feels it too.")),
            object_key<BreathingKeys>(s.breathing, effect_field<BreathingKeys>("breathing", "Respiration: true for the defaults.")),
            object_key<PulseKeys>(s.pulse, effect_field<PulseKeys>("pulse", "Arterial pulse: true for the defaults.")),
            key(s.self_contact, flag_field("self_contact", "Solid bodies against themselves, where their leaf spheres lay apart at rest, and instruments; "
                                                           "needs coarse_contact.")),
            key(s.instrument_contact, flag_field("instrument_contact", "Instruments of one lumen against one another, side by side and crossing; needs "
                                                                       "coarse_contact.")),
            key(s.twist, flag_field("twist", "Torsion of instruments: a turn of the handle travels along them; off, it reaches the tip at "
                                             "once.")),
            object_key<BloodKeys>(s.blood_drag,
                                  effect_field<BloodKeys>("blood_drag", "Drag of the blood on instruments: true for the defaults.")),
            key(s.fluoroscopy, flag_field("fluoroscopy", "X-ray pictures.")), no_key(s.added)); // effects_table has theirs
    }
};
static_assert(describes_all<EffectsKeys>);

/// Those, and the keys of effects that are known by their descriptors alone.
[[nodiscard]] const ObjectSpec& effects_table();

} // namespace trocar::engine
