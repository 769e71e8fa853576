#include "engine/cli/bench_request.hpp"
#include "engine/cli/commands.hpp"
#include "engine/cli/python_bench.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <unistd.h>

namespace trocar::engine {

namespace {

/// It prints its own table, and is no part of either program.
int run_python(const BenchRequest& request) {
    if (!request.json.empty() || !request.page.empty() || !request.docs.empty() || !request.scene.empty() || !request.given.empty() ||
        request.threads != 0 || request.large)
        return report_error({ErrorCode::BadUsage, "found another option beside `bench python`, expected none but --quick", {}, 0, 0, "bench"});
    return report_error(become_python_bench(request.quick ? std::vector<std::string>{"--quick"} : std::vector<std::string>{}));
}

/// The words of this process, as they were given.
std::vector<std::string> read_command_line() {
    std::ifstream file("/proc/self/cmdline", std::ios::binary); // it has no size before it is read
    std::vector<std::string> words;
    for (std::string word; std::getline(file, word, '\0');) words.push_back(word);
    return words;
}

} // namespace

int become_bench_program(const BenchRequest&) {
    std::error_code failed;
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failed).parent_path() / "trocar-bench";
    if (failed || access(program.c_str(), X_OK) != 0)
        return report_error({ErrorCode::MissingTool,
                             fmt::format("the benches are a program of their own, and {} is not there; expected it beside trocar: `./start build` makes it",
                                         program.string()),
                             {}, 0, 0, "bench"});
    std::vector<std::string> words = read_command_line();
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    execv(program.c_str(), pointers.data());
    return report_error({ErrorCode::ToolFailed, fmt::format("{} could not be started: {}", program.string(), std::strerror(errno)), {}, 0, 0, "bench"});
}

Command add_bench_command(CLI::App& app, AnswerBench answer) {
    const auto request = std::make_shared<BenchRequest>();
    CLI::App* command = app.add_subcommand("bench", "Measure the papers' and the peers' tables here; no name: list them");
    command->add_option("name", request->name, "which table, or all");
    command->add_option("--json", request->json, "write the rows to this file");
    command->add_option("--page", request->page, "write a page with the table and its plots to this file");
    command
        ->add_option("--docs", request->docs,
                     "folder of benchmarks.md: what is measured, not what is --given, is kept there, and the page's tables are written anew; without a name "
                     "only that")
        ->check(CLI::ExistingDirectory);
    command->add_option("--given", request->given,
                        "all: files that `bench NAME --json` wrote, taken as they are instead of measuring those");
    command->add_option("--scene", request->scene, "scene for tables that run one");
    command->add_option("--threads", request->threads, "threads; 0: one, then all")->check(CLI::Range(0u, 256u));
    command->add_flag("--quick", request->quick, "a small part of the table");
    command->add_flag("--large,--long", request->large,
                      "seed004: models of 320K to 502K triangles as well; hard-cases: ten minutes of simulated time as well");
    return {command, [request, answer = std::move(answer)] { return request->name == "python" ? run_python(*request) : answer(*request); }};
}

} // namespace trocar::engine
