// What drives the instruments in an episode.
#pragma once

#include "base/result.hpp"

#include <span>

namespace trocar::engine {

class Policy {
public:
    virtual ~Policy() = default;
    /// observation  [observation_size] mm, mm/s, rad
    /// action       [devices][2] mm/s and rad/s, written whole and finite
    /// fails        ToolFailed: a program of the user's that ended or answered something else
    [[nodiscard]] virtual Result<void> act(std::span<const float> observation, std::span<double> action) = 0;
};

} // namespace trocar::engine
