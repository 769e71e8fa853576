// Named repairs that a scene may ask for. Each does one thing, says what it did in counts, and fails with an Error where the
// surface gives it nothing to work with. None runs unasked.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace seldinger {

enum class Repair : std::uint8_t {
    Weld,                  // merge vertices closer than the tolerance; triangles that collapse by it go
    DropDegenerate,        // remove triangles without area: the ones with a repeated vertex, then needles and caps by edge flips
    DropDuplicates,        // of triangles with the same three vertices keep the first
    DropNonManifold,       // cut the surface open at edges of three or more triangles and at pinched vertices
    FillHoles,             // close every border loop
    Orient,                // consistent within each shell, and outward as a whole
    DropInnerShells,       // keep outer skins: of a double shell the outer one, of nested shells the outermost
    KeepLargest,           // keep the component with the largest surface area
    DropSelfIntersections, // remove crossing triangles and close the gap, until none cross
};
inline constexpr std::size_t kRepairCount = 9;

/// As scenes spell it: weld, drop_degenerate, drop_duplicates, drop_non_manifold, fill_holes, orient, drop_inner_shells,
/// keep_largest, drop_self_intersections.
[[nodiscard]] std::string_view repair_name(Repair repair) noexcept;
[[nodiscard]] std::optional<Repair> find_repair(std::string_view name) noexcept;
[[nodiscard]] std::span<const std::string_view> repair_names() noexcept;

struct RepairOptions {
    double weld_tolerance = 0.0; // m; 0: 1e-6 of the longest box edge
};

/// What one repair changed.
struct RepairStep {
    Repair repair = Repair::Weld;
    std::size_t vertices_merged = 0;
    std::size_t vertices_split = 0;
    std::size_t triangles_removed = 0;
    std::size_t triangles_added = 0;
    std::size_t triangles_flipped = 0;
    std::size_t holes_filled = 0;
    std::size_t shells_removed = 0;

    /// "fill_holes: 628 triangles added, 12 holes filled", or "orient: nothing to do".
    [[nodiscard]] std::string to_string() const;
};

struct RepairReport {
    std::vector<RepairStep> steps;
};

/// In the order given. On an Error the mesh is left as it was.
[[nodiscard]] Result<RepairReport> apply_repairs(TriMesh& mesh, std::span<const Repair> repairs, const RepairOptions& options = {});

[[nodiscard]] Result<RepairStep> apply_repair(TriMesh& mesh, Repair repair, const RepairOptions& options = {});

} // namespace seldinger
