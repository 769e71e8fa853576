// The interface between the culling algorithm and its image-space back ends: graphics hardware, or the CPU reference.
#pragma once

#include "base/result.hpp"
#include "collision/culling/cull_frame.hpp"

#include <span>
#include <string>

namespace trocar::collision {

/// What is stored per pixel and set. Both forms are conservative; the second separates what lies between two others.
enum class CullMemory : std::uint8_t {
    Fronts,    // the two nearest fronts: a prism is free if it lies before all of the set, as in Govindaraju et al. 2005
    Intervals, // the two nearest with their backs, and the third front: a prism may also lie behind or between them. Inside a closed
               // vessel nothing is ever before the near wall, so this is what culls there
};

/// One query: does this prism, in this view, meet any other of that set than the one neighbour it may have there?
struct CullQuestion {
    Index prism, set;
};

/// Pixels of a picture that footprints may take on average, drawn and queried: enough to separate shapes. Few large triangles are
/// given a small picture, or most of the time would go into filling it.
inline constexpr double kPixelsPerFootprint = 64.0;

/// Are these footprints small enough, or would a picture of half the size suffice?
/// most   pixels that a footprint may take on average
[[nodiscard]] inline bool are_small_enough(std::span<const Footprint> footprints, std::span<const CullQuestion> questions,
                                           double most = kPixelsPerFootprint) noexcept {
    const auto area = [](const Footprint& p) { return static_cast<double>(p.x1 - p.x0) * (p.y1 - p.y0); };
    double pixels = 0.0;
    for (const Footprint& p : footprints) pixels += area(p);
    for (const CullQuestion& q : questions) pixels += area(footprints[q.prism]);
    return pixels <= most * static_cast<double>(footprints.size() + questions.size());
}

/// One view of one problem. Borrows everything.
struct CullJob {
    int width = 0, height = 0;                   // pixels
    std::span<const Footprint> footprints;       // [prism_count]
    std::span<const Triangle> corners;           // [prism_count] vertex ids: prisms that share one are neighbours
    std::span<const Index> set_begin;            // [set_count + 1] into set_members
    std::span<const Index> set_members;          // prisms that are drawn, set by set
    std::span<const CullQuestion> questions;     // by set, each once
    std::span<const std::size_t> question_begin; // [set_count + 1] into questions
    CullMemory memory = CullMemory::Intervals;

    [[nodiscard]] Index set_count() const noexcept { return static_cast<Index>(set_begin.size() - 1); }
};

class CullBackend {
public:
    virtual ~CullBackend() = default;
    /// "CPU reference", or the API of the graphics device and its name.
    [[nodiscard]] virtual std::string name() const = 0;
    /// Resolution, pixels a side, at which this back end is most efficient.
    [[nodiscard]] virtual int preferred_resolution() const noexcept = 0;
    /// Allocates for jobs of so many prisms and questions, with pictures of so many pixels a side: this library allocates nothing for those
    /// afterwards. Allocations of a driver are not counted.
    virtual void reserve(std::size_t /*prisms*/, std::size_t /*questions*/, int /*resolution*/) {}
    /// Pixels a side of the largest picture that fits; shrinks when the device turns out to have less memory.
    [[nodiscard]] virtual int largest_resolution() const noexcept { return kLargestPicture; }
    /// hits   [question_count] written: 0 only if the prism is proven free of the set in this view
    /// fails  ToolFailed where the device does: lost context, out of memory; hits are then worth nothing. Where a smaller picture
    ///        would help, largest_resolution() is below the job's from then on
    [[nodiscard]] virtual Result<void> find_hits(const CullJob& job, std::span<std::uint8_t> hits) = 0;
};

} // namespace trocar::collision
