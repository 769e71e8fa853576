#pragma once

#include "engine/experiments/sweep/sweep_plan.hpp"
#include "tests/temp_folder.hpp"

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

using SweepFolder = FolderTest;

inline const std::string kBall = R"({
    "units": {"length": "mm"},
    "time": {"step": 0.01, "duration": 1},
    "bodies": {"ball": {"kind": "static", "surface": {"shape": "sphere", "radius": 10}}},
    "targets": {"end": {"position": [0, 0, 1]}},
    "effects": ["coarse_contact"]
})";

} // namespace trocar::engine
