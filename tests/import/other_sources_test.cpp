// Projects of other programs, and organs.
#include "phantoms.hpp"

#include "assets/anatomy/shapes.hpp"
#include "base/topology.hpp"
#include "engine/importing/import_curves.hpp"
#include "engine/importing/import_organ.hpp"
#include "engine/importing/import_steve.hpp"
#include "engine/importing/sweep_curves.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/write_mesh.hpp"
#include "engine/prepare/prepare_scene.hpp"

#include <numbers>

using namespace trocar;
using namespace trocar::engine;
using namespace trocar::import_test;

namespace {

using Projects = Folder;

bool says(const auto& result, const std::string& piece) { return !result.ok() && result.error().to_string().find(piece) != std::string::npos; }

/// A path along z of 6 cm, as SimVascular writes it.
std::string path_text(const std::string& second = "<pos x=\"0\" y=\"0\" z=\"3\" />") {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\" ?>\n<format version=\"1.0\" />\n<path id=\"1\"><timestep id=\"0\"><path_element><path_points>\n"
           "<path_point id=\"0\"><pos x=\"0\" y=\"0\" z=\"0\" /></path_point>\n<path_point id=\"1\">" +
           second + "</path_point>\n<path_point id=\"2\"><pos x=\"0\" y=\"0\" z=\"6\" /></path_point>\n</path_points></path_element></timestep></path>\n";
}

std::string contours_text(double radius_cm) {
    std::string text = "<?xml version=\"1.0\" encoding=\"UTF-8\" ?>\n<format version=\"1.0\" />\n<contourgroup path_name=\"aorta\" path_id=\"1\"><timestep id=\"0\">\n";
    for (const double z : {0.0, 6.0}) {
        text += "<contour id=\"0\"><contour_points>\n";
        for (int i = 0; i < 24; ++i)
            text += fmt::format("<point id=\"{}\" x=\"{}\" y=\"{}\" z=\"{}\" />\n", i, radius_cm * std::cos(2 * std::numbers::pi * i / 24),
                                radius_cm * std::sin(2 * std::numbers::pi * i / 24), z);
        text += "</contour_points></contour>\n";
    }
    return text + "</timestep></contourgroup>\n";
}

} // namespace

TEST_F(Projects, OfSimVascularAreSweptAlongTheirPathsInCentimetres) {
    write("p/Paths/aorta.pth", path_text());
    EXPECT_TRUE(says(read_simvascular(folder / "p"), "neither Models/*.vtp nor Segmentations/*.ctgr"));
    write("p/Segmentations/aorta.ctgr", contours_text(0.4));
    const Result<CurveSet> set = read_simvascular(folder / "p");
    ASSERT_TRUE(set.ok()) << set.error().to_string();
    ASSERT_EQ(set->curves.size(), 1u);
    for (const double radius : set->curves[0].radii) EXPECT_NEAR(radius, 0.004, 1e-6);
    const Result<ImportedVessel> vessel = import_curve_set(*set, {});
    ASSERT_TRUE(vessel.ok()) << vessel.error().to_string();
    EXPECT_EQ(vessel->ends.size(), 2u);
    EXPECT_NEAR(vessel->targets[0].narrowest, 0.004, 1e-4);
    write("p/Paths/aorta.pth", path_text("<pos x=\"0\" y=\"nan\" z=\"3\" />"));
    EXPECT_TRUE(says(read_simvascular(folder / "p"), "path_point.pos: expected three finite numbers"));
    write("p/Paths/aorta.pth", "<path><path_points>");
    EXPECT_TRUE(says(read_simvascular(folder / "p"), "no well-formed XML"));
}

TEST_F(Projects, OfSimVascularTakeTheirModelWhereThereIsOne) {
    const std::vector<Vec3> axis{{0, 0, 0}, {0, 0, 6}};
    const std::vector<double> radii{0.5, 0.5};
    fs::create_directories(folder / "p/Models");
    ASSERT_TRUE(write_vtp(folder / "p/Models/a.vtp", anatomy::make_tube(axis, radii, 24)).ok());
    const Result<CurveSet> set = read_simvascular(folder / "p");
    ASSERT_TRUE(set.ok()) << set.error().to_string();
    const Result<ImportedVessel> vessel = import_curve_set(*set, {});
    ASSERT_TRUE(vessel.ok()) << vessel.error().to_string();
    EXPECT_NEAR(vessel->targets[0].narrowest, 0.005, 2e-4);
}

/// Cells of 0.4 of its radius: 4e11 of them fill this curve's box, and nearly all are empty.
TEST(SweptCurves, ThatAreThinAndRunAcrossALargeBoxAreWidenedToItsCellsAndItIsTold) {
    const double far = 1.0 / std::sqrt(3.0); // m
    const Result<SweptSurface> swept =
        sweep_curves({{"oblique", {Vec3::Zero(), Vec3::Constant(0.5 * far), Vec3::Constant(far)}, {2e-4, 2e-4, 2e-4}}});
    ASSERT_TRUE(swept.ok()) << swept.error().to_string();
    EXPECT_TRUE(check_closed_surface(swept->mesh).ok());
    ASSERT_EQ(swept->told.size(), 2u) << swept->told.front();
    EXPECT_NE(swept->told[1].find("radii: 3 smaller than 0.2"), std::string::npos) << swept->told[1];
}

