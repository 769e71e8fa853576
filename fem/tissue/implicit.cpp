#include "fem/tissue/implicit.hpp"

#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/substep.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

constexpr double kSolved = 1e-7;    // of an edge: a correction of no node is larger
constexpr double kShare = 1e-2;     // nor than this of the stage's first correction, however small that is
constexpr double kRounding = 1e-12; // of an edge: nothing is to be corrected
constexpr double kOvershoot = 0.5;  // of the slope along a Newton step: beyond it the step is shortened
constexpr double kInner = 0.03;     // of the residual's norm by A0^-1: where a linear solve ends
constexpr int kMostNewton = 25, kMostIterations = 200, kMostTrials = 8;
constexpr int kMostPolish = 6;       // Newton steps after the correction is small, for the sake of kShare
constexpr unsigned kMostParts = 64;  // of a sub-step
constexpr unsigned kMostWork = 6000; // iterations of all linear solves of a call; a call that has more is given up

double dot(std::span<const Vec3> a, std::span<const Vec3> b) noexcept {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += a[i].dot(b[i]);
    return sum;
}

/// Not finite where one of them is not.
double largest(std::span<const Vec3> field) noexcept {
    double most = 0.0;
    for (const Vec3& v : field)
        if (const double size = v.squaredNorm(); !(size <= most)) most = size;
    return std::sqrt(most);
}

/// Whether TetKernel::Stiffness is the derivative of the forces, not a bound on it.
bool has_exact_tangent(MaterialLaw law) noexcept { return law != MaterialLaw::Hgo && law != MaterialLaw::Ogden; }

/// Of one body: what acts on its nodes where they stand, and how that changes.
struct BodyStage {
    const Substep s;
    const ImplicitSystem& system;
    ImplicitWorkspace& iw;
    double reach; // s, of its implicit Euler
    double since; // s, of its end after the sub-step's start

    BodyStage(const ImplicitBody& body, double time, double reach_s, double since_s) noexcept
        : s{body.model, body.inputs, body.workspace, nullptr, body.advance.integrate, time}, system(body.system), iw(body.implicit), reach(reach_s), since(since_s) {}

    [[nodiscard]] double per_mass(std::size_t node) const noexcept { return s.model.plan.inv_mass[node]; }

    void move(std::size_t node, const Vec3& x) const noexcept {
        NodeRecord& to = s.w.stage[node];
        for (int axis = 0; axis < 3; ++axis) {
            to.x[axis] = x[axis];
            to.v[axis] = (x[axis] - iw.known[node].x[axis]) / reach;
        }
    }

    /// Into residual, N, without ties. False: not finite.
    bool find_residual() const noexcept {
        (void)find_forces(s, s.w.stage);
        const PartialForce* extra = find_extra(s, since, s.w.stage);
        const ForcePlan& plan = s.model.plan;
        const double drag = s.model.material.mass_damping;
        for (std::size_t node = 0; node < plan.node_count(); ++node) {
            Vec3& r = iw.residual[node];
            r.setZero();
            if (!(per_mass(node) > 0.0)) continue;
            r = sum_partial(plan, s.w.partial, node);
            if (extra != nullptr) r += Vec3(extra[node].f);
            const NodeRecord& now = s.w.stage[node];
            for (int axis = 0; axis < 3; ++axis)
                r[axis] += (s.inputs.gravity[axis] - drag * now.v[axis] - (now.v[axis] - iw.known[node].v[axis]) / reach) / per_mass(node);
            if (is_finite(r)) continue;
            s.report.first_bad_node = plan.node_of[node];
            s.report.first_bad_tet = measure_tets(s.model, s.w.stage, s.w.sums, 1).first_bad_tet;
            return false;
        }
        return true;
    }

    void add_kernel(TetKernel kernel, double scale) const noexcept {
        (void)run_tets(s.model.plan, make_tet_job(s.model, kernel, s.w.threads), iw.probe, s.w.partial);
        ++s.w.evaluations;
        for (std::size_t node = 0; node < iw.product.size(); ++node)
            if (per_mass(node) > 0.0) iw.product[node] -= scale * sum_partial(s.model.plan, s.w.partial, node);
    }

