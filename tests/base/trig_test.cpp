#include "base/trig.hpp"

#include "test_meshes.hpp"

using namespace trocar;
using namespace trocar::test;

namespace {

/// |value - exact| in units of the exact value's last place, against long double's 64 bits.
double ulps(double value, long double exact) {
    const double rounded = std::abs(static_cast<double>(exact));
    const double ulp = std::nextafter(rounded, std::numeric_limits<double>::infinity()) - rounded;
    return static_cast<double>(std::abs(static_cast<long double>(value) - exact)) / ulp;
}

} // namespace

TEST(SinCos, StaysWithinTwoUlpUpToTenThousandRadians) {
    Random random{41};
    SCOPED_TRACE(random.trace());
    double worst = 0.0;
    for (int trial = 0; trial < 300000; ++trial) {
        const double reach = std::pow(10.0, random.uniform(-8.0, 4.0));
        const double x = random.uniform() * reach;
        const SinCos sc = sin_cos(x);
        worst = std::max({worst, ulps(sc.sin, sinl(x)), ulps(sc.cos, cosl(x))});
    }
    EXPECT_LT(worst, 2.0);
    RecordProperty("worst_ulp", std::to_string(worst));
}

TEST(SinCos, KeepsItsDigitsNearMultiplesOfHalfPi) {
    double worst = 0.0;
    for (int n = -6000; n <= 6000; ++n)
        for (const double nudge : {0.0, 1e-12, -1e-9, 1e-5}) {
            const double x = n * 1.5707963267948966 + nudge;
            worst = std::max({worst, ulps(sin_cos(x).sin, sinl(x)), ulps(sin_cos(x).cos, cosl(x))});
        }
    EXPECT_LT(worst, 2.0);
}

TEST(SinCos, HasTheExactValuesAndSymmetries) {
    EXPECT_EQ(sin_cos(0.0).sin, 0.0);
    EXPECT_EQ(sin_cos(0.0).cos, 1.0);
    for (const double x : {0.1, 0.7, 2.0, 3.9, 55.5, 9876.5}) {
        EXPECT_EQ(sin_cos(-x).sin, -sin_cos(x).sin);
        EXPECT_EQ(sin_cos(-x).cos, sin_cos(x).cos);
    }
    EXPECT_TRUE(std::isnan(sin_cos(std::numeric_limits<double>::infinity()).sin));
    EXPECT_TRUE(std::isnan(sin_cos(std::nan("")).cos));
    EXPECT_TRUE(std::isnan(sin_cos(1e300).cos));
}

TEST(RotationAbout, TurnsRightHandedAndKeepsLengths) {
    const Mat3 quarter = rotation_about(Vec3::UnitZ(), 0.5 * M_PI);
    EXPECT_NEAR((quarter * Vec3::UnitX() - Vec3::UnitY()).norm(), 0.0, 1e-15);
    const Mat3 any = rotation_about(Vec3(1, 2, -2) / 3.0, 1.234);
    EXPECT_NEAR((any * any.transpose() - Mat3::Identity()).norm(), 0.0, 1e-15);
    EXPECT_NEAR((any * Vec3(1, 2, -2) - Vec3(1, 2, -2)).norm(), 0.0, 1e-15);
}
