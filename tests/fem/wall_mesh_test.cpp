// Walls around vessels: that no tetrahedron folds over, whatever the surface, that they are as thick as asked for, and that they widen under pressure as shells do.
#include "fem/mesh/wall_mesh.hpp"

#include "base/topology.hpp"
#include "fem/mesh/mapped_mesh.hpp"
#include "fem/tissue/forces.hpp"
#include "fem/tissue/relaxation.hpp"
#include "fem/tissue/wall_cases.hpp"
#include "tests/fem/bodies.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace trocar::fem {

namespace {

constexpr double kPi = std::numbers::pi;

TriMesh make_ball(double radius, Index parts) {
    TriMesh ball = make_octasphere(parts);
    for (Vec3& v : ball.vertices) v *= radius;
    return ball;
}

} // namespace

TEST(WallMesh, OfAnySurfaceHasNoTetrahedronThatIsFoldedOver) {
    std::mt19937_64 engine(11);
    struct {
        std::mt19937_64& engine;
        double between(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); }
    } random{engine};
    std::size_t thinned = 0, whole = 0, made = 0;
    for (int k = 0; k < 60; ++k) {
        TriMesh surface = make_ball(0.01, static_cast<Index>(random.between(3.0, 12.0)));
        const double rough = k % 3 == 0 ? 0.0 : random.between(0.0, 0.25), dent = k % 4 == 1 ? random.between(0.3, 0.8) : 0.0;
        for (Vec3& v : surface.vertices) {
            const double down = std::max(0.0, v.z() / 0.01 - 0.6) / 0.4; // a pit at the top
            v *= (1.0 + rough * random.between(-1.0, 1.0)) * (1.0 - dent * down);
        }
        const WallOptions options{.thickness = random.between(0.0002, 0.006), .layers = static_cast<Index>(random.between(1.0, 4.99))};
        const auto wall = make_wall_mesh(surface, options);
        ASSERT_TRUE(wall.ok()) << wall.error().to_string();
        if (wall->folds) {
            EXPECT_LT(wall->least_share, kLeastWall) << k;
            EXPECT_TRUE(wall->tets.tets.empty());
            continue;
        }
        ++made;
        (wall->thinned > 0 ? thinned : whole) += 1;
        EXPECT_GE(wall->least_share, kLeastWall);
        EXPECT_EQ(wall->tets.tets.size(), 3u * options.layers * surface.triangles.size());
        const TetMeshReport report = inspect_tets(wall->tets);
        EXPECT_TRUE(report.valid()) << k;
        EXPECT_EQ(report.components, 1u);
        const TriMesh boundary = boundary_surface(wall->tets);
        const SurfaceReport skin = inspect_surface(boundary); // both sides, and nothing between them
        EXPECT_TRUE(skin.closed() && skin.manifold() && skin.oriented()) << k;
        EXPECT_EQ(skin.components, 2u) << k;
        EXPECT_EQ(boundary.triangles.size(), 2u * surface.triangles.size());
        for (std::size_t v = 0; v < surface.vertices.size(); ++v) ASSERT_EQ(wall->tets.vertices[v], surface.vertices[v]);
    }
    EXPECT_GT(thinned, 8u);
    EXPECT_GT(whole, 8u);
    EXPECT_GT(made, 30u);
}

TEST(WallMesh, OfASphereHasTheVolumeOfItsShell) {
    for (const Index layers : {1u, 3u}) {
        const TriMesh ball = make_ball(0.01, 16);
        const auto wall = make_wall_mesh(ball, {.thickness = 0.001, .layers = layers});
        ASSERT_TRUE(wall.ok() && !wall->folds);
        EXPECT_EQ(wall->thinned, 0u);
        EXPECT_NEAR(inspect_tets(wall->tets).volume / (4.0 / 3.0 * kPi * (std::pow(0.011, 3) - std::pow(0.01, 3))), 1.0, 0.01);
    }
}

