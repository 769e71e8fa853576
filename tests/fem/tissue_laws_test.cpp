// Laws of materials against their closed forms, and what must hold of each for any deformation.
#include "fem/tissue/fibred_laws.hpp"
#include "fem/tissue/integrate.hpp"
#include "fem/tissue/law_validation.hpp"
#include "fem/tissue/laws.hpp"
#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/statics.hpp"
#include "fem/tissue/tangent.hpp"
#include "tests/fem/bodies.hpp"

#include <cmath>
#include <Eigen/Dense>
#include <functional>
#include <gtest/gtest.h>

namespace trocar::fem {

using namespace test;

namespace {

double energy_of(const Material& m, const Mat3& f) { return find_energy(m, f, Vec3(0.1, 0.2, 0.3)); }

/// Mean first Piola-Kirchhoff stress of a cube of kernels' tets in a uniform deformation: of the tractions on its faces.
Mat3 stress_of_block(const Material& material, const Mat3& f, TetElements elements) {
    Material m = material;
    m.elements = elements;
    const TissueModel model = make_model(make_bar(2, 2, 2, 0.5), m);
    std::vector<Vec3> position, force = zeros(model.node_count());
    for (const Vec3& x : model.rest_position) position.push_back(f * x);
    (void)add_tet_forces(model, position, zeros(model.node_count()), force);
    Mat3 stress = Mat3::Zero();
    for (std::size_t node = 0; node < force.size(); ++node) stress -= force[node] * model.rest_position[node].transpose();
    return stress; // over the volume, which is 1
}

Mat3 random_matrix(std::mt19937_64& random, double size) {
    Mat3 f = Mat3::Identity();
    for (int k = 0; k < 3; ++k) f.col(k) += random_vec(random, size);
    return f;
}

} // namespace

TEST(TissueLaws, StressIsTheDerivativeOfTheEnergyForRandomDeformationsInvertedOnesToo) {
    std::mt19937_64 random(31);
    for (const MaterialLaw law : kAllLaws) {
        const Material material = make_material(law, 0.45);
        int inverted = 0;
        for (int trial = 0; trial < 60; ++trial) {
            const Mat3 f = random_matrix(random, trial % 3 == 0 ? 1.5 : 0.4);
            inverted += f.determinant() < 0.0;
            const Mat3 p = stress_of_block(material, f, TetElements::Linear);
            const double h = 1e-6;
            for (int i = 0; i < 9; ++i) {
                Mat3 above = f, below = f;
                above(i / 3, i % 3) += h;
                below(i / 3, i % 3) -= h;
                const double slope = (energy_of(material, above) - energy_of(material, below)) / (2.0 * h);
                if (law == MaterialLaw::Corotational && f.determinant() < 0.05) continue; // its rotation jumps there
                EXPECT_NEAR(p(i / 3, i % 3), slope, 1e-6 * (p.norm() + 5000.0)) << kLawNames[static_cast<int>(law)] << " " << trial;
            }
        }
        EXPECT_GT(inverted, 3);
    }
}

TEST(TissueLaws, NearlyLinearFibresStoreWhatTheyPullWith) {
    std::mt19937_64 random(34);
    Material linear = make_material(MaterialLaw::Hgo, 0.45);
    linear.k2 = 1e-18;
    for (const double k2 : {1e-1, 1e-3, 1e-6, 1e-10, 1e-15}) {
        Material material = linear;
        material.k2 = k2;
        for (int trial = 0; trial < 20; ++trial) {
            const Mat3 f = random_matrix(random, 0.3);
            const Mat3 p = stress_of_block(material, f, TetElements::Linear);
            const double h = 1e-6;
            for (int i = 0; i < 9; ++i) {
                Mat3 above = f, below = f;
                above(i / 3, i % 3) += h;
                below(i / 3, i % 3) -= h;
                EXPECT_NEAR(p(i / 3, i % 3), (energy_of(material, above) - energy_of(material, below)) / (2.0 * h), 1e-6 * (p.norm() + 5000.0)) << k2;
            }
            if (k2 <= 1e-10) {
                EXPECT_NEAR(energy_of(material, f), energy_of(linear, f), 1e-7 * energy_of(linear, f)) << k2;
            }
        }
    }
    const double modulus = find_pull_tangent(linear, 1.0);
    for (const double k2 : {1e-6, 1e-9, 1e-12}) {
        Material material = linear;
        material.k2 = k2;
        EXPECT_NEAR(find_pull_tangent(material, 1.0), modulus, 1e-3 * modulus) << k2;
    }
}

TEST(TissueLaws, AtRestThePullsTangentIsYoungsModulus) {
    for (const MaterialLaw law : kAllLaws) {
        if (law == MaterialLaw::Hgo) continue; // its fibres add to it
        for (const double nu : {0.0, 0.3, 0.45, 0.49}) {
            Material material = make_material(law, nu);
            const double modulus = find_small_strain(material).young_modulus();
            EXPECT_NEAR(find_pull_tangent(material, 1.0), modulus, 1e-3 * modulus) << kLawNames[static_cast<int>(law)] << " " << nu;
        }
    }
}

TEST(TissueLaws, TurningTheBodyTurnsTheStressAndKeepsTheEnergy) {
    std::mt19937_64 random(32);
    for (const MaterialLaw law : kAllLaws) {
        const Material material = make_material(law, 0.45);
        for (int trial = 0; trial < 20; ++trial) {
            const Mat3 f = random_matrix(random, 0.5);
            if (law == MaterialLaw::Corotational && f.determinant() < 0.05) continue;
            const Mat3 turn = Eigen::AngleAxisd(3.0 * random_vec(random, 1.0)[0], random_vec(random, 1.0).normalized()).matrix();
            for (const TetElements elements : kElements) {
                const Mat3 p = stress_of_block(material, f, elements), q = stress_of_block(material, turn * f, elements);
                EXPECT_LT((turn * p - q).norm(), 1e-9 * (p.norm() + 5000.0)) << kLawNames[static_cast<int>(law)];
            }
            EXPECT_NEAR(energy_of(material, turn * f), energy_of(material, f), 1e-9 * (std::abs(energy_of(material, f)) + 5000.0));
        }
    }
}

TEST(TissueLaws, PlatesOfEachLawPullAsTheClosedFormSays) {
    for (const NamedMaterial& one : biaxial_materials())
        for (const TetElements elements : kElements) EXPECT_LT(biaxial_error(one.material, elements), 1e-8) << one.name;
}

TEST(TissueLaws, TheClosedFormsAreThoseOfTheLawsTwoDirectionsOneToThreeTermsWithAndWithoutDispersion) {
    const std::vector<NamedMaterial> all = biaxial_materials();
    EXPECT_EQ(all.size(), 9u);
    for (const NamedMaterial& one : all)
        for (int i = 0; i < 3; ++i) { // the slope of the energy along one stretch
            const double h = 1e-6, l[3] = {1.2, 0.9, 1.05};
            Vec3 above(l[0], l[1], l[2]), below = above;
            above[i] += h, below[i] -= h;
            const double slope = (find_energy(one.material, above.asDiagonal(), Vec3::Zero()) - find_energy(one.material, below.asDiagonal(), Vec3::Zero())) / (2.0 * h);
            EXPECT_NEAR(principal_stress(one.material, l, i), slope, 1e-5 * 5000.0) << one.name << " " << i;
        }
}

TEST(TissueLaws, FibresWindRoundTheirAxisBothWays) {
    Material m = make_material(MaterialLaw::Hgo, 0.47);
    m.fibre_axis = Vec3(0, 0, 2);
    m.fibre_point = Vec3(1, 1, 0);
    m.fibre_angle = 0.4;
    const FibreAxes at = find_fibres(m, Vec3(4, 1, 7)); // out along x: the circumference runs along y
    const double expected[6] = {0.0, std::cos(0.4), std::sin(0.4), 0.0, std::cos(0.4), -std::sin(0.4)};
    for (int k = 0; k < 6; ++k) EXPECT_NEAR(at.axis[k], expected[k], 1e-14);
    EXPECT_TRUE(std::isfinite(find_fibres(m, Vec3(1, 1, 3)).axis[0])); // on the axis itself
}

TEST(TissueLaws, CubesThatAreTwistedStretchedCrushedAndInvertedComeBack) {
    std::mt19937_64 random(33);
    for (const MaterialLaw law : kAllLaws)
        for (const TetElements elements : kElements) {
            if (law == MaterialLaw::StVK || law == MaterialLaw::Corotational) continue; // no resistance to inversion: docs/tissue.md
            Material material = make_material(law, 0.45);
            material.elements = elements;
            material.viscosity = 3.0;
            material.mass_damping = 20.0;
            material.k1 = 500.0, material.k2 = 0.1; // a stretch of 3 within what an integrator can follow
            const TissueModel model = make_model(make_bar(4, 4, 4, 0.01), material);
            const Vec3 middle(0.02, 0.02, 0.02);
            for (int hard = 0; hard < 5; ++hard) {
                if (hard == 3 && law == MaterialLaw::Ogden) continue; // a negative alpha keeps what is wholly mirrored so: docs/tissue.md
                TissueState state = make_rest_state(model);
                for (Vec3& x : state.position) {
                    const double turn = 3.0 * (x[0] - middle[0]) / 0.02;
                    if (hard == 0) x = middle + Eigen::AngleAxisd(turn, Vec3::UnitX()).matrix() * (x - middle); // twisted by a turn
                    if (hard == 1) x = middle + Vec3(3.0, 0.4, 0.4).cwiseProduct(x - middle);                   // stretched
                    if (hard == 2) x = middle + Vec3(0.1, 1.0, 1.0).cwiseProduct(x - middle);                   // crushed
                    if (hard == 3) x = middle + Vec3(-0.5, 1.0, 1.0).cwiseProduct(x - middle);                  // turned inside out
                    if (hard == 4) x += random_vec(random, law == MaterialLaw::Hgo ? 0.008 : 0.012);            // scattered
                }
                RkWorkspace workspace;
                StableStepWorkspace stable;
                bool fine = true;
                AdvanceReport report;
                for (int frame = 0; frame < 400 && fine; ++frame) {
                    report = advance(model, state, 0.005, {}, {.max_substeps = 20000}, workspace, stable);
                    fine = report.integrate.finite() && !report.refused;
                }
                EXPECT_TRUE(fine) << report.rejected << " rejected, stable step " << report.tightest.step << " refused " << report.refused
                                  << kLawNames[static_cast<int>(law)] << " " << hard;
                EXPECT_EQ(report.integrate.inverted, 0u) << kLawNames[static_cast<int>(law)] << " " << hard;
                EXPECT_LT(report.integrate.elastic_j, 1e-3 * 5000.0 * model.volume) << kLawNames[static_cast<int>(law)] << " " << hard;
            }
        }
}

TEST(TissueLaws, ShearRelaxesAsTheSeriesSaysWhateverTheLawAndTheElements) {
    for (const MaterialLaw law : kAllLaws)
        for (const TetElements elements : kElements) EXPECT_LT(relaxation_error(law, elements, 0.01), 1e-3) << kLawNames[static_cast<int>(law)];
}

TEST(TissueLaws, ShearThatAStressHoldsCreepsAsTheClosedFormSaysToFirstOrderInTheStep) {
    const double coarse = creep_error(TetElements::Patched, 2e-3), fine = creep_error(TetElements::Patched, 1e-3);
    EXPECT_LT(fine, 1e-3);
    EXPECT_NEAR(coarse / fine, 2.0, 0.1);
}

TEST(TissueLaws, ALoadCreepsFromTheModulusAtOnceToThatInTheEnd) {
    // A column held below and sheared by a load above: at once it gives way by 1 / (1 + g), in the end by 1.
    Material m = make_material(MaterialLaw::NeoHookean, 0.3);
    m.g1 = 1.0, m.tau1 = 0.3;
    m.mass_damping = 60.0;
    m.viscosity = 5.0;
    const TetMesh mesh = make_bar(2, 2, 2, 0.01);
    const TissueModel model = make_model(mesh, m, nodes_at(mesh, 2, 0.0));
    std::vector<Vec3> force = zeros(model.node_count());
    for (const Index node : nodes_at(mesh, 2, 0.02)) force[node][0] = 1e-4;
    const std::vector<Vec3> end = solve_small_strain(model, force);
    const Index tip = nodes_at(mesh, 2, 0.02)[4];
    TissueState state = make_rest_state(model);
    RkWorkspace workspace;
    StableStepWorkspace stable;
    const auto run = [&](double seconds) {
        for (double t = 0.0; t < seconds - 1e-9; t += 0.01)
            ASSERT_TRUE(advance(model, state, 0.01, {.external_force = force}, {}, workspace, stable).integrate.finite());
    };
    run(0.1);
    const double early = (state.position[tip] - model.rest_position[tip])[0] / end[tip][0];
    run(3.0);
    const double late = (state.position[tip] - model.rest_position[tip])[0] / end[tip][0];
    EXPECT_GT(early, 0.4);
    EXPECT_LT(early, 0.75); // it has crept for a while
    EXPECT_NEAR(late, 1.0, 0.02);
}

TEST(TissueLaws, WhatRelaxesPullsNothingRoundAndTheBitsDoNotDependOnThreads) {
    Material m = make_material(MaterialLaw::NeoHookean, 0.45);
    m.g1 = 2.0, m.tau1 = 0.05;
    const TissueModel model = make_model(make_bar(8, 5, 5, 0.01), m);
    std::mt19937_64 random(36);
    std::vector<Vec3> position = model.rest_position;
    for (Vec3& x : position) x += random_vec(random, 0.003);
    std::vector<NodeRecord> records(model.node_count());
    gather_records(model.plan, position, position, records);
    std::vector<std::vector<PartialForce>> all;
    for (const unsigned threads : {1u, 3u}) {
        TissueState state = make_rest_state(model);
        state.relaxed.resize(relaxation_size(model));
        relax(model, records, 0.02, state.relaxed, threads);
        all.emplace_back(model.plan.slots.size());
        add_relaxation_forces(model, records, state.relaxed, all.back(), threads);
    }
    Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
    double size = 0.0;
    for (std::size_t record = 0; record < records.size(); ++record) {
        const Vec3 force = sum_partial(model.plan, all[0], record);
        sum += force;
        moment += position[model.plan.node_of[record]].cross(force);
        size += force.norm();
        EXPECT_EQ(force, sum_partial(model.plan, all[1], record));
    }
    EXPECT_LT(sum.norm(), 1e-13 * size);
    EXPECT_LT(moment.norm(), 1e-12 * size * 0.08);
}

TEST(TissueLaws, ParametersOutOfRangeAreRefusedByName) {
    const auto refusal = [](MaterialLaw law, auto&& change) {
        Material m = make_material(law, 0.45);
        change(m);
        const auto fine = check_material(m);
        return fine.ok() ? std::string() : fine.error().message;
    };
    EXPECT_NE(refusal(MaterialLaw::MooneyRivlin, [](Material& m) { m.c10 = -1.0; }).find("c10"), std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::MooneyRivlin, [](Material& m) { m.c10 = m.c01 = 0.0; }).find("c10"), std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::MooneyRivlin, [](Material& m) { m.c10 = m.poisson_ratio = 0.0, m.c01 = 5.0; }).find("poisson_ratio"), std::string::npos);
    EXPECT_EQ(refusal(MaterialLaw::MooneyRivlin, [](Material& m) { m.c10 = 1.0, m.poisson_ratio = 0.0, m.c01 = 5.0; }), "");
    EXPECT_NE(refusal(MaterialLaw::Ogden, [](Material& m) { m.mu2 = 1.0; }).find("mu2"), std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::Ogden, [](Material& m) { m.alpha1 = 1e3; }).find("alpha1"), std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::Ogden, [](Material& m) { m.mu1 = m.mu2 = m.mu3 = m.alpha1 = m.alpha2 = m.alpha3 = 0.0; }).find("term"),
              std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::Hgo, [](Material& m) { m.kappa = 0.5; }).find("kappa"), std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::Hgo, [](Material& m) { m.fibre1 = Vec3::Zero(); }).find("fibre1"), std::string::npos);
    EXPECT_NE(refusal(MaterialLaw::Hgo, [](Material& m) { m.k2 = 0.0; }).find("k2"), std::string::npos);
    for (const MaterialLaw law : kAllLaws) {
        EXPECT_EQ(refusal(law, [](Material&) {}), "");
        EXPECT_EQ(refusal(law, [](Material& m) { m.g1 = 1.5, m.tau1 = 0.2; }), "");
        EXPECT_NE(refusal(law, [](Material& m) { m.g2 = 1.5; }).find("tau2"), std::string::npos); // in no time
        EXPECT_NE(refusal(law, [](Material& m) { m.g3 = -0.5, m.tau3 = 0.2; }).find("g3"), std::string::npos);
    }
}

} // namespace trocar::fem
