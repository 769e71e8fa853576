// Where sharp edges of two closed surfaces cross: bars that lie across each other, a block over a table's rim. No vertex is near such a
// place, and what of an edge already lies inside says neither how deep nor which way.
//
// Two edges push where their lines come nearest between the ends of both, along their common normal, if that lies in the normal cone of
// each (normal_cone.hpp): the distance of the two surfaces has a local minimum there. The sign says which has passed the other. A place that
// is not yet there is listed if the two meet in the next step as they go (an exact sweep of it), or if the plane between them does not hold them on
// that way; one that lies in the other body only if the two edges have
// crossed in this step (collision::sweep_edge_edge, exact), if it lay or pressed there in the last one, or if one edge passes through
// both faces of the other (solid_touch.cpp): else edges at two sides of a body would hold one another.
//
// source   Johnson & Cohen 2001, "Local minimum distances". Deviates: edges count whose faces meet at more than some 20 degrees at rest; a
//          flatter one is a curved surface in facets, and is met by its vertices.
#pragma once

#include "engine/step/solid/solid_passage.hpp"

namespace trocar::engine {

/// Of a closed solid body, by leaf.
[[nodiscard]] SharpEdges list_sharp_edges(const BodyModel& body);

/// Where two edges are nearest.
struct EdgePlace {
    double s = 0.0, t = 0.0; // [0, 1] along the own edge and the other one
    Vec3 point = Vec3::Zero();   // m, on the other one
    Vec3 normal = Vec3::UnitX(); // unit, from the other to the own one
    double gap = 0.0;            // m, along it
};

/// Where an edge of one body's topology and one of the other's stand at the end of the step; nothing: they do not meet, as far as their directions say.
[[nodiscard]] std::optional<EdgePlace> place_edges(const OneWay& way, Index own, Index other);

[[nodiscard]] Contact make_edge_touch(const OneWay& way, Index own, Index other, const EdgePlace& at);

/// Units for the pairs of edges beneath two leaves.
[[nodiscard]] std::uint64_t edge_units(const SharpEdges& a, Index leaf_a, const SharpEdges& b, Index leaf_b);

/// Appends the touches of edges beneath two leaves, and lowers the pair's gap to theirs. All touches of the two bodies are those from
/// `first_touch` on.
void touch_edges(const OneWay& way, std::size_t first_touch, LeafPair& pair);

/// Appends those of sharp edges that lay in the other body, or pressed, in the last step, and still may, whatever leaves the descent found.
void touch_edges_before(const OneWay& way, std::size_t first_touch);

/// Are these two edges among the touches?
[[nodiscard]] bool is_listed(const OneWay& way, std::size_t first_touch, Index own, Index other);

/// Among the touches: do edges cross where this edge of the body lies in the other one?
[[nodiscard]] bool cross_there(const SolidScratch& solids, std::size_t first_touch, std::size_t body, const Piercing& in, const Piercing& out);

} // namespace trocar::engine
