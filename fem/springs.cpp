#include "fem/springs.hpp"

namespace seldinger::fem {

SpringReport add_spring_forces(const ContactSprings& springs, std::span<const Vec3> position,
                               std::span<const Vec3> velocity, std::span<Vec3> force) noexcept {
    SpringReport report;
    for (const ContactSpring& spring : springs.springs) {
        const std::span<const SpringEntry> entries(springs.entries.data() + spring.first_entry, spring.entry_count);
        double gap = spring.offset, rate = 0.0;
        for (const SpringEntry& entry : entries) {
            gap += entry.g.dot(position[entry.node]);
            rate += entry.g.dot(velocity[entry.node]);
        }
        if (!(gap < 0.0)) continue;
        const double push = -spring.stiffness * gap + (rate < 0.0 ? -spring.damping * rate : 0.0);
        for (const SpringEntry& entry : entries) force[entry.node] += push * entry.g;
        ++report.pressed;
        report.energy += 0.5 * spring.stiffness * gap * gap;
        if (gap < report.deepest_gap) report.deepest_gap = gap;
    }
    return report;
}

} // namespace seldinger::fem
