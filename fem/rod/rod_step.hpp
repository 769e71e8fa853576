// One implicit Euler step of the rod by Newton's method: inertia, drag, stretch, bending and the planes that hold it.
#pragma once

#include "fem/rod/rod_band.hpp"
#include "fem/rod/rod_model.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::fem {

/// Newton iterations of one sub-step at most: contacts that come and go settle in 3 to 8.
inline constexpr unsigned kMaxNewton = 12;
/// Damped iterations after those, where they did not end: contacts that open each other in turn converge. Without them the result
/// is not in equilibrium, and shows contact forces a hundred times those of the neighbouring steps.
inline constexpr unsigned kMaxDamped = 36;
inline constexpr double kDamping = 0.5; // [-] of a damped correction
/// m; a Newton correction below this ends the iteration: a thousandth of a skin's clearance.
inline constexpr double kNewtonTolerance = 1e-7;
/// m; no node moves further in one Newton iteration: keeps the linearised stretch valid.
inline constexpr double kTrustRadius = 2e-3;
/// m/s; below this sliding speed friction grows linearly instead of jumping, so a stuck rod creeps by at most this.
inline constexpr double kStickSpeed = 1e-3;
/// m/s; the same with torsion: at a rod's radius the other bound would let it turn by radians a second.
inline constexpr double kTwistStickSpeed = 1e-4;

[[nodiscard]] inline double damped_mass(const RodModel& model, std::size_t i, double dt) noexcept {
    return model.mass[i] / (dt * dt) * (1.0 + model.design.drag * dt);
}

/// One implicit Euler step: the nodes from `first` on move, those before it are where the port put them.
class RodStep {
public:
    /// share  of the segment behind `first`, see inserted_share
    RodStep(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes, double dt, Index first, double share,
            RodWorkspace& workspace, RodTwist* twist = nullptr) noexcept
        : model_(model), state_(state), drive_(drive), planes_(planes), dt_(dt), first_(first), share_(share), work_(workspace),
          twist_(twist) {}

    /// Returns the largest correction of the last iteration.
    double solve(RodReport& report) noexcept {
        double correction = 0.0, farthest_sq = 0.0;
        for (unsigned iteration = 0; iteration < kMaxNewton + kMaxDamped; ++iteration) {
            farthest_sq = std::max(farthest_sq, farthest_from_start_sq());
            correction = newton_iteration(iteration < kMaxNewton ? 1.0 : kDamping);
            if (twist_ != nullptr) correction = std::max(correction, twist_->turn());
            ++report.iterations;
            if (!(correction > kNewtonTolerance)) break;
        }
        report.farthest_m += std::sqrt(farthest_sq); // a sub-step's on top of those before it
        return correction;
    }

private:
    double newton_iteration(double share) noexcept {
        const std::size_t moving = model_.node_count() - first_;
        RodBand band(work_.band, moving);
        std::fill_n(work_.rhs.begin(), 3 * moving, 0.0);
        add_inertia(band);
        add_stretch(band);
        add_bending(band);
        if (twist_ != nullptr) add_twist(band);
        if (!drive_.flow.empty()) add_flow(band);
        for (RodPlane& plane : planes_) add_plane(band, plane);
        band.solve(std::span(work_.rhs).first(3 * moving));
        return apply_correction(moving, share);
    }

    [[nodiscard]] double farthest_from_start_sq() const noexcept {
        double farthest_sq = 0.0;
        for (std::size_t i = first_; i < model_.node_count(); ++i)
            farthest_sq = std::max(farthest_sq, (state_.position[i] - work_.start[i]).squaredNorm());
        return farthest_sq;
    }

    [[nodiscard]] bool moves(std::size_t node) const noexcept { return node >= first_; }
    /// Of what node i and the segment after it stand for.
    [[nodiscard]] double share_of(std::size_t i) const noexcept { return i + 1 == first_ ? share_ : 1.0; }

    void push(std::size_t node, const Vec3& force) noexcept {
        if (!moves(node)) return;
        for (int axis = 0; axis < 3; ++axis) work_.rhs[3 * (node - first_) + std::size_t(axis)] += force[axis];
    }
    template <class Stiffness>
    void stiffen(RodBand& band, std::size_t i, std::size_t j, const Stiffness& value) noexcept {
        if (moves(i) && moves(j)) band.add(i - first_, j - first_, value);
    }

