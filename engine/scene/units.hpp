// Units a scene may declare, and the physical dimensions its numbers have. Everything becomes SI when the scene is
// read.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trocar::engine {

enum class Dimension : std::uint8_t {
    None,         // ratios, counts, directions
    Length,       // m
    Volume,       // m^3
    Time,         // s
    Rate,         // 1/s
    Speed,        // m/s
    Acceleration, // m/s^2
    Angle,        // rad
    AngularSpeed, // rad/s
    Pressure,     // Pa
    Viscosity,    // Pa s
    Density,      // kg/m^3
    Force,        // N
    Stiffness,    // N/m
    Torque,       // N m
};

/// What a scene's numbers are measured in: factors to SI, and the names the scene used.
struct Units {
    double length = 1.0;   // m
    double time = 1.0;     // s
    double angle = 1.0;    // rad
    double pressure = 1.0; // Pa
    double density = 1.0;  // kg/m^3
    double force = 1.0;    // N
    std::string length_name = "m", time_name = "s", angle_name = "rad", pressure_name = "Pa", density_name = "kg/m^3", force_name = "N";

    /// SI value of one unit of this dimension.
    [[nodiscard]] double factor(Dimension dimension) const noexcept;
    /// As in "mm/s"; empty for Dimension::None.
    [[nodiscard]] std::string name(Dimension dimension) const;
};

/// A unit by name: what a scene may write under "units".
struct UnitName {
    std::string_view name;
    double factor; // to SI
};

/// Known units of Length, Time, Angle, Pressure, Density or Force. Empty for the others: they follow from these.
[[nodiscard]] std::span<const UnitName> known_units(Dimension dimension) noexcept;

/// Factor to SI of a unit written under "units"; nothing where it is unknown.
[[nodiscard]] std::optional<double> find_unit(Dimension dimension, std::string_view name) noexcept;

} // namespace trocar::engine
