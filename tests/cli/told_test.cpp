// Warnings of a run that a user would not look for: settings that nothing reads, what was given up, meshes that do not fit. And
// what is refused before it costs anything.
#include "program.hpp"

#include <cmath>

namespace trocar::cli_test {
namespace {

class Told : public Program {
protected:
    [[nodiscard]] bool notices(const std::string& piece) const {
        const Json all = summary()["notices"];
        for (const Json& notice : all)
            if (notice.get<std::string>().find(piece) != std::string::npos) return true;
        return false;
    }
};

/// A soft ball of 60 mm on a table, and a press that leaves it a millimetre within a hundredth of a second.
const std::string kPress = R"({
  "units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 0.05},
  "bodies": {
    "ball": {"kind": "deformable", "surface": {"shape": "sphere", "centre": [0, 0, 30], "radius": 30, "subdivisions": 2},
             "material": {"young_modulus": 20, "density": 1000}, "coarse": {"mesher": "lattice", "surface_triangles": 100}},
    "table": {"kind": "static", "surface": {"shape": "box", "centre": [0, 0, -5], "extent": [200, 200, 10]}},
    "press": {"kind": "kinematic", "surface": {"shape": "box", "centre": [0, 0, 70], "extent": [200, 200, 10]},
              "motion": [[0, 0, 0, 0], [0.01, 0, 0, -64], [1, 0, 0, -64]]}
  },
  "effects": ["elasticity", "coarse_contact"]
})";

/// A cube of 20 mm whose tetrahedra come from a file.
std::string cube_scene(const std::string& file, const std::string& unit) {
    return R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.01, "duration": 0.02}, "bodies": {"cube": {
        "kind": "deformable", "surface": {"shape": "box", "centre": [10, 10, 10], "extent": [20, 20, 20]},
        "material": {"young_modulus": 20, "density": 1000}, "coarse": {"file": ")" +
           file + R"(", "unit": ")" + unit + R"("}}}, "effects": ["elasticity"]})";
}
/// Its six tetrahedra about one diagonal, moved along x.
std::string cube_tets(double size, double away = 0.0) {
    std::string text = "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n";
    for (int i = 0; i < 8; ++i)
        text += std::to_string((i & 1) * size + away) + " " + std::to_string((i >> 1 & 1) * size) + " " + std::to_string((i >> 2) * size) +
                "\n";
    text += "CELLS 6 30\n";
    for (const auto& [a, b] : {std::pair(1, 3), {3, 2}, {2, 6}, {6, 4}, {4, 5}, {5, 1}})
        text += "4 0 " + std::to_string(a) + " " + std::to_string(b) + " 7\n";
    return text + "CELL_TYPES 6\n10\n10\n10\n10\n10\n10\n";
}

TEST_F(Told, ACrushedBodyIsOnTheTerminalAndInTheSummary) {
    const Ended ended = run(write("press.json", kPress));
    ASSERT_TRUE(ended_with(ended, 0));
    ASSERT_GT(summary()["inverted_tets_max"], 0);
    EXPECT_NE(ended.err.find("Crushed elements: up to "), std::string::npos) << ended;
    EXPECT_TRUE(notices("Crushed elements: up to ")) << summary()["notices"];
    EXPECT_TRUE(notices("Solids deep in one another: by up to ")) << summary()["notices"];
    EXPECT_GT(summary()["deepest_touch_m"], 0.25 * 0.01) << "a quarter of the table";
    const std::string report = text_of(out() / "report.html");
    const std::size_t told = report.find("Crushed elements");
    ASSERT_NE(told, std::string::npos);
    EXPECT_EQ(report.find("Crushed elements", told + 1), std::string::npos) << "said once";
}

TEST_F(Told, ADriveThatWasSlowedIsOnTheTerminalAndInTheSummary) {
    const Ended ended = run(write("tube.json", with(kTube, "\"step\": 0.01", "\"step\": 0.1")));
    ASSERT_TRUE(ended_with(ended, 0));
    ASSERT_GT(summary()["hand_limited_steps"], 0);
    EXPECT_NE(ended.err.find("Drive slowed: in "), std::string::npos) << ended;
    EXPECT_TRUE(notices("Drive slowed: in ")) << summary()["notices"];
}

TEST_F(Told, ARunThatKeepsWhatItsSceneAsksSaysNothing) {
    const Ended ended = run(write("tube.json", kTube));
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_EQ(summary()["notices"], Json::array());
    EXPECT_EQ(ended.err, "");
}

/// The wire of kTube on its way to a target.
std::string led_to(const std::string& target, const std::string& more = "") {
    return with(with(kTube, R"("path": [[0, 20, 0], [0.2, 26, 0.4]])", R"("follow": {"target": "t")" + more + "}"), R"("effects":)",
                R"("targets": {"t": {"position": )" + target + R"(}}, "effects":)");
}

