#include "fem/tissue/springs.hpp"

#include <algorithm>

namespace trocar::fem {

namespace {

struct Moment {
    double gap = 0.0, rate = 0.0;     // m, m/s
    double stiffness = 0.0;           // N/m
    double elastic = 0.0, push = 0.0; // N
};

/// position(node), velocity(node)
template <class Position, class Velocity>
Moment measure(const ContactSprings& springs, const ContactSpring& spring, double time, Position&& position, Velocity&& velocity) noexcept {
    Moment m{spring.offset + spring.rate * time, spring.rate, spring.stiffness_at(time)};
    for (Index k = spring.first_entry; k < spring.first_entry + spring.entry_count; ++k) {
        const SpringEntry& entry = springs.entries[k];
        m.gap += entry.g.dot(position(entry.node));
        m.rate += entry.g.dot(velocity(entry.node));
    }
    if (!(m.gap < 0.0)) return m;
    m.elastic = std::clamp(-m.stiffness * m.gap, 0.0, spring.limit);
    const double drag = m.rate < 0.0 ? -spring.damping * m.rate : 0.0;
    m.push = std::clamp(m.elastic + drag, 0.0, spring.limit);
    return m;
}

/// push_node(node, force)
template <class Position, class Velocity, class Push>
SpringReport add_forces(const ContactSprings& springs, double time, Position&& position, Velocity&& velocity, Push&& push_node) noexcept {
    SpringReport report;
    for (const ContactSpring& spring : springs.springs) {
        const Moment m = measure(springs, spring, time, position, velocity);
        if (!(m.gap < 0.0)) continue;
        for (Index k = spring.first_entry; k < spring.first_entry + spring.entry_count; ++k)
            push_node(springs.entries[k].node, m.push * springs.entries[k].g);
        ++report.pressed;
        report.energy += m.elastic * (-m.gap - (m.stiffness > 0.0 ? 0.5 * m.elastic / m.stiffness : 0.0));
        report.deepest_gap = std::min(report.deepest_gap, m.gap);
    }
    return report;
}

} // namespace

void append_springs(const ContactSprings& from, ContactSprings& to) {
    const auto shift = static_cast<Index>(to.entries.size());
    to.entries.insert(to.entries.end(), from.entries.begin(), from.entries.end());
    for (const ContactSpring& spring : from.springs) to.springs.emplace_back(spring).first_entry += shift;
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

void add_spring_product(const ContactSprings& springs, double time, double per_second, const ForcePlan& plan, std::span<const NodeRecord> records,
                        std::span<const Vec3> displacement, std::span<Vec3> product) noexcept {
    for (const ContactSpring& spring : springs.springs) {
        const Moment m = measure(
            springs, spring, time, [&](Index node) { return Vec3(records[plan.record_of[node]].x); },
            [&](Index node) { return Vec3(records[plan.record_of[node]].v); });
        if (!(m.gap < 0.0) || !(m.push < spring.limit)) continue;
        const double slope = m.stiffness + (m.rate < 0.0 ? spring.damping * per_second : 0.0);
        const auto entries = std::span(springs.entries).subspan(spring.first_entry, spring.entry_count);
        double closer = 0.0;
        for (const SpringEntry& entry : entries) closer += entry.g.dot(displacement[plan.record_of[entry.node]]);
        for (const SpringEntry& entry : entries)
            if (plan.inv_mass[plan.record_of[entry.node]] > 0.0) product[plan.record_of[entry.node]] += slope * closer * entry.g;
    }
}

} // namespace trocar::fem
