#include "fem/tissue/validation.hpp"

#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/statics.hpp"

#include <cmath>
#include <limits>
#include <numbers>

namespace trocar::fem {

namespace {

constexpr double kYoung = 20000.0, kDensity = 1000.0; // Pa, kg/m^3

TissueModel make_body(const TetMesh& mesh, MaterialLaw law, double poisson_ratio, std::vector<Index> pinned = {}, double viscosity = 0.0,
                      TetElements elements = TetElements::Automatic) {
    Material material{.law = law, .young_modulus = kYoung, .poisson_ratio = poisson_ratio, .density = kDensity, .viscosity = viscosity};
    material.elements = elements;
    return make_tissue_model(mesh, material, pinned).value();
}

std::vector<Index> nodes_at(const TetMesh& mesh, double x) {
    std::vector<Index> nodes;
    for (Index node = 0; node < mesh.vertices.size(); ++node)
        if (std::abs(mesh.vertices[node][0] - x) < 1e-9) nodes.push_back(node);
    return nodes;
}

double derived_step(const TissueModel& model, Integrator integrator) {
    StableStepWorkspace workspace;
    return find_stable_step(model, model.rest_position, nullptr, workspace, integrator).step;
}

std::vector<Vec3> forces_at(const TissueModel& model, const std::vector<Vec3>& position) {
    std::vector<Vec3> force(position.size(), Vec3::Zero());
    const std::vector<Vec3> still = force;
    (void)add_tet_forces(model, position, still, force);
    return force;
}

/// A bar that tumbles and wobbles.
TissueState thrown(const TissueModel& model) {
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < model.node_count(); ++node) {
        const Vec3& x = model.rest_position[node];
        state.velocity[node] = Vec3(0.3, -0.2, 0.5) + Vec3(3, 5, -4).cross(x) + Vec3(0, 8 * x[0] * x[0] / 0.04, 4 * x[1]);
    }
    return state;
}

} // namespace

double patch_error(MaterialLaw law) {
    constexpr double kSide = 0.04;
    const TissueModel model = make_body(make_bar_mesh({4, 4, 4}, 0.25 * kSide, 0.15), law, 0.4);
    Mat3 stretch;
    stretch << 1.08, 0.05, -0.02, 0.01, 0.93, 0.04, -0.03, 0.02, 1.05;
    std::vector<Vec3> position;
    for (const Vec3& x : model.rest_position) position.push_back(stretch * x);
    const std::vector<Vec3> force = forces_at(model, position);
    double inside = 0.0, outside = 0.0;
    for (std::size_t node = 0; node < force.size(); ++node) {
        const Vec3& x = model.rest_position[node];
        const bool within = x.minCoeff() > 1e-9 && x.maxCoeff() < kSide - 1e-9;
        (within ? inside : outside) = std::max(within ? inside : outside, force[node].norm());
    }
    return inside / outside;
}

double axial_mode_ratio(MaterialLaw law, Index cells) {
    constexpr double kLength = 0.4;
    const double cell = kLength / cells;
    const TissueModel model = make_body(make_bar_mesh({cells, 2, 2}, cell, 0.0), law, 0.0);
    std::vector<double> mode;
    TissueState state = make_rest_state(model);
    for (const Vec3& x : model.rest_position) mode.push_back(std::cos(std::numbers::pi * x[0] / kLength));
    for (std::size_t node = 0; node < mode.size(); ++node) state.velocity[node] = Vec3(1e-4 * mode[node], 0.0, 0.0);
    const auto amplitude = [&] {
        double sum = 0.0;
        for (std::size_t node = 0; node < mode.size(); ++node) sum += model.node_mass[node] * mode[node] * state.velocity[node][0];
        return sum;
    };
    RkWorkspace workspace;
    const double h = 0.25 * derived_step(model, Integrator::Rk4);
    double time = 0.0, before = amplitude(), first = 0.0, last = 0.0;
    for (int crossings = 0; crossings < 9;) {
        (void)integrate_rk4(model, state, h, 1, {}, workspace);
        time += h;
        const double now = amplitude();
        if ((now < 0.0) != (before < 0.0)) {
            last = time - h * now / (now - before);
            if (crossings++ == 0) first = last;
        }
        before = now;
    }
    return 4.0 / (last - first) / (std::sqrt(kYoung / kDensity) / (2.0 * kLength));
}

