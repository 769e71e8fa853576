// The two mesh reports of topology.hpp.
#include "base/predicates.hpp"
#include "base/topology.hpp"

#include <algorithm>

namespace trocar {
namespace {

constexpr std::size_t kMostBadIds = 8;

void note(std::vector<Index>& ids, Index id) {
    if (ids.size() < kMostBadIds && std::find(ids.begin(), ids.end(), id) == ids.end()) ids.push_back(id);
}

template <std::size_t N>
bool in_range(const std::array<Index, N>& ids, std::size_t count) {
    return std::all_of(ids.begin(), ids.end(), [count](Index v) { return v < count; });
}

template <std::size_t N>
bool repeats(std::array<Index, N> ids) {
    std::sort(ids.begin(), ids.end());
    return std::adjacent_find(ids.begin(), ids.end()) != ids.end();
}

/// Ids of cells whose vertex set an earlier cell has.
template <std::size_t N>
std::vector<Index> find_duplicates(const std::vector<std::array<Index, N>>& cells) {
    struct Key {
        std::array<Index, N> sorted;
        Index id;
        bool operator<(const Key& o) const { return sorted != o.sorted ? sorted < o.sorted : id < o.id; }
    };
    std::vector<Key> keys(cells.size());
    for (std::size_t i = 0; i < cells.size(); ++i) {
        keys[i] = {cells[i], static_cast<Index>(i)};
        std::sort(keys[i].sorted.begin(), keys[i].sorted.end());
    }
    std::sort(keys.begin(), keys.end());
    std::vector<Index> duplicates;
    for (std::size_t i = 1; i < keys.size(); ++i)
        if (keys[i].sorted == keys[i - 1].sorted) duplicates.push_back(keys[i].id);
    std::sort(duplicates.begin(), duplicates.end());
    return duplicates;
}

std::size_t count_unreferenced(std::size_t vertex_count, const auto& cells) {
    std::vector<bool> used(vertex_count, false);
    for (const auto& cell : cells)
        for (const Index v : cell) used[v] = true;
    return static_cast<std::size_t>(std::count(used.begin(), used.end(), false));
}

/// What is left of a mesh once cells that name a vertex twice or none at all are out, with their old ids.
struct SoundTriangles {
    std::vector<Triangle> triangles;
    std::vector<Index> id;
};

SoundTriangles keep_sound(const TriMesh& mesh, SurfaceReport& report) {
    SoundTriangles sound;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const Triangle& corners = mesh.triangles[t];
        const auto id = static_cast<Index>(t);
        if (!in_range(corners, mesh.vertices.size()) || repeats(corners)) {
            ++report.degenerate_triangles;
            note(report.bad_triangles, id);
            continue;
        }
        sound.triangles.push_back(corners);
        sound.id.push_back(id);
        const Vec3 &a = mesh.vertices[corners[0]], &b = mesh.vertices[corners[1]], &c = mesh.vertices[corners[2]];
        if (is_finite(a) && is_finite(b) && is_finite(c) && are_collinear(a, b, c)) {
            ++report.degenerate_triangles;
            note(report.bad_triangles, id);
        }
    }
    return sound;
}

void count_edges(const SoundTriangles& sound, SurfaceReport& report) {
    std::vector<Index> nonmanifold, inconsistent, border;
    const auto uses = sorted_edge_uses(sound.triangles);
    for_each_edge(uses, [&](std::span<const EdgeUse> edge) {
        const Index id = sound.id[edge[0].triangle];
        if (edge.size() == 1) ++report.boundary_edges, note(border, id);
        if (edge.size() == 2 && edge[0].forward == edge[1].forward) ++report.inconsistent_edges, note(inconsistent, id);
        if (edge.size() > 2) ++report.nonmanifold_edges, note(nonmanifold, id);
    });
    for (const auto* ids : {&nonmanifold, &inconsistent, &border})
        for (const Index id : *ids) note(report.bad_triangles, id);
}

void count_pinched_vertices(const SoundTriangles& sound, std::size_t vertex_count, SurfaceReport& report) {
    const auto fans = corner_fans(sound.triangles, vertex_count, false);
    std::vector<bool> pinched(vertex_count, false);
    for (std::size_t t = 0; t < fans.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
            if (fans[t][k] > 0) {
                pinched[sound.triangles[t][k]] = true;
                note(report.bad_triangles, sound.id[t]);
            }
    report.nonmanifold_vertices = static_cast<std::size_t>(std::count(pinched.begin(), pinched.end(), true));
}

std::string list_ids(const std::vector<Index>& ids) {
    std::string text;
    for (const Index id : ids) text += (text.empty() ? "" : ", ") + std::to_string(id);
    return text;
}

} // namespace

SurfaceReport inspect_surface(const TriMesh& mesh) {
    SurfaceReport report;
    report.vertices = mesh.vertices.size();
    report.triangles = mesh.triangles.size();
    report.non_finite_vertices =
        static_cast<std::size_t>(std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const Vec3& v) { return !is_finite(v); }));
    const SoundTriangles sound = keep_sound(mesh, report);
    report.duplicate_triangles = find_duplicates(sound.triangles).size();
    count_edges(sound, report);
    count_pinched_vertices(sound, mesh.vertices.size(), report);
    report.unreferenced_vertices = count_unreferenced(mesh.vertices.size(), sound.triangles);
    report.components = find_components(sound.triangles, mesh.vertices.size()).count;
    if (report.finite()) report.signed_volume = signed_volume({mesh.vertices, sound.triangles});
    return report;
}

