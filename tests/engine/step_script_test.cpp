// Drive commands: tables, limits, and steering along a route, on routes and tips made for the test.
#include "engine/prepare/scripted_motion.hpp"
#include "engine/step/instrument/script.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <random>

namespace trocar::engine {
namespace {

constexpr double kDt = 0.01;
constexpr DriveLimits kLimits{0.035, 3.14};
constexpr FollowSettings kSettings{0.025, 0.012, 0.003};

/// 100 mm along z, then 60 mm along `aside`, points 1 mm apart.
Route make_bent_route(const Vec3& aside) {
    std::vector<Vec3> points;
    for (int i = 0; i <= 100; ++i) points.emplace_back(0.0, 0.0, 1e-3 * i);
    for (int i = 1; i <= 60; ++i) points.push_back(Vec3(0.0, 0.0, 0.1) + 1e-3 * i * aside);
    std::vector<double> radii(points.size(), 3e-3);
    return make_route(std::move(points), std::move(radii));
}

TEST(DrivePath, IsLinearBetweenRowsAndHeldOutside) {
    const std::array<DriveRow, 3> rows{{{1.0, 0.02, 0.0}, {2.0, 0.04, 1.0}, {4.0, 0.03, -1.0}}};
    EXPECT_DOUBLE_EQ(evaluate_path(rows, -5.0).insertion, 0.02);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 1.0).insertion, 0.02);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 1.5).insertion, 0.03);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 1.5).rotation, 0.5);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 2.0).rotation, 1.0);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 3.0).insertion, 0.035);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 3.0).rotation, 0.0);
    EXPECT_DOUBLE_EQ(evaluate_path(rows, 99.0).insertion, 0.03);
}

TEST(DrivePath, OfOneRowOrOfTwoAtTheSameTimeHasAnAnswer) {
    const std::array<DriveRow, 1> one{{{1.0, 0.02, 0.5}}};
    EXPECT_DOUBLE_EQ(evaluate_path(one, 0.0).insertion, 0.02);
    EXPECT_DOUBLE_EQ(evaluate_path(one, 2.0).rotation, 0.5);
    const std::array<DriveRow, 3> jump{{{0.0, 0.01, 0.0}, {1.0, 0.02, 0.0}, {1.0, 0.05, 0.0}}};
    EXPECT_DOUBLE_EQ(evaluate_path(jump, 1.0).insertion, 0.02);
    EXPECT_DOUBLE_EQ(evaluate_path(jump, 1.1).insertion, 0.05);
}

TEST(DrivePath, OfThousandsOfRowsIsToTheBitWhatASearchFromTheFirstRowFinds) {
    std::mt19937_64 random(17);
    std::uniform_real_distribution<double> any(0.0, 1.0);
    std::vector<DriveRow> drive;
    std::vector<MotionRow> motion;
    for (double time = 0.5; drive.size() < 3000; time += random() % 5 == 0 ? 0.0 : 0.01 * any(random)) { // some rows at the same time
        drive.push_back({time, any(random), any(random)});
        motion.push_back({time, Vec3(any(random), any(random), any(random))});
    }
    const auto compare = [&](double time) {
        std::size_t i = 1;
        while (i < drive.size() && time > drive[i].time) ++i;
        DriveCommand command{drive.back().insertion, drive.back().rotation};
        Vec3 displacement = motion.back().displacement;
        if (i < drive.size()) {
            const double span = drive[i].time - drive[i - 1].time, s = span > 0.0 ? (time - drive[i - 1].time) / span : 1.0;
            command = {drive[i - 1].insertion + s * (drive[i].insertion - drive[i - 1].insertion),
                       drive[i - 1].rotation + s * (drive[i].rotation - drive[i - 1].rotation)};
            displacement = motion[i - 1].displacement + s * (motion[i].displacement - motion[i - 1].displacement);
        }
        EXPECT_EQ(evaluate_path(drive, time).insertion, command.insertion) << time;
        EXPECT_EQ(evaluate_path(drive, time).rotation, command.rotation) << time;
        EXPECT_EQ(evaluate_motion(motion, time), displacement) << time;
    };
    for (std::size_t i = 1; i < drive.size(); i += 7) compare(drive[i].time);
    for (int k = 0; k < 300; ++k) compare(drive.front().time + (drive.back().time + 1.0 - drive.front().time) * (any(random) + 1e-9));
}

