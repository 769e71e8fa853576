#include "fem/tissue/prism_pairs.hpp"

#include <Eigen/Geometry>

#include <algorithm>

namespace trocar::fem {

namespace {

constexpr double kFlat = 0.7; // [-] cosine between the normals of a pair

/// Two prisms of a layer side by side, and how long the edge that they share is.
struct SharedEdge {
    double length_sq;
    Index a, b;
};

/// By their lower edges; the longest first.
std::vector<SharedEdge> find_neighbours(std::span<const Prism> prisms, std::span<const Vec3> x) {
    std::vector<std::pair<std::array<Index, 2>, Index>> edges;
    for (std::size_t p = 0; p < prisms.size(); ++p)
        for (std::size_t side = 0; side < 3; ++side) {
            std::array<Index, 2> edge{prisms[p].node[(side + 1) % 3], prisms[p].node[(side + 2) % 3]};
            std::sort(edge.begin(), edge.end());
            edges.push_back({edge, static_cast<Index>(p)});
        }
    std::sort(edges.begin(), edges.end());
    std::vector<SharedEdge> all;
    for (std::size_t k = 1; k < edges.size(); ++k)
        if (edges[k].first == edges[k - 1].first) all.push_back({(x[edges[k].first[1]] - x[edges[k].first[0]]).squaredNorm(), edges[k - 1].second, edges[k].second});
    std::stable_sort(all.begin(), all.end(), [](const SharedEdge& a, const SharedEdge& b) { return a.length_sq > b.length_sq; });
    return all;
}

} // namespace

/// The first of its tetrahedra has three lower corners, whose ids are below those of the upper ones.
Prism prism_of(std::span<const Tet> tets, std::size_t prism, Index sheet) {
    Tet first = tets[3 * prism];
    std::sort(first.begin(), first.end());
    return {{first[0], first[1], first[2], first[0] + sheet, first[1] + sheet, first[2] + sheet}};
}

Mat3 frame_of(const Prism& prism, std::span<const Vec3> x) {
    const auto middle = [&](std::size_t k) { return Vec3(0.5 * (x[prism.node[k]] + x[prism.node[k + 3]])); };
    Mat3 frame;
    frame.col(0) = middle(1) - middle(0);
    frame.col(1) = middle(2) - middle(0);
    frame.col(2).setZero();
    for (std::size_t k = 0; k < 3; ++k) frame.col(2) += (x[prism.node[k + 3]] - x[prism.node[k]]) / 6.0;
    return frame;
}

Vec3 normal_of(const Mat3& frame) { return frame.col(0).cross(frame.col(1)).normalized(); }

Result<void> check_prisms(std::span<const Tet> tets, std::size_t node_count, Index sheet) {
    const auto bad = [] { return Error{ErrorCode::BadValue, "elements \"prisms\": expected the mesh of a wall in layers, as the mesher \"wall\" makes it"}; };
    if (sheet == 0 || node_count % sheet != 0 || tets.size() % 3 != 0) return bad();
    for (std::size_t p = 0; 3 * p < tets.size(); ++p) {
        const Prism prism = prism_of(tets, p, sheet);
        for (std::size_t k = 0; k < 3; ++k) {
            const auto corner_of = [&](Index node) { return std::find(prism.node.begin(), prism.node.end(), node) - prism.node.begin(); };
            std::ptrdiff_t upper = 0; // corners: 1, 2, 3 of the three tetrahedra
            for (const Index node : tets[3 * p + k]) {
                if (corner_of(node) == 6) return bad();
                upper += corner_of(node) >= 3;
            }
            if (upper != static_cast<std::ptrdiff_t>(k) + 1) return bad();
        }
    }
    return {};
}

std::vector<Index> pair_prisms(std::span<const Tet> tets, std::span<const Vec3> x, Index sheet, std::span<const Index> order) {
    std::vector<Prism> prisms;
    std::vector<Vec3> normal;
    for (std::size_t p = 0; 3 * p < tets.size(); ++p) {
        prisms.push_back(prism_of(tets, p, sheet));
        Vec3 n = normal_of(frame_of(prisms.back(), x));
        if (n.dot(frame_of(prisms.back(), x).col(2)) < 0.0) n = -n;
        normal.push_back(n);
    }
    std::vector<Index> other(prisms.size(), kNoIndex); // halves of a quadrilateral, which its diagonal, the longest of their edges, parts
    for (const auto& [length_sq, a, b] : find_neighbours(prisms, x))
        if (other[a] == kNoIndex && other[b] == kNoIndex && normal[a].dot(normal[b]) > kFlat) other[a] = b, other[b] = a;
    std::vector<bool> taken(prisms.size(), false);
    std::vector<Index> rows;
    const auto add = [&](Index prism) {
        for (Index k = 0; k < 3; ++k) rows.push_back(prism == kNoIndex ? kNoIndex : 3 * prism + k);
    };
    for (const Index tet : order) {
        const Index prism = tet / 3;
        if (taken[prism]) continue;
        taken[prism] = true;
        if (other[prism] != kNoIndex) taken[other[prism]] = true;
        add(prism);
        add(other[prism]);
        rows.insert(rows.end(), {kNoIndex, kNoIndex});
    }
    return rows;
}

} // namespace trocar::fem