TEST(WallMesh, OfAPipeWithFlatSidesIsAsThickAcrossThem) {
    constexpr Index kSides = 8, kRings = 5;
    TriMesh pipe;
    for (Index i = 0; i < kRings; ++i)
        for (Index j = 0; j < kSides; ++j) pipe.vertices.push_back(0.01 * Vec3(std::cos(2.0 * kPi * j / kSides), std::sin(2.0 * kPi * j / kSides), i));
    const auto id = [](Index i, Index j) { return i * kSides + j % kSides; };
    for (Index i = 0; i + 1 < kRings; ++i)
        for (Index j = 0; j < kSides; ++j) {
            pipe.triangles.push_back({id(i, j), id(i, j + 1), id(i + 1, j + 1)});
            pipe.triangles.push_back({id(i, j), id(i + 1, j + 1), id(i + 1, j)});
        }
    const auto wall = make_wall_mesh(pipe, {.thickness = 0.002, .layers = 2});
    ASSERT_TRUE(wall.ok() && !wall->folds);
    const double inner = 0.01 * std::cos(kPi / kSides), outer = inner + 0.002; // to the sides
    const double area = kSides * std::tan(kPi / kSides) * (outer * outer - inner * inner);
    EXPECT_NEAR(inspect_tets(wall->tets).volume / (area * 0.01 * (kRings - 1)), 1.0, 1e-9);
}

TEST(WallMesh, WidensUnderPressureAsLameSaysAndConverges) {
    for (const double nu : {0.3, 0.45, 0.49})
        for (const Index layers : {1u, 2u}) {
            for (const TetElements elements : {TetElements::Patched, TetElements::Prisms}) {
                const double coarse = shell_ratio(24, layers, nu, elements), fine = shell_ratio(48, layers, nu, elements);
                std::printf("sphere, nu %g, %u layers, %s: %.3f %.3f\n", nu, layers, elements == TetElements::Prisms ? "prisms" : "patches", coarse, fine);
                EXPECT_NEAR(fine, 1.0, elements == TetElements::Prisms ? 0.015 : 0.03) << nu << " " << layers;
                if (elements == TetElements::Prisms) {
                    EXPECT_NEAR(coarse, 1.0, 0.08) << nu << " " << layers;
                } else {
                    EXPECT_LT(std::abs(fine - 1.0), std::max(std::abs(coarse - 1.0), 0.006)) << nu << " " << layers;
                }
            }
        }
}

TEST(WallMesh, BendsMoreAsItShouldWithEachLayer) {
    double last = 10.0;
    for (const Index layers : {1u, 2u, 3u, 4u}) { // patches alone would not resist bending of one layer but by what holds them together
        const double ratio = crushed_ring_ratio(96, layers, 0.45, TetElements::Patched);
        EXPECT_LT(std::abs(ratio - 1.0), std::abs(last - 1.0)) << layers;
        last = ratio;
    }
    EXPECT_NEAR(last, 1.0, 0.05);
}

TEST(WallMesh, OfPrismsBendsAsAPlateOfOneLayerOrMore) {
    // 1 - nu^2: free edges of a narrow ring bend across, which the bending of prisms leaves out.
    for (const double nu : {0.3, 0.45})
        for (const Index layers : {1u, 2u}) {
            const auto ratio = [&](Index around) { return crushed_ring_ratio(around, layers, nu, TetElements::Prisms) / (1.0 - nu * nu); };
            const double coarse = ratio(24), middle = ratio(48), fine = ratio(96);
            std::printf("ring, nu %g, %u layers: %.3f %.3f %.3f\n", nu, layers, coarse, middle, fine);
            if (layers == 1) {
                EXPECT_NEAR(coarse, 1.0, 0.06) << nu;
                EXPECT_NEAR(middle, 1.0, 0.06) << nu;
                EXPECT_NEAR(fine, 1.0, 0.06) << nu;
            }
        }
}

TEST(WallMesh, OfPrismsGivesWayAsManyFineLayersDoHoweverFine) {
    const double reference = pressed_tube_way(54, 4, 0.45, TetElements::Patched);
    std::printf("pressed tube: %.2f of four layers, 54 around\n", reference);
    for (const Index around : {16u, 24u, 36u}) {
        const double prisms = pressed_tube_way(around, 1, 0.45, TetElements::Prisms), patches = pressed_tube_way(around, 1, 0.45, TetElements::Patched);
        std::printf("%u around: prisms %.2f, patches %.2f\n", around, prisms, patches);
        EXPECT_NEAR(prisms / reference, 1.0, 0.15) << around;
    }
}

