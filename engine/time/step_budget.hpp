// One deadline over a step. Kernels get small grants of work units; this is where microseconds become units, by rates that
// are measured as the run goes (wall) or declared once and for all (work).
#pragma once

#include "base/work_budget.hpp"
#include "engine/time/clock.hpp"
#include "engine/time/decisions.hpp"
#include "engine/time/forecast.hpp"
#include "engine/time/limits.hpp"
#include "engine/time/step_probe.hpp"

#include <algorithm>
#include <array>
#include <cstdint>

namespace trocar::engine {

/// Parts of a step whose cost is forecast from step to step.
enum class StepPart : std::uint8_t {
    Tissue,  // integration
    EmbeddedSurfaces,   // surfaces, sphere trees and the free motion of instruments
    Lumen,   // a lumen's inscribed spheres on its moved wall, before an instrument's descent reads them
    List,    // the descent's answer, pair by pair: what it left open takes time to name, and there is more of it the more it tested
    Respond, // instruments between their walls when there is no exact answer: planes and solves, which nothing interrupts
    Walls,   // how far the walls have come: every step needs it, with or without an exact answer, so what it costs is always known
    Planes,  // the instrument's wall planes, found before the rod is solved against them: likewise
    Skin,    // the boxes of an instrument's skin, before its continuous tests
    Holds,    // of solids: places made of what was found, and of what was left
    Renew,    // planes of some places of an instrument, for the next step's look ahead
    LookAhead, // free motion of the instruments between the last step's planes: not on the account, but it tells how hard this step is
};
inline constexpr std::size_t kStepPartCount = 11;

/// Declared rates of mode Work: what one operation of the exact stage costs in sphere-pair tests. Fixed numbers, so that no
/// machine changes an answer: a pair test ~10 ns, a candidate ~60 ns, a triangle's refit ~20 ns when they were measured,
/// rounded. They are no forecast of seconds, which mode Wall measures as it runs: the traversal to a candidate costs more than the
/// candidate, and is not counted here.
inline constexpr std::uint64_t kUnitsPerCandidate = 6;
inline constexpr std::uint64_t kUnitsPerRefitTriangle = 2;
/// Of the surfaces of solids: a triangle's boxes and normals, a triangle beneath a leaf (its vertices and edges against the other surface),
/// a query for the closest point; and one place of a contact's solve, once.
inline constexpr std::uint64_t kUnitsPerSurfaceTriangle = 1, kUnitsPerLeafTriangle = 60, kUnitsPerQuery = 60, kUnitsPerRow = 1;

/// What the exact stage is expected to do: the numbers of its last run.
struct ExactForecast {
    std::uint64_t candidates = 0;
    std::uint64_t triangles = 0;      // of the skins: their boxes are refitted in every round
};

/// What the surfaces of solids will ask for, units.
struct SurfaceNeed {
    std::uint64_t made_ready = 0; // in pieces
    std::uint64_t places = 0;     // beneath leaves
};

class StepBudget {
public:
    StepBudget(const Clock& clock, const BudgetLimits& limits) noexcept : clock_(&clock), limits_(limits) {}

    /// From the next step on; rates and forecasts stay.
    void set_limits(const BudgetLimits& limits) noexcept { limits_ = limits; }
    /// Starts the step's time accounting: of the whole step, or of collision alone (CollisionScope).
    void begin(bool covers_step = true) noexcept;
    /// Time that passes between pause and resume is not charged.
    void pause() noexcept;
    void resume() noexcept;
    [[nodiscard]] bool covers_step() const noexcept { return covers_step_; }
    /// Time that another account was charged for work that this one depends on.
    void charge(double seconds) noexcept { charged_ns_ += static_cast<std::int64_t>(seconds * 1e9); }

