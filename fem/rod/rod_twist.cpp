#include "fem/rod/rod_twist.hpp"

#include "base/trig.hpp"
#include "fem/rod/rod_frames.hpp"
#include "fem/rod/rod_parts.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// Area on the unit sphere, by its sign counterclockwise (Van Oosterom & Strackee 1983).
double triangle_area(const Vec3& a, const Vec3& b, const Vec3& c) noexcept {
    const double cosine = 1.0 + a.dot(b) + b.dot(c) + c.dot(a), sine = a.dot(b.cross(c));
    if (std::abs(sine) < 1e-2 * cosine) { // nearly all: half of it by the series of the arc tangent, to 1e-17
        const double t = sine / cosine, sq = t * t;
        return 2.0 * t * (1.0 - sq * (1.0 / 3.0 - sq * (1.0 / 5.0 - sq * (1.0 / 7.0))));
    }
    const double length = std::sqrt(cosine * cosine + sine * sine);
    return length > 0.0 ? 2.0 * find_angle(cosine / length, sine / length) : 0.0;
}
/// rad; an axis that is transported round a, b, c, d and back has turned by it.
double swept_area(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) noexcept { return triangle_area(a, b, c) + triangle_area(a, c, d); }

} // namespace

void size_twist_workspace(const RodModel& model, RodWorkspace& work) {
    if (model.twist_stiffness.empty() || work.turn.size() == model.node_count()) return;
    work.binormal.assign(model.node_count(), Vec3::Zero());
    work.edge.assign(model.node_count(), Vec3::Zero());
    for (auto* list :
         {&work.before, &work.after, &work.writhe, &work.start_angle, &work.diagonal, &work.beside, &work.turn})
        list->assign(model.node_count(), 0.0);
}

double RodTwist::stiffness(std::size_t i) const noexcept {
    const double k = model_.twist_stiffness[i];
    if (drive_.clamp && i + 2 == model_.node_count()) return 2.0 * k; // what a clamp holds ends in the segment's middle
    if (i + 1 != first_) return k;
    return k / inserted_share(model_, state_.insertion, first_);
}

void RodTwist::carry_frames() noexcept {
    carry_along(state_.position, frame_start(state_, drive_.port), [&](std::size_t i, const Vec3& tangent, const Vec3& axis, const Vec3& edge) {
        work_.tangent[i] = tangent;
        work_.axis[i] = axis;
        work_.edge[i] = edge;
    });
}

void RodTwist::turn_rest_bend(std::size_t i) noexcept {
    const auto& k = model_.rest_curvature[i];
    if (k[0] == 0.0 && k[1] == 0.0) return;
    const SinCos turn = sin_cos(state_.angle[i]);
    const Vec3 across = work_.tangent[i].cross(work_.axis[i]);
    const double h_sq = model_.segment * model_.segment;
    work_.rest_bend[i] = h_sq * ((k[0] * turn.cos - k[1] * turn.sin) * work_.axis[i] + (k[0] * turn.sin + k[1] * turn.cos) * across);
}

double RodTwist::torque(std::size_t i) const noexcept {
    return stiffness(i) * (state_.angle[i + 1] - state_.angle[i] + bent(i));
}

double RodTwist::torque_at(std::size_t i) const noexcept { return i < first_ ? torque(i) : 0.5 * (torque(i - 1) + torque(i)); }

double RodTwist::stiffness_at(std::size_t i) const noexcept { return i < first_ ? stiffness(i) : 0.5 * (stiffness(i - 1) + stiffness(i)); }

std::array<Vec3, 3> RodTwist::gradient(std::size_t i) const noexcept {
    const Vec3 before = work_.before[i] * work_.binormal[i], after = work_.after[i] * work_.binormal[i];
    return {-before, before - after, after};
}

TwistCurl RodTwist::curl(std::size_t i) const noexcept {
    const double a = work_.before[i], b = work_.after[i];
    const Vec3 before = a * (state_.position[i] - state_.position[i - 1]), after = b * (state_.position[i + 1] - state_.position[i]);
    const double chi = 1.0 + before.dot(after);
    const Vec3 bend = 2.0 * work_.binormal[i], middle = (before + after) / chi;
    const auto twice = [&](const Vec3& along) { return Mat3(bend * (along + middle).transpose() + (along + middle) * bend.transpose()); };
    Mat3 cross;
    cross << 0.0, -before[2], before[1], before[2], 0.0, -before[0], -before[1], before[0], 0.0;
    return {-0.25 * a * a * twice(before), -0.25 * b * b * twice(after), 0.5 * a * b * (2.0 / chi * cross - bend * middle.transpose())};
}

void RodTwist::find_writhe() noexcept {
    const std::size_t first = std::max<std::size_t>(first_, 2) - 1;
    Vec3 last = state_.position[first] - state_.position[first - 1];
    double per_last = 1.0 / std::sqrt(last.squaredNorm());
    last *= per_last;
    for (std::size_t i = first; i + 1 < model_.node_count(); ++i) {
        Vec3 edge = state_.position[i + 1] - state_.position[i];
        const double per_length = 1.0 / std::sqrt(edge.squaredNorm());
        edge *= per_length;
        const double room = 1.0 + last.dot(edge); // 0 where it folds back on itself
        const bool bends = room > 1e-3;           // not where a segment has no length, either
        work_.binormal[i] = bends ? Vec3(last.cross(edge) / room) : Vec3(Vec3::Zero());
        work_.before[i] = bends ? per_last : 0.0;
        work_.after[i] = bends ? per_length : 0.0;
        work_.writhe[i] = bends ? -swept_area(work_.edge[i - 1], last, edge, work_.edge[i]) : 0.0;
        last = edge;
        per_last = per_length;
    }
}

