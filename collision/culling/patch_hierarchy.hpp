// A hierarchy of patches on a mesh's connectivity: connected triangles stay together under any deformation.
// This work is based on: the image-space paper (an extension of CULLIDE, 2003), section 3.1, which finds it far better than one that
// ignores connectivity.
#pragma once

#include "base/vec.hpp"

#include <span>
#include <vector>

namespace trocar::collision {

struct PatchHierarchy {
    struct Patch {
        Index begin = 0, end = 0; // into order
        Index left = kNoIndex;    // the right child follows it; kNoIndex: a single triangle
    };
    std::vector<Index> order;   // [triangle_count] triangle ids; patches are ranges of it
    std::vector<Patch> patches; // parents before children; the first holds everything
};

/// Halves, again and again: the triangles nearest to one at the rim, counted in steps over shared vertices, and the rest. What is not
/// connected is taken piece after piece. cost   O(n log n) for bounded valence
[[nodiscard]] PatchHierarchy make_patch_hierarchy(std::span<const Triangle> triangles, std::size_t vertex_count);
/// Halves of any order, for comparison: patches that are not connected.
[[nodiscard]] PatchHierarchy make_random_hierarchy(std::size_t triangle_count, std::uint64_t seed);

} // namespace trocar::collision
