// Choosing the triangle of coarse nodes in which each dense vertex is embedded.
#include "fem/embedding/links.hpp"

#include "base/closest_point.hpp"
#include "base/topology.hpp"
#include "base/triangle_tree.hpp"
#include "fem/embedding/link_frame.hpp"
#include "fem/embedding/tet_locator.hpp"

#include <algorithm>
#include <limits>
#include <map>
#include <optional>
#include <string>

namespace trocar::fem {

namespace {

/// Nearest nodes that make a thinner triangle than this (sine at its nearest node) are passed over for farther ones: the
/// frame of a thin triangle rotates fast under the smallest motion of its short side.
constexpr double kThinSine = 0.25;

struct Choice {
    Triangle nodes;
    std::array<double, 3> weight;
};

double sine_at(const Vec3& apex, const Vec3& a, const Vec3& b) {
    const double size_sq = (a - apex).squaredNorm() * (b - apex).squaredNorm();
    return size_sq > 0.0 ? (a - apex).cross(b - apex).norm() / std::sqrt(size_sq) : 0.0;
}

/// Collects links; triangles are sorted by node id first, so that vertices on the same three nodes share a frame.
class LinkBuilder {
public:
    LinkBuilder(const TetMesh& coarse, std::span<const Vec3> vertices) : vertices_(vertices) {
        links_.node_rest = coarse.vertices;
        links_.vertex_frame.assign(vertices.size(), kNoIndex);
        links_.vertex_weight.assign(vertices.size(), {0.0, 0.0, 0.0});
        links_.vertex_projection.assign(vertices.size(), Vec3::Zero());
        links_.vertex_blend.assign(vertices.size(), 0.0);
    }

    /// False when the triangle has no frame: the vertex stays static.
    bool add(Index vertex, Choice choice, double blend) {
        sort_nodes(choice);
        const LinkTriangle triangle{node(choice.nodes[0]), node(choice.nodes[1]), node(choice.nodes[2])};
        Mat3 axes;
        if (!(blend > 0.0) || !find_axes(triangle, axes)) return false;
        const auto [slot, is_new] = frame_of_.try_emplace(choice.nodes, static_cast<Index>(links_.frame_nodes.size()));
        if (is_new) {
            links_.frame_nodes.push_back(choice.nodes);
            links_.frame_rest.push_back(axes);
        }
        const auto& a = choice.weight;
        const Vec3 link = vertices_[vertex] - (a[0] * triangle.q0 + a[1] * triangle.q1 + a[2] * triangle.q2);
        links_.vertex_frame[vertex] = slot->second;
        links_.vertex_weight[vertex] = a;
        links_.vertex_projection[vertex] = axes.transpose() * link;
        links_.vertex_blend[vertex] = blend;
        note_length(vertex, link.norm(), triangle);
        return true;
    }
    void count_degenerate() { ++links_.degenerate; }

    RigidLinks finish() && {
        links_.static_count = static_cast<std::size_t>(std::count(links_.vertex_frame.begin(), links_.vertex_frame.end(), kNoIndex));
        return std::move(links_);
    }

private:
    const Vec3& node(Index id) const { return links_.node_rest[id]; }

    static void sort_nodes(Choice& choice) {
        for (const auto& [i, j] : {std::pair{0, 1}, std::pair{1, 2}, std::pair{0, 1}})
            if (choice.nodes[i] > choice.nodes[j]) {
                std::swap(choice.nodes[i], choice.nodes[j]);
                std::swap(choice.weight[i], choice.weight[j]);
            }
    }
    void note_length(Index vertex, double length, const LinkTriangle& t) {
        if (length > links_.max_length || links_.longest == kNoIndex) {
            links_.max_length = length;
            links_.longest = vertex;
        }
        if (length > std::max({(t.q1 - t.q0).norm(), (t.q2 - t.q1).norm(), (t.q0 - t.q2).norm()})) ++links_.long_count;
    }

    std::span<const Vec3> vertices_;
    RigidLinks links_;
    std::map<Triangle, Index> frame_of_;
};

/// The boundary of the coarse mesh with what the search around a point needs.
struct CoarseSurface {
    TriMesh mesh; // vertices: all coarse nodes
    TriangleTree tree;
    VertexTriangles around;

