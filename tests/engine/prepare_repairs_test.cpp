// One rule for surfaces, and the whole chain of repairs that meets it, found by trying.
#include "assets/anatomy/shapes.hpp"
#include "base/self_intersection.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/write_mesh.hpp"
#include "engine/prepare/prepare_mesh.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/prepare/surface_rule.hpp"
#include "fem/mesh/bar_mesh.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

namespace trocar::engine {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

const SurfaceNeeds kLumen{"a lumen", true, true}, kBody{"a deformable body", true, false};

struct Dice {
    std::mt19937 engine;
    double uniform(double lo, double hi) { return lo + (hi - lo) * (engine() * 0x1p-32); }
    std::size_t pick(std::size_t count) { return engine() % count; }
};

TriMesh join(TriMesh a, const TriMesh& b) {
    const auto offset = static_cast<Index>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (const Triangle& t : b.triangles) a.triangles.push_back({t[0] + offset, t[1] + offset, t[2] + offset});
    return a;
}

TriMesh ball(const Vec3& centre, double radius) { return anatomy::make_icosphere(centre, radius, 3); }

/// Defects from exporters, scanners and segmentations.
TriMesh damage(TriMesh mesh, Dice& dice) {
    for (std::size_t i = dice.pick(4); i > 0; --i)
        mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(dice.pick(mesh.triangles.size())));
    for (std::size_t i = dice.pick(3); i > 0; --i) {
        Triangle& turned = mesh.triangles[dice.pick(mesh.triangles.size())];
        std::swap(turned[0], turned[1]);
    }
    if (dice.pick(2) == 0) mesh.triangles.push_back(mesh.triangles[dice.pick(mesh.triangles.size())]);
    if (dice.pick(2) == 0)
        for (Triangle& t : mesh.triangles) std::swap(t[1], t[2]);
    if (dice.pick(3) == 0) { // every triangle with corners of its own, a little apart
        TriMesh soup;
        for (const Triangle& t : mesh.triangles) {
            const auto first = static_cast<Index>(soup.vertices.size());
            for (const Index v : t) soup.vertices.emplace_back(mesh.vertices[v] + 1e-9 * Vec3(dice.uniform(-1, 1), dice.uniform(-1, 1), 0));
            soup.triangles.push_back({first, first + 1, first + 2});
        }
        return soup;
    }
    return mesh;
}

TEST(SurfaceRule, TheProposedChainMendsWhateverExportersDo) {
    for (unsigned seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        Dice dice{std::mt19937(seed)};
        TriMesh mesh = damage(ball(Vec3::Zero(), 0.05), dice);
        if (dice.pick(2) == 0) mesh = join(mesh, ball(Vec3(0.094, 0.003, 0.007), 0.05)); // overlaps a little
        const SurfaceNeeds& needs = seed % 2 == 0 ? kLumen : kBody;
        if (!find_defect(mesh, inspect_surface(mesh), needs)) continue;
        const RepairAdvice advice = propose_repairs(mesh, {}, needs, {});
        ASSERT_TRUE(advice.proposal) << find_defect(mesh, inspect_surface(mesh), needs)->what << ": " << advice.obstacle;
        TriMesh mended = mesh;
        const auto done = apply_repairs(mended, advice.proposal->repairs);
        ASSERT_TRUE(done.ok()) << done.error().message;
        EXPECT_FALSE(find_defect(mended, inspect_surface(mended), needs));
        EXPECT_DOUBLE_EQ(measure_surface(mended).area, advice.proposal->after.area);
    }
}

TEST(SurfaceRule, WhatWasAskedForStaysInTheChainWhereItHelps) {
    TriMesh mesh = ball(Vec3::Zero(), 0.05);
    mesh.triangles.erase(mesh.triangles.begin() + 5);
    const std::array asked{Repair::Weld};
    const RepairAdvice advice = propose_repairs(mesh, asked, kLumen, {});
    ASSERT_TRUE(advice.proposal);
    EXPECT_EQ(advice.proposal->repairs, (std::vector{Repair::Weld, Repair::FillHoles}));
    EXPECT_THAT(describe_advice(advice, RepairWriting::SceneKey),
                HasSubstr("\"repair\": [\"weld\", \"fill_holes\"] mends all of it: area "));
    EXPECT_THAT(describe_advice(advice, RepairWriting::Option), HasSubstr("--repair weld,fill_holes mends all of it: area "));
}

