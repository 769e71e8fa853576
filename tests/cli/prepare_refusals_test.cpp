// Surfaces that `prepare` refuses, with numbers and what was expected, and thin ones whose work is bounded.
#include "program.hpp"

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

TEST_F(Preparation, OfANeedleEndsAndSaysThatItsSpheresAreCoarser) {
    const fs::path needle = write("needle.obj", cube_with_corner("1e6"));
    const Ended ended = prepare(needle, {"--builder", "shell", "--depth", "1"});
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("notice: the sphere tree is coarser than its depth allows")) << ended;
    EXPECT_NE(text_of(out() / "prepare.json").find("coarser than its depth allows"), std::string::npos);
    const Ended plain = prepare(write("cube.obj", cube_with_corner("1")), {"--depth", "1"});
    EXPECT_TRUE(ended_with(plain, 0) && !plain.says("coarser")) << plain;
}

} // namespace
} // namespace trocar::cli_test
