#include "base/inside.hpp"
#include "base/repair.hpp"
#include "base/repair_steps.hpp"
#include "base/self_intersection.hpp"

#include "test_meshes.hpp"
#include "tests/made/surfaces.hpp"

#include <algorithm>
#include <ctime>
#include <numbers>

using namespace trocar;
using namespace trocar::test;

namespace {

RepairStep expect_repair(TriMesh& mesh, Repair repair) {
    const Result<RepairStep> step = apply_repair(mesh, repair);
    EXPECT_TRUE(step.ok()) << (step.ok() ? "" : step.error().message);
    return step.ok() ? *step : RepairStep{};
}

void expect_closed(const TriMesh& mesh) {
    const Result<void> check = check_closed_surface(mesh);
    EXPECT_TRUE(check.ok()) << (check.ok() ? "" : check.error().message);
}

/// Every triangle with corners of its own, each moved by up to `jitter`.
TriMesh make_soup(const TriMesh& mesh, double jitter) {
    Random random{61};
    TriMesh soup;
    for (const Triangle& t : mesh.triangles) {
        const auto first = static_cast<Index>(soup.vertices.size());
        for (const Index v : t) soup.vertices.push_back(mesh.vertices[v] + jitter * random.point());
        soup.triangles.push_back({first, first + 1, first + 2});
    }
    return soup;
}

TriMesh without(TriMesh mesh, std::initializer_list<std::size_t> triangles) {
    std::vector<std::size_t> ids(triangles);
    for (auto t = ids.rbegin(); t != ids.rend(); ++t) mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(*t));
    return mesh;
}

} // namespace

TEST(Repair, NamesGoBothWays) {
    EXPECT_EQ(repair_names().size(), kRepairCount);
    for (const std::string_view name : repair_names()) {
        ASSERT_TRUE(find_repair(name));
        EXPECT_EQ(repair_name(*find_repair(name)), name);
    }
    EXPECT_FALSE(find_repair("fill_hole"));
    EXPECT_EQ(find_repair("drop_self_intersections"), Repair::DropSelfIntersections);
}

TEST(Repair, SoundSurfacesComeOutUntouchedByEveryRepair) {
    for (const TriMesh& sound : {make_cube(), make_sphere(3), make_torus(20, 10)})
        for (std::size_t r = 0; r < kRepairCount; ++r) {
            TriMesh mesh = sound;
            const RepairStep step = expect_repair(mesh, static_cast<Repair>(r));
            EXPECT_EQ(mesh.triangles, sound.triangles) << step.to_string();
            EXPECT_EQ(mesh.vertices, sound.vertices);
            EXPECT_NE(step.to_string().find("nothing to do"), std::string::npos) << step.to_string();
        }
}

TEST(Repair, UnusableMeshesAreErrorsAndStayAsTheyWere) {
    TriMesh nan_cube = make_cube(), wild = make_cube();
    nan_cube.vertices[2][1] = std::nan("");
    wild.triangles[3][0] = 42;
    for (TriMesh mesh : {TriMesh{}, nan_cube, wild})
        for (std::size_t r = 0; r < kRepairCount; ++r) EXPECT_FALSE(apply_repair(mesh, static_cast<Repair>(r)).ok());
    const std::array both{Repair::FillHoles, Repair::Orient};
    EXPECT_FALSE(apply_repairs(wild, both).ok());
    EXPECT_EQ(wild.triangles[3][0], 42u);
}

TEST(Weld, MakesASurfaceOfASoup) {
    for (const double jitter : {0.0, 1e-9}) {
        TriMesh mesh = make_soup(make_sphere(3), jitter);
        const RepairStep step = expect_repair(mesh, Repair::Weld);
        EXPECT_EQ(mesh.vertices.size(), make_sphere(3).vertices.size());
        EXPECT_EQ(step.vertices_merged, 3 * mesh.triangles.size() - mesh.vertices.size());
        expect_closed(mesh);
    }
}

