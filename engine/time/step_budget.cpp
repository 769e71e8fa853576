#include "engine/time/step_budget.hpp"

#include <algorithm>
#include <limits>

namespace trocar::engine {

namespace {

/// Pair tests between two readings of the clock at most; the clock's own cost (about 30 ns) stays below a thousandth of the
/// tests'.
constexpr std::uint64_t kLargestGrant = 4096;
/// Of the time that is left, a grant takes this share until it would be this small: units that
/// cost five times what the last ones did are seen before the time is gone.
constexpr double kGrantShare = 0.125;
constexpr std::uint64_t kSmallestShare = 8;
/// Grants that spent less measure the clock more than the tests: they update no rate.
constexpr std::uint64_t kSmallestLesson = 32, kFewPlaces = 8;
/// Weight of the newest measurement: a rate that changes tenfold is followed within some ten grants.
constexpr double kLearning = 0.2;
/// Rates that rise are followed faster: late is dearer than early.
constexpr double kAlarm = 0.5;
/// A unit of the descent costs several times as much in one grant as in the next: grants are sized by a slowly decaying maximum.
constexpr double kFallingDescent = 0.05;
/// What takes more units than this at once is done in one piece (a sphere's wall links), and is granted by itself: a unit of it costs
/// ten times as much as one of a test.
constexpr bool is_piece(std::uint64_t at_least) noexcept { return at_least > kSmallestShare; }
/// Contacts grow between steps, and what one costs changes from round to round: a third is kept in reserve.
constexpr double kTestsReserve = 1.33;
/// Of what is done in one piece: nothing ends it early.
constexpr double kPieceReserve = 1.25;
/// Of the budget, one part in so many for the solver: what it is not given leaves speeds of approach, but what surfaces are not given leaves
/// places out, and these are more of a force's error (two_organs: of an exact step's charge the solver has a third).
constexpr unsigned kRowsShare = 3;
/// Of what is left after the solver, kept for surfaces: a descent that ends early holds bodies as wholes, which is more of a force's error than surfaces
/// that are not looked at, while what pressed is followed.
constexpr double kSurfacesShare = 0.2;
/// An abandoned stage would have cost more than it was given; how much more is unknown.
constexpr double kAbandonedCost = 1.5;
/// Per step in which the exact stage was not tried its stored number of candidates decays by this factor, as CostForecast::fade.
constexpr double kForget = 0.98;
/// Per exact stage that was given up before any test, of what tests are thought to cost.
constexpr double kDoubt = 0.9;

/// Steps in a row without the exact stage, after which it is tried by what its parts cost lately (CostForecast::recent_s) instead of by
/// their reserves, until it is given up or late once: reserves that rare long measurements keep above the budget would refuse it for ever.
constexpr unsigned kRefusalsUntilRetry = 10;
/// From then on the cost of whole stages, which no step without one measures, is forgotten so many times as fast.
constexpr int kFadesOfRetry = 3;

/// As CostForecast: a program that was suspended has not become a thousand times slower.
constexpr double kLargestLesson = 10.0;

void learn(double& rate, double measured, double falling = kLearning, double rising = kAlarm) noexcept {
    measured = std::min(measured, kLargestLesson * rate);
    rate += (measured > rate ? rising : falling) * (measured - rate);
}

std::uint64_t units_of(const ExactForecast& forecast) noexcept {
    return forecast.candidates * kUnitsPerCandidate + forecast.triangles * kUnitsPerRefitTriangle;
}

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) noexcept { return static_cast<double>(to_ns - from_ns) * 1e-9; }

} // namespace

void StepBudget::begin(bool covers_step) noexcept {
    covers_step_ = covers_step;
    charged_ns_ = charged_cpu_ns_ = 0;
    units_spent_ = 0;
    kept_back_s_ = 0.0;
    kept_back_units_ = 0;
    descent_lesson_s_ = 0.0;
    descent_lesson_ = 0;
    if (!exact_tried_) {
        trust_ *= kForget;
        for (int times = retries() ? kFadesOfRetry : 1; times > 0; --times) exact_.fade();
        leave_out(StepPart::Skin);
        if (!solve_seen_) solve_.fade();
    }
    if (steady_s_ > 0.0 && solve_seen_) { // otherwise it was walls alone
        steady_.learn(steady_s_);
        steady_ratio_.learn(steady_s_, look_ahead_s());
    }
    steady_s_ = 0.0;
    exact_tried_ = solve_seen_ = false;
    running_ = false;
    if (covers_step) resume();
}

