// Parts of a step for whoever measures them from outside: a probe is told where each begins and where it ends. Without one nothing is
// done, and nothing that a step computes depends on it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace trocar::engine {

/// The first ones follow one another and are all of a step but its report; the others lie within those, and may nest.
enum class ProbedPart : std::uint8_t {
    Script,      // where everything is, drive commands, pulls
    Prediction,  // free motion of the instruments
    Tissue,      // integration
    Surfaces,    // embedded ones, and those that the scene moves
    Trees,       // spheres follow their surfaces
    Descent,     // pairs of spheres
    Exact,       // instruments between their walls, and continuous tests
    Instruments, // the same where no exact answer stands
    Solids,      // places where surfaces of solids touch; the list of contacts
    Solver,      // in Tissue: impulses between solids
    Walls,       // in Exact and Instruments, like those below: a moved wall is followed
    Planes,      // of walls around rods
    RodSolve,    // in Exact with planes that are made anew in it
    Skin,        // boxes of an instrument's skin
    Tests,       // continuous ones
};
inline constexpr std::size_t kProbedParts = 15, kFirstInnerPart = 9;

/// Both are called on the thread that steps.
class StepProbe {
public:
    virtual ~StepProbe() = default;
    virtual void begin(ProbedPart part) noexcept = 0;
    virtual void end(ProbedPart part) noexcept = 0;
};

/// A part, for as long as this lives. nullptr: nobody is told.
class ProbeScope {
public:
    ProbeScope(StepProbe* probe, ProbedPart part) noexcept : probe_(probe), part_(part) {
        if (probe_ != nullptr) probe_->begin(part_);
    }
    ~ProbeScope() {
        if (probe_ != nullptr) probe_->end(part_);
    }
    ProbeScope(const ProbeScope&) = delete;
    ProbeScope& operator=(const ProbeScope&) = delete;

private:
    StepProbe* probe_;
    ProbedPart part_;
};

} // namespace trocar::engine
