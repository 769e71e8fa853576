#include "fem/springs.hpp"

#include <algorithm>

namespace seldinger::fem {

namespace {

/// position(node), velocity(node), push(node, force)
template <class Position, class Velocity, class Push>
SpringReport add_forces(const ContactSprings& springs, double time, Position&& position, Velocity&& velocity, Push&& push_node) noexcept {
    SpringReport report;
    for (const ContactSpring& spring : springs.springs) {
        const std::span<const SpringEntry> entries(springs.entries.data() + spring.first_entry, spring.entry_count);
        double gap = spring.offset + spring.rate * time, rate = spring.rate;
        for (const SpringEntry& entry : entries) {
            gap += entry.g.dot(position(entry.node));
            rate += entry.g.dot(velocity(entry.node));
        }
        if (!(gap < 0.0) && !spring.holds) continue;
        const double least = spring.holds ? -spring.limit : 0.0;
        const double elastic = std::clamp(-spring.stiffness * gap, least, spring.limit);
        const double drag = spring.holds || rate < 0.0 ? -spring.damping * rate : 0.0;
        const double push = std::clamp(elastic + drag, least, spring.limit);
        for (const SpringEntry& entry : entries) push_node(entry.node, push * entry.g);
        ++report.pressed;
        report.energy += elastic * (-gap - (spring.stiffness > 0.0 ? 0.5 * elastic / spring.stiffness : 0.0));
        if (gap < report.deepest_gap) report.deepest_gap = gap;
    }
    return report;
}

} // namespace

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

} // namespace seldinger::fem
