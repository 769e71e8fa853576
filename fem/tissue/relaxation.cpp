#include "fem/tissue/relaxation.hpp"

#include "fem/tissue/block.hpp"
#include "fem/tissue/blocks.hpp"
#include "fem/tissue/exponential.hpp"

#include <array>

namespace trocar::fem {

namespace {

constexpr int kMostBranches = 3;
constexpr std::size_t kStrain = 6; // xx yy zz xy xz yz

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

Block<double> load_gradient(const ForcePlan& plan, std::size_t b, std::size_t lane, const NodeRecord* records,
                            Block<double>& inverse) noexcept {
    const TetBatch& batch = plan.batches[b];
    const auto at = [&](std::size_t corner) { return records[batch.node[corner][lane] / sizeof(NodeRecord)].x; };
    Block<double> edges;
    const double* origin = at(0);
    for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < 3; ++i) edges.m[3 * i + k] = at(k + 1)[i] - origin[i];
    for (int i = 0; i < 9; ++i) inverse.m[i] = batch.inverse[i][lane];
    return product(edges, inverse);
}

/// dev E of the tet or patch that begins at a batch.
struct GroupStrain {
    Block<double> f{};
    std::array<double, kStrain> deviator{};
};
GroupStrain find_strain(const ForcePlan& plan, std::size_t first, std::size_t lane, const NodeRecord* records) noexcept {
    GroupStrain strain;
    for (std::size_t b = first; b < first + group_of(plan); ++b) {
        Block<double> inverse;
        const Block<double> f = load_gradient(plan, b, lane, records, inverse);
        const double share = plan.patched() ? plan.shares[b].share[lane] : 1.0;
        for (int i = 0; i < 9; ++i) strain.f.m[i] += share * f.m[i];
    }
    const Block<double> g = transposed_product(strain.f, strain.f);
    const double third = (g.m[0] + g.m[4] + g.m[8]) / 3.0;
    strain.deviator = {0.5 * (g.m[0] - third), 0.5 * (g.m[4] - third), 0.5 * (g.m[8] - third), 0.5 * g.m[1], 0.5 * g.m[2], 0.5 * g.m[5]};
    return strain;
}

/// Calls work(first batch, lane, its own numbers) for every group of a chunk.
template <class Work>
void for_each_group(const ForcePlan& plan, const ForceChunk& chunk, int branches, Work&& work) {
    const std::size_t group = group_of(plan);
    for (std::size_t b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; b += group)
        for (std::size_t lane = 0; lane < kBatch; ++lane)
            work(b, lane, kStrain * static_cast<std::size_t>(branches) * (b / group * kBatch + lane));
}

void push_tet(const ForcePlan& plan, std::size_t b, std::size_t lane, const Block<double>& stress, PartialForce* partial) noexcept {
    const TetBatch& batch = plan.batches[b];
    double sum[3] = {0.0, 0.0, 0.0};
    for (std::size_t corner = 1; corner < 4; ++corner)
        for (std::size_t i = 0; i < 3; ++i) {
            double push = 0.0;
            for (std::size_t j = 0; j < 3; ++j)
                push -= batch.volume[lane] * stress.m[3 * i + j] * batch.inverse[3 * (corner - 1) + j][lane];
            partial[batch.slot[corner][lane] / sizeof(PartialForce)].f[i] += push;
            sum[i] += push;
        }
    for (std::size_t i = 0; i < 3; ++i) partial[batch.slot[0][lane] / sizeof(PartialForce)].f[i] -= sum[i];
}

} // namespace

int count_branches(const Material& material) noexcept { return list_branches(material).count; }

std::size_t relaxation_size(const TissueModel& model) noexcept {
    const auto branches = static_cast<std::size_t>(count_branches(model.material));
    return kStrain * branches * kBatch * (model.plan.batches.size() / group_of(model.plan));
}

void add_relaxation_forces(const TissueModel& model, std::span<const NodeRecord> records, std::span<const double> relaxed,
                           std::span<PartialForce> partial, unsigned threads) noexcept {
    const Branches branches = list_branches(model.material);
    const double twice_mu = 2.0 * find_small_strain(model.material).mu;
    const ForcePlan& plan = model.plan;
    const auto push_group = [&](std::size_t first, std::size_t lane, std::size_t own) {
        const GroupStrain strain = find_strain(plan, first, lane, records.data());
        std::array<double, kStrain> s{};
        for (std::size_t k = 0; k < static_cast<std::size_t>(branches.count); ++k)
            for (std::size_t i = 0; i < kStrain; ++i)
                s[i] += twice_mu * branches.g[k] * (strain.deviator[i] - relaxed[own + kStrain * k + i]);
        const Block<double> second{{s[0], s[3], s[4], s[3], s[1], s[5], s[4], s[5], s[2]}};
        // E's derivative passes the deviator on to S
        const double third = (s[0] + s[1] + s[2]) / 3.0;
        Block<double> traceless = second;
        for (int i = 0; i < 9; i += 4) traceless.m[i] -= third;
        const Block<double> stress = product(strain.f, traceless);
        for (std::size_t b = first; b < first + group_of(plan); ++b) push_tet(plan, b, lane, stress, partial.data());
    };
    for_each_block(plan.chunks.size(), threads, 1, [&](std::size_t, std::size_t begin, std::size_t end) {
        for (std::size_t c = begin; c < end; ++c) for_each_group(plan, plan.chunks[c], branches.count, push_group);
    });
}

void relax(const TissueModel& model, std::span<const NodeRecord> records, double h, std::span<double> relaxed, unsigned threads) noexcept {
    const Branches branches = list_branches(model.material);
    const ForcePlan& plan = model.plan;
    std::array<double, kMostBranches> share{};
    for (std::size_t k = 0; k < share.size(); ++k) share[k] = branches.tau[k] > 0.0 ? 1.0 - natural_exp(-h / branches.tau[k]) : 0.0;
    const auto follow = [&](std::size_t first, std::size_t lane, std::size_t own) {
        const GroupStrain strain = find_strain(plan, first, lane, records.data());
        for (std::size_t k = 0; k < static_cast<std::size_t>(branches.count); ++k)
            for (std::size_t i = 0; i < kStrain; ++i) {
                double& kept = relaxed[own + kStrain * k + i];
                kept += share[k] * (strain.deviator[i] - kept);
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
