// Instruments under budgets that leave no time for planes of all places and a solve between them, on clocks that the test moves.
#include "step_fixture.hpp"

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
    double insertion = 0.0;    // m
    unsigned carried = 0;      // steps
    unsigned waited = 0;       // steps in which the drive was held
    std::uint64_t exits = 0;
    double largest_force = 0.0; // N
    std::uint64_t hash = 0;
};

Way follow(const SceneModel& model, const BudgetLimits& limits, double tick_s, int steps) {
    const TickingClock clock(tick_s);
    Simulator simulator(model, clock, limits);
    Way way;
    for (int k = 0; k < steps; ++k) {
        const StepReport& report = simulator.step();
        EXPECT_TRUE(report.finite) << report.failure;
        if (!report.finite) break;
        way.carried += report.carried_instruments > 0;
        way.waited += report.drive_limited > 0;
        way.exits += report.lumen_exits;
        way.largest_force = std::max(way.largest_force, report.contact_force_n);
        if (report.carried_instruments == 0) EXPECT_EQ(report.carried_places, 0u);
    }
    way.insertion = simulator.state().instruments[0].rod.insertion;
    way.hash = hash_state(simulator.state());
    return way;
}

constexpr BudgetLimits wall(double seconds) { return {BudgetMode::Wall, seconds, 0}; }
constexpr BudgetLimits kExact{BudgetMode::Exact, 0.0, 0};

/// With contact of spheres alone: the exact stage's answer would hide what carrying does.
PreparedScene scene(bool in_tissue) {
    BentTube tube{.effects = R"("coarse_contact", "friction")"};
    if (in_tissue) tube.host_body = test::kOrgan;
    return test::prepare(test::bent_tube_scene(tube));
}

TEST(CarriedResponse, UnderAnyBudgetTheRodStaysInItsLumenAndTheDriveGoesFartherTheMoreTimeThereIs) {
    for (const bool in_tissue : {false, true}) {
        const PreparedScene prepared = scene(in_tissue);
        const Way whole = follow(prepared.model, kExact, 1e-6, 340);
        EXPECT_EQ(whole.carried, 0u);
        double before = 0.0;
        for (const double budget : {0.0, 20e-6, 60e-6, 200e-6, 1e-3, 1.0}) {
            SCOPED_TRACE(fmt::format("{} ms, {}", 1e3 * budget, in_tissue ? "in tissue" : "in a wall that stands"));
            const Way way = follow(prepared.model, wall(budget), 1e-6, 340);
            std::printf("%g ms: %.1f mm, %u carried, %u waited, %lu exits, %.3g N (whole: %.3g N)\n", 1e3 * budget, 1e3 * way.insertion, way.carried, way.waited, (unsigned long)way.exits, way.largest_force, whole.largest_force);
            EXPECT_EQ(way.exits, 0u);
            EXPECT_GE(way.insertion, before - 2e-3) << "m; more time, and it came less far";
            EXPECT_LT(way.largest_force, 5.0 * whole.largest_force + 0.05) << "N";
            before = std::max(before, way.insertion);
            if (budget == 0.0) EXPECT_GT(way.waited, 0u);
            if (budget < 1.0) continue;
            EXPECT_EQ(way.carried, 0u);
            EXPECT_EQ(way.insertion, whole.insertion);
        }
    }
}

} // namespace
} // namespace trocar::engine
