// Stage II in the paper's order: every pair of sets in two passes, a visibility query for each prism against what was drawn before
// it. Correct and far too slow: the reference that the order-free form is compared with, bit for bit in one view.
// This work is based on: Govindaraju et al. (2005), algorithm 5.1, without view coherence, so that the two forms are comparable.
#pragma once

#include "collision/cull_backend.hpp"

#include <vector>

namespace seldinger::collision {

/// What draws prisms one after another and tells how they lie to those before: a depth buffer with occlusion queries.
class VisibilityCanvas {
public:
    virtual ~VisibilityCanvas() = default;
    virtual void start(const CullJob& job) = 0;
    virtual void clear() = 0;
    /// True if some of the prism is at or behind what was drawn since the last clear (GEQUAL, no writes).
    [[nodiscard]] virtual bool is_behind(Index prism) = 0;
    /// Its front, where it is the nearest (LESS, writes).
    virtual void draw(Index prism) = 0;
};

class CpuCanvas final : public VisibilityCanvas {
public:
    void start(const CullJob& job) override;
    void clear() override;
    [[nodiscard]] bool is_behind(Index prism) override;
    void draw(Index prism) override;

private:
    const CullJob* job_ = nullptr;
    std::vector<float> depth_; // [height][width]
};

/// hits   [question_count], as CullBackend::find_hits with CullMemory::Fronts gives them; questions must name prisms that are drawn
/// returns how many queries it took
std::uint64_t find_hits_in_two_passes(const CullJob& job, VisibilityCanvas& canvas, std::span<std::uint8_t> hits);

} // namespace seldinger::collision
