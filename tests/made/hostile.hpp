// Meshes that break programs, written by the tests themselves: each small, each with one defect, under the names and with the properties
// of the public collection that TROCAR_TEST_DATA may hold beside them.
#pragma once

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace trocar::made {

using Point = std::array<double, 3>;
using Face = std::array<int, 3>;

struct Shape {
    std::vector<Point> points;
    std::vector<Face> faces; // from 0
};

inline Shape cube(const Point& corner = {0, 0, 0}, double size = 1.0) {
    Shape shape;
    for (const auto& [x, y, z] :
         std::array<Point, 8>{{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}}})
        shape.points.push_back({corner[0] + size * x, corner[1] + size * y, corner[2] + size * z});
    shape.faces = {{0, 2, 1}, {0, 3, 2}, {4, 5, 6}, {4, 6, 7}, {0, 1, 5}, {0, 5, 4},
                   {1, 2, 6}, {1, 6, 5}, {2, 3, 7}, {2, 7, 6}, {3, 0, 4}, {3, 4, 7}};
    return shape;
}

/// Of rings between two poles.
inline Shape ball(const Point& centre, int rings, int spokes) {
    constexpr double kPi = 3.14159265358979323846;
    Shape shape;
    const auto add = [&](double tilt, double turn) {
        shape.points.push_back(
            {centre[0] + std::sin(tilt) * std::cos(turn), centre[1] + std::sin(tilt) * std::sin(turn), centre[2] + std::cos(tilt)});
    };
    add(0.0, 0.0);
    for (int r = 1; r < rings; ++r)
        for (int s = 0; s < spokes; ++s) add(kPi * r / rings, 2.0 * kPi * s / spokes);
    add(kPi, 0.0);
    const auto id = [&](int r, int s) { return 1 + (r - 1) * spokes + s % spokes; };
    const int last = static_cast<int>(shape.points.size()) - 1;
    for (int s = 0; s < spokes; ++s) {
        shape.faces.push_back({0, id(1, s), id(1, s + 1)});
        for (int r = 1; r + 1 < rings; ++r) {
            shape.faces.push_back({id(r, s), id(r + 1, s), id(r + 1, s + 1)});
            shape.faces.push_back({id(r, s), id(r + 1, s + 1), id(r, s + 1)});
        }
        shape.faces.push_back({last, id(rings - 1, s + 1), id(rings - 1, s)});
    }
    return shape;
}

inline Shape join(Shape a, const Shape& b) {
    const int first = static_cast<int>(a.points.size());
    a.points.insert(a.points.end(), b.points.begin(), b.points.end());
    for (const Face& f : b.faces) a.faces.push_back({f[0] + first, f[1] + first, f[2] + first});
    return a;
}

/// Every face with corners of its own, each moved by up to `jitter`.
inline Shape soup(const Shape& shape, double jitter) {
    Shape out;
    unsigned state = 1;
    const auto shift = [&] { return jitter * (static_cast<double>((state = state * 1664525u + 1013904223u) >> 8) * 0x1p-23 - 1.0); };
    for (const Face& face : shape.faces) {
        const int first = static_cast<int>(out.points.size());
        for (const int corner : face) {
            Point p = shape.points[static_cast<std::size_t>(corner)];
            for (double& x : p) x += shift();
            out.points.push_back(p);
        }
        out.faces.push_back({first, first + 1, first + 2});
    }
    return out;
}

/// An unorientable band: `steps` quads round a circle that turn over once.
inline Shape moebius(int steps) {
    constexpr double kPi = 3.14159265358979323846;
    Shape shape;
    for (int k = 0; k < steps; ++k)
        for (const double across : {-0.3, 0.3}) {
            const double turn = 2.0 * kPi * k / steps, out = 1.0 + across * std::cos(0.5 * turn);
            shape.points.push_back({out * std::cos(turn), out * std::sin(turn), across * std::sin(0.5 * turn)});
        }
    for (int k = 0; k < steps; ++k) {
        const int a = 2 * k, b = 2 * k + 1, c = k + 1 < steps ? a + 2 : 1, d = k + 1 < steps ? b + 2 : 0;
        shape.faces.push_back({a, c, b});
        shape.faces.push_back({b, c, d});
    }
    return shape;
}

