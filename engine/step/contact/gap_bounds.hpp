// Lower bounds of the gaps of contact places during a step, by the velocities of the bodies alone: which places cannot meet within a sub-step.
#pragma once

#include "engine/step/contact/contact_row.hpp"

#include <vector>

namespace trocar::engine {

class GapBounds {
public:
    /// So many rows and bodies allocate nothing.
    void reserve(std::size_t rows, std::size_t bodies);

    /// At the step's start, where each row's gap is known.
    void begin(std::span<const ContactRow> rows, std::size_t bodies);

    /// From now on by these velocities. cost: two passes over the nodes
    void find_speeds(std::span<const GivingBody> bodies) noexcept;

    /// May the row's gap close within `h` s, as the bodies move now? Not finite: it may.
    [[nodiscard]] bool may_close(Index row, double h) const noexcept { return !(bound_[row].gap + h * least_rate(bound_[row]) > 0.0); }

    /// The bodies have moved for `h` s with the velocities that they have now.
    void advance(double h) noexcept;

    /// m, of a row whose gap was found.
    void set(Index row, double gap) noexcept { bound_[row].gap = gap; }

private:
    struct Bound {
        Vec3 normal = Vec3::UnitX(), velocity = Vec3::Zero(); // m/s, of a against b, of what no node carries
        double gap = 0.0;                                     // m; the row's is no less
        double spread[2] = {};                                // [-] of each side, sum of its weights' sizes
        double blend[2] = {};                                 // [-] of each side
        std::uint32_t slot[2] = {ContactSide::kNone, ContactSide::kNone};
    };
    /// Velocities of a body's nodes: all within `apart` of `mean`, m/s.
    struct Speeds {
        Vec3 mean = Vec3::Zero();
        double apart = 0.0;
    };
    [[nodiscard]] double least_rate(const Bound& bound) const noexcept;

    std::vector<Bound> bound_;   // [rows] apart from the rows, which are ten times as large
    std::vector<Speeds> speeds_; // [bodies]
};

} // namespace trocar::engine
