// Vessel surfaces: whatever is wrong with them is mended by name, their ends are found and named by size, and nothing depends on how the
// file counts or turns.
#include "phantoms.hpp"

#include "assets/anatomy/vessels.hpp"
#include "base/inside.hpp"
#include "base/self_intersection.hpp"
#include "base/topology.hpp"
#include "engine/importing/import_vessel.hpp"
#include "engine/importing/unit_guess.hpp"
#include "engine/importing/vessel_files.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/prepare_scene.hpp"
#include "engine/scene/device.hpp"
#include "tests/temp_folder.hpp"

using namespace trocar;
using namespace trocar::engine;
using namespace trocar::import_test;

namespace {

using VesselFiles = Folder;

/// m. A trunk of 4 mm along z that forks into 3 mm and 2 mm.
TriMesh forked_vessel() {
    const std::vector<anatomy::VesselBranch> branches{{{{0, 0, 0}, {0, 0, 0.04}, {0, 0, 0.05}}, {0.004, 0.004, 0.004}},
                                                      {{{0, 0, 0.045}, {0.006, 0, 0.06}, {0.02, 0, 0.09}}, {0.003, 0.003, 0.003}},
                                                      {{{0, 0, 0.045}, {-0.006, 0, 0.06}, {-0.02, 0, 0.09}}, {0.002, 0.002, 0.002}}};
    return anatomy::make_vessels(branches, 1e-3, 8000).value();
}

/// Without the triangles beyond a plane.
TriMesh cut(TriMesh mesh, const Vec3& at, const Vec3& outward) {
    std::erase_if(mesh.triangles, [&](const Triangle& t) {
        return std::any_of(t.begin(), t.end(), [&](Index v) { return (mesh.vertices[v] - at).dot(outward) > 0.0; });
    });
    drop_unreferenced_vertices(mesh);
    return mesh;
}

TriMesh open_vessel() {
    TriMesh mesh = cut(forked_vessel(), {0, 0, 0.002}, {0, 0, -1});
    mesh = cut(mesh, {0.019, 0, 0.0885}, Vec3(0.42, 0, 0.9).normalized());
    return cut(mesh, {-0.019, 0, 0.0885}, Vec3(-0.42, 0, 0.9).normalized());
}

void expect_imported(const Result<ImportedVessel>& vessel) {
    ASSERT_TRUE(vessel.ok()) << vessel.error().to_string();
    EXPECT_TRUE(check_closed_surface(vessel->surface).ok());
    EXPECT_EQ(find_self_intersections(vessel->surface, 1).count, 0u);
    const InsideTest inside(vessel->surface);
    EXPECT_GT(-inside.signed_distance(vessel->entry), vessel->instrument.radius);
    for (const VesselTarget& target : vessel->targets) EXPECT_NEAR(-inside.signed_distance(target.position), target.radius, 1e-9);
    for (const CentrelineBranch& branch : vessel->branches)
        for (std::size_t i = 0; i < branch.points.size(); ++i) EXPECT_NEAR(-inside.signed_distance(branch.points[i]), branch.radii[i], 1e-9);
}

} // namespace

TEST(VesselEnds, AreNamedBySizeWhateverTheOrientationAndTheOrderOfTheFile) {
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        Dice dice(seed + 1);
        TriMesh mesh = open_vessel();
        const Mat3 turn = dice.turn();
        const Vec3 shift(dice.between(-0.5, 0.5), dice.between(-0.5, 0.5), dice.between(-0.5, 0.5));
        for (Vec3& v : mesh.vertices) v = turn * v + shift;
        for (Triangle& t : mesh.triangles)
            if (seed % 3 == 1 || (seed % 3 == 2 && dice.between(0, 1) < 0.3)) std::swap(t[1], t[2]); // inward, or turned apart
        for (std::size_t t = mesh.triangles.size() - 1; t > 0; --t) std::swap(mesh.triangles[t], mesh.triangles[static_cast<std::size_t>(dice.between(0, static_cast<double>(t)))]);
        const Result<ImportedVessel> vessel = import_vessel(mesh, {});
        SCOPED_TRACE(seed);
        expect_imported(vessel);
        ASSERT_EQ(vessel->ends.size(), 3u);
        EXPECT_EQ(vessel->ends[1].name, "outlet_1");
        const double radii[] = {4.0, 3.0, 2.0};
        for (std::size_t e = 0; e < 3; ++e) {
            EXPECT_TRUE(vessel->ends[e].open);
            EXPECT_NEAR(1e3 * vessel->ends[e].radius, radii[e], 0.25);
        }
        EXPECT_GT((turn.transpose() * vessel->direction).z(), 0.95) << "into the vessel";
        EXPECT_EQ(vessel->branches.size(), 3u);
        EXPECT_EQ(vessel->was_sound, false);
        EXPECT_EQ(vessel->instrument.target, 0u) << "the widest way";
        EXPECT_NEAR(1e3 * vessel->targets[0].narrowest, 3.0, 0.3);
    }
}

