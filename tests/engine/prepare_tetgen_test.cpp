#include "base/simplify.hpp"
#include "base/topology.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/process.hpp"
#include "engine/prepare/tetgen.hpp"
#include "fem/tissue/tissue.hpp"
#include "tests/made/hostile.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <numbers>

namespace trocar::engine {

namespace {

using testing::HasSubstr;

/// Longitude-latitude sphere, a little squashed, outward.
TriMesh make_ball(Index rings, Index spokes, double radius, const Vec3& centre = Vec3::Zero()) {
    TriMesh mesh;
    mesh.vertices.push_back(centre + Vec3(0, 0, radius));
    for (Index r = 1; r < rings; ++r)
        for (Index s = 0; s < spokes; ++s) {
            const double a = std::numbers::pi * r / rings, b = 2 * std::numbers::pi * s / spokes;
            mesh.vertices.push_back(centre + radius * Vec3(std::sin(a) * std::cos(b), 0.8 * std::sin(a) * std::sin(b), std::cos(a)));
        }
    mesh.vertices.push_back(centre - Vec3(0, 0, radius));
    const auto id = [&](Index r, Index s) { return 1 + (r - 1) * spokes + s % spokes; };
    const auto last = static_cast<Index>(mesh.vertices.size() - 1);
    for (Index s = 0; s < spokes; ++s) {
        mesh.triangles.push_back({0, id(1, s), id(1, s + 1)});
        for (Index r = 1; r + 1 < rings; ++r) {
            mesh.triangles.push_back({id(r, s), id(r + 1, s), id(r + 1, s + 1)});
            mesh.triangles.push_back({id(r, s), id(r + 1, s + 1), id(r, s + 1)});
        }
        mesh.triangles.push_back({last, id(rings - 1, s + 1), id(rings - 1, s)});
    }
    return mesh;
}

bool have_tetgen() { return find_program("tetgen", "tetgen").ok(); }

#define NEED_TETGEN()                                                                                                                      \
    if (!have_tetgen()) GTEST_SKIP() << "tetgen is not installed"

double volume_of(const TetMesh& mesh) { return inspect_tets(mesh).volume; }

TriMesh joined(TriMesh a, const TriMesh& b) {
    const auto shift = static_cast<Index>(a.vertices.size());
    a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
    for (Triangle t : b.triangles) a.triangles.push_back({t[0] + shift, t[1] + shift, t[2] + shift});
    return a;
}

Error error_of(const TriMesh& surface, const TetgenOptions& options = {}) {
    const auto mesh = run_tetgen(surface, options);
    if (mesh.ok()) return {.message = "accepted"};
    return mesh.error();
}

/// A stand-in for tetgen that does what the test needs.
class FakeProgram {
public:
    explicit FakeProgram(const std::string& script) : folder_(std::move(TemporaryFolder::make()).value()) {
        std::ofstream(path()) << "#!/bin/sh\n" << script << "\n";
        std::filesystem::permissions(path(), std::filesystem::perms::owner_all);
    }
    [[nodiscard]] std::string path() const { return (folder_.path() / "mesher").string(); }

private:
    TemporaryFolder folder_;
};

} // namespace

TEST(Tetgen, FillsAClosedSurfaceAndKeepsItsVerticesToTheBit) {
    NEED_TETGEN();
    for (const Vec3& centre : {Vec3(0, 0, 0), Vec3(4000, -3000, 50)}) {
        const TriMesh ball = make_ball(12, 20, 0.08, centre);
        const auto mesh = run_tetgen(ball, {.max_volume = 2e-6});
        ASSERT_TRUE(mesh.ok()) << mesh.error().to_string();
        for (std::size_t v = 0; v < ball.vertices.size(); ++v) EXPECT_EQ(mesh->vertices[v], ball.vertices[v]);
        EXPECT_NEAR(volume_of(*mesh), signed_volume(ball), 1e-9 * signed_volume(ball));
        const TriMesh shell = boundary_surface(*mesh);
        EXPECT_EQ(shell.triangles.size(), ball.triangles.size()) << "the surface was cut";
        EXPECT_TRUE(fem::make_tissue_model(*mesh, {}, {}).ok());
        std::size_t beyond = 0;
        for (const Tet& tet : mesh->tets) {
            const double volume = volume_of({mesh->vertices, {tet}});
            beyond += volume > 2e-6;
            EXPECT_LE(volume, 2.0 * 2e-6);
        }
        EXPECT_LT(beyond, mesh->tets.size() / 10) << "the bound is a target: the last smoothing passes it here and there";
        EXPECT_GT(mesh->tets.size(), run_tetgen(ball, {})->tets.size());
    }
}

TEST(Tetgen, GivesTheSameMeshAgain) {
    NEED_TETGEN();
    const TriMesh ball = make_ball(10, 14, 0.05);
    const auto a = run_tetgen(ball, {}), b = run_tetgen(ball, {});
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->vertices, b->vertices);
    EXPECT_EQ(a->tets, b->tets);
}

