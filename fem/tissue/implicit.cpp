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

struct ImplicitStage {
    const Substep& s;
    const ImplicitSystem& system;
    ImplicitWorkspace& iw;
    double reach; // s, of its implicit Euler
    double since; // s, of its end after the sub-step's start

    [[nodiscard]] double per_mass(std::size_t node) const noexcept { return s.model.plan.inv_mass[node]; }

    void move(std::size_t node, const Vec3& x) const noexcept {
        NodeRecord& to = s.w.stage[node];
        for (int axis = 0; axis < 3; ++axis) {
            to.x[axis] = x[axis];
            to.v[axis] = (x[axis] - iw.known[node].x[axis]) / reach;
        }
    }

    /// Into residual, N, and correction, A0^-1 of it. False: not finite.
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
        system.factor.solve(iw.residual, iw.correction, iw.scratch);
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
            const Vec3 third = face.pressure / 6.0 * ((db - da).cross(c - a) + (b - a).cross(dc - da));
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

    /// iw.product = A d
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

    /// iw.step = A^-1 residual, to kInner; correction holds A0^-1 of the residual. Leaves residual as it was.
    unsigned solve(double size) const noexcept {
        for (Vec3& x : iw.step) x.setZero();
        std::copy(iw.correction.begin(), iw.correction.end(), iw.direction.begin());
        std::copy(iw.residual.begin(), iw.residual.end(), iw.before.begin()); // what is left
        const double wanted = kInner * kInner * size;
        double now = size;
        unsigned count = 0;
        while (count < kMostIterations && now > wanted) {
            multiply(iw.direction);
            const double bend = dot(iw.direction, iw.product);
            if (!(bend > 0.0) || !std::isfinite(bend)) { // no minimum along this way
                if (count == 0) std::copy(iw.direction.begin(), iw.direction.end(), iw.step.begin());
                break;
            }
            ++count;
            const double along = now / bend;
            for (std::size_t node = 0; node < iw.step.size(); ++node) {
                iw.step[node] += along * iw.direction[node];
                if (per_mass(node) > 0.0) iw.before[node] -= along * iw.product[node];
            }
            system.factor.solve(iw.before, iw.correction, iw.scratch);
            const double next = dot(iw.before, iw.correction), share = next / now;
            now = next;
            for (std::size_t node = 0; node < iw.step.size(); ++node) iw.direction[node] = iw.correction[node] + share * iw.direction[node];
        }
        return count;
    }

    void forget_bad() const noexcept { s.report.first_bad_node = s.report.first_bad_tet = kNoIndex; }

    enum class Outcome : std::uint8_t { Solved, NotFinite, Stuck };

