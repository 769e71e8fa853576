#include "fem/rod/mass_spring.hpp"

#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_step.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// Of the limit 2 / omega.
constexpr double kSafety = 0.9;
/// Planes at a node that are thought to press at once: those of three places of a tube, two each.
constexpr double kPlanesAtANode = 6.0;
/// N/m; a stiffer wall would only shorten the sub-steps.
constexpr double kStiffestWall = 2e4;
/// m/s; below this sliding speed friction grows linearly instead of jumping, so that a stuck chain creeps by at most this.
constexpr double kStickSpeed = 1e-3;

/// One semi-implicit Euler step of the nodes from `first` on.
class MassSpringStep {
public:
    MassSpringStep(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes, double dt, Index first,
                   RodWorkspace& work) noexcept
        : model_(model), state_(state), drive_(drive), planes_(planes), dt_(dt), first_(first), work_(work) {}

    void advance() noexcept {
        const std::size_t nodes = model_.node_count();
        for (std::size_t i = first_ > 0 ? first_ - 1 : 0; i < nodes; ++i) work_.force[i] = model_.mass[i] * drive_.gravity;
        for (std::size_t i = 0; i < drive_.force.size(); ++i) work_.force[i] += drive_.force[i];
        add_springs();
        for (RodPlane& plane : planes_) add_wall(plane);
        const double whip = model_.design.transverse_drag * model_.segment;
        for (std::size_t i = first_; i < nodes; ++i) {
            const double mass = model_.mass[i];
            Vec3 v = (state_.velocity[i] + dt_ / mass * work_.force[i]) / (1.0 + model_.design.drag * dt_);
            const Vec3 along = v.dot(work_.tangent[i]) * work_.tangent[i];
            state_.velocity[i] = along + (v - along) / (1.0 + dt_ * whip / mass);
        }
        if (!drive_.flow.empty()) drift();
        if (drive_.friction > 0.0)
            for (RodPlane& plane : planes_) rub(plane);
        for (std::size_t i = first_; i < nodes; ++i) state_.position[i] += dt_ * state_.velocity[i];
    }

private:
    /// Drag of the fluid, implicit: it never turns a velocity round.
    void drift() noexcept {
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const RodFlow& flow = drive_.flow[i];
            const Vec3 slip = flow.velocity - state_.velocity[i];
            const Vec3 along = slip.dot(work_.tangent[i]) * work_.tangent[i], across = slip - along;
            const double share = dt_ * model_.segment * (i > 0 && i + 1 < model_.node_count() ? 1.0 : 0.5) / model_.mass[i];
            const double a = share * flow.viscous, b = share * (2.0 * flow.viscous + flow.form * std::sqrt(across.squaredNorm()));
            state_.velocity[i] += a / (1.0 + a) * along + b / (1.0 + b) * across;
        }
    }

    void add_springs() noexcept {
        const std::size_t nodes = model_.node_count();
        std::vector<Vec3>& force = work_.force;
        for (std::size_t i = first_ > 0 ? first_ - 1 : 0; i + 1 < nodes; ++i) {
            const Vec3 edge = state_.position[i + 1] - state_.position[i];
            const double length = std::sqrt(edge.squaredNorm());
            if (!(length > 0.0)) continue;
            const Vec3 tension = model_.stretch_stiffness[i] * (length - model_.segment) / length * edge;
            force[i] += tension;
            force[i + 1] -= tension;
        }
        for (std::size_t i = std::max<std::size_t>(first_, 2) - 1; i + 1 < nodes; ++i) {
            const Vec3 moment = model_.bend_stiffness[i] * (second_difference(state_.position, i) - work_.rest_bend[i]);
            force[i - 1] -= moment;
            force[i] += 2.0 * moment;
            force[i + 1] -= moment;
        }
    }

    void add_wall(RodPlane& plane) noexcept {
        const double w = plane.weight;
        const Vec3 point = (1.0 - w) * state_.position[plane.node] + w * state_.position[plane.node + 1];
        plane.force = std::min(drive_.contact_stiffness, kStiffestWall) * std::max(0.0, plane.offset - plane.normal.dot(point));
        plane.drag.setZero();
        work_.force[plane.node] += (1.0 - w) * plane.force * plane.normal;
        work_.force[plane.node + 1] += w * plane.force * plane.normal;
    }

    /// Coulomb friction removes sliding velocity up to its bound, never more than there is.
    void rub(RodPlane& plane) noexcept {
        if (!(plane.force > 0.0)) return;
        const double weight[2] = {1.0 - plane.weight, plane.weight};
        Vec3 slide = -plane.wall_velocity;
        double yield = 0.0; // 1/kg, of the point
        for (std::size_t a = 0; a < 2; ++a) {
            slide += weight[a] * state_.velocity[plane.node + a];
            if (plane.node + a >= first_) yield += weight[a] * weight[a] / model_.mass[plane.node + a];
        }
        slide -= plane.normal.dot(slide) * plane.normal;
        const double speed = std::sqrt(slide.squaredNorm());
        const double viscous = drive_.friction * plane.friction_share * plane.force / std::max(speed, kStickSpeed);
        plane.drag = -viscous / (1.0 + dt_ * viscous * yield) * slide;
        for (std::size_t a = 0; a < 2; ++a)
            if (plane.node + a >= first_) state_.velocity[plane.node + a] += dt_ * weight[a] / model_.mass[plane.node + a] * plane.drag;
    }

    const RodModel& model_;
    RodState& state_;
    const RodDrive& drive_;
    std::span<RodPlane> planes_;
    double dt_;
    Index first_;
    RodWorkspace& work_;
};

} // namespace

