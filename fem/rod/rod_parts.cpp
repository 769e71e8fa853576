#include "fem/rod/rod_parts.hpp"

#include "base/trig.hpp"
#include "fem/rod/rod_band.hpp"
#include "fem/rod/rod_frames.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

void size_workspace(std::size_t nodes, RodWorkspace& work) {
    if (work.start.size() == nodes) return;
    constexpr std::size_t most = kTwistedCoordinates; // with torsion
    for (auto* list : {&work.start, &work.from, &work.from_velocity, &work.step_start, &work.step_velocity}) list->resize(nodes);
    work.pace.resize(nodes);
    work.touched.resize(nodes);
    work.rest_bend.assign(nodes, Vec3::Zero());
    work.axis.resize(nodes);
    work.tangent.resize(nodes);
    work.band.resize(most * nodes * (rod_bandwidth(most) + 1));
    for (auto* list : {&work.rhs, &work.residual, &work.remainder, &work.guess, &work.direction, &work.banded, &work.solution})
        list->resize(most * nodes);
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

Index first_clamped_node(const RodModel& model, const RodDrive& drive) noexcept {
    return static_cast<Index>(model.node_count() - (drive.clamp ? 2 : 0));
}

Mat3 clamp_freedom(const RodDrive& drive) noexcept {
    if (!drive.clamp || !drive.clamp->slides) return Mat3::Zero();
    return drive.clamp->direction * drive.clamp->direction.transpose();
}

double find_angle(double cosine, double sine) noexcept {
    double angle = sine;
    for (int k = 0; k < 4; ++k) {
        const SinCos at = sin_cos(angle);
        angle += sine * at.cos - cosine * at.sin;
    }
    return angle;
}

namespace {

/// The angle that takes the material to the clamp's axis, or `part` of the way there.
void turn_clamped(const RodClamp& clamp, double part, const Vec3& direction, const Vec3& tangent, const Vec3& axis, double& angle) noexcept {
    const Vec3 carried = transport_axis(axis, tangent, direction), across = direction.cross(carried);
    const SinCos now = sin_cos(angle);
    const Vec3 material = now.cos * carried + now.sin * across, wanted = carry_axis(clamp.axis, direction);
    angle += part * find_angle(material.dot(wanted), direction.dot(material.cross(wanted)));
}

} // namespace

void move_clamp(const RodModel& model, const RodClamp& clamp, double part, double dt, const Vec3& tangent, const Vec3& axis, RodState& state) noexcept {
    const std::size_t tip = model.node_count() - 1;
    const Vec3 chord = state.position[tip] - state.position[tip - 1];
    Vec3 direction = chord / std::sqrt(chord.squaredNorm());
    direction += part * (clamp.direction - direction);
    direction /= std::sqrt(direction.squaredNorm());
    const Vec3 place = state.position[tip] + part * (clamp.position - state.position[tip]);
    for (std::size_t i = tip - 1; i <= tip; ++i) {
        Vec3 target = place - static_cast<double>(tip - i) * rest_length(model, tip - 1) * direction;
        if (clamp.slides) target = place + (state.position[i] - place).dot(direction) * direction;
        if (!clamp.slides) state.velocity[i] = (target - state.position[i]) / dt;
        state.position[i] = target;
    }
    if (!state.angle.empty() && !clamp.spins) turn_clamped(clamp, part, direction, tangent, axis, state.angle[tip]);
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
            report.bend_j += 0.5 * model.bending_of(i) * (bend - work.rest_bend[i]).squaredNorm();
        }
        const bool turns = state.angle.empty() || (std::isfinite(state.angle[i]) && std::isfinite(state.spin[i]));
        if (report.first_bad_node == kNoIndex && !(turns && is_finite(state.position[i]) && is_finite(state.velocity[i])))
            report.first_bad_node = static_cast<Index>(i);
    }
}

} // namespace trocar::fem