TEST(WallMesh, OfPrismsBendsAsAPlateHoweverWideAndUnevenItsTriangles) {
    for (const double uneven : {0.0, 0.25})
        for (const double thickness : {1.0 / 20.0, 1.0 / 67.0, 1.0 / 200.0}) {
            std::printf("plate of %.4f, uneven by %.2f:", thickness, uneven);
            for (const Index cells : {8u, 16u, 24u}) {
                const double ratio = pressed_plate_ratio(cells, thickness, uneven, TetElements::Prisms);
                std::printf(" %.1f: %.3f", 1.0 / (cells * thickness), ratio);
                EXPECT_NEAR(ratio, 1.0, 0.12) << cells << " cells, thickness " << thickness;
            }
            std::printf("\n");
        }
}

TEST(WallMesh, OfPrismsFeelsTheStretchOfFacesThatAreFoldedAgainstOneAnother) {
    // Two triangles on either side of the x axis, as high as one another, thin; folded about it both are stretched along y, as when they are pulled apart.
    std::mt19937_64 engine(31);
    const auto between = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
    for (int k = 0; k < 40; ++k) {
        const double high = between(0.4, 1.5), thickness = between(0.002, 0.01), tilt = between(0.1, 1.0), away = high / std::cos(tilt) - high;
        TriMesh kite;
        kite.vertices = {Vec3(0, 0, 0), Vec3(between(-0.2, 1.2), -high, 0), Vec3(1, 0, 0), Vec3(between(-0.2, 1.2), high, 0)};
        kite.triangles = {{0, 1, 2}, {0, 2, 3}};
        const auto wall = make_wall_mesh(kite, {.thickness = thickness, .layers = 1});
        Material material{.law = k % 2 == 0 ? MaterialLaw::NeoHookean : MaterialLaw::Corotational, .young_modulus = 1.0, .poisson_ratio = between(0.3, 0.49), .density = 1000.0};
        material.elements = TetElements::Prisms;
        const TissueModel model = make_tissue_model(wall->tets, material, {}, {}, 4).value();
        std::vector<Vec3> folded = model.rest_position, flat = folded, sheared = folded;
        for (const Index node : {1u, 3u, 5u, 7u}) {
            folded[node].z() += high * std::tan(tilt);
            flat[node].y() += node % 4 == 1 ? -away : away;
        }
        EXPECT_NEAR(measure_tets(model, folded).elastic_energy / measure_tets(model, flat).elastic_energy, 1.0, 0.03 * thickness / (tilt * tilt) + 1e-3) << k;
        // A stretch along the wall and one across it are felt as by any tetrahedra of the law.
        Mat3 stretch = Mat3::Identity();
        for (const int i : {0, 1, 3, 4, 8}) stretch(i / 3, i % 3) += between(-0.3, 0.3);
        for (Vec3& x : sheared) x = stretch * x;
        material.elements = TetElements::Linear;
        const TissueModel linear = make_tissue_model(wall->tets, material, {}).value();
        EXPECT_NEAR(measure_tets(model, sheared).elastic_energy / measure_tets(linear, sheared).elastic_energy, 1.0, 1e-9) << k;
    }
}

