// Laws of contact between solids, measured in scenes of their own.
#include "bench/closed_end.hpp"
#include "bench/law_row.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "fem/tissue/integrate.hpp"

#include <Eigen/Geometry>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace trocar::engine {

namespace {

/// In m, kPa.
struct LawScene {
    std::string bodies, contact;
    double step = 0.005;
    Vec3 gravity = Vec3::Zero();
    std::string budget = "exact";
};

PreparedScene prepare_law(const LawScene& s) {
    return prepare_law_text(fmt::format(
        R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": {}, "duration": 100}}, "budget": "{}",
        "gravity": [{}, {}, {}], "bodies": {{{}}}, "contact": {{{}}}, "effects": ["elasticity", "gravity", "damping", "coarse_contact",
        "friction"]}})",
        s.step, s.budget, s.gravity.x(), s.gravity.y(), s.gravity.z(), s.bodies, s.contact));
}

std::string body(const std::string& name, const std::string& surface, double kpa, double viscosity, double mass_damping,
                 const std::string& mesher, int triangles = 300) {
    return fmt::format(R"("{}": {{"kind": "deformable", "surface": {}, "material": {{"young_modulus": {}, "poisson_ratio": 0.4,
        "density": 1000, "viscosity": {}, "mass_damping": {}}}, "coarse": {{"mesher": "{}", "surface_triangles": {}}}}})",
                       name, surface, kpa, viscosity, mass_damping, mesher, triangles);
}

std::string ball_at(const Vec3& c, int subdivisions = 3) {
    return fmt::format(R"({{"shape": "sphere", "centre": [{}, {}, {}], "radius": 0.02, "subdivisions": {}}})", c.x(), c.y(), c.z(),
                       subdivisions);
}

std::string box_at(const Vec3& c, const Vec3& extent, int cells) {
    return fmt::format(R"({{"shape": "box", "centre": [{}, {}, {}], "extent": [{}, {}, {}], "cells": {}}})", c.x(), c.y(), c.z(), extent.x(),
                       extent.y(), extent.z(), cells);
}

std::string table_of(int cells) {
    return fmt::format(R"(, "table": {{"kind": "static", "surface": {}}})", box_at({0, 0, -0.01}, {0.3, 0.3, 0.02}, cells));
}

Vec3 centre_of(const fem::TissueModel& tissue, const fem::TissueState& state) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t n = 0; n < tissue.node_count(); ++n) sum += tissue.node_mass[n] * state.position[n];
    return sum / tissue.mass;
}

std::string setting_of(const std::string& mesher, double step) { return fmt::format("{}, {:g} ms", mesher, 1e3 * step); }

struct Impact {
    double first = 0.0, second = 0.0; // m/s, along the line of the throw
    double lost_momentum = 0.0, gained_energy = 0.0, seconds = 0.0;
};

/// Two equal soft balls, one thrown at the other.
Impact strike(const std::string& mesher, double step, double speed, const std::string& budget = "exact") {
    LawScene scene;
    scene.step = step;
    scene.budget = budget;
    scene.bodies = body("first", ball_at({-0.0205, 0, 0}), 10.0, 0.001, 0.0, mesher) + ", " +
                   body("second", ball_at({0.0205, 0, 0}), 10.0, 0.001, 0.0, mesher);
    const PreparedScene prepared = prepare_law(scene);
    Simulator simulator(prepared.model);
    State thrown = simulator.state();
    for (Vec3& v : thrown.bodies[0].tissue.velocity) v = Vec3(speed, 0, 0);
    (void)simulator.restore(thrown);
    const fem::TissueModel &a = *prepared.model.bodies[0].tissue, &b = *prepared.model.bodies[1].tissue;
    Impact impact;
    const double energy = 0.5 * a.mass * speed * speed;
    for (int k = 0; k < static_cast<int>(0.2 / step); ++k) {
        const StepReport& report = simulator.step();
        impact.gained_energy = std::max(impact.gained_energy, (report.kinetic_j + report.elastic_j) / energy - 1.0);
    }
    const Vec3 of_a = fem::find_momentum(a, simulator.state().bodies[0].tissue).linear;
    const Vec3 of_b = fem::find_momentum(b, simulator.state().bodies[1].tissue).linear;
    impact.first = of_a.x() / a.mass;
    impact.second = of_b.x() / b.mass;
    impact.lost_momentum = (of_a + of_b - Vec3(a.mass * speed, 0, 0)).norm() / (a.mass * speed);
    return impact;
}

