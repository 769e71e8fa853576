// Contact of a rod with planes as constraints: 0 <= force, gap >= 0, one of them zero, and Coulomb's cone for what slides.
//
// This work is based on:
//   Alart & Curnier 1991, "A mixed formulation for frictional contact problems prone to Newton like solution methods" (augmented
//   Lagrangian, semi-smooth Newton).
//   Simo & Laursen 1992, "An augmented Lagrangian treatment of contact problems involving friction" (friction as return mapping).
// Each plane keeps a multiplier, the force that it was left with: force = max(0, multiplier + k depth), friction = multiplier - k slide,
// cut to the cone. The multipliers take over these forces between Newton iterations, so that depth and slide of what holds go to zero
// whatever k is: a held place does not creep. A plane touches two neighbouring nodes: the matrix stays a band, O(n) for any number of
// planes. With torsion the place that slides is on the rod's surface: one cone for what slides along it and around it.
// Deviations: the cone's size is the normal multiplier, lagged by an iteration (Tresca's friction, iterated), so that the matrix is
// symmetric; the rod's tangent and the plane's normal are those of the sub-step's start.
#pragma once

#include "fem/rod/rod_model.hpp"
#include "fem/rod/rod_parts.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

/// [-] augmentation, of the rod's own stiffness against what is pressed across it, and of a segment against what drags along it: fewer
/// iterations when larger, until what opens and closes by turns does not settle. The answer does not depend on it.
inline constexpr double kPressAugmentation = 30.0, kHoldAugmentation = 3.0;

class RodContact {
public:
    /// twists   the rod has angles, and rolls on what it touches
    RodContact(const RodModel& model, const RodState& state, const RodDrive& drive, std::span<RodPlane> planes, double dt, Index first,
               bool twists, RodWorkspace& workspace) noexcept
        : model_(model), state_(state), drive_(drive), planes_(planes), dt_(dt), first_(first), twists_(twists), work_(workspace) {
        begin();
    }

    [[nodiscard]] std::span<RodPlane> planes() const noexcept { return planes_; }
    [[nodiscard]] RodPress& press(std::size_t k) noexcept { return work_.presses[k]; }

    /// Forces and stiffness of every plane where the rod is now.
    void evaluate() noexcept {
        for (std::size_t k = 0; k < planes_.size(); ++k) evaluate(planes_[k], work_.presses[k]);
    }

    /// The multipliers become the forces. Returns how far the worst of them was off, N.
    double update() noexcept {
        double change = 0.0;
        for (std::size_t k = 0; k < planes_.size(); ++k) {
            RodPress& press = work_.presses[k];
            const Vec3 aside = planes_[k].drag - press.drag;
            change = std::max({change, std::abs(planes_[k].force - press.force), std::sqrt(aside.squaredNorm())});
            press.force = planes_[k].force;
            press.drag = planes_[k].drag;
        }
        return change;
    }

    /// N, of the normal forces.
    [[nodiscard]] double largest_force() const noexcept {
        double largest = 0.0;
        for (const RodPlane& plane : planes_) largest = std::max(largest, plane.force);
        return largest;
    }

    [[nodiscard]] Vec3 force(std::size_t k) const noexcept { return planes_[k].force * planes_[k].normal + planes_[k].drag; }
    /// m/rad, around the rod: how its surface at the plane moves as it turns.
    [[nodiscard]] Vec3 roll(const RodPlane& plane) const noexcept {
        return -model_.design.radius * work_.tangent[plane.node].cross(plane.normal);
    }

private:
    void begin() noexcept {
        if (work_.presses.size() < planes_.size()) work_.presses.resize(planes_.size()); // never shrinks
        double across = 0.0, along = 0.0;
        for (std::size_t i = std::max<std::size_t>(first_, 1); i < model_.node_count(); ++i) {
            along = std::max(along, model_.stretch_stiffness[i - 1]);
            if (i + 1 == model_.node_count()) continue;
            const double turn = bend_stencil(model_, i)[1];
            across = std::max(across, 1.5 * model_.bending_of(i) * turn * turn + model_.mass[i] / (dt_ * dt_));
        }
        across_ = kPressAugmentation * across;
        along_ = kHoldAugmentation * along;
        for (std::size_t k = 0; k < planes_.size(); ++k) {
            const RodPlane& plane = planes_[k];
            work_.presses[k] = {plane.force, plane.drag - plane.normal.dot(plane.drag) * plane.normal};
        }
    }

    [[nodiscard]] static Vec3 point(const RodPlane& plane, const std::vector<Vec3>& position) noexcept {
        return (1.0 - plane.weight) * position[plane.node] + plane.weight * position[plane.node + 1];
    }
    [[nodiscard]] static double mean(const RodPlane& plane, const std::vector<double>& value) noexcept {
        return (1.0 - plane.weight) * value[plane.node] + plane.weight * value[plane.node + 1];
    }

    /// m; of the rod's surface on the wall since the sub-step's start.
    [[nodiscard]] Vec3 slide(const RodPlane& plane) const noexcept {
        Vec3 moved = point(plane, state_.position) - point(plane, work_.start) - dt_ * plane.wall_velocity;
        moved -= plane.normal.dot(moved) * plane.normal;
        if (twists_) moved += (mean(plane, state_.angle) - mean(plane, work_.start_angle)) * roll(plane);
        return moved;
    }

    void evaluate(RodPlane& plane, RodPress& press) const noexcept {
        const double depth = plane.offset - plane.normal.dot(point(plane, state_.position));
        const double yields = 1.0 + across_ / drive_.contact_stiffness;
        plane.force = std::max(0.0, (press.force + across_ * depth) / yields);
        press.stiffness = plane.force > 0.0 ? across_ / yields : 0.0;
        plane.drag.setZero();
        press.aside.setZero();
        const double bound = drive_.friction * plane.friction_share * press.force;
        if (!(bound > 0.0)) return;
        plane.drag = press.drag - along_ * slide(plane);
        const double trial = std::sqrt(plane.drag.squaredNorm());
        press.aside = along_ * (Mat3::Identity() - plane.normal * plane.normal.transpose());
        if (trial <= bound) return; // it holds
        plane.drag *= bound / trial;
        press.aside = bound / trial * (press.aside - along_ / (bound * bound) * plane.drag * plane.drag.transpose());
    }

    const RodModel& model_;
    const RodState& state_;
    const RodDrive& drive_;
    std::span<RodPlane> planes_;
    double dt_;
    Index first_;
    bool twists_;
    RodWorkspace& work_;
    double across_ = 0.0, along_ = 0.0; // N/m, augmentation
};

} // namespace trocar::fem