    /// K d by a central difference of forces: of laws whose product is a bound on their derivative, for stable steps.
    void add_difference(std::span<const Vec3> d) const noexcept {
        const double reach_m = largest(d);
        if (!(reach_m > 0.0)) return;
        const double far = 1e-6 * system.edge / reach_m;
        const TetJob job = make_tet_job(s.model, TetKernel::Force, s.w.threads);
        for (const double side : {1.0, -1.0}) {
            for (std::size_t node = 0; node < d.size(); ++node)
                for (int axis = 0; axis < 3; ++axis) iw.probe[node].x[axis] = s.w.stage[node].x[axis] + side * far * d[node][axis];
            (void)run_tets(s.model.plan, job, iw.probe, s.w.partial);
            ++s.w.evaluations;
            for (std::size_t node = 0; node < d.size(); ++node)
                if (per_mass(node) > 0.0) iw.product[node] -= side * 0.5 / far * sum_partial(s.model.plan, s.w.partial, node);
        }
        for (std::size_t node = 0; node < d.size(); ++node)
            for (int axis = 0; axis < 3; ++axis) iw.probe[node].x[axis] = s.w.stage[node].x[axis];
    }

    /// A face that turns and grows takes its pressure along. Symmetric but for the rims of what is pressed.
    void add_pressures(std::span<const Vec3> d) const noexcept {
        const ForcePlan& plan = s.model.plan;
        for (const FacePressure& face : s.inputs.pressures) {
            const Index record[3] = {plan.record_of[face.nodes[0]], plan.record_of[face.nodes[1]], plan.record_of[face.nodes[2]]};
            const Vec3 a(s.w.stage[record[0]].x), b(s.w.stage[record[1]].x), c(s.w.stage[record[2]].x);
            const Vec3 da = d[record[0]], db = d[record[1]], dc = d[record[2]];
            const Vec3 third = face.at(s.time + since) / 6.0 * ((db - da).cross(c - a) + (b - a).cross(dc - da));
            for (const Index node : record)
                if (per_mass(node) > 0.0) iw.product[node] += third;
        }
    }

    /// Branches that relax, by a difference: their forces are of third order in the places.
    void add_branches(std::span<const Vec3> d) const noexcept {
        const double reach_m = largest(d);
        if (s.w.relaxed.empty() || !(reach_m > 0.0)) return;
        const double far = 1e-4 * system.edge / reach_m;
        for (const double side : {1.0, -1.0}) {
            for (std::size_t node = 0; node < d.size(); ++node)
                for (int axis = 0; axis < 3; ++axis) iw.probe[node].x[axis] = s.w.stage[node].x[axis] + side * far * d[node][axis];
            for (PartialForce& p : iw.ahead) p = {};
            add_relaxation_forces(s.model, iw.probe, s.w.relaxed, iw.ahead, s.w.threads);
            for (std::size_t node = 0; node < d.size(); ++node)
                if (per_mass(node) > 0.0) iw.product[node] -= side * 0.5 / far * sum_partial(s.model.plan, iw.ahead, node);
        }
    }

    /// iw.product = A d, without ties
    void multiply(std::span<const Vec3> d) const noexcept {
        const double inertia = (1.0 / reach + s.model.material.mass_damping) / reach;
        for (std::size_t node = 0; node < d.size(); ++node) {
            iw.product[node] = per_mass(node) > 0.0 ? Vec3(inertia / per_mass(node) * d[node]) : Vec3(0.0, 0.0, 0.0);
            for (int axis = 0; axis < 3; ++axis) {
                iw.probe[node].x[axis] = s.w.stage[node].x[axis];
                iw.probe[node].v[axis] = d[node][axis];
            }
        }
        if (has_exact_tangent(s.model.material.law))
            add_kernel(TetKernel::Stiffness, 1.0);
        else
            add_difference(d);
        if (s.model.material.viscosity > 0.0) add_kernel(TetKernel::Damping, 1.0 / reach);
        if (s.inputs.springs != nullptr)
            add_spring_product(*s.inputs.springs, s.time + since, 1.0 / reach, s.model.plan, s.w.stage, d, iw.product);
        add_pressures(d);
        add_branches(d);
    }

    /// To iw.before + share * iw.step.
    void move_along(double share) const noexcept {
        for (std::size_t node = 0; node < iw.before.size(); ++node)
            if (per_mass(node) > 0.0) move(node, iw.before[node] + share * iw.step[node]);
    }
};