/// omega^2 u = M^-1 K u on nodes far from the faces.
double wave_speed_ratio(Wave wave, double poisson_ratio) {
    constexpr Index kCells = 24;
    constexpr double kCell = 0.01, kNumber = 2.0 * std::numbers::pi / (kCells * kCell); // one wave in the block
    const TetMesh mesh = make_bar_mesh({kCells, 8, 8}, kCell, 0.1);
    const TissueModel model = make_body(mesh, MaterialLaw::NeoHookean, poisson_ratio);
    const Vec3 along = wave == Wave::Pressure ? Vec3::UnitX() : Vec3::UnitY();
    std::vector<Vec3> u, product(mesh.vertices.size(), Vec3::Zero());
    for (const Vec3& x : mesh.vertices) u.push_back(std::sin(kNumber * x[0]) * along);
    (void)add_stiffness_product(model, model.rest_position, u, product);
    const auto is_inner = [&](double at, double cells) { return at > 2.5 * kCell && at < (cells - 2.5) * kCell; };
    double work = 0.0, mass = 0.0;
    for (std::size_t node = 0; node < u.size(); ++node) {
        const Vec3& x = mesh.vertices[node];
        if (!is_inner(x[1], 8) || !is_inner(x[2], 8) || x[0] < 1.5 * kCell || x[0] > (kCells - 1.5) * kCell) continue;
        work += u[node].dot(product[node]);
        mass += model.node_mass[node] * u[node].squaredNorm();
    }
    const double mu = kYoung / (2.0 * (1.0 + poisson_ratio)),
                 lambda = kYoung * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio));
    return std::sqrt(work / mass) / kNumber / std::sqrt((wave == Wave::Pressure ? lambda + 2.0 * mu : mu) / kDensity);
}

double cantilever_ratio(Index cells_across, double poisson_ratio, TetElements elements, const Mat3& turn) {
    constexpr double kSide = 0.1, kLength = 0.4, kLoad = 1e-3;
    TetMesh mesh = make_bar_mesh({4 * cells_across, cells_across, cells_across}, kSide / cells_across, 0.0);
    const std::vector<Index> clamped = nodes_at(mesh, 0.0), end = nodes_at(mesh, kLength);
    for (Vec3& x : mesh.vertices) x = turn * x;
    const TissueModel model = make_body(mesh, MaterialLaw::NeoHookean, poisson_ratio, clamped, 0.0, elements);
    std::vector<Vec3> force(model.node_count(), Vec3::Zero());
    double weight = 0.0, tip = 0.0;
    for (const Index node : end) weight += model.node_mass[node];
    const Vec3 way = turn.col(2);
    for (const Index node : end) force[node] = kLoad * model.node_mass[node] / weight * way;
    const std::vector<Vec3> u = solve_small_strain(model, force);
    for (const Index node : end) tip += u[node].dot(way) / static_cast<double>(end.size());
    const double area = kSide * kSide, inertia = kSide * area * kSide / 12.0, shear = kYoung / (2.0 * (1.0 + poisson_ratio));
    const double coefficient = 10.0 * (1.0 + poisson_ratio) / (12.0 + 11.0 * poisson_ratio); // Cowper 1966
    return tip / (kLoad * kLength * kLength * kLength / (3.0 * kYoung * inertia) + kLoad * kLength / (coefficient * shear * area));
}

double bulk_ratio(MaterialLaw law) {
    constexpr double kPoisson = 0.4, kSqueeze = 1e-6, kBulk = kYoung / (3.0 * (1.0 - 2.0 * kPoisson)), kSide = 0.04;
    const TissueModel model = make_body(make_bar_mesh({4, 4, 4}, 0.25 * kSide, 0.15), law, kPoisson);
    std::vector<Vec3> position;
    for (const Vec3& x : model.rest_position) position.push_back((1.0 - kSqueeze) * x);
    const std::vector<Vec3> force = forces_at(model, position);
    double push = 0.0;
    for (const Index node : nodes_at({model.rest_position, {}}, kSide)) push += force[node][0];
    return push / (kSide * kSide) / (3.0 * kBulk * kSqueeze);
}

