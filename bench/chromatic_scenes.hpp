// The scenes of Govindaraju et al. 2005, generated: cloth that folds, two curtains, a catheter in its vessel.
#pragma once

#include "collision/topology.hpp"
#include "engine/io/frames.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

struct CullScene {
    std::string name;
    FrameSequence frames;                             // of all surfaces together
    std::vector<collision::SurfaceTopology> surfaces; // by object, over the vertices of all
    bool within = true, between = false;              // the contacts searched for
    const char* paper_ms = "";                        // per step, Govindaraju et al. 2005: Pentium IV 3.4 GHz, GeForce 6800
    const char* paper_sets = "";

    [[nodiscard]] std::size_t triangle_count() const noexcept;
    [[nodiscard]] std::size_t step_count() const noexcept { return frames.frame_count - 1; }
    [[nodiscard]] std::vector<collision::SurfaceMotion> motions(std::size_t step) const;
    [[nodiscard]] std::vector<const collision::SurfaceTopology*> topologies() const;
};

/// Surfaces that are one object each; `name` and the rest are the caller's.
[[nodiscard]] CullScene make_cull_scene(std::string name, FrameSequence frames);

/// Steps of a fold in which pleats press into each other.
[[nodiscard]] CullScene make_cloth_scene(std::string name, std::size_t columns, std::size_t rows, std::size_t steps);
/// Two curtains, the second one a copy that overlaps the first along its edge.
[[nodiscard]] CullScene make_curtains_scene(std::size_t columns, std::size_t rows, std::size_t steps);
[[nodiscard]] CullScene make_catheter_scene(std::size_t steps);
/// Its catheter against itself, without the vessel.
[[nodiscard]] CullScene make_catheter_alone_scene(std::size_t steps);

} // namespace trocar::engine
