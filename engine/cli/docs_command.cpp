// `trocar docs`: reference pages, the manual page and completions, as the program itself knows them.
#include "engine/cli/commands.hpp"
#include "engine/cli/help.hpp"
#include "engine/episodes/play.hpp"
#include "engine/experiments/cost_page.hpp"
#include "engine/experiments/plan_files.hpp"
#include "engine/experiments/sweep/sweep_spec.hpp"
#include "engine/report/run_outputs.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/schema.hpp"

#include <CLI/CLI.hpp>

#include <cstdio>
#include <memory>

namespace trocar::engine {

namespace {

/// Files whose writers lie below the report, or are no tables: a test compares these with what is written.
std::vector<OutputTable> other_tables() {
    return {{"prepare.json",
             "",
             {{"dense", "", "The surface: `vertices`, `triangles`, `closed`, `manifold`, `self_intersections`, `components`, `longest_edge_m`."},
              {"coarse", "", "The tetrahedral mesh that fills it, or null: `nodes`, `tets`, `mesher`, `min_dihedral_deg`, `volume_ratio`, `stable_step_s`."},
              {"coarse_by_lattice", "", "The same of a lattice."},
              {"links", "", "Of the surface to the mesh, or null: `count`, `max_length_m`, `degenerate`."},
              {"spheres", "",
               "The tree: `builder`, `branching`, `depth`, `levels`, `volume_ratio`, `seconds`, `peak_mb`, `from_cache`. Of a level: `count`; `outside_max` and "
               "`outside_mean`, by how much its spheres stand out of the surface, in 1/1000 of `longest_edge_m`; `uncovered` and `reachable`, "
               "shares of the surface. With `--spheres` also `file` and `as_it_came`."},
              {"chromatic", "", "Sets of triangles that share no vertex: `colours`, `seconds`."},
              {"unit_m", "m", "The file's unit of length."},
              {"notes", "", "What was noticed."}}},
            {"contacts --out",
             "A row for each contact, sorted by its ids. `VF`: a vertex and a face, `EE`: two edges, `TT`: two triangles (image-space methods only).",
             {{"kind", "", "`VF`, `EE` or `TT`."},
              {"body_a", "", "0 or 1: which of the meshes; of a sequence the object's number."},
              {"feature_a0", "", "`VF`: the vertex; `EE`: an edge's first vertex; `TT`: a triangle."},
              {"feature_a1", "", "`EE`: the edge's other vertex."},
              {"body_b", "", "As body_a."},
              {"feature_b0", "", "`VF`: the face's first vertex; `EE`: the other edge's first vertex; `TT`: a triangle."},
              {"feature_b1", "", "`VF`: its second vertex; `EE`: the other vertex."},
              {"feature_b2", "", "`VF`: its third vertex."},
              {"time", "[-]", "Time of impact, from 0 to 1 between the two frames."},
              {"bary_a", "[-]", "`EE`: weight of feature_a1; the rest of 1 is that of feature_a0."},
              {"bary_b0", "[-]", "Weight of feature_b0."},
              {"bary_b1", "[-]", "Weight of feature_b1; the rest of 1 is that of the last vertex."},
              {"normal_x", "[-]", "Of the contact normal, from b to a."},
              {"normal_y", "[-]", "Of the contact normal."},
              {"normal_z", "[-]", "Of the contact normal."},
              {"frame", "", "Of a sequence (`--frames`) alone: its step."}}}};
}

struct Page {
    std::string_view name;
    std::string (*text)(const CLI::App& program);
};
constexpr Page kPages[] = {
    {"commands", commands_markdown},
    {"outputs", [](const CLI::App&) { return outputs_markdown(); }},
    {"scene", [](const CLI::App&) { return scene_reference_markdown(); }},
    {"sweep", [](const CLI::App&) { return sweep_reference_markdown(); }},
    {"man", manual_page},
    {"bash", bash_completion},
    {"zsh", zsh_completion},
};

} // namespace

std::string outputs_markdown() {
    std::vector<OutputTable> tables = run_output_tables();
    for (auto&& more : {cost_output_tables(), plan_output_tables(), episode_output_tables(), other_tables()})
        for (const OutputTable& table : more) tables.push_back(table);
    return "# Outputs\n\nEvery file, column and key that the program writes. This page is written by the program, `trocar docs outputs`, from the "
           "tables that its writers take their names from. Columns and keys keep their names; more may follow at the end.\n\nAll numbers are in SI, "
           "times of the program's own work in ms. A unit of [-] is a share or a ratio. What `import` writes is in [import.md](import.md), the "
           "tables of sweeps in [sweep.md](sweep.md), what `contacts --stats` counts in [contacts.md](contacts.md), the words in "
           "[glossary.md](glossary.md).\n" +
           output_sections(tables);
}

Command add_docs_command(CLI::App& app) {
    CLI::App* command = app.add_subcommand("docs", "Print a reference page, the manual page, or a shell's completion");
    const auto name = std::make_shared<std::string>();
    command->add_option("page", *name, "commands, outputs, scene, sweep, man, bash or zsh")->required();
    return {command, [name, &app] {
                std::vector<std::string_view> known;
                for (const Page& page : kPages) {
                    known.push_back(page.name);
                    if (page.name != *name) continue;
                    std::fputs(page.text(app).c_str(), stdout);
                    return static_cast<int>(kExitFine);
                }
                return report_error({ErrorCode::BadUsage, refuse_unknown("page", *name, known), {}, 0, 0, "page"});
            }};
}

} // namespace trocar::engine
