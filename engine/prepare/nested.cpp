#include "engine/prepare/nested.hpp"

#include "base/inside.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

void find_nested(PreparedScene& prepared) {
    const std::vector<BodyModel>& bodies = prepared.model.bodies;
    std::vector<Box3> boxes(bodies.size());
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (const Vec3& v : bodies[i].surface.vertices) boxes[i].add(v);
    const auto lies_in = [&](std::size_t i, std::size_t k) {
        const BodyModel &inner = bodies[i], &outer = bodies[k];
        if (i == k || inner.hollow || outer.hollow || !outer.closed || (!inner.moves() && !outer.moves())) return false;
        if (inner.host_body == k || outer.host_body == i || inner.surface.vertices.empty()) return false;
        if (!boxes[k].contains(boxes[i].lo) || !boxes[k].contains(boxes[i].hi)) return false;
        const InsideTest inside(outer.surface);
        return std::all_of(inner.surface.vertices.begin(), inner.surface.vertices.end(), [&](const Vec3& v) { return inside.inside(v); });
    };
    for (std::size_t i = 0; i < bodies.size(); ++i)
        for (std::size_t k = 0; k < bodies.size(); ++k) {
            if (!lies_in(i, k)) continue;
            prepared.model.nested.emplace_back(std::min(i, k), std::max(i, k));
            prepared.bodies[i].notes.push_back(fmt::format("starts wholly inside {}: the two do not touch one another", bodies[k].name));
        }
    std::sort(prepared.model.nested.begin(), prepared.model.nested.end());
}

} // namespace trocar::engine
