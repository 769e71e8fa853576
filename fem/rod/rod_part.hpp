// A rod's step as a part of the step of several rods that press on one another: what rods_together.cpp asks of it, whatever its
// coordinates.
#pragma once

#include "fem/rod/joint_band.hpp"
#include "fem/rod/rod_step.hpp"

#include <optional>

namespace trocar::fem {

/// A place on a rod's surface, and how its nodes move it: W0 x_node + W1 x_node+1 + roll times its angle. A segment that turns takes its
/// surface along.
struct SurfacePlace {
    Index node = 0;
    double share[2] = {1.0, 0.0}; // [-] of the axis' point, of the angle
    Mat3 weight[2] = {Mat3::Identity(), Mat3::Zero()};
    Vec3 roll = Vec3::Zero(); // m/rad
};

class RodPart {
public:
    virtual ~RodPart() = default;

    /// m, across the axis: from there to where it touches the other one
    [[nodiscard]] virtual SurfacePlace place(Index node, double weight, const Vec3& lever) const noexcept = 0;
    /// m, of the axis there
    [[nodiscard]] virtual Vec3 point(const SurfacePlace& place) const noexcept = 0;
    /// m, of the surface since the stage's start
    [[nodiscard]] virtual Vec3 displacement(const SurfacePlace& place) const noexcept = 0;
    [[nodiscard]] virtual double stiffness() const noexcept = 0; // N/m, stiffness_across
    [[nodiscard]] virtual double farthest_from_start_sq() const noexcept = 0;

    // Its contact with walls and with itself.
    virtual void evaluate(bool held) noexcept = 0;
    [[nodiscard]] virtual double largest_force() const noexcept = 0;
    [[nodiscard]] virtual double update(bool bounds) noexcept = 0;
    virtual void stay_in_cone() noexcept = 0;
    virtual void add_contact_power(double part, double& power) noexcept = 0;

    // A correction.
    [[nodiscard]] virtual std::size_t size() const noexcept = 0; // of what moves, all coordinates
    virtual void assemble() noexcept = 0;
    virtual void push_place(const SurfacePlace& place, const Vec3& force, const Mat3& stiffness) noexcept = 0;
    /// b: the right side, x: what the band alone answers; [size]
    virtual void solve_band(std::span<double> b, std::span<double> x) noexcept = 0;
    /// Instead of solve_band, where it is solved with others: the right side, and where the band's entries go.
    virtual void copy_right_side(std::span<double> b) const noexcept = 0;
    virtual void couple_band(std::size_t from, JointBand& joint) const noexcept = 0;
    virtual void add_band(std::size_t from, JointBand& joint) const noexcept = 0;
    /// The coordinates of a place's node, of all of this rod; none: it does not move.
    [[nodiscard]] virtual std::size_t coordinates() const noexcept = 0; // of a node
    [[nodiscard]] virtual Index first() const noexcept = 0;             // node that moves
    [[nodiscard]] virtual double arc(Index node) const noexcept = 0;    // m, from the port
    virtual void solve_again(std::span<double> x) noexcept = 0;
    [[nodiscard]] virtual bool is_coupled() const noexcept = 0; // with itself
    virtual void couple_itself(std::span<const double> p, std::span<double> out) const noexcept = 0;
    [[nodiscard]] virtual Vec3 motion_at(const SurfacePlace& place, std::span<const double> p) const noexcept = 0;
    virtual void take_force(const SurfacePlace& place, const Vec3& force, std::span<double> out) const noexcept = 0;
    virtual void set_correction(std::span<const double> x) noexcept = 0;
    virtual void measure_correction(double& largest, double& turned) const noexcept = 0;
    virtual void move_by(double share) noexcept = 0;

    // Its angles alone, where the rod twists.
    virtual bool begin_turns() noexcept = 0; // false: it does not
    virtual void push_turn(const SurfacePlace& place, const Vec3& drag, const Mat3& aside) noexcept = 0;
    virtual void end_turns() noexcept = 0;

    // What it tells at a step's end, around push_place of what others press with; pressed: N, of those.
    virtual void begin_balance() noexcept = 0;
    virtual void end_balance(const Vec3& pressed, RodReport& report) noexcept = 0;
};

template <std::size_t kCoordinates>
class RodPartOf final : public RodPart, private RodStep<kCoordinates> {
    using Base = RodStep<kCoordinates>;
    using typename Base::Band;
    using Base::kTwists, Base::model_, Base::state_, Base::work_, Base::first_, Base::contact_, Base::self_, Base::moves, Base::moving,
        Base::twist_;

public:
    RodPartOf(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes, std::span<RodPlane> self, double dt,
              Index first, double share, RodWorkspace& workspace, RodTwist* twist) noexcept
        : Base(model, state, drive, planes, self, dt, first, share, workspace, twist), stiffness_(stiffness_across(model, dt, first)) {}

