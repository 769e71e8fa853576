// `cost`: what accuracy costs in time, and what a budget costs in accuracy.
#include "engine/cli/commands.hpp"
#include "engine/cli/job_pool.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/set_option.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/io/printable.hpp"
#include "engine/experiments/cost_page.hpp"
#include "engine/experiments/cost_parts.hpp"
#include "engine/experiments/cost_variants.hpp"
#include "engine/report/floor.hpp"
#include "engine/report/output_folder.hpp"
#include "engine/time/interrupt.hpp"
#include "engine/scene/scene.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <memory>
#include <optional>
#include <thread>

#include <unistd.h>

namespace trocar::engine {

namespace {

/// Without -n: a run of the whole scene under five budgets would take some eleven times its length.
constexpr std::uint64_t kUsualSteps = 300;

struct CostRequest {
    std::filesystem::path scene;
    std::filesystem::path out; // empty: out/<scene name>-cost
    std::string budgets = "0.1ms,1ms,10ms,100ms,exact";
    std::string variants;    // names, separated by commas; empty: none
    std::int64_t steps = -1; // < 0: as the scene says, at most kUsualSteps
    std::optional<double> from; // s; nothing: as the scene says
    unsigned jobs = 1;       // processes that run at once
    std::int64_t only = -1;  // >= 0: this row's run by itself is measured for another process
    std::int64_t parent = 0; // that process; 0: not said
    SceneSettings settings;
    bool force = false, resume = false, page = true, quiet = false;
};

/// Pictures of one instant, at most.
constexpr std::size_t kMostPictures = 4;
constexpr unsigned kPictureWidth = 880, kPictureHeight = 600; // pixels

Error budget_error(std::string message) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, "--budgets"}; }

/// Names between commas, without blanks around them.
std::vector<std::string_view> split_names(std::string_view text) {
    std::vector<std::string_view> names;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        std::string_view name = text.substr(begin, end - begin);
        while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
        while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
        names.push_back(name);
        begin = end + 1;
    }
    return names;
}

Result<std::vector<NamedBudget>> read_budgets(std::string_view text) {
    std::vector<NamedBudget> budgets;
    for (const std::string_view name : split_names(text)) {
        if (name.empty()) return budget_error("an empty budget in the list; expected 0.1ms,1ms,work:20000,exact");
        const auto budget = parse_budget(name);
        if (!budget.ok()) return budget_error(budget.error().message);
        for (const NamedBudget& known : budgets)
            if (known.name == name) return budget_error(fmt::format("\"{}\" is listed twice; expected once", name));
        budgets.push_back({std::string(name), budget->limits});
    }
    return budgets;
}

/// A scene and what it becomes: the model's owner.
struct PreparedVariant {
    std::string name;
    std::unique_ptr<PreparedScene> prepared;
};

Result<std::vector<std::pair<std::string, Scene>>> read_variants(std::string_view text, const Scene& scene) {
    std::vector<std::pair<std::string, Scene>> variants;
    if (text.empty()) return variants;
    for (const std::string_view name : split_names(text)) {
        auto variant = make_variant(scene, name);
        if (!variant) return variant.error();
        for (const auto& [known, other] : variants)
            if (known == name)
                return Error{ErrorCode::BadUsage, fmt::format("\"{}\" is listed twice; expected once", name), {}, 0, 0, "--variants"};
        variants.emplace_back(name, std::move(*variant));
    }
    return variants;
}

/// The figures first: they took the time.
WrittenOutputs write_pages(const std::filesystem::path& out, const Scene& scene, CostTable& table, std::span<const CostPicture> pictures,
                           bool page) {
    WrittenOutputs outputs;
    outputs.note(write_file_atomically(out / output_name::kCost, cost_csv(table)));
    outputs.note(write_file_atomically(out / output_name::kCostJson, cost_json(scene, table)));
    for (std::size_t k = 0; k < pictures.size(); ++k)
        outputs.note(write_file_atomically(out / fmt::format("anatomy_{:02}_t{:05.2f}s.png", k + 1, pictures[k].time_s), pictures[k].png));
    if (page) outputs.note(write_file_atomically(out / output_name::kReport, cost_page(scene, table, pictures)));
    return outputs;
}

