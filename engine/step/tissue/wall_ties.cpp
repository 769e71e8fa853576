#include "engine/step/tissue/wall_ties.hpp"

#include <algorithm>

namespace trocar::engine {

void list_ties(const SceneModel& model, std::span<const std::size_t> members, std::vector<fem::TiedBodies>& ties) {
    ties.clear();
    const auto place_of = [&](std::size_t body) { return static_cast<std::size_t>(std::lower_bound(members.begin(), members.end(), body) - members.begin()); };
    for (std::size_t k = 0; k < members.size(); ++k)
        if (const std::optional<WallJoint>& joint = model.bodies[members[k]].joint) ties.push_back({k, place_of(joint->host), joint->ties});
}

void kick_ties(std::span<const fem::TiedBodies> ties, double h, std::span<fem::TissueLockstep> bodies) noexcept {
    for (const fem::TiedBodies& pair : ties) {
        fem::TissueLockstep &own = bodies[pair.body], &host = bodies[pair.host];
        fem::kick_by_ties(pair.ties, {own.model().plan, host.model().plan}, h, own.nodes(), host.nodes());
    }
}

double tie_energy(const SceneModel& model, const State& state) noexcept {
    double energy = 0.0;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const std::optional<WallJoint>& joint = model.bodies[i].joint;
        if (!joint) continue;
        const std::vector<Vec3>&own = state.bodies[i].tissue.position, &host = state.bodies[joint->host].tissue.position;
        for (const fem::Tie& tie : joint->ties) {
            Vec3 gap = -own[tie.node];
            for (std::size_t k = 0; k < 4; ++k) gap += tie.weight[k] * host[tie.host[k]];
            energy += 0.5 * tie.stiffness * gap.squaredNorm();
        }
    }
    return energy;
}

} // namespace trocar::engine