TEST(DriveLimits, HoldBothWaysAndLetSmallChangesPass) {
    const DriveCommand from{0.1, 1.0};
    EXPECT_DOUBLE_EQ(limit_command(from, {0.2, 2.0}, kLimits, kDt).insertion, 0.1 + 0.035 * kDt);
    EXPECT_DOUBLE_EQ(limit_command(from, {0.0, 2.0}, kLimits, kDt).insertion, 0.1 - 0.035 * kDt);
    EXPECT_DOUBLE_EQ(limit_command(from, {0.1, 9.0}, kLimits, kDt).rotation, 1.0 + 3.14 * kDt);
    EXPECT_DOUBLE_EQ(limit_command(from, {0.1, -9.0}, kLimits, kDt).rotation, 1.0 - 3.14 * kDt);
    const DriveCommand near{0.1001, 1.01};
    EXPECT_DOUBLE_EQ(limit_command(from, near, kLimits, kDt).insertion, near.insertion);
    EXPECT_DOUBLE_EQ(limit_command(from, near, kLimits, kDt).rotation, near.rotation);
}

TEST(Steering, WhereTheWayIsStraightItPushesAtFullSpeedAndLeavesTheHandleAlone) {
    const Route route = make_bent_route(Vec3::UnitX());
    FollowState state;
    const DriveCommand now{0.05, 0.3};
    const DriveCommand next = follow_route(route, kSettings, kLimits, {{0, 0, 0.02}, Vec3::UnitZ(), Vec3::UnitX()}, now, kDt, state);
    EXPECT_DOUBLE_EQ(next.insertion, 0.05 + 0.025 * kDt);
    EXPECT_DOUBLE_EQ(next.rotation, 0.3);
    EXPECT_EQ(state.mode, FollowMode::Advance);
}

TEST(Steering, TurnsTheTipTowardsTheSideTheRouteGoesTo) {
    const TipView view{{0, 0, 0.096}, Vec3::UnitZ(), Vec3::UnitX()}; // the tip points to x
    const auto turn_for = [&](const Vec3& aside) {
        FollowState state;
        state.progress = 0.096;
        return follow_route(make_bent_route(aside), kSettings, kLimits, view, {0.1, 0.0}, kDt, state).rotation;
    };
    EXPECT_GT(turn_for(Vec3::UnitY()), 0.01) << "counter-clockwise about z";
    EXPECT_LT(turn_for(-Vec3::UnitY()), -0.01);
    EXPECT_NEAR(turn_for(Vec3::UnitX()), 0.0, 1e-9) << "already there";
    EXPECT_NEAR(std::abs(turn_for(-Vec3::UnitX())), 3.14 * kDt, 1e-9) << "the wrong way round: as fast as allowed";
}

TEST(Steering, ATipBesideItsWayIsAimedBetweenTheBranchsDirectionAndItsMiddle) {
    std::mt19937 random(7);
    const auto between = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
    for (int k = 0; k < 200; ++k) {
        const double direction = between(-3.0, 3.0), offset = (k % 2 == 0 ? 1.0 : -1.0) * between(1e-3, 4e-3);
        const Vec3 aside(std::cos(direction), std::sin(direction), 0.0), side = Vec3::UnitZ().cross(aside);
        const Route route = make_bent_route(aside);
        const Vec3 tip = Vec3(0.0, 0.0, between(0.094, 0.1)) + offset * side;
        FollowState state;
        DriveCommand now{0.1, direction + between(-2.0, 2.0)};
        state.progress = tip.z();
        const auto bend = [&] { return Vec3(std::cos(now.rotation), std::sin(now.rotation), 0.0); };
        for (int step = 0; step < 1000; ++step)
            now.rotation = follow_route(route, kSettings, kLimits, {tip, Vec3::UnitZ(), bend()}, now, kDt, state).rotation;
        const double back = -std::copysign(1.0, offset) * bend().dot(side);
        const Vec3 middle = route.points[static_cast<std::size_t>(std::lround(1e3 * (tip.z() + 0.012)))] - tip;
        const double straight = std::abs(middle.dot(side)) / std::hypot(middle.dot(side), middle.dot(aside));
        EXPECT_GT(bend().dot(aside), 0.0);
        EXPECT_GT(back, 0.2 * straight) << "it brings the tip back to the branch's middle, offset " << offset << " m";
        EXPECT_LT(back, straight) << "and still points along the branch, offset " << offset << " m";
    }
}

