// What `trocar bench` was asked for, and who answers. The benches are linked into trocar-bench alone, the same program with them:
// trocar hands its command line on.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace trocar::engine {

struct BenchRequest {
    std::string name;               // of a table, or "all"; empty: list them
    std::vector<std::string> given; // files with tables that `all` does not measure again
    bool quick = false;             // a small part of every table
    bool large = false;             // what is long, too
    unsigned threads = 0;           // 0: one, then all
    std::filesystem::path json, page, docs, scene; // empty: none
};

/// Returns the exit code.
using AnswerBench = std::function<int(const BenchRequest&)>;

/// Becomes trocar-bench, which lies beside this program, with the same command line. Returns, with an error told, only if that fails.
[[nodiscard]] int become_bench_program(const BenchRequest& request);

} // namespace trocar::engine
