// A wire in a bent tube: it stays inside at every budget and speed, and says what it could not test.
#include "engine/step/make_scratch.hpp"
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

using test::BentTube;
using test::Tally;

struct Case {
    std::string name;
    BentTube tube;
    double least_insertion = 0.1; // m; less means that the wire got stuck
};
void PrintTo(const Case& tested, std::ostream* os) { *os << tested.name; }

class WireInABentTube : public ::testing::TestWithParam<Case> {};

TEST_P(WireInABentTube, NeverLeavesIt) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene(GetParam().tube));
    ASSERT_EQ(prepared.model.instruments.size(), 1u);
    Simulator simulator(prepared.model);
    const std::uint64_t steps = prepared.model.step_count + 50;
    const Tally tally = test::run_steps(simulator, steps);
    EXPECT_EQ(tally.steps, steps) << tally;
    EXPECT_EQ(tally.lumen_exits, 0u) << tally;
    EXPECT_TRUE(test::all_finite(simulator.state()));
    EXPECT_GT(tally.largest_force, 0.0) << "the bend was never felt: " << tally;
    EXPECT_GT(tally.insertion, GetParam().least_insertion) << tally;
}

constexpr const char* kCoarse = R"("coarse_contact")";
constexpr const char* kExact = R"("exact_contact")";
constexpr const char* kBoth = R"("coarse_contact", "exact_contact", "friction")";

INSTANTIATE_TEST_SUITE_P(
    , WireInABentTube,
    ::testing::Values(
        Case{"Exact", {35, "exact", kBoth, ""}}, Case{"ExactAlone", {35, "exact", kExact, ""}},
        Case{"CoarseOnly", {35, "exact", kCoarse, ""}}, Case{"WorkOf500", {35, "work:500", kBoth, ""}},
        Case{"WorkOf20000", {35, "work:20000", kBoth, ""}}, Case{"ExactAtAHundredTimesTheSpeed", {3500, "exact", kBoth, ""}, 0.05},
        Case{"WorkOf500AtAHundredTimesTheSpeed", {3500, "work:500", kBoth, ""}, 0.05},
        Case{"ExactInAnOrgan", {35, "exact", R"("elasticity", "damping", "coarse_contact", "exact_contact")", test::kOrgan}, 0.06},
        Case{"WorkOf500InAnOrgan", {35, "work:500", R"("elasticity", "damping", "coarse_contact", "exact_contact")", test::kOrgan}, 0.06}),
    [](const ::testing::TestParamInfo<Case>& tested) { return tested.param.name; });

/// A straight tube of 3 mm, closed at 100 mm, that `tube` may move, and a wire that `path` drives.
std::string straight_tube_scene(const std::string& tube, const std::string& path, const std::string& budget) {
    return fmt::format(R"({{
    "name": "straight-tube",
    "units": {{"length": "mm", "pressure": "kPa"}},
    "time": {{"step": 0.01, "duration": 6}},
    "budget": "{}",
    "bodies": {{"tube": {{{}, "hollow": true,
                         "surface": {{"shape": "tube", "axis": [[0, 0, 0, 3], [0, 0, 50, 3], [0, 0, 100, 3]], "sides": 20}}}}}},
    "instruments": {{"wire": {{"length": 220, "radius": 0.5, "young_modulus": 60000, "segment": 2.5, "skin_triangles": 1500,
        "tip": {{"shape": "J", "length": 12, "angle": 0.8}}, "lumen": "tube",
        "entry": {{"position": [0, 0, 10], "direction": [0, 0, 1]}}, "path": {}}}}},
    "effects": ["coarse_contact", "exact_contact"]
}})",
                       budget, tube, path);
}

