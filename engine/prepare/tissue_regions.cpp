#include "engine/prepare/tissue_regions.hpp"

#include "engine/io/printable.hpp"
#include "engine/scene/describe_body.hpp"
#include "engine/scene/nearest.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace trocar::engine {

namespace {

constexpr std::size_t kMostListed = 12;
/// On average, at least: an array of another name that has fewer counts its cells.
constexpr std::size_t kCellsOfARegion = 2;

/// What arrays of regions are called, letters and digits alone: the first that is there is taken.
constexpr std::array kUsualNames{"region", "regions", "regionid", "material", "materials", "materialid", "materialids", "matid", "label", "labels",
                                 "labelid", "tissue", "tissueid", "domain", "domains", "subdomain", "part", "partid", "gmshphysical", "meditref",
                                 "tetgenref", "vegaregion", "cellentityids", "gmshgeometrical"};

std::string plain_name(std::string_view name) {
    std::string plain;
    for (const char c : name)
        if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'))
            plain += c;
        else if (c >= 'A' && c <= 'Z')
            plain += static_cast<char>(c - 'A' + 'a');
    return plain;
}

/// As the key "label" of a scene takes it.
bool is_label(double value) { return value == std::floor(value) && std::abs(value) <= kLargestLabel; }

/// Empty where the array has one integer for each cell.
std::string find_defect(const BesideTets& beside, const CellArray& array) {
    if (beside.cells > 0 && array.values.size() > beside.cells)
        return fmt::format("has {} values, and the file has {} cells; expected one for each cell", array.values.size(), beside.cells);
    for (const std::size_t place : beside.place_of_tet)
        if (place >= array.values.size())
            return fmt::format("has {} values, and the file has cell {}; expected one for each cell", array.values.size(), place);
    for (const std::size_t place : beside.place_of_tet)
        if (!is_label(array.values[place]))
            return fmt::format("has {} at cell {}; expected an integer from {} to {}, the label of the cell's region", array.values[place], place, -kLargestLabel, kLargestLabel);
    return {};
}

/// Of an array without a defect.
std::size_t count_labels(const BesideTets& beside, const CellArray& array) {
    std::vector<double> labels;
    labels.reserve(beside.place_of_tet.size());
    for (const std::size_t place : beside.place_of_tet) labels.push_back(array.values[place]);
    std::sort(labels.begin(), labels.end());
    return static_cast<std::size_t>(std::unique(labels.begin(), labels.end()) - labels.begin());
}

/// Names as a message shows them.
std::vector<std::string> shown_names(const BesideTets& beside) {
    std::vector<std::string> names;
    for (const CellArray& array : beside.arrays) names.push_back(printable(fmt::format("{:.60}", array.name)));
    return names;
}

Error no_array(std::string message) { return {ErrorCode::BadValue, std::move(message)}; }

Result<const CellArray*> choose_array(const BesideTets& beside) {
    std::vector<const CellArray*> fitting;
    for (const CellArray& array : beside.arrays)
        if (find_defect(beside, array).empty() && count_labels(beside, array) <= kMostRegions) fitting.push_back(&array);
    for (const char* usual : kUsualNames)
        for (const CellArray* array : fitting)
            if (plain_name(array->name) == usual) return array;
    if (fitting.size() == 1 && kCellsOfARegion * count_labels(beside, *fitting[0]) <= beside.place_of_tet.size()) return fitting[0];
    if (beside.arrays.empty()) return no_array("no cell array says which region a cell belongs to; expected one of integers");
    return no_array(fmt::format("none of the cell arrays {} is known to say which region a cell belongs to; expected one of integers to be named, by \"region_array\" of a scene or --regions of import",
                                fmt::join(shown_names(beside), ", ")));
}

Result<const CellArray*> find_array(const BesideTets& beside, std::string_view name) {
    if (name.empty()) return choose_array(beside);
    for (const CellArray& array : beside.arrays) {
        if (array.name != name) continue;
        if (const std::string defect = find_defect(beside, array); !defect.empty()) return no_array(fmt::format("the cell array \"{:.60}\" {}", name, defect));
        if (const std::size_t count = count_labels(beside, array); count > kMostRegions)
            return no_array(fmt::format("the cell array \"{:.60}\" has {} different labels; expected at most {}, one for each region", name, count, kMostRegions));
        return &array;
    }
    const std::vector<std::string> names = shown_names(beside);
    return no_array(refuse_unknown("cell array", name, std::vector<std::string_view>(names.begin(), names.end())));
}

double volume_of(const TetMesh& mesh, const Tet& t) {
    const Vec3& o = mesh.vertices[t[0]];
    return (mesh.vertices[t[1]] - o).dot((mesh.vertices[t[2]] - o).cross(mesh.vertices[t[3]] - o)) / 6.0;
}

/// "2 (tumour)": the nearest first, then all of them.
std::string list_labels(const std::vector<RegionSummary>& list, std::int64_t label) {
    const auto shown = [](const RegionSummary& region) {
        return region.name.empty() ? std::to_string(region.label) : fmt::format("{} ({})", region.label, printable(fmt::format("{:.40}", region.name)));
    };
    const auto distance = [label](const RegionSummary& region) { return std::abs(static_cast<double>(region.label) - static_cast<double>(label)); };
    const auto nearest = std::min_element(list.begin(), list.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
    std::vector<std::string> all;
    for (std::size_t k = 0; k < std::min(list.size(), kMostListed); ++k) all.push_back(shown(list[k]));
    if (list.size() > kMostListed) all.push_back(fmt::format("{} more", list.size() - kMostListed));
    return fmt::format("nearest label: {} (there are {})", shown(*nearest), fmt::join(all, ", "));
}

/// The region of the file that a scene's region means.
Result<RegionSummary*> find_region(const Scene& scene, const std::string& key, const std::string& file, const TissueRegion& region,
                                   const TetLabels& labels, std::vector<RegionSummary>& list) {
    if (region.label != TissueRegion::kNoLabel) {
        for (RegionSummary& known : list)
            if (known.label == region.label) return &known;
        return scene_error(scene, key + ".label", fmt::format("found {}, which no cell of {} has in its array \"{:.60}\"; {}", region.label, file, labels.array,
                                                              list_labels(list, region.label)));
    }
    std::vector<std::string_view> names;
    for (RegionSummary& known : list) {
        const auto named = labels.names.find(known.label);
        if (named == labels.names.end()) continue;
        if (named->second == region.name) return &known;
        names.push_back(named->second);
    }
    if (names.empty())
        return scene_error(scene, key, fmt::format("found no \"label\", and {} has no names for its labels; expected one; {}", file, list_labels(list, 0)));
    return scene_error(scene, key, fmt::format("found no \"label\" and {}", refuse_unknown("region of the file", region.name, names)));
}

/// [-] on the body's moduli. Exactly 1 for its own modulus.
double stiffness_factor(const TissueRegion& region, const fem::Material& material) {
    if (!(region.young_modulus > 0.0)) return 1.0;
    const bool of_young = material.law != fem::MaterialLaw::MooneyRivlin && material.law != fem::MaterialLaw::Ogden;
    return region.young_modulus / (of_young ? material.young_modulus : fem::find_small_strain(material).young_modulus());
}

double density_factor(const TissueRegion& region, const fem::Material& material) {
    return region.density > 0.0 ? region.density / material.density : 1.0;
}

bool all_one(const std::vector<double>& factors) {
    return std::all_of(factors.begin(), factors.end(), [](double factor) { return factor == 1.0; });
}

} // namespace

Result<TetLabels> find_tet_labels(const BesideTets& beside, std::string_view name) {
    const Result<const CellArray*> array = find_array(beside, name);
    if (!array.ok()) return array.error();
    TetLabels labels{(*array)->name, {}, (*array)->names};
    labels.of_tet.reserve(beside.place_of_tet.size());
    for (const std::size_t place : beside.place_of_tet) labels.of_tet.push_back(static_cast<std::int64_t>((*array)->values[place]));
    return labels;
}

std::vector<RegionSummary> measure_regions(const TetMesh& mesh, const TetLabels& labels) {
    std::map<std::int64_t, RegionSummary> by_label;
    for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
        RegionSummary& region = by_label[labels.of_tet[t]];
        ++region.tets;
        region.volume_m3 += volume_of(mesh, mesh.tets[t]);
    }
    std::vector<RegionSummary> list;
    for (auto& [label, region] : by_label) {
        region.label = label;
        if (const auto named = labels.names.find(label); named != labels.names.end()) region.name = named->second;
        list.push_back(std::move(region));
    }
    return list;
}

