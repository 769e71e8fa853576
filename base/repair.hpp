// Named repairs that a scene may ask for. Each does one thing, says what it did in counts and what the surface measured before and
// after, and fails with an Error where the surface gives it nothing to work with, or where it would take more of the surface
// than it may. None runs unasked.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace trocar {

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

/// Share of the area, or of the enclosed volume, that one repair may take unasked.
inline constexpr double kUsualRemoval = 0.1;

struct RepairOptions {
    double weld_tolerance = 0.0;       // m; 0: 1e-6 of the longest box edge
    double may_remove = kUsualRemoval; // [-] share of the area and of the volume that one repair may take; 1: all of it
    bool may_split = false;            // a repair may leave more connected parts than it found
    int most_rounds = 40;              // of drop_self_intersections; every third one cuts a ring of triangles wider
    /// How the caller's users set the two, for messages.
    std::string_view may_remove_key = "\"may_remove\":", may_split_key = "\"may_split\": true";
};

/// How much surface there is.
struct SurfaceMeasure {
    std::size_t triangles = 0;
    std::size_t components = 0;   // of triangles, joined across shared edges
    double area = 0.0;            // m^2
    std::optional<double> volume; // m^3, signed; none unless every edge runs as often one way as the other: then it depends on no origin
    double shell_volumes = 0.0;   // m^3, where there is a volume: of each component, all taken positive
};
[[nodiscard]] SurfaceMeasure measure_surface(const TriMesh& mesh);

/// "area 0.152 to 0.153 m^2, volume open to 0.0017 m^3, components 1"; each number once where it stayed.
[[nodiscard]] std::string describe_change(const SurfaceMeasure& before, const SurfaceMeasure& after);

/// What one repair changed.
struct RepairStep {
    Repair repair = Repair::Weld;
    SurfaceMeasure before, after;
    std::size_t vertices_merged = 0;
    std::size_t vertices_split = 0;
    std::size_t triangles_removed = 0;
    std::size_t triangles_added = 0;
    std::size_t triangles_flipped = 0;
    std::size_t holes_filled = 0;
    std::size_t shells_removed = 0;
    std::size_t crossings_made = 0; // pairs of triangles, by fill_holes where no patch fits without

    /// "fill_holes: 628 triangles added, 12 holes filled; area 0.152 to 0.153 m^2, volume open to 0.0017 m^3, components 1 to 1",
    /// or "orient: nothing to do; area 0.152 m^2, ...".
    [[nodiscard]] std::string to_string() const;
};

struct RepairReport {
    std::vector<RepairStep> steps;
};

/// In the order given. On an Error the mesh is left as it was. BadMesh as well, with what it would have removed, where a repair
/// takes more than options.may_remove of the area or of the volume, or leaves more components than it found. Left out of the
/// count: copies (drop_duplicates), what lies inside what stays (drop_inner_shells), and components cut apart by drop_non_manifold.
[[nodiscard]] Result<RepairReport> apply_repairs(TriMesh& mesh, std::span<const Repair> repairs, const RepairOptions& options = {});

[[nodiscard]] Result<RepairStep> apply_repair(TriMesh& mesh, Repair repair, const RepairOptions& options = {});

} // namespace trocar
