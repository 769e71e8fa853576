// What a sweep will run, written once into its folder and never changed: the runs follow from their number alone.
#pragma once

#include "engine/experiments/sweep/sweep_spec.hpp"

#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trocar::engine {

/// A varied value as a cell of the table, or a word of a command line: strings without their quotes.
[[nodiscard]] std::string value_text(const std::string& json);

/// A file that runs read, and what it held when the plan was made.
struct PlannedFile {
    std::string file; // absolute
    std::string hash;
};

struct PlannedRun {
    std::uint64_t number = 0;
    std::size_t scene = 0;
    std::vector<std::pair<std::string, std::string>> settings; // pointer, canonical JSON
    std::uint64_t repeat = 0;
    std::string key; // of scene, settings, command, options, repetition, program, files: 32 hex digits
};

struct SweepPlan {
    std::string program; // version and build
    std::string folder;  // of the sweep, absolute: where runs are started
    SweepCommand command = SweepCommand::Run;
    std::vector<std::string> options;
    std::vector<std::string> scene_names; // as the sweep writes them
    bool has_scene_column = false;
    std::vector<PlannedFile> scenes; // [scene]
    std::vector<PlannedFile> files;  // meshes, paths, recipes that any run reads
    struct Axis {
        std::vector<std::string> pointers;
        std::vector<std::vector<std::string>> values;
    };
    std::vector<Axis> axes;
    std::uint64_t repeat = 1;
    std::vector<CollectItem> collect;
    bool keeps_folders = false;
    double time_limit = 0.0;         // s; 0: none
    std::uint64_t chunk_runs = 1;    // runs whose results are packed into one file

    [[nodiscard]] std::uint64_t run_count() const noexcept;
    [[nodiscard]] std::uint64_t chunk_count() const noexcept { return (run_count() + chunk_runs - 1) / chunk_runs; }
    /// number < run_count()
    [[nodiscard]] PlannedRun run(std::uint64_t number) const;
    /// Runs of a chunk: first, and one beyond the last.
    [[nodiscard]] std::pair<std::uint64_t, std::uint64_t> chunk(std::uint64_t index) const noexcept;
    /// Of this program: command, scene, --set, the sweep's options, and where its outputs go.
    [[nodiscard]] std::vector<std::string> command_line(const PlannedRun& run, const std::filesystem::path& out) const;
    /// The same for a person, from the sweep's folder.
    [[nodiscard]] std::string describe(const PlannedRun& run) const;

    /// plan.json: the same text for the same sweep, scenes, files and program.
    [[nodiscard]] std::string text() const;
};

/// Reads the scenes, checks the pointers and what runs they come to, hashes what they read. Nothing runs.
/// fails  an unknown pointer, a value that does not fit: the sweep's line and column, the nearest key
[[nodiscard]] Result<SweepPlan> make_plan(const SweepSpec& spec);

/// fails  no plan, damaged, of another format
[[nodiscard]] Result<SweepPlan> read_plan(const std::filesystem::path& file);
/// file  that the text stands in
[[nodiscard]] Result<SweepPlan> parse_plan(std::string_view text, const std::filesystem::path& file);

/// Are the scenes and the files that runs read still what they were?
/// fails  BadValue that names the first one that changed
[[nodiscard]] Result<void> check_unchanged(const SweepPlan& plan);

/// Version and build of this program: results of one are not mixed with those of another.
[[nodiscard]] std::string program_version();

} // namespace trocar::engine
