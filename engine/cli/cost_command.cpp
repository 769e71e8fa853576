// `cost`: what accuracy costs in time, and what a budget costs in accuracy.
#include "engine/cli/commands.hpp"
#include "engine/cli/interrupt.hpp"
#include "engine/cli/progress.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/observe/cost_page.hpp"
#include "engine/observe/output_folder.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <memory>

namespace seldinger::engine {

namespace {

/// Without -n: a run of the whole scene under five budgets would take some eleven times its length.
constexpr std::uint64_t kUsualSteps = 300;

struct CostRequest {
    std::filesystem::path scene;
    std::filesystem::path out; // empty: out/<scene name>-cost
    std::string budgets = "0.1ms,1ms,10ms,100ms,exact";
    std::int64_t steps = -1; // < 0: as the scene says, at most kUsualSteps
    bool force = false, quiet = false;
};

Error budget_error(std::string message) { return {ErrorCode::BadUsage, std::move(message), {}, 0, 0, "--budgets"}; }

Result<std::vector<NamedBudget>> read_budgets(std::string_view text) {
    std::vector<NamedBudget> budgets;
    for (std::size_t begin = 0; begin <= text.size();) {
        const std::size_t end = std::min(text.find(',', begin), text.size());
        std::string_view name = text.substr(begin, end - begin);
        while (!name.empty() && name.front() == ' ') name.remove_prefix(1);
        while (!name.empty() && name.back() == ' ') name.remove_suffix(1);
        begin = end + 1;
        if (name.empty()) return budget_error("an empty budget in the list; 0.1ms,1ms,work:20000,exact would be right");
        const auto budget = parse_budget(name);
        if (!budget.ok()) return budget_error(budget.error().message);
        for (const NamedBudget& known : budgets)
            if (known.name == name) return budget_error(fmt::format("\"{}\" is listed twice; once would be right", name));
        budgets.push_back({std::string(name), budget->limits});
    }
    return budgets;
}

Result<void> write_pages(const std::filesystem::path& out, const Scene& scene, CostTable& table) {
    const std::string page = cost_page(scene, table);
    if (auto written = write_file_atomically(out / output_name::kReport, page); !written) return written;
    if (auto written = write_file_atomically(out / output_name::kCostJson, cost_json(scene, table)); !written) return written;
    return write_file_atomically(out / output_name::kCost, cost_csv(table));
}

int measure(const CostRequest& request, const std::vector<NamedBudget>& budgets, const Scene& scene, ProgressLine& progress) {
    const std::filesystem::path out = request.out.empty() ? std::filesystem::path("out") / (scene.name + "-cost") : request.out;
    const auto folder = OutputFolder::open(out, request.force);
    if (!folder.ok()) return report_error(folder.error());
    const auto prepared = prepare_scene(scene, [&](const std::string& what) { progress.show("preparing " + what); });
    if (!prepared.ok()) {
        progress.clear();
        return report_error(prepared.error());
    }
    CostOptions options;
    options.budgets = budgets;
    options.steps = request.steps >= 0 ? static_cast<std::uint64_t>(request.steps) : std::min(prepared->model.step_count, kUsualSteps);
    options.progress = [&](const std::string& what) { progress.show_now_and_then(what); };
    options.interrupted = interrupt_requested;
    catch_interrupts();
    CostTable table = measure_cost(*prepared, scene.cost, options);
    progress.clear();
    if (const auto written = write_pages(out, scene, table); !written.ok()) return report_error(written.error());
    for (const std::string& notice : table.notices) fmt::print(stderr, "notice: {}\n", notice);
    fmt::print("{}{} steps each, against the exact run   report {}\n", cost_text(table), table.steps,
               (out / output_name::kReport).string());
    if (table.interrupted) return kExitInterrupted;
    return table.steps < options.steps ? kExitNotFinite : kExitFine;
}

int cost(const CostRequest& request) {
    const auto budgets = read_budgets(request.budgets);
    if (!budgets.ok()) return report_error(budgets.error());
    const Result<Scene> scene = read_scene(request.scene);
    if (!scene.ok()) return report_error(scene.error());
    ProgressLine progress(!request.quiet);
    return measure(request, *budgets, *scene, progress);
}

} // namespace

Command add_cost_command(CLI::App& app) {
    const auto request = std::make_shared<CostRequest>();
    CLI::App* command = app.add_subcommand("cost", "The price of accuracy: a scene under each budget against its exact run");
    command->add_option("scene", request->scene, "scene file (JSON)")->required();
    command->add_option("--budgets", request->budgets, "per step, separated by commas: times (1ms, 250us), work:TESTS, exact")
        ->capture_default_str();
    command
        ->add_option("-n,--steps", request->steps,
                     fmt::format("steps of every run; as the scene says, at most {}, when absent", kUsualSteps))
        ->check(CLI::Range(std::int64_t{0}, std::int64_t{1'000'000'000}));
    command->add_option("--out", request->out, "output folder; out/<scene name>-cost where none is given");
    command->add_flag("--force", request->force, "write into an output folder that is not empty");
    command->add_flag("--quiet", request->quiet, "no progress line");
    return {command, [request] { return cost(*request); }};
}

} // namespace seldinger::engine
