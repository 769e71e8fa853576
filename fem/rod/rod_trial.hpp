// A rod alone that comes in along x at the origin: what validation.cpp tries. None of it is part of a step.
#pragma once

#include "base/trig.hpp"
#include "fem/rod/rod.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace trocar::fem {

struct RodTrial {
    RodModel model;
    RodDrive drive;
    RodState state;
    RodWorkspace work;
    std::vector<Vec3> force; // [node_count] N
    std::vector<RodPlane> planes;
    double bending = 0.0, twisting = 0.0; // N m^2: E I, G J

    /// Straight and at rest, `length` metres in `segments` segments beyond the port, in which a node stands; radius m.
    RodTrial(double length, int segments, double radius, bool torsion = false, double drag = 40.0) {
        RodDesign design;
        design.segment = length / segments;
        design.length = (segments + 4) * design.segment;
        design.radius = radius;
        design.tip = TipShape::Straight;
        design.tip_stiffness = 1.0;
        design.drag = drag;
        design.transverse_drag = 0.0;
        design.torsion = torsion;
        model = make_rod_model(design).value();
        bending = design.young_modulus * 0.25 * std::numbers::pi * std::pow(radius, 4);
        twisting = bending / (1.0 + design.poisson_ratio);
        drive.port = {Vec3::Zero(), Vec3::UnitX()};
        insert((segments - 1e-9) * model.segment);
        force.assign(model.node_count(), Vec3::Zero());
    }

    /// Straight, so far; m
    void insert(double length) {
        drive.insertion = length;
        place_rod(model, drive.port, length, 0.0, state);
    }

    /// N m^2, N, N m^2
    void set_stiffness(double bend, double stretch, double twist) {
        for (double& k : model.bend_stiffness)
            if (k > 0.0) k = bend / std::pow(model.segment, 3);
        for (double& k : model.stretch_stiffness) k = stretch / model.segment;
        for (double& k : model.twist_stiffness) k = twist / model.segment;
        bending = bend, twisting = twist;
    }

    [[nodiscard]] const Vec3& tip() const { return state.position.back(); }
    [[nodiscard]] Index first() const { return first_inserted_node(model, drive.insertion); }
    [[nodiscard]] double line_density() const { // kg/m
        return model.design.density * std::numbers::pi * model.design.radius * model.design.radius;
    }

    /// Evenly, by `turn` rad to the middle of the last segment, where a clamp's hold ends.
    void wind(double turn) {
        const double end = drive.insertion - 0.5 * model.segment;
        for (std::size_t i = first(); i < state.angle.size(); ++i) state.angle[i] = turn * std::min(1.0, state.position[i].x() / end);
    }
    void clamp_tip(const Vec3& position, const Vec3& direction, double turn) {
        drive.clamp = RodClamp{};
        drive.clamp->position = position;
        drive.clamp->direction = direction;
        drive.clamp->axis = rotation_about(direction, turn) * perpendicular_axis(direction);
    }

    RodReport step(double dt, unsigned substeps = 1) {
        drive.force = force;
        return solve_rod(model, state, dt, substeps, drive, planes, work);
    }
    void run(double seconds, double dt) {
        for (double t = 0.0; t < seconds; t += dt) (void)step(dt);
    }
    /// Until it moves less than 1e-11 m in a step.
    void settle(int most = 2000) {
        std::vector<Vec3> before;
        for (int k = 0; k < most; ++k) {
            before = state.position;
            (void)step(0.05);
            double moved = 0.0;
            for (std::size_t i = 0; i < before.size(); ++i) moved = std::max(moved, (state.position[i] - before[i]).norm());
            if (moved < 1e-11 && k > 10) return;
        }
    }
    /// Logarithm of what `size` of a disturbance becomes over a while, after another one in which its shape settles.
    template <class Size>
    double growth(double seconds, double dt, const Size& size) {
        run(seconds, dt);
        const double early = size();
        run(seconds, dt);
        return std::log(size() / early);
    }
};

/// Where `growth` is 0: by regula falsi (Illinois). It grows from `low` to `high`.
template <class Growth>
double find_neutral(double low, double high, const Growth& growth) {
    double below = growth(low), above = growth(high), side = 0.0, at = low;
    for (int round = 0; round < 12; ++round) {
        at = (low * above - high * below) / (above - below);
        const double here = growth(at);
        if (std::abs(here) < 1e-4) break;
        if ((here > 0.0) == (above > 0.0)) {
            high = at, above = here;
            if (side > 0.0) below *= 0.5;
            side = 1.0;
        } else {
            low = at, below = here;
            if (side < 0.0) above *= 0.5;
            side = -1.0;
        }
    }
    return at;
}

} // namespace trocar::fem
