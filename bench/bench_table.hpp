// What a bench is: what it is asked for, and the table that it gives.
#pragma once

#include "base/result.hpp"
#include "engine/prepare/model.hpp"
#include "engine/report/gnuplot.hpp"
#include "engine/scene/scene.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace trocar::engine {

struct BenchOptions {
    bool quick = false;                        // a small part of every table, for tests: same columns, fewer rows
    bool large = false;                        // the paper's large models as well, where a table has them
    unsigned threads = 0;                      // 0: one row set with 1 thread and one with every core
    std::filesystem::path json;                // empty: printed only
    std::filesystem::path page;                // empty: none; a page with the table and its plots
    std::filesystem::path docs;                // empty: none; the folder of benchmarks.md, which then shows what was measured
    std::filesystem::path scene;               // what scene-wide tables run; empty: the hepatic scene of this project
    std::optional<std::filesystem::path> data; // $TROCAR_TEST_DATA where it names a folder
    std::function<void(const std::string&)> progress = [](const std::string&) {}; // what is being measured now
};

/// One line of a table. Keys keep their order; units stand in the names (ns_per_tet, total_ms); a figure that was not
/// measured here (a paper's, a peer's that is not installed) says so in its own key or is null.
using BenchRow = nlohmann::ordered_json;

/// A scene that a table ran.
struct BenchScene {
    std::string file;
    std::uint64_t model_hash = 0; // hash_model, as it was prepared
};

struct BenchTable {
    bool quick = false; // a small part: smaller models, fewer steps than the papers'
    std::vector<BenchRow> rows;
    std::vector<std::string> notes; // what was left out and why; printed under the table
    std::vector<Sketch> sketches;   // plots of the page
    std::vector<PlotData> plot_data;
    std::vector<BenchScene> scenes; // read from files; none: the table makes its own
    std::string command;            // that measures it anew; empty: by its name alone
};

/// A scene that the table ran, for its page and its JSON.
void note_scene(BenchTable& table, const Scene& scene, const SceneModel& model);

struct Bench {
    std::string_view name;
    std::string_view what; // one line for --help
    Result<BenchTable> (*run)(const BenchOptions&);
};

struct MeasuredBench {
    const Bench* bench = nullptr;
    BenchTable table;
};

/// The middle one of the values; 0 where there is none.
[[nodiscard]] inline double median(std::vector<double> values) {
    if (values.empty()) return 0.0;
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
    return values[values.size() / 2];
}

} // namespace trocar::engine
