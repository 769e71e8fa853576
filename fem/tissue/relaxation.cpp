#include "fem/tissue/relaxation.hpp"

#include "fem/tissue/block.hpp"
#include "fem/tissue/blocks.hpp"
#include "fem/tissue/exponential.hpp"
#include "fem/tissue/prism_pair.hpp"

#include <array>

namespace trocar::fem {

namespace {

constexpr int kMostBranches = 3;
constexpr std::size_t kStrain = 6;            // xx yy zz xy xz yz
constexpr std::size_t kPairStrain = kStrain + 6; // and of both prisms xx yy xy of bending

/// Of a tet, a patch or a pair of prisms, which has them all.
using Strain = std::array<double, kPairStrain>;

struct Branches {
    int count = 0;
    std::array<double, kMostBranches> g{}, tau{};
};

Branches list_branches(const Material& m) noexcept {
    Branches branches;
    const double g[] = {m.g1, m.g2, m.g3}, tau[] = {m.tau1, m.tau2, m.tau3};
    for (int k = 0; k < kMostBranches; ++k) {
        if (!(g[k] > 0.0)) continue;
        const auto at = static_cast<std::size_t>(branches.count++);
        branches.g[at] = g[k];
        branches.tau[at] = tau[k];
    }
    return branches;
}

/// Batches that share one strain.
std::size_t group_of(const ForcePlan& plan) noexcept { return plan.patched() ? kPatch : 1; }
/// Numbers of its strain.
std::size_t strain_size(const ForcePlan& plan) noexcept { return plan.prisms.empty() ? kStrain : kPairStrain; }

/// x1 - x0, x2 - x0, x3 - x0 as columns.
Block<double> load_edges(const TetBatch& batch, std::size_t lane, const NodeRecord* records) noexcept {
    const auto at = [&](std::size_t corner) { return records[batch.node[corner][lane] / sizeof(NodeRecord)].x; };
    Block<double> edges;
    const double* origin = at(0);
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) edges.m[3 * i + k] = at(k + 1)[i] - origin[i];
    return edges;
}

PrismPair load_pair(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records) {
    return PrismPair(plan, first, lane, [&](std::size_t k) { return load_edges(plan.batches[first + k], lane, records); });
}

/// Mean gradient of the tet or patch that begins at a batch.
Block<double> find_mean(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records) noexcept {
    Block<double> mean{};
    for (std::size_t b = first; b < first + group_of(plan); ++b) {
        Block<double> inverse;
        for (int i = 0; i < 9; ++i) inverse.m[i] = plan.batches[b].inverse[i][lane];
        const Block<double> f = product(load_edges(plan.batches[b], lane, records), inverse);
        const double share = plan.patched() ? plan.shares[b].share[lane] : 1.0;
        for (int i = 0; i < 9; ++i) mean.m[i] += share * f.m[i];
    }
    return mean;
}

/// dev E
Strain find_deviator(const Block<double>& f) noexcept {
    const Block<double> g = transposed_product(f, f);
    const double third = (g.m[0] + g.m[4] + g.m[8]) / 3.0;
    return {0.5 * (g.m[0] - third), 0.5 * (g.m[4] - third), 0.5 * (g.m[8] - third), 0.5 * g.m[1], 0.5 * g.m[2], 0.5 * g.m[5]};
}
/// And of bending.
Strain find_strain(const PrismPair& pair) noexcept {
    Strain strain = find_deviator(to_block(pair.felt()));
    for (std::size_t prism = 0; prism < 2; ++prism) {
        const PrismBending bending = pair.bending(prism);
        for (std::size_t i = 0; i < 3; ++i) strain[kStrain + 3 * prism + i] = bending[i];
    }
    return strain;
}

/// Pa, of g 1: what strains are multiplied with, of their energy's derivative.
struct Moduli {
    double twice_mu, bend;
};
Moduli find_moduli(const Material& material) noexcept {
    const SmallStrain small = find_small_strain(material);
    const double across = small.lambda / (small.lambda + 2.0 * small.mu); // of a plate bent along: how much its thickness gives way
    return {2.0 * small.mu, 2.0 / 3.0 * small.mu * (1.0 + across * across - (1.0 - across) * (1.0 - across) / 3.0)};
}

/// Calls work(first batch, lane, its own numbers) for every group of a chunk.
template <class Work>
void for_each_group(const ForcePlan& plan, const ForceChunk& chunk, int branches, Work&& work) {
    const std::size_t group = group_of(plan);
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; b += group)
        for (std::size_t lane = 0; lane < kBatch; ++lane)
            work(b, lane, strain_size(plan) * static_cast<std::size_t>(branches) * (b / group * kBatch + lane));
}

/// stress: derivative of the energy, J/m^3, by what the tet's edges times `gradient` are part of
void push_tet(const TetBatch& batch, std::size_t lane, double volume, const Block<double>& stress, const double (&gradient)[9][kBatch], PartialForce* partial) noexcept {
    double sum[3] = {0.0, 0.0, 0.0};
    for (std::size_t corner = 1; corner < 4; ++corner)
        for (std::size_t i = 0; i < 3; ++i) {
            double push = 0.0;
            for (std::size_t j = 0; j < 3; ++j)
                push -= volume * stress.m[3 * i + j] * gradient[3 * (corner - 1) + j][lane];
            partial[batch.slot[corner][lane] / sizeof(PartialForce)].f[i] += push;
            sum[i] += push;
        }
    for (std::size_t i = 0; i < 3; ++i) partial[batch.slot[0][lane] / sizeof(PartialForce)].f[i] -= sum[i];
}

