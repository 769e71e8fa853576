// One implicit Euler step of the rod by Newton's method: inertia, drag, stretch, bending, torsion and the planes that hold it.
#pragma once

#include "fem/rod/conjugate_gradients.hpp"
#include "fem/rod/rod_band.hpp"
#include "fem/rod/rod_contact.hpp"
#include "fem/rod/rod_model.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::fem {

/// Newton iterations of one sub-step at most: contacts that come and go settle in 3 to 8.
inline constexpr unsigned kMaxNewton = 48;
/// rad a segment of bend that a torque is as strong as; below it what add_curl adds is not worth its time.
inline constexpr double kWound = 0.05;
/// m; a Newton correction below this ends the iteration: a thousandth of a skin's clearance.
inline constexpr double kNewtonTolerance = 1e-7;
/// m; the same where RodDrive::rough says so, whatever the forces still change.
inline constexpr double kRoughTolerance = 1e-5;
/// Contact forces that change less than this in an iteration end it: of the largest normal force, or N.
inline constexpr double kForceTolerance = 2e-3, kLeastForce = 1e-6;
/// m; no node moves further in one Newton iteration: keeps the linearised stretch valid.
inline constexpr double kTrustRadius = 2e-3;
/// m; bounds of friction follow normal forces only where a correction was at most this large: far from balance those mean nothing.
inline constexpr double kBoundWithin = 1e-6;
/// [-] of a segment, that bends at the clamp at least: keeps the stiffness finite.
inline constexpr double kLeastBend = 1e-3;

/// kg/s^2
[[nodiscard]] inline double damped_mass(const RodModel& model, std::size_t i, double dt) noexcept {
    return model.mass[i] / (dt * dt) * (1.0 + model.design.drag * dt);
}

/// One implicit Euler step: the nodes from `first` on move, those before it are where the port put them. kCoordinates: of a node, its
/// position, and with torsion its angle.
template <std::size_t kCoordinates>
class RodStep {
public:
    static constexpr bool kTwists = kCoordinates == kTwistedCoordinates;
    using Band = RodBandOf<kCoordinates>;

    /// self   planes that places of the rod itself carry
    /// share  of the segment behind `first`, see inserted_share
    RodStep(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes, std::span<RodPlane> self, double dt,
            Index first, double share, RodWorkspace& workspace, RodTwist* twist = nullptr) noexcept
        : model_(model), state_(state), drive_(drive), dt_(dt), first_(first), held_(first_clamped_node(model, drive)), share_(share),
          allowed_(clamp_freedom(drive)), work_(workspace), twist_(twist),
          contact_(model, state, drive, planes, dt, first, kTwists, workspace, workspace.presses, workspace.near_planes),
          self_(model, state, drive, self, dt, first, kTwists, workspace, workspace.self_presses, workspace.near_self) {}

    /// Returns whether positions and contact forces settled.
    bool solve(RodReport& report) noexcept {
        double correction = 0.0, change = 0.0, farthest_sq = 0.0;
        bool settled = false;
        for (unsigned iteration = 0; iteration < kMaxNewton; ++iteration) {
            farthest_sq = std::max(farthest_sq, farthest_from_start_sq());
            if (iteration == 0) {
                contact_.evaluate_held(), self_.evaluate_held();
            } else {
                contact_.evaluate(), self_.evaluate();
                const double largest = std::max(contact_.largest_force(), self_.largest_force());
                const bool bounds = correction <= kBoundWithin;
                change = std::max(contact_.update(bounds), self_.update(bounds));
                settled = drive_.rough ? correction <= kRoughTolerance : correction <= kNewtonTolerance && change <= std::max(kForceTolerance * largest, kLeastForce);
                if (settled) break;
                if (bounds) contact_.evaluate(), self_.evaluate();
            }
            ++report.iterations;
            Band band(work_.band, moving());
            curls_ = kTwists;
            assemble(band);
            solve_band(band, report);
            if (curls_ && curled_ && !band.is_definite()) { // where it stands it would buckle: without what lets it the correction goes downhill
                curls_ = false;
                Band held(work_.band, moving());
                assemble(held);
                solve_band(held, report);
            }
            correction = apply_correction();
        }
        contact_.stay_in_cone(), self_.stay_in_cone();
        report.farthest_m += std::sqrt(farthest_sq); // a stage's on top of those before it
        report.unconverged += !settled;
        report.largest_residual = std::max(report.largest_residual, correction);
        report.force_error = std::max(report.force_error, change);
        return settled;
    }

