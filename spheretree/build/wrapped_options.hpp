// How a wrapped sphere tree is built (wrapped_tree.hpp).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace trocar::spheretree {

enum class Builder : std::uint8_t {
    Medial,  // adaptive medial axis: tight, needs a closed surface
    Hubbard, // medial spheres merged pair by pair: baseline, needs a closed surface
    Octree,  // spheres around octree cells: baseline, any surface
    Shell,   // balls around patches, as small as can be: open surfaces such as vessel walls
};
/// medial, hubbard, octree, shell.
[[nodiscard]] std::string_view builder_name(Builder builder) noexcept;
[[nodiscard]] std::optional<Builder> find_builder(std::string_view name) noexcept;
[[nodiscard]] std::string builder_names();
[[nodiscard]] constexpr bool needs_closed(Builder builder) noexcept { return builder == Builder::Medial || builder == Builder::Hubbard; }

struct WrappedOptions {
    Builder builder = Builder::Medial;
    unsigned branching = 8; // children of a sphere at most: 2 to 64; the octree has 8 whatever it says
    unsigned depth = 3;     // levels below the root: 0 to 8
};

} // namespace trocar::spheretree
