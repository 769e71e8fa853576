#include "fem/tissue/forces.hpp"

#include "fem/tissue/fibred_laws.hpp"
#include "fem/tissue/laws.hpp"
#include "fem/tissue/prism_pair.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// x1 - x0, x2 - x0, x3 - x0 as columns; at(node) is a pointer to three numbers.
template <class At>
Block<double> find_edges(const TissueModel& model, std::size_t tet, At&& at) noexcept {
    const Tet& t = model.tet_nodes[tet];
    Block<double> edges;
    for (std::size_t k = 0; k < 3; ++k)
        for (int i = 0; i < 3; ++i) edges.m[3 * i + static_cast<int>(k)] = at(t[k + 1])[i] - at(t[0])[i];
    return edges;
}

/// F = edges Dm^-1.
template <class At>
Block<double> find_gradient(const TissueModel& model, std::size_t tet, At&& at) noexcept {
    Block<double> inverse;
    for (int i = 0; i < 9; ++i) inverse.m[i] = model.tet_shape[tet].inverse[i];
    return product(find_edges(model, tet, at), inverse);
}

void note_volume(TetReport& report, double det, std::size_t tet) noexcept {
    if (det < report.min_volume_ratio || report.min_volume_tet == kNoIndex) {
        report.min_volume_ratio = det;
        report.min_volume_tet = static_cast<Index>(tet);
    }
    if (det <= 0.0) ++report.inverted;
}

void note_energy(TetReport& report, double det, double energy, std::size_t tet) noexcept {
    note_volume(report, det, tet);
    report.elastic_energy += energy;
    if (!(std::isfinite(det) && std::isfinite(energy))) report.first_bad_tet = std::min(report.first_bad_tet, static_cast<Index>(tet));
}

FibreAxes find_fibres_at(const TissueModel& model, std::size_t batch, std::size_t lane) noexcept {
    return model.plan.fibres.empty() ? FibreAxes{} : fibres_at(model, batch, lane);
}

/// J/m^3
template <class Law>
double pair_energy(const LawConstants& law, const PrismPair& pair, const FibreAxes& fibres) noexcept {
    const Block<double> felt = to_block(pair.felt());
    return Law::energy(law, felt, determinant(felt), &fibres) + law.patch * pair.hold_energy() + 0.5 * law.bend * pair.bending_sq();
}

/// Energy of a patch, whose tets have the gradients `each` and volumes above 0 or are fillers. note(k, J/m^3)
template <class Law, class Note>
void measure_patch(const TissueModel& model, std::size_t first, std::size_t lane, const Block<double> (&each)[kPatch], Note&& note) noexcept {
    Block<double> mean{};
    for (std::size_t k = 0; k < kPatch; ++k)
        for (int i = 0; i < 9; ++i) mean.m[i] += model.plan.shares[first + k].share[lane] * each[k].m[i];
    const FibreAxes fibres = find_fibres_at(model, first, lane);
    const double shared = Law::energy(model.law, mean, determinant(mean), &fibres);
    for (std::size_t k = 0; k < kPatch; ++k) {
        Block<double> off = each[k];
        for (int i = 0; i < 9; ++i) off.m[i] -= mean.m[i];
        note(k, shared + 0.5 * model.law.patch * contraction(off, off));
    }
}

/// Patch by patch, or pair by pair of prisms, in the plan's order.
template <class Law, class At>
TetReport measure_rows(const TissueModel& model, At&& at) noexcept {
    TetReport report;
    const ForcePlan& plan = model.plan;
    for (std::size_t first = 0; first < plan.batches.size(); first += kPatch)
        for (std::size_t lane = 0; lane < kBatch; ++lane) {
            const auto tet_at = [&](std::size_t k) { return plan.tet_of[(first + k) * kBatch + lane]; };
            Block<double> each[kPatch];
            for (std::size_t k = 0; k < kPatch; ++k) each[k] = find_gradient(model, tet_at(k), at);
            const auto note = [&](std::size_t k, double density) {
                if (const double volume = plan.batches[first + k].volume[lane]; volume > 0.0) // fillers have none
                    note_energy(report, determinant(each[k]), volume * density, tet_at(k));
            };
            if (plan.prisms.empty()) {
                measure_patch<Law>(model, first, lane, each, note);
                continue;
            }
            const PrismPair pair(plan, first, lane, [&](std::size_t k) { return find_edges(model, tet_at(k), at); });
            const double density = pair_energy<Law>(model.law, pair, find_fibres_at(model, first, lane));
            for (std::size_t k = 0; k < kPairTets; ++k) note(k, density);
        }
    return report;
}

template <class Law, class At>
TetReport measure(const TissueModel& model, At&& at) noexcept {
    if (model.plan.patched()) return measure_rows<Law>(model, at);
    TetReport report;
    const auto note = [&](std::size_t tet, const FibreAxes& fibres) {
        const Block<double> f = find_gradient(model, tet, at);
        const double det = determinant(f);
        note_energy(report, det, model.tet_shape[tet].volume * model.tet_shape[tet].stiffness * Law::energy(model.law, f, det, &fibres), tet);
    };
    const ForcePlan& plan = model.plan;
    if (plan.fibres.empty()) {
        for (std::size_t tet = 0; tet < model.tet_count(); ++tet) note(tet, {});
        return report;
    }
    for (std::size_t place = 0; place < plan.tet_of.size(); ++place)
        if (plan.batches[place / kBatch].volume[place % kBatch] > 0.0) note(plan.tet_of[place], fibres_at(model, place / kBatch, place % kBatch));
    return report;
}

