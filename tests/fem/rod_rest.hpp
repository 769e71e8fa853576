// Rods at rest: straight designs whose steps are only there to find the place of least energy.
#pragma once

#include "fem/rod/rod.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::fem::test {

/// A straight rod of one modulus that nothing slows down: long implicit steps bring it to rest in a few.
inline RodDesign bare_design(double length, double segment) {
    RodDesign design;
    design.length = length;
    design.segment = segment;
    design.tip = TipShape::Straight;
    design.tip_stiffness = 1.0;
    design.drag = 0.0;
    design.transverse_drag = 0.0;
    return design;
}

inline double bending_stiffness(const RodDesign& design) { // N m^2
    return design.young_modulus * 0.25 * std::numbers::pi * std::pow(design.radius, 4);
}

/// 1/s, mass-proportional: brings a rod to rest that its own steps hardly slow down.
inline constexpr double kSettlingDrag = 40.0;

/// Steps until the rod moves less than `still` metres in one, `most` steps at most.
inline RodReport settle(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes = {}, double dt = 0.05,
                        int most = 2000, double still = 1e-11) {
    RodWorkspace workspace;
    RodReport report;
    RodModel slowed = model;
    slowed.design.drag = std::max(model.design.drag, kSettlingDrag);
    for (int k = 0; k < most; ++k) {
        const std::vector<Vec3> before = state.position;
        report = solve_rod(slowed, state, dt, 1, drive, planes, workspace);
        double moved = 0.0;
        for (std::size_t i = 0; i < before.size(); ++i) moved = std::max(moved, (state.position[i] - before[i]).norm());
        if (moved < still && k > 10) break;
    }
    return report;
}

} // namespace trocar::fem::test
