#include "collision/proximity/face_groups.hpp"

#include "collision/culling/chromatic_sets.hpp"

#include <algorithm>
#include <cassert>

namespace trocar::collision {
namespace {

/// Breadth first over faces that share a vertex; a vertex is passed once, however many faces it has.
class NearestSeeds {
public:
    NearestSeeds(const SurfaceTopology& topology, FaceGroups& groups)
        : topology_(topology), stars_(topology.triangles, topology.vertex_count()), groups_(groups),
          steps_(topology.triangles.size(), kNoIndex), passed_(topology.vertex_count(), kNoIndex) {}

    /// Gives the new group all faces that are nearer to the seed than to any before it.
    void add(Index seed, std::uint8_t group) {
        queue_.assign(1, seed);
        take(seed, group, 0);
        for (std::size_t at = 0; at < queue_.size(); ++at) {
            const Index face = queue_[at], next = steps_[face] + 1;
            for (const Index vertex : topology_.triangles[face]) {
                if (passed_[vertex] == group) continue;
                passed_[vertex] = group;
                for (const Index other : stars_.of(vertex))
                    if (steps_[other] > next) {
                        take(other, group, next);
                        queue_.push_back(other);
                    }
            }
        }
    }
    [[nodiscard]] Index farthest() const { return static_cast<Index>(std::max_element(steps_.begin(), steps_.end()) - steps_.begin()); }
    [[nodiscard]] bool is_seed(Index face) const { return steps_[face] == 0; }

private:
    void take(Index face, std::uint8_t group, Index steps) {
        groups_.of[face] = group;
        steps_[face] = steps;
    }

    const SurfaceTopology& topology_;
    TriangleStars stars_;
    FaceGroups& groups_;
    std::vector<Index> steps_, passed_, queue_;
};

} // namespace

FaceGroups make_face_groups(const SurfaceTopology& topology, std::size_t wanted) {
    assert(wanted >= 1 && wanted <= FaceGroups::kMost);
    FaceGroups groups;
    groups.of.assign(topology.triangles.size(), 0);
    if (topology.triangles.empty()) return groups;
    NearestSeeds seeds(topology, groups);
    Index seed = 0;
    std::size_t count = 0;
    while (count < wanted) {
        seeds.add(seed, static_cast<std::uint8_t>(count++));
        seed = seeds.farthest();
        if (seeds.is_seed(seed)) break;
    }
    groups.adjacent.assign(count, 0);
    std::vector<std::uint64_t> around(topology.vertex_count(), 0);
    for (std::size_t id = 0; id < topology.triangles.size(); ++id)
        for (const Index v : topology.triangles[id]) around[v] |= std::uint64_t{1} << groups.of[id];
    for (const std::uint64_t meet : around)
        for (std::uint64_t left = meet; left != 0; left &= left - 1)
            groups.adjacent[static_cast<std::size_t>(__builtin_ctzll(left))] |= meet;
    return groups;
}

} // namespace trocar::collision
