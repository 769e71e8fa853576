#include "fem/rod/coaxial.hpp"

#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_step.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// Of the inner rod's segment; a node closer to the outer tip lies on its axis still, so that no piece of the chain is shorter.
constexpr double kShortestPiece = 0.25;

/// N m^2, of the inner node nearest to arc length s that bends.
double bending_at(const RodModel& model, double insertion, double s, std::size_t& node) noexcept {
    const double place = static_cast<double>(model.node_count() - 1) - (insertion - s) / model.segment;
    node = static_cast<std::size_t>(std::clamp(std::round(place), 1.0, static_cast<double>(model.node_count() - 2)));
    return model.bend_stiffness[node] * model.segment * model.segment * model.segment;
}

/// One implicit Euler step of both.
class CoaxialStep {
public:
    CoaxialStep(const CoaxialRod& outer, const CoaxialRod& inner, double dt, CoaxialWorkspace& work) noexcept
        : outer_(outer), inner_(inner), dt_(dt), work_(work), nodes_(outer.model.node_count()),
          first_(first_inserted_node(outer.model, outer.state.insertion)),
          free_(first_free_node(inner.model, inner.state.insertion, outer.state.insertion)),
          inner_first_(first_inserted_node(inner.model, inner.state.insertion)) {}

    void advance(RodReport& report) noexcept {
        RodTwist outer_twist(outer_.model, outer_.state, outer_.drive, dt_, first_, outer_.workspace);
        RodTwist inner_twist(inner_.model, inner_.state, inner_.drive, dt_, inner_first_, inner_.workspace);
        begin(outer_, outer_twist);
        begin(inner_, inner_twist);
        move_behind_port(outer_.model, outer_.drive.port, outer_.state.insertion, dt_, first_, outer_.state);
        join();
        map_planes();
        RodDrive drive = outer_.drive;
        drive.friction = std::max(outer_.drive.friction, inner_.drive.friction);
        join_flow();
        drive.flow = work_.flow;
        join_forces();
        drive.force = work_.force;
        RodStep<kRodCoordinates> step(work_.model, work_.state, drive, work_.planes, {}, dt_, first_, share(), work_.rod);
        step.solve(report);
        step.balance(report);
        part();
        end(outer_, outer_twist);
        end(inner_, inner_twist);
        return_planes();
    }

    void add_energy(RodReport& report) const noexcept { add_energies(work_.model, work_.state, first_, share(), work_.rod, report); }

private:
    [[nodiscard]] double share() const noexcept { return inserted_share(outer_.model, outer_.state.insertion, first_); }
    [[nodiscard]] std::size_t free_count() const noexcept { return inner_.model.node_count() - free_; }
    [[nodiscard]] double junction() const noexcept {
        return arc_of(inner_.model, inner_.state.insertion, static_cast<double>(free_)) - outer_.state.insertion;
    }

    static void begin(const CoaxialRod& rod, RodTwist& twist) noexcept {
        if (rod.state.angle.empty())
            find_rest_bend(rod.model, rod.state, rod.drive.port, rod.workspace);
        else
            twist.begin();
    }
    static void end(const CoaxialRod& rod, RodTwist& twist) noexcept {
        if (rod.state.angle.empty()) return;
        twist.find_writhe();
        twist.assemble();
        twist.solve_rows();
        twist.end();
    }

    /// The chain as it stands at the start of the sub-step, with its guess for the end.
    void join() noexcept {
        const std::size_t count = nodes_ + free_count();
        RodModel& chain = work_.model;
        chain.design.drag = outer_.model.design.drag;
        chain.design.transverse_drag = outer_.model.design.transverse_drag;
        chain.segment = outer_.model.segment;
        for (auto* list : {&chain.unit_edge_stiffness, &chain.mass}) list->assign(count, 0.0);
        for (auto* list : {&chain.stretch_stiffness, &chain.rest_length}) list->assign(count - 1, 0.0);
        for (auto* list : {&work_.state.position, &work_.state.velocity, &work_.rod.start, &work_.rod.rest_bend, &work_.rod.tangent,
                           &work_.rod.from, &work_.rod.from_velocity})
            list->resize(count);
        work_.rod.pace.assign(count, dt_);
        work_.rod.band.resize(3 * count * (kRodBandwidth + 1));
        for (auto* list : {&work_.rod.rhs, &work_.rod.residual}) list->resize(3 * count);
        for (std::size_t i = 0; i < nodes_; ++i) join_outer(i);
        for (std::size_t k = 0; k < free_count(); ++k) join_inner(k);
        for (std::size_t i = 1; i + 1 < count; ++i) join_bending(i);
    }