    /// Forces as they are now, for the report.
    void balance(RodReport& report) noexcept {
        forget_balance();
        Band band(work_.band, moving());
        assemble(band);
        tell_balance(report);
    }

protected:
    void forget_balance() noexcept {
        handle_.setZero();
        body_.setZero();
        clamped_.setZero();
    }

    void tell_balance(RodReport& report) noexcept {
        report.handle_force = -handle_;
        report.clamp_force = -clamped_;
        if constexpr (kTwists) report.clamp_torque = holds_angle() ? twist_->torque_behind(static_cast<Index>(model_.node_count() - 1)) : 0.0;
        report.body_force = body_;
        report.contact_force.setZero();
        for (std::size_t k = 0; k < contact_.planes().size(); ++k) report.contact_force += contact_.force(k);
        report.handle_torque = handle_torque();
    }

    void solve_band(Band& band, RodReport& report) noexcept {
        const auto rhs = std::span(work_.rhs).first(kCoordinates * moving());
        std::copy(rhs.begin(), rhs.end(), work_.residual.begin());
        band.solve(rhs);
        if (!work_.couplings.empty())
            report.inner_iterations += conjugate_gradients(band, std::span<const double>(work_.residual).first(rhs.size()), rhs, work_,
                                                           [&](std::span<const double> p, std::span<double> out) {
                                                               couple_places<kCoordinates>(work_.couplings, first_, p, out);
                                                           });
        power_ = 0.0;
        for (std::size_t r = 0; r < rhs.size(); ++r) power_ += rhs[r] * work_.residual[r];
    }

    [[nodiscard]] double handle_torque() noexcept {
        double torque = 0.0;
        if constexpr (kTwists) {
            if (first_ == 0 || moving() == 0) return 0.0; // it has left its port, or is in it all
            torque = -twist_->torque_behind(first_);
            for (const RodPlane& plane : contact_.planes())
                if (!moves(plane.node)) torque -= (1.0 - plane.weight) * contact_.roll(plane).dot(plane.drag);
        } else if (first_ > 0) { // else none holds it
            for (std::size_t i = first_; i + 1 < model_.node_count(); ++i) {
                const double share = bend_share(i);
                const std::array<double, 3> w = bend_stencil(model_, i);
                torque -= model_.bending_of(i) * unit_change(i, w).dot(work_.tangent[i].cross(work_.rest_bend[i])) / share * share;
            }
        }
        return torque;
    }

    [[nodiscard]] std::size_t moving() const noexcept { return model_.node_count() - first_; }

    void assemble(Band& band) noexcept {
        std::fill_n(work_.rhs.begin(), kCoordinates * moving(), 0.0);
        add_inertia(band);
        add_stretch(band);
        add_bending(band);
        if constexpr (kTwists) add_twist(band);
        if (!drive_.flow.empty()) add_flow(band);
        add_planes(band);
        work_.couplings.clear();
        for (const Index k : self_.awake()) add_place(band, self_.planes()[k], k);
        hold_clamped(band);
    }

    /// Where clamped nodes may not go their rows say so by themselves, with a stiffness of the size of the others.
    void hold_clamped(Band& band) noexcept {
        for (std::size_t i = std::max<std::size_t>(held_, first_); i < model_.node_count(); ++i)
            band.add(i - first_, i - first_, Mat3(damped_mass(model_, i, work_.pace[i]) * (Mat3::Identity() - allowed_)));
    }
    [[nodiscard]] bool is_held(std::size_t node) const noexcept { return node >= held_; }
    [[nodiscard]] bool holds_angle() const noexcept { return drive_.clamp && !drive_.clamp->spins; }
    /// Whether a node's angle is one of what is solved for.
    [[nodiscard]] bool turns(std::size_t node) const noexcept { return moves(node) && !(holds_angle() && node + 1 == model_.node_count()); }

