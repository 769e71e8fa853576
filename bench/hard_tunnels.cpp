// Tunnelling at rising speed: what flies at a thin wall, or is flown at by one, and how each way of answering comes through it.
#include "bench/hard_scenes.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr double kStep = 0.005;  // s
constexpr double kRadius = 15.0; // mm, of the ball
/// Steps that a ball has to come out where it was caught, once what flew at it has stopped.
constexpr std::uint64_t kAfter = 12;

struct TunnelCase {
    std::string response = "surface", budget = "exact";
    double thickness = 4.0; // mm, of the plate
    double speed = 300.0;   // mm/s
};

struct Outcome {
    bool ran = false;
    bool finite = true;
    bool tunnelled = false;   // the ball is on the plate's other side
    bool said = false;        // the report of some step named places beyond the middle, or pairs that were not tested
    double ball_speed = 0.0;  // m/s upwards, at the end, of its centre of mass
    double energy_gain = 0.0; // of the end over the beginning; what a script drives brings energy
};

std::string ball_at(double z) {
    return soft_body("ball", fmt::format(R"({{"shape": "sphere", "centre": [0, 0, {}], "radius": {}, "subdivisions": 3}})", z, kRadius));
}

std::string plate_of(double thickness, const std::string& motion) {
    return fmt::format(R"("plate": {{{}, "surface": {{"shape": "box", "centre": [0, 0, 0], "extent": [90, 90, {}], "cells": 10}}}}, )",
                       motion, thickness);
}

Outcome look_after(HardReport& report, const TunnelCase& m, const std::string& bodies, std::uint64_t steps, double ball_flies_at) {
    const auto prepared = prepare_hard_scene(report, solid_scene({.bodies = bodies,
                                                                  .budget = m.budget,
                                                                  .contact = fmt::format(R"("solid_response": "{}")", m.response),
                                                                  .step = kStep,
                                                                  .gravity = false,
                                                                  .table = false}));
    Outcome outcome;
    if (!prepared) return outcome;
    Simulator simulator(prepared->model);
    State thrown = simulator.state(); // a scene gives no body a velocity
    for (Vec3& v : thrown.bodies[0].tissue.velocity) v = Vec3(0.0, 0.0, ball_flies_at);
    if (!report.require(simulator.restore(thrown).ok(), "a state with another velocity is taken")) return outcome;
    const double mass = prepared->model.bodies[0].tissue->mass, first = 0.5 * mass * ball_flies_at * ball_flies_at;
    outcome.ran = true;
    for (std::uint64_t k = 0; k < steps; ++k) {
        const StepReport& step = simulator.step();
        outcome.said = outcome.said || !step.finite || step.passed_places > 0 || step.unproven_solids > 0;
        if (outcome.finite = step.finite; !step.finite) return outcome; // it stopped and reported it: not silent
    }
    const fem::TissueModel& tissue = *prepared->model.bodies[0].tissue;
    const State& state = simulator.state();
    for (std::size_t n = 0; n < tissue.node_count(); ++n)
        outcome.ball_speed += tissue.node_mass[n] / mass * state.bodies[0].tissue.velocity[n].z();
    outcome.energy_gain = energy_of(simulator) / std::max(first, 1e-12);
    outcome.tunnelled = !(middle_of(state.bodies[0].surface).z() - middle_of(state.bodies[1].surface).z() > 0.0);
    return outcome;
}

/// A plate flies 120 mm up, through where a ball of 30 mm hangs. Without tunnelling it carries or throws the ball.
Outcome plate_at_ball(HardReport& report, const TunnelCase& m) {
    const double start = 0.02, end = start + 120.0 / m.speed;
    const std::string motion =
        fmt::format(R"("kind": "kinematic", "motion": [[0, 0, 0, 0], [{:.9f}, 0, 0, 0], [{:.9f}, 0, 0, 120]])", start, end);
    return look_after(report, m, ball_at(40.0) + plate_of(m.thickness, motion), static_cast<std::uint64_t>(std::ceil(end / kStep)) + kAfter,
                      0.0);
}

/// A ball flies down at a plate that is fixed.
Outcome ball_at_plate(HardReport& report, const TunnelCase& m) {
    const double time = 0.02 + 150.0 / m.speed;
    return look_after(report, m, ball_at(60.0) + plate_of(m.thickness, R"("kind": "static")"),
                      static_cast<std::uint64_t>(std::ceil(time / kStep)) + kAfter, -1e-3 * m.speed);
}

constexpr double kSpeeds[] = {300.0, 600.0, 1200.0, 2500.0, 5000.0, 10000.0, 30000.0}; // mm/s

struct Way {
    const char *response, *budget;
    double holds_up_to; // mm/s; the first speed that tunnels must be above
    bool throws;        // what it meets is looked at: what a tighter budget leaves is held, and comes to a stop before it
};
/// Spheres push along their line of centres, and have no inside: nothing is guaranteed beyond what they report.
constexpr Way kWays[] = {
    {"surface", "exact", 30000.0, true}, {"surface", "work:2000000", 30000.0, true}, {"surface", "work:100000", 5000.0, false},
    {"surface", "work:5", 5000.0, false}, {"spheres", "exact", 0.0, false}};

