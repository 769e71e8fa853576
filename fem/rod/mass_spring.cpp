#include "fem/rod/mass_spring.hpp"

#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_step.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// Of the limit 2 / omega.
constexpr double kSafety = 0.9;
/// Sweeps over the planes of a sub-step at most; they begin with the last one's impulses. Ended at a change of so much of the largest force.
constexpr unsigned kMostSweeps = 20;
constexpr double kSettled = 1e-4;
/// m/s; what lies in a wall comes out of it no faster.
constexpr double kPartSpeed = 2e-3;

/// One semi-implicit Euler step of the nodes from `first` on.
class MassSpringStep {
public:
    /// left  s, to the end of the step, where the planes' walls are
    MassSpringStep(const RodModel& model, RodState& state, const RodDrive& drive, std::span<RodPlane> planes, double dt, double left,
                   Index first, RodWorkspace& work) noexcept
        : model_(model), state_(state), drive_(drive), planes_(planes), dt_(dt), left_(left), first_(first), work_(work) {}

    void advance(RodReport& report) noexcept {
        const std::size_t nodes = model_.node_count();
        std::fill(work_.force.begin(), work_.force.end(), Vec3::Zero());
        add_springs();
        hold_.setZero();
        for (std::size_t i = first_ > 2 ? first_ - 2 : 0; i < first_; ++i) hold_ += work_.force[i]; // the handle's last two bend the rest
        body_.setZero();
        for (std::size_t i = first_; i < nodes; ++i) {
            Vec3 load = model_.mass[i] * drive_.gravity;
            if (!drive_.force.empty()) load += drive_.force[i];
            if (i + 1 == nodes) load += work_.tip_force;
            body_ += load;
            work_.from_velocity[i] = state_.velocity[i];
            state_.velocity[i] += dt_ / model_.mass[i] * (work_.force[i] + load);
            slow_down(i);
        }
        report.unconverged += !press();
        for (std::size_t i = first_; i < nodes; ++i) {
            body_ -= model_.mass[i] / dt_ * (state_.velocity[i] - work_.from_velocity[i]);
            state_.position[i] += dt_ * state_.velocity[i];
        }
    }

    /// Of what was advanced.
    void report_forces(RodReport& report) const noexcept {
        report.contact_force.setZero();
        report.handle_force = -hold_;
        for (const RodPlane& plane : planes_) {
            const Vec3 force = plane.force * plane.normal + plane.drag;
            report.contact_force += force;
            if (plane.node < first_) report.handle_force -= (1.0 - plane.weight) * force;
            if (plane.node + 1 < first_) report.handle_force -= plane.weight * force;
        }
        report.body_force = body_;
        report.handle_torque = 0.0; // that of the rest curvature, as of a rod without torsion
        for (std::size_t i = std::max<std::size_t>(first_, 1); i + 1 < model_.node_count(); ++i)
            report.handle_torque -= model_.bend_stiffness[i] * second_difference(state_.position, i).dot(work_.tangent[i].cross(work_.rest_bend[i]));
    }

private:
    [[nodiscard]] static double speed_across(const Vec3& slip, const Vec3& tangent) noexcept {
        return std::sqrt((slip - slip.dot(tangent) * tangent).squaredNorm());
    }

