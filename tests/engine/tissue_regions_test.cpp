// A body of several tissues, by the labels of its coarse mesh's cells: bars of two materials against their closed forms, mass, the stable step,
// the same bits where the tissues are the same, and what is refused.
#include "base/topology.hpp"
#include "engine/experiments/explain.hpp"
#include "engine/io/write_mesh.hpp"
#include "engine/step/model_hash.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "fem/tissue/forces.hpp"
#include "fem/tissue/statics.hpp"
#include "step_fixture.hpp"
#include "tests/temp_folder.hpp"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numeric>

namespace trocar::engine {
namespace {

using ::testing::HasSubstr;

constexpr std::array<Index, 3> kCells{12, 3, 3};
constexpr double kCell = 0.01; // m
constexpr double kLength = kCell * kCells[0], kArea = kCell * kCell * kCells[1] * kCells[2];

Vec3 centre_of(const TetMesh& mesh, const Tet& t) { return 0.25 * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]] + mesh.vertices[t[3]]); }

/// Tissue of the body, in Pa and kg/m^3.
struct Bar {
    std::string law = "neo_hookean";
    double young = 5000.0, poisson = 0.3, density = 1000.0;
    std::string regions = {}; // the map's text; empty: no key
    std::string array = {};
};

class Regions : public trocar::FolderTest {
protected:
    /// The bar, its cells labelled by their centres.
    void write_bar(const std::function<double(const Vec3&)>& label, const std::string& array = "region", double jitter = 0.1) {
        mesh_ = fem::make_bar_mesh(kCells, kCell, jitter);
        labels_.clear();
        for (const Tet& t : mesh_.tets) labels_.push_back(label(centre_of(mesh_, t)));
        const DataArray cells[] = {{array, 1, labels_}};
        ASSERT_TRUE(write_vtu(folder / "bar.vtu", mesh_, {{}, cells}).ok());
    }

    [[nodiscard]] std::string text(const Bar& bar) const {
        const std::string material = bar.law == "neo_hookean" ? fmt::format("\"young_modulus\": {:.17g}", bar.young)
                                                              : fmt::format("\"law\": \"{}\", {}", bar.law, bar.law == "ogden" ? "\"mu1\": 800, \"alpha1\": 5" : "\"c10\": 700, \"c01\": 300");
        return fmt::format(R"({{"units": {{"length": "m", "pressure": "Pa"}}, "time": {{"step": 0.01, "duration": 0.1}}, "bodies": {{
    "bar": {{"kind": "deformable", "surface": {{"shape": "box", "centre": [{}, {}, {}], "extent": [{}, {}, {}], "cells": 3}},
    "material": {{{}, "poisson_ratio": {:.17g}, "density": {:.17g}, "viscosity": 0.1}},
    "coarse": {{
        "file": "{}"{}{}
    }},
    "fixed": [{{"direction": [-1, 0, 0], "fraction": 0.01}}]}}}}, "effects": ["elasticity", "damping"]}})",
                           kLength / 2, kCell * kCells[1] / 2, kCell * kCells[2] / 2, kLength, kCell * kCells[1], kCell * kCells[2], material, bar.poisson, bar.density,
                           (folder / "bar.vtu").string(), bar.array.empty() ? "" : ",\n        \"region_array\": " + bar.array,
                           bar.regions.empty() ? "" : ",\n        \"regions\": " + bar.regions);
    }
    [[nodiscard]] PreparedScene prepare(const Bar& bar) const { return test::prepare(text(bar)); }

    /// What the scene is refused with, while it is read or prepared.
    [[nodiscard]] Error refusal(const Bar& bar) const {
        const Result<Scene> scene = parse_scene(text(bar), (folder / "test.json").string());
        if (!scene.ok()) return scene.error();
        const Result<PreparedScene> prepared = make_prepared_scene(*scene);
        EXPECT_FALSE(prepared.ok()) << "accepted: " << bar.regions;
        return prepared.ok() ? Error{} : prepared.error();
    }

    TetMesh mesh_;
    std::vector<double> labels_;
};

