// Where an X-ray source and its detector stand, by the angles of a C-arm. docs/fluoroscopy.md draws it.
//
// World: RAS. +x patient's right, +y anterior, +z head. At 0/0 the source is behind the patient and the detector in front of it; the
// picture is seen from the detector: columns run to the patient's left, rows to the feet.
#pragma once

#include "engine/scene/scene.hpp"

#include <Eigen/Core>

namespace trocar::engine {

/// Metres to pixels: (u, v, 1) ~ P (x, y, z, 1). u runs right, v down, the first pixel's centre is (0.5, 0.5).
using XrayProjection = Eigen::Matrix<double, 3, 4>;

/// A pinhole: all rays start at the source.
struct ConeBeam {
    Vec3 source = Vec3::Zero();                           // m, in the patient's frame
    Vec3 right = Vec3::Zero(), down = Vec3::Zero();       // unit, along a detector row and column
    Vec3 along = Vec3::Zero();                            // unit, from the source to the detector's centre
    double sid = 1.0;                                     // m
    std::array<double, 2> pitch{};                        // m, of a pixel on the detector
    std::array<unsigned, 2> pixels{};                     // columns, rows

    [[nodiscard]] XrayProjection projection() const noexcept;
    /// [-] of a ray through this place on the picture: its length over its length along the axis.
    [[nodiscard]] double obliquity(double u, double v) const noexcept;
};

struct ArmAngles {
    double primary = 0.0, secondary = 0.0; // rad
};

/// Where the arm stands at that time.
[[nodiscard]] ArmAngles find_angles(const XrayView& view, double time) noexcept;

/// source    DICOM PS3.3 C.8.7.5.1.2: positioner primary angle + towards the patient's left (LAO), secondary + towards the head (CRA)
[[nodiscard]] ConeBeam make_cone_beam(const XrayView& view, const ArmAngles& angles) noexcept;

/// Pixels; none where the point does not lie before the source.
[[nodiscard]] std::optional<std::array<double, 2>> project(const XrayProjection& projection, const Vec3& point) noexcept;

} // namespace trocar::engine
