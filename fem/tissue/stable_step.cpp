#include "fem/tissue/stable_step.hpp"

#include "fem/tissue/relaxation.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// Uniform in [-1, 1), the same for the same number on every machine (splitmix64, Steele et al. 2014).
double scatter_number(std::uint64_t number) noexcept {
    std::uint64_t z = (number + 1) * 0x9e3779b97f4a7c15ULL;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return static_cast<double>(static_cast<std::int64_t>(z ^ (z >> 31))) * 0x1p-63;
}

double find_norm(std::span<const Vec3> v) noexcept {
    double sum = 0.0;
    for (const Vec3& entry : v) sum += entry.squaredNorm();
    return std::sqrt(sum);
}

/// Unit length, every node present: the old mode plus a tenth of noise, so that a mode that arises elsewhere is found too.
void prepare_mode(std::vector<Vec3>& mode, const ForcePlan& plan, std::span<const double> root_inv_mass, bool warm) noexcept {
    if (!warm) mode.assign(root_inv_mass.size(), Vec3::Zero());
    const double share = warm ? 0.1 / std::sqrt(static_cast<double>(mode.size())) : 1.0;
    for (std::size_t node = 0; node < mode.size(); ++node)
        for (int axis = 0; axis < 3; ++axis)
            if (root_inv_mass[node] > 0.0)
                mode[node][axis] += share * scatter_number(3 * std::uint64_t{plan.node_of[node]} + static_cast<std::uint64_t>(axis));
    const double norm = find_norm(mode);
    if (norm > 0.0)
        for (Vec3& entry : mode) entry /= norm;
}

struct Eigenvalue {
    double value = 0.0; // estimate from below of the largest |eigenvalue| of M^-1/2 A M^-1/2
    Index worst_tet = kNoIndex;
};

/// Power iteration with a kernel that gives -A v. The norm of A y for a unit y is the better estimate: it lies between the
/// Rayleigh quotient and the eigenvalue.
Eigenvalue iterate(const TissueModel& model, TetKernel kernel, std::vector<Vec3>& mode, StableStepWorkspace& w, int rounds) noexcept {
    Eigenvalue result;
    const TetJob job = make_tet_job(model, kernel, w.threads);
    for (int round = 0; round < rounds; ++round) {
        for (std::size_t node = 0; node < mode.size(); ++node)
            for (int axis = 0; axis < 3; ++axis) w.records[node].v[axis] = w.root_inv_mass[node] * mode[node][axis];
        const Extremes found = run_tets(model.plan, job, w.records, w.partial);
        result.worst_tet = found.high_place == kNoIndex ? kNoIndex : model.plan.tet_of[found.high_place];
        for (std::size_t node = 0; node < mode.size(); ++node)
            w.product[node] = -w.root_inv_mass[node] * sum_partial(model.plan, w.partial, node);
        const double norm = find_norm(w.product);
        result.value = norm;
        if (!(norm > 0.0) || !std::isfinite(norm)) return result;
        const double per_norm = 1.0 / norm;
        for (std::size_t node = 0; node < mode.size(); ++node) mode[node] = per_norm * w.product[node];
    }
    return result;
}

/// Largest row sum of M^-1/2 (sum_s k_s g_s g_s^T) M^-1/2 by nodes: no eigenvalue is larger (Gershgorin, block norms).
/// All springs count, pressed or not: any may be within the step.
struct SpringBound {
    double stiffness = 0.0, damping = 0.0;
};

/// Of one spring: the sum over its nodes that multiplies each node's own share.
double find_reach(const ForcePlan& plan, std::span<const SpringEntry> entries, const StableStepWorkspace& w) noexcept {
    double reach = 0.0;
    for (const SpringEntry& entry : entries) reach += entry.g.norm() * w.root_inv_mass[plan.record_of[entry.node]];
    return reach;
}

std::span<const SpringEntry> entries_of(const ContactSprings& springs, const ContactSpring& spring) noexcept {
    return {springs.entries.data() + spring.first_entry, spring.entry_count};
}

