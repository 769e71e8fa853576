// A scene after all offline work: the model to step, and what preparation found.
#pragma once

#include "engine/prepare/load_surface.hpp"
#include "engine/prepare/model.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

/// What preparation found and made, body by body, for `explain` and the report.
struct BodySummary {
    std::string name;
    std::size_t vertices = 0, triangles = 0;
    std::size_t coarse_nodes = 0, coarse_tets = 0, pinned_nodes = 0;
    double stable_step_s = 0.0; // deformable bodies, at rest
    std::size_t links = 0, static_links = 0, degenerate_links = 0;
    double longest_link_m = 0.0;
    std::size_t tree_spheres = 0, inscribed_spheres = 0;
    std::vector<std::string> notes; // repairs, leniencies, warnings
};

struct PreparedScene {
    SceneModel model;
    std::vector<BodySummary> bodies; // as SceneModel::bodies
    std::vector<Place> targets;      // as Scene::targets
    std::vector<std::string> notices; // what preparing changed or found unreachable in what the scene asks: a run tells it
    double seconds = 0.0;            // wall time of preparation
};

} // namespace trocar::engine
