// An organ from tetrahedra or from a surface, as a scene around it: its boundary, what holds it, how good its tetrahedra are.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/importing/vessel_files.hpp"
#include "engine/prepare/tissue_regions.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

namespace import_name {
inline constexpr const char* kOrganSurface = "organ.vtp";
inline constexpr const char* kOrganTets = "organ.vtu";
inline constexpr const char* kRegionArray = "region"; // of kOrganTets
} // namespace import_name

struct OrganInput {
    std::optional<TetMesh> tets; // in the file's unit; none: a surface
    TriMesh surface;             // the tetrahedra's boundary, or what was read
    std::string split;           // what was split into tetrahedra, with counts; empty: nothing
    TetLabels labels;            // of the tetrahedra; of_tet empty: all are of one region, or nothing says of which
    std::string labels_note;     // why cell arrays that are there are not taken; empty: there is nothing to say
};

/// region_array  that says which region a cell belongs to; empty: as find_tet_labels finds it
/// Cell arrays that cannot be read are left out with a note where none is named.
/// fails  as read_tets and read_surface, and as find_tet_labels where an array is named
[[nodiscard]] Result<OrganInput> read_organ(const std::filesystem::path& file, const std::string& region_array = {});

struct OrganHold {
    Vec3 direction = Vec3::UnitZ(); // towards the part that is held
    double fraction = 0.15;         // of the extent along it
};

struct ImportedOrgan {
    std::optional<TetMesh> tets;      // m
    TriMesh surface;                  // m; closed, manifold, outward
    std::vector<std::string> repairs; // with counts
    std::vector<std::string> quality; // of the tetrahedra, sentences
    TetLabels labels;                 // as those of the input
    std::vector<RegionSummary> regions; // by label, each with a name of its own as scenes take names; no material yet
    std::string labels_note;
    OrganHold hold;
};

/// scale  m, of the input's unit
/// fails  BadMesh: a surface that no repair closes, tetrahedra that are inverted or flat: which, and what helps
[[nodiscard]] Result<ImportedOrgan> import_organ(OrganInput input, double scale, MendMode mode, const OrganHold& hold);

/// "tumour (label 2): 120 tetrahedra, 340 mm^3"
[[nodiscard]] std::string describe_region(const RegionSummary& region);

[[nodiscard]] std::string organ_scene_text(const ImportedOrgan& organ, const ImportSource& source);
[[nodiscard]] std::vector<Result<void>> write_organ(const ImportedOrgan& organ, const ImportSource& source, const std::filesystem::path& folder);

} // namespace trocar::engine
