// One place of a closed surface against another one: whether it lies inside or comes there in the next step, and the plane that keeps it out.
#pragma once

#include "engine/step/solid/solid_passage.hpp"

namespace trocar::engine {

/// A place of a surface: a vertex, or a point of an edge.
struct VertexProbe {
    Index vertex[2] = {kNoIndex, kNoIndex};
    double weight[2] = {1.0, 0.0};

    [[nodiscard]] Vec3 at(const std::vector<Vec3>& surface) const {
        return vertex[1] == kNoIndex ? surface[vertex[0]] : Vec3(weight[0] * surface[vertex[0]] + weight[1] * surface[vertex[1]]);
    }
};

/// What test_vertex saw; vertex_seen holds it once a vertex was looked at.
enum Seen : std::uint8_t { kNotSeen = 0, kFar, kNear, kInside };

struct Look {
    Seen seen = kFar;
    double gap = std::numeric_limits<double>::infinity(); // m, of the touch that was listed
};

/// Lists the touch of a vertex, and what is remembered of it, in way.solids, way.entries and way.report.
/// reach   m, how far the other surface comes, and the margin
[[nodiscard]] Look test_vertex(const OneWay& way, Index v, double reach);

/// Lists the touch of a point of an edge that lies inside: of what lies inside of the edge, the middle.
void add_edge_touch(const OneWay& way, const VertexProbe& probe);

} // namespace trocar::engine
