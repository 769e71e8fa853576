#pragma once

#include "engine/experiments/sweep/sweep_plan.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace trocar::engine {

inline std::string text_of(const std::filesystem::path& file) {
    std::ifstream stream(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// A folder that goes away with the test.
class SweepFolder : public ::testing::Test {
protected:
    SweepFolder() {
        std::string name = (std::filesystem::temp_directory_path() / "trocar-sweep-XXXXXX").string();
        folder = mkdtemp(name.data());
    }
    ~SweepFolder() override {
        std::error_code ignored;
        std::filesystem::remove_all(folder, ignored);
    }
    std::filesystem::path write(const std::string& name, const std::string& text) const {
        std::ofstream(folder / name, std::ios::binary) << text;
        return folder / name;
    }
    std::filesystem::path folder;
};

inline const std::string kBall = R"({
    "units": {"length": "mm"},
    "time": {"step": 0.01, "duration": 1},
    "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "radius": 10}}},
    "targets": {"end": {"position": [0, 0, 1]}},
    "effects": ["coarse_contact"]
})";

} // namespace trocar::engine
