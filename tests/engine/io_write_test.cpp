// What is written reads back to the last bit, and a failed write leaves the old file as it was.
#include "engine/io/atomic_file.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/io/read_tets.hpp"
#include "engine/io/write_mesh.hpp"
#include "io_bytes.hpp"

#include <cmath>
#include <thread>
#include <vector>

namespace trocar::engine::test {
namespace {

using Writers = FolderTest;

TriMesh awkward_surface() {
    return {.vertices = {{1.0 / 3, -0.0, 1e-300}, {1e17, M_PI, 5e-324}, {0.1, 0.2, 0.30000000000000004}, {7, 8, 9}},
            .triangles = {{0, 1, 2}, {3, 2, 1}}};
}

TEST_F(Writers, ObjAndVtpComeBackToTheLastBit) {
    const TriMesh mesh = awkward_surface();
    const std::vector<double> pressure = {1, 2, 3, 4}, normals(6, 0.5);
    const DataArray points[] = {{"contact <pressure> & \"more\"", 1, pressure}}, cells[] = {{"normal", 3, normals}};
    ASSERT_TRUE(write_obj(folder_ / "m.obj", mesh).ok());
    ASSERT_TRUE(write_vtp(folder_ / "m.vtp", mesh, {points, cells}).ok());
    for (const char* name : {"m.obj", "m.vtp"}) {
        const Result<TriMesh> back = read_surface(folder_ / name);
        ASSERT_TRUE(back.ok()) << back.error().to_string();
        EXPECT_EQ(back->vertices, mesh.vertices);
        EXPECT_EQ(back->triangles, mesh.triangles);
    }
    EXPECT_EQ(files_in_folder(), 2u);
}

TEST_F(Writers, VtuComesBackToTheLastBit) {
    const TetMesh mesh{.vertices = awkward_surface().vertices, .tets = {{0, 1, 2, 3}, {0, 2, 1, 3}}};
    ASSERT_TRUE(write_vtu(folder_ / "m.vtu", mesh).ok());
    const Result<TetMesh> back = read_tets(folder_ / "m.vtu");
    ASSERT_TRUE(back.ok()) << back.error().to_string();
    EXPECT_EQ(back->vertices, mesh.vertices);
    EXPECT_EQ(back->tets, mesh.tets);
}

TEST_F(Writers, ArraysOfTheWrongLengthAreRefused) {
    const std::vector<double> three(3);
    const DataArray points[] = {{"p", 1, three}};
    const Result<void> outcome = write_vtp(folder_ / "m.vtp", awkward_surface(), {points, {}});
    ASSERT_FALSE(outcome.ok());
    EXPECT_EQ(outcome.error().code, ErrorCode::BadValue);
    EXPECT_EQ(files_in_folder(), 0u);
}

TEST_F(Writers, ACollectionListsItsFrames) {
    PvdCollection frames(folder_ / "run.pvd");
    frames.add(0.0, "liver_0.vtp");
    frames.add(0.1, "liver_1.vtp", 2);
    ASSERT_TRUE(frames.write().ok());
    const std::string text = slurp(folder_ / "run.pvd");
    EXPECT_NE(text.find("<DataSet timestep=\"0.1\" part=\"2\" file=\"liver_1.vtp\"/>"), std::string::npos) << text;
}

TEST_F(Writers, AFileIsReplacedAsAWholeAndKeepsItsMode) {
    const std::filesystem::path path = write("a.txt", "old");
    std::filesystem::permissions(path, std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
    ASSERT_TRUE(write_file_atomically(path, "new").ok());
    EXPECT_EQ(slurp(path), "new");
    EXPECT_EQ(std::filesystem::status(path).permissions(), std::filesystem::perms(0600));
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(Writers, ASymbolicLinkStaysOne) {
    (void)write("target.txt", "old");
    std::filesystem::create_symlink("target.txt", folder_ / "link.txt");
    ASSERT_TRUE(write_file_atomically(folder_ / "link.txt", "new").ok());
    EXPECT_TRUE(std::filesystem::is_symlink(folder_ / "link.txt"));
    EXPECT_EQ(slurp(folder_ / "target.txt"), "new");
}

TEST_F(Writers, AFullDiskIsAnError) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
    const Result<void> outcome = write_file_atomically("/dev/full", "bytes");
    ASSERT_FALSE(outcome.ok());
    EXPECT_EQ(outcome.error().code, ErrorCode::CannotWrite);
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
}

TEST_F(Writers, AFailedWriteNamesTheFileAndLeavesNothing) {
    std::filesystem::create_directory(folder_ / "taken");
    for (const char* name : {"missing/a.obj", "taken"}) {
        const Result<void> outcome = write_obj(folder_ / name, awkward_surface());
        ASSERT_FALSE(outcome.ok()) << name;
        EXPECT_EQ(outcome.error().code, ErrorCode::CannotWrite);
        EXPECT_EQ(outcome.error().file, (folder_ / name).string());
    }
    EXPECT_EQ(files_in_folder(), 1u);
}

TEST_F(Writers, ManyWritersOfOneFileLeaveOneCompleteFile) {
    std::vector<std::thread> writers;
    for (char c : {'a', 'b', 'c', 'd'})
        writers.emplace_back([this, c] {
            for (int i = 0; i < 20; ++i) EXPECT_TRUE(write_file_atomically(folder_ / "shared", std::string(10000, c)).ok());
        });
    for (std::thread& writer : writers) writer.join();
    const std::string text = slurp(folder_ / "shared");
    EXPECT_EQ(text, std::string(10000, text.at(0)));
    EXPECT_EQ(files_in_folder(), 1u);
}

} // namespace
} // namespace trocar::engine::test