TEST(SurfaceRule, WhereNoChainDoesTheLastObstacleIsNamed) {
    TriMesh kidney;
    for (int i = 0; i < 15; ++i) kidney = join(kidney, ball(Vec3(0.015 * i, 0.001 * (i % 3), 0.002 * (i % 5)), 0.05));
    const RepairAdvice advice = propose_repairs(kidney, {}, kLumen, {});
    EXPECT_FALSE(advice.proposal);
    EXPECT_THAT(describe_advice(advice, RepairWriting::Option),
                AllOf(HasSubstr("no chain of repairs was found that mends all of it"), HasSubstr("drop_self_intersections")));
    EXPECT_FALSE(find_defect(kidney, inspect_surface(kidney), kBody)) << "a deformable body may overlap itself: a lattice takes it";
}

TEST(SurfaceRule, ASearchForCrossingsThatGaveUpIsNoProofThatThereAreNone) {
    EXPECT_EQ(describe_crossings({{}, 0, true}), "");
    EXPECT_THAT(describe_crossings({{}, 0, false}), HasSubstr("may pass through itself: more than 300000000 pairs of triangles are too near"));
    EXPECT_EQ(describe_crossings({{{1, 2}}, 7, true}), "passes through itself: 7 pairs of triangles cross");
    EXPECT_THAT(describe_crossings({{{1, 2}}, 7, false}), HasSubstr("7 pairs of triangles cross, and more may"));
}

TEST(SurfaceRule, APolygonOfTwoHundredThousandCornersIsNotTriedForEver) {
    constexpr Index kCorners = 200'000;
    TriMesh polygon;
    for (Index i = 0; i < kCorners; ++i)
        polygon.vertices.emplace_back(std::cos(6.283185307179586 * i / kCorners), std::sin(6.283185307179586 * i / kCorners), 0.0);
    for (Index i = 2; i < kCorners; ++i) polygon.triangles.push_back({0, i - 1, i});
    const auto defect = find_defect(polygon, inspect_surface(polygon), kLumen);
    ASSERT_TRUE(defect);
    EXPECT_THAT(defect->what, HasSubstr("200000 border edges"));
    const RepairAdvice advice = propose_repairs(polygon, {}, kLumen, {});
    EXPECT_FALSE(advice.proposal);
    EXPECT_THAT(advice.obstacle, HasSubstr("199998 triangles share vertex 0"));
}

class SurfaceFile : public testing::Test {
protected:
    SurfaceFile() { std::filesystem::create_directories(folder); }
    [[nodiscard]] std::filesystem::path write(const char* name, const TriMesh& mesh) const {
        EXPECT_TRUE(write_obj(folder / name, mesh).ok());
        return folder / name;
    }
    static std::string scene(const std::filesystem::path& file, const std::string& keys,
                             const std::string& body = R"("kind": "static", "hollow": true)") {
        return fmt::format(
            R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 0.1}}, "bodies": {{"vessel":
            {{{}, "surface": {{"file": "{}"{}}}}}}}, "effects": []}})",
            body, file.string(), keys);
    }
    static Result<PreparedScene> prepare_text(const std::string& text) {
        const Result<Scene> scene = parse_scene(text, "test.json");
        EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
        if (!scene.ok()) return scene.error();
        return make_prepared_scene(*scene);
    }
    static Result<MeshPreparation> prepare_file(const std::filesystem::path& file) {
        PrepareOptions options;
        options.use_cache = false;
        options.spheres.depth = 1;
        return prepare_mesh(file, options, [](const std::string&) {});
    }
    const std::filesystem::path folder = std::filesystem::path(testing::TempDir()) / "trocar_surface_rule";
};

TEST_F(SurfaceFile, ThatCrossesItselfIsRefusedAlikeAsALumenAndByPrepare) {
    const auto file = write("crossing.obj", join(ball(Vec3::Zero(), 0.05), ball(Vec3(0.094, 0.003, 0.007), 0.05)));
    const auto lumen = prepare_text(scene(file, ""));
    const auto prepared = prepare_file(file);
    ASSERT_FALSE(lumen.ok());
    ASSERT_FALSE(prepared.ok());
    EXPECT_THAT(lumen.error().message,
                AllOf(HasSubstr("pairs of triangles cross"), HasSubstr("\"repair\": [\"drop_self_intersections\"] mends all of it")));
    EXPECT_THAT(prepared.error().message,
                AllOf(HasSubstr("pairs of triangles cross"), HasSubstr("--repair drop_self_intersections mends all of it")));
    const auto mended = prepare_text(scene(file, R"(, "repair": ["drop_self_intersections"])"));
    EXPECT_TRUE(mended.ok()) << mended.error().to_string();
    const auto allowed = prepare_text(scene(file, R"(, "may_cross": true)"));
    ASSERT_TRUE(allowed.ok()) << allowed.error().to_string();
    EXPECT_THAT(allowed->bodies[0].notes, Contains(HasSubstr("pairs of triangles cross")));
}