void measure_impacts(const std::vector<std::string>& meshers, const std::vector<double>& steps, std::vector<LawRow>& rows) {
    constexpr double kSpeed = 0.196;
    for (const std::string& mesher : meshers) {
        const Impact reference = strike(mesher, 2e-4, kSpeed);
        for (const double step : steps) {
            const Impact impact = strike(mesher, step, kSpeed);
            const std::string setting = setting_of(mesher, step);
            rows.push_back({"equal balls: the struck one leaves as at 0.2 ms", "m/s", reference.second, impact.second, 0.05 * kSpeed, setting});
            rows.push_back({"equal balls: the striking one stops as at 0.2 ms", "m/s", reference.first, impact.first, 0.05 * kSpeed, setting});
            rows.push_back({"momentum of a free system stays", "share of it", 0.0, impact.lost_momentum, 1e-9, setting});
            rows.push_back({"energy is never gained", "share of what moved", 0.0, std::max(0.0, impact.gained_energy), 1e-6, setting});
            for (const char* budget : {"work:1000", "work:0"}) {
                const Impact left = strike(mesher, step, kSpeed, budget);
                rows.push_back({"momentum of a free system stays", "share of it", 0.0, left.lost_momentum, 1e-9, setting + ", " + budget});
                rows.push_back({"energy is never gained", "share of what moved", 0.0, std::max(0.0, left.gained_energy), 1e-6, setting + ", " + budget});
            }
        }
    }
}

/// Where the nodes of two balls, one thrown at the other, are after 30 ms: as they are, all turned by `turn`, all moved along at `frame`.
std::vector<Vec3> throw_turned(const PreparedScene& prepared, double step, const Mat3& turn, const Vec3& frame) {
    Simulator simulator(prepared.model);
    State start = simulator.state();
    for (Vec3& v : start.bodies[0].tissue.velocity) v = Vec3(0.3, 0, 0);
    for (BodyState& body : start.bodies) {
        for (auto* list : {&body.tissue.position, &body.tissue.velocity, &body.surface})
            for (Vec3& v : *list) v = turn * v;
        for (Vec3& v : body.tissue.velocity) v += frame;
    }
    (void)simulator.restore(start);
    for (int k = 0; k < static_cast<int>(0.03 / step); ++k) simulator.step();
    std::vector<Vec3> out;
    for (const BodyState& body : simulator.state().bodies) out.insert(out.end(), body.tissue.position.begin(), body.tissue.position.end());
    return out;
}

/// m, between places and others that were turned and moved.
double farthest_apart(const std::vector<Vec3>& places, const std::vector<Vec3>& others, const Mat3& turn, const Vec3& way) {
    double most = 0.0;
    for (std::size_t n = 0; n < places.size(); ++n) most = std::max(most, (turn * places[n] + way - others[n]).norm());
    return most;
}

void measure_invariance(const std::vector<std::string>& meshers, const std::vector<double>& steps, std::vector<LawRow>& rows) {
    const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(0.3, -0.8, 0.5).normalized()).toRotationMatrix(), none = Mat3::Identity();
    const Vec3 frame(4.0, -7.0, 5.0), still = Vec3::Zero();
    for (const std::string& mesher : meshers)
        for (const double step : steps) {
            LawScene scene;
            scene.step = step;
            scene.contact = R"("solid_friction": 0.3)";
            scene.bodies = body("first", ball_at({-0.0205, 0, 0}), 10.0, 0.001, 0.0, mesher) + ", " + body("second", ball_at({0.0205, 0.006, 0}), 10.0, 0.001, 0.0, mesher);
            const PreparedScene prepared = prepare_law(scene);
            const std::vector<Vec3> as_is = throw_turned(prepared, step, none, still);
            const double steps_done = static_cast<int>(0.03 / step);
            rows.push_back({"what is turned goes on turned", "of the radius", 0.0,
                            farthest_apart(as_is, throw_turned(prepared, step, turn, still), turn, still) / 0.02, 1e-6, setting_of(mesher, step)});
            rows.push_back({"what flies along meets as what rests", "of the radius", 0.0,
                            farthest_apart(as_is, throw_turned(prepared, step, none, frame), none, steps_done * step * frame) / 0.02, 1e-6, setting_of(mesher, step)});
        }
}