/// One measurement: the scene, what it is compared with, and where its parts lie.
class Measurement {
public:
    Measurement(const CostRequest& request, const Scene& scene, ProgressLine& progress)
        : request_(request), scene_(scene), progress_(progress),
          out_(request.out.empty() ? std::filesystem::path("out") / (safe_file_name(scene.name) + "-cost") : request.out) {}

    Result<void> prepare(const std::vector<NamedBudget>& budgets, const std::vector<std::pair<std::string, Scene>>& variants) {
        auto prepared = make_prepared_scene(scene_, [&](const std::string& what) { progress_.show("preparing " + what); });
        if (!prepared) return prepared.error();
        prepared_ = std::move(*prepared);
        for (const auto& [name, scene] : variants) {
            auto variant = make_prepared_scene(scene, [&](const std::string& what) { progress_.show("preparing " + name + ": " + what); });
            if (!variant) return variant.error();
            variants_.push_back({name, std::make_unique<PreparedScene>(std::move(*variant))});
            options_.variants.push_back({name, &variants_.back().prepared->model});
        }
        options_.budgets = budgets;
        const std::optional<std::uint64_t> steps = request_.steps >= 0 ? std::optional(static_cast<std::uint64_t>(request_.steps)) : std::nullopt;
        const auto stretch = choose_stretch(prepared_.model, request_.from.value_or(scene_.cost.from), steps, kUsualSteps);
        if (!stretch) return stretch.error();
        options_.from = stretch->from, options_.steps = stretch->steps;
        options_.progress = [this](const std::string& what) {
            progress_.show_now_and_then(what);
            if (pool_) pool_->tick();
        };
        options_.interrupted = interrupt_requested;
        parts_.emplace(out_ / output_name::kParts, CostParts::key_of(prepared_.model, options_));
        options_.parts = &*parts_;
        return {};
    }

    /// For another process.
    int measure_one_row() {
        const auto measured = measure_own_run(prepared_, options_, static_cast<std::size_t>(request_.only));
        if (!measured) return report_error(measured.error());
        return interrupt_requested() ? kExitInterrupted : kExitFine;
    }

    int measure() {
        const std::size_t rows = list_rows(options_).size();
        if (!request_.resume)
            parts_->remove(rows);
        else if (parts_->count(rows) == 0)
            report_notice(fmt::format("nothing in {} belongs to this measurement; it starts from the beginning", out_.string()));
        if (const auto made = parts_->make_folder(); !made) return report_error(made.error());
        CostPhotographer photographer(prepared_, kPictureWidth, kPictureHeight);
        if (request_.page) take_pictures(photographer, rows);
        if (request_.jobs > 1)
            if (const auto shared = share_rows(rows); !shared) return report_error(shared.error());
        auto table = measure_cost(prepared_, scene_.cost, options_);
        pool_.reset();
        progress_.clear();
        if (!table) return report_error(table.error());
        if (table->interrupted) { // rows that are not finished are none: no table
            print_to_stderr(fmt::format("interrupted: {} of {} runs are finished; the same command with --resume goes on with them",
                                        parts_->count(rows), rows + 1));
            return kExitInterrupted;
        }
        if (!photographer.notice().empty()) table->notices.push_back(photographer.notice());
        if (request_.jobs > 1)
            table->notices.push_back(fmt::format("up to {} processes ran at once: times are those of a busy machine", request_.jobs + 1));
        if (busiest_)
            if (const auto floor = measure_floor(Simulator(prepared_.model), &*busiest_)) table->floor_ms = floor->ms;
        return finish(*table, photographer.pictures(), rows);
    }