TEST(WallMesh, OfPrismsKeepsMomentumAndTurnsFreely) {
    std::mt19937_64 engine(4);
    std::normal_distribution<double> normal;
    const TriMesh ball = make_ball(0.01, 4);
    const auto wall = make_wall_mesh(ball, {.thickness = 0.001, .layers = 2});
    Material material{.law = MaterialLaw::NeoHookean, .young_modulus = 1e5, .poisson_ratio = 0.45, .density = 1000.0};
    material.elements = TetElements::Prisms;
    const auto sheet = static_cast<Index>(ball.vertices.size());
    const TissueModel model = make_tissue_model(wall->tets, material, {}, {}, sheet).value();
    const auto force_at = [&](const std::vector<Vec3>& x) {
        std::vector<Vec3> force(x.size(), Vec3::Zero());
        add_tet_forces(model, x, std::vector<Vec3>(x.size(), Vec3::Zero()), force);
        return force;
    };
    const auto largest = [](const std::vector<Vec3>& field) {
        double most = 0.0;
        for (const Vec3& v : field) most = std::max(most, v.norm());
        return most;
    };
    std::vector<Vec3> bent = model.rest_position;
    for (Vec3& x : bent) x += 2e-4 * Vec3(normal(engine), normal(engine), normal(engine));
    const double scale = largest(force_at(bent));
    for (int k = 0; k < 8; ++k) {
        const Mat3 turn = Eigen::Quaterniond(normal(engine), normal(engine), normal(engine), normal(engine)).normalized().toRotationMatrix();
        std::vector<Vec3> turned = model.rest_position, both = bent;
        for (Vec3& x : turned) x = turn * x + Vec3(0.1, -0.2, 0.3);
        for (Vec3& x : both) x = turn * x;
        EXPECT_LT(largest(force_at(turned)), 1e-9 * scale);
        EXPECT_NEAR(measure_tets(model, both).elastic_energy / measure_tets(model, bent).elastic_energy, 1.0, 1e-10);
        const std::vector<Vec3> force = force_at(both);
        Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
        for (std::size_t n = 0; n < force.size(); ++n) sum += force[n], moment += both[n].cross(force[n]);
        EXPECT_LT(sum.norm(), 1e-11 * scale);
        EXPECT_LT(moment.norm(), 1e-11 * scale);
    }
    // Forces are minus the energy's gradient, the product its second derivative.
    // Crushed along the wall too, to less than kLeastPairArea.
    std::vector<Vec3> crushed = bent;
    for (Vec3& x : crushed) x = Vec3(0.03 * x.x(), 0.02 * x.y(), 0.04 * x.z());
    for (int k = 0; k < 20; ++k) {
        const std::vector<Vec3>& here = k % 4 == 3 ? crushed : bent;
        const std::vector<Vec3> force = force_at(here);
        std::vector<Vec3> way(bent.size());
        for (Vec3& d : way) d = Vec3(normal(engine), normal(engine), normal(engine));
        constexpr double kFar = 1e-7;
        const auto at = [&](double far) {
            std::vector<Vec3> x = here;
            for (std::size_t n = 0; n < x.size(); ++n) x[n] += far * way[n];
            return x;
        };
        double work = 0.0;
        for (std::size_t n = 0; n < bent.size(); ++n) work -= force[n].dot(way[n]);
        const double difference = (measure_tets(model, at(kFar)).elastic_energy - measure_tets(model, at(-kFar)).elastic_energy) / (2.0 * kFar);
        EXPECT_NEAR(difference, work, 1e-5 * scale * std::sqrt(static_cast<double>(bent.size())));
        std::vector<Vec3> product(bent.size(), Vec3::Zero());
        add_stiffness_product(model, here, way, product);
        const std::vector<Vec3> ahead = force_at(at(kFar)), behind = force_at(at(-kFar));
        double off = 0.0, size = 0.0;
        for (std::size_t n = 0; n < bent.size(); ++n) {
            off = std::max(off, (product[n] + (ahead[n] - behind[n]) / (2.0 * kFar)).norm());
            size = std::max(size, product[n].norm());
        }
        EXPECT_LT(off, 1e-5 * size);
    }
    // A growth of all of it is felt as by any tetrahedra of the law; a stretch that shears it across, a little less.
    material.elements = TetElements::Linear;
    const TissueModel linear = make_tissue_model(wall->tets, material, {}).value();
    Mat3 stretch = Mat3::Identity();
    for (int i = 0; i < 9; ++i) stretch(i / 3, i % 3) += 0.1 * normal(engine);
    std::vector<Vec3> stretched = model.rest_position, grown = stretched;
    for (Vec3& x : stretched) x = stretch * x;
    for (Vec3& x : grown) x *= 1.1;
    const auto over_linear = [&](const std::vector<Vec3>& x) { return measure_tets(model, x).elastic_energy / measure_tets(linear, x).elastic_energy; };
    EXPECT_NEAR(over_linear(grown), 1.0, 1e-9);
    EXPECT_LT(over_linear(stretched), 1.0);
    EXPECT_GT(over_linear(stretched), 0.9);
    material.elements = TetElements::Prisms;
    EXPECT_FALSE(make_tissue_model(wall->tets, material, {}, {}, sheet + 1).ok());
    EXPECT_FALSE(make_tissue_model(wall->tets, material, {}).ok());
}

namespace {

std::vector<Vec3> make_random_field(std::mt19937_64& engine, std::size_t count, double size) {
    std::normal_distribution<double> normal;
    std::vector<Vec3> field(count);
    for (Vec3& v : field) v = size * Vec3(normal(engine), normal(engine), normal(engine));
    return field;
}

double dot(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
    double sum = 0.0;
    for (std::size_t n = 0; n < a.size(); ++n) sum += a[n].dot(b[n]);
    return sum;
}

} // namespace

