// What an imported vessel is written as: a scene that runs as it is, the surface, the centreline, and what was done to get there.
#pragma once

#include "engine/importing/import_vessel.hpp"

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace trocar::engine {

/// Names of the files in the output folder.
namespace import_name {
inline constexpr const char* kScene = "scene.json";
inline constexpr const char* kSurface = "vessel.vtp";
inline constexpr const char* kStl = "vessel.stl";
inline constexpr const char* kCentreline = "centreline.vtp";
inline constexpr const char* kMarkups = "centreline.mrk.json";
inline constexpr const char* kReport = "import.json";
inline constexpr const char* kExplain = "explain.txt";
} // namespace import_name

/// Where the anatomy came from, for the scene's comment and the report.
struct ImportSource {
    std::string name;                                        // of the scene
    std::string file;                                        // as the user named it
    std::vector<std::pair<std::string, std::string>> facts; // unit, frame, ...: named
    double unit = 1.0;                                       // m, of one unit of the file
};

[[nodiscard]] std::string vessel_scene_text(const ImportedVessel& vessel, const ImportSource& source);
[[nodiscard]] std::string vessel_report_text(const ImportedVessel& vessel, const ImportSource& source);

/// All files of a vessel, the scene last. Coordinates in mm, in the frame of the source.
/// scene_text  in place of vessel_scene_text; empty: that
[[nodiscard]] std::vector<Result<void>> write_vessel(const ImportedVessel& vessel, const ImportSource& source,
                                                     const std::filesystem::path& folder, const std::string& scene_text = {});

/// As VMTK names it: point data MaximumInscribedSphereRadius, cell data GroupIds, CenterlineIds, TractIds, Blanking; one line a branch.
/// Coordinates and radii in mm.
[[nodiscard]] Result<void> write_centreline_vtp(const std::filesystem::path& path, std::span<const CentrelineBranch> branches);

} // namespace trocar::engine
