// The vectorised loops over link triangles and dense vertices: AVX-512, AVX2, or the scalar reference, with the same bits.
#pragma once

#include "fem/embedding/rigid_links.hpp"
#include "fem/tissue/force_plan.hpp"

#include <span>

namespace trocar::fem {

/// Link triangles and dense vertices that one thread takes at least.
inline constexpr std::size_t kLeastFrames = 512, kLeastVertices = 2048;

/// Updates the frames of link triangles begin .. end - 1. nodes [node_count]: x the position, v the displacement; frames [frame_count].
EmbeddedUpdateReport turn_link_frames(const RigidLinks& links, std::span<const NodeRecord> nodes, std::span<LinkFrame> frames,
                             unsigned threads) noexcept;

/// p' = p + w (sum a_i u_i + (A' - A) r) of every vertex. out must not be rest.
void move_vertices(const RigidLinks& links, const LinkFrames& frames, std::span<const Vec3> rest, std::span<Vec3> out) noexcept;

} // namespace trocar::fem