void StepBudget::pause() noexcept {
    if (running_) {
        charged_ns_ += clock_->now_ns() - running_since_;
        charged_cpu_ns_ += clock_->cpu_ns() - running_since_cpu_;
    }
    running_ = false;
}

void StepBudget::resume() noexcept {
    if (running_) return;
    running_since_cpu_ = clock_->cpu_ns();
    running_since_ = clock_->now_ns();
    running_ = true;
}

double StepBudget::elapsed_s() const noexcept {
    const std::int64_t open = running_ ? clock_->now_ns() - running_since_ : 0;
    return static_cast<double>(charged_ns_ + open) * 1e-9;
}

double StepBudget::elapsed_cpu_s() const noexcept {
    const std::int64_t open = running_ ? clock_->cpu_ns() - running_since_cpu_ : 0;
    return static_cast<double>(charged_cpu_ns_ + open) * 1e-9;
}

double StepBudget::limit_s() const noexcept {
    return limits_.mode == BudgetMode::Wall ? limits_.wall_s : std::numeric_limits<double>::infinity();
}

double StepBudget::left_s() const noexcept { return limit_s() - kept_back_s_ - elapsed_s(); }

std::uint64_t StepBudget::units_left() const noexcept {
    if (limits_.mode != BudgetMode::Work) return WorkBudget::kUnlimited;
    const std::uint64_t gone = units_spent_ + kept_back_units_;
    return limits_.work_units > gone ? limits_.work_units - gone : 0;
}

void StepBudget::end_part(StepPart part) noexcept {
    const auto index = static_cast<std::size_t>(part);
    const double seconds = seconds_between(part_start_ns_[index], clock_->now_ns());
    parts_[index].learn(seconds);
    part_took_s_[index] = seconds;
    if (part == StepPart::Respond) response_ratio_.learn(seconds, look_ahead_s());
    if (part == StepPart::Walls || part == StepPart::Planes) steady_s_ += seconds;
    tell(part, &StepProbe::end);
}

void StepBudget::tell(StepPart part, void (StepProbe::*what)(ProbedPart)) noexcept {
    if (part == StepPart::Walls) tell(ProbedPart::Walls, what);
    if (part == StepPart::Planes) tell(ProbedPart::Planes, what);
    if (part == StepPart::Skin) tell(ProbedPart::Skin, what);
}

void StepBudget::end_solve() noexcept {
    const double seconds = seconds_between(round_start_ns_, clock_->now_ns());
    solve_.learn(seconds);
    steady_s_ += seconds;
    solve_seen_ = true;
    tell(ProbedPart::RodSolve, &StepProbe::end);
}

unsigned StepBudget::choose_drops(std::span<const Droppable> order) {
    const auto by_forecast = [&]() -> std::uint64_t {
        if (limits_.mode != BudgetMode::Wall) return 0;
        const CostForecast& tissue = forecast(StepPart::Tissue);
        double need =
            tissue.reserve_s() + forecast(StepPart::EmbeddedSurfaces).reserve_s() + forecast(StepPart::Respond).reserve_s() + exact_.reserve_s();
        unsigned dropped = 0;
        for (const Droppable effect : order) {
            if (need <= left_s()) break;
            dropped |= drop_bit(effect);
            need -= effect == Droppable::Elasticity ? tissue.reserve_s() : exact_.reserve_s();
        }
        if ((dropped & drop_bit(Droppable::Elasticity)) != 0) leave_out(StepPart::Tissue);
        return dropped;
    };
    return order.empty() ? 0u : static_cast<unsigned>(tape_.decide(DecisionKind::Drop, by_forecast));
}

std::uint64_t StepBudget::affordable_descent(std::uint64_t at_least) const noexcept {
    if (is_piece(at_least)) return left_s() >= static_cast<double>(at_least) * piece_s_per_unit_ ? at_least : 0;
    return share_of_left(descent_s_per_unit_, at_least, kSmallestShare);
}

