// The policy that a command line names: drawn at random, straight ahead, or a function of the user's own in Python.
#pragma once

#include "engine/episodes/environment.hpp"
#include "engine/episodes/policy.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace trocar::engine {

/// text    "random": uniform within the drives' limits, from the seed; "advance": the lead instrument at full speed, no rotation;
///         FILE.py or FILE.py:FUNCTION: python3 calls FUNCTION (act when absent) with every observation
/// folder  that FILE is relative to
/// fails   as check_policy; ToolFailed: the program could not be started
[[nodiscard]] Result<std::unique_ptr<Policy>> make_policy(const std::string& text, const std::filesystem::path& folder, const Environment& environment,
                                                          std::uint64_t seed);

enum class PolicyCheck : std::uint8_t {
    Name,  // it is known, or its file is there
    Import // and python3 imports the file: what that needs and does not find shows before anything runs
};
/// fails   BadUsage: no such name; FileNotFound; MissingTool: no python3; ToolFailed with what Python said
[[nodiscard]] Result<void> check_policy(const std::string& text, const std::filesystem::path& folder, PolicyCheck check);

} // namespace trocar::engine