    [[nodiscard]] const std::filesystem::path& out() const noexcept { return out_; }

private:
    /// The first and the last budget and some between them.
    void take_pictures(CostPhotographer& photographer, std::size_t rows) {
        const std::size_t budgets = options_.budgets.size(), count = std::min(kMostPictures, rows);
        std::vector<std::string> wanted;
        const std::vector<CostRow> all = list_rows(options_);
        for (std::size_t k = 0; k < count; ++k) {
            const std::size_t among = budgets >= count ? budgets : rows;
            wanted.push_back(all[count == 1 ? 0 : k * (among - 1) / (count - 1)].name());
        }
        options_.show = [this, &photographer, wanted](const CostRow& row, Simulator& answer) {
            if (!busiest_) busiest_ = answer.state();
            if (std::find(wanted.begin(), wanted.end(), row.name()) != wanted.end()) photographer.take(row.name(), answer);
        };
    }

    /// The exact run first, which all need; then every row in a process of its own, while this one evaluates along the exact states.
    Result<void> share_rows(std::size_t rows) {
        if (auto measured = measure_exact_run(prepared_, options_); !measured) return measured;
        std::vector<std::vector<std::string>> jobs;
        for (std::size_t row = 0; row < rows; ++row) {
            jobs.push_back({"cost", request_.scene.string(), "--budgets", request_.budgets, "--steps", std::to_string(options_.steps),
                            "--from", fmt::format("{}", static_cast<double>(options_.from) * prepared_.model.step_s), "--out", out_.string(), "--quiet", "--only", std::to_string(row), "--parent", std::to_string(getpid())});
            const std::vector<std::string> settings = request_.settings.words();
            jobs.back().insert(jobs.back().end(), settings.begin(), settings.end());
            if (!request_.variants.empty()) jobs.back().insert(jobs.back().end(), {"--variants", request_.variants});
        }
        pool_.emplace(std::move(jobs), request_.jobs);
        options_.elsewhere = [this](std::size_t row) -> Result<CostOwnRun> {
            while (!pool_->is_done(row) && !interrupt_requested()) {
                pool_->tick();
                progress_.show_now_and_then(fmt::format("waiting for {} by itself", list_rows(options_)[row].name()));
                std::this_thread::sleep_for(std::chrono::milliseconds(20));
            }
            if (auto own = parts_->own_run(row)) return *own;
            if (interrupt_requested()) return CostOwnRun{};
            if (auto ended = pool_->outcome(row); !ended) return ended.error();
            return Error{ErrorCode::CannotWrite, "the row's part is not there", (out_ / output_name::kParts).string()};
        };
        pool_->tick();
        return {};
    }

    int finish(CostTable& table, std::span<const CostPicture> pictures, std::size_t rows) {
        const WrittenOutputs outputs = write_pages(out_, scene_, table, pictures, request_.page);
        for (const std::string& notice : table.notices) report_notice(notice);
        fmt::print("{}{} steps each{}, against the exact run   {} {}\n", cost_text(table), table.steps, start_text(table, prepared_.model.step_s), request_.page ? "report" : "table",
                   (out_ / (request_.page ? output_name::kReport : output_name::kCost)).string());
        if (outputs.all_there()) parts_->remove(rows); // else --resume writes what is missing without measuring it again
        return table.steps < options_.steps ? kExitNotFinite : outputs.tell(out_);
    }

    const CostRequest& request_;
    const Scene& scene_;
    ProgressLine& progress_;
    std::filesystem::path out_;
    PreparedScene prepared_;
    std::vector<PreparedVariant> variants_;
    CostOptions options_;
    std::optional<State> busiest_; // of the step that the pictures show
    std::optional<CostParts> parts_;
    std::optional<JobPool> pool_;
};

