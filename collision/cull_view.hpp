// One look at prisms along one direction: what is drawn and asked, the picture's size, and the answers.
#pragma once

#include "collision/cull_backend.hpp"

#include <vector>

namespace seldinger::collision {

/// Filled by whoever culls, then asked; the lists keep their room from look to look.
struct CullView {
    std::vector<SweptCorners> prisms;          // finite corners
    std::vector<Triangle> corners;             // [prism_count]
    std::vector<Index> set_begin, set_members; // as CullJob
    std::vector<CullQuestion> questions;
    std::vector<std::size_t> question_begin;
    std::vector<Footprint> footprints; // [prism_count] of the last look
    std::vector<std::uint8_t> hits;    // [question_count] of the last look

    struct Settings {
        double reach = 0.0; // m, by which prisms grow
        int resolution = 0; // pixels a side; 0: what the backend prefers
        bool adapt = true;  // fewer pixels where triangles are large in the picture
        CullMemory memory = CullMemory::Intervals;
    };
    struct Outcome {
        int resolution = 0;              // that was taken
        unsigned lowered_for_memory = 0; // times that the device had no memory for a picture and was given half the size
    };
    /// fails   as the backend does, but for a lack of memory that a smaller picture helps: that is taken, and counted
    [[nodiscard]] Result<Outcome> look(const ViewDirection& direction, const Settings& settings, CullBackend& backend);
};

} // namespace seldinger::collision