double volume_of(const TetMesh& mesh, const Tet& t) {
    const Vec3& o = mesh.vertices[t[0]];
    return (mesh.vertices[t[1]] - o).dot((mesh.vertices[t[2]] - o).cross(mesh.vertices[t[3]] - o)) / 6.0;
}

TEST_F(Regions, OfTheBodysOwnTissueHaveTheBitsOfABodyWithoutRegions) {
    test::Random random(1);
    for (int round = 0; round < 12; ++round) {
        write_bar([&](const Vec3&) { return std::floor(random.between(0.0, 4.0)); });
        Bar bar{.young = random.between(500.0, 1e6), .poisson = random.between(0.0, 0.49), .density = random.between(900.0, 1200.0)};
        const std::uint64_t plain = hash_model(prepare(bar).model);
        bar.regions = fmt::format(R"({{"a": {{"label": 0, "young_modulus": {0:.17g}, "density": {1:.17g}}}, "b": {{"label": 1}}, "c": {{"label": 3, "young_modulus": {0:.17g}}}}})",
                                  bar.young, bar.density);
        EXPECT_EQ(hash_model(prepare(bar).model), plain);
        bar.regions = fmt::format(R"({{"a": {{"label": 0, "young_modulus": {:.17g}}}}})", bar.young * (1.0 + 1e-12));
        EXPECT_NE(hash_model(prepare(bar).model), plain) << "the last digits of a modulus are seen";
    }
}

TEST_F(Regions, InSeriesStretchByTheHarmonicMeanOfTheirModuli) {
    test::Random random(2);
    for (int round = 0; round < 12; ++round) {
        const double nu = round < 6 ? 0.0 : random.between(0.05, 0.3), ratio = std::pow(10.0, random.between(-1.0, 1.0));
        const int layers = static_cast<int>(random.between(3.0, 10.0));
        write_bar([&](const Vec3& x) { return x.x() < kCell * layers ? 7.0 : -2.0; }, "region", 0.0);
        const Bar bar{.poisson = nu, .regions = fmt::format(R"({{"far": {{"label": -2, "young_modulus": {:.17g}}}}})", 5000.0 * ratio)};
        const PreparedScene prepared = prepare(bar);
        ASSERT_EQ(prepared.model.bodies.size(), 1u);
        const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
        const double stress = 1.0; // Pa, on the far end
        std::vector<Vec3> force(tissue.node_count(), Vec3::Zero());
        const auto at_end = [&](Index n) { return tissue.rest_position[n].x() > kLength - 1e-9; };
        for (const Triangle& f : boundary_surface(mesh_).triangles)
            if (at_end(f[0]) && at_end(f[1]) && at_end(f[2])) {
                const Vec3 &a = mesh_.vertices[f[0]], &b = mesh_.vertices[f[1]], &c = mesh_.vertices[f[2]];
                for (const Index n : f) force[n].x() += stress * 0.5 * (b - a).cross(c - a).norm() / 3.0;
            }
        const std::vector<Vec3> moved = fem::solve_small_strain(tissue, force);
        double pull = 0.0, work = 0.0;
        for (std::size_t n = 0; n < force.size(); ++n) pull += force[n].x(), work += force[n].x() * moved[n].x();
        ASSERT_NEAR(pull, stress * kArea, 1e-9 * stress * kArea);
        const double near = kCell * layers, expected = stress * (near / 5000.0 + (kLength - near) / (5000.0 * ratio));
        EXPECT_NEAR(work / pull, expected, (nu > 0.0 ? 0.04 : 1e-6) * expected) << "nu " << nu << ", ratio " << ratio << ", " << layers << " of 12 cells";
    }
}