    [[nodiscard]] double farthest_from_start_sq() const noexcept {
        double farthest_sq = 0.0;
        for (std::size_t i = first_; i < model_.node_count(); ++i)
            farthest_sq = std::max(farthest_sq, (state_.position[i] - work_.start[i]).squaredNorm());
        return farthest_sq;
    }

    [[nodiscard]] bool moves(std::size_t node) const noexcept { return node >= first_; }
    /// Of the segment after node i, what is beyond the port.
    [[nodiscard]] double share_of(std::size_t i) const noexcept { return i + 1 == first_ ? share_ : 1.0; }
    /// Of the length that bends at node i, from the middle of one segment to that of the next, what is beyond the port.
    [[nodiscard]] double bend_share(std::size_t i) const noexcept {
        if (first_ == 0 || i > first_) return 1.0;
        return i == first_ ? std::min(1.0, share_ + 0.5) : std::max(share_ - 0.5, kLeastBend);
    }
    /// What pushes a node beside elasticity and contact.
    void push_body(std::size_t node, const Vec3& force) noexcept {
        push(node, force);
        body_ += force;
    }

    void push(std::size_t node, const Vec3& force) noexcept {
        if (!moves(node)) {
            handle_ += force;
            return;
        }
        if (is_held(node)) {
            const Vec3 free = allowed_ * force;
            clamped_ += force - free;
            for (int axis = 0; axis < 3; ++axis) work_.rhs[kCoordinates * (node - first_) + std::size_t(axis)] += free[axis];
            return;
        }
        for (int axis = 0; axis < 3; ++axis) work_.rhs[kCoordinates * (node - first_) + std::size_t(axis)] += force[axis];
    }
    template <class Stiffness>
    void stiffen(Band& band, std::size_t i, std::size_t j, const Stiffness& value) noexcept {
        if (!moves(i) || !moves(j)) return;
        if (is_held(i) || is_held(j))
            stiffen_held(band, i, j, as_matrix(value));
        else
            band.add(i - first_, j - first_, value);
    }
    static Mat3 as_matrix(double value) noexcept { return value * Mat3::Identity(); }
    static const Mat3& as_matrix(const Mat3& value) noexcept { return value; }
    void stiffen_held(Band& band, std::size_t i, std::size_t j, const Mat3& value) noexcept {
        const Mat3 left = is_held(i) ? Mat3(allowed_ * value) : value;
        band.add(i - first_, j - first_, is_held(j) ? Mat3(left * allowed_) : left);
    }