    /// Share of the outer rod's node that the inner one fills.
    [[nodiscard]] double filled(std::size_t i) const noexcept {
        const double arc = arc_of(outer_.model, outer_.state.insertion, static_cast<double>(i));
        return std::clamp((inner_.state.insertion - arc) / outer_.model.segment + 0.5, 0.0, 1.0);
    }

    void join_outer(std::size_t i) noexcept {
        RodModel& chain = work_.model;
        const double line = inner_.model.mass[1] / inner_.model.segment; // kg/m
        const double length = outer_.model.segment * (i == 0 || i + 1 == nodes_ ? 0.5 : 1.0);
        chain.mass[i] = outer_.model.mass[i] + filled(i) * line * length;
        if (i + 1 < nodes_) {
            chain.rest_length[i] = outer_.model.segment;
            chain.stretch_stiffness[i] = outer_.model.stretch_stiffness[i];
        }
        const bool moves = i >= first_;
        work_.state.velocity[i] = outer_.state.velocity[i];
        work_.rod.tangent[i] = outer_.workspace.tangent[i];
        work_.rod.start[i] = work_.rod.from[i] = outer_.state.position[i];
        work_.rod.from_velocity[i] = outer_.state.velocity[i];
        work_.state.position[i] = outer_.state.position[i] + (moves ? dt_ : 0.0) * outer_.state.velocity[i];
    }

    void join_inner(std::size_t k) noexcept {
        RodModel& chain = work_.model;
        const std::size_t i = nodes_ + k, j = free_ + k;
        const double length = k == 0 ? junction() : inner_.model.segment;
        chain.rest_length[i - 1] = length;
        chain.stretch_stiffness[i - 1] = inner_.model.stretch_stiffness[j - 1] * inner_.model.segment / length;
        chain.mass[i] = inner_.model.mass[j];
        work_.state.velocity[i] = inner_.state.velocity[j];
        work_.rod.tangent[i] = inner_.workspace.tangent[j];
        work_.rod.start[i] = work_.rod.from[i] = inner_.state.position[j];
        work_.rod.from_velocity[i] = inner_.state.velocity[j];
        work_.state.position[i] = inner_.state.position[j] + dt_ * inner_.state.velocity[j];
    }

    /// k / 2 |change of unit edge - rest|^2 with k = E I over the length that the node stands for, summed over both rods.
    void join_bending(std::size_t i) noexcept {
        const double length = 0.5 * (work_.model.rest_length[i - 1] + work_.model.rest_length[i]);
        double stiffness = 0.0;
        Vec3 moment = Vec3::Zero();
        if (i + 1 < nodes_) {
            const double h = outer_.model.segment;
            const double own = outer_.model.bend_stiffness[i] * h * h;
            stiffness += own;
            moment += own / h * outer_.workspace.rest_bend[i];
        }
        const double arc = i < nodes_ ? arc_of(outer_.model, outer_.state.insertion, static_cast<double>(i))
                                      : arc_of(inner_.model, inner_.state.insertion, static_cast<double>(free_ + i - nodes_));
        const double share = i < nodes_ ? filled(i) : 1.0;
        std::size_t node = 0;
        const double other = share * bending_at(inner_.model, inner_.state.insertion, arc, node) / length;
        const double g = inner_.model.segment;
        stiffness += other;
        moment += other * length / (g * g) * inner_.workspace.rest_bend[node];
        work_.model.unit_edge_stiffness[i] = stiffness;
        work_.rod.rest_bend[i] = stiffness > 0.0 ? Vec3(moment / stiffness) : Vec3(Vec3::Zero());
    }

    /// The part inside the outer rod's bore has no fluid drag.
    void join_flow() noexcept {
        work_.flow.clear();
        if (outer_.drive.flow.empty() || inner_.drive.flow.empty()) return;
        work_.flow.insert(work_.flow.end(), outer_.drive.flow.begin(), outer_.drive.flow.end());
        work_.flow.insert(work_.flow.end(), inner_.drive.flow.begin() + free_, inner_.drive.flow.end());
    }

