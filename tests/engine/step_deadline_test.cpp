// Deadlines that cannot be met, on clocks that the test moves: whole steps, with all their guarantees.
#include "step_fixture.hpp"

#include "engine/step/instrument/instrument_stage.hpp"

#include <numeric>

namespace trocar::engine {
namespace {

/// Every reading takes time, and some of them much more.
class TickingClock final : public Clock {
public:
    explicit TickingClock(double tick_s) : tick_(static_cast<std::int64_t>(1e9 * tick_s)) {}
    [[nodiscard]] std::int64_t now_ns() const noexcept override {
        now_ += tick_ + (++readings_ == leap_at_ ? leap_ : 0);
        return now_;
    }
    /// At the `reading`-th reading from now it leaps by so much.
    void leap(std::uint64_t reading, double seconds) {
        leap_at_ = readings_ + reading;
        leap_ = static_cast<std::int64_t>(1e9 * seconds);
    }
    [[nodiscard]] std::uint64_t readings() const noexcept { return readings_; }

private:
    mutable std::int64_t now_ = 0;
    mutable std::uint64_t readings_ = 0;
    std::int64_t tick_ = 0, leap_ = 0;
    std::uint64_t leap_at_ = 0;
};

constexpr BudgetLimits wall(double seconds) { return {BudgetMode::Wall, seconds, 0}; }

/// 63 blocks, 0.2 mm apart, over a table.
std::string heap() {
    std::string bodies =
        R"("table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -5], "extent": [100, 100, 10], "cells": 8}})";
    for (int k = 0; k < 63; ++k)
        bodies += fmt::format(R"(, "block{0}": {{"kind": "deformable",
            "surface": {{"shape": "box", "centre": [{1}, {2}, {3}], "extent": [8, 8, 8], "cells": 2}},
            "material": {{"young_modulus": 20, "poisson_ratio": 0.3, "density": 1000, "mass_damping": 1}}, "coarse": {{"surface_triangles": 40}}}})",
                              k, 8.2 * (k % 4) - 12.3, 8.2 * (k / 4 % 4) - 12.3, 4.1 + 8.2 * (k / 16));
    return R"({"name": "heap", "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 1},
        "gravity": [0, 0, -9810], "contact": {"solid_friction": 0.3}, "bodies": {)" +
           bodies + R"(}, "effects": ["elasticity", "gravity", "damping", "coarse_contact", "friction"]})";
}

const PreparedScene& prepared_heap() {
    static const PreparedScene heap_of_64 = test::prepare(heap());
    return heap_of_64;
}

TEST(Deadline, Of64BodiesIsKeptToWithinOneGrant) {
    constexpr double kTick = 1e-6;
    for (const double budget : {5e-6, 50e-6, 500e-6}) {
        TickingClock clock(kTick);
        Simulator simulator(prepared_heap().model, clock, wall(budget));
        std::uint64_t tested = 0;
        for (int k = 0; k < 12; ++k) {
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            // solves of what touched before have a few iterations whatever the budget
            const double floor = 1e-3 * report.account[static_cast<std::size_t>(AccountPart::Solve)].used_ms;
            EXPECT_LE(1e-3 * report.ms.budget, std::max(budget, floor) + 32 * kTick) << "every reading takes a microsecond, and a grant at least one";
            if (report.pairs_open > 0) EXPECT_GT(report.assumed, 0u);
            tested += report.pairs_tested;
        }
        EXPECT_TRUE(budget < 500e-6 || tested > 0) << budget << ": what is left open has to be listed within it as well";
    }
}

TEST(Deadline, UnderOneTest64BodiesStayOnTheirTable) {
    Simulator simulator(prepared_heap().model, BudgetLimits{BudgetMode::Work, 0.0, 1});
    double kinetic = 0.0;
    std::uint32_t inverted = 0;
    for (int k = 0; k < 60; ++k) {
        ASSERT_TRUE(simulator.step().finite);
        kinetic = std::max(kinetic, simulator.report().kinetic_j);
        inverted += simulator.report().inverted_tets;
        EXPECT_LE(simulator.report().pairs_tested, 1u);
    }
    EXPECT_LT(kinetic, 2e-3) << "J; all of them together can fall by a millimetre: 3e-4";
    EXPECT_EQ(inverted, 0u);
    std::size_t fallen = 0; // off the table's edge: a corner block of the top layer may be tipped off
    for (std::size_t i = 1; i < simulator.state().bodies.size(); ++i) {
        const std::vector<Vec3>& at = simulator.state().bodies[i].surface;
        bool beside = false;
        for (const Vec3& v : at) beside = beside || std::max(std::abs(v.x()), std::abs(v.y())) > 0.05;
        fallen += beside;
        if (beside) continue;
        for (const Vec3& v : at) ASSERT_GT(v.z(), -1e-3) << simulator.model().bodies[i].name;
    }
    std::printf("64 bodies under one test: %.3g J at most, %zu beside the table\n", kinetic, fallen);
    EXPECT_LE(fallen, 2u);
}