TEST(Weld, ToleranceIsADistance) {
    TriMesh cube = make_soup(make_cube(), 0.0);
    for (std::size_t v = 0; v < cube.vertices.size(); v += 2) cube.vertices[v] += Vec3(0.009, 0, 0);
    TriMesh loose = cube;
    EXPECT_TRUE(apply_repair(loose, Repair::Weld, {.weld_tolerance = 0.01}).ok());
    EXPECT_EQ(loose.vertices.size(), 8u);
    TriMesh tight = cube;
    EXPECT_TRUE(apply_repair(tight, Repair::Weld, {.weld_tolerance = 0.008}).ok());
    EXPECT_GT(tight.vertices.size(), 8u);
    TriMesh tiny = make_soup(make_cube(1e-9), 0.0);
    expect_repair(tiny, Repair::Weld);
    EXPECT_EQ(tiny.vertices.size(), 8u);
}

/// Of every pair, as the repair says it: each vertex to the lowest earlier one within the tolerance that has stayed.
TEST(Weld, ToleranceIsThatOfThePairsWhateverTheCells) {
    const double tolerance = 0.01;
    Random random{67};
    for (const double extent : {0.02, 0.1, 1.0}) {
        TriMesh soup;
        for (Index v = 0; v < 600; ++v) soup.vertices.push_back(extent * random.point());
        for (Index v = 0; v < 600; v += 3) soup.triangles.push_back({v, v + 1, v + 2});
        std::vector<Index> stayed;
        std::size_t merged = 0;
        for (Index v = 0; v < 600; ++v) {
            const auto near = [&](Index kept) { return (soup.vertices[kept] - soup.vertices[v]).norm() <= tolerance; };
            if (std::any_of(stayed.begin(), stayed.end(), near))
                ++merged;
            else
                stayed.push_back(v);
        }
        const auto step = apply_repair(soup, Repair::Weld, {.weld_tolerance = tolerance, .may_remove = 1.0, .may_split = true});
        ASSERT_TRUE(step.ok()) << step.error().message;
        EXPECT_EQ(step->vertices_merged, merged) << extent;
    }
}

TEST(Weld, OfHundredsOfThousandsOfVerticesAtOnePlaceTakesNoLongerThanOfAsManyApart) {
    constexpr Index kTriangles = 200000; // a cone of loose triangles: all have the apex
    TriMesh cone;
    const auto rim = [](Index k) {
        const double angle = 2.0 * std::numbers::pi * static_cast<double>(k % kTriangles) / kTriangles;
        return Vec3(1e3 * std::cos(angle), 1e3 * std::sin(angle), 0.0);
    };
    for (Index k = 0; k < kTriangles; ++k) {
        cone.triangles.push_back({3 * k, 3 * k + 1, 3 * k + 2});
        cone.vertices.insert(cone.vertices.end(), {Vec3(0.0, 0.0, 1e3), rim(k), rim(k + 1)});
    }
    const std::clock_t begin = std::clock();
    ASSERT_TRUE(apply_repair(cone, Repair::Weld).ok());
    EXPECT_LT(static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC, 15.0) << "each copy of the apex was compared with all others";
    EXPECT_EQ(cone.vertices.size(), kTriangles + 1u);
    EXPECT_EQ(cone.triangles.size(), kTriangles);
}

TEST(DropDegenerate, NeedlesAndCapsGoWithoutOpeningTheSurface) {
    TriMesh mesh = make_cube();
    mesh.vertices.emplace_back(0.5, 0.0, 0.0); // on edge 0-1: a cap between the two faces there
    mesh.triangles[4] = {0, 8, 5};             // was 0 1 5
    mesh.triangles.push_back({8, 1, 5});
    mesh.triangles.push_back({0, 1, 8});
    ASSERT_EQ(inspect_surface(mesh).boundary_edges, 0u);
    ASSERT_EQ(inspect_surface(mesh).degenerate_triangles, 1u);
    expect_repair(mesh, Repair::DropDegenerate);
    expect_closed(mesh);
    EXPECT_DOUBLE_EQ(signed_volume(mesh), 1.0);

    TriMesh needle = make_cube(); // vertex 7 doubled, the gap closed by triangles without area
    needle.vertices.push_back(needle.vertices[7]);
    needle.triangles[1][1] = 3;
    for (const std::size_t t : {std::size_t{2}, std::size_t{3}})
        for (Index& v : needle.triangles[t])
            if (v == 7) v = 8;
    needle.triangles.push_back({7, 8, 5});
    needle.triangles.push_back({8, 7, 6});
    ASSERT_EQ(inspect_surface(needle).degenerate_triangles, 2u);
    expect_repair(needle, Repair::DropDegenerate);
    expect_closed(needle);
    EXPECT_EQ(needle.vertices.size(), 8u);
}

