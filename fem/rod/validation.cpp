#include "fem/rod/validation.hpp"

#include "base/trig.hpp"
#include "fem/rod/rod_internal.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_trial.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::fem {

namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLength = 0.1; // m, of most rods here

} // namespace

ElasticaTip loaded_tip(int segments, double load) {
    RodTrial rod(kLength, segments, 1e-3 * kLength);
    rod.force.back() = Vec3(0, 0, load * rod.bending / (kLength * kLength));
    rod.settle();
    return {rod.tip().x() / kLength, rod.tip().z() / kLength};
}

ElasticaTip heavy_tip(int segments, double weight) {
    RodTrial rod(kLength, segments, 1e-3 * kLength);
    rod.drive.gravity = Vec3(0, 0, weight * rod.bending / std::pow(kLength, 3) / rod.line_density());
    rod.settle();
    return {rod.tip().x() / kLength, rod.tip().z() / kLength};
}

Vec3 bend45_tip(int segments) {
    constexpr double kUnit = 1e-3, kModulus = 1e7, kLoad = 600.0; // m; Pa, of a section of 1 x 1
    const double length = 0.25 * kPi * 100.0 * kUnit;
    RodTrial rod(length, segments, kUnit, true);
    // The square section's: area 1, second moment 1/12 in both directions, polar 1/6; the shear modulus is half of Young's.
    rod.set_stiffness(kModulus * std::pow(kUnit, 4) / 12.0, kModulus * kUnit * kUnit, 0.5 * kModulus * std::pow(kUnit, 4) / 6.0);
    const double curvature = 0.01 / kUnit;
    for (auto& k : rod.model.rest_curvature) k = {0.0, -curvature}; // towards y
    rod.settle();
    for (int part = 1; part <= 10; ++part) {
        rod.force.back() = Vec3(0, 0, 0.1 * part * kLoad * kUnit * kUnit);
        rod.settle(part == 10 ? 4000 : 40);
    }
    return rod.tip() / kUnit;
}

double rolled_gap(int segments) {
    RodTrial rod(kLength, segments, 5e-3 * kLength);
    const std::size_t first = rod.first() - 1;
    for (std::size_t i = first; i + 1 < rod.model.node_count(); ++i) rod.model.rest_curvature[i] = {2.0 * kPi / kLength, 0.0};
    rod.settle(4000);
    return (rod.tip() - rod.state.position[first]).norm() / kLength;
}

double greenhill_moment(int segments) {
    return find_neutral(0.9 * kGreenhillMoment, 1.1 * kGreenhillMoment, [&](double moment) {
        const double free = kLength / (1.0 - 0.5 / segments); // a clamp ends in the middle of the last segment
        RodTrial rod(free, segments, 1e-3 * kLength, true);
        rod.wind(moment * rod.bending / rod.twisting);
        rod.clamp_tip(rod.tip(), Vec3::UnitX(), moment * rod.bending / rod.twisting);
        rod.drive.clamp->slides = true;
        for (Vec3& x : rod.state.position)
            if (x.x() > 0.0) x += 1e-3 * kLength * std::pow(std::sin(kPi * x.x() / free), 2) * Vec3(0, std::cos(4.0 * x.x() / free), std::sin(4.0 * x.x() / free));
        return rod.growth(0.1, 2e-3, [&] {
            double sum = 0.0;
            for (const Vec3& x : rod.state.position) sum += x.y() * x.y() + x.z() * x.z();
            return sum;
        });
    });
}

double michell_twist(int segments) {
    // What has buckled gives some of its twist away: the torque falls. (The ring's plane may turn about x, which costs nothing.)
    const auto buckles = [&](double twist) {
        RodTrial rod(kLength, segments, 1e-3 * kLength, true);
        rod.insert(kLength + 0.5 * rod.model.segment); // port and clamp each end in the middle of a segment, of the same one: a whole polygon
        const double turn = 2.0 * kPi * twist * rod.bending / rod.twisting, radius = kLength / (2.0 * kPi);
        rod.wind(turn);
        for (Vec3& x : rod.state.position) {
            if (!(x.x() > 0.0)) continue;
            const double at = x.x() / radius;
            x = radius * Vec3(std::sin(at), 1.0 - std::cos(at), 0.02 * std::sin(2.0 * at));
        }
        rod.clamp_tip(0.5 * rod.model.segment * Vec3::UnitX(), Vec3::UnitX(), turn);
        const double flat = turn * rod.twisting / kLength;
        for (int k = 0; k < 800; ++k)
            if (rod.step(0.01).clamp_torque < 0.97 * flat && k > 50) return true;
        return false;
    };
    double low = 0.7 * std::sqrt(3.0), high = 1.3 * std::sqrt(3.0);
    for (int round = 0; round < 11; ++round) {
        const double middle = 0.5 * (low + high);
        (buckles(middle) ? high : low) = middle;
    }
    return 0.5 * (low + high);
}