TEST(SteveDevices, WithoutACrossSectionAreTakenAsSolidAndItIsSaid) {
    std::vector<std::string> notes;
    const std::string text = steve_instrument_text({"wire", 900, 0.36, 0.36, 0.36, 0, 0, 1e3, 1e3, 5e-6, 0.001}, "catheter", "\"inserted\": 8", notes);
    ASSERT_EQ(notes.size(), 1u);
    EXPECT_NE(notes[0].find("has no cross-section; taken as solid"), std::string::npos) << notes[0];
    EXPECT_NE(text.find("\"inside\": \"catheter\""), std::string::npos);
    EXPECT_NE(text.find("\"young_modulus\": 1,"), std::string::npos) << "1000 kPa are 1 MPa: " << text;
    EXPECT_NE(text.find("\"density\": 5000,"), std::string::npos) << text;
    notes.clear();
    const std::string tube = steve_instrument_text({"catheter", 900, 0.7, 0.57, 0.6, 0, 0, 1e3, 1e3, 5e-6, 0.001}, "", "\"inserted\": 8", notes);
    EXPECT_TRUE(notes.empty());
    EXPECT_NE(tube.find("\"inner_radius\": 0.285, \"young_modulus\": 1, \"density\": 5000,"), std::string::npos) << tube;
}

TEST(SteveSetups, AreScenesThatArePrepared) {
    const TempFolder own;
    const fs::path& folder = own.path();
    const Result<SteveSetup> setup = import_arch_variety({});
    ASSERT_TRUE(setup.ok()) << setup.error().to_string();
    const ImportSource source{"archvariety", "", {}};
    for (const Result<void>& written : write_vessel(setup->vessel, source, folder, steve_scene_text(*setup, source))) ASSERT_TRUE(written.ok());
    const Result<Scene> scene = read_scene(folder / import_name::kScene);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_EQ(scene->targets.size(), 3u);
    EXPECT_NEAR(scene->instruments[0].design.tip_length, 0.0121 * 0.4 * std::numbers::pi, 1e-6);
    const auto prepared = make_prepared_scene(*scene);
    EXPECT_TRUE(prepared.ok()) << prepared.error().to_string();
}

TEST_F(Projects, OfOrgansKeepTheirTetrahedraAndTellTheirQuality) {
    TetMesh cube; // five tetrahedra, mm
    for (int k = 0; k < 8; ++k) cube.vertices.emplace_back(40.0 * (k & 1), 40.0 * ((k >> 1) & 1), 40.0 * (k >> 2));
    cube.tets = {{0, 1, 2, 4}, {3, 2, 1, 7}, {5, 4, 7, 1}, {6, 7, 4, 2}, {1, 2, 4, 7}};
    ASSERT_TRUE(write_vtu(folder / "cube.vtu", cube).ok());
    const Result<TetMesh> again = read_tets(folder / "cube.vtu");
    ASSERT_TRUE(again.ok());
    EXPECT_EQ(again->vertices, cube.vertices);
    EXPECT_EQ(again->tets, cube.tets);
    Result<OrganInput> input = read_organ(folder / "cube.vtu");
    ASSERT_TRUE(input.ok()) << input.error().to_string();
    const Result<ImportedOrgan> organ = import_organ(std::move(*input), 1e-3, MendMode::None, {Vec3::UnitX(), 0.2});
    ASSERT_TRUE(organ.ok()) << organ.error().to_string();
    EXPECT_EQ(organ->surface.triangles.size(), 12u);
    ASSERT_EQ(organ->quality.size(), 1u);
    EXPECT_NE(organ->quality[0].find("8 nodes, 5 tetrahedra in 1 parts, 64000 mm^3, smallest dihedral angle 54.74 degrees"), std::string::npos) << organ->quality[0];
    for (const Result<void>& written : write_organ(*organ, {"cube", "", {}}, folder)) ASSERT_TRUE(written.ok());
    const Result<Scene> scene = read_scene(folder / import_name::kScene);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_TRUE(make_prepared_scene(*scene).ok());
    TetMesh flat = cube;
    flat.tets.push_back({0, 1, 2, 3});
    ASSERT_TRUE(write_vtu(folder / "flat.vtu", flat).ok());
    Result<OrganInput> bad = read_organ(folder / "flat.vtu");
    ASSERT_TRUE(bad.ok());
    EXPECT_TRUE(says(import_organ(std::move(*bad), 1e-3, MendMode::Automatic, {}), "1 tetrahedra have no volume; first bad ones: 5"));
}

TEST(OrganData, OfEveryFileImportsOrIsRefusedWithAReason) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    std::size_t imported = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(data) / "organs")) {
        SCOPED_TRACE(entry.path().filename().string());
        Result<OrganInput> input = read_organ(entry.path());
        ASSERT_TRUE(input.ok()) << input.error().to_string();
        const Result<ImportedOrgan> organ = import_organ(std::move(*input), 1e-3, MendMode::Automatic, {});
        if (!organ.ok()) std::printf("%s: %s\n", entry.path().filename().c_str(), organ.error().to_string().c_str());
        imported += organ.ok();
        if (organ.ok()) EXPECT_TRUE(check_closed_surface(organ->surface).ok());
    }
    EXPECT_GE(imported, 12u);
}
