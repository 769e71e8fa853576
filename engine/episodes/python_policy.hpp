// A policy in Python: python3 in a process of its own that reads observations and answers actions, a line of JSON each. Neither the
// package of this project nor NumPy is needed; where NumPy is installed, observations are its arrays.
#pragma once

#include "engine/episodes/environment.hpp"
#include "engine/episodes/policy.hpp"

#include <filesystem>
#include <memory>
#include <string>

namespace trocar::engine {

/// Of a policy's text: the file, and the function in it.
struct PythonFunction {
    std::filesystem::path file;
    std::string name;
};

/// fails  MissingTool; ToolFailed: the last line that Python printed
[[nodiscard]] Result<void> check_python_function(const PythonFunction& function);

/// Starts the process; it ends with the policy, or with this process.
[[nodiscard]] Result<std::unique_ptr<Policy>> make_python_policy(const PythonFunction& function, const Environment& environment, std::uint64_t seed);

} // namespace trocar::engine
