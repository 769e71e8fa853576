// The vectorised inner loops over tets and nodes, chosen at run time for the processor: AVX-512, AVX2, or plain 128-bit code.
// All of them do the same operations in the same order, with the same fused multiply-adds: the same bits.
#pragma once

#include "fem/tissue/force_plan.hpp"
#include "fem/tissue/material.hpp"

#include <string_view>

namespace trocar::fem {

enum class TetKernel : std::uint8_t {
    Force,        // elastic force of x
    ViscousForce, // elastic force of x and drag of v
    Stiffness,    // -K(x) v
    Damping,      // -C(x) v
};

/// Extremes of one kernel run; places are positions in the plan, ties go to the lower one.
struct Extremes {
    double low;  // Force*: smallest det F
    double high; // Force*: largest growth since TetJob::growth was noted, 1 without; Stiffness: most energy that a tet takes up
    Index low_place, high_place;
    void join(const Extremes& other) noexcept;
};
[[nodiscard]] Extremes no_extremes() noexcept;

/// How stiff the eight tets of a batch were at some time, as reciprocals.
struct alignas(64) StiffnessNote {
    double per_tangent[kBatch]; // 1/Pa, of a bound on the largest eigenvalue of the tangent
    double per_size[kBatch];    // of |F|^2, which drag and turning frames grow with
};

/// Measures in a force evaluation how much the stiffest tet has grown since an earlier one.
struct TetGrowth {
    enum class Use : std::uint8_t { None, Note, Compare };
    Use use = Use::None;
    StiffnessNote* notes = nullptr; // [batches]
};

struct TetJob {
    TetKernel kernel = TetKernel::Force;
    MaterialLaw law = MaterialLaw::NeoHookean;
    LawConstants constants;
    double viscosity = 0.0;
    TetGrowth growth = {}; // of Force and ViscousForce
    unsigned threads = 1;  // the bits are the same for any number
};

/// Overwrites every partial sum of the plan. records [node_count], partial [plan.slots.size()]
Extremes run_tets(const ForcePlan& plan, const TetJob& job, std::span<const NodeRecord> records, std::span<PartialForce> partial) noexcept;

/// Energy and volume ratios of some tets.
struct TetSum {
    double energy = 0.0;            // J
    double low = 0.0;               // smallest det F; the first in the plan's order of equal ones
    Index low_place = kNoIndex;     // in the plan
    Index first_bad_tet = kNoIndex; // lowest caller's id of a det F or energy that is not finite
    std::uint32_t inverted = 0;     // det F <= 0
};
/// Of all tets, by the job's law and constants. per_chunk [plan.chunks.size()] is scratch.
TetSum sum_tets(const ForcePlan& plan, const TetJob& job, std::span<const NodeRecord> records, std::span<TetSum> per_chunk) noexcept;

/// Node update from its force F: a = inv_mass (F + extra) + gravity - mass_damping v, 0 where pinned; D = [v | a].
enum class NodeUpdate : std::uint8_t {
    FirstStage,  // slope = D, out = start + reach D
    MiddleStage, // slope += 2 D, out = start + reach D
    LastStage,   // out = start + reach (slope + D)
    KickDrift,   // out.v = now.v + reach a, out.x = now.x + drift out.v
};

struct NodeJob {
    NodeUpdate update = NodeUpdate::FirstStage;
    const NodeRecord* start = nullptr;
    const NodeRecord* now = nullptr; // what the force was computed from
    NodeRecord* out = nullptr;       // may be `now`
    NodeRecord* slope = nullptr;
    const PartialForce* partial = nullptr;
    const PartialForce* extra = nullptr; // [node_count] by record, N; null: none
    double gravity[4] = {0, 0, 0, 0};    // m/s^2
    double mass_damping = 0.0;           // 1/s
    double reach = 0.0, drift = 0.0;     // s
    unsigned threads = 1;
};

/// An acceleration beyond this is counted as not finite: its square must still be a double.
inline constexpr double kAccelerationLimit = 1e150; // m/s^2

/// Nodes that one thread takes at least.
inline constexpr std::size_t kLeastNodes = 256;

/// Returns the lowest caller's id of a node whose acceleration is not finite; kNoIndex: all are.
Index update_nodes(const ForcePlan& plan, const NodeJob& job) noexcept;

/// Sum of a record's partial forces.
[[nodiscard]] inline Vec3 sum_partial(const ForcePlan& plan, std::span<const PartialForce> partial, std::size_t record) noexcept {
    double sum[3] = {0, 0, 0};
    for (Index k = plan.slot_begin[record]; k < plan.slot_begin[record + 1]; ++k)
        for (int axis = 0; axis < 3; ++axis) sum[axis] += partial[plan.slots[k]].f[axis];
    return {sum[0], sum[1], sum[2]};
}

/// "avx512", "avx2" or "portable": what the next call runs.
[[nodiscard]] std::string_view chosen_isa() noexcept;
/// For tests and measurements: restricts the whole process to one of the above; empty: the best again. False: this
/// processor does not have it.
bool choose_isa(std::string_view isa) noexcept;

} // namespace trocar::fem