    [[nodiscard]] SurfacePlace place(Index node, double weight, const Vec3& lever) const noexcept override {
        SurfacePlace place;
        place.node = node;
        place.share[0] = 1.0 - weight, place.share[1] = weight;
        const Vec3 edge = work_.start[node + 1] - work_.start[node];
        const double length_sq = edge.squaredNorm();
        Mat3 tilt = Mat3::Zero(); // of the lever with the segment: omega x lever, omega = edge x d(edge) / edge^2
        if (length_sq > 0.0) tilt = (edge.dot(lever) * Mat3::Identity() - edge * lever.transpose()) / length_sq;
        place.weight[0] = place.share[0] * Mat3::Identity() - tilt;
        place.weight[1] = place.share[1] * Mat3::Identity() + tilt;
        if (kTwists && length_sq > 0.0) place.roll = edge.cross(lever) / std::sqrt(length_sq);
        return place;
    }
    [[nodiscard]] Vec3 point(const SurfacePlace& place) const noexcept override {
        return place.share[0] * state_.position[place.node] + place.share[1] * state_.position[place.node + 1];
    }
    [[nodiscard]] Vec3 displacement(const SurfacePlace& place) const noexcept override {
        Vec3 sum = Vec3::Zero();
        for (std::size_t a = 0; a < 2; ++a) {
            sum += place.weight[a] * (state_.position[place.node + a] - work_.start[place.node + a]);
            if constexpr (kTwists) sum += place.share[a] * (state_.angle[place.node + a] - work_.start_angle[place.node + a]) * place.roll;
        }
        return sum;
    }
    [[nodiscard]] double stiffness() const noexcept override { return stiffness_; }
    [[nodiscard]] double farthest_from_start_sq() const noexcept override { return Base::farthest_from_start_sq(); }

    void evaluate(bool held) noexcept override {
        if (held)
            contact_.evaluate_held(), self_.evaluate_held();
        else
            contact_.evaluate(), self_.evaluate();
    }
    [[nodiscard]] double largest_force() const noexcept override { return std::max(contact_.largest_force(), self_.largest_force()); }
    [[nodiscard]] double update(bool bounds) noexcept override { return std::max(contact_.update(bounds), self_.update(bounds)); }
    void stay_in_cone() noexcept override { contact_.stay_in_cone(), self_.stay_in_cone(); }
    void add_contact_power(double part, double& power) noexcept override { Base::add_contact_power(part, power); }