/// Of all bodies that are advanced together: their nodes' places are the unknowns of one system.
struct ImplicitStage {
    std::span<const ImplicitBody> bodies;
    std::span<const TiedBodies> ties;
    double time, reach, since; // s
    ImplicitWork& work;

    /// visit(BodyStage)
    template <class Visit>
    void each(Visit&& visit) const {
        for (const ImplicitBody& body : bodies) visit(BodyStage(body, time, reach, since));
    }
    /// visit(ImplicitWorkspace)
    template <class Visit>
    void each_workspace(Visit&& visit) const {
        for (const ImplicitBody& body : bodies) visit(body.implicit);
    }

    using Field = std::vector<Vec3> ImplicitWorkspace::*;
    [[nodiscard]] double product_of(Field a, Field b) const noexcept {
        double sum = 0.0;
        each_workspace([&](ImplicitWorkspace& iw) { sum += dot(iw.*a, iw.*b); });
        return sum;
    }
    /// Not finite where one of them is not.
    [[nodiscard]] double largest_correction() const noexcept {
        double most = 0.0;
        each_workspace([&](ImplicitWorkspace& iw) {
            if (const double size = largest(iw.correction); !(size <= most)) most = size;
        });
        return most;
    }
    [[nodiscard]] double edge() const noexcept {
        double least = bodies.front().system.edge;
        for (const ImplicitBody& body : bodies) least = std::min(least, body.system.edge);
        return least;
    }
    [[nodiscard]] TieEnds ends_of(const TiedBodies& pair) const noexcept { return {bodies[pair.body].model.plan, bodies[pair.host].model.plan}; }

    void precondition(Field right) const noexcept {
        for (const ImplicitBody& body : bodies) body.system.factor.solve(body.implicit.*right, body.implicit.correction, body.implicit.scratch);
    }

    /// Into residual, N, and correction, A0^-1 of it. False: not finite.
    bool find_residual() const noexcept {
        for (const ImplicitBody& body : bodies)
            if (!BodyStage(body, time, reach, since).find_residual()) return false;
        for (const TiedBodies& pair : ties)
            add_tie_forces(pair.ties, ends_of(pair), bodies[pair.body].workspace.stage, bodies[pair.host].workspace.stage, bodies[pair.body].implicit.residual,
                           bodies[pair.host].implicit.residual);
        precondition(&ImplicitWorkspace::residual);
        return true;
    }

    /// product = A direction
    void multiply() const noexcept {
        each([](const BodyStage& own) { own.multiply(own.iw.direction); });
        for (const TiedBodies& pair : ties) {
            ImplicitWorkspace &own = bodies[pair.body].implicit, &host = bodies[pair.host].implicit;
            add_tie_product(pair.ties, ends_of(pair), own.direction, host.direction, own.product, host.product);
        }
    }

    /// step = A^-1 residual, to kInner; correction holds A0^-1 of the residual. Leaves residual as it was.
    unsigned solve(double size) const noexcept {
        each_workspace([](ImplicitWorkspace& iw) {
            for (Vec3& x : iw.step) x.setZero();
            std::copy(iw.correction.begin(), iw.correction.end(), iw.direction.begin());
            std::copy(iw.residual.begin(), iw.residual.end(), iw.before.begin()); // what is left
        });
        const double wanted = kInner * kInner * size;
        double now = size;
        unsigned count = 0;
        while (count < kMostIterations && now > wanted) {
            multiply();
            const double bend = product_of(&ImplicitWorkspace::direction, &ImplicitWorkspace::product);
            if (!(bend > 0.0) || !std::isfinite(bend)) { // no minimum along this way
                if (count == 0) each_workspace([](ImplicitWorkspace& iw) { std::copy(iw.direction.begin(), iw.direction.end(), iw.step.begin()); });
                break;
            }
            ++count;
            const double along = now / bend;
            each([&](const BodyStage& own) {
                for (std::size_t node = 0; node < own.iw.step.size(); ++node) {
                    own.iw.step[node] += along * own.iw.direction[node];
                    if (own.per_mass(node) > 0.0) own.iw.before[node] -= along * own.iw.product[node];
                }
            });
            precondition(&ImplicitWorkspace::before);
            const double next = product_of(&ImplicitWorkspace::before, &ImplicitWorkspace::correction), share = next / now;
            now = next;
            each_workspace([&](ImplicitWorkspace& iw) {
                for (std::size_t node = 0; node < iw.step.size(); ++node) iw.direction[node] = iw.correction[node] + share * iw.direction[node];
            });
        }
        return count;
    }

