// `sweep`: many runs of scenes, resumable, and one table at the end.
#include "engine/cli/commands.hpp"
#include "engine/cli/job_pool.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/sweep_folder.hpp"
#include "engine/cli/sweep_options.hpp"
#include "engine/cli/taken_files.hpp"
#include "engine/experiments/sweep/collect.hpp"
#include "engine/experiments/sweep/slurm.hpp"
#include "engine/experiments/sweep/slurm_queue.hpp"
#include "engine/experiments/sweep/sweep_page.hpp"
#include "engine/experiments/sweep/worker.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/time/interrupt.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <optional>
#include <thread>
#include <unistd.h>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kMostListed = 1000; // runs that --dry-run lists
constexpr std::size_t kMostRefused = 4;     // workers that end with an error of their own before no more are started

struct SweepRequest {
    std::filesystem::path sweep, out, table;
    unsigned jobs = 1;
    bool slurm = false, watch = false, forecast = true;
    SlurmOptions cluster;
    bool status = false, plan = false, resume = false, dry_run = false, retry_failed = false, quiet = false;
};

std::string duration_text(double s) {
    if (s < 90.0) return fmt::format("{:.2g} s", s);
    if (s < 5400.0) return fmt::format("{:.0f} min", s / 60.0);
    return fmt::format("{:.1f} h", s / 3600.0);
}

/// One sweep in one folder.
class Sweep {
public:
    Sweep(const SweepRequest& request, const SweepPlan& plan) : request_(request), plan_(plan), store_(request.out, plan) {}

    int show_status() const {
        const InterruptHold hold(InterruptHold::Then::OwnerEnds);
        for (;;) {
            const SweepStatus status = find_status(request_.out, plan_);
            fmt::print("{}", status_text(status, plan_));
            const SlurmQueue queue = ask_queue(request_.out);
            if (queue.running + queue.waiting > 0) fmt::print("slurm    {}\n", queued_text(queue));
            if (!queue.failure.empty()) fmt::print("slurm    cannot be asked: {}\n", queue.failure);
            fmt::print("{}", ended_text(queue, status.incomplete));
            std::fflush(stdout);
            if (!request_.watch || status.done + status.failed == status.runs) return kExitFine;
            for (int tenth = 0; tenth < 20; ++tenth) {
                if (interrupt_requested()) return kExitInterrupted;
                std::this_thread::sleep_for(std::chrono::milliseconds(100));
            }
        }
    }

