#include "engine/episodes/record.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/io/csv.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/state/bit_hash.hpp"
#include "engine/step/model_hash.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace trocar::engine {

namespace {

using Json = nlohmann::ordered_json;

Json scene_json(const SceneModel& model, const EpisodeSource& source) {
    std::error_code failed;
    const std::filesystem::path whole = std::filesystem::absolute(source.scene, failed);
    Json json{{"name", model.name}, {"file", (failed ? source.scene : whole).lexically_normal().string()}, {"text", source.text}};
    json["anatomy_seed"] = source.anatomy_seed ? Json(*source.anatomy_seed) : Json();
    json["set"] = source.settings;
    return json;
}

} // namespace

std::string record_columns(const SceneModel& model) {
    std::string text;
    for (const auto& instrument : model.instruments)
        for (const char* what : {episode_record::kInsertion, episode_record::kRotation}) text += csv_cell(instrument.name + what) + ",";
    return text + episode_record::kState;
}

std::string record_cells(std::span<const double> action, std::uint64_t state_hash) {
    return fmt::format("{},{}", fmt::join(action, ","), hash_text(state_hash));
}

bool can_be_recorded(const Task& task) noexcept { return task.budget.mode != BudgetMode::Wall; }

Result<void> write_manifest(const Task& task, const EpisodeSource& source, std::uint64_t seed,
                            std::span<const std::string> files, const std::filesystem::path& folder) {
    Json json{{"kind", episode_record::kKind}, {"version", episode_record::kVersion}};
    json["program"] = fmt::format("{}, commit {}", build_facts().version, build_facts().commit);
    json["model"] = hash_text(hash_model(task.model()));
    json["scene"] = scene_json(task.model(), source);
    json["seed"] = std::to_string(seed);
    json["budget"] = BudgetSpec{task.budget}.to_string();
    visit_options(task.options, [&options = json["options"]](const char* name, const auto& value) { options[name] = value; });
    json["files"] = Json::object();
    for (const std::string& name : files) {
        const auto bytes = read_file_bytes(folder / name);
        if (!bytes) return bytes.error();
        json["files"][name] = hash_file_bytes(*bytes);
    }
    const std::string text = json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
    if (auto written = write_file_atomically(folder / output_name::kManifest, text); !written) return written;
    return write_file_atomically(folder / output_name::kManifestHash, hash_file_bytes(text) + "\n");
}

std::string hash_text(std::uint64_t hash) { return fmt::format("{:016x}", hash); }

std::string hash_file_bytes(std::string_view bytes) {
    BitHash hash;
    hash.add_bytes(bytes);
    return hash_text(hash.value());
}

} // namespace trocar::engine