TEST(Wire, AWallThatSweepsPastItInOneStepTakesItAlong) {
    // To and fro by 2.2 mm within a step: far more than the wire's thickness, so that its axis ends up behind the wall's old side.
    const std::string motion = R"("kind": "kinematic", "motion": [[0, 0, 0, 0], [1, 0, 0, 0], [1.01, 2.2, 0, 0], [1.5, 2.2, 0, 0],
        [1.51, -2.2, 0, 0], [1.8, -2.2, 0, 0], [1.81, 0, 2.2, 0], [2.2, 0, 2.2, 0], [2.21, 0, 0, 0]])";
    for (const char* budget : {"exact", "work:500"}) {
        const PreparedScene prepared = test::prepare(straight_tube_scene(motion, "[[0, 40, 0], [1, 70, 0], [4, 70, 0]]", budget));
        Simulator simulator(prepared.model);
        const Tally tally = test::run_steps(simulator, 300);
        EXPECT_EQ(tally.lumen_exits, 0u) << budget << ": " << tally;
        EXPECT_EQ(tally.scaled_step_count, 0u) << budget << ": " << tally;
        EXPECT_EQ(tally.steps, 300u) << budget << ": " << tally;
    }
}

TEST(Wire, AfterADeadEndItComesOutAgain) {
    const PreparedScene prepared =
        test::prepare(straight_tube_scene(R"("kind": "static")", "[[0, 60, 0], [3, 150, 0], [6, 60, 0]]", "exact"));
    Simulator simulator(prepared.model);
    const Tally pushed = test::run_steps(simulator, 300);
    EXPECT_EQ(pushed.lumen_exits, 0u) << pushed;
    EXPECT_GT(pushed.largest_force, 0.0) << pushed;
    const Tally drawn = test::run_steps(simulator, 300);
    EXPECT_EQ(drawn.lumen_exits, 0u) << drawn;
    EXPECT_LT(drawn.insertion, 0.065) << drawn;
}

TEST(Wire, RunsUnderAWorkBudgetGiveTheSameBitsTwice) {
    const PreparedScene prepared = test::prepare(
        test::bent_tube_scene({35, "work:3000", R"("elasticity", "damping", "coarse_contact", "exact_contact")", test::kOrgan}));
    std::uint64_t first = 0;
    for (int run = 0; run < 2; ++run) {
        Simulator simulator(prepared.model);
        const std::uint64_t start = hash_state(simulator.state());
        EXPECT_EQ(test::run_steps(simulator, 150).steps, 150u);
        const std::uint64_t hash = hash_state(simulator.state());
        EXPECT_NE(hash, start);
        if (run == 0) first = hash;
        EXPECT_EQ(hash, first);
    }
    const PreparedScene again = test::prepare(
        test::bent_tube_scene({35, "work:3000", R"("elasticity", "damping", "coarse_contact", "exact_contact")", test::kOrgan}));
    Simulator simulator(again.model);
    (void)test::run_steps(simulator, 150);
    EXPECT_EQ(hash_state(simulator.state()), first) << "preparation gives the same model twice";
}

TEST(Wire, TheHashSeesOneBitOfOnePosition) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene());
    State state = make_initial_state(prepared.model);
    const std::uint64_t hash = hash_state(state);
    double& x = state.instruments[0].rod.position[7].x();
    x = std::nextafter(x, 1.0);
    EXPECT_NE(hash_state(state), hash);
}

TEST(Wire, ABudgetOfNothingAssumesEverythingAndSaysSo) {
    for (const char* budget : {"work:0", "0ms", "work:1", "1us"}) {
        const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, budget, kBoth, ""}));
        Simulator simulator(prepared.model);
        const Tally tally = test::run_steps(simulator, 250);
        EXPECT_EQ(tally.steps, 250u) << budget << ": " << tally.last.failure;
        EXPECT_TRUE(test::all_finite(simulator.state())) << budget;
        EXPECT_EQ(tally.exact_steps, tally.forced_exact) << budget << ": only to keep the wire inside";
        EXPECT_LE(tally.forced_exact, 5u) << budget;
        EXPECT_GE(tally.open, 250u) << budget << ": every step leaves pairs open";
        EXPECT_GT(tally.assumed, 0u) << budget;
        EXPECT_GT(tally.unproven, 0u) << budget;
    }
}

TEST(Wire, MoreWorkLeavesFewerLinksUnproven) {
    std::uint64_t last_unproven = std::numeric_limits<std::uint64_t>::max();
    for (const char* budget : {"work:0", "work:10", "exact"}) {
        const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, budget, kCoarse, ""}));
        Simulator simulator(prepared.model);
        const Tally tally = test::run_steps(simulator, 50);
        EXPECT_LE(tally.unproven, last_unproven) << budget;
        last_unproven = tally.unproven;
        if (std::string(budget) == "exact") {
            EXPECT_EQ(tally.open, 0u);
        }
    }
}

