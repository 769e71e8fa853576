#include "collision/culling/patch_hierarchy.hpp"

#include "collision/culling/chromatic_sets.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace trocar::collision {
namespace {

/// Breadth-first over shared vertices, within one patch.
class Walk {
public:
    Walk(std::span<const Triangle> triangles, std::size_t vertex_count)
        : triangles_(triangles), stars_(triangles, vertex_count), patch_of_(triangles.size(), kNoIndex), turn_(triangles.size(), 0),
          vertex_turn_(vertex_count, 0) {}

    void name_patch(std::span<const Index> ids, Index patch) {
        for (const Index t : ids) patch_of_[t] = patch;
    }
    /// The patch's triangles by distance from `start`, then those of its other pieces.
    void run(std::span<const Index> ids, Index start, std::vector<Index>& out) {
        ++now_;
        out.clear();
        visit_from(start, out);
        for (const Index t : ids)
            if (turn_[t] != now_) visit_from(t, out);
    }

private:
    void visit_from(Index start, std::vector<Index>& out) {
        std::size_t next = out.size();
        out.push_back(start);
        turn_[start] = now_;
        for (; next < out.size(); ++next)
            for (const Index v : triangles_[out[next]]) {
                if (vertex_turn_[v] == now_) continue; // or a fan would cost its square
                vertex_turn_[v] = now_;
                for (const Index t : stars_.of(v)) {
                    if (turn_[t] == now_ || patch_of_[t] != patch_of_[start]) continue;
                    turn_[t] = now_;
                    out.push_back(t);
                }
            }
    }

    std::span<const Triangle> triangles_;
    TriangleStars stars_;
    std::vector<Index> patch_of_;
    std::vector<std::uint32_t> turn_, vertex_turn_;
    std::uint32_t now_ = 0;
};

/// Ranges halved until they hold one; arrange(ids, patch) orders them before each halving.
template <class Arrange>
PatchHierarchy halve(std::size_t count, Arrange&& arrange) {
    PatchHierarchy h;
    h.order.resize(count);
    std::iota(h.order.begin(), h.order.end(), Index{0});
    if (count == 0) return h;
    h.patches.push_back({0, static_cast<Index>(count)});
    for (Index at = 0; at < h.patches.size(); ++at) {
        const auto [begin, end, unused] = h.patches[at];
        if (end - begin < 2) continue;
        arrange(std::span(h.order).subspan(begin, end - begin), at);
        const Index middle = begin + (end - begin) / 2;
        h.patches[at].left = static_cast<Index>(h.patches.size());
        h.patches.push_back({begin, middle});
        h.patches.push_back({middle, end});
    }
    return h;
}

} // namespace

PatchHierarchy make_patch_hierarchy(std::span<const Triangle> triangles, std::size_t vertex_count) {
    Walk walk(triangles, vertex_count);
    std::vector<Index> out;
    return halve(triangles.size(), [&](std::span<Index> ids, Index patch) {
        walk.name_patch(ids, patch);
        walk.run(ids, ids.front(), out);
        const Index rim = out.back(); // as far away as can be
        walk.run(ids, rim, out);
        std::copy(out.begin(), out.end(), ids.begin());
    });
}

PatchHierarchy make_random_hierarchy(std::size_t triangle_count, std::uint64_t seed) {
    bool shuffled = false;
    return halve(triangle_count, [&](std::span<Index> ids, Index) {
        if (std::exchange(shuffled, true)) return;
        for (std::size_t k = ids.size(); k > 1; --k) { // a linear congruential generator is random enough
            seed = seed * 6364136223846793005ull + 1442695040888963407ull;
            std::swap(ids[k - 1], ids[(seed >> 33) % k]);
        }
    });
}

} // namespace trocar::collision