    /// w.stage holds a guess, and then where the stage ends.
    Outcome run(ImplicitReport& report) const noexcept {
        if (!find_residual()) return Outcome::NotFinite;
        double size = dot(iw.residual, iw.correction);
        const double small = kSolved * system.edge;
        const double wanted = std::clamp(kShare * largest(iw.correction), kRounding * system.edge, small);
        if (largest(iw.correction) <= kRounding * system.edge) return Outcome::Solved;
        int polish = 0;
        for (int round = 0; round < kMostNewton && report.iterations < kMostWork; ++round) {
            const double left = largest(iw.correction);
            if (round > 0 && left <= wanted) return Outcome::Solved;
            if (left <= small && polish++ == kMostPolish) return Outcome::Solved;
            ++report.newton;
            report.iterations += solve(size);
            for (std::size_t node = 0; node < iw.before.size(); ++node) iw.before[node] = Vec3(s.w.stage[node].x);
            const double downhill = dot(iw.residual, iw.step);
            if (!(downhill > 0.0)) return left <= small ? Outcome::Solved : Outcome::Stuck;
            double share = 1.0;
            for (int trial = 0;; ++trial) {
                for (std::size_t node = 0; node < iw.before.size(); ++node)
                    if (per_mass(node) > 0.0) move(node, iw.before[node] + share * iw.step[node]);
                const bool finite = find_residual();
                const double slope = finite ? dot(iw.residual, iw.step) : 0.0;
                if (finite && slope >= -kOvershoot * downhill) break;
                if (trial == kMostTrials) {
                    forget_bad();
                    return finite && largest(iw.correction) <= small ? Outcome::Solved : Outcome::Stuck;
                }
                share *= finite ? std::clamp(downhill / (downhill - slope), 0.1, 0.7) : 0.25;
            }
            size = dot(iw.residual, iw.correction);
            forget_bad(); // a place that was tried and not taken
        }
        return largest(iw.correction) <= small ? Outcome::Solved : Outcome::Stuck;
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

/// One sub-step of w.start over h. Not Solved: it was left as it was.
ImplicitStage::Outcome take(const Substep& s, const ImplicitSystem& system, ImplicitWorkspace& iw, double h, ImplicitReport& report) noexcept {
    const double reach = kStageShare * h;
    const auto begin = [&](double at, auto&& known) { // at: s, of the stage's end
        for (std::size_t node = 0; node < iw.known.size(); ++node) {
            const NodeRecord& from = s.w.start[node];
            NodeRecord& to = s.w.stage[node];
            iw.known[node] = {};
            for (int axis = 0; axis < 3; ++axis) known(node, axis);
            const bool free = s.model.plan.inv_mass[node] > 0.0;
            for (int axis = 0; axis < 3; ++axis) {
                const double v = free ? to.v[axis] : from.v[axis];
                to.x[axis] = free ? iw.known[node].x[axis] + reach * v : from.x[axis] + at * v;
                to.v[axis] = v;
            }
        }
    };
    begin(reach, [&](std::size_t node, int axis) {
        const NodeRecord& from = s.w.start[node];
        iw.known[node].x[axis] = from.x[axis];
        iw.known[node].v[axis] = s.w.stage[node].v[axis] = from.v[axis];
    });
    const ImplicitStage first{s, system, iw, reach, reach};
    if (const ImplicitStage::Outcome outcome = first.run(report); outcome != ImplicitStage::Outcome::Solved) return outcome;
    begin(h, [&](std::size_t node, int axis) {
        const NodeRecord& from = s.w.start[node];
        const double v = s.w.stage[node].v[axis];
        iw.known[node].x[axis] = from.x[axis] + (1.0 - kStageShare) * h * v;
        iw.known[node].v[axis] = from.v[axis] + (1.0 - kStageShare) / kStageShare * (v - from.v[axis]);
    });
    const ImplicitStage second{s, system, iw, reach, h};
    if (const ImplicitStage::Outcome outcome = second.run(report); outcome != ImplicitStage::Outcome::Solved) return outcome;
    std::swap(s.w.start, s.w.stage);
    follow_relaxation(s.model, s.w, h);
    return ImplicitStage::Outcome::Solved;
}

} // namespace

ImplicitReport advance_implicitly(const TissueModel& model, const ImplicitSystem& system, TissueState& state, double step, unsigned substeps,
                                  const IntegrateInputs& inputs, RkWorkspace& w, ImplicitWorkspace& iw) {
    ImplicitReport report;
    AdvanceReport& advance = report.advance;
    begin_substeps(model, state, step, inputs, w, advance.integrate);
    size_workspace(model, iw);
    const double whole = step / substeps, shortest = whole / kMostParts;
    double time = 0.0, h = whole;
    while (advance.integrate.finite() && step - time > 1e-12 * step) {
        h = std::min(h, step - time);
        const ImplicitStage::Outcome outcome = take({model, inputs, w, nullptr, advance.integrate, time}, system, iw, h, report);
        if (outcome == ImplicitStage::Outcome::Solved) {
            ++advance.integrate.substeps_done;
            advance.last_substep = h;
            if (advance.tightest.step == 0.0 || h < advance.tightest.step) advance.tightest.step = h;
            time = step - time - h > 1e-9 * step ? time + h : step;
            h = std::min(2.0 * h, whole);
            continue;
        }
        if (h <= 1.5 * shortest || report.iterations >= kMostWork) {
            if (outcome == ImplicitStage::Outcome::Stuck) report.unsolved = largest(iw.correction);
            advance.refused = outcome == ImplicitStage::Outcome::Stuck;
            advance.last_substep = h;
            break;
        }
        advance.integrate.first_bad_node = advance.integrate.first_bad_tet = kNoIndex;
        ++advance.rejected;
        h *= 0.5;
    }
    advance.time_done = time;
    finish_substeps(model, state, inputs, time == step, w, advance.integrate);
    return report;
}

} // namespace trocar::fem
