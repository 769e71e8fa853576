#include "engine/experiments/sweep/worker.hpp"

#include "engine/experiments/sweep/child.hpp"
#include "engine/experiments/sweep/reduction.hpp"
#include "engine/io/file_bytes.hpp"
#include "engine/io/printable.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/time/interrupt.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>

namespace trocar::engine {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr int kNotStarted = 127;         // exit code of a run that could not be started
constexpr std::size_t kMostReason = 300; // bytes of a row's reason

/// A figure as a cell: strings as they are, nothing of null, the rest as JSON.
std::string cell_of(const Json& value) {
    if (value.is_null()) return "";
    if (value.is_string()) return value.get<std::string>();
    return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// table_name  as table_file; nullptr: the command has none, and no item asks for it
std::string collected(const CollectItem& item, const Json& figures, const fs::path& out, const char* table_name) {
    if (!item.pointer.empty()) {
        try { // the library's pointers throw on what is no index
            const Json::json_pointer pointer(item.pointer);
            return figures.contains(pointer) ? cell_of(figures.at(pointer)) : "";
        } catch (const nlohmann::json::exception&) {
            return "";
        }
    }
    if (table_name == nullptr) return "";
    const auto table = read_file_bytes(out / table_name);
    if (!table) return "";
    auto values = column_values(*table, item.column);
    if (!values) return "";
    const auto number = reduce(item.take, std::move(*values));
    return number ? fmt::format("{}", *number) : "";
}

/// The last error that a run has printed, without the names of folders that only this run had.
std::string reason_of(std::string_view text, const fs::path& out) {
    std::string reason;
    for (std::size_t begin = 0; begin < text.size();) {
        const std::size_t end = std::min(text.find('\n', begin), text.size());
        std::string_view line = text.substr(begin, end - begin);
        begin = end + 1;
        if (const std::size_t cleared = line.rfind('\r'); cleared != std::string_view::npos) line.remove_prefix(cleared + 1);
        if (line.starts_with("error: ")) reason = line.substr(7);
        else if (reason.empty() && line.starts_with("trocar: ")) reason = line;
    }
    for (const std::string& place : {out.string() + "/", out.string()})
        for (std::size_t at = 0; (at = reason.find(place, at)) != std::string::npos;) reason.erase(at, place.size());
    reason = printable(reason);
    if (reason.size() > kMostReason) {
        std::size_t cut = kMostReason;
        while (cut > 0 && (static_cast<unsigned char>(reason[cut]) & 0xC0U) == 0x80U) --cut;
        reason = reason.substr(0, cut) + "...";
    }
    return reason;
}

/// The disk, not the run: then the run has no result.
bool is_machines_fault(const std::string& text) {
    return std::ranges::any_of(std::array{ENOSPC, EDQUOT, EFBIG, EIO, EROFS, ESTALE},
                               [&](int reason) { return text.find(std::strerror(reason)) != std::string::npos; });
}

/// "done", or why not; nothing where the run has no result.
std::optional<std::string> judge(const ChildEnd& end, const SweepPlan& plan, const fs::path& out) {
    if (end.timed_out) return fmt::format("failed: took longer than {:g} s", plan.time_limit);
    // by somebody; or it could not even start
    if (end.signal == SIGKILL || end.signal == SIGTERM || end.signal == SIGINT || end.exit_code == 130 || end.exit_code == kNotStarted) return std::nullopt;
    if (end.signal != 0) return fmt::format("failed: crashed with signal {}", end.signal);
    const char* figures = figures_file(plan.command);
    std::error_code none;
    if (end.exit_code == 0) {
        if (figures == nullptr || fs::exists(out / figures, none)) return "done";
        return fmt::format("failed: left no {}", figures);
    }
    const std::string reason = reason_of(end.output, out);
    return reason.empty() ? fmt::format("failed: exit {}", end.exit_code) : fmt::format("failed: exit {}: {}", end.exit_code, reason);
}

/// A place for the outputs of runs that are going on; gone with it.
class Scratch {
public:
    Scratch(const fs::path& folder, const std::string& name) {
        const char* own = std::getenv("TROCAR_SCRATCH"); // a disk of the node, where the sweep's folder is on a network
        path_ = (own != nullptr && *own != '\0' ? fs::path(own) : folder / sweep_name::kScratch) / name;
        for (int attempt = 0; attempt < 50; ++attempt) { // somebody may tidy up an empty folder above it between two of its steps
            fs::create_directories(path_, failed_);
            if (!failed_ || failed_ != std::errc::no_such_file_or_directory) return;
        }
    }
    ~Scratch() {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    [[nodiscard]] const fs::path& path() const noexcept { return path_; }
    [[nodiscard]] Result<void> made() const {
        if (!failed_) return {};
        return Error{ErrorCode::CannotWrite, "cannot be made: " + failed_.message(), path_.string()};
    }

private:
    fs::path path_;
    std::error_code failed_;
};

/// The run's whole folder to its place; one that is there already is of the same run.
Result<void> keep_folder(const fs::path& out, const fs::path& folder, const std::string& key) {
    const fs::path place = folder / sweep_name::kRuns / key;
    std::error_code failed;
    fs::create_directories(place.parent_path(), failed);
    if (fs::exists(place, failed)) fs::remove_all(place, failed);
    fs::rename(out, place, failed);
    if (!failed || failed == std::errc::directory_not_empty) return {}; // another worker, at the same run, was faster
    const fs::path copy = place.parent_path() / ("." + key + ".part"); // from another file system
    fs::remove_all(copy, failed);
    fs::copy(out, copy, fs::copy_options::recursive, failed);
    if (!failed) fs::rename(copy, place, failed);
    if (failed) return Error{ErrorCode::CannotWrite, "cannot be kept: " + failed.message(), place.string()};
    return {};
}

} // namespace

RunResult collect_run(const SweepPlan& plan, const PlannedRun& run, const fs::path& out, std::string status) {
    RunResult result{run.number, run.key, std::move(status), {}, "null"};
    Json figures;
    if (const char* name = figures_file(plan.command))
        if (const auto text = read_file_bytes(out / name)) {
            figures = Json::parse(*text, nullptr, false);
            if (!figures.is_discarded()) result.figures = figures.dump(-1, ' ', false, Json::error_handler_t::replace);
        }
    for (const CollectItem& item : plan.collect) result.values.push_back(collected(item, figures, out, table_file(plan.command)));
    return result;
}

Result<ChunkEnd> run_chunk(const fs::path& folder, const SweepPlan& plan, std::uint64_t chunk) {
    const ResultStore store(folder, plan);
    ChunkEnd ended;
    const auto [first, end] = plan.chunk(chunk);
    const ChunkResults before = store.read(chunk);
    if (before.is_packed && before.parts.empty()) return ended;
    if (before.runs.size() < end - first) {
        auto part = PartFile::create(folder, chunk);
        if (!part) return part.error();
        const Scratch scratch(folder, part->path().stem().string());
        if (auto made = scratch.made(); !made) return made.error();
        for (std::uint64_t number = first; number < end; ++number) {
            if (before.runs.contains(number)) continue;
            ended.interrupted = interrupt_requested();
            if (ended.interrupted) break;
            const PlannedRun run = plan.run(number);
            const fs::path out = scratch.path() / "out";
            std::error_code ignored;
            fs::remove_all(out, ignored);
            if (plan.command == SweepCommand::Verify) fs::create_directory(out, ignored); // the others make it
            const auto child = run_this_program(plan.command_line(run, out), plan.folder, plan.time_limit);
            if (!child) return child.error();
            ended.interrupted = child->interrupted;
            if (ended.interrupted) break;
            auto status = judge(*child, plan, out);
            if (!status) {
                ++ended.killed;
                continue;
            }
            if (child->exit_code != 0 && !child->timed_out && is_machines_fault(child->output))
                return Error{ErrorCode::CannotWrite, fmt::format("run {} cannot write its outputs: {}", number, reason_of(child->output, out)), folder.string()};
            const RunResult result = collect_run(plan, run, out, std::move(*status));
            if (plan.keeps_folders && fs::exists(out, ignored))
                if (auto kept = keep_folder(out, folder, run.key); !kept) return kept.error();
            if (auto added = part->add(result); !added) return added.error();
            ++ended.done;
        }
    }
    const ChunkResults now = store.read(chunk); // other workers may have been at it
    if (now.runs.size() == end - first)
        if (auto packed = store.pack(chunk, now); !packed) return packed.error();
    return ended;
}

void remove_old_scratch(const fs::path& folder) {
    std::error_code failed;
    std::vector<fs::path> old;
    for (fs::directory_iterator it(folder / sweep_name::kScratch, failed), end; !failed && it != end; it.increment(failed))
        if (!is_locked(folder / sweep_name::kResults / (it->path().filename().string() + ".part"))) old.push_back(it->path());
    for (const fs::path& one : old) fs::remove_all(one, failed);
    fs::remove(folder / sweep_name::kScratch, failed);
}

} // namespace trocar::engine