inline std::string obj(const Shape& shape) {
    std::string text;
    char line[128];
    for (const Point& p : shape.points) {
        std::snprintf(line, sizeof line, "v %.17g %.17g %.17g\n", p[0], p[1], p[2]);
        text += line;
    }
    for (const Face& f : shape.faces) {
        std::snprintf(line, sizeof line, "f %d %d %d\n", f[0] + 1, f[1] + 1, f[2] + 1);
        text += line;
    }
    return text;
}

/// A cube of which something was changed.
template <class Change>
std::string spoilt_cube(Change change) {
    Shape shape = cube();
    change(shape);
    return obj(shape);
}

inline std::string two_tets(const std::string& fifth_point, const std::string& second_tet) {
    return "# vtk DataFile Version 3.0\ntets\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n" +
           fifth_point + "\nCELLS 2 10\n4 0 1 2 3\n4 " + second_tet + "\nCELL_TYPES 2\n10\n10\n";
}

/// Name and bytes of every one.
inline std::map<std::string, std::string> hostile_meshes() {
    Shape bowtie{{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {-1, 0, 0}, {0, -1, 0}, {0, 0, -1}}, {}};
    bowtie.faces = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}, {0, 4, 5}, {0, 6, 4}, {0, 5, 6}, {4, 6, 5}};
    Shape slivers;
    for (int k = 0; k < 10; ++k) slivers.points.push_back({0.5 * k, k % 2 == 0 ? 0.0 : 1e-12, 0.0});
    for (int k = 0; k + 2 < 10; ++k) slivers.faces.push_back(k % 2 == 0 ? Face{k, k + 2, k + 1} : Face{k, k + 1, k + 2});
    std::string nan = obj(cube()), infinite = nan;
    nan.replace(nan.find("v 1 1 1"), 7, "v nan 1 1");
    infinite.replace(infinite.find("v 1 1 1"), 7, "v inf 1 1");
    return {
        {"cube_nan_vertex.obj", nan},
        {"cube_inf_vertex.obj", infinite},
        {"cube_open_one_face.obj", spoilt_cube([](Shape& s) { s.faces.resize(10); })},
        {"cube_flipped_face.obj", spoilt_cube([](Shape& s) { std::swap(s.faces[4][1], s.faces[4][2]); })},
        {"cube_duplicate_face.obj", spoilt_cube([](Shape& s) { s.faces.push_back(s.faces[3]); })},
        {"cube_duplicate_verts.obj", obj(soup(cube(), 0.0))},
        {"cube_near_duplicate_verts.obj", obj(soup(cube(), 1e-9))},
        {"degenerate_zero_area.obj", spoilt_cube([](Shape& s) {
             s.points.push_back({0.5, 0, 0});
             s.faces.insert(s.faces.end(), {{0, 1, 8}, {2, 2, 3}});
         })},
        {"edge_three_faces.obj", obj({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}, {{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}})},
        {"bowtie_vertex.obj", obj(bowtie)},
        {"two_spheres_interpenetrating.obj", obj(join(ball({0, 0, 0}, 12, 20), ball({0.9, 0.13, 0.07}, 12, 20)))},
        {"two_cubes_touching_face.obj", obj(join(cube(), cube({1, 0, 0})))},
        {"cube_huge_offset.obj", obj(cube({1e8, 1e8, 1e8}))},
        {"cube_tiny.obj", obj(cube({0, 0, 0}, 1e-9))},
        {"sliver_strip.obj", obj(slivers)},
        {"index_out_of_range.obj", obj(cube()) + "f 1 2 100\n"},
        {"unreferenced_vertices.obj", spoilt_cube([](Shape& s) {
             s.points.insert(s.points.end(), {{100, 0, 0}, {0, -1e6, 0}});
         })},
        {"nonplanar_quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nv 0.5 1.5 0\nvt 0 0\nvn 0 0 1\nf -5/1/1 -4/1/1 -3/1/1 -2/1/1\n"
                               "f 1//1 2//1 3//1 5//1 4//1\n"},
        {"empty.obj", ""},
        {"tet_inverted.vtk", two_tets("1 1 1", "1 2 4 3")},
        {"tet_flat.vtk", two_tets("1 1 0", "0 1 2 4")},
        {"mobius_strip.obj", obj(moebius(60))},
    };
}

