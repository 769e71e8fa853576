// From a sweep to its plan: every scene is read, every pointer is followed, before anything runs.
#include "engine/experiments/plan_scene.hpp"
#include "engine/experiments/regression.hpp"
#include "engine/experiments/sweep/sweep_plan.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/prepare/cache.hpp"
#include "engine/scene/override.hpp"
#include "engine/scene/recipe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <set>

namespace trocar::engine {
namespace {

/// So many runs are each checked as a whole; of more, every value beside the first values of the other pointers.
constexpr std::uint64_t kMostChecked = 3000;
/// Results of so many runs are packed into one file; small sweeps have so many chunks that several processes share them.
constexpr std::uint64_t kMostChunkRuns = 500, kFewestChunks = 32;

std::string hash_of(std::string_view bytes) {
    ContentHash hash;
    hash.feed(bytes);
    return hash.hex();
}

/// What a scene reads beside its own file.
void find_scene_files(const Scene& scene, std::set<std::string>& files) {
    for (const std::filesystem::path& file : files_of(scene))
        if (file != scene.file) files.insert(file.string());
}

/// What `verify` reads: the scenes of the lists, their files and their references. A reference that is not there is a matter of the run.
Result<std::set<std::string>> find_verified_files(const SweepPlan& plan) {
    std::set<std::string> files;
    for (const PlannedFile& list : plan.scenes) {
        const auto entries = read_regression_list(list.file);
        if (!entries) return entries.error();
        for (const RegressionEntry& entry : *entries) {
            const auto scene = read_scene(entry.scene);
            if (!scene) return scene.error();
            find_scene_files(*scene, files);
            files.insert(entry.scene.string());
            std::error_code none;
            if (std::filesystem::exists(entry.reference, none)) files.insert(entry.reference.string());
        }
    }
    return files;
}

/// Follows the pointers of one plan into its scenes.
class PlanCheck {
public:
    PlanCheck(const SweepSpec& spec, const SweepPlan& plan) : spec_(spec), plan_(plan) {}

    /// The scene without its runs, then the runs.
    std::optional<Error> check(std::size_t scene, const std::string& text) {
        scene_ = scene;
        text_ = &text;
        if (auto alone = parse_scene(text, plan_.scenes[scene].file); !alone) return alone.error();
        const std::uint64_t per_scene = plan_.run_count() / plan_.scenes.size() / plan_.repeat;
        if (per_scene <= kMostChecked) {
            for (std::uint64_t k = 0; k < per_scene; ++k)
                if (auto error = check_run((scene * per_scene + k) * plan_.repeat)) return error;
            return std::nullopt;
        }
        std::uint64_t stride = plan_.repeat;
        for (std::size_t i = plan_.axes.size(); i-- > 0; stride *= plan_.axes[i].values.size())
            for (std::size_t v = 0; v < plan_.axes[i].values.size(); ++v)
                if (auto error = check_run(scene * per_scene * plan_.repeat + v * stride)) return error;
        return std::nullopt;
    }

    [[nodiscard]] const std::set<std::string>& files() const noexcept { return files_; }

private:
    std::optional<Error> check_run(std::uint64_t number) {
        const PlannedRun run = plan_.run(number);
        std::vector<SceneOverride> overrides;
        for (const auto& [pointer, value] : run.settings) {
            if (is_option(pointer)) continue; // the command line's own check
            auto override = parse_override(pointer + "=" + value);
            if (!override) return override.error();
            overrides.push_back(std::move(*override));
        }
        auto scene = parse_scene(*text_, plan_.scenes[scene_].file, overrides);
        if (!scene) return blame(scene.error(), run);
        if (auto error = check_targets(*scene, run)) return blame(at_options(*error), run);
        find_scene_files(*scene, files_);
        return std::nullopt;
    }

    /// `plan` must have a way to its target, the others a target of every name that they are given.
    std::optional<Error> check_targets(Scene& scene, const PlannedRun& run) const {
        constexpr std::string_view kTo = "--to";
        const std::vector<std::string> words = plan_.command_line(run, "out");
        std::vector<std::string> targets;
        for (std::size_t i = 0; i < words.size(); ++i) {
            if (words[i] == kTo && i + 1 < words.size()) targets.push_back(words[i + 1]);
            if (words[i].starts_with("--to=")) targets.push_back(words[i].substr(kTo.size() + 1));
        }
        if (plan_.command == SweepCommand::Plan) {
            const auto aimed = aim_to_plan(scene, targets.empty() ? usual_target(scene).value_or("") : targets.front());
            return aimed ? std::nullopt : std::optional(aimed.error());
        }
        for (const std::string& target : targets)
            if (const auto aimed = aim_first_instrument(scene, target); !aimed) return aimed.error();
        return std::nullopt;
    }

    Error at_options(Error error) const {
        const TextPosition at = spec_.options.empty() ? spec_.scene_at[scene_] : spec_.options_at;
        return {error.code, std::move(error.message), spec_.file.string(), at.line, at.column, std::move(error.key)};
    }

    /// "gravity[2]" is within "gravity", as is "gravity" itself.
    static bool is_within(const std::string& key, const std::string& whole) {
        return key == whole || (!whole.empty() && (key.starts_with(whole + ".") || key.starts_with(whole + "[")));
    }