TEST_F(SurfaceFile, OfWhichEveryFaceStandsTwiceIsRefusedWithTheRepairThatHelps) {
    TriMesh twice = ball(Vec3::Zero(), 0.05);
    twice.triangles.insert(twice.triangles.end(), twice.triangles.begin(),
                           twice.triangles.begin() + static_cast<std::ptrdiff_t>(twice.triangles.size()));
    const auto file = write("twice.obj", twice);
    const auto prepared = prepare_file(file);
    ASSERT_FALSE(prepared.ok());
    EXPECT_THAT(prepared.error().message, AllOf(HasSubstr("triangles stand twice"), HasSubstr("--repair drop_duplicates mends all of it")));
    const auto lumen = prepare_text(scene(file, ""));
    ASSERT_FALSE(lumen.ok());
    EXPECT_THAT(lumen.error().message, HasSubstr("\"repair\": [\"drop_duplicates\"]"));
}

TEST_F(SurfaceFile, RepairsThatTakeTooMuchStopTheSceneUnlessItAllowsIt) {
    TriMesh kidney;
    for (int i = 0; i < 8; ++i) kidney = join(kidney, ball(Vec3(0.03 * i, 0.001 * (i % 3), 0.002 * (i % 5)), 0.05));
    const auto file = write("kidney.obj", kidney);
    const std::string body = R"("kind": "static")", repair = R"(, "repair": ["drop_self_intersections"])";
    const auto refused = prepare_text(scene(file, repair, body));
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().to_string(), AllOf(HasSubstr("kidney.obj"), HasSubstr("bodies.vessel.surface"), HasSubstr("would remove"),
                                                   HasSubstr("\"may_remove\": ")));
    const auto allowed = prepare_text(scene(file, repair + R"(, "may_remove": 1, "may_split": true)", body));
    ASSERT_TRUE(allowed.ok()) << allowed.error().to_string();
    EXPECT_THAT(allowed->bodies[0].notes, Contains(AllOf(HasSubstr("repair drop_self_intersections"), HasSubstr("components 8"))));
}

TEST_F(SurfaceFile, OfAThinShellIsRefusedByTheLatticeWithTheRepairThatHelps) {
    TriMesh inner = ball(Vec3::Zero(), 0.0495);
    for (Triangle& t : inner.triangles) std::swap(t[1], t[2]); // it looks into the hollow
    const auto file = write("shell.obj", join(ball(Vec3::Zero(), 0.05), inner));
    const std::string body = R"("kind": "deformable", "coarse": {"surface_triangles": 100, "mesher": "lattice"},
        "material": {"young_modulus": 8, "poisson_ratio": 0.45, "density": 1060})";
    const auto refused = prepare_text(scene(file, "", body));
    ASSERT_FALSE(refused.ok());
    EXPECT_THAT(refused.error().to_string(),
                AllOf(HasSubstr("bodies.vessel"), HasSubstr("thinner than a cell"), HasSubstr("\"surface_triangles\" than 100"),
                      HasSubstr("\"repair\": [\"drop_inner_shells\"]"), HasSubstr("\"mesher\": \"tetgen\"")));
    const auto mended = prepare_text(scene(file, R"(, "repair": ["drop_inner_shells"], "may_remove": 1, "may_split": true)", body));
    EXPECT_TRUE(mended.ok()) << mended.error().to_string();
}

TEST_F(SurfaceFile, OfTetrahedraGivesTheirBoundary) {
    const TetMesh bar = fem::make_bar_mesh({4, 3, 3}, 0.01, 0.0);
    ASSERT_TRUE(write_vtu(folder / "bar.vtu", bar).ok());
    std::string msh = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n" + std::to_string(bar.vertices.size()) + "\n";
    for (std::size_t i = 0; i < bar.vertices.size(); ++i)
        msh += fmt::format("{} {} {} {}\n", i + 1, bar.vertices[i][0], bar.vertices[i][1], bar.vertices[i][2]);
    msh += "$EndNodes\n$Elements\n" + std::to_string(bar.tets.size()) + "\n";
    for (std::size_t i = 0; i < bar.tets.size(); ++i)
        msh += fmt::format("{} 4 0 {} {} {} {}\n", i + 1, bar.tets[i][0] + 1, bar.tets[i][1] + 1, bar.tets[i][2] + 1, bar.tets[i][3] + 1);
    std::ofstream(folder / "bar.msh") << msh << "$EndElements\n";
    for (const char* name : {"bar.vtu", "bar.msh"}) {
        SCOPED_TRACE(name);
        std::string note;
        const auto surface = read_surface(folder / name, {}, &note);
        ASSERT_TRUE(surface.ok()) << surface.error().to_string();
        EXPECT_TRUE(check_closed_surface(*surface).ok());
        EXPECT_NEAR(signed_volume(*surface), 36e-6, 1e-12);
        EXPECT_THAT(note, HasSubstr(fmt::format("the boundary of {} tetrahedra", bar.tets.size())));
        const auto prepared = prepare_file(folder / name);
        ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
        EXPECT_THAT(prepared->notes, Contains(HasSubstr("\"coarse\"")));
        const auto body = prepare_text(
            scene(folder / name, "",
                  R"("kind": "deformable", "material": {"young_modulus": 5}, "coarse": {"mesher": "lattice", "surface_triangles": 100})"));
        ASSERT_TRUE(body.ok()) << body.error().to_string();
        EXPECT_THAT(body->bodies[0].notes, Contains(HasSubstr("boundary of")));
    }
}

