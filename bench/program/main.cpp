// trocar-bench: the program with the benches linked in. `trocar bench` becomes it; all other commands it has too, since a bench may start
// runs of its own program.
#include "bench/bench.hpp"
#include "bench/benchmark_page.hpp"
#include "bench/headlines.hpp"
#include "engine/cli/bench_request.hpp"
#include "engine/cli/commands.hpp"
#include "engine/cli/progress.hpp"
#include "engine/cli/taken_files.hpp"
#include "engine/io/atomic_file.hpp"
#include "engine/report/build_facts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

extern const char* const kTrocarCommit; // cmake/commit.cmake writes it

namespace trocar::engine {

namespace {

BenchOptions options_of(const BenchRequest& request) {
    BenchOptions options{.quick = request.quick, .large = request.large, .threads = request.threads, .json = request.json, .page = request.page,
                         .docs = request.docs, .scene = request.scene};
    if (const char* data = std::getenv("TROCAR_TEST_DATA"); data != nullptr && std::filesystem::is_directory(data)) options.data = data;
    return options;
}

int list_benches() {
    for (const Bench& bench : benches()) fmt::print("{:<16} {}\n", bench.name, bench.what);
    fmt::print("{:<16} {}\n", "python", "the Python package: environment steps, batches, threads, forks, memory (python -m trocar.bench)");
    fmt::print("{:<16} {}\n", "all", "every one of them but python, with a short table first: Markdown on the terminal, everything by --page");
    return kExitFine;
}

Result<void> write_if_named(const std::filesystem::path& file, const std::function<std::string()>& text) {
    return file.empty() ? Result<void>() : write_file_atomically(file, text());
}

/// Rows that have a bound (`holds`) and are beyond it: listed by name, beside the exit code for scripts.
std::size_t count_broken(std::string_view bench, const BenchTable& table) {
    std::size_t broken = 0;
    for (const BenchRow& row : table.rows) {
        if (!row.contains("holds") || row["holds"] != false) continue;
        ++broken;
        fmt::print(stderr, "error: bench {}: beyond its bound: {}\n", bench, row.dump());
    }
    return broken;
}

/// Kept for docs/benchmarks.md as soon as it is measured: what ends a later one takes nothing away.
Result<void> show_in_docs(const std::filesystem::path& docs, std::string_view name, const BenchTable& table) {
    if (docs.empty()) return {};
    if (auto kept = keep_measured(docs, name, table); !kept) return kept;
    return write_benchmark_page(docs);
}

/// The whole of a bench of this program's own scenes is what the page shows: known before anything is measured.
Result<void> check_docs(const BenchRequest& request) {
    const BenchRequest& o = request;
    if (o.docs.empty()) return {};
    const auto refuse = [](const char* found, const char* expected) {
        return Error{ErrorCode::BadUsage, fmt::format("found {} beside it, expected {}", found, expected), {}, 0, 0, "--docs"};
    };
    if (o.quick || !o.scene.empty()) return refuse(o.quick ? "--quick" : "--scene", "the whole table: the page shows what was measured");
    if (o.name.empty() && (!o.json.empty() || !o.page.empty() || !o.given.empty() || o.threads != 0 || o.large))
        return refuse("another option and no bench", "a bench's name, or --docs alone");
    const auto page = make_benchmark_page(o.docs);
    return page ? Result<void>() : Result<void>(page.error());
}

/// Every table, one after another. One that cannot be measured is named, and the others are.
int run_all(const BenchRequest& request, const BenchOptions& files, ProgressLine& progress) {
    std::vector<MeasuredBench> measured;
    nlohmann::ordered_json json = nlohmann::ordered_json::array();
    int failed = 0;
    std::vector<ReadBench> given;
    for (const std::string& file : request.given) {
        auto read = read_bench(file);
        if (!read) return report_error(read.error());
        given.push_back(std::move(*read));
    }
    for (const Bench& bench : benches()) {
        const auto known = std::find_if(given.begin(), given.end(), [&](const ReadBench& g) { return g.name == bench.name; });
        if (known != given.end()) {
            json.push_back(bench_json(bench.name, known->table));
            measured.push_back({&bench, std::move(known->table)});
            continue;
        }
        BenchOptions options = files;
        options.progress = [&](const std::string& what) { progress.show(fmt::format("{}: {}", bench.name, what)); };
        auto table = bench.run(options);
        progress.clear();
        if (!table) {
            failed = report_error(table.error());
            continue;
        }
        table->quick = options.quick;
        table->command = bench_command(bench.name, options);
        if (const auto shown = show_in_docs(options.docs, bench.name, *table); !shown) failed = report_error(shown.error());
        json.push_back(bench_json(bench.name, *table));
        measured.push_back({&bench, std::move(*table)});
    }
    fmt::print("{}", headlines_markdown(measured));
    for (const auto& written : {write_if_named(files.page, [&] { return all_benches_page(measured); }),
                                write_if_named(files.json, [&] { return json.dump(2) + "\n"; })})
        if (!written) failed = report_error(written.error());
    std::size_t broken = 0;
    for (const MeasuredBench& one : measured) broken += count_broken(one.bench->name, one.table);
    return failed == 0 && broken > 0 ? kExitDiffers : failed;
}

/// Neither the scene nor one another is written over.
Result<void> check_files(const BenchRequest& request) {
    std::vector<std::filesystem::path> taken;
    for (const auto& [file, option] : {std::pair(std::filesystem::path(request.scene), ""), std::pair(std::filesystem::path(request.page), "--page"),
                                       std::pair(std::filesystem::path(request.json), "--json")}) {
        if (file.empty()) continue;
        if (auto fine = check_not_taken(file, taken, option); !fine) return fine;
        taken.push_back(file);
    }
    return {};
}

int run_bench(const BenchRequest& request) {
    if (const auto fits = check_docs(request); !fits) return report_error(fits.error());
    if (request.name.empty() && !request.docs.empty()) {
        const auto written = write_benchmark_page(request.docs);
        return written ? kExitFine : report_error(written.error());
    }
    if (request.name.empty()) return list_benches();
    const auto all = benches();
    const auto bench = std::find_if(all.begin(), all.end(), [&](const Bench& b) { return b.name == request.name; });
    if (bench == all.end() && request.name != "all") {
        std::string known = "all, python";
        for (const Bench& b : all) known += ", " + std::string(b.name);
        return report_error({ErrorCode::BadUsage, fmt::format("no bench '{}'; known: {}", request.name, known), {}, 0, 0, "bench"});
    }
    for (const auto& [file, option] : {std::pair(request.page, "--page"), std::pair(request.json, "--json")})
        if (!file.empty())
            if (const auto fits = check_place(file, option); !fits) return report_error(fits.error());
    if (const auto fits = check_files(request); !fits) return report_error(fits.error());
    BenchOptions options = options_of(request);
    ProgressLine progress(true, ProgressLine::Elsewhere::ALineAMinute);
    if (request.name == "all") return run_all(request, options, progress);
    options.progress = [&](const std::string& what) { progress.show(what); };
    auto table = bench->run(options);
    progress.clear();
    if (!table.ok()) return report_error(table.error());
    table->quick = options.quick;
    table->command = bench_command(bench->name, options);
    fmt::print("{}", bench_text(*table));
    WrittenOutputs outputs;
    outputs.note(write_if_named(options.page, [&] { return bench_page(*bench, *table); }));
    outputs.note(show_in_docs(options.docs, bench->name, *table));
    outputs.note(write_if_named(options.json, [&] { return bench_json(bench->name, *table).dump(2) + "\n"; }));
    const std::size_t broken = count_broken(bench->name, *table);
    return outputs.all_there() && broken > 0 ? kExitDiffers : outputs.tell({});
}

} // namespace

} // namespace trocar::engine

int main(int argc, char** argv) {
    trocar::engine::name_commit(kTrocarCommit);
    return trocar::engine::run_program(argc, argv, trocar::engine::run_bench);
}
