// Symmetric positive definite band matrix in blocks of a node's coordinates, and its LDL^T solve: what the rod's Newton step needs.
#pragma once

#include "base/vec.hpp"

#include <algorithm>
#include <span>
#include <type_traits>

namespace trocar::fem {

/// Coordinates of a node: three of its position, and with torsion its angle.
inline constexpr std::size_t kRodCoordinates = 3, kTwistedCoordinates = 4;

/// Node i meets i - 2 .. i + 2: row r reaches back to column r - 8 with three coordinates a node, to r - 11 with four.
[[nodiscard]] constexpr std::size_t rod_bandwidth(std::size_t coordinates) noexcept { return 3 * coordinates - 1; }
inline constexpr std::size_t kRodBandwidth = rod_bandwidth(kRodCoordinates);

template <std::size_t kCoordinates>
class RodBandOf {
public:
    static constexpr std::size_t kBandwidth = rod_bandwidth(kCoordinates);

    /// storage  [kCoordinates node_count][kBandwidth + 1], the lower band by columns, diagonal first
    RodBandOf(std::span<double> storage, std::size_t node_count) noexcept : data_(storage), size_(kCoordinates * node_count) {
        std::fill_n(data_.begin(), size_ * (kBandwidth + 1), 0.0);
    }

    /// Adds to the block of positions of nodes (i, j) and by symmetry to (j, i). On the diagonal m is symmetric.
    void add(std::size_t i, std::size_t j, const Mat3& m) noexcept {
        const std::size_t high = std::max(i, j), low = std::min(i, j), between = kCoordinates * (high - low);
        for (std::size_t c = 0; c < 3; ++c) {
            double* column = column_of(kCoordinates * low + c); // its rows count from the diagonal
            if (high == low)
                for (std::size_t r = c; r < 3; ++r) column[r - c] += m(int(r), int(c));
            else if (i > j)
                for (std::size_t r = 0; r < 3; ++r) column[between + r - c] += m(int(r), int(c));
            else
                for (std::size_t r = 0; r < 3; ++r) column[between + r - c] += m(int(c), int(r));
        }
    }
    void add(std::size_t i, std::size_t j, double scale) noexcept {
        const std::size_t high = std::max(i, j), low = std::min(i, j);
        for (std::size_t r = 0; r < 3; ++r) column_of(kCoordinates * low + r)[kCoordinates * (high - low)] += scale;
    }
    /// Adds to the entry of coordinates a and b, counted over all nodes, and by symmetry to (b, a).
    void add_entry(std::size_t a, std::size_t b, double value) noexcept { column_of(std::min(a, b))[a > b ? a - b : b - a] += value; }

    /// Factorises in place and solves; x holds the right side before, the solution after. O(size * bandwidth^2).
    void solve(std::span<double> x) noexcept {
        const std::size_t whole = size_ > kBandwidth ? size_ - kBandwidth : 0; // columns with all of their band beneath
        for (std::size_t c = 0; c < whole; ++c) eliminate(c, Whole(), x.data());
        for (std::size_t c = whole; c < size_; ++c) eliminate(c, size_ - 1 - c, x.data());
        substitute_back(x);
    }

    /// Solves once more with the factors that solve() left. Below `from` x is 0.
    void solve_again(std::span<double> x, std::size_t from) noexcept {
        const std::size_t whole = std::max(from, size_ > kBandwidth ? size_ - kBandwidth : 0);
        for (std::size_t c = from; c < whole; ++c) substitute(c, Whole(), x.data());
        for (std::size_t c = whole; c < size_; ++c) substitute(c, size_ - 1 - c, x.data());
        substitute_back(x);
    }

    /// Calls entry(a, b, value) of all of its entries but those above the diagonal, before solve().
    template <class Entry>
    void for_each_entry(const Entry& entry) const noexcept {
        for (std::size_t c = 0; c < size_; ++c)
            for (std::size_t m = 0; m <= kBandwidth && c + m < size_; ++m) entry(c + m, c, data_[c * (kBandwidth + 1) + m]);
    }

    /// After solve(): was the matrix positive definite?
    [[nodiscard]] bool is_definite() const noexcept {
        bool positive = true;
        for (std::size_t c = 0; c < size_; ++c) positive = positive && data_[c * (kBandwidth + 1)] > 0.0;
        return positive;
    }

private:
    using Whole = std::integral_constant<std::size_t, kBandwidth>;

    void substitute_back(std::span<double> x) noexcept {
        for (std::size_t c = 0; c < size_; ++c) x[c] /= column_of(c)[0];
        const std::size_t whole = size_ > kBandwidth ? size_ - kBandwidth : 0;
        for (std::size_t c = size_; c-- > whole;) gather(c, size_ - 1 - c, x.data());
        for (std::size_t c = whole; c-- > 0;) gather(c, Whole(), x.data());
    }

    template <class Reach>
    void substitute(std::size_t c, Reach reach, double* x) noexcept {
        const double* own = column_of(c);
        const double at = x[c];
        for (std::size_t m = 1; m <= reach; ++m) x[c + m] -= own[m] * at;
    }
    /// The nearest entry last: it is the one that is waited for.
    template <class Reach>
    void gather(std::size_t c, Reach reach, double* x) noexcept {
        const double* own = column_of(c);
        double sum = x[c];
        for (std::size_t m = reach; m > 0; --m) sum -= own[m] * x[c + m];
        x[c] = sum;
    }

    [[nodiscard]] double* column_of(std::size_t column) noexcept { return data_.data() + column * (kBandwidth + 1); }

    /// Leaves D and L in column c, takes what it does to the `reach` columns after it off those, and substitutes forward on the way.
    /// The products of a column depend only on its divisions: entry by entry, each after the one before, it takes five times as long.
    template <class Reach>
    void eliminate(std::size_t c, Reach reach, double* x) noexcept {
        double* own = column_of(c);
        double before[kBandwidth + 1]; // L D
        for (std::size_t m = 1; m <= reach; ++m) before[m] = own[m];
        for (std::size_t m = 1; m <= reach; ++m) own[m] = before[m] / own[0];
        for (std::size_t i = 1; i <= reach; ++i) {
            double* other = column_of(c + i);
            for (std::size_t m = i; m <= reach; ++m) other[m - i] -= before[m] * own[i];
        }
        for (std::size_t m = 1; m <= reach; ++m) x[c + m] -= own[m] * x[c];
    }

    std::span<double> data_;
    std::size_t size_;
};

using RodBand = RodBandOf<kRodCoordinates>;

} // namespace trocar::fem
