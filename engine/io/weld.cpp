#include "engine/io/weld.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

namespace trocar::engine {
namespace {

/// -0 counts as 0.
std::uint64_t bits_of(double coordinate) noexcept { return std::bit_cast<std::uint64_t>(coordinate + 0.0); }

/// Mixes the bits of a position: equal positions have equal codes.
std::uint64_t hash_of(const Vec3& p) noexcept {
    std::uint64_t code = 0x9E3779B97F4A7C15u;
    for (int axis = 0; axis < 3; ++axis) {
        code ^= bits_of(p[axis]);
        code *= 0xFF51AFD7ED558CCDu;
        code ^= code >> 32;
    }
    return code;
}

/// A file can be made whose positions all fall into one slot; more probes than this a vertex, and the positions are sorted instead.
constexpr std::size_t kProbesPerVertex = 16;

/// old id -> new id, in order of first appearance; false: too many positions share their slots, `map` is unfinished.
bool map_by_hash(std::span<const Vec3> positions, std::vector<Index>& map) {
    std::vector<Index> slots(std::bit_ceil(2 * positions.size() + 2), kNoIndex); // at most half full; each holds the first of equal ones
    const std::size_t mask = slots.size() - 1;
    std::size_t probes_left = kProbesPerVertex * (positions.size() + 1);
    Index kept = 0;
    for (Index i = 0; i < positions.size(); ++i) {
        std::size_t slot = hash_of(positions[i]) & mask;
        for (; slots[slot] != kNoIndex && positions[slots[slot]] != positions[i]; slot = (slot + 1) & mask)
            if (--probes_left == 0) return false;
        if (slots[slot] == kNoIndex) {
            slots[slot] = i;
            map[i] = kept++;
        } else
            map[i] = map[slots[slot]];
    }
    return true;
}

void map_by_sorting(std::span<const Vec3> positions, std::vector<Index>& map) {
    const auto key_of = [&](Index i) {
        return std::array{bits_of(positions[i].x()), bits_of(positions[i].y()), bits_of(positions[i].z())};
    };
    std::vector<Index> order(positions.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(), [&](Index a, Index b) { return std::pair(key_of(a), a) < std::pair(key_of(b), b); });
    std::vector<Index> first(positions.size());
    for (std::size_t k = 0; k < order.size(); ++k)
        first[order[k]] = k > 0 && key_of(order[k]) == key_of(order[k - 1]) ? first[order[k - 1]] : order[k];
    Index kept = 0;
    for (Index i = 0; i < positions.size(); ++i) map[i] = first[i] == i ? kept++ : map[first[i]];
}

} // namespace

std::size_t weld_equal_vertices(TriMesh& mesh) {
    std::vector<Index> map(mesh.vertices.size());
    if (!map_by_hash(mesh.vertices, map)) map_by_sorting(mesh.vertices, map);
    Index kept = 0; // ids grow in order of first appearance
    for (std::size_t i = 0; i < map.size(); ++i)
        if (map[i] == kept) mesh.vertices[kept++] = mesh.vertices[i];
    const std::size_t joined = mesh.vertices.size() - kept;
    mesh.vertices.resize(kept);
    for (Triangle& triangle : mesh.triangles)
        for (Index& v : triangle) v = map[v];
    return joined;
}

std::size_t drop_unreferenced_nodes(TetMesh& mesh, std::vector<Index>* kept_nodes) {
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
    if (kept_nodes != nullptr) *kept_nodes = std::move(map);
    return dropped;
}

} // namespace trocar::engine