TEST(Steering, AnAttemptHoldsTheHandleOrKeepsTheAimAndThenPushesAsFastAsTheLimitAllows) {
    const Route route = make_bent_route(Vec3::UnitX());
    const DriveCommand now{0.1, 0.0};
    const auto command_of = [&](unsigned attempt) {
        FollowState state;
        state.mode = FollowMode::Probe;
        state.attempts = attempt;
        state.fork = 0.1;
        state.progress = state.best_progress = 0.09;
        state.best_insertion = state.astray_insertion = now.insertion;
        return follow_route(route, kSettings, kLimits, {{0, 0, 0.096}, Vec3::UnitZ(), -Vec3::UnitY()}, now, kDt, state);
    };
    EXPECT_NEAR(command_of(1).insertion, now.insertion + kSettings.speed * kDt, 1e-12);
    EXPECT_DOUBLE_EQ(command_of(1).rotation, now.rotation);
    EXPECT_NEAR(command_of(2).insertion, now.insertion + kLimits.speed * kDt, 1e-12);
    EXPECT_GT(command_of(2).rotation, 0.01) << "a tip that was turned off its way is turned back";
}

TEST(Steering, PushesMoreSlowlyWhileTheTipLooksElsewhere) {
    const Route route = make_bent_route(Vec3::UnitX());
    const auto push_for = [&](const Vec3& bend) {
        FollowState state;
        state.progress = 0.096;
        return follow_route(route, kSettings, kLimits, {{0, 0, 0.096}, Vec3::UnitZ(), bend}, {0.1, 0.0}, kDt, state).insertion - 0.1;
    };
    EXPECT_GT(push_for(Vec3::UnitX()), push_for(-Vec3::UnitX()));
    EXPECT_GT(push_for(-Vec3::UnitX()), 0.0);
}

TEST(Steering, ArrivesWhereNothingIsLeftToImproveAndKeepsStillUntilTheTipSlips) {
    const Route route = make_bent_route(Vec3::UnitX()); // ends at 60, 0, 100 mm
    FollowState state;
    state.progress = 0.155;
    const DriveCommand now{0.2, 1.0};
    const auto command_at = [&](double x) {
        return follow_route(route, kSettings, kLimits, {{x, 0, 0.1}, Vec3::UnitX(), Vec3::UnitY()}, now, kDt, state);
    };
    state.missing = 0.01;
    EXPECT_GT(command_at(0.0575).insertion, 0.2) << "within the tolerance, but still coming nearer";
    EXPECT_DOUBLE_EQ(command_at(0.0575).insertion, 0.2) << "nearer it does not come";
    EXPECT_EQ(state.mode, FollowMode::Arrived);
    EXPECT_DOUBLE_EQ(command_at(0.0580).rotation, 1.0);
    EXPECT_DOUBLE_EQ(command_at(0.0567).insertion, 0.2) << "a little out of the tolerance";
    EXPECT_GT(command_at(0.0560).insertion, 0.2) << "slipped: pushed on";
    EXPECT_EQ(state.mode, FollowMode::Advance);
    EXPECT_LT(command_at(0.0640).insertion, 0.2) << "beyond the end: pulled back";
}