double column_weight(int segments) {
    return find_neutral(0.9 * kHeavyColumn, 1.1 * kHeavyColumn, [&](double weight) {
        RodTrial rod(kLength, segments, 1e-3 * kLength);
        rod.drive.gravity = -weight * rod.bending / std::pow(kLength, 3) / rod.line_density() * Vec3::UnitX();
        for (Vec3& x : rod.state.position)
            if (x.x() > 0.0) x.z() = 1e-3 * x.x() * x.x() / kLength;
        return rod.growth(2.0, 0.02, [&] { return rod.tip().z() * rod.tip().z(); });
    });
}

namespace {

/// The free part's nodes on the closed form's centreline, from its first on.
void lay_helix(const HelicalBuckling& closed, RodTrial& rod) {
    constexpr int kParts = 200; // of a segment
    const double ds = rod.model.segment / kLength / kParts;
    Vec3 at = Vec3::Zero();
    double s = 0.0, turned = 0.0; // lengths, rad
    for (std::size_t i = rod.first(); i < rod.state.position.size(); ++i) {
        for (int part = 0; part < kParts; ++part, s += ds) {
            const double along = 1.0 - 2.0 * closed.spread() * closed.envelope(s + 0.5 * ds - 0.5), across = std::sqrt(std::max(0.0, 1.0 - along * along));
            const double turn = closed.moment / (1.0 + along) * ds, middle = turned + 0.5 * turn;
            at += ds * Vec3(along, across * std::cos(middle), across * std::sin(middle));
            turned += turn;
        }
        rod.state.position[i] = kLength * at;
    }
}

/// Largest distance of the lean of its segments, as a share of the closed form's largest, from the closed form about its own middle.
double envelope_error(const HelicalBuckling& closed, const RodTrial& rod) {
    const std::size_t first = rod.first() - 1, count = rod.model.node_count() - 1 - first;
    std::vector<double> lean(count);
    double sum = 0.0, weighted = 0.0, worst = 0.0;
    const auto place = [&](std::size_t k) { return (static_cast<double>(k) + 0.5) * rod.model.segment / kLength; };
    for (std::size_t k = 0; k < count; ++k) {
        lean[k] = 1.0 - (rod.state.position[first + k + 1] - rod.state.position[first + k]).normalized().x();
        sum += lean[k], weighted += lean[k] * place(k);
    }
    for (std::size_t k = 0; k < count; ++k)
        worst = std::max(worst, std::abs(lean[k] / (2.0 * closed.spread()) - closed.envelope(place(k) - weighted / sum)));
    return worst;
}

} // namespace

BuckledHelix buckle_helix(int segments) {
    constexpr double kTurn = 27.0 * 2.0 * kPi, kSlack = 0.03, kRatio = 0.789 / 1.345, kStretch = 2e8; // rad, -, -, E A L^2 / (E I)
    const HelicalBuckling closed = helical_buckling(kSlack, kTurn, kRatio);
    const double free = kLength / (1.0 - 0.5 / segments);
    RodTrial rod(free, segments, 1e-3 * kLength, true);
    rod.set_stiffness(rod.bending, kStretch * rod.bending / (kLength * kLength), kRatio * rod.bending);
    rod.wind(kTurn);
    lay_helix(closed, rod);
    rod.clamp_tip((free - kSlack * kLength) * Vec3::UnitX(), Vec3::UnitX(), kTurn);
    RodReport report;
    for (int k = 0; k < 400; ++k) report = rod.step(5e-3);
    BuckledHelix found;
    found.moment = report.clamp_torque * kLength / rod.bending;
    found.tension = report.clamp_force.x() * kLength * kLength / rod.bending;
    found.envelope = envelope_error(closed, rod);
    found.moving = report.kinetic_j / report.bend_j;
    return found;
}

