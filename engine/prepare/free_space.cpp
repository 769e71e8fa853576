#include "engine/prepare/free_space.hpp"

#include "assets/anatomy/shapes.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Squares along an edge of a face of the box.
constexpr int kBoxCells = 4;

void append(const TriMesh& from, bool turned, TriMesh& to) {
    const Index first = static_cast<Index>(to.vertices.size());
    to.vertices.insert(to.vertices.end(), from.vertices.begin(), from.vertices.end());
    for (const Triangle& t : from.triangles)
        to.triangles.push_back(turned ? Triangle{first + t[0], first + t[2], first + t[1]} : Triangle{first + t[0], first + t[1], first + t[2]});
}

} // namespace

TriMesh make_free_space_wall(std::span<const BodyModel> bodies, std::span<const Index> around, double margin) {
    TriMesh wall;
    Box3 box;
    for (const Index body : around) {
        append(bodies[body].surface, true, wall);
        for (const Vec3& v : bodies[body].surface.vertices) box.add(v);
    }
    append(anatomy::make_box(box.centre(), box.hi - box.lo + Vec3::Constant(2.0 * margin), kBoxCells), false, wall);
    return wall;
}

std::optional<std::size_t> find_host(std::span<const BodyModel> bodies, std::span<const Index> around) {
    for (const Index body : around)
        if (bodies[body].tissue) return body;
    return std::nullopt;
}

fem::RigidLinks link_free_space_wall(std::span<const BodyModel> bodies, std::span<const Index> around, std::size_t host, std::size_t vertex_count) {
    const fem::RigidLinks& own = *bodies[host].links;
    std::size_t first = 0;
    for (const Index body : around) {
        if (body == host) break;
        first += bodies[body].surface.vertices.size();
    }
    fem::RigidLinks links = own;
    links.vertex_frame.assign(vertex_count, kNoIndex);
    links.vertex_weight.assign(vertex_count, {});
    links.vertex_projection.assign(vertex_count, Vec3::Zero());
    links.vertex_blend.assign(vertex_count, 0.0);
    const auto place = [&](const auto& from, auto& to) { std::copy(from.begin(), from.end(), to.begin() + static_cast<std::ptrdiff_t>(first)); };
    place(own.vertex_frame, links.vertex_frame);
    place(own.vertex_weight, links.vertex_weight);
    place(own.vertex_projection, links.vertex_projection);
    place(own.vertex_blend, links.vertex_blend);
    links.static_count = own.static_count + vertex_count - own.vertex_count();
    if (links.longest != kNoIndex) links.longest += static_cast<Index>(first);
    return links;
}

} // namespace trocar::engine