TEST(WallMesh, OfPrismsIsDampedByViscosityAsItIsStiffHoweverWideItsTriangles) {
    std::mt19937_64 engine(9);
    const auto random_field = [&](std::size_t count, double size) { return make_random_field(engine, count, size); };
    const TriMesh ball = make_ball(0.01, 4);
    const auto sheet = static_cast<Index>(ball.vertices.size());
    for (const double thickness : {0.0002, 0.002}) {
        const auto wall = make_wall_mesh(ball, {.thickness = thickness, .layers = 1});
        Material material{.law = MaterialLaw::NeoHookean, .young_modulus = 1e5, .poisson_ratio = 0.45, .density = 1000.0, .viscosity = 30.0};
        material.elements = TetElements::Prisms;
        const TissueModel model = make_tissue_model(wall->tets, material, {}, {}, sheet).value();
        std::vector<Vec3> bent = model.rest_position;
        const std::vector<Vec3> way = random_field(bent.size(), 0.2 * thickness);
        for (std::size_t n = 0; n < bent.size(); ++n) bent[n] += way[n];
        const auto drag = [&](const std::vector<Vec3>& velocity) {
            std::vector<Vec3> product(bent.size(), Vec3::Zero());
            add_damping_product(model, bent, velocity, product);
            return product;
        };
        const std::vector<Vec3> u = random_field(bent.size(), 1.0), v = random_field(bent.size(), 1.0), of_u = drag(u), of_v = drag(v);
        const double size = dot(u, of_u);
        EXPECT_GT(size, 0.0);
        EXPECT_NEAR(dot(u, of_v), dot(v, of_u), 1e-11 * size);
        std::vector<Vec3> turning(bent.size()), still(bent.size(), Vec3::Zero()), force = still, elastic = still;
        for (std::size_t n = 0; n < bent.size(); ++n) turning[n] = Vec3(3.0, -2.0, 1.0).cross(bent[n]) + Vec3(0.1, 0.2, 0.3);
        EXPECT_LT(std::abs(dot(turning, drag(turning))), 1e-11 * size);
        Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
        for (std::size_t n = 0; n < bent.size(); ++n) sum += of_u[n], moment += bent[n].cross(of_u[n]);
        EXPECT_LT(sum.norm(), 1e-11 * size);
        EXPECT_LT(moment.norm(), 1e-11 * size);
        add_tet_forces(model, bent, u, force);
        add_tet_forces(model, bent, still, elastic);
        double off = 0.0, most = 0.0;
        for (std::size_t n = 0; n < bent.size(); ++n) off = std::max(off, (elastic[n] - force[n] - of_u[n]).norm()), most = std::max(most, of_u[n].norm());
        EXPECT_LT(off, 1e-10 * most);
    }
    // Of a plate's way under pressure, over what it is with the moduli: 1 - nu of a bent plate.
    for (const double uneven : {0.0, 0.25})
        for (const double thickness : {1.0 / 20.0, 1.0 / 200.0}) {
            const double ratio = pressed_plate_damping(8, thickness, uneven);
            std::printf("plate of %.4f, uneven by %.2f: damped %.3f times as it is stiff\n", thickness, uneven, ratio);
            EXPECT_NEAR(ratio, 0.725, 0.03);
        }
}