    void forget_bad() const noexcept {
        for (const ImplicitBody& body : bodies) body.advance.integrate.first_bad_node = body.advance.integrate.first_bad_tet = kNoIndex;
    }

    enum class Outcome : std::uint8_t { Solved, NotFinite, Stuck };

    /// The workspaces' stages hold a guess, and then where the stage ends.
    Outcome run() const noexcept {
        if (!find_residual()) return Outcome::NotFinite;
        double size = product_of(&ImplicitWorkspace::residual, &ImplicitWorkspace::correction);
        const double small = kSolved * edge(), rounding = kRounding * edge();
        const double wanted = std::clamp(kShare * largest_correction(), rounding, small);
        if (largest_correction() <= rounding) return Outcome::Solved;
        int polish = 0;
        for (int round = 0; round < kMostNewton && work.iterations < kMostWork; ++round) {
            const double left = largest_correction();
            if (round > 0 && left <= wanted) return Outcome::Solved;
            if (left <= small && polish++ == kMostPolish) return Outcome::Solved;
            ++work.newton;
            work.iterations += solve(size);
            for (const ImplicitBody& body : bodies)
                for (std::size_t node = 0; node < body.implicit.before.size(); ++node) body.implicit.before[node] = Vec3(body.workspace.stage[node].x);
            const double downhill = product_of(&ImplicitWorkspace::residual, &ImplicitWorkspace::step);
            if (!(downhill > 0.0)) return left <= small ? Outcome::Solved : Outcome::Stuck;
            double share = 1.0;
            for (int trial = 0;; ++trial) {
                each([&](const BodyStage& own) { own.move_along(share); });
                const bool finite = find_residual();
                const double slope = finite ? product_of(&ImplicitWorkspace::residual, &ImplicitWorkspace::step) : 0.0;
                if (finite && slope >= -kOvershoot * downhill) break;
                if (trial == kMostTrials) {
                    forget_bad();
                    return finite && largest_correction() <= small ? Outcome::Solved : Outcome::Stuck;
                }
                share *= finite ? std::clamp(downhill / (downhill - slope), 0.1, 0.7) : 0.25;
            }
            size = product_of(&ImplicitWorkspace::residual, &ImplicitWorkspace::correction);
            forget_bad(); // a place that was tried and not taken
        }
        return largest_correction() <= small ? Outcome::Solved : Outcome::Stuck;
    }
};

void size_workspace(const TissueModel& model, ImplicitWorkspace& iw) {
    const std::size_t count = model.node_count();
    for (std::vector<NodeRecord>* array : {&iw.known, &iw.probe}) array->resize(count);
    for (std::vector<Vec3>* array : {&iw.residual, &iw.correction, &iw.direction, &iw.product, &iw.step, &iw.before})
        array->resize(count, Vec3::Zero());
    iw.scratch.resize(count);
    if (relaxation_size(model) > 0) iw.ahead.resize(model.plan.slots.size());
}

/// known(node, axis): where the stage begins from; at: s, of its end.
template <class Known>
void begin_stage(const BodyStage& own, double at, Known&& known) noexcept {
    for (std::size_t node = 0; node < own.iw.known.size(); ++node) {
        const NodeRecord& from = own.s.w.start[node];
        NodeRecord& to = own.s.w.stage[node];
        own.iw.known[node] = {};
        for (int axis = 0; axis < 3; ++axis) known(node, axis);
        const bool free = own.per_mass(node) > 0.0;
        for (int axis = 0; axis < 3; ++axis) {
            const double v = free ? to.v[axis] : from.v[axis];
            to.x[axis] = free ? own.iw.known[node].x[axis] + own.reach * v : from.x[axis] + at * v;
            to.v[axis] = v;
        }
    }
}

void begin_first(const BodyStage& own) noexcept {
    begin_stage(own, own.since, [&](std::size_t node, int axis) {
        const NodeRecord& from = own.s.w.start[node];
        own.iw.known[node].x[axis] = from.x[axis];
        own.iw.known[node].v[axis] = own.s.w.stage[node].v[axis] = from.v[axis];
    });
}