TEST(DropDuplicates, KeepsTheFirst) {
    TriMesh mesh = make_cube();
    mesh.triangles.push_back({3, 0, 2});
    mesh.triangles.push_back({0, 3, 2});
    EXPECT_EQ(expect_repair(mesh, Repair::DropDuplicates).triangles_removed, 2u);
    EXPECT_EQ(mesh.triangles, make_cube().triangles);
}

TEST(DropNonManifold, CutsFinsAndBowtiesApart) {
    TriMesh bowtie = join(make_cube(), make_cube(1.0, Vec3(1, 1, 1)));
    for (Triangle& t : bowtie.triangles)
        for (Index& v : t)
            if (v == 8) v = 7;
    EXPECT_EQ(expect_repair(bowtie, Repair::DropNonManifold).vertices_split, 1u);
    expect_closed(bowtie);
    TriMesh fin = make_cube();
    fin.vertices.emplace_back(0.5, -1, -1);
    fin.triangles.push_back({0, 1, 8});
    for (const Repair helpless : {Repair::FillHoles, Repair::Orient, Repair::DropInnerShells, Repair::DropSelfIntersections}) {
        const Result<RepairStep> refused = apply_repair(fin, helpless);
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.error().message.find("drop_non_manifold"), std::string::npos) << refused.error().message;
    }
    ASSERT_TRUE(
        apply_repairs(fin, std::array{Repair::DropNonManifold, Repair::FillHoles, Repair::Orient}, {.may_remove = 0.2, .may_split = true}).ok());
    expect_closed(fin);
}

TEST(DropNonManifold, OfTwoCubesThatShareAnEdgeMakesTwoPartsOnlyWhereThatIsAllowed) {
    TriMesh pair = join(make_cube(), make_cube(1.0, Vec3(1, 1, 0)));
    ASSERT_TRUE(apply_repair(pair, Repair::Weld).ok());
    ASSERT_EQ(measure_surface(pair).components, 1u);
    const Result<RepairStep> refused = apply_repair(pair, Repair::DropNonManifold);
    ASSERT_FALSE(refused.ok());
    for (const char* piece : {"leave more parts than there were", "components 1 to 2", "\"may_split\": true allows it"})
        EXPECT_NE(refused.error().message.find(piece), std::string::npos) << piece << " in " << refused.error().message;
    ASSERT_TRUE(apply_repair(pair, Repair::DropNonManifold, {.may_split = true}).ok());
    expect_closed(pair);
}

TEST(FillHoles, ClosesFlatAndBentHolesWithTheirArea) {
    TriMesh cube = without(make_cube(), {10, 11});
    EXPECT_EQ(expect_repair(cube, Repair::FillHoles).holes_filled, 1u);
    expect_closed(cube);
    EXPECT_DOUBLE_EQ(signed_volume(cube), 1.0);
    TriMesh half = make_sphere(4); // keep what is not in one octant: a bent border of three arcs
    std::erase_if(half.triangles, [&](const Triangle& t) {
        const Vec3 middle = half.vertices[t[0]] + half.vertices[t[1]] + half.vertices[t[2]];
        return middle.minCoeff() > 0.0;
    });
    EXPECT_EQ(expect_repair(half, Repair::FillHoles).holes_filled, 1u);
    expect_closed(half);
    EXPECT_EQ(find_self_intersections(half).count, 0u);
}

TEST(FillHoles, TakesHolesThatTouchAtAVertex) {
    TriMesh sphere = make_sphere(2);
    const VertexTriangles around = vertex_triangles(sphere.triangles, sphere.vertices.size());
    Index vertex = 0;
    while (around.of(vertex).size() != 6) ++vertex;
    const auto neighbours = triangle_neighbours(sphere.triangles);
    const Index first = around.of(vertex)[0];
    for (const Index second : around.of(vertex)) { // one that shares only the vertex
        const auto& next = neighbours[first];
        if (second == first || std::find(next.begin(), next.end(), second) != next.end()) continue;
        TriMesh mesh = without(sphere, {first, second});
        ASSERT_EQ(inspect_surface(mesh).nonmanifold_vertices, 1u);
        EXPECT_EQ(expect_repair(mesh, Repair::FillHoles).holes_filled, 2u);
        expect_closed(mesh);
        EXPECT_NEAR(signed_volume(mesh), signed_volume(sphere), 1e-12);
    }
}

