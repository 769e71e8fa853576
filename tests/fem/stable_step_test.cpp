#include "fem/tissue/integrate.hpp"
#include "fem/tissue/stable_step.hpp"
#include "tests/fem/bodies.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

namespace trocar::fem {

using namespace test;

namespace {

/// Largest eigenfrequency of the free nodes, from the full stiffness matrix, springs pressed.
double true_omega(const TissueModel& model, const std::vector<Vec3>& position, const ContactSprings* springs = nullptr) {
    const auto size = static_cast<Eigen::Index>(3 * model.node_count());
    Eigen::MatrixXd k(size, size);
    for (Eigen::Index column = 0; column < size; ++column) {
        auto along = zeros(model.node_count()), product = along;
        along[static_cast<std::size_t>(column) / 3][column % 3] = 1.0;
        add_stiffness_product(model, position, along, product);
        if (springs)
            for (const ContactSpring& s : springs->springs) {
                double rate = 0.0;
                for (Index e = s.first_entry; e < s.first_entry + s.entry_count; ++e)
                    rate += springs->entries[e].g.dot(along[springs->entries[e].node]);
                for (Index e = s.first_entry; e < s.first_entry + s.entry_count; ++e)
                    product[springs->entries[e].node] += s.stiffness * rate * springs->entries[e].g;
            }
        for (Eigen::Index row = 0; row < size; ++row) k(row, column) = product[static_cast<std::size_t>(row) / 3][row % 3];
    }
    for (Eigen::Index i = 0; i < size; ++i)
        for (Eigen::Index j = 0; j < size; ++j)
            k(i, j) *= std::sqrt(model.inv_mass[static_cast<std::size_t>(i) / 3] * model.inv_mass[static_cast<std::size_t>(j) / 3]);
    return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(0.5 * (k + k.transpose()), Eigen::EigenvaluesOnly)
                         .eigenvalues()
                         .cwiseAbs()
                         .maxCoeff());
}

TetMesh make_rough_bar(std::uint64_t seed) {
    TetMesh mesh = make_bar(3, 2, 2, 0.01);
    std::mt19937_64 random(seed);
    for (Vec3& v : mesh.vertices) v += random_vec(random, 0.0015);
    return mesh;
}

StableStep cold_step(const TissueModel& model, const std::vector<Vec3>& position, const ContactSprings* springs = nullptr) {
    StableStepWorkspace workspace;
    return find_stable_step(model, position, springs, workspace);
}

/// Energy after `steps` steps from a small random velocity, relative to the start; huge or NaN when it explodes.
double energy_growth(const TissueModel& model, double step, int steps) {
    TissueState state = make_rest_state(model);
    std::mt19937_64 random(5);
    for (Vec3& v : state.velocity) v = random_vec(random, 1e-7);
    RkWorkspace workspace;
    double first = 0.0;
    for (const Vec3& v : state.velocity) first += 0.5 * model.node_mass[0] * v.squaredNorm();
    IntegrateReport report;
    for (int i = 0; i < steps && report.finite(); ++i) report = integrate_rk4(model, state, step, 1, {}, workspace);
    return report.finite() ? (report.kinetic_j + report.elastic_j) / first : 1e300;
}

} // namespace

TEST(StableStep, EstimateIsWithinFourPercentBelowTheTrueFrequency) {
    for (const MaterialLaw law : kLaws)
        for (std::uint64_t seed = 1; seed <= 6; ++seed) {
            const auto model =
                make_model(make_rough_bar(seed), make_material(law, 0.45), seed % 2 ? std::vector<Index>{0, 3, 9} : std::vector<Index>{});
            const double ratio = cold_step(model, model.rest_position).tissue_omega / true_omega(model, model.rest_position);
            EXPECT_GT(ratio, 0.96) << "law " << static_cast<int>(law) << ", seed " << seed;
            EXPECT_LT(ratio, 1.0 + 1e-9);
        }
}

