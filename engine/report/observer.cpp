#include "engine/report/observer.hpp"

#include "engine/io/atomic_file.hpp"
#include "engine/report/floor.hpp"
#include "engine/report/missing.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/report/photographer.hpp"
#include "engine/report/recorder.hpp"
#include "engine/report/report_page.hpp"
#include "engine/report/step_table.hpp"
#include "engine/report/summary.hpp"
#include "engine/report/verdict.hpp"
#include "engine/report/xray_frames.hpp"
#include "engine/step/checkpoint.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <limits>
#include <utility>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kUsualStates = 100; // when the command line asks and the scene does not say how often

/// Outputs of several files, as they are called where some are missing.
constexpr const char *kPictures = "pictures", *kFluoroscopyFrames = "fluoroscopy frames", *kRecordedStates = "recorded states";

std::uint64_t record_interval(const Scene& scene, const ObserveOptions& options) {
    if (scene.outputs.record_every > 0) return scene.outputs.record_every;
    if (!options.record) return 0;
    return std::max<std::uint64_t>(1, (options.steps + kUsualStates - 1) / kUsualStates);
}

void append(const std::vector<std::string>& lines, std::vector<std::string>& to) { to.insert(to.end(), lines.begin(), lines.end()); }

/// ms; infinite where the budget is no time.
double budget_limit_ms(const BudgetSpec& budget) {
    return budget.limits.mode == BudgetMode::Wall ? 1e3 * budget.limits.wall_s : std::numeric_limits<double>::infinity();
}

} // namespace

struct RunObserver::Parts {
    Parts(const Scene& scene_in, const PreparedScene& prepared_in, const ObserveOptions& options_in, OutputFolder folder_in,
          StepTable table_in)
        : scene(scene_in), prepared(prepared_in), options(options_in), budget_ms(budget_limit_ms(scene_in.budget)),
          first_step(options_in.resumed_from != nullptr ? options_in.resumed_from->step : 0), folder(std::move(folder_in)),
          table(std::move(table_in)), photographer(scene_in, folder.path()),
          recorder(prepared_in.model, folder.path() / output_name::kRecord, record_interval(scene_in, options_in)) {
        statistics.reserve(options.steps);
    }

    [[nodiscard]] Moment moment(Simulator& simulator) const {
        return {prepared, simulator.state(), simulator.contacts()};
    }
    Result<void> start();
    void observe(Simulator& simulator, const StepReport& report);
    void stop(Simulator& simulator, const StepReport& report);
    void take_pictures(const Moment& now, double time, bool rest);
    void take_xrays(const State& state);
    void save(Simulator& simulator);
    void note(const std::string& what, const Result<void>& written);
    void write_pages(RunRecord& record);

    const Scene& scene;
    const PreparedScene& prepared;
    ObserveOptions options;
    double budget_ms;
    std::uint64_t first_step; // steps that were done before this run
    OutputFolder folder;
    StepTable table;
    Photographer photographer;
    Recorder recorder;
    std::unique_ptr<XrayFrames> xrays; // nullptr: the scene asks for none, or nobody wants pictures
    std::size_t failed_xrays = 0;
    RunStatistics statistics;
    std::vector<std::string> notices;
    MissingOutputs missing;
    std::optional<Error> news; // an output that has begun to be missing, not reported yet
    std::size_t failed_pictures = 0;
    double spent_ms = 0.0; // in here while the run goes
    std::optional<PaceSpec> pace;
    PaceStats pace_stats;
    std::string failure, last_good_state;
    std::uint64_t failed_step = 0;
    std::uint64_t saved_step = 0; // of the newest checkpoint; 0: there is none
};

/// The state before the first step: pictures of time 0, and a driver that is awake before the steps begin. A run that goes on takes
/// no picture that the one before it has taken.
Result<void> RunObserver::Parts::start() {
    if (options.resumed_from != nullptr) {
        photographer.skip_until(options.resumed_from->time);
        return recorder.start(*options.resumed_from);
    }
    const bool picture = options.pictures && photographer.anything_due(0.0);
    const bool record = record_interval(scene, options) > 0;
    if (!picture && !record && !xrays) return {};
    const State initial = make_initial_state(prepared.model);
    if (xrays) take_xrays(initial);
    if (picture) take_pictures({.prepared = prepared, .state = initial, .contacts = {}}, 0.0, false);
    return recorder.start(initial);
}