    /// A part of the step begins, and ends: what it cost is the forecast for the next one. Parts may nest.
    void begin_part(StepPart part) noexcept {
        tell(part, &StepProbe::begin);
        part_start_ns_[static_cast<std::size_t>(part)] = clock_->now_ns();
    }
    void end_part(StepPart part) noexcept;
    /// A part was left out for want of time: the stored forecast of its cost decays, or it would be left out for ever.
    void leave_out(StepPart part) noexcept { parts_[static_cast<std::size_t>(part)].fade(); }
    [[nodiscard]] const CostForecast& forecast(StepPart part) const noexcept { return parts_[static_cast<std::size_t>(part)]; }
    /// A solve of an instrument, in the exact stage or outside of it: it tells what the next one will cost.
    void begin_solve() noexcept {
        tell(ProbedPart::RodSolve, &StepProbe::begin);
        round_start_ns_ = clock_->now_ns();
    }
    void end_solve() noexcept;
    /// Which of the droppable effects this step leaves out, in their order, so that the forecast of the rest fits.
    [[nodiscard]] unsigned choose_drops(std::span<const Droppable> order);
    /// From now on this much is reserved from every grant, for what must follow within the budget: seconds in mode Wall, units in mode Work.
    void keep_back(double seconds, std::uint64_t units = 0) noexcept { kept_back_s_ = seconds, kept_back_units_ = units; }
    /// s; what is kept for listing pairs before it is known how many there are.
    [[nodiscard]] double least_listing_s() const noexcept {
        return std::min(forecast(StepPart::List).reserve_s(), margin_s());
    }
    /// s; what listing so many pairs will take, and holding them if they are left: by what the last lists took.
    [[nodiscard]] double listing_s(std::uint64_t pairs) const noexcept {
        return kListed * static_cast<double>(pairs) * (list_s_per_pair_ + hold_s_per_pair_) + margin_s();
    }
    [[nodiscard]] double holding_s(std::uint64_t pairs) const noexcept {
        return kListed * static_cast<double>(pairs) * hold_s_per_pair_ + margin_s();
    }
    /// So many pairs were listed, and so many were held or left, in the last part of that kind.
    void learn_listing(std::uint64_t pairs) noexcept { learn_per_pair(StepPart::List, pairs, list_s_per_pair_); }
    void learn_holding(std::uint64_t pairs) noexcept { learn_per_pair(StepPart::Holds, pairs, hold_s_per_pair_); }
    /// What the surfaces of solids may ask of what is left, for so much that they are known to need: a fifth at most (mode Work: half).
    [[nodiscard]] double surfaces_share_s(const SurfaceNeed& need) const noexcept;
    [[nodiscard]] std::uint64_t surfaces_share_units(const SurfaceNeed& need) const noexcept { return std::min(need.made_ready + need.places, units_left() / 2); }

    /// Places times iterations that the solves of a step's contact may take, a third of the budget at most; each solve has its least number
    /// all the same.
    [[nodiscard]] WorkBudget grant_rows();
    /// A solve over so many places; small ones are charged by the rate of the others, since reading the clock would take as long.
    /// more   it does more than iterate, which is charged and says nothing of the rate
    void begin_rows(std::uint64_t places, bool more) noexcept {
        tell(ProbedPart::Solver, &StepProbe::begin);
        rows_more_ = more;
        rows_timed_ = more || places >= kTimedPlaces;
        if (rows_timed_) rows_start_ns_ = clock_->now_ns();
    }
    /// units   places times iterations. Charged whatever the budget covers.
    void end_rows(std::uint64_t units) noexcept;
    void settle_rows(const WorkBudget& grant) noexcept;

    /// The next grant for the surfaces of solids; empty when there is no room for so many units.
    [[nodiscard]] WorkBudget grant_surfaces(std::uint64_t at_least);
    void settle_surfaces(const WorkBudget& grant) noexcept;

    /// The next grant for sphere-pair tests: small, so that the clock is read often enough. Empty when the time is up.
    /// at_least  units, what is done next takes no less: nothing is granted where the time is too short for that
    [[nodiscard]] WorkBudget grant_descent(std::uint64_t at_least = 1);
    void settle_descent(const WorkBudget& grant) noexcept;

