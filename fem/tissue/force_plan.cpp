#include "fem/tissue/force_plan.hpp"

#include "base/box.hpp"
#include "fem/tissue/block.hpp"
#include "fem/tissue/patches.hpp"
#include "fem/tissue/prism_pairs.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// Spreads the low 21 bits to every third bit.
std::uint64_t spread_bits(std::uint64_t value) noexcept {
    value &= 0x1fffff;
    value = (value | value << 32) & 0x1f00000000ffffULL;
    value = (value | value << 16) & 0x1f0000ff0000ffULL;
    value = (value | value << 8) & 0x100f00f00f00f00fULL;
    value = (value | value << 4) & 0x10c30c30c30c30c3ULL;
    return (value | value << 2) & 0x1249249249249249ULL;
}

/// Tet ids along the Morton curve of their centroids; ties by id.
std::vector<Index> sort_tets(std::span<const Tet> tets, std::span<const Vec3> position) {
    Box3 box;
    for (const Vec3& x : position) box.add(x);
    const double size = std::max((box.hi - box.lo).maxCoeff(), 1e-300);
    std::vector<std::pair<std::uint64_t, Index>> keyed(tets.size());
    for (std::size_t tet = 0; tet < tets.size(); ++tet) {
        const Tet& t = tets[tet];
        const Vec3 centre = 0.25 * (position[t[0]] + position[t[1]] + position[t[2]] + position[t[3]]);
        std::uint64_t code = 0;
        for (int axis = 0; axis < 3; ++axis) {
            const double unit = std::clamp((centre[axis] - box.lo[axis]) / size, 0.0, 1.0);
            code |= spread_bits(static_cast<std::uint64_t>(unit * 2097151.0)) << axis;
        }
        keyed[tet] = {code, static_cast<Index>(tet)};
    }
    std::sort(keyed.begin(), keyed.end());
    std::vector<Index> order(tets.size());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = keyed[k].second;
    return order;
}

void number_nodes(ForcePlan& plan, std::span<const Tet> tets, std::span<const Index> order) {
    for (const Index tet : order)
        for (const Index node : tet == kNoIndex ? std::span<const Index>() : std::span<const Index>(tets[tet]))
            if (plan.record_of[node] == kNoIndex) {
                plan.record_of[node] = static_cast<Index>(plan.node_of.size());
                plan.node_of.push_back(node);
            }
}

void fill_lane(TetBatch& batch, std::size_t lane, const TetShape& shape, double volume) {
    Block<double> inverse, turned;
    for (int i = 0; i < 9; ++i) batch.inverse[i][lane] = inverse.m[i] = turned.m[i / 3 + i % 3 * 3] = shape.inverse[i];
    const Block<double> gram = transposed_product(turned, turned);
    constexpr int kKept[6] = {0, 4, 8, 1, 2, 5};
    for (int k = 0; k < 6; ++k) batch.gram[k][lane] = gram.m[kKept[k]];
    batch.inverse_det[lane] = determinant(inverse);
    batch.volume[lane] = volume;
}

Index last_tet(std::span<const Index> order) {
    std::size_t place = order.size();
    while (order[--place] == kNoIndex) {
    }
    return order[place];
}

/// Volumes over the patch's; patches that no tet fills have the whole of their first.
void fill_shares(ForcePlan& plan) {
    plan.shares.resize(plan.batches.size());
    for (std::size_t first = 0; first < plan.batches.size(); first += kPatch)
        for (std::size_t lane = 0; lane < kBatch; ++lane) {
            double volume = 0.0;
            for (std::size_t b = first; b < first + kPatch; ++b) volume += plan.batches[b].volume[lane];
            for (std::size_t b = first; b < first + kPatch; ++b)
                plan.shares[b].share[lane] = volume > 0.0 ? plan.batches[b].volume[lane] / volume : b == first ? 1.0 : 0.0;
        }
}