SpringBound bound_springs(const ForcePlan& plan, const ContactSprings& springs, StableStepWorkspace& w) noexcept {
    for (std::size_t node = 0; node < w.row.size(); ++node) {
        w.row[node] = springs.tied.empty() ? 0.0 : springs.tied[node];
        w.damping_row[node] = 0.0;
    }
    for (const ContactSpring& spring : springs.springs) {
        const std::span<const SpringEntry> entries = entries_of(springs, spring);
        const double reach = find_reach(plan, entries, w);
        for (const SpringEntry& entry : entries) {
            const Index node = plan.record_of[entry.node];
            const double share = entry.g.norm() * w.root_inv_mass[node] * reach;
            w.row[node] += spring.stiffness * share;
            w.damping_row[node] += spring.damping * share;
        }
    }
    SpringBound bound;
    for (std::size_t node = 0; node < w.row.size(); ++node) {
        if (!(w.row[node] <= bound.stiffness)) bound.stiffness = w.row[node]; // keeps a NaN, to be reported
        if (!(w.damping_row[node] <= bound.damping)) bound.damping = w.damping_row[node];
    }
    return bound;
}

/// What follows from the model alone.
void size_workspace(const TissueModel& model, StableStepWorkspace& w) {
    const std::size_t count = model.node_count();
    w.root_inv_mass.resize(count);
    for (std::size_t node = 0; node < count; ++node) w.root_inv_mass[node] = std::sqrt(model.plan.inv_mass[node]);
    w.records.resize(count);
    w.partial.resize(model.plan.slots.size());
    w.product.resize(count);
    w.row.resize(count);
    w.damping_row.resize(count);
}

void prepare_workspace(const TissueModel& model, StableStepWorkspace& w) {
    const std::size_t count = model.node_count();
    if (w.mode.size() != count) w.warm = false;
    size_workspace(model, w);
    const bool viscous = model.material.viscosity > 0.0, both_warm = w.warm && w.damping_mode.size() == count;
    if (w.rounds_ahead > 0 && (viscous ? both_warm : w.warm)) return; // the next modes are being iterated
    w.rounds_ahead = 0;
    prepare_mode(w.mode, model.plan, w.root_inv_mass, w.warm);
    if (viscous) prepare_mode(w.damping_mode, model.plan, w.root_inv_mass, both_warm);
}

/// Seconds, safety included; infinite where nothing moves.
double find_limit(const StableStep& stable, Integrator integrator) noexcept {
    if (integrator == Integrator::Rk4) {
        const double circle = kRk4CircleLimit / stable.omega_max, real = kRk4RealLimit / stable.damping_rate; // x/0 = inf
        return kStepSafety * (circle < real ? circle : real);
    }
    if (!(stable.omega_max > 0.0)) return kStepSafety * kLeapfrogLimit / stable.damping_rate;
    const double ratio = 0.5 * stable.damping_rate / stable.omega_max;
    const double safety = kStepSafety * (1.0 - kUndampedShare * std::max(0.0, 1.0 - ratio / kDampedRatio));
    return safety * kLeapfrogLimit / stable.omega_max * (std::sqrt(1.0 + ratio * ratio) - ratio);
}

StableStep join(const TissueModel& model, const TissueRates& tissue, const ContactSprings* springs, StableStepWorkspace& w,
                Integrator integrator) {
    const SpringBound contact = springs ? bound_springs(model.plan, *springs, w) : SpringBound{};
    StableStep stable;
    stable.worst_tet = tissue.worst_tet;
    const double elastic = instant_share(model.material) * tissue.elastic; // branches stiffen the shear, so this is a bound
    stable.tissue_omega = std::sqrt(elastic);
    stable.omega_max = std::sqrt(elastic + contact.stiffness);
    stable.damping_rate = tissue.viscous + contact.damping + model.material.mass_damping;
    stable.finite = std::isfinite(stable.omega_max) && std::isfinite(stable.damping_rate);
    w.warm = stable.finite && tissue.elastic > 0.0;
    if (stable.finite) stable.step = find_limit(stable, integrator);
    return stable;
}

/// Rounds that are taken ahead: in turn, the drag's first, if there is drag.
int viscous_ahead(const TissueModel& model, const StableStepWorkspace& w) noexcept {
    return model.material.viscosity > 0.0 ? (w.rounds_ahead + 1) / 2 : 0;
}
int elastic_ahead(const TissueModel& model, const StableStepWorkspace& w) noexcept { return w.rounds_ahead - viscous_ahead(model, w); }

