// Drive positions of every step, as `run --path` reads them. Rows are kept in the scene's units, and the drive follows
// those rows, so that a run that reads them back moves the same, bit for bit.
#pragma once

#include "engine/io/path_csv.hpp"
#include "engine/prepare/drive.hpp"
#include "engine/scene/scene.hpp"

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace trocar::engine::viewer {

/// Events that a file of drive positions cannot hold: a run that had one is not repeated by the file.
enum class Spoiler : std::uint8_t { WallBudget, BudgetChanged, EffectSwitched, TissuePulled, InjectedAgain, InjectedInList, Full, Stopped };
inline constexpr std::size_t kSpoilerCount = 8;

/// One run, from its first step. One thread appends, others may read what is there at any time: nothing moves in memory.
class Recording {
public:
    /// Steps that fit: an hour of steps of 10 ms.
    static constexpr std::size_t kCapacity = 360'000;

    /// How far a run has come: what a run that goes on from there shares with it.
    struct Mark {
        std::size_t steps = 0;
        unsigned spoilers = 0;
        double injection = -1.0;
    };

    Recording(const Units& units, const DriveCommand& start, const BudgetLimits& limits);
    /// Of a run that goes on from there.
    Recording(const Recording& run, const Mark& from);

    [[nodiscard]] Mark mark() const noexcept;

    /// The drive position at `time` [s], as near to `wanted` as the scene's units write it: what the script of a run
    /// that reads this recording says then. Full: `wanted` as it is, and the run is spoiled.
    DriveCommand add(double time, const DriveCommand& wanted) noexcept;
    void spoil(Spoiler by) noexcept { spoilers_.fetch_or(1u << static_cast<unsigned>(by), std::memory_order_relaxed); }
    [[nodiscard]] bool spoiled(Spoiler by) const noexcept {
        return (spoilers_.load(std::memory_order_relaxed) >> static_cast<unsigned>(by)) & 1u;
    }
    /// Contrast is injected from that time [s] on, instead of when the scene says: an option of the run that repeats this one.
    /// returns   s, the nearest start that the scene's units write, not before `time`
    double add_injection(double time) noexcept;
    [[nodiscard]] bool repeatable() const noexcept { return spoilers_.load(std::memory_order_relaxed) == 0; }

    [[nodiscard]] DriveCommand start() const noexcept { return position_of(rows_.front()); }
    [[nodiscard]] std::size_t steps() const noexcept { return count_.load(std::memory_order_acquire) - 1; }
    [[nodiscard]] const BudgetLimits& limits() const noexcept { return limits_; }

    /// `steps` rows after the first, with remarks that say how to repeat the run, or why it cannot be repeated.
    /// state_hash  after that many steps
    [[nodiscard]] std::string text(const Scene& scene, std::size_t steps, std::uint64_t state_hash) const;

private:
    [[nodiscard]] DriveCommand position_of(const PathRow& row) const noexcept;
    [[nodiscard]] PathRow row_of(double time, const DriveCommand& position) const noexcept;
    [[nodiscard]] double in_units(double time) const noexcept;
    [[nodiscard]] double seconds(const PathRow& row) const noexcept { return row.time * time_unit_; }

    double time_unit_, length_unit_, angle_unit_; // SI value of the scene's
    BudgetLimits limits_;
    std::vector<PathRow> rows_; // [kCapacity + 1] in the scene's units, the first at time 0
    std::atomic<std::size_t> count_;
    std::atomic<unsigned> spoilers_{0};
    std::atomic<double> injection_{-1.0}; // in the scene's units; below 0: as the scene says
};

} // namespace trocar::engine::viewer