/// Tetrahedra of a block, and the surface of a smaller block within it, as meshers of a hull around an organ write them.
TEST_F(SurfaceFile, OfTetrahedraWithClosedTrianglesOfTheirOwnGivesThose) {
    const TetMesh bar = fem::make_bar_mesh({4, 3, 3}, 0.01, 0.0);
    TetMesh part = bar; // its lowest layer
    part.tets.resize(bar.tets.size() / 3);
    const std::vector<Triangle> inner = boundary_surface(part).triangles;
    const auto write_both = [&](std::vector<Triangle> faces, bool inward) {
        if (inward)
            for (Triangle& t : faces) std::swap(t[1], t[2]);
        std::string medit = fmt::format("MeshVersionFormatted 1\nDimension 3\nVertices\n{}\n", bar.vertices.size());
        std::string msh = fmt::format("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n", bar.vertices.size());
        for (std::size_t i = 0; i < bar.vertices.size(); ++i) {
            const std::string place = fmt::format("{} {} {}", bar.vertices[i][0], bar.vertices[i][1], bar.vertices[i][2]);
            medit += place + " 0\n";
            msh += fmt::format("{} {}\n", i + 1, place);
        }
        medit += fmt::format("Triangles\n{}\n", faces.size());
        msh += fmt::format("$EndNodes\n$Elements\n{}\n", faces.size() + bar.tets.size());
        std::size_t id = 0;
        for (const Triangle& t : faces) {
            medit += fmt::format("{} {} {} 1\n", t[0] + 1, t[1] + 1, t[2] + 1);
            msh += fmt::format("{} 2 2 0 1 {} {} {}\n", ++id, t[0] + 1, t[1] + 1, t[2] + 1);
        }
        medit += fmt::format("Tetrahedra\n{}\n", bar.tets.size());
        for (const Tet& t : bar.tets) {
            medit += fmt::format("{} {} {} {} 1\n", t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
            msh += fmt::format("{} 4 2 0 1 {} {} {} {}\n", ++id, t[0] + 1, t[1] + 1, t[2] + 1, t[3] + 1);
        }
        std::ofstream(folder / "both.mesh") << medit << "End\n";
        std::ofstream(folder / "both.msh") << msh << "$EndElements\n";
    };
    const auto read = [&](const char* name, std::size_t triangles, const std::string& said) {
        SCOPED_TRACE(name);
        std::string note;
        const auto surface = read_surface(folder / name, {}, &note);
        ASSERT_TRUE(surface.ok()) << surface.error().to_string();
        EXPECT_EQ(surface->triangles.size(), triangles);
        EXPECT_TRUE(check_closed_surface(*surface).ok());
        EXPECT_GT(signed_volume(*surface), 0.0);
        EXPECT_THAT(note, HasSubstr(said));
        EXPECT_EQ(read_tets(folder / name)->tets.size(), bar.tets.size());
    };
    const std::size_t outer = boundary_surface(bar).triangles.size();
    for (const char* name : {"both.mesh", "both.msh"}) {
        for (const bool inward : {false, true}) {
            write_both(inner, inward);
            read(name, inner.size(), fmt::format("the file's own {} triangles, a closed surface", inner.size()));
        }
        write_both({inner.begin() + 1, inner.end()}, false);
        read(name, outer, fmt::format("the boundary of {} tetrahedra (the file's own {} triangles were left aside", bar.tets.size(), inner.size() - 1));
        write_both(boundary_surface(bar).triangles, false);
        read(name, outer, fmt::format("the boundary of {} tetrahedra; ", bar.tets.size()));
    }
}

} // namespace
} // namespace trocar::engine
