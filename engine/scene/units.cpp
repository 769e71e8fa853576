#include "engine/scene/units.hpp"

#include <array>

namespace trocar::engine {
namespace {

constexpr std::array kLength = {UnitName{"m", 1.0}, UnitName{"cm", 1e-2}, UnitName{"mm", 1e-3}, UnitName{"um", 1e-6},
                                UnitName{"in", 0.0254}};
constexpr std::array kTime = {UnitName{"s", 1.0}, UnitName{"ms", 1e-3}, UnitName{"min", 60.0}};
constexpr std::array kAngle = {UnitName{"rad", 1.0}, UnitName{"deg", 3.14159265358979323846 / 180.0}};
constexpr std::array kPressure = {UnitName{"Pa", 1.0},  UnitName{"kPa", 1e3},    UnitName{"MPa", 1e6},
                                  UnitName{"GPa", 1e9}, UnitName{"N/mm^2", 1e6}, UnitName{"mmHg", 133.322387415}};
constexpr std::array kDensity = {UnitName{"kg/m^3", 1.0}, UnitName{"g/cm^3", 1e3}, UnitName{"g/mm^3", 1e6}, UnitName{"kg/mm^3", 1e9},
                                 UnitName{"t/mm^3", 1e12}};
constexpr std::array kForce = {UnitName{"N", 1.0}, UnitName{"mN", 1e-3}, UnitName{"kN", 1e3}};

} // namespace

double Units::factor(Dimension dimension) const noexcept {
    switch (dimension) {
    case Dimension::None:
        return 1.0;
    case Dimension::Length:
        return length;
    case Dimension::Volume:
        return length * length * length;
    case Dimension::Time:
        return time;
    case Dimension::Rate:
        return 1.0 / time;
    case Dimension::Speed:
        return length / time;
    case Dimension::Acceleration:
        return length / (time * time);
    case Dimension::Angle:
        return angle;
    case Dimension::AngularSpeed:
        return angle / time;
    case Dimension::Pressure:
        return pressure;
    case Dimension::Viscosity:
        return pressure * time;
    case Dimension::Density:
        return density;
    case Dimension::Force:
        return force;
    case Dimension::Stiffness:
        return force / length;
    case Dimension::Torque:
        return force * length;
    }
    return 1.0;
}

std::string Units::name(Dimension dimension) const {
    switch (dimension) {
    case Dimension::None:
        return "";
    case Dimension::Length:
        return length_name;
    case Dimension::Volume:
        return length_name + "^3";
    case Dimension::Time:
        return time_name;
    case Dimension::Rate:
        return "1/" + time_name;
    case Dimension::Speed:
        return length_name + "/" + time_name;
    case Dimension::Acceleration:
        return length_name + "/" + time_name + "^2";
    case Dimension::Angle:
        return angle_name;
    case Dimension::AngularSpeed:
        return angle_name + "/" + time_name;
    case Dimension::Pressure:
        return pressure_name;
    case Dimension::Viscosity:
        return pressure_name + " " + time_name;
    case Dimension::Density:
        return density_name;
    case Dimension::Force:
        return force_name;
    case Dimension::Stiffness:
        return force_name + "/" + length_name;
    case Dimension::Torque:
        return force_name + " " + length_name;
    }
    return "";
}

std::span<const UnitName> known_units(Dimension dimension) noexcept {
    switch (dimension) {
    case Dimension::Length:
        return kLength;
    case Dimension::Time:
        return kTime;
    case Dimension::Angle:
        return kAngle;
    case Dimension::Pressure:
        return kPressure;
    case Dimension::Density:
        return kDensity;
    case Dimension::Force:
        return kForce;
    default:
        return {};
    }
}

std::optional<double> find_unit(Dimension dimension, std::string_view name) noexcept {
    for (const UnitName& unit : known_units(dimension))
        if (unit.name == name) return unit.factor;
    return std::nullopt;
}

} // namespace trocar::engine
