#include "base/inside.hpp"
#include "shapes.hpp"
#include "spheretree/lumen/build_lumen.hpp"
#include "spheretree/lumen/lumen_path.hpp"
#include "spheretree/lumen/lumen_state.hpp"
#include "spheretree/lumen/union_room.hpp"
#include "tests/made/surfaces.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <cmath>

namespace trocar::spheretree {
namespace {

using test::make_icosphere;
using test::make_straight_tube;
using test::make_tube;
using test::Random;

/// A vessel that winds and narrows from 6 to 2 mm.
TriMesh winding_vessel() {
    return make_tube({[](double t) { return Vec3(0.02 * std::sin(5 * t), 0.015 * std::cos(4 * t), 0.2 * t); },
                      [](double t) { return 6e-3 * std::pow(1.0 / 3.0, t); }, 32, 120});
}

void expect_inscribed_spheres(const LumenTree& lumen, const TriMesh& wall) {
    const InsideTest inside(wall);
    for (Index b = 0; b < lumen.ball_count(); ++b) {
        const Sphere& ball = lumen.ball(b);
        ASSERT_TRUE(inside.inside(ball.centre)) << "ball " << b;
        ASSERT_GE(inside.tree().closest(ball.centre)->distance, ball.radius) << "ball " << b;
    }
}

TEST(LumenTree, BallsAreFreeConnectedAndReachTheWall) {
    LumenReport report;
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall, {}, &report);
    ASSERT_TRUE(lumen) << lumen.error().to_string();
    expect_inscribed_spheres(*lumen, wall);
    EXPECT_EQ(report.components, 1U);
    EXPECT_LT(report.mean_relative_error, 0.03);
    EXPECT_LT(report.balls, 700U) << "a wall of 8000 triangles needs few balls";
    // Where the vessel is round, the wall lies within the promised error of the union: rings away from the caps.
    for (Index ring = 6; ring < 114; ++ring)
        for (Index k = 0; k < 32; ++k) {
            const double radius = 6e-3 * std::pow(1.0 / 3.0, ring / 120.0);
            ASSERT_GT(free_radius_at(*lumen, wall.vertices[ring * 32 + k]), -0.08 * radius) << "ring " << ring;
        }
}

TEST(LumenTree, InnerSpheresBoundTheBallsBeneath) {
    const auto lumen = build_lumen_tree(winding_vessel());
    ASSERT_TRUE(lumen);
    const SphereTree& tree = lumen->tree;
    for (Index s = 0; s < tree.sphere_count(); ++s)
        for (Index b = tree.item_begin[s]; b < tree.item_end[s]; ++b) {
            EXPECT_LE((lumen->ball(b).centre - tree.spheres[s].centre).norm() + lumen->ball(b).radius,
                      tree.spheres[s].radius * (1 + 1e-12));
            EXPECT_LE(lumen->ball(b).radius, lumen->largest_ball[s]);
        }
}

TEST(LumenTree, OfASphereIsHardlyMoreThanOneBall) {
    LumenReport report;
    const auto lumen = build_lumen_tree(make_icosphere({0.1, 0.2, 0.3}, 0.01, 3), {}, &report);
    ASSERT_TRUE(lumen);
    EXPECT_LE(report.balls, 8U);
    EXPECT_NEAR(lumen->largest_ball[0], 0.01, 4e-4);
}

TEST(LumenTree, OfMadeVesselsThatBranchIsFreeAndOnePiece) {
    for (const std::uint64_t seed : {1u, 2u}) {
        const TriMesh wall = made::make_artery_tree(seed, 4000);
        LumenReport report;
        const auto lumen = build_lumen_tree(wall, {}, &report);
        ASSERT_TRUE(lumen) << lumen.error().to_string();
        expect_inscribed_spheres(*lumen, wall);
        EXPECT_EQ(report.components, 1U) << "seed " << seed;
    }
}

TEST(LumenTree, OfPatientsVesselsIsFree) {
    const auto wall = test::read_test_obj("vessels/steve_vessel_architecture_3.6k.obj", 1e-3);
    if (!wall) GTEST_SKIP() << "TROCAR_TEST_DATA does not name a folder with the test data";
    LumenReport report;
    const auto lumen = build_lumen_tree(*wall, {}, &report);
    ASSERT_TRUE(lumen) << lumen.error().to_string();
    expect_inscribed_spheres(*lumen, *wall);
    EXPECT_LT(report.components, 10U);
}

TEST(LumenTree, SameMeshGivesTheSameTree) {
    const auto one = build_lumen_tree(winding_vessel()), two = build_lumen_tree(winding_vessel());
    ASSERT_TRUE(one && two);
    ASSERT_EQ(one->tree.sphere_count(), two->tree.sphere_count());
    for (Index s = 0; s < one->tree.sphere_count(); ++s) {
        EXPECT_EQ(one->tree.spheres[s].centre, two->tree.spheres[s].centre);
        EXPECT_EQ(one->tree.spheres[s].radius, two->tree.spheres[s].radius);
    }
}

TEST(LumenTree, RefusesOpenInwardAndEmptySurfaces) {
    TriMesh open = make_straight_tube(3e-3, 0.05);
    TriMesh inward = open;
    open.triangles.pop_back();
    for (Triangle& t : inward.triangles) std::swap(t[0], t[1]);
    for (const TriMesh& bad : {open, inward, TriMesh{}}) {
        const auto lumen = build_lumen_tree(bad);
        ASSERT_FALSE(lumen);
        EXPECT_EQ(lumen.error().code, ErrorCode::BadMesh);
    }
    EXPECT_FALSE(build_lumen_tree(make_straight_tube(3e-5, 1e-3))) << "narrower than min_radius everywhere";
}

TEST(LumenState, FollowsARigidMotion) {
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    const Mat3 turn = Eigen::AngleAxisd(1.5707963, Vec3(1, 2, 3).normalized()).toRotationMatrix();
    const Vec3 shift(0.1, -0.2, 0.05);
    std::vector<Vec3> moved;
    for (const Vec3& v : wall.vertices) moved.emplace_back(turn * v + shift);
    LumenState state;
    state.update(*lumen, wall.vertices, moved);
    std::size_t exact = 0;
    for (Index b = 0; b < lumen->ball_count(); ++b) {
        const MovingBall& ball = state.ball(*lumen, b);
        const Vec3 expected = turn * lumen->ball(b).centre + shift;
        const double ratio = ball.radius / lumen->ball(b).radius;
        exact += (ball.centre_t1 - expected).norm() < 1e-9 && ratio > 0.99 - 1e-9 && ratio < 1.0 + 1e-9;
    }
    EXPECT_GT(exact, lumen->ball_count() * 95 / 100) << "of " << lumen->ball_count();
}

TEST(LumenState, BallsStayFreeInABentVessel) {
    TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    std::vector<Vec3> bent;
    for (const Vec3& v : wall.vertices) bent.emplace_back(v + Vec3(0.8 * v[2] * v[2], 0, 0.1 * v[2]));
    LumenState state;
    state.update(*lumen, wall.vertices, bent);
    for (Index b = 0; b < lumen->ball_count(); b += 2) (void)state.ball(*lumen, b); // half of them known from the last step
    state.update(*lumen, bent, bent);
    wall.vertices = bent;
    const InsideTest inside(wall);
    double kept = 0.0;
    for (Index b = 0; b < lumen->ball_count(); ++b) {
        const MovingBall& ball = state.ball(*lumen, b);
        if (ball.radius < 0.0) continue;
        ASSERT_TRUE(inside.inside(ball.centre_t1));
        ASSERT_LE(ball.radius_t1, inside.tree().closest(ball.centre_t1)->distance * (1 + 1e-9)) << "ball " << b;
        kept += ball.radius / lumen->ball(b).radius;
    }
    EXPECT_GT(kept / static_cast<double>(lumen->ball_count()), 0.9) << "balls do not waste the lumen";
}

TEST(LumenState, ABallIsFreeAtBothEndsOfAStepInWhichItsWallClosesInOrGivesWay) {
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    TriMesh narrow = wall; // by a tenth of a millimetre all around
    std::vector<Vec3> normal(wall.vertices.size(), Vec3::Zero());
    for (const Triangle& t : wall.triangles)
        for (const Index v : t) normal[v] += (wall.vertices[t[1]] - wall.vertices[t[0]]).cross(wall.vertices[t[2]] - wall.vertices[t[0]]);
    for (std::size_t v = 0; v < normal.size(); ++v) narrow.vertices[v] -= 1e-4 * normal[v].normalized();
    const InsideTest wide_inside(wall), narrow_inside(narrow);
    for (const bool closes : {true, false}) {
        LumenState state;
        if (closes)
            state.update(*lumen, wall.vertices, narrow.vertices);
        else
            state.update(*lumen, narrow.vertices, wall.vertices);
        const InsideTest &at_t0 = closes ? wide_inside : narrow_inside, &at_t1 = closes ? narrow_inside : wide_inside;
        for (Index b = 0; b < lumen->ball_count(); ++b) {
            const MovingBall& ball = state.ball(*lumen, b);
            if (ball.radius < 0.0) continue;
            ASSERT_LE(ball.radius, at_t0.tree().closest(ball.centre_t0)->distance * (1 + 1e-9)) << "ball " << b << ", closes " << closes;
            ASSERT_LE(ball.radius, at_t1.tree().closest(ball.centre_t1)->distance * (1 + 1e-9)) << "ball " << b << ", closes " << closes;
        }
    }
}

TEST(LumenState, BoundsHoldTheMovedBalls) {
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    std::vector<Vec3> t0, t1;
    for (const Vec3& v : wall.vertices) {
        t0.emplace_back(v + Vec3(0.5 * v[2] * v[2], 0, 0));
        t1.emplace_back(v + Vec3(0, 0.02 * v[2], 1.5 * v[0] * v[0]));
    }
    LumenState state;
    state.update(*lumen, t0, t1);
    const std::uint64_t seed = 5;
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Random random(seed);
    for (int i = 0; i < 200; ++i) {
        const Vec3 p = random.in_box(wall.bounds());
        for (Index s = 0; s < lumen->tree.sphere_count(); ++s)
            for (Index b = lumen->tree.item_begin[s]; b < lumen->tree.item_end[s]; b += 7) {
                const MovingBall& ball = state.ball(*lumen, b);
                ASSERT_GE(state.bound_at(s, p) + 1e-12, ball.radius - (ball.centre_t0 - p).norm());
                ASSERT_GE(state.bound_at(s, p) + 1e-12, ball.radius_t1 - (ball.centre_t1 - p).norm());
            }
    }
}

TEST(LumenState, MeasuresOnlyWhatIsAskedForAndNothingOfAWallAtRest) {
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    LumenState state;
    state.update(*lumen, {}, {});
    EXPECT_EQ(state.ball(*lumen, 3).radius, lumen->ball(3).radius);
    EXPECT_EQ(state.balls_updated(), 0U);
    std::vector<double> weight(wall.vertices.size(), 0.0);
    for (std::size_t v = 0; v < weight.size(); ++v) weight[v] = wall.vertices[v][2] > 0.1;
    state.mark_still(*lumen, weight);
    std::vector<Vec3> moved = wall.vertices;
    for (std::size_t v = 0; v < weight.size(); ++v) moved[v][0] += 0.001 * weight[v];
    state.update(*lumen, wall.vertices, moved);
    for (Index b = 0; b < lumen->ball_count(); ++b) {
        const std::size_t before = state.balls_updated();
        (void)state.ball(*lumen, b);
        if (lumen->ball(b).centre[2] < 0.08) {
            EXPECT_EQ(state.balls_updated(), before);
        }
        if (lumen->ball(b).centre[2] > 0.11) {
            EXPECT_EQ(state.balls_updated(), before + 1);
        }
    }
}

/// An update that goes on from the last one finds the same bits as one that takes both ends anew; so does one that was not updated for
/// some steps. Half of the wall never moves.
TEST(LumenState, GoingOnIsTheSameAsBothEndsAnew) {
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    std::vector<double> weight(wall.vertices.size());
    for (std::size_t v = 0; v < weight.size(); ++v) weight[v] = std::max(0.0, wall.vertices[v][2] - 0.06);
    const auto at = [&](int step) {
        std::vector<Vec3> moved = wall.vertices;
        for (std::size_t v = 0; v < moved.size(); ++v) moved[v] += weight[v] * Vec3(0.01 * step, 0.2 * std::sin(step), 0.0);
        return moved;
    };
    LumenState going, anew;
    for (LumenState* state : {&going, &anew}) state->mark_still(*lumen, weight);
    std::size_t moving = 0;
    std::vector<Vec3> from = at(0);
    for (int step = 1; step < 12; ++step) {
        const std::vector<Vec3> to = at(step);
        const bool missed = step == 6 || step == 7; // neither is updated
        if (!missed) {
            going.update(*lumen, from, to, step != 1 && step != 8);
            anew.update(*lumen, from, to);
            for (Index b = step % 3; b < lumen->ball_count(); b += 3) {
                ASSERT_EQ(going.cost_of(*lumen, b), anew.cost_of(*lumen, b)) << "step " << step << ", ball " << b;
                const MovingBall &one = going.ball(*lumen, b), &other = anew.ball(*lumen, b);
                ASSERT_EQ(one.centre_t0, other.centre_t0);
                ASSERT_EQ(one.centre_t1, other.centre_t1);
                ASSERT_EQ(one.radius_t0, other.radius_t0);
                ASSERT_EQ(one.radius, other.radius);
                moving += one.centre_t0 != one.centre_t1;
            }
            const Vec3 p = wall.vertices[static_cast<std::size_t>(37 * step)];
            for (Index s = 0; s < lumen->tree.sphere_count(); ++s) ASSERT_EQ(going.bound_at(s, p), anew.bound_at(s, p)) << s;
        }
        from = to;
    }
    EXPECT_GT(moving, 300u);
}

TEST(UnionClearance, IsFreeSpaceAndSmoothBetweenTwoBalls) {
    const std::uint64_t seed = 21;
    SCOPED_TRACE(::testing::Message() << "seed " << seed);
    Random random(seed);
    const Box3 box{Vec3(-1, -1, -1), Vec3(1, 1, 1)};
    int better = 0;
    for (int i = 0; i < 3000; ++i) {
        const Vec3 centre_a = random.in_box(box), centre_b = random.in_box(box);
        const Sphere a{centre_a, random.uniform(0.3, 1.0)}, b{centre_b, random.uniform(0.3, 1.0)};
        const Vec3 p = random.in_box(box);
        Clearance clearance = clearance_in_ball(p, a);
        if (const Clearance other = clearance_in_ball(p, b); other.radius > clearance.radius) clearance = other;
        const double alone = clearance.radius;
        improve_clearance(p, a, b, clearance);
        EXPECT_GE(clearance.radius, alone);
        if (clearance.radius <= alone) continue;
        ++better;
        for (int k = 0; k < 50; ++k) {
            const Vec3 q = p + clearance.radius * random.in_box(box).normalized();
            EXPECT_TRUE((q - a.centre).norm() <= a.radius * (1 + 1e-9) || (q - b.centre).norm() <= b.radius * (1 + 1e-9));
        }
    }
    EXPECT_GT(better, 20);
}

TEST(LumenPath, RunsAlongTheVesselWithClearance) {
    const TriMesh wall = winding_vessel();
    const auto lumen = build_lumen_tree(wall);
    ASSERT_TRUE(lumen);
    const auto axis = [](double t) { return Vec3(0.02 * std::sin(5 * t), 0.015 * std::cos(4 * t), 0.2 * t); };
    const auto path = find_lumen_path(*lumen, axis(0.02), axis(0.98));
    ASSERT_TRUE(path) << path.error().to_string();
    const InsideTest inside(wall);
    EXPECT_EQ(path->front().centre, axis(0.02));
    EXPECT_EQ(path->back().centre, axis(0.98));
    for (std::size_t i = 0; i < path->size(); ++i) {
        const LumenPathPoint& p = (*path)[i];
        EXPECT_GT(p.radius, 1.5e-3) << "point " << i;
        EXPECT_LE(p.radius, -inside.signed_distance(p.centre) + 1e-9) << "the radius is a lower bound";
        if (i > 0) {
            EXPECT_LT((p.centre - (*path)[i - 1].centre).norm(), 1.5e-3);
        }
    }
}

TEST(LumenPath, SaysWhyThereIsNone) {
    const auto lumen = build_lumen_tree(winding_vessel());
    ASSERT_TRUE(lumen);
    const Vec3 start(0.0, 0.015, 0.01), end(0.02 * std::sin(4.9), 0.015 * std::cos(3.92), 0.196);
    const auto narrow = find_lumen_path(*lumen, start, end, {.min_radius = 4e-3});
    ASSERT_FALSE(narrow);
    EXPECT_NE(narrow.error().message.find("widest one has"), std::string::npos) << narrow.error().message;
    const auto outside = find_lumen_path(*lumen, Vec3(1, 1, 1), end);
    ASSERT_FALSE(outside);
    EXPECT_NE(outside.error().message.find("start lies outside"), std::string::npos) << outside.error().message;
}

} // namespace
} // namespace trocar::spheretree