    /// Inside the bore a force on the inner rod is one on the outer rod's nearest node.
    void join_forces() noexcept {
        work_.force.clear();
        const Vec3 &outer_tip = outer_.workspace.tip_force, &inner_tip = inner_.workspace.tip_force;
        if (outer_.drive.force.empty() && inner_.drive.force.empty() && outer_tip.isZero(0.0) && inner_tip.isZero(0.0)) return;
        work_.force.assign(nodes_ + free_count(), Vec3::Zero());
        std::copy(outer_.drive.force.begin(), outer_.drive.force.end(), work_.force.begin());
        work_.force[nodes_ - 1] += outer_tip;
        for (std::size_t i = 0; i < inner_.drive.force.size(); ++i) force_under(i) += inner_.drive.force[i];
        force_under(inner_.model.node_count() - 1) += inner_tip;
    }
    [[nodiscard]] Vec3& force_under(std::size_t i) noexcept {
        if (i >= free_) return work_.force[nodes_ + i - free_];
        const double arc = arc_of(inner_.model, inner_.state.insertion, static_cast<double>(i)); // from the port
        const double behind_tip = std::max(0.0, outer_.state.insertion - arc) / outer_.model.segment;
        return work_.force[nodes_ - 1 - std::min(nodes_ - 1, static_cast<std::size_t>(behind_tip + 0.5))];
    }

    /// The inner rod's planes at the same arc length of the chain.
    void map_planes() noexcept {
        const double most = std::max(outer_.drive.friction, inner_.drive.friction);
        work_.planes.clear();
        for (const RodPlane& plane : outer_.planes) {
            work_.planes.push_back(plane);
            if (most > 0.0) work_.planes.back().friction_share *= outer_.drive.friction / most;
        }
        for (const RodPlane& plane : inner_.planes) {
            const double beyond =
                arc_of(inner_.model, inner_.state.insertion, static_cast<double>(plane.node) + plane.weight) - outer_.state.insertion;
            RodPlane mapped = plane;
            if (most > 0.0) mapped.friction_share *= inner_.drive.friction / most;
            if (plane.node >= free_) {
                mapped.node = static_cast<Index>(nodes_ + plane.node - free_);
            } else if (free_count() > 0 && beyond > 0.0) {
                mapped.node = static_cast<Index>(nodes_ - 1);
                mapped.weight = std::min(1.0, beyond / junction());
            } else {
                const double place = std::max(0.0, static_cast<double>(nodes_ - 1) + std::min(0.0, beyond) / outer_.model.segment);
                mapped.node = static_cast<Index>(std::min(place, static_cast<double>(nodes_ - 2)));
                mapped.weight = place - static_cast<double>(mapped.node);
            }
            work_.planes.push_back(mapped);
        }
    }
    void return_planes() noexcept {
        std::size_t k = 0;
        for (const CoaxialRod* rod : {&outer_, &inner_})
            for (RodPlane& plane : rod->planes) {
                plane.force = work_.planes[k].force;
                plane.drag = work_.planes[k++].drag;
            }
    }

    /// The chain's end of the sub-step back into both rods.
    void part() noexcept {
        for (std::size_t i = first_; i < work_.state.position.size(); ++i)
            work_.state.velocity[i] = (work_.state.position[i] - work_.rod.start[i]) / dt_;
        for (std::size_t i = first_; i < nodes_; ++i) {
            outer_.state.position[i] = work_.state.position[i];
            outer_.state.velocity[i] = work_.state.velocity[i];
        }
        for (std::size_t j = 0; j < inner_.model.node_count(); ++j) {
            const Vec3 place = j >= free_ ? work_.state.position[nodes_ + j - free_] : place_inside(j);
            inner_.state.velocity[j] = (place - inner_.state.position[j]) / dt_;
            inner_.state.position[j] = place;
        }
    }

    /// Where the inner rod's node j lies on the outer one's axis, or on the port's behind it.
    [[nodiscard]] Vec3 place_inside(std::size_t j) const noexcept {
        const double arc = arc_of(inner_.model, inner_.state.insertion, static_cast<double>(j));
        const RodPort& port = outer_.drive.port;
        const auto& axis = outer_.state.position;
        const double place = static_cast<double>(nodes_ - 1) - (outer_.state.insertion - arc) / outer_.model.segment;
        if (arc <= 0.0 || place <= 0.0) return port.position + arc * port.direction;
        const double last = static_cast<double>(nodes_ - 1);
        if (place < last) {
            const auto node = static_cast<std::size_t>(place);
            const double weight = place - static_cast<double>(node);
            return (1.0 - weight) * axis[node] + weight * axis[node + 1];
        }
        const Vec3 ahead =
            free_count() > 0 ? Vec3(work_.state.position[nodes_] - axis[nodes_ - 1]) : Vec3(axis[nodes_ - 1] - axis[nodes_ - 2]);
        const double length = std::sqrt(ahead.squaredNorm());
        return length > 0.0 ? Vec3(axis[nodes_ - 1] + (arc - outer_.state.insertion) / length * ahead) : axis[nodes_ - 1];
    }

