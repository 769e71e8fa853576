// When image-space culling leaves the rest to the exact tests on the CPU: by a rate measured on the current mesh.
#pragma once

#include "collision/culling/image_space.hpp"
#include "engine/time/clock.hpp"

namespace trocar::engine {

class HandOver {
public:
    /// Times the exact tests on a part of the mesh. positions are finite or their triangles are skipped by the tests
    HandOver(std::span<const Triangle> triangles, std::span<const Vec3> positions);

    /// Of every pass: passes over whole patches do not count in the time of a pass.
    void see(const collision::ImageSpacePass& pass) noexcept;
    /// Another pass pays if one like the last would save more time in the tests than it took.
    [[nodiscard]] bool go_on(const collision::ImageSpacePass& last);
    [[nodiscard]] double test_us_per_triangle() const noexcept { return 1e3 * test_ms_per_triangle_; }

private:
    double test_ms_per_triangle_ = 0.0;
    std::size_t passes_ = 0; // of single triangles, since the last answer
    StopWatch watch_;        // since the last answer
};

} // namespace trocar::engine