double RodTwist::bent(std::size_t i) const noexcept { return (i < first_ ? 1.0 : 0.5) * work_.writhe[i] + 0.5 * work_.writhe[i + 1]; }

void RodTwist::begin() noexcept {
    for (Index i = 0; i < first_; ++i) {
        state_.angle[i] = state_.rotation;
        state_.spin[i] = 0.0;
    }
    carry_frames();
    std::fill(work_.binormal.begin(), work_.binormal.end(), Vec3::Zero());
    std::fill(work_.writhe.begin(), work_.writhe.end(), 0.0);
    work_.start = state_.position; // same size: copies, never allocates
    work_.start_angle = state_.angle;
    for (std::size_t i = first_; i < model_.node_count(); ++i) state_.angle[i] += dt_ * state_.spin[i];
    for (std::size_t i = 0; i < model_.node_count(); ++i) turn_rest_bend(i);
}

/// Row of node i: its torque, and the derivative by its angle; beside[i] couples it to node i - 1.
void RodTwist::assemble_row(std::size_t i) noexcept {
    const double inertia = model_.turn_inertia[i] / (dt_ * dt_);
    const double damped = inertia * (1.0 + model_.design.drag * dt_);
    const double turned = state_.angle[i] - work_.start_angle[i];
    double sum = inertia * dt_ * state_.spin[i] - damped * turned;
    double diagonal = damped;
    work_.beside[i] = 0.0;
    if (i > 0) {
        sum -= torque(i - 1);
        diagonal += stiffness(i - 1);
        if (i > first_) work_.beside[i] = -stiffness(i - 1);
    }
    if (i + 1 < model_.node_count()) {
        sum += torque(i);
        diagonal += stiffness(i);
    }
    if (const double k = model_.bend_stiffness[i]; k > 0.0) {
        const Vec3 bend = second_difference(state_.position, i);
        sum += k * bend.dot(work_.tangent[i].cross(work_.rest_bend[i]));
        diagonal += k * std::max(0.0, bend.dot(work_.rest_bend[i])); // beyond a right angle it would make the matrix indefinite
    }
    work_.turn[i] = sum;
    work_.diagonal[i] = diagonal;
}

void RodTwist::assemble() noexcept {
    for (std::size_t i = first_; i < model_.node_count(); ++i) assemble_row(i);
    work_.turn.back() += work_.tip_torque;
    hold_tip();
}

void RodTwist::hold_tip() noexcept {
    if (!drive_.clamp || drive_.clamp->spins) return;
    work_.turn.back() = 0.0;
    work_.beside.back() = 0.0;
}

void RodTwist::turn_node(std::size_t node, double by) noexcept {
    state_.angle[node] += by;
    turn_rest_bend(node);
}

void RodTwist::solve_rows() noexcept {
    const std::size_t nodes = model_.node_count();
    for (std::size_t i = first_ + 1; i < nodes; ++i) {
        const double factor = work_.beside[i] / work_.diagonal[i - 1];
        work_.diagonal[i] -= factor * work_.beside[i];
        work_.turn[i] -= factor * work_.turn[i - 1];
    }
    double largest = 0.0;
    for (std::size_t i = nodes; i-- > first_;) {
        if (i + 1 < nodes) work_.turn[i] -= work_.beside[i + 1] * work_.turn[i + 1];
        work_.turn[i] /= work_.diagonal[i];
        largest = std::max(largest, std::abs(work_.turn[i]));
    }
    const double scale = largest > kTrustAngle ? kTrustAngle / largest : 1.0;
    for (std::size_t i = first_; i < nodes; ++i) turn_node(i, scale * work_.turn[i]);
}

/// Frames transported in time are rotated against those transported along the rod now, by what bending has twisted all before them.
void RodTwist::recount_angles() noexcept {
    double sum = 0.0;
    for (std::size_t i = first_ > 0 ? first_ : 1; i < model_.node_count(); ++i) state_.angle[i] += sum += bent(i - 1);
}

void RodTwist::end() noexcept {
    for (std::size_t i = first_; i < model_.node_count(); ++i) state_.spin[i] = (state_.angle[i] - work_.start_angle[i]) / dt_;
    recount_angles();
    std::fill(work_.writhe.begin(), work_.writhe.end(), 0.0); // it is in the angles now
}

double RodTwist::energy() const noexcept {
    double sum = 0.0;
    for (std::size_t i = first_ > 0 ? first_ - 1 : 0; i + 1 < model_.node_count(); ++i)
        sum += 0.5 * torque(i) * (state_.angle[i + 1] - state_.angle[i]); // after end(): the angles are all of it
    return sum;
}

} // namespace trocar::fem
