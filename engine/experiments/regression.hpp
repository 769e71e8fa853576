// Regression runs: a list of scenes, the result of each when its reference was written, and its result now. Runs are
// in work mode, so that the same program gives the same bits; a tolerance per scene covers other compilers.
//
// List: a line per scene, "scene steps tolerance [budget]"; the scene relative to the list's folder, the tolerance in metres
// of any point, the budget work:TESTS or exact (work:1000000 when absent); # begins a comment. References lie in
// references/ beside the list, one NAME.json.gz per scene.
#pragma once

#include "engine/prepare/prepare_scene.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

struct RegressionEntry {
    std::filesystem::path scene;
    std::uint64_t steps = 0;
    double tolerance = 0.0; // m; 0: the same bits
    BudgetLimits budget;    // work or exact
    std::filesystem::path reference;
    std::string name;     // of scene and reference: the scene file's stem
    std::size_t line = 0; // in the list
};

/// fails  with the list's file and line: no list, a line that is none, a scene that is not there, two of the same name
[[nodiscard]] Result<std::vector<RegressionEntry>> read_regression_list(const std::filesystem::path& list);

/// Points of one part: coarse nodes of a deformable body, surface vertices of another that moves, nodes of a rod.
struct TracePart {
    std::string name;
    std::vector<Index> ids;
    std::vector<Vec3> points; // m
};
/// A state in few numbers.
struct TraceSample {
    std::uint64_t step = 0;
    std::vector<TracePart> parts;
    std::vector<double> drive_positions; // insertion [m] and rotation [rad] of every instrument
    double kinetic_j = 0.0, elastic_j = 0.0;
    std::uint64_t contacts = 0, pairs_tested = 0; // since the sample before
};
/// A run in few numbers.
struct Trace {
    std::string scene;
    std::uint64_t model_hash = 0, state_hash = 0;
    std::uint64_t steps = 0;
    std::string budget;
    std::vector<TraceSample> samples;
    std::string failure; // not kept: why the run was stopped
};

[[nodiscard]] Trace run_trace(const SceneModel& model, const RegressionEntry& entry,
                              const std::function<void(std::uint64_t)>& progress = {});

[[nodiscard]] std::string trace_text(const Trace& trace);
/// fails  with the file: damaged, no reference, another version, a key that is missing or wrong
[[nodiscard]] Result<Trace> read_trace(const std::filesystem::path& file);
[[nodiscard]] Result<void> write_trace(const std::filesystem::path& file, const Trace& trace);

/// The first difference beyond the tolerance, in words: step, body, node, size. Empty: none.
[[nodiscard]] std::string first_difference(const Trace& reference, const Trace& now, double tolerance);

} // namespace trocar::engine
