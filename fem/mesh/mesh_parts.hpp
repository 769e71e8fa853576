// Parts of a tet mesh that share no node: two bodies in one model would drift apart unseen.
#pragma once

#include "base/mesh.hpp"

namespace trocar::fem {

/// Root node of every node's part, joined through tets; a node without a tet is its own. The root is the lowest id.
[[nodiscard]] std::vector<Index> find_node_parts(const TetMesh& mesh);

/// Keeps the part with the most tets (of equals the one with the lowest node). Returns how many tets went; nodes stay.
std::size_t drop_loose_parts(TetMesh& mesh);

} // namespace trocar::fem
