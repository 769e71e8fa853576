#include "engine/cli/commands.hpp"
#include "engine/cli/number_range.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/set_option.hpp"
#include "engine/cli/taken_files.hpp"
#include "engine/render/attach_culler.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/printable.hpp"
#include "engine/report/grant_record.hpp"
#include "engine/report/observer.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/statistics.hpp"
#include "engine/experiments/plan_scene.hpp"
#include "engine/experiments/trace.hpp"
#include "engine/step/checkpoint.hpp"
#include "engine/step/model_hash.hpp"
#include "engine/time/interrupt.hpp"
#include "engine/time/pacer.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>

namespace trocar::engine {

namespace {

struct RunOptions {
    std::filesystem::path scene;
    std::filesystem::path out;  // empty: out/<scene name>
    std::int64_t steps = -1;    // < 0: as the scene says
    std::string budget;         // empty: as the scene says
    double pace = -1.0;         // simulated seconds in a second; 0: as fast as it goes; < 0: as the scene says
    std::filesystem::path path; // CSV that replaces the first instrument's script
    std::string target;         // that the path's tip is measured against; empty: the one that the scene follows, if any
    std::filesystem::path record_grants, replay;
    std::uint64_t checkpoint_every = 0; // steps; 0: none
    std::filesystem::path resume;       // a checkpoint, or the output folder that holds one
    SceneSettings settings;
    bool trace = false, record = false, force = false, fail_on_overrun = false, pictures = true, page = true, quiet = false;
};

/// Decisions of the clock: written down, or taken from a record, or both. And the time line, where it is asked for.
struct Grants {
    GrantRecord* record = nullptr;
    const GrantRecord* replay = nullptr;
    StepTrace* trace = nullptr;
};

/// What the command line says overrides what the scene says.
Result<void> apply_overrides(const RunOptions& options, Scene& scene) {
    if (!options.budget.empty()) scene.budget.limits = parse_budget(options.budget)->limits; // checked with the command line
    if (options.pace == 0.0) scene.time.pace.reset();
    if (options.pace > 0.0) scene.time.pace = PaceSpec{options.pace, scene.time.pace.value_or(PaceSpec{}).late};
    if (!options.path.empty()) {
        if (scene.instruments.empty())
            return Error{ErrorCode::BadUsage, "the scene has no instrument that could follow a path", {}, 0, 0, "--path"};
        if (const Result<void> read = read_instrument_paths(scene, options.path); !read.ok()) return read;
        if (!options.target.empty()) return aim_first_instrument(scene, options.target);
    }
    return {};
}

/// A replayed path that nobody named a target for is measured against the scene's only one, where that can be reached.
/// progress  as of prepare_scene
Result<PreparedScene> prepare_to_run(const RunOptions& options, Scene& scene, const Progress& progress) {
    const bool guess = !options.path.empty() && options.target.empty() && scene.targets.size() == 1 && !scene.instruments[kLeadInstrument].follow;
    if (!guess || !aim_first_instrument(scene, scene.targets.front().name).ok()) return make_prepared_scene(scene, progress);
    auto prepared = make_prepared_scene(scene, progress);
    if (!prepared.ok()) {
        scene.instruments[kLeadInstrument].follow.reset();
        return make_prepared_scene(scene, progress);
    }
    std::erase_if(prepared->notices, [](const std::string& notice) { return notice.starts_with("targets."); }); // of following it
    return prepared;
}

void print_summary(const RunSummary& summary, const PreparedScene& prepared, const std::filesystem::path& out, bool page) {
    fmt::print("{} steps in {:.3g} s, real-time factor {:.3g}, step p50/p95/p99/max {:.3g}/{:.3g}/{:.3g}/{:.3g} ms, "
               "budget kept in {:.2f} %\n",
               summary.steps, summary.wall_s, summary.realtime_factor, summary.step_ms.p50, summary.step_ms.p95, summary.step_ms.p99,
               summary.step_ms.max, percent_of(summary.budget_kept));
    const double step_ms = 1e3 * prepared.model.step_s;
    fmt::print("real time kept in {:.2f} %: {} of {} whole steps took longer than the {:.4g} ms they simulate{}\n",
               percent_of(summary.realtime_kept), summary.realtime_overruns, summary.steps, step_ms,
               prepared.model.budget.mode == BudgetMode::Wall && !prepared.model.budget_covers_step
                   ? "; the budget is for contact alone"
                   : "");
    if (prepared.model.budget.mode == BudgetMode::Wall)
        fmt::print("charged to the budget p50/p95/p99/max {:.3g}/{:.3g}/{:.3g}/{:.3g} of {:.4g} ms\n", summary.charged_ms.p50, summary.charged_ms.p95,
                   summary.charged_ms.p99, summary.charged_ms.max, 1e3 * prepared.model.budget.wall_s);
    if (summary.floor_steps > 0)
        fmt::print("below the floor{} in {} of {} steps: all that a budget may leave out was left out\n",
                   summary.floor_ms > 0.0 ? fmt::format(" of {:.2g} ms", summary.floor_ms) : "", summary.floor_steps, summary.steps);
    if (!prepared.model.instruments.empty())
        fmt::print("lumen exits {}, exact contacts in {} of {} steps, {} scaled to the safe fraction, {} unresolved, {} assumed{}\n",
                   summary.lumen_exits, summary.exact_steps, summary.steps, summary.scaled_steps, summary.unresolved, summary.assumed,
                   summary.unproven_steps > 0 ? fmt::format(", not proven free in {} steps", summary.unproven_steps) : "");
    if (summary.passed_places + summary.unproven_solids > 0)
        fmt::print(
            "{} places of solids beyond the middle of another, pushed back to where they came from; {} pairs of solids may have passed "
            "through each other\n",
            summary.passed_places, summary.unproven_solids);
    if (summary.pace)
        fmt::print("pace {:g}: {} of {} steps began late, by {:.3g} ms at worst; {:.3g} s behind real time\n", summary.pace->speed,
                   summary.pace_stats.late_steps, summary.steps, 1e-6 * static_cast<double>(summary.pace_stats.worst_late_ns),
                   1e-9 * static_cast<double>(summary.pace_stats.lost_ns));
    if (summary.target_distance_m >= 0.0)
        fmt::print("tip to target {:.2f} mm{}\n", 1e3 * summary.target_distance_m,
                   prepared.model.instruments[kLeadInstrument].path.empty() ? "" : ", at the end of the replayed path");
    const bool lost = !page || std::any_of(summary.missing_outputs.begin(), summary.missing_outputs.end(),
                                  [](const std::string& sentence) { return sentence.starts_with(output_name::kReport); });
    fmt::print("state {}{}\n", summary.state_hash, lost ? "" : "   report " + (out / output_name::kReport).string());
}

/// How the steps ended, when nothing went wrong with the output.
struct Taken {
    bool interrupted = false;
    std::uint64_t left_record = 0; // the step in which a replay was no longer the recorded run; 0: it was, to the end
};

/// One step, with its decisions to or from a file. False: a replay that is not the recorded run.
bool take_step(Simulator& simulator, std::uint64_t k, const Grants& grants) {
    if (grants.record != nullptr) simulator.tape().record_into(&grants.record->steps.emplace_back().decisions);
    if (grants.replay != nullptr) simulator.tape().replay(grants.replay->steps[k].decisions);
    const StepReport& report = simulator.step();
    if (grants.record != nullptr) grants.record->steps.back().fingerprint = fingerprint_of(report);
    return grants.replay == nullptr || (!simulator.tape().left_script() && grants.replay->steps[k].fingerprint == fingerprint_of(report));
}

/// Steps until done, stopped, or interrupted. An output that cannot be written is reported at once: hours may follow.
Taken take_steps(Simulator& simulator, RunObserver& observer, std::uint64_t steps, const Grants& grants, Pacer* pacer,
                 ProgressLine& progress) {
    Taken taken;
    for (std::uint64_t k = simulator.state().step; k < steps; ++k) {
        taken.interrupted = interrupt_requested();
        if (taken.interrupted) break;
        if (pacer != nullptr) wait_until_ns(pacer->begin_step(monotonic_ns()));
        const bool as_recorded = take_step(simulator, k, grants);
        const StepReport& report = simulator.report();
        const Result<void> observed = observer.after_step(simulator, report);
        if (!observed.ok()) {
            progress.clear();
            report_notice(printable(observed.error().to_string()) + "; the run goes on without it");
        }
        progress.show_step(k + 1, steps, report, simulator.budget());
        if (grants.trace != nullptr) grants.trace->add(report);
        if (!as_recorded) taken.left_record = k + 1;
        if (!as_recorded || !report.finite) break;
    }
    return taken;
}

/// The record holds as many steps as are asked for.
Result<void> check_length(const RunOptions& options, const GrantRecord& record) {
    if (options.steps > static_cast<std::int64_t>(record.steps.size()))
        return Error{ErrorCode::BadUsage,
                     fmt::format("the record holds {} steps; expected at most that many", record.steps.size()),
                     {},
                     0,
                     0,
                     "--steps"};
    return {};
}

/// The record belongs to this scene.
Result<void> check_replay(const RunOptions& options, const GrantRecord& record, const SceneModel& model) {
    if (record.model_hash != hash_model(model))
        return Error{ErrorCode::BadValue,
                     fmt::format("was recorded with another scene, \"{}\" ({:016x}); this one is \"{}\" ({:016x}), prepared from its "
                                 "meshes and paths as they are now",
                                 record.scene, record.model_hash, model.name, hash_model(model)),
                     options.replay.string()};
    return {};
}

/// The checkpoint's own file: --resume may name the folder that holds it.
std::filesystem::path checkpoint_file(const RunOptions& options) {
    std::error_code failed;
    return std::filesystem::is_directory(options.resume, failed) ? options.resume / output_name::kCheckpoint : options.resume;
}

/// How many steps there will be in all.
std::uint64_t count_steps(const RunOptions& options, std::uint64_t of_scene, const GrantRecord* replay) {
    if (options.steps >= 0) return static_cast<std::uint64_t>(options.steps);
    return replay != nullptr ? replay->steps.size() : of_scene;
}

/// Checked before the scene is prepared: it can be read, is of this scene's name, and has steps to come.
Result<Checkpoint> read_resumed(const RunOptions& options, const Scene& scene, std::uint64_t steps) {
    const std::filesystem::path file = checkpoint_file(options);
    auto checkpoint = read_checkpoint(file);
    if (!checkpoint.ok()) return checkpoint;
    if (checkpoint->scene != scene.name)
        return Error{ErrorCode::BadValue,
                     fmt::format("was made of another scene, \"{}\"; expected one of \"{}\"", checkpoint->scene, scene.name),
                     file.string()};
    if (checkpoint->step >= steps)
        return Error{
            ErrorCode::BadUsage,
            fmt::format("{} is of step {}, and the run is to end at step {}; expected a later end", file.string(), checkpoint->step, steps),
            {},
            0,
            0,
            "--steps"};
    return checkpoint;
}

/// Goes on from a checkpoint. Nothing was written yet: a wrong one costs no outputs.
Result<void> go_on(const RunOptions& options, const Checkpoint& checkpoint, Simulator& simulator) {
    const std::filesystem::path file = checkpoint_file(options);
    if (auto resumed = resume(simulator, checkpoint, file); !resumed.ok()) return resumed;
    const BudgetLimits &was = checkpoint.limits, &is = simulator.budget();
    if (was.mode != is.mode || was.wall_s != is.wall_s || was.work_units != is.work_units)
        report_notice(file.string() + " was made under another budget; this one decides from here on");
    return {};
}

/// Exit code of a replay: did it come to the same end?
int judge_replay(const RunOptions& options, const GrantRecord& record, const Taken& taken, const RunSummary& summary) {
    const std::string hash = fmt::format("{:016x}", record.state_hash);
    if (taken.left_record > 0) {
        report_error({ErrorCode::BadValue,
                      fmt::format("step {} is not the recorded one: another build of the program, or other prepared meshes", taken.left_record),
                      options.replay.string()});
        return kExitDiffers;
    }
    if (summary.steps < record.steps.size()) { // a part was asked for, or it was interrupted
        fmt::print("replayed {} of {} steps, each as it was recorded\n", summary.steps, record.steps.size());
        return kExitFine;
    }
    if (summary.state_hash != hash) {
        report_error({ErrorCode::BadValue, fmt::format("ends in state {}, the recorded run in {}", summary.state_hash, hash),
                      options.replay.string()});
        return kExitDiffers;
    }
    fmt::print("replayed bit for bit\n");
    return kExitFine;
}

/// What the run reads: nothing may be written over it.
/// files  of the scene as it was read: a path of the command line takes the place of its own
std::vector<std::filesystem::path> files_read(const RunOptions& options, std::vector<std::filesystem::path> files) {
    for (const std::filesystem::path& file : {options.path, options.replay})
        if (!file.empty()) files.push_back(file);
    if (!options.resume.empty()) files.push_back(checkpoint_file(options));
    return files;
}

Result<void> write_record(const RunOptions& options, const PreparedScene& prepared, Simulator& simulator, GrantRecord& record) {
    record.model_hash = hash_model(prepared.model);
    record.scene = prepared.model.name;
    record.limits = prepared.model.budget;
    record.covers_step = prepared.model.budget_covers_step;
    record.state_hash = hash_state(simulator.state());
    return write_grant_record(options.record_grants, record);
}

std::filesystem::path output_folder(const RunOptions& options, const Scene& scene) {
    return options.out.empty() ? std::filesystem::path("out") / safe_file_name(scene.name) : options.out;
}

/// Paths, records and checkpoints that the run uses, read and checked before anything is prepared.
struct Given {
    std::optional<GrantRecord> replay;
    std::optional<Checkpoint> checkpoint;
};

/// reads  files_read
Result<Given> read_given(const RunOptions& options, Scene& scene, const std::vector<std::filesystem::path>& reads) {
    if (!options.record_grants.empty()) {
        if (auto fine = check_not_taken(options.record_grants, reads, "--record-grants"); !fine.ok()) return fine.error();
        if (auto fits = check_place(options.record_grants, "--record-grants"); !fits.ok()) return fits.error();
    }
    Given given;
    if (!options.replay.empty()) {
        auto record = read_grant_record(options.replay);
        if (!record.ok()) return record.error();
        if (auto fits = check_length(options, *record); !fits.ok()) return fits.error();
        given.replay = std::move(*record);
        scene.budget.limits = given.replay->limits;
        scene.budget.scope = given.replay->covers_step ? BudgetScope::Step : BudgetScope::Collision;
    }
    if (!options.resume.empty()) {
        auto checkpoint = read_resumed(options, scene, count_steps(options, scene.time.step_count(), nullptr));
        if (!checkpoint.ok()) return checkpoint.error();
        given.checkpoint = std::move(*checkpoint);
    }
    const char* const keep = given.checkpoint ? output_name::kCheckpoint : nullptr;
    const std::filesystem::path folder = output_folder(options, scene);
    if (auto fits = OutputFolder::check(folder, options.force, reads, keep); !fits.ok()) return fits.error();
    std::vector<std::filesystem::path> writes;
    for (const char* name : {output_name::kLock, output_name::kSteps, output_name::kPartialSteps, output_name::kSummary, output_name::kReport,
                             output_name::kTrace, output_name::kCheckpoint, output_name::kLastGoodState, output_name::kRecord, output_name::kFluoro})
        writes.push_back(folder / name);
    if (!options.record_grants.empty())
        if (auto fine = check_not_taken(options.record_grants, writes, "--record-grants"); !fine.ok()) return fine.error();
    return given;
}

/// Reports every missing output, and those that exist. Returns the run's exit code.
int tell_missing(const RunSummary& summary, const std::filesystem::path& out, int code) {
    if (summary.missing_outputs.empty()) return code;
    for (const std::string& sentence : summary.missing_outputs) report_error({ErrorCode::CannotWrite, sentence});
    print_to_stderr(fmt::format("the other outputs of the {} steps are in {}", summary.steps, out.string()));
    return code == kExitNotFinite || code == kExitDiffers ? code : kExitBadInput; // their exit codes take precedence
}

int exit_code(const RunOptions& options, const RunSummary& summary, const Taken& taken, const GrantRecord* replay) {
    if (replay != nullptr)
        if (const int code = judge_replay(options, *replay, taken, summary); code != kExitFine) return code;
    if (!summary.finite) {
        const bool saved = std::none_of(summary.missing_outputs.begin(), summary.missing_outputs.end(),
                                        [](const std::string& sentence) { return sentence.starts_with(output_name::kLastGoodState); });
        report_error({ErrorCode::NotFinite, fmt::format("stopped: {}; the last good state is {}saved", summary.failure, saved ? "" : "not ")});
        return kExitNotFinite;
    }
    if (taken.interrupted) return kExitInterrupted;
    if (!options.fail_on_overrun || summary.overruns == 0) return kExitFine;
    report_error({ErrorCode::BadValue, fmt::format("{} of {} steps missed the budget", summary.overruns, summary.steps)});
    return kExitOverrun;
}

int simulate(const RunOptions& options, const Scene& scene, const PreparedScene& prepared, const Given& given, ProgressLine& progress) {
    const GrantRecord* replay = given.replay ? &*given.replay : nullptr;
    ObserveOptions observe;
    observe.out = output_folder(options, scene);
    observe.force = options.force;
    observe.record = options.record;
    observe.pictures = options.pictures;
    observe.page = options.page;
    observe.steps = count_steps(options, prepared.model.step_count, replay);
    observe.checkpoint_every = options.checkpoint_every;
    Simulator simulator(prepared.model);
    if (given.checkpoint) {
        if (const auto resumed = go_on(options, *given.checkpoint, simulator); !resumed.ok()) return report_error(resumed.error());
        observe.resumed_from = &simulator.state();
    }
    const std::uint64_t first_step = simulator.state().step;
    const InterruptHold hold(InterruptHold::Then::OwnerEnds); // what was done is written
    auto observer = RunObserver::open(scene, prepared, observe);
    if (!observer.ok()) return report_error(observer.error());

    if (const std::string culler = attach_culler(simulator); !culler.empty()) report_notice(culler);
    GrantRecord record;
    StepTrace trace;
    const Grants grants{options.record_grants.empty() ? nullptr : &record, replay, options.trace ? &trace : nullptr};
    std::optional<Pacer> pacer;
    if (scene.time.pace) pacer.emplace(*scene.time.pace, prepared.model.step_s);
    const StopWatch watch;
    const Taken taken = take_steps(simulator, **observer, observe.steps, grants, pacer ? &*pacer : nullptr, progress);
    const double wall_s = 1e-3 * watch.elapsed_ms();
    progress.clear();
    if (pacer) (*observer)->set_pace(pacer->spec(), pacer->stats());
    if (!options.record_grants.empty())
        (*observer)->note_output(options.record_grants.string(), write_record(options, prepared, simulator, record));
    if (options.trace)
        (*observer)->note_output(output_name::kTrace, write_file_atomically(observe.out / output_name::kTrace, trace.text()));
    const RunSummary summary = (*observer)->finish(simulator, wall_s, taken.interrupted);
    for (const std::string& notice : (*observer)->notices()) report_notice(notice);
    for (const std::string& note : simulator.cull_notes()) report_notice(note);
    print_summary(summary, prepared, observe.out, options.page);
    if (first_step > 0) fmt::print("resumed after step {}: rows, counts and extremes are of the steps since then\n", first_step);
    return tell_missing(summary, observe.out, exit_code(options, summary, taken, replay));
}

int run(const RunOptions& options) {
    Result<Scene> scene = read_set_scene(options.scene, options.settings);
    if (!scene.ok()) return report_error(scene.error());
    const std::vector<std::filesystem::path> reads = files_read(options, files_of(*scene));
    const Result<void> overridden = apply_overrides(options, *scene);
    if (!overridden.ok()) return report_error(overridden.error());
    const Result<Given> given = read_given(options, *scene, reads);
    if (!given.ok()) return report_error(given.error());
    ProgressLine progress(!options.quiet);
    const auto prepared = prepare_to_run(options, *scene, [&](const std::string& what) { progress.show("preparing " + what); });
    progress.clear();
    if (!prepared.ok()) return report_error(prepared.error());
    if (given->replay)
        if (const auto belongs = check_replay(options, *given->replay, prepared->model); !belongs.ok())
            return report_error(belongs.error());
    return simulate(options, *scene, *prepared, *given, progress);
}

} // namespace

Command add_run_command(CLI::App& app) {
    const auto run_options = std::make_shared<RunOptions>();
    RunOptions& options = *run_options;
    CLI::App* command = app.add_subcommand("run", "Simulate a scene without a display and report what was done");
    command->add_option("scene", options.scene, "scene file (JSON)")->required();
    command->add_option("--out", options.out, "output folder; out/<scene name> where none is given");
    command->add_option("-n,--steps", options.steps, "steps to take instead of the scene's duration")
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
    CLI::Option* budget = command->add_option("--budget", options.budget, "per step: a time (1ms, 250us), work:TESTS, or exact")->check(budget_text());
    command
        ->add_option("--pace", options.pace,
                     "simulated seconds in a second: 1 is real time, 0 as fast as it goes; as the scene says when absent")
        ->check(zero_or_range(1e-3, 1e3));
    command->add_option(
        "--path", options.path,
        "CSV t,insertion,rotation (or NAME.insertion,NAME.rotation of several instruments) in the scene's units, instead of the "
        "scene's script");
    command->add_option("--to", options.target, "with --path: the target that the tip is measured against, one of the scene's")
        ->needs("--path");
    CLI::Option* record = command->add_option("--record-grants", options.record_grants, "write every decision of the clock to this file");
    CLI::Option* replay =
        command->add_option("--replay", options.replay, "repeat the run of such a file bit for bit, under its budget")->excludes(budget);
    command->add_option("--checkpoint-every", options.checkpoint_every, "write checkpoint.bin every so many steps, and at the end")
        ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}));
    command
        ->add_option("--resume", options.resume,
                     "go on from such a file, or from the output folder that holds it, up to step -n counted from the first run's start")
        ->excludes(record)
        ->excludes(replay);
    command->add_flag("--trace", options.trace, "write the stages of every step for chrome://tracing and ui.perfetto.dev");
    command->add_flag("--record", options.record, "write states for ParaView (PVD, VTP)");
    command->add_flag("--force", options.force, "write into an output folder that is not empty");
    command->add_flag("--fail-on-overrun", options.fail_on_overrun, "exit 4 when a step missed its budget");
    command->add_flag("!--no-pictures", options.pictures, "take no pictures");
    command->add_flag("!--no-report", options.page, "write no report.html, whose plots take longer than a short run");
    add_set_options(*command, options.settings);
    command->add_flag("--quiet", options.quiet, "no progress line");
    return {command, [run_options] { return run(*run_options); }};
}

} // namespace trocar::engine
