// Surfaces that `prepare` refuses, with numbers and what was expected, and thin ones whose work is bounded.
#include "program.hpp"

#include <cmath>

namespace trocar::cli_test {
namespace {

const std::vector<std::string> kBuilders = {"medial", "hubbard", "octree", "shell"};
const std::string kCubeFaces =
    "f 1 3 2\nf 1 4 3\nf 5 6 7\nf 5 7 8\nf 1 2 6\nf 1 6 5\nf 2 3 7\nf 2 7 6\nf 3 4 8\nf 3 8 7\nf 4 1 5\nf 4 5 8\n";

/// A box on the origin with sides 1, 1 and `height`, whose corner across from the origin is at `far` in each coordinate.
std::string cube_with_corner(const std::string& far, const std::string& height = "1") {
    std::ostringstream text;
    text << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 " << height << "\nv 1 0 " << height << "\nv " << far << " " << far << " "
         << (height == "1" ? far : height) << "\nv 0 1 " << height << "\n"
         << kCubeFaces;
    return text.str();
}

class Preparation : public Program {
protected:
    [[nodiscard]] Ended prepare(const fs::path& mesh, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {"prepare", mesh.string(), "--out", out().string(), "--no-cache", "--quiet", "--force"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return call(arguments);
    }
};

TEST_F(Preparation, OfCoordinatesWhoseVolumesWouldOverflowIsRefusedByEveryBuilder) {
    for (const char* far : {"1.1e30", "1e160", "1e308"}) {
        const fs::path mesh = write("far.obj", cube_with_corner(far));
        for (const std::string& builder : kBuilders) {
            const Ended ended = prepare(mesh, {"--builder", builder});
            EXPECT_TRUE(refuses(ended, "far.obj: vertex 6 lies ") && refuses(ended, "expected at most 1e+30 m")) << builder;
        }
    }
    EXPECT_TRUE(refuses(prepare(write("far.obj", cube_with_corner("1e20")), {"--unit", "1e12"}), "vertex 6 lies 1e+32 m"));
}

TEST_F(Preparation, TakesUnitsWithinReasonAlone) {
    const fs::path cube = write("cube.obj", cube_with_corner("1"));
    for (const char* unit : {"1e300", "1e-300", "inf", "nan", "0", "-1", "parsec"})
        EXPECT_TRUE(refuses(prepare(cube, {"--unit", unit}), "from 1e-12 to 1e+12")) << unit;
    EXPECT_TRUE(ended_with(prepare(cube, {"--unit", "1e12", "--depth", "1"}), 0));
}

TEST_F(Preparation, OfSpheresWhoseFilesNameIsNotUtf8IsWrittenDown) {
    const fs::path cube = write("cube.obj", cube_with_corner("1")), spheres = folder / ("s\xff" ".sph");
    ASSERT_TRUE(ended_with(prepare(cube, {"--depth", "1"}), 0));
    fs::rename(out() / "spheres.sph", spheres);
    ASSERT_TRUE(ended_with(prepare(cube, {"--spheres", spheres.string()}), 0));
    EXPECT_TRUE(Json::parse(text_of(out() / "prepare.json"), nullptr, false).is_object());
}

TEST_F(Preparation, OfASurfaceWithoutExtentAreaOrVolumeIsRefused) {
    const fs::path cube = write("cube.obj", cube_with_corner("1"));
    std::string point;
    for (int k = 0; k < 8; ++k) point += "v 1 2 3\n";
    const fs::path at_one = write("point.obj", point + kCubeFaces);
    const fs::path one = write("one.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 1 1\n");
    const fs::path needle = write("needle.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n");
    for (const char* builder : {"octree", "shell"}) {
        EXPECT_TRUE(refuses(prepare(at_one, {"--builder", builder}), "all vertices lie at one point")) << builder;
        EXPECT_TRUE(refuses(prepare(one, {"--builder", builder}), "all vertices lie at one point")) << builder;
        EXPECT_TRUE(refuses(prepare(needle, {"--builder", builder}), "the surface has no area")) << builder;
    }
    EXPECT_TRUE(refuses(prepare(at_one), "all vertices lie at one point"));
    const fs::path flat = write("flat.obj", cube_with_corner("1", "1e-300"));
    EXPECT_TRUE(refuses(prepare(flat), "flat.obj: the surface holds no volume"));
    EXPECT_TRUE(ended_with(prepare(flat, {"--builder", "shell", "--depth", "1"}), 0)) << "a sheet";
    EXPECT_TRUE(ended_with(prepare(cube, {"--unit", "1e-12", "--depth", "1"}), 0));
}

TEST_F(Preparation, OfManyTrianglesUponEachOtherIsRefusedBeforeTheyAreCompared) {
    std::string polygon = cube_with_corner("1");
    polygon.resize(polygon.find('f'));
    polygon += "f";
    for (int k = 0; k < 100'000; ++k) polygon.append(" ").append(std::to_string(1 + k % 8));
    const Ended ended = prepare(write("polygon.obj", polygon + "\n"), {"--builder", "shell"});
    EXPECT_TRUE(refuses(ended, "99998 triangles share 8 vertices") && refuses(ended, "drop_degenerate,drop_duplicates"));
}

/// Two polygons of so many corners, joined by squares; open: one of them alone.
std::string polygon_file(int corners, bool open) {
    std::ostringstream text;
    text.precision(12);
    for (const double z : {0.0, 0.01})
        for (int i = 0; i < corners; ++i)
            text << "v " << 0.05 * std::cos(6.283185307179586 * i / corners) << " " << 0.05 * std::sin(6.283185307179586 * i / corners) << " " << z << "\n";
    text << "f";
    for (int i = corners; i > 0; --i) text << " " << i;
    for (int i = 0; i < corners && !open; ++i) {
        const int next = (i + 1) % corners;
        text << "\nf " << 1 + i << " " << 1 + next << " " << 1 + corners + next << " " << 1 + corners + i;
    }
    text << (open ? "\n" : "\nf");
    for (int i = 0; i < corners && !open; ++i) text << " " << 1 + corners + i;
    text << "\n";
    return text.str();
}

TEST_F(Preparation, OfPolygonsWithVeryManyCornersIsRefusedAtOnceWhateverIsAsked) {
    constexpr double kSoon = 60.0; // s; a second on an idle machine
    const fs::path open = write("open.obj", polygon_file(200'000, true)), closed = write("closed.obj", polygon_file(100'000, false));
    for (const fs::path& mesh : {open, closed})
        for (const std::vector<std::string>& more :
             {std::vector<std::string>{}, {"--repair", "fill_holes"}, {"--builder", "shell"}, {"--repair", "drop_self_intersections"}}) {
            std::vector<std::string> arguments = {"prepare", mesh.string(), "--out", out().string(), "--no-cache", "--quiet", "--force"};
            arguments.insert(arguments.end(), more.begin(), more.end());
            const Ended ended = call(arguments, kSoon);
            EXPECT_TRUE(refuses(ended, " triangles share vertex ") && ended.says(" m; expected at most 5000, as of polygons")) << mesh;
            EXPECT_FALSE(ended.says("takes any surface")) << ended;
        }
    for (const char* body : {R"("kind": "static")", R"("kind": "static", "hollow": true)", R"("kind": "deformable", "material": {})"}) {
        const fs::path scene = write("prism.json", R"({"units": {"length": "m", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.1},
            "bodies": {"prism": {"surface": {"file": "closed.obj"}, )" + std::string(body) + R"(}}, "effects": []})");
        const Ended ended = call({"explain", scene.string()}, kSoon);
        EXPECT_TRUE(refuses(ended, " triangles share vertex ") && ended.says("prism.json:")) << body;
    }
    EXPECT_TRUE(ended_with(prepare(write("few.obj", polygon_file(500, false)), {"--depth", "1"}), 0));
}

TEST_F(Preparation, OfCubesThatShareAnEdgeNamesTheKeyThatLetsThemComeApart) {
    const fs::path pair = write("pair.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                                            "v 2 1 0\nv 2 2 0\nv 1 2 0\nv 2 1 1\nv 2 2 1\nv 1 2 1\n" +
                                                kCubeFaces +
                                                "f 3 10 9\nf 3 11 10\nf 7 12 13\nf 7 13 14\nf 3 9 12\nf 3 12 7\nf 9 10 13\nf 9 13 12\n"
                                                "f 10 11 14\nf 10 14 13\nf 11 3 7\nf 11 7 14\n");
    for (const std::vector<std::string>& more : {std::vector<std::string>{"--depth", "1"}, {"--depth", "1", "--repair", "drop_non_manifold"}})
        EXPECT_TRUE(refuses(prepare(pair, more), "--repair drop_non_manifold --may-split mends all of it"));
    const Ended mended = prepare(pair, {"--depth", "1", "--repair", "drop_non_manifold", "--may-split"});
    EXPECT_TRUE(ended_with(mended, 0) && mended.says("components 1 to 2")) << mended;
}

TEST_F(Preparation, SaysAnObstacleOnce) {
    const auto count = [](const std::string& text, const std::string& piece) {
        std::size_t found = 0;
        for (std::size_t at = text.find(piece); at != std::string::npos; at = text.find(piece, at + 1)) ++found;
        return found;
    };
    std::string crossing = cube_with_corner("1"), other = kCubeFaces; // a cube, and another across its corner
    std::string vertices = crossing.substr(0, crossing.find('f'));
    for (int i = 0; i < 8; ++i)
        vertices += "v " + std::to_string(0.5 + ((i & 1) != (i >> 1 & 1) ? 1.0 : 0.0)) + " " + std::to_string(0.45 + (i >> 1 & 1)) + " " +
                    std::to_string(0.4 + (i >> 2)) + "\n";
    std::istringstream faces(kCubeFaces);
    char letter = 0;
    int a = 0, b = 0, c = 0;
    while (faces >> letter >> a >> b >> c)
        other += "f " + std::to_string(a + 8) + " " + std::to_string(b + 8) + " " + std::to_string(c + 8) + "\n";
    const Ended ended = prepare(write("two.obj", vertices + other), {"--repair", "drop_self_intersections"});
    EXPECT_TRUE(refuses(ended, "no chain of repairs was found that mends all of it"));
    EXPECT_EQ(count(ended.err, "drop_self_intersections"), 1u) << ended;
}

TEST_F(Preparation, OfANeedleEndsAndSaysThatItsSpheresAreCoarser) {
    const fs::path needle = write("needle.obj", cube_with_corner("1e6"));
    const Ended ended = prepare(needle, {"--builder", "shell", "--depth", "1"});
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("notice: the sphere tree is coarser than its depth allows")) << ended;
    EXPECT_NE(text_of(out() / "prepare.json").find("coarser than its depth allows"), std::string::npos);
    const Ended plain = prepare(write("cube.obj", cube_with_corner("1")), {"--depth", "1"});
    EXPECT_TRUE(ended_with(plain, 0) && !plain.says("coarser")) << plain;
}

TEST_F(Preparation, TakesATreeFromAFileSaysWhatItLacksAndWritesItWhole) {
    const fs::path cube = write("cube.obj", cube_with_corner("1"));
    ASSERT_TRUE(ended_with(prepare(cube, {"--unit", "cm", "--depth", "2"}), 0));
    const std::string tree = text_of(out() / "spheres.sph");
    const fs::path own = write("own.sph", tree);
    const Ended whole = prepare(cube, {"--unit", "cm", "--spheres", own.string()});
    ASSERT_TRUE(ended_with(whole, 0));
    EXPECT_TRUE(whole.says("which hold all of the surface")) << whole;
    const fs::path poor = write("poor.sph", tree.substr(0, tree.rfind('\n', tree.size() - 2)) + "\n0 0 0 -1 1\n"); // the last leaf is gone
    const Ended ended = prepare(cube, {"--unit", "cm", "--spheres", poor.string()});
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("lay outside its leaves, by up to")) << ended;
    EXPECT_TRUE(ended.says("leaves grew to hold it")) << ended;
    const Json json = Json::parse(text_of(out() / "prepare.json"), nullptr, false);
    EXPECT_EQ(json["spheres"]["builder"], "file");
    EXPECT_GT(json["spheres"]["as_it_came"]["uncovered"].get<double>(), 0.0);
    EXPECT_GE(json["spheres"]["as_it_came"]["grown_leaves"].get<int>(), 1);
    for (const Json& level : json["spheres"]["levels"]) EXPECT_LT(level["uncovered"].get<double>(), 1e-7) << "as it is written it is whole";
    write("grown.sph", text_of(out() / "spheres.sph"));
    EXPECT_TRUE(prepare(cube, {"--unit", "cm", "--spheres", (folder / "grown.sph").string()}).says("which hold all of the surface"));
}

TEST_F(Preparation, RefusesATreeThatIsDamagedOrOfAnotherSizeAndOptionsOfABuilderBesideIt) {
    const fs::path cube = write("cube.obj", cube_with_corner("1"));
    const fs::path good = write("good.sph", "1 1\n0.5 0.5 0.5 0.9 1\n");
    EXPECT_TRUE(ended_with(prepare(cube, {"--spheres", good.string()}), 0));
    EXPECT_TRUE(refuses(prepare(cube, {"--spheres", (folder / "none.sph").string()}), "none.sph"));
    EXPECT_TRUE(refuses(prepare(cube, {"--spheres", write("empty.sph", "").string()}), "empty.sph"));
    EXPECT_TRUE(refuses(prepare(cube, {"--spheres", write("word.sph", "1 1\n0.5 x 0.5 0.9 1\n").string()}), "word.sph:2"));
    EXPECT_TRUE(refuses(prepare(cube, {"--spheres", write("mm.sph", "1 1\n500 500 500 900 1\n").string()}), "expected a tree of about its size"));
    EXPECT_TRUE(refuses(prepare(cube, {"--spheres", good.string(), "--builder", "shell"}), "--builder"));
    EXPECT_TRUE(refuses(prepare(cube, {"--spheres", good.string(), "--depth", "2"}), "--depth"));
}

} // namespace
} // namespace trocar::cli_test