TEST(Tetgen, NamesTheTrianglesOfABadSurface) {
    const TriMesh ball = make_ball(8, 12, 0.05);
    TriMesh open = ball;
    open.triangles.erase(open.triangles.begin() + 30);
    EXPECT_EQ(error_of(open).code, ErrorCode::BadMesh);
    EXPECT_THAT(error_of(open).message, HasSubstr("triangle"));

    TriMesh doubled = ball;
    doubled.triangles.push_back(ball.triangles[5]);
    EXPECT_EQ(error_of(doubled).code, ErrorCode::BadMesh);
    EXPECT_THAT(error_of(doubled).message, HasSubstr("triangle"));

    TriMesh not_finite = ball;
    not_finite.vertices[7][1] = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(error_of(not_finite).code, ErrorCode::BadMesh);

    TriMesh inside_out = ball;
    for (Triangle& t : inside_out.triangles) std::swap(t[0], t[1]);
    EXPECT_EQ(error_of(inside_out).code, ErrorCode::BadMesh);

    const TriMesh crossing = joined(ball, make_ball(8, 12, 0.05, Vec3(0.06, 0.003, 0.002)));
    EXPECT_EQ(error_of(crossing).code, ErrorCode::BadMesh);
    EXPECT_THAT(error_of(crossing).message, HasSubstr("crosses itself"));
    EXPECT_THAT(error_of(crossing).message, testing::ContainsRegex("first [0-9]+-[0-9]+"));
    EXPECT_EQ(error_of(TriMesh{}).code, ErrorCode::BadMesh);
}

TEST(Tetgen, RefusesASurfaceWhoseCrossingsAreNotFoundOut) {
    const TriMesh shells = joined(make_ball(8, 12, 0.05), make_ball(8, 12, 0.048));
    EXPECT_TRUE(check_meshable_surface(shells).ok());
    const auto refused = check_meshable_surface(shells, 0);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.error().code, ErrorCode::BadMesh);
    EXPECT_THAT(refused.error().message, HasSubstr("too near to each other to tell"));
}

TEST(Tetgen, RefusesOptionsItCannotKeep) {
    const TriMesh ball = make_ball(8, 12, 0.05);
    EXPECT_EQ(error_of(ball, {.max_radius_edge_ratio = 0.9}).code, ErrorCode::BadValue);
    EXPECT_EQ(error_of(ball, {.min_dihedral_degrees = 60}).code, ErrorCode::BadValue);
    EXPECT_EQ(error_of(ball, {.max_volume = -1}).code, ErrorCode::BadValue);
    EXPECT_EQ(error_of(ball, {.time_limit = std::nan("")}).code, ErrorCode::BadValue);
}