FreeFlight free_flight_error(MaterialLaw law, double share) {
    const TissueModel model = make_body(make_bar_mesh({6, 2, 2}, 0.01, 0.15), law, 0.4, {}, 0.1);
    TissueState state = thrown(model);
    const Momentum before = find_momentum(model, state);
    RkWorkspace workspace;
    constexpr double kDuration = 0.1;
    (void)integrate_rk4(model, state, kDuration, static_cast<unsigned>(kDuration / (share * derived_step(model, Integrator::Rk4))) + 1, {},
                        workspace);
    const Momentum after = find_momentum(model, state);
    return {(after.linear - before.linear).norm() / before.linear.norm(), (after.angular - before.angular).norm() / before.angular.norm()};
}

std::vector<StepError> step_errors(Integrator integrator, int levels) {
    constexpr double kDuration = 0.05;
    const TetMesh mesh = make_bar_mesh({4, 1, 1}, 0.01, 0.0);
    const TissueModel model = make_body(mesh, MaterialLaw::NeoHookean, 0.3, nodes_at(mesh, 0.0));
    const auto run = [&](unsigned substeps, Integrator with) {
        TissueState state = make_rest_state(model);
        RkWorkspace workspace;
        (void)integrate(model, state, kDuration, substeps, {.gravity = Vec3(0, 0, -9.81)}, with, workspace);
        return state.position;
    };
    const unsigned coarse = 4 * static_cast<unsigned>(kDuration / derived_step(model, integrator)) + 2;
    const std::vector<Vec3> exact = run(coarse << (levels + 3), Integrator::Rk4);
    std::vector<StepError> errors;
    for (int level = 0; level <= levels; ++level) {
        const std::vector<Vec3> position = run(coarse << level, integrator);
        StepError& error = errors.emplace_back(StepError{kDuration / (coarse << level), 0.0});
        for (std::size_t node = 0; node < position.size(); ++node)
            error.error = std::max(error.error, (position[node] - exact[node]).norm());
    }
    return errors;
}

std::vector<double> energy_over_time(Integrator integrator, double share, double seconds) {
    const TissueModel model = make_body(make_bar_mesh({6, 2, 2}, 0.01, 0.15), MaterialLaw::NeoHookean, 0.3);
    TissueState state = thrown(model);
    RkWorkspace workspace;
    constexpr double kFrame = 0.1;
    const auto substeps = static_cast<unsigned>(kFrame / (share * derived_step(model, integrator))) + 1;
    double first = 0.0;
    for (std::size_t node = 0; node < model.node_count(); ++node) first += 0.5 * model.node_mass[node] * state.velocity[node].squaredNorm();
    std::vector<double> energy{1.0};
    while (0.1 * static_cast<double>(energy.size()) < seconds + 0.05) {
        const IntegrateReport report = integrate(model, state, kFrame, substeps, {}, integrator, workspace);
        energy.push_back((report.kinetic_j + report.elastic_j) / first);
    }
    return energy;
}

double growth_at_edge(MaterialLaw law, Integrator integrator, double share, unsigned steps) {
    const TissueModel model = make_body(make_bar_mesh({2, 2, 1}, 0.01, 0.0), law, 0.3);
    StableStepWorkspace exact;
    exact.cold_rounds = 200; // to the last digit on so small a body
    const double omega = find_stable_step(model, model.rest_position, nullptr, exact, integrator).tissue_omega;
    const double h = share * (integrator == Integrator::Rk4 ? 2.0 * std::numbers::sqrt2 : kLeapfrogLimit) / omega;
    TissueState state = make_rest_state(model);
    double first = 0.0;
    for (std::size_t node = 0; node < model.node_count(); ++node) {
        const double phase = static_cast<double>(node);
        state.velocity[node] = 1e-7 * Vec3(std::sin(1.7 * phase + 1.0), std::sin(2.3 * phase), std::sin(3.1 * phase + 2.0));
        first += 0.5 * model.node_mass[node] * state.velocity[node].squaredNorm();
    }
    RkWorkspace workspace;
    const IntegrateReport report = integrate(model, state, steps * h, steps, {}, integrator, workspace);
    return report.finite() ? (report.kinetic_j + report.elastic_j) / first : std::numeric_limits<double>::infinity();
}

} // namespace trocar::fem