TEST_F(Told, ATargetThatIsNotReachedAsItStandsIsOnTheTerminalAndInTheSummary) {
    const std::pair<std::string, const char*> scenes[] = {{led_to("[3.6, 0, 60]"), "its tip comes no nearer than"},
                                                          {led_to("[5, 0, 60]"), "lies 1"},
                                                          {led_to("[0, 0, 60]", R"(, "tolerance": 9)"), "is wider than the lumen there"}};
    for (const auto& [scene, piece] : scenes) {
        const Ended ended = run(write("tube.json", scene), {"--force"});
        ASSERT_TRUE(ended_with(ended, 0));
        EXPECT_NE(ended.err.find("notice: targets.t"), std::string::npos) << ended;
        EXPECT_NE(ended.err.find(piece), std::string::npos) << piece << ended;
        EXPECT_TRUE(notices("targets.t") && notices(piece)) << summary()["notices"];
    }
    const Ended plain = run(write("tube.json", led_to("[0, 0, 60]")), {"--force"});
    EXPECT_TRUE(ended_with(plain, 0) && !plain.says("targets.t")) << plain;
}

/// Two cubes apart, of 20 mm and of `size`.
std::string two_cubes(double size) {
    std::string text = "OFF\n16 24 0\n";
    for (const auto& [at, edge] : {std::pair(0.0, 20.0), {40.0, size}})
        for (int i = 0; i < 8; ++i)
            text += std::to_string(at + (i & 1) * edge) + " " + std::to_string((i >> 1 & 1) * edge) + " " + std::to_string((i >> 2) * edge) + "\n";
    constexpr int kFaces[12][3] = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                                   {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
    for (const int first : {0, 8})
        for (const auto& face : kFaces)
            text += "3 " + std::to_string(first + face[0]) + " " + std::to_string(first + face[1]) + " " + std::to_string(first + face[2]) + "\n";
    return text;
}

TEST_F(Told, OfTwoShellsInOneBodyTheSmallerIsNotLostWithoutAWord) {
    const auto scene = [](const std::string& coarse) {
        return R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 0.01}, "bodies": {"organ": {"kind":
            "deformable", "surface": {"file": "two.off"}, "material": {}, "coarse": {)" +
               coarse + R"(}}}, "effects": ["elasticity"]})";
    };
    write("two.off", two_cubes(12));
    for (const std::string mesher : {R"("mesher": "lattice")", R"("mesher": "tetgen", "surface_triangles": 100)"}) {
        const Ended refused = run(write("two.json", scene(mesher)), {"--force"});
        EXPECT_TRUE(refuses(refused, "parts of the coarse mesh apart from its largest one") && refused.says("\"may_drop\": 0."))
            << mesher << refused;
        EXPECT_TRUE(refused.says("two.json:")) << refused;
        const Ended allowed = run(write("two.json", scene(mesher + R"(, "may_drop": 0.4)")), {"--force"});
        ASSERT_TRUE(ended_with(allowed, 0)) << mesher;
        EXPECT_NE(allowed.err.find("notice: bodies.organ: "), std::string::npos) << allowed;
        EXPECT_TRUE(notices("of the coarse mesh, ") && notices("were left out")) << summary()["notices"];
    }
}

TEST_F(Told, ABodyThatTouchesNothingHasNoContacts) {
    std::string axis;
    for (int i = 0; i <= 10; ++i) axis += "[-5.6, 0, " + std::to_string(3 * (10 - i)) + ", 5], ";
    for (int i = 1; i < 16; ++i)
        axis += "[" + std::to_string(-5.6 * std::cos(3.14159265 * i / 16)) + ", 0, " + std::to_string(-5.6 * std::sin(3.14159265 * i / 16)) + ", 5], ";
    for (int i = 0; i <= 10; ++i) axis += "[5.6, 0, " + std::to_string(3 * i) + ", 5]" + (i < 10 ? ", " : "");
    const Ended ended = run(write("u.json", R"({"units": {"length": "mm", "pressure": "kPa"}, "time": {"step": 0.005, "duration": 0.05},
        "gravity": [-9810, 0, 0], "bodies": {"u": {"kind": "deformable", "surface": {"shape": "tube", "axis": [)" +
                                               axis + R"(]}, "material": {"young_modulus": 8}, "coarse": {"surface_triangles": 800}}},
        "effects": ["elasticity", "gravity", "coarse_contact", "self_contact"]})"));
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_EQ(summary()["contacts_total"], 0);
    ASSERT_TRUE(ended_with(run(write("press.json", kPress), {"--force"}), 0));
    EXPECT_GT(summary()["contacts_total"], 0) << "and one that is pressed has";
}

TEST_F(Told, SettingsThatNothingReadsAreNamed) {
    const std::string settings = R"("contact": {"culling": "cpu", "exact_distance": 0.00005, "solid_friction": 0.2}, "bodies":)";
    const Ended ended = run(write("press.json", with(kPress, "\"bodies\":", settings)));
    ASSERT_TRUE(ended_with(ended, 0));
    for (const char* key : {"contact.culling", "contact.exact_distance", "contact.solid_friction"}) {
        EXPECT_NE(ended.err.find(std::string("notice: ") + key + ": given, but "), std::string::npos) << key << ended;
        EXPECT_TRUE(notices(std::string(key) + ": given, but ")) << key;
    }
}

TEST_F(Told, ACoarseMeshOfAnotherSizeOrPlaceIsRefusedAndTheFittingOneIsTaken) {
    write("cube.vtk", cube_tets(20.0));
    write("away.vtk", cube_tets(20.0, 40.0));
    EXPECT_TRUE(ended_with(run(write("fits.json", cube_scene("cube.vtk", "mm"))), 0));
    const Ended unit = call({"run", write("unit.json", cube_scene("cube.vtk", "cm")), "--out", folder / "unit"});
    EXPECT_TRUE(refuses(unit, "the coarse mesh is 200 mm long and the surface 20 mm"));
    EXPECT_TRUE(unit.says("cube.vtk") && unit.says("unit.json:")) << unit;
    EXPECT_TRUE(refuses(call({"run", write("away.json", cube_scene("away.vtk", "mm")), "--out", folder / "away"}), "from the nearest tetrahedron"));
}

TEST_F(Told, AFlatTetrahedronOfAFileIsSaidToBeInThatFile) {
    std::string flat = cube_tets(20.0); // the first one's corner 1 becomes corner 3, as its second is
    write("flat.vtk", flat.replace(flat.find("4 0 1 3 7"), 9, "4 0 3 3 7"));
    const Ended ended = run(write("flat.json", cube_scene("flat.vtk", "mm")));
    EXPECT_TRUE(refuses(ended, "flat.vtk: ") && refuses(ended, "flat.json:")) << ended;
}

TEST_F(Told, ADriveThatWouldBeSlowedIsExplainedBeforehand) {
    const Ended slow = call({"explain", write("tube.json", kTube)});
    EXPECT_EQ(slow.out.find("its drive would go"), std::string::npos) << slow;
    const Ended fast = call({"explain", write("fast.json", with(kTube, "\"step\": 0.01", "\"step\": 0.1"))});
    ASSERT_TRUE(ended_with(fast, 0));
    EXPECT_NE(fast.out.find("mm in a step; 1 mm are taken, expected a step of at most "), std::string::npos) << fast;
}

TEST_F(Told, MaterialsOfPrepareAreRefusedByTheirOptions) {
    const fs::path cube = write("cube.off", "OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
    for (const auto& [option, value] : {std::pair{"--young", "-3"}, {"--young", "nan"}, {"--poisson", "0.5"}, {"--density", "1e9"}})
        EXPECT_TRUE(refuses(call({"prepare", cube, "--out", out(), option, value}), option)) << value;
    EXPECT_FALSE(fs::exists(out()));
    EXPECT_TRUE(refuses(run(write("tube.json", kTube), {"--pace", "nan"}), "--pace"));
}

TEST_F(Told, PlacesThatCannotBeWrittenAreRefusedBeforeAnythingIsDone) {
    const fs::path nowhere = folder / "no" / "such" / "place";
    EXPECT_TRUE(refuses(run(write("tube.json", kTube), {"--record-grants", nowhere}), "--record-grants"));
    EXPECT_FALSE(fs::exists(out())) << "what is left there would stand in the next run's way";
    for (const char* option : {"--json", "--page"}) {
        const Ended ended = call({"bench", "spheretree", "--quick", option, nowhere});
        EXPECT_TRUE(refuses(ended, option));
        EXPECT_EQ(ended.out, "");
    }
}

TEST_F(Told, AQueryFileThatIsNotThereIsSaidToBeNotThere) {
    EXPECT_TRUE(refuses(call({"ccd", folder / "none.csv"}), "cannot be opened"));
    EXPECT_TRUE(refuses(call({"ccd", folder}), "folder"));
    fs::create_symlink("loop.csv", folder / "loop.csv");
    EXPECT_TRUE(refuses(call({"ccd", folder / "loop.csv"}), "loop.csv: cannot be opened"));
}

/// A budget below what no step can leave out is accepted, and said with both numbers.
TEST_F(Told, ABudgetBelowTheFloor) {
    const Ended ended = run(write("press.json", kPress), {"--budget", "1us", "-n", "10"});
    ASSERT_TRUE(ended_with(ended, 0));
    EXPECT_TRUE(ended.says("below the floor of ")) << ended;
    EXPECT_TRUE(ended.says("of 10 steps: all that a budget may leave out was left out")) << ended;
    EXPECT_TRUE(notices("the budget of 0.001 ms is below the floor of "));
    EXPECT_GT(summary()["floor_ms"].get<double>(), 0.001);
    EXPECT_GT(summary()["below_floor_steps"].get<int>(), 0);
}

} // namespace
} // namespace trocar::cli_test
