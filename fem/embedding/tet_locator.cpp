#include "fem/embedding/tet_locator.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

constexpr double kMaxCellsPerTet = 8.0; // a long thin body would otherwise ask for far more cells than it has tets

Box3 box_of(const TetMesh& mesh, Index tet) {
    Box3 box;
    for (const Index node : mesh.tets[tet]) box.add(mesh.vertices[node]);
    return box;
}

} // namespace

TetLocator::TetLocator(const TetMesh& mesh) : mesh_(mesh) {
    double edges = 0.0;
    for (Index tet = 0; tet < mesh.tets.size(); ++tet) {
        const Box3 box = box_of(mesh, tet);
        bounds_.add(box);
        edges += box.longest_edge();
    }
    if (mesh.tets.empty()) return;
    const Vec3 extent = bounds_.extent();
    cell_ = std::max({edges / static_cast<double>(mesh.tets.size()), 1e-3 * extent.maxCoeff(),
                      std::cbrt(extent.prod() / (kMaxCellsPerTet * static_cast<double>(mesh.tets.size())))});
    for (std::size_t axis = 0; axis < 3; ++axis) count_[axis] = static_cast<Index>(extent[static_cast<int>(axis)] / cell_) + 1;

    const std::size_t cells = static_cast<std::size_t>(count_[0]) * count_[1] * count_[2];
    begin_.assign(cells + 1, 0);
    const auto for_each_cell = [&](Index tet, auto&& visit) {
        const Box3 box = box_of(mesh, tet);
        const auto lo = cell_of(box.lo), hi = cell_of(box.hi);
        for (Index k = lo[2]; k <= hi[2]; ++k)
            for (Index j = lo[1]; j <= hi[1]; ++j)
                for (Index i = lo[0]; i <= hi[0]; ++i) visit(cell_id(i, j, k));
    };
    for (Index tet = 0; tet < mesh.tets.size(); ++tet) for_each_cell(tet, [&](std::size_t cell) { ++begin_[cell + 1]; });
    for (std::size_t cell = 0; cell < cells; ++cell) begin_[cell + 1] += begin_[cell];
    tets_.resize(begin_.back());
    std::vector<Index> next(begin_.begin(), begin_.end() - 1);
    for (Index tet = 0; tet < mesh.tets.size(); ++tet) for_each_cell(tet, [&](std::size_t cell) { tets_[next[cell]++] = tet; });
}

std::array<Index, 3> TetLocator::cell_of(const Vec3& p) const noexcept {
    std::array<Index, 3> cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const int a = static_cast<int>(axis);
        const double at = std::clamp((p[a] - bounds_.lo[a]) / cell_, 0.0, static_cast<double>(count_[axis] - 1));
        cell[axis] = static_cast<Index>(at);
    }
    return cell;
}

bool TetLocator::contains(Index tet, const Vec3& p) const noexcept {
    const Tet& t = mesh_.tets[tet];
    Vec3 x[4];
    for (std::size_t i = 0; i < 4; ++i) x[i] = mesh_.vertices[t[i]] - p;
    const auto volume = [&](int a, int b, int c) { return x[a].dot(x[b].cross(x[c])); };
    const double part[4] = {volume(1, 2, 3), -volume(0, 2, 3), volume(0, 1, 3), -volume(0, 1, 2)};
    const double least = -1e-12 * std::abs(part[0] + part[1] + part[2] + part[3]);
    return part[0] >= least && part[1] >= least && part[2] >= least && part[3] >= least;
}

Index TetLocator::find(const Vec3& p) const noexcept {
    if (tets_.empty() || !bounds_.contains(p)) return kNoIndex;
    const auto [i, j, k] = cell_of(p);
    const std::size_t cell = cell_id(i, j, k);
    for (Index slot = begin_[cell]; slot < begin_[cell + 1]; ++slot)
        if (contains(tets_[slot], p)) return tets_[slot];
    return kNoIndex;
}

} // namespace trocar::fem
