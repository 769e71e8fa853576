#include "collision/culling/chromatic_sets.hpp"

#include <algorithm>
#include <bit>
#include <cassert>
#include <numeric>

namespace trocar::collision {
namespace {

/// Work on the extended dual graph, in visits of a neighbour of a neighbour, before vertices of high valence are taken out of it.
constexpr std::uint64_t kMostVisits = 1ull << 28;
/// Above this valence a vertex is a hub from the start: its triangles need a set each anyway.
constexpr std::size_t kHubValence = 256;

constexpr Index kUncoloured = kNoIndex;

ChromaticSets gather_sets(std::vector<Index> set_of, Index count) {
    ChromaticSets sets;
    sets.begin.assign(count + 1, 0);
    for (const Index set : set_of) ++sets.begin[set + 1];
    std::partial_sum(sets.begin.begin(), sets.begin.end(), sets.begin.begin());
    sets.members.resize(set_of.size());
    std::vector<Index> next(sets.begin.begin(), sets.begin.end() - 1);
    for (Index t = 0; t < set_of.size(); ++t) sets.members[next[set_of[t]]++] = t;
    sets.set_of = std::move(set_of);
    return sets;
}

/// Lists of triangles per triangle, in one array.
struct Lists {
    std::vector<std::size_t> begin{0};
    std::vector<Index> items;
    void close_list() { begin.push_back(items.size()); }
    [[nodiscard]] std::span<const Index> of(Index id) const noexcept {
        return std::span(items).subspan(begin[id], begin[id + 1] - begin[id]);
    }
};

/// Marks which triangles were visited since the last start.
class Stamps {
public:
    explicit Stamps(std::size_t count) : stamp_(count, 0) {}
    void start() noexcept { ++now_; }
    [[nodiscard]] bool first_time(Index id) noexcept {
        const bool fresh = stamp_[id] != now_;
        stamp_[id] = now_;
        return fresh;
    }

private:
    std::vector<std::uint32_t> stamp_;
    std::uint32_t now_ = 0;
};

/// Largest valence whose graph is affordable: all but hostile meshes stay far below the bound at once.
std::size_t find_hub_valence(std::span<const Triangle> triangles, const TriangleStars& stars, std::size_t vertex_count) {
    for (std::size_t limit = kHubValence; limit > 2; limit /= 2) {
        const auto valence = [&](Index v) -> std::uint64_t { return stars.of(v).size() <= limit ? stars.of(v).size() : 0; };
        std::uint64_t visits = 0;
        for (Index v = 0; v < vertex_count && visits <= kMostVisits; ++v) {
            std::uint64_t around = 0;
            if (valence(v) > 0)
                for (const Index t : stars.of(v)) around += valence(triangles[t][0]) + valence(triangles[t][1]) + valence(triangles[t][2]);
            visits += valence(v) * around;
        }
        if (visits <= kMostVisits) return limit;
    }
    return 2;
}

/// Neighbours of each triangle, itself included, across vertices that are no hubs.
Lists find_neighbours(std::span<const Triangle> triangles, const TriangleStars& stars, std::size_t hub_valence) {
    Lists out;
    Stamps stamps(triangles.size());
    for (Index t = 0; t < triangles.size(); ++t) {
        stamps.start();
        for (const Index v : triangles[t]) {
            if (stars.of(v).size() > hub_valence) continue;
            for (const Index other : stars.of(v))
                if (stamps.first_time(other)) out.items.push_back(other);
        }
        out.close_list();
    }
    return out;
}

/// The extended dual graph: neighbours and neighbours of neighbours. Triangles at hubs link others but are no nodes.
Lists extend(const Lists& neighbours, const std::vector<bool>& at_hub) {
    Lists out;
    Stamps stamps(at_hub.size());
    for (Index t = 0; t < at_hub.size(); ++t) {
        stamps.start();
        [[maybe_unused]] const bool self = stamps.first_time(t);
        if (!at_hub[t])
            for (const Index middle : neighbours.of(t))
                for (const Index other : neighbours.of(middle))
                    if (!at_hub[other] && stamps.first_time(other)) out.items.push_back(other);
        out.close_list();
    }
    return out;
}

/// The colours around each node, as bits; grows when a new word of colours is needed.
class ColourBits {
public:
    explicit ColourBits(std::size_t nodes) : nodes_(nodes), bits_(nodes, 0) {}
    /// False if the colour was there before.
    bool add(Index node, Index colour) {
        if (colour >= 64 * words_) widen();
        std::uint64_t& word = bits_[node * words_ + colour / 64];
        const std::uint64_t bit = 1ull << (colour % 64);
        const bool fresh = (word & bit) == 0;
        word |= bit;
        return fresh;
    }
    [[nodiscard]] Index first_free(Index node) const noexcept {
        for (std::size_t w = 0; w < words_; ++w)
            if (const std::uint64_t word = bits_[node * words_ + w]; word != ~0ull)
                return static_cast<Index>(64 * w) + static_cast<Index>(std::countr_one(word));
        return static_cast<Index>(64 * words_);
    }

private:
    void widen() {
        std::vector<std::uint64_t> wider(2 * words_ * nodes_, 0);
        for (std::size_t n = 0; n < nodes_; ++n)
            std::copy_n(bits_.begin() + static_cast<std::ptrdiff_t>(n * words_), words_,
                        wider.begin() + static_cast<std::ptrdiff_t>(2 * n * words_));
        bits_ = std::move(wider);
        words_ *= 2;
    }
    std::size_t nodes_, words_ = 1;
    std::vector<std::uint64_t> bits_;
};

struct Urgency {
    Index saturation, degree, id;
    /// Least urgent first, as heaps want it.
    bool operator<(const Urgency& o) const noexcept {
        if (saturation != o.saturation) return saturation < o.saturation;
        if (degree != o.degree) return degree < o.degree;
        return id > o.id;
    }
};

/// A node enters the heap again whenever its saturation grows; entries that were overtaken are passed over.
Index colour_by_dsatur(const Lists& graph, const std::vector<bool>& at_hub, std::vector<Index>& colours) {
    const std::size_t n = at_hub.size();
    std::vector<Index> saturation(n, 0);
    std::vector<Urgency> heap;
    ColourBits around(n);
    for (Index t = 0; t < n; ++t)
        if (!at_hub[t]) heap.push_back({0, static_cast<Index>(graph.of(t).size()), t});
    std::make_heap(heap.begin(), heap.end());
    Index count = 0;
    while (!heap.empty()) {
        std::pop_heap(heap.begin(), heap.end());
        const Urgency next = heap.back();
        heap.pop_back();
        if (colours[next.id] != kUncoloured || next.saturation != saturation[next.id]) continue;
        const Index colour = around.first_free(next.id);
        colours[next.id] = colour;
        count = std::max(count, colour + 1);
        for (const Index other : graph.of(next.id)) {
            if (colours[other] != kUncoloured || !around.add(other, colour)) continue;
            heap.push_back({++saturation[other], static_cast<Index>(graph.of(other).size()), other});
            std::push_heap(heap.begin(), heap.end());
        }
    }
    return count;
}

} // namespace

TriangleStars::TriangleStars(std::span<const Triangle> triangles, std::size_t vertex_count) : begin_(vertex_count + 1, 0) {
    const auto repeats = [](const Triangle& t, int k) { return (k > 0 && t[k] == t[0]) || (k > 1 && t[k] == t[1]); };
    for (const Triangle& t : triangles)
        for (int k = 0; k < 3; ++k) begin_[t[k] + 1] += !repeats(t, k);
    std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
    triangles_.resize(begin_.back());
    std::vector<Index> next(begin_.begin(), begin_.end() - 1);
    for (Index id = 0; id < triangles.size(); ++id)
        for (int k = 0; k < 3; ++k)
            if (!repeats(triangles[id], k)) triangles_[next[triangles[id][k]]++] = id;
}

ChromaticSets make_sets_by_dsatur(std::span<const Triangle> triangles, std::size_t vertex_count) {
    const TriangleStars stars(triangles, vertex_count);
    const std::size_t hub_valence = find_hub_valence(triangles, stars, vertex_count);
    std::vector<bool> at_hub(triangles.size(), false);
    for (Index t = 0; t < triangles.size(); ++t)
        for (const Index v : triangles[t])
            if (stars.of(v).size() > hub_valence) at_hub[t] = true;
    std::vector<Index> colours(triangles.size(), kUncoloured);
    Index count = colour_by_dsatur(extend(find_neighbours(triangles, stars, hub_valence), at_hub), at_hub, colours);
    const Index before_hubs = count;
    for (Index& colour : colours)
        if (colour == kUncoloured) colour = count++;
    ChromaticSets sets = gather_sets(std::move(colours), count);
    sets.hub_triangles = count - before_hubs;
    return sets;
}

ChromaticSets make_chromatic_sets(std::span<const Triangle> triangles, std::size_t vertex_count) {
    if (const auto grid = find_quad_grid(triangles, vertex_count)) return make_sets_of_grid(triangles, *grid);
    return make_sets_by_dsatur(triangles, vertex_count);
}

std::vector<SetSlot> pair_sets(const ChromaticSets& sets, std::span<const Triangle> triangles, const TriangleStars& stars, Index i,
                               Index j) {
    std::vector<SetSlot> slots;
    std::vector<Index> matched;
    for (const Index p : sets.set(i)) {
        SetSlot slot{p, i == j ? p : kNoIndex};
        if (i != j)
            for (const Index v : triangles[p])
                for (const Index q : stars.of(v))
                    if (sets.set_of[q] == j) slot.of_j = q;
        if (slot.of_j != kNoIndex) matched.push_back(slot.of_j);
        slots.push_back(slot);
    }
    if (i == j) return slots;
    std::sort(matched.begin(), matched.end());
    for (const Index q : sets.set(j))
        if (!std::binary_search(matched.begin(), matched.end(), q)) slots.push_back({kNoIndex, q});
    return slots;
}

SetViolations check_sets(const ChromaticSets& sets, std::span<const Triangle> triangles, const TriangleStars& stars) {
    SetViolations found;
    std::vector<Index> neighbour_in(sets.count(), kNoIndex); // of the current triangle, per set
    for (Index t = 0; t < triangles.size(); ++t) {
        for (const bool counting : {true, false}) // the second round forgets what the first noted
            for (const Index v : triangles[t])
                for (const Index other : stars.of(v)) {
                    if (other == t) continue;
                    Index& known = neighbour_in[sets.set_of[other]];
                    if (!counting) {
                        known = kNoIndex;
                        continue;
                    }
                    found.adjacent_in_set += sets.set_of[other] == sets.set_of[t];
                    found.second_neighbours += known != kNoIndex && known != other;
                    known = other;
                }
    }
    return found;
}

std::optional<QuadGrid> find_quad_grid(std::span<const Triangle> triangles, std::size_t vertex_count) {
    if (triangles.size() < 2 || triangles.size() % 2 != 0) return std::nullopt;
    Index row_length = 0;
    std::vector<bool> used(vertex_count, false); // as the lowest corner of a quad
    for (std::size_t q = 0; q < triangles.size(); q += 2) {
        std::array<Index, 6> all;
        std::copy_n(triangles[q].begin(), 3, all.begin());
        std::copy_n(triangles[q + 1].begin(), 3, all.begin() + 3);
        std::sort(all.begin(), all.end());
        const auto end = std::unique(all.begin(), all.end());
        if (end - all.begin() != 4 || all[1] != all[0] + 1 || all[3] != all[2] + 1) return std::nullopt;
        if (row_length == 0) row_length = all[2] - all[0];
        if (row_length < 2 || all[2] - all[0] != row_length || all[0] % row_length == row_length - 1 || used[all[0]]) return std::nullopt;
        for (std::size_t half = q; half < q + 2; ++half) {
            const Triangle& t = triangles[half];
            if (t[0] == t[1] || t[1] == t[2] || t[2] == t[0]) return std::nullopt;
        }
        used[all[0]] = true;
    }
    return QuadGrid{row_length};
}

ChromaticSets make_sets_of_grid(std::span<const Triangle> triangles, const QuadGrid& grid) {
    std::vector<Index> raw(triangles.size());
    std::array<bool, 18> used{};
    for (std::size_t t = 0; t < triangles.size(); ++t) {
        const Triangle &a = triangles[t & ~std::size_t{1}], &b = triangles[t | 1];
        const Index corner = std::min({a[0], a[1], a[2], b[0], b[1], b[2]});
        const Index x = corner % grid.row_length, y = corner / grid.row_length;
        raw[t] = 2 * (x % 3 + 3 * (y % 3)) + static_cast<Index>(t & 1);
        used[raw[t]] = true;
    }
    std::array<Index, 18> number{};
    Index count = 0;
    for (std::size_t c = 0; c < used.size(); ++c)
        if (used[c]) number[c] = count++;
    for (Index& c : raw) c = number[c];
    ChromaticSets sets = gather_sets(std::move(raw), count);
    sets.from_grid = true;
    return sets;
}

} // namespace trocar::collision
