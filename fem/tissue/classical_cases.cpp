#include "fem/tissue/classical_cases.hpp"

#include "base/trig.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "fem/mesh/mapped_mesh.hpp"
#include "fem/tissue/case_bodies.hpp"
#include "fem/tissue/forces.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/law_validation.hpp"
#include "fem/tissue/statics.hpp"
#include "fem/tissue/validation.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace trocar::fem {

namespace {

constexpr double kPi = std::numbers::pi;

} // namespace

double cook_tip(Index cells, TetElements elements) {
    const TetMesh mesh =
        make_mapped_grid({cells, cells, 1}, [](double u, double v, double w) { return Vec3(48.0 * u, 44.0 * u + v * (44.0 - 28.0 * u), w); });
    const TissueModel model = make_body(mesh, 1.0, 1.0 / 3.0, elements, nodes_across(mesh, 0, 0.0));
    Field force(model.node_count(), Vec3::Zero());
    const std::vector<Index> end = nodes_across(mesh, 0, 48.0);
    for (const Index node : end) {
        const bool edge = mesh.vertices[node][1] < 44.01 || mesh.vertices[node][1] > 59.99;
        force[node][1] = (edge ? 0.25 : 0.5) / cells; // 1 in all, over both faces
    }
    const Field u = solve_small_strain(model, force);
    double tip = 0.0;
    for (const Index node : end)
        if (std::abs(mesh.vertices[node][1] - 52.0) < 0.01) tip += 0.5 * u[node][1];
    return tip;
}

double block_sink(Index cells, double poisson_ratio, TetElements elements) {
    const TetMesh mesh = make_bar_mesh({cells, cells, cells}, 1.0 / cells, 0.0);
    const TissueModel model = make_body(mesh, 5000.0, poisson_ratio, elements, nodes_across(mesh, 2, 0.0));
    Field force(model.node_count(), Vec3::Zero());
    double all = 0.0;
    const auto weight = [&](const Vec3& x) { // of a node's share of the loaded square: half on its edge
        const Vec3 off = (x - Vec3(0.5, 0.5, 1.0)).cwiseAbs();
        if (off.maxCoeff() > 0.25 + 1e-9) return 0.0;
        return (off[0] > 0.25 - 1e-9 ? 0.5 : 1.0) * (off[1] > 0.25 - 1e-9 ? 0.5 : 1.0);
    };
    for (const Index node : nodes_across(mesh, 2, 1.0)) all += weight(mesh.vertices[node]);
    for (const Index node : nodes_across(mesh, 2, 1.0)) force[node][2] = -weight(mesh.vertices[node]) / all;
    double sink = 0.0;
    const Field u = solve_small_strain(model, force);
    for (std::size_t node = 0; node < u.size(); ++node) sink += u[node].dot(force[node]); // work: the mean under the load
    return sink;
}

double hollow_sphere_ratio(Index cells, double poisson_ratio, TetElements elements) {
    const TriMesh sphere = make_octasphere(static_cast<Index>(std::lround(0.75 * kPi * cells))); // as wide as high in the wall's middle
    const TetMesh mesh = make_layered_mesh(sphere, cells, [&](Index v, double share) { return Vec3((1.0 + share) * sphere.vertices[v]); });
    const TissueModel model = make_body(mesh, 1.0, poisson_ratio, elements);
    const Field u = solve_small_strain(model, press_out(mesh, sphere));
    double widened = 0.0;
    for (std::size_t v = 0; v < sphere.vertices.size(); ++v) widened += u[v].dot(sphere.vertices[v]) / static_cast<double>(sphere.vertices.size());
    const double a3 = 1.0, b3 = 8.0; // p a / (E (b^3 - a^3)) ((1 - 2 nu) a^3 + (1 + nu) b^3 / 2)
    return widened / (((1.0 - 2.0 * poisson_ratio) * a3 + (1.0 + poisson_ratio) * 0.5 * b3) / (b3 - a3));
}