/// Units of a grant at such a rate, at least so many or none.
std::uint64_t StepBudget::share_of_left(double s_per_unit, std::uint64_t at_least, std::uint64_t smallest) const noexcept {
    const double left = left_s(), all = left / s_per_unit;
    if (!(left > 0.0) || all < static_cast<double>(at_least)) return 0;
    const double share = std::max(kGrantShare * all, std::min(all, static_cast<double>(std::max(at_least, smallest))));
    return static_cast<std::uint64_t>(std::min(share, static_cast<double>(std::max(at_least, kLargestGrant))));
}

WorkBudget StepBudget::grant_descent(std::uint64_t at_least) {
    operation_start_ns_ = clock_->now_ns();
    granted_piece_ = is_piece(at_least);
    return WorkBudget(tape_.decide(DecisionKind::Descent, [&]() -> std::uint64_t {
        if (limits_.mode == BudgetMode::Wall) return affordable_descent(at_least);
        return units_left() >= at_least ? units_left() : 0;
    }));
}

void StepBudget::settle_descent(const WorkBudget& grant) noexcept {
    units_spent_ += grant.spent();
    if (limits_.mode != BudgetMode::Wall) return;
    const double seconds = seconds_between(operation_start_ns_, clock_->now_ns());
    if (granted_piece_) {
        if (grant.spent() >= kSmallestLesson) learn(piece_s_per_unit_, seconds / static_cast<double>(grant.spent()));
        return;
    }
    descent_lesson_s_ += seconds; // small grants teach together, or a rate that allows no others would stay
    descent_lesson_ += grant.spent();
    if (descent_lesson_ < kSmallestLesson) return;
    learn(descent_s_per_unit_, descent_lesson_s_ / static_cast<double>(descent_lesson_), kFallingDescent, 1.0);
    descent_lesson_s_ = 0.0;
    descent_lesson_ = 0;
}

void StepBudget::learn_per_pair(StepPart part, std::uint64_t pairs, double& rate) noexcept {
    if (pairs < kSmallestLesson) return;
    learn(rate, part_took_s_[static_cast<std::size_t>(part)] / static_cast<double>(pairs));
}

double StepBudget::surfaces_share_s(const SurfaceNeed& need) const noexcept {
    const double left = left_s();
    if (limits_.mode != BudgetMode::Wall || !(left > 0.0)) return 0.0;
    return std::min(static_cast<double>(need.made_ready) * kPieceReserve * surface_s_per_unit_ + static_cast<double>(need.places) * query_s_per_unit_, kSurfacesShare * left);
}

double StepBudget::median_of_last() const noexcept {
    std::array<double, 4> sorted = surface_last_;
    std::sort(sorted.begin(), sorted.end());
    return sorted[2];
}

WorkBudget StepBudget::grant_surfaces(std::uint64_t at_least) {
    operation_start_ns_ = clock_->now_ns();
    granted_piece_ = at_least > kLargestGrant;
    return WorkBudget(tape_.decide(DecisionKind::Surfaces, [&]() -> std::uint64_t {
        if (limits_.mode != BudgetMode::Wall) return units_left() >= at_least ? units_left() : 0;
        double& rate = granted_piece_ ? surface_s_per_unit_ : query_s_per_unit_;
        const std::uint64_t granted = share_of_left(granted_piece_ ? kPieceReserve * rate : rate, at_least, kLargestGrant / 8);
        if (granted == 0 && granted_piece_) // or a long one is never forgotten
            rate = std::max(kForget * rate, std::min(rate, median_of_last()));
        return granted;
    }));
}

void StepBudget::settle_surfaces(const WorkBudget& grant) noexcept {
    units_spent_ += grant.spent();
    if (limits_.mode != BudgetMode::Wall || grant.spent() < kSmallestLesson) return;
    const double measured = seconds_between(operation_start_ns_, clock_->now_ns()) / static_cast<double>(grant.spent());
    if (!granted_piece_) return learn(query_s_per_unit_, measured); // one grant of many: a late one is made up for by the next ones
    learn(surface_s_per_unit_, measured, kFallingDescent, 1.0);
    if (surfaces_measured_ == 0) surface_last_.fill(measured);
    surface_last_[surfaces_measured_++ % surface_last_.size()] = measured;
}

