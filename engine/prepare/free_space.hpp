// The free space around solids as a hollow body: what an instrument that meets them from outside moves in.
#pragma once

#include "engine/prepare/model.hpp"

#include <span>

namespace trocar::engine {

/// Its wall, closed and outward where the free space ends: the solids' surfaces turned round, in their order, and a box about them all.
/// around  ids of closed solids
/// margin  m, from their common box
[[nodiscard]] TriMesh make_free_space_wall(std::span<const BodyModel> bodies, std::span<const Index> around, double margin);

/// The solid among them that deforms; none: all rest.
[[nodiscard]] std::optional<std::size_t> find_host(std::span<const BodyModel> bodies, std::span<const Index> around);

/// Its wall follows the host's tissue as the host's own surface does, to the bit, and rests elsewhere.
/// host          of find_host
/// vertex_count  of the wall
[[nodiscard]] fem::RigidLinks link_free_space_wall(std::span<const BodyModel> bodies, std::span<const Index> around, std::size_t host,
                                                   std::size_t vertex_count);

} // namespace trocar::engine
