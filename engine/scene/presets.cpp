#include "engine/scene/presets.hpp"

#include <array>

namespace trocar::engine {
namespace {

struct Preset {
    std::string_view name;
    fem::Material (*make)();
};

constexpr double kFibreDegree = 3.14159265358979323846 / 180.0;

/// Their constants are of psi = c / 2 (I1 - 3) + k1 / (2 k2) sum (exp(k2 (I4 - 1)^2) - 1), carotid artery of a rabbit; c is the ground's
/// mu.
fem::Material make_artery(double c, double k1, double k2, double degrees) {
    fem::Material m{.law = fem::MaterialLaw::Hgo, .poisson_ratio = 0.49, .density = 1100.0};
    m.young_modulus = 2.0 * (1.0 + m.poisson_ratio) * c;
    m.k1 = k1;
    m.k2 = k2;
    m.fibre_axis = Vec3::UnitZ();
    m.fibre_angle = degrees * kFibreDegree;
    return m;
}

/// One term in the form psi = 2 mu / alpha^2 (l1^alpha + l2^alpha + l3^alpha - 3), whose mu is the shear modulus.
fem::Material make_ogden(double mu, double alpha, double density) {
    fem::Material m{.law = fem::MaterialLaw::Ogden, .poisson_ratio = 0.49, .density = density};
    m.mu1 = 2.0 * mu / alpha;
    m.alpha1 = alpha;
    return m;
}

/// Its constants are of the shear modulus at once, 842 Pa, of which 0.450 relaxes in 0.5 s and 0.365 in 50 s.
fem::Material make_brain() {
    constexpr double kInTheEnd = 1.0 - 0.450 - 0.365;
    fem::Material m = make_ogden(kInTheEnd * 842.0, -4.7, 1040.0);
    m.g1 = 0.450 / kInTheEnd, m.tau1 = 0.5;
    m.g2 = 0.365 / kInTheEnd, m.tau2 = 50.0;
    return m;
}

/// Of psi = c10 (I1 - 3).
fem::Material make_neo_hookean(double c10, double density) {
    return {.law = fem::MaterialLaw::MooneyRivlin, .poisson_ratio = 0.49, .density = density, .c10 = c10};
}

constexpr std::array kPresets = {
    Preset{"artery_media", [] { return make_artery(3000.0, 2363.2, 0.8393, 29.0); }},
    Preset{"artery_adventitia", [] { return make_artery(300.0, 562.0, 0.7112, 62.0); }},
    Preset{"brain", make_brain},
    Preset{"liver", [] { return make_neo_hookean(2040.0 / (4.0 * 1.49), 1060.0); }}, // of a Young's modulus of 2.04 kPa
    Preset{"muscle", [] { return make_neo_hookean(2750.0, 1060.0); }},               // in the middle of 1.75 to 3.75 kPa
    Preset{"fat", [] { return make_ogden(400.0, 23.0, 920.0); }},
};

} // namespace

std::vector<std::string_view> preset_names() {
    std::vector<std::string_view> names;
    for (const Preset& preset : kPresets) names.push_back(preset.name);
    return names;
}

std::optional<fem::Material> find_preset(std::string_view name) noexcept {
    for (const Preset& preset : kPresets)
        if (preset.name == name) return preset.make();
    return std::nullopt;
}

} // namespace trocar::engine
