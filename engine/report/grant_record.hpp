// Every decision of the clock in a run, as a file: with it a wall run can be repeated bit for bit, a glitch that showed once
// can be reproduced.
//
// Text, a line per step: its number, a fingerprint of the step's result, the decisions in the order in which they were
// made (d and t: units granted for sphere pairs and for continuous tests; f and r: the exact stage, or one more round of it,
// was started (1) or not (0); x: effects left out). The last line holds a hash of all bytes before it.
#pragma once

#include "base/result.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/decisions.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

struct GrantStep {
    std::uint64_t fingerprint = 0;
    std::vector<Decision> decisions;
};

struct GrantRecord {
    std::uint64_t model_hash = 0; // hash_model of the scene
    std::string scene;            // its name
    BudgetLimits limits;
    bool covers_step = false;
    std::uint64_t state_hash = 0; // after the last step
    std::vector<GrantStep> steps;
};

/// Fingerprint of a step's result: enough to name the first step in which two runs differ.
[[nodiscard]] std::uint64_t fingerprint_of(const StepReport& report) noexcept;

[[nodiscard]] std::string grant_record_text(const GrantRecord& record);
/// fails  BadSyntax with the line: another kind of file, another version, truncated, changed
[[nodiscard]] Result<GrantRecord> parse_grant_record(const std::string& text, const std::filesystem::path& file);

/// Written complete or not at all.
[[nodiscard]] Result<void> write_grant_record(const std::filesystem::path& file, const GrantRecord& record);
[[nodiscard]] Result<GrantRecord> read_grant_record(const std::filesystem::path& file);

} // namespace trocar::engine
