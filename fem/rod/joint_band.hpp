// Rods that run within one another as one matrix: their nodes in the order of their arc lengths, so that what a bore couples lies near the
// diagonal, and its LDL^T factors. docs/contact.md, "A rod in another's bore".
#pragma once

#include "base/vec.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace trocar::fem {

/// Symmetric, positive definite; column c reaches from the diagonal to row end_[c], which never falls from one column to the next.
class JointBand {
public:
    struct Node {
        double arc;             // m, from the port: nodes are in the order of (chain, arc)
        Index chain;            // of rods within one another
        std::size_t coordinate; // its first one among all
        std::size_t count;      // of its coordinates
    };

    /// rows, entries   as many as it will have at most
    void reserve(std::size_t rows, std::size_t entries);

    /// Orders the coordinates anew; nothing is coupled yet.
    void order(std::span<Node> nodes);
    /// Makes room for an entry of two coordinates and of all between; all of them before begin().
    void couple(std::size_t a, std::size_t b) noexcept;
    /// All entries become 0.
    void begin();
    /// Adds to (a, b) and, by symmetry, to (b, a).
    void add(std::size_t a, std::size_t b, double value) noexcept;

    /// O(rows reach^2)
    void factorise() noexcept;
    /// x holds the right side before, the solution after. O(rows reach)
    void solve(std::span<double> x) noexcept;

private:
    std::vector<std::size_t> row_;  // [coordinates]
    std::vector<std::size_t> end_;  // [rows] last row of a column
    std::vector<std::size_t> from_; // [rows] where a column's diagonal is
    std::vector<double> data_;      // columns, diagonal first
    std::vector<double> before_, moved_; // [longest column], [rows]
};

} // namespace trocar::fem
