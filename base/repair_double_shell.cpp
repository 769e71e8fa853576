// Telling the outer skin of a double shell from the inner one, where both are one surface. From the outer skin most straight
// lines reach infinity, from the inner one only those through an opening: on the male liver capsule of the Visible Human
// the open share is below 0.35 or above 0.5 for 97 % of the area.
#include "base/repair_steps.hpp"
#include "base/topology.hpp"
#include "base/triangle_tree.hpp"
#include "base/trig.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::repairs {
namespace {

constexpr int kDirections = 24;       // and their opposites
constexpr double kGrazing = 0.1;      // cosine to the normal below which a line is not counted
constexpr double kOpenShare = 0.4;    // of lines that get away; the valley between the two skins
constexpr double kThinSheet = 0.03;   // mean thickness (2 volume / area) of a sheet, in longest box edges
constexpr double kLeastHidden = 0.25; // an inner skin has about half the area; folds of a solid body far less

/// Evenly spread over the half sphere (a Fibonacci lattice).
Vec3 direction(int i) noexcept {
    constexpr double kGoldenAngle = 2.39996322972865332;
    const double z = (i + 0.5) / kDirections, r = std::sqrt(1.0 - z * z);
    const auto [s, c] = sin_cos(kGoldenAngle * i);
    return {r * c, r * s, z};
}

/// Rows are a frame whose first axis is the direction.
Mat3 frame_along(const Vec3& first) noexcept {
    int least = 0;
    first.cwiseAbs().minCoeff(&least);
    const Vec3 second = first.cross(Vec3::Unit(least)).normalized();
    Mat3 frame;
    frame << first.transpose(), second.transpose(), first.cross(second).transpose();
    return frame;
}

/// [triangle] share of lines from its front that meet nothing.
std::vector<double> find_open_shares(const TriMesh& mesh) {
    const std::size_t count = mesh.triangles.size();
    std::vector<double> open(count, 0.0), asked(count, 0.0);
    std::vector<Vec3> turned(mesh.vertices.size());
    TriangleTree tree;
    const double off_surface = 1e-7 * mesh.bounds().longest_edge();
    for (int i = 0; i < kDirections; ++i) {
        const Mat3 frame = frame_along(direction(i));
        std::transform(mesh.vertices.begin(), mesh.vertices.end(), turned.begin(), [&](const Vec3& v) { return Vec3(frame * v); });
        tree.build(turned, mesh.triangles);
        for (std::size_t t = 0; t < count; ++t) {
            const Vec3 &a = turned[mesh.triangles[t][0]], &b = turned[mesh.triangles[t][1]], &c = turned[mesh.triangles[t][2]];
            const Vec3 normal = (b - a).cross(c - a).normalized();
            if (!(std::abs(normal[0]) > kGrazing)) continue;
            asked[t] += 1.0;
            if (!tree.ray_meets_any((a + b + c) / 3.0 + off_surface * normal, 0, normal[0] > 0.0)) open[t] += 1.0;
        }
    }
    for (std::size_t t = 0; t < count; ++t) open[t] = asked[t] > 0.0 ? open[t] / asked[t] : 1.0;
    return open;
}

/// Of the triangles marked `value` only the largest connected part (by area) keeps the mark.
void keep_largest_mark(const TriMesh& mesh, std::vector<bool>& mark, bool value) {
    std::vector<Triangle> marked;
    std::vector<std::size_t> ids;
    for (std::size_t t = 0; t < mark.size(); ++t)
        if (mark[t] == value) marked.push_back(mesh.triangles[t]), ids.push_back(t);
    const Components parts = find_components(marked, mesh.vertices.size(), Joined::BySharedEdges);
    std::vector<double> areas(parts.count, 0.0);
    for (std::size_t i = 0; i < marked.size(); ++i) areas[parts.of_triangle[i]] += area(mesh, marked[i]);
    const auto largest = static_cast<Index>(std::max_element(areas.begin(), areas.end()) - areas.begin());
    for (std::size_t i = 0; i < marked.size(); ++i)
        if (parts.of_triangle[i] != largest) mark[ids[i]] = !value;
}

} // namespace

std::vector<bool> find_inner_skin(const TriMesh& shell) {
    std::vector<bool> inner(shell.triangles.size(), false);
    double total = 0.0;
    for (const Triangle& t : shell.triangles) total += area(shell, t);
    const double thickness = 2.0 * std::abs(signed_volume(shell)) / total;
    if (!(thickness < kThinSheet * shell.bounds().longest_edge())) return inner;
    TriMesh outward = shell; // lines start on the sheet's free side
    if (signed_volume(shell) < 0.0)
        for (Triangle& t : outward.triangles) std::swap(t[1], t[2]);
    const std::vector<double> open = find_open_shares(outward);
    double hidden = 0.0;
    for (std::size_t t = 0; t < inner.size(); ++t) {
        inner[t] = open[t] < kOpenShare;
        if (inner[t]) hidden += area(shell, shell.triangles[t]);
    }
    if (!(hidden > kLeastHidden * total && hidden < (1.0 - kLeastHidden) * total)) return std::vector<bool>(inner.size(), false);
    keep_largest_mark(shell, inner, false); // small outer parts inside the inner skin
    keep_largest_mark(shell, inner, true);  // folds of the outer skin with a low open share
    return inner;
}

} // namespace trocar::repairs