TEST(VesselEnds, OfAClosedSurfaceAreItsDeadEnds) {
    const Result<ImportedVessel> vessel = import_vessel(forked_vessel(), {});
    expect_imported(vessel);
    EXPECT_TRUE(vessel->was_sound);
    EXPECT_TRUE(vessel->repairs.empty());
    ASSERT_EQ(vessel->ends.size(), 3u);
    EXPECT_FALSE(vessel->ends[0].open);
    EXPECT_LT(vessel->ends[0].centre.z(), 0.01) << "the widest is the inlet";
    VesselOptions options;
    options.inlet = Vec3(-0.02, 0, 0.09);
    const Result<ImportedVessel> other = import_vessel(forked_vessel(), options);
    expect_imported(other);
    EXPECT_LT(other->entry.x(), -0.01) << "the end that was asked for";
}

TEST(VesselEnds, OfAClosedSurfaceBeginWithTheWidestAlsoWhereTheVesselIsWidestThere) {
    const std::vector<anatomy::VesselBranch> branches{{{{0, 0, 0}, {0, 0, 0.04}, {0, 0, 0.05}}, {0.005, 0.0042, 0.004}},
                                                      {{{0, 0, 0.045}, {0.006, 0, 0.06}, {0.02, 0, 0.09}}, {0.003, 0.003, 0.003}},
                                                      {{{0, 0, 0.045}, {-0.006, 0, 0.06}, {-0.02, 0, 0.09}}, {0.002, 0.002, 0.002}}};
    const Result<ImportedVessel> vessel = import_vessel(anatomy::make_vessels(branches, 1e-3, 8000).value(), {});
    expect_imported(vessel);
    ASSERT_EQ(vessel->ends.size(), 3u);
    EXPECT_LT(vessel->ends[0].centre.norm(), 0.006) << "the inlet is the trunk's end";
    EXPECT_GT(vessel->ends[0].radius, vessel->ends[1].radius);
    EXPECT_GT(vessel->ends[1].radius, vessel->ends[2].radius);
}

TEST(VesselInstrument, IsADeviceOfTheCatalogueWhereOneIsNamed) {
    const trocar::TempFolder own;
    const ImportSource source{"vessel", "", {}};
    for (const char* device : {"steve_micro_catheter", "steve_micro_guide_wire"}) {
        SCOPED_TRACE(device);
        VesselOptions options;
        options.device = device;
        const Result<ImportedVessel> vessel = import_vessel(forked_vessel(), options);
        expect_imported(vessel);
        for (const Result<void>& written : write_vessel(*vessel, source, own.path(), vessel_scene_text(*vessel, source))) ASSERT_TRUE(written.ok());
        const Result<Scene> scene = read_scene(own.path() / import_name::kScene);
        ASSERT_TRUE(scene.ok()) << scene.error().to_string();
        const SceneInstrument& instrument = scene->instruments[0];
        EXPECT_EQ(instrument.name, device);
        EXPECT_EQ(instrument.device, device);
        const Result<Device> known = parse_device(*find_device(device), device);
        ASSERT_TRUE(known.ok());
        EXPECT_EQ(instrument.design.young_modulus, known->instrument.design.young_modulus);
        EXPECT_EQ(instrument.design.radius, known->instrument.design.radius);
        EXPECT_LE(instrument.design.length, known->instrument.design.length);
        const auto prepared = make_prepared_scene(*scene);
        EXPECT_TRUE(prepared.ok()) << prepared.error().to_string();
    }
    VesselOptions options;
    options.device = "cobra_3";
    const Result<ImportedVessel> unknown = import_vessel(forked_vessel(), options);
    ASSERT_FALSE(unknown.ok());
    EXPECT_NE(unknown.error().to_string().find("--instrument: found the unknown device \"cobra_3\"; nearest known device: \"cobra_2\""), std::string::npos) << unknown.error().to_string();
    options.device = "guide_6f";
    TriMesh small = forked_vessel();
    for (Vec3& v : small.vertices) v *= 0.3;
    const Result<ImportedVessel> thick = import_vessel(small, options);
    ASSERT_FALSE(thick.ok());
    EXPECT_NE(thick.error().message.find("and guide_6f is "), std::string::npos) << thick.error().message;
}

TEST(VesselRepairs, NameEveryDefectAndNoneIsRefusedWhereNoneIsAskedFor) {
    TriMesh broken = open_vessel();
    broken.triangles.erase(broken.triangles.begin() + 1000);                  // a hole in the wall
    broken.triangles.push_back(broken.triangles[50]);                         // a copy
    const Vec3 away(0.05, 0.05, 0.05);                                        // an island
    const auto first = static_cast<Index>(broken.vertices.size());
    for (const Vec3& v : {Vec3(0, 0, 0), Vec3(1e-3, 0, 0), Vec3(0, 1e-3, 0), Vec3(0, 0, 1e-3)}) broken.vertices.push_back(away + v);
    for (const Triangle& t : {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{1, 2, 3}, Triangle{2, 0, 3}}) broken.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    const Result<ImportedVessel> vessel = import_vessel(broken, {});
    expect_imported(vessel);
    std::string told;
    for (const std::string& repair : vessel->repairs) told += repair + "\n";
    for (const char* each : {"drop_duplicates: 1 triangles removed", "fill_holes: ", "4 holes filled", "islands: 1 of 2 shells removed", "open_ends: 3 capped"})
        EXPECT_NE(told.find(each), std::string::npos) << each << "\n" << told;
    ASSERT_EQ(vessel->ends.size(), 3u) << "the hole is no opening";
    VesselOptions options;
    options.mode = MendMode::None;
    const Result<ImportedVessel> refused = import_vessel(broken, options);
    ASSERT_FALSE(refused.ok());
    EXPECT_NE(refused.error().message.find("without --repair none it is mended"), std::string::npos) << refused.error().message;
    EXPECT_TRUE(import_vessel(forked_vessel(), options).ok()) << "sound";
}

