// A surface cut into convex pieces: a sphere that holds a piece's corners holds the piece, so "covered" is a bound and not a
// matter of samples. Pieces are cut on demand where no single sphere holds them.
#pragma once

#include "base/mesh.hpp"

#include <span>

namespace trocar::spheretree {

struct Piece {
    std::array<Index, 3> corners{}; // ids into PieceSet::points
    Index triangle = kNoIndex;      // of the mesh, that it is a part of
};

/// Points that define the pieces: the mesh's vertices first, then midpoints, each of two earlier points. Midpoints move with
/// their parents, so a piece stays a part of its triangle while the mesh deforms.
class PieceSet {
public:
    explicit PieceSet(std::span<const Vec3> vertices) : points_(vertices.begin(), vertices.end()), vertex_count_(vertices.size()) {}

    [[nodiscard]] const Vec3& point(Index id) const noexcept { return points_[id]; }
    [[nodiscard]] const std::vector<Vec3>& points() const noexcept { return points_; }
    [[nodiscard]] std::size_t vertex_count() const noexcept { return vertex_count_; }
    [[nodiscard]] const std::vector<std::array<Index, 2>>& midpoints() const noexcept { return midpoints_; }

    /// Square of the longest edge, m^2, and the corner it starts from.
    [[nodiscard]] double longest_edge_sq(const Piece& piece, int& corner) const noexcept {
        double longest = -1.0;
        for (int k = 0; k < 3; ++k) {
            const double length =
                (points_[piece.corners[static_cast<std::size_t>(k)]] - points_[piece.corners[static_cast<std::size_t>((k + 1) % 3)]])
                    .squaredNorm();
            if (length > longest) {
                longest = length;
                corner = k;
            }
        }
        return longest;
    }

    /// Two halves, cut through the middle of the edge that starts at `corner`.
    [[nodiscard]] std::array<Piece, 2> split(const Piece& piece, int corner) {
        const auto a = static_cast<std::size_t>(corner), b = (a + 1) % 3, c = (a + 2) % 3;
        const auto middle = static_cast<Index>(points_.size());
        points_.push_back(0.5 * (points_[piece.corners[a]] + points_[piece.corners[b]]));
        midpoints_.push_back({piece.corners[a], piece.corners[b]});
        return {Piece{{piece.corners[a], middle, piece.corners[c]}, piece.triangle},
                Piece{{middle, piece.corners[b], piece.corners[c]}, piece.triangle}};
    }

    /// Takes back the cuts made since there were so many points.
    void shrink(std::size_t points) {
        points_.resize(points);
        midpoints_.resize(points - vertex_count_);
    }

private:
    std::vector<Vec3> points_;                    // [vertex_count + midpoint_count] m
    std::vector<std::array<Index, 2>> midpoints_; // [midpoint_count] parents of points_[vertex_count + i]
    std::size_t vertex_count_ = 0;
};

} // namespace trocar::spheretree