double mass_spring_substep(const RodModel& model, double contact_stiffness) noexcept {
    double largest = 0.0;
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        double stiffness = kPlanesAtANode * std::min(contact_stiffness, kStiffestWall);
        if (i > 0) stiffness += 2.0 * model.stretch_stiffness[i - 1];
        if (i + 1 < model.node_count()) stiffness += 2.0 * model.stretch_stiffness[i];
        for (std::size_t j = i > 0 ? i - 1 : 0; j <= std::min(i + 1, model.node_count() - 1); ++j)
            stiffness += (j == i ? 8.0 : 4.0) * model.bend_stiffness[j]; // row sums of the stencil (1, -2, 1) with itself
        largest = std::max(largest, stiffness / model.mass[i]);
    }
    return kSafety * 2.0 / std::sqrt(largest);
}

Result<unsigned> count_mass_spring_substeps(const RodModel& model, double contact_stiffness, double step) {
    const double stable = mass_spring_substep(model, contact_stiffness), count = std::ceil(step / stable);
    if (count <= kMostMassSpringSubsteps) return static_cast<unsigned>(std::max(1.0, count));
    return Error{ErrorCode::BadValue, "a mass_spring of this stiffness is stable for " + std::to_string(1e6 * stable) + " us at a time, " +
                                          std::to_string(static_cast<unsigned long long>(count)) +
                                          " sub-steps in a step; expected at most " +
                                          std::to_string(static_cast<unsigned>(kMostMassSpringSubsteps)) +
                                          ": longer segments, a softer or heavier instrument, shorter steps, or the kind rod"};
}

RodReport solve_mass_spring(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                            std::span<RodPlane> planes, RodWorkspace& work) noexcept {
    RodReport report;
    size_workspace(model.node_count(), work);
    if (work.force.size() != model.node_count()) work.force.resize(model.node_count());
    const double insertion_t0 = state.insertion, rotation_t0 = state.rotation, dt = step / substeps;
    Index first = first_inserted_node(model, state.insertion);
    work.start = state.position; // same size: copies, never allocates
    double farthest_sq = 0.0;
    for (unsigned k = 1; k <= substeps; ++k) {
        const double fraction = static_cast<double>(k) / substeps;
        state.insertion = insertion_t0 + fraction * (drive.insertion - insertion_t0);
        state.rotation = rotation_t0 + fraction * (drive.rotation - rotation_t0);
        first = first_inserted_node(model, state.insertion);
        find_rest_bend(model, state, drive.port, work);
        move_behind_port(model, drive.port, state.insertion, dt, first, state);
        for (std::size_t i = first; i < model.node_count(); ++i)
            farthest_sq = std::max(farthest_sq, (state.position[i] - work.start[i]).squaredNorm());
        MassSpringStep(model, state, drive, planes, dt, first, work).advance();
    }
    report.iterations = substeps;
    report.farthest_m = std::sqrt(farthest_sq);
    add_energies(model, state, first, 1.0, work, report);
    return report;
}

} // namespace trocar::fem
