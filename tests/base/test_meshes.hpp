// Small surfaces for tests, and just enough of an OBJ reader to fetch real ones (the engine's reader is in a layer above).
#pragma once

#include "base/mesh.hpp"
#include "base/topology.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <sstream>

namespace trocar::test {

/// Fixed seed, printed where a test fails: SCOPED_TRACE(random.seed).
struct Random {
    std::uint32_t seed;
    std::mt19937 engine{seed};
    double uniform(double lo = -1.0, double hi = 1.0) { return lo + (hi - lo) * (engine() * 0x1p-32); }
    Vec3 point(double reach = 1.0) {
        const double x = uniform(), y = uniform(), z = uniform();
        return reach * Vec3(x, y, z);
    }
    std::string trace() const { return "seed " + std::to_string(seed); }
};

inline TriMesh make_cube(double size = 1.0, const Vec3& corner = Vec3::Zero()) {
    TriMesh cube;
    for (int i = 0; i < 8; ++i) cube.vertices.push_back(corner + size * Vec3(i & 1, (i >> 1) & 1, i >> 2));
    cube.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                      {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    return cube;
}

/// Octahedron split `levels` times and pushed onto the sphere: 8 * 4^levels triangles, outward.
inline TriMesh make_sphere(int levels, double radius = 1.0, const Vec3& centre = Vec3::Zero()) {
    TriMesh m;
    m.vertices = {Vec3(1, 0, 0), Vec3(-1, 0, 0), Vec3(0, 1, 0), Vec3(0, -1, 0), Vec3(0, 0, 1), Vec3(0, 0, -1)};
    m.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int level = 0; level < levels; ++level) {
        std::map<std::pair<Index, Index>, Index> middle;
        const auto split = [&](Index a, Index b) {
            const auto [it, fresh] = middle.try_emplace(std::minmax(a, b), static_cast<Index>(m.vertices.size()));
            if (fresh) m.vertices.push_back((m.vertices[a] + m.vertices[b]).normalized());
            return it->second;
        };
        std::vector<Triangle> finer;
        for (const auto& [a, b, c] : m.triangles) {
            const Index ab = split(a, b), bc = split(b, c), ca = split(c, a);
            finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
        }
        m.triangles = finer;
    }
    for (Vec3& v : m.vertices) v = centre + radius * v;
    return m;
}

/// Outward torus round the z axis, genus 1.
inline TriMesh make_torus(Index around, Index across, double radius = 1.0, double tube = 0.3) {
    TriMesh m;
    for (Index i = 0; i < around; ++i)
        for (Index j = 0; j < across; ++j) {
            const double u = 2.0 * M_PI * i / around, v = 2.0 * M_PI * j / across, r = radius + tube * std::cos(v);
            m.vertices.emplace_back(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
        }
    for (Index i = 0; i < around; ++i)
        for (Index j = 0; j < across; ++j) {
            const Index i1 = (i + 1) % around, j1 = (j + 1) % across;
            const Index a = i * across + j, b = i1 * across + j, c = i1 * across + j1, d = i * across + j1;
            m.triangles.insert(m.triangles.end(), {{a, b, c}, {a, c, d}});
        }
    return m;
}

/// Flat n x n grid of squares in the unit square, 2 n^2 triangles, open.
inline TriMesh make_grid(Index n) {
    TriMesh m;
    for (Index i = 0; i <= n; ++i)
        for (Index j = 0; j <= n; ++j) m.vertices.emplace_back(double(i) / n, double(j) / n, 0.0);
    for (Index i = 0; i < n; ++i)
        for (Index j = 0; j < n; ++j) {
            const Index a = i * (n + 1) + j, b = a + n + 1, c = b + 1, d = a + 1;
            m.triangles.insert(m.triangles.end(), {{a, b, c}, {a, c, d}});
        }
    return m;
}

inline TriMesh join(TriMesh a, const TriMesh& b) {
    const auto offset = static_cast<Index>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    return a;
}

inline TriMesh flipped(TriMesh m) {
    for (Triangle& t : m.triangles) std::swap(t[1], t[2]);
    return m;
}

/// Reads $TROCAR_TEST_DATA/name, plain or gzip. v and f lines only; polygons become fans. Empty if it cannot.
inline TriMesh load_obj(const std::string& name) {
    TriMesh m;
    const char* root = std::getenv("TROCAR_TEST_DATA");
    if (root == nullptr) return m;
    gzFile file = gzopen((std::string(root) + "/" + name).c_str(), "rb");
    if (file == nullptr) return m;
    std::string line;
    std::array<char, 4096> buffer;
    while (gzgets(file, buffer.data(), static_cast<int>(buffer.size())) != nullptr) {
        std::istringstream words(buffer.data());
        std::string word;
        words >> word;
        if (word == "v") {
            std::string x, y, z; // strtod takes nan and inf, which streams do not
            words >> x >> y >> z;
            m.vertices.emplace_back(std::strtod(x.c_str(), nullptr), std::strtod(y.c_str(), nullptr), std::strtod(z.c_str(), nullptr));
        } else if (word == "f") {
            std::vector<Index> corners;
            while (words >> word) {
                const long id = std::strtol(word.c_str(), nullptr, 10);
                corners.push_back(static_cast<Index>(id > 0 ? id - 1 : static_cast<long>(m.vertices.size()) + id));
            }
            for (std::size_t k = 2; k < corners.size(); ++k) m.triangles.push_back({corners[0], corners[k - 1], corners[k]});
        }
    }
    gzclose(file);
    return m;
}

} // namespace trocar::test

#define TROCAR_LOAD_OR_SKIP(mesh, name)                                                                                                    \
    TriMesh mesh = trocar::test::load_obj(name);                                                                                           \
    if (mesh.triangles.empty()) GTEST_SKIP() << "set TROCAR_TEST_DATA to the folder that holds " << name