/// w.records hold the positions.
StableStep find_from_records(const TissueModel& model, const ContactSprings* springs, StableStepWorkspace& w, Integrator integrator) {
    const int rounds = w.warm ? w.warm_rounds : w.cold_rounds;
    const Eigenvalue elastic = iterate(model, TetKernel::Stiffness, w.mode, w, std::max(1, rounds - elastic_ahead(model, w)));
    w.rates.elastic = elastic.value;
    w.rates.worst_tet = elastic.worst_tet;
    if (!(model.material.viscosity > 0.0))
        w.rates.viscous = 0.0;
    else if (const int left = rounds - viscous_ahead(model, w); left > 0)
        w.rates.viscous = iterate(model, TetKernel::Damping, w.damping_mode, w, left).value;
    w.rounds_ahead = 0;
    w.rates_age = 0;
    w.rates_hold = false;
    return join(model, w.rates, springs, w, integrator);
}

} // namespace

StableStep find_stable_step(const TissueModel& model, std::span<const Vec3> position, const ContactSprings* springs, StableStepWorkspace& w,
                            Integrator integrator) {
    prepare_workspace(model, w);
    gather_records(model.plan, position, {}, w.records);
    return find_from_records(model, springs, w, integrator);
}

StableStep find_stable_step(const TissueModel& model, std::span<const NodeRecord> records, const ContactSprings* springs,
                            StableStepWorkspace& w, Integrator integrator) {
    prepare_workspace(model, w);
    std::copy(records.begin(), records.end(), w.records.begin());
    return find_from_records(model, springs, w, integrator);
}

StableStep find_stable_step_again(const TissueModel& model, const ContactSprings* springs, StableStepWorkspace& w, Integrator integrator) {
    if (w.root_inv_mass.size() != model.node_count()) size_workspace(model, w); // its rates were restored from a checkpoint
    return join(model, w.rates, springs, w, integrator);
}

int rounds_to_come(const TissueModel& model, const StableStepWorkspace& w) noexcept {
    return (model.material.viscosity > 0.0 ? 2 : 1) * w.warm_rounds - 1 - w.rounds_ahead;
}

void derive_ahead(const TissueModel& model, std::span<const NodeRecord> records, StableStepWorkspace& w) {
    prepare_workspace(model, w);
    std::copy(records.begin(), records.end(), w.records.begin());
    const bool drag = viscous_ahead(model, w) <= elastic_ahead(model, w) && model.material.viscosity > 0.0;
    const Eigenvalue found =
        drag ? iterate(model, TetKernel::Damping, w.damping_mode, w, 1) : iterate(model, TetKernel::Stiffness, w.mode, w, 1);
    ++w.rounds_ahead;
    if (drag && viscous_ahead(model, w) == w.warm_rounds) w.rates.viscous = found.value; // the last round gives the rate
}

double cap_viscosity(const TissueModel& model, const StableStep& at_rest, Integrator integrator) noexcept {
    const double asked = model.material.viscosity, drag = model.material.mass_damping;
    const double viscous = at_rest.damping_rate - drag;
    if (!(asked > 0.0) || !(viscous > 0.0) || !at_rest.finite) return asked;
    const double share = 1.0 - kViscousStepShare;
    // RK4: real limit / rate = share circle limit / omega. Leapfrog: sqrt(1 + r^2) - r = share, rate = 2 r omega.
    const double most = integrator == Integrator::Rk4 ? kRk4RealLimit / (share * kRk4CircleLimit) * at_rest.omega_max
                                                      : (1.0 - share * share) / share * at_rest.omega_max;
    if (!(viscous > most - drag)) return asked;
    return most > drag ? asked * (most - drag) / viscous : 0.0;
}

unsigned count_substeps(double step, const StableStep& stable, unsigned max_substeps) noexcept {
    if (!(stable.step > 0.0) || !(step > 0.0)) return 0;
    const double count = std::ceil(step / stable.step);
    return count <= static_cast<double>(max_substeps) ? static_cast<unsigned>(count < 1.0 ? 1.0 : count) : 0;
}

} // namespace trocar::fem
