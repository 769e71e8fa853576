// One pair of prisms (prisms.hpp), in plain words: what the kernels of tet_prisms-inl.hpp take in lanes.
#pragma once

#include "fem/tissue/block.hpp"
#include "fem/tissue/prisms.hpp"

namespace trocar::fem {

[[nodiscard]] inline Mat3 to_matrix(const Block<double>& block) noexcept { return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(block.m); }
[[nodiscard]] inline Block<double> to_block(const Mat3& matrix) noexcept {
    Block<double> block;
    for (int i = 0; i < 9; ++i) block.m[i] = matrix(i / 3, i % 3);
    return block;
}

class PrismPair {
public:
    /// first, lane: of the pair's first tetrahedra; edges_at(k): x1 - x0, x2 - x0, x3 - x0 of its k-th as columns
    template <class EdgesAt>
    PrismPair(const ForcePlan& plan, std::size_t first, std::size_t lane, EdgesAt&& edges_at) : pair_(plan.pairs[first / kPatch]), lane_(lane) {
        for (std::size_t k = 0; k < kPairTets; ++k)
            if (is_outer(k)) add(plan.prisms[first + k], k, to_matrix(edges_at(k)));
        complete();
    }

    /// Fs
    [[nodiscard]] const Mat3& felt() const { return felt_; }
    /// J/m^3 over mu: of what the two prisms differ by.
    [[nodiscard]] double hold_energy() const { return hold_; }
    /// |B|^2 of both.
    [[nodiscard]] double bending_sq() const { return bent_[0].squaredNorm() + bent_[1].squaredNorm(); }

private:
    void add(const PrismBatch& prism, std::size_t k, const Mat3& edges);
    void complete();

    const PairBatch& pair_;
    std::size_t lane_;
    Mat3 mean_ = Mat3::Zero(), jump_ = Mat3::Zero(), bent_[2] = {Mat3::Zero(), Mat3::Zero()}, felt_;
    double hold_ = 0.0;
};

} // namespace trocar::fem
