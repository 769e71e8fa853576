#include "engine/bench/bench.hpp"
#include "engine/cli/commands.hpp"
#include "engine/cli/progress.hpp"
#include "engine/io/atomic_file.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <cstdlib>
#include <memory>

namespace seldinger::engine {

namespace {

struct Request {
    std::string name;
    BenchOptions options;
};

int list_benches() {
    for (const Bench& bench : benches()) fmt::print("{:<16} {}\n", bench.name, bench.what);
    return kExitFine;
}

int run_bench(Request& request) {
    if (request.name.empty()) return list_benches();
    const auto all = benches();
    const auto bench = std::find_if(all.begin(), all.end(), [&](const Bench& b) { return b.name == request.name; });
    if (bench == all.end()) {
        std::string known;
        for (const Bench& b : all) known += (known.empty() ? "" : ", ") + std::string(b.name);
        return report_error({ErrorCode::BadUsage, fmt::format("no bench '{}'; known: {}", request.name, known), {}, 0, 0, "bench"});
    }
    if (const char* data = std::getenv("SELDINGER_TEST_DATA"); data != nullptr && std::filesystem::is_directory(data))
        request.options.data = data;
    ProgressLine progress(true);
    request.options.progress = [&](const std::string& what) { progress.show(what); };
    const auto table = bench->run(request.options);
    progress.clear();
    if (!table.ok()) return report_error(table.error());
    fmt::print("{}", bench_text(*table));
    if (!request.options.page.empty())
        if (const auto written = write_file_atomically(request.options.page, bench_page(*bench, *table)); !written.ok())
            return report_error(written.error());
    if (request.options.json.empty()) return kExitFine;
    const auto written = write_file_atomically(request.options.json, bench_json(bench->name, *table).dump(2) + "\n");
    return written.ok() ? static_cast<int>(kExitFine) : report_error(written.error());
}

} // namespace

Command add_bench_command(CLI::App& app) {
    const auto request = std::make_shared<Request>();
    CLI::App* command = app.add_subcommand("bench", "Measure the papers' and the peers' tables here; no name: list them");
    command->add_option("name", request->name, "which table");
    command->add_option("--json", request->options.json, "write the rows to this file");
    command->add_option("--page", request->options.page, "write a page with the table and its plots to this file");
    command->add_option("--scene", request->options.scene, "scene for tables that run one");
    command->add_option("--threads", request->options.threads, "threads; 0: one, then all")->check(CLI::Range(0u, 256u));
    command->add_flag("--quick", request->options.quick, "a small part of the table");
    command->add_flag("--large,--long", request->options.large,
                      "seed004: models of 320K to 502K triangles as well; hard-cases: ten minutes of simulated time as well");
    return {command, [request] { return run_bench(*request); }};
}

} // namespace seldinger::engine
