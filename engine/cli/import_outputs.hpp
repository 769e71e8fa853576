// What `import` leaves: the files of an anatomy, a scene that was read back and prepared, and what it says on the terminal.
#pragma once

#include "engine/cli/import_options.hpp"

#include <span>

namespace trocar::engine {

/// Before anything is written: the output folder takes files, and none of them takes the place of one that is read.
/// reads  files
[[nodiscard]] Result<void> check_import_place(const ImportRequest& request, const std::filesystem::path& out,
                                              std::span<const std::filesystem::path> reads);

/// scene_text  in place of the vessel's own; empty: that
/// Writes a vessel and its scene, prepares the scene as `run` would, and explains it. Returns the exit code.
[[nodiscard]] int write_imported(const ImportedVessel& vessel, const ImportSource& source, const ImportRequest& request,
                                 const std::filesystem::path& out, const std::string& scene_text = {});

/// Named facts of the source, and the repairs.
void print_facts(const ImportSource& source, const std::vector<std::string>& repairs);

/// try_scene, and where the scene is. Returns the exit code.
/// written  names of this import's files, which go again where the scene does not run; files of an earlier import stay
[[nodiscard]] int end_import(const ImportRequest& request, const std::filesystem::path& out, const std::vector<const char*>& written);

/// Reads the scene back and prepares it; explain.txt where it was not asked to be left out. Returns the exit code.
[[nodiscard]] int try_scene(const ImportRequest& request, const std::filesystem::path& out);

} // namespace trocar::engine
