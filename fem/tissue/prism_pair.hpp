// One pair of prisms (prisms.hpp), in plain words: what the kernels of tet_prisms-inl.hpp take in lanes.
#pragma once

#include "fem/tissue/block.hpp"
#include "fem/tissue/prisms.hpp"

#include <array>

namespace trocar::fem {

[[nodiscard]] inline Mat3 to_matrix(const Block<double>& block) noexcept { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.m); }
[[nodiscard]] inline Block<double> to_block(const Mat3& matrix) noexcept {
    Block<double> block;
    for (int i = 0; i < 9; ++i) block.m[i] = matrix(i / 3, i % 3);
    return block;
}

/// Derivatives of an energy by what is linear in the nodes' positions.
struct PairStress {
    Mat3 mean, jump, bent[2]; // by Fm, by J, by each prism's B times the root of its share of the pair
};

/// How a prism is bent along the wall, which no rotation changes: of the symmetric part of Fm^T B, xx yy xy along the pair's axes.
using PrismBending = std::array<double, 3>;

class PrismPair {
public:
    /// first, lane: of the pair's first tetrahedra; edges_at(k): x1 - x0, x2 - x0, x3 - x0 of its k-th as columns
    template <class EdgesAt>
    PrismPair(const ForcePlan& plan, std::size_t first, std::size_t lane, EdgesAt&& edges_at) : pair_(plan.pairs[first / kPatch]), lane_(lane) {
        for (std::size_t k = 0; k < kPairTets; ++k)
            if (is_outer(k)) add(plan.prisms[first + k], k, edges_at(k));
        complete();
    }

    /// Fs
    [[nodiscard]] const Mat3& felt() const { return felt_; }
    /// J/m^3 over mu: of what the law does not see but bending.
    [[nodiscard]] double hold_energy() const;
    /// |B|^2 of both prisms.
    [[nodiscard]] double bending_sq() const { return bent_[0].squaredNorm() + bent_[1].squaredNorm(); }
    /// Times the root of its share of the pair.
    [[nodiscard]] PrismBending bending(std::size_t prism) const;
    /// stress: derivative of an energy by Fs
    [[nodiscard]] PairStress pull_back(const Mat3& stress) const;
    /// stress: derivative of an energy by bending(prism), its xy counted once
    void add_bending(std::size_t prism, const PrismBending& stress, PairStress& to) const;

private:
    void add(const PrismBatch& prism, std::size_t k, const Block<double>& edges);
    void complete();

    const PairBatch& pair_;
    std::size_t lane_;
    Mat3 mean_ = Mat3::Zero(), jump_ = Mat3::Zero(), bent_[2] = {Mat3::Zero(), Mat3::Zero()}, felt_;
    Vec3 along_[2], across_;                       // at rest
    Vec3 edge_[2], up_, normal_, kink_[2], fold_; // as it stands, as in PairFrame
    double per_area_ = 0.0, less_ = 0.0, both_ = 0.0, root_ = 1.0, growth_ = 0.5, step_[2] = {};
};

} // namespace trocar::fem
