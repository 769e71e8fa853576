// `import` as a user calls it: a scene that runs as written, or exit 2 with what helps and nothing half-written.
#include "program.hpp"

#include "base/vec.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <random>

namespace trocar::cli_test {
namespace {

class ImportCommand : public Program {
protected:
    /// A label map of a straight tube, radius 3 mm, voxels of 0.75 mm, that the volume's sides cut: two open ends.
    fs::path write_tube(const std::string& header_more = "") const {
        constexpr int kSide = 24, kLength = 96;
        std::string voxels;
        for (int k = 0; k < kLength; ++k)
            for (int j = 0; j < kSide; ++j)
                for (int i = 0; i < kSide; ++i) voxels += std::hypot(0.75 * (i - 11.5), 0.75 * (j - 11.5)) <= 3.0 ? '\2' : '\0';
        return write("tube.nrrd", "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: 24 24 96\n"
                                  "space directions: (0.75,0,0) (0,0.75,0) (0,0,0.75)\nencoding: raw\nspace origin: (0,0,0)\n" +
                                      header_more + "\n" + voxels);
    }
    /// A label map of a vessel that forks, of random directions and widths, and as many times as large: the volume's side cuts its trunk of radius
    /// 3 mm.
    fs::path write_fork(unsigned seed, double scale) const {
        std::mt19937 random(seed);
        const auto between = [&](double least, double most) { return least + (most - least) * static_cast<double>(random()) / 4294967296.0; };
        constexpr double kVoxel = 0.75, kRadius = 3.0;
        const Vec3 begin(0, 0, -5), fork(0, 0, between(18, 26));
        const double side = between(0, 6.28), gentle = between(0.1, 0.5), sharp = between(0.5, 1.2);
        const Vec3 aside(std::cos(side), std::sin(side), 0);
        struct Tube {
            Vec3 from, to;
            double radius;
        };
        const Tube tubes[] = {{begin, fork, kRadius},
                              {fork, fork + 26 * (std::cos(gentle) * Vec3::UnitZ() + std::sin(gentle) * aside), kRadius * between(0.7, 0.95)},
                              {fork, fork + 22 * (std::cos(sharp) * Vec3::UnitZ() - std::sin(sharp) * aside), kRadius * between(0.5, 0.8)}};
        constexpr int kSide = 76, kLength = 76;
        std::string voxels;
        for (int k = 0; k < kLength; ++k)
            for (int j = 0; j < kSide; ++j)
                for (int i = 0; i < kSide; ++i) {
                    const Vec3 p(kVoxel * (i - 0.5 * kSide), kVoxel * (j - 0.5 * kSide), kVoxel * k);
                    voxels += std::any_of(std::begin(tubes), std::end(tubes), [&](const Tube& tube) {
                        const Vec3 along = tube.to - tube.from;
                        const double share = std::clamp((p - tube.from).dot(along) / along.squaredNorm(), 0.0, 1.0);
                        return (p - tube.from - share * along).norm() <= tube.radius;
                    }) ? '\1' : '\0';
                }
        char header[300];
        std::snprintf(header, sizeof header, "NRRD0004\ntype: unsigned char\ndimension: 3\nspace: left-posterior-superior\nsizes: %d %d %d\n"
                      "space directions: (%g,0,0) (0,%g,0) (0,0,%g)\nencoding: raw\nspace origin: (0,0,0)\n\n",
                      kSide, kSide, kLength, scale * kVoxel, scale * kVoxel, scale * kVoxel);
        return write("fork.nrrd", header + voxels);
    }
    Ended import(const std::string& kind, const fs::path& file, std::vector<std::string> more = {}) const {
        std::vector<std::string> arguments = {"import", kind, file.string(), "--out", (folder / "made").string(), "--quiet"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return call(arguments);
    }
    [[nodiscard]] fs::path made(const char* name) const { return folder / "made" / name; }
};

} // namespace

TEST_F(ImportCommand, MakesASceneOfALabelMapThatRunsWithoutAnExitAndIsPlanned) {
    const Ended ended = import("segmentation", write_tube());
    ASSERT_EQ(ended.exit_code, 0) << ended;
    for (const char* name : {"scene.json", "vessel.vtp", "vessel.stl", "centreline.vtp", "centreline.mrk.json", "import.json", "explain.txt"})
        EXPECT_TRUE(fs::exists(made(name))) << name;
    EXPECT_TRUE(ended.says("24 x 24 x 96")) << ended;
    EXPECT_TRUE(ended.says("open_ends: 2")) << ended;
    const Json report = Json::parse(text_of(made("import.json")));
    ASSERT_EQ(report["ends"].size(), 2u);
    EXPECT_EQ(report["ends"][0]["name"], "inlet");
    EXPECT_EQ(report["ends"][1]["name"], "outlet_1");
    const Ended ran = run(made("scene.json"), {"-n", "300"});
    ASSERT_EQ(ran.exit_code, 0) << ran;
    EXPECT_EQ(summary()["steps"], 300);
    EXPECT_EQ(summary()["lumen_exits"], 0);
    const Ended planned = call({"plan", made("scene.json").string(), "--to", "outlet_1", "--out", (folder / "plan").string(), "--no-report", "--quiet"});
    EXPECT_EQ(planned.exit_code, 0) << planned;
}

TEST_F(ImportCommand, AForkedVesselOfAnySizeIsPlannedAsItWasImported) {
    for (unsigned seed = 1; seed <= 3; ++seed)
        for (const double scale : {0.5, 1.0, 3.0}) {
            SCOPED_TRACE("vessel " + std::to_string(seed) + ", times " + std::to_string(scale));
            ASSERT_TRUE(ended_with(import("segmentation", write_fork(seed, scale), {"--no-explain", "--force"}), 0));
            std::vector<std::string> arguments{"plan", made("scene.json").string(), "--out", (folder / "plan").string(), "--no-report", "--quiet", "--force"};
            if (scale == 1.0) arguments.insert(arguments.end(), {"--to", "outlet_2"}); // where the instrument was not fitted to
            EXPECT_TRUE(ended_with(call(arguments), 0));
            EXPECT_EQ(Json::parse(text_of(folder / "plan" / "plan.json"))["lumen_exits"], 0);
        }
}

TEST_F(ImportCommand, MakesAVesselOfASurfaceAndAnOrganOfTheSameLabelMap) {
    ASSERT_EQ(import("segmentation", write_tube(), {"--no-explain"}).exit_code, 0);
    fs::copy_file(made("vessel.stl"), folder / "again.stl");
    fs::copy_file(made("centreline.mrk.json"), folder / "line.mrk.json");
    fs::copy_file(made("centreline.vtp"), folder / "line.vtp");
    const Ended vessel = import("vessel", folder / "again.stl", {"--no-explain", "--force", "--unit", "mm"});
    EXPECT_EQ(vessel.exit_code, 0) << vessel;
    for (const auto& [kind, file] : {std::pair{"slicer", "line.mrk.json"}, {"vmtk", "line.vtp"}}) {
        const Ended curves = import(kind, folder / file, {"--no-explain", "--force"});
        EXPECT_EQ(curves.exit_code, 0) << curves;
        EXPECT_TRUE(curves.says("swept: 1 curves")) << curves;
    }
    const Ended organ = import("segmentation", folder / "tube.nrrd", {"--no-explain", "--force", "--as", "organ"});
    ASSERT_EQ(organ.exit_code, 0) << organ;
    const Ended ran = run(made("scene.json"), {"-n", "20"});
    EXPECT_EQ(ran.exit_code, 0) << ran;
}

TEST_F(ImportCommand, RefusesWhatItCannotReadAndLeavesNothingBehind) {
    const auto refused = [&](const Ended& ended, const std::string& says) {
        EXPECT_EQ(ended.exit_code, 2) << ended;
        EXPECT_TRUE(ended.says(says)) << says << "\n" << ended;
        EXPECT_FALSE(fs::exists(folder / "made")) << says;
    };
    const fs::path tube = write_tube();
    const std::string whole = text_of(tube);
    refused(import("segmentation", folder / "missing.nrrd"), "cannot be opened");
    refused(import("segmentation", tube, {"--label", "7"}), "--label: no segment '7'; known: 2");
    refused(import("segmentation", write_tube("space units: \"parsec\"\n")), "space units");
    refused(import("segmentation", write("short.nrrd", whole.substr(0, 5000))), "the header announces 55296");
    refused(import("vessel", write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")), "error: ");
    refused(import("vessel", write("b.obj", "v 0 0 0\nf 1 1 1\n")), "error: ");
    refused(import("vessel", tube), "nrrd");
    refused(import("vessel", write("c.stl", "solid\nendsolid\n"), {"--unit", "furlong"}), "error: ");
    refused(import("organ", folder / "missing.msh"), "cannot be opened");
    refused(import("slicer", folder / "missing"), "no such file or folder");
    refused(import("simvascular", tube), "is no folder");
    refused(import("vmtk", tube), "expected a .vtp file");
    refused(import("vessel", tube, {"--inlet", ""}), "empty value");
    EXPECT_EQ(call({"import"}).exit_code, 2);
    EXPECT_EQ(call({"import", "hologram", "x"}).exit_code, 2);
    fs::create_directories(folder / "made");
    std::ofstream(folder / "made" / "mine.txt") << "mine";
    const Ended occupied = import("segmentation", tube);
    EXPECT_EQ(occupied.exit_code, 2);
    EXPECT_TRUE(occupied.says("not empty")) << occupied;
    EXPECT_FALSE(fs::exists(made("scene.json")));
}

TEST_F(ImportCommand, IsRefusedWhereItsFilesTakeThePlaceOfThoseThatItReads) {
    ASSERT_TRUE(ended_with(import("segmentation", write_tube(), {"--no-explain"}), 0));
    fs::create_symlink(made("vessel.stl"), folder / "link.stl");
    std::vector<std::pair<fs::path, std::string>> before;
    for (const auto& entry : fs::directory_iterator(folder / "made")) before.emplace_back(entry.path(), text_of(entry.path()));
    for (const auto& [kind, file] : {std::pair<std::string, fs::path>{"vessel", made("vessel.stl")},
                                     {"vessel", folder / "link.stl"},
                                     {"organ", made("../made/vessel.vtp")},
                                     {"vmtk", made("centreline.vtp")},
                                     {"slicer", made("centreline.mrk.json")},
                                     {"slicer", folder / "made"}})
        EXPECT_TRUE(refuses(import(kind, file, {"--no-explain", "--force"}), "--out: ")) << kind << " " << file;
    for (const auto& [file, text] : before) EXPECT_EQ(text_of(file), text) << file;
    EXPECT_EQ(before.size(), 6u);
}

TEST_F(ImportCommand, OfASceneThatIsNotTakenRemovesItsOwnFilesAndNoneOfAnEarlierImport) {
    write("made/organ.vtp", "of an earlier import");
    fs::create_directories(made("explain.txt") / "in the way"); // the trial cannot write its answer
    const Ended ended = import("segmentation", write_tube(), {"--force"});
    EXPECT_TRUE(refuses(ended, "explain.txt"));
    for (const char* name : {"scene.json", "vessel.vtp", "vessel.stl", "centreline.vtp", "centreline.mrk.json", "import.json"})
        EXPECT_FALSE(fs::exists(made(name))) << name;
    EXPECT_EQ(text_of(made("organ.vtp")), "of an earlier import");
}

TEST_F(ImportCommand, RegionsOfAnOrganStandInItsSceneAndAWrongLabelIsRefused) {
    const fs::path file = write("two.mesh", "MeshVersionFormatted 1\nDimension 3\nVertices\n12\n0 0 0 0\n50 0 0 0\n50 50 0 0\n0 50 0 0\n0 0 50 0\n50 0 50 0\n50 50 50 0\n"
                                            "0 50 50 0\n0 0 80 0\n50 0 80 0\n50 50 80 0\n0 50 80 0\nHexahedra\n2\n1 2 3 4 5 6 7 8 4\n5 6 7 8 9 10 11 12 6\nEnd\n");
    const Ended ended = import("organ", file, {"--unit", "mm", "--no-explain"});
    ASSERT_EQ(ended.exit_code, 0) << ended;
    EXPECT_TRUE(ended.says("region     region_4 (label 4): 6 tetrahedra, 125000 mm^3")) << ended;
    EXPECT_TRUE(ended.says("region     region_6 (label 6): 6 tetrahedra, 75000 mm^3")) << ended;
    EXPECT_EQ(Json::parse(text_of(made("import.json")))["regions"].size(), 2u);
    std::string scene = text_of(made("scene.json"));
    const std::string stiff = "\"label\": 6, \"young_modulus\": 8";
    ASSERT_NE(scene.find(stiff), std::string::npos) << scene;
    scene.replace(scene.find(stiff), stiff.size(), "\"label\": 6, \"young_modulus\": 80");
    std::ofstream(made("scene.json")) << scene;
    const Ended ran = run(made("scene.json"), {"-n", "5"});
    EXPECT_EQ(ran.exit_code, 0) << ran;
    scene.replace(scene.find("\"label\": 6"), 10, "\"label\": 7");
    std::ofstream(made("scene.json")) << scene;
    const Ended wrong = run(made("scene.json"), {"-n", "5", "--force"});
    EXPECT_EQ(wrong.exit_code, 2) << wrong;
    EXPECT_TRUE(wrong.says("scene.json:14:")) << wrong;
    EXPECT_TRUE(wrong.says("bodies.organ.coarse.regions.region_6.label: found 7, which no cell of organ.vtu has in its array \"region\"; nearest label: 6")) << wrong;
    const Ended array = import("organ", file, {"--unit", "mm", "--regions", "medit:rfe", "--force"});
    EXPECT_EQ(array.exit_code, 2) << array;
    EXPECT_TRUE(array.says("--regions: found the unknown cell array \"medit:rfe\"; nearest known cell array: \"medit:ref\"")) << array;
}

TEST_F(ImportCommand, TakesTheCellsOfAFileWhoseArraysCannotBeReadAndSaysSo) {
    const fs::path file = write("cube.vtk", "# vtk DataFile Version 3.0\ncube\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 float\n0 0 0 50 0 0 50 50 0 0 50 0\n0 0 50 50 0 50 50 50 50 0 50 50\n"
                                            "CELLS 1 9\n8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n12\nCELL_DATA 1\nFIELD FieldData 1\norgan 1 1 string\nliver\n");
    const Ended ended = import("organ", file, {"--unit", "mm", "--no-explain"});
    ASSERT_EQ(ended.exit_code, 0) << ended;
    EXPECT_TRUE(ended.says("region     the cell arrays are left out")) << ended;
    EXPECT_TRUE(ended.says("cube.vtk:14: type 'string' is not read")) << ended;
    EXPECT_TRUE(fs::exists(made("organ.vtu")));
    const Ended named = import("organ", file, {"--unit", "mm", "--regions", "organ", "--force"});
    EXPECT_EQ(named.exit_code, 2) << named;
    EXPECT_TRUE(named.says("cube.vtk:14: type 'string' is not read")) << named;
}

TEST_F(ImportCommand, TakesADeviceOfTheCatalogueAndRefusesAnother) {
    const fs::path tube = write_tube();
    const Ended taken = import("segmentation", tube, {"--instrument", "steve_micro_catheter", "--no-explain"});
    ASSERT_EQ(taken.exit_code, 0) << taken;
    EXPECT_TRUE(taken.says("instrument steve_micro_catheter, radius ")) << taken;
    const Ended ran = run(made("scene.json"), {"-n", "20"});
    EXPECT_EQ(ran.exit_code, 0) << ran;
    const Ended unknown = import("segmentation", tube, {"--instrument", "cobra_3", "--force"});
    EXPECT_EQ(unknown.exit_code, 2) << unknown;
    EXPECT_TRUE(unknown.says("--instrument: found the unknown device \"cobra_3\"; nearest known device: \"cobra_2\"")) << unknown;
}

TEST_F(ImportCommand, SaysWhereAnInletWasAskedForAndRefusesWordsForIt) {
    const Ended ended = import("segmentation", write_tube(), {"--inlet", "8.6,8.6,71", "--no-explain"});
    ASSERT_EQ(ended.exit_code, 0) << ended;
    const Json report = Json::parse(text_of(made("import.json")));
    EXPECT_GT(report["ends"][0]["centre_mm"][2].get<double>(), 70.0);
    EXPECT_LT(report["entry"]["direction"][2].get<double>(), -0.95);
    const Ended words = import("segmentation", folder / "tube.nrrd", {"--inlet", "left,right", "--force"});
    EXPECT_EQ(words.exit_code, 2);
    EXPECT_TRUE(words.says("--inlet: found 'left,right'; expected three numbers")) << words;
}

} // namespace trocar::cli_test
