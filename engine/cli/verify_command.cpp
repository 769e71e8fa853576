// `verify`: do the scenes of a list still give the results that their references hold?
#include "engine/cli/commands.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/taken_files.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/experiments/regression_page.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>
#include <vector>

namespace trocar::engine {

namespace {

constexpr const char* kUsualList = "tests/regression/scenes.txt";
constexpr const char* kDifferencesPage = "out/verify.html";

struct VerifyRequest {
    std::filesystem::path list; // empty: the project's own
    std::filesystem::path page; // empty: kDifferencesPage, where something differs
    bool write = false, quiet = false;
};

/// One line of the list with everything it needs.
struct Case {
    RegressionEntry entry;
    Scene scene;
    Trace reference; // unless references are written
};

/// The project's list from the working folder or one above it, or from the program's folder.
std::filesystem::path find_list() {
    std::error_code failed;
    for (std::filesystem::path start :
         {std::filesystem::current_path(failed), std::filesystem::read_symlink("/proc/self/exe", failed).parent_path()})
        for (;; start = start.parent_path()) {
            if (std::filesystem::is_regular_file(start / kUsualList, failed))
                return (start / kUsualList).lexically_proximate(std::filesystem::current_path(failed));
            if (!start.has_relative_path()) break;
        }
    return kUsualList;
}

Error in_list(const std::filesystem::path& list, const RegressionEntry& entry, const std::string& message) {
    return {ErrorCode::BadValue, message, list.string(), entry.line};
}

/// The reference is there, whole, and made for what the list asks for.
Result<Trace> load_reference(const std::filesystem::path& list, const RegressionEntry& entry) {
    std::error_code failed;
    if (!std::filesystem::exists(entry.reference, failed))
        return in_list(list, entry, fmt::format("no reference {}; `trocar verify --write-references` writes it", entry.reference.string()));
    auto trace = read_trace(entry.reference);
    if (!trace.ok()) return trace.error();
    const std::string budget = BudgetSpec{entry.budget}.to_string();
    if (trace->steps != entry.steps || trace->budget != budget || trace->scene != entry.name)
        return in_list(list, entry,
                       fmt::format("{} was written for {} steps of {} under {}, not for {} steps under {}; "
                                   "`trocar verify --write-references` writes it anew",
                                   entry.reference.string(), trace->steps, trace->scene, trace->budget, entry.steps, budget));
    return trace;
}

Result<std::vector<Case>> load_cases(const std::filesystem::path& list, bool write) {
    const auto entries = read_regression_list(list);
    if (!entries.ok()) return entries.error();
    std::vector<Case> cases;
    for (const RegressionEntry& entry : *entries) {
        auto scene = read_scene(entry.scene);
        if (!scene.ok()) return scene.error();
        Case& loaded = cases.emplace_back(Case{entry, std::move(*scene), {}});
        if (write) continue;
        auto reference = load_reference(list, entry);
        if (!reference.ok()) return reference.error();
        loaded.reference = std::move(*reference);
    }
    return cases;
}

/// The page takes the place of no file that is read.
Result<void> check_page(const std::filesystem::path& page, const std::filesystem::path& list, const std::vector<Case>& cases) {
    std::vector<std::filesystem::path> reads{list};
    for (const Case& one : cases) {
        const std::vector<std::filesystem::path> files = files_of(one.scene);
        reads.insert(reads.end(), files.begin(), files.end());
        reads.push_back(one.entry.reference);
    }
    return check_not_taken(page, reads, "--page");
}

enum class Verdict { Same, Differs, Failed };

Verdict write_reference(const Case& one, const Trace& now) {
    if (!now.failure.empty()) {
        report_error({ErrorCode::NotFinite, fmt::format("stopped in step {}: {}; no reference is written", now.steps + 1, now.failure),
                      one.entry.scene.string()});
        return Verdict::Failed;
    }
    if (const auto written = write_trace(one.entry.reference, now); !written.ok()) {
        report_error(written.error());
        return Verdict::Failed;
    }
    fmt::print("wrote    {:<24} {} steps, state {:016x}   {}\n", one.entry.name, now.steps, now.state_hash, one.entry.reference.string());
    return Verdict::Same;
}

void print_drift(const Case& one, const Trace& now) {
    for (const PartDrift& drift : measure_drift(one.reference, now, one.entry.tolerance))
        if (drift.first_step > 0)
            fmt::print("         {:<24} {}: beyond the tolerance from step {} on, at most {:.3g} m, node {} in step {}\n", "", drift.part,
                       drift.first_step, drift.worst_m, drift.worst_node, drift.worst_step);
}

Verdict judge(const Case& one, const Trace& now, std::string& problem) {
    problem = first_difference(one.reference, now, one.entry.tolerance);
    if (!problem.empty()) {
        fmt::print("differs  {:<24} {}\n", one.entry.name, problem);
        print_drift(one, now);
        if (one.reference.model_hash != now.model_hash)
            fmt::print("         {:<24} the scene or its preparation is not that of the reference\n", "");
        return Verdict::Differs;
    }
    const bool same_bits = one.reference.state_hash == now.state_hash;
    fmt::print("same     {:<24} {} steps, {}\n", one.entry.name, now.steps,
               same_bits ? std::string("the same bits") : fmt::format("within {:g} m", one.entry.tolerance));
    return Verdict::Same;
}

Verdict verify_one(const Case& one, bool write, ProgressLine& progress, std::vector<RegressionOutcome>& outcomes) {
    const auto prepared = make_prepared_scene(one.scene, [&](const std::string& what) { progress.show(one.entry.name + ": preparing " + what); });
    if (!prepared.ok()) {
        progress.clear();
        report_error(prepared.error());
        return Verdict::Failed;
    }
    const Trace now = run_trace(prepared->model, one.entry, [&](std::uint64_t step) {
        progress.show_now_and_then(fmt::format("{}: step {}/{}", one.entry.name, step, one.entry.steps));
    });
    progress.clear();
    if (write) return write_reference(one, now);
    RegressionOutcome& outcome = outcomes.emplace_back(RegressionOutcome{one.entry, one.reference, now, {}});
    return judge(one, now, outcome.difference);
}

int verify(const VerifyRequest& request) {
    const std::filesystem::path list = request.list.empty() ? find_list() : request.list;
    if (!request.page.empty())
        if (const auto fits = check_place(request.page, "--page"); !fits.ok()) return report_error(fits.error());
    const auto cases = load_cases(list, request.write);
    if (!cases.ok()) return report_error(cases.error());
    if (!request.page.empty())
        if (const auto fine = check_page(request.page, list, *cases); !fine.ok()) return report_error(fine.error());
    ProgressLine progress(!request.quiet);
    std::size_t different = 0;
    bool page_failed = false;
    std::vector<RegressionOutcome> outcomes;
    for (const Case& one : *cases) {
        const Verdict verdict = verify_one(one, request.write, progress, outcomes);
        if (verdict == Verdict::Failed) return kExitBadInput;
        different += verdict == Verdict::Differs;
    }
    if (different > 0 || !request.page.empty()) {
        const std::filesystem::path page = request.page.empty() ? std::filesystem::path(kDifferencesPage) : request.page;
        std::error_code not_made; // then the page cannot be written either, which is said
        if (request.page.empty()) std::filesystem::create_directories(page.parent_path(), not_made);
        if (const auto written = write_file_atomically(page, regression_page(outcomes)); !written) {
            report_error(written.error());
            page_failed = true; // the differences were reported, and take precedence
        } else
            fmt::print("page     {}\n", page.string());
    }
    if (different == 0) return page_failed ? kExitBadInput : kExitFine;
    report_error({ErrorCode::BadValue,
                  fmt::format("{} of {} scenes differ from their references; where that is meant, --write-references writes them anew", different,
                              cases->size())});
    return kExitDiffers;
}

} // namespace

Command add_verify_command(CLI::App& app) {
    const auto request = std::make_shared<VerifyRequest>();
    CLI::App* command = app.add_subcommand("verify", "Run a list of scenes in work mode and compare with stored references");
    command->add_option("scenes", request->list,
                        fmt::format("list file: scene, steps, tolerance [m] in each line; {} when absent", kUsualList));
    command->add_flag("--write-references", request->write, "write the references instead of comparing with them");
    command
        ->add_option("--page", request->page,
                     fmt::format("write a page with what came out, and curves of what differs; {} when absent and something differs",
                                 kDifferencesPage))
        ->excludes("--write-references");
    command->add_flag("--quiet", request->quiet, "no progress line");
    return {command, [request] { return verify(*request); }};
}

} // namespace trocar::engine
