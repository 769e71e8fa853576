#include "base/predicates.hpp"

#include "test_meshes.hpp"

using namespace trocar;
using namespace trocar::test;

namespace {

/// Sign of the 3x3 determinant in integers, exact for |coordinates| < 2^38.
int integer_orient3d(const std::array<std::array<__int128, 3>, 4>& p) {
    __int128 m[3][3];
    for (int row = 0; row < 3; ++row)
        for (int axis = 0; axis < 3; ++axis) m[row][axis] = p[row + 1][axis] - p[0][axis];
    const __int128 det = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
                         m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
    return det > 0 ? 1 : det < 0 ? -1 : 0;
}

} // namespace

TEST(Orient3d, IsPositiveOnTheSideTheNormalPointsTo) {
    EXPECT_EQ(orient3d(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.2, 0.2, 1)), 1);
    EXPECT_EQ(orient3d(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0.2, 0.2, -1)), -1);
    EXPECT_EQ(orient3d(Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(5, 7, 0)), 0);
    EXPECT_EQ(orient2d({0, 0}, {1, 0}, {0, 1}), 1);
}

TEST(Orient3d, AgreesWithIntegersOnNearlyCoplanarPoints) {
    Random random{20240607};
    SCOPED_TRACE(random.trace());
    int zeros = 0, disagreements = 0;
    for (int trial = 0; trial < 200000; ++trial) {
        std::array<std::array<__int128, 3>, 4> exact;
        std::array<Vec3, 4> p;
        const long reach = 1L << (3 + trial % 34);
        for (int i = 0; i < 4; ++i)
            for (int axis = 0; axis < 3; ++axis) exact[i][axis] = static_cast<long>(random.uniform() * double(reach));
        const int u = static_cast<int>(random.engine() % 5), v = static_cast<int>(random.engine() % 5);
        for (int axis = 0; axis < 3; ++axis) { // d near the plane of a, b, c, or on it
            const long nudge = static_cast<long>(random.engine() % 3) - 1;
            exact[3][axis] =
                exact[0][axis] + (u * (exact[1][axis] - exact[0][axis]) + v * (exact[2][axis] - exact[0][axis])) / 2 + (trial % 2) * nudge;
        }
        for (int i = 0; i < 4; ++i)
            for (int axis = 0; axis < 3; ++axis) p[i][axis] = static_cast<double>(exact[i][axis]) * 0x1p-20; // exact scaling
        const int expected = integer_orient3d(exact);
        disagreements += orient3d(p[0], p[1], p[2], p[3]) != expected;
        disagreements += orient3d(p[1], p[0], p[2], p[3]) != -expected;
        disagreements += orient3d(p[3], p[2], p[1], p[0]) != expected;
        zeros += expected == 0;
    }
    EXPECT_EQ(disagreements, 0);
    EXPECT_GT(zeros, 1000); // the sample reaches the exact stage
}

TEST(Orient2d, SeesOneUlpBesideALongLine) {
    const double x = 0.5, up = std::nextafter(0.5, 1.0);
    EXPECT_EQ(orient2d({x, x}, {12, 12}, {24, 24}), 0);
    EXPECT_EQ(orient2d({x, up}, {12, 12}, {24, 24}), orient2d({0, 1}, {12, 12}, {24, 24}));
    EXPECT_EQ(orient2d({up, x}, {12, 12}, {24, 24}), orient2d({1, 0}, {12, 12}, {24, 24}));
}

TEST(Collinear, HoldsForScaledAndCoincidentPointsOnly) {
    const Vec3 a(1.25, -2.5, 3.75), d(0.5, 0.25, -0.125);
    EXPECT_TRUE(are_collinear(a, a + d, a + 3 * d));
    EXPECT_TRUE(are_collinear(a, a, d));
    EXPECT_FALSE(are_collinear(a, a + d, a + 3 * d + Vec3(0, 0, 1e-15)));
}
