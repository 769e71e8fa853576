// An organ from tetrahedra or from a surface, as a scene around it: its boundary, what holds it, how good its tetrahedra are.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"
#include "engine/importing/vessel_files.hpp"

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

namespace import_name {
inline constexpr const char* kOrganSurface = "organ.vtp";
inline constexpr const char* kOrganTets = "organ.vtu";
} // namespace import_name

struct OrganInput {
    std::optional<TetMesh> tets; // in the file's unit; none: a surface
    TriMesh surface;             // the tetrahedra's boundary, or what was read
    std::string split;           // what was split into tetrahedra, with counts; empty: nothing
};

/// fails  as read_tets and read_surface
[[nodiscard]] Result<OrganInput> read_organ(const std::filesystem::path& file);

struct OrganHold {
    Vec3 direction = Vec3::UnitZ(); // towards the part that is held
    double fraction = 0.15;         // of the extent along it
};

struct ImportedOrgan {
    std::optional<TetMesh> tets;      // m
    TriMesh surface;                  // m; closed, manifold, outward
    std::vector<std::string> repairs; // with counts
    std::vector<std::string> quality; // of the tetrahedra, sentences
    OrganHold hold;
};

/// scale  m, of the input's unit
/// fails  BadMesh: a surface that no repair closes, tetrahedra that are inverted or flat: which, and what helps
[[nodiscard]] Result<ImportedOrgan> import_organ(OrganInput input, double scale, MendMode mode, const OrganHold& hold);

[[nodiscard]] std::string organ_scene_text(const ImportedOrgan& organ, const ImportSource& source);
[[nodiscard]] std::vector<Result<void>> write_organ(const ImportedOrgan& organ, const ImportSource& source, const std::filesystem::path& folder);

} // namespace trocar::engine
