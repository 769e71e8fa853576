#include "engine/importing/import_organ.hpp"

#include "base/topology.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/mesh_path.hpp"
#include "engine/io/printable.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/weld.hpp"
#include "engine/io/write_mesh.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

namespace trocar::engine {

namespace {

using Ordered = nlohmann::ordered_json;

/// Degrees: below it a tetrahedron is flat enough to shrink the stable step of the whole organ.
constexpr double kFlatDegrees = 5.0;

/// Degrees, smallest angle between two faces of a tetrahedron.
double smallest_angle(const TetMesh& mesh, const Tet& t) {
    std::array<Vec3, 4> normal; // outward, of the face across from each node
    for (std::size_t k = 0; k < 4; ++k) {
        const Vec3 &a = mesh.vertices[t[(k + 1) % 4]], &b = mesh.vertices[t[(k + 2) % 4]], &c = mesh.vertices[t[(k + 3) % 4]];
        normal[k] = (b - a).cross(c - a).normalized();
        if (normal[k].dot(mesh.vertices[t[k]] - a) > 0.0) normal[k] = -normal[k];
    }
    double largest_cosine = -1.0;
    for (std::size_t i = 0; i < 4; ++i)
        for (std::size_t k = i + 1; k < 4; ++k) largest_cosine = std::max(largest_cosine, -normal[i].dot(normal[k]));
    return std::acos(std::clamp(largest_cosine, -1.0, 1.0)) * 180.0 / std::numbers::pi;
}

Result<void> check_tets(const TetMesh& mesh, std::vector<std::string>& quality) {
    const TetMeshReport report = inspect_tets(mesh);
    const auto bad = [&](std::size_t count, const char* what) {
        std::string which;
        for (const Index t : report.bad_tets) which += (which.empty() ? "" : ", ") + std::to_string(t);
        return Error{ErrorCode::BadMesh, fmt::format("{} tetrahedra {}; first bad ones: {}; expected none: mesh it anew, or import the surface alone", count,
                                                     what, which)};
    };
    if (report.inverted_tets > 0) return bad(report.inverted_tets, "are inverted");
    if (report.flat_tets > 0) return bad(report.flat_tets, "have no volume");
    if (report.duplicate_tets > 0) return bad(report.duplicate_tets, "stand twice");
    if (report.overused_faces > 0) return bad(report.overused_faces, "share a face with two others");
    double least = 180.0;
    std::size_t flat = 0;
    for (const Tet& t : mesh.tets) {
        const double angle = smallest_angle(mesh, t);
        least = std::min(least, angle);
        flat += angle < kFlatDegrees;
    }
    quality.push_back(fmt::format("{} nodes, {} tetrahedra in {} parts, {:.6g} mm^3, smallest dihedral angle {:.2f} degrees, {} tetrahedra below {:g}",
                                  report.nodes - report.unreferenced_nodes, report.tets, report.components, 1e9 * report.volume, least, flat, kFlatDegrees));
    return {};
}

std::string numbers(const Vec3& v) { return fmt::format("[{:.6g}, {:.6g}, {:.6g}]", v.x(), v.y(), v.z()); }

std::string quoted_name(const std::string& text) { return Ordered(text).dump(-1, ' ', false, Ordered::error_handler_t::replace); }

std::string organ_report_text(const ImportedOrgan& organ, const ImportSource& source) {
    Ordered json;
    json["source"] = source.file;
    for (const auto& [key, value] : source.facts) json[key] = value;
    json["repairs"] = organ.repairs;
    json["quality"] = organ.quality;
    json["surface"] = {{"file", import_name::kOrganSurface}, {"triangles", organ.surface.triangles.size()}, {"volume_mm3", 1e9 * signed_volume(organ.surface)}};
    json["tets"] = organ.tets ? Ordered(organ.tets->tets.size()) : Ordered();
    json["regions"] = Ordered::array();
    for (const RegionSummary& region : organ.regions)
        json["regions"].push_back({{"name", region.name}, {"label", region.label}, {"array", organ.labels.array}, {"tets", region.tets}, {"volume_mm3", 1e9 * region.volume_m3}});
    return json.dump(2, ' ', false, Ordered::error_handler_t::replace) + "\n";
}

/// Which tetrahedra belong to which region, where the file says so.
Result<void> take_labels(const BesideTets& beside, const std::string& region_array, OrganInput& input) {
    Result<TetLabels> labels = find_tet_labels(beside, region_array);
    if (!labels.ok() && !region_array.empty()) return labels.error();
    if (!labels.ok() && !beside.arrays.empty()) input.labels_note = labels.error().message;
    if (!labels.ok()) return {};
    const std::vector<std::int64_t>& of_tet = labels->of_tet;
    const bool several = std::adjacent_find(of_tet.begin(), of_tet.end(), std::not_equal_to<>()) != of_tet.end();
    if (!several && !region_array.empty()) input.labels_note = fmt::format("all cells have the label {} of {}: one region", of_tet.front(), printable(labels->array));
    if (several) input.labels = std::move(*labels);
    return {};
}

/// The tetrahedra with their cell arrays. Where those cannot be read, and none is named, without them: then a note says why.
Result<TetMesh> read_organ_tets(const std::filesystem::path& file, const std::string& region_array, BesideTets& beside, std::string& note) {
    beside.with_arrays = true;
    Result<TetMesh> tets = read_tets(file, &beside);
    if (tets.ok() || !region_array.empty()) return tets;
    beside.with_arrays = false;
    Result<TetMesh> plain = read_tets(file, &beside);
    if (plain.ok()) note = fmt::format("the cell arrays are left out, since they cannot be read: {}", tets.error().to_string());
    return plain;
}

/// Names as keys of a scene: letters, digits, - and _, each once. The first region of a name keeps it.
void name_regions(std::vector<RegionSummary>& regions) {
    std::set<std::string> names;
    std::vector<RegionSummary*> doubled;
    for (RegionSummary& region : regions) {
        region.name = region.name.empty() ? fmt::format("region_{}", region.label) : safe_file_name(region.name);
        if (!names.insert(region.name).second) doubled.push_back(&region);
    }
    for (RegionSummary* region : doubled) {
        std::string name = fmt::format("{:.40}_{}", region->name, region->label);
        for (int again = 2; !names.insert(name).second; ++again) name = fmt::format("{:.40}_{}_{}", region->name, region->label, again);
        region->name = name;
    }
}

/// The organ's own stiffness and density, kPa and kg/m^3: a soft liver's.
constexpr double kYoung = 8.0, kDensity = 1060.0;

/// Regions are written with the organ's own material, to be changed there.
std::string coarse_text(const ImportedOrgan& organ) {
    if (!organ.tets) return "{\"mesher\": \"lattice\", \"surface_triangles\": 800}";
    std::string text = fmt::format("{{\"file\": \"{}\", \"unit\": \"mm\"", import_name::kOrganTets);
    if (organ.regions.empty()) return text + "}";
    text += fmt::format(", \"region_array\": \"{}\", \"regions\": {{", import_name::kRegionArray);
    for (std::size_t k = 0; k < organ.regions.size(); ++k)
        text += fmt::format("{}\n                \"{}\": {{\"label\": {}, \"young_modulus\": {:g}, \"density\": {:g}}}", k > 0 ? "," : "", organ.regions[k].name,
                            organ.regions[k].label, kYoung, kDensity);
    return text + "\n            }}";
}

} // namespace

std::string describe_region(const RegionSummary& region) {
    return fmt::format("{} (label {}): {} tetrahedra, {:.6g} mm^3", region.name, region.label, region.tets, 1e9 * region.volume_m3);
}

Result<OrganInput> read_organ(const std::filesystem::path& file, const std::string& region_array) {
    const std::string extension = mesh_extension(file);
    constexpr std::array kVolumes{".msh", ".vtu", ".mesh", ".node", ".ele", ".veg"};
    const bool volume = std::find(kVolumes.begin(), kVolumes.end(), extension) != kVolumes.end();
    OrganInput input;
    std::string no_tets; // why a .vtk file gives none
    if (volume || extension == ".vtk") {
        BesideTets beside;
        Result<TetMesh> tets = read_organ_tets(file, region_array, beside, input.labels_note);
        if (tets.ok()) {
            if (const Result<void> labels = take_labels(beside, region_array, input); !labels.ok()) return labels.error();
            input.split = describe_split(beside.split);
            drop_unreferenced_nodes(*tets);
            input.surface = boundary_surface(*tets);
            drop_unreferenced_vertices(input.surface);
            input.tets = std::move(*tets);
            return input;
        }
        if (volume || !region_array.empty()) return tets.error();
        no_tets = tets.error().message;
    }
    ReadOptions reading;
    reading.weld = true;
    Result<TriMesh> surface = read_surface(file, reading);
    if (!surface.ok()) {
        Error error = surface.error();
        if (!no_tets.empty() && no_tets != error.message) error.message += "; as tetrahedra: " + no_tets;
        return error;
    }
    input.surface = std::move(*surface);
    if (!region_array.empty())
        return Error{ErrorCode::BadValue, fmt::format("found the array \"{:.60}\" for a surface, which has no regions; expected a file of tetrahedra, or it left out", region_array)};
    return input;
}

Result<ImportedOrgan> import_organ(OrganInput input, double scale, MendMode mode, const OrganHold& hold) {
    ImportedOrgan organ;
    organ.hold = hold;
    for (Vec3& v : input.surface.vertices) v *= scale;
    if (input.tets) {
        for (Vec3& v : input.tets->vertices) v *= scale;
        if (!input.split.empty()) organ.quality.push_back(input.split);
        if (const Result<void> good = check_tets(*input.tets, organ.quality); !good.ok()) return good.error();
        organ.tets = std::move(input.tets);
        organ.labels = std::move(input.labels);
        organ.labels_note = std::move(input.labels_note);
        if (!organ.labels.of_tet.empty()) organ.regions = measure_regions(*organ.tets, organ.labels);
        name_regions(organ.regions);
    }
    Result<MendedVessel> mended = mend_organ(std::move(input.surface), mode);
    if (!mended.ok()) return mended.error();
    organ.surface = std::move(mended->surface);
    organ.repairs = std::move(mended->repairs);
    return organ;
}

std::string organ_scene_text(const ImportedOrgan& organ, const ImportSource& source) {
    const Vec3 down = -9810.0 * organ.hold.direction.normalized(); // it hangs from what is held
    return fmt::format(
        "{{\n    \"name\": {},\n    \"units\": {{\"length\": \"mm\", \"pressure\": \"kPa\"}},\n    \"time\": {{\"step\": 0.01, \"duration\": 3}},\n"
        "    \"budget\": {{\"limit\": \"10ms\"}},\n    \"gravity\": {},\n    \"bodies\": {{\n        \"organ\": {{\n            \"kind\": \"deformable\",\n"
        "            \"surface\": {{\"file\": \"{}\", \"unit\": \"mm\"}},\n"
        "            \"material\": {{\"law\": \"neo_hookean\", \"young_modulus\": {:g}, \"poisson_ratio\": 0.45, \"density\": {:g}, \"viscosity\": 0.001, "
        "\"mass_damping\": 5}},\n"
        "            \"coarse\": {},\n            \"fixed\": [{{\"direction\": {}, \"fraction\": {:.6g}}}]\n        }}\n    }},\n"
        "    \"effects\": [\"elasticity\", \"gravity\", \"damping\"],\n    \"outputs\": {{\"pictures\": 2}}\n}}\n",
        quoted_name(source.name), numbers(down), import_name::kOrganSurface, kYoung, kDensity, coarse_text(organ), numbers(organ.hold.direction), organ.hold.fraction);
}

std::vector<Result<void>> write_organ(const ImportedOrgan& organ, const ImportSource& source, const std::filesystem::path& folder) {
    TriMesh surface = organ.surface;
    for (Vec3& v : surface.vertices) v *= 1e3;
    std::vector<Result<void>> written{write_vtp(folder / import_name::kOrganSurface, surface)};
    if (organ.tets) {
        TetMesh tets = *organ.tets;
        for (Vec3& v : tets.vertices) v *= 1e3;
        const std::vector<double> labels(organ.labels.of_tet.begin(), organ.labels.of_tet.end());
        std::vector<DataArray> cells;
        if (!labels.empty()) cells.push_back({import_name::kRegionArray, 1, labels});
        written.push_back(write_vtu(folder / import_name::kOrganTets, tets, {{}, cells}));
    }
    written.push_back(write_file_atomically(folder / import_name::kReport, organ_report_text(organ, source)));
    written.push_back(write_file_atomically(folder / import_name::kScene, organ_scene_text(organ, source)));
    return written;
}

} // namespace trocar::engine
