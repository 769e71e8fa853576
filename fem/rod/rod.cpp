#include "fem/rod/rod.hpp"

#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_step.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

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
        const double share = inserted_share(model, state.insertion, first);
        if (twists)
            RodStep<kTwistedCoordinates>(model, state, drive, planes, dt, first, share, work, &twist).solve(report);
        else
            RodStep<kRodCoordinates>(model, state, drive, planes, dt, first, share, work).solve(report);
        for (std::size_t i = first; i < model.node_count(); ++i) state.velocity[i] = (state.position[i] - work.start[i]) / dt;
        if (!twists) continue;
        twist.end();
        report.twist_j = twist.energy();
    }
    add_energies(model, state, first, inserted_share(model, state.insertion, first), work, report);
    return report;
}

} // namespace trocar::fem
