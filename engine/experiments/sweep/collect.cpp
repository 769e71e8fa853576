#include "engine/experiments/sweep/collect.hpp"

#include "engine/io/csv.hpp"

#include <fmt/format.h>

namespace trocar::engine {
namespace {

constexpr std::size_t kMostSpans = 20;

/// result  nullptr: missing
void make_row(const SweepPlan& plan, const PlannedRun& run, const RunResult* result, std::vector<std::string>& row) {
    row.clear();
    if (plan.has_scene_column) row.push_back(plan.scene_names[run.scene]);
    for (const auto& [pointer, value] : run.settings) row.push_back(value_text(value));
    row.push_back(std::to_string(run.repeat));
    row.push_back(result != nullptr ? result->status : "missing");
    for (std::size_t i = 0; i < plan.collect.size(); ++i) row.push_back(result != nullptr ? result->values[i] : "");
}

} // namespace

std::vector<std::string> column_names(const SweepPlan& plan) {
    std::vector<std::string> names;
    if (plan.has_scene_column) names.emplace_back("scene");
    for (const SweepPlan::Axis& axis : plan.axes) names.insert(names.end(), axis.pointers.begin(), axis.pointers.end());
    names.insert(names.end(), {"repeat", "status"});
    for (const CollectItem& item : plan.collect) names.push_back(item.name);
    return names;
}

Result<SweepTable> collect_table(const std::filesystem::path& folder, const SweepPlan& plan, const RowSink& sink) {
    SweepTable table;
    table.columns = column_names(plan);
    table.varied = table.columns.size() - plan.collect.size() - 2;
    table.rows = plan.run_count();
    const ResultStore store(folder, plan);
    const ResultStore::Parts begun = store.find_begun();
    std::vector<std::uint64_t> found(plan.collect.size());
    std::vector<std::string> row;
    for (std::uint64_t chunk = 0; chunk < plan.chunk_count(); ++chunk) {
        const ChunkResults results = store.read(chunk, begun);
        const auto [first, end] = plan.chunk(chunk);
        for (std::uint64_t number = first; number < end; ++number) {
            const auto result = results.runs.find(number);
            const bool is_there = result != results.runs.end();
            make_row(plan, plan.run(number), is_there ? &result->second : nullptr, row);
            for (std::size_t i = 0; i < found.size(); ++i) found[i] += !row[table.varied + 2 + i].empty();
            table.missing += !is_there;
            table.done += is_there && result->second.status == "done";
            if (auto taken = sink(number, row); !taken) return taken.error();
        }
    }
    table.failed = table.rows - table.done - table.missing;
    for (std::size_t i = 0; i < found.size(); ++i)
        if (found[i] == 0 && table.done > 0)
            table.notices.push_back(fmt::format("{}: no run has {}", plan.collect[i].name,
                                                plan.collect[i].pointer.empty() ? plan.collect[i].column : plan.collect[i].pointer));
    return table;
}

std::string csv_row(const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t i = 0; i < cells.size(); ++i) text += (i > 0 ? "," : "") + csv_cell(cells[i]);
    return text + '\n';
}

SweepStatus find_status(const std::filesystem::path& folder, const SweepPlan& plan) {
    SweepStatus status;
    status.runs = plan.run_count();
    status.chunks = plan.chunk_count();
    const ResultStore store(folder, plan);
    const ResultStore::Parts begun = store.find_begun();
    for (std::uint64_t chunk = 0; chunk < status.chunks; ++chunk) {
        const ChunkResults results = store.read(chunk, begun);
        const auto [first, end] = plan.chunk(chunk);
        bool told = false;
        for (std::uint64_t number = first; number < end; ++number) {
            const auto result = results.runs.find(number);
            if (result == results.runs.end()) {
                if (results.is_worked_on && !told) {
                    status.running.push_back(number);
                    told = true;
                    continue;
                }
                ++status.missing;
                if (!status.missing_runs.empty() && status.missing_runs.back().second + 1 == number)
                    status.missing_runs.back().second = number;
                else
                    status.missing_runs.emplace_back(number, number);
            } else if (result->second.status == "done")
                ++status.done;
            else if (++status.failed <= SweepStatus::kMostFailures)
                status.failures.push_back({number, result->second.status});
        }
        if (results.runs.size() == end - first)
            ++status.complete_chunks;
        else
            status.incomplete.push_back(chunk);
    }
    return status;
}

std::string status_text(const SweepStatus& status, const SweepPlan& plan) {
    std::string text = fmt::format("{} runs: {} done, {} failed, {} running, {} missing; {} of {} chunks complete\n", status.runs, status.done, status.failed,
                                   status.running.size(), status.missing, status.complete_chunks, status.chunks);
    for (const std::uint64_t run : status.running) text += fmt::format("running  {:>7}  {}\n", run, plan.describe(plan.run(run)));
    for (const auto& [run, reason] : status.failures) text += fmt::format("failed   {:>7}  {}\n         {:>7}  {}\n", run, plan.describe(plan.run(run)), "", reason);
    if (status.failed > status.failures.size()) text += fmt::format("failed   and {} more\n", status.failed - status.failures.size());
    for (std::size_t i = 0; i < status.missing_runs.size() && i < kMostSpans; ++i) {
        const auto [first, last] = status.missing_runs[i];
        text += first == last ? fmt::format("missing  {:>7}\n", first)
                              : fmt::format("missing  {:>7} to {}, chunks {} to {}\n", first, last, first / plan.chunk_runs, last / plan.chunk_runs);
    }
    if (status.missing_runs.size() > kMostSpans) text += fmt::format("missing  and {} more spans\n", status.missing_runs.size() - kMostSpans);
    return text;
}

} // namespace trocar::engine
