// A scene that is too large is refused before anything of that size is made, with the key that made it so.
#include "assets/anatomy/shapes.hpp"
#include "engine/prepare/prepare_body.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/scene/scene_size.hpp"
#include "scene_fixture.hpp"

namespace trocar::engine {
namespace {

const std::string kHead = R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 1}, "bodies": {)";

std::string body(const std::string& name, const std::string& surface, const std::string& kind = R"("kind": "static")") {
    return "\"" + name + "\": {" + kind + ", \"surface\": {" + surface + "}}";
}

std::string sides(int count) { return ", \"sides\": " + std::to_string(count); }

const std::string kLargestBox = R"("shape": "box", "extent": [10, 10, 10], "cells": 500)"; // 3 million triangles

Scene parsed(const std::string& text) {
    Result<Scene> scene = parse_scene(text, "scenes/test.json");
    EXPECT_TRUE(scene.ok()) << (scene.ok() ? "" : scene.error().to_string());
    return scene.ok() ? *scene : Scene{};
}

TEST(SceneSize, ShapesAreCountedAsTheyAreMade) {
    const auto shape = [](const std::string& text) { return parsed(kHead + body("a", text) + "}}").bodies.at(0).surface.shape; };
    for (const int n : {0, 1, 4}) {
        const ShapeSpec sphere = shape(R"("shape": "sphere", "radius": 5, "subdivisions": )" + std::to_string(n));
        EXPECT_EQ(count_triangles(sphere), anatomy::make_icosphere(sphere.centre, sphere.radius, n).triangles.size());
    }
    for (const int n : {1, 2, 9}) {
        const ShapeSpec box = shape(R"("shape": "box", "extent": [1, 2, 3], "cells": )" + std::to_string(n));
        EXPECT_EQ(count_triangles(box), anatomy::make_box(box.centre, box.extent, n).triangles.size());
    }
    for (const int n : {3, 7, 8, 24}) {
        const ShapeSpec tube = shape(R"("shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 50, 3], [0, 9, 90, 3]])" + sides(n));
        EXPECT_EQ(count_triangles(tube), anatomy::make_tube(tube.axis, tube.axis_radii, n).triangles.size()) << n;
        const ShapeSpec torus = shape(R"("shape": "torus", "radius": 9, "tube_radius": 2)" + sides(n));
        EXPECT_EQ(count_triangles(torus), anatomy::make_torus(Vec3::Zero(), 9, 2, 2 * n, n).triangles.size()) << n;
    }
}

TEST(SceneSize, AShortTextOfFarRowsIsNoTubeOfManyRings) {
    std::string rows = "[0, 0, 0, 0.01]";
    for (int i = 1; i < 20000; ++i) rows += i % 2 == 0 ? ", [0, 0, 0, 0.01]" : ", [90000, 0, 0, 0.01]"; // 40 million rings
    const Error error = refusal(kHead + body("a", R"("shape": "tube", "axis": [)" + rows + "]") + "}}");
    EXPECT_EQ(error.code, ErrorCode::BadValue);
    EXPECT_TRUE(says(error, "bodies.a.surface.axis["));
    EXPECT_TRUE(says(error, "10000000 in the scene"));
    EXPECT_EQ(error.line, 1U);
    EXPECT_LT(error.column, 5000U) << "the remaining rows are not read";
}

TEST(SceneSize, ShapesTogetherAreRefusedAtTheOneThatIsTooMuch) {
    std::string text = kHead;
    for (const char* name : {"a", "b", "c", "d"}) text += (text == kHead ? "\n" : ",\n") + body(name, kLargestBox);
    const Error error = refusal(text + "}}");
    EXPECT_EQ(error.key, "bodies.d.surface");
    EXPECT_EQ(error.line, 5U);
    EXPECT_TRUE(says(error, "a box of 500 cells an edge: 3000000 triangles, and 12000000 with what stands before"));
}

TEST(SceneSize, SkinsOfInstrumentsCount) {
    std::string text =
        kHead + body("tube", R"("shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 90, 4]])", R"("kind": "static", "hollow": true)");
    text += "}, \"instruments\": {";
    for (int i = 0; i < 10; ++i)
        text +=
            (i > 0 ? ", \"w" : "\"w") + std::to_string(i) +
            R"(": {"length": 90, "radius": 0.4, "skin_triangles": 1000000, "lumen": "tube", "entry": {"position": [0, 0, 9], "direction": [0, 0, 1]}})";
    EXPECT_EQ(refusal(text + "}}").key, "instruments.w9");
}