    /// What is missing and is in no queue, as an array job.
    int submit_array() const {
        const SlurmQueue queue = ask_queue(request_.out);
        if (!queue.failure.empty()) return report_error({ErrorCode::ToolFailed, queue.failure, {}, 0, 0, "--slurm"});
        std::vector<std::uint64_t> chunks;
        for (const std::uint64_t chunk : find_status(request_.out, plan_).incomplete)
            if (!queue.chunks.contains(chunk)) chunks.push_back(chunk);
        if (chunks.empty()) {
            fmt::print("nothing to submit: {}\n", queue.running + queue.waiting > 0 ? queued_text(queue) : std::string("every run has its result"));
            return kExitFine;
        }
        std::error_code failed;
        const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed);
        const auto job = submit(request_.out, plan_, chunks, program, forecast(), request_.cluster);
        if (!job) return report_error(job.error());
        fmt::print("submitted {}: {} chunks after the preparation in {}   --status tells how far it is\n", job->array_id, chunks.size(), job->prepare_id);
        return kExitFine;
    }

    /// Nothing where it was not wanted: then a run counts as a second.
    SweepForecast forecast() const {
        SweepForecast known;
        known.run_s = known.longest_s = 1.0;
        if (!request_.forecast) return known;
        ProgressLine progress(!request_.quiet);
        const SweepForecast found = forecast_sweep(plan_, [&](const std::string& what) { progress.show(what); });
        progress.clear();
        if (!found.failure.empty()) report_notice(found.failure);
        return found.tried > 0 ? found : known;
    }

    int list() const {
        const std::uint64_t runs = plan_.run_count();
        for (std::uint64_t k = 0; k < std::min(runs, kMostListed); ++k) fmt::print("{:>7}  {}\n", k, plan_.describe(plan_.run(k)));
        if (runs > kMostListed) fmt::print("        and {} more\n", runs - kMostListed);
        std::vector<std::uint64_t> chunks(plan_.chunk_count());
        for (std::size_t i = 0; i < chunks.size(); ++i) chunks[i] = i;
        fmt::print("{} runs, results packed by {}\n", runs, plan_.chunk_runs);
        std::fflush(stdout); // trials take their time
        const SweepForecast known = forecast();
        if (known.tried > 0)
            fmt::print("about {} a run ({} the longest of {} tried), {} in all on one core; {:.0f} MB\n", duration_text(known.run_s), duration_text(known.longest_s),
                       known.tried, duration_text(known.run_s * static_cast<double>(runs)), known.memory_mb);
        const auto tasks = group_chunks(plan_, chunks, known.run_s, 1000);
        fmt::print("on a cluster {} tasks of up to {} runs\n", tasks.size(), std::min(runs, tasks.front().size() * plan_.chunk_runs));
        return kExitFine;
    }

    /// Runs what is missing with a pool of processes.
    int run() {
        const SweepStatus before = find_status(request_.out, plan_);
        done_before_ = before.done + before.failed;
        chunks_ = before.incomplete;
        remove_old_scratch(request_.out);
        if (!chunks_.empty())
            if (const int code = run_pool(); code != kExitFine) return code;
        remove_old_scratch(request_.out);
        return tell_end();
    }

    int collect() const {
        auto csv = AtomicFile::create(request_.table);
        if (!csv) return report_error(csv.error());
        SweepPage plots(column_names(plan_), plan_);
        if (const auto head = csv->add(csv_row(column_names(plan_))); !head) return report_error(head.error());
        const auto collected = collect_table(request_.out, plan_, [&](std::uint64_t run, const std::vector<std::string>& row) {
            plots.add(run, row);
            return csv->add(csv_row(row));
        });
        if (!collected) return report_error(collected.error());
        const SweepTable& table = *collected;
        WrittenOutputs outputs;
        outputs.note(csv->finish());
        const std::filesystem::path page = std::filesystem::path(request_.table).replace_extension(".html");
        std::error_code unknown;
        const std::filesystem::path place = std::filesystem::absolute(page, unknown).lexically_normal().parent_path();
        const bool is_device = std::filesystem::exists(request_.table, unknown) && !std::filesystem::is_regular_file(request_.table, unknown);
        if (!is_device) outputs.note(write_file_atomically(page, plots.text(request_.sweep.stem().string(), table, request_.out, place)));
        for (const std::string& notice : table.notices) report_notice(notice);
        if (table.missing > 0) report_notice(fmt::format("{} of {} runs are missing in the table", table.missing, plan_.run_count()));
        fmt::print("table {}{}   {} rows: {} done, {} failed, {} missing\n", request_.table.string(), is_device ? "" : "   page " + page.string(), table.rows,
                   table.done, table.failed, table.missing);
        return outputs.tell({});
    }

