#include "engine/cli/import_outputs.hpp"

#include "engine/cli/progress.hpp"
#include "engine/cli/taken_files.hpp"
#include "engine/experiments/explain.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/printable.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/report/output_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>

namespace trocar::engine {

namespace {

constexpr std::size_t kShownEnds = 12; // outlets that the terminal lists

void print_vessel(const ImportedVessel& vessel, const ImportSource& source) {
    print_facts(source, vessel.repairs);
    fmt::print("surface    {} triangles, closed, manifold, no self-intersections\n", vessel.surface.triangles.size());
    const VesselEnd& inlet = vessel.ends[0];
    fmt::print("inlet      {}, radius {:.3g} mm at ({:.5g}, {:.5g}, {:.5g}) mm; entry at ({:.5g}, {:.5g}, {:.5g}) mm\n",
               inlet.open ? "open" : "closed end", 1e3 * inlet.radius, 1e3 * inlet.centre.x(), 1e3 * inlet.centre.y(), 1e3 * inlet.centre.z(),
               1e3 * vessel.entry.x(), 1e3 * vessel.entry.y(), 1e3 * vessel.entry.z());
    for (std::size_t e = 1; e < std::min(vessel.ends.size(), kShownEnds + 1); ++e)
        fmt::print("{:<10} {}, radius {:.3g} mm; target {:.4g} mm from the entry, narrowest radius on the way {:.3g} mm\n", vessel.ends[e].name,
                   vessel.ends[e].open ? "open" : vessel.ends[e].dome ? "sac" : "closed end", 1e3 * vessel.ends[e].radius, 1e3 * vessel.targets[e - 1].way,
                   1e3 * vessel.targets[e - 1].narrowest);
    if (vessel.ends.size() > kShownEnds + 1) fmt::print("           and {} more outlets, see import.json\n", vessel.ends.size() - 1 - kShownEnds);
    std::size_t points = 0;
    for (const CentrelineBranch& branch : vessel.branches) points += branch.points.size();
    fmt::print("centreline {} branches, {} points\n", vessel.branches.size(), points);
    fmt::print("instrument {}radius {:.3g} mm, follows {}\n", vessel.instrument.device.empty() ? "" : vessel.instrument.device + ", ", 1e3 * vessel.instrument.radius, vessel.targets[vessel.instrument.target].name);
}

} // namespace

void print_facts(const ImportSource& source, const std::vector<std::string>& repairs) {
    for (const auto& [key, value] : source.facts) fmt::print("{:<10} {}\n", key, printable(value));
    if (repairs.empty()) fmt::print("repair     none was needed\n");
    for (const std::string& repair : repairs) fmt::print("repair     {}\n", printable(repair));
}

Result<void> check_import_place(const ImportRequest& request, const std::filesystem::path& out, std::span<const std::filesystem::path> reads) {
    if (auto free = OutputFolder::check(out, request.force, reads); !free.ok()) return free;
    for (const char* name : {import_name::kScene, import_name::kSurface, import_name::kStl, import_name::kCentreline, import_name::kMarkups,
                             import_name::kReport, import_name::kExplain, import_name::kOrganSurface, import_name::kOrganTets})
        if (const std::filesystem::path file = out / name; !check_not_taken(file, reads, "--out").ok())
            return Error{ErrorCode::BadUsage, "is read, and an import may write it anew; expected another output folder", file.string(), 0, 0, "--out"};
    return {};
}

int end_import(const ImportRequest& request, const std::filesystem::path& out, const std::vector<const char*>& written) {
    if (const int tried = try_scene(request, out); tried != kExitFine) { // nothing stays that looks finished
        std::error_code ignored;
        for (const char* name : written) std::filesystem::remove(out / name, ignored);
        return tried;
    }
    fmt::print("scene {}\nto see it: trocar view {}\n", (out / import_name::kScene).string(), (out / import_name::kScene).string());
    return kExitFine;
}

int try_scene(const ImportRequest& request, const std::filesystem::path& out) {
    const std::filesystem::path file = out / import_name::kScene;
    std::error_code ignored;
    std::filesystem::remove(out / import_name::kExplain, ignored); // of an earlier import
    ProgressLine progress(!request.quiet);
    const Result<Scene> scene = read_scene(file);
    if (!scene.ok()) return report_error(scene.error());
    const auto prepared = make_prepared_scene(*scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());
    if (!request.explain) return kExitFine;
    std::string text;
    explain_scene(*scene, *prepared, [&](const std::string& part) { text += part; }, [&](const std::string& what) { progress.show(what); });
    progress.clear();
    const Result<void> written = write_file_atomically(out / import_name::kExplain, text);
    return written.ok() ? kExitFine : report_error(written.error());
}

int write_imported(const ImportedVessel& vessel, const ImportSource& source, const ImportRequest& request, const std::filesystem::path& out,
                   const std::string& scene_text) {
    const auto folder = OutputFolder::open(out, request.force);
    if (!folder.ok()) return report_error(folder.error());
    WrittenOutputs outputs;
    for (const Result<void>& written : write_vessel(vessel, source, out, scene_text)) outputs.note(written);
    if (!outputs.all_there()) return outputs.tell(out);
    print_vessel(vessel, source);
    for (const std::string& note : vessel.notes) report_notice(note);
    return end_import(request, out, {import_name::kSurface, import_name::kStl, import_name::kCentreline, import_name::kMarkups, import_name::kReport,
                                     import_name::kScene});
}

} // namespace trocar::engine
