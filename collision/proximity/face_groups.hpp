// Compact, connected groups of a surface's faces and which of them touch: where two groups do not, no cone of normals is valid.
// source   Mezger, Kimmerle, Etzmuss 2003, section 5.1, which leaves open how to divide. Here: the seed of each new group is the face
//          farthest from all seeds so far, counted in faces that share a vertex, and every face joins its nearest seed, so that even
//          pieces of the surface that are not connected are in groups of their own as long as there are groups left.
#pragma once

#include "collision/topology.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace trocar::collision {

struct FaceGroups {
    static constexpr std::size_t kMost = 64;

    std::vector<std::uint8_t> of;        // [triangle_count] below count()
    std::vector<std::uint64_t> adjacent; // [group_count] bit g: a face of each share a vertex; a group is adjacent to itself

    [[nodiscard]] std::size_t count() const noexcept { return adjacent.size(); }
    /// Is every group of the set adjacent to all others of it?
    [[nodiscard]] bool all_adjacent(std::uint64_t groups) const noexcept {
        for (std::uint64_t left = groups; left != 0; left &= left - 1)
            if ((groups & ~adjacent[static_cast<std::size_t>(__builtin_ctzll(left))]) != 0) return false;
        return true;
    }
};

/// wanted   1 .. kMost; there are fewer where the surface has fewer faces
/// cost     O(wanted * n), n corners of faces
[[nodiscard]] FaceGroups make_face_groups(const SurfaceTopology& topology, std::size_t wanted);

} // namespace trocar::collision
