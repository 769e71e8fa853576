// All offline work: a scene becomes a model that can be stepped.
#pragma once

#include "base/result.hpp"
#include "engine/scene/scene.hpp"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace trocar::engine {

struct PreparedScene;
struct SceneModel;

/// Called before each part of the work with what comes next.
using Progress = std::function<void(const std::string&)>;

/// Tetrahedra of a deformable body's coarse mesh that one label of its file names.
struct RegionSummary {
    std::string name; // of the scene, else of the file; empty: neither names it
    std::int64_t label = 0;
    std::size_t tets = 0;
    double volume_m3 = 0.0;
    double young_modulus = 0.0; // Pa, at small strain
    double density = 0.0;       // kg/m^3
    bool has_own_tissue = false; // the scene says one
};

/// What preparation found and made, body by body, for `explain` and the report.
struct BodySummary {
    std::string name;
    std::size_t vertices = 0, triangles = 0;
    std::size_t coarse_nodes = 0, coarse_tets = 0, pinned_nodes = 0;
    double stable_step_s = 0.0; // deformable bodies, at rest
    std::size_t links = 0, static_links = 0, degenerate_links = 0;
    double longest_link_m = 0.0;
    std::size_t tree_spheres = 0, inscribed_spheres = 0;
    std::string region_array;           // that tells regions apart; empty: the body is of one tissue
    std::vector<RegionSummary> regions; // by label
    std::string fibres;                 // of hgo, how they lie
    std::vector<std::string> notes; // repairs, leniencies, warnings
};

/// A scene after all offline work, as programs hold it: never changed, shared by its copies and by every simulator of it, on any thread.
class Prepared {
public:
    explicit Prepared(PreparedScene scene);

    [[nodiscard]] const SceneModel& model() const noexcept;
    [[nodiscard]] std::span<const BodySummary> bodies() const noexcept; // as Scene::bodies
    [[nodiscard]] std::span<const Place> targets() const noexcept;      // as Scene::targets
    /// What preparing changed or found unreachable in what the scene asks.
    [[nodiscard]] std::span<const std::string> notices() const noexcept;
    [[nodiscard]] double seconds() const noexcept; // wall time of preparation

private:
    std::shared_ptr<const PreparedScene> scene_;
};

/// fails  with the scene's file, line and key
[[nodiscard]] Result<Prepared> prepare_scene(const Scene& scene, const Progress& progress = {});

} // namespace trocar::engine
