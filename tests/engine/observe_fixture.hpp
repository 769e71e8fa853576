// Tiny scenes that run in milliseconds, and folders that clean up after themselves.
#pragma once

#include "engine/io/file_bytes.hpp"
#include "engine/report/observer.hpp"
#include "engine/prepare/process.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace trocar::engine::test {

namespace fs = std::filesystem;

inline const std::string kTubeScene = R"({
    "name": "tube & <wire>",
    "units": {"length": "mm", "pressure": "MPa"},
    "time": {"step": 0.01, "duration": 0.2},
    "budget": {"limit": "exact"},
    "bodies": {"tube": {"kind": "static", "hollow": true,
        "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 120, 4]], "sides": 16}}},
    "instruments": {"wire": {"length": 100, "radius": 0.5, "young_modulus": 60, "segment": 5, "skin_triangles": 600,
        "tip": {"shape": "J", "length": 12, "angle": 0.6}, "lumen": "tube",
        "entry": {"position": [0, 0, 10], "direction": [0, 0, 1]}, "path": [[0, 20, 0], [0.2, 26, 0.4]]}},
    "effects": ["coarse_contact", "exact_contact"]
})";

/// A run of a scene text into a folder.
struct TinyRun {
    Scene scene;
    PreparedScene prepared;

    explicit TinyRun(const std::string& text, const std::string& file = "scenes/tiny.json") {
        Result<Scene> read = parse_scene(text, file);
        EXPECT_TRUE(read.ok()) << (read.ok() ? "" : read.error().to_string());
        if (!read.ok()) return;
        scene = std::move(*read);
        Result<PreparedScene> made = make_prepared_scene(scene);
        EXPECT_TRUE(made.ok()) << (made.ok() ? "" : made.error().to_string());
        if (made.ok()) prepared = std::move(*made);
    }

    [[nodiscard]] Result<RunSummary> into(const fs::path& out, std::uint64_t steps, bool force = false, bool record = false,
                                          std::vector<std::string>* notices = nullptr) const {
        ObserveOptions options;
        options.out = out;
        options.steps = steps;
        options.force = force;
        options.record = record;
        auto observer = RunObserver::open(scene, prepared, options);
        if (!observer.ok()) return observer.error();
        Simulator simulator(prepared.model);
        for (std::uint64_t k = 0; k < steps; ++k)
            (void)(*observer)->after_step(simulator, simulator.step()); // what is missing is in the summary
        auto summary = (*observer)->finish(simulator, 0.5, false);
        if (notices != nullptr) *notices = (*observer)->notices();
        return summary;
    }
};

/// Prepared once: preparing is what takes time.
inline const TinyRun& tube_run() {
    static const TinyRun run(kTubeScene);
    return run;
}

class Folder : public ::testing::Test {
protected:
    Folder() : temporary_(TemporaryFolder::make()) {
        EXPECT_TRUE(temporary_.ok());
        out = temporary_->path() / "out";
    }
    [[nodiscard]] std::string text_of(const fs::path& name) const {
        const Result<std::string> bytes = read_file_bytes(out / name);
        EXPECT_TRUE(bytes.ok()) << name;
        return bytes.ok() ? *bytes : std::string();
    }
    [[nodiscard]] nlohmann::json summary() const { return nlohmann::json::parse(text_of("summary.json")); }
    [[nodiscard]] std::vector<std::string> lines_of(const fs::path& name) const {
        std::istringstream in(text_of(name));
        std::vector<std::string> lines;
        for (std::string line; std::getline(in, line);) lines.push_back(line);
        return lines;
    }
    void write(const fs::path& name, const std::string& text) const {
        fs::create_directories((out / name).parent_path());
        std::ofstream(out / name) << text;
    }
    [[nodiscard]] std::vector<std::string> names() const {
        std::vector<std::string> found;
        for (const fs::directory_entry& entry : fs::directory_iterator(out)) found.push_back(entry.path().filename().string());
        std::sort(found.begin(), found.end());
        return found;
    }

    Result<TemporaryFolder> temporary_;
    fs::path out;
};

} // namespace trocar::engine::test
