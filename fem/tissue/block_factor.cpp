#include "fem/tissue/block_factor.hpp"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace trocar::fem {

namespace {

using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

std::vector<Index> find_order(const BlockMatrix& matrix) {
    const auto rows = static_cast<int>(matrix.row_count());
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(matrix.column.size());
    for (int row = 0; row < rows; ++row)
        for (Index k = matrix.row_begin[static_cast<std::size_t>(row)]; k < matrix.row_begin[static_cast<std::size_t>(row) + 1]; ++k)
            entries.emplace_back(row, static_cast<int>(matrix.column[k]), 1.0);
    Sparse pattern(rows, rows);
    pattern.setFromTriplets(entries.begin(), entries.end());
    Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> found;
    Eigen::AMDOrdering<int>()(pattern, found);
    std::vector<Index> order(matrix.row_count());
    for (std::size_t k = 0; k < order.size(); ++k) order[k] = static_cast<Index>(found.indices()[static_cast<Eigen::Index>(k)]);
    return order;
}

/// Lower half, in the order of elimination.
Sparse arrange(const BlockMatrix& matrix, std::span<const Index> order) {
    std::vector<int> place(order.size());
    for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = static_cast<int>(k);
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(9 * matrix.column.size() / 2 + 9 * order.size());
    for (std::size_t row = 0; row < order.size(); ++row)
        for (Index k = matrix.row_begin[row]; k < matrix.row_begin[row + 1]; ++k) {
            const int i = place[row], j = place[matrix.column[k]];
            if (i < j) continue;
            for (int a = 0; a < 3; ++a)
                for (int b = 0; b < 3; ++b)
                    if (i != j || a >= b) entries.emplace_back(3 * i + a, 3 * j + b, matrix.block[k](a, b));
        }
    const auto size = static_cast<int>(3 * order.size());
    Sparse lower(size, size);
    lower.setFromTriplets(entries.begin(), entries.end());
    return lower;
}

Mat3 invert_lower(const Mat3& l) {
    Mat3 inverse = Mat3::Zero();
    for (int column = 0; column < 3; ++column)
        for (int row = column; row < 3; ++row) {
            double sum = row == column ? 1.0 : 0.0;
            for (int k = column; k < row; ++k) sum -= l(row, k) * inverse(k, column);
            inverse(row, column) = sum / l(row, row);
        }
    return inverse;
}

FloatBlock round(const Mat3& block) {
    FloatBlock rounded{};
    for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) rounded[static_cast<std::size_t>(4 * column + row)] = static_cast<float>(block(row, column));
    return rounded;
}

using Four = Eigen::Array4f;
Four load(const std::array<float, 4>& from) noexcept { return Eigen::Map<const Four>(from.data()); }
void store(const Four& value, std::array<float, 4>& to) noexcept { Eigen::Map<Four>(to.data()) = value; }
Four column(const FloatBlock& block, int which) noexcept { return Eigen::Map<const Four>(block.data() + 4 * which); }

} // namespace

std::optional<BlockFactor> make_block_factor(const BlockMatrix& matrix) {
    BlockFactor factor;
    factor.order = find_order(matrix);
    const Sparse lower = arrange(matrix, factor.order);
    Eigen::SimplicialLLT<Sparse, Eigen::Lower, Eigen::NaturalOrdering<int>> cholesky(lower);
    if (cholesky.info() != Eigen::Success) return std::nullopt;
    const Sparse& found = cholesky.matrixL().nestedExpression();
    const int* begin = found.outerIndexPtr();
    const int* rows_below = found.innerIndexPtr();
    const double* value = found.valuePtr();
    const std::size_t rows = factor.order.size();
    factor.column_begin.assign(1, 0);
    factor.inverse.reserve(rows);
    for (std::size_t j = 0; j < rows; ++j) { // blocks are full: three columns that follow one another have the same rows below
        Mat3 diagonal = Mat3::Zero();
        for (int b = 0; b < 3; ++b) {
            const int first = begin[3 * j + static_cast<std::size_t>(b)];
            for (int a = b; a < 3; ++a) diagonal(a, b) = value[first + a - b];
        }
        factor.inverse.push_back(round(invert_lower(diagonal)));
        const int count = begin[3 * j + 1] - begin[3 * j] - 3;
        for (int k = 0; k < count; k += 3) {
            factor.row.push_back(static_cast<Index>(rows_below[begin[3 * j] + 3 + k] / 3));
            Mat3 block;
            for (int b = 0; b < 3; ++b)
                for (int a = 0; a < 3; ++a) block(a, b) = value[begin[3 * j + static_cast<std::size_t>(b)] + 3 - b + k + a];
            factor.below.push_back(round(block));
        }
        factor.column_begin.push_back(static_cast<Index>(factor.row.size()));
    }
    return factor;
}

void BlockFactor::solve(std::span<const Vec3> right, std::span<Vec3> out, std::span<std::array<float, 4>> scratch) const noexcept {
    const std::size_t rows = order.size();
    for (std::size_t k = 0; k < rows; ++k) {
        const Vec3& from = right[order[k]];
        scratch[k] = {static_cast<float>(from[0]), static_cast<float>(from[1]), static_cast<float>(from[2]), 0.0F};
    }
    for (std::size_t j = 0; j < rows; ++j) {
        const std::array<float, 4>& own = scratch[j];
        const Four y = column(inverse[j], 0) * own[0] + column(inverse[j], 1) * own[1] + column(inverse[j], 2) * own[2];
        store(y, scratch[j]);
        for (Index k = column_begin[j]; k < column_begin[j + 1]; ++k) {
            const FloatBlock& block = below[k];
            store(load(scratch[row[k]]) - (column(block, 0) * y[0] + column(block, 1) * y[1] + column(block, 2) * y[2]), scratch[row[k]]);
        }
    }
    for (std::size_t j = rows; j-- > 0;) {
        Four sums[3] = {Four::Zero(), Four::Zero(), Four::Zero()};
        for (Index k = column_begin[j]; k < column_begin[j + 1]; ++k) {
            const Four far = load(scratch[row[k]]);
            for (int axis = 0; axis < 3; ++axis) sums[axis] += column(below[k], axis) * far;
        }
        Four rest = load(scratch[j]);
        for (int axis = 0; axis < 3; ++axis) rest[axis] -= sums[axis][0] + sums[axis][1] + sums[axis][2];
        for (int axis = 0; axis < 3; ++axis) {
            const Four own = column(inverse[j], axis) * rest;
            scratch[j][static_cast<std::size_t>(axis)] = own[0] + own[1] + own[2];
        }
    }
    for (std::size_t k = 0; k < rows; ++k) out[order[k]] = Vec3(scratch[k][0], scratch[k][1], scratch[k][2]);
}

} // namespace trocar::fem