TEST(Wire, AWorkBudgetIsNeverOverspent) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "work:500", kBoth, ""}));
    Simulator simulator(prepared.model);
    for (int k = 0; k < 200; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_LE(report.work_units, 500u) << "step " << report.step;
        ASSERT_LE(report.pairs_tested, 500u) << "step " << report.step;
    }
}

/// Every reading passes some time.
class TickingClock final : public Clock {
public:
    explicit TickingClock(std::int64_t tick_ns) : tick_ns_(tick_ns) {}
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ += tick_ns_; }

private:
    std::int64_t tick_ns_;
    mutable std::int64_t now_ = 0;
};

TEST(Wire, ADeadlineOnASlowMachineIsReportedAsMissed) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "1ms", kBoth, ""}));
    const TickingClock slow(2'000'000), quick(10);
    Simulator late(prepared.model, slow), early(prepared.model, quick);
    const Tally missed = test::run_steps(late, 20);
    EXPECT_FALSE(missed.last.budget_kept);
    EXPECT_EQ(missed.exact_steps, 0u);
    EXPECT_GT(missed.open, 0u);
    const Tally kept = test::run_steps(early, 20);
    EXPECT_TRUE(kept.last.budget_kept);
    EXPECT_GE(kept.exact_steps, 19u) << "the first forecast is a guess";
}

TEST(Wire, InsertionFollowsThePathWithinTheLimitsOfTheDrive) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene());
    Simulator simulator(prepared.model);
    double last = 0.02;
    for (int k = 0; k < 100; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_LE(report.insertion_m - last, 0.035 * 0.01 + 1e-12);
        last = report.insertion_m;
    }
    EXPECT_NEAR(last, 0.02 + 0.035, 1e-3) << "free on the straight part";
}

TEST(Effects, LeftOutExactContactBuildsNoSkinTreeAndTestsNothing) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "exact", kCoarse, ""}));
    Simulator simulator(prepared.model);
    const Tally tally = test::run_steps(simulator, 100);
    EXPECT_EQ(tally.exact_steps, 0u);
    EXPECT_EQ(tally.candidates, 0u);
    EXPECT_TRUE(ScratchView::of(simulator).rods.instruments[0].tree.empty());
    EXPECT_GT(tally.pairs_tested, 0u);
}

TEST(Effects, LeftOutCoarseContactTestsNoSpheres) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "exact", kExact, ""}));
    Simulator simulator(prepared.model);
    const Tally tally = test::run_steps(simulator, 100);
    EXPECT_EQ(tally.pairs_tested, 0u);
    EXPECT_EQ(tally.open, 0u);
    EXPECT_EQ(tally.exact_steps, 100u);
}

TEST(Effects, WithoutAnyContactTheWirePassesThroughAndTheIndependentCheckSeesIt) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene({35, "exact", "", ""}));
    Simulator simulator(prepared.model);
    const Tally tally = test::run_steps(simulator, prepared.model.step_count);
    EXPECT_GT(tally.lumen_exits, 0u);
    EXPECT_EQ(tally.largest_force, 0.0);
}

/// Rings that wait at the port lie on each other; clusters that were made of them would reach along the whole rod once it is in.
TEST(Wire, EveryClusterOfItsSkinIsAShortPieceOfTheRod) {
    const PreparedScene prepared = test::prepare(test::bent_tube_scene());
    const SceneModel& model = prepared.model;
    State state = make_initial_state(model);
    const StepScratch context = make_scratch(model, state);
    const collision::DopTree& tree = context.rods.instruments[0].tree;
    ASSERT_GT(tree.clusters().size(), 50u);
    for (Index cluster = 0; cluster < tree.clusters().size(); ++cluster) {
        Index first = kNoIndex, last = 0;
        for (const Index v : tree.touched(cluster)) {
            first = std::min(first, model.instruments[0].skin.vertex_node[v]);
            last = std::max(last, model.instruments[0].skin.vertex_node[v]);
        }
        EXPECT_LE(last - first, 4u) << "cluster " << cluster;
    }
}

} // namespace
} // namespace trocar::engine