TEST(FillHoles, ALongLoopGetsAFan) {
    TriMesh grid = make_grid(250); // border of 1000
    EXPECT_EQ(expect_repair(grid, Repair::FillHoles).triangles_added, 1000u);
    const SurfaceReport report = inspect_surface(grid);
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
}

TEST(FillHoles, LoopsBeyondWhatIsWeighedInAllGetFansAsLongOnesDo) {
    constexpr Index kRim = 790;
    constexpr std::size_t kCones = 14;
    TriMesh mesh;
    for (std::size_t c = 0; c < kCones; ++c) { // open at the bottom
        const Vec3 middle(3.0 * static_cast<double>(c), 0.0, 0.0);
        TriMesh cone;
        cone.vertices.push_back(middle + Vec3::UnitZ());
        for (Index k = 0; k < kRim; ++k) {
            const double angle = 2.0 * std::numbers::pi * k / kRim;
            cone.vertices.push_back(middle + Vec3(std::cos(angle), std::sin(angle), 0.0));
            cone.triangles.push_back({0, 1 + k, 1 + (k + 1) % kRim});
        }
        mesh = join(std::move(mesh), cone);
    }
    const std::size_t vertices = mesh.vertices.size();
    const RepairStep step = expect_repair(mesh, Repair::FillHoles);
    const std::size_t fans = mesh.vertices.size() - vertices; // each has a hub
    EXPECT_EQ(step.holes_filled, kCones);
    EXPECT_EQ(step.crossings_made, 0u);
    EXPECT_TRUE(inspect_surface(mesh).closed());
    EXPECT_GT(fans, 0u) << "all loops were weighed";
    EXPECT_LT(fans, kCones / 2) << "those within the limit get least area";
    EXPECT_EQ(step.triangles_added, kCones * (kRim - 2) + 2 * fans);
}

TEST(FillHoles, WorksOnInconsistentInputAndRefusesAMoebiusStrip) {
    TriMesh cube = without(make_cube(), {10});
    std::swap(cube.triangles[3][0], cube.triangles[3][1]);
    EXPECT_EQ(expect_repair(cube, Repair::FillHoles).triangles_flipped, 1u);
    expect_closed(cube);
    TriMesh strip;
    for (Index i = 0; i < 12; ++i) {
        const double u = 2.0 * M_PI * i / 12, half_turn = 0.5 * u;
        for (const double s : {-0.2, 0.2}) {
            const double r = 1.0 + s * std::cos(half_turn);
            strip.vertices.emplace_back(r * std::cos(u), r * std::sin(u), s * std::sin(half_turn));
        }
    }
    for (Index i = 0; i < 12; ++i) {
        const Index a = 2 * i, b = a + 1, c = i < 11 ? a + 2 : 1, d = i < 11 ? a + 3 : 0;
        strip.triangles.insert(strip.triangles.end(), {{a, c, b}, {b, c, d}});
    }
    for (const Repair repair : {Repair::FillHoles, Repair::Orient}) {
        const Result<RepairStep> refused = apply_repair(strip, repair);
        ASSERT_FALSE(refused.ok());
        EXPECT_NE(refused.error().message.find("one side"), std::string::npos) << refused.error().message;
    }
}

TEST(Orient, TurnsInwardSurfacesOutAndKeepsCavities) {
    TriMesh inward = flipped(make_sphere(3));
    inward.triangles[7] = make_sphere(3).triangles[7];
    expect_repair(inward, Repair::Orient);
    expect_closed(inward);
    TriMesh hollow = flipped(join(make_sphere(3), flipped(make_sphere(3, 0.5)))); // inside out as a whole
    expect_repair(hollow, Repair::Orient);
    EXPECT_NEAR(signed_volume(hollow), signed_volume(make_sphere(3)) * (1.0 - 0.125), 1e-12);
    TriMesh apart = join(flipped(make_cube()), make_cube(1.0, Vec3(5, 0, 0)));
    EXPECT_EQ(expect_repair(apart, Repair::Orient).triangles_flipped, 12u);
    EXPECT_NEAR(signed_volume(apart), 2.0, 1e-12);
}

