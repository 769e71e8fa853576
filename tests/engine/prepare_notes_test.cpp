// What preparing a scene warns of: the sliver that sets the step, a Poisson's ratio at which linear tetrahedra lock, a body inside
// another.
#include "engine/io/write_mesh.hpp"
#include "fem/mesh/bar_mesh.hpp"
#include "step_fixture.hpp"

#include "base/topology.hpp"

#include <gmock/gmock.h>

#include <filesystem>

#include <unistd.h>

namespace trocar::engine {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

std::string block_scene(const std::string& coarse, double poisson_ratio, const std::string& elements = "automatic") {
    return fmt::format(R"({{"units": {{"length": "m", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 0.1}}, "bodies": {{"block":
        {{"kind": "deformable", "surface": {{"shape": "box", "centre": [0.015, 0.015, 0.015], "extent": [0.03, 0.03, 0.03], "cells": 3}},
        "material": {{"young_modulus": 5, "poisson_ratio": {}, "elements": "{}"}}, "coarse": {}}}}}, "effects": ["elasticity"]}})",
                       poisson_ratio, elements, coarse);
}

/// A cube of 3 x 3 x 3 cells of 10 mm, and one more tet on a face of it, `height` cells high.
TetMesh cube_with_a_thin_tet(double height, Tet& thin) {
    TetMesh mesh = fem::make_bar_mesh({3, 3, 3}, 0.01, 0.0);
    const Triangle face = boundary_surface(mesh).triangles[20];
    const Vec3 &a = mesh.vertices[face[0]], &b = mesh.vertices[face[1]], &c = mesh.vertices[face[2]];
    const Vec3 apex = (a + b + c) / 3.0 + 0.01 * height * (b - a).cross(c - a).normalized();
    thin = {face[0], face[1], face[2], static_cast<Index>(mesh.vertices.size())};
    mesh.vertices.push_back(apex);
    mesh.tets.push_back(thin);
    return mesh;
}

TEST(PreparationNotes, NameTheSliverThatSetsTheStepWithItsNodesAndHeight) {
    const std::filesystem::path file = std::filesystem::path(testing::TempDir()) / "sliver.vtu";
    for (const double height : {0.01, 0.5}) {
        Tet thin;
        const TetMesh mesh = cube_with_a_thin_tet(height, thin);
        ASSERT_TRUE(write_vtu(file, mesh).ok());
        const PreparedScene prepared = test::prepare(block_scene(fmt::format(R"({{"file": "{}"}})", file.string()), 0.3));
        ASSERT_EQ(prepared.bodies.size(), 1u);
        const std::string named =
            fmt::format("tetrahedron {} (nodes {}, {}, {}, {}) is a sliver, ", mesh.tets.size() - 1, thin[0], thin[1], thin[2], thin[3]);
        const auto& notes = prepared.bodies[0].notes;
        if (height < 0.05) {
            EXPECT_THAT(notes,
                        Contains(AllOf(HasSubstr(named), HasSubstr(fmt::format("{:.3g} of its longest edge high", height / std::sqrt(2.0))),
                                       HasSubstr(fmt::format("stable step of {:.3g} s", prepared.bodies[0].stable_step_s)))));
        } else {
            EXPECT_THAT(notes, Not(Contains(HasSubstr("sliver"))));
        }
    }
}

TEST(PreparationNotes, WarnOfLockingOfLinearElementsAboveAPoissonsRatioOf045WithTheNumbers) {
    for (const char* elements : {"linear", "patched", "automatic"})
        for (const double nu : {0.3, 0.45, 0.46, 0.49, 0.499}) {
            const PreparedScene prepared = test::prepare(block_scene(R"({"mesher": "lattice", "surface_triangles": 60})", nu, elements));
            ASSERT_EQ(prepared.bodies.size(), 1u);
            const auto& notes = prepared.bodies[0].notes;
            if (nu > 0.45 && elements == std::string("linear")) {
                EXPECT_THAT(notes, Contains(AllOf(HasSubstr(fmt::format("Poisson's ratio {} above 0.45", nu)), HasSubstr("lock"),
                                                  HasSubstr("0.88 of what it should at 0.45, 0.71 at 0.49, 0.29 at 0.499"))));
            } else {
                EXPECT_THAT(notes, Not(Contains(HasSubstr("lock")))) << nu << elements;
            }
        }
}

TEST(PreparationNotes, NameASolidThatStartsWhollyInsideAnother) {
    const auto ball = [](const char* name, double x, double radius, const std::string& kind) {
        return fmt::format(
            R"("{}": {{"kind": "{}", {}"surface": {{"shape": "sphere", "centre": [{}, 0, 0], "radius": {}, "subdivisions": 2}}}})", name,
            kind, kind == "kinematic" ? R"("motion": [[0, 0, 0, 0], [0.1, 1, 0, 0]], )" : "", x, radius);
    };
    const auto notes_of = [&](double x, const char* kind) -> std::vector<std::string> {
        const PreparedScene prepared =
            test::prepare(fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}}, "time": {{"step": 0.01, "duration": 0.1}},
            "bodies": {{{}, {}}}, "effects": ["coarse_contact"]}})",
                                      ball("large", 0, 30, "static"), ball("small", x, 5, kind)));
        if (prepared.bodies.size() != 2) return {"not prepared"};
        EXPECT_EQ(prepared.model.nested.size(), prepared.bodies[1].notes.size());
        return prepared.bodies[1].notes;
    };
    EXPECT_THAT(notes_of(20, "kinematic"), Contains(HasSubstr("starts wholly inside large")));
    EXPECT_THAT(notes_of(28, "kinematic"), Not(Contains(HasSubstr("inside")))) << "their surfaces cross: that is a contact";
    EXPECT_THAT(notes_of(40, "kinematic"), Not(Contains(HasSubstr("inside"))));
    EXPECT_THAT(notes_of(20, "static"), Not(Contains(HasSubstr("inside")))) << "neither ever moves";
}