Result<void> check_closed_surface(const TriMesh& mesh) {
    const SurfaceReport report = inspect_surface(mesh);
    std::string defect;
    const auto add = [&defect](std::size_t count, const char* what) {
        if (count > 0) defect += (defect.empty() ? "" : ", ") + std::to_string(count) + " " + what;
    };
    add(report.non_finite_vertices, "vertices that are not finite");
    add(report.degenerate_triangles, "degenerate triangles");
    add(report.duplicate_triangles, "duplicate triangles");
    add(report.nonmanifold_edges, "edges of three or more triangles");
    add(report.nonmanifold_vertices, "vertices where the surface only touches itself");
    add(report.boundary_edges, "open border edges");
    add(report.inconsistent_edges, "edges across which the orientation flips");
    if (report.triangles == 0) defect = "no triangles";
    if (defect.empty() && !(report.signed_volume > 0.0)) defect = "its orientation is inward (negative volume)";
    if (defect.empty()) return {};
    std::string message = "the surface is not closed, manifold and oriented outwards: " + defect;
    if (!report.bad_triangles.empty()) message += "; see triangles " + list_ids(report.bad_triangles);
    return Error{ErrorCode::BadMesh, message};
}

TetMeshReport inspect_tets(const TetMesh& mesh) {
    TetMeshReport report;
    report.nodes = mesh.vertices.size();
    report.tets = mesh.tets.size();
    report.non_finite_nodes =
        static_cast<std::size_t>(std::count_if(mesh.vertices.begin(), mesh.vertices.end(), [](const Vec3& v) { return !is_finite(v); }));
    std::vector<Tet> sound;
    std::vector<Index> sound_id;
    for (std::size_t i = 0; i < mesh.tets.size(); ++i) {
        if (!in_range(mesh.tets[i], mesh.vertices.size())) {
            ++report.out_of_range_tets;
            note(report.bad_tets, static_cast<Index>(i));
            continue;
        }
        sound.push_back(mesh.tets[i]);
        sound_id.push_back(static_cast<Index>(i));
    }
    std::vector<Triangle> faces, pairs_of_nodes;
    for (std::size_t i = 0; i < sound.size(); ++i) {
        const Tet& t = sound[i];
        const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]], &d = mesh.vertices[t[3]];
        for (std::size_t skip = 0; skip < 4; ++skip) {
            Triangle face{t[(skip + 1) % 4], t[(skip + 2) % 4], t[(skip + 3) % 4]};
            std::sort(face.begin(), face.end());
            faces.push_back(face);
        }
        pairs_of_nodes.push_back({t[0], t[1], t[2]});
        pairs_of_nodes.push_back({t[0], t[2], t[3]});
        if (!(is_finite(a) && is_finite(b) && is_finite(c) && is_finite(d))) continue;
        const int sign = repeats(t) ? 0 : orient3d(a, b, c, d);
        report.inverted_tets += sign < 0;
        report.flat_tets += sign == 0;
        if (sign <= 0) note(report.bad_tets, sound_id[i]);
        report.volume += (b - a).dot((c - a).cross(d - a)) / 6.0;
    }
    const auto duplicates = find_duplicates(sound);
    report.duplicate_tets = duplicates.size();
    for (const Index i : duplicates) note(report.bad_tets, sound_id[i]);
    std::sort(faces.begin(), faces.end());
    for (std::size_t i = 0; i < faces.size();) {
        std::size_t end = i;
        while (end < faces.size() && faces[end] == faces[i]) ++end;
        report.overused_faces += end - i > 2;
        i = end;
    }
    report.unreferenced_nodes = count_unreferenced(mesh.vertices.size(), sound);
    report.components = find_components(pairs_of_nodes, mesh.vertices.size()).count;
    return report;
}

} // namespace trocar
