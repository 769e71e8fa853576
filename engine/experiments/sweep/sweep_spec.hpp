// A sweep as its user writes it: scenes, what is varied in them, the command that is run on each, and what is collected.
#pragma once

#include "base/result.hpp"
#include "engine/scene/json_tree.hpp"
#include "engine/scene/table.hpp"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// More runs than this are refused: a count was mistyped, or several sweeps are wanted.
inline constexpr std::uint64_t kMostRuns = 1'000'000;

enum class SweepCommand : std::uint8_t { Run, Cost, Plan, Verify, Episode };
inline constexpr SweepCommand kSweepCommands[] = {SweepCommand::Run, SweepCommand::Cost, SweepCommand::Plan, SweepCommand::Verify,
                                                  SweepCommand::Episode};
[[nodiscard]] const char* command_name(SweepCommand command) noexcept;
/// Where a run's figures are: summary.json, cost.json, plan.json; nullptr of verify.
[[nodiscard]] const char* figures_file(SweepCommand command) noexcept;
/// What reductions are of: steps.csv, an episode's actions.csv; nullptr of the others.
[[nodiscard]] const char* table_file(SweepCommand command) noexcept;

/// Is this varied name an option of the command, as in --budgets, and no pointer into the scene?
[[nodiscard]] inline bool is_option(std::string_view name) noexcept { return name.starts_with("--"); }

/// Pointers that change together. Axes are combined with one another.
struct SweepAxis {
    std::vector<std::string> pointers;
    std::vector<std::vector<std::string>> values; // [value][pointer], canonical JSON
    std::string file;                             // that the values stand in: the sweep's, or a CSV
    std::vector<TextPosition> pointer_at;         // [pointer]
    std::vector<TextPosition> value_at;           // [value * pointers + pointer]; empty: as pointer_at

    /// Where a pointer stands, or one of its values.
    [[nodiscard]] TextPosition place(std::size_t pointer, std::optional<std::size_t> value) const {
        return !value || value_at.empty() ? pointer_at[pointer] : value_at[*value * pointers.size() + pointer];
    }
};

/// A column of the table: a value of the figures' file, or a reduction of a column of table_file.
struct CollectItem {
    std::string name;
    std::string pointer;      // into the figures' file; empty: a reduction
    std::string column, take; // of table_file; how its values become one
    TextPosition at;
};

struct SweepSpec {
    std::filesystem::path file;
    std::vector<std::string> scenes; // as written: relative to the sweep's folder
    bool is_list = false;            // of scenes: then the table has a column for them
    std::vector<TextPosition> scene_at;
    SweepCommand command = SweepCommand::Run;
    std::vector<std::string> options; // of the command
    TextPosition options_at;
    std::uint64_t repeat = 1;
    std::vector<SweepAxis> axes; // the first changes slowest
    std::vector<CollectItem> collect;
    bool keeps_folders = false;
    double time_limit = 0.0; // s of wall time for one run; 0: none

    [[nodiscard]] std::filesystem::path folder() const;
};

/// fails  with file, line, column, key: what was found, what was expected
[[nodiscard]] Result<SweepSpec> read_sweep(const std::filesystem::path& file);
/// file  that the text stands in: the rows' file is relative to it
[[nodiscard]] Result<SweepSpec> parse_sweep(std::string_view text, const std::filesystem::path& file);

/// The format's table, and what is made from it: assets/sweep.schema.json, docs/sweep.md.
[[nodiscard]] const ObjectSpec& sweep_table();
[[nodiscard]] std::string sweep_schema_text();
[[nodiscard]] std::string sweep_reference_markdown();

} // namespace trocar::engine
