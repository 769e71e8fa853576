#include "base/topology.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/cache.hpp"
#include "engine/prepare/coarse.hpp"
#include "engine/prepare/process.hpp"
#include "fem/mesh/lattice.hpp"
#include "fem/embedding/links.hpp"
#include "fem/tissue/stable_step.hpp"
#include "tests/engine/private_cache.hpp"
#include "tests/made/surfaces.hpp"

#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>

namespace trocar::engine {

namespace {

/// A bumpy closed surface: an octahedron divided and pushed outwards.
TriMesh make_bumpy_ball(int rounds) {
    TriMesh mesh;
    mesh.vertices = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
    for (int round = 0; round < rounds; ++round) {
        std::map<std::array<Index, 2>, Index> middle_of;
        const auto middle = [&](Index a, Index b) {
            const auto [slot, is_new] = middle_of.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<Index>(mesh.vertices.size()));
            if (is_new) mesh.vertices.push_back((0.5 * (mesh.vertices[a] + mesh.vertices[b])).normalized());
            return slot->second;
        };
        std::vector<Triangle> finer;
        for (const Triangle& t : mesh.triangles) {
            const Index a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
            finer.insert(finer.end(), {Triangle{t[0], a, c}, Triangle{a, t[1], b}, Triangle{c, b, t[2]}, Triangle{a, b, c}});
        }
        mesh.triangles = finer;
    }
    for (Vec3& v : mesh.vertices) v *= 0.1 * (1.0 + 0.15 * v[0] * v[1] + 0.1 * v[2] * v[2] * v[0]);
    return mesh;
}

#define NEED_TETGEN()                                                                                                                      \
    if (!find_program("tetgen", "tetgen").ok()) GTEST_SKIP() << "tetgen is not installed"

} // namespace

TEST(Coarse, MeshIsAFairCopyOfTheDenseSurfaceAndComesFromTheCacheNextTime) {
    NEED_TETGEN();
    const PrivateCache cache;
    const TriMesh dense = make_bumpy_ball(5);
    const auto first = make_coarse_mesh(dense, {.surface_triangles = 400});
    ASSERT_TRUE(first.ok()) << first.error().to_string();
    EXPECT_FALSE(first->from_cache);
    EXPECT_LE(first->surface_triangles, 400U);
    EXPECT_GT(first->surface_triangles, 300U);
    EXPECT_NEAR(inspect_tets(first->tets).volume, signed_volume(dense), 0.03 * signed_volume(dense));
    EXPECT_EQ(inspect_tets(first->tets).components, 1U);
    const auto again = make_coarse_mesh(dense, {.surface_triangles = 400});
    ASSERT_TRUE(again.ok());
    EXPECT_TRUE(again->from_cache);
    EXPECT_EQ(again->tets.vertices, first->tets.vertices);
    EXPECT_EQ(again->tets.tets, first->tets.tets);
    const auto other = make_coarse_mesh(dense, {.surface_triangles = 300});
    ASSERT_TRUE(other.ok());
    EXPECT_FALSE(other->from_cache);
}

TEST(Coarse, EntryThatWasDamagedIsMadeAgain) {
    NEED_TETGEN();
    const PrivateCache cache;
    const TriMesh dense = make_bumpy_ball(4);
    const auto first = make_coarse_mesh(dense, {.surface_triangles = 200});
    ASSERT_TRUE(first.ok());
    const auto size = std::filesystem::file_size(cache.only_entry());
    const auto damage = [&](auto&& change) {
        change();
        const auto mesh = make_coarse_mesh(dense, {.surface_triangles = 200});
        ASSERT_TRUE(mesh.ok());
        EXPECT_FALSE(mesh->from_cache);
        EXPECT_EQ(mesh->tets.tets, first->tets.tets);
        EXPECT_TRUE(make_coarse_mesh(dense, {.surface_triangles = 200})->from_cache);
    };
    damage([&] { std::filesystem::resize_file(cache.only_entry(), size / 2); });
    damage([&] { std::filesystem::resize_file(cache.only_entry(), 3); });
    damage([&] {
        std::fstream file(cache.only_entry(), std::ios::in | std::ios::out | std::ios::binary);
        file.seekp(static_cast<std::streamoff>(size / 2));
        file.put('\x5a').put('\xa5');
    });
}

