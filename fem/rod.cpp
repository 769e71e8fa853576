#include "fem/rod.hpp"

#include "base/trig.hpp"
#include "fem/rod_step.hpp"

#include <algorithm>
#include <cmath>

namespace seldinger::fem {

namespace {

void size_workspace(std::size_t nodes, RodWorkspace& work) {
    if (work.start.size() == nodes) return;
    work.start.resize(nodes);
    work.rest_bend.assign(nodes, Vec3::Zero());
    work.axis.resize(nodes);
    work.tangent.resize(nodes);
    work.band.resize(3 * nodes * (kRodBandwidth + 1));
    work.rhs.resize(3 * nodes);
}

Vec3 tangent_at(const RodModel& model, const RodState& state, const RodPort& port, std::size_t i) noexcept {
    const std::size_t last = model.node_count() - 1;
    const Vec3 chord = state.position[std::min(i + 1, last)] - state.position[i > 0 ? i - 1 : 0];
    const double length = std::sqrt(chord.squaredNorm());
    return length > 0.0 ? Vec3(chord / length) : port.direction;
}

/// Frames of the last sub-step turn the shaped tip's rest curvature into the world.
void find_rest_bend(const RodModel& model, const RodState& state, const RodPort& port, RodWorkspace& work) noexcept {
    carry_material_axis(model, state, port, work.axis);
    const double h_sq = model.segment * model.segment;
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        work.tangent[i] = tangent_at(model, state, port, i);
        const auto& k = model.rest_curvature[i];
        work.rest_bend[i] = h_sq * (k[0] * work.axis[i] + k[1] * work.tangent[i].cross(work.axis[i]));
    }
}

void move_behind_port(const RodModel& model, const RodPort& port, double insertion, double dt, Index first, RodState& state) noexcept {
    const double last = static_cast<double>(model.node_count() - 1);
    for (Index i = 0; i < first; ++i) {
        const Vec3 target = port.position + port.direction * (insertion - (last - i) * model.segment);
        state.velocity[i] = (target - state.position[i]) / dt;
        state.position[i] = target;
    }
}

void add_energies(const RodModel& model, const RodState& state, Index first, const RodWorkspace& work, RodReport& report) noexcept {
    for (std::size_t i = first; i < model.node_count(); ++i) {
        report.kinetic_j += 0.5 * model.mass[i] * state.velocity[i].squaredNorm();
        if (i > 0) {
            const double stretch = std::sqrt((state.position[i] - state.position[i - 1]).squaredNorm()) - model.segment;
            report.stretch_j += 0.5 * model.stretch_stiffness[i - 1] * stretch * stretch;
        }
        if (i > 0 && i + 1 < model.node_count())
            report.bend_j += 0.5 * model.bend_stiffness[i] * (second_difference(state.position, i) - work.rest_bend[i]).squaredNorm();
        if (report.first_bad_node == kNoIndex && !(is_finite(state.position[i]) && is_finite(state.velocity[i])))
            report.first_bad_node = static_cast<Index>(i);
    }
}

} // namespace

Vec3 perpendicular_axis(const Vec3& direction) noexcept {
    int smallest = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(direction[axis]) < std::abs(direction[smallest])) smallest = axis;
    const Vec3 across = direction.cross(Vec3::Unit(smallest));
    return across / std::sqrt(across.squaredNorm());
}

Index first_inserted_node(const RodModel& model, double insertion) noexcept {
    const double outside = static_cast<double>(model.node_count() - 1) - insertion / model.segment;
    if (!(outside > 0.0)) return 0;
    // A node exactly on the port counts as outside.
    const double first = std::floor(outside) + 1.0;
    return static_cast<Index>(std::min(first, static_cast<double>(model.node_count())));
}

void place_rod(const RodModel& model, const RodPort& port, double insertion, double rotation, RodState& state) {
    const std::size_t nodes = model.node_count();
    state.position.resize(nodes);
    state.velocity.assign(nodes, Vec3::Zero());
    state.insertion = insertion;
    state.rotation = rotation;
    for (std::size_t i = 0; i < nodes; ++i)
        state.position[i] = port.position + port.direction * (insertion - static_cast<double>(nodes - 1 - i) * model.segment);
}

void carry_material_axis(const RodModel& model, const RodState& state, const RodPort& port, std::span<Vec3> axis) noexcept {
    const SinCos turn = sin_cos(state.rotation);
    const Vec3 reference = perpendicular_axis(port.direction);
    Vec3 m = turn.cos * reference + turn.sin * port.direction.cross(reference);
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        // Projecting onto the next normal plane is parallel transport to second order in the turn per node.
        const Vec3 tangent = tangent_at(model, state, port, i);
        const Vec3 projected = m - m.dot(tangent) * tangent;
        const double length = std::sqrt(projected.squaredNorm());
        m = length > 1e-6 ? Vec3(projected / length) : perpendicular_axis(tangent);
        axis[i] = m;
    }
}

RodReport solve_rod(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                    std::span<RodPlane> planes, RodWorkspace& work) noexcept {
    RodReport report;
    size_workspace(model.node_count(), work);
    const double insertion_t0 = state.insertion, rotation_t0 = state.rotation;
    const double dt = step / substeps;
    Index first = first_inserted_node(model, state.insertion);
    for (unsigned k = 1; k <= substeps; ++k) {
        const double fraction = static_cast<double>(k) / substeps;
        state.insertion = insertion_t0 + fraction * (drive.insertion - insertion_t0);
        state.rotation = rotation_t0 + fraction * (drive.rotation - rotation_t0);
        first = first_inserted_node(model, state.insertion);
        find_rest_bend(model, state, drive.port, work);
        work.start = state.position; // same size: copies, never allocates
        move_behind_port(model, drive.port, state.insertion, dt, first, state);
        for (std::size_t i = first; i < model.node_count(); ++i) state.position[i] += dt * state.velocity[i];
        RodStep rod_step(model, state, drive, planes, dt, first, work);
        report.largest_residual = std::max(report.largest_residual, rod_step.solve(report));
        for (std::size_t i = first; i < model.node_count(); ++i) state.velocity[i] = (state.position[i] - work.start[i]) / dt;
    }
    add_energies(model, state, first, work, report);
    return report;
}

} // namespace seldinger::fem
