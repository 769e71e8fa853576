// The techniques of "Hierarchical techniques in collision detection for cloth animation" (Mezger, Kimmerle, Etzmuss 2003) as switches of
// one search for proximities, each of which says whether it may change the answer.
#pragma once

#include "base/result.hpp"

#include <array>
#include <cstdint>
#include <string_view>

namespace trocar::collision {

enum class Exactness : std::uint8_t {
    Exact,     // on or off: the same proximities, to the bit
    Heuristic, // may lose some; how many is measured by `trocar bench seed001`
};

/// How bounds grow so that they hold what comes near during the step (sections 3.2, 3.3). To all of them d_close/2 is added.
enum class Inflation : std::uint8_t {
    Plain,         // by the fastest vertex of the surface, on all sides alike; exact
    OrientedPaper, // v max(0, n.c) along each direction n: the mean axis c alone; nothing where there is no direction; heuristic
    OrientedSafe,  // v max(0, cos(max(0, angle(n, c) - phi))) with the half angle phi; v on all sides where there is no direction; exact
    Swept,         // both ends of every vertex's path are bounded: what the paper calls twice the cost of the leaves; exact
};

/// Where a surface is not tested against itself because it is too flat to meet itself (section 5.1).
enum class NormalCones : std::uint8_t {
    Off,     // every node is
    Alone,   // not where the normals' cone is narrow; misses flat pieces with a concave outline; heuristic
    Groups,  // the same, not applied between face groups that are not adjacent: as in the paper; heuristic
    Contour, // not where the cone is below pi/2 and the outline, seen along its axis, does not meet itself; exact for what meets
             // (self_distance 0), at any time of the step; a heuristic for what only comes near
};

/// What of the last step is used again (section 6.3).
enum class Coherence : std::uint8_t {
    None,
    SeparationList, // Li, Chen 1998: start where the last traversal stopped; exact
    VelocityCones,  // pairs of nodes that moved little relative to each other keep their results; heuristic, with a bound:
                    // nothing nearer than d_close - 2 reuse_limit is lost
};

enum class LeafTest : std::uint8_t {
    Faces,    // faces against faces
    Vertices, // vertices of the later body against faces of the earlier one: the baseline of the paper's figure 8; misses; heuristic
};

struct ProximityOptions {
    double distance = 1e-3;       // m, d_close between surfaces, >= 0
    double self_distance = 0.0;   // m, within one surface; 0: what meets, decided without rounding
    bool during_step = true;      // also what comes as near on the way to t1; false: at t0 only
    bool between = true;          // surfaces against each other
    std::uint64_t within = ~0ull; // bit b: body b against itself; faces that share a vertex do not count. Bodies beyond 63: bit 63

    std::size_t dop = 18;  // 6, 14, 18, 26
    std::size_t arity = 4; // 2, 4, 8
    Inflation inflation = Inflation::OrientedSafe;
    double lazy_tolerance = 0.0; // m, section 4.3: vertices that moved less keep their bounds, which are wider by it; 0: off. Exact
    double significance = 0.0;   // m per step: slower vertices do not turn a velocity cone (section 5.2). Exact

    NormalCones normal_cones = NormalCones::Contour;
    double cone_half_angle = 1.4; // rad, < pi/2 - 0.005: Alone and Groups accept cones up to this. The paper's apex angle pi - margin
    std::size_t group_count = 32; // 1 .. 64, face groups of a surface, for Groups and for the leaf angle
    double leaf_angle = 0.0;      // rad, section 6.2: faces of one group or adjacent ones count only if their normals differ by more; 0:
                                  // off. Heuristic

    Coherence coherence = Coherence::None;
    std::size_t rebuild_after = 10; // SeparationList: steps after which the list is made anew
    double reuse_limit = 0.0;       // m, VelocityCones: results are kept until their nodes may have moved so far, > 0

    LeafTest leaf_test = LeafTest::Faces;
    bool simd = true; // false: the scalar reference of the overlap test
};

/// One switch: its name, what it may change, and why.
struct PolicyLabel {
    std::string_view policy;
    Exactness exactness;
    std::string_view why;
};
inline constexpr std::array kPolicyLabels{
    PolicyLabel{"k and arity", Exactness::Exact, "every box holds its faces, rounded outwards"},
    PolicyLabel{"lazy refit", Exactness::Exact, "boxes are wider by the tolerance, and no vertex has left it"},
    PolicyLabel{"plain inflation", Exactness::Exact, "d_close/2 and the fastest vertex's way"},
    PolicyLabel{"oriented inflation, paper", Exactness::Heuristic, "the mean axis says nothing about the other vertices"},
    PolicyLabel{"oriented inflation, safe", Exactness::Exact, "holds every velocity within the cone's half angle"},
    PolicyLabel{"extrapolated vertices", Exactness::Exact, "both ends of a straight way hold the way"},
    PolicyLabel{"normal cones", Exactness::Heuristic, "a flat piece with a concave outline can meet itself"},
    PolicyLabel{"normal cones and groups", Exactness::Heuristic, "so can two adjacent groups"},
    PolicyLabel{"normal cones and contour", Exactness::Exact, "Volino, Magnenat-Thalmann 1994; for what meets, not for what comes near"},
    PolicyLabel{"angle of leaf faces", Exactness::Heuristic, "parallel sheets of adjacent groups are not told from one flat sheet"},
    PolicyLabel{"separation list", Exactness::Exact, "the list cuts every path of the traversal"},
    PolicyLabel{"velocity cones' reuse", Exactness::Heuristic,
                "what came near meanwhile is not seen; nothing nearer than d_close - 2 "
                "reuse_limit is lost"},
    PolicyLabel{"vertices against faces alone", Exactness::Heuristic, "edges pass through faces between the vertices (figure 8)"},
};

/// Exact only if every switch is, for these distances.
[[nodiscard]] Exactness exactness_of(const ProximityOptions& options) noexcept;

/// fails   with the option, its value and what was expected
[[nodiscard]] Result<void> check_options(const ProximityOptions& options);

} // namespace trocar::collision
