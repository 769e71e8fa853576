// What the page asks for about picked places, as plain data. read_command.hpp makes it out of a message.
#pragma once

#include "base/mesh.hpp"
#include "base/result.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace trocar::engine::viewer {

/// A click on a surface. Body and triangle exist: checked when the message was read.
struct PickPlace {
    enum class What : std::uint8_t { Target, Entry };
    What what = What::Target;
    std::uint32_t body = 0;
    Index triangle = 0;
    std::array<double, 3> weights{1.0, 0.0, 0.0}; // of the triangle's corners; their sum is 1
};
struct ForgetPicks {};
/// A new scene with the picks, beside the one that is shown.
struct SaveScene {
    std::string target;    // name of the picked target
    std::string file_name; // empty: <scene>-picked.json, or with the next free number
};

/// Bytes of a file's name at most.
inline constexpr std::size_t kLongestFileName = 64;

/// A plain name: letters, digits, - _ and dots, none of them at the front.
/// fails  BadValue
[[nodiscard]] Result<void> check_file_name(std::string_view name);

} // namespace trocar::engine::viewer
