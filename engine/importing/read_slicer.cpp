#include "engine/importing/curve_set.hpp"
#include "engine/importing/folder_files.hpp"
#include "engine/io/markups.hpp"
#include "engine/io/read_lines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace trocar::engine {

Result<CurveSet> read_slicer(const std::filesystem::path& path) {
    const auto files = list_files(path, ".mrk.json");
    if (!files.ok()) return files.error();
    CurveSet set;
    set.files = *files;
    std::size_t other = 0;
    for (const std::filesystem::path& file : *files) {
        const Result<std::vector<Markup>> markups = read_markups(file);
        if (!markups.ok()) return markups.error();
        for (const Markup& markup : *markups) {
            if (markup.type == "ClosedCurve")
                return Error{ErrorCode::BadValue, "a closed curve is no vessel's centreline; expected type Curve", file.string(), 0, 0, "markups.type"};
            if (markup.type != "Curve") {
                ++other;
                continue;
            }
            if (markup.radii.empty())
                return Error{ErrorCode::BadValue, "the curve has no radii; expected a measurement named Radius with a number per control point",
                             file.string(), 0, 0, "markups.measurements"};
            if (markup.points.size() < 2)
                return Error{ErrorCode::BadValue, fmt::format("the curve has {} points; expected two or more", markup.points.size()), file.string(), 0, 0,
                             "markups.controlPoints"};
            const std::string name = file.filename().string();
            set.curves.push_back({markup.name.empty() ? name.substr(0, name.find(".mrk.json")) : markup.name, markup.points, markup.radii});
        }
    }
    if (set.curves.empty()) return Error{ErrorCode::BadValue, fmt::format("holds no curve among {} markups", other), path.string()};
    set.facts.emplace_back("frame", "right, anterior, superior (RAS), mm; what lay in LPS is turned");
    set.facts.emplace_back("markups", fmt::format("{} curves of {} files, {} other markups passed over", set.curves.size(), files->size(), other));
    return set;
}

Result<CurveSet> read_vmtk(const std::filesystem::path& path) {
    const Result<LineMesh> lines = read_centreline_lines(path);
    if (!lines.ok()) return lines.error();
    if (lines->radii.empty())
        return Error{ErrorCode::BadValue, "has no point data MaximumInscribedSphereRadius; expected VMTK's centreline", path.string()};
    CurveSet set;
    set.files = {path};
    std::set<double> groups;
    std::size_t again = 0;
    for (std::size_t l = 0; l < lines->lines.size(); ++l) {
        if (lines->lines[l].size() < 2) continue;
        if (!lines->groups.empty() && !groups.insert(lines->groups[l]).second) {
            ++again;
            continue;
        }
        NamedCurve curve{fmt::format("line {}", l), {}, {}};
        for (const Index p : lines->lines[l]) {
            curve.points.push_back(1e-3 * lines->points[p]);
            curve.radii.push_back(1e-3 * lines->radii[p]);
        }
        set.curves.push_back(std::move(curve));
    }
    if (set.curves.empty()) return Error{ErrorCode::BadValue, "holds no line of two or more points", path.string()};
    set.facts.emplace_back("unit", "mm, as VMTK's centrelines of clinical data have");
    set.facts.emplace_back("lines", fmt::format("{} lines, {} more of groups that stand again", set.curves.size(), again));
    return set;
}

} // namespace trocar::engine
