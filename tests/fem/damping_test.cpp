// The law of docs/tissue.md, measured: what `viscosity` and `mass_damping` multiply, and how fast a free oscillation dies away.
#include "bodies.hpp"
#include "fem/tissue/integrate.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

namespace trocar::fem {
namespace {

using namespace test;

constexpr double kPi = 3.14159265358979323846;

/// 2 viscosity, times the square of the rate of Green strain, over the rest volume: what the drag takes from the body, W.
double dissipation(const TissueModel& model, const std::vector<Vec3>& position, const std::vector<Vec3>& velocity) {
    double watts = 0.0;
    for (std::size_t t = 0; t < model.tet_count(); ++t) {
        const Tet& tet = model.tet_nodes[t];
        const auto gradient = [&](const std::vector<Vec3>& of) {
            Mat3 edges;
            for (int k = 0; k < 3; ++k) edges.col(k) = of[tet[static_cast<std::size_t>(k) + 1]] - of[tet[0]];
            return Mat3(edges * Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(model.tet_shape[t].inverse));
        };
        const Mat3 f = gradient(position), rate = gradient(velocity);
        const Mat3 strain_rate = 0.5 * (f.transpose() * rate + rate.transpose() * f);
        const TetShape& shape = model.tet_shape[t];
        watts += 2.0 * model.material.viscosity * shape.stiffness * shape.volume * strain_rate.squaredNorm();
    }
    return watts;
}

TEST(Damping, DragTakesTwiceTheViscosityTimesTheStrainRateSquaredWhateverTheDeformation) {
    std::mt19937_64 random(3);
    const TetMesh mesh = make_bar(3, 2, 2, 0.01);
    std::vector<double> factor(mesh.tets.size());
    for (double& value : factor) value = std::uniform_real_distribution<double>(0.2, 5.0)(random);
    const std::vector<double> density(mesh.tets.size(), 1.0);
    for (const MaterialLaw law : kLaws)
        for (const double size : {1e-4, 3e-3, 3e-2}) { // m: from small strain to inverted tets
            Material material = make_material(law, 0.4);
            material.viscosity = 0.7;
            const auto model = make_tissue_model(mesh, material, {}, {factor, density}).value();
            std::vector<Vec3> position = model.rest_position, velocity(position.size()), drag = zeros(position.size());
            for (Vec3& x : position) x += random_vec(random, size);
            for (Vec3& v : velocity) v = random_vec(random, 1.0);
            add_damping_product(model, position, velocity, drag);
            double watts = 0.0;
            for (std::size_t node = 0; node < drag.size(); ++node) watts += drag[node].dot(velocity[node]);
            EXPECT_NEAR(watts, dissipation(model, position, velocity), 1e-10 * watts) << size << " m, law " << static_cast<int>(law);
        }
}

TEST(Damping, AFallingBodyComesToTheSpeedOfItsWeightOverItsMassDamping) {
    Material material = make_material(MaterialLaw::NeoHookean, 0.4);
    material.mass_damping = 12.0;
    const auto model = make_model(make_bar(3, 2, 2, 0.01), material);
    for (const Integrator integrator : {Integrator::Rk4, Integrator::Leapfrog}) {
        TissueState state = make_rest_state(model);
        RkWorkspace workspace;
        double worst = 0.0;
        for (int frame = 1; frame <= 60; ++frame) {
            ASSERT_TRUE(integrate(model, state, 0.01, 40, {.gravity = Vec3(0, 0, -9.81)}, integrator, workspace).finite());
            const double expected = -9.81 / 12.0 * (1.0 - std::exp(-12.0 * 0.01 * frame));
            for (const Vec3& v : state.velocity) worst = std::max(worst, (v - Vec3(0, 0, expected)).norm());
        }
        EXPECT_LT(worst, integrator == Integrator::Rk4 ? 1e-9 : 2e-3) << "m/s; leapfrog takes the drag where a sub-step starts";
    }
}

/// A free bar swings in its first mode of torsion or of stretch.
struct Swing {
    bool torsion = false;
    Material material;
};

struct Measured {
    double omega = 0.0;     // rad/s
    double decrement = 0.0; // [-] logarithm of one swing over the next
};

constexpr Index kAcross = 3, kAlong = 24;
constexpr double kCell = 3e-3, kLength = kAlong * kCell; // m

/// m; the mode of a slender bar, up to its size.
std::vector<Vec3> mode_of(const TissueModel& model, const Swing& swing) {
    std::vector<Vec3> mode;
    const Vec3 middle(0.5 * kAcross * kCell, 0.5 * kAcross * kCell, 0.0);
    for (const Vec3& x : model.rest_position) {
        const Vec3 r = x - middle;
        const double phase = kPi * x.z() / kLength, size = 1e-3 * kCell;
        const double narrowing = swing.material.poisson_ratio * kPi / kLength * std::sin(phase);
        mode.push_back(swing.torsion ? Vec3(size / kCell * std::cos(phase) * Vec3(-r.y(), r.x(), 0.0))
                                     : Vec3(size * Vec3(narrowing * r.x(), narrowing * r.y(), std::cos(phase))));
    }
    return mode;
}

/// From the peaks of the mode's share of the motion, second to sixth: by then what else was set off is gone.
Measured measure(const Swing& swing) {
    const auto model = make_model(make_bar(kAcross, kAcross, kAlong, kCell), swing.material);
    const std::vector<Vec3> mode = mode_of(model, swing);
    TissueState state = make_rest_state(model);
    for (std::size_t node = 0; node < mode.size(); ++node) state.position[node] += mode[node];
    StableStepWorkspace stable;
    const double step = 0.7 * find_stable_step(model, model.rest_position, nullptr, stable).step;
    RkWorkspace workspace;
    struct Peak {
        double time, height;
    };
    std::vector<Peak> peaks;
    double before[2] = {0.0, 0.0};
    for (int k = 1; peaks.size() < 7 && k < 100'000; ++k) {
        if (!integrate_rk4(model, state, step, 1, {}, workspace).finite()) break;
        double now = 0.0;
        for (std::size_t node = 0; node < mode.size(); ++node)
            now += model.node_mass[node] * mode[node].dot(state.position[node] - model.rest_position[node]);
        if (k > 2 && before[1] > 0.0 && before[1] > before[0] && before[1] >= now) { // the parabola through three samples
            const double slope = 0.5 * (now - before[0]), bend = now - 2.0 * before[1] + before[0];
            peaks.push_back({step * (k - 1 - slope / bend), before[1] - 0.5 * slope * slope / bend});
        }
        before[0] = before[1];
        before[1] = now;
    }
    if (peaks.size() < 7) return {};
    return {2.0 * kPi * 4.0 / (peaks[5].time - peaks[1].time), 0.25 * std::log(peaks[1].height / peaks[5].height)};
}

/// docs/tissue.md: zeta = mass_damping / (2 omega) + omega viscosity g / E, decrement 2 pi zeta / sqrt(1 - zeta^2).
double expected_decrement(const Swing& swing, double damped_omega) {
    const Material& m = swing.material;
    const double nu = m.poisson_ratio, shape = swing.torsion ? 1.0 + nu : 1.0 + 2.0 * nu * nu;
    double zeta = 0.0;
    for (int round = 0; round < 20; ++round) {
        const double omega = damped_omega / std::sqrt(1.0 - zeta * zeta);
        zeta = m.mass_damping / (2.0 * omega) + omega * m.viscosity * shape / m.young_modulus;
    }
    return 2.0 * kPi * zeta / std::sqrt(1.0 - zeta * zeta);
}

void expect_the_law(const Swing& swing, double tolerance) {
    const Measured measured = measure(swing);
    ASSERT_GT(measured.omega, 0.0) << "it swings";
    const double expected = expected_decrement(swing, measured.omega);
    std::printf("%s, nu %.2f: %.1f rad/s, decrement %.4f, %.4f by the equation\n", swing.torsion ? "torsion" : "stretch",
                swing.material.poisson_ratio, measured.omega, measured.decrement, expected);
    EXPECT_NEAR(measured.decrement, expected, tolerance * expected)
        << (swing.torsion ? "torsion" : "stretch") << ", law " << static_cast<int>(swing.material.law) << ", nu "
        << swing.material.poisson_ratio << ", viscosity " << swing.material.viscosity << " Pa s, mass damping "
        << swing.material.mass_damping << " 1/s, " << measured.omega << " rad/s";
}

TEST(Damping, TorsionDiesAwayByTheViscosityTimesOnePlusNuWhateverTheLaw) {
    for (const MaterialLaw law : kLaws) {
        Swing swing{true, make_material(law, 0.3)};
        swing.material.viscosity = 3.0;
        expect_the_law(swing, 0.02);
    }
}

TEST(Damping, StretchDiesAwayByTheViscosityTimesOnePlusTwiceNuSquared) {
    for (const double nu : {0.0, 0.3, 0.45}) {
        Swing swing{false, make_material(MaterialLaw::NeoHookean, nu)};
        swing.material.viscosity = 2.0;
        expect_the_law(swing, 0.02);
    }
}

TEST(Damping, MassDampingTakesTheSameFromEveryMotionAndAddsToTheViscosity) {
    for (const bool torsion : {false, true})
        for (const double viscosity : {0.0, 1.5}) {
            Swing swing{torsion, make_material(MaterialLaw::Corotational, 0.3)};
            swing.material.mass_damping = 4.0;
            swing.material.viscosity = viscosity;
            expect_the_law(swing, 0.02);
        }
}

} // namespace
} // namespace trocar::fem