/// From where the first one ended, of a sub-step of own.since.
void begin_second(const BodyStage& own) noexcept {
    begin_stage(own, own.since, [&](std::size_t node, int axis) {
        const NodeRecord& from = own.s.w.start[node];
        const double v = own.s.w.stage[node].v[axis];
        own.iw.known[node].x[axis] = from.x[axis] + (1.0 - kStageShare) * own.since * v;
        own.iw.known[node].v[axis] = from.v[axis] + (1.0 - kStageShare) / kStageShare * (v - from.v[axis]);
    });
}

/// One sub-step of the workspaces' starts over h. Not Solved: they were left as they were.
ImplicitStage::Outcome take(std::span<const ImplicitBody> bodies, std::span<const TiedBodies> ties, double time, double h, ImplicitWork& work) noexcept {
    const double reach = kStageShare * h;
    const ImplicitStage first{bodies, ties, time, reach, reach, work};
    first.each(begin_first);
    if (const ImplicitStage::Outcome outcome = first.run(); outcome != ImplicitStage::Outcome::Solved) return outcome;
    const ImplicitStage second{bodies, ties, time, reach, h, work};
    second.each(begin_second);
    if (const ImplicitStage::Outcome outcome = second.run(); outcome != ImplicitStage::Outcome::Solved) return outcome;
    for (const ImplicitBody& body : bodies) {
        std::swap(body.workspace.start, body.workspace.stage);
        follow_relaxation(body.model, body.workspace, h);
    }
    return ImplicitStage::Outcome::Solved;
}

bool all_finite(std::span<const ImplicitBody> bodies) noexcept {
    return std::all_of(bodies.begin(), bodies.end(), [](const ImplicitBody& body) { return body.advance.integrate.finite(); });
}

} // namespace

ImplicitWork advance_implicitly(std::span<const ImplicitBody> bodies, std::span<const TiedBodies> ties, double step, unsigned substeps) {
    ImplicitWork work;
    for (const ImplicitBody& body : bodies) {
        body.advance = {};
        begin_substeps(body.model, body.state, step, body.inputs, body.workspace, body.advance.integrate);
        size_workspace(body.model, body.implicit);
    }
    const double whole = step / substeps, shortest = whole / kMostParts;
    double time = 0.0, h = whole;
    while (all_finite(bodies) && step - time > 1e-12 * step) {
        h = std::min(h, step - time);
        const ImplicitStage::Outcome outcome = take(bodies, ties, time, h, work);
        if (outcome == ImplicitStage::Outcome::Solved) {
            for (const ImplicitBody& body : bodies) {
                ++body.advance.integrate.substeps_done;
                body.advance.last_substep = h;
                if (body.advance.tightest.step == 0.0 || h < body.advance.tightest.step) body.advance.tightest.step = h;
            }
            time = step - time - h > 1e-9 * step ? time + h : step;
            h = std::min(2.0 * h, whole);
            continue;
        }
        if (h <= 1.5 * shortest || work.iterations >= kMostWork) {
            for (const ImplicitBody& body : bodies) {
                if (outcome == ImplicitStage::Outcome::Stuck) work.unsolved = std::max(work.unsolved, largest(body.implicit.correction));
                body.advance.refused = outcome == ImplicitStage::Outcome::Stuck;
                body.advance.last_substep = h;
            }
            break;
        }
        for (const ImplicitBody& body : bodies) {
            body.advance.integrate.first_bad_node = body.advance.integrate.first_bad_tet = kNoIndex;
            ++body.advance.rejected;
        }
        h *= 0.5;
    }
    for (const ImplicitBody& body : bodies) {
        body.advance.time_done = time;
        finish_substeps(body.model, body.state, body.inputs, time == step, body.workspace, body.advance.integrate);
    }
    return work;
}

ImplicitReport advance_implicitly(const TissueModel& model, const ImplicitSystem& system, TissueState& state, double step, unsigned substeps,
                                  const IntegrateInputs& inputs, RkWorkspace& workspace, ImplicitWorkspace& implicit) {
    ImplicitReport report;
    const ImplicitBody body{model, system, state, inputs, workspace, implicit, report.advance};
    static_cast<ImplicitWork&>(report) = advance_implicitly(std::span(&body, 1), {}, step, substeps);
    return report;
}

} // namespace trocar::fem
