#include "fem/rod/rod.hpp"

#include "base/trig.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_step.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

void size_workspace(std::size_t nodes, RodWorkspace& work) {
    if (work.start.size() == nodes) return;
    work.start.resize(nodes);
    work.rest_bend.assign(nodes, Vec3::Zero());
    work.axis.resize(nodes);
    work.tangent.resize(nodes);
    work.band.resize(3 * nodes * (kRodBandwidth + 1));
    work.rhs.resize(3 * nodes);
}

void find_rest_bend(const RodModel& model, const RodState& state, const RodPort& port, RodWorkspace& work) noexcept {
    carry_material_axis(model, state, port, work.axis);
    const double h_sq = model.segment * model.segment;
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        work.tangent[i] = rod_tangent(state.position, i, port.direction);
        const auto& k = model.rest_curvature[i];
        work.rest_bend[i] = h_sq * (k[0] * work.axis[i] + k[1] * work.tangent[i].cross(work.axis[i]));
    }
}

namespace {

constexpr double kShortestRodPiece = 0.02; // of a segment

} // namespace

double inserted_share(const RodModel& model, double insertion, Index first) noexcept {
    if (first == 0) return 1.0;
    const double inside = insertion / model.segment - (static_cast<double>(model.node_count()) - 1.0 - static_cast<double>(first));
    return std::clamp(inside, kShortestRodPiece, 1.0);
}

void move_behind_port(const RodModel& model, const RodPort& port, double insertion, double dt, Index first, RodState& state) noexcept {
    const double last = static_cast<double>(model.node_count() - 1);
    for (Index i = 0; i < first; ++i) {
        const Vec3 target = port.position + port.direction * (insertion - (last - i) * model.segment);
        state.velocity[i] = (target - state.position[i]) / dt;
        state.position[i] = target;
    }
}

void add_energies(const RodModel& model, const RodState& state, Index first, double share, const RodWorkspace& work,
                  RodReport& report) noexcept {
    for (std::size_t i = first; i < model.node_count(); ++i) {
        report.kinetic_j += 0.5 * model.mass[i] * state.velocity[i].squaredNorm();
        if (i > 0) {
            const double stretch = std::sqrt((state.position[i] - state.position[i - 1]).squaredNorm()) - rest_length(model, i - 1);
            report.stretch_j += 0.5 * model.stretch_stiffness[i - 1] / (i == first ? share : 1.0) * stretch * stretch;
        }
        if (i > 0 && i + 1 < model.node_count()) {
            const std::array<double, 3> w = bend_stencil(model, i);
            const Vec3 bend = model.rest_length.empty()
                                  ? second_difference(state.position, i)
                                  : Vec3(w[0] * state.position[i - 1] + w[1] * state.position[i] + w[2] * state.position[i + 1]);
            report.bend_j += 0.5 * model.bend_stiffness[i] * (bend - work.rest_bend[i]).squaredNorm();
        }
        const bool turns = state.angle.empty() || (std::isfinite(state.angle[i]) && std::isfinite(state.spin[i]));
        if (report.first_bad_node == kNoIndex && !(turns && is_finite(state.position[i]) && is_finite(state.velocity[i])))
            report.first_bad_node = static_cast<Index>(i);
    }
}

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
    state.angle.assign(model.twist_stiffness.empty() ? 0 : nodes, rotation);
    state.spin.assign(state.angle.size(), 0.0);
    for (std::size_t i = 0; i < nodes; ++i)
        state.position[i] = port.position + port.direction * (insertion - static_cast<double>(nodes - 1 - i) * model.segment);
}

Vec3 rod_tangent(std::span<const Vec3> position, std::size_t i, const Vec3& fallback) noexcept {
    const Vec3 chord = position[std::min(i + 1, position.size() - 1)] - position[i > 0 ? i - 1 : 0];
    const double length = std::sqrt(chord.squaredNorm());
    return length > 0.0 ? Vec3(chord / length) : fallback;
}

Vec3 carry_axis(const Vec3& axis, const Vec3& tangent) noexcept {
    const Vec3 projected = axis - axis.dot(tangent) * tangent;
    const double length = std::sqrt(projected.squaredNorm());
    return length > 1e-6 ? Vec3(projected / length) : perpendicular_axis(tangent);
}

Vec3 transport_axis(const Vec3& axis, const Vec3& from, const Vec3& to) noexcept {
    const double room = 1.0 + from.dot(to);
    return carry_axis(room > 1e-6 ? Vec3(axis - axis.dot(to) / room * (from + to)) : axis, to); // and no drift by rounding
}

void carry_material_axis(const RodModel& model, const RodState& state, const RodPort& port, std::span<Vec3> axis) noexcept {
    const bool twists = !state.angle.empty();
    const SinCos turn = sin_cos(state.rotation);
    const Vec3 reference = perpendicular_axis(port.direction);
    Vec3 m = twists ? reference : Vec3(turn.cos * reference + turn.sin * port.direction.cross(reference));
    Vec3 last = port.direction;
    for (std::size_t i = 0; i < model.node_count(); ++i) {
        const Vec3 tangent = rod_tangent(state.position, i, port.direction);
        m = twists ? transport_axis(m, last, tangent) : carry_axis(m, tangent);
        last = tangent;
        axis[i] = m;
        if (!twists) continue;
        const SinCos here = sin_cos(state.angle[i]);
        axis[i] = here.cos * m + here.sin * tangent.cross(m);
    }
}

RodReport solve_rod(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                    std::span<RodPlane> planes, RodWorkspace& work) noexcept {
    RodReport report;
    size_workspace(model.node_count(), work);
    size_twist_workspace(model, work);
    const bool twists = !state.angle.empty();
    const double insertion_t0 = state.insertion, rotation_t0 = state.rotation;
    const double dt = step / substeps;
    Index first = first_inserted_node(model, state.insertion);
    for (unsigned k = 1; k <= substeps; ++k) {
        const double fraction = static_cast<double>(k) / substeps;
        state.insertion = insertion_t0 + fraction * (drive.insertion - insertion_t0);
        state.rotation = rotation_t0 + fraction * (drive.rotation - rotation_t0);
        first = first_inserted_node(model, state.insertion);
        RodTwist twist(model, state, drive, dt, first, work);
        if (twists)
            twist.begin();
        else
            find_rest_bend(model, state, drive.port, work);
        work.start = state.position; // same size: copies, never allocates
        move_behind_port(model, drive.port, state.insertion, dt, first, state);
        for (std::size_t i = first; i < model.node_count(); ++i) state.position[i] += dt * state.velocity[i];
        RodStep rod_step(model, state, drive, planes, dt, first, inserted_share(model, state.insertion, first), work,
                         twists ? &twist : nullptr);
        report.largest_residual = std::max(report.largest_residual, rod_step.solve(report));
        for (std::size_t i = first; i < model.node_count(); ++i) state.velocity[i] = (state.position[i] - work.start[i]) / dt;
        if (!twists) continue;
        twist.end();
        report.twist_j = twist.energy();
    }
    add_energies(model, state, first, inserted_share(model, state.insertion, first), work, report);
    return report;
}

} // namespace trocar::fem
