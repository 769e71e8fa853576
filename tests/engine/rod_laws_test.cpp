// Laws of a rod in contact, as `trocar bench laws --quick` measures them: over random rods and steps of 0.2 to 10 ms.
#include "bench/law_row.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace trocar::engine {
namespace {

TEST(RodLaws, HoldForRandomRodsAtEveryStepLength) {
    for (const LawRow& row : measure_rod_laws(true)) {
        std::printf("law: %s: %s (%s): %.4g, reference %.4g, bound %.2g\n", row.law.c_str(), row.quantity.c_str(), row.setting.c_str(), row.measured,
                    row.reference, row.bound);
        EXPECT_LE(std::abs(row.measured - row.reference), row.bound) << row.law << ": " << row.quantity << ", " << row.setting;
    }
}

} // namespace
} // namespace trocar::engine
