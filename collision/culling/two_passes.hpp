// Stage II in the order of Govindaraju et al. 2005: every pair of sets in two passes, a visibility query for each prism against what was
// drawn before it. Correct and far too slow: the reference that the order-free form is compared with, bit for bit in one view.
// This work is based on: Govindaraju et al. (2005), algorithm 5.1, without view coherence, so that the two forms are comparable; the
// whole algorithm, coherence included, is collision/culling/query_culler.hpp.
#pragma once

#include "collision/culling/cull_backend.hpp"

#include <string>
#include <vector>

namespace trocar::collision {

/// Draws prisms one after another and tells how they lie to those before: a depth buffer with occlusion queries. Answers are
/// collected after many questions, so that the device is not synchronised after each.
class VisibilityCanvas {
public:
    virtual ~VisibilityCanvas() = default;
    /// As CullBackend::name.
    [[nodiscard]] virtual std::string name() const = 0;
    /// Resolution, pixels a side, at which this canvas is most efficient.
    [[nodiscard]] virtual int preferred_resolution() const noexcept = 0;
    /// The job's footprints, until the next start. Only its size and footprints are read.
    /// fails   ToolFailed: the context was lost, no memory
    [[nodiscard]] virtual Result<void> start(const CullJob& job) = 0;
    virtual void clear() = 0;
    /// Is some of the prism at or behind what was drawn since the last clear (GEQUAL, no writes)?
    virtual void ask(Index prism) = 0;
    /// Its front, where it is the nearest (LESS, writes).
    virtual void draw(Index prism) = 0;
    /// behind  [questions since the last call] 1: yes, in the order of the questions
    /// fails   as start does
    [[nodiscard]] virtual Result<void> answer(std::vector<std::uint8_t>& behind) = 0;
};

class CpuCanvas final : public VisibilityCanvas {
public:
    [[nodiscard]] std::string name() const override { return "CPU reference"; }
    [[nodiscard]] int preferred_resolution() const noexcept override { return 256; }
    [[nodiscard]] Result<void> start(const CullJob& job) override;
    void clear() override;
    void ask(Index prism) override;
    void draw(Index prism) override;
    [[nodiscard]] Result<void> answer(std::vector<std::uint8_t>& behind) override;

private:
    CullJob job_;
    std::vector<float> depth_; // [height][width]
    std::vector<std::uint8_t> behind_;
};

/// hits    [question_count], as CullBackend::find_hits with CullMemory::Fronts gives them; questions must name prisms that are drawn
/// returns how many queries it took
/// fails   as the canvas does
[[nodiscard]] Result<std::uint64_t> find_hits_in_two_passes(const CullJob& job, VisibilityCanvas& canvas, std::span<std::uint8_t> hits);

} // namespace trocar::collision
