#include "shapes.hpp"

#include <Eigen/Geometry>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <numbers>
#include <sstream>

namespace trocar::spheretree::test {

TriMesh make_tube(const TubeShape& shape) {
    TriMesh mesh;
    const unsigned n = shape.sides, m = shape.rings;
    const double h = 1e-4;
    Vec3 side = (shape.axis(h) - shape.axis(0)).unitOrthogonal();
    for (unsigned r = 0; r <= m; ++r) {
        const double t = static_cast<double>(r) / m;
        const Vec3 ahead = (shape.axis(std::min(1.0, t + h)) - shape.axis(std::max(0.0, t - h))).normalized();
        side = (side - ahead * ahead.dot(side)).normalized();
        const Vec3 up = ahead.cross(side);
        for (unsigned k = 0; k < n; ++k) {
            const double angle = 2.0 * std::numbers::pi * (k + 0.5 * (r % 2)) / n;
            mesh.vertices.push_back(shape.axis(t) + shape.radius(t) * (std::cos(angle) * side + std::sin(angle) * up));
        }
    }
    const auto first_cap = static_cast<Index>(mesh.vertices.size());
    mesh.vertices.push_back(shape.axis(0));
    mesh.vertices.push_back(shape.axis(1));
    for (unsigned r = 0; r < m; ++r)
        for (unsigned k = 0; k < n; ++k) {
            const Index a = r * n + k, b = r * n + (k + 1) % n;
            const Index c = a + n, d = b + n;
            if (r % 2 == 0) {
                mesh.triangles.push_back({a, b, c});
                mesh.triangles.push_back({b, d, c});
            } else {
                mesh.triangles.push_back({a, b, d});
                mesh.triangles.push_back({a, d, c});
            }
        }
    for (unsigned k = 0; k < n; ++k) {
        mesh.triangles.push_back({first_cap, (k + 1) % n, k});
        mesh.triangles.push_back({first_cap + 1, m * n + k, m * n + (k + 1) % n});
    }
    return mesh;
}

TriMesh make_straight_tube(double radius, double length, unsigned sides, unsigned rings) {
    return make_tube({[=](double t) { return Vec3(0, 0, t * length); }, [=](double) { return radius; }, sides, rings});
}

TriMesh make_icosphere(const Vec3& centre, double radius, unsigned levels) {
    const double g = 0.5 * (1.0 + std::sqrt(5.0));
    TriMesh mesh;
    for (const double s : {1.0, -1.0})
        for (const double u : {g, -g}) {
            mesh.vertices.emplace_back(0, s, u);
            mesh.vertices.emplace_back(s, u, 0);
            mesh.vertices.emplace_back(u, 0, s);
        }
    for (Index a = 0; a < 12; ++a)
        for (Index b = a + 1; b < 12; ++b)
            for (Index c = b + 1; c < 12; ++c) {
                const Vec3 &p = mesh.vertices[a], &q = mesh.vertices[b], &r = mesh.vertices[c];
                if (std::max({(p - q).norm(), (q - r).norm(), (r - p).norm()}) > 2.1) continue;
                if ((q - p).cross(r - p).dot(p + q + r) > 0)
                    mesh.triangles.push_back({a, b, c});
                else
                    mesh.triangles.push_back({a, c, b});
            }
    for (unsigned level = 0; level < levels; ++level) {
        std::map<std::pair<Index, Index>, Index> middle;
        std::vector<Triangle> finer;
        for (const Triangle& t : mesh.triangles) {
            Index m[3];
            for (int e = 0; e < 3; ++e) {
                const std::pair<Index, Index> edge = std::minmax(t[e], t[(e + 1) % 3]);
                const auto [place, added] = middle.try_emplace(edge, static_cast<Index>(mesh.vertices.size()));
                if (added) mesh.vertices.emplace_back(mesh.vertices[edge.first] + mesh.vertices[edge.second]);
                m[e] = place->second;
            }
            for (const Triangle& part :
                 {Triangle{t[0], m[0], m[2]}, Triangle{m[0], t[1], m[1]}, Triangle{m[2], m[1], t[2]}, Triangle{m[0], m[1], m[2]}})
                finer.push_back(part);
        }
        mesh.triangles = std::move(finer);
        for (Vec3& v : mesh.vertices) v.normalize();
    }
    for (Vec3& v : mesh.vertices) v = centre + radius * v.normalized();
    return mesh;
}

std::optional<TriMesh> read_test_obj(const std::string& name, double scale) {
    const char* folder = std::getenv("TROCAR_TEST_DATA");
    if (folder == nullptr) return std::nullopt;
    std::ifstream file(std::string(folder) + "/" + name);
    if (!file) return std::nullopt;
    TriMesh mesh;
    for (std::string line, word; std::getline(file, line);) {
        std::istringstream words(line);
        words >> word;
        if (word == "v") {
            Vec3 v;
            words >> v[0] >> v[1] >> v[2];
            mesh.vertices.emplace_back(scale * v);
        } else if (word == "f") {
            std::vector<Index> corners;
            while (words >> word) corners.push_back(static_cast<Index>(std::stoul(word) - 1));
            for (std::size_t k = 2; k < corners.size(); ++k) mesh.triangles.push_back({corners[0], corners[k - 1], corners[k]});
        }
    }
    double volume = 0.0;
    for (const Triangle& t : mesh.triangles) volume += mesh.vertices[t[0]].dot(mesh.vertices[t[1]].cross(mesh.vertices[t[2]]));
    if (volume < 0.0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    return mesh;
}

} // namespace trocar::spheretree::test
