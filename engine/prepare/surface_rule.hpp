// Requirements on a surface by its use: one rule for the bodies of scenes and for `prepare`.
#pragma once

#include "base/repair.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"

#include <optional>
#include <string>
#include <vector>

namespace trocar::engine {

/// Requirements on a surface. Finite coordinates, and outward orientation where closed, are required of all.
struct SurfaceNeeds {
    std::string wanted;     // the use, for messages: "a lumen"
    bool closed = false;    // and manifold, consistently oriented, outward, every triangle with area
    bool uncrossed = false; // no triangle passes through another
};

/// The first requirement that a surface violates.
struct SurfaceDefect {
    std::string what;             // with counts and the first bad triangles
    std::optional<Repair> repair; // that is made for it
};
[[nodiscard]] std::optional<SurfaceDefect> find_defect(const TriMesh& mesh, const SurfaceReport& report, const SurfaceNeeds& needs);

/// A vertex with very many triangles round it, such as a polygon of that many corners makes: their boxes all overlap, and to repair
/// them, to search them for crossings or to cover them with spheres is to compare each with each. Copies, and triangles that
/// repeat a vertex, do not count: repairs take them away.
[[nodiscard]] Result<void> check_fans(const TriMesh& mesh);

/// "passes through itself: ..." of a surface that does or may, for notes; empty: it surely does not.
[[nodiscard]] std::string describe_crossings(const SelfIntersections& crossings);

/// Accepted defects, a note each.
[[nodiscard]] std::vector<std::string> list_leniencies(const SurfaceReport& report);

/// Repairs after which nothing is wrong any more, found by trying them.
struct RepairProposal {
    std::vector<Repair> repairs; // the whole chain, those that were asked for included where they help
    bool splits = false;         // one of them leaves more parts than it found, which has to be allowed
    SurfaceMeasure before, after;
};

/// Proposed repairs of a surface.
struct RepairAdvice {
    std::optional<RepairProposal> proposal;
    std::string obstacle; // why there is none: the error of the last try
};
/// raw     the surface before any repair        asked   the repairs that the user has requested
/// cost    bounded: a few chains of at most a dozen repairs, in few rounds; surfaces above 400,000 triangles are not tried
[[nodiscard]] RepairAdvice propose_repairs(const TriMesh& raw, std::span<const Repair> asked, const SurfaceNeeds& needs,
                                           const RepairOptions& options);

/// How a place asks for repairs: a scene's key, or `prepare`'s option.
enum class RepairWriting : std::uint8_t { SceneKey, Option };
/// "; \"repair\": [\"weld\", \"fill_holes\"] mends all of it: area ...", or why nothing does.
/// told  the sentence before it: an obstacle that says the same is not said twice
[[nodiscard]] std::string describe_advice(const RepairAdvice& advice, RepairWriting writing, std::string_view told = {});

} // namespace trocar::engine
