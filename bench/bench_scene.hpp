// A scene that a bench steps.
#pragma once

#include "bench/bench_table.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/scene/scene.hpp"

#include <filesystem>
#include <utility>

namespace trocar::engine {

struct SteppedScene {
    Scene scene;
    PreparedScene prepared;
};

/// Reads and prepares it, and notes it in the table.
[[nodiscard]] inline Result<SteppedScene> prepare_for_bench(const std::filesystem::path& file, const BenchOptions& options, BenchTable& table) {
    Result<Scene> scene = read_scene(file);
    if (!scene.ok()) return scene.error();
    Result<PreparedScene> prepared = make_prepared_scene(*scene, [&](const std::string& what) { options.progress("preparing " + what); });
    if (!prepared.ok()) return prepared.error();
    note_scene(table, *scene, prepared->model);
    return SteppedScene{std::move(*scene), std::move(*prepared)};
}

} // namespace trocar::engine
