#include "engine/viewer/scene_saver.hpp"

#include "engine/scene/recipe.hpp"

#include <filesystem>

namespace trocar::engine::viewer {

SceneSaver::SceneSaver(const Scene& scene) : scene_(scene) {
    std::error_code problem;
    if (!std::filesystem::is_regular_file(scene.file, problem)) return; // a pipe cannot be read twice
    if (auto text = read_json_file(scene.file); text.ok()) text_ = std::move(*text);
}

std::string SceneSaver::start(unsigned client, const Picks& picks, const SaveScene& asked) {
    if (saving_.valid()) return "another scene is being checked and saved; wait for it";
    client_ = client;
    saving_ = std::async(std::launch::async, [this, picks, asked] { return save_picked_scene(text_, scene_, picks, asked); });
    return {};
}

std::optional<SceneSaver::Answer> SceneSaver::take() {
    if (!saving_.valid() || saving_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return std::nullopt;
    return Answer{client_, saving_.get()};
}

} // namespace trocar::engine::viewer
