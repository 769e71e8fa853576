#include "fem/tissue/patches.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

namespace trocar::fem {

namespace {

using Neighbours = std::vector<std::array<Index, 4>>; // [tet_count] across each face; kNoIndex: none, or several, which are no neighbours

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
    const auto is_same = [&](std::size_t k, std::size_t other) { return other < faces.size() && faces[k].first == faces[other].first; };
    for (std::size_t k = 1; k < faces.size(); ++k) {
        if (!is_same(k, k - 1) || is_same(k, k + 1) || (k > 1 && is_same(k, k - 2))) continue;
        const auto [a, face_a] = faces[k - 1].second;
        const auto [b, face_b] = faces[k].second;
        neighbours[a][static_cast<std::size_t>(face_a)] = b;
        neighbours[b][static_cast<std::size_t>(face_b)] = a;
    }
    return neighbours;
}

/// What is the same but for rounding becomes the same, so that what comes next decides and not how the mesh lies. Of anything, for sorting.
double rounded(double value) {
    if (!std::isfinite(value)) return std::numeric_limits<double>::max();
    int exponent = 0;
    const double mantissa = std::frexp(value, &exponent);
    return std::ldexp(std::round(std::ldexp(mantissa, 30)), exponent - 30);
}

/// Centroids, and squared distances from them.
class Places {
public:
    Places(std::span<const Tet> tets, std::span<const Vec3> position) {
        Vec3 sum = Vec3::Zero();
        for (const Tet& tet : tets) {
            centroids_.push_back(0.25 * (position[tet[0]] + position[tet[1]] + position[tet[2]] + position[tet[3]]));
            sum += centroids_.back();
        }
        middle_ = sum / static_cast<double>(std::max<std::size_t>(tets.size(), 1));
    }
    [[nodiscard]] const Vec3& operator[](Index tet) const { return centroids_[tet]; }
    [[nodiscard]] double distance(Index tet, const Vec3& from) const { return rounded((centroids_[tet] - from).squaredNorm()); }
    [[nodiscard]] double from_middle(Index tet) const { return distance(tet, middle_); }

private:
    std::vector<Vec3> centroids_;
    Vec3 middle_;
};

/// One patch after another. The next begins at the front of those made, in the corner that is left with fewest free neighbours; of these the
/// farthest from the middle, so that no single tetrahedra are left over. It is grown by the free neighbour that adds fewest nodes; of these the one
/// nearest the patch's middle, so that patches are as round as they can be however the mesh lies; of these the one that would be left with fewest
/// free neighbours. What is still equal is taken along the order.
class Growth {
public:
    Growth(std::span<const Tet> tets, std::span<const Vec3> position, std::span<const double> stiffness, std::span<const Index> order)
        : tets_(tets), stiffness_(stiffness), neighbours_(find_neighbours(tets)), places_(tets, position), rank_(tets.size()), taken_(tets.size(), false) {
        for (std::size_t k = 0; k < order.size(); ++k) rank_[order[k]] = static_cast<Index>(k);
    }

    /// Their order: of the first of their tets along it, so that what is near is near in memory.
    [[nodiscard]] std::vector<Index> grow_all(std::span<const Index> order) {
        std::vector<Row> rows;
        rows.reserve(tets_.size() / kMostPatchTets * 9 / 8 + 1);
        std::vector<Seed> inner; // where nothing is taken around them
        for (const Index tet : order) inner.push_back(judge_seed(tet));
        std::sort(inner.begin(), inner.end());
        for (const Seed& first : inner) {
            if (!taken_[order[first.rank]]) rows.push_back(grow(order[first.rank]));
            while (!front_.empty()) {
                const Seed seed = front_.top();
                front_.pop();
                const Index tet = order[seed.rank];
                if (!taken_[tet] && seed == judge_seed(tet)) rows.push_back(grow(tet)); // else it is there a second time, as it is now
            }
        }
        std::sort(rows.begin(), rows.end());
        std::vector<Index> tets;
        tets.reserve(kMostPatchTets * rows.size());
        for (const Row& row : rows) tets.insert(tets.end(), row.tets.begin(), row.tets.end());
        return tets;
    }

private:
    struct Row {
        Index first = kNoIndex; // lowest rank
        std::array<Index, kMostPatchTets> tets{};
        auto operator<=>(const Row&) const = default;
    };
    struct Seed {
        int free_neighbours = 0;
        double nearness = 0.0;
        Index rank = 0;
        auto operator<=>(const Seed&) const = default;
    };
    struct Merit {
        int new_nodes = 0;
        double distance = 0.0;
        int free_neighbours = 0;
        Index rank = 0;
        auto operator<=>(const Merit&) const = default;
    };

    [[nodiscard]] Row grow(Index seed) {
        count_ = 0;
        sum_ = Vec3::Zero();
        add(seed);
        while (count_ < kMostPatchTets) {
            const Index next = find_next();
            if (next == kNoIndex) break;
            add(next);
        }
        Row row;
        row.tets.fill(kNoIndex);
        for (std::size_t k = 0; k < count_; ++k) {
            row.tets[k] = patch_[k];
            row.first = std::min(row.first, rank_[patch_[k]]);
            for (const Index other : neighbours_[patch_[k]])
                if (other != kNoIndex && !taken_[other]) front_.push(judge_seed(other));
        }
        return row;
    }
    void add(Index tet) {
        taken_[tet] = true;
        patch_[count_++] = tet;
        sum_ += places_[tet];
    }
    [[nodiscard]] bool has_node(Index node) const {
        return std::any_of(patch_.begin(), patch_.begin() + static_cast<std::ptrdiff_t>(count_),
                           [&](Index tet) { return std::find(tets_[tet].begin(), tets_[tet].end(), node) != tets_[tet].end(); });
    }
    [[nodiscard]] int count_free(Index tet) const {
        return static_cast<int>(std::count_if(neighbours_[tet].begin(), neighbours_[tet].end(), [&](Index other) { return other != kNoIndex && !taken_[other]; }));
    }
    [[nodiscard]] Seed judge_seed(Index tet) const {
        return {count_free(tet), -places_.from_middle(tet), rank_[tet]};
    }
    [[nodiscard]] Merit judge(Index tet) const {
        Merit merit{0, places_.distance(tet, sum_ / static_cast<double>(count_)), count_free(tet), rank_[tet]};
        for (const Index node : tets_[tet]) merit.new_nodes += !has_node(node);
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
    Places places_;
    std::vector<Index> rank_;
    std::vector<bool> taken_;
    std::priority_queue<Seed, std::vector<Seed>, std::greater<>> front_; // free neighbours of what is taken
    std::array<Index, kMostPatchTets> patch_{};
    std::size_t count_ = 0;
    Vec3 sum_ = Vec3::Zero(); // of the patch's centroids
};

} // namespace

std::vector<Index> make_patches(std::span<const Tet> tets, std::span<const Vec3> position, std::span<const double> stiffness, std::span<const Index> order) {
    return Growth(tets, position, stiffness, order).grow_all(order);
}

} // namespace trocar::fem
