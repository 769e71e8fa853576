// Laws of contact as `trocar bench laws --quick` measures them: over random rods and steps of 0.2 to 10 ms, and between solids.
#include "bench/law_row.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trocar::engine {
namespace {

void expect_to_hold(const std::vector<LawRow>& rows) {
    for (const LawRow& row : rows) {
        std::printf("law: %s: %s (%s): %.4g, reference %.4g, bound %.2g\n", row.law.c_str(), row.quantity.c_str(), row.setting.c_str(), row.measured,
                    row.reference, row.bound);
        EXPECT_LE(std::abs(row.measured - row.reference), row.bound) << row.law << ": " << row.quantity << ", " << row.setting;
    }
}

TEST(RodLaws, HoldForRandomRodsAtEveryStepLength) { expect_to_hold(measure_rod_laws(true)); }

TEST(SolidLaws, HoldAsTheBenchMeasuresThem) { expect_to_hold(measure_solid_laws(true)); }

TEST(RodInTissue, HoldsAsTheBenchMeasuresIt) { expect_to_hold(measure_wall_laws(true)); }

} // namespace
} // namespace trocar::engine
