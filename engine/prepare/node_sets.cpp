#include "engine/prepare/node_sets.hpp"

#include "base/topology.hpp"
#include "base/triangle_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::engine {
namespace {

bool in_region(const FixedRegion& region, const Vec3& p, double least, double most) {
    switch (region.kind) {
    case RegionKind::Box:
        return region.box.contains(p);
    case RegionKind::Sphere:
        return (p - region.centre).squaredNorm() <= region.radius * region.radius;
    case RegionKind::Plane: {
        const double before = region.normal.dot(p - region.point);
        return region.within > 0.0 ? std::abs(before) <= region.within : before >= 0.0;
    }
    case RegionKind::Near:
    case RegionKind::Listed:
        return false; // by their ids
    case RegionKind::Direction:
        break;
    }
    return region.fraction >= 1.0 || region.direction.dot(p) >= most - region.fraction * (most - least); // all is all, rounded or not
}

bool is_on_faces(LoadKind kind) { return kind == LoadKind::Traction || kind == LoadKind::Pressure; }

/// Boundary triangles whose nodes are all among some; with a lumen only those that face into it, however thin its wall.
void add_faces(const TetMesh& mesh, const std::vector<Index>& nodes, const TriMesh* lumen, BodyLoad& load) {
    const auto is_in = [&](Index node) { return std::binary_search(nodes.begin(), nodes.end(), node); };
    std::vector<Triangle> faces;
    for (const Triangle& face : boundary_surface(mesh).triangles)
        if (std::all_of(face.begin(), face.end(), is_in)) faces.push_back(face);
    const std::vector<bool> on_bore = lumen != nullptr ? face_into(mesh, faces, *lumen) : std::vector<bool>(faces.size(), true);
    for (std::size_t k = 0; k < faces.size(); ++k) {
        if (!on_bore[k]) continue;
        const Triangle& face = faces[k];
        const Vec3 &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]], &c = mesh.vertices[face[2]];
        load.faces.push_back(face);
        load.area.push_back(0.5 * (b - a).cross(c - a).norm());
    }
}

void add_nodes(const fem::TissueModel& tissue, const std::vector<Index>& nodes, BodyLoad& load) {
    double mass = 0.0;
    for (const Index node : nodes) mass += tissue.node_mass[node];
    for (const Index node : nodes) load.share.push_back(tissue.node_mass[node] / mass);
    load.nodes = nodes;
}

} // namespace

std::vector<bool> face_into(const TetMesh& mesh, std::span<const Triangle> faces, const TriMesh& lumen) {
    const TriangleTree bore(lumen);
    std::vector<bool> found;
    for (const Triangle& face : faces) {
        const Vec3 &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]], &c = mesh.vertices[face[2]];
        const Triangle& t = lumen.triangles[bore.closest((a + b + c) / 3.0)->triangle];
        const Vec3 &p = lumen.vertices[t[0]], &q = lumen.vertices[t[1]], &r = lumen.vertices[t[2]];
        found.push_back((q - p).cross(r - p).dot((b - a).cross(c - a)) < 0.0);
    }
    return found;
}

std::vector<Index> find_region_nodes(const FixedRegion& region, const std::vector<Vec3>& nodes) {
    if (region.kind == RegionKind::Listed) return region.nodes;
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const Vec3& p : nodes) {
        least = std::min(least, region.direction.dot(p));
        most = std::max(most, region.direction.dot(p));
    }
    std::vector<Index> found;
    for (Index i = 0; i < nodes.size(); ++i)
        if (in_region(region, nodes[i], least, most)) found.push_back(i);
    return found;
}

namespace {

Result<void> list_near(const Scene& scene, const std::string& key, const std::vector<Vec3>& nodes, const std::vector<BodyModel>& before,
                       const BodyModel& own, FixedRegion& region) {
    const auto is_it = [&](const BodyModel& body) { return body.name == region.surface; };
    const auto found = std::find_if(before.begin(), before.end(), is_it);
    if (found == before.end() && !is_it(own))
        return scene_error(scene, key + ".near.surface",
                           fmt::format("found \"{}\"; expected {}, or a body that stands before it in the scene", region.surface, own.name));
    const TriMesh& surface = found == before.end() ? own.surface : found->surface;
    const TriangleTree tree(surface);
    for (Index i = 0; i < nodes.size(); ++i)
        if (tree.closest(nodes[i], region.distance)) region.nodes.push_back(i);
    region.kind = RegionKind::Listed;
    return {};
}

/// Lists name nodes as the file of the coarse mesh does; it may have some that no tetrahedron has.
Result<void> list_region(const Scene& scene, const std::string& key, const std::vector<Vec3>& nodes, std::span<const Index> places,
                         const std::vector<BodyModel>& before, const BodyModel& own, FixedRegion& region) {
    if (region.kind == RegionKind::Near) return list_near(scene, key, nodes, before, own, region);
    if (region.kind != RegionKind::Listed) return {};
    const std::size_t count = places.empty() ? nodes.size() : places.size();
    const auto fail = [&](Index node, const std::string& what) {
        return scene_error(scene, key + ".nodes", fmt::format("{} lists node {}{}", region.file.string(), node, what));
    };
    for (Index& node : region.nodes) {
        if (node >= count) return fail(node, fmt::format("; expected at most {}, the last one of the coarse mesh of {}", count - 1, own.name));
        if (places.empty()) continue;
        if (places[node] == kNoIndex) return fail(node, fmt::format(", which no tetrahedron of the coarse mesh of {} has", own.name));
        node = places[node];
    }
    return {};
}

} // namespace

