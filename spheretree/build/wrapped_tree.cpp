#include "spheretree/build/wrapped_tree.hpp"

#include "base/short_number.hpp"
#include "base/surface_area.hpp"
#include "base/topology.hpp"
#include "spheretree/build/wrapped_nodes.hpp"

#include <algorithm>
#include <string>

namespace trocar::spheretree {

namespace {

WrappedTree flatten(WrappedNodes&& built) {
    WrappedTree out;
    const std::vector<WrappedNode>& nodes = built.nodes;
    SphereTree& tree = out.tree;
    const std::size_t count = nodes.size();
    tree.parent.assign(count, kNoIndex);
    tree.item_begin.assign(count, 0);
    tree.item_end.assign(count, 0);
    for (std::size_t n = 0; n < count; ++n) {
        const WrappedNode& node = nodes[n];
        tree.spheres.push_back({node.ball.centre, node.ball.radius});
        tree.level.push_back(node.level);
        tree.child_count.push_back(static_cast<std::uint16_t>(node.children.size()));
        tree.first_child.push_back(node.children.empty() ? kNoIndex : static_cast<Index>(node.children.front()));
        for (const std::size_t child : node.children) tree.parent[child] = static_cast<Index>(n);
        if (node.level == tree.level_begin.size()) tree.level_begin.push_back(static_cast<Index>(n));
    }
    tree.level_begin.push_back(static_cast<Index>(count));
    std::vector<std::pair<std::size_t, bool>> stack{{0, false}};
    while (!stack.empty()) { // depth first
        const auto [n, done] = stack.back();
        stack.pop_back();
        if (done) {
            tree.item_end[n] = static_cast<Index>(out.pieces.size());
            continue;
        }
        tree.item_begin[n] = static_cast<Index>(out.pieces.size());
        out.pieces.insert(out.pieces.end(), nodes[n].pieces.begin(), nodes[n].pieces.end());
        stack.emplace_back(n, true);
        for (std::size_t k = nodes[n].children.size(); k-- > 0;) stack.emplace_back(nodes[n].children[k], false);
    }
    for (const Piece& piece : out.pieces) tree.items.push_back(piece.triangle);
    out.set = std::move(built.set);
    out.coarser = built.coarser;
    return out;
}

std::string list_ids(std::span<const Index> ids) {
    std::string text;
    for (const Index id : ids) text += (text.empty() ? "" : ", ") + std::to_string(id);
    return text;
}

Error bad_mesh(std::string message) { return {ErrorCode::BadMesh, std::move(message)}; }

std::string instead(Builder builder) {
    return "the " + std::string(builder_name(builder)) + " builder needs a closed surface; builder \"shell\" takes any";
}

/// Triangles at edges that fail `bad(uses of the edge)`, first 8.
template <class Bad>
std::string triangles_at(const TriMesh& surface, Bad&& bad) {
    std::vector<Index> ids;
    const std::vector<EdgeUse> uses = sorted_edge_uses(surface.triangles);
    for_each_edge(std::span(uses), [&](std::span<const EdgeUse> edge) {
        if (bad(edge))
            for (const EdgeUse& use : edge) ids.push_back(use.triangle);
    });
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    ids.resize(std::min<std::size_t>(ids.size(), 8));
    return list_ids(ids);
}

Result<void> check_finite(const TriMesh& surface) {
    if (surface.triangles.empty()) return bad_mesh("the surface has no triangles");
    for (Index t = 0; t < surface.triangles.size(); ++t)
        for (const Index v : surface.triangles[t]) {
            if (v >= surface.vertices.size())
                return bad_mesh("triangle " + std::to_string(t) + " refers to vertex " + std::to_string(v) + " of " +
                                std::to_string(surface.vertices.size()));
            if (!is_finite(surface.vertices[v]))
                return bad_mesh("vertex " + std::to_string(v) + " of triangle " + std::to_string(t) + " is not finite");
            if (const double largest = surface.vertices[v].cwiseAbs().maxCoeff(); largest > kLargestCoordinate)
                return bad_mesh("vertex " + std::to_string(v) + " of triangle " + std::to_string(t) + " lies " + short_number(largest) +
                                " from the origin; expected at most " + short_number(kLargestCoordinate));
        }
    return {};
}

} // namespace

std::string_view builder_name(Builder builder) noexcept {
    switch (builder) {
    case Builder::Medial:
        return "medial";
    case Builder::Hubbard:
        return "hubbard";
    case Builder::Octree:
        return "octree";
    case Builder::Shell:
        break;
    }
    return "shell";
}

std::optional<Builder> find_builder(std::string_view name) noexcept {
    for (const Builder builder : {Builder::Medial, Builder::Hubbard, Builder::Octree, Builder::Shell})
        if (builder_name(builder) == name) return builder;
    return std::nullopt;
}

std::string builder_names() { return "medial, hubbard, octree, shell"; }

Result<void> check_surface_for(const TriMesh& surface, Builder builder, std::size_t max_compared) {
    if (const Result<void> finite = check_finite(surface); !finite.ok() || !needs_closed(builder)) return finite;
    const SurfaceReport report = inspect_surface(surface);
    if (!report.closed())
        return bad_mesh(std::to_string(report.boundary_edges) + " border edges, first bad triangles " +
                        triangles_at(surface, [](auto edge) { return edge.size() == 1; }) + "; repair \"fill_holes\" closes them; " +
                        instead(builder));
    if (report.inconsistent_edges > 0)
        return bad_mesh(std::to_string(report.inconsistent_edges) + " edges that both triangles use the same way, first bad triangles " +
                        triangles_at(surface, [](auto edge) { return edge.size() == 2 && edge[0].forward == edge[1].forward; }) +
                        "; repair \"orient\" turns them; " + instead(builder));
    const SelfIntersections crossings = find_self_intersections(surface, 4, Crossing::Proper, max_compared);
    if (crossings.count > 0) {
        std::string pairs;
        for (const auto& pair : crossings.pairs)
            pairs += (pairs.empty() ? "" : ", ") + std::to_string(pair[0]) + " with " + std::to_string(pair[1]);
        return bad_mesh(std::to_string(crossings.count) + " pairs of triangles cross, first bad triangles " + pairs +
                        "; repair \"drop_self_intersections\" separates them; " + instead(builder));
    }
    if (!crossings.complete)
        return bad_mesh("more than " + std::to_string(max_compared) + " pairs of triangles are too near to each other to tell whether any cross; " +
                        instead(builder));
    if (report.signed_volume < 0.0)
        return bad_mesh("the surface is inside out (triangle 0 and all others), repair \"orient\" turns it; " + instead(builder));
    return {};
}

std::string describe_coarser(const TriMesh& surface) {
    const double area = surface_area(surface), size = surface.bounds().longest_edge();
    return "the sphere tree is coarser than its depth allows: with a longest side of " + short_number(size) + " and an area of " +
           short_number(area) + " the surface is " + short_number(size * size / area) +
           " times as long as wide, too thin to be cut as finely as the spheres would need";
}

Result<WrappedTree> build_wrapped_tree(const TriMesh& surface, const WrappedOptions& options, const std::function<void(double share)>& progress) {
    if (options.branching < 2 || options.branching > 64)
        return Error{ErrorCode::BadValue, "branching " + std::to_string(options.branching) + " is not in 2 to 64"};
    if (options.depth > 8) return Error{ErrorCode::BadValue, "depth " + std::to_string(options.depth) + " is not in 0 to 8"};
    if (const Result<void> sound = check_surface_for(surface, options.builder); !sound.ok()) return sound.error();
    const bool closed = needs_closed(options.builder) || check_surface_for(surface, Builder::Medial).ok();
    BodyDepth body(surface, closed && options.builder != Builder::Shell);
    const bool by_nodes = options.builder == Builder::Octree || options.builder == Builder::Hubbard;
    const BuildProgress tell = progress ? progress : [](double) {};
    return flatten(by_nodes ? build_by_nodes(surface, options, body, tell) : build_by_covers(surface, options, body, tell));
}

} // namespace trocar::spheretree
