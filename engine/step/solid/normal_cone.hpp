// Which way two surfaces push where a vertex or an edge of one meets the other: along the normals of what is met, and of nothing else.
//
// Two surfaces push one another where their distance has a local minimum on both sides: the direction between the two places lies in the
// normal cone of each feature (of a face its normal, of an edge what lies between its faces', of a vertex what lies among its faces'). A
// vertex within a flat table has a cone of one direction: it never pushes along the facets of the ball that lies on it, and one table is
// the same with any number of cells. A surface that is curved is known up to the angle between its facets: so far the cone of a flatter
// vertex is widened, and the direction is the cone's own.
//
// source   Johnson & Cohen 2001, "Local minimum distances"; Erleben 2017, "Methodology for assessing mesh-based contact point methods".
//          Deviates: cones are circular, around the mean normal; what lies deep in a body keeps the direction to its nearest side.
#pragma once

#include "base/mesh.hpp"
#include "collision/topology.hpp"

#include <optional>
#include <span>
#include <vector>

namespace trocar::engine {

/// Faces around the vertices and edges of a surface, built once.
struct SurfaceAdjacency {
    std::vector<Index> vertex_begin;              // [vertex_count + 1]
    std::vector<Index> vertex_face;               // [entries]
    std::vector<collision::EdgeFaces> edge_faces; // [edge_count]
};
[[nodiscard]] SurfaceAdjacency make_adjacency(const collision::SurfaceTopology& topology);

/// Directions around an axis.
struct NormalCone {
    Vec3 axis = Vec3::UnitX(); // unit
    double cosine = 1.0;       // of its half angle
};

/// positions [vertex_count] m
[[nodiscard]] NormalCone cone_of_vertex(const SurfaceAdjacency& adjacency, const std::vector<Triangle>& triangles, Index vertex,
                                        std::span<const Vec3> positions) noexcept;
/// Unit, area-weighted over the faces around it; as spheretree::direction_of where they have no area.
[[nodiscard]] Vec3 normal_of_vertex(const SurfaceAdjacency& adjacency, const std::vector<Triangle>& triangles, Index vertex,
                                    std::span<const Vec3> positions) noexcept;
/// edge   its index, or its two vertices
[[nodiscard]] NormalCone cone_of_edge(const SurfaceAdjacency& adjacency, const collision::SurfaceTopology& topology, Index edge,
                                      std::span<const Vec3> positions) noexcept;
[[nodiscard]] NormalCone cone_of_edge(const SurfaceAdjacency& adjacency, const collision::SurfaceTopology& topology, Index v0, Index v1,
                                      std::span<const Vec3> positions) noexcept;

/// Cosine of the largest angle between a face and its neighbours, edges that are sharp left out: how well its normal is known.
[[nodiscard]] double facet_cosine(const SurfaceAdjacency& adjacency, const collision::SurfaceTopology& topology, Index face,
                                  std::span<const Vec3> positions) noexcept;

/// The direction in which the other surface pushes a feature with this cone, given that its own normal is `out` and known up to the
/// angle of `facet`. Nothing: the two do not meet there.
[[nodiscard]] std::optional<Vec3> choose_normal(const NormalCone& own, const Vec3& out, double facet) noexcept;

} // namespace trocar::engine