    explicit CoarseSurface(const TetMesh& coarse)
        : mesh(boundary_surface(coarse)), tree(mesh), around(vertex_triangles(mesh.triangles, mesh.vertices.size())) {}

    [[nodiscard]] Vec3 normal(Index triangle) const {
        const Triangle& t = mesh.triangles[triangle];
        return (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
    }
    [[nodiscard]] double longest_edge(Index triangle) const {
        const Triangle& t = mesh.triangles[triangle];
        double longest = 0.0;
        for (std::size_t k = 0; k < 3; ++k) longest = std::max(longest, (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
        return longest;
    }
};

/// The nearest triangle that faces the way of `normal`, searched as far as one edge beyond the nearest one; else the nearest.
Index find_patch_centre(const CoarseSurface& surface, const Vec3& p, const Vec3& normal) {
    const auto nearest = surface.tree.closest(p);
    if (!nearest) return kNoIndex;
    if (!(normal.dot(surface.normal(nearest->triangle)) < 0.0)) return nearest->triangle;
    const double reach = nearest->distance + surface.longest_edge(nearest->triangle);
    Box3 box;
    box.add(p);
    box.inflate(reach);
    Index best = nearest->triangle;
    double best_sq = reach * reach;
    surface.tree.for_each_overlapping(box, [&](Index triangle) {
        if (!(normal.dot(surface.normal(triangle)) > 0.0)) return;
        const Triangle& t = surface.mesh.triangles[triangle];
        const double distance_sq =
            closest_on_triangle(p, surface.mesh.vertices[t[0]], surface.mesh.vertices[t[1]], surface.mesh.vertices[t[2]]).distance_sq;
        if (distance_sq > best_sq || (distance_sq == best_sq && triangle > best)) return;
        best = triangle;
        best_sq = distance_sq;
    });
    return best;
}

/// Nodes of the triangles that share a vertex with `centre`, nearest to p first; ties by id.
std::vector<Index> patch_nodes(const CoarseSurface& surface, Index centre, const Vec3& p) {
    std::vector<Index> nodes;
    for (const Index corner : surface.mesh.triangles[centre])
        for (const Index triangle : surface.around.of(corner))
            for (const Index node : surface.mesh.triangles[triangle]) nodes.push_back(node);
    std::sort(nodes.begin(), nodes.end());
    nodes.erase(std::unique(nodes.begin(), nodes.end()), nodes.end());
    std::stable_sort(nodes.begin(), nodes.end(), [&](Index a, Index b) {
        return (surface.mesh.vertices[a] - p).squaredNorm() < (surface.mesh.vertices[b] - p).squaredNorm();
    });
    return nodes;
}

/// 1/d weights; all of it on the nearest node where it coincides with p.
std::array<double, 3> inverse_distance_weights(const std::array<double, 3>& distance) {
    for (std::size_t i = 0; i < 3; ++i)
        if (!(distance[i] > 0.0)) {
            std::array<double, 3> weight{0.0, 0.0, 0.0};
            weight[i] = 1.0;
            return weight;
        }
    const double sum = 1.0 / distance[0] + 1.0 / distance[1] + 1.0 / distance[2];
    return {1.0 / distance[0] / sum, 1.0 / distance[1] / sum, 1.0 / distance[2] / sum};
}

struct NodeChoice {
    Triangle nodes;
    bool widened; // the three nearest are collinear or thin
};

/// Three of the patch: the nearest, the next that is elsewhere, the next that is off their line by least_sine.
std::optional<NodeChoice> choose_nodes(std::span<const Vec3> at, const std::vector<Index>& nearest, double least_sine) {
    for (std::size_t second = 1; second < nearest.size(); ++second)
        for (std::size_t third = second + 1; third < nearest.size(); ++third)
            if (sine_at(at[nearest[0]], at[nearest[second]], at[nearest[third]]) > least_sine)
                return NodeChoice{{nearest[0], nearest[second], nearest[third]}, third != 2};
    return std::nullopt;
}

std::vector<Vec3> vertex_normals(const TriMesh& mesh) {
    std::vector<Vec3> normals(mesh.vertices.size(), Vec3::Zero());
    for (const Triangle& t : mesh.triangles) {
        const Vec3 n = (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]);
        for (const Index v : t) normals[v] += n;
    }
    return normals;
}

Result<void> check_inputs(const TetMesh& coarse, std::span<const Vec3> vertices) {
    const auto bad = [](std::string message) { return Error{.code = ErrorCode::BadMesh, .message = std::move(message)}; };
    if (coarse.tets.empty()) return bad("the coarse mesh has no tetrahedra to link to");
    for (const Tet& t : coarse.tets)
        for (const Index node : t)
            if (node >= coarse.vertices.size()) return bad("a coarse tet names node " + std::to_string(node) + ", which does not exist");
    for (std::size_t node = 0; node < coarse.vertices.size(); ++node)
        if (!is_finite(coarse.vertices[node])) return bad("coarse node " + std::to_string(node) + " is not finite");
    for (std::size_t v = 0; v < vertices.size(); ++v)
        if (!is_finite(vertices[v])) return bad("vertex " + std::to_string(v) + " is not finite");
    return {};
}

Choice on_face(const Triangle& nodes, const PointOnTriangle& closest) { return {nodes, closest.bary}; }

PointOnTriangle closest_on_face(const Vec3& p, const Triangle& face, std::span<const Vec3> at) {
    return closest_on_triangle(p, at[face[0]], at[face[1]], at[face[2]]);
}

/// The tet's faces, nearest to p first; ties by face number.
std::array<Triangle, 4> faces_by_distance(const Tet& t, const Vec3& p, std::span<const Vec3> at) {
    std::array<Triangle, 4> faces{Triangle{t[1], t[2], t[3]}, {t[0], t[2], t[3]}, {t[0], t[1], t[3]}, {t[0], t[1], t[2]}};
    std::stable_sort(faces.begin(), faces.end(), [&](const Triangle& a, const Triangle& b) {
        return closest_on_face(p, a, at).distance_sq < closest_on_face(p, b, at).distance_sq;
    });
    return faces;
}

double smooth_fall(double x) { return x >= 1.0 ? 0.0 : 1.0 - x * x * (3.0 - 2.0 * x); }

} // namespace

Result<RigidLinks> make_surface_links(const TetMesh& coarse, const TriMesh& dense) {
    if (const auto fine = check_inputs(coarse, dense.vertices); !fine) return fine.error();
    for (const Triangle& t : dense.triangles)
        for (const Index v : t)
            if (v >= dense.vertices.size())
                return Error{.code = ErrorCode::BadMesh,
                             .message = "a triangle names vertex " + std::to_string(v) + ", which does not exist"};
    const CoarseSurface surface(coarse);
    if (surface.mesh.triangles.empty()) return Error{.code = ErrorCode::BadMesh, .message = "the coarse mesh has no surface to link to"};
    const std::vector<Vec3> normals = vertex_normals(dense);
    LinkBuilder builder(coarse, dense.vertices);
    for (Index v = 0; v < dense.vertices.size(); ++v) {
        const Vec3& p = dense.vertices[v];
        const Index centre = find_patch_centre(surface, p, normals[v]);
        const std::vector<Index> nearest = patch_nodes(surface, centre, p);
        auto choice = choose_nodes(coarse.vertices, nearest, kThinSine);
        if (!choice) choice = choose_nodes(coarse.vertices, nearest, kCollapsedSine);
        if (!choice || choice->widened) builder.count_degenerate();
        if (!choice) continue; // a patch without area: no frame to embed in, the vertex is static and counted
        std::array<double, 3> distance{};
        for (std::size_t i = 0; i < 3; ++i) distance[i] = (coarse.vertices[choice->nodes[i]] - p).norm();
        builder.add(v, {choice->nodes, inverse_distance_weights(distance)}, 1.0);
    }
    return std::move(builder).finish();
}

Result<RigidLinks> make_embedded_links(const TetMesh& coarse, std::span<const Vec3> vertices, double blend_length) {
    if (const auto fine = check_inputs(coarse, vertices); !fine) return fine.error();
    if (!(blend_length >= 0.0) || !std::isfinite(blend_length))
        return Error{.code = ErrorCode::BadValue,
                     .message = "the blend length is " + std::to_string(blend_length) + " m; it must be 0 or more"};
    const CoarseSurface surface(coarse);
    const TetLocator locator(coarse);
    // A vertex that rounding alone puts outside belongs to the surface.
    const double touching = 1e-9 * surface.tree.bounds().longest_edge();
    LinkBuilder builder(coarse, vertices);
    for (Index v = 0; v < vertices.size(); ++v) {
        const Vec3& p = vertices[v];
        if (const Index tet = locator.find(p); tet != kNoIndex) {
            bool linked = false, first = true;
            for (const Triangle& face : faces_by_distance(coarse.tets[tet], p, coarse.vertices)) {
                linked = builder.add(v, on_face(face, closest_on_face(p, face, coarse.vertices)), 1.0);
                if (linked) break;
                if (first) builder.count_degenerate();
                first = false;
            }
            continue;
        }
        const auto nearest = surface.tree.closest(p, std::max(blend_length, touching));
        if (!nearest) continue;
        const double blend = nearest->distance <= touching ? 1.0 : smooth_fall(nearest->distance / blend_length);
        if (blend > 0.0 && !builder.add(v, {surface.mesh.triangles[nearest->triangle], nearest->bary}, blend)) builder.count_degenerate();
    }
    return std::move(builder).finish();
}

Result<RigidLinks> make_bore_links(const TetMesh& wall, const TriMesh& lumen) {
    if (const auto fine = check_inputs(wall, lumen.vertices); !fine) return fine.error();
    const CoarseSurface surface(wall);
    if (surface.mesh.triangles.empty()) return Error{.code = ErrorCode::BadMesh, .message = "the wall has no surface to link to"};
    const std::vector<Vec3> normals = vertex_normals(lumen);
    LinkBuilder builder(wall, lumen.vertices);
    for (Index v = 0; v < lumen.vertices.size(); ++v) {
        const Triangle& nodes = surface.mesh.triangles[find_patch_centre(surface, lumen.vertices[v], -normals[v])];
        if (!builder.add(v, on_face(nodes, closest_on_face(lumen.vertices[v], nodes, wall.vertices)), 1.0)) builder.count_degenerate();
    }
    return std::move(builder).finish();
}

namespace {

/// The nearest of these nodes, and the two that with it lie most evenly around p: whose directions from it nearly add up to nothing.
Triangle surround(const std::vector<Index>& nodes, std::span<const Vec3> at, const Vec3& p) {
    std::vector<Vec3> way;
    for (const Index node : nodes) way.push_back((at[node] - p).normalized());
    Triangle best{nodes[0], nodes[1], nodes[2]};
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < nodes.size(); ++i)
        for (std::size_t j = i + 1; j < nodes.size(); ++j)
            if (const double off = (way[0] + way[i] + way[j]).squaredNorm(); off < least) least = off, best = {nodes[0], nodes[i], nodes[j]};
    return best;
}

/// Those within half as far again as the nearest, nearest first; at most so many, and at least three.
std::vector<Index> find_around(std::span<const Vec3> at, const Vec3& p) {
    constexpr std::size_t kMost = 96;
    std::vector<std::pair<double, Index>> all;
    for (Index node = 0; node < at.size(); ++node) all.emplace_back((at[node] - p).norm(), node);
    const std::size_t most = std::min(kMost, all.size());
    std::partial_sort(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(most), all.end());
    std::vector<Index> near;
    for (std::size_t k = 0; k < most && (k < 3 || all[k].first <= 1.5 * all[0].first); ++k) near.push_back(all[k].second);
    return near;
}

} // namespace

Result<RigidLinks> make_middle_links(const TetMesh& wall, std::span<const Vec3> points) {
    if (const auto fine = check_inputs(wall, points); !fine) return fine.error();
    LinkBuilder builder(wall, points);
    for (Index v = 0; v < points.size(); ++v) {
        const Triangle nodes = surround(find_around(wall.vertices, points[v]), wall.vertices, points[v]);
        if (!builder.add(v, on_face(nodes, closest_on_face(points[v], nodes, wall.vertices)), 1.0)) builder.count_degenerate();
    }
    return std::move(builder).finish();
}

} // namespace trocar::fem
