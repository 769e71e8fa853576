#include "fem/tissue/ties.hpp"

#include <cmath>

namespace trocar::fem {

namespace {

/// What a field of the nodes is at a tie's point in its host, less what it is at its node. at(record), host_at(record)
template <class At, class HostAt>
Vec3 across(const Tie& tie, const TieEnds& ends, At&& at, HostAt&& host_at) noexcept {
    Vec3 sum = -at(ends.plan.record_of[tie.node]);
    for (std::size_t k = 0; k < 4; ++k) sum += tie.weight[k] * host_at(ends.host_plan.record_of[tie.host[k]]);
    return sum;
}

Vec3 gap_of(const Tie& tie, const TieEnds& ends, std::span<const NodeRecord> nodes, std::span<const NodeRecord> host_nodes) noexcept {
    return across(
        tie, ends, [&](Index record) { return Vec3(nodes[record].x); }, [&](Index record) { return Vec3(host_nodes[record].x); });
}

/// The host's pull on the node, and its reaction on each of the host's corners. add(of the host, record, pull)
template <class Add>
void share_out(const Tie& tie, const TieEnds& ends, const Vec3& pull, Add&& add) noexcept {
    add(false, ends.plan.record_of[tie.node], pull);
    for (std::size_t k = 0; k < 4; ++k) add(true, ends.host_plan.record_of[tie.host[k]], Vec3(-tie.weight[k] * pull));
}

} // namespace

std::vector<double> bound_tied(std::span<const Tie> ties, const ForcePlan& plan) {
    std::vector<double> bound(plan.node_count(), 0.0);
    for (const Tie& tie : ties) bound[plan.record_of[tie.node]] += 2.0 * tie.stiffness * plan.inv_mass[plan.record_of[tie.node]];
    return bound;
}

std::vector<double> bound_hosts(std::span<const Tie> ties, const ForcePlan& plan) {
    std::vector<double> bound(plan.node_count(), 0.0);
    for (const Tie& tie : ties) {
        double reach = 0.0;
        for (std::size_t k = 0; k < 4; ++k) reach += std::abs(tie.weight[k]) * std::sqrt(plan.inv_mass[plan.record_of[tie.host[k]]]);
        for (std::size_t k = 0; k < 4; ++k) {
            const Index record = plan.record_of[tie.host[k]];
            bound[record] += 2.0 * tie.stiffness * std::abs(tie.weight[k]) * std::sqrt(plan.inv_mass[record]) * reach;
        }
    }
    return bound;
}

void kick_by_ties(std::span<const Tie> ties, const TieEnds& ends, double h, std::span<NodeRecord> nodes, std::span<NodeRecord> host_nodes) noexcept {
    for (const Tie& tie : ties) {
        const Vec3 gap = gap_of(tie, ends, nodes, host_nodes);
        share_out(tie, ends, (h * tie.stiffness) * gap, [&](bool host, Index record, const Vec3& impulse) {
            NodeRecord& to = host ? host_nodes[record] : nodes[record];
            const double per_mass = (host ? ends.host_plan : ends.plan).inv_mass[record];
            for (int axis = 0; axis < 3; ++axis) to.v[axis] += per_mass * impulse[axis];
        });
    }
}

void add_tie_forces(std::span<const Tie> ties, const TieEnds& ends, std::span<const NodeRecord> nodes, std::span<const NodeRecord> host_nodes,
                      std::span<Vec3> force, std::span<Vec3> host_force) noexcept {
    for (const Tie& tie : ties) {
        const Vec3 gap = gap_of(tie, ends, nodes, host_nodes);
        share_out(tie, ends, tie.stiffness * gap, [&](bool host, Index record, const Vec3& pull) {
            if ((host ? ends.host_plan : ends.plan).inv_mass[record] > 0.0) (host ? host_force : force)[record] += pull;
        });
    }
}

void add_tie_product(std::span<const Tie> ties, const TieEnds& ends, std::span<const Vec3> displacement, std::span<const Vec3> host_displacement,
                     std::span<Vec3> product, std::span<Vec3> host_product) noexcept {
    for (const Tie& tie : ties) {
        const Vec3 gap = across(
            tie, ends, [&](Index record) { return displacement[record]; }, [&](Index record) { return host_displacement[record]; });
        share_out(tie, ends, -tie.stiffness * gap, [&](bool host, Index record, const Vec3& back) {
            if ((host ? ends.host_plan : ends.plan).inv_mass[record] > 0.0) (host ? host_product : product)[record] += back;
        });
    }
}

} // namespace trocar::fem