Result<SceneBody> list_region_nodes(const Scene& scene, const SceneBody& body, const std::vector<Vec3>& nodes, std::span<const Index> places,
                                    const std::vector<BodyModel>& before, const BodyModel& own) {
    SceneBody listed = body;
    const auto list = [&](const char* key, std::size_t i, FixedRegion& region) {
        return list_region(scene, fmt::format("bodies.{}.{}", body.name, fmt::format(fmt::runtime(key), i)), nodes, places, before, own, region);
    };
    for (std::size_t i = 0; i < listed.fixed.size(); ++i)
        if (const Result<void> done = list("fixed[{}]", i, listed.fixed[i].region); !done.ok()) return done.error();
    for (std::size_t i = 0; i < listed.loads.size(); ++i)
        if (auto& region = listed.loads[i].region)
            if (const Result<void> done = list("loads[{}].where", i, *region); !done.ok()) return done.error();
    return listed;
}

std::vector<Index> find_pinned(const std::vector<HeldRegion>& regions, const std::vector<Vec3>& nodes) {
    std::vector<Index> pinned;
    for (const HeldRegion& held : regions) {
        const std::vector<Index> found = find_region_nodes(held.region, nodes);
        pinned.insert(pinned.end(), found.begin(), found.end());
    }
    std::sort(pinned.begin(), pinned.end());
    pinned.erase(std::unique(pinned.begin(), pinned.end()), pinned.end());
    return pinned;
}

Result<void> prepare_held(const Scene& scene, const SceneBody& body, const std::vector<Vec3>& nodes, const std::vector<Index>& pinned,
                          BodyModel& model) {
    std::vector<bool> moves(nodes.size(), false);
    for (std::size_t i = 0; i < body.fixed.size(); ++i) {
        const HeldRegion& held = body.fixed[i];
        if (held.moves.empty() && held.turns.empty()) continue;
        const std::string key = fmt::format("bodies.{}.fixed[{}]", body.name, i);
        HeldNodes& made = model.held.emplace_back();
        made.turns = held.turns;
        made.point = held.point;
        made.axis = held.axis;
        for (const KeyFrame& frame : held.moves) made.moves.push_back({frame.time, frame.displacement});
        for (const Index node : find_region_nodes(held.region, nodes)) {
            if (moves[node])
                return scene_error(scene, key, fmt::format("node {} of the coarse mesh is moved by another region already", node));
            moves[node] = true;
            const auto place = std::lower_bound(pinned.begin(), pinned.end(), node);
            made.pinned.push_back(static_cast<Index>(place - pinned.begin()));
        }
        if (made.pinned.empty()) return scene_error(scene, key, "no node of the coarse mesh lies in this region, and it is to move");
    }
    return {};
}

static bool acts_on_held(const BodyLoad& load, const fem::TissueModel& tissue) {
    const auto is_held = [&](Index node) { return !(tissue.inv_mass[node] > 0.0); };
    return std::all_of(load.nodes.begin(), load.nodes.end(), is_held) &&
           std::all_of(load.faces.begin(), load.faces.end(), [&](const Triangle& face) { return std::all_of(face.begin(), face.end(), is_held); });
}

Result<void> prepare_loads(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const fem::TissueModel& tissue,
                           BodyModel& model, std::vector<std::string>& notices) {
    if (!scene.effects.loads) return {};
    for (std::size_t i = 0; i < body.loads.size(); ++i) {
        const LoadSpec& spec = body.loads[i];
        BodyLoad& load = model.loads.emplace_back();
        load.kind = spec.kind;
        load.vector = spec.vector;
        load.number = spec.number;
        load.over = spec.over;
        std::vector<Index> nodes;
        if (spec.region)
            nodes = find_region_nodes(*spec.region, mesh.vertices);
        else
            for (Index node = 0; node < mesh.vertices.size(); ++node) nodes.push_back(node);
        const bool on_bore = body.hollow && spec.region && spec.region->surface == body.name; // near the lumen's surface
        if (is_on_faces(spec.kind))
            add_faces(mesh, nodes, on_bore ? &model.surface : nullptr, load);
        else
            add_nodes(tissue, nodes, load);
        if (load.nodes.empty() && load.faces.empty())
            return scene_error(scene, fmt::format("bodies.{}.loads[{}]", body.name, i),
                               is_on_faces(spec.kind) ? "no boundary triangle of the coarse mesh lies in its region"
                                                      : "no node of the coarse mesh lies in its region");
        if (acts_on_held(load, tissue))
            notices.push_back(fmt::format("bodies.{}.loads[{}] moves nothing: all nodes that it acts on are held (fixed)", body.name, i));
    }
    return {};
}

} // namespace trocar::engine
