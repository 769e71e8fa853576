// The simulation's thread: commands, a step, a snapshot, and a rest until the next step is due. It shares memory with the
// network through queues that never block, and never waits.
#pragma once

#include "engine/report/statistics.hpp"
#include "engine/viewer/latest.hpp"
#include "engine/viewer/snapshot.hpp"

#include <boost/lockfree/spsc_queue.hpp>

#include <atomic>
#include <optional>

namespace trocar::engine::viewer {

/// One step in the page's plot.
struct PlotPoint {
    std::uint64_t step = 0;
    float total_ms = 0.0f;   // the whole step
    float charged_ms = 0.0f; // what the budget's scope took
    float limit_ms = 0.0f;   // 0: no limit in time
    std::int16_t level = 0;
    bool kept = true;
    float force_n = 0.0f;     // on the wall
    float insertion_m = 0.0f; // of the first instrument
};

/// A recording as it stood when it was requested, or a saved state.
struct Sealed {
    std::optional<Saved> saved; // none: not asked for, or there is no such one
    std::shared_ptr<const Recording> recording;
    std::size_t steps = 0;
    std::uint64_t state_hash = 0; // after so many steps
};

/// Commands that may wait for the next step.
inline constexpr std::size_t kMostCommands = 256;
/// Seal commands that may wait for their answers.
inline constexpr std::size_t kMostSeals = 16;

/// State shared by the two threads.
struct Exchange {
    boost::lockfree::spsc_queue<Command, boost::lockfree::capacity<kMostCommands>> commands; // network -> simulation
    boost::lockfree::spsc_queue<PlotPoint, boost::lockfree::capacity<4096>> steps;           // simulation -> network
    std::atomic<std::uint64_t> steps_not_shown{0};                                           // the queue was full
    Latest<Snapshot> snapshot;
    Latest<State> xray;                    // visible_part, for the X-ray monitor
    std::atomic<bool> xray_wanted{false};  // a viewer shows it
    std::atomic<std::uint64_t> answers{0}; // snapshots published that show what a command did, or are for one that has joined
    boost::lockfree::spsc_queue<Sealed, boost::lockfree::capacity<kMostSeals>> sealed; // an answer to each Seal, in their order
    std::atomic<unsigned> viewers{0};      // no viewer: nothing is copied
    std::atomic<std::uint64_t> joined{0};  // viewers that have come so far: each one is shown the session as it is then
    std::atomic<bool> spheres{false};      // a viewer shows them
    std::atomic<bool> stop{false};
};

struct LoopOptions {
    std::uint64_t steps = 0;      // 0: until stopped
    bool paced = true;            // false: as fast as it goes, for measurements
    bool wait_for_viewer = false; // no step before the first viewer
};

/// Before the threads start: sizes what they share, and shows the session as it is.
void open_exchange(Session& session, Exchange& exchange);

/// Runs until `exchange.stop`, or so many steps. tally  every step's report, as a headless run counts them; its memory is
/// reserved, and later steps are left out when it is full.
void run_loop(Session& session, Exchange& exchange, const LoopOptions& options, RunStatistics& tally);

/// Steps that a tally holds: an hour of steps of 10 ms.
inline constexpr std::uint64_t kTallySteps = 360'000;

} // namespace trocar::engine::viewer
