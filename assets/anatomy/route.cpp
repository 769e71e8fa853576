#include "assets/anatomy/route.hpp"

#include "assets/anatomy/curves.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace trocar::anatomy {
namespace {

constexpr double kBendWindow = 0.003; // m, bends shorter than two of these are below what a catheter feels

std::vector<Index> nodes_to(const Centreline& line, Index target, Index entry) {
    std::vector<Index> nodes;
    for (Index n = target; n != kNoIndex; n = line.parent[n]) {
        nodes.push_back(n);
        if (n == entry) break;
    }
    std::reverse(nodes.begin(), nodes.end());
    return nodes;
}

Result<std::vector<Index>> route_nodes(const Anatomy& anatomy, std::string_view target) {
    const auto& named = anatomy.centreline.named;
    const auto entry = named.find("femoral_entry"), found = named.find(target);
    if (entry == named.end() || found == named.end()) {
        std::string known;
        for (const auto& [name, node] : named) {
            if (!known.empty()) known += ", ";
            known += name;
        }
        return Error{ErrorCode::BadValue, "no landmark '" + std::string(target) + "'; there are: " + known};
    }
    return nodes_to(anatomy.centreline, found->second, entry->second);
}

std::string surface_line(const char* name, const TriMesh& mesh) {
    const Vec3 size = 1e3 * mesh.bounds().extent();
    char text[160];
    std::snprintf(text, sizeof text, "%-8s %7zu vertices %7zu triangles, %.0f x %.0f x %.0f mm\n", name, mesh.vertices.size(),
                  mesh.triangles.size(), size[0], size[1], size[2]);
    return text;
}

} // namespace

Result<Route> find_route(const Anatomy& anatomy, std::string_view target) {
    const auto nodes = route_nodes(anatomy, target);
    if (!nodes) return nodes.error();
    Route route;
    for (const Index n : *nodes) {
        route.points.push_back(anatomy.centreline.points[n]);
        route.radii.push_back(anatomy.centreline.radii[n]);
    }
    return route;
}

Result<RouteReport> inspect_route(const Anatomy& anatomy, std::string_view target) {
    const auto nodes = route_nodes(anatomy, target);
    if (!nodes) return nodes.error();
    const Route route = *find_route(anatomy, target);
    RouteReport report;
    report.target = target;
    report.straight_distance = (route.points.back() - route.points.front()).norm();
    report.min_radius = *std::min_element(route.radii.begin(), route.radii.end());
    report.length = arc_lengths(route.points).back();
    if (route.points.size() < 3) return report;
    const std::vector<double> bends = curvature_radii(route.points, kBendWindow);
    report.min_curvature_radius = *std::min_element(bends.begin(), bends.end());
    for (std::size_t i = 1; i + 1 < route.points.size(); ++i) {
        const Vec3 in = route.points[i] - route.points[i - 1], out = route.points[i + 1] - route.points[i];
        report.total_turn += std::atan2(in.cross(out).norm(), in.dot(out));
    }
    for (std::size_t i = 1; i < nodes->size(); ++i)
        report.forks += anatomy.centreline.branch[(*nodes)[i]] != anatomy.centreline.branch[(*nodes)[i - 1]];
    return report;
}

std::string summarise(const Anatomy& anatomy) {
    std::string text = surface_line("liver", anatomy.liver) + surface_line("lumen", anatomy.lumen);
    text += "route          length  straight  min radius  sharpest bend  turns  forks   (mm, rad)\n";
    for (const Landmark& l : anatomy.landmarks) {
        const auto r = inspect_route(anatomy, l.name);
        if (!r || l.name == "femoral_entry") continue;
        char line[160];
        std::snprintf(line, sizeof line, "%-14s %6.1f  %8.1f  %10.2f  %13.1f  %5.1f  %5d\n", l.name.c_str(), 1e3 * r->length,
                      1e3 * r->straight_distance, 1e3 * r->min_radius, 1e3 * r->min_curvature_radius, r->total_turn, r->forks);
        text += line;
    }
    return text;
}

} // namespace trocar::anatomy
