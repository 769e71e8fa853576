// Laws of a rod in contact, and of one that nothing touches: random rods against planes, posts and tubes, without an engine around them.
#include "bench/law_row.hpp"
#include "fem/rod/rod.hpp"
#include "fem/rod/rod_internal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <span>

namespace trocar::engine {

namespace {

using std::numbers::pi;
using namespace fem;

constexpr double kStepLengths[] = {2e-4, 1e-3, 5e-3, 1e-2}; // s

/// A straight rod of one modulus in a vacuum.
RodDesign straight_design(double length, double segment) {
    RodDesign design;
    design.length = length;
    design.segment = segment;
    design.tip = TipShape::Straight;
    design.tip_stiffness = 1.0;
    design.drag = 0.0;
    design.transverse_drag = 0.0;
    return design;
}

double section_of(const RodDesign& design) { return pi * design.radius * design.radius; }                            // m^2
double bending_stiffness(const RodDesign& design) { return 0.25 * design.young_modulus * pi * std::pow(design.radius, 4); } // N m^2
double torsion_stiffness(const RodDesign& design) { return bending_stiffness(design) / (1.0 + design.poisson_ratio); }      // N m^2

class RandomRods {
public:
    explicit RandomRods(unsigned seed) : random_(seed) {}
    double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
    RodDesign design(double length) {
        RodDesign design = straight_design(length, between(2e-3, 3e-3));
        design.radius = between(0.3e-3, 0.6e-3);
        design.young_modulus = between(30e6, 200e6);
        design.drag = 40.0;
        return design;
    }

private:
    std::mt19937 random_;
};

/// One rod that comes in along x, and the planes that it meets.
struct RodBench {
    RodModel model;
    RodDrive drive;
    RodState state;
    RodWorkspace workspace;
    RodReport report;
    std::vector<RodPlane> planes;
    std::vector<Vec3> force; // [node_count] N

