#include "python/binding/loaded_scene.hpp"

#include <algorithm>

namespace trocar::python {

Result<engine::Scene> read_source(const SceneSource& source) {
    auto scene = source.text.empty() ? engine::read_scene(source.file) : engine::parse_scene(source.text, source.file);
    if (!scene.ok()) return scene;
    if (!source.budget.empty()) {
        const auto budget = engine::parse_budget(source.budget);
        if (!budget.ok()) {
            Error error = budget.error();
            error.key = "budget";
            return error;
        }
        scene->budget.limits = budget->limits;
    }
    if (source.anatomy_seed) {
        bool generated = false;
        for (engine::SceneBody& body : scene->bodies)
            if (body.surface.source == engine::SurfaceSource::Recipe) body.surface.recipe.seed = *source.anatomy_seed, generated = true;
        if (!generated)
            return Error{ErrorCode::BadUsage, "no body of this scene is generated from a recipe; expected no anatomy_seed", source.file, 0, 0, "anatomy_seed"};
    }
    return scene;
}

std::unique_ptr<engine::Simulator> LoadedScene::take_simulator(const engine::BudgetLimits& limits) const {
    {
        const std::lock_guard lock(simulators_);
        const auto same = [&](const auto& idle) {
            const engine::BudgetLimits& own = idle->budget();
            return own.mode == limits.mode && own.wall_s == limits.wall_s && own.work_units == limits.work_units;
        };
        if (const auto found = std::find_if(idle_.begin(), idle_.end(), same); found != idle_.end()) {
            auto taken = std::move(*found);
            idle_.erase(found);
            if (taken->restore(prototype_->raw_state()).ok()) return taken;
        }
        if (!prototype_) prototype_ = std::make_unique<const engine::Simulator>(model());
    }
    return std::make_unique<engine::Simulator>(*prototype_, limits);
}

void LoadedScene::give_back(std::unique_ptr<engine::Simulator> simulator) const noexcept {
    if (simulator->budget().mode == engine::BudgetMode::Wall) return; // it has learned rates that another one has not
    const std::lock_guard lock(simulators_);
    if (idle_.size() < kMostIdle) idle_.push_back(std::move(simulator));
}

Result<ScenePtr> load_scene(SceneSource source, const engine::Progress& progress) {
    auto scene = read_source(source);
    if (!scene.ok()) return scene.error();
    auto prepared = engine::make_prepared_scene(*scene, progress);
    if (!prepared.ok()) return prepared.error();
    return ScenePtr(std::make_shared<const LoadedScene>(std::move(source), std::move(*scene), std::move(*prepared)));
}

} // namespace trocar::python
