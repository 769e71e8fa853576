// A scene as Python holds it: what was read and what was prepared from it, immutable, shared by any number of simulators.
#pragma once

#include "engine/prepare/prepare_scene.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

namespace trocar::python {

/// What a scene is loaded from; the same of it gives the same model.
struct SceneSource {
    std::string file;                          // absolute; of a text, what its names of files are relative to
    std::string text;                          // empty: the file's
    std::string budget;                        // empty: the scene's
    std::optional<std::uint32_t> anatomy_seed; // of every recipe in it; none: the recipes' own
};

class LoadedScene {
public:
    LoadedScene(SceneSource source, engine::Scene scene, engine::PreparedScene prepared)
        : source_(std::move(source)), scene_(std::move(scene)), prepared_(std::move(prepared)) {}

    [[nodiscard]] const SceneSource& source() const noexcept { return source_; }
    [[nodiscard]] const engine::Scene& scene() const noexcept { return scene_; }
    [[nodiscard]] const engine::PreparedScene& prepared() const noexcept { return prepared_; }
    [[nodiscard]] const engine::SceneModel& model() const noexcept { return prepared_.model; }
    /// hash_model, found once.
    [[nodiscard]] std::uint64_t hash() const {
        std::call_once(hashed_, [&] { hash_ = engine::hash_model(model()); });
        return hash_;
    }

    /// At the scene's start, under these limits: copied from one that is kept for that, or one that was given back.
    [[nodiscard]] std::unique_ptr<engine::Simulator> take_simulator(const engine::BudgetLimits& limits) const;
    /// A simulator that nobody needs any more: the next fork is it, restored.
    void give_back(std::unique_ptr<engine::Simulator> simulator) const noexcept;

private:
    static constexpr std::size_t kMostIdle = 4;
    SceneSource source_;
    engine::Scene scene_;
    engine::PreparedScene prepared_;
    mutable std::once_flag hashed_;
    mutable std::uint64_t hash_ = 0;
    mutable std::mutex simulators_;
    mutable std::unique_ptr<const engine::Simulator> prototype_; // takes no step
    mutable std::vector<std::unique_ptr<engine::Simulator>> idle_;
};

using ScenePtr = std::shared_ptr<const LoadedScene>;

/// The scene as its source says, with its overrides.
/// fails  with the scene's file, line and key
[[nodiscard]] Result<engine::Scene> read_source(const SceneSource& source);

/// fails  as read_source and prepare_scene
/// throws what `progress` throws
[[nodiscard]] Result<ScenePtr> load_scene(SceneSource source, const engine::Progress& progress);

} // namespace trocar::python