TEST(PreparationNotes, SayHowFarTwoSolidsOverlapAtTheStart) {
    const auto notes_of = [](const char* block, const char* ground) {
        const PreparedScene prepared = test::prepare(fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}},
            "time": {{"step": 0.01, "duration": 0.1}}, "effects": ["coarse_contact"], "bodies": {{
            "block": {{"kind": "deformable", "surface": {{"shape": "box", {}}}}}, "ground": {{"kind": "static", "surface": {{"shape": "box", {}}}}}}}}})",
                                                                 block, ground));
        return prepared.bodies.empty() ? std::vector<std::string>{"not prepared"} : prepared.bodies.front().notes;
    };
    const auto on_table = [&](double gap) {
        return notes_of(fmt::format(R"("centre": [0, 0, {}], "extent": [20, 20, 20], "cells": 2)", 10.0 + gap).c_str(),
                        R"("centre": [0, 0, -5], "extent": [100, 100, 10], "cells": 2)");
    };
    const auto across_wall = [&](double gap) { // no vertex of either is in the other
        return notes_of(fmt::format(R"("centre": [1, 2, {}], "extent": [90, 20, 20], "cells": 1)", 10.0 + gap).c_str(),
                        R"("centre": [0, 0, -20], "extent": [30, 200, 40], "cells": 1)");
    };
    EXPECT_THAT(on_table(-1.5), Contains(HasSubstr("overlaps ground at the start by up to 1.5 mm (10 vertices in the other)")));
    EXPECT_THAT(on_table(0.0), Not(Contains(HasSubstr("overlaps")))) << "it is laid on the table";
    EXPECT_THAT(on_table(0.5), Not(Contains(HasSubstr("overlaps"))));
    EXPECT_THAT(across_wall(-4.0), Contains(HasSubstr("overlaps ground at the start (edges cross, with no vertex in the other)")));
    EXPECT_THAT(across_wall(0.0), Not(Contains(HasSubstr("overlaps"))));
}

TEST(PreparationNotes, SayOfNoShippedSceneOfSolidsThatTheyOverlap) {
    for (const char* name : {"falling_sphere", "heap", "needle_and_liver", "spikes", "two_organs"}) {
        const Result<Scene> scene = read_scene(std::filesystem::path(TROCAR_SOURCE_DIR) / "assets/scenes" / (std::string(name) + ".json"));
        ASSERT_TRUE(scene.ok()) << scene.error().to_string();
        const Result<PreparedScene> prepared = make_prepared_scene(*scene);
        ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
        for (const BodySummary& body : prepared->bodies) EXPECT_THAT(body.notes, Not(Contains(HasSubstr("overlaps")))) << name << ": " << body.name;
    }
}

TEST(PreparationNotes, SayThatCornersStandTooFarOffTheLattice) {
    TriMesh pyramid; // its tip is cells away
    pyramid.vertices = {{-20, -20, 0}, {20, -20, 0}, {20, 20, 0}, {-20, 20, 0}, {0, 0, 300}};
    pyramid.triangles = {{0, 2, 1}, {0, 3, 2}, {0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
    const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / fmt::format("pyramid_{}.obj", getpid());
    ASSERT_TRUE(write_obj(file, pyramid).ok());
    const auto notes_of = [](const char* mesher, const std::string& surface) {
        const PreparedScene prepared = test::prepare(fmt::format(R"({{"units": {{"length": "mm", "pressure": "kPa"}},
            "time": {{"step": 0.01, "duration": 0.1}}, "effects": ["coarse_contact", "elasticity"], "bodies": {{"bar": {{"kind": "deformable",
            "surface": {}, "coarse": {{"mesher": "{}", "surface_triangles": 200}}}}}}}})",
                                                                 surface, mesher));
        return prepared.bodies.empty() ? std::vector<std::string>{"not prepared"} : prepared.bodies.front().notes;
    };
    const std::string box = R"({"shape": "box", "centre": [0, 0, 0], "extent": [60, 20, 20], "cells": 1})", tip = fmt::format("\"{}\"", file.string());
    EXPECT_THAT(notes_of("lattice", tip), Contains(AllOf(HasSubstr("8 sharp edges"), HasSubstr("off the coarse mesh"))));
    EXPECT_THAT(notes_of("lattice", box), Not(Contains(HasSubstr("sharp edges")))) << "its corners follow the tetrahedra beneath them";
    EXPECT_THAT(notes_of("tetgen", box), Not(Contains(HasSubstr("sharp edges")))) << "its nodes are the corners";
}

} // namespace
} // namespace trocar::engine
