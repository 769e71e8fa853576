// Which tet contains a point: a uniform grid over the tets' boxes. For preparation, not for the step loop.
#pragma once

#include "base/mesh.hpp"

namespace trocar::fem {

class TetLocator {
public:
    explicit TetLocator(const TetMesh& mesh);

    /// The lowest tet that contains p, its faces included (barycentric coordinates down to -1e-12 count); kNoIndex outside.
    [[nodiscard]] Index find(const Vec3& p) const noexcept;

private:
    [[nodiscard]] std::array<Index, 3> cell_of(const Vec3& p) const noexcept;
    [[nodiscard]] std::size_t cell_id(Index i, Index j, Index k) const noexcept {
        return (static_cast<std::size_t>(k) * count_[1] + j) * count_[0] + i;
    }
    [[nodiscard]] bool contains(Index tet, const Vec3& p) const noexcept;

    const TetMesh& mesh_;
    Box3 bounds_;
    double cell_ = 1.0; // m, edge of a cell
    std::array<Index, 3> count_{1, 1, 1};
    std::vector<Index> begin_; // [cell_count + 1]
    std::vector<Index> tets_;  // ascending within a cell
};

} // namespace trocar::fem