TEST(WallMesh, OfPrismsRelaxesInStretchAndBending) {
    std::mt19937_64 engine(14);
    const auto random_field = [&](std::size_t count, double size) { return make_random_field(engine, count, size); };
    const TriMesh ball = make_ball(0.01, 4);
    const auto sheet = static_cast<Index>(ball.vertices.size());
    for (const double thickness : {0.0002, 0.002}) {
        const auto wall = make_wall_mesh(ball, {.thickness = thickness, .layers = 1});
        Material material{.law = MaterialLaw::NeoHookean, .young_modulus = 1e5, .poisson_ratio = 0.45, .density = 1000.0, .g1 = 0.7, .tau1 = 0.1};
        material.elements = TetElements::Prisms;
        const TissueModel model = make_tissue_model(wall->tets, material, {}, {}, sheet).value();
        material.elements = TetElements::Linear;
        const TissueModel linear = make_tissue_model(wall->tets, material, {}).value();
        const auto records_of = [](const TissueModel& m, const std::vector<Vec3>& x) {
            std::vector<NodeRecord> records(m.node_count());
            gather_records(m.plan, x, x, records);
            return records;
        };
        const auto force_of = [&](const TissueModel& m, const std::vector<Vec3>& x, const std::vector<double>& relaxed) {
            std::vector<PartialForce> partial(m.plan.slots.size(), PartialForce{});
            add_relaxation_forces(m, records_of(m, x), relaxed, partial, 1);
            std::vector<Vec3> force(x.size());
            for (std::size_t record = 0; record < x.size(); ++record) force[m.plan.node_of[record]] = sum_partial(m.plan, partial, record);
            return force;
        };
        const auto moved = [](std::vector<Vec3> x, double far, const std::vector<Vec3>& way) {
            for (std::size_t n = 0; n < x.size(); ++n) x[n] += far * way[n];
            return x;
        };
        const std::vector<Vec3>& rest = model.rest_position;
        const std::vector<Vec3> bent = moved(rest, 0.2 * thickness, random_field(rest.size(), 1.0)), before = moved(rest, 0.2 * thickness, random_field(rest.size(), 1.0));
        std::vector<double> relaxed(relaxation_size(model));
        relax(model, records_of(model, before), 0.07, relaxed, 1);
        // Forces are derivatives of one energy (their own derivative is symmetric) that no motion of the whole changes.
        const std::vector<Vec3> u = random_field(rest.size(), 1.0), v = random_field(rest.size(), 1.0), force = force_of(model, bent, relaxed);
        const double far = 1e-6 * thickness;
        const auto rate = [&](const std::vector<Vec3>& along, const std::vector<Vec3>& by) {
            return (dot(force_of(model, moved(bent, far, along), relaxed), by) - dot(force_of(model, moved(bent, -far, along), relaxed), by)) / (2.0 * far);
        };
        EXPECT_NEAR(rate(u, v), rate(v, u), 1e-6 * std::abs(rate(u, u)));
        Vec3 sum = Vec3::Zero(), moment = Vec3::Zero();
        double most = 0.0;
        for (std::size_t n = 0; n < rest.size(); ++n) sum += force[n], moment += bent[n].cross(force[n]), most = std::max(most, force[n].norm());
        EXPECT_GT(most, 0.0);
        EXPECT_LT(sum.norm(), 1e-11 * most);
        EXPECT_LT(moment.norm(), 1e-12 * most);
        // A growth of all of it, by other numbers along each axis, is felt as by any tetrahedra.
        std::vector<Vec3> grown = rest, growing = rest;
        for (Vec3& x : grown) x *= 1.2;
        for (Vec3& x : growing) x = Vec3(x.x(), -2.0 * x.y(), 0.5 * x.z());
        const auto work = [&](const TissueModel& m, double along) { return dot(force_of(m, moved(grown, along, growing), std::vector<double>(relaxation_size(m))), growing); };
        const double small = 1e-5;
        EXPECT_LT(std::abs(dot(force_of(model, grown, std::vector<double>(relaxed.size())), growing)), 1e-9 * std::abs(work(linear, small)));
        if (thickness == 0.002) {
            EXPECT_LT(work(model, small) / work(linear, small), 1.0); // where it shears the wall across, less
            EXPECT_GT(work(model, small) / work(linear, small), 0.75);
        }
    }
    // A plate that bends along itself is stretched by 1 in its fibres, by -nu / (1 - nu) across: of that 2 mu dev E over young_modulus / (1 - nu^2).
    const double across = 0.3 / 0.7, plate = (1.0 + across * across - (1.0 - across) * (1.0 - across) / 3.0) / 1.3 * (1.0 - 0.09);
    for (const double uneven : {0.0, 0.25})
        for (const double thickness : {1.0 / 20.0, 1.0 / 200.0}) {
            const double ratio = pressed_plate_relaxation(8, thickness, uneven);
            std::printf("plate of %.4f, uneven by %.2f: a branch resists %.4f times as much\n", thickness, uneven, ratio);
            EXPECT_NEAR(ratio, plate, 0.03) << thickness;
        }
}

TEST(WallMesh, RefusesWhatIsNoWall) {
    const TriMesh ball = make_ball(0.01, 4);
    EXPECT_FALSE(make_wall_mesh(ball, {.thickness = 0.0, .layers = 1}).ok());
    EXPECT_FALSE(make_wall_mesh(ball, {.thickness = 0.001, .layers = 0}).ok());
    EXPECT_FALSE(make_wall_mesh(TriMesh{}, {.thickness = 0.001, .layers = 1}).ok());
}

} // namespace trocar::fem