TEST(DropInnerShells, KeepsTheOutermostOfNestedShells) {
    TriMesh nested = join(join(make_sphere(2, 0.3), make_sphere(3)), join(flipped(make_sphere(2, 0.6)), make_cube(1.0, Vec3(4, 0, 0))));
    EXPECT_EQ(expect_repair(nested, Repair::DropInnerShells).shells_removed, 2u);
    EXPECT_EQ(nested.triangles.size(), make_sphere(3).triangles.size() + 12u);
    TriMesh crossing = join(make_sphere(3), make_sphere(3, 0.8, Vec3(0.9, 0, 0)));
    EXPECT_EQ(expect_repair(crossing, Repair::DropInnerShells).shells_removed, 0u);
}

TEST(DropInnerShells, PeelsADoubleShellThatIsOneSurface) {
    // a thin bowl, nearly closed: outer and inner spheres joined round an opening at the top
    const TriMesh sphere = make_sphere(5);
    TriMesh outer = sphere, inner = flipped(make_sphere(5, 0.98));
    const auto in_cap = [&sphere](const Triangle& t) {
        return sphere.vertices[t[0]][2] + sphere.vertices[t[1]][2] + sphere.vertices[t[2]][2] > 2.7;
    };
    std::erase_if(outer.triangles, in_cap);
    std::erase_if(inner.triangles, in_cap);
    const auto offset = static_cast<Index>(outer.vertices.size());
    TriMesh bowl = join(outer, inner);
    for_each_edge(sorted_edge_uses(outer.triangles), [&](std::span<const EdgeUse> uses) {
        if (uses.size() != 1) return;
        const Triangle& t = outer.triangles[uses[0].triangle];
        const Index a = t[uses[0].corner], b = t[(uses[0].corner + 1u) % 3u];
        bowl.triangles.insert(bowl.triangles.end(), {{b, a, a + offset}, {b, a + offset, b + offset}});
    });
    expect_closed(bowl);
    EXPECT_EQ(expect_repair(bowl, Repair::DropInnerShells).shells_removed, 1u);
    expect_closed(bowl);
    EXPECT_GT(signed_volume(bowl), 0.95 * signed_volume(sphere));
}

TEST(KeepLargest, GoesByArea) {
    TriMesh mesh = join(make_sphere(4, 0.1), make_cube(3.0, Vec3(2, 2, 2)));
    EXPECT_EQ(expect_repair(mesh, Repair::KeepLargest).shells_removed, 1u);
    EXPECT_EQ(mesh.triangles.size(), 12u);
}

TEST(DropSelfIntersections, LeavesNoneBetweenOverlappingSpheres) {
    TriMesh mesh = join(make_sphere(4), make_sphere(4, 1.0, Vec3(1.8, 0.1, 0.2)));
    ASSERT_GT(find_self_intersections(mesh).count, 0u);
    expect_repair(mesh, Repair::DropSelfIntersections);
    expect_closed(mesh);
    EXPECT_EQ(find_self_intersections(mesh).count, 0u);
    EXPECT_GT(signed_volume(mesh), 1.7 * signed_volume(make_sphere(4)));
}

/// What scanners and segmentations do to a surface: a soup of triangles with holes, flipped faces and doubled ones, and a second wall
/// inside.
TEST(MadeRepairs, BringSpoiltOrgansAndArteriesBackToWhatTheyWereMadeOf) {
    for (const std::uint64_t seed : {1u, 2u, 3u}) {
        made::Random random(seed);
        SCOPED_TRACE("seed " + std::to_string(seed));
        for (const bool organ : {true, false}) {
            const TriMesh sound = organ ? made::make_organ(seed, 4) : made::make_artery_tree(seed, 6000);
            expect_closed(sound);
            TriMesh mesh = made::with_holes(sound, 6, random);
            for (int k = 0; k < 9; ++k) {
                Triangle& t = mesh.triangles[random.next() % mesh.triangles.size()];
                std::swap(t[1], t[2]);
            }
            for (int k = 0; k < 4; ++k) mesh.triangles.push_back(mesh.triangles[random.next() % mesh.triangles.size()]);
            mesh = made::as_soup(mesh, random);
            using enum Repair;
            const auto report = apply_repairs(mesh, std::array{Weld, DropDuplicates, FillHoles, Orient, DropSelfIntersections});
            ASSERT_TRUE(report.ok()) << report.error().message;
            expect_closed(mesh);
            EXPECT_EQ(find_self_intersections(mesh).count, 0u);
            EXPECT_NEAR(signed_volume(mesh), signed_volume(sound), 0.02 * signed_volume(sound)) << (organ ? "organ" : "arteries");
        }
    }
}

