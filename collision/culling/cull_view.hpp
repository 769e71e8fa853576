// One view of prisms along one direction: what is drawn and queried, the picture's size, and the answers.
#pragma once

#include "collision/culling/cull_backend.hpp"

#include <vector>

namespace trocar::collision {

/// Drawn and queried in place of the prisms of triangles: convex hulls of static points.
struct CullHulls {
    std::vector<Vec3> points;   // finite; hull by hull
    std::vector<Index> begin;   // [hull_count + 1] into points; no hull is empty
    std::vector<Vec3> normals;  // [hull_count] where it lies flattest, of any length
    std::vector<Index> hull_of; // [prism_count] the first hull_count prisms are the hulls, the others are some of them once more
};

/// Filled by the culler, then queried; the lists keep their capacity from view to view.
struct CullView {
    std::vector<SweptCorners> prisms;          // finite corners
    CullHulls hulls;                           // in place of prisms where there are any
    std::vector<Triangle> corners;             // [prism_count]
    std::vector<Index> set_begin, set_members; // as CullJob
    std::vector<CullQuestion> questions;
    std::vector<std::size_t> question_begin;
    std::vector<Footprint> footprints; // [prism_count] of the last view
    std::vector<std::uint8_t> hits;    // [question_count] of the last view

    /// For prisms; not for hulls.
    void reserve(std::size_t prism_count, std::size_t question_count, std::size_t set_count);

    struct Settings {
        double reach = 0.0;                                // m, by which prisms grow
        int resolution = 0;                                // pixels a side; 0: what the backend prefers
        bool adapt = true;                                 // fewer pixels where footprints are large in the picture,
        double pixels_per_footprint = kPixelsPerFootprint; // on average
        CullMemory memory = CullMemory::Intervals;
    };
    struct Outcome {
        int resolution = 0;              // that was taken
        unsigned lowered_for_memory = 0; // times that the device had no memory for a picture and was given half the size
    };
    /// fails   as the backend does, but for a lack of memory that a smaller picture helps: that is taken, and counted
    [[nodiscard]] Result<Outcome> look(const ViewDirection& direction, const Settings& settings, CullBackend& backend);

private:
    void make_footprints(const ViewDirection& direction, double reach, int resolution);
};

} // namespace trocar::collision