TEST(Coarse, AnotherTetgenAtTheSamePathIsNotGivenTheMeshOfTheOneBefore) {
    const auto tetgen = find_program("tetgen", "tetgen");
    if (!tetgen.ok()) GTEST_SKIP() << "tetgen is not installed";
    const PrivateCache cache;
    const auto folder = TemporaryFolder::make();
    ASSERT_TRUE(folder.ok());
    const std::filesystem::path program = folder->path() / "mesher";
    const auto install = [&](const char* version) {
        std::ofstream(program) << "#!/bin/sh\n# " << version << "\nexec " << tetgen->string() << " \"$@\"\n";
        std::filesystem::permissions(program, std::filesystem::perms::owner_all);
    };
    CoarseOptions options{.surface_triangles = 200};
    options.tetgen.program = program.string();
    const auto from_cache = [&] {
        const auto mesh = make_coarse_mesh(make_bumpy_ball(4), options);
        EXPECT_TRUE(mesh.ok()) << mesh.error().to_string();
        return mesh.ok() && mesh->from_cache;
    };
    install("1.5");
    EXPECT_FALSE(from_cache());
    EXPECT_TRUE(from_cache());
    install("1.6 of a later year");
    EXPECT_FALSE(from_cache()) << "another size";
    EXPECT_TRUE(from_cache());
    std::filesystem::last_write_time(program, std::filesystem::last_write_time(program) - std::chrono::hours(1));
    EXPECT_FALSE(from_cache()) << "another time";
    std::filesystem::rename(program, folder->path() / "elsewhere");
    options.tetgen.program = (folder->path() / "elsewhere").string();
    EXPECT_FALSE(from_cache()) << "another path";
}

TEST(Coarse, OpenDenseSurfaceIsAnErrorThatNamesTriangles) {
    TriMesh dense = make_bumpy_ball(3);
    dense.triangles.pop_back();
    const auto mesh = make_coarse_mesh(dense, {.surface_triangles = 100, .use_cache = false});
    ASSERT_FALSE(mesh.ok());
    EXPECT_EQ(mesh.error().code, ErrorCode::BadMesh);
    EXPECT_THAT(mesh.error().message, testing::HasSubstr("triangle"));
    EXPECT_EQ(make_coarse_mesh(dense, {.surface_triangles = 3}).error().code, ErrorCode::BadValue);
}

/// metres  an organ, about 20 cm across
void expect_a_usable_body(const TriMesh& metres) {
    const auto coarse = make_coarse_mesh(metres, {.surface_triangles = 800, .use_cache = false});
    ASSERT_TRUE(coarse.ok()) << coarse.error().to_string();
    const auto model = fem::make_tissue_model(coarse->tets, {}, {});
    ASSERT_TRUE(model.ok());
    EXPECT_NEAR(model->volume, signed_volume(metres), 0.03 * signed_volume(metres));
    fem::StableStepWorkspace workspace;
    EXPECT_GT(fem::find_stable_step(*model, model->rest_position, nullptr, workspace).step, 1e-4);
    const auto links = fem::make_surface_links(coarse->tets, metres);
    ASSERT_TRUE(links.ok());
    EXPECT_EQ(links->static_count, 0U);
    EXPECT_LT(links->max_length, 0.02);
    testing::Test::RecordProperty("tets", std::to_string(coarse->tets.tets.size()));
}

TEST(Coarse, MadeOrgansBecomeBodiesWithShortLinksAndAUsableStep) {
    NEED_TETGEN();
    for (const std::uint64_t seed : {1u, 2u}) expect_a_usable_body(made::make_organ(seed, 4));
}

TEST(Coarse, RealLiverBecomesABodyWithShortLinksAndAUsableStep) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (!data) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    NEED_TETGEN();
    const auto dense = read_surface(std::filesystem::path(data) / "organs/infinytoolkit_liver_visual_5k.obj.gz", {});
    ASSERT_TRUE(dense.ok()) << dense.error().to_string();
    TriMesh metres = *dense;
    for (Vec3& v : metres.vertices) v *= 0.025; // about 24 cm across
    expect_a_usable_body(metres);
}

struct Asked {
    std::size_t triangles; // of TetGen's surface
    double times;          // that the lattice's stable step is longer, at least
};