/// Both walls of a capsule that was segmented as a thick shell: the inner one goes, the organ stays.
TEST(MadeRepairs, TakeTheInnerWallOutOfAThickCapsule) {
    const TriMesh outer = made::make_organ(4, 4);
    TriMesh inner = flipped(outer);
    for (Vec3& v : inner.vertices) v *= 0.97;
    TriMesh mesh = join(outer, inner);
    EXPECT_LT(signed_volume(mesh), 0.1 * signed_volume(outer));
    EXPECT_EQ(expect_repair(mesh, Repair::DropInnerShells).shells_removed, 1u);
    expect_closed(mesh);
    EXPECT_NEAR(signed_volume(mesh), signed_volume(outer), 1e-12);
}

namespace {

/// Overlapping balls along a line: like a kidney whose parts were exported one by one.
TriMesh make_chain_of_balls(int count, double gap, Random& random) {
    TriMesh chain;
    for (int i = 0; i < count; ++i) chain = join(chain, make_sphere(3, 1.0, Vec3(gap * i, 0, 0) + random.point(0.05)));
    return chain;
}

void expect_measure(const SurfaceMeasure& measure, const TriMesh& mesh) {
    const SurfaceReport report = inspect_surface(mesh);
    double area_sum = 0.0;
    for (const Triangle& t : mesh.triangles)
        area_sum += 0.5 * (mesh.vertices[t[1]] - mesh.vertices[t[0]]).cross(mesh.vertices[t[2]] - mesh.vertices[t[0]]).norm();
    EXPECT_EQ(measure.triangles, mesh.triangles.size());
    EXPECT_NEAR(measure.area, area_sum, 1e-12 * area_sum);
    EXPECT_EQ(measure.components, find_components(mesh.triangles, mesh.vertices.size(), Joined::BySharedEdges).count);
    if (report.closed() && report.oriented() && report.nonmanifold_edges == 0) {
        ASSERT_TRUE(measure.volume);
        EXPECT_NEAR(*measure.volume, report.signed_volume, 1e-12 * std::abs(report.signed_volume));
    }
    if (!report.closed() || !report.oriented()) {
        EXPECT_FALSE(measure.volume);
    }
}

/// A surface with random holes, wrong turns, copies of triangles, and cracks of no width: corners moved onto a neighbour's edge.
TriMesh damage(TriMesh mesh, Random& random) {
    const auto pick = [&](std::size_t count) { return static_cast<std::size_t>(random.uniform(0.0, 0.999) * static_cast<double>(count)); };
    for (int i = 0; i < 6; ++i) mesh.triangles.erase(mesh.triangles.begin() + static_cast<std::ptrdiff_t>(pick(mesh.triangles.size())));
    for (int i = 0; i < 3; ++i) {
        Triangle& turned = mesh.triangles[pick(mesh.triangles.size())];
        std::swap(turned[0], turned[1]);
    }
    for (int i = 0; i < 4; ++i) { // split a triangle at an edge's middle, and not its neighbour
        const std::size_t t = pick(mesh.triangles.size());
        const Triangle old = mesh.triangles[t];
        const auto middle = static_cast<Index>(mesh.vertices.size());
        mesh.vertices.emplace_back(0.5 * (mesh.vertices[old[0]] + mesh.vertices[old[1]]));
        mesh.triangles[t] = {old[0], middle, old[2]};
        mesh.triangles.push_back({middle, old[1], old[2]});
    }
    return mesh;
}

} // namespace

