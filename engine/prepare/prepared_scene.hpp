// A scene after all offline work: the model to step, and what preparation found. Programs hold it as a Prepared.
#pragma once

#include "engine/prepare/load_surface.hpp"
#include "engine/prepare/model.hpp"
#include "engine/prepare/prepared.hpp"

#include <string>
#include <vector>

namespace trocar::engine {

struct PreparedScene {
    SceneModel model;
    std::vector<BodySummary> bodies; // as SceneModel::bodies
    std::vector<Place> targets;      // as Scene::targets
    std::vector<std::string> notices; // what preparing changed or found unreachable in what the scene asks: a run tells it
    double seconds = 0.0;            // wall time of preparation
};

/// Tetrahedra of deformable bodies, kept beside the model while others are embedded in them.
struct CoarseBodies {
    std::vector<TetMesh> meshes; // [body_count], empty where a body does not deform
};

} // namespace trocar::engine
