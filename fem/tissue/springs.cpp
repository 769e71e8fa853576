#include "fem/tissue/springs.hpp"

#include <algorithm>

namespace trocar::fem {

namespace {

/// [-], of what equal extents would give: nodes in one line bear no couple about it.
constexpr double kLeastInertia = 1e-9;

struct Moment {
    double gap = 0.0, rate = 0.0;     // m, m/s
    double elastic = 0.0, push = 0.0; // N
};

/// position(node), velocity(node); bound: N, of a spring that holds
template <class Position, class Velocity>
Moment look_at(const ContactSprings& springs, const ContactSpring& spring, double time, double bound, Position&& position,
               Velocity&& velocity) noexcept {
    Moment m{spring.offset + spring.rate * time, spring.rate};
    for (Index k = spring.first_entry; k < spring.first_entry + spring.entry_count; ++k) {
        const SpringEntry& entry = springs.entries[k];
        m.gap += entry.g.dot(position(entry.node));
        m.rate += entry.g.dot(velocity(entry.node));
    }
    const bool holds = spring.load != kNoIndex;
    if (!holds && !(m.gap < 0.0)) return m;
    const double most = holds ? bound : spring.limit, least = holds ? -bound : 0.0;
    m.elastic = std::clamp(-spring.stiffness * m.gap, least, most);
    const double drag = holds || m.rate < 0.0 ? -spring.damping * m.rate : 0.0;
    m.push = std::clamp(m.elastic + drag, least, most);
    return m;
}

Moment measure_spring(const ContactSprings& springs, Index spring, double time, double bound, std::span<const Vec3> position) noexcept {
    return look_at(
        springs, springs.springs[spring], time, bound, [&](Index node) -> const Vec3& { return position[node]; },
        [](Index) -> Vec3 { return Vec3::Zero(); });
}

/// Correction of a balanced spring's forces, so that they have no moment about any point: alpha x (x_k - mean) for each N of push.
struct Couple {
    Vec3 mean = Vec3::Zero(), alpha = Vec3::Zero();
    [[nodiscard]] Vec3 at(const Vec3& x) const noexcept { return alpha.cross(x - mean); }
};

template <class Position>
Couple find_couple(const ContactSprings& springs, const ContactSpring& spring, Position&& position) noexcept {
    const std::span<const SpringEntry> entries(springs.entries.data() + spring.first_entry, spring.entry_count);
    Couple couple;
    for (const SpringEntry& entry : entries) couple.mean += position(entry.node);
    couple.mean /= static_cast<double>(spring.entry_count);
    Vec3 moment = Vec3::Zero();
    Mat3 inertia = Mat3::Zero();
    for (const SpringEntry& entry : entries) {
        const Vec3 arm = position(entry.node) - couple.mean;
        moment += arm.cross(entry.g);
        inertia += arm.squaredNorm() * Mat3::Identity() - arm * arm.transpose();
    }
    const double size = inertia.trace() / 3.0;
    if (inertia.determinant() > kLeastInertia * size * size * size) couple.alpha = -inertia.inverse() * moment;
    return couple;
}

/// push_node(node, force)
template <class Position, class Velocity, class Push>
SpringReport add_forces(const ContactSprings& springs, double time, Position&& position, Velocity&& velocity, Push&& push_node) noexcept {
    SpringReport report;
    Index before = kNoIndex; // the spring evaluated last, and its force: mostly the load of those that follow it
    double push_before = 0.0;
    for (Index index = 0; index < springs.springs.size(); ++index) {
        const ContactSpring& spring = springs.springs[index];
        double bound = 0.0;
        if (spring.load != kNoIndex) {
            if (spring.load != before) {
                before = spring.load;
                push_before = look_at(springs, springs.springs[before], time, 0.0, position, velocity).push;
            }
            bound = spring.friction * push_before;
            if (!(bound > 0.0)) continue;
        }
        const Moment m = look_at(springs, spring, time, bound, position, velocity);
        if (spring.load == kNoIndex) before = index, push_before = m.push;
        if (spring.load == kNoIndex && !(m.gap < 0.0)) continue;
        const Couple couple = spring.balanced ? find_couple(springs, spring, position) : Couple{};
        for (Index k = spring.first_entry; k < spring.first_entry + spring.entry_count; ++k) {
            const SpringEntry& entry = springs.entries[k];
            push_node(entry.node, m.push * (spring.balanced ? Vec3(entry.g + couple.at(position(entry.node))) : entry.g));
        }
        ++report.pressed;
        report.energy += m.elastic * (-m.gap - (spring.stiffness > 0.0 ? 0.5 * m.elastic / spring.stiffness : 0.0));
        if (m.gap < report.deepest_gap && spring.load == kNoIndex) report.deepest_gap = m.gap;
    }
    return report;
}

} // namespace

double find_spring_gap(const ContactSprings& springs, Index spring, double time, std::span<const Vec3> position) noexcept {
    return measure_spring(springs, spring, time, 0.0, position).gap;
}

double find_spring_push(const ContactSprings& springs, Index spring, double time, std::span<const Vec3> position) noexcept {
    const ContactSpring& s = springs.springs[spring];
    const double bound = s.load == kNoIndex ? 0.0 : s.friction * find_spring_push(springs, s.load, time, position);
    return measure_spring(springs, spring, time, bound, position).push;
}

SpringReport add_spring_forces(const ContactSprings& springs, double time, std::span<const Vec3> position, std::span<const Vec3> velocity,
                               std::span<Vec3> force) noexcept {
    return add_forces(
        springs, time, [&](Index node) -> const Vec3& { return position[node]; }, [&](Index node) -> const Vec3& { return velocity[node]; },
        [&](Index node, const Vec3& push) { force[node] += push; });
}

SpringReport add_spring_forces(const ContactSprings& springs, double time, const ForcePlan& plan, std::span<const NodeRecord> records,
                               std::span<PartialForce> force) noexcept {
    return add_forces(
        springs, time, [&](Index node) { return Vec3(records[plan.record_of[node]].x); },
        [&](Index node) { return Vec3(records[plan.record_of[node]].v); },
        [&](Index node, const Vec3& push) {
            for (int axis = 0; axis < 3; ++axis) force[plan.record_of[node]].f[axis] += push[axis];
        });
}

} // namespace trocar::fem