/// Two or three boxes and balls of random sizes, attitudes and stiffness, thrown at one another in free space under a random budget: what energy they
/// gain at most, of what they have after the first step, and what of their momentum is lost, of the sum of its sizes.
std::pair<double, double> throw_at_random(std::mt19937_64& rng) {
    const auto between = [&rng](double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng); };
    const char* const meshers[] = {"lattice", "tetgen"};
    const char* const budgets[] = {"work:0", "work:300", "work:1000", "work:3000", "exact"};
    const double steps[] = {2e-4, 1e-3, 2e-3, 5e-3, 1e-2};
    LawScene scene;
    scene.step = steps[rng() % 5];
    scene.budget = budgets[rng() % 5];
    scene.contact = fmt::format(R"("solid_friction": {})", rng() % 2 ? 0.3 : 0.0);
    const std::string mesher = meshers[rng() % 2];
    const std::size_t count = 2 + rng() % 2;
    double at = 0.0; // m, along x, of the last one's end
    std::vector<Vec3> centres;
    for (std::size_t k = 0; k < count; ++k) {
        const bool is_box = rng() % 3 != 0;
        const Vec3 extent(between(0.01, 0.03), between(0.01, 0.03), between(0.01, 0.03));
        const double radius = is_box ? 0.5 * extent.norm() : 0.02;
        centres.emplace_back(at + radius + 1e-3, between(-0.004, 0.004), between(-0.004, 0.004));
        at += 2.0 * radius + 1e-3;
        scene.bodies += (k > 0 ? ", " : "") + body(fmt::format("b{}", k), is_box ? box_at(centres[k], extent, 3) : ball_at(centres[k]),
                                                   std::pow(10.0, between(0.7, 2.7)), rng() % 2 ? 0.001 : 0.02, 0.0, mesher);
    }
    const PreparedScene prepared = prepare_law(scene);
    Simulator simulator(prepared.model);
    State start = simulator.state();
    const double speed = between(0.05, 0.6);
    for (std::size_t k = 0; k < count; ++k) {
        const Mat3 turn = Eigen::AngleAxisd(between(0.0, 3.0), Vec3(between(-1, 1), between(-1, 1), between(-1, 1)).normalized()).toRotationMatrix();
        for (auto* places : {&start.bodies[k].tissue.position, &start.bodies[k].surface})
            for (Vec3& x : *places) x = centres[k] + turn * (x - centres[k]);
        for (Vec3& v : start.bodies[k].tissue.velocity) v = Vec3(k == 0 ? speed : k + 1 == count ? -0.3 * speed : 0.0, 0, 0);
    }
    (void)simulator.restore(start);
    const auto momentum = [&](const State& state) {
        std::pair<Vec3, double> sum{Vec3::Zero(), 0.0};
        for (std::size_t k = 0; k < count; ++k) {
            const Vec3 own = fem::find_momentum(*prepared.model.bodies[k].tissue, state.bodies[k].tissue).linear;
            sum.first += own;
            sum.second += own.norm();
        }
        return sum;
    };
    const auto [before, size] = momentum(start);
    double first = 0.0, most = 0.0;
    for (int k = 0; k < static_cast<int>(0.15 / scene.step); ++k) {
        const StepReport& report = simulator.step();
        const double energy = report.finite ? report.kinetic_j + report.elastic_j : std::numeric_limits<double>::infinity();
        if (k == 0) first = energy;
        most = std::max(most, energy);
    }
    return {most / first - 1.0, (momentum(simulator.state()).first - before).norm() / size};
}

void measure_free_systems(int count, std::vector<LawRow>& rows) {
    std::mt19937_64 rng(2811);
    double gained = 0.0, lost = 0.0;
    for (int k = 0; k < count; ++k) {
        const auto [energy, momentum] = throw_at_random(rng);
        gained = std::max(gained, energy);
        lost = std::max(lost, momentum);
    }
    const std::string setting = fmt::format("{} systems, any budget", count);
    rows.push_back({"bodies thrown at random gain no energy", "share of what moved, at most", 0.0, gained, 1e-6, setting});
    rows.push_back({"bodies thrown at random keep their momentum", "share of it, at most", 0.0, lost, 1e-9, setting});
}

