// Imports of users' anatomy, each measured: repairs, what the surface is afterwards, how far it went from the input, the centreline's radii
// against known ones, and whether the scene runs and is planned as it was written.
#include "bench/import_phantoms.hpp"
#include "bench/tables.hpp"
#include "base/repair.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"
#include "engine/experiments/plan.hpp"
#include "engine/experiments/plan_scene.hpp"
#include "engine/importing/import_organ.hpp"
#include "engine/importing/import_segmentation.hpp"
#include "engine/importing/import_vessel.hpp"
#include "engine/importing/rebuild_surface.hpp"
#include "engine/importing/unit_guess.hpp"
#include "engine/importing/vessel_files.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace trocar::engine {

namespace {

namespace fs = std::filesystem;

constexpr unsigned kImportSteps = 300;

/// A folder that goes away.
class ImportScratch {
public:
    ImportScratch() {
        std::string name = (fs::temp_directory_path() / "trocar-bench-import-XXXXXX").string();
        if (mkdtemp(name.data()) != nullptr) path_ = name;
    }
    ImportScratch(const ImportScratch&) = delete;
    ImportScratch& operator=(const ImportScratch&) = delete;
    ~ImportScratch() {
        std::error_code ignored;
        if (!path_.empty()) fs::remove_all(path_, ignored);
    }
    [[nodiscard]] const fs::path& path() const noexcept { return path_; }

private:
    fs::path path_;
};

void describe_surface(BenchRow& row, const TriMesh& surface) {
    const SurfaceReport report = inspect_surface(surface);
    row["triangles"] = surface.triangles.size();
    row["closed"] = report.closed();
    row["manifold"] = report.manifold();
    row["self_intersections"] = find_self_intersections(surface, 0).count;
}

/// 300 steps of the scene as it was written, and a plan to the target that it follows.
void run_written(BenchRow& row, const fs::path& scene_file, const std::string& target) {
    Result<Scene> scene = read_scene(scene_file);
    if (!scene.ok()) {
        row["runs"] = scene.error().to_string();
        return;
    }
    scene->budget.limits.mode = BudgetMode::Exact;
    auto prepared = make_prepared_scene(*scene);
    if (!prepared.ok()) {
        row["runs"] = prepared.error().to_string();
        return;
    }
    Simulator simulator(prepared->model);
    std::size_t exits = 0;
    bool finite = true;
    for (unsigned step = 0; step < kImportSteps && finite; ++step) {
        const StepReport& report = simulator.step();
        exits += report.lumen_exits;
        finite = report.finite;
    }
    row["runs"] = finite ? fmt::format("{} steps", kImportSteps) : std::string("left its bounds");
    row["lumen_exits"] = exits;
    if (target.empty()) return;
    const InstrumentModel& instrument = prepared->model.instruments[kLeadInstrument];
    const RouteReport route = inspect_route(*instrument.route, instrument.rod.design.radius);
    const Plan plan = find_motion(prepared->model, usual_trial_time(route, instrument), [](double) { return false; });
    row["plan_arrives"] = plan.arrived;
    row["plan_exits"] = plan.lumen_exits;
}

void finish_vessel(BenchRow& row, const ImportedVessel& vessel, const fs::path& folder) {
    describe_surface(row, vessel.surface);
    row["ends"] = vessel.ends.size();
    row["branches"] = vessel.branches.size();
    for (const Result<void>& written : write_vessel(vessel, {"bench", "bench", {}}, folder))
        if (!written.ok()) row["runs"] = written.error().to_string();
    if (!row.contains("runs")) run_written(row, folder / import_name::kScene, vessel.targets[vessel.instrument.target].name);
}

BenchRow measure_vessel(const fs::path& file) {
    BenchRow row{{"what", file.filename().string()}, {"kind", "vessel"}};
    ReadOptions reading;
    reading.weld = true;
    const StopWatch watch;
    Result<TriMesh> mesh = read_surface(file, reading);
    if (!mesh.ok()) return row["refused"] = mesh.error().message, row;
    const UnitGuess unit = guess_unit(mesh->bounds().longest_edge());
    for (Vec3& v : mesh->vertices) v *= unit.metres;
    const TriMesh raw = *mesh;
    const Result<ImportedVessel> vessel = import_vessel(std::move(*mesh), {});
    row["seconds"] = 1e-3 * watch.elapsed_ms();
    if (!vessel.ok()) return row["refused"] = vessel.error().to_string(), row;
    row["unit"] = unit.name;
    row["repairs"] = vessel->repairs.size();
    row["hausdorff_mm"] = 1e3 * largest_distance(vessel->surface, raw);
    const ImportScratch folder;
    finish_vessel(row, *vessel, folder.path());
    return row;
}

BenchRow measure_organ(const fs::path& file) {
    BenchRow row{{"what", file.filename().string()}, {"kind", "organ"}};
    const StopWatch watch;
    Result<OrganInput> input = read_organ(file);
    if (!input.ok()) return row["refused"] = input.error().message, row;
    const UnitGuess unit = guess_unit(input->surface.bounds().longest_edge());
    const Result<ImportedOrgan> organ = import_organ(std::move(*input), unit.metres, MendMode::Automatic, {});
    row["seconds"] = 1e-3 * watch.elapsed_ms();
    if (!organ.ok()) return row["refused"] = organ.error().to_string(), row;
    row["unit"] = unit.name;
    row["repairs"] = organ->repairs.size();
    describe_surface(row, organ->surface);
    const ImportScratch folder;
    for (const Result<void>& written : write_organ(*organ, {"bench", "bench", {}}, folder.path()))
        if (!written.ok()) row["runs"] = written.error().to_string();
    if (!row.contains("runs")) run_written(row, folder.path() / import_name::kScene, "");
    return row;
}

BenchRow measure_phantom(const LabelPhantom& phantom) {
    BenchRow row{{"what", phantom.name}, {"kind", "phantom"}};
    const ImportScratch folder;
    const fs::path file = folder.path() / "phantom.nrrd";
    if (const Result<void> written = write_phantom(phantom, file); !written.ok()) return row["refused"] = written.error().message, row;
    const StopWatch watch;
    Result<SegmentSurface> segment = read_segment(file, "", {});
    if (!segment.ok()) return row["refused"] = segment.error().to_string(), row;
    VesselOptions options;
    options.openings = segment->cut;
    const Result<ImportedVessel> vessel = import_vessel(std::move(segment->mesh), options);
    row["seconds"] = 1e-3 * watch.elapsed_ms();
    if (!vessel.ok()) return row["refused"] = vessel.error().to_string(), row;
    row["voxels_along"] = phantom.size;
    row["repairs"] = vessel->repairs.size();
    const RadiusError error = measure_radii(phantom, vessel->branches);
    row["radius_error_voxels"] = error.most / phantom.voxel;
    row["radius_points"] = error.points;
    finish_vessel(row, *vessel, folder.path());
    return row;
}

std::vector<fs::path> sorted_files(const fs::path& folder) {
    std::vector<fs::path> files;
    std::error_code ignored;
    for (const auto& entry : fs::directory_iterator(folder, ignored)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

} // namespace

Result<BenchTable> bench_import(const BenchOptions& options) {
    BenchTable table;
    table.quick = options.quick;
    for (const LabelPhantom& phantom : make_phantoms(options.quick)) {
        options.progress("phantom " + phantom.name);
        table.rows.push_back(measure_phantom(phantom));
    }
    if (!options.data) table.notes.emplace_back("vessels and organs need TROCAR_TEST_DATA, a folder with vessels/ and organs/: left out");
    if (!options.data || options.quick) return table;
    for (const fs::path& file : sorted_files(*options.data / "vessels")) {
        options.progress(file.filename().string());
        table.rows.push_back(measure_vessel(file));
    }
    for (const fs::path& file : sorted_files(*options.data / "organs")) {
        options.progress(file.filename().string());
        table.rows.push_back(measure_organ(file));
    }
    table.notes.emplace_back("seconds: from the file to an anatomy with centreline, without writing and running; hausdorff_mm: farthest that the imported "
                             "surface lies from the input's triangles, caps included; runs and plans: under the budget exact");
    return table;
}

} // namespace trocar::engine
