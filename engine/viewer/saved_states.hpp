// What the page shows of the states that a person keeps under names, to go back to.
#pragma once

#include "engine/viewer/command.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace trocar::engine::viewer {

/// States that are kept at the same time.
inline constexpr std::size_t kMostSaved = 12;

struct SavedMark {
    std::uint32_t id = 0; // from 1; never twice in a session
    StateName name{};
    std::uint64_t step = 0;
    double time_s = 0.0;
};
/// The oldest first. Plain data: a snapshot copies it without allocating.
struct SavedMarks {
    std::array<SavedMark, kMostSaved> marks{};
    std::size_t count = 0;
    [[nodiscard]] std::span<const SavedMark> all() const noexcept { return std::span(marks).first(count); }
};

} // namespace trocar::engine::viewer