void RunObserver::Parts::note(const std::string& what, const Result<void>& written) {
    if (missing.note(what, written) && !news) news = written.error();
}

void RunObserver::Parts::take_pictures(const Moment& now, double time, bool rest) {
    rest ? photographer.take_rest(now, time, notices) : photographer.take_due(now, time, notices);
    for (; failed_pictures < photographer.failed().size(); ++failed_pictures) {
        const Error& error = photographer.failed()[failed_pictures];
        if (missing.add(kPictures, error) && !news) news = error;
    }
}

void RunObserver::Parts::take_xrays(const State& state) {
    xrays->take(state);
    for (; failed_xrays < xrays->failed().size(); ++failed_xrays)
        if (missing.add(kFluoroscopyFrames, xrays->failed()[failed_xrays]) && !news) news = xrays->failed()[failed_xrays];
}

void RunObserver::Parts::observe(Simulator& simulator, const StepReport& report) {
    if (!report.finite) return stop(simulator, report);
    statistics.add(report, budget_ms, simulator.contacts().size());
    note(output_name::kSteps, table.add(report));
    if (options.pictures && photographer.anything_due(report.time_s)) take_pictures(moment(simulator), report.time_s, false);
    if (xrays && xrays->is_due(simulator.state())) take_xrays(simulator.state());
    if (options.checkpoint_every > 0 && report.step % options.checkpoint_every == 0) save(simulator);
    if (Result<void> recorded = recorder.after_step(simulator.state()); !recorded && missing.add(kRecordedStates, recorded.error()))
        news = recorded.error();
}

void RunObserver::Parts::save(Simulator& simulator) {
    const Result<void> written = write_checkpoint(folder.path() / output_name::kCheckpoint, make_checkpoint(simulator));
    if (written.ok()) saved_step = simulator.state().step; // an older one stays where it is
    note(output_name::kCheckpoint, written);
}

/// The step that failed has no row: it was not done. The simulator went back to the last good state, which is kept.
void RunObserver::Parts::stop(Simulator& simulator, const StepReport& report) {
    failure = report.failure;
    failed_step = report.step;
    const std::filesystem::path place = folder.path() / output_name::kLastGoodState;
    std::error_code failed;
    std::filesystem::create_directories(place, failed);
    if (failed)
        return note(output_name::kLastGoodState,
                    Error{.code = ErrorCode::CannotWrite, .message = "cannot be made: " + failed.message(), .file = place.string()});
    const auto files = write_state(place, prepared.model, simulator.state(), "", false);
    if (files) last_good_state = output_name::kLastGoodState;
    note(output_name::kLastGoodState, files ? Result<void>() : Result<void>(files.error()));
}

/// The report first: the summary names what is missing of all the others, and alone of itself it cannot.
void RunObserver::Parts::write_pages(RunRecord& record) {
    record.notices = notices;
    append(missing.sentences(), record.notices);
    if (options.page)
        note(output_name::kReport, write_file_atomically(folder.path() / output_name::kReport,
                                                         make_report_page(record, photographer.taken(), folder.path(), notices)));
    append(list_warnings(record), notices); // the report has them as losses, with what would help
    record.notices = notices;
    record.summary.missing_outputs = missing.sentences();
    note(output_name::kSummary, write_file_atomically(folder.path() / output_name::kSummary, summary_text(record)));
    record.summary.missing_outputs = missing.sentences();
}