    RodBench(const RodDesign& design, double insertion, const Vec3& port = Vec3::Zero()) : model(make_rod_model(design).value()) {
        drive.port = {port, Vec3::UnitX()};
        drive.insertion = insertion;
        drive.contact_stiffness = 1e6;
        place_rod(model, drive.port, insertion, 0.0, state);
        force.assign(model.node_count(), Vec3::Zero());
    }
    void step(double dt) {
        drive.force = force;
        report = solve_rod(model, state, dt, 1, drive, planes, workspace);
    }
    void run(double seconds, double dt) {
        for (double t = 0.0; t < seconds; t += dt) step(dt);
    }
    [[nodiscard]] Index first() const { return first_inserted_node(model, drive.insertion); }
    [[nodiscard]] Index last_segment() const { return static_cast<Index>(model.node_count() - 2); }
    /// A plane at the middle and the end of every segment beyond the port.
    void lay_on(const Vec3& normal, double offset) {
        for (Index node = first() - 1; node + 1 < model.node_count(); ++node)
            for (const double weight : {0.5, 1.0}) planes.push_back({node, weight, normal, offset});
    }
    /// The wall of a tube along x: planes on the nodes, where these are now and to both hands of it. They are the last of all planes, and
    /// what pressed on a node last begins there.
    void surround(double clearance) {
        std::vector<double> pressed(model.node_count(), 0.0);
        for (std::size_t k = others; k < planes.size(); ++k) pressed[planes[k].node + 1] += planes[k].force;
        planes.resize(others);
        for (Index node = first() - 1; node + 1 < model.node_count(); ++node) {
            const Vec3& p = state.position[node + 1];
            const double at = std::sqrt(p.y() * p.y() + p.z() * p.z()) > 0.1 * clearance ? std::atan2(p.y(), -p.z()) : 0.0;
            for (const double hand : {0.0, -0.3, 0.3})
                planes.push_back({node, 1.0, Vec3(0.0, -std::sin(at + hand), std::cos(at + hand)), -clearance, hand == 0.0 ? pressed[node + 1] : 0.0});
        }
    }
    /// Planes before those of surround().
    std::size_t others = 0;
    [[nodiscard]] double weight() const {
        double sum = 0.0;
        for (Index i = first(); i < model.node_count(); ++i) sum += model.mass[i] * std::sqrt(drive.gravity.squaredNorm());
        return sum;
    }
};

std::string at_step(double dt) { return fmt::format("step {:g} ms", 1e3 * dt); }

void rest_on_floor(std::vector<LawRow>& rows) {
    RandomRods random(281);
    for (const double dt : kStepLengths) {
        RodBench bench(random.design(0.14), 0.1);
        bench.drive.gravity = Vec3(0, 0, -random.between(2.0, 9.81));
        bench.drive.friction = random.between(0.0, 0.3);
        bench.lay_on(Vec3::UnitZ(), 0.0);
        bench.run(1.0, dt);
        constexpr int kSamples = 100;
        double sum = 0.0, squares = 0.0;
        for (int k = 0; k < kSamples; ++k) {
            bench.step(dt);
            double pressed = 0.0;
            for (const RodPlane& plane : bench.planes) pressed += plane.force;
            const double share = pressed / bench.weight();
            sum += share, squares += share * share;
        }
        const double mean = sum / kSamples;
        rows.push_back({"what rests presses with its weight", "sum of normal forces over the weight", 1.0, mean, 0.01, at_step(dt)});
        rows.push_back({"what rests presses with its weight", "standard deviation of that", 0.0,
                        std::sqrt(std::max(0.0, squares / kSamples - mean * mean)), 0.02, at_step(dt)});
    }
}

/// Dragged back over a floor, turned meanwhile, and then held.
void hold_what_was_dragged(std::vector<LawRow>& rows, bool quick) {
    RandomRods random(282);
    for (const double dt : {1e-3, 1e-2})
        for (const bool torsion : {false, true}) {
            RodDesign design = random.design(0.2);
            design.torsion = torsion;
            RodBench bench(design, 0.1);
            bench.drive.gravity = Vec3(0, 0, -9.81);
            bench.drive.friction = random.between(0.2, 0.5);
            bench.lay_on(Vec3::UnitZ(), 0.0);
            bench.run(0.2, dt);
            for (double t = 0.0; t < 1.0; t += dt) {
                bench.drive.insertion -= 1e-3 * dt;
                bench.drive.rotation += (torsion ? 0.2 : 0.0) * dt;
                bench.step(dt);
            }
            const std::string setting = at_step(dt) + (torsion ? ", with torsion" : "");
            rows.push_back({"friction of what slides is Coulomb's", "handle's pull over mu times the weight", 1.0,
                            -bench.report.handle_force.x() / (bench.drive.friction * bench.weight()), 0.05, setting});
            bench.run(0.5, dt);
            const double held = bench.report.handle_force.x(), turned = bench.report.handle_torque;
            bench.run(quick || dt < 5e-3 ? 5.0 : 60.0, dt);
            rows.push_back({"held friction stays", "handle's pull after 60 s (5 s at 1 ms) over that after 0.5 s", 1.0,
                            bench.report.handle_force.x() / held, 0.01, setting});
            if (torsion)
                rows.push_back({"held friction stays", "handle's torque after 60 s (5 s at 1 ms) over that after 0.5 s", 1.0,
                                bench.report.handle_torque / turned, 0.01, setting});
        }
}

/// Turned against two jaws at its tip by less than what makes it slip, and held.
void hold_what_was_turned(std::vector<LawRow>& rows, bool quick) {
    RandomRods random(283);
    for (const double dt : {1e-3, 1e-2}) {
        RodDesign design = random.design(0.2);
        design.torsion = true;
        RodBench bench(design, 0.15);
        bench.drive.friction = 0.3;
        constexpr double kGrip = 0.05; // N
        for (const double side : {-1.0, 1.0}) bench.planes.push_back({bench.last_segment(), 1.0, Vec3(0, side, 0), kGrip / bench.drive.contact_stiffness});
        const double torque = 2.0 * bench.drive.friction * kGrip * design.radius;
        const double lag = 0.8 * torque * 0.15 / torsion_stiffness(design);
        for (double t = 0.0; t < 0.5; t += dt) {
            bench.drive.rotation += lag * dt / 0.5;
            bench.step(dt);
        }
        bench.run(0.5, dt);
        const double held = bench.report.handle_torque;
        rows.push_back({"a held turn stays", "handle's torque over the lag times GJ / L", 1.0, held * 0.15 / torsion_stiffness(design) / lag, 0.03,
                        at_step(dt)});
        bench.run(quick || dt < 5e-3 ? 5.0 : 60.0, dt);
        rows.push_back({"a held turn stays", "handle's torque after 60 s (5 s at 1 ms) over that at first", 1.0, bench.report.handle_torque / held,
                        0.01, at_step(dt)});
    }
}

/// Of the handle's pull over the load at the other end, for a thin rod that is drawn over a post through `angle`.
double measure_capstan(double mu, double angle, double dt) {
    const double post = 20e-3, lead = 10e-3; // m, radius of the post; straight parts
    const double inside = 2.0 * lead + post * angle;
    RodDesign design = straight_design(inside + 40e-3, 1e-3);
    design.radius = 0.1e-3;
    design.drag = 40.0;
    RodBench bench(design, inside);
    bench.drive.friction = mu;
    const std::size_t nodes = bench.model.node_count();
    const Vec3 centre(lead, post, 0.0);
    const auto normal_at = [&](double s) { // arc length from the port
        const double turned = std::clamp((s - lead) / post, 0.0, angle);
        return Vec3(std::sin(turned), -std::cos(turned), 0.0);
    };
    for (std::size_t i = 0; i < nodes; ++i) {
        const double s = inside - static_cast<double>(nodes - 1 - i) * bench.model.segment;
        const Vec3 normal = normal_at(s), tangent(-normal.y(), normal.x(), 0.0);
        bench.state.position[i] = s <= lead ? Vec3(s, 0.0, 0.0) : Vec3(centre + post * normal + std::max(0.0, s - lead - post * angle) * tangent);
    }
    const double load = 5e-3; // N, against the tip's direction: it holds back
    const Vec3 end = normal_at(inside);
    bench.force.back() = load * Vec3(-end.y(), end.x(), 0.0);
    for (Index node = bench.first() - 1; node + 1 < nodes; ++node) bench.planes.push_back({node, 1.0, Vec3::UnitX(), -1.0});
    double sum = 0.0;
    const int steps = static_cast<int>(1.2 / dt);
    for (int k = 0; k < steps; ++k) {
        if (k > steps / 3) bench.drive.insertion -= 1e-3 * dt;
        for (RodPlane& plane : bench.planes) {
            const Vec3 out = bench.state.position[plane.node + 1] - centre;
            plane.normal = Vec3(out.x(), out.y(), 0.0).normalized();
            plane.offset = plane.normal.dot(centre) + post;
        }
        bench.step(dt);
        if (k >= steps - 20) sum += -bench.report.handle_force.x() / 20.0;
    }
    return sum / load;
}

void draw_over_posts(std::vector<LawRow>& rows) {
    const struct {
        double mu, angle;
    } cases[] = {{0.1, pi}, {0.2, pi}, {0.3, 1.5 * pi}};
    for (const auto& [mu, angle] : cases)
        for (const double dt : {1e-3, 1e-2})
            rows.push_back({"a rod drawn over a post: exp(mu theta)", "handle's pull over the load", std::exp(mu * angle),
                            measure_capstan(mu, angle, dt), 0.03 * std::exp(mu * angle),
                            fmt::format("mu {}, angle {:.1f} pi, {}", mu, angle / pi, at_step(dt))});
}

void turn_to_and_fro(std::vector<LawRow>& rows) {
    RandomRods random(285);
    for (const double dt : {1e-3, 1e-2}) {
        RodDesign design = random.design(0.2);
        design.torsion = true;
        RodBench bench(design, 0.15);
        bench.drive.friction = 0.3;
        for (const double side : {-1.0, 1.0}) bench.planes.push_back({bench.last_segment(), 1.0, Vec3(0, side, 0), 0.01 / bench.drive.contact_stiffness});
        const double torque = 2.0 * 0.3 * 0.01 * design.radius, wound = torque * 0.15 / torsion_stiffness(design);
        std::vector<double> loop[2];
        constexpr int kQuarter = 200;
        for (int k = 0; k < 3 * 4 * kQuarter; ++k) { // triangles of twice what makes it slip
            const int phase = k % (4 * kQuarter);
            const double turn = phase < kQuarter ? phase : phase < 3 * kQuarter ? 2 * kQuarter - phase : phase - 4 * kQuarter;
            bench.drive.rotation = 2.0 * wound * turn / kQuarter;
            bench.step(dt);
            if (k >= 4 * kQuarter) loop[k / (8 * kQuarter)].push_back(bench.report.handle_torque);
        }
        double largest = 0.0, apart = 0.0;
        for (std::size_t k = 0; k < loop[1].size(); ++k) {
            apart = std::max(apart, std::abs(loop[0][k] - loop[1][k]) / torque);
            largest = std::max(largest, std::abs(loop[1][k]));
        }
        rows.push_back({"turned to and fro the torque closes its loop", "largest torque over friction's", 1.0, largest / torque, 0.02, at_step(dt)});
        rows.push_back({"turned to and fro the torque closes its loop", "second loop off the third, of friction's torque", 0.0, apart, 0.01, at_step(dt)});
    }
}

void push_a_blocked_tip(std::vector<LawRow>& rows) {
    RandomRods random(286);
    for (const double dt : kStepLengths) {
        RodBench bench(random.design(0.3), 0.1);
        bench.drive.friction = 0.2;
        bench.drive.gravity = Vec3(0, 0, -1.0);
        for (const Vec3& wall : {Vec3(Vec3::UnitZ()), Vec3(-Vec3::UnitZ()), Vec3(Vec3::UnitY()), Vec3(-Vec3::UnitY())}) bench.lay_on(wall, -1e-3);
        bench.planes.push_back({bench.last_segment(), 1.0, -Vec3::UnitX(), -0.1});
        const auto press = [&] { return bench.planes.back().force; };
        std::vector<double> course;
        for (double t = 0.0; t < 0.5; t += dt) {
            bench.drive.insertion += 1.9e-3 * dt / 0.5; // less than a segment: the planes stay those of the free part
            bench.step(dt);
            course.push_back(press());
        }
        const double pushed = press();
        double spike = 0.0, before = 0.0; // before: the largest so far but for the last 50 ms
        const std::size_t lag = static_cast<std::size_t>(0.05 / dt);
        for (std::size_t k = 0; k < course.size(); ++k) {
            if (k >= lag) before = std::max(before, course[k - lag]);
            spike = std::max(spike, course[k] / std::max(pushed, before));
        }
        bench.run(1.0, dt);
        double least = 1e9, most = 0.0;
        for (double t = 0.0; t < 1.0; t += dt) {
            bench.step(dt);
            least = std::min(least, press()), most = std::max(most, press());
        }
        rows.push_back({"a blocked tip's force is steady", "largest over smallest in a second, held", 1.0, most / least, 0.05, at_step(dt)});
        rows.push_back({"a blocked tip's force has no spikes", "highest while pushed over the steady one", 1.0, spike, 0.5, at_step(dt)});
    }
}

void vary_the_stiffness(std::vector<LawRow>& rows) {
    RandomRods random(287);
    const RodDesign design = random.design(0.2);
    double reference = 0.0;
    for (const double stiffness : {1e5, 1e6, 1e7}) {
        RodBench bench(design, 0.1);
        bench.drive.contact_stiffness = stiffness;
        bench.drive.gravity = Vec3(0, 0, -9.81);
        bench.lay_on(Vec3::UnitZ(), 0.0);
        bench.planes.push_back({bench.last_segment(), 1.0, Vec3::UnitY(), 3e-3}); // aside
        bench.run(3.0, 1e-2);
        const double force = bench.planes.back().force;
        if (reference == 0.0) reference = force;
        rows.push_back({"numerical stiffness does not change forces", "force over that at 1e5 N/m", 1.0, force / reference, 0.05,
                        fmt::format("rod_stiffness {:g} N/m", stiffness)});
    }
}

/// A rod that lies in a tube of the field's size.
struct TubeRod {
    static constexpr double kGravity = 9.81; // m/s^2
    RodDesign design = straight_design(1.5, 10e-3);
    double clearance = 4.3e-3; // m
    double ei, weight, sinusoidal; // N m^2, N/m, N
    TubeRod() {
        design.young_modulus = 80e6;
        design.radius = 0.7e-3;
        design.drag = 40.0;
        ei = bending_stiffness(design);
        weight = kGravity * design.density * section_of(design);
        sinusoidal = 2.0 * std::sqrt(ei * weight / clearance);
    }
    [[nodiscard]] double half_wave() const { return pi * std::pow(ei * clearance / weight, 0.25); }
};

/// At the tube's bottom, with a wave of a hundredth of its clearance.
RodBench lie_in(const TubeRod& tube, double insertion) {
    RodBench bench(tube.design, insertion, Vec3(0, 0, -tube.clearance));
    bench.drive.gravity = Vec3(0, 0, -TubeRod::kGravity);
    for (Vec3& p : bench.state.position) {
        if (!(p.x() > 0.0)) continue;
        const double angle = 0.02 * std::sin(pi * p.x() / tube.half_wave());
        p.y() = tube.clearance * std::sin(angle), p.z() = -tube.clearance * std::cos(angle);
    }
    return bench;
}

/// Whether that wave grows under a load at the end, which keeps its place across.
bool grows(const TubeRod& tube, double load) {
    RodBench bench = lie_in(tube, 10.0 * tube.half_wave());
    bench.force.back() = Vec3(-load, 0, 0);
    for (const double side : {-1.0, 1.0}) bench.planes.push_back({bench.last_segment(), 1.0, Vec3(0, side, 0), 0.0});
    bench.others = bench.planes.size();
    const auto amplitude = [&] {
        double sum = 0.0;
        for (const Vec3& p : bench.state.position) sum += p.y() * p.y();
        return sum;
    };
    constexpr double kHelixStep = 2e-3, kSeconds = 1.5;
    double early = 0.0;
    for (double t = 0.0; t < kSeconds; t += kHelixStep) {
        bench.surround(tube.clearance);
        bench.step(kHelixStep);
        if (early == 0.0 && t > 0.5 * kSeconds) early = amplitude();
    }
    return amplitude() > early;
}

/// J/m; by how much a rod that a load has wound into a helix is above one that lies straight: bending, lift, and what the load did. Of the
/// middle, after a second in which it may settle.
double energy_of_wound(const TubeRod& tube, double load) {
    const double length = 10.0 * tube.half_wave(), turn = std::sqrt(0.5 * load / tube.ei), lean = tube.clearance * turn; // rad/m, -
    RodBench bench = lie_in(tube, length);
    for (Vec3& p : bench.state.position) {
        if (!(p.x() > 0.0)) continue;
        const double angle = turn * p.x();
        p = Vec3(p.x() * std::sqrt(1.0 - lean * lean), tube.clearance * std::sin(angle), -tube.clearance * std::cos(angle));
    }
    bench.force.back() = Vec3(-load, 0, 0);
    for (double t = 0.0; t < 1.0; t += 2e-3) {
        bench.surround(tube.clearance);
        bench.step(2e-3);
    }
    const std::vector<Vec3>& x = bench.state.position;
    const RodInternalForces inside = find_internal_forces(bench.model, bench.state, bench.drive.port);
    double energy = 0.0, along = 0.0;
    for (std::size_t i = bench.first() + 1; i + 1 < x.size(); ++i) {
        if (x[i].x() < 0.3 * length || x[i].x() > 0.7 * length) continue;
        const double segment = (x[i + 1] - x[i]).norm();
        energy += segment * (0.5 * inside.moment[i].squaredNorm() / tube.ei + tube.weight * (x[i].z() + tube.clearance)) -
                  load * (segment - (x[i + 1].x() - x[i].x()));
        along += segment;
    }
    return energy / along;
}

/// The load from which a helix is the rod's lower state, over sqrt(EI w / r): 2 sqrt(2) (Chen, Lin & Cheatham 1990).
double find_winding_load(const TubeRod& tube) {
    double low = 2.4, high = 3.3;
    for (int k = 0; k < 6; ++k) {
        const double middle = 0.5 * (low + high);
        (energy_of_wound(tube, 0.5 * middle * tube.sinusoidal) < 0.0 ? high : low) = middle;
    }
    return 0.5 * (low + high);
}

void buckle_in_a_tube(std::vector<LawRow>& rows, bool quick) {
    const TubeRod tube;
    double low = 0.9, high = 1.1;
    for (int k = 0; k < (quick ? 4 : 6); ++k) {
        const double middle = 0.5 * (low + high);
        (grows(tube, middle * tube.sinusoidal) ? high : low) = middle;
    }
    rows.push_back({"a pressed rod in a tube snakes at 2 sqrt(EI w / r)", "load over that", 1.0, 0.5 * (low + high), 0.05, "10 half waves"});
    rows.push_back({"and lies lower wound into a helix from 2 sqrt(2) sqrt(EI w / r) on", "load over that", 1.0,
                    find_winding_load(tube) / (2.0 * std::numbers::sqrt2), 0.1, "middle of 10 half waves"});
    if (quick) return;

    // Pushed on it winds; wound in one sense by k radians on a length it presses with r (P k^2 - EI k^4): r P^2 / (4 EI) at the best k.
    const double length = 10.0 * tube.half_wave();
    RodBench bench = lie_in(tube, length - 1e-3);
    bench.planes.push_back({bench.last_segment(), 1.0, -Vec3::UnitX(), -length});
    bench.others = 1;
    double share = 0.0;
    int samples = 0;
    for (int k = 0; k < 2600; ++k) {
        if (k > 100) bench.drive.insertion += 1e-5;
        bench.surround(tube.clearance);
        bench.step(5e-3);
        double wound = 0.0, turned = 0.0, middle = 0.0; // rad, with its sign and without; of the middle
        const std::vector<Vec3>& x = bench.state.position;
        for (std::size_t i = bench.first() + 1; i < x.size(); ++i) {
            const double angle = std::atan2(x[i - 1].y() * x[i].z() - x[i - 1].z() * x[i].y(), x[i - 1].y() * x[i].y() + x[i - 1].z() * x[i].z());
            wound += angle, turned += std::abs(angle);
            if (x[i].x() > 0.3 * length && x[i].x() < 0.7 * length) middle += angle;
        }
        if (turned < 2.0 * pi * 6.0 || std::abs(wound) < 0.98 * turned) continue;
        const RodInternalForces inside = find_internal_forces(bench.model, bench.state, bench.drive.port);
        double pressed = 0.0, load = 0.0, along = 0.0;
        for (std::size_t i = bench.first() + 1; i + 1 < x.size(); ++i)
            if (x[i].x() > 0.3 * length && x[i].x() < 0.7 * length) load -= inside.tension[i] * bench.model.segment, along += bench.model.segment;
        for (std::size_t j = bench.others; j < bench.planes.size(); ++j) {
            const double at = x[bench.planes[j].node + 1].x();
            if (at > 0.3 * length && at < 0.7 * length) pressed += bench.planes[j].force;
        }
        load /= along;
        const double k_sq = std::pow(middle / (0.4 * length), 2);
        share += pressed / along / (tube.clearance * (load * k_sq - tube.ei * k_sq * k_sq));
        ++samples;
    }
    rows.push_back({"a wound rod in a tube presses with r (P k^2 - EI k^4) on a length", "force over that, mean while it is wound in one sense", 1.0,
                    samples > 0 ? share / samples : 0.0, 0.1, fmt::format("middle of 10 half waves, {} steps", samples)});
}

void clamp_at_the_port(std::vector<LawRow>& rows, bool quick) {
    double off = 0.0;
    for (double length = 0.03; length <= 0.1; length += quick ? 5.35e-3 : 1.35e-3) { // past nodes of 2.5 mm
        RodDesign design = straight_design(0.12, 2.5e-3);
        design.drag = 40.0;
        RodBench bench(design, length);
        bench.force.back() = Vec3(0, 0, 0.003 * bending_stiffness(design) * 3.0 / std::pow(length, 2)); // small: 0.3 % of its length
        bench.run(30.0, 0.05);
        const double share = bench.state.position.back().z() / (0.003 * length);
        if (std::abs(share - 1.0) > std::abs(off)) off = share - 1.0;
    }
    rows.push_back({"a cantilever is clamped at its port", "tip's deflection over Euler-Bernoulli's, worst of 30 to 100 mm", 1.0, 1.0 + off, 0.01,
                    "segments of 2.5 mm"});
}

void let_ring(std::vector<LawRow>& rows) {
    for (const double dt : {1e-3, 1e-2}) {
        const double length = 0.05;
        RodDesign design = straight_design(0.07, 2.5e-3);
        RodBench bench(design, length);
        bench.drive.gravity = Vec3(0, 0, -0.1);
        bench.model.design.drag = 40.0;
        bench.run(30.0, 0.05);
        bench.model.design.drag = 0.0;
        bench.drive.gravity.setZero();
        const double period = 2.0 * pi / 3.516 * std::sqrt(design.density * section_of(design) / bending_stiffness(design)) * length * length;
        double early = 0.0, late = 0.0;
        for (int k = 0; k < static_cast<int>(10.0 * period / dt); ++k) {
            bench.step(dt);
            late = bench.report.kinetic_j + bench.report.bend_j;
            if (k == static_cast<int>(2.0 * period / dt)) early = late;
        }
        rows.push_back({"a free rod rings on", "log decrement a period of the first mode", 0.0, 0.5 * std::log(early / late) / 8.0, dt < 5e-3 ? 0.02 : 0.05,
                        at_step(dt)});
    }
}

void balance_forces(std::vector<LawRow>& rows) {
    RandomRods random(288);
    for (const double dt : kStepLengths) {
        double worst = 0.0, unsettled = 0.0;
        for (int rod = 0; rod < 2; ++rod) {
            const RodDesign design = random.design(0.2);
            RodBench bench(design, 0.1);
            bench.drive.gravity = Vec3(0, 1.0, -5.0);
            bench.drive.friction = 0.3;
            bench.lay_on(Vec3::UnitZ(), -1e-3);
            for (int k = 0; k < 100; ++k) {
                bench.drive.insertion += 2e-3 * dt * (k < 50 ? 1.0 : -1.0);
                bench.step(dt);
                unsettled += bench.report.unconverged;
                const RodReport& report = bench.report;
                const double sum = (report.handle_force + report.contact_force + report.body_force).norm();
                worst = std::max(worst, sum / (report.contact_force.norm() + bench.weight()));
            }
        }
        rows.push_back({"handle, contacts, loads and inertia add up to nothing", "their sum over the largest", 0.0, worst, 1e-2, at_step(dt)});
        rows.push_back({"handle, contacts, loads and inertia add up to nothing", "solves of 200 that had not settled", 0.0, unsettled, 2.0, at_step(dt)});
    }
}

/// Tension, moment and torque along a rod that is loaded at its end.
void look_inside(std::vector<LawRow>& rows) {
    RodDesign design = straight_design(0.12, 2.5e-3);
    design.drag = 40.0;
    design.torsion = true;
    RodBench bench(design, 0.1);
    const double aside = 0.003 * bending_stiffness(design) * 3.0 / 0.01; // N
    bench.force.back() = Vec3(0.05, 0, aside);
    bench.run(30.0, 0.05);
    const RodInternalForces inside = find_internal_forces(bench.model, bench.state, bench.drive.port);
    const std::size_t middle = bench.model.node_count() - 1 - 20; // 50 mm from the tip
    const double lever = bench.state.position.back().x() - bench.state.position[middle].x();
    const double stiffened = aside * lever - 0.05 * (bench.state.position.back().z() - bench.state.position[middle].z());
    rows.push_back({"inside a loaded rod", "tension over the pull", 1.0, inside.tension[middle] / 0.05, 0.01, "cantilever of 100 mm"});
    rows.push_back({"inside a loaded rod", "bending moment over force times lever", 1.0, std::sqrt(inside.moment[middle].squaredNorm()) / stiffened, 0.01,
                    "cantilever of 100 mm"});
}

} // namespace

std::vector<LawRow> measure_rod_laws(bool quick) {
    std::vector<LawRow> rows;
    rest_on_floor(rows);
    hold_what_was_dragged(rows, quick);
    hold_what_was_turned(rows, quick);
    draw_over_posts(rows);
    turn_to_and_fro(rows);
    push_a_blocked_tip(rows);
    vary_the_stiffness(rows);
    buckle_in_a_tube(rows, quick);
    clamp_at_the_port(rows, quick);
    let_ring(rows);
    balance_forces(rows);
    look_inside(rows);
    return rows;
}

} // namespace trocar::engine
