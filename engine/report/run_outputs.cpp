#include "engine/report/run_outputs.hpp"

#include "engine/report/output_folder.hpp"
#include "engine/report/step_table.hpp"
#include "engine/report/summary.hpp"

#include <utility>

namespace trocar::engine {

namespace {

OutputTable folder_table() {
    return {"Files of an output folder",
            "A file appears under its name when it is complete: it is written under another name first. A run refuses a folder that is not "
            "empty, unless `--force` is given; then it removes an earlier run's outputs, by these names, and nothing else.",
            {{output_name::kSteps, "", "`run`: a row for each step."},
             {output_name::kPartialSteps, "", "`run`: its rows while the run goes on; all that is left of a run that was killed."},
             {output_name::kSummary, "", "`run`, `episode`: it in numbers."},
             {output_name::kActions, "", "`episode`: a row for each action."},
             {output_name::kManifest, "", "`episode`: what `score` simulates it again from; none where the budget is a time."},
             {output_name::kManifestHash, "", "`episode`: the hash of `manifest.json`."},
             {output_name::kReport, "", "`run`, `cost`, `plan`: one page without any other file."},
             {"anatomy_01_t30.00s.png", "", "`run`: a picture, named by view (`anatomy`, `tip`, `fluoro`), number and simulated time."},
             {output_name::kTrace, "", "`run --trace`: the stages of every step for chrome://tracing and ui.perfetto.dev."},
             {output_name::kCheckpoint, "", "`run --checkpoint-every`: the newest state that `--resume` goes on from."},
             {output_name::kRecord, "", "`run --record`: a folder of states for ParaView (`.pvd`, `.vtp`, `.vtu`)."},
             {output_name::kFluoro, "", "`run` with the effect `fluoroscopy`: a folder of X-ray frames (docs/fluoroscopy.md)."},
             {output_name::kLastGoodState, "", "`run`: a folder with the state before the step that failed."},
             {output_name::kCost, "", "`cost`: a row for each budget."},
             {output_name::kCostJson, "", "`cost`: everything that was measured."},
             {output_name::kPath, "", "`plan`: `t,insertion,rotation` in the scene's units, as `run --path` reads it."},
             {output_name::kCentreline, "", "`plan`: `x,y,z,radius` of the way in the scene's units; the last row is the target."},
             {output_name::kPlan, "", "`plan`: the way in numbers."},
             {output_name::kPrepare, "", "`prepare`: what was made of the mesh."},
             {output_name::kSpheres, "", "`prepare`: the sphere tree, in the mesh's unit."}}};
}

} // namespace

std::vector<OutputTable> run_output_tables() {
    std::vector<OutputTable> tables{
        folder_table(),
        {"steps.csv", "One row for each step. Numbers have all the digits that tell them from their neighbours.", step_table_columns()}};
    for (OutputTable& table : summary_tables()) tables.push_back(std::move(table));
    return tables;
}

} // namespace trocar::engine