private:
    int run_pool() {
        std::vector<std::vector<std::string>> jobs;
        for (const std::uint64_t chunk : chunks_)
            jobs.push_back({"sweep-worker", request_.out.string(), "--chunk", std::to_string(chunk), "--parent", std::to_string(getpid())});
        counted_.assign(chunks_.size(), 0);
        const ResultStore::Parts begun = store_.find_begun();
        for (std::size_t i = 0; i < chunks_.size(); ++i) counted_[i] = store_.read(chunks_[i], begun).runs.size();
        const InterruptHold hold(InterruptHold::Then::OwnerEnds);
        ProgressLine progress(!request_.quiet, ProgressLine::Elsewhere::ALineAMinute);
        const StopWatch watch;
        std::string failure;
        {
            JobPool pool(std::move(jobs), request_.jobs);
            bool working = true;
            while (working && !interrupt_requested()) {
                pool.tick();
                working = false;
                std::size_t refused = 0;
                for (std::size_t i = 0; i < chunks_.size(); ++i) {
                    working = working || !pool.is_done(i);
                    refused += pool.is_done(i) && pool.exit_code(i) == kExitBadInput;
                }
                if (refused >= kMostRefused) break; // a full disk: the others would end as they did
                if (working) std::this_thread::sleep_for(std::chrono::milliseconds(3));
                show(pool, progress, watch.elapsed_ms());
            }
            progress.clear();
            for (std::size_t i = 0; i < chunks_.size() && failure.empty(); ++i)
                if (pool.is_done(i))
                    if (const auto ended = pool.outcome(i); !ended) failure = ended.error().message;
        }
        if (interrupt_requested()) {
            const SweepStatus now = find_status(request_.out, plan_);
            print_to_stderr(fmt::format("interrupted: {} of {} runs are finished; the same command with --resume goes on with the others",
                                        now.done + now.failed, now.runs));
            return kExitInterrupted;
        }
        if (!failure.empty()) report_notice(failure);
        return kExitFine;
    }

    /// How far it is, at most twice a second: workers' files are read.
    void show(const JobPool& pool, ProgressLine& progress, double now_ms) {
        if (now_ms - shown_ms_ < 500.0) return;
        shown_ms_ = now_ms;
        std::uint64_t done = plan_.run_count();
        for (std::size_t i = 0; i < chunks_.size(); ++i) {
            const auto [first, end] = plan_.chunk(chunks_[i]);
            if (pool.is_running(i)) counted_[i] = store_.read(chunks_[i]).runs.size();
            if (pool.is_done(i)) counted_[i] = end - first;
            done -= end - first - counted_[i];
        }
        const std::uint64_t all = plan_.run_count(), here = done > done_before_ ? done - done_before_ : 0;
        const std::size_t filled = all > 0 ? 24 * done / all : 24;
        std::string text = fmt::format("[{:=>{}}{: >{}}] {}/{} runs", "", filled, "", 24 - filled, done, all);
        if (here > 0) text += ", " + duration_text(1e-3 * now_ms / static_cast<double>(here) * static_cast<double>(all - done)) + " to go";
        progress.show(text);
    }

    int tell_end() const {
        const SweepStatus status = find_status(request_.out, plan_);
        fmt::print("{} runs: {} done, {} failed, {} missing   results {}\n", status.runs, status.done, status.failed, status.missing, request_.out.string());
        if (status.failed > 0) {
            const auto& first = status.failures.front();
            report_notice(fmt::format("{} runs failed and are rows with their reason; the first, run {}: {}", status.failed, first.run,
                                      first.reason));
        }
        const std::uint64_t missing = status.missing + status.running.size();
        if (missing == 0) return kExitFine;
        return report_error({ErrorCode::ToolFailed, fmt::format("{} of {} runs are missing; the same command with --resume runs them", missing, status.runs),
                             request_.out.string()});
    }

    const SweepRequest& request_;
    const SweepPlan& plan_;
    ResultStore store_;
    std::vector<std::uint64_t> chunks_;   // with missing runs
    std::vector<std::uint64_t> counted_;  // [chunk] finished runs as last seen
    std::uint64_t done_before_ = 0;
    double shown_ms_ = -1e9;
};

Result<void> check_request(const SweepRequest& request) {
    const auto fail = [](std::string message, const char* key) { return Error{ErrorCode::BadUsage, std::move(message), {}, 0, 0, key}; };
    if (request.dry_run) return {};
    if (request.out.empty()) return fail("is wanted: the folder of the sweep's results", "--out");
    if (request.retry_failed && !request.resume) return fail("goes with --resume", "--retry-failed");
    if (request.watch && !request.status) return fail("goes with --status", "--watch");
    if (request.slurm && !request.table.empty()) return fail("wants results, which come later: collect when --status tells that all is done", "--collect");
    if (request.table.extension() == ".html") return fail("names the table; the page beside it is NAME.html; expected another ending, as in .csv", "--collect");
    if (const bool is_in_folder = is_same_place(request.table.parent_path(), request.out); !request.table.empty() && !is_in_folder)
        return check_place(request.table, "--collect"); // the sweep's own folder is made before the table
    return {};
}

/// The table must not take the place of what the sweep is made of.
Result<void> check_table(const SweepRequest& request, const SweepSpec& spec, const SweepPlan& plan) {
    std::vector<std::filesystem::path> taken{request.sweep, request.out / sweep_name::kPlan, request.out / sweep_name::kLock};
    for (const std::vector<PlannedFile>* list : {&plan.scenes, &plan.files})
        for (const PlannedFile& one : *list) taken.emplace_back(one.file);
    for (const SweepAxis& axis : spec.axes) taken.emplace_back(axis.file);
    for (const std::filesystem::path& file : taken)
        if (!request.table.empty() && is_same_place(request.table, file))
            return Error{ErrorCode::BadUsage, "would overwrite a file that the sweep reads; expected another name", request.table.string(), 0, 0, "--collect"};
    return {};
}

