// What X-rays are attenuated by: mass attenuation coefficients at one photon energy, and densities.
#pragma once

#include "engine/scene/scene.hpp"

#include <string_view>

namespace trocar::engine {

/// keV, the photons' energy: about the mean of an 80 to 100 kV spectrum behind its filter.
inline constexpr double kXrayEnergy = 60.0;

struct XrayCoefficient {
    std::string_view name;
    double mass_attenuation; // m^2/kg, at kXrayEnergy
    double density;          // kg/m^3
    [[nodiscard]] double linear() const noexcept { return mass_attenuation * density; } // 1/m
};

/// quoted    Hubbell & Seltzer, NISTIR 5632 (NIST Standard Reference Database 126), tables 3 and 4 at 60 keV, cm^2/g times 0.1: soft
///           tissue, blood and cortical bone of ICRU 44, nickel 1.512, titanium 0.7661, iron 1.205, iodine 7.579. Nitinol is 55.8 % nickel
///           by weight; its and steel's density are the makers', soft tissue's and blood's 1060 kg/m^3
[[nodiscard]] const XrayCoefficient& coefficient_of(XrayMatter matter) noexcept;

/// m^2/kg of iodine: contrast agent adds this times its iodine per volume.
inline constexpr double kIodineAttenuation = 0.7579;

} // namespace trocar::engine
