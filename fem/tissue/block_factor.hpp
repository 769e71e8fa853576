// Sparse Cholesky factor of a symmetric positive definite matrix of 3 x 3 blocks: one row of blocks for each node.
// Ordered by approximate minimum degree (Amestoy, Davis & Duff 1996) and factored by Eigen; kept by blocks and in single precision, since a solve is bound
// by memory: it preconditions solves in double precision.
#pragma once

#include "base/mesh.hpp"

#include <array>
#include <optional>
#include <span>
#include <vector>

namespace trocar::fem {

/// Symmetric; both halves are given, row by row.
struct BlockMatrix {
    std::vector<Index> row_begin; // [rows + 1]
    std::vector<Index> column;    // ascending within a row, the diagonal included
    std::vector<Mat3> block;      // of each column

    [[nodiscard]] std::size_t row_count() const noexcept { return row_begin.empty() ? 0 : row_begin.size() - 1; }
};

/// Three columns of three numbers and a 0 each.
using FloatBlock = std::array<float, 12>;

struct BlockFactor {
    std::vector<Index> order;        // [rows] row of the matrix that is eliminated k-th
    std::vector<Index> column_begin; // [rows + 1]
    std::vector<Index> row;          // of a block below the diagonal: place in `order`
    std::vector<FloatBlock> below;   // of each row
    std::vector<FloatBlock> inverse; // [rows] of the diagonal block's lower triangle

    /// out = A^-1 right, to single precision; scratch [rows]. right and out may be the same.
    void solve(std::span<const Vec3> right, std::span<Vec3> out, std::span<std::array<float, 4>> scratch) const noexcept;
};

/// None: not positive definite.
[[nodiscard]] std::optional<BlockFactor> make_block_factor(const BlockMatrix& matrix);

} // namespace trocar::fem