double whirl_ratio(int segments, double share) {
    RodTrial rod(kLength, segments, 1e-3 * kLength);
    const double bow = 0.02 / kLength, unit = std::sqrt(rod.bending / rod.line_density()) / (kLength * kLength); // 1/m, 1/s
    for (std::size_t i = rod.first() - 1; i + 1 < rod.model.node_count(); ++i) rod.model.rest_curvature[i] = {bow, 0.0};
    rod.model.design.drag = 20.0 * unit;
    rod.run(10.0 / unit, 0.02 / unit);
    const double rest = std::hypot(rod.tip().y(), rod.tip().z());
    rod.model.design.drag = kWhirlDamping * kWhirlingSpeed * unit;
    const double speed = share * kWhirlingSpeed * unit, dt = 2.0 * kPi / speed / 400.0; // rad/s, s
    const double seconds = 14.0 / rod.model.design.drag;
    for (double t = 0.0; t < seconds; t += dt) {
        rod.drive.rotation += speed * dt;
        (void)rod.step(dt);
    }
    return std::hypot(rod.tip().y(), rod.tip().z()) / rest;
}

namespace {

/// Planes that hold every node of the free part on a curve: straight for `straight_nodes`, then an arc.
std::vector<RodPlane> zero_clearance_tube(const RodTrial& rod, std::size_t straight_nodes, double curvature) {
    std::vector<RodPlane> planes;
    const std::size_t nodes = rod.model.node_count();
    const Index first = rod.first();
    const double h = rod.model.segment, turn = 2.0 * std::asin(0.5 * curvature * h);
    Vec3 at = Vec3::Zero();
    double angle = 0.0;
    for (std::size_t i = first; i < nodes; ++i) {
        if (i - first > straight_nodes) angle += turn;
        at += h * Vec3(std::cos(angle), 0, std::sin(angle));
        const Vec3 across(-std::sin(angle - 0.5 * turn), 0, std::cos(angle - 0.5 * turn));
        for (const Vec3& normal : {Vec3(Vec3::UnitY()), across})
            for (const double side : {1.0, -1.0})
                planes.push_back({static_cast<Index>(i - 1), 1.0, Vec3(side * normal), side * normal.dot(at) + 1e-6, 0.0});
    }
    return planes;
}

} // namespace

Whip turn_in_bend(int segments, double rest_curvature, double tube_curvature) {
    constexpr double kShaft = 0.16; // m
    const int tip_nodes = segments / 8;
    RodTrial rod(kShaft, segments, 0.5e-3, true, 0.0);
    const std::size_t last = rod.model.node_count() - 1;
    for (std::size_t i = last - static_cast<std::size_t>(tip_nodes); i < last; ++i) rod.model.rest_curvature[i][0] = rest_curvature;
    rod.drive.contact_stiffness = 1e4;
    // The reference axis of a rod along x: the tube bends the way the tip does when the handle stands at 0.
    const double way = perpendicular_axis(Vec3::UnitX()).dot(Vec3::UnitZ());
    rod.planes = zero_clearance_tube(rod, static_cast<std::size_t>(segments - tip_nodes) - 1, way * tube_curvature);
    rod.run(1.0, 0.01);
    Whip whip;
    const double shaft = (segments - 0.5 * tip_nodes) * rod.model.segment; // m, to the middle of the tip
    whip.beta = rod.bending * rest_curvature * tube_curvature * tip_nodes * rod.model.segment * shaft / rod.twisting;
    whip.share = tip_nodes * rod.model.segment / shaft;
    const auto tip_angle = [&] { return rod.state.angle[last - static_cast<std::size_t>(tip_nodes / 2)]; };
    double before = tip_angle();
    for (int k = 1; k <= 1400; ++k) {
        rod.drive.rotation = 0.005 * k;
        (void)rod.step(0.01, 2);
        const double now = tip_angle();
        if (k == 40) whip.first_slope = now / rod.drive.rotation;
        if (now - before > whip.jump) whip.jump = now - before, whip.handle = rod.drive.rotation;
        before = now;
    }
    whip.last = rod.drive.rotation - before;
    return whip;
}

double wound_by_torque(int segments) {
    RodTrial rod(kLength, segments, 5e-3 * kLength, true);
    rod.drive.tip.torque = 0.5 * rod.twisting / kLength; // half a radian
    rod.settle();
    return rod.drive.tip.torque * kLength / rod.twisting / rod.state.angle.back();
}

} // namespace trocar::fem