TEST(StableStep, FollowsTheBodyAsItStiffens) {
    const auto model = make_model(make_rough_bar(3), make_material(MaterialLaw::NeoHookean, 0.45));
    StableStepWorkspace workspace;
    auto position = model.rest_position;
    (void)find_stable_step(model, position, nullptr, workspace);
    for (int frame = 0; frame < 40; ++frame) {
        for (std::size_t node = 0; node < position.size(); ++node) position[node][0] = model.rest_position[node][0] * (1.0 + 0.02 * frame);
        const StableStep warm = find_stable_step(model, position, nullptr, workspace);
        EXPECT_GT(warm.tissue_omega / true_omega(model, position), 0.95) << frame;
    }
}

TEST(StableStep, SpringsAndTheirDampingAreInTheBound) {
    const auto model = make_model(make_rough_bar(4), make_material(MaterialLaw::NeoHookean, 0.45));
    ContactSprings springs;
    for (Index s = 0; s < 4; ++s) { // overlapping: nodes 0 and 1 carry them all
        springs.springs.push_back({.first_entry = s * 3, .entry_count = 3, .offset = -1.0, .stiffness = 300.0, .damping = 0.5});
        for (Index k = 0; k < 3; ++k) springs.entries.push_back({k < 2 ? k : 5 + s, Vec3(0.3, 0.1 * k, 0.2 * s)});
    }
    const StableStep with = cold_step(model, model.rest_position, &springs), without = cold_step(model, model.rest_position);
    EXPECT_GE(with.omega_max, true_omega(model, model.rest_position, &springs) * 0.99);
    EXPECT_LT(with.omega_max, 2.0 * true_omega(model, model.rest_position, &springs));
    EXPECT_GT(with.omega_max, without.omega_max);
    EXPECT_GT(with.damping_rate, 0.0);
    EXPECT_EQ(without.damping_rate, 0.0);
}

TEST(StableStep, Rk4IsBoundedOnOneSideOfTheEdgeAndGrowsOnTheOther) {
    for (const MaterialLaw law : kLaws) {
        const auto model = make_model(make_bar(2, 2, 1, 0.01), make_material(law, 0.3));
        const double edge = 2.0 * std::sqrt(2.0) / true_omega(model, model.rest_position);
        EXPECT_LT(energy_growth(model, edge * 0.999, 2000), 2.0);
        EXPECT_GT(energy_growth(model, edge * 1.02, 2000), 100.0);
        EXPECT_LT(cold_step(model, model.rest_position).step, edge);
        EXPECT_GT(cold_step(model, model.rest_position).step, 0.8 * edge);
    }
}

TEST(StableStep, ViscousBodiesAreBoundedAtTheirStepAtEveryDampingRatio) {
    // (omega h)max measured elsewhere: 2.95 at ratio 0.1, 2.62 at 0.5, 2.786 at 1, 0.747 at 2, 0.282 at 5.
    for (const double ratio : {0.1, 0.5, 1.0, 2.0, 5.0}) {
        Material material = make_material(MaterialLaw::NeoHookean, 0.3);
        const TetMesh mesh = make_bar(2, 2, 1, 0.01);
        const double omega = true_omega(make_model(mesh, material), mesh.vertices);
        material.viscosity = 2.0 * ratio / omega * material.young_modulus / 2.6; // ratio of the shear modes
        const auto model = make_model(mesh, material);
        const StableStep stable = cold_step(model, model.rest_position);
        EXPECT_LT(energy_growth(model, stable.step / kStepSafety, 1000), 1.0) << ratio;
        EXPECT_GT(energy_growth(model, stable.step * 2.2, 1000), 10.0) << ratio << ": the limit is not idle";
    }
}

