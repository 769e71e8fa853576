// Centrelines from other programs: curves with radii, or the surface that comes with them.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace trocar::engine {

struct NamedCurve {
    std::string name;
    std::vector<Vec3> points;  // m
    std::vector<double> radii; // m, [point_count]
};

struct CurveSet {
    std::vector<NamedCurve> curves;
    std::optional<TriMesh> surface; // m; instead of one that is swept along the curves
    std::vector<std::pair<std::string, std::string>> facts;
    std::vector<std::filesystem::path> files; // that it was read from
};

/// 3D Slicer: one .mrk.json, or a folder of them. Curves need the measurement Radius; other markups are passed over, and counted.
[[nodiscard]] Result<CurveSet> read_slicer(const std::filesystem::path& path);
/// VMTK: a .vtp with lines and MaximumInscribedSphereRadius, in mm; GroupIds that stand more than once are taken once, Blanking is kept.
[[nodiscard]] Result<CurveSet> read_vmtk(const std::filesystem::path& path);
/// SimVascular: a project's folder, in cm. The surface of Models/*.vtp where there is one; otherwise Paths/*.pth with the radii of
/// Segmentations/*.ctgr.
[[nodiscard]] Result<CurveSet> read_simvascular(const std::filesystem::path& path);

} // namespace trocar::engine
