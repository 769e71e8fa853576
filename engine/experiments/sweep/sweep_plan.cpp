#include "engine/experiments/sweep/sweep_plan.hpp"

#include "engine/io/file_bytes.hpp"
#include "engine/prepare/cache.hpp"
#include "engine/report/build_facts.hpp"
#include "engine/report/places.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstring>

#include <link.h>

namespace trocar::engine {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kFormat = 1;

Json parse_value(const std::string& text) { return Json::parse(text, nullptr, false); }

Json files_json(const std::vector<PlannedFile>& files) {
    Json list = Json::array();
    for (const PlannedFile& one : files) list.push_back({{"file", one.file}, {"hash", one.hash}});
    return list;
}

std::vector<PlannedFile> read_files(const Json& list) {
    std::vector<PlannedFile> files;
    for (const Json& one : list) files.push_back({one.at("file").get<std::string>(), one.at("hash").get<std::string>()});
    return files;
}

SweepPlan from_json(const Json& json) {
    SweepPlan plan;
    plan.program = json.at("program").get<std::string>();
    plan.folder = json.at("folder").get<std::string>();
    const auto command = json.at("command").get<std::string>();
    for (const SweepCommand one : kSweepCommands)
        if (command == command_name(one)) plan.command = one;
    if (command != command_name(plan.command)) throw std::runtime_error("an unknown command");
    plan.options = json.at("options").get<std::vector<std::string>>();
    plan.scene_names = json.at("scene_names").get<std::vector<std::string>>();
    plan.has_scene_column = json.at("scene_column").get<bool>();
    plan.scenes = read_files(json.at("scenes"));
    plan.files = read_files(json.at("files"));
    for (const Json& axis : json.at("axes")) {
        SweepPlan::Axis& read = plan.axes.emplace_back();
        read.pointers = axis.at("pointers").get<std::vector<std::string>>();
        for (const Json& row : axis.at("values")) {
            std::vector<std::string>& values = read.values.emplace_back();
            for (const Json& value : row) values.push_back(value.dump());
            if (values.size() != read.pointers.size()) throw std::runtime_error("a row of another length");
        }
    }
    plan.repeat = json.at("repeat").get<std::uint64_t>();
    for (const Json& item : json.at("collect"))
        plan.collect.push_back({item.at("name").get<std::string>(), item.value("pointer", ""), item.value("column", ""), item.value("take", ""), {}});
    plan.keeps_folders = json.at("keep_folders").get<bool>();
    plan.time_limit = json.at("time_limit").get<double>();
    plan.chunk_runs = json.at("chunk_runs").get<std::uint64_t>();
    if (plan.chunk_runs == 0 || plan.chunk_runs > kMostRuns || plan.scenes.empty() || plan.scenes.size() != plan.scene_names.size() || plan.run_count() == 0 ||
        plan.run_count() > kMostRuns || plan.run_count() != json.at("runs").get<std::uint64_t>())
        throw std::runtime_error("counts that contradict each other");
    return plan;
}

/// The linker's build id: the same program, the same digits.
std::string build_id() {
    std::string id;
    dl_iterate_phdr(
        [](dl_phdr_info* info, std::size_t, void* out) {
            if (info->dlpi_name != nullptr && *info->dlpi_name != '\0') return 0; // a library
            for (int i = 0; i < info->dlpi_phnum; ++i) {
                if (info->dlpi_phdr[i].p_type != PT_NOTE) continue;
                const char* at = reinterpret_cast<const char*>(info->dlpi_addr + info->dlpi_phdr[i].p_vaddr);
                const char* end = at + info->dlpi_phdr[i].p_memsz;
                while (at + sizeof(ElfW(Nhdr)) <= end) {
                    ElfW(Nhdr) note;
                    std::memcpy(&note, at, sizeof note);
                    const char* name = at + sizeof note;
                    const char* content = name + ((note.n_namesz + 3U) & ~3U);
                    if (note.n_type == NT_GNU_BUILD_ID && note.n_namesz == 4 && std::memcmp(name, "GNU", 4) == 0)
                        for (unsigned k = 0; k < note.n_descsz; ++k)
                            *static_cast<std::string*>(out) += fmt::format("{:02x}", static_cast<unsigned char>(content[k]));
                    at = content + ((note.n_descsz + 3U) & ~3U);
                }
            }
            return 1;
        },
        &id);
    return id.empty() ? std::string(maker_version()) : id;
}

} // namespace

std::string value_text(const std::string& json) {
    if (json.empty() || json.front() != '"') return json;
    const Json value = parse_value(json);
    return value.is_string() ? value.get<std::string>() : json;
}

std::string program_version() { return "trocar " + build_facts().version + " " + build_id(); }

std::uint64_t SweepPlan::run_count() const noexcept {
    std::uint64_t runs = scenes.size() * std::min(repeat, kMostRuns + 1);
    for (const Axis& axis : axes) runs = std::min(runs, kMostRuns + 1) * axis.values.size();
    return runs;
}