void measure_planes(const std::vector<double>& steps, std::vector<LawRow>& rows) {
    for (const int cells : {1, 16, 64})
        for (const double step : steps) {
            LawScene scene;
            scene.step = step;
            scene.gravity = {0, 0, -9.81};
            scene.bodies = body("ball", ball_at({0.003, 0.002, 0.024}), 10.0, 0.001, 2.0, "lattice") + table_of(cells);
            const PreparedScene prepared = prepare_law(scene);
            Simulator simulator(prepared.model);
            const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
            const Vec3 start = centre_of(tissue, simulator.state().bodies[0].tissue);
            double sideways = 0.0;
            for (int k = 0; k < static_cast<int>(0.5 / step); ++k) {
                simulator.step();
                const Vec3 moved = centre_of(tissue, simulator.state().bodies[0].tissue) - start;
                sideways = std::max(sideways, std::hypot(moved.x(), moved.y()));
            }
            rows.push_back({"a frictionless plane pushes along its normal", "mm aside", 0.0, 1e3 * sideways, 1e-3,
                            fmt::format("{} cells, {:g} ms", cells, 1e3 * step)});
        }
}

/// What carries the first body of a scene at rest.
struct Rest {
    double force = 0.0, spread = 0.0; // [-] of its weight: mean, and deviation from that
    double depth = 0.0;               // m, at most
};

Rest look_at_rest(const LawScene& scene, double from_s, double until_s) {
    const PreparedScene prepared = prepare_law(scene);
    Simulator simulator(prepared.model);
    const double weight = 9.81 * prepared.model.bodies[0].tissue->mass;
    double sum = 0.0, squares = 0.0;
    int count = 0;
    Rest rest;
    for (int k = 0; k < static_cast<int>(until_s / scene.step); ++k) {
        const StepReport& report = simulator.step();
        if (report.time_s < from_s) continue;
        sum += report.solid_force_n, squares += report.solid_force_n * report.solid_force_n, ++count;
        rest.depth = std::max(rest.depth, report.deepest_touch_m);
    }
    const double mean = sum / count;
    rest.force = mean / weight;
    rest.spread = std::sqrt(std::max(0.0, squares / count - mean * mean)) / weight;
    return rest;
}

void measure_weights(const std::vector<std::string>& meshers, const std::vector<double>& steps, std::vector<LawRow>& rows) {
    for (const std::string& mesher : meshers)
        for (const double step : steps) {
            const Rest rest = look_at_rest(
                {.bodies = body("block", box_at({0.002, 0.001, 0.0105}, {0.04, 0.03, 0.02}, 4), 30.0, 0.001, 20.0, mesher) + table_of(8),
                 .contact = "\"solid_friction\": 0.3",
                 .step = step,
                 .gravity = {0, 0, -9.81}},
                1.0, 1.2);
            rows.push_back({"at rest contact carries the weight", "of the weight", 1.0, rest.force, 0.01, setting_of(mesher, step)});
            rows.push_back({"and is steady", "deviation, of the weight", 0.0, rest.spread, 0.02, setting_of(mesher, step)});
        }
}

/// A beam across a wall that is narrower than the beam is long, and longer than it is wide: no corner of either is over the other.
void measure_crossing(const std::vector<std::string>& meshers, const std::vector<double>& steps, std::vector<LawRow>& rows) {
    const std::string wall = fmt::format(R"(, "wall": {{"kind": "static", "surface": {}}})", box_at({0, 0, -0.02}, {0.03, 0.2, 0.04}, 1));
    for (const std::string& mesher : meshers)
        for (const double step : steps) {
            const Rest rest = look_at_rest({.bodies = body("beam", box_at({0.003, 0.002, 0.0102}, {0.1, 0.02, 0.02}, 1), 500.0, 0.1, 5.0, mesher) + wall,
                                            .contact = "",
                                            .step = step,
                                            .gravity = {0, 0, -9.81}},
                                           1.5, 1.7);
            rows.push_back({"edges across edges carry the weight", "of the weight", 1.0, rest.force, 0.01, setting_of(mesher, step)});
            rows.push_back({"and are steady", "deviation, of the weight", 0.0, rest.spread, 0.02, setting_of(mesher, step)});
            rows.push_back({"and do not sink", "mm", 0.0, 1e3 * rest.depth, 0.01, setting_of(mesher, step)});
        }
}

struct Thrown {
    std::string block; // as body() writes it
    std::string beside;
    double speed = 1.0, seconds = 0.1; // m/s along x, s
    Vec3 gravity = Vec3::Zero();
};