    [[nodiscard]] std::size_t size() const noexcept override { return kCoordinates * moving(); }
    /// What presses on the rod only stiffens it: where the band by itself is definite it is with that.
    void assemble() noexcept override {
        Base::curls_ = kTwists;
        Base::assemble(band_.emplace(work_.band, moving()));
        if (!Base::curled_) return;
        band_->solve(std::span(work_.residual).first(size()));
        Base::curls_ = band_->is_definite();
        Base::forget_balance(); // it is told once
        Base::assemble(band_.emplace(work_.band, moving()));
    }
    void push_place(const SurfacePlace& place, const Vec3& force, const Mat3& stiffness) noexcept override {
        for (std::size_t a = 0; a < 2; ++a) {
            const Mat3 across = place.weight[a].transpose() * stiffness;
            Base::push(place.node + a, place.weight[a].transpose() * force);
            for (std::size_t b = 0; b <= a; ++b) Base::stiffen(*band_, place.node + a, place.node + b, Mat3(across * place.weight[b]));
        }
        if constexpr (kTwists) grip_place(place, force, stiffness);
    }
    void solve_band(std::span<double> b, std::span<double> x) noexcept override {
        std::copy_n(work_.rhs.begin(), b.size(), b.begin());
        std::copy_n(work_.rhs.begin(), x.size(), x.begin());
        band_->solve(x);
    }
    void copy_right_side(std::span<double> b) const noexcept override { std::copy_n(work_.rhs.begin(), b.size(), b.begin()); }
    void couple_band(std::size_t from, JointBand& joint) const noexcept override {
        for (std::size_t i = 0; i < moving(); ++i) {
            const std::size_t last = kCoordinates * std::min(i + 3, moving());
            for (std::size_t k = 0; k < kCoordinates; ++k) joint.couple(from + kCoordinates * i + k, from + last - 1);
        }
    }
    void add_band(std::size_t from, JointBand& joint) const noexcept override {
        band_->for_each_entry([&](std::size_t a, std::size_t b, double value) {
            if (value != 0.0) joint.add(from + a, from + b, value);
        });
    }
    [[nodiscard]] std::size_t coordinates() const noexcept override { return kCoordinates; }
    [[nodiscard]] Index first() const noexcept override { return first_; }
    [[nodiscard]] double arc(Index node) const noexcept override { return arc_of(model_, state_.insertion, node); }
    void solve_again(std::span<double> x) noexcept override { band_->solve_again(x, 0); }
    [[nodiscard]] bool is_coupled() const noexcept override { return !work_.couplings.empty(); }
    void couple_itself(std::span<const double> p, std::span<double> out) const noexcept override {
        couple_places<kCoordinates>(work_.couplings, first_, p, out);
    }
    [[nodiscard]] Vec3 motion_at(const SurfacePlace& place, std::span<const double> p) const noexcept override {
        Vec3 sum = Vec3::Zero();
        for (std::size_t a = 0; a < 2; ++a) {
            if (!moves(place.node + a)) continue;
            const double* at = p.data() + kCoordinates * (place.node + a - first_);
            sum += place.weight[a] * Vec3(at[0], at[1], at[2]);
            if constexpr (kTwists) sum += place.share[a] * at[3] * place.roll;
        }
        return sum;
    }
    void take_force(const SurfacePlace& place, const Vec3& force, std::span<double> out) const noexcept override {
        for (std::size_t a = 0; a < 2; ++a) {
            if (!moves(place.node + a)) continue;
            double* at = out.data() + kCoordinates * (place.node + a - first_);
            const Vec3 own = place.weight[a].transpose() * force;
            for (int axis = 0; axis < 3; ++axis) at[axis] += own[axis];
            if constexpr (kTwists) at[3] += place.share[a] * place.roll.dot(force);
        }
    }
    void set_correction(std::span<const double> x) noexcept override { std::copy(x.begin(), x.end(), work_.rhs.begin()); }
    void measure_correction(double& largest, double& turned) const noexcept override { Base::measure_correction(largest, turned); }
    void move_by(double share) noexcept override { Base::move_by(share); }

    bool begin_turns() noexcept override {
        if constexpr (kTwists) Base::assemble_turns();
        return kTwists;
    }
    void push_turn(const SurfacePlace& place, const Vec3& drag, const Mat3& aside) noexcept override {
        const double torque = place.roll.dot(drag), grip = place.roll.dot(aside * place.roll);
        for (std::size_t a = 0; a < 2; ++a) {
            work_.turn[place.node + a] += place.share[a] * torque;
            work_.diagonal[place.node + a] += place.share[a] * place.share[a] * grip;
        }
        work_.beside[place.node + 1] += place.share[0] * place.share[1] * grip;
    }
    void end_turns() noexcept override {
        if constexpr (kTwists) twist_->hold_tip(), twist_->solve_rows();
    }

    void begin_balance() noexcept override {
        Base::forget_balance();
        assemble();
    }
    void end_balance(const Vec3& pressed, RodReport& report) noexcept override {
        Base::tell_balance(report);
        report.contact_force += pressed;
    }

private:
    void grip_place(const SurfacePlace& place, const Vec3& force, const Mat3& stiffness) noexcept {
        const Vec3 stiff = stiffness * place.roll;
        for (std::size_t a = 0; a < 2; ++a) {
            if (!moves(place.node + a)) continue;
            const std::size_t row = Base::angle_row(place.node + a);
            work_.rhs[row] += place.share[a] * place.roll.dot(force);
            for (std::size_t b = 0; b < 2; ++b) {
                if (!moves(place.node + b)) continue;
                if (b <= a) band_->add_entry(row, Base::angle_row(place.node + b), place.share[a] * place.share[b] * place.roll.dot(stiff));
                const Vec3 beside = place.share[a] * (place.weight[b].transpose() * stiff);
                for (std::size_t axis = 0; axis < 3; ++axis) band_->add_entry(row, kCoordinates * (place.node + b - first_) + axis, beside[int(axis)]);
            }
        }
    }

    double stiffness_;
    std::optional<Band> band_;
};

} // namespace trocar::fem
