// Holding motion back so that nothing passes through anything.
#pragma once

#include "base/contact.hpp"
#include "collision/contacts.hpp"

#include <span>
#include <vector>

namespace seldinger::collision {

/// Lowers each vertex's fraction to the smallest safe time of the contacts it takes part in.
/// contacts   and safe_times side by side, as ContactFinder gave them
/// body       whose vertices these are
/// fraction   [vertex_count] in [0, 1], lowered only: fill with 1 first
void lower_fractions(std::span<const Contact> contacts, std::span<const double> safe_times, BodyId body, std::span<double> fraction);

/// t1 = t0 + fraction (t1 - t0), per vertex; a fraction of 1 leaves t1's bits alone, 0 gives t0's.
void shorten(std::span<const Vec3> t0, std::span<const double> fraction, std::span<Vec3> t1);

/// One body of a pair whose motion may be shortened in place.
struct HeldSurface {
    const SurfaceTopology* topology;
    BoxTree* tree;
    std::span<const Vec3> t0; // [vertex_count] m
    std::span<Vec3> t1;       // [vertex_count] m, shortened where needed
};

struct HoldReport {
    std::uint32_t rounds = 0;      // searches made
    std::uint32_t held = 0;        // vertices whose motion was shortened
    double smallest_fraction = 1.0;
    bool proven = false;           // the motion that is left was searched and is free, or is a prefix of one that was
};

/// Shortens motions until they are proven free of touching. Vertices in contact first, each by its own fraction: shapes change
/// differently then, so the shortened motion is searched again. After max_rounds, all vertices by one fraction: a prefix of the
/// last motion searched needs no search. Surfaces that touch at t0 already stay there: proven, and smallest_fraction 0; so does
/// everything when the budget runs out. The two bodies need different ids. A shortened position is rounded once, to 1e-16 of
/// its coordinates: the kept gap, kKeptGap of the distance, has to be larger than that.
class MotionHolder {
public:
    HoldReport hold(ContactFinder& finder, HeldSurface a, HeldSurface b, const ExactOptions& options, WorkBudget& budget,
                    unsigned max_rounds = 3);

private:
    static void apply(std::span<const double> round, const HeldSurface& surface, std::span<double> fraction);

    std::vector<Contact> contacts_;
    std::vector<double> fraction_a_, fraction_b_; // of the motion that was asked for
    std::vector<double> round_a_, round_b_;       // of the motion that the round before left
};

} // namespace seldinger::collision
