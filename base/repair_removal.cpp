// What a surface measures, and how much of it a repair may take.
#include "base/repair.hpp"
#include "base/repair_steps.hpp"
#include "base/short_number.hpp"
#include "base/surface_area.hpp"
#include "base/topology.hpp"

#include <algorithm>
#include <cmath>

namespace trocar {
namespace {

/// Does every edge run as often one way as the other?
bool is_balanced(std::span<const EdgeUse> uses) {
    bool balanced = true;
    for_each_edge(uses, [&balanced](std::span<const EdgeUse> edge) {
        const auto forward = std::count_if(edge.begin(), edge.end(), [](const EdgeUse& use) { return use.forward; });
        balanced = balanced && 2 * static_cast<std::size_t>(forward) == edge.size();
    });
    return balanced;
}

constexpr double kRounding = 1e-9; // [-] of a share: sums in another order

/// Sum of the volumes of all parts, each counted positive: shells turned apart do not cancel.
double sum_of_shell_volumes(const TriMesh& mesh, const Components& parts) {
    std::vector<double> six_volumes(parts.count, 0.0);
    const Vec3 origin = mesh.triangles.empty() ? Vec3(Vec3::Zero()) : mesh.bounds().centre();
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        const auto& [a, b, c] = mesh.triangles[t];
        const Vec3 p = mesh.vertices[a] - origin, q = mesh.vertices[b] - origin, r = mesh.vertices[c] - origin;
        six_volumes[parts.of_triangle[t]] += p.dot(q.cross(r));
    }
    double sum = 0.0;
    for (const double six : six_volumes) sum += std::abs(six) / 6.0;
    return sum;
}

double share_lost(double before, double after) noexcept { return before > 0.0 ? std::max(0.0, (before - after) / before) : 0.0; }

/// Copies, and what lies inside what stays, are asked for by name and leave the body as it was.
bool is_bounded(Repair repair) noexcept { return repair != Repair::DropDuplicates && repair != Repair::DropInnerShells; }

std::string percent(double share) { return short_number(std::round(1e3 * share) / 10.0) + " %"; }

std::string change(const std::string& name, const std::string& before, const std::string& after, const std::string& unit) {
    return name + " " + (before == after ? before : before + " to " + after) + unit;
}

} // namespace

SurfaceMeasure measure_surface(const TriMesh& mesh) {
    SurfaceMeasure measure;
    const Components parts = find_components(mesh.triangles, mesh.vertices.size(), Joined::BySharedEdges);
    measure.triangles = mesh.triangles.size();
    measure.components = parts.count;
    measure.area = surface_area(mesh);
    if (!is_balanced(sorted_edge_uses(mesh.triangles))) return measure;
    measure.volume = signed_volume(mesh);
    measure.shell_volumes = sum_of_shell_volumes(mesh, parts);
    return measure;
}

std::string describe_change(const SurfaceMeasure& before, const SurfaceMeasure& after) {
    const auto volume = [](const SurfaceMeasure& m) { return m.volume ? short_number(1e9 * *m.volume) : std::string("open"); };
    return change("area", short_number(1e6 * before.area), short_number(1e6 * after.area), " mm^2, ") +
           change("volume", volume(before), volume(after), after.volume ? " mm^3, " : ", ") +
           change("components", std::to_string(before.components), std::to_string(after.components), "");
}

namespace repairs {

Result<void> check_removal(const RepairStep& step, const RepairOptions& options) {
    const SurfaceMeasure &before = step.before, &after = step.after;
    double area = 0.0, volume = 0.0;
    if (is_bounded(step.repair)) {
        area = share_lost(before.area, after.area);
        if (before.volume && after.volume) volume = share_lost(before.shell_volumes, after.shell_volumes);
    }
    const double worst = std::max(area, volume);
    const bool removes = worst > options.may_remove + kRounding;
    const bool splits = after.components > before.components && !options.may_split;
    if (!removes && !splits) return {};
    std::string message = std::string(repair_name(step.repair)) + " would remove " + percent(area) + " of the area" +
                          (before.volume && after.volume ? " and " + percent(volume) + " of the volume" : std::string()) +
                          (splits ? ", and leave more parts than there were" : "") + ": " + describe_change(before, after) +
                          ", triangles " + std::to_string(before.triangles) + " to " + std::to_string(after.triangles) +
                          "; expected at most " + percent(options.may_remove) + " and no part split; ";
    const double enough = std::min(1.0, std::ceil(100.0 * worst) / 100.0);
    if (removes) message += std::string(options.may_remove_key) + " " + short_number(enough) + (splits ? " and " : "");
    if (splits) message += options.may_split_key;
    return Error{ErrorCode::BadMesh, message + (removes && splits ? " allow it" : " allows it")};
}

} // namespace repairs
} // namespace trocar