/// m; how far the block's middle comes, and how far it would come alone.
std::pair<Vec3, Vec3> throw_block(const Thrown& thrown, double step) {
    std::string block = thrown.block;
    block.insert(block.size() - 1, fmt::format(R"(, "velocity": [{}, 0, 0])", thrown.speed));
    const PreparedScene prepared = prepare_law({.bodies = block + thrown.beside, .contact = "", .step = step, .gravity = thrown.gravity});
    Simulator simulator(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    const Vec3 from = centre_of(tissue, simulator.state().bodies[0].tissue);
    while (simulator.raw_state().time < thrown.seconds - 0.5 * step) simulator.step();
    return {centre_of(tissue, simulator.state().bodies[0].tissue) - from, Vec3(thrown.speed * simulator.raw_state().time, 0, 0)};
}

/// A block that is thrown past the edge of a box, 1 mm above it, in steps that take it farther than it is long: by how much less it comes.
void measure_passing(const std::vector<std::string>& meshers, const std::vector<double>& steps, std::vector<LawRow>& rows) {
    const std::string box = fmt::format(R"(, "box": {{"kind": "static", "surface": {}}})", box_at({0, 0, -0.011}, {0.08, 0.08, 0.02}, 1));
    for (const std::string& mesher : meshers)
        for (const double step : steps) {
            const auto [way, alone] = throw_block(
                {.block = body("block", box_at({-0.06, 0.003, 0.01}, {0.02, 0.02, 0.02}, 2), 200.0, 0.02, 0.0, mesher), .beside = box, .speed = 2.5, .seconds = 0.06}, step);
            rows.push_back({"what flies past is held by nothing", "mm off its way", 0.0, 1e3 * (way - alone).norm(), 1e-6, setting_of(mesher, step)});
        }
}

/// A block that slides along the rim of a table, a part of it over the rim, past the vertices by which that is divided: what it loses of its way.
void measure_rims(const std::vector<std::string>& meshers, const std::vector<double>& steps, std::vector<LawRow>& rows) {
    const std::string table = fmt::format(R"(, "table": {{"kind": "static", "surface": {}}})", box_at({0, 0, -0.01}, {0.3, 0.3, 0.02}, 9));
    for (const std::string& mesher : meshers)
        for (const double step : steps) {
            const auto [way, alone] = throw_block({.block = body("block", box_at({-0.1, 0.1431, 0.0151}, {0.03, 0.03, 0.03}, 1), 500.0, 0.02, 0.0, mesher),
                                                   .beside = table,
                                                   .speed = 0.9,
                                                   .seconds = 0.15,
                                                   .gravity = {0, 0, -9.81}},
                                                  step);
            rows.push_back({"what slides along a rim keeps its speed", "of its way", 1.0, way.x() / alone.x(), 0.005, setting_of(mesher, step)});
        }
}

/// m/s^2 down a slope, and m that it went in the first half of the time; see OnASlope in test_engine
std::pair<double, double> slide_down(double tangent, double friction, double step, double seconds) {
    LawScene scene;
    scene.step = step;
    const double normal = 9.81 / std::hypot(1.0, tangent);
    scene.gravity = {tangent * normal, 0, -normal};
    scene.contact = fmt::format("\"solid_friction\": {}", friction);
    scene.bodies = body("block", box_at({-0.08, 0, 0.0051}, {0.03, 0.03, 0.01}, 3), 200.0, 0.02, 0.0, "lattice") + table_of(8);
    const PreparedScene prepared = prepare_law(scene);
    Simulator simulator(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    const int steps = static_cast<int>(seconds / step);
    double at[3] = {};
    for (int k = 0; k < steps; ++k) {
        simulator.step();
        const double x = centre_of(tissue, simulator.state().bodies[0].tissue).x();
        if (k + 1 == steps / 4) at[0] = x;
        if (k + 1 == steps / 2) at[1] = x;
        at[2] = x;
    }
    const double t1 = 0.25 * seconds, t2 = 0.75 * seconds;
    return {2.0 * ((at[2] - at[0]) / t2 - (at[1] - at[0]) / t1) / (t2 - t1), at[2] - at[0]};
}

void measure_slopes(const std::vector<double>& steps, std::vector<LawRow>& rows) {
    for (const double step : steps) {
        const double expected = 9.81 * (0.5 - 0.2) / std::hypot(1.0, 0.5);
        rows.push_back({"a block slides with g (sin - mu cos)", "m/s^2", expected, slide_down(0.5, 0.2, step, 0.4).first, 0.02 * expected,
                        setting_of("lattice", step)});
        rows.push_back({"below the angle of friction it stays", "mm in a second", 0.0, 1e3 * slide_down(0.3, 0.35, step, 1.0).second, 0.02,
                        setting_of("lattice", step)});
    }
}

/// A ball between two plates that close on it slowly (Hertz 1882): each presses with 4/3 E / (1 - nu^2) sqrt(R) depth^1.5. From the depth where
/// the circle that touches is two cells wide on.
void press_a_ball(const std::string& mesher, double step, std::vector<LawRow>& rows) {
    constexpr double kBallRadius = 0.02, kSpeed = 0.005, kSeconds = 0.4; // m/s, of each plate against the ball
    constexpr double kFull = 10e3 / (1.0 - 0.4 * 0.4) * 4.0 / 3.0;    // Pa
    LawScene scene;
    scene.step = step;
    scene.bodies = body("ball", ball_at(Vec3::Zero(), 4), 10.0, 0.002, 0.0, mesher, mesher == "tetgen" ? 3000 : 2000) +
                   fmt::format(R"(, "table": {{"kind": "static", "surface": {}}}, "plate": {{"kind": "kinematic", "surface": {},
                       "motion": [[0, 0, 0, 0], [1, 0, 0, {}]]}})",
                               box_at({0, 0, -kBallRadius - 0.005}, {0.08, 0.08, 0.01}, 40), box_at({0, 0, kBallRadius + 0.005}, {0.08, 0.08, 0.01}, 40),
                               -2.0 * kSpeed);
    const PreparedScene prepared = prepare_law(scene);
    Simulator simulator(prepared.model);
    double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0, ratio = 0.0; // of the straight line through the logarithms
    while (simulator.raw_state().time < kSeconds) {
        const StepReport& report = simulator.step();
        const double depth = kSpeed * report.time_s, force = 0.5 * report.solid_force_n;
        if (depth < 0.02 * kBallRadius || !(force > 0.0)) continue;
        const double u = std::log(depth), v = std::log(force);
        n += 1.0, x += u, y += v, xx += u * u, xy += u * v;
        ratio = force / (kFull * std::sqrt(kBallRadius) * std::pow(depth, 1.5));
    }
    const std::string setting = setting_of(mesher, step);
    rows.push_back({"a ball is pressed flat by force ~ depth^1.5 (Hertz)", "exponent, depth 2 to 10 % of the radius", 1.5,
                    (n * xy - x * y) / (n * xx - x * x), 0.075, setting});
    rows.push_back({"and by that law's own force", "of it, at 10 %", 1.0, ratio, 0.25, setting});
}

} // namespace