namespace {

/// A tube of a vessel's wall, radii 1 and 1.4, along z.
struct Tube {
    TetMesh mesh; // [layers + 1][cells + 1][around] nodes
    TriMesh bore; // its nodes are the mesh's
    std::vector<Triangle> section; // of the first section's nodes
    Index around = 0, layers = 0, on_a_section = 0;
};

constexpr double kTubeOuter = 1.4;

Tube make_tube(Index cells, double length) {
    const double cell = (kTubeOuter - 1.0) / cells;
    Tube tube;
    tube.around = 2 * static_cast<Index>(std::lround(kPi * 1.2 / cell));
    tube.layers = static_cast<Index>(std::max(1L, std::lround(length / cell)));
    const Index around = tube.around;
    TriMesh flat; // [cells + 1][around]
    for (Index r = 0; r <= cells; ++r)
        for (Index j = 0; j < around; ++j) {
            const double radius = 1.0 + cell * r, angle = 2.0 * kPi * j / around;
            flat.vertices.push_back(radius * Vec3(std::cos(angle), std::sin(angle), 0.0));
        }
    const auto id = [&](Index r, Index j) { return r * around + j % around; };
    for (Index r = 0; r < cells; ++r)
        for (Index j = 0; j < around; ++j) { // diagonals alternate
            const Index a = id(r, j), b = id(r + 1, j), c = id(r + 1, j + 1), d = id(r, j + 1);
            if ((r + j) % 2 == 0)
                flat.triangles.push_back({a, b, c}), flat.triangles.push_back({a, c, d});
            else
                flat.triangles.push_back({a, b, d}), flat.triangles.push_back({b, c, d});
        }
    tube.mesh = make_layered_mesh(flat, tube.layers, [&](Index v, double share) { return Vec3(flat.vertices[v] + Vec3(0, 0, length * share)); });
    tube.on_a_section = static_cast<Index>(flat.vertices.size());
    tube.section = flat.triangles;
    for (Index layer = 0; layer < tube.layers; ++layer)
        for (Index j = 0; j < around; ++j) {
            const Index a = layer * tube.on_a_section + id(0, j), b = layer * tube.on_a_section + id(0, j + 1), up = tube.on_a_section;
            tube.bore.triangles.push_back({a, b, b + up}), tube.bore.triangles.push_back({a, b + up, a + up});
        }
    return tube;
}

/// Of a bore of radius 1, in the tube's middle: the mean radial displacement of its nodes.
template <class Displacement>
double widening_of(const Tube& tube, const Displacement& displacement) {
    double widened = 0.0;
    for (const Index section : {tube.layers / 2, (tube.layers + 1) / 2})
        for (Index j = 0; j < tube.around; ++j) {
            const Vec3& rest = tube.mesh.vertices[j];
            widened += displacement(section * tube.on_a_section + j).dot(Vec3(rest.x(), rest.y(), 0.0)) / (2.0 * tube.around);
        }
    return widened;
}

/// A thick tube without a force along its axis at large strains: d(P_r)/dR = (P_around - P_r) / R over the wall (Runge-Kutta of fourth order), one stretch along the
/// axis. Stretches and stresses are those around, along the axis and across the wall.
class InflatedTube {
public:
    explicit InflatedTube(const Material& material) : material_(material) {}

    /// Pa, of the bore's area at rest: what widens a bore of radius 1 by so much. axial_stress() is of the last one.
    [[nodiscard]] double find_load(double widening) {
        double low = 0.5, high = 1.5;
        for (int round = 0; round < kRounds; ++round) {
            axial_ = 0.5 * (low + high);
            (void)free_load(widening);
            (pull_ < 0.0 ? low : high) = axial_;
        }
        return free_load(widening);
    }

    /// Pa, of the area at rest, on a section; between the places of the integration linear.
    [[nodiscard]] double axial_stress(double radius) const {
        const double at = std::clamp((radius - 1.0) / (kTubeOuter - 1.0), 0.0, 1.0) * kSteps;
        const int i = std::min(static_cast<int>(at), kSteps - 1);
        return axial_stress_[i] + (at - i) * (axial_stress_[i + 1] - axial_stress_[i]);
    }

private:
    static constexpr int kSteps = 50, kRounds = 45;

    /// Pa, that leaves the outer face free.
    [[nodiscard]] double free_load(double widening) {
        double low = 0.0, high = material_.young_modulus;
        while (outer_stress(high, widening) > 0.0) low = high, high *= 2.0;
        for (int round = 0; round < kRounds; ++round) {
            const double middle = 0.5 * (low + high);
            (outer_stress(middle, widening) > 0.0 ? low : high) = middle;
        }
        return 0.5 * (low + high);
    }

