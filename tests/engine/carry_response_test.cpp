// Instruments under budgets that leave no time for planes of all places and a solve between them, on clocks that the test moves.
#include "step_fixture.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace trocar::engine {
namespace {

/// Every reading is later by as much.
class TickingClock final : public Clock {
public:
    explicit TickingClock(double tick_s) : tick_(static_cast<std::int64_t>(1e9 * tick_s)) {}
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ += tick_; }

private:
    mutable std::int64_t now_ = 0;
    std::int64_t tick_;
};

struct Way {
    Vec3 tip = Vec3::Zero(); // m
    unsigned carried = 0;    // steps
    std::uint64_t places = 0, exits = 0;
    double largest_force = 0.0; // N
    std::uint64_t hash = 0;
};

Way follow(const SceneModel& model, const BudgetLimits& limits, int steps, double tick_s = 1e-6) {
    const TickingClock clock(tick_s);
    Simulator simulator(model, clock, limits);
    Way way;
    for (int k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        if (!report.finite) break;
        way.carried += report.carried_instruments > 0;
        way.places += report.carried_places;
        way.exits += report.lumen_exits;
        way.largest_force = std::max(way.largest_force, report.contact_force_n);
        if (report.carried_instruments == 0) EXPECT_EQ(report.carried_places, 0u);
    }
    way.tip = simulator.state().instruments[0].rod.position.back();
    way.hash = hash_state(simulator.state());
    return way;
}

constexpr BudgetLimits wall(double seconds) { return {BudgetMode::Wall, seconds, 0}; }
constexpr BudgetLimits kExact{BudgetMode::Exact, 0.0, 0}, kNothing{BudgetMode::Work, 0.0, 0};
constexpr int kSteps = 340;

/// With contact of spheres alone: the exact stage's answer would hide what carrying does.
PreparedScene scene(bool in_tissue, double speed = 35.0) {
    test::BentTube tube{.speed = speed, .effects = R"("coarse_contact", "friction")"};
    if (in_tissue) tube.host_body = test::kOrgan;
    return test::prepare(test::bent_tube_scene(tube));
}

TEST(CarriedResponse, UnderAnyBudgetTheRodStaysInItsLumenAndComesWhereItWould) {
    for (const bool in_tissue : {false, true}) {
        const PreparedScene prepared = scene(in_tissue);
        const Way whole = follow(prepared.model, kExact, kSteps);
        EXPECT_EQ(whole.carried, 0u);
        for (const double budget : {0.0, 20e-6, 60e-6, 200e-6, 1e-3, 1.0}) {
            SCOPED_TRACE(fmt::format("{} ms, {}", 1e3 * budget, in_tissue ? "in tissue" : "in a wall that stands"));
            const Way way = follow(prepared.model, wall(budget), kSteps);
            std::printf("margin: %g ms: tip %.2f mm from the whole answer's, %u steps carried, largest force %.3g N (whole %.3g)\n", 1e3 * budget,
                        1e3 * (way.tip - whole.tip).norm(), way.carried, way.largest_force, whole.largest_force);
            EXPECT_EQ(way.exits, 0u);
            EXPECT_LT((way.tip - whole.tip).norm(), 2e-3) << "m";
            EXPECT_LT(way.largest_force, 5.0 * whole.largest_force + 0.05) << "N";
            if (budget == 0.0) EXPECT_GT(way.carried, kSteps * 3 / 4u);
            if (budget < 1.0) continue;
            EXPECT_EQ(way.carried, 0u);
            EXPECT_EQ(way.hash, whole.hash);
        }
    }
}

TEST(CarriedResponse, NothingGrantedIsTheSameBitsEveryTimeAndHalfOfThePlaces) {
    const PreparedScene prepared = scene(true);
    const Way once = follow(prepared.model, kNothing, 120), again = follow(prepared.model, kNothing, 120, 50e-6);
    EXPECT_EQ(once.hash, again.hash);
    EXPECT_GT(once.carried, 100u);
    EXPECT_GT(once.places, 0u);
    const Way some = follow(prepared.model, {BudgetMode::Work, 0.0, 1}, 120);
    EXPECT_EQ(some.carried, 0u);
}

TEST(CarriedResponse, AtAnySpeedOfTheDriveNothingLeavesItsLumen) {
    for (const double speed : {5.0, 35.0, 150.0, 3500.0}) {
        SCOPED_TRACE(speed);
        const PreparedScene prepared = scene(false, speed);
        const Way way = follow(prepared.model, kNothing, std::min(kSteps, static_cast<int>(1.2e4 / speed) + 20));
        EXPECT_EQ(way.exits, 0u);
        EXPECT_EQ(way.carried > 0, speed < 100.0);
    }
}

/// Vertices of the skin, one in so many of all in all steps, may be out by the hair that planes of the step before last leave.
constexpr double kMostOut = 1e-5;

TEST(CarriedResponse, WiresOfAnyStiffnessAndWidthStayInTheirLumenUnderAnyBudget) {
    std::mt19937 random(29);
    std::uniform_real_distribution<double> modulus(std::log(5e3), std::log(2e6)), radius(0.3, 0.7), speed(5.0, 45.0), budget(0.0, 150e-6);
    for (int round = 0; round < 12; ++round) {
        std::string text = test::bent_tube_scene({.speed = speed(random), .effects = R"("coarse_contact", "friction")", .host_body = round % 2 == 0 ? std::string() : test::kOrgan});
        const auto put = [&](const std::string& old, const std::string& now) {
            const std::size_t at = text.find(old);
            ASSERT_NE(at, std::string::npos) << old;
            text.replace(at, old.size(), now);
        };
        put("\"radius\": 0.5, \"young_modulus\": 60000", fmt::format("\"radius\": {:.3f}, \"young_modulus\": {:.0f}", radius(random), std::exp(modulus(random))));
        const PreparedScene prepared = test::prepare(text);
        const double seconds = budget(random);
        SCOPED_TRACE(fmt::format("round {}, {} s", round, seconds));
        for (const BudgetLimits& limits : {kNothing, wall(seconds)}) {
            const Way way = follow(prepared.model, limits, kSteps);
            const double tests = static_cast<double>(kSteps) * static_cast<double>(prepared.model.instruments[0].skin.vertex_node.size());
            EXPECT_LE(static_cast<double>(way.exits), kMostOut * tests);
        }
    }
}

TEST(CarriedResponse, ARunGoesOnFromWhatItSaved) {
    const PreparedScene prepared = scene(true);
    const TickingClock clock(1e-6);
    Simulator one(prepared.model, clock, kNothing), other(prepared.model, clock, kNothing);
    for (int k = 0; k < 151; ++k) (void)one.step();
    ASSERT_TRUE(other.restore(one.state()).ok());
    for (int k = 0; k < 20; ++k) (void)one.step(), (void)other.step();
    EXPECT_EQ(hash_state(one.state()), hash_state(other.state()));
}

} // namespace
} // namespace trocar::engine