TEST(Repair, EveryStepSaysWhatTheSurfaceMeasuredBeforeAndAfter) {
    Random random{71};
    SCOPED_TRACE(random.trace());
    for (int run = 0; run < 12; ++run)
        for (std::size_t r = 0; r < kRepairCount; ++r) {
            const TriMesh old = damage(run % 2 == 0 ? make_sphere(3) : join(make_torus(24, 12), make_sphere(2, 0.2)), random);
            TriMesh mesh = old;
            const Result<RepairStep> step = apply_repair(mesh, static_cast<Repair>(r), {.may_remove = 1.0, .may_split = true});
            if (!step.ok()) continue;
            expect_measure(step->before, old);
            expect_measure(step->after, mesh);
            EXPECT_NE(step->to_string().find("components " + std::to_string(step->before.components)), std::string::npos)
                << step->to_string();
        }
}

TEST(Repair, ThatWouldTakeTooMuchOrSplitIsAnErrorThatSaysWhatItWouldHaveRemoved) {
    Random random{73};
    const TriMesh kidney = make_chain_of_balls(15, 0.35, random); // each lies in its neighbours for the most part
    TriMesh mesh = kidney;
    const Result<RepairStep> refused = apply_repair(mesh, Repair::DropSelfIntersections);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(mesh.triangles, kidney.triangles) << "refused, and yet changed";
    for (const char* piece : {"would remove", "% of the area", "components 15", "expected at most 10 %", "\"may_remove\": 0."})
        EXPECT_NE(refused.error().message.find(piece), std::string::npos) << piece << " in " << refused.error().message;
    const Result<RepairStep> allowed = apply_repair(mesh, Repair::DropSelfIntersections, {.may_remove = 1.0, .may_split = true});
    ASSERT_TRUE(allowed.ok()) << allowed.error().message;
    EXPECT_LT(allowed->after.area, 0.9 * allowed->before.area);
    TriMesh two = join(make_cube(2.0), make_cube(1.0, Vec3(5, 0, 0)));
    EXPECT_FALSE(apply_repair(two, Repair::KeepLargest).ok());
    EXPECT_TRUE(apply_repair(two, Repair::KeepLargest, {.may_remove = 0.25}).ok());
}

TEST(DropSelfIntersections, ASearchThatGivesUpIsAnErrorAndNoProofThatNothingCrosses) {
    TriMesh shells = join(make_sphere(2), make_sphere(2, 0.98));
    EXPECT_TRUE(repairs::drop_self_intersections(shells, 0).ok());
    for (const int most_rounds : {0, 1}) {
        const Result<RepairStep> step = repairs::drop_self_intersections(shells, most_rounds, 0);
        ASSERT_FALSE(step.ok());
        EXPECT_NE(step.error().message.find("for crossings to be counted"), std::string::npos) << step.error().message;
    }
}

TEST(Repair, NeverTakesMoreThanItMayNorSplits) {
    Random random{79};
    SCOPED_TRACE(random.trace());
    int done = 0, refused = 0;
    for (int run = 0; run < 24; ++run) {
        TriMesh mesh = make_chain_of_balls(2 + run % 4, random.uniform(0.3, 2.2), random);
        const SurfaceMeasure before = measure_surface(mesh);
        const Result<RepairStep> step = apply_repair(mesh, Repair::DropSelfIntersections, {.may_remove = 0.15});
        const SurfaceMeasure after = measure_surface(mesh);
        (step.ok() ? done : refused) += 1;
        EXPECT_GE(after.area, 0.85 * before.area);
        EXPECT_GE(*after.volume, 0.85 * *before.volume);
        EXPECT_LE(after.components, before.components);
        if (step.ok()) {
            EXPECT_EQ(find_self_intersections(mesh).count, 0u);
        }
    }
    EXPECT_GT(done, 3);
    EXPECT_GT(refused, 3);
}

TEST(FillHoles, LeavesNoTriangleWithoutAreaNotEvenInCracksOfNoWidth) {
    TriMesh crack = make_cube(); // one face split at the middle of an edge, its neighbour not
    crack.vertices.emplace_back(0.5, 0.0, 0.0);
    crack.triangles[4] = {0, 8, 5};
    crack.triangles.push_back({8, 1, 5});
    ASSERT_EQ(inspect_surface(crack).boundary_edges, 3u);
    expect_repair(crack, Repair::FillHoles);
    expect_closed(crack);
    EXPECT_DOUBLE_EQ(signed_volume(crack), 1.0);
    Random random{83};
    SCOPED_TRACE(random.trace());
    for (int run = 0; run < 40; ++run) {
        TriMesh mesh = damage(run % 2 == 0 ? make_sphere(3) : make_torus(24, 12), random);
        ASSERT_EQ(inspect_surface(mesh).degenerate_triangles, 0u);
        if (inspect_surface(mesh).nonmanifold_edges > 0) continue;
        expect_repair(mesh, Repair::FillHoles);
        const SurfaceReport report = inspect_surface(mesh);
        EXPECT_EQ(report.degenerate_triangles, 0u) << "run " << run;
        EXPECT_TRUE(report.closed() && report.oriented()) << "run " << run;
    }
}

