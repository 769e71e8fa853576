// Regions of a body's coarse mesh: which tetrahedra its file gives which label, and what their tissue is.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/io/split_cells.hpp"
#include "engine/prepare/prepared.hpp"
#include "engine/scene/scene.hpp"
#include "fem/tissue/tissue.hpp"

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

/// One label for each tetrahedron.
struct TetLabels {
    std::string array;
    std::vector<std::int64_t> of_tet;          // [tet_count]
    std::map<std::int64_t, std::string> names; // of labels, where the file names them
};

/// Labels by an array of the file. Without a name: the array whose name, or whose format, is usual for regions (region, material, label, ...,
/// gmsh:physical, medit:ref, tetgen:ref, vega:region, gmsh:geometrical), or else the only one of at most kMostRegions integers, two cells to each.
/// fails  BadValue, without a file: no such array, or none that looks like regions (which there are); a value that is no label of a scene, a number of
///        values that is not that of the cells, more than kMostRegions labels
[[nodiscard]] Result<TetLabels> find_tet_labels(const BesideTets& beside, std::string_view array = {});
inline constexpr std::size_t kMostRegions = 256;

/// The labels in ascending order with what each takes up. mesh in m
[[nodiscard]] std::vector<RegionSummary> measure_regions(const TetMesh& mesh, const TetLabels& labels);

struct TissueRegions {
    std::vector<double> stiffness, density; // [tet_count] factors on the body's material; empty: all are 1
    std::string array;
    std::vector<RegionSummary> list; // by label
};

/// Of a body whose coarse mesh is a file's. mesh: placed, in m. Nothing where the scene names no region.
/// fails  with the scene's file, line and key, and the labels that there are
[[nodiscard]] Result<TissueRegions> make_tissue_regions(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const BesideTets& beside);

} // namespace trocar::engine
