// `trocar bench python`: what the Python package costs, measured by the package itself.
#pragma once

#include "base/result.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace trocar::engine {

/// An interpreter that has the package, and where it finds it.
struct PythonWithPackage {
    std::filesystem::path interpreter;
    std::filesystem::path package_folder; // for PYTHONPATH; empty: installed in the interpreter's environment
};

/// The virtual environment that `./start python` makes beside the build directory, else the package in the build directory itself.
/// program   the running binary
/// fails     MissingTool: neither is there
[[nodiscard]] Result<PythonWithPackage> find_python(const std::filesystem::path& program);

/// Replaces this process by `python -m trocar.bench`, whose exit code is the program's.
/// returns   only where that failed
[[nodiscard]] Error become_python_bench(const std::vector<std::string>& arguments);

} // namespace trocar::engine