/// More of them, without a property that is stated: every operation on them ends, in a result or an error.
inline std::map<std::string, std::string> odd_meshes() {
    std::string crushed = obj(ball({0, 0, 0}, 8, 12)), cut = obj(ball({0, 0, 0}, 10, 16));
    cut.resize(cut.size() * 2 / 3);
    Shape flat = ball({0, 0, 0}, 10, 14), nested = join(ball({0, 0, 0}, 8, 12), ball({0.1, 0, 0}, 6, 8)), holes = ball({0, 0, 0}, 14, 20);
    for (Point& p : flat.points) p[2] = 0.0;
    for (std::size_t k = 0; k < holes.faces.size(); k += 9) holes.faces.erase(holes.faces.begin() + static_cast<std::ptrdiff_t>(k));
    Shape inward = ball({0, 0, 0}, 9, 13), crowd, fan{{{0, 0, 0}}, {}};
    for (Face& f : inward.faces) std::swap(f[0], f[1]);
    for (int k = 0; k < 12; ++k) crowd = join(crowd, ball({0.7 * (k % 4), 0.6 * (k / 4), 0.11 * k}, 6, 9));
    for (int k = 0; k <= 60; ++k) fan.points.push_back({std::cos(0.1 * k), std::sin(0.1 * k), 0.05 * (k % 3)});
    for (int k = 1; k <= 60; ++k) fan.faces.push_back({0, k, k % 60 + 1});
    return {{"ball_with_holes.obj", obj(holes)},
            {"balls_interpenetrating.obj", obj(crowd)},
            {"ball_in_ball.obj", obj(nested)},
            {"ball_inward.obj", obj(inward)},
            {"ball_flat.obj", obj(flat)},
            {"ball_as_soup.obj", obj(soup(ball({0, 0, 0}, 10, 15), 0.0))},
            {"ball_cut_off.obj", cut},
            {"fan_open.obj", obj(fan)},
            {"two_balls_far_apart.obj", obj(join(ball({0, 0, 0}, 8, 12), ball({1e7, 0, 0}, 8, 12)))},
            {"too_few_corners.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\n"},
            {"words_for_numbers.obj", "v zero one two\nf 1 2 3\n"},
            {"wall_continued.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 \\\n3 4\n"},
            {"not_a_mesh.stl", std::string(200, 'x')},
            {"count_that_lies.stl", std::string(80, ' ') + "\xff\xff\xff\x7f" + std::string(100, '\0')}};
}

/// A folder `nasty/synthetic` with all of them, and what is stated of each in EXPECTED.json, as the test data have it.
inline void write_hostile_meshes(const std::filesystem::path& folder) {
    const std::filesystem::path synthetic = folder / "nasty/synthetic";
    std::filesystem::create_directories(synthetic);
    std::string expected;
    for (const auto& [name, bytes] : hostile_meshes()) {
        std::ofstream(synthetic / name, std::ios::binary) << bytes;
        expected += (expected.empty() ? "{\n \"" : ",\n \"") + name + "\": \"as its name says\"";
    }
    std::ofstream(synthetic / "EXPECTED.json") << expected << "\n}\n";
    for (const auto& [name, bytes] : odd_meshes()) std::ofstream(folder / "nasty" / name, std::ios::binary) << bytes;
}

} // namespace trocar::made
