// The table of the sweep format: the check, the schema and the reference page are made from it.
#include "engine/experiments/sweep/reduction.hpp"
#include "engine/experiments/sweep/sweep_spec.hpp"
#include "engine/scene/schema.hpp"

#include <nlohmann/json.hpp>

namespace trocar::engine {
namespace {

constexpr double kMostCount = static_cast<double>(kMostRuns);

ValueSpec pair_value(std::string_view first, std::string_view second) {
    ValueSpec value;
    value.kind = ValueKind::Vector;
    value.columns = {{first, Dimension::None, {}}, {second, Dimension::None, {}}};
    return value;
}

const ObjectSpec& range_table() {
    static const ObjectSpec table{
        "range", "Numbers at even distances, both ends included, in the order from the first to the last: a falling range is run as it stands.", "from", "",
        {number_field("from", Dimension::None, {}, "The first, in the scene's units.").required(),
         number_field("to", Dimension::None, {}, "The last.").required(),
         count_field("count", 1, kMostCount, "How many; 1 is the first alone.").required(),
         choice_field("scale", {"linear", "log"}, "Even differences, or even ratios (both ends above 0).").by_default(std::string_view("linear"))}};
    return table;
}

ObjectSpec draw_object(std::string_view name, std::string_view doc, std::string_view key, ValueSpec value, std::string_view key_doc) {
    return {name, doc, key, "", {value_field(key, std::move(value), key_doc).required()}};
}

const ObjectSpec& uniform_table() {
    static const ObjectSpec table = draw_object("uniform draw", "Random numbers, all equally likely.", "uniform", pair_value("least", "most"), "Bounds.");
    return table;
}
const ObjectSpec& log_uniform_table() {
    static const ObjectSpec table =
        draw_object("log-uniform draw", "Random numbers whose logarithms are equally likely.", "log_uniform", pair_value("least", "most"), "Bounds, above 0.");
    return table;
}
const ObjectSpec& normal_table() {
    static const ObjectSpec table =
        draw_object("normal draw", "Random numbers of a normal distribution.", "normal", pair_value("mean", "deviation"), "Mean and standard deviation.");
    return table;
}
const ObjectSpec& integer_table() {
    static const ObjectSpec table =
        draw_object("integer draw", "Random integers, all equally likely.", "integer", pair_value("least", "most"), "Bounds, both included.");
    return table;
}
const ObjectSpec& choice_table() {
    static const ObjectSpec table =
        draw_object("choice draw", "Random elements of a list.", "choice", list_value(json_value(), 1), "What is chosen from.");
    return table;
}

const ObjectSpec& draws_table() {
    static const ObjectSpec table{
        "draws", "Of all random values of the sweep: they are drawn together, one value for each pointer in every draw.", "", "",
        {count_field("count", 1, kMostCount, "How many draws.").required(),
         count_field("seed", 0, 9007199254740992.0, "Another number is another set of values. A pointer's values do not depend on the other pointers.")
             .by_default(0.0)}};
    return table;
}

const ObjectSpec& reduction_table() {
    static const ObjectSpec table{
        "reduction", "One number of a column of steps.csv, of `episode` of actions.csv.", "column", "",
        {text_field("column", "As in max_contact_force_n; of `episode` as in contact_force_n.").required(),
         choice_field("take", reduction_names(), "What of the column's values: pN are nearest-rank percentiles.").required()}};
    return table;
}

} // namespace

const ObjectSpec& sweep_table() {
    static const ObjectSpec table{
        "sweep",
        "The whole file.",
        "",
        "",
        {text_field("$schema", "Where editors find the schema; not read."),
         value_field("scene", any_value({text_field("", "").value, list_value(text_field("", "").value, 1)}),
                     "The scene's file, relative to this file's folder; a list is varied first, and gets a column. Of `verify` the file of its list.")
             .required(),
         choice_field("command", {"run", "cost", "plan", "verify", "episode"}, "What is done with every scene.").by_default(std::string_view("run")),
         value_field("options", list_value(text_field("", "").value, 0),
                     "Of the command, word by word, as in [\"-n\", \"200\"]. Names of files are relative to this file's folder."),
         count_field("repeat", 1, kMostCount, "How often every combination is run; the column repeat counts from 0.").by_default(1.0),
         [] {
             ValueSpec one = any_value({list_value(json_value(), 1), object_value(range_table()), object_value(uniform_table()),
                                        object_value(log_uniform_table()), object_value(normal_table()), object_value(integer_table()),
                                        object_value(choice_table())});
             FieldSpec field = map_field("vary", std::move(one),
                                         "JSON pointer into the scene -> its values. All combinations are run; the first pointer changes slowest. An option of the "
                                         "command may stand in a pointer's place, as in --budgets.");
             field.value.any_names = true;
             return field;
         }(),
         object_field("draws", draws_table(), "How many random draws, where something is drawn."),
         path_field("rows", "A CSV file whose header names pointers and whose every row is one combination of their values, relative to this file's "
                            "folder. A cell is JSON, or else a string. Rows change slower than `vary`."),
         map_field("collect", any_value({text_field("", "").value, object_value(reduction_table())}),
                   "Column of the table -> a JSON pointer into the run's figures (summary.json of run and episode, cost.json of cost, plan.json of plan), or a "
                   "reduction of steps.csv, of an episode's actions.csv."),
         choice_field("keep", {"summary", "folder"}, "What stays of a run besides its row: its figures, or its whole output folder with the report.")
             .by_default(std::string_view("summary")),
         number_field("time_limit", Dimension::None, between(1e-3, 1e7), "s of wall time that one run may take; it fails beyond. None when absent.")}};
    return table;
}

std::string sweep_schema_text() { return make_schema("Trocar sweep", sweep_table()).dump(2) + "\n"; }

std::string sweep_reference_markdown() {
    return std::string(R"(# Sweep files

A sweep is a JSON file (`//` and `/* */` comments are allowed) that names scenes, what is varied in them, the command that runs
on every combination, and what is collected into one table. [Running on a cluster](cluster.md) says how it is run.

- Pointers are JSON pointers into the scene: `/instruments/catheter/friction`, `/bodies/vessel/surface/branches/0/4/3`. A key that the
  scene leaves out may be named where its schema allows it; a body, an instrument, a target and a list's element must be there. A
  pointer that leads nowhere, and a value that does not fit, end the program before anything runs.
- Numbers are in the scene's units. Names of files inside a scene are relative to the scene's folder, those of the sweep to its own.
- Combinations are run in this order: scenes, rows of the CSV, pointers of `vary` as they stand in the file (all drawn ones together,
  where the first of them stands), repetitions. The first changes slowest. That is the order of the table's rows, too.
- At most 1,000,000 runs.

The table has the columns `scene` (of a list), one for each pointer, `repeat`, `status`, and one for each collected name. A row's status
is `done`, `failed: ` with the exit code and the reason, or `missing`. Numbers have all their digits; a figure that a run does not have
is an empty cell.

This page is written by the engine from the table that also checks sweeps and makes `assets/sweep.schema.json`.
)") + reference_markdown(sweep_table());
}

} // namespace trocar::engine