TEST(FillHoles, PatchesStayOutOfTheSurfaceWhereAnyDoes) {
    // a box whose rim goes up and down: its lid is a ridge or a valley, and a small cube sits where one of the two would be
    for (const double height : {1.0, 1.5}) {
        TriMesh box = without(make_cube(), {2, 3});
        box.vertices[5][2] = box.vertices[6][2] = 1.5;
        TriMesh mesh = join(box, make_cube(0.1, Vec3(0.43, 0.46, height - 0.05)));
        const RepairStep step = expect_repair(mesh, Repair::FillHoles);
        EXPECT_EQ(step.holes_filled, 1u);
        EXPECT_EQ(find_self_intersections(mesh).count, 0u) << "cube at " << height;
        EXPECT_EQ(step.crossings_made, 0u);
    }
}

TEST(FillHoles, CrossingsThatNoPatchAvoidsAreCounted) {
    Random random{89};
    SCOPED_TRACE(random.trace());
    std::size_t most = 0;
    for (int run = 0; run < 20; ++run) {
        TriMesh bowl = make_sphere(3);
        const double rim = random.uniform(-0.5, 0.8);
        std::erase_if(bowl.triangles, [&](const Triangle& t) {
            return bowl.vertices[t[0]][2] + bowl.vertices[t[1]][2] + bowl.vertices[t[2]][2] > 3.0 * rim;
        });
        TriMesh mesh = join(bowl, make_cube(0.2, Vec3(-0.1, -0.1, rim + random.uniform(-0.3, 0.3))));
        ASSERT_EQ(find_self_intersections(mesh).count, 0u);
        const RepairStep step = expect_repair(mesh, Repair::FillHoles);
        EXPECT_EQ(find_self_intersections(mesh).count, step.crossings_made);
        most = std::max(most, step.crossings_made);
    }
    EXPECT_GT(most, 0u) << "a pillar through the opening cannot be avoided";
}

TEST(RealRepairs, BringScansToClosedOutwardSurfacesThatDoNotCross) {
    struct Row {
        const char* name;
        std::vector<Repair> repairs;
        double least_volume, most_volume; // m^3
        double may_remove = kUsualRemoval;
    };
    using enum Repair;
    const std::array rows{
        Row{"organs/hra_vhf_liver_capsule_30k.obj.gz", {FillHoles, Orient, DropSelfIntersections}, 1.4e-3, 2.2e-3},
        Row{"organs/hra_vhm_liver_capsule_28k.obj.gz", {FillHoles, DropInnerShells, Orient, DropSelfIntersections}, 1.4e-3, 2.0e-3},
        Row{"vessels/hra_vhf_arteries_101k.obj.gz", {Weld, FillHoles, Orient, DropSelfIntersections}, 1.5e-4, 2.5e-4},
        Row{"vessels/hra_vhf_arteries_101k.obj.gz", {Weld, KeepLargest, FillHoles, Orient}, 1.2e-4, 1.8e-4, 0.6}};
    for (const Row& row : rows) {
        SCOPED_TRACE(row.name);
        TROCAR_LOAD_OR_SKIP(mesh, row.name);
        const auto report = apply_repairs(mesh, row.repairs, {.may_remove = row.may_remove});
        ASSERT_TRUE(report.ok()) << report.error().message;
        for (const RepairStep& step : report->steps) std::printf("  %s\n", step.to_string().c_str());
        expect_closed(mesh);
        EXPECT_EQ(find_self_intersections(mesh).count, 0u);
        EXPECT_GT(signed_volume(mesh), row.least_volume);
        EXPECT_LT(signed_volume(mesh), row.most_volume);
    }
}