    /// Pa, P_r at the outer face where the bore is pressed by `load`: the more, the less.
    [[nodiscard]] double outer_stress(double load, double widening) {
        double r = 1.0 + widening, stress = -load;
        across_ = 1.0 / r, pull_ = 0.0;
        const double step = (kTubeOuter - 1.0) / kSteps;
        for (int i = 0; i < kSteps; ++i) {
            const double at = 1.0 + step * i;
            const auto k1 = slope(at, r, stress), k2 = slope(at + 0.5 * step, r + 0.5 * step * k1[0], stress + 0.5 * step * k1[1]);
            const auto k3 = slope(at + 0.5 * step, r + 0.5 * step * k2[0], stress + 0.5 * step * k2[1]);
            const auto k4 = slope(at + step, r + step * k3[0], stress + step * k3[1]);
            r += step / 6.0 * (k1[0] + 2.0 * k2[0] + 2.0 * k3[0] + k4[0]);
            stress += step / 6.0 * (k1[1] + 2.0 * k2[1] + 2.0 * k3[1] + k4[1]);
            pull_ += step / 6.0 * (k1[2] + 2.0 * k2[2] + 2.0 * k3[2] + k4[2]);
            axial_stress_[i] = k1[2] / at;
        }
        axial_stress_[kSteps] = slope(kTubeOuter, r, stress)[2] / kTubeOuter;
        return stress;
    }

    /// dr/dR, which is the stretch across the wall, d(P_r)/dR, and P_axis R.
    [[nodiscard]] std::array<double, 3> slope(double at, double r, double stress) {
        const double around = r / at;
        const auto left = [&](double across) {
            const double l[3] = {around, axial_, across};
            return principal_stress(material_, l, 2) - stress;
        };
        for (int round = 0; round < 30; ++round) { // Newton's method, from the last place's stretch
            constexpr double kSmall = 1e-7;
            const double f = left(across_), change = -f * kSmall / (left(across_ + kSmall) - f);
            across_ += change;
            if (std::abs(change) < 1e-12) break;
        }
        const double l[3] = {around, axial_, across_};
        return {across_, (principal_stress(material_, l, 0) - stress) / at, principal_stress(material_, l, 1) * at};
    }

    Material material_;
    double across_ = 1.0, axial_ = 1.0;
    double pull_ = 0.0; // N over 2 pi, along the axis
    std::array<double, kSteps + 1> axial_stress_{};
};

} // namespace

double ring_ratio(Index cells, double poisson_ratio, TetElements elements) {
    const Tube ring = make_tube(cells, (kTubeOuter - 1.0) / cells); // one layer
    const TissueModel model = make_body(ring.mesh, 1.0, poisson_ratio, elements);
    const Field u = solve_small_strain(model, press_out(ring.mesh, ring.bore));
    const double widened = widening_of(ring, [&](Index node) -> const Vec3& { return u[node]; });
    const double b2 = kTubeOuter * kTubeOuter; // p a / (E (b^2 - a^2)) ((1 - nu) a^2 + (1 + nu) b^2)
    return widened / (((1.0 - poisson_ratio) + (1.0 + poisson_ratio) * b2) / (b2 - 1.0));
}

double artery_ratio(Index cells, double widening, TetElements elements) {
    constexpr double kLong = 1.2;                                     // three times the wall: a flat ring would tip over
    constexpr double kLoadTime = 2.0, kRestTime = 4.0, kFrame = 0.05; // s: the tube breathes once in 2 s
    constexpr double kShear = 3000.0, kFibres = 2363.2, kExponent = 0.8393, kAngle = 29.0 * kPi / 180.0; // Pa, Pa, [-], rad: of the media
    Material material{.law = MaterialLaw::Hgo, .poisson_ratio = 0.49, .density = 1000.0, .mass_damping = 4.0};
    material.young_modulus = 2.0 * (1.0 + material.poisson_ratio) * kShear;
    material.k1 = kFibres, material.k2 = kExponent;
    material.fibre1 = Vec3(std::cos(kAngle), std::sin(kAngle), 0.0);
    InflatedTube expected(material);
    const double load = expected.find_load(widening);
    material.elements = elements;
    material.fibre_axis = Vec3::UnitZ(), material.fibre_angle = kAngle;
    const Tube tube = make_tube(cells, kLong);
    const TissueModel model = make_tissue_model(tube.mesh, material, {}).value();
    Field force = press_out(tube.mesh, tube.bore);
    for (Vec3& f : force) f *= load;
    const Index last = tube.layers * tube.on_a_section;
    for (const Triangle& t : tube.section) {
        const Vec3 &a = tube.mesh.vertices[t[0]], &b = tube.mesh.vertices[t[1]], &c = tube.mesh.vertices[t[2]], middle = (a + b + c) / 3.0;
        const double share = (b - a).cross(c - a).norm() / 6.0 * expected.axial_stress(std::hypot(middle.x(), middle.y()));
        for (const Index node : t) force[node].z() -= share, force[last + node].z() += share;
    }
    Field now(force.size());
    TissueState state = make_rest_state(model);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    for (double t = 0.0; t < kLoadTime + kRestTime; t += kFrame) {
        for (std::size_t node = 0; node < now.size(); ++node) now[node] = std::min(1.0, (t + kFrame) / kLoadTime) * force[node];
        if (advance(model, state, kFrame, {.external_force = now}, {.max_substeps = 20000}, workspace, stable).refused) return 0.0;
    }
    return widening_of(tube, [&](Index node) { return Vec3(state.position[node] - model.rest_position[node]); }) / widening;
}