Result<TissueRegions> make_tissue_regions(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const BesideTets& beside) {
    TissueRegions made;
    const CoarseSpec& coarse = body.coarse;
    if (coarse.regions.empty()) return made;
    const std::string key = "bodies." + body.name + ".coarse", file = coarse.file.filename().string();
    const Result<TetLabels> labels = find_tet_labels(beside, coarse.region_array);
    if (!labels.ok())
        return scene_error(scene, key + (coarse.region_array.empty() ? ".regions" : ".region_array"), fmt::format("{}: {}", file, labels.error().message));
    made.array = labels->array;
    made.list = measure_regions(mesh, *labels);
    std::map<std::int64_t, std::array<double, 2>> factors; // of stiffness and density
    for (RegionSummary& region : made.list) {
        region.young_modulus = fem::find_small_strain(body.material).young_modulus();
        region.density = body.material.density;
        factors[region.label] = {1.0, 1.0};
    }
    for (const TissueRegion& region : coarse.regions) {
        const std::string own = key + ".regions." + region.name;
        const Result<RegionSummary*> found = find_region(scene, own, file, region, *labels, made.list);
        if (!found.ok()) return found.error();
        RegionSummary& known = **found;
        if (known.has_own_tissue)
            return scene_error(scene, own, fmt::format("found the label {} a second time, after {}; expected a region of the scene for each", known.label, known.name));
        const double stiffness = stiffness_factor(region, body.material), density = density_factor(region, body.material);
        factors[known.label] = {stiffness, density};
        known.name = region.name;
        known.has_own_tissue = true;
        known.young_modulus *= stiffness;
        known.density *= density;
    }
    for (const std::int64_t label : labels->of_tet) {
        made.stiffness.push_back(factors[label][0]);
        made.density.push_back(factors[label][1]);
    }
    if (all_one(made.stiffness)) made.stiffness.clear(); // then all bits are those of the body's one material
    if (all_one(made.density)) made.density.clear();
    return made;
}

} // namespace trocar::engine