std::vector<LawRow> measure_solid_laws(bool quick) {
    const std::vector<std::string> meshers = quick ? std::vector<std::string>{"lattice"} : std::vector<std::string>{"lattice", "tetgen"};
    const std::vector<double> steps = quick ? std::vector<double>{1e-2} : std::vector<double>{2e-4, 1e-3, 5e-3, 1e-2};
    std::vector<LawRow> rows;
    measure_impacts(meshers, steps, rows);
    measure_invariance(meshers, quick ? steps : std::vector<double>{1e-3, 5e-3, 1e-2}, rows);
    measure_free_systems(quick ? 20 : 200, rows);
    measure_planes(quick ? steps : std::vector<double>{1e-3, 1e-2}, rows);
    measure_weights(meshers, steps, rows);
    measure_crossing(meshers, quick ? steps : std::vector<double>{1e-3, 5e-3, 1e-2}, rows);
    for (const std::string& mesher : meshers)
        for (const double step : quick ? std::vector<double>{1e-2} : std::vector<double>{1e-3, 5e-3, 1e-2}) press_a_ball(mesher, step, rows);
    measure_passing(meshers, quick ? steps : std::vector<double>{1e-3, 5e-3, 1e-2}, rows);
    measure_rims(meshers, quick ? steps : std::vector<double>{2e-3, 5e-3, 1e-2}, rows);
    measure_slopes(quick ? steps : std::vector<double>{1e-3, 5e-3, 1e-2}, rows);
    return rows;
}

} // namespace trocar::engine