TEST(Deadline, ThatIsShorterThanOneReadingOfTheClockIsMissedAndSaidAndNothingHangs) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.host_body = test::kOrgan}));
    TickingClock clock(1e-3);
    Simulator simulator(prepared.model, clock, wall(0.4e-3));
    for (int k = 0; k < 30; ++k) {
        const std::uint64_t before = clock.readings();
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite);
        EXPECT_FALSE(report.budget_kept);
        EXPECT_EQ(report.lumen_exits, 0u);
        EXPECT_LT(clock.readings() - before, 100u) << "it does not go on asking";
    }
}

TEST(Deadline, OfNothingLeavesEveryPairOpenAndTheWireInside) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.host_body = test::kOrgan}));
    Simulator simulator(prepared.model, wall(0.0));
    for (int k = 0; k < 60; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite);
        EXPECT_EQ(report.pairs_tested, 0u);
        EXPECT_EQ(report.lumen_exits, 0u);
        EXPECT_TRUE(!report.exact_ran || report.exact_forced) << "only where safety requires it, and then it is reported";
    }
}

TEST(Deadline, InWhichTheExactStageNeverFitsIsNeverHeldUpByIt) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({.host_body = test::kOrgan}));
    TickingClock clock(40e-6); // descents get through; a round of the exact stage would need thousands of readings' time
    Simulator simulator(prepared.model, clock, wall(0.6e-3));
    unsigned tried = 0, ran = 0;
    for (int k = 0; k < 100; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite);
        EXPECT_EQ(report.lumen_exits, 0u);
        tried += report.exact_abandoned;
        ran += report.exact_ran && !report.exact_forced;
    }
    EXPECT_TRUE(ran > 0 || tried < 20) << "what did not fit is not begun again in every step: " << tried << " times in 100";
}

/// Two wires, each in a tube of its own, whose walls are soft: one tube has kinks, in which planes alone do not keep the wire inside.
std::string two_tubes(std::string_view budget, bool with_kinked) {
    const std::string kinked = R"("kinked": {"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500, "lumen": "kinks",
                "tip": {"shape": "J", "length": 12, "angle": 0.8}, "entry": {"position": [200, 0, 10], "direction": [0, 0, 1]},
                "path": [[0, 20, 0], [4, 150, 2]]},)";
    return fmt::format(R"({{
        "name": "two-tubes", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 4}}, "budget": "{}",
        "contact": {{"rod_stiffness": 2000}},
        "bodies": {{
            "kinks": {{"kind": "static", "hollow": true,
                "surface": {{"shape": "tube", "axis": [[200, 0, 0, 3], [200, 0, 60, 3], [240, 0, 100, 3], [320, 0, 100, 3]], "sides": 20}}}},
            "tube": {{"kind": "static", "hollow": true, "surface": {{"shape": "tube", "axis": [{}], "sides": 20}}}}}},
        "instruments": {{{}
            "wire": {{"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500, "lumen": "tube",
                "tip": {{"shape": "J", "length": 12, "angle": 0.8}}, "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}},
                "path": [[0, 20, 0], [4, 150, 2]]}}}},
        "effects": ["coarse_contact", "exact_contact", "friction"]}})",
                       budget, test::bent_axis(25.0, 3.0), with_kinked ? kinked : std::string());
}

struct WireInTube {
    unsigned forced = 0, exact = 0, presses = 0;
    std::uint64_t exits = 0, unproven = 0; // of the wire; where only the other one was forced
};
WireInTube run_wire(const char* budget, bool with_kinked) {
    const PreparedScene prepared = test::prepare(two_tubes(budget, with_kinked));
    const std::size_t wire = prepared.model.instruments.size() - 1;
    Simulator simulator(prepared.model);
    WireInTube result;
    for (int k = 0; k < 400; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        result.forced += report.exact_forced;
        result.exact += report.exact_ran;
        result.unproven += report.exact_forced && !report.exact_ran ? report.unproven_links : 0;
        result.exits += count_lumen_exits(prepared.model, wire, simulator.state(), ScratchView::of(simulator).rods);
        for (const fem::RodPlane& plane : simulator.state().instruments[wire].planes) result.presses += plane.force > 0.0;
    }
    return result;
}