/// Lane l of a chunk's batches walks along the l-th eighth of the chunk: neighbours in space, which share nodes, do not meet in
/// one batch, where their sums would depend on each other.
void fill_chunk(ForcePlan& plan, const ForceChunk& chunk, std::span<const Tet> tets, std::span<const TetShape> shapes,
                std::span<const Index> order) {
    Index tet = order.front();
    for (std::size_t lane = 0; lane < kBatch; ++lane)
        for (std::size_t b = 0; b < chunk.batch_count; ++b) {
            const std::size_t place = kBatch * chunk.first_batch + lane * chunk.batch_count + b; // along the curve
            const bool filled = place < order.size() && order[place] != kNoIndex;
            tet = filled ? order[place] : place < order.size() ? tet : last_tet(order);
            TetBatch& batch = plan.batches[chunk.first_batch + b];
            plan.tet_of[kBatch * (chunk.first_batch + b) + lane] = tet;
            fill_lane(batch, lane, shapes[tet], filled ? shapes[tet].volume * shapes[tet].stiffness : 0.0);
            for (std::size_t corner = 0; corner < 4; ++corner)
                batch.node[corner][lane] = static_cast<Index>(sizeof(NodeRecord)) * plan.record_of[tets[tet][corner]];
        }
}

/// Slots of one chunk in order of first use; `owner` collects the record of each.
void add_slots(ForcePlan& plan, ForceChunk& chunk, std::vector<Index>& slot_of, std::vector<Index>& owner) {
    chunk.first_slot = static_cast<Index>(owner.size());
    for (Index b = chunk.first_batch; b < chunk.first_batch + chunk.batch_count; ++b)
        for (std::size_t lane = 0; lane < kBatch; ++lane)
            for (int corner = 0; corner < 4; ++corner) {
                const Index record = plan.batches[b].node[corner][lane] / sizeof(NodeRecord);
                if (slot_of[record] == kNoIndex || slot_of[record] < chunk.first_slot) {
                    slot_of[record] = static_cast<Index>(owner.size());
                    owner.push_back(record);
                }
                plan.batches[b].slot[corner][lane] = static_cast<Index>(sizeof(PartialForce)) * slot_of[record];
            }
    chunk.slot_count = static_cast<Index>(owner.size()) - chunk.first_slot;
}

void group_slots(ForcePlan& plan, std::span<const Index> owner) {
    plan.slot_begin.assign(plan.node_count() + 1, 0);
    for (const Index record : owner) ++plan.slot_begin[record + 1];
    for (std::size_t record = 0; record < plan.node_count(); ++record) plan.slot_begin[record + 1] += plan.slot_begin[record];
    std::vector<Index> next(plan.slot_begin.begin(), plan.slot_begin.end() - 1);
    plan.slots.resize(owner.size());
    for (std::size_t slot = 0; slot < owner.size(); ++slot) plan.slots[next[owner[slot]]++] = static_cast<Index>(slot);
}

} // namespace

ForcePlan make_force_plan(std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> rest_position,
                          std::span<const double> inv_mass, bool patched, Index sheet) {
    ForcePlan plan;
    std::vector<Index> order = sort_tets(tets, rest_position);
    if (sheet > 0) {
        order = pair_prisms(tets, rest_position, sheet, order);
    } else if (patched) {
        static_assert(kPatch == kMostPatchTets);
        std::vector<double> stiffness;
        for (const TetShape& shape : shapes) stiffness.push_back(shape.stiffness);
        order = make_patches(tets, rest_position, stiffness, order);
    }
    plan.record_of.assign(rest_position.size(), kNoIndex);
    number_nodes(plan, tets, order);
    const std::size_t whole = patched ? kBatch * kPatch : kBatch; // tets of the smallest piece of a chunk
    plan.batches.resize((order.size() + whole - 1) / whole * (whole / kBatch));
    plan.tet_of.resize(kBatch * plan.batches.size());
    for (std::size_t first = 0; first < plan.batches.size(); first += kChunkBatches)
        plan.chunks.push_back({static_cast<Index>(first), static_cast<Index>(std::min(kChunkBatches, plan.batches.size() - first)), 0, 0});
    for (const ForceChunk& chunk : plan.chunks) fill_chunk(plan, chunk, tets, shapes, order);
    if (patched) fill_shares(plan);
    std::vector<Index> slot_of(plan.node_count(), kNoIndex), owner;
    for (ForceChunk& chunk : plan.chunks) add_slots(plan, chunk, slot_of, owner);
    group_slots(plan, owner);
    plan.inv_mass.resize(plan.node_count());
    for (std::size_t record = 0; record < plan.node_count(); ++record) plan.inv_mass[record] = inv_mass[plan.node_of[record]];
    return plan;
}

} // namespace trocar::fem
