#include "engine/io/weld.hpp"

#include <bit>
#include <cstdint>

namespace seldinger::engine {
namespace {

/// Mixes the bits of a position; -0 counts as 0, so that equal positions have equal codes.
std::uint64_t hash_of(const Vec3& p) noexcept {
    std::uint64_t code = 0x9E3779B97F4A7C15u;
    for (int axis = 0; axis < 3; ++axis) {
        code ^= std::bit_cast<std::uint64_t>(p[axis] + 0.0);
        code *= 0xFF51AFD7ED558CCDu;
        code ^= code >> 32;
    }
    return code;
}

} // namespace

std::size_t weld_equal_vertices(TriMesh& mesh) {
    // Open addressing, at most half full; slots hold new vertex ids.
    std::vector<Index> slots(std::bit_ceil(2 * mesh.vertices.size() + 2), kNoIndex);
    const std::size_t mask = slots.size() - 1;
    std::vector<Index> map(mesh.vertices.size());
    Index kept = 0;
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        const Vec3 position = mesh.vertices[i];
        std::size_t slot = hash_of(position) & mask;
        while (slots[slot] != kNoIndex && mesh.vertices[slots[slot]] != position) slot = (slot + 1) & mask;
        if (slots[slot] == kNoIndex) {
            slots[slot] = kept;
            mesh.vertices[kept++] = position;
        }
        map[i] = slots[slot];
    }
    const std::size_t joined = mesh.vertices.size() - kept;
    mesh.vertices.resize(kept);
    for (Triangle& triangle : mesh.triangles)
        for (Index& v : triangle) v = map[v];
    return joined;
}

std::size_t drop_unreferenced_nodes(TetMesh& mesh) {
    std::vector<Index> map(mesh.vertices.size(), kNoIndex);
    for (const Tet& tet : mesh.tets)
        for (const Index v : tet) map[v] = 0;
    Index kept = 0;
    for (std::size_t i = 0; i < map.size(); ++i) {
        if (map[i] == kNoIndex) continue;
        mesh.vertices[kept] = mesh.vertices[i];
        map[i] = kept++;
    }
    const std::size_t dropped = map.size() - kept;
    mesh.vertices.resize(kept);
    for (Tet& tet : mesh.tets)
        for (Index& v : tet) v = map[v];
    return dropped;
}

} // namespace seldinger::engine