TEST(VesselRepairs, OfADoubleWallKeepTheInnerSide) {
    TriMesh wall = forked_vessel();
    const std::size_t inner = wall.vertices.size();
    std::vector<Vec3> normals(inner, Vec3::Zero());
    for (const Triangle& t : wall.triangles)
        for (const Index v : t) normals[v] += (wall.vertices[t[1]] - wall.vertices[t[0]]).cross(wall.vertices[t[2]] - wall.vertices[t[0]]);
    const std::size_t triangles = wall.triangles.size();
    for (std::size_t v = 0; v < inner; ++v) wall.vertices.push_back(wall.vertices[v] + 3e-4 * normals[v].normalized());
    for (std::size_t t = 0; t < triangles; ++t) {
        const Triangle in = wall.triangles[t];
        wall.triangles.push_back({in[0] + static_cast<Index>(inner), in[1] + static_cast<Index>(inner), in[2] + static_cast<Index>(inner)});
        std::swap(wall.triangles[t][1], wall.triangles[t][2]); // the wall's own solid: inner side inward
    }
    const Result<ImportedVessel> vessel = import_vessel(wall, {});
    expect_imported(vessel);
    EXPECT_NEAR(signed_volume(vessel->surface), signed_volume(forked_vessel()), 1e-12);
    ASSERT_FALSE(vessel->repairs.empty());
    EXPECT_NE(vessel->repairs[0].find("double_walls: 1 outer shells removed"), std::string::npos) << vessel->repairs[0];
}

TEST(VesselRepairs, MakeASurfaceAnewThatNoChainMends) {
    TriMesh mesh = forked_vessel();
    const TriMesh other = forked_vessel();
    const auto first = static_cast<Index>(mesh.vertices.size());
    for (const Vec3& v : other.vertices) mesh.vertices.push_back(v + Vec3(1.3e-3, 0.4e-3, 1e-3)); // inside one another nearly everywhere
    for (const Triangle& t : other.triangles) mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
    const Result<ImportedVessel> vessel = import_vessel(mesh, {});
    expect_imported(vessel);
    EXPECT_GT(signed_volume(vessel->surface), signed_volume(other)) << "of both together";
}

TEST_F(VesselFiles, AreASceneThatIsReadAndPreparedAsWritten) {
    const Result<ImportedVessel> vessel = import_vessel(open_vessel(), {});
    ASSERT_TRUE(vessel.ok());
    for (const Result<void>& written : write_vessel(*vessel, {"a \"fork\"", "fork.stl", {}}, folder)) ASSERT_TRUE(written.ok()) << written.error().to_string();
    const Result<Scene> scene = read_scene(folder / import_name::kScene);
    ASSERT_TRUE(scene.ok()) << scene.error().to_string();
    EXPECT_EQ(scene->name, "a \"fork\"");
    EXPECT_TRUE(scene->questions.empty()) << scene->questions.front();
    const auto prepared = make_prepared_scene(*scene);
    ASSERT_TRUE(prepared.ok()) << prepared.error().to_string();
    const Result<TriMesh> surface = read_surface(folder / import_name::kSurface);
    ASSERT_TRUE(surface.ok());
    EXPECT_EQ(surface->triangles, vessel->surface.triangles);
}

TEST(VesselUnits, AreRecognisedBySize) {
    EXPECT_EQ(guess_unit(0.49).name, "m");
    EXPECT_EQ(guess_unit(12.0).name, "cm");
    EXPECT_EQ(guess_unit(591.0).name, "mm");
    EXPECT_EQ(guess_unit(9e4).name, "um");
}

TEST(VesselData, OfEveryFileImportsWithoutAParameter) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (data == nullptr) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    std::size_t files = 0;
    for (const auto& entry : fs::directory_iterator(fs::path(data) / "vessels")) {
        SCOPED_TRACE(entry.path().filename().string());
        ReadOptions reading;
        reading.weld = true;
        Result<TriMesh> mesh = read_surface(entry.path(), reading);
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        const double unit = guess_unit(mesh->bounds().longest_edge()).metres;
        for (Vec3& v : mesh->vertices) v *= unit;
        const Result<ImportedVessel> vessel = import_vessel(std::move(*mesh), {});
        expect_imported(vessel);
        EXPECT_GE(vessel->ends.size(), 2u);
        ++files;
    }
    EXPECT_GE(files, 8u);
}