template <class At>
TetReport measure_with_law(const TissueModel& model, At&& at) noexcept {
    switch (model.material.law) {
    case MaterialLaw::StVK:
        return measure<StVKLaw>(model, at);
    case MaterialLaw::Corotational:
        return measure<CorotationalLaw>(model, at);
    case MaterialLaw::MooneyRivlin:
        return measure<MooneyRivlinLaw>(model, at);
    case MaterialLaw::Ogden:
        return measure<OgdenLaw>(model, at);
    case MaterialLaw::Hgo:
        return measure<HgoLaw>(model, at);
    case MaterialLaw::NeoHookean:
        break;
    }
    return measure<NeoHookeanLaw>(model, at);
}

/// Runs a kernel on fresh records and adds sign times the node sums.
Extremes run_once(const TissueModel& model, TetKernel kernel, std::span<const Vec3> position, std::span<const Vec3> second, double sign,
                  std::span<Vec3> out) {
    const ForcePlan& plan = model.plan;
    std::vector<NodeRecord> records(plan.node_count());
    std::vector<PartialForce> partial(plan.slots.size());
    gather_records(plan, position, second, records);
    const Extremes found = run_tets(plan, make_tet_job(model, kernel, 1), records, partial);
    for (std::size_t record = 0; record < plan.node_count(); ++record)
        out[plan.node_of[record]] += sign * sum_partial(plan, partial, record);
    return found;
}

} // namespace

TetJob make_tet_job(const TissueModel& model, TetKernel kernel, unsigned threads) noexcept {
    return {.kernel = kernel, .law = model.material.law, .constants = model.law, .viscosity = model.material.viscosity, .threads = threads};
}

void gather_records(const ForcePlan& plan, std::span<const Vec3> position, std::span<const Vec3> second,
                    std::span<NodeRecord> records) noexcept {
    for (std::size_t record = 0; record < plan.node_count(); ++record) {
        const Index node = plan.node_of[record];
        for (int axis = 0; axis < 3; ++axis) {
            records[record].x[axis] = position[node][axis];
            if (!second.empty()) records[record].v[axis] = second[node][axis];
        }
    }
}

void scatter_records(const ForcePlan& plan, std::span<const NodeRecord> records, std::span<Vec3> position,
                     std::span<Vec3> second) noexcept {
    for (std::size_t record = 0; record < plan.node_count(); ++record) {
        const Index node = plan.node_of[record];
        const NodeRecord& r = records[record];
        position[node] = Vec3(r.x[0], r.x[1], r.x[2]);
        second[node] = Vec3(r.v[0], r.v[1], r.v[2]);
    }
}

TetReport add_tet_forces(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity, std::span<Vec3> force) {
    const TetKernel kernel = model.material.viscosity > 0.0 ? TetKernel::ViscousForce : TetKernel::Force;
    const Extremes found = run_once(model, kernel, position, velocity, 1.0, force);
    TetReport report;
    for (std::size_t tet = 0; tet < model.tet_count(); ++tet) {
        const double det = determinant(find_gradient(model, tet, [&](Index node) { return position[node].data(); }));
        if (det <= 0.0) ++report.inverted;
    }
    if (found.low_place == kNoIndex) return report;
    report.min_volume_ratio = found.low;
    report.min_volume_tet = model.plan.tet_of[found.low_place];
    return report;
}

TetReport measure_tets(const TissueModel& model, std::span<const Vec3> position) noexcept {
    return measure_with_law(model, [&](Index node) { return position[node].data(); });
}

TetReport measure_tets(const TissueModel& model, std::span<const NodeRecord> records, std::span<TetSum> scratch,
                       unsigned threads) noexcept {
    const TetSum sum = sum_tets(model.plan, make_tet_job(model, TetKernel::Force, threads), records, scratch);
    TetReport report;
    report.elastic_energy = sum.energy;
    report.inverted = sum.inverted;
    report.first_bad_tet = sum.first_bad_tet;
    if (sum.low_place == kNoIndex) return report;
    report.min_volume_ratio = sum.low;
    report.min_volume_tet = model.plan.tet_of[sum.low_place];
    return report;
}

Index add_stiffness_product(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> displacement,
                            std::span<Vec3> product) {
    const Extremes found = run_once(model, TetKernel::Stiffness, position, displacement, -1.0, product);
    return found.high_place == kNoIndex ? kNoIndex : model.plan.tet_of[found.high_place];
}

void add_damping_product(const TissueModel& model, std::span<const Vec3> position, std::span<const Vec3> velocity,
                         std::span<Vec3> product) {
    if (model.material.viscosity > 0.0) run_once(model, TetKernel::Damping, position, velocity, -1.0, product);
}

} // namespace trocar::fem
