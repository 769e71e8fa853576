// How a hierarchy over a surface is built.
#pragma once

#include <cstddef>
#include <cstdint>

namespace trocar::collision {

enum class TreeBuilder : std::uint8_t {
    Median, // halves by count along the longest axis: full clusters
    Sah,    // binned surface-area heuristic
    Middle, // the paper's: through the middle, across the slab that is widest; what is cut goes to the smaller side
};

struct TreeOptions {
    std::size_t dop = 6;           // 6, 14, 18, 26
    std::size_t arity = 8;         // 2, 4, 8
    std::size_t cluster_size = 32; // triangles in a leaf, 1 .. kMaxClusterSize
    TreeBuilder builder = TreeBuilder::Sah;
    /// Clusters and pairs of features are looked at along the directions of fine_bounds.hpp too: pays where thin things lie aslant
    /// beside each other (an instrument in its vessel), not where most pairs are neighbours on one surface.
    bool fine = false;

    friend bool operator==(const TreeOptions&, const TreeOptions&) = default;
};

} // namespace trocar::collision