double StepBudget::by_look_ahead(const CostRatio& ratio) const noexcept {
    return look_ahead_s() > 0.0 ? ratio.largest() * look_ahead_s() : std::numeric_limits<double>::infinity();
}

bool StepBudget::response_fits() {
    if (limits_.mode != BudgetMode::Wall) return !grants_nothing();
    return tape_.decide(DecisionKind::Response, [&]() -> std::uint64_t {
        tries_response_ = false;
        if (std::min(forecast(StepPart::Respond).recent_s(), by_look_ahead(response_ratio_)) <= left_s()) return 1;
        if (++carried_steps_ < patience_) return 0;
        carried_steps_ = 0;
        patience_ = std::min(2 * patience_, kMostPatience);
        tries_response_ = true;
        return 1;
    }) != 0;
}

void StepBudget::end_response() noexcept {
    if (tries_response_ && !overrun()) patience_ = kLeastPatience;
}

std::uint64_t StepBudget::grant_places(std::uint64_t wanted) {
    if (limits_.mode != BudgetMode::Wall) return grants_nothing() ? 0 : wanted;
    return tape_.decide(DecisionKind::Places, [&]() -> std::uint64_t {
        const double left = std::max(0.0, left_s() - kMargin * limits_.wall_s);
        return std::min(wanted, static_cast<std::uint64_t>(left / plane_s_per_place_));
    });
}

void StepBudget::learn_places(StepPart part, std::uint64_t count) noexcept {
    if (count >= kFewPlaces) learn(plane_s_per_place_, part_took_s_[static_cast<std::size_t>(part)] / static_cast<double>(count), kFallingDescent, 1.0);
}

WorkBudget StepBudget::grant_rows() {
    rows_s_ = 0.0;
    rows_timed_units_ = 0;
    return WorkBudget(tape_.decide(DecisionKind::Rows, [&]() -> std::uint64_t {
        if (limits_.mode == BudgetMode::Exact) return WorkBudget::kUnlimited;
        if (limits_.mode == BudgetMode::Work) return limits_.work_units / kRowsShare / kUnitsPerRow;
        return static_cast<std::uint64_t>(std::min(limits_.wall_s / kRowsShare / row_s_per_unit_ / static_cast<double>(kUnitsPerRow), 1e15));
    }));
}

void StepBudget::end_rows(std::uint64_t units) noexcept {
    const double seconds = rows_timed_ ? seconds_between(rows_start_ns_, clock_->now_ns()) : static_cast<double>(units) * row_s_per_unit_;
    tell(ProbedPart::Solver, &StepProbe::end);
    if (rows_timed_ && !rows_more_) rows_s_ += seconds, rows_timed_units_ += units;
    if (running_) return;
    charged_ns_ += static_cast<std::int64_t>(1e9 * seconds);
    charged_cpu_ns_ += static_cast<std::int64_t>(1e9 * seconds); // what little of it others took is not worth a second clock
}

void StepBudget::settle_rows(const WorkBudget& grant) noexcept {
    units_spent_ += grant.spent() * kUnitsPerRow;
    if (limits_.mode == BudgetMode::Wall && rows_timed_units_ >= kSmallestLesson) learn(row_s_per_unit_, rows_s_ / static_cast<double>(rows_timed_units_));
}

bool StepBudget::retries() const noexcept { return refusals_ >= kRefusalsUntilRetry; }

double StepBudget::tests_seconds(std::uint64_t candidates) const noexcept {
    return kTestsReserve * static_cast<double>(candidates) * tests_s_per_candidate_;
}

