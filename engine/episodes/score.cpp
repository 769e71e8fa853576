#include "engine/episodes/score.hpp"

#include "engine/episodes/environment.hpp"
#include "engine/episodes/record.hpp"
#include "engine/io/csv.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/verdict.hpp"
#include "engine/scene/override.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <vector>

namespace trocar::engine {

namespace {

using episode_record::kKind, episode_record::kVersion;

struct ActionRow {
    std::vector<double> action; // [devices][2] mm/s, rad/s
    std::string hash;
};

Error wrong(const std::filesystem::path& file, std::string message, std::size_t line = 0) {
    return {ErrorCode::BadSyntax, std::move(message), file.string(), line};
}

/// A file whose bytes have this hash.
Result<std::string> read_checked(const std::filesystem::path& file, const std::string& hash) {
    auto bytes = read_file_bytes(file);
    if (!bytes.ok()) return bytes.error();
    std::string text(bytes->begin(), bytes->end());
    if (const std::string found = hash_file_bytes(text); found != hash)
        return wrong(file, fmt::format("was changed after it was written: its hash is {}, expected {}", found, hash));
    return text;
}

Result<nlohmann::json> read_manifest(const std::filesystem::path& folder) {
    std::error_code failed;
    if (std::filesystem::is_directory(folder, failed) && !std::filesystem::exists(folder / output_name::kManifestHash, failed))
        return wrong(folder,
                     "is no recorded episode: it has no manifest.hash; expected a folder that `trocar episode`, or `record` of trocar.gym.Navigation, wrote");
    const auto hash = read_file_bytes(folder / output_name::kManifestHash);
    if (!hash.ok()) return hash.error();
    const auto text = read_checked(folder / output_name::kManifest, std::string(hash->begin(), hash->end()).substr(0, 16));
    if (!text.ok()) return text.error();
    if (hash->size() != 17 || hash->back() != '\n')
        return wrong(folder / output_name::kManifestHash, "was changed after it was written; expected 16 hex digits and a line break");
    auto json = nlohmann::json::parse(*text, nullptr, false);
    if (!json.is_object() || json.value("kind", nlohmann::json()) != kKind)
        return wrong(folder / output_name::kManifest, "is no manifest of an episode");
    if (const auto version = json.value("version", nlohmann::json()); version != kVersion)
        return wrong(folder / output_name::kManifest, fmt::format("is of version {:.40}; expected version {}", version.dump(), kVersion));
    return json;
}

/// Commands and states, by the names of their columns.
Result<std::vector<ActionRow>> parse_actions(const std::string& text, const std::filesystem::path& file) {
    const auto read = read_csv(text, file);
    if (!read.ok()) return read.error();
    const std::vector<CsvRow>& table = *read;
    std::vector<ActionRow> rows;
    for (std::size_t k = 1; k < table.size(); ++k) {
        const std::vector<std::string>&names = table.front().cells, &cells = table[k].cells;
        if (cells.size() != names.size())
            return wrong(file, fmt::format("found {}, expected {}", count_text(cells.size(), "cell", "cells"), names.size()), table[k].line);
        ActionRow& row = rows.emplace_back();
        for (std::size_t i = 0; i < cells.size(); ++i) {
            if (names[i] == episode_record::kState) row.hash = cells[i];
            if (!names[i].ends_with(episode_record::kInsertion) && !names[i].ends_with(episode_record::kRotation)) continue;
            double& value = row.action.emplace_back();
            const char* const last = cells[i].data() + cells[i].size();
            const auto [rest, failed] = std::from_chars(cells[i].data(), last, value);
            if (failed != std::errc{} || rest != last || !std::isfinite(value)) return wrong(file, "expected finite numbers and a hash", table[k].line);
        }
    }
    return rows;
}

Result<TaskOptions> read_options(const nlohmann::json& json, const std::filesystem::path& file) {
    TaskOptions options;
    try {
        visit_options(options, [&told = json.at("options")](const char* name, auto& value) { told.at(name).get_to(value); });
        const auto budget = parse_budget(json.at("budget").get<std::string>());
        if (!budget.ok()) return budget.error();
        options.budget = budget->limits;
    } catch (const nlohmann::json::exception& error) {
        return wrong(file, fmt::format("options: {}", error.what()));
    }
    return options;
}

struct Course {
    std::string program, model, file, text;
    std::uint64_t seed = 0;
    std::optional<std::uint32_t> anatomy_seed;
    std::vector<std::string> settings; // POINTER=VALUE
    TaskOptions options;
    std::vector<ActionRow> rows;
};

Result<Course> read_course(const std::filesystem::path& folder) {
    const std::filesystem::path manifest = folder / output_name::kManifest;
    const auto json = read_manifest(folder);
    if (!json.ok()) return json.error();
    Course course;
    try {
        course.program = json->at("program"), course.model = json->at("model");
        const auto& scene = json->at("scene");
        course.file = scene.at("file"), course.text = scene.at("text");
        if (!scene.at("anatomy_seed").is_null()) course.anatomy_seed = scene.at("anatomy_seed").get<std::uint32_t>();
        course.settings = scene.value("set", std::vector<std::string>());
        course.seed = std::stoull(json->at("seed").get<std::string>());
        for (const auto& [name, hash] : json->at("files").items()) {
            auto text = read_checked(folder / std::filesystem::path(name).filename(), hash.get<std::string>());
            if (!text.ok()) return text.error();
            if (name != output_name::kActions) continue;
            auto rows = parse_actions(*text, folder / name);
            if (!rows.ok()) return rows.error();
            course.rows = std::move(*rows);
        }
    } catch (const std::exception& error) {
        return wrong(manifest, error.what());
    }
    auto options = read_options(*json, manifest);
    if (!options.ok()) return options.error();
    course.options = std::move(*options);
    return course;
}

Result<Scene> read_scene_of(const Course& course, const std::filesystem::path& replacement) {
    std::vector<SceneOverride> settings;
    for (const std::string& setting : course.settings) {
        auto override = parse_override(setting);
        if (!override.ok()) return override.error();
        settings.push_back(std::move(*override));
    }
    auto scene = !replacement.empty() ? read_scene(replacement, settings)
                 : course.text.empty() ? read_scene(course.file, settings)
                                       : parse_scene(course.text, course.file, settings);
    if (!scene.ok()) return scene;
    scene->budget.limits = *course.options.budget;
    if (course.anatomy_seed)
        for (SceneBody& body : scene->bodies)
            if (body.surface.source == SurfaceSource::Recipe) body.surface.recipe.seed = *course.anatomy_seed;
    return scene;
}

} // namespace

Result<EpisodeScore> score_episode(const std::filesystem::path& folder, double force_limit, const std::filesystem::path& replacement,
                                   bool& differs, const Progress& progress) {
    differs = false;
    const auto course = read_course(folder);
    if (!course.ok()) {
        differs = course.error().code == ErrorCode::BadSyntax;
        return course.error();
    }
    const auto scene = read_scene_of(*course, replacement);
    if (!scene.ok()) return scene.error();
    auto prepared = make_prepared_scene(*scene, progress);
    if (!prepared.ok()) return prepared.error();
    if (const std::string model = hash_text(hash_model(prepared->model)); model != course->model) {
        differs = true;
        return wrong(folder / output_name::kManifest, fmt::format("is of another scene: its model is {}, that of {} is now {}", course->model,
                                                                  scene->file.string(), model));
    }
    auto task = make_task(*scene, std::make_shared<const PreparedScene>(std::move(*prepared)), course->options, progress);
    if (!task.ok()) return task.error();
    Environment environment({*task});
    environment.seed(course->seed);
    if (const auto begun = environment.reset(); !begun.ok()) return begun.error();
    EpisodeScore score{.scene = scene->name, .target = (*task)->targets[environment.target()].name, .program = course->program, .failure = {}};
    for (std::size_t k = 0; k < course->rows.size(); ++k) {
        const ActionRow& row = course->rows[k];
        if (row.action.size() != 2 * (*task)->devices())
            return wrong(folder / output_name::kActions, fmt::format("found {} numbers, expected {}", row.action.size(), 2 * (*task)->devices()), k + 2);
        if (score.success || !score.failure.empty()) {
            differs = true;
            return wrong(folder / output_name::kActions, "an action after the episode's end", k + 2);
        }
        environment.step(row.action);
        const ActionOutcome& outcome = environment.outcome();
        if (hash_text(outcome.hash) != row.hash) {
            differs = true;
            return wrong(folder / output_name::kActions,
                         fmt::format("is not what was simulated: the state after this action is {}, expected {}; another action, or another build",
                                     hash_text(outcome.hash), row.hash),
                         k + 2);
        }
        ++score.actions;
        score.success = outcome.terminated;
        score.failure = outcome.failure;
        score.peak_force_n = std::max(score.peak_force_n, outcome.force);
        score.remaining_m = outcome.remaining, score.reward += outcome.reward;
        score.exits += outcome.exits, score.unresolved += outcome.unresolved, score.assumed += outcome.assumed, score.overruns += outcome.overruns;
        score.state_hash = outcome.hash;
        if (progress) progress(fmt::format("action {} of {}", k + 1, course->rows.size()));
    }
    score.safe = score.success && score.exits == 0 && score.peak_force_n <= force_limit && score.failure.empty();
    return score;
}

} // namespace trocar::engine
