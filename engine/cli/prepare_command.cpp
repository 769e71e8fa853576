#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/prepare/prepare_mesh.hpp"
#include "engine/prepare/sph.hpp"
#include "engine/scene/units.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <optional>

namespace trocar::engine {

namespace {

constexpr double kLeastUnit = 1e-12, kMostUnit = 1e12; // m

struct PrepareRequest {
    std::filesystem::path mesh, out;
    std::string builder = "medial", unit = "m", repair;
    PrepareOptions options;
    bool force = false, no_cache = false, quiet = false;
};

Error bad_option(std::string option, std::string message) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, std::move(option)}; }

/// A name of a length unit, or metres as a number.
Result<double> parse_unit(const std::string& text) {
    if (const auto known = find_unit(Dimension::Length, text)) return *known;
    char* end = nullptr;
    const double metres = std::strtod(text.c_str(), &end);
    if (end != text.c_str() && *end == 0 && metres >= kLeastUnit && metres <= kMostUnit) return metres;
    std::vector<std::string_view> names;
    for (const UnitName& unit : known_units(Dimension::Length)) names.push_back(unit.name);
    return bad_option("--unit", fmt::format("no unit '{}'; known: {}, or metres as a number from {:g} to {:g}", text,
                                            fmt::join(names, ", "), kLeastUnit, kMostUnit));
}

Result<std::vector<Repair>> parse_repairs(const std::string& text) {
    std::vector<Repair> repairs;
    for (std::size_t at = 0; at < text.size();) {
        const std::size_t end = std::min(text.find(',', at), text.size());
        const std::string name = text.substr(at, end - at);
        const auto repair = find_repair(name);
        if (!repair) return bad_option("--repair", fmt::format("no repair '{}'; known: {}", name, fmt::join(repair_names(), ", ")));
        repairs.push_back(*repair);
        at = end + 1;
    }
    return repairs;
}

void print_report(const MeshPreparation& made, const PrepareOptions& options, const std::filesystem::path& out) {
    const double size = made.surface.bounds().longest_edge();
    fmt::print("dense      {} vertices, {} triangles, {}, {} components, longest side {:.4g} mm\n", made.surface.vertices.size(),
               made.surface.triangles.size(), made.dense.closed() ? "closed" : "open", made.dense.components, 1e3 * size);
    for (const auto& coarse : {made.coarse, made.lattice})
        if (coarse)
            fmt::print(
                "coarse     {} nodes, {} tets by {}, smallest dihedral angle {:.1f} degrees, {:.4f} of the volume, stable step {:.4g} ms\n",
                coarse->nodes, coarse->tets, coarse->mesher, coarse->min_dihedral_deg, coarse->volume_ratio, 1e3 * coarse->stable_step_s);
    if (made.links)
        fmt::print("links      {}, longest {:.3g} mm, {} degenerate\n", made.links->count, 1e3 * made.links->max_length_m,
                   made.links->degenerate);
    const std::string origin = options.spheres_file.empty()
                                   ? fmt::format("{} builder, branching {}, depth {}", spheretree::builder_name(options.spheres.builder),
                                                 options.spheres.branching, options.spheres.depth)
                                   : fmt::format("from {}, depth {}", options.spheres_file.string(), made.spheres.leaf_depth());
    fmt::print("spheres    {}, {:.2f} s{}, {:.0f} MB, volume ratio {:.4f}\n", origin, made.sphere_seconds,
               made.spheres_from_cache ? " (from the cache)" : "", made.sphere_peak_mb, made.quality.volume_ratio);
    fmt::print("           level  count  outside max  mean [1/1000 of the longest side]  uncovered  reachable\n");
    for (std::size_t k = 0; k < made.quality.levels.size(); ++k) {
        const spheretree::LevelQuality& q = made.quality.levels[k];
        const double per_mille = size > 0.0 ? 1e3 / size : 0.0;
        fmt::print("           {:5}  {:5}  {:11.2f}  {:4.2f}{:>40.4g} %  {:.6g} %\n", k, q.count, per_mille * q.outside_max,
                   per_mille * q.outside_mean, 100.0 * q.uncovered, 100.0 * q.reachable);
    }
    fmt::print("chromatic  {} colours, {:.2f} s\n", made.colours, made.colour_seconds);
    for (const std::string& note : made.notes) report_notice(note);
    fmt::print("report {}   spheres {}\n", (out / output_name::kPrepare).string(), (out / output_name::kSpheres).string());
}