    void add_inertia(RodBand& band) noexcept {
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const double mass = damped_mass(model_, i, dt_);
            const Vec3 moved = state_.position[i] - work_.start[i];
            push(i, model_.mass[i] * (state_.velocity[i] / dt_ + drive_.gravity) - mass * moved);
            if (!drive_.force.empty()) push(i, drive_.force[i]);
            stiffen(band, i, i, mass);
            const double whip = model_.design.transverse_drag * model_.segment / dt_;
            const Mat3 across = Mat3::Identity() - work_.tangent[i] * work_.tangent[i].transpose();
            push(i, -whip * (across * moved));
            stiffen(band, i, i, Mat3(whip * across));
        }
    }

    void add_stretch(RodBand& band) noexcept {
        for (std::size_t i = first_ > 0 ? first_ - 1 : 0; i + 1 < model_.node_count(); ++i) {
            const Vec3 edge = state_.position[i + 1] - state_.position[i];
            const double length = std::sqrt(edge.squaredNorm());
            if (!(length > 0.0)) continue;
            const Vec3 along = edge / length;
            const double k = model_.stretch_stiffness[i] / share_of(i);
            const double rest = rest_length(model_, i);
            const Vec3 tension = k * (length - rest) * along;
            push(i, tension);
            push(i + 1, -tension);
            // Under compression the transverse part would make the matrix indefinite: it is left out (Baraff & Witkin).
            const double transverse = std::max(0.0, 1.0 - rest / length);
            const Mat3 axial = along * along.transpose();
            const Mat3 hessian = k * (axial + transverse * (Mat3::Identity() - axial));
            stiffen(band, i, i, hessian);
            stiffen(band, i + 1, i + 1, hessian);
            stiffen(band, i + 1, i, Mat3(-hessian));
        }
    }

    void add_bending(RodBand& band) noexcept {
        const bool uniform = model_.rest_length.empty();
        for (std::size_t i = std::max<std::size_t>(first_, 2) - 1; i + 1 < model_.node_count(); ++i) {
            const double share = share_of(i); // nodes that have not passed the port neither bend nor have a rest curvature
            const double k = model_.bending_of(i) / share;
            const std::array<double, 3> weight = bend_stencil(model_, i);
            const Vec3 bend = uniform ? second_difference(state_.position, i) : unit_change(i, weight);
            const Vec3 moment = k * (bend - share * work_.rest_bend[i]);
            for (std::size_t a = 0; a < 3; ++a) {
                push(i - 1 + a, -weight[a] * moment);
                for (std::size_t b = 0; b <= a; ++b) stiffen(band, i - 1 + a, i - 1 + b, k * weight[a] * weight[b]);
            }
        }
    }

    [[nodiscard]] Vec3 unit_change(std::size_t i, const std::array<double, 3>& weight) const noexcept {
        return weight[0] * state_.position[i - 1] + weight[1] * state_.position[i] + weight[2] * state_.position[i + 1];
    }

    /// Bending twists a rod that is not straight, and a twisted rod bends. The stiffness is no less than the
    /// true one, of which a node's neighbours have a share. Clears the planes' torques on the angles.
    void add_twist(RodBand& band) noexcept {
        twist_->find_writhe();
        for (std::size_t i = std::max<std::size_t>(first_, 2) - 1; i + 1 < model_.node_count(); ++i) {
            const std::array<Vec3, 3> weight = twist_->gradient(i);
            const double torque = twist_->torque_at(i), k = twist_->stiffness_at(i);
            for (std::size_t a = 0; a < 3; ++a) {
                push(i - 1 + a, -torque * weight[a]);
                for (std::size_t b = 0; b <= a; ++b) stiffen(band, i - 1 + a, i - 1 + b, Mat3(k * weight[a] * weight[b].transpose()));
            }
        }
        for (std::size_t i = first_ > 0 ? first_ - 1 : 0; i < model_.node_count(); ++i) work_.grip[i] = work_.push[i] = 0.0;
    }

    /// m of rod beyond the port that node i stands for.
    [[nodiscard]] double length_of(std::size_t i) const noexcept {
        const double before = i > 0 ? share_of(i - 1) * rest_length(model_, i - 1) : 0.0;
        return 0.5 * (before + (i + 1 < model_.node_count() ? rest_length(model_, i) : 0.0));
    }

    /// Drag of the fluid; the speed in its square is that of the last iteration.
    void add_flow(RodBand& band) noexcept {
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const RodFlow& flow = drive_.flow[i];
            const Vec3& tangent = work_.tangent[i];
            const Vec3 slip = dt_ * flow.velocity - (state_.position[i] - work_.start[i]);
            const Vec3 along = slip.dot(tangent) * tangent, across = slip - along;
            const double share = length_of(i) / dt_;
            const double k = 2.0 * flow.viscous + flow.form * std::sqrt(across.squaredNorm()) / dt_;
            push(i, share * (flow.viscous * along + k * across));
            const Mat3 axial = tangent * tangent.transpose();
            stiffen(band, i, i, Mat3(share * (flow.viscous * axial + k * (Mat3::Identity() - axial))));
        }
    }

    /// m; how far the rod's surface at the plane has rolled across it in this sub-step, as the angles are now.
    [[nodiscard]] Vec3 rolled(const RodPlane& plane) const noexcept {
        if (twist_ == nullptr) return Vec3::Zero();
        const double before = (1.0 - plane.weight) * work_.start_angle[plane.node] + plane.weight * work_.start_angle[plane.node + 1];
        const double now = (1.0 - plane.weight) * state_.angle[plane.node] + plane.weight * state_.angle[plane.node + 1];
        return (before - now) * model_.design.radius * work_.tangent[plane.node].cross(plane.normal);
    }

    /// Friction on the surface turns the rod: `grip` resists a change of angle, `push` turns it as the rod slides sideways.
    void add_grip(const RodPlane& plane, const Vec3& slide, double viscous) noexcept {
        if (twist_ == nullptr) return;
        const double radius = model_.design.radius;
        const double torque = radius * viscous * work_.tangent[plane.node].dot(plane.normal.cross(slide));
        for (std::size_t a = 0; a < 2; ++a) {
            const double weight = a == 0 ? 1.0 - plane.weight : plane.weight;
            work_.grip[plane.node + a] += weight * radius * radius * viscous;
            work_.push[plane.node + a] += weight * torque;
        }
    }

    void add_plane(RodBand& band, RodPlane& plane) noexcept {
        const std::size_t node[2] = {plane.node, plane.node + 1};
        const double weight[2] = {1.0 - plane.weight, plane.weight};
        const Vec3 point = weight[0] * state_.position[node[0]] + weight[1] * state_.position[node[1]];
        const double depth = plane.offset - plane.normal.dot(point);
        plane.force = 0.0;
        plane.drag.setZero();
        if (!(depth > 0.0)) return;
        plane.force = drive_.contact_stiffness * depth;
        Mat3 stiffness = drive_.contact_stiffness * plane.normal * plane.normal.transpose();
        Vec3 force = plane.force * plane.normal;
        if (drive_.friction > 0.0) {
            const Mat3 tangential = Mat3::Identity() - plane.normal * plane.normal.transpose();
            const Vec3 start = weight[0] * work_.start[node[0]] + weight[1] * work_.start[node[1]];
            Vec3 slide = tangential * (point - start - dt_ * plane.wall_velocity);
            const Vec3 moved = slide;
            if (twist_ != nullptr) slide += rolled(plane);
            const double speed = std::sqrt(slide.squaredNorm()) / dt_;
            // Coulomb's force opposes the sliding of this step; its coefficient is lagged by one iteration.
            const double viscous = drive_.friction * plane.friction_share * plane.force /
                                   (std::max(speed, twist_ != nullptr ? kTwistStickSpeed : kStickSpeed) * dt_);
            plane.drag = -viscous * slide;
            add_grip(plane, moved, viscous);
            force += plane.drag;
            stiffness += viscous * tangential;
        }
        for (int a = 0; a < 2; ++a) {
            push(node[a], weight[a] * force);
            for (int b = 0; b <= a; ++b) stiffen(band, node[a], node[b], Mat3(weight[a] * weight[b] * stiffness));
        }
    }

    double apply_correction(std::size_t moving, double share) noexcept {
        double largest = 0.0;
        for (std::size_t i = 0; i < moving; ++i) {
            const Vec3 delta(work_.rhs[3 * i], work_.rhs[3 * i + 1], work_.rhs[3 * i + 2]);
            largest = std::max(largest, std::sqrt(delta.squaredNorm()));
        }
        const double scale = share * (largest > kTrustRadius ? kTrustRadius / largest : 1.0);
        for (std::size_t i = 0; i < moving; ++i)
            for (int axis = 0; axis < 3; ++axis) state_.position[i + first_][axis] += scale * work_.rhs[3 * i + std::size_t(axis)];
        return largest;
    }

    const RodModel& model_;
    RodState& state_;
    const RodDrive& drive_;
    std::span<RodPlane> planes_;
    double dt_;
    Index first_;
    double share_;
    RodWorkspace& work_;
    RodTwist* twist_; // nullptr: no torsion
};

} // namespace trocar::fem