double torsion_ratio(Index cells_across, double poisson_ratio, TetElements elements) {
    // Tangential forces on both ends that grow as the distance from the axis: away from the ends any torque twists alike.
    constexpr double kLong = 4.0;
    const Index along = static_cast<Index>(kLong) * cells_across;
    TetMesh mesh = make_bar_mesh({along, cells_across, cells_across}, 1.0 / cells_across, 0.0);
    for (Vec3& x : mesh.vertices) x -= Vec3(0.0, 0.5, 0.5);
    const TissueModel model = make_body(mesh, 1.0, poisson_ratio, elements);
    Field force(model.node_count(), Vec3::Zero());
    double torque = 0.0;
    const auto area = [](const Vec3& x) { return (std::abs(x.y()) > 0.4999 ? 0.5 : 1.0) * (std::abs(x.z()) > 0.4999 ? 0.5 : 1.0); };
    for (const double end : {0.0, kLong})
        for (const Index node : nodes_across(mesh, 0, end)) {
            const Vec3 across = (end > 0.0 ? 1.0 : -1.0) * area(mesh.vertices[node]) * Vec3::UnitX().cross(mesh.vertices[node]);
            force[node] = across;
            if (end > 0.0) torque += mesh.vertices[node].cross(across).x();
        }
    const Field u = solve_small_strain(model, force);
    const auto turned = [&](double x) { // of a section: least squares
        double moment = 0.0, size = 0.0;
        for (const Index node : nodes_across(mesh, 0, x)) {
            const Vec3& at = mesh.vertices[node];
            moment += at.cross(u[node]).x(), size += at.y() * at.y() + at.z() * at.z();
        }
        return moment / size;
    };
    const double shear = 1.0 / (2.0 * (1.0 + poisson_ratio)), rate = 0.5 * (turned(3.0) - turned(1.0));
    return torque / rate / (0.140577 * shear);
}

namespace {

/// rad/s times sqrt(rho / E) times the side: the least frequency of a Timoshenko cantilever of a square section, side 1. source: shooting from
/// the clamp with both unknown loads there, and where no combination leaves the end without loads.
double timoshenko_frequency(double length, double poisson_ratio) {
    const double inertia = 1.0 / 12.0, shear = 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio) / (2.0 * (1.0 + poisson_ratio));
    const auto determinant = [&](double omega) {
        std::array<double, 2> end[2];
        for (int load = 0; load < 2; ++load) {
            std::array<double, 4> y{0.0, 0.0, load == 0 ? 1.0 : 0.0, load == 1 ? 1.0 : 0.0}; // deflection, turn, moment, shear force
            const auto rate = [&](const std::array<double, 4>& s) {
                return std::array<double, 4>{s[1] + s[3] / shear, s[2] / inertia, -s[3] - omega * omega * inertia * s[1], -omega * omega * s[0]};
            };
            constexpr int kSteps = 400;
            const double h = length / kSteps;
            const auto ahead = [](std::array<double, 4> s, const std::array<double, 4>& d, double part) {
                for (std::size_t k = 0; k < 4; ++k) s[k] += part * d[k];
                return s;
            };
            for (int i = 0; i < kSteps; ++i) {
                const auto k1 = rate(y), k2 = rate(ahead(y, k1, 0.5 * h)), k3 = rate(ahead(y, k2, 0.5 * h)), k4 = rate(ahead(y, k3, h));
                for (std::size_t k = 0; k < 4; ++k) y[k] += h / 6.0 * (k1[k] + 2.0 * k2[k] + 2.0 * k3[k] + k4[k]);
            }
            end[load] = {y[2], y[3]};
        }
        return end[0][0] * end[1][1] - end[0][1] * end[1][0];
    };
    const double slender = 3.51601527 / (length * length) * std::sqrt(inertia);
    double low = 0.5 * slender, high = 1.05 * slender;
    const bool sign = determinant(low) > 0.0;
    for (int round = 0; round < 60; ++round) {
        const double middle = 0.5 * (low + high);
        ((determinant(middle) > 0.0) == sign ? low : high) = middle;
    }
    return 0.5 * (low + high);
}

} // namespace