    const CoaxialRod &outer_, &inner_;
    double dt_;
    CoaxialWorkspace& work_;
    std::size_t nodes_;
    Index first_, free_, inner_first_;
};

} // namespace

void reserve_coaxial(const RodModel& outer, const RodModel& inner, std::size_t plane_count, CoaxialWorkspace& work) {
    const std::size_t most = outer.node_count() + inner.node_count();
    for (auto* list : {&work.model.unit_edge_stiffness, &work.model.mass, &work.model.stretch_stiffness, &work.model.rest_length})
        list->reserve(most);
    for (auto* list : {&work.state.position, &work.state.velocity, &work.rod.start, &work.rod.rest_bend, &work.rod.tangent, &work.rod.from,
                       &work.rod.from_velocity})
        list->reserve(most);
    work.rod.pace.reserve(most);
    work.rod.band.reserve(3 * most * (kRodBandwidth + 1));
    for (auto* list : {&work.rod.rhs, &work.rod.residual}) list->reserve(3 * most);
    work.rod.presses.reserve(plane_count);
    work.planes.reserve(plane_count);
    work.flow.reserve(most);
    work.force.reserve(most);
}

Index first_free_node(const RodModel& inner, double inner_insertion, double outer_insertion) noexcept {
    const double covered =
        static_cast<double>(inner.node_count() - 1) - (inner_insertion - outer_insertion) / inner.segment + kShortestPiece;
    if (!(covered > 0.0)) return 0;
    return static_cast<Index>(std::min(std::ceil(covered), static_cast<double>(inner.node_count())));
}

RodReport solve_coaxial(const CoaxialRod& outer, const CoaxialRod& inner, double step, unsigned substeps, CoaxialWorkspace& work) noexcept {
    RodReport report;
    for (const CoaxialRod* rod : {&outer, &inner}) {
        size_workspace(rod->model.node_count(), rod->workspace);
        size_twist_workspace(rod->model, rod->workspace);
    }
    const double insertion_t0[2] = {outer.state.insertion, inner.state.insertion};
    const double rotation_t0[2] = {outer.state.rotation, inner.state.rotation};
    const double dt = step / substeps;
    for (unsigned k = 1; k <= substeps; ++k) {
        const double fraction = static_cast<double>(k) / substeps;
        std::size_t which = 0;
        for (const CoaxialRod* rod : {&outer, &inner}) {
            rod->state.insertion = insertion_t0[which] + fraction * (rod->drive.insertion - insertion_t0[which]);
            rod->state.rotation = rotation_t0[which] + fraction * (rod->drive.rotation - rotation_t0[which]);
            set_tip_load(rod->drive, (k - 0.5) * dt, rod->workspace); // its mean: a step gives its integral
            ++which;
        }
        CoaxialStep joint(outer, inner, dt, work);
        joint.advance(report);
        if (k == substeps) joint.add_energy(report);
    }
    return report;
}

void part_tension(const RodModel& outer, const RodState& outer_state, const RodModel& inner, const RodState& inner_state, RodInternalForces& outer_inside,
                  RodInternalForces& inner_inside) noexcept {
    const Index free = first_free_node(inner, inner_state.insertion, outer_state.insertion);
    // Bending is by unit edges: where the joint rod's axial strain jumps, at the mouth, it pulls along the axis as well. So the next segment but one tells.
    const double at_mouth = free + 2 < inner.node_count() ? inner_inside.tension[free + 1] : 0.0; // N
    const auto first_segment = [](const RodModel& model, const RodState& state) { return std::max<Index>(first_inserted_node(model, state.insertion), 1) - 1; };
    for (std::size_t i = first_segment(inner, inner_state); i < std::min<std::size_t>(free, inner.node_count() - 1); ++i) inner_inside.tension[i] = at_mouth;
    for (std::size_t i = first_segment(outer, outer_state); i + 1 < outer.node_count(); ++i) outer_inside.tension[i] -= at_mouth;
}

} // namespace trocar::fem