TEST(Deadline, AnInstrumentWhoseExactStageIsForcedLeavesTheOthersTheirAnswer) {
    for (const char* budget : {"work:0", "work:1", "work:1000"}) {
        const WireInTube alone = run_wire(budget, false), beside = run_wire(budget, true);
        std::printf("%s: forced in %u steps of 400, exact for both in %u; the other wire presses at %u places, %u alone, vertices outside %llu, %llu alone\n",
                    budget, beside.forced, beside.exact, beside.presses, alone.presses, static_cast<unsigned long long>(beside.exits),
                    static_cast<unsigned long long>(alone.exits));
        EXPECT_GT(beside.forced, 50u) << budget << ": the kinks ask for it";
        EXPECT_LT(beside.exact, beside.forced) << budget << ": one that was not forced was not exact";
        EXPECT_LE(beside.exits, alone.exits + 5) << budget;
        EXPECT_GT(beside.presses, 100u) << budget;
        if (std::string_view(budget) == "work:0") { // where no motion is scaled
            EXPECT_NEAR(beside.presses, alone.presses, 0.3 * alone.presses);
            EXPECT_GT(beside.unproven, 0u) << "what the traversal left of it is said";
        }
    }
}

/// Of two instruments, on a clock that leaps past the deadline wherever in a step: what an exact stage found and did for an answer that is not used is neither
/// told nor left, and a motion that is known to touch is not carried on.
TEST(Deadline, AnExactAnswerThatIsGivenUpLeavesNothing) {
    const PreparedScene prepared = test::prepare(two_tubes("exact", true));
    std::uint64_t given_up = 0, in_vain = 0;
    for (const unsigned seed : {4711u, 4712u, 4713u}) {
        test::Random random(seed);
        TickingClock clock(0.1e-6);
        Simulator simulator(prepared.model, clock, wall(1e-3));
        for (int k = 0; k < 400; ++k) {
            SCOPED_TRACE(fmt::format("seed {}, step {}", seed, k));
            if (k % 3 == 2) clock.leap(static_cast<std::uint64_t>(random.between(1.0, 60.0)), 2e-3);
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite) << report.failure;
            if (report.exact_ran || report.exact_forced) continue;
            EXPECT_EQ(report.exact_contacts, 0u);
            EXPECT_EQ(report.unresolved, 0u);
            EXPECT_EQ(report.corrections, 0u);
            EXPECT_EQ(report.drive_stops, 0u);
            EXPECT_EQ(report.safe_fraction, 1.0);
            const std::vector<InstrumentScratch>& instruments = ScratchView::of(simulator).rods.instruments;
            unsigned met = 0;
            for (std::size_t i = 0; i < instruments.size(); ++i) {
                met += instruments[i].is_met;
                EXPECT_FALSE(simulator.state().instruments[i].drive_stopped) << i;
            }
            EXPECT_LE(report.carried_instruments, instruments.size() - met);
            given_up += report.exact_abandoned;
            in_vain += met > 0;
        }
    }
    std::printf("given up in %llu steps; in %llu with contacts left\n", static_cast<unsigned long long>(given_up), static_cast<unsigned long long>(in_vain));
    EXPECT_GT(given_up, 8u);
    EXPECT_GT(in_vain, 4u);
}

TEST(Deadline, AClockThatLeapsByAnHourInAStepCostsThatStepAlone) {
    bool missed = false;
    for (const std::uint64_t reading : {2u, 6u, 15u}) { // wherever in the step
        TickingClock clock(0.1e-6);
        Simulator simulator(prepared_heap().model, clock, wall(300e-6));
        std::uint64_t before = 0, after = 0;
        for (int k = 0; k < 24; ++k) {
            if (k == 6) clock.leap(reading, 3600.0);
            const StepReport& report = simulator.step();
            ASSERT_TRUE(report.finite);
            if (k == 6)
                missed = missed || !report.budget_kept;
            else
                EXPECT_TRUE(report.budget_kept) << "step " << k << ", reading " << reading;
            if (k == 5) before = report.pairs_tested;
            if (k == 23) after = report.pairs_tested;
        }
        EXPECT_GT(2 * after, before) << "what it learnt in that step is forgotten";
    }
    EXPECT_TRUE(missed) << "some of them fell into what the budget pays for";
}

} // namespace
} // namespace trocar::engine
