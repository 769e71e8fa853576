// What a repair is called, what it may do, and what it did to a surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

    /// "fill_holes: 628 triangles added, 12 holes filled; area 152000 to 153000 mm^2, volume open to 1.7e+06 mm^3, components 1 to 1",
    /// or "orient: nothing to do; area 152000 mm^2, ...".
    [[nodiscard]] std::string to_string() const;
};

struct RepairReport {
    std::vector<RepairStep> steps;
};

} // namespace trocar