    void add_inertia(Band& band) noexcept {
        if (first_ < model_.node_count()) push_body(model_.node_count() - 1, work_.tip_force);
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const double pace = work_.pace[i], mass = damped_mass(model_, i, pace);
            const Vec3 moved = state_.position[i] - work_.from[i];
            push_body(i, model_.mass[i] * (work_.from_velocity[i] / pace + drive_.gravity) - mass * moved);
            if (!drive_.force.empty()) push_body(i, drive_.force[i]);
            stiffen(band, i, i, mass);
            const double whip = model_.design.transverse_drag * length_of(i) / pace;
            const Mat3 across = Mat3::Identity() - work_.tangent[i] * work_.tangent[i].transpose();
            push_body(i, -whip * (across * moved));
            stiffen(band, i, i, Mat3(whip * across));
        }
    }

    void add_stretch(Band& band) noexcept {
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

    void add_bending(Band& band) noexcept {
        const bool uniform = model_.rest_length.empty();
        for (std::size_t i = std::max<std::size_t>(first_, 2) - 1; i + 1 < model_.node_count(); ++i) {
            const double share = bend_share(i); // nodes that have not passed the port neither bend nor have a rest curvature
            if (i < first_) {
                add_clamp(band, i, share);
                continue;
            }
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

    /// The last node behind the port bends by as much of its length as has passed it, across the port's axis alone: where that is little
    /// the bending of the next segment is none, its stretch is as it was.
    void add_clamp(Band& band, std::size_t i, double share) noexcept {
        const std::array<double, 3> weight = bend_stencil(model_, i);
        const double k = model_.bending_of(i) / share;
        const Vec3& axis = drive_.port.direction;
        const Mat3 across = Mat3::Identity() - axis * axis.transpose();
        const Vec3 moment = k * (across * (unit_change(i, weight) - share * work_.rest_bend[i]));
        for (std::size_t a = 0; a < 3; ++a) push(i - 1 + a, -weight[a] * moment);
        stiffen(band, i + 1, i + 1, Mat3(k * weight[2] * weight[2] * across));
    }

    [[nodiscard]] Vec3 unit_change(std::size_t i, const std::array<double, 3>& weight) const noexcept {
        return weight[0] * state_.position[i - 1] + weight[1] * state_.position[i] + weight[2] * state_.position[i + 1];
    }

    /// Bending twists a rod that is not straight, and a twisted rod bends. The stiffness is no less than the
    /// true one, of which a node's neighbours have a share. Then the angles' own rows.
    void add_twist(Band& band) noexcept {
        twist_->find_writhe();
        curled_ = false;
        for (std::size_t i = std::max<std::size_t>(first_, 2) - 1; i + 1 < model_.node_count(); ++i) {
            const std::array<Vec3, 3> weight = twist_->gradient(i);
            const double torque = twist_->torque_at(i), k = twist_->stiffness_at(i);
            for (std::size_t a = 0; a < 3; ++a) {
                push(i - 1 + a, -torque * weight[a]);
                for (std::size_t b = 0; b <= a; ++b) stiffen(band, i - 1 + a, i - 1 + b, Mat3(k * weight[a] * weight[b].transpose()));
            }
            if (curls_ && std::abs(torque) > kWound * model_.bend_stiffness[i] * model_.segment * model_.segment) add_curl(band, i, torque);
        }
        twist_->assemble();
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const std::size_t row = angle_row(i);
            work_.rhs[row] += work_.turn[i];
            band.add_entry(row, row, work_.diagonal[i]);
            if (i > first_) band.add_entry(row, row - kCoordinates, work_.beside[i]);
        }
    }
    /// How the gradient at node i changes as its segments turn, under a torque: what lets a wound rod buckle.
    void add_curl(Band& band, std::size_t i, double torque) noexcept {
        curled_ = true;
        const TwistCurl curl = twist_->curl(i);
        const Mat3 before = torque * curl.before, after = torque * curl.after, across = torque * curl.across;
        stiffen(band, i - 1, i - 1, before);
        stiffen(band, i, i, Mat3(before - across - across.transpose() + after));
        stiffen(band, i + 1, i + 1, after);
        stiffen(band, i, i - 1, Mat3(across.transpose() - before));
        stiffen(band, i + 1, i, Mat3(across.transpose() - after));
        stiffen(band, i + 1, i - 1, Mat3(-across.transpose()));
    }
    [[nodiscard]] std::size_t angle_row(std::size_t node) const noexcept { return kCoordinates * (node - first_) + 3; }

    /// m of rod beyond the port that node i stands for.
    [[nodiscard]] double length_of(std::size_t i) const noexcept {
        const double before = i > 0 ? share_of(i - 1) * rest_length(model_, i - 1) : 0.0;
        return 0.5 * (before + (i + 1 < model_.node_count() ? rest_length(model_, i) : 0.0));
    }

    /// Drag of the fluid; the speed in its square is that of the last iteration.
    void add_flow(Band& band) noexcept {
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const RodFlow& flow = drive_.flow[i];
            const Vec3& tangent = work_.tangent[i];
            const double pace = work_.pace[i];
            const Vec3 slip = pace * flow.velocity - (state_.position[i] - work_.from[i]);
            const Vec3 along = slip.dot(tangent) * tangent, across = slip - along;
            const double share = length_of(i) / pace;
            const double k = 2.0 * flow.viscous + flow.form * std::sqrt(across.squaredNorm()) / pace;
            push_body(i, share * (flow.viscous * along + k * across));
            const Mat3 axial = tangent * tangent.transpose();
            stiffen(band, i, i, Mat3(share * (flow.viscous * axial + k * (Mat3::Identity() - axial))));
        }
    }

    void add_planes(Band& band) noexcept {
        for (const Index k : contact_.awake()) {
            RodPress& press = contact_.press(k);
            press.pushed = press.pushes;
            if (!press.pushes) continue;
            const RodPlane& plane = contact_.planes()[k];
            const Vec3 force = contact_.force(k);
            press.start_force = force;
            press.start_stiffness = press.stiffness * plane.normal * plane.normal.transpose() + press.aside;
            press.start_shared = press.shared;
            const Mat3 stiffness = press.start_stiffness + press.shared;
            const double weight[2] = {1.0 - plane.weight, plane.weight};
            for (std::size_t a = 0; a < 2; ++a) {
                push(plane.node + a, weight[a] * force);
                for (std::size_t b = 0; b <= a; ++b)
                    stiffen(band, plane.node + a, plane.node + b, Mat3(weight[a] * weight[b] * stiffness));
            }
            if constexpr (kTwists) add_grip(band, plane, press);
        }
    }

    /// Of a plane that the rod itself carries: what either place feels of its own motion. What it feels of the other's is no part of the
    /// band: couple_places.
    void add_place(Band& band, const RodPlane& plane, std::size_t k) noexcept {
        RodPress& press = self_.press(k);
        press.pushed = press.pushes;
        if (!press.pushes) return;
        press.start_force = self_.force(k);
        press.start_stiffness = press.stiffness * plane.normal * plane.normal.transpose() + press.aside;
        const auto add_side = [&](Index node, double weight, const Vec3& force) {
            const double weights[2] = {1.0 - weight, weight};
            for (std::size_t a = 0; a < 2; ++a) {
                push(node + a, weights[a] * force);
                for (std::size_t b = 0; b <= a; ++b) stiffen(band, node + a, node + b, Mat3(weights[a] * weights[b] * press.start_stiffness));
            }
        };
        add_side(plane.node, plane.weight, press.start_force);
        add_side(plane.other, plane.other_weight, -press.start_force);
        work_.couplings.push_back({plane.node, plane.other, plane.weight, plane.other_weight, press.start_stiffness});
    }

    /// Friction on the surface turns the rod.
    void add_grip(Band& band, const RodPlane& plane, const RodPress& press) noexcept {
        const Vec3 roll = contact_.roll(plane), stiff = press.aside * roll;
        const double weight[2] = {1.0 - plane.weight, plane.weight};
        for (std::size_t a = 0; a < 2; ++a) {
            if (!turns(plane.node + a)) continue;
            const std::size_t row = angle_row(plane.node + a);
            work_.rhs[row] += weight[a] * roll.dot(plane.drag);
            for (std::size_t b = 0; b < 2; ++b) {
                if (!moves(plane.node + b)) continue;
                if (b <= a && turns(plane.node + b)) band.add_entry(row, angle_row(plane.node + b), weight[a] * weight[b] * roll.dot(stiff));
                if (is_held(plane.node + b)) continue;
                for (std::size_t axis = 0; axis < 3; ++axis)
                    band.add_entry(row, kCoordinates * (plane.node + b - first_) + axis, weight[a] * weight[b] * stiff[int(axis)]);
            }
        }
    }

    /// The angles again, where the positions are now: what couples both beside friction is left out of the band.
    void turn_alone() noexcept {
        assemble_turns();
        twist_->solve_rows();
    }

    void assemble_turns() noexcept {
        contact_.evaluate();
        twist_->find_writhe();
        twist_->assemble();
        for (const Index k : contact_.awake()) {
            if (!contact_.press(k).pushes) continue;
            const RodPlane& plane = contact_.planes()[k];
            const Vec3 roll = contact_.roll(plane);
            const double torque = roll.dot(plane.drag), grip = roll.dot(contact_.press(k).aside * roll);
            const double weight[2] = {1.0 - plane.weight, plane.weight};
            for (std::size_t a = 0; a < 2; ++a) {
                work_.turn[plane.node + a] += weight[a] * torque;
                work_.diagonal[plane.node + a] += weight[a] * weight[a] * grip;
            }
            work_.beside[plane.node + 1] += weight[0] * weight[1] * grip;
        }
        twist_->hold_tip();
    }

    /// Returns the largest correction, m, before it was shortened.
    double apply_correction() noexcept {
        double largest = 0.0, turned = 0.0;
        measure_correction(largest, turned);
        const double most = std::min({1.0, kTrustRadius / largest, kTrustAngle / turned}); // by 0: infinite
        move_by(most);
        search_along(most, power_, [&](double part) { return power_at(part); }, [&](double part) { move_by(part); });
        if constexpr (kTwists) turn_alone();
        return std::max(largest, turned * model_.design.radius);
    }

    /// m, rad: of the correction; no less than they were.
    void measure_correction(double& largest, double& turned) const noexcept {
        for (std::size_t i = 0; i < moving(); ++i) {
            const double* delta = work_.rhs.data() + kCoordinates * i;
            largest = std::max(largest, std::sqrt(delta[0] * delta[0] + delta[1] * delta[1] + delta[2] * delta[2]));
            if constexpr (kTwists) turned = std::max(turned, std::abs(delta[3]));
        }
    }

    void move_by(double scale) noexcept {
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const double* delta = work_.rhs.data() + kCoordinates * (i - first_);
            for (int axis = 0; axis < 3; ++axis) state_.position[i][axis] += scale * delta[axis];
            if constexpr (kTwists) twist_->turn_node(i, scale * delta[3]);
        }
    }

    /// m; how the correction moves the rod's surface at a plane.
    [[nodiscard]] Vec3 moved_at(const RodPlane& plane) const noexcept {
        if (plane.other != kNoIndex)
            return motion_at<kCoordinates>(work_.rhs, first_, plane.node, plane.weight) -
                   motion_at<kCoordinates>(work_.rhs, first_, plane.other, plane.other_weight);
        const double weight[2] = {1.0 - plane.weight, plane.weight};
        Vec3 sum = Vec3::Zero();
        for (std::size_t a = 0; a < 2; ++a) {
            if (!moves(plane.node + a)) continue;
            const double* delta = work_.rhs.data() + kCoordinates * (plane.node + a - first_);
            sum += weight[a] * Vec3(delta[0], delta[1], delta[2]);
            if constexpr (kTwists) sum += weight[a] * delta[3] * contact_.roll(plane);
        }
        return sum;
    }

    /// J; power over the correction of all forces where `part` of it is made: the planes' as they are there, the rest linear.
    [[nodiscard]] double power_at(double part) noexcept {
        double power = (1.0 - part) * power_;
        add_contact_power(part, power);
        return power;
    }

    void add_contact_power(double part, double& power) noexcept {
        for (RodContact* contact : {&contact_, &self_}) {
            contact->evaluate();
            for (const Index k : contact->awake()) {
                const RodPress& press = contact->press(k);
                if (!press.pushes && !press.pushed) continue;
                const Vec3 moved = moved_at(contact->planes()[k]);
                Vec3 change = press.pushes ? contact->force(k) : Vec3(Vec3::Zero());
                if (press.pushed) change += part * (press.start_stiffness * moved) - press.start_force;
                power += change.dot(moved);
                if (!press.pushed || press.start_shared.isZero(0.0)) continue;
                const RodPlane& plane = contact->planes()[k]; // its wall does not feel how the rod turns
                const Vec3 along = motion_at<kCoordinates>(work_.rhs, first_, plane.node, plane.weight);
                power += part * along.dot(press.start_shared * along);
            }
        }
    }

    const RodModel& model_;
    RodState& state_;
    const RodDrive& drive_;
    double dt_;
    Index first_, held_; // the first that moves, the first that the clamp holds
    double share_;
    Mat3 allowed_; // part of a force or a motion that the clamp leaves its nodes
    RodWorkspace& work_;
    RodTwist* twist_; // nullptr: no torsion
    RodContact contact_, self_; // with walls, with itself
    Vec3 handle_ = Vec3::Zero(), body_ = Vec3::Zero(), clamped_ = Vec3::Zero(); // N, on what does not move; see RodReport
    bool curls_ = false, curled_ = false; // the band may have what add_curl adds, has it
    double power_ = 0.0; // J, of all forces over the correction, at its start
};

} // namespace trocar::fem