/// stress: derivative of the energy by what the law is asked for
void push_tets(const ForcePlan& plan, std::size_t first, std::size_t lane, const Block<double>& stress, PartialForce* partial) noexcept {
    for (std::size_t b = first; b < first + group_of(plan); ++b)
        push_tet(plan.batches[b], lane, plan.batches[b].volume[lane], stress, plan.batches[b].inverse, partial);
}
void push_pair(const ForcePlan& plan, std::size_t first, std::size_t lane, const PairStress& by, PartialForce* partial) noexcept {
    for (std::size_t k = 0; k < kPairTets; ++k) {
        if (!is_outer(k)) continue;
        const PrismBatch& prism = plan.prisms[first + k];
        const double volume = plan.pairs[first / kPatch].volume[lane];
        push_tet(plan.batches[first + k], lane, volume, to_block(by.mean + prism.side[lane] * by.jump), prism.mean, partial);
        push_tet(plan.batches[first + k], lane, volume, to_block(by.bent[k / kPrismTets]), prism.bend, partial);
    }
}

} // namespace

int count_branches(const Material& material) noexcept { return list_branches(material).count; }

std::size_t relaxation_size(const TissueModel& model) noexcept {
    const auto branches = static_cast<std::size_t>(count_branches(model.material));
    return strain_size(model.plan) * branches * kBatch * (model.plan.batches.size() / group_of(model.plan));
}

void add_relaxation_forces(const TissueModel& model, std::span<const NodeRecord> records, std::span<const double> relaxed,
                           std::span<PartialForce> partial, unsigned threads) noexcept {
    const Branches branches = list_branches(model.material);
    const Moduli moduli = find_moduli(model.material);
    const ForcePlan& plan = model.plan;
    const std::size_t size = strain_size(plan);
    const auto pull = [&](const Strain& strain, std::size_t own) {
        Strain s{};
        for (std::size_t k = 0; k < static_cast<std::size_t>(branches.count); ++k)
            for (std::size_t i = 0; i < size; ++i) s[i] += (i < kStrain ? moduli.twice_mu : moduli.bend) * branches.g[k] * (strain[i] - relaxed[own + size * k + i]);
        return s;
    };
    const auto stress_of = [](const Block<double>& f, const Strain& s) {
        const Block<double> second{{s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]}};
        // E's derivative passes the deviator on to S
        const double third = (s[0] + s[1] + s[2]) / 3.0;
        Block<double> traceless = second;
        for (int i = 0; i < 9; i += 4) traceless.m[i] -= third;
        return product(f, traceless);
    };
    const auto push = [&](std::size_t first, std::size_t lane, std::size_t own) {
        if (plan.prisms.empty()) {
            const Block<double> f = find_mean(plan, first, lane, records.data());
            push_tets(plan, first, lane, stress_of(f, pull(find_deviator(f), own)), partial.data());
        } else {
            const PrismPair pair = load_pair(plan, first, lane, records.data());
            const Strain s = pull(find_strain(pair), own);
            PairStress by = pair.pull_back(to_matrix(stress_of(to_block(pair.felt()), s)));
            for (std::size_t prism = 0; prism < 2; ++prism) pair.add_bending(prism, {s[kStrain + 3 * prism], s[kStrain + 3 * prism + 1], 2.0 * s[kStrain + 3 * prism + 2]}, by);
            push_pair(plan, first, lane, by, partial.data());
        }
    };
    for_each_block(plan.chunks.size(), threads, 1, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) for_each_group(plan, plan.chunks[c], branches.count, push);
    });
}

void relax(const TissueModel& model, std::span<const NodeRecord> records, double h, std::span<double> relaxed, unsigned threads) noexcept {
    const Branches branches = list_branches(model.material);
    const ForcePlan& plan = model.plan;
    const std::size_t size = strain_size(plan);
    std::array<double, kMostBranches> share{};
    for (std::size_t k = 0; k < share.size(); ++k) share[k] = branches.tau[k] > 0.0 ? 1.0 - natural_exp(-h / branches.tau[k]) : 0.0;
    const auto follow = [&](std::size_t first, std::size_t lane, std::size_t own) {
        const Strain strain = plan.prisms.empty() ? find_deviator(find_mean(plan, first, lane, records.data())) : find_strain(load_pair(plan, first, lane, records.data()));
        for (std::size_t k = 0; k < static_cast<std::size_t>(branches.count); ++k)
            for (std::size_t i = 0; i < size; ++i) {
                double& kept = relaxed[own + size * k + i];
                kept += share[k] * (strain[i] - kept);
            }
    };
    for_each_block(plan.chunks.size(), threads, 1, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) for_each_group(plan, plan.chunks[c], branches.count, follow);
    });
}

double instant_share(const Material& material) noexcept {
    const Branches branches = list_branches(material);
    double share = 1.0;
    for (std::size_t k = 0; k < static_cast<std::size_t>(branches.count); ++k) share += branches.g[k];
    return share;
}

} // namespace trocar::fem