int measure(const CostRequest& request, const std::vector<NamedBudget>& budgets, const Scene& scene, ProgressLine& progress) {
    const auto variants = read_variants(request.variants, scene);
    if (!variants) return report_error(variants.error());
    Measurement measurement(request, scene, progress);
    if (request.only >= 0) answer_interrupts_silently();
    const InterruptHold hold(InterruptHold::Then::OwnerEnds); // finished runs are kept
    const auto prepare = [&] {
        const auto prepared = measurement.prepare(budgets, *variants);
        if (!prepared) progress.clear();
        return prepared;
    };
    if (request.only >= 0) { // the folder is held by the process that shares its work
        if (const auto prepared = prepare(); !prepared) return interrupt_requested() ? kExitInterrupted : report_error(prepared.error());
        return measurement.measure_one_row();
    }
    std::error_code none;
    const bool goes_on = request.resume && std::filesystem::is_directory(measurement.out() / output_name::kParts, none);
    const bool replaces = request.force || goes_on;
    if (const auto free = OutputFolder::check(measurement.out(), replaces, files_of(scene)); !free.ok()) return report_error(free.error());
    if (const auto prepared = prepare(); !prepared) return interrupt_requested() ? kExitInterrupted : report_error(prepared.error());
    const auto folder = OutputFolder::open(measurement.out(), replaces); // what an earlier one left goes only now
    if (!folder.ok()) return report_error(folder.error());
    return measurement.measure();
}

int cost(const CostRequest& request) {
    if (request.parent > 0) end_with_parent(static_cast<pid_t>(request.parent));
    const auto budgets = read_budgets(request.budgets);
    if (!budgets.ok()) return report_error(budgets.error());
    const Result<Scene> scene = read_set_scene(request.scene, request.settings);
    if (!scene.ok()) return report_error(scene.error());
    if (request.only >= 0 && static_cast<std::size_t>(request.only) >= budgets->size() * (1 + split_names(request.variants).size()))
        return report_error({ErrorCode::BadUsage, "there is no such row", {}, 0, 0, "--only"});
    ProgressLine progress(!request.quiet);
    return measure(request, *budgets, *scene, progress);
}

CLI::Validator budget_texts() {
    const auto check = [](std::string& text) -> std::string {
        const auto budgets = read_budgets(text);
        return budgets || text.empty() ? "" : budgets.error().message; // that a value is empty is said elsewhere
    };
    return {check, ""};
}

} // namespace

Command add_cost_command(CLI::App& app) {
    const auto request = std::make_shared<CostRequest>();
    CLI::App* command = app.add_subcommand("cost", "The price of accuracy: a scene under each budget against its exact run");
    command->add_option("scene", request->scene, "scene file (JSON)")->required();
    command->add_option("--budgets", request->budgets, "per step, separated by commas: times (1ms, 250us), work:TESTS, exact")
        ->check(budget_texts())
        ->capture_default_str();
    command
        ->add_option("-n,--steps", request->steps,
                     fmt::format("steps of every run; as the scene says, at most {}, when absent", kUsualSteps))
        ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}));
    command->add_option("--from", request->from,
                        "simulated seconds that the exact run goes alone, once for all, before runs are compared; the scene's cost.from when absent");
    command->add_option("--out", request->out, "output folder; out/<scene name>-cost where none is given");
    std::string words;
    for (const VariantWord& word : list_variants()) words += fmt::format("{}{} ({})", words.empty() ? "" : ", ", word.name, word.does);
    command->add_option("--variants", request->variants, "other ways to answer contacts, measured under every budget as well: " + words);
    command->add_option("--jobs", request->jobs, "runs that are measured at once, in processes of their own")->check(CLI::Range(1u, 256u));
    command->add_option("--only", request->only)->group(""); // the options of those processes
    command->add_option("--parent", request->parent)->group("");
    command->add_flag("--resume", request->resume, "go on with what an interrupted measurement into this folder has finished");
    command->add_flag("--force", request->force, "write into an output folder that is not empty");
    command->add_flag("!--no-report", request->page, "take no pictures and write no report.html");
    add_set_options(*command, request->settings);
    command->add_flag("--quiet", request->quiet, "no progress line");
    return {command, [request] { return cost(*request); }};
}

} // namespace trocar::engine
