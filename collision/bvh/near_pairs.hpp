// Which of two blocks' features come near each other: the innermost loop of the broad phase. Highway kernels for every instruction
// set, chosen at run time, and a scalar reference that gives the same pairs in the same order.
#pragma once

#include "collision/ccd/sweep_batch.hpp"

#include <cstddef>
#include <cstdint>

namespace trocar::collision {

/// Consecutive blocks of 16 features as DopTree lays them out, at most a cluster's.
struct BlockRun {
    const float* bounds = nullptr;  // [blocks][2 slabs][16]
    const Index* ids = nullptr;     // [blocks][16]
    const Index* corners = nullptr; // [blocks][3][16]
    Index count = 0;                // features
    int corner_count = 0;           // 1 vertices, 2 edges, 3 faces
};

struct NearTest {
    std::size_t slabs = 3;
    const float* distance = nullptr; // [slabs] m along each direction, times the direction's length, rounded up
    const float* box_a = nullptr;    // [2 slabs] holds all of a
    const float* box_b = nullptr;    // [2 slabs] holds all of b
    bool skip_shared = false;        // one surface against itself: features that share a vertex do not count
    bool same_run = false;           // a is b: each unordered pair once
};

/// Appends (feature of a, feature of b) for all whose bounds are no farther apart than the distance: by a, then by b.
/// out       room for a.count * b.count pairs
/// returns   how many were written
[[nodiscard]] std::size_t near_pairs(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) noexcept;
[[nodiscard]] std::size_t near_pairs_plain(const BlockRun& a, const BlockRun& b, const NearTest& test, FeaturePair* out) noexcept;

/// Bit i: child i comes near the box.
/// box   [2 slabs]        children   [2 slabs][arity], arity 2, 4 or 8
[[nodiscard]] std::uint32_t near_children(const float* box, std::size_t box_stride, const float* children, std::size_t arity,
                                          std::size_t slabs, const float* distance) noexcept;
[[nodiscard]] std::uint32_t near_children_plain(const float* box, std::size_t box_stride, const float* children, std::size_t arity,
                                                std::size_t slabs, const float* distance) noexcept;

/// Bit i: feature i of a block of 16 comes near the box. Empty lanes never do, unless the distance is infinite.
/// box   [2 slabs]        block   [2 slabs][16]
[[nodiscard]] std::uint32_t near_features(const float* box, const float* block, std::size_t slabs, const float* distance) noexcept;
[[nodiscard]] std::uint32_t near_features_plain(const float* box, const float* block, std::size_t slabs, const float* distance) noexcept;

/// Name of the instruction set that the kernels run on.
[[nodiscard]] const char* near_pairs_target() noexcept;

} // namespace trocar::collision