TEST_F(Regions, SideBySideBearTheArithmeticMeanOfTheirModuli) {
    test::Random random(3);
    for (int round = 0; round < 12; ++round) {
        const double nu = random.between(0.0, 0.45), ratio = std::pow(10.0, random.between(-1.5, 1.5)), strain = 1e-6;
        write_bar([&](const Vec3& x) { return x.z() < kCell ? 1.0 : x.z() < 2.0 * kCell ? 2.0 : 3.0; }, "region", 0.0);
        const Bar bar{.poisson = nu, .regions = fmt::format(R"({{"core": {{"label": 2, "young_modulus": {:.17g}}}, "top": {{"label": 3, "young_modulus": 2500}}}})", 5000.0 * ratio)};
        const PreparedScene prepared = prepare(bar);
        ASSERT_EQ(prepared.model.bodies.size(), 1u);
        const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
        std::vector<Vec3> stretched = tissue.rest_position, force(tissue.node_count(), Vec3::Zero());
        const std::vector<Vec3> still(tissue.node_count(), Vec3::Zero());
        for (Vec3& x : stretched) x = Vec3(x.x() * (1.0 + strain), x.y() * (1.0 - nu * strain), x.z() * (1.0 - nu * strain));
        (void)fem::add_tet_forces(tissue, stretched, still, force);
        double pull = 0.0, sideways = 0.0;
        for (std::size_t n = 0; n < force.size(); ++n) {
            const bool end = tissue.rest_position[n].x() > kLength - 1e-9, held = tissue.rest_position[n].x() < 1e-9;
            if (end) pull -= force[n].x();
            if (!end && !held) sideways = std::max(sideways, force[n].norm());
        }
        const double expected = strain * kArea / 3.0 * (5000.0 + 5000.0 * ratio + 2500.0);
        EXPECT_NEAR(pull, expected, 1e-4 * expected) << "nu " << nu << ", ratio " << ratio;
        EXPECT_LT(sideways, 1e-3 * expected) << "with one Poisson's ratio a uniform stretch is in balance";
    }
}

TEST_F(Regions, WeighTheSumOfTheirDensitiesTimesTheirVolumes) {
    test::Random random(4);
    for (int round = 0; round < 10; ++round) {
        write_bar([&](const Vec3&) { return std::floor(random.between(0.0, 5.0)); });
        Bar bar{.poisson = random.between(0.0, 0.49), .density = random.between(900.0, 1100.0), .regions = "{"};
        std::array<double, 5> density{};
        density.fill(bar.density);
        for (const int label : {0, 2, 3}) {
            density[static_cast<std::size_t>(label)] = random.between(200.0, 2000.0);
            bar.regions += fmt::format("{}\"r{}\": {{\"label\": {}, \"density\": {:.17g}}}", label > 0 ? ", " : "", label, label, density[static_cast<std::size_t>(label)]);
        }
        bar.regions += "}";
        const PreparedScene prepared = prepare(bar);
        ASSERT_EQ(prepared.model.bodies.size(), 1u);
        double mass = 0.0;
        for (std::size_t t = 0; t < mesh_.tets.size(); ++t) mass += density[static_cast<std::size_t>(labels_[t])] * volume_of(mesh_, mesh_.tets[t]);
        const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
        EXPECT_NEAR(tissue.mass, mass, 1e-12 * mass);
        EXPECT_NEAR(std::accumulate(tissue.node_mass.begin(), tissue.node_mass.end(), 0.0), mass, 1e-12 * mass);
        double told = 0.0;
        for (const RegionSummary& region : prepared.bodies[0].regions) told += region.density * region.volume_m3;
        EXPECT_NEAR(told, mass, 1e-12 * mass);
    }
}

TEST_F(Regions, TakeTheStableStepOfTheStiffestAndLightestOfThem) {
    write_bar([](const Vec3& x) { return x.x() < 0.5 * kLength ? 0.0 : 1.0; });
    for (const char* tissue : {"\"young_modulus\": 80000", "\"density\": 250"}) {
        const double plain = prepare({}).bodies[0].stable_step_s;
        const double whole = prepare({.regions = fmt::format(R"({{"a": {{"label": 0, {0}}}, "b": {{"label": 1, {0}}}}})", tissue)}).bodies[0].stable_step_s;
        const double part = prepare({.regions = fmt::format(R"({{"b": {{"label": 1, {}}}}})", tissue)}).bodies[0].stable_step_s;
        EXPECT_LT(whole, 0.6 * plain) << tissue;
        EXPECT_NEAR(part, whole, 0.1 * whole) << tissue;
    }
}

