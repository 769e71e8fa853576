// The stages of a rod's step and what lies between them: what rod.cpp goes through for one rod and rods_together.cpp for several.
#pragma once

#include "fem/rod/rod.hpp"
#include "fem/rod/rod_frames.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace trocar::fem {

/// Stages of a sub-step: the singly diagonally implicit Runge-Kutta method of order 2 that is L-stable (Alexander 1977), both of them an
/// implicit Euler step of kStage times the sub-step's length. A node that a plane touches goes on in implicit Euler steps: impact is
/// inelastic, and what rests does not chatter.
inline constexpr double kStage = 0.29289321881345248; // 1 - 1 / sqrt(2)
inline constexpr double kCarry = (1.0 - kStage) / kStage;

class RodStages {
public:
    /// All that it refers to outlives it.
    RodStages(const RodModel& model, RodState& state, const RodDrive& drive, double step, unsigned substeps, RodWorkspace& work) noexcept
        : model_(&model), state_(&state), drive_(&drive), work_(&work), step_(step), substeps_(substeps), insertion_t0_(state.insertion),
          rotation_t0_(state.rotation), first_(first_inserted_node(model, state.insertion)), before_(first_) {
        size_workspace(model.node_count(), work);
        size_twist_workspace(model, work);
    }

    [[nodiscard]] bool twists() const noexcept { return !state_->angle.empty(); }
    [[nodiscard]] RodTwist& twist() noexcept { return *twist_; }
    [[nodiscard]] double dt() const noexcept { return dt_; }
    [[nodiscard]] Index first() const noexcept { return first_; }
    [[nodiscard]] double share() const noexcept { return inserted_share(*model_, state_->insertion, first_); }

    /// k   of 2 substeps
    void begin(unsigned k) noexcept {
        const int stage = static_cast<int>(k % 2);
        dt_ = (stage == 0 ? kStage : 1.0 - kStage) * step_ / substeps_;
        const double fraction = (static_cast<double>(k / 2) + (stage == 0 ? kStage : 1.0)) / substeps_;
        const double before = (static_cast<double>(k / 2) + (stage == 0 ? 0.0 : kStage)) / substeps_;
        if (state_->root.isZero(0.0)) { // else it has left the port: the drive has no hold of it
            state_->insertion = insertion_t0_ + fraction * (drive_->insertion - insertion_t0_);
            state_->rotation = rotation_t0_ + fraction * (drive_->rotation - rotation_t0_);
        }
        set_tip_load(*drive_, fraction * step_, *work_);
        first_ = first_inserted_node(*model_, state_->insertion);
        if (first_ == 0 && twists() && state_->root.isZero(0.0)) free_frames(drive_->port, *state_);
        twist_.emplace(*model_, *state_, *drive_, dt_, first_, *work_);
        if (twists())
            twist_->begin();
        else
            find_rest_bend(*model_, *state_, drive_->port, *work_);
        work_->start = state_->position; // same size: copies, never allocates
        count_from(stage);
        move_behind_port(*model_, drive_->port, state_->insertion, dt_, first_, *state_);
        if (drive_->clamp)
            move_clamp(*model_, *drive_->clamp, (fraction - before) / (1.0 - before), dt_, work_->tangent.back(), work_->axis.back(), *state_);
    }

    /// touch_others   (touch): calls touch(node, weight) of every place that others press on
    template <class Others>
    void end(bool settled, std::span<const RodPlane> planes, std::span<const RodPlane> self, const Others& touch_others, RodReport& report) noexcept {
        const double energy = settled ? 0.0 : kinetic_energy();
        find_touched(planes, self, touch_others);
        for (std::size_t i = first_; i < state_->position.size(); ++i)
            state_->velocity[i] = work_->touched[i] != 0 ? Vec3((state_->position[i] - work_->start[i]) / dt_)
                                                         : Vec3((state_->position[i] - work_->from[i]) / work_->pace[i]);
        if (!settled) hold_back(energy);
        before_ = first_;
        if (!twists()) return;
        if (first_ == 0) carry_root();
        twist_->end();
        report.twist_j = twist_->energy();
    }

    void finish(RodReport& report) const noexcept { add_energies(*model_, *state_, first_, share(), *work_, report); }

private:
    /// Of a rod that has left its port: where its frames begin follows its first segment.
    void carry_root() noexcept {
        state_->root = transport_axis(state_->root, work_->tangent[0], rod_tangent(state_->position, 0, work_->tangent[0]));
    }

    /// What a stage counts motion from.
    void count_from(int stage) noexcept {
        RodWorkspace& work = *work_;
        if (stage == 0) {
            work.step_start = state_->position; // same sizes: copies, never allocates
            work.step_velocity = state_->velocity;
        }
        for (std::size_t i = 0; i < state_->position.size(); ++i) {
            work.from[i] = state_->position[i];
            work.from_velocity[i] = state_->velocity[i];
            work.pace[i] = dt_;
            if (stage == 0 || i < first_ || work.touched[i] != 0) continue;
            work.from[i] = work.step_start[i] + kCarry * (state_->position[i] - work.step_start[i]);
            work.from_velocity[i] = work.step_velocity[i] + kCarry * (state_->velocity[i] - work.step_velocity[i]);
            work.pace[i] = kStage * (step_ / substeps_);
        }
    }

    /// Nodes that were behind the port when the stage began are, too.
    template <class Others>
    void find_touched(std::span<const RodPlane> planes, std::span<const RodPlane> self, const Others& touch_others) noexcept {
        std::vector<std::uint8_t>& touched = work_->touched;
        std::fill(touched.begin(), touched.end(), std::uint8_t{0});
        const auto touch = [&](Index node, double weight) {
            if (weight < 1.0) touched[node] = 1;
            if (weight > 0.0) touched[node + 1] = 1;
        };
        for (const RodPlane& plane : planes)
            if (plane.force > 0.0) touch(plane.node, plane.weight);
        for (const RodPlane& plane : self)
            if (plane.force > 0.0) touch(plane.node, plane.weight), touch(plane.other, plane.other_weight);
        touch_others(touch);
        for (std::size_t i = 0; i < std::max(first_, before_); ++i) touched[i] = 1;
        for (std::size_t i = first_clamped_node(*model_, *drive_); i < touched.size(); ++i) touched[i] = 1;
    }

    [[nodiscard]] double kinetic_energy() const noexcept {
        double sum = 0.0;
        for (std::size_t i = first_; i < state_->velocity.size(); ++i) sum += 0.5 * model_->mass[i] * state_->velocity[i].squaredNorm();
        return sum;
    }

    /// What an iteration that did not settle moved may be no motion at all: it must not drive the rod.
    void hold_back(double most_j) noexcept {
        const double energy = kinetic_energy();
        if (!(energy > most_j)) return;
        const double share = std::sqrt(most_j / energy);
        for (std::size_t i = first_; i < state_->velocity.size(); ++i) state_->velocity[i] *= share;
    }

    const RodModel* model_;
    RodState* state_;
    const RodDrive* drive_;
    RodWorkspace* work_;
    double step_; // s
    unsigned substeps_;
    double insertion_t0_, rotation_t0_;
    Index first_, before_;
    double dt_ = 0.0; // s, of this stage
    std::optional<RodTwist> twist_;
};

} // namespace trocar::fem