TEST(SceneSize, AShapeOfTooManyTrianglesIsRefusedBeforeItIsMade) {
    const std::string hollow = R"("kind": "static", "hollow": true)", tube = R"("shape": "tube", "axis": [[0, 0, 0, 4], [0, 0, 90, 4]])";
    const Error error = refusal(kHead + body("tube", tube + sides(1000), hollow) + "}}");
    EXPECT_EQ(error.key, "bodies.tube.surface.sides");
    EXPECT_TRUE(says(error, "4998000 triangles; expected at most 1000000, \"sides\": 236")) << error.to_string();
    EXPECT_EQ(refusal(kHead + body("a", kLargestBox, R"("kind": "static", "hollow": true)") + "}}").key, "bodies.a.surface.cells");
    EXPECT_TRUE(parse_scene(kHead + body("tube", tube + sides(200), hollow) + "}}", "scenes/test.json").ok());
}

TEST(SceneSize, ATubeThatIsALittleTooLongIsToldWithAllItsDigits) {
    const std::string tube = R"("shape": "tube", "axis": [[0, 0, 0, 20], [0, 0, 10000.01, 20]])";
    const auto prepared = make_prepared_scene(parsed(kHead + body("tube", tube) + "}}"));
    ASSERT_FALSE(prepared.ok());
    EXPECT_TRUE(says(prepared.error(), "longest side is 10.00001")) << prepared.error().to_string();
    EXPECT_TRUE(says(prepared.error(), "bodies measure 0.0001 m to 10 m"));
}

TEST(SceneSize, MoreThanAThousandBodiesAreRefused) {
    std::string text = kHead;
    for (int i = 0; i <= 1000; ++i) text += (i > 0 ? ", " : "") + body("b" + std::to_string(i), R"("shape": "sphere", "radius": 5)");
    const Error error = refusal(text + "}}");
    EXPECT_EQ(error.key, "bodies");
    EXPECT_TRUE(says(error, "found 1001 bodies and instruments; expected at most 1000"));
}

TEST(SceneSize, AFileIsRefusedOnceItIsReadAndNothingElseIsMade) {
    const SceneFolder folder;
    std::string obj;
    for (int i = 0; i < 5000; ++i)
        obj += "v " + std::to_string(i) + " 0 0\nv " + std::to_string(i) + " 1 0\nv " + std::to_string(i) + " 0 1\nf -3 -2 -1\n";
    const auto file = folder.write("mesh.obj", obj);
    std::string text = kHead + body("mesh", "\"file\": \"" + file.string() + "\"");
    for (const char* name : {"a", "b", "c"}) text += "," + body(name, kLargestBox);
    text += "," + body("d", R"("shape": "box", "extent": [10, 10, 10], "cells": 288)") + "}}"; // 9,995,328 in all
    const auto prepared = make_prepared_scene(parsed(text));
    ASSERT_FALSE(prepared.ok());
    EXPECT_EQ(prepared.error().key, "bodies.mesh.surface");
    EXPECT_TRUE(says(prepared.error(), "found 5000 triangles, 10000328 with the other bodies; expected at most 10000000"));
}

TEST(SceneSize, TetrahedraAreCountedOverAllBodies) {
    const std::string ball = R"("shape": "sphere", "radius": 50)";
    const std::string tissue = R"("kind": "deformable", "coarse": {"mesher": "lattice", "surface_triangles": )";
    const Scene scene = parsed(kHead + body("ball", ball, tissue + "200}") + "}}");
    const auto prepare = [&](std::size_t before) {
        PreparedScene prepared;
        prepared.bodies.emplace_back().coarse_tets = before;
        CoarseBodies coarse;
        PatientShelf shelf;
        return prepare_body(scene, scene.bodies[0], shelf, coarse, prepared);
    };
    EXPECT_TRUE(prepare(0).ok());
    const Result<void> full = prepare(kMostTets - 10);
    ASSERT_FALSE(full.ok());
    EXPECT_EQ(full.error().key, "bodies.ball.coarse");
    EXPECT_TRUE(says(full.error(), "with the other bodies; expected at most 5000000 in the scene"));
}

TEST(SceneSize, ALatticeOfMoreTetrahedraIsRefusedBeforeItIsMade) {
    const std::string tissue = R"("kind": "deformable", "coarse": {"mesher": "lattice", "surface_triangles": 1000000})";
    const auto prepared = make_prepared_scene(parsed(kHead + body("ball", R"("shape": "sphere", "radius": 50)", tissue) + "}}"));
    ASSERT_FALSE(prepared.ok());
    EXPECT_EQ(prepared.error().key, "bodies.ball.coarse");
    EXPECT_TRUE(says(prepared.error(), "larger cells or fewer surface triangles are needed"));
}

} // namespace
} // namespace trocar::engine