    /// Instruments between their walls without an exact answer, in whole: does it fit, by what it cost lately? Where it does not it is tried
    /// again after a while, and after twice that where the try overran. In mode Work it always does, but under no units at all.
    [[nodiscard]] bool response_fits();
    void end_response() noexcept;
    /// Places whose planes there is time for, of so many.
    [[nodiscard]] std::uint64_t grant_places(std::uint64_t wanted);
    /// That were made in the last such part, Planes or Renew.
    void learn_places(StepPart part, std::uint64_t count) noexcept;

    /// The exact stage: does it fit, by the cost of its last runs, in what is left? True starts its account.
    /// In mode Wall all parts but the tests are measured by themselves (Walls, Planes, solves, Skin); in mode Work they cost what is
    /// declared.
    [[nodiscard]] bool exact_fits(const ExactForecast& forecast);
    /// Is there time for one more solve and the boxes of what it moved? False: the stage is abandoned, its answer thrown away. True
    /// starts the solve's account, which end_solve ends.
    [[nodiscard]] bool round_fits();
    /// The solve is done, and so are the skin's boxes: the grant of candidates for the continuous tests. They end early when that runs out.
    [[nodiscard]] WorkBudget grant_tests(const ExactForecast& forecast);
    void settle_tests(const ExactForecast& forecast, const WorkBudget& grant) noexcept;
    /// Does image-space culling filter the candidates of the next tests first? Only where that pays, and fits into what is left.
    [[nodiscard]] bool choose_cull(double culling_s, bool pays);
    /// finished  false: abandoned, so the cost is not known, only that it is more than what was spent
    void end_exact(bool finished) noexcept;

    [[nodiscard]] double elapsed_s() const noexcept;     // charged so far in this step
    [[nodiscard]] double elapsed_cpu_s() const noexcept; // the same in this thread's own time
    [[nodiscard]] double limit_s() const noexcept;       // infinity unless mode Wall
    [[nodiscard]] std::uint64_t units_spent() const noexcept { return units_spent_; }
    [[nodiscard]] bool overrun() const noexcept { return limits_.mode == BudgetMode::Wall && elapsed_s() > limit_s(); }
    [[nodiscard]] const BudgetLimits& limits() const noexcept { return limits_; }
    [[nodiscard]] DecisionTape& tape() noexcept { return tape_; }
    /// Is told of the parts of a step from now on; nullptr: nobody is. It must outlive its use.
    void set_probe(StepProbe* probe) noexcept { probe_ = probe; }
    [[nodiscard]] StepProbe* probe() const noexcept { return probe_; }

private:
    [[nodiscard]] bool grants_nothing() const noexcept { return limits_.mode == BudgetMode::Work && limits_.work_units == 0; }
    static constexpr std::uint64_t kTimedPlaces = 24;
    static constexpr unsigned kLeastPatience = 4, kMostPatience = 2048; // steps
    /// Of the budget: what follows the surfaces is no steadier than that.
    static constexpr double kMargin = 0.1;
    /// Of what listing and holding pairs take: choosing among them and reporting them, which are not measured by themselves, and a reserve.
    static constexpr double kListed = 2.0;
    [[nodiscard]] double margin_s() const noexcept { return limits_.mode == BudgetMode::Wall ? kMargin * limits_.wall_s : 0.0; }
    void learn_per_pair(StepPart part, std::uint64_t pairs, double& rate) noexcept;
    void tell(ProbedPart part, void (StepProbe::*what)(ProbedPart)) noexcept {
        if (probe_ != nullptr) (probe_->*what)(part);
    }
    void tell(StepPart part, void (StepProbe::*what)(ProbedPart)) noexcept;
    [[nodiscard]] double median_of_last() const noexcept;
    [[nodiscard]] double left_s() const noexcept;
    [[nodiscard]] double look_ahead_s() const noexcept { return part_took_s_[static_cast<std::size_t>(StepPart::LookAhead)]; }
    [[nodiscard]] double by_look_ahead(const CostRatio& ratio) const noexcept; // s; infinite where nothing tells
    [[nodiscard]] bool retries() const noexcept; // the exact stage, by what its parts cost lately
    [[nodiscard]] std::uint64_t units_left() const noexcept;
    [[nodiscard]] double tests_seconds(std::uint64_t candidates) const noexcept;
    [[nodiscard]] std::uint64_t affordable_tests(const ExactForecast& forecast) const noexcept;
    [[nodiscard]] std::uint64_t affordable_descent(std::uint64_t at_least) const noexcept;
    [[nodiscard]] std::uint64_t share_of_left(double s_per_unit, std::uint64_t at_least, std::uint64_t smallest) const noexcept;

