#include "fem/tissue/patches.hpp"

#include <algorithm>
#include <array>

namespace trocar::fem {

namespace {

using Neighbours = std::vector<std::array<Index, 4>>; // [tet_count] across each face; kNoIndex: none

Neighbours find_neighbours(std::span<const Tet> tets) {
    std::vector<std::pair<std::array<Index, 3>, std::pair<Index, int>>> faces;
    faces.reserve(4 * tets.size());
    for (std::size_t tet = 0; tet < tets.size(); ++tet)
        for (int apex = 0; apex < 4; ++apex) {
            std::array<Index, 3> face{};
            for (int corner = 0, k = 0; corner < 4; ++corner)
                if (corner != apex) face[static_cast<std::size_t>(k++)] = tets[tet][static_cast<std::size_t>(corner)];
            std::sort(face.begin(), face.end());
            faces.push_back({face, {static_cast<Index>(tet), apex}});
        }
    std::sort(faces.begin(), faces.end());
    Neighbours neighbours(tets.size(), {kNoIndex, kNoIndex, kNoIndex, kNoIndex});
    for (std::size_t k = 1; k < faces.size(); ++k) {
        if (faces[k].first != faces[k - 1].first) continue;
        const auto [a, face_a] = faces[k - 1].second;
        const auto [b, face_b] = faces[k].second;
        neighbours[a][static_cast<std::size_t>(face_a)] = b;
        neighbours[b][static_cast<std::size_t>(face_b)] = a;
    }
    return neighbours;
}

/// One patch after another, each grown by the free neighbour that adds fewest nodes; of these the one that would be left with fewest free
/// neighbours of its own; of these the first along the order.
class Growth {
public:
    Growth(std::span<const Tet> tets, std::span<const double> stiffness, std::span<const Index> order)
        : tets_(tets), stiffness_(stiffness), neighbours_(find_neighbours(tets)), rank_(tets.size()), taken_(tets.size(), false) {
        for (std::size_t k = 0; k < order.size(); ++k) rank_[order[k]] = static_cast<Index>(k);
    }

    void grow(Index seed, std::vector<Index>& rows) {
        if (taken_[seed]) return;
        count_ = 0;
        add(seed);
        while (count_ < kMostPatchTets) {
            const Index next = find_next();
            if (next == kNoIndex) break;
            add(next);
        }
        for (std::size_t k = 0; k < kMostPatchTets; ++k) rows.push_back(k < count_ ? patch_[k] : kNoIndex);
    }

private:
    void add(Index tet) {
        taken_[tet] = true;
        patch_[count_++] = tet;
    }
    [[nodiscard]] bool has_node(Index node) const {
        return std::any_of(patch_.begin(), patch_.begin() + static_cast<std::ptrdiff_t>(count_),
                           [&](Index tet) { return std::find(tets_[tet].begin(), tets_[tet].end(), node) != tets_[tet].end(); });
    }
    struct Merit {
        int new_nodes, free_neighbours;
        Index rank;
        auto operator<=>(const Merit&) const = default;
    };
    [[nodiscard]] Merit judge(Index tet) const {
        Merit merit{0, 0, rank_[tet]};
        for (const Index node : tets_[tet]) merit.new_nodes += !has_node(node);
        for (const Index other : neighbours_[tet]) merit.free_neighbours += other != kNoIndex && !taken_[other];
        return merit;
    }
    [[nodiscard]] Index find_next() const {
        Index best = kNoIndex;
        Merit least{};
        for (std::size_t k = 0; k < count_; ++k)
            for (const Index tet : neighbours_[patch_[k]]) {
                if (tet == kNoIndex || taken_[tet] || stiffness_[tet] != stiffness_[patch_[0]]) continue;
                const Merit merit = judge(tet);
                if (best != kNoIndex && !(merit < least)) continue;
                best = tet;
                least = merit;
            }
        return best;
    }

    std::span<const Tet> tets_;
    std::span<const double> stiffness_;
    Neighbours neighbours_;
    std::vector<Index> rank_;
    std::vector<bool> taken_;
    std::array<Index, kMostPatchTets> patch_{};
    std::size_t count_ = 0;
};

} // namespace

std::vector<Index> make_patches(std::span<const Tet> tets, std::span<const double> stiffness, std::span<const Index> order) {
    Growth growth(tets, stiffness, order);
    std::vector<Index> rows;
    rows.reserve(tets.size() + tets.size() / 8);
    for (const Index seed : order) growth.grow(seed, rows);
    return rows;
}

} // namespace trocar::fem
