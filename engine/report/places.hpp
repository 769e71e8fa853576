// Names of a scene: paths that mean the same on every machine, lines for a shell.
#pragma once

#include "engine/scene/scene.hpp"

#include <string>
#include <string_view>

namespace trocar::engine {

/// The scene's file relative to its project, the nearest folder above it that holds CMakePresets.json; relative to the
/// working folder where there is none.
[[nodiscard]] std::string project_path(const std::filesystem::path& file);

/// The word quoted for a POSIX shell.
[[nodiscard]] std::string shell_quoted(std::string_view word);

/// The command that repeats a run.
[[nodiscard]] std::string repeat_command(const Scene& scene, std::uint64_t steps);

/// "wall", "work" or "exact".
[[nodiscard]] const char* mode_name(BudgetMode mode) noexcept;

/// Lines about the machine: processor, memory, compiler.
struct Machine {
    std::string processor;
    unsigned cores = 0;
    double memory_gib = 0.0;
    std::string system, compiler;
};
[[nodiscard]] Machine describe_machine();

} // namespace trocar::engine
