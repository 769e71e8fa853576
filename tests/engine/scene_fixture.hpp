// A small sound scene whose parts a test can spoil, and the checks every error must pass.
#pragma once

#include "engine/scene/scene.hpp"
#include "tests/temp_folder.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

namespace trocar::engine {

inline const std::string kSoundScene = R"({
    "units": {"length": "mm", "pressure": "kPa"},
    "time": {"step": 0.01, "duration": 1},
    "bodies": {
        "organ": {
            "kind": "deformable",
            "surface": {"shape": "sphere", "radius": 50},
            "material": {"young_modulus": 5, "density": 1060},
            "fixed": [{"direction": [0, 0, 1], "fraction": 0.2}]
        },
        "vessel": {
            "kind": "static",
            "surface": {"shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 200, 4]]},
            "hollow": true,
            "embedded_in": "organ",
            "blend": 5
        }
    },
    "instruments": {
        "wire": {
            "length": 300,
            "radius": 0.4,
            "young_modulus": 60000,
            "entry": {"position": [0, 0, 10], "direction": [0, 0, 2]},
            "lumen": "vessel",
            "path": [[0, 20, 0], [1, 50, 1]]
        }
    },
    "targets": {"end": {"position": [0, 0, 150]}},
    "effects": ["elasticity", "damping", "coarse_contact", "exact_contact"]
})";

/// The sound scene with one piece of its text replaced; the piece must be there.
inline std::string spoil(const std::string& piece, const std::string& other) {
    std::string text = kSoundScene;
    const std::size_t at = text.find(piece);
    EXPECT_NE(at, std::string::npos) << piece;
    if (at != std::string::npos) text.replace(at, piece.size(), other);
    return text;
}

/// What a text is refused with; says so when it is not.
inline Error refusal(const std::string& text) {
    const auto scene = parse_scene(text, "scenes/test.json");
    EXPECT_FALSE(scene.ok()) << "accepted: " << text.substr(0, 2000);
    return scene.ok() ? Error{} : scene.error();
}

/// Does the text contain the piece? As an assertion that shows both.
inline testing::AssertionResult says(const Error& error, const std::string& piece) {
    if (error.to_string().find(piece) != std::string::npos) return testing::AssertionSuccess();
    return testing::AssertionFailure() << "\"" << piece << "\" is not in: " << error.to_string();
}

using SceneFolder = TempFolder;

/// Root of the source tree, seen from this file.
inline std::filesystem::path source_root() {
    return TROCAR_SOURCE_DIR; // __FILE__ may be relative to where the compiler ran
}

} // namespace trocar::engine