TEST(StableStep, WorstTetIsTheSliver) {
    TetMesh mesh = make_bar(3, 3, 3, 0.01);
    const Index apex = 21; // an inner node, pushed almost onto a face of one of its tets
    const Tet* sliver = nullptr;
    for (const Tet& t : mesh.tets)
        if (std::find(t.begin(), t.end(), apex) != t.end()) {
            sliver = &t;
            break;
        }
    Vec3 foot = Vec3::Zero();
    for (const Index node : *sliver)
        if (node != apex) foot += mesh.vertices[node] / 3.0;
    mesh.vertices[apex] = foot + 0.02 * (mesh.vertices[apex] - foot);
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean));
    const StableStep stable = cold_step(model, model.rest_position);
    ASSERT_NE(stable.worst_tet, kNoIndex);
    const Tet& worst = model.tet_nodes[stable.worst_tet];
    EXPECT_NE(std::find(worst.begin(), worst.end(), apex), worst.end());
}

TEST(StableStep, IsInfiniteWithNothingToMoveAndNamesWhatIsNotFinite) {
    const TetMesh mesh = make_bar(1, 1, 1, 0.01);
    const auto pinned = make_model(mesh, make_material(MaterialLaw::NeoHookean), {0, 1, 2, 3, 4, 5, 6, 7});
    EXPECT_EQ(count_substeps(0.01, cold_step(pinned, pinned.rest_position), 100), 1U);
    const auto model = make_model(mesh, make_material(MaterialLaw::NeoHookean));
    auto position = model.rest_position;
    position[2][1] = std::numeric_limits<double>::quiet_NaN();
    const StableStep broken = cold_step(model, position);
    EXPECT_FALSE(broken.finite);
    EXPECT_EQ(count_substeps(0.01, broken, 100), 0U);
    EXPECT_EQ(count_substeps(1.0, {.step = 0.3}, 100), 4U);
    EXPECT_EQ(count_substeps(1.0, {.step = 0.3}, 3), 0U);
}

/// Rounds that are spread over the steps before a derivation find the rates that they find at once: of a body that is being bent, with
/// and without drag.
TEST(StableStep, ADerivationSpreadOverTheStepsBeforeItIsAsGood) {
    for (const double viscosity : {0.0, 2.0}) {
        Material material = make_material(MaterialLaw::NeoHookean, 0.45);
        material.viscosity = viscosity;
        const auto model = make_model(make_rough_bar(7), material);
        std::mt19937_64 random(29);
        std::vector<Vec3> way = model.rest_position;
        for (Vec3& v : way) v = random_vec(random, 2e-5);
        const auto at = [&](int step) {
            std::vector<Vec3> position = model.rest_position;
            for (std::size_t n = 0; n < position.size(); ++n) position[n] += step * way[n];
            return position;
        };
        const auto records = [&](int step) {
            std::vector<NodeRecord> out(model.node_count());
            gather_records(model.plan, at(step), {}, out);
            return out;
        };
        StableStepWorkspace spread, at_once;
        for (StableStepWorkspace* w : {&spread, &at_once}) (void)find_stable_step(model, records(0), nullptr, *w, Integrator::Leapfrog);
        int rounds = 0;
        for (int step = 1; step <= 60; ++step) {
            if (step % 12 > 12 - 8 && rounds_to_come(model, spread) > 0) derive_ahead(model, records(step), spread), ++rounds;
            if (step % 12 != 0) continue;
            EXPECT_EQ(rounds_to_come(model, spread), 0);
            const StableStep one = find_stable_step(model, records(step), nullptr, spread, Integrator::Leapfrog);
            const StableStep other = find_stable_step(model, records(step), nullptr, at_once, Integrator::Leapfrog);
            // well within kStepSafety
            EXPECT_NEAR(one.tissue_omega / other.tissue_omega, 1.0, 0.02) << "viscosity " << viscosity << ", step " << step;
            EXPECT_NEAR(one.step / other.step, 1.0, 0.02);
            EXPECT_LT(one.tissue_omega, true_omega(model, at(step)) * (1.0 + 1e-9));
            EXPECT_GT(one.tissue_omega, true_omega(model, at(step)) * 0.95);
        }
        EXPECT_EQ(rounds, 5 * (viscosity > 0.0 ? 7 : 3));
    }
}

} // namespace trocar::fem
