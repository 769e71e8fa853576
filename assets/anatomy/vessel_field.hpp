// Arteries as one implicit shape: tubes of varying radius, each melting into those it springs from.
#pragma once

#include "assets/anatomy/field.hpp"
#include "base/box.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace trocar::anatomy {

/// A vessel's axis with radii. It blends with the tubes before it in the list, near its root only: farther along, tubes that
/// pass each other keep apart.
struct Tube {
    std::vector<Vec3> points;  // m, evenly spaced, finer than the radius
    std::vector<double> radii; // m, [point_count]
    double blend = 0.0;        // m, width of the fillet at the root
    double blend_begin = 0.0;  // m of arc length: the fillet fades from here
    double blend_end = 0.0;    // m of arc length: to here
};

/// Nearest place on a tube.
struct TubeHit {
    double distance; // m to the wall, negative inside
    double arc;      // m from the root
    double radius;   // m
};

[[nodiscard]] TubeHit nearest_on_tube(const Tube& tube, const Vec3& p);

class VesselField final : public Field {
public:
    explicit VesselField(std::vector<Tube> tubes);

    /// Exact within kReach of a wall and inside; beyond, kReach.
    [[nodiscard]] double value(const Vec3& p) const override { return look(p).value; }

    /// m, radius of the tube whose wall is nearest.
    [[nodiscard]] double local_radius(const Vec3& p) const { return look(p).radius; }

    [[nodiscard]] Box3 box() const;

    static constexpr double kReach = 0.012; // m

private:
    struct Run { // consecutive segments of one tube that matter in a cell
        Index tube, first, last;
    };
    struct Sample {
        double value, radius;
    };

    std::vector<Tube> tubes_;
    std::vector<double> spacing_; // [tube] m
    double cell_ = 0.005;         // m
    Vec3 origin_;
    std::array<std::int64_t, 3> size_{};
    std::vector<Index> cell_begin_; // [cell_count + 1] into runs_
    std::vector<Run> runs_;

    [[nodiscard]] Sample look(const Vec3& p) const;
    void sort_into_cells();
};

} // namespace trocar::anatomy