TEST(Steering, OnARouteThatTurnsBackPushesFromTheStart) {
    std::vector<Vec3> points; // up, over, and down again below the level of the start
    for (int i = 0; i <= 50; ++i) points.emplace_back(0.0, 0.0, 1e-3 * i);
    for (int i = 1; i <= 20; ++i) points.emplace_back(1e-3 * i, 0.0, 0.05);
    for (int i = 1; i <= 70; ++i) points.emplace_back(0.02, 0.0, 0.05 - 1e-3 * i);
    for (int i = 1; i <= 10; ++i) points.emplace_back(0.02, 0.0, -0.02 + 1e-3 * i); // the end points up: all of it lies "beyond"
    const Route route = make_route(points, std::vector<double>(points.size(), 3e-3));
    FollowState state;
    const DriveCommand now{0.01, 0.0};
    EXPECT_GT(follow_route(route, kSettings, kLimits, {{0, 0, 0.01}, Vec3::UnitZ(), Vec3::UnitX()}, now, kDt, state).insertion, 0.01);
}

/// A tip before a fork in which it goes astray: however far it is pushed, it is 3 mm beside the route; however far it is pulled, the tip
/// goes back by.
struct StrayTip {
    double insertion = 0.1;
    [[nodiscard]] Vec3 at(double hand) const {
        return hand < insertion ? Vec3(0, 0, 0.1 - (insertion - hand)) : Vec3(0, -std::min(0.01, 2.0 * (hand - insertion)), 0.1);
    }
};

TEST(Steering, PullsBackToBeforeTheForkAndProbesOtherAnglesThere) {
    const Route route = make_bent_route(Vec3::UnitX());
    const StrayTip tip;
    FollowState state;
    state.progress = state.best_progress = 0.095;
    DriveCommand now{0.095, 0.0};
    state.best_insertion = state.astray_insertion = now.insertion;
    std::vector<double> probed; // handle's angle of each attempt
    std::vector<double> started;
    FollowMode before = state.mode;
    for (int step = 0; step < 200'000 && probed.size() < 26; ++step) {
        const Vec3 bend(std::cos(now.rotation), std::sin(now.rotation), 0.0);
        const DriveCommand next = follow_route(route, kSettings, kLimits, {tip.at(now.insertion), Vec3::UnitZ(), bend}, now, kDt, state);
        ASSERT_LE(std::abs(next.insertion - now.insertion), kLimits.speed * kDt + 1e-12);
        ASSERT_LE(std::abs(next.rotation - now.rotation), kLimits.rotation * kDt + 1e-12);
        if (state.mode == FollowMode::Probe && before != FollowMode::Probe) {
            probed.push_back(std::remainder(next.rotation, 2.0 * std::numbers::pi));
            started.push_back(tip.at(next.insertion).z());
        }
        before = state.mode;
        now = next;
    }
    ASSERT_EQ(probed.size(), 26u);
    for (int k = 0; k < 8; ++k) { // no direction is further than 0.5 rad from an angle that was probed in the first round
        const double direction = k * std::numbers::pi / 4.0;
        double nearest = 9.0;
        for (std::size_t i = 0; i < 13; ++i)
            nearest = std::min(nearest, std::abs(std::remainder(direction - probed[i], 2.0 * std::numbers::pi)));
        EXPECT_LT(nearest, 0.5) << "direction " << direction;
    }
    for (const double z : started) EXPECT_LT(z, 0.0955) << "each attempt begins before the fork";
    EXPECT_LT(started[13], started[0] - 0.004) << "the second round begins further back";
}

TEST(Steering, WithAShortLookAheadItRetractsInProportionToIt) {
    const auto retraction_in = [](double size) { // of the tip's way back at the first attempt, as a multiple of the vessel's size
        Route route = make_bent_route(Vec3::UnitX());
        for (Vec3& point : route.points) point *= size;
        for (double& radius : route.radii) radius *= size;
        for (double& length : route.length) length *= size;
        const FollowSettings settings{0.025 * size, 0.012 * size, 0.003 * size};
        const DriveLimits limits{0.035 * size, 3.14};
        const StrayTip tip;
        FollowState state;
        state.progress = state.best_progress = 0.095 * size;
        DriveCommand now{0.095 * size, 0.0};
        state.best_insertion = state.astray_insertion = now.insertion;
        double furthest = now.insertion;
        for (int step = 0; step < 20'000 && state.mode != FollowMode::Turn; ++step) {
            const Vec3 bend(std::cos(now.rotation), std::sin(now.rotation), 0.0);
            now = follow_route(route, settings, limits, {size * tip.at(now.insertion / size), Vec3::UnitZ(), bend}, now, kDt, state);
            furthest = std::max(furthest, now.insertion);
        }
        EXPECT_EQ(state.mode, FollowMode::Turn) << size;
        return (furthest - now.insertion) / size;
    };
    const double usual = retraction_in(1.0);
    for (const double size : {0.3, 0.5, 0.8}) EXPECT_NEAR(retraction_in(size), usual, 0.15 * usual) << "times the usual vessel: " << size;
}

