// Every hard case, one test each: nothing beyond its bound. The figures are printed, so that a margin that shrinks is seen before it
// is gone: `test_hard_cases | grep margin`, or `trocar bench hard-cases` for one table.
#include "bench/hard_cases.hpp"

#include <gtest/gtest.h>

#include <cstdio>
#include <ostream>

namespace trocar::engine {

std::ostream& operator<<(std::ostream& os, const HardCase& hard) { return os << hard.name; } // found by gtest

namespace {

class Hard : public ::testing::TestWithParam<HardCase> {};

TEST_P(Hard, CaseHolds) {
    HardReport report;
    GetParam().run(report);
    for (const HardMargin& m : report.margins()) {
        std::printf("margin: %-84s %10.4g %c %g %s\n", m.what.c_str(), m.measured, m.relation, m.bound, m.unit.c_str());
        EXPECT_TRUE(m.holds()) << m.what << ": " << m.measured << ' ' << m.relation << ' ' << m.bound << ' ' << m.unit;
    }
    for (const std::string& sentence : report.broken()) ADD_FAILURE() << "does not hold: " << sentence;
    for (const std::string& note : report.notes()) std::printf("note: %s\n", note.c_str());
}
INSTANTIATE_TEST_SUITE_P(Cases, Hard, ::testing::ValuesIn(hard_cases()), [](const auto& tested) { return std::string(tested.param.name); });

TEST(HardReport, KnowsWhatHoldsAndThatNaNNeverDoes) {
    HardReport report;
    report.below("a", 1.0, 2.0);
    report.above("b", 1.0, 2.0);
    report.equal("c", 3.0, 3.0);
    report.below("d", std::nan(""), 2.0);
    report.above("e", std::nan(""), 2.0);
    const auto m = report.margins();
    EXPECT_TRUE(m[0].holds() && m[2].holds());
    EXPECT_FALSE(m[1].holds() || m[3].holds() || m[4].holds());
    EXPECT_FALSE(report.require(false, "no"));
    EXPECT_EQ(report.broken().size(), 1u);
}

} // namespace
} // namespace trocar::engine
