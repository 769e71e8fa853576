// What drives an instrument in an episode: drawn at random, straight ahead, or a function of the user's own in Python.
#pragma once

#include "engine/episodes/environment.hpp"

#include <filesystem>
#include <memory>
#include <span>
#include <string>

namespace trocar::engine {

class Policy {
public:
    virtual ~Policy() = default;
    /// observation  [observation_size] mm, mm/s, rad
    /// action       [devices][2] mm/s and rad/s, written whole and finite
    /// fails        ToolFailed: a program of the user's that ended or answered something else
    [[nodiscard]] virtual Result<void> act(std::span<const float> observation, std::span<double> action) = 0;
};

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
