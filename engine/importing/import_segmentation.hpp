// A label map's segment as a surface with what the import has to tell about it.
#pragma once

#include "engine/importing/label_surface.hpp"

#include <filesystem>
#include <utility>

namespace trocar::engine {

struct SegmentSurface {
    TriMesh mesh;                   // m, right anterior superior
    std::vector<VesselEnd> cut;     // where a side of the volume cuts it
    std::vector<std::string> repairs;
    std::vector<std::pair<std::string, std::string>> facts; // named: voxels, spacing, surface, assumptions
};

/// label  a segment's name or number; empty: the only one
[[nodiscard]] Result<SegmentSurface> read_segment(const std::filesystem::path& file, const std::string& label, const LabelSurfaceOptions& options,
                                                  const std::function<void(const std::string&)>& progress = {});

} // namespace trocar::engine
