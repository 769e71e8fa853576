#include "engine/importing/vessel_files.hpp"

#include "base/repair.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/markups.hpp"
#include "engine/io/write_mesh.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

using Ordered = nlohmann::ordered_json;

/// s, of the scene: what the way takes at the follower's speed, with patience for forks, within these bounds.
constexpr double kPatience = 1.5, kShortest = 5.0, kLongest = 60.0; // -, s, s

std::string quoted(const std::string& text) { return Ordered(text).dump(-1, ' ', false, Ordered::error_handler_t::replace); }

/// A length in mm, as short as 1e-6 mm allows.
std::string mm(double metres) { return fmt::format("{:.9g}", std::round(metres * 1e9) / 1e6); }
std::string mm(const Vec3& p) { return fmt::format("[{}, {}, {}]", mm(p.x()), mm(p.y()), mm(p.z())); }

double duration_of(const ImportedVessel& vessel) {
    const double way = vessel.targets[vessel.instrument.target].way;
    return std::ceil(std::clamp(kPatience * way / vessel.instrument.speed, kShortest, kLongest));
}

Ordered point_json(const Vec3& p) { return {1e3 * p.x(), 1e3 * p.y(), 1e3 * p.z()}; }

/// [branch] the lines from the inlet that it lies on begin with this end; and how many branches lie before it.
std::vector<double> count_tracts(std::span<const CentrelineBranch> branches) {
    std::vector<double> tract(branches.size(), 0.0);
    for (std::size_t b = 0; b < branches.size(); ++b)
        for (Index at = branches[b].parent; at != kNoIndex; at = branches[at].parent) tract[b] += 1.0;
    return tract;
}

/// [branch] the first of the centrelines, numbered by the branches that end, that runs through it.
std::vector<double> first_centrelines(std::span<const CentrelineBranch> branches) {
    std::vector<double> first(branches.size(), -1.0);
    double line = 0.0;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        if (!branches[b].ends) continue;
        for (auto at = static_cast<Index>(b); at != kNoIndex; at = branches[at].parent)
            if (first[at] < 0.0) first[at] = line;
        line += 1.0;
    }
    return first;
}

std::vector<Markup> branch_markups(std::span<const CentrelineBranch> branches) {
    std::vector<Markup> markups;
    for (std::size_t b = 0; b < branches.size(); ++b)
        markups.push_back({"Curve", fmt::format("branch {}", b), branches[b].points, branches[b].radii, {}});
    return markups;
}

Markup end_markup(const ImportedVessel& vessel) {
    Markup ends;
    ends.type = "Fiducial";
    ends.name = "inlets, outlets and targets";
    for (const VesselEnd& end : vessel.ends) {
        ends.points.push_back(end.centre);
        ends.labels.push_back(end.name);
    }
    for (const VesselTarget& target : vessel.targets) {
        ends.points.push_back(target.position);
        ends.labels.push_back("target " + target.name);
    }
    return ends;
}

Ordered ends_json(const ImportedVessel& vessel) {
    Ordered list = Ordered::array();
    for (std::size_t e = 0; e < vessel.ends.size(); ++e) {
        const VesselEnd& end = vessel.ends[e];
        Ordered json{{"name", end.name}, {"kind", e == 0 ? "inlet" : "outlet"}, {"was_open", end.open}, {"sac", end.dome}, {"centre_mm", point_json(end.centre)},
                     {"inward", {end.inward.x(), end.inward.y(), end.inward.z()}}, {"radius_mm", 1e3 * end.radius},
                     {"branch", vessel.end_branch[e]}};
        if (e > 0) {
            const VesselTarget& target = vessel.targets[e - 1];
            json["target_mm"] = point_json(target.position);
            json["way_mm"] = 1e3 * target.way;
            json["narrowest_radius_mm"] = 1e3 * target.narrowest;
        }
        list.push_back(std::move(json));
    }
    return list;
}

Ordered branches_json(const ImportedVessel& vessel) {
    Ordered list = Ordered::array();
    for (std::size_t b = 0; b < vessel.branches.size(); ++b) {
        const CentrelineBranch& branch = vessel.branches[b];
        double length = 0.0;
        for (std::size_t i = 1; i < branch.points.size(); ++i) length += (branch.points[i] - branch.points[i - 1]).norm();
        const auto [least, most] = std::minmax_element(branch.radii.begin(), branch.radii.end());
        list.push_back({{"id", b},
                        {"parent", branch.parent == kNoIndex ? Ordered() : Ordered(branch.parent)},
                        {"points", branch.points.size()},
                        {"length_mm", 1e3 * length},
                        {"least_radius_mm", 1e3 * *least},
                        {"most_radius_mm", 1e3 * *most},
                        {"ends", branch.ends}});
    }
    return list;
}

/// What an instrument is, as keys of a scene: a device of the catalogue, or numbers.
std::string design_text(const FittingInstrument& fit) {
    if (!fit.device.empty())
        return fmt::format("            \"device\": \"{}\",\n            \"length\": {},\n", fit.device, mm(fit.length));
    return fmt::format("            \"length\": {},\n            \"radius\": {},\n            \"young_modulus\": 60,\n"
                       "            \"tip\": {{\"shape\": \"J\", \"length\": {}, \"angle\": {:.3g}, \"stiffness\": 0.3}},\n",
                       mm(fit.length), mm(fit.radius), mm(fit.tip_length), fit.tip_angle);
}

} // namespace