/// Up to this speed a step is short beside the ball, and the response works it out: beyond, what is thrown is caught first.
constexpr double kWorkedOut = 1200.0; // mm/s
/// m/s; half of the speed at which what has passed is brought back (kRecovery): caught is not thrown, but it comes out.
constexpr double kComesOut = 0.05;

/// Bound on the ball's speed after a collision, over the speed of approach.
struct Throw {
    double least; // up to kWorkedOut
    double most;  // at any speed
};

void rise(HardReport& report, const char* what, Outcome (*fly)(HardReport&, const TunnelCase&), const Throw& thrown) {
    for (const Way& way : kWays)
        for (const double thickness : {4.0, 2.0}) {
            double failed_at = INFINITY, said_at = INFINITY, slowest = INFINITY, least = INFINITY, most = 0.0, gain = 0.0;
            int silent = 0, stopped = 0;
            for (const double speed : kSpeeds) {
                const Outcome outcome = fly(report, {way.response, way.budget, thickness, speed});
                if (!outcome.ran) return;
                if (outcome.tunnelled) failed_at = std::min(failed_at, speed);
                if (outcome.said) said_at = std::min(said_at, speed);
                silent += outcome.tunnelled && !outcome.said;
                stopped += !outcome.finite;
                const double share = outcome.ball_speed / (1e-3 * speed);
                slowest = std::min(slowest, outcome.ball_speed);
                most = std::max(most, share);
                gain = std::max(gain, outcome.energy_gain);
                if (speed <= kWorkedOut) least = std::min(least, share);
            }
            const std::string name = fmt::format("{}, {:g} mm, 5 ms, {}, {}", what, thickness, way.response, way.budget);
            report.above(name + ": first speed that tunnels", failed_at, way.holds_up_to, "mm/s");
            report.equal(name + ": speeds that tunnel and do not say so", silent, 0);
            if (way.holds_up_to > 0.0) {
                report.equal(name + ": speeds at which the run stops", stopped, 0);
                report.below(name + ": its speed over the other's, most at any speed", most, thrown.most);
                if (fly == ball_at_plate) report.below(name + ": most energy at the end over that at the start", gain, 1.05);
            }
            if (way.throws) {
                report.above(name + ": slowest that the ball comes out at, at any speed", slowest, kComesOut, "m/s");
                report.above(name + ": its speed over the other's, least up to 1200 mm/s", least, thrown.least);
            }
            if (std::isfinite(said_at)) report.note(fmt::format("{}: from {:g} mm/s on the report says so", name, said_at));
        }
}

void plates_at_rising_speed(HardReport& report) {
    rise(report, "plate at a ball", plate_at_ball, {0.8, 2.0});
} // a wall throws at 2 v at most
void balls_at_rising_speed(HardReport& report) { rise(report, "ball at a plate", ball_at_plate, {0.2, 1.0}); } // soft flesh keeps the rest

void tunnelling_of_a_wire_at_rising_speed(HardReport& report) {
    struct Method {
        const char *what, *effects;
        double safe_mm_per_s; // up to there it must hold
    };
    for (const Method& m :
         {Method{"planes and continuous tests", R"("coarse_contact", "exact_contact")", 3500.0},
          Method{"continuous tests alone", R"("exact_contact")", 3500.0}, Method{"planes alone", R"("coarse_contact")", 35.0}}) {
        double failed_at = INFINITY, fastest = 0.0;
        for (const double speed : {35.0, 3500.0, 10000.0}) { // mm/s; a scene's drive commands may go no faster than 10 m/s
            if (std::isfinite(failed_at)) break;
            const auto prepared =
                prepare_hard_scene(report, tube_scene({.from = 20.0, .to = 180.0, .speed = speed, .effects = m.effects, .bent = true}));
            if (!prepared) return;
            Simulator simulator(prepared->model);
            std::uint64_t exits = 0;
            const std::uint64_t steps = speed < 100.0 ? 300 : 120;
            if (!run_hard(report, simulator, steps, [&](const StepReport& step) { exits += step.lumen_exits; })) return;
            if (exits > 0)
                failed_at = speed;
            else
                fastest = speed;
        }
        report.above(fmt::format("wire into a bend, {}: first speed at which it leaves the vessel (none up to {:g})", m.what, fastest),
                     failed_at, m.safe_mm_per_s, "mm/s");
    }
}

constexpr HardCase kTunnelsCases[] = {
    {"tunnelling", "APlateThatFliesAtABallThrowsIt",
     "by surfaces no speed from 0.3 to 30 m/s tunnels or stops the run where the budget has room to look, none up to 5 m/s where it has not, and beyond the report says so; up to 1.2 m/s the ball leaves at 0.8 of the "
     "plate's speed at least, at none at more than twice it; by spheres where it tunnels the report says so",
     plates_at_rising_speed},
    {"tunnelling", "ABallThatFliesAtAPlateIsThrownBack",
     "the same, thrown back at 0.2 at least; the energy at the end below 1.05 of the first: a plate that stands still gives none",
     balls_at_rising_speed},
    {"tunnelling", "AWireDoesNotTunnelAtAHundredTimesItsSpeed",
     "with continuous tests no vertex outside at 35 and 3500 mm/s; planes alone prove nothing, and hold at a surgeon's 35 mm/s",
     tunnelling_of_a_wire_at_rising_speed},
};

} // namespace

std::span<const HardCase> hard_tunnels() noexcept { return kTunnelsCases; }

} // namespace trocar::engine
