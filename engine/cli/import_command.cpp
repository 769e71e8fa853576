// `import`: the files of a clinic or of another program become a scene that runs.
#include "base/self_intersection.hpp"
#include "engine/cli/commands.hpp"
#include "engine/cli/import_options.hpp"
#include "engine/cli/import_outputs.hpp"
#include "engine/cli/progress.hpp"
#include "engine/importing/import_curves.hpp"
#include "engine/importing/import_organ.hpp"
#include "engine/importing/import_segmentation.hpp"
#include "engine/importing/import_steve.hpp"
#include "engine/importing/import_vessel.hpp"
#include "engine/importing/vessel_files.hpp"
#include "engine/io/printable.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/surface_rule.hpp"
#include "engine/report/output_folder.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <vector>

namespace trocar::engine {

namespace {

/// Of the file's coordinates, before they are scaled.
Result<TriMesh> read_scaled(const ImportRequest& request, ImportSource& source) {
    ReadOptions reading;
    reading.weld = true;
    std::string note;
    Result<TriMesh> mesh = read_surface(request.file, reading, &note);
    if (!mesh.ok()) return mesh.error();
    if (!note.empty()) source.facts.emplace_back("read_as", note);
    const auto unit = choose_unit(request, mesh->bounds().longest_edge(), source);
    if (!unit.ok()) return unit.error();
    if (const Result<void> size = check_size(mesh->bounds(), *unit, request); !size.ok()) return size.error();
    for (Vec3& v : mesh->vertices) v *= *unit;
    return mesh;
}

int import_vessel_surface(ImportRequest& request) {
    const std::filesystem::path out = output_of(request);
    if (const auto free = check_import_place(request, out, {&request.file, 1}); !free.ok()) return report_error(free.error());
    ImportSource source = source_of(request);
    ProgressLine progress(!request.quiet);
    Result<TriMesh> mesh = read_scaled(request, source);
    if (!mesh.ok()) return report_error(mesh.error());
    const auto options = vessel_options(request, source.unit);
    if (!options.ok()) return report_error(options.error());
    const auto vessel = import_vessel(std::move(*mesh), *options, [&](const std::string& what) { progress.show(what); });
    progress.clear();
    if (!vessel.ok()) return report_error(about_file(vessel.error(), request.file));
    return write_imported(*vessel, source, request, out);
}

int finish_organ(const ImportedOrgan& organ, const ImportSource& source, const ImportRequest& request, const std::filesystem::path& out) {
    const auto folder = OutputFolder::open(out, request.force);
    if (!folder.ok()) return report_error(folder.error());
    WrittenOutputs outputs;
    for (const Result<void>& written : write_organ(organ, source, out)) outputs.note(written);
    if (!outputs.all_there()) return outputs.tell(out);
    print_facts(source, organ.repairs);
    const std::string crossing = describe_crossings(find_self_intersections(organ.surface, 0)); // tissue needs none mended: it is embedded
    fmt::print("surface    {} triangles, closed, manifold, {}\n", organ.surface.triangles.size(),
               crossing.empty() ? std::string("no self-intersections") : crossing + ", which stays");
    for (const std::string& sentence : organ.quality) fmt::print("tets       {}\n", sentence);
    for (const RegionSummary& region : organ.regions) fmt::print("region     {}\n", describe_region(region));
    if (!organ.regions.empty()) fmt::print("           by the cell array {}; all have the organ's material until the scene says another\n", printable(organ.labels.array));
    if (!organ.labels_note.empty()) fmt::print("region     {}\n", organ.labels_note);
    std::vector<const char*> written{import_name::kOrganSurface, import_name::kReport, import_name::kScene};
    if (organ.tets) written.push_back(import_name::kOrganTets);
    return end_import(request, out, written);
}

int import_organ_file(ImportRequest& request) {
    const std::filesystem::path out = output_of(request);
    if (const auto free = check_import_place(request, out, {&request.file, 1}); !free.ok()) return report_error(free.error());
    ImportSource source = source_of(request);
    const auto hold = hold_of(request);
    if (!hold.ok()) return report_error(hold.error());
    Result<OrganInput> input = read_organ(request.file, request.regions);
    if (!input.ok() && input.error().file.empty()) { // of the array, not of the file's text
        Error error = about_file(input.error(), request.file);
        error.key = "--regions";
        return report_error(error);
    }
    if (!input.ok()) return report_error(input.error());
    Box3 box = input->surface.bounds();
    if (input->tets)
        for (const Vec3& v : input->tets->vertices) box.add(v); // all of them, if doubled ones leave no boundary
    const auto unit = choose_unit(request, box.longest_edge(), source);
    if (!unit.ok()) return report_error(unit.error());
    if (const Result<void> size = check_size(box, *unit, request); !size.ok()) return report_error(size.error());
    const Result<ImportedOrgan> organ = import_organ(std::move(*input), *unit, mend_mode(request), *hold);
    if (!organ.ok()) return report_error(about_file(organ.error(), request.file));
    return finish_organ(*organ, source, request, out);
}

/// A label map becomes a vessel, or an organ.
int import_segmentation(ImportRequest& request) {
    const std::filesystem::path out = output_of(request);
    if (const auto free = check_import_place(request, out, {&request.file, 1}); !free.ok()) return report_error(free.error());
    ImportSource source = source_of(request);
    source.facts.emplace_back("frame", "right, anterior, superior (RAS), mm; what lay in LPS is turned");
    ProgressLine progress(!request.quiet);
    const auto show = [&](const std::string& what) { progress.show(what); };
    show("reading the label map");
    LabelSurfaceOptions cutting;
    cutting.error = request.error_voxels;
    Result<SegmentSurface> segment = read_segment(request.file, request.label, cutting, show);
    if (!segment.ok()) return report_error(about_file(segment.error(), request.file));
    for (const auto& fact : segment->facts) source.facts.push_back(fact);
    if (request.kind == "organ") {
        const auto hold = hold_of(request);
        if (!hold.ok()) return report_error(hold.error());
        Result<ImportedOrgan> organ = import_organ({.tets = std::nullopt, .surface = std::move(segment->mesh), .split = {}, .labels = {}, .labels_note = {}}, 1.0, mend_mode(request), *hold);
        progress.clear();
        if (!organ.ok()) return report_error(about_file(organ.error(), request.file));
        organ->repairs.insert(organ->repairs.begin(), segment->repairs.begin(), segment->repairs.end());
        return finish_organ(*organ, source, request, out);
    }
    const auto given = vessel_options(request, 1e-3);
    if (!given.ok()) return report_error(given.error());
    VesselOptions options = *given;
    options.openings = segment->cut;
    Result<ImportedVessel> vessel = import_vessel(std::move(segment->mesh), options, show);
    progress.clear();
    if (!vessel.ok()) return report_error(about_file(vessel.error(), request.file));
    vessel->repairs.insert(vessel->repairs.begin(), segment->repairs.begin(), segment->repairs.end());
    return write_imported(*vessel, source, request, out);
}

/// Branches without a surface: swept, blended, and then as any vessel.
int import_curves(ImportRequest& request, Result<CurveSet> (*read)(const std::filesystem::path&)) {
    const std::filesystem::path out = output_of(request);
    if (const auto free = check_import_place(request, out, {}); !free.ok()) return report_error(free.error());
    ImportSource source = source_of(request);
    ProgressLine progress(!request.quiet);
    const auto show = [&](const std::string& what) { progress.show(what); };
    show("reading the centrelines");
    Result<CurveSet> curves = read(request.file);
    if (!curves.ok()) return report_error(about_file(curves.error(), request.file));
    if (const auto apart = check_import_place(request, out, curves->files); !apart.ok()) return report_error(apart.error());
    const auto options = vessel_options(request, 1e-3);
    if (!options.ok()) return report_error(options.error());
    Result<ImportedVessel> vessel = import_curve_set(*curves, *options, show);
    progress.clear();
    if (!vessel.ok()) return report_error(about_file(vessel.error(), request.file));
    source.facts = curves->facts;
    return write_imported(*vessel, source, request, out);
}

int import_steve(ImportRequest& request) {
    const bool arch = request.kind == "archvariety";
    if (!arch && request.file.empty())
        return report_error({ErrorCode::BadUsage, "DualDeviceNav needs the folder of its centrelines; --setup archvariety needs none", {}, 0, 0, "centrelines"});
    if (request.out.empty()) request.out = std::filesystem::path("out") / (arch ? "archvariety" : "dualdevicenav");
    if (const auto free = check_import_place(request, request.out, {}); !free.ok()) return report_error(free.error());
    ProgressLine progress(!request.quiet);
    const auto show = [&](const std::string& what) { progress.show(what); };
    Result<SteveSetup> setup = arch ? import_arch_variety(show) : import_dual_device_nav(request.file, show);
    progress.clear();
    if (!setup.ok()) return report_error(about_file(setup.error(), request.file));
    if (const auto apart = check_import_place(request, request.out, setup->files); !apart.ok()) return report_error(apart.error());
    ImportSource source;
    source.name = arch ? "archvariety" : "dualdevicenav";
    source.file = arch ? "stEVE, ArchVariety" : request.file.string();
    for (const std::string& note : setup->notes) setup->vessel.notes.push_back(note);
    return write_imported(setup->vessel, source, request, request.out, steve_scene_text(*setup, source));
}

} // namespace

Command add_import_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("import", "Make a scene that runs of a user's anatomy: label maps, surfaces, volumes, centrelines");
    command->require_subcommand(1);
    const auto request = std::make_shared<ImportRequest>();
    std::vector<Command> kinds;
    CLI::App* vessel = command->add_subcommand("vessel", "A vessel's surface, open or closed: mended, its ends named, its centreline found");
    add_surface_options(*vessel, *request);
    kinds.push_back({vessel, [request] { return import_vessel_surface(*request); }});
    CLI::App* segmentation = command->add_subcommand("segmentation", "A segment of a label map (NRRD, NIfTI-1, MetaImage) as a vessel or an organ");
    add_segmentation_options(*segmentation, *request);
    kinds.push_back({segmentation, [request] { return import_segmentation(*request); }});
    CLI::App* organ = command->add_subcommand("organ", "Tetrahedra, or a surface that is filled with them, as soft tissue");
    add_organ_options(*organ, *request);
    kinds.push_back({organ, [request] { return import_organ_file(*request); }});
    const auto add_curves = [&](const char* name, const char* what, const char* file, Result<CurveSet> (*read)(const std::filesystem::path&)) {
        CLI::App* curves = command->add_subcommand(name, what);
        add_curve_options(*curves, *request, file);
        kinds.push_back({curves, [request, read] { return import_curves(*request, read); }});
    };
    add_curves("slicer", "3D Slicer's curves with radii, swept to a vessel", "a .mrk.json file, or a folder of them", read_slicer);
    add_curves("vmtk", "VMTK's centrelines, swept to a vessel", "a .vtp file with lines and MaximumInscribedSphereRadius", read_vmtk);
    add_curves("simvascular", "A SimVascular project: its model, or its paths with their segmentations", "the project's folder", read_simvascular);
    CLI::App* steve = command->add_subcommand("steve", "stEVE's set-ups DualDeviceNav and ArchVariety, with its devices");
    add_steve_options(*steve, *request);
    kinds.push_back({steve, [request] { return import_steve(*request); }});
    return {command, [kinds] { return run_chosen(kinds); }};
}

} // namespace trocar::engine