std::string vessel_scene_text(const ImportedVessel& vessel, const ImportSource& source) {
    const FittingInstrument& fit = vessel.instrument;
    std::string targets;
    for (const VesselTarget& target : vessel.targets)
        targets += fmt::format("{}\n        {}: {{\"position\": {}}}", targets.empty() ? "" : ",", quoted(target.name), mm(target.position));
    return fmt::format(
        "{{\n    \"name\": {},\n    \"units\": {{\"length\": \"mm\", \"pressure\": \"MPa\"}},\n"
        "    \"time\": {{\"step\": 0.01, \"duration\": {:g}}},\n    \"budget\": {{\"limit\": \"10ms\"}},\n    \"bodies\": {{\n"
        "        \"vessel\": {{\"kind\": \"static\", \"hollow\": true, \"surface\": {{\"file\": \"{}\", \"unit\": \"mm\"}}}}\n    }},\n"
        "    \"instruments\": {{\n        \"{}\": {{\n{}            \"segment\": {},\n            \"skin_triangles\": 6000,\n            \"inserted\": {},\n"
        "            \"entry\": {{\"position\": {}, \"direction\": [{:.6g}, {:.6g}, {:.6g}]}},\n            \"lumen\": \"vessel\",\n"
        "            \"follow\": {{\"target\": {}, \"speed\": {:.3g}, \"look_ahead\": {}, \"tolerance\": {}}}\n        }}\n    }},\n    \"targets\": {{{}\n    }},\n"
        "    \"effects\": [\"coarse_contact\", \"exact_contact\", \"friction\"],\n    \"outputs\": {{\"pictures\": 2}}\n}}\n",
        quoted(source.name), duration_of(vessel), import_name::kSurface, fit.device.empty() ? "catheter" : fit.device, design_text(fit),
        mm(fit.segment), mm(fit.inserted), mm(vessel.entry), vessel.direction.x(), vessel.direction.y(), vessel.direction.z(),
        quoted(vessel.targets[fit.target].name), 1e3 * fit.speed, mm(fit.tip_length), mm(fit.tolerance), targets);
}

std::string vessel_report_text(const ImportedVessel& vessel, const ImportSource& source) {
    const SurfaceMeasure measure = measure_surface(vessel.surface);
    Ordered json;
    json["source"] = source.file;
    for (const auto& [key, value] : source.facts) json[key] = value;
    json["repairs"] = vessel.repairs;
    json["surface_was_sound"] = vessel.was_sound;
    json["notes"] = vessel.notes;
    json["surface"] = {{"file", import_name::kSurface},
                       {"triangles", measure.triangles},
                       {"area_mm2", 1e6 * measure.area},
                       {"volume_mm3", 1e9 * measure.volume.value_or(0.0)},
                       {"closed", true},
                       {"manifold", true},
                       {"self_intersections", 0}};
    json["entry"] = {{"position_mm", point_json(vessel.entry)}, {"direction", {vessel.direction.x(), vessel.direction.y(), vessel.direction.z()}}};
    json["ends"] = ends_json(vessel);
    json["branches"] = branches_json(vessel);
    return json.dump(2, ' ', false, Ordered::error_handler_t::replace) + "\n";
}

Result<void> write_centreline_vtp(const std::filesystem::path& path, std::span<const CentrelineBranch> branches) {
    std::vector<Vec3> points;
    std::vector<double> radii, groups;
    const std::vector<double> tracts = count_tracts(branches), blanking(branches.size(), 0.0), lines_of = first_centrelines(branches);
    std::vector<std::vector<Index>> lines;
    for (std::size_t b = 0; b < branches.size(); ++b) {
        std::vector<Index> line;
        for (std::size_t i = 0; i < branches[b].points.size(); ++i) {
            line.push_back(static_cast<Index>(points.size()));
            points.push_back(1e3 * branches[b].points[i]);
            radii.push_back(1e3 * branches[b].radii[i]);
        }
        lines.push_back(std::move(line));
        groups.push_back(static_cast<double>(b));
    }
    const DataArray of_points[] = {{"MaximumInscribedSphereRadius", 1, radii}};
    const DataArray of_lines[] = {{"GroupIds", 1, groups}, {"CenterlineIds", 1, lines_of}, {"TractIds", 1, tracts}, {"Blanking", 1, blanking}};
    return write_vtp_lines(path, points, lines, {of_points, of_lines});
}

std::vector<Result<void>> write_vessel(const ImportedVessel& vessel, const ImportSource& source, const std::filesystem::path& folder,
                                       const std::string& scene_text) {
    TriMesh surface = vessel.surface;
    for (Vec3& v : surface.vertices) v *= 1e3;
    std::vector<Markup> markups = branch_markups(vessel.branches);
    markups.push_back(end_markup(vessel));
    return {write_vtp(folder / import_name::kSurface, surface),
            write_stl(folder / import_name::kStl, surface),
            write_centreline_vtp(folder / import_name::kCentreline, vessel.branches),
            write_markups(folder / import_name::kMarkups, markups),
            write_file_atomically(folder / import_name::kReport, vessel_report_text(vessel, source)),
            write_file_atomically(folder / import_name::kScene, scene_text.empty() ? vessel_scene_text(vessel, source) : scene_text)};
}

} // namespace trocar::engine
