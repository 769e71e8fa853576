#include "engine/prepare/geometry_cache.hpp"

#include "assets/anatomy/vessels.hpp"
#include "engine/prepare/cache.hpp"
#include "engine/prepare/payload.hpp"
#include "spheretree/lumen/build_lumen.hpp"

namespace trocar::engine {

namespace {

constexpr std::string_view kVessels = "vessels", kLumenTree = "lumen_tree", kCentreline = "centreline";

/// link_reach and the wall itself follow from the key: they are not in the payload.
std::string pack(const spheretree::LumenTree& lumen) {
    Payload payload;
    payload.put_tree(lumen.tree);
    payload.put(lumen.largest_ball), payload.put(lumen.leaf_of_ball);
    payload.put(lumen.neighbour_begin), payload.put(lumen.neighbours);
    payload.put(lumen.wall_begin), payload.put(lumen.wall_triangles);
    payload.put(lumen.anchor_begin), payload.put(lumen.anchors), payload.put(lumen.anchor_weights);
    return payload.bytes();
}

bool unpack(std::string bytes, spheretree::LumenTree& lumen) {
    Payload payload(std::move(bytes));
    return payload.get_tree(lumen.tree) && payload.get(lumen.largest_ball) && payload.get(lumen.leaf_of_ball) &&
           payload.get(lumen.neighbour_begin) && payload.get(lumen.neighbours) && payload.get(lumen.wall_begin) &&
           payload.get(lumen.wall_triangles) && payload.get(lumen.anchor_begin) && payload.get(lumen.anchors) &&
           payload.get(lumen.anchor_weights);
}

} // namespace

Result<TriMesh> make_or_read_vessels(std::span<const anatomy::VesselBranch> branches, double blend, std::size_t triangles) {
    ContentHash hash;
    hash.feed(maker_version());
    hash.feed(static_cast<std::uint64_t>(branches.size()));
    for (const anatomy::VesselBranch& branch : branches) {
        hash.feed(static_cast<std::uint64_t>(branch.axis.size()));
        for (const Vec3& point : branch.axis)
            for (const double x : point) hash.feed(x);
        hash.feed(static_cast<std::uint64_t>(branch.radii.size()));
        for (const double radius : branch.radii) hash.feed(radius);
    }
    hash.feed(blend);
    hash.feed(static_cast<std::uint64_t>(triangles));
    const std::string key = hash.hex();
    if (const auto payload = read_cache(kVessels, key))
        if (auto mesh = unpack_triangles(*payload)) return std::move(*mesh);
    Result<TriMesh> mesh = anatomy::make_vessels(branches, blend, triangles);
    if (mesh.ok()) write_cache(kVessels, key, pack_mesh(*mesh));
    return mesh;
}

Result<spheretree::LumenTree> make_or_read_lumen_tree(const TriMesh& closed_lumen) {
    ContentHash hash;
    hash.feed(maker_version());
    hash.feed(closed_lumen);
    const std::string key = hash.hex();
    if (auto payload = read_cache(kLumenTree, key)) {
        spheretree::LumenTree lumen;
        if (unpack(std::move(*payload), lumen)) {
            lumen.link_reach = spheretree::LumenOptions{}.link_reach;
            lumen.rest_vertices = closed_lumen.vertices;
            lumen.triangles = closed_lumen.triangles;
            return lumen;
        }
    }
    Result<spheretree::LumenTree> lumen = spheretree::build_lumen_tree(closed_lumen);
    if (lumen.ok()) write_cache(kLumenTree, key, pack(*lumen));
    return lumen;
}

Result<spheretree::CentrelineTree> make_or_read_centreline(const spheretree::LumenTree& lumen, const Vec3& root) {
    ContentHash hash;
    hash.feed(maker_version());
    hash.feed(TriMesh{lumen.rest_vertices, lumen.triangles});
    for (const double x : root) hash.feed(x);
    const std::string key = hash.hex();
    if (auto bytes = read_cache(kCentreline, key)) {
        Payload payload(std::move(*bytes));
        spheretree::CentrelineTree tree;
        if (payload.get(tree.points) && payload.get(tree.radii) && payload.get(tree.parents)) return tree;
    }
    Result<spheretree::CentrelineTree> tree = spheretree::find_centreline_tree(lumen, root);
    if (!tree.ok()) return tree;
    Payload payload;
    payload.put(tree->points), payload.put(tree->radii), payload.put(tree->parents);
    write_cache(kCentreline, key, payload.bytes());
    return tree;
}

} // namespace trocar::engine
