// A generated patient: a liver and the arteries from the groin to the liver's segments, with a centreline and landmarks.
//
// Frame: x to the patient's right, y from back to front, z from feet to head (right-handed); seen from the front the liver
// is on the left of the picture, as in a radiograph. The origin is in front of the spine, at the height of the groin.
//
// The liver is a smooth implicit shape; the trunk arteries are curves through anatomical way points; the intrahepatic tree
// is grown by constrained constructive optimisation with Murray's law (Schreiner & Buxbaum 1993; Karch et al. 1999).
// Deviates: radii follow from the flows alone, branching points are bounded to gentle angles, and the segments become
// smooth curves, so that a catheter can take every turn.
#pragma once

#include "assets/anatomy/recipe.hpp"
#include "base/mesh.hpp"
#include "base/result.hpp"

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::anatomy {

struct Landmark {
    std::string name;
    Vec3 position = Vec3::Zero();   // m, on a vessel's axis
    Vec3 direction = Vec3::UnitZ(); // unit, along the axis, away from the groin
    double radius = 0.0;            // m, of the lumen there
};

/// One vessel between two forks (or a fork and an end), named as in the atlas where it has a name.
struct Branch {
    std::string name;
    Index parent = kNoIndex;   // branch it leaves
    double radius = 0.0;       // m, nominal: the lumen's beyond the taper at its root
    bool intrahepatic = false; // part of the optimised tree, Murray's law holds at its end
};

/// Polyline tree, rooted at the groin's end: following parents from a target gives the catheter's way backwards.
/// A parent's id is always lower than its child's. Arrays are [node_count].
struct Centreline {
    std::vector<Vec3> points;                        // m
    std::vector<double> radii;                       // m, of the tube around the axis; fillets and funnels are wider
    std::vector<Index> parent;                       // node, kNoIndex at the root
    std::vector<Index> branch;                       // into branches
    std::vector<Branch> branches;                    // [branch_count]
    std::map<std::string, Index, std::less<>> named; // landmark name -> node
};

struct Anatomy {
    TriMesh liver; // closed
    TriMesh lumen; // closed: all arteries as one surface, ends rounded
    Centreline centreline;
    std::vector<Landmark> landmarks; // femoral_entry, coeliac_ostium, tumour, segment_1 .. segment_n
};

/// Same recipe, same bits. BadValue for a recipe out of range, BadMesh when no valid patient was found for this seed.
/// cost  a few seconds at the default size
[[nodiscard]] Result<Anatomy> generate(const Recipe& recipe);

/// nullptr when there is none of that name.
[[nodiscard]] const Landmark* find_landmark(const Anatomy& anatomy, std::string_view name) noexcept;

/// Names of the parts that find_part knows: "liver", "lumen" (also called "arteries").
[[nodiscard]] const TriMesh* find_part(const Anatomy& anatomy, std::string_view name) noexcept;

} // namespace trocar::anatomy