/// At the same number of nodes; the surface is scaled to 0.2 m.
void expect_longer_steps(TriMesh surface, const char* name, std::initializer_list<Asked> all) {
    const double unit = 0.2 / surface.bounds().longest_edge();
    for (Vec3& v : surface.vertices) v *= unit;
    const auto step_of = [](const TetMesh& tets) {
        const auto model = fem::make_tissue_model(tets, {.young_modulus = 20000.0, .poisson_ratio = 0.4, .density = 1000.0}, {});
        EXPECT_TRUE(model.ok());
        fem::StableStepWorkspace workspace;
        return fem::find_stable_step(*model, model->rest_position, nullptr, workspace).step;
    };
    for (const auto& [triangles, times] : all) {
        const auto tetgen = make_coarse_mesh(surface, {.surface_triangles = triangles, .use_cache = false});
        ASSERT_TRUE(tetgen.ok()) << tetgen.error().to_string();
        const auto lattice = fem::make_lattice_of_nodes(surface, tetgen->tets.vertices.size());
        ASSERT_TRUE(lattice.ok()) << lattice.error().to_string();
        const double by_tetgen = step_of(tetgen->tets), by_lattice = step_of(lattice->tets);
        const double nodes = static_cast<double>(lattice->tets.vertices.size()) / static_cast<double>(tetgen->tets.vertices.size());
        std::printf("%s of 0.2 m, %zu triangles: TetGen %zu nodes %.4g ms, lattice %zu nodes %.4g ms, %.2f times\n", name, triangles,
                    tetgen->tets.vertices.size(), 1e3 * by_tetgen, lattice->tets.vertices.size(), 1e3 * by_lattice, by_lattice / by_tetgen);
        EXPECT_GT(nodes, 0.85);
        EXPECT_LT(nodes, 1.18);
        EXPECT_GT(by_lattice, times * by_tetgen);
    }
}

TEST(Coarse, LatticeOfMadeBodiesBearsSeveralTimesTetGensStepAtItsNodeCount) {
    NEED_TETGEN();
    expect_longer_steps(made::make_organ(1, 4), "organ", {{800, 2.0}, {1400, 2.0}});
    expect_longer_steps(made::make_animal(1, 7000), "animal", {{1400, 2.0}, {3000, 2.0}});
}

TEST(Coarse, LatticeOfTheBunnyBearsFiveTimesTetGensStepAtItsNodeCount) {
    const char* data = std::getenv("TROCAR_TEST_DATA");
    if (!data) GTEST_SKIP() << "TROCAR_TEST_DATA is not set";
    NEED_TETGEN();
    const auto bunny = read_surface(std::filesystem::path(data) / "stanford/bunny_7k_closed.off.gz", {});
    ASSERT_TRUE(bunny.ok()) << bunny.error().to_string();
    // 642 nodes are too few for cells inside the ears: 4.2 times there
    expect_longer_steps(*bunny, "bunny", {{800, 4.0}, {1400, 5.0}, {3000, 5.0}});
}

TEST(Cache, KeysTellApartWhatWasFedIn) {
    const auto key = [](auto&&... parts) {
        ContentHash hash;
        (hash.feed(parts), ...);
        return hash.hex();
    };
    EXPECT_NE(key(std::string_view("ab"), std::string_view("c")), key(std::string_view("a"), std::string_view("bc")));
    EXPECT_NE(key(0.0), key(-0.0));
    EXPECT_NE(key(make_bumpy_ball(1)), key(make_bumpy_ball(2)));
    EXPECT_EQ(key(make_bumpy_ball(2)), key(make_bumpy_ball(2)));
    ContentHash fnv; // published test vector of FNV-1a 128
    fnv.feed("foobar", 6);
    EXPECT_EQ(fnv.hex(), "343e1662793c64bf6f0d3597ba446f18");
}

TEST(Cache, CanBeTurnedOffAndNeverInventsAnEntry) {
    const PrivateCache cache;
    const std::string key(32, 'a');
    EXPECT_FALSE(read_cache("coarse", key));
    EXPECT_TRUE(write_cache("coarse", key, "payload"));
    EXPECT_EQ(read_cache("coarse", key), "payload");
    EXPECT_FALSE(read_cache("other", key));
    setenv("TROCAR_CACHE", "off", 1);
    EXPECT_FALSE(read_cache("coarse", key));
    EXPECT_FALSE(write_cache("coarse", key, "payload"));
    setenv("TROCAR_CACHE", "/proc/no/such/folder", 1);
    EXPECT_FALSE(write_cache("coarse", key, "payload"));
}

TEST(Cache, UnpacksOnlyWholeMeshesWithIndicesInRange) {
    const TriMesh mesh = make_bumpy_ball(1);
    const std::string packed = pack_mesh(mesh);
    EXPECT_EQ(unpack_triangles(packed)->vertices, mesh.vertices);
    EXPECT_FALSE(unpack_triangles(packed.substr(0, packed.size() - 1)));
    EXPECT_FALSE(unpack_triangles(packed + "x"));
    EXPECT_FALSE(unpack_triangles(std::string(8, '\xff')));
    EXPECT_FALSE(unpack_triangles(""));
    EXPECT_FALSE(unpack_tets(packed));
    TriMesh broken = mesh;
    broken.triangles[0][0] = 4000;
    EXPECT_FALSE(unpack_triangles(pack_mesh(broken)));
}

} // namespace trocar::engine
