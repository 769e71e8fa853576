#include "fem/mesh/mesh_parts.hpp"

#include <algorithm>
#include <numeric>

namespace trocar::fem {

std::vector<Index> find_node_parts(const TetMesh& mesh) {
    std::vector<Index> root(mesh.vertices.size());
    std::iota(root.begin(), root.end(), Index{0});
    const auto find = [&](Index node) {
        while (root[node] != node) node = root[node] = root[root[node]];
        return node;
    };
    for (const Tet& t : mesh.tets)
        for (int k = 1; k < 4; ++k) {
            const Index a = find(t[0]), b = find(t[k]);
            root[std::max(a, b)] = std::min(a, b);
        }
    for (Index node = 0; node < root.size(); ++node) root[node] = find(node);
    return root;
}

std::size_t drop_loose_parts(TetMesh& mesh) {
    const std::vector<Index> root = find_node_parts(mesh);
    std::vector<std::size_t> size(root.size(), 0);
    for (const Tet& t : mesh.tets) ++size[root[t[0]]];
    const auto largest = static_cast<Index>(std::max_element(size.begin(), size.end()) - size.begin());
    return std::erase_if(mesh.tets, [&](const Tet& t) { return root[t[0]] != largest; });
}

} // namespace trocar::fem