    const Clock* clock_;
    StepProbe* probe_ = nullptr;
    BudgetLimits limits_;
    DecisionTape tape_;
    std::int64_t charged_ns_ = 0, charged_cpu_ns_ = 0;
    std::int64_t running_since_ = 0, running_since_cpu_ = 0;
    bool running_ = false, covers_step_ = true;
    bool exact_tried_ = true, solve_seen_ = true;
    double kept_back_s_ = 0.0, rows_s_ = 0.0;
    std::uint64_t kept_back_units_ = 0, units_spent_ = 0;
    std::uint64_t rows_timed_units_ = 0;
    std::int64_t rows_start_ns_ = 0;
    bool rows_timed_ = false, rows_more_ = false;
    std::array<std::int64_t, kStepPartCount> part_start_ns_{};
    std::array<double, kStepPartCount> part_took_s_{};     // the last time
    double list_s_per_pair_ = 50e-9, hold_s_per_pair_ = 50e-9; // s
    double plane_s_per_place_ = 3e-6;                          // s, likewise
    unsigned carried_steps_ = 0, patience_ = kLeastPatience;   // without a response; until one is tried
    bool tries_response_ = false;
    std::int64_t operation_start_ns_ = 0, exact_start_ns_ = 0, round_start_ns_ = 0;
    double descent_s_per_unit_ = 100e-9; // s, replaced by the first measurement
    double descent_lesson_s_ = 0.0;      // s, of grants that taught nothing yet
    std::uint64_t descent_lesson_ = 0;   // units of the same
    double piece_s_per_unit_ = 100e-9;   // s, of what is done in one piece
    double query_s_per_unit_ = 15e-9, surface_s_per_unit_ = 10e-9, row_s_per_unit_ = 2e-9; // s, of surfaces and of contact's solves
    std::array<double, 4> surface_last_{}; // s, the last that were measured; 0: none was
    std::size_t surfaces_measured_ = 0;
    bool granted_piece_ = false;
    double tests_s_per_candidate_ = 500e-9; // s, likewise
    double tests_cheapest_ = 0.0;           // s, the lowest that was measured so far; 0: none was
    double trust_ = 1.0;                    // in the number of candidates of the last exact stage
    bool learned_ = false;                  // what tests cost, in this stage
    unsigned refusals_ = 0;                 // steps in a row without an exact stage for want of time; retries() stays until one fails
    std::array<CostForecast, kStepPartCount> parts_{CostForecast{},       CostForecast{},      CostForecast::of_steady(),
                                                    CostForecast{0.1e-3}, CostForecast{},      CostForecast{},
                                                    CostForecast{},       CostForecast{0.1e-3}, CostForecast{}, CostForecast{},
                                                    CostForecast{}};
    // whole exact stages, and the solve of one of their rounds; first guesses are on the late side
    CostForecast exact_{1e-3}, solve_{0.3e-3};
    CostForecast steady_;   // Walls, Planes and solves of a step together: that one of them is held up says nothing of the others
    double steady_s_ = 0.0; // of the step that goes on
    CostRatio steady_ratio_, response_ratio_; // of that, and of whole responses, to the look ahead
};

/// Detection, and what stands in for it, for as long as this lives: charged whatever the budget covers.
class CollisionScope {
public:
    explicit CollisionScope(StepBudget& budget) noexcept : budget_(budget) {
        if (!budget.covers_step()) budget.resume();
    }
    ~CollisionScope() {
        if (!budget_.covers_step()) budget_.pause();
    }
    CollisionScope(const CollisionScope&) = delete;
    CollisionScope& operator=(const CollisionScope&) = delete;

private:
    StepBudget& budget_;
};

} // namespace trocar::engine
