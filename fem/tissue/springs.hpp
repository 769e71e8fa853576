// One-sided contact springs on the nodes: the only form in which contact reaches the tissue. engine/step makes them from
// contacts through the transposed links; fem is independent of contacts, other bodies and budgets.
#pragma once

#include "fem/tissue/force_plan.hpp"

#include <limits>
#include <span>
#include <vector>

namespace trocar::fem {

struct SpringEntry {
    Index node = 0;
    Vec3 g = Vec3::Zero(); // d gap / d x_node, [-]
};

/// gap(x, t) = offset + rate t + sum_k g_k . x_k. Where gap < 0 node k feels N g_k with N = stiffness (-gap) + damping
/// max(0, -d gap/dt), at most `limit`. Damping acts on approach only, so that N >= 0 always: a spring pushes and never sticks.
struct ContactSpring {
    Index first_entry = 0;                                  // into ContactSprings::entries
    std::uint16_t entry_count = 0;                          // coarse nodes it acts on, 3 for a linked vertex
    double offset = 0.0;                                    // m
    double rate = 0.0;                                      // m/s, prescribed motion of the obstacle; < 0: it approaches
    double stiffness = 0.0;                                 // N/m, >= 0, the most in the step
    double share = 1.0, share_rate = 0.0;                   // [-], 1/s, of it at the start of the step, and from then on; from 0 to 1
    double damping = 0.0;                                   // N s/m, >= 0
    double limit = std::numeric_limits<double>::infinity(); // N, >= 0

    [[nodiscard]] double stiffness_at(double time) const noexcept { return stiffness * (share + share_rate * time); }
};

struct ContactSprings {
    std::vector<ContactSpring> springs;
    std::vector<SpringEntry> entries;
    std::span<const double> tied; // [node_count] 1/s^2, by record: what ties to other bodies add to a stable step's bound (ties.hpp); empty: none

    void clear() noexcept {
        springs.clear();
        entries.clear();
    }
};

/// All of `from` behind those of `to`.
void append_springs(const ContactSprings& from, ContactSprings& to);

struct SpringReport {
    std::uint32_t pressed = 0; // springs with a negative gap
    double energy = 0.0;       // J, stored energy of the pressed ones: 1/2 stiffness gap^2 up to their limit
    double deepest_gap = 0.0;  // m, <= 0
};

/// Adds the force of every pressed spring. position, velocity, force [node_count]; entries name nodes below node_count.
/// time: s since the springs were made
SpringReport add_spring_forces(const ContactSprings& springs, double time, std::span<const Vec3> position, std::span<const Vec3> velocity,
                               std::span<Vec3> force) noexcept;

/// The same on records in the plan's order; entries name nodes in the caller's.
SpringReport add_spring_forces(const ContactSprings& springs, double time, const ForcePlan& plan, std::span<const NodeRecord> records,
                               std::span<PartialForce> force) noexcept;

/// Adds what a displacement of the nodes takes from the force of every pressed spring, and of its drag, if it comes about at `per_second` (1/s).
/// records: where the springs are pressed; displacement, product [node_count] by record
void add_spring_product(const ContactSprings& springs, double time, double per_second, const ForcePlan& plan, std::span<const NodeRecord> records,
                        std::span<const Vec3> displacement, std::span<Vec3> product) noexcept;

} // namespace trocar::fem
