#include "engine/viewer/picked_scene.hpp"

#include "engine/experiments/plan_scene.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/scene/edit_text.hpp"

#include <fmt/format.h>

namespace trocar::engine::viewer {

namespace {

/// Of the lumen's radius at the target: a tip that is so near has arrived in this vessel, and in no other.
constexpr double kArrivedShare = 0.97;
/// Of the straight part beyond an entry that has room: inserted at most.
constexpr double kInsertedShare = 0.8;
/// Files <scene>-picked-N.json at most.
constexpr unsigned kMostNumbers = 999;

std::string number_text(double number) { return fmt::format("{:.9g}", number); }
std::string vector_text(const Vec3& v) { return fmt::format("[{:.9g}, {:.9g}, {:.9g}]", v.x(), v.y(), v.z()); }

/// The first error is kept, and ends it.
class Editor {
public:
    explicit Editor(std::string_view text) : text_(std::string(text)) {}
    void set(const std::vector<std::string>& keys, const std::string& value) {
        if (text_.ok()) text_ = set_json_value(*text_, keys, value);
    }
    [[nodiscard]] Result<std::string> finish() { return std::move(text_); }

private:
    Result<std::string> text_;
};

void put_target(Editor& editor, const Scene& scene, const MiddlePlace& place, const std::string& name, std::vector<std::string>& notices) {
    const SceneInstrument& instrument = scene.instruments[kLeadInstrument];
    editor.set({"targets", name}, fmt::format("{{\"position\": {}}}", vector_text(place.position / scene.units.length)));
    if (!instrument.path.empty()) {
        notices.push_back(fmt::format("{} is driven by the scene's path as before: `trocar plan` with --to {} finds the way", instrument.name, name));
        return;
    }
    editor.set({"instruments", instrument.name, "follow", "target"}, json_string(name));
    const double tolerance = instrument.follow ? instrument.follow->settings.tolerance : FollowSettings{}.tolerance;
    if (tolerance <= place.radius) return;
    editor.set({"instruments", instrument.name, "follow", "tolerance"}, number_text(kArrivedShare * place.radius / scene.units.length));
    notices.push_back(fmt::format("the tolerance of {:.3g} mm is wider than the vessel there: it is {:.3g} mm now", 1e3 * tolerance,
                                  1e3 * kArrivedShare * place.radius));
}

void put_entry(Editor& editor, const Scene& scene, const PickedEntry& entry, std::vector<std::string>& notices) {
    const SceneInstrument& instrument = scene.instruments[kLeadInstrument];
    editor.set({"instruments", instrument.name, "entry"},
               fmt::format("{{\"position\": {}, \"direction\": {}}}", vector_text(entry.place.position / scene.units.length),
                           vector_text(entry.place.direction)));
    if (!instrument.path.empty() || instrument.inserted <= entry.free_ahead) return; // a path says itself how much is inserted
    const double inserted = kInsertedShare * entry.free_ahead;
    editor.set({"instruments", instrument.name, "inserted"}, number_text(inserted / scene.units.length));
    notices.push_back(fmt::format("{:.3g} mm of {} are inserted at the start instead of {:.3g} mm: so much is straight there", 1e3 * inserted,
                                  instrument.name, 1e3 * instrument.inserted));
}

/// Nothing at all has the name, not even a link to nowhere.
bool is_free(const std::filesystem::path& file) {
    std::error_code problem;
    return std::filesystem::symlink_status(file, problem).type() == std::filesystem::file_type::not_found;
}

Result<std::filesystem::path> choose_file(const Scene& scene, std::string name) {
    const std::filesystem::path folder = scene.file.parent_path();
    if (!name.empty()) {
        if (const auto good = check_file_name(name); !good.ok()) return good.error();
        if (!name.ends_with(".json")) name += ".json";
        if (!is_free(folder / name)) return Error{ErrorCode::BadUsage, fmt::format("there is a file {} already; expected another name", name)};
        return folder / name;
    }
    const std::string stem = scene.file.stem().string() + "-picked";
    for (unsigned number = 1; number <= kMostNumbers; ++number) {
        std::filesystem::path file = folder / (number == 1 ? stem + ".json" : fmt::format("{}-{}.json", stem, number));
        if (is_free(file)) return file;
    }
    return Error{ErrorCode::BadUsage, fmt::format("there are {} files {}-N.json already; expected another name", kMostNumbers, stem)};
}

/// As `plan` does before its trial: the way to what the first instrument follows, and what has been picked.
Result<PreparedScene> check_way(Scene scene, const Picks& picks, const std::string& picked) {
    const std::string target = picks.target ? picked : usual_target(scene).value_or("");
    if (target.empty()) return make_prepared_scene(scene);
    if (const auto aimed = aim_to_plan(scene, target); !aimed.ok()) return aimed.error();
    auto prepared = make_prepared_scene(scene);
    if (!prepared.ok()) return prepared;
    const InstrumentModel& instrument = prepared->model.instruments[kLeadInstrument];
    if (const auto bends = check_bends(scene, inspect_route(*instrument.route, instrument.rod.design.radius), target); !bends.ok()) return bends.error();
    return prepared;
}

} // namespace

Result<std::string> put_picks(std::string_view text, const Scene& scene, const Picks& picks, const std::string& target,
                              std::vector<std::string>& notices) {
    if (!picks.target && !picks.entry) return Error{ErrorCode::BadUsage, "nothing is picked yet: there is nothing to save"};
    Editor editor(text);
    if (picks.target) put_target(editor, scene, *picks.target, target, notices);
    if (picks.entry) put_entry(editor, scene, *picks.entry, notices);
    return editor.finish();
}

Result<SavedScene> save_picked_scene(std::string_view text, const Scene& scene, const Picks& picks, const SaveScene& asked) {
    if (text.empty()) return Error{ErrorCode::BadUsage, "the scene that is shown came from no file: there is no folder to save it in"};
    SavedScene saved;
    const auto file = choose_file(scene, asked.file_name);
    if (!file.ok()) return file.error();
    saved.file = *file;
    const auto picked = put_picks(text, scene, picks, asked.target, saved.notices);
    if (!picked.ok()) return picked.error();
    const auto read = parse_scene(*picked, saved.file);
    if (!read.ok()) return read.error();
    const auto prepared = check_way(*read, picks, asked.target);
    if (!prepared.ok()) return prepared.error();
    saved.notices.insert(saved.notices.end(), prepared->notices.begin(), prepared->notices.end());
    if (!is_free(saved.file)) return Error{ErrorCode::BadUsage, fmt::format("there is a file {} now; expected another name", saved.file.string())};
    if (const auto written = write_file_atomically(saved.file, *picked); !written.ok()) return written.error();
    return saved;
}

} // namespace trocar::engine::viewer
