// What a step and a run are given of time, and the rows in which a step says what it took. Plain data: step_budget.hpp, account.hpp and
// pacer.hpp do something with it.
#pragma once

#include <cstddef>
#include <cstdint>

namespace trocar::engine {

enum class BudgetMode : std::uint8_t {
    Wall,  // microseconds of a monotonic clock
    Work,  // sphere-pair tests; the same answers on every run and machine
    Exact, // no limit: everything is tested, the exact stage always runs
};

struct BudgetLimits {
    BudgetMode mode = BudgetMode::Exact;
    double wall_s = 0.0;          // s per step, mode Wall
    std::uint64_t work_units = 0; // per step, mode Work
};

/// What a step may leave out when its budget covers the whole of it.
enum class Droppable : std::uint8_t { ExactContact, Elasticity };
[[nodiscard]] constexpr unsigned drop_bit(Droppable effect) noexcept { return 1u << static_cast<unsigned>(effect); }

/// Parts of a step that are charged whatever the budget covers: what each had, and what it took.
enum class AccountPart : std::uint8_t {
    Solve,    // contact between solids, in the tissue's sub-steps
    Descent,  // sphere trees
    Exact,    // continuous tests, with the solves of instruments between their walls that they check
    Walls,    // instruments between their walls where no exact answer stands; springs that they press on
    Surfaces, // of solids
};
inline constexpr std::size_t kAccountParts = 5;
struct AccountEntry {
    double granted_ms = -1.0; // left of the budget when the part began; negative: no limit of time
    double used_ms = 0.0;
    std::uint64_t units = 0; // work units used
};

/// A step that begins after its time.
enum class LatePolicy : std::uint8_t {
    FallBehind, // the run's schedule is shifted by the delay: late steps fall behind real time
    CatchUp,    // catch up: the next steps begin without waiting until the run is on schedule
};

struct PaceSpec {
    double speed = 1.0; // simulated seconds in a second, > 0
    LatePolicy late = LatePolicy::FallBehind;
};

} // namespace trocar::engine