TEST_F(Regions, OfLawsWithoutAModulusAreToldByTheirModulusAtSmallStrain) {
    write_bar([](const Vec3& x) { return x.x() < 0.5 * kLength ? 0.0 : 1.0; });
    for (const char* law : {"mooney_rivlin", "ogden"}) {
        const PreparedScene prepared = prepare({.law = law, .regions = R"({"stiff": {"label": 1, "young_modulus": 40000}})"});
        ASSERT_EQ(prepared.bodies.size(), 1u);
        const auto& regions = prepared.bodies[0].regions;
        ASSERT_EQ(regions.size(), 2u);
        EXPECT_FALSE(regions[0].has_own_tissue);
        EXPECT_NEAR(regions[1].young_modulus, 40000.0, 1e-8 * 40000.0) << law;
        const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
        for (std::size_t t = 0; t < tissue.tet_count(); ++t)
            ASSERT_NEAR(tissue.tet_shape[t].stiffness * fem::find_small_strain(tissue.material).young_modulus(), labels_[t] > 0.0 ? 40000.0 : regions[0].young_modulus, 1e-3);
    }
}

TEST_F(Regions, StayWhatTheyAreWhereDampingIsLeftOut) {
    write_bar([](const Vec3& x) { return x.x() < 0.5 * kLength ? 0.0 : 1.0; });
    PreparedScene prepared = prepare({.regions = R"({"stiff": {"label": 1, "young_modulus": 40000, "density": 1500}})"});
    ASSERT_EQ(prepared.bodies.size(), 1u);
    const double mass = prepared.model.bodies[0].tissue->mass;
    find_effect("damping")->remove(prepared.model);
    const fem::TissueModel& tissue = *prepared.model.bodies[0].tissue;
    EXPECT_EQ(tissue.material.viscosity, 0.0);
    EXPECT_EQ(tissue.mass, mass);
    for (std::size_t t = 0; t < tissue.tet_count(); ++t) ASSERT_DOUBLE_EQ(tissue.tet_shape[t].stiffness, labels_[t] > 0.0 ? 8.0 : 1.0);
}

TEST_F(Regions, AreAllListedByExplainThoseWithoutATissueOfTheirOwnToo) {
    write_bar([](const Vec3& x) { return x.x() < 0.25 * kLength ? 5.0 : 9.0; }, "layer", 0.0);
    const std::string scene_text = text({.regions = R"({"tumour": {"label": 9, "young_modulus": 40000, "density": 1500}})"});
    const Result<Scene> scene = parse_scene(scene_text, "scenes/step.json");
    ASSERT_TRUE(scene.ok());
    const Result<PreparedScene> prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    std::string told;
    explain_scene(*scene, *prepared, [&](const std::string& part) { told += part; }, [](const std::string&) {});
    EXPECT_THAT(told, HasSubstr("region (layer 5): 162 tetrahedra, 27000 mm^3, the body's material"));
    EXPECT_THAT(told, HasSubstr("region tumour (layer 9): 486 tetrahedra, 81000 mm^3, Young's modulus 40000 Pa, 1500 kg/m^3"));
}

