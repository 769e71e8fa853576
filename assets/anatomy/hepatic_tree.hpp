// The intrahepatic arteries by constrained constructive optimisation: ends are added one by one, each joined to the segment
// and at the point that cost the least blood (Schreiner & Buxbaum 1993; Karch et al. 1999). Radii follow from the flow by
// Murray's law. Deviates: no pressures; joins with sharp angles, short legs, or too near to another vessel or to the
// liver's surface are refused.
#pragma once

#include "assets/anatomy/liver.hpp"
#include "assets/anatomy/random.hpp"
#include "assets/anatomy/recipe.hpp"

#include <optional>
#include <vector>

namespace trocar::anatomy {

struct TreeSegment {
    Vec3 from = Vec3::Zero(), to = Vec3::Zero(); // m
    Index parent = kNoIndex;                     // kNoIndex: springs from the proper hepatic artery
    Index major = kNoIndex, minor = kNoIndex;    // children; major goes on more straightly; both kNoIndex at an end
    double flow = 0.0;                           // [-] in units of a terminal's
    bool forkable = true;                        // may new vessels spring from it
};

struct HepaticTree {
    std::vector<TreeSegment> segments; // 0: right hepatic artery, 1: left hepatic artery
    Index tumour = kNoIndex;           // the end segment that feeds it

    [[nodiscard]] double flow() const { return segments[0].flow + segments[1].flow; }
};

/// m, by Murray's law
[[nodiscard]] double murray_radius(const Recipe& recipe, double flow);

/// approach  unit, direction of the proper hepatic artery where it divides
/// returns   nothing when the ends could not all be joined: try again with another random sequence
[[nodiscard]] std::optional<HepaticTree> grow_hepatic_tree(const Recipe& recipe, const LiverShape& liver, const Vec3& approach,
                                                           Random& random);

} // namespace trocar::anatomy