    /// Drag, implicit: it never turns a velocity round. The speed in its square is that of the sub-step's start.
    void slow_down(std::size_t i) noexcept {
        const double mass = model_.mass[i];
        const Vec3 before = state_.velocity[i];
        Vec3 v = before / (1.0 + model_.design.drag * dt_);
        const Vec3& tangent = work_.tangent[i];
        const Vec3 straight = v.dot(tangent) * tangent;
        const double length = model_.segment * (i > 0 && i + 1 < model_.node_count() ? 1.0 : 0.5); // m, that a node stands for
        v = straight + (v - straight) / (1.0 + dt_ * model_.design.transverse_drag * length / mass);
        if (!drive_.flow.empty()) {
            const RodFlow& flow = drive_.flow[i];
            const Vec3 slip = flow.velocity - v;
            const Vec3 along = slip.dot(tangent) * tangent, across = slip - along;
            const double share = dt_ * length / mass;
            const double a = share * flow.viscous, b = share * (2.0 * flow.viscous + flow.form * speed_across(flow.velocity - work_.from_velocity[i], tangent));
            v += a / (1.0 + a) * along + b / (1.0 + b) * across;
        }
        state_.velocity[i] = v;
        body_ += mass / dt_ * (v - before);
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

    /// The planes' impulses: Moreau's time stepping with lumped masses by projected Gauss-Seidel, as between solids. Contact adds no
    /// stiffness, and what friction holds does not creep. Returns whether they settled.
    bool press() noexcept {
        for (RodPlane& plane : planes_)
            if (plane.force > 0.0) push(plane, plane.force * plane.normal + plane.drag);
        for (unsigned sweep = 0; sweep < kMostSweeps; ++sweep) {
            double change = 0.0, largest = 0.0;
            for (RodPlane& plane : planes_) {
                change = std::max(change, balance(plane));
                largest = std::max(largest, plane.force);
            }
            if (change <= kSettled * largest) return true;
        }
        return false;
    }

    void push(const RodPlane& plane, const Vec3& force) noexcept {
        const double weight[2] = {1.0 - plane.weight, plane.weight};
        for (std::size_t a = 0; a < 2; ++a)
            if (plane.node + a >= first_) state_.velocity[plane.node + a] += dt_ * weight[a] / model_.mass[plane.node + a] * force;
    }

    /// One plane's normal force, then its friction within the cone. Returns by how much either changed, N.
    double balance(RodPlane& plane) noexcept {
        const double weight[2] = {1.0 - plane.weight, plane.weight};
        Vec3 point = Vec3::Zero(), slip = -plane.wall_velocity;
        double yield = 0.0; // 1/kg, of the point
        for (std::size_t a = 0; a < 2; ++a) {
            point += weight[a] * state_.position[plane.node + a];
            slip += weight[a] * state_.velocity[plane.node + a];
            if (plane.node + a >= first_) yield += weight[a] * weight[a] / model_.mass[plane.node + a];
        }
        const Vec3 before = plane.force * plane.normal + plane.drag;
        const double gap = plane.normal.dot(point + left_ * plane.wall_velocity) - plane.offset; // the wall's way to come is not yet taken
        const double closing = plane.normal.dot(slip) + std::max(gap / dt_, -kPartSpeed);
        if (!(plane.force > 0.0) && !(closing < 0.0)) return 0.0;
        if (!(yield > 0.0)) { // behind the port
            plane.force = 0.0;
            plane.drag.setZero();
            return 0.0;
        }
        plane.force = std::max(0.0, plane.force - closing / (dt_ * yield));
        const Vec3 along = slip - plane.normal.dot(slip) * plane.normal;
        const double most = drive_.friction * plane.friction_share * plane.force;
        Vec3 drag = plane.drag - along / (dt_ * yield);
        const double size = std::sqrt(drag.squaredNorm());
        if (size > most) drag *= most / size;
        plane.drag = drag;
        const Vec3 change = plane.force * plane.normal + plane.drag - before;
        push(plane, change);
        return std::sqrt(change.squaredNorm());
    }

    const RodModel& model_;
    RodState& state_;
    const RodDrive& drive_;
    std::span<RodPlane> planes_;
    double dt_, left_;
    Index first_;
    RodWorkspace& work_;
    Vec3 hold_ = Vec3::Zero(), body_ = Vec3::Zero(); // N, see RodReport
};

} // namespace

double mass_spring_substep(const RodModel& model) noexcept {
    double largest = 0.0;
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        double stiffness = 0.0;
        if (i > 0) stiffness += 2.0 * model.stretch_stiffness[i - 1];
        if (i + 1 < model.node_count()) stiffness += 2.0 * model.stretch_stiffness[i];
        for (std::size_t j = i > 0 ? i - 1 : 0; j <= std::min(i + 1, model.node_count() - 1); ++j)
            stiffness += (j == i ? 8.0 : 4.0) * model.bend_stiffness[j]; // row sums of the stencil (1, -2, 1) with itself
        largest = std::max(largest, stiffness / model.mass[i]);
    }
    return kSafety * 2.0 / std::sqrt(largest);
}

Result<unsigned> count_mass_spring_substeps(const RodModel& model, double step) {
    const double stable = mass_spring_substep(model), count = std::ceil(step / stable);
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
        set_tip_load(drive, (k - 0.5) * dt, work); // its mean: a step gives its integral
        move_behind_port(model, drive.port, state.insertion, dt, first, state);
        for (std::size_t i = first; i < model.node_count(); ++i)
            farthest_sq = std::max(farthest_sq, (state.position[i] - work.start[i]).squaredNorm());
        MassSpringStep sub(model, state, drive, planes, dt, (1.0 - fraction) * step, first, work);
        sub.advance(report);
        if (k == substeps) sub.report_forces(report);
    }
    report.iterations = substeps;
    report.farthest_m = std::sqrt(farthest_sq);
    add_energies(model, state, first, 1.0, work, report);
    return report;
}

} // namespace trocar::fem