int sweep(SweepRequest& request) {
    if (const auto fits = check_request(request); !fits) return report_error(fits.error());
    const auto spec = read_sweep(request.sweep);
    if (!spec) return report_error(spec.error());
    const auto plan = make_plan(*spec);
    if (!plan) return report_error(plan.error());
    if (const auto fits = check_sweep_options(*spec, *plan); !fits) return report_error(fits.error());
    if (request.dry_run) return Sweep(request, *plan).list();
    std::error_code failed;
    request.out = std::filesystem::absolute(request.out, failed).lexically_normal();
    if (const auto fits = check_table(request, *spec, *plan); !fits) return report_error(fits.error());
    const auto state = inspect_folder(request.out, *plan);
    if (!state) return report_error(state.error());
    const bool is_new = *state == FolderState::New;
    const auto at_folder = [&](std::string message) { return report_error({ErrorCode::BadUsage, std::move(message), request.out.string()}); };
    Sweep one(request, *plan);
    if (request.status) return is_new ? at_folder("holds no sweep yet; without --status it is run") : one.show_status();
    const bool collects_alone = !is_new && !request.resume && !request.table.empty();
    if (collects_alone) return one.collect();
    if (!is_new && !request.resume)
        return at_folder("holds results of this sweep; --resume runs what is missing, --collect makes the table, --status tells how far it is");
    if (is_new && request.resume)
        report_notice(fmt::format("nothing in {} belongs to this sweep; it starts from the beginning", request.out.string()));
    const auto lock = FolderLock::take(request.out);
    if (!lock) return report_error(lock.error());
    if (const auto now = inspect_folder(request.out, *plan); !now) // another sweep may have begun there just before
        return report_error(now.error());
    for (const std::filesystem::path& place : {request.out, request.out / sweep_name::kSlurm}) remove_temporaries(place); // a submitter's alone
    if (is_new)
        if (const auto written = write_plan_once(request.out, *plan); !written) return report_error(written.error());
    if (request.plan) {
        fmt::print("{} runs in {} chunks, 0 to {}   plan {}\n", plan->run_count(), plan->chunk_count(), plan->chunk_count() - 1, (request.out / sweep_name::kPlan).string());
        return kExitFine;
    }
    const ResultStore store(request.out, *plan);
    if (request.retry_failed)
        if (const auto dropped = store.drop_failed(); !dropped) return report_error(dropped.error());
    const int code = request.slurm ? one.submit_array() : one.run();
    if (const auto packed = store.pack_complete(); !packed) return report_error(packed.error());
    if (request.slurm) return code;
    if (request.table.empty() || code == kExitInterrupted) return code;
    const int collected = one.collect();
    return code != kExitFine ? code : collected;
}

} // namespace

Command add_sweep_command(CLI::App& app) {
    const auto request = std::make_shared<SweepRequest>();
    CLI::App* command = app.add_subcommand("sweep", "Run scenes under all combinations of what is varied, and collect one table");
    command->add_option("sweep", request->sweep, "sweep file (JSON)")->required();
    command->add_option("--out", request->out, "folder of the plan and the results");
    command->add_option("--jobs", request->jobs, "runs at once, in processes of their own")->check(CLI::Range(1u, 256u));
    command->add_flag("--status", request->status, "tell what is done, running, failed and missing; nothing runs");
    command->add_flag("--resume", request->resume, "run what is missing of the results that are there");
    command->add_flag("--retry-failed", request->retry_failed, "with --resume: run what has failed again, too");
    command->add_option("--collect", request->table, "write the table (CSV) to this file; alone where the results are there already");
    command->add_flag("--plan", request->plan, "write the plan and run nothing: for workers that are started by hand");
    command->add_flag("--dry-run", request->dry_run, "check everything and list the runs; nothing runs");
    CLI::Option* slurm = command->add_flag("--slurm", request->slurm, "submit what is missing as one array job of Slurm");
    command->add_option("--partition", request->cluster.partition, "of the cluster")->needs(slurm);
    command->add_option("--time", request->cluster.time, "limit of one task, as Slurm writes it; from a forecast when absent")->needs(slurm);
    command->add_option("--memory", request->cluster.memory_mb, "MB of one task; from a forecast when absent")->needs(slurm)->check(number_range(1.0, 1e8));
    command->add_flag("--watch", request->watch, "with --status: tell it every two seconds until all is done");
    command->add_flag("!--no-forecast", request->forecast, "with --dry-run or --slurm: try no steps; a run counts as a second");
    command->add_flag("--quiet", request->quiet, "no progress line");
    return {command, [request] { return sweep(*request); }};
}

} // namespace trocar::engine
