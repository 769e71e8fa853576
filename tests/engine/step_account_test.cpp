// The account of a step: what each part was granted and took, and that nothing is missing in it.
#include "step_fixture.hpp"

namespace trocar::engine {
namespace {

/// Every reading takes a microsecond: times are counts of readings, the same on every machine.
class CountingClock final : public Clock {
public:
    [[nodiscard]] std::int64_t now_ns() const noexcept override { return now_ += 1000; }

private:
    mutable std::int64_t now_ = 0;
};

std::string ball_on_table(const char* scope) {
    return fmt::format(R"({{"name": "ball", "units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.005, "duration": 1}},
        "gravity": [0, 0, -9810], "budget": {{"limit": "exact", "scope": "{}"}},
        "bodies": {{
            "ball": {{"kind": "deformable", "surface": {{"shape": "sphere", "centre": [0, 0, 31], "radius": 30, "subdivisions": 3}},
                      "material": {{"young_modulus": 20, "poisson_ratio": 0.4, "density": 1000}},
                      "coarse": {{"mesher": "lattice", "surface_triangles": 200}}}},
            "table": {{"kind": "static", "surface": {{"shape": "box", "centre": [0, 0, -5], "extent": [120, 120, 10], "cells": 8}}}}}},
        "effects": ["elasticity", "gravity", "damping", "coarse_contact"]}})",
                       scope);
}

const AccountEntry& part_of(const StepReport& report, AccountPart part) { return report.account[static_cast<std::size_t>(part)]; }

TEST(Account, PartsOfAStepSumToWhatItWasChargedInTimeAndInUnits) {
    const std::string scenes[] = {ball_on_table("collision"), test::bent_tube_scene({.host_body = test::kOrgan})};
    for (const std::string& scene : scenes) {
        const PreparedScene prepared = test::prepare(scene);
        for (const BudgetLimits& limits : {BudgetLimits{}, BudgetLimits{BudgetMode::Work, 0.0, 0}, BudgetLimits{BudgetMode::Work, 0.0, 20'000},
                                           BudgetLimits{BudgetMode::Wall, 50e-6, 0}, BudgetLimits{BudgetMode::Wall, 5e-3, 0}}) {
            CountingClock clock;
            Simulator simulator(prepared.model, clock, limits);
            std::uint64_t everything = 0;
            for (int k = 0; k < 60; ++k) {
                const StepReport& report = simulator.step();
                ASSERT_TRUE(report.finite);
                double used = 0.0;
                std::uint64_t units = 0;
                for (const AccountEntry& entry : report.account) {
                    EXPECT_GE(entry.used_ms, 0.0);
                    EXPECT_EQ(entry.granted_ms < 0.0, limits.mode != BudgetMode::Wall);
                    used += entry.used_ms;
                    units += entry.units;
                }
                EXPECT_NEAR(used, report.ms.budget, 20e-3) << "ms: what lies between the parts, a few readings";
                EXPECT_EQ(units, report.work_units);
                if (limits.mode == BudgetMode::Work) EXPECT_LE(units, limits.work_units) << "what nothing leaves out is not counted in units";
                const bool solids = prepared.model.instruments.empty();
                everything += part_of(report, solids ? AccountPart::Surfaces : AccountPart::Exact).units;
            }
            if (limits.mode == BudgetMode::Exact) EXPECT_GT(everything, 0u) << "what is looked at is on it";
        }
    }
}

TEST(Account, UnderABudgetOfNothingTakesTheFloorAloneAndSaysSo) {
    const PreparedScene prepared = test::prepare(ball_on_table("collision"));
    CountingClock clock;
    Simulator simulator(prepared.model, clock, BudgetLimits{BudgetMode::Wall, 1e-6, 0});
    bool said = false;
    for (int k = 0; k < 40; ++k) {
        const StepReport& report = simulator.step();
        ASSERT_TRUE(report.finite);
        EXPECT_EQ(part_of(report, AccountPart::Descent).units, 0u);
        EXPECT_EQ(part_of(report, AccountPart::Surfaces).units, 0u);
        EXPECT_FALSE(report.budget_kept);
        said = said || report.below_floor;
        EXPECT_LT(report.ms.budget, 0.2) << "ms: bounded, whatever the surfaces' size";
    }
    EXPECT_TRUE(said);
}

} // namespace
} // namespace trocar::engine