    /// The place in the sweep of the value that the scene refuses. Without its runs the scene was fine, so what is refused as a whole is
    /// refused for the part that is varied.
    Error blame(Error error, const PlannedRun& run) const {
        std::uint64_t index = run.number / plan_.repeat;
        for (std::size_t i = spec_.axes.size(); i-- > 0;) {
            const SweepAxis& axis = spec_.axes[i];
            const std::size_t value = index % axis.values.size();
            index /= axis.values.size();
            for (std::size_t p = 0; p < axis.pointers.size(); ++p) {
                const bool unknown = error.key == axis.pointers[p] && !is_option(axis.pointers[p]);
                const std::string key = dotted_key(axis.pointers[p]);
                if (!unknown && error.key != axis.pointers[p] && !is_within(error.key, key) && !is_within(key, error.key)) continue;
                const TextPosition at = axis.place(p, unknown ? std::nullopt : std::optional(value));
                error.message = error.message.substr(0, error.message.find("; the value was given for ")); // that is the place here
                error.message += fmt::format(" (scene {})", plan_.scene_names[run.scene]);
                return {error.code, std::move(error.message), axis.file, at.line, at.column, axis.pointers[p]};
            }
        }
        error.message += fmt::format(" (in run {}: {})", run.number, plan_.describe(run));
        return error;
    }

    const SweepSpec& spec_;
    const SweepPlan& plan_;
    std::size_t scene_ = 0;
    const std::string* text_ = nullptr;
    std::set<std::string> files_;
};

/// The files of the scenes, hashed; the texts are kept for the check.
Result<std::vector<std::string>> read_scenes(const SweepSpec& spec, SweepPlan& plan) {
    std::vector<std::string> texts;
    for (std::size_t i = 0; i < spec.scenes.size(); ++i) {
        const TextPosition at = spec.scene_at[i];
        const auto fail = [&](std::string message) {
            return Error{ErrorCode::FileNotFound, std::move(message), spec.file.string(), at.line, at.column, "scene"};
        };
        const std::filesystem::path file = (spec.folder() / spec.scenes[i]).lexically_normal();
        std::error_code none;
        if (std::filesystem::equivalent(file, spec.file, none)) return fail("names this file itself; expected a scene");
        if (!std::filesystem::is_regular_file(file, none))
            return fail(fmt::format("the file \"{:.200}\" does not exist (looked for {:.300}); expected a file relative to the sweep's folder",
                                    spec.scenes[i], file.string()));
        const auto text = read_json_file(file);
        if (!text) return text.error();
        for (std::size_t k = 0; k < i; ++k)
            if (plan.scenes[k].file == file.string()) return fail(fmt::format("\"{:.200}\" is listed twice; expected once", spec.scenes[i]));
        plan.scenes.push_back({file.string(), hash_of(*text)});
        texts.push_back(*text);
    }
    return texts;
}

/// Files that the command's options name: a path to replay, a policy as in policy.py:function.
void find_option_files(const SweepSpec& spec, std::set<std::string>& files) {
    const auto note = [&](const std::string& word) {
        for (const std::string& name : {word, word.substr(0, word.rfind(':')), word.substr(word.find('=') + 1)}) {
            std::error_code none;
            const std::filesystem::path file = (spec.folder() / name).lexically_normal();
            if (!name.empty() && std::filesystem::is_regular_file(file, none)) files.insert(file.string());
        }
    };
    for (const std::string& word : spec.options) note(word);
    for (const SweepAxis& axis : spec.axes)
        for (std::size_t p = 0; p < axis.pointers.size(); ++p)
            if (is_option(axis.pointers[p]))
                for (const auto& values : axis.values) note(value_text(values[p]));
}

} // namespace

Result<SweepPlan> make_plan(const SweepSpec& spec) {
    SweepPlan plan;
    plan.program = program_version();
    plan.folder = spec.folder().string();
    plan.command = spec.command;
    plan.options = spec.options;
    plan.scene_names = spec.scenes;
    plan.has_scene_column = spec.is_list;
    for (const SweepAxis& axis : spec.axes) plan.axes.push_back({axis.pointers, axis.values});
    plan.repeat = spec.repeat;
    plan.collect = spec.collect;
    plan.keeps_folders = spec.keeps_folders;
    plan.time_limit = spec.time_limit;
    const auto texts = read_scenes(spec, plan);
    if (!texts) return texts.error();
    const std::uint64_t runs = plan.run_count();
    plan.chunk_runs = std::clamp<std::uint64_t>(runs / kFewestChunks, 1, kMostChunkRuns);
    std::set<std::string> files;
    if (plan.command == SweepCommand::Verify) {
        auto found = find_verified_files(plan);
        if (!found) return found.error();
        files = std::move(*found);
    } else {
        PlanCheck check(spec, plan);
        for (std::size_t i = 0; i < texts->size(); ++i)
            if (auto error = check.check(i, (*texts)[i])) return *error;
        files = check.files();
        find_option_files(spec, files);
    }
    for (const std::string& file : files) {
        const auto bytes = read_file_bytes(file);
        if (!bytes) return bytes.error();
        plan.files.push_back({file, hash_of(*bytes)});
    }
    return plan;
}

} // namespace trocar::engine