int prepare(PrepareRequest& request) {
    PrepareOptions& options = request.options;
    const auto builder = spheretree::find_builder(request.builder);
    if (!builder)
        return report_error(
            bad_option("--builder", fmt::format("no builder '{}'; known: {}", request.builder, spheretree::builder_names())));
    const auto unit = parse_unit(request.unit);
    if (!unit.ok()) return report_error(unit.error());
    const auto repairs = parse_repairs(request.repair);
    if (!repairs.ok()) return report_error(repairs.error());
    if (const auto material = fem::check_material(options.material); !material.ok()) return report_error(material.error());
    options.spheres.builder = *builder;
    if (!options.spheres_file.empty()) options.spheres.builder = spheretree::Builder::Shell; // nothing is built: any surface will do
    if (*builder == spheretree::Builder::Octree) options.spheres.branching = 8;
    options.unit = *unit;
    options.repairs = *repairs;
    options.use_cache = !request.no_cache;
    const std::filesystem::path out = request.out.empty() ? std::filesystem::path("out") / request.mesh.stem().stem() : request.out;

    const std::filesystem::path reads[] = {request.mesh, options.spheres_file}; // the second may be empty: passed over
    if (const auto free = OutputFolder::check(out, request.force, reads); !free.ok()) return report_error(free.error());
    ProgressLine progress(!request.quiet);
    const auto made = prepare_mesh(request.mesh, options, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!made.ok()) return report_error(made.error());
    const auto folder = OutputFolder::open(out, request.force);
    if (!folder.ok()) return report_error(folder.error());
    WrittenOutputs outputs;
    outputs.note(write_sph(out / output_name::kSpheres, made->spheres, 1.0 / options.unit));
    outputs.note(write_file_atomically(out / output_name::kPrepare, preparation_json(*made, options)));
    print_report(*made, options, out);
    return outputs.tell(out);
}

} // namespace

Command add_prepare_command(CLI::App& app) {
    const auto request = std::make_shared<PrepareRequest>();
    CLI::App* command =
        app.add_subcommand("prepare", "Make what is made once of a surface: coarse model, links, sphere tree, chromatic sets");
    command
        ->add_option("mesh", request->mesh,
                     "surface file (OBJ, PLY, STL, OFF, VTK, VTP; plain or .gz); of a file of tetrahedra the boundary")
        ->required();
    command->add_option("--out", request->out, "output folder; out/<mesh name> where none is given");
    CLI::Option* spheres = command->add_option("--spheres", request->options.spheres_file,
                                               "a sphere tree (.sph, in the mesh's unit and frame) to take instead of building one; what it leaves "
                                               "uncovered is given to its nearest leaves, and said");
    command
        ->add_option("--builder", request->builder, "of the sphere tree: " + spheretree::builder_names() + "; shell takes open surfaces")
        ->excludes(spheres);
    command->add_option("--branching", request->options.spheres.branching, "children of a sphere at most")
        ->check(CLI::Range(2U, 64U))
        ->excludes(spheres);
    command->add_option("--depth", request->options.spheres.depth, "levels below the root")->check(CLI::Range(0U, 8U))->excludes(spheres);
    command->add_option("--repair", request->repair,
                        "repairs by name, in this order, joined by commas: fill_holes,drop_self_intersections,orient");
    command
        ->add_option("--may-remove", request->options.repairing.may_remove,
                     "share of the area, and of the volume, that one repair may take; more is refused")
        ->check(number_range(0.0, 1.0));
    command->add_flag("--may-split", request->options.repairing.may_split, "lets a repair leave more connected parts than it found");
    command->add_option("--unit", request->unit, "of the file's coordinates: m, mm, ... or metres as a number; spheres.sph keeps it");
    command->add_option("--coarse-triangles", request->options.coarse_triangles, "of the simplified surface that is filled with tetrahedra")
        ->check(CLI::Range(std::size_t{20}, std::size_t{1'000'000}));
    command->add_option("--young", request->options.material.young_modulus, "Pa, for the stable step")->check(number_range(10.0, 3e10));
    command->add_option("--poisson", request->options.material.poisson_ratio, "for the stable step")->check(number_range(0.0, 0.4999));
    command->add_option("--density", request->options.material.density, "kg/m^3, for the stable step")->check(number_range(50.0, 23000.0));
    command->add_flag("--force", request->force, "write into an output folder that is not empty");
    command->add_flag("--no-cache", request->no_cache, "make everything anew");
    command->add_flag("--quiet", request->quiet, "no progress line");
    return {command, [request] { return prepare(*request); }};
}

} // namespace trocar::engine