PlannedRun SweepPlan::run(std::uint64_t number) const {
    PlannedRun run;
    run.number = number;
    run.repeat = number % repeat;
    number /= repeat;
    std::vector<std::size_t> at(axes.size());
    for (std::size_t i = axes.size(); i-- > 0;) {
        at[i] = number % axes[i].values.size();
        number /= axes[i].values.size();
    }
    run.scene = number;
    for (std::size_t i = 0; i < axes.size(); ++i)
        for (std::size_t p = 0; p < axes[i].pointers.size(); ++p) run.settings.emplace_back(axes[i].pointers[p], axes[i].values[at[i]][p]);
    ContentHash hash;
    hash.feed(std::uint64_t{kFormat});
    for (const std::string_view part : {std::string_view(program), std::string_view(command_name(command)), std::string_view(scenes[run.scene].hash)})
        hash.feed(part);
    for (const PlannedFile& one : files) hash.feed(std::string_view(one.hash));
    for (const std::string& word : options) hash.feed(std::string_view(word));
    for (const auto& [pointer, value] : run.settings) hash.feed(std::string_view(pointer)), hash.feed(std::string_view(value));
    for (const CollectItem& item : collect)
        for (const std::string* part : {&item.name, &item.pointer, &item.column, &item.take}) hash.feed(std::string_view(*part));
    hash.feed(static_cast<std::uint64_t>(keeps_folders));
    hash.feed(run.repeat);
    run.key = hash.hex();
    return run;
}

std::pair<std::uint64_t, std::uint64_t> SweepPlan::chunk(std::uint64_t index) const noexcept {
    return {index * chunk_runs, std::min((index + 1) * chunk_runs, run_count())};
}

std::vector<std::string> SweepPlan::command_line(const PlannedRun& run, const std::filesystem::path& out) const {
    std::vector<std::string> words{command_name(command), scenes[run.scene].file};
    for (const auto& [pointer, value] : run.settings)
        if (is_option(pointer))
            words.insert(words.end(), {pointer, value_text(value)});
        else
            words.insert(words.end(), {"--set", pointer + "=" + value});
    words.insert(words.end(), options.begin(), options.end());
    words.emplace_back("--quiet");
    if (command == SweepCommand::Verify) { // without a name the page would go to the sweep's folder
        if (options.empty()) words.insert(words.end(), {"--page", (out / "verify.html").string()});
        return words;
    }
    words.insert(words.end(), {"--out", out.string()});
    // pictures that nobody keeps: a third of a run of a second
    const bool is_named = std::find(options.begin(), options.end(), "--no-pictures") != options.end();
    if (!keeps_folders && command == SweepCommand::Run && !is_named) words.emplace_back("--no-pictures");
    if (!keeps_folders && command != SweepCommand::Episode) words.emplace_back("--no-report");
    return words;
}

std::string SweepPlan::describe(const PlannedRun& run) const {
    std::string text = fmt::format("trocar {} {}", command_name(command), shell_quoted(scene_names[run.scene]));
    for (const auto& [pointer, value] : run.settings)
        text += is_option(pointer) ? fmt::format(" {} {}", pointer, shell_quoted(value_text(value))) : " --set " + shell_quoted(pointer + "=" + value);
    for (const std::string& word : options) text += " " + shell_quoted(word);
    return text;
}

std::string SweepPlan::text() const {
    Json json{{"format", kFormat},         {"program", program},        {"folder", folder}, {"command", command_name(command)}, {"options", options},
              {"scene_names", scene_names}, {"scene_column", has_scene_column}};
    json["scenes"] = files_json(scenes);
    json["files"] = files_json(files);
    json["axes"] = Json::array();
    for (const Axis& axis : axes) {
        Json rows = Json::array();
        for (const auto& values : axis.values) {
            Json row = Json::array();
            for (const std::string& value : values) row.push_back(parse_value(value));
            rows.push_back(std::move(row));
        }
        json["axes"].push_back({{"pointers", axis.pointers}, {"values", std::move(rows)}});
    }
    json["repeat"] = repeat;
    json["collect"] = Json::array();
    for (const CollectItem& item : collect) {
        Json one{{"name", item.name}};
        if (!item.pointer.empty())
            one["pointer"] = item.pointer;
        else
            one["column"] = item.column, one["take"] = item.take;
        json["collect"].push_back(std::move(one));
    }
    json["keep_folders"] = keeps_folders;
    json["time_limit"] = time_limit;
    json["chunk_runs"] = chunk_runs;
    json["runs"] = run_count();
    return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<SweepPlan> read_plan(const std::filesystem::path& file) {
    const auto text = read_file_bytes(file);
    if (!text) return text.error();
    return parse_plan(*text, file);
}

Result<SweepPlan> parse_plan(std::string_view text, const std::filesystem::path& file) {
    const Json json = Json::parse(text, nullptr, false);
    const auto fail = [&](std::string message) { return Error{ErrorCode::BadSyntax, std::move(message), file.string()}; };
    if (json.is_discarded() || !json.is_object() || !json.contains("format")) return fail("is no plan of a sweep");
    if (json["format"] != kFormat) return fail(fmt::format("is a plan of another format; expected format {}", kFormat));
    try { // of the JSON library, whose access throws
        return from_json(json);
    } catch (const std::exception& problem) {
        return fail(fmt::format("is a damaged plan: {}", problem.what()));
    }
}

Result<void> check_unchanged(const SweepPlan& plan) {
    for (const std::vector<PlannedFile>* list : {&plan.scenes, &plan.files})
        for (const PlannedFile& one : *list) {
            const auto bytes = read_file_bytes(one.file);
            if (!bytes) return bytes.error();
            ContentHash hash;
            hash.feed(std::string_view(*bytes));
            if (hash.hex() != one.hash)
                return Error{ErrorCode::BadValue, "has changed since the sweep was planned; expected it unchanged, or another --out", one.file};
        }
    return {};
}

} // namespace trocar::engine