bool StepBudget::exact_fits(const ExactForecast& last) {
    const bool fits = tape_.decide(DecisionKind::Fits, [&]() -> std::uint64_t {
        if (limits_.mode == BudgetMode::Exact) return 1;
        if (limits_.mode == BudgetMode::Work) return units_of(last) <= units_left();
        // What no grant interrupts is known from every step. The forecast of whole stages fades, and so does that of how many candidates
        // the last one had: a stage that is begun for too few of them is given up in time.
        const CostForecast& skin = forecast(StepPart::Skin);
        const double tests = trust_ * tests_seconds(last.candidates);
        if (retries()) {
            const double parts = std::min(CostForecast::recent_of_both_s(steady_, skin), by_look_ahead(steady_ratio_) + skin.recent_s());
            return std::max({exact_.recent_s(), forecast(StepPart::Walls).recent_s(), parts + tests}) <= left_s();
        }
        const double parts = CostForecast::reserve_of_all_s({forecast(StepPart::Walls), forecast(StepPart::Planes), solve_, skin});
        return std::max(exact_.reserve_s(), parts + tests) <= left_s();
    }) != 0;
    if (!fits && !retries()) ++refusals_;
    if (!fits) return false;
    if (!retries()) refusals_ = 0;
    exact_tried_ = true;
    trust_ = 1.0;
    learned_ = false;
    exact_start_ns_ = clock_->now_ns();
    return true;
}

bool StepBudget::round_fits() {
    const bool fits = tape_.decide(DecisionKind::Round, [&]() -> std::uint64_t {
        if (limits_.mode != BudgetMode::Wall) return 1; // work is charged where the tests are granted
        const CostForecast& skin = forecast(StepPart::Skin);
        return (retries() ? CostForecast::recent_of_both_s(solve_, skin) : solve_.reserve_s() + skin.reserve_s()) <= left_s();
    }) != 0;
    if (fits) begin_solve();
    return fits;
}

std::uint64_t StepBudget::affordable_tests(const ExactForecast& forecast) const noexcept {
    const std::uint64_t refit = forecast.triangles * kUnitsPerRefitTriangle;
    if (limits_.mode == BudgetMode::Exact) return WorkBudget::kUnlimited;
    if (limits_.mode == BudgetMode::Work) return units_left() > refit ? (units_left() - refit) / kUnitsPerCandidate : 0;
    const double all = left_s() / (kTestsReserve * tests_s_per_candidate_); // one grant: the clock is not read a second time
    constexpr double kMost = 1e18; // a clock that stood still while tests were timed makes them appear free
    return all > 0.0 ? static_cast<std::uint64_t>(std::min(all, kMost)) : 0;
}

WorkBudget StepBudget::grant_tests(const ExactForecast& forecast) {
    tell(ProbedPart::Tests, &StepProbe::begin);
    operation_start_ns_ = clock_->now_ns();
    return WorkBudget(tape_.decide(DecisionKind::Tests, [&] { return affordable_tests(forecast); }));
}

void StepBudget::settle_tests(const ExactForecast& forecast, const WorkBudget& grant) noexcept {
    tell(ProbedPart::Tests, &StepProbe::end);
    units_spent_ += grant.spent() * kUnitsPerCandidate + forecast.triangles * kUnitsPerRefitTriangle;
    if (limits_.mode != BudgetMode::Wall || grant.spent() < kSmallestLesson) return;
    const double measured = seconds_between(operation_start_ns_, clock_->now_ns()) / static_cast<double>(grant.spent());
    if (tests_cheapest_ > 0.0)
        learn(tests_s_per_candidate_, measured);
    else
        tests_s_per_candidate_ = tests_cheapest_ = measured; // better than any guess
    tests_cheapest_ = std::min(tests_cheapest_, measured);
    learned_ = true;
}

bool StepBudget::choose_cull(double culling_s, bool pays) {
    if (limits_.mode != BudgetMode::Wall) return pays;
    return tape_.decide(DecisionKind::Cull, [&]() -> std::uint64_t { return pays && culling_s <= left_s(); }) != 0;
}

void StepBudget::end_exact(bool finished) noexcept {
    if (limits_.mode != BudgetMode::Wall) return;
    const double spent = seconds_between(exact_start_ns_, clock_->now_ns());
    if (!finished || overrun()) refusals_ = 0;
    if (finished)
        exact_.learn(spent);
    else
        exact_.learn(std::max(kAbandonedCost * spent, exact_.mean_s()));
    // A rate that leaves no time for any test is never measured again: it falls, with each stage that is given up for it.
    if (!finished && !learned_)
        tests_s_per_candidate_ = std::max(std::min(tests_cheapest_, tests_s_per_candidate_), kDoubt * tests_s_per_candidate_);
}

} // namespace trocar::engine
