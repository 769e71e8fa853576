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

namespace {

/// Stages of a sub-step: the singly diagonally implicit Runge-Kutta method of order 2 that is L-stable (Alexander 1977), both of them an
/// implicit Euler step of kStage times the sub-step's length. A node that a plane touches goes on in implicit Euler steps: impact is
/// inelastic, and what rests does not chatter.
constexpr double kStage = 0.29289321881345248; // 1 - 1 / sqrt(2)
constexpr double kCarry = (1.0 - kStage) / kStage;

/// What a stage counts motion from. dt: s, from the last stage to this one; step: s, the sub-step
void begin_stage(int stage, double dt, double step, Index first, const RodState& state, RodWorkspace& work) noexcept {
    if (stage == 0) {
        work.step_start = state.position; // same sizes: copies, never allocates
        work.step_velocity = state.velocity;
    }
    for (std::size_t i = 0; i < state.position.size(); ++i) {
        work.from[i] = state.position[i];
        work.from_velocity[i] = state.velocity[i];
        work.pace[i] = dt;
        if (stage == 0 || i < first || work.touched[i] != 0) continue;
        work.from[i] = work.step_start[i] + kCarry * (state.position[i] - work.step_start[i]);
        work.from_velocity[i] = work.step_velocity[i] + kCarry * (state.velocity[i] - work.step_velocity[i]);
        work.pace[i] = kStage * step;
    }
}

/// Velocities at a stage's end, and what was touched in it. Nodes before `free_from` were behind the port when it began.
void end_stage(double dt, Index first, Index free_from, std::span<const RodPlane> planes, std::span<const RodPlane> self, RodState& state,
               RodWorkspace& work) noexcept {
    std::fill(work.touched.begin(), work.touched.end(), std::uint8_t{0});
    const auto touch = [&](Index node, double weight) {
        if (weight < 1.0) work.touched[node] = 1;
        if (weight > 0.0) work.touched[node + 1] = 1;
    };
    for (const RodPlane& plane : planes)
        if (plane.force > 0.0) touch(plane.node, plane.weight);
    for (const RodPlane& plane : self)
        if (plane.force > 0.0) touch(plane.node, plane.weight), touch(plane.other, plane.other_weight);
    for (std::size_t i = 0; i < free_from; ++i) work.touched[i] = 1;
    for (std::size_t i = first; i < state.position.size(); ++i)
        state.velocity[i] = work.touched[i] != 0 ? Vec3((state.position[i] - work.start[i]) / dt)
                                                 : Vec3((state.position[i] - work.from[i]) / work.pace[i]);
}

double kinetic_energy(const RodModel& model, const RodState& state, Index first) noexcept {
    double sum = 0.0;
    for (std::size_t i = first; i < state.velocity.size(); ++i) sum += 0.5 * model.mass[i] * state.velocity[i].squaredNorm();
    return sum;
}

/// What an iteration that did not settle moved may be no motion at all: it must not drive the rod.
void hold_back(const RodModel& model, double most_j, Index first, RodState& state) noexcept {
    const double energy = kinetic_energy(model, state, first);
    if (!(energy > most_j)) return;
    const double share = std::sqrt(most_j / energy);
    for (std::size_t i = first; i < state.velocity.size(); ++i) state.velocity[i] *= share;
}

} // namespace

RodReport solve_rod(const RodModel& model, RodState& state, double step, unsigned substeps, const RodDrive& drive,
                    std::span<RodPlane> planes, RodWorkspace& work, std::span<RodPlane> self) noexcept {
    RodReport report;
    size_workspace(model.node_count(), work);
    size_twist_workspace(model, work);
    const bool twists = !state.angle.empty();
    const double insertion_t0 = state.insertion, rotation_t0 = state.rotation;
    Index first = first_inserted_node(model, state.insertion), before = first;
    for (unsigned k = 0; k < 2 * substeps; ++k) {
        const int stage = static_cast<int>(k % 2);
        const double dt = (stage == 0 ? kStage : 1.0 - kStage) * step / substeps;
        const double fraction = (static_cast<double>(k / 2) + (stage == 0 ? kStage : 1.0)) / substeps;
        state.insertion = insertion_t0 + fraction * (drive.insertion - insertion_t0);
        state.rotation = rotation_t0 + fraction * (drive.rotation - rotation_t0);
        first = first_inserted_node(model, state.insertion);
        RodTwist twist(model, state, drive, dt, first, work);
        if (twists)
            twist.begin();
        else
            find_rest_bend(model, state, drive.port, work);
        work.start = state.position; // same size: copies, never allocates
        begin_stage(stage, dt, step / substeps, first, state, work);
        move_behind_port(model, drive.port, state.insertion, dt, first, state);
        const double share = inserted_share(model, state.insertion, first);
        bool settled = true;
        const auto advance = [&](auto&& rod_step) {
            settled = rod_step.solve(report);
            if (k + 1 == 2 * substeps) rod_step.balance(report);
        };
        if (twists)
            advance(RodStep<kTwistedCoordinates>(model, state, drive, planes, self, dt, first, share, work, &twist));
        else
            advance(RodStep<kRodCoordinates>(model, state, drive, planes, self, dt, first, share, work));
        const double energy = settled ? 0.0 : kinetic_energy(model, state, first);
        end_stage(dt, first, std::max(first, before), planes, self, state, work);
        if (!settled) hold_back(model, energy, first, state);
        before = first;
        if (!twists) continue;
        twist.end();
        report.twist_j = twist.energy();
    }
    add_energies(model, state, first, inserted_share(model, state.insertion, first), work, report);
    return report;
}

} // namespace trocar::fem