double bending_mode_ratio(Index cells_across, double poisson_ratio, TetElements elements) {
    constexpr Index kSlender = 10;
    const TetMesh mesh = make_bar_mesh({kSlender * cells_across, cells_across, cells_across}, 1.0 / cells_across, 0.0);
    const TissueModel model = make_body(mesh, 1.0, poisson_ratio, elements, nodes_across(mesh, 0, 0.0), 1.0);
    Field u, force(model.node_count(), Vec3::Zero());
    for (const Vec3& x : mesh.vertices) u.push_back(Vec3(0.0, 0.0, x.x() * x.x()));
    double frequency_sq = 0.0;
    for (int round = 0; round < 4; ++round) { // inverse iteration on M u; Rayleigh's quotient
        for (std::size_t i = 0; i < u.size(); ++i) force[i] = model.node_mass[i] * u[i];
        const Field next = solve_small_strain(model, force);
        double work = 0.0, mass = 0.0, most = 0.0;
        for (std::size_t i = 0; i < u.size(); ++i) {
            work += next[i].dot(force[i]), mass += model.node_mass[i] * next[i].squaredNorm();
            most = std::max(most, next[i].norm());
        }
        frequency_sq = work / mass;
        for (std::size_t i = 0; i < u.size(); ++i) u[i] = next[i] / most;
    }
    return std::sqrt(frequency_sq) / timoshenko_frequency(kSlender, poisson_ratio);
}

TurnedBar turn_bar(MaterialLaw law, Index cells_across) {
    constexpr double kTurnTime = 2.0, kRestTime = 2.0, kFrame = 0.01; // s
    const double side = 0.02;
    TetMesh mesh = make_bar_mesh({6 * cells_across, cells_across, cells_across}, side / cells_across, 0.0);
    for (Vec3& x : mesh.vertices) x -= Vec3(0.0, 0.5 * side, 0.5 * side);
    std::vector<Index> held = nodes_across(mesh, 0, 0.0);
    for (const Index node : nodes_across(mesh, 0, 6.0 * side)) held.push_back(node);
    const double mu = 5000.0 / 2.9;
    Material material{.law = law, .young_modulus = 5000.0, .poisson_ratio = 0.45, .density = 1000.0, .viscosity = 2.0, .mass_damping = 20.0};
    material.c10 = 0.35 * mu, material.c01 = 0.15 * mu;
    material.alpha1 = 2.0, material.mu1 = mu;
    material.k1 = 500.0, material.k2 = 0.1;
    const TissueModel model = make_tissue_model(mesh, material, held).value();
    TissueState state = make_rest_state(model);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    Field target(model.pinned.size());
    TurnedBar turned;
    for (double t = kFrame; t < 2.0 * kTurnTime + kRestTime; t += kFrame) {
        const double share = t < kTurnTime ? t / kTurnTime : std::max(0.0, 2.0 - t / kTurnTime);
        for (std::size_t k = 0; k < target.size(); ++k) {
            const Vec3& rest = model.rest_position[model.pinned[k]];
            target[k] = rest.x() > side ? Vec3(rotation_about(Vec3::UnitX(), 2.0 * kPi * share) * rest) : rest;
        }
        const AdvanceReport report = advance(model, state, kFrame, {.pinned_target = target}, {.max_substeps = 20000}, workspace, stable);
        turned.inverted = std::max(turned.inverted, static_cast<unsigned>(report.integrate.inverted));
        turned.peak_j = std::max(turned.peak_j, report.integrate.elastic_j);
        turned.energy_left = report.integrate.elastic_j + report.integrate.kinetic_j;
        if (report.refused || !report.integrate.finite()) return {1e9, turned.inverted, turned.peak_j, 1e9};
    }
    turned.energy_left /= turned.peak_j;
    for (std::size_t node = 0; node < model.node_count(); ++node)
        turned.left = std::max(turned.left, (state.position[node] - model.rest_position[node]).norm() / side);
    return turned;
}

} // namespace trocar::fem