TEST(Tetgen, MissingProgramNamesThePackage) {
    const Error error = error_of(make_ball(8, 12, 0.05), {.program = "tetgen-that-is-not-there"});
    EXPECT_EQ(error.code, ErrorCode::MissingTool);
    EXPECT_THAT(error.message, HasSubstr("apt-get install tetgen"));
}

TEST(Tetgen, CrashHangAndRubbishBecomeErrors) {
    const TriMesh ball = make_ball(8, 12, 0.05);
    const FakeProgram crash("echo about to fall; kill -SEGV $$"), hang("sleep 100 & sleep 100"), fails("echo cannot; exit 3"),
        silent("exit 0"), rubbish("echo '4 3 0 0' > surface.1.node; echo '0 nan 0 0' >> surface.1.node; echo '1 4 0' > surface.1.ele");
    const Error crashed = error_of(ball, {.program = crash.path()});
    EXPECT_EQ(crashed.code, ErrorCode::ToolFailed);
    EXPECT_THAT(crashed.message, HasSubstr("signal 11; its last words: about to fall"));
    const Error hung = error_of(ball, {.time_limit = 0.3, .program = hang.path()});
    EXPECT_EQ(hung.code, ErrorCode::ToolFailed);
    EXPECT_THAT(hung.message, HasSubstr("stopped after 0.3 s"));
    EXPECT_THAT(error_of(ball, {.program = fails.path()}).message, HasSubstr("exit code 3; its last words: cannot"));
    EXPECT_THAT(error_of(ball, {.program = silent.path()}).message, HasSubstr("no usable mesh"));
    EXPECT_THAT(error_of(ball, {.program = rubbish.path()}).message, HasSubstr("no usable mesh"));
}

/// Of the surfaces of a folder, with at most 5,000 triangles.
void expect_meshes_or_errors(const std::filesystem::path& folder, std::size_t least_files) {
    std::size_t files = 0, meshed = 0;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
        if (!entry.is_regular_file()) continue;
        const auto surface = read_surface(entry.path(), {});
        if (!surface.ok() || surface->triangles.size() > 5000) continue;
        ++files;
        const auto mesh = run_tetgen(*surface, {.time_limit = 2.0});
        if (!mesh.ok()) {
            EXPECT_FALSE(mesh.error().message.empty());
            continue;
        }
        ++meshed;
        EXPECT_TRUE(inspect_tets(*mesh).valid()) << entry.path();
    }
    EXPECT_GT(files, least_files);
    EXPECT_GT(meshed, 0U);
    testing::Test::RecordProperty("meshed", std::to_string(meshed) + " of " + std::to_string(files));
}

TEST(Tetgen, EveryHostileSurfaceWrittenHereEndsInAMeshOrAnError) {
    NEED_TETGEN();
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    made::write_hostile_meshes(folder->path());
    expect_meshes_or_errors(folder->path(), 20);
}

TEST(Tetgen, EveryNastySurfaceEndsInAMeshOrAnError) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (!data) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    NEED_TETGEN();
    expect_meshes_or_errors(std::filesystem::path(data) / "nasty", 20);
}

TEST(Process, TemporaryFolderGoesWithEverythingInIt) {
    std::filesystem::path path;
    {
        const auto folder = TemporaryFolder::make();
        ASSERT_TRUE(folder.ok());
        path = folder->path();
        std::ofstream(path / "file") << "x";
        EXPECT_TRUE(std::filesystem::exists(path / "file"));
    }
    EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(Process, ArgumentsAreNotReadByAShell) {
    const auto folder = TemporaryFolder::make();
    const auto echo = find_program("echo", "coreutils");
    ASSERT_TRUE(folder.ok() && echo.ok());
    const auto outcome = run_process(*echo, {"$HOME; rm -rf *", "`id`"}, folder->path(), 5.0);
    ASSERT_TRUE(outcome.ok());
    EXPECT_EQ(outcome->output, "$HOME; rm -rf * `id`\n");
    EXPECT_EQ(outcome->exit_code, 0);
}

} // namespace trocar::engine