TEST_F(Regions, ThatAreWrongAreRefusedWithLineKeyAndWhatWasExpected) {
    write_bar([](const Vec3& x) { return x.x() < 0.25 * kLength ? 5.0 : 9.0; });
    struct Wrong {
        Bar bar;
        std::size_t line;
        std::string key, message;
    };
    const std::vector<Wrong> cases{
        {{.regions = R"({"a": {"label": 8}})"}, 6, "bodies.bar.coarse.regions.a.label", "found 8, which no cell of bar.vtu has in its array \"region\"; nearest label: 9 (there are 5, 9)"},
        {{.regions = R"({"a": {"label": 5, "young_modulus": -1}})"}, 6, "bodies.bar.coarse.regions.a.young_modulus", "-1"},
        {{.regions = R"({"a": {"label": 5, "density": 0}})"}, 6, "bodies.bar.coarse.regions.a.density", "expected"},
        {{.regions = R"({"a": {"label": 5.5}})"}, 6, "bodies.bar.coarse.regions.a.label", "5.5"},
        {{.regions = R"({"a": {"label": "five"}})"}, 6, "bodies.bar.coarse.regions.a.label", "five"},
        {{.regions = R"({"a": {"label": 5, "poisson_ratio": 0.2}})"}, 6, "bodies.bar.coarse.regions.a.poisson_ratio", "(known: label, young_modulus, density)"},
        {{.regions = R"({"a": {"young_modulus": 900}})"}, 6, "bodies.bar.coarse.regions.a", "found no \"label\", and bar.vtu has no names for its labels; expected one; nearest label: 5 (there are 5, 9)"},
        {{.regions = R"({"a": {"label": 5}, "b": {"label": 5}})"}, 6, "bodies.bar.coarse.regions.b.label", "found 5, which is a's; expected a label for each region"},
        {{.regions = R"({"a": {"label": 5}})", .array = "\"regoin\""}, 6, "bodies.bar.coarse.region_array", "found the unknown cell array \"regoin\"; nearest known cell array: \"region\" (known: region)"},
        {{.array = "\"region\""}, 6, "bodies.bar.coarse.region_array", "unused key"},
        {{.regions = "3"}, 6, "bodies.bar.coarse.regions", "found"},
    };
    for (const Wrong& c : cases) {
        SCOPED_TRACE(c.bar.regions + c.bar.array);
        const Error error = refusal(c.bar);
        EXPECT_EQ(error.file, (folder / "test.json").string());
        EXPECT_GE(error.line, c.line) << error.to_string();
        EXPECT_LE(error.line, c.line + 2) << error.to_string();
        EXPECT_EQ(error.key, c.key) << error.to_string();
        EXPECT_THAT(error.to_string(), HasSubstr(c.message));
    }
    write_bar([](const Vec3& x) { return x.x() < 0.25 * kLength ? 5.5 : 9.0; });
    EXPECT_THAT(refusal({.regions = R"({"a": {"label": 9}})"}).to_string(), HasSubstr("none of the cell arrays region is known to say"));
    EXPECT_THAT(refusal({.regions = R"({"a": {"label": 9}})", .array = "\"region\""}).to_string(),
                HasSubstr("bodies.bar.coarse.region_array: bar.vtu: the cell array \"region\" has 5.5 at cell 0; expected an integer"));
    double next = 0.0;
    write_bar([&](const Vec3&) { return next++; }, "CellId");
    const Error ids = refusal({.regions = R"({"a": {"label": 9}})", .array = "\"CellId\""});
    EXPECT_EQ(ids.line, 6u) << ids.to_string();
    EXPECT_THAT(ids.to_string(),
                HasSubstr("bodies.bar.coarse.region_array: bar.vtu: the cell array \"CellId\" has 648 different labels; expected at most 256, one for each region"));
    write_bar([](const Vec3& x) { return x.x() < 0.25 * kLength ? 3e9 : 9.0; });
    EXPECT_THAT(refusal({.regions = R"({"a": {"label": 9}})", .array = "\"region\""}).to_string(),
                HasSubstr("the cell array \"region\" has 3000000000 at cell 0; expected an integer from -2147483647 to 2147483647"));
    ASSERT_TRUE(write_vtu(folder / "bar.vtu", mesh_).ok());
    EXPECT_THAT(refusal({.regions = R"({"a": {"label": 9}})"}).to_string(), HasSubstr("bodies.bar.coarse.regions: bar.vtu: no cell array says which region a cell belongs to"));
}

TEST_F(Regions, NeedAMeshFromAFile) {
    std::string scene = text({.regions = R"({"a": {"label": 5}})"});
    write_bar([](const Vec3&) { return 5.0; });
    scene.replace(scene.find("\"file\": "), std::string("\"file\": \"").size() + (folder / "bar.vtu").string().size() + 1, "\"mesher\": \"lattice\"");
    const Result<Scene> read = parse_scene(scene, "test.json");
    ASSERT_FALSE(read.ok());
    EXPECT_THAT(read.error().to_string(), HasSubstr("unknown key \"regions\""));
}

} // namespace
} // namespace trocar::engine