Result<std::unique_ptr<RunObserver>> RunObserver::open(const Scene& scene, const PreparedScene& prepared, const ObserveOptions& options) {
    std::unique_ptr<XrayFrames> xrays; // before an earlier run's outputs are removed: its sources may be refused
    if (options.pictures) {
        auto made = XrayFrames::make(scene, prepared, options.out);
        if (!made) return made.error();
        xrays = std::move(*made);
    }
    Result<OutputFolder> folder =
        OutputFolder::open(options.out, options.force, options.resumed_from != nullptr ? output_name::kCheckpoint : nullptr);
    if (!folder) return folder.error();
    Result<StepTable> table = StepTable::create(options.out, budget_limit_ms(scene.budget));
    if (!table) return table.error();
    auto parts = std::make_unique<Parts>(scene, prepared, options, std::move(*folder), std::move(*table));
    parts->xrays = std::move(xrays);
    if (Result<void> started = parts->start(); !started) return started.error();
    return std::unique_ptr<RunObserver>(new RunObserver(std::move(parts)));
}

RunObserver::RunObserver(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
RunObserver::~RunObserver() = default;

Result<void> RunObserver::after_step(Simulator& simulator, const StepReport& report) {
    const StopWatch watch;
    parts_->observe(simulator, report);
    parts_->spent_ms += watch.elapsed_ms();
    if (!parts_->news) return {};
    return *std::exchange(parts_->news, std::nullopt);
}

void RunObserver::note_output(const std::string& name, const Result<void>& written) { parts_->note(name, written); }

void RunObserver::set_pace(const PaceSpec& pace, const PaceStats& stats) {
    parts_->pace = pace;
    parts_->pace_stats = stats;
}

RunSummary RunObserver::finish(Simulator& simulator, double wall_s, bool interrupted) {
    Parts& parts = *parts_;
    const State& state = simulator.state();
    parts.note(output_name::kSteps, parts.table.finish());
    if (parts.options.checkpoint_every > 0 && parts.failed_step == 0 && parts.saved_step != state.step) parts.save(simulator);
    if (parts.options.pictures) parts.take_pictures(parts.moment(simulator), state.time, true);
    if (parts.xrays) {
        parts.xrays->finish();
        for (; parts.failed_xrays < parts.xrays->failed().size(); ++parts.failed_xrays)
            parts.missing.add(kFluoroscopyFrames, parts.xrays->failed()[parts.failed_xrays]);
        append(parts.xrays->notices(), parts.notices);
    }
    if (const Result<void> finished = parts.recorder.finish(state); !finished) parts.missing.add(kRecordedStates, finished.error());

    RunRecord record{.scene = parts.scene, .prepared = parts.prepared, .statistics = parts.statistics};
    record.observe_s = 1e-3 * parts.spent_ms;
    record.interrupted = interrupted;
    record.resumed_step = parts.options.resumed_from != nullptr ? parts.first_step : 0;
    record.checkpoint_step = parts.saved_step;
    record.failed_step = parts.failed_step;
    record.last_good_state = parts.last_good_state;
    record.summary.finite = parts.failed_step == 0;
    record.summary.failure = parts.failure;
    record.summary.pace = parts.pace;
    record.summary.pace_stats = parts.pace_stats;
    record.gl = parts.photographer.renderer_name();
    record.machine = describe_machine();
    record.xrays = parts.xrays.get();
    for (const TakenPicture& picture : parts.photographer.taken()) record.pictures.push_back(picture.file);
    make_run_summary(record, static_cast<double>(parts.statistics.steps) * parts.scene.time.step, std::max(wall_s - record.observe_s, 0.0),
                     hash_state(state));
    if (parts.scene.budget.limits.mode == BudgetMode::Wall && parts.failed_step == 0 && parts.statistics.steps > 0)
        if (const auto floor = measure_floor(simulator, &state)) record.summary.floor_ms = floor->ms;
    if (record.summary.floor_ms > 1e3 * parts.scene.budget.limits.wall_s)
        parts.notices.push_back(fmt::format("the budget of {:.3g} ms is below the floor of {:.3g} ms, which {} takes under a budget of nothing: such "
                                            "steps leave out all that can be left out",
                                            1e3 * parts.scene.budget.limits.wall_s, record.summary.floor_ms, scope_text(parts.scene.budget)));
    append(parts.scene.questions, parts.notices);
    append(parts.prepared.notices, parts.notices);
    parts.write_pages(record);
    return record.summary;
}

const std::vector<std::string>& RunObserver::notices() const noexcept { return parts_->notices; }

} // namespace trocar::engine
