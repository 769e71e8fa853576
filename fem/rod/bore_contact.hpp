// A rod in the bore of another one, with play: places of the inner one that stay within the play of the outer one's axis (RodMeeting::play).
// docs/contact.md, "A rod in another's bore".
//
// Places are the nodes of the rod with the shorter segments, against the smooth curve through the nodes of the other one: against its chords a
// bent rod would be held straight between its nodes. The bore's mouth, and the inner rod's tip where it is in the bore, are places as well.
#pragma once

#include "fem/rod/moved_rod.hpp"

#include <vector>

namespace trocar::fem {

/// [-] of the play: nearer than this to the axis the direction to it is that of before.
inline constexpr double kLeastAside = 1e-3;
/// [-] k of docs/contact.md, of the rods' own stiffness, as kSelfAugmentation.
inline constexpr double kBoreAugmentation = 0.6;

/// A point of a rod's smooth curve: the cubic through its nodes with the directions of their neighbours' chords (Catmull & Rom 1974).
struct CurvePoint {
    Index node = 0;      // its chord is between this and the next
    double weight = 0.0; // of the next
    Vec3 beside = Vec3::Zero(); // m, from the chord's point
    Vec3 along = Vec3::UnitZ(); // unit
};

/// The point next to `place`, sought from the chord `start` on.
/// axis   [node_count] m
/// fails  never; where nodes coincide `along` is the zero vector
[[nodiscard]] CurvePoint find_on_curve(std::span<const Vec3> axis, const Vec3& place, Index start) noexcept;

/// m, by which a place is beyond the bore that it is in, sought anew where the rods are; 0 in it.
/// inner, outer   [node_count] m, of the rods of a meeting with play
[[nodiscard]] double find_bore_excess(const RodMeeting& meeting, std::span<const Vec3> inner, std::span<const Vec3> outer) noexcept;

/// The limits of `inner` in the bore of `outer`, at the step's end; those of the last step hand on their forces.
/// last       meetings that had a force; what a place had that is none any more goes to the mouth, or the tip
/// meetings   appended to
void list_bore(const MovedRod& outer, const MovedRod& inner, std::span<const RodMeeting> last, std::vector<RodMeeting>& meetings);

} // namespace trocar::fem
