// Data layout of the force kernels: tets in Morton order, eight at a time; nodes renumbered by first use and kept as 64-byte
// records. Callers never see this order: integrators gather from and scatter to the caller's own node ids.
// Forces are summed twice: each chunk of tets into its own slots, in order; then the slots of a node, in order. Which thread
// ran a chunk does not show in the bits.
#pragma once

#include "base/mesh.hpp"

#include <span>
#include <vector>

namespace trocar::fem {

inline constexpr std::size_t kBatch = 8;         // tets that a kernel handles at once: a vector of doubles in AVX-512
inline constexpr std::size_t kPatch = 8;         // tets that share a deformation gradient at most: patches.hpp
inline constexpr std::size_t kChunkBatches = 64; // its slots fit in the first-level cache

/// Eight tets; where the last chunk is not full, its last tet is repeated with volume 0.
struct alignas(64) TetBatch {
    double inverse[9][kBatch];  // Dm^-1, row-major, 1/m
    double volume[kBatch];      // m^3, times the tet's stiffness factor
    double gram[6][kBatch];     // Dm^-1 Dm^-T: xx yy zz xy xz yz, 1/m^2
    double inverse_det[kBatch]; // det Dm^-1, 1/m^3
    Index node[4][kBatch];      // records, as bytes from the first
    Index slot[4][kBatch];      // partial sums, as bytes from the first
};

/// Of patched plans: each tet's share of its patch's volume, [-]. A patch is a lane of kPatch batches that follow one another.
struct alignas(64) PatchShares {
    double share[kBatch];
};

/// Of walls in prisms (prisms.hpp): what each tet's edges x_k - x_0 have in what its patch feels, row-major, 1/m; 0 where no tet is.
struct alignas(64) PrismBatch {
    double mean[9][kBatch]; // edges times this: of the patch's mean gradient
    double bend[9][kBatch]; // of the prism's bending, times the root of its share of the patch
    double side[kBatch];    // times the former: of the first prism's gradient less the second's
};

/// Of eight pairs of prisms, of kPatch batches: zero where there is none.
struct alignas(64) PairBatch {
    double along[6][kBatch];                  // two unit vectors along the wall at rest, at right angles: x y z x y z
    double shear[kBatch];                     // of the law's shear across the wall
    double hold[kBatch], kink[kBatch];        // of LawConstants::patch: resistance to the prisms' difference along the wall and across it
    double volume[kBatch];                    // m^3, times its stiffness factor
};

/// Of hgo: both fibre directions at rest, x y z x y z; of a patch the same in all its tets.
struct alignas(64) FibreBatch {
    double axis[6][kBatch];
};

/// A node's two vectors side by side: position and velocity, or position and a displacement.
struct alignas(64) NodeRecord {
    double x[4] = {0, 0, 0, 0}, v[4] = {0, 0, 0, 0}; // fourth numbers stay 0
};

struct alignas(32) PartialForce {
    double f[4];
};

struct ForceChunk {
    Index first_batch, batch_count;
    Index first_slot, slot_count;
};

struct ForcePlan {
    std::vector<TetBatch> batches;
    std::vector<ForceChunk> chunks;
    std::vector<PatchShares> shares; // [batches]; empty: every tet stands for itself
    std::vector<PrismBatch> prisms;  // [batches]; empty: patches of tets, or none
    std::vector<PairBatch> pairs;    // [batches / kPatch] of prisms
    std::vector<FibreBatch> fibres;  // [batches]; empty: a law without
    std::vector<Index> tet_of;       // [8 batches] caller's tet id
    std::vector<Index> node_of;      // [node_count] caller's id of a record
    std::vector<Index> record_of;    // [node_count] record of a caller's node
    std::vector<Index> slot_begin;   // [node_count + 1] into `slots`
    std::vector<Index> slots;        // a record's partial sums, ascending
    std::vector<double> inv_mass;    // [node_count] by record, 1/kg; 0 pins

    [[nodiscard]] bool patched() const noexcept { return !shares.empty(); }
    [[nodiscard]] std::size_t node_count() const noexcept { return node_of.size(); }
};

/// Rest shape of one tetrahedron.
struct TetShape {
    double inverse[9]; // Dm^-1, row-major: F = Ds Dm^-1 with Ds = [x1-x0, x2-x0, x3-x0], 1/m
    double volume;     // m^3, > 0
    double stiffness;  // factor on the material's moduli and viscosity, > 0
};

/// Nodes and partial sums whose distances in bytes still fit: 67 million nodes.
inline constexpr std::size_t kMostPlanBytes = std::size_t{1} << 32;

/// tets, shapes [tet_count]; inv_mass [node_count] in the caller's order. Every node must belong to a tet. patched: see patches.hpp.
/// sheet: of a wall in prisms, nodes a sheet: patches are pairs of prisms (fill_prisms tells what they feel); 0: it is not
[[nodiscard]] ForcePlan make_force_plan(std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> rest_position,
                                        std::span<const double> inv_mass, bool patched = false, Index sheet = 0);

} // namespace trocar::fem
