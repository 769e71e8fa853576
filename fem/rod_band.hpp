// Symmetric positive definite band matrix in three-coordinate blocks, and its LDL^T solve: what the rod's Newton step needs.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <span>

namespace seldinger::fem {

/// Node i meets i - 2 .. i + 2, three coordinates each: row r reaches back to column r - 8.
inline constexpr std::size_t kRodBandwidth = 8;

class RodBand {
public:
    /// storage  [3 node_count][kRodBandwidth + 1], the lower band, diagonal last
    RodBand(std::span<double> storage, std::size_t node_count) noexcept : data_(storage), size_(3 * node_count) {
        std::fill_n(data_.begin(), size_ * (kRodBandwidth + 1), 0.0);
    }

    /// Adds to the block of nodes (i, j) and by symmetry to (j, i).
    void add(std::size_t i, std::size_t j, const Mat3& m) noexcept {
        const bool lower = i >= j;
        for (std::size_t r = 0; r < 3; ++r)
            for (std::size_t c = 0; c < 3; ++c) {
                const std::size_t row = lower ? 3 * i + r : 3 * j + r;
                const std::size_t column = lower ? 3 * j + c : 3 * i + c;
                if (row >= column) at(row, column) += lower ? m(int(r), int(c)) : m(int(c), int(r));
            }
    }
    void add(std::size_t i, std::size_t j, double scale) noexcept {
        const std::size_t high = std::max(i, j), low = std::min(i, j);
        for (std::size_t r = 0; r < 3; ++r) at(3 * high + r, 3 * low + r) += scale;
    }

    /// Factorises in place and solves; x holds the right side before, the solution after. O(size * bandwidth^2).
    void solve(std::span<double> x) noexcept {
        for (std::size_t row = 0; row < size_; ++row) factorise_row(row, x);
        for (std::size_t row = 0; row < size_; ++row) x[row] /= at(row, row);
        for (std::size_t row = size_; row-- > 0;)
            for (std::size_t column = first_column(row); column < row; ++column) x[column] -= at(row, column) * x[row];
    }

private:
    [[nodiscard]] static std::size_t first_column(std::size_t row) noexcept { return row > kRodBandwidth ? row - kRodBandwidth : 0; }
    [[nodiscard]] double& at(std::size_t row, std::size_t column) noexcept {
        return data_[row * (kRodBandwidth + 1) + (kRodBandwidth - (row - column))];
    }
    /// Leaves L in the row and D on the diagonal, and does the forward substitution on the way.
    void factorise_row(std::size_t row, std::span<double> x) noexcept {
        const std::size_t first = first_column(row);
        for (std::size_t column = first; column < row; ++column) {
            double sum = at(row, column);
            for (std::size_t k = std::max(first, first_column(column)); k < column; ++k)
                sum -= at(row, k) * at(column, k); // L_rk D_k (not yet divided) times L_ck
            at(row, column) = sum;
        }
        double diagonal = at(row, row);
        for (std::size_t column = first; column < row; ++column) {
            const double factor = at(row, column) / at(column, column);
            diagonal -= factor * at(row, column);
            x[row] -= factor * x[column];
            at(row, column) = factor;
        }
        at(row, row) = diagonal;
    }

    std::span<double> data_;
    std::size_t size_;
};

} // namespace seldinger::fem