TEST(Steering, ATargetThatIsPassedBesideItIsTriedAgainAndOneThatIsPassedIsGoneBackTo) {
    const Route route = make_bent_route(Vec3::UnitX()); // ends at 60, 0, 100 mm
    for (const double beside : {0.0, 0.002, 0.0031, 0.005}) {
        FollowState state;
        state.progress = state.best_progress = 0.159;
        state.missing = 1.0;
        const DriveCommand now{0.2, 1.0};
        state.best_insertion = state.astray_insertion = now.insertion;
        const TipView view{{0.0645, beside, 0.1}, Vec3::UnitX(), Vec3::UnitY(), 0.0, true};
        for (int step = 0; step < 50; ++step) {
            EXPECT_LT(follow_route(route, kSettings, kLimits, view, now, kDt, state).insertion, 0.2) << beside;
            EXPECT_EQ(state.attempts, 0u) << "first it is pulled back";
        }
        for (int step = 0; step < 60 && state.attempts == 0; ++step) (void)follow_route(route, kSettings, kLimits, view, now, kDt, state);
        EXPECT_EQ(state.attempts, beside > kSettings.tolerance ? 1u : 0u) << beside;
    }
}

TEST(Steering, OnARouteWithoutPointsDoesNothing) {
    FollowState state;
    const DriveCommand now{0.2, 1.0};
    const DriveCommand next = follow_route({}, kSettings, kLimits, {}, now, kDt, state);
    EXPECT_DOUBLE_EQ(next.insertion, now.insertion);
    EXPECT_DOUBLE_EQ(next.rotation, now.rotation);
}

TEST(Steering, ATipThatOnlyTakesTheForkAtOneAngleGetsToTheEnd) {
    for (int start = 0; start < 8; ++start)       // any first angle of the handle
        for (int opens = 0; opens < 8; ++opens) { // and whatever angle it is that leads on
            const Route route = make_bent_route(Vec3::UnitX());
            const double opening = opens * std::numbers::pi / 4.0;
            FollowState state;
            DriveCommand now{0.0, start * std::numbers::pi / 4.0};
            double tip = 0.0, blocked_at = 0.0; // m along the route; insertion that is slack
            int step = 0;
            for (; step < 20'000 && state.mode != FollowMode::Arrived; ++step) {
                const bool ahead = tip < 0.1;
                const Vec3 tangent = ahead ? Vec3::UnitZ() : Vec3::UnitX();
                const Vec3 bend = ahead ? Vec3(std::cos(now.rotation), std::sin(now.rotation), 0.0) : Vec3(Vec3::UnitY());
                const std::size_t at = static_cast<std::size_t>(std::llround(1e3 * tip));
                const DriveCommand next = follow_route(route, kSettings, kLimits, {route.points[at], tangent, bend}, now, kDt, state);
                const double reach = std::clamp(next.insertion - blocked_at, 0.0, 0.16);
                const bool taken = !ahead || reach < 0.1 || std::cos(now.rotation - opening) > 0.88;
                if (!taken) blocked_at = std::max(0.0, next.insertion - 0.0995); // it buckles instead
                tip = taken ? reach : 0.0995;
                now = next;
            }
            EXPECT_EQ(state.mode, FollowMode::Arrived) << "first angle " << start << ", opens at " << opening;
            EXPECT_LT(step, 4000) << "first angle " << start << ", opens at " << opening;
        }
}

} // namespace
} // namespace trocar::engine
