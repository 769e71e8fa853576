#include "gpu_scene.hpp"

#include "engine/render/canvas.hpp"
#include "engine/render/overlay.hpp"

#include <gmock/gmock.h>

#include <cmath>

namespace trocar::engine {
namespace {

using test::kHeight;
using test::kWidth;
using test::SmallScene;

[[nodiscard]] double mean_level(const Picture& picture, int x, int y, int reach = 0) {
    double sum = 0.0;
    for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
            for (int c = 0; c < 3; ++c) sum += picture.pixel(x + dx, y + dy)[c];
    return sum / (3.0 * (2 * reach + 1) * (2 * reach + 1));
}

TEST(Shaded, ShowsTheBodiesOnALightBackground) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    const auto picture = renderer->shaded(small.scene(), small.camera(), kWidth, kHeight);
    ASSERT_TRUE(picture.ok()) << picture.error().message;
    EXPECT_EQ(picture->width, kWidth);
    EXPECT_EQ(picture->height, kHeight);
    EXPECT_GT(mean_level(*picture, 4, 4), 200.0);
    const std::uint8_t* rod = picture->pixel(kWidth / 2, kHeight / 2);
    const std::uint8_t* vessel = picture->pixel(kWidth / 2, kHeight / 2 + 10); // beside the rod
    EXPECT_GT(rod[2] - rod[0], vessel[2] - vessel[0] + 60) << "the blue rod shines through two transparent walls";
    const std::uint8_t* organ = picture->pixel(kWidth / 2, kHeight / 4);
    EXPECT_GT(int{organ[0]}, int{organ[2]} + 10) << "the organ is red";
}

TEST(Shaded, ADrawnSceneGivesTheSameBytesAgain) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    const auto first = renderer->shaded(small.scene(), small.camera(), kWidth, kHeight);
    for (int i = 0; i < 3; ++i) {
        const auto again = renderer->shaded(small.scene(), small.camera(), kWidth, kHeight);
        ASSERT_TRUE(first.ok() && again.ok());
        EXPECT_EQ(first->rgb, again->rgb);
    }
}

TEST(Shaded, TransparencyDoesNotDependOnTheOrderOfTheBodies) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    RenderScene reversed = small.scene();
    std::reverse(reversed.surfaces.begin(), reversed.surfaces.end());
    const auto a = renderer->shaded(small.scene(), small.camera(), kWidth, kHeight);
    const auto b = renderer->shaded(reversed, small.camera(), kWidth, kHeight);
    ASSERT_TRUE(a.ok() && b.ok());
    EXPECT_EQ(a->rgb, b->rgb);
}

TEST(Shaded, EmphasisLetsARodShineThroughWhatLiesInFront) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    RenderScene scene = small.scene();
    const auto plain = renderer->shaded(scene, small.camera(), kWidth, kHeight);
    scene.surfaces[2].emphasis = 1.0;
    const auto emphasised = renderer->shaded(scene, small.camera(), kWidth, kHeight);
    scene.surfaces = {small.rod_surface()};
    const auto alone = renderer->shaded(scene, small.camera(), kWidth, kHeight);
    ASSERT_TRUE(plain.ok() && emphasised.ok() && alone.ok());
    const auto at = [](const Picture& p) { return p.pixel(kWidth / 2, kHeight / 2); };
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(at(*emphasised)[c], at(*alone)[c], 2);
    EXPECT_GT(std::abs(at(*plain)[0] - at(*alone)[0]), 10);
}

TEST(Shaded, TilesMeetWithoutASeam) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    const TriMesh wall = anatomy::make_box(Vec3(0.0, -0.08, 0.0), Vec3(0.4, 0.01, 0.4)); // hides the background's gradient
    RenderScene scene = small.scene();
    scene.scale_bar = false;
    scene.surfaces.push_back({.vertices = wall.vertices, .triangles = wall.triangles});
    Camera tall; // 512 x 1024: two tiles or more; its upper half fits one
    tall.eye = Vec3(0.0, 0.5, 0.0);
    tall.orthographic = true;
    tall.height = 0.16;
    Camera upper = tall;
    upper.height = 0.08;
    upper.eye.z() += 0.04;
    upper.look_at.z() += 0.04;
    Camera lower = upper;
    lower.eye.z() -= 0.08;
    lower.look_at.z() -= 0.08;
    const auto whole = renderer->shaded(scene, tall, 512, 1024);
    const auto top = renderer->shaded(scene, upper, 512, 512);
    const auto bottom = renderer->shaded(scene, lower, 512, 512);
    ASSERT_TRUE(whole.ok() && top.ok() && bottom.ok());
    Picture joined = *top;
    joined.height = 1024;
    joined.rgb.insert(joined.rgb.end(), bottom->rgb.begin(), bottom->rgb.end());
    EXPECT_LT(test::compare(*whole, joined).mean, 0.6) << "dither apart, the same picture";
    const std::size_t row = 3 * 512;
    double seam = 0.0; // the rows on both sides of the cut
    for (std::size_t i = 511 * row; i < 513 * row; ++i) seam += std::abs(int{whole->rgb[i]} - int{joined.rgb[i]});
    EXPECT_LT(seam / (2.0 * static_cast<double>(row)), 1.0);
}

TEST(Shaded, ManyLayersInOnePlaceAreAllThere) {
    REQUIRE_RENDERER(renderer);
    const TriMesh sheet = anatomy::make_box(Vec3::Zero(), Vec3(0.2, 0.0002, 0.2));
    std::vector<TriMesh> sheets(40, sheet);
    RenderScene scene;
    for (std::size_t i = 0; i < sheets.size(); ++i) {
        for (Vec3& v : sheets[i].vertices) v.y() += 0.001 * static_cast<double>(i);
        scene.surfaces.push_back(
            {.vertices = sheets[i].vertices, .triangles = sheets[i].triangles, .colour = Vec3(0.1, 0.1, 0.1), .opacity = 0.01});
    }
    const auto picture = renderer->shaded(scene, frame_camera(sheet.bounds(), {.aspect = 4.0 / 3.0, .margin = -0.2}), 64, 48);
    ASSERT_TRUE(picture.ok()) << picture.error().message;
    // 80 walls, half of them back walls that count 0.55: what is left of the background is (0.99 * 0.9945)^40
    const double left = std::pow(0.99 * 0.9945, 40.0);
    const double expected = 255.0 * std::pow(left * 0.97, 1.0 / 2.2);
    EXPECT_NEAR(mean_level(*picture, 32, 24, 2), expected, 30.0);
}

TEST(Shaded, BrokenGeometryIsLeftOutAndTheRestIsDrawn) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    TriMesh broken = small.rod;
    const double nan = std::numeric_limits<double>::quiet_NaN();
    broken.vertices.push_back(Vec3(nan, 0.0, 0.0));
    broken.triangles.push_back({0, 1, static_cast<Index>(broken.vertices.size() - 1)});
    broken.triangles.push_back({0, 1, kNoIndex});
    broken.triangles.push_back({2, 2, 2});
    RenderScene scene = small.scene();
    scene.surfaces[2].vertices = broken.vertices;
    scene.surfaces[2].triangles = broken.triangles;
    scene.markers.push_back({Vec3(nan, nan, nan), nan});
    scene.targets.push_back({.position = Vec3(0.0, nan, 0.0)});
    scene.colour_bar = false;
    const auto picture = renderer->shaded(scene, small.camera(), kWidth, kHeight);
    const auto clean = renderer->shaded(small.scene(), small.camera(), kWidth, kHeight);
    ASSERT_TRUE(picture.ok() && clean.ok());
    EXPECT_EQ(picture->rgb, clean->rgb);
    EXPECT_TRUE(renderer->shaded({}, small.camera(), kWidth, kHeight).ok());
    EXPECT_TRUE(renderer->fluoroscopy({}, small.camera(), kWidth, kHeight).ok());
}

TEST(Shaded, ASizeThatMakesNoSenseIsAnError) {
    REQUIRE_RENDERER(renderer);
    for (const int side : {-5, 0, 15, 8193}) {
        const auto picture = renderer->shaded({}, {}, side, 240);
        ASSERT_FALSE(picture.ok());
        EXPECT_EQ(picture.error().code, ErrorCode::BadValue);
        EXPECT_FALSE(renderer->fluoroscopy({}, {}, 240, side).ok());
    }
}

TEST(Shaded, AMarkerHasTheColourOfItsDepth) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    RenderScene scene = small.scene();
    scene.marker_range = 0.002;
    scene.colour_bar = false;
    for (const double share : {0.0, 0.5, 1.0, 7.0, -1.0}) {
        scene.markers = {{Vec3::Zero(), share * scene.marker_range}};
        const auto picture = renderer->shaded(scene, small.camera(), kWidth, kHeight);
        ASSERT_TRUE(picture.ok());
        const auto colour = depth_colour(share);
        for (std::size_t c = 0; c < 3; ++c)
            EXPECT_NEAR(picture->pixel(kWidth / 2, kHeight / 2)[c], 255.0 * colour[c], 1.0) << "share " << share;
    }
}

TEST(Shaded, TheColourBarEndsAtTheNextRoundDepth) {
    RenderScene scene;
    EXPECT_DOUBLE_EQ(find_marker_range(scene), 1e-3);
    const std::pair<double, double> expected[] = {{0.0004, 0.0005}, {0.0005, 0.0005}, {0.0011, 0.002}, {0.0099, 0.01}, {0.0, 0.001}};
    for (const auto& [deepest, range] : expected) {
        scene.markers = {{Vec3::Zero(), 0.0}, {Vec3::Zero(), deepest}};
        EXPECT_NEAR(find_marker_range(scene), range, 1e-12) << deepest;
    }
}

// Grey level without noise and offset at the picture's centre, where the vignette is 1.
[[nodiscard]] double transmitted(const Picture& picture) { return mean_level(picture, kWidth / 2, kHeight / 2, 6) / 255.0 - 0.02; }

TEST(Fluoroscopy, DarkensByBeerLambertWithTheSummedThickness) {
    REQUIRE_RENDERER(renderer);
    const Camera camera = frame_camera(std::array{Vec3(-0.05, -0.05, -0.05), Vec3(0.05, 0.05, 0.05)}, {.orthographic = true});
    const auto grey = [&](const std::vector<RenderSurface>& surfaces) {
        RenderScene scene;
        scene.surfaces = surfaces;
        const auto picture = renderer->fluoroscopy(scene, camera, kWidth, kHeight);
        EXPECT_TRUE(picture.ok());
        return transmitted(*picture);
    };
    const TriMesh slab = anatomy::make_box(Vec3(0.0, 0.01, 0.0), Vec3(0.06, 0.02, 0.06));
    const TriMesh other = anatomy::make_box(Vec3(0.0, -0.02, 0.0), Vec3(0.06, 0.01, 0.06));
    const RenderSurface a = {.vertices = slab.vertices, .triangles = slab.triangles, .attenuation = 20.0};
    const RenderSurface b = {.vertices = other.vertices, .triangles = other.triangles, .attenuation = 50.0};
    RenderSurface hidden = b;
    hidden.fluoro_thickness = false;
    const double open = grey({});
    EXPECT_GT(open, 0.7);
    EXPECT_NEAR(grey({a}) / open, std::exp(-20.0 * 0.02), 0.01);
    EXPECT_NEAR(grey({a, b}) / open, std::exp(-20.0 * 0.02 - 50.0 * 0.01), 0.01);
    EXPECT_NEAR(grey({a, hidden}) / open, std::exp(-20.0 * 0.02), 0.01);
}

TEST(Fluoroscopy, OnlyTheWallOfAHollowBodyCounts) {
    REQUIRE_RENDERER(renderer);
    TriMesh shell = anatomy::make_icosphere(Vec3::Zero(), 0.04, 5);
    const TriMesh cavity = anatomy::make_icosphere(Vec3::Zero(), 0.03, 5);
    const Index first = static_cast<Index>(shell.vertices.size());
    shell.vertices.insert(shell.vertices.end(), cavity.vertices.begin(), cavity.vertices.end());
    for (const Triangle& t : cavity.triangles) shell.triangles.push_back({first + t[0], first + t[2], first + t[1]});
    RenderScene scene;
    const Camera camera = frame_camera(shell.bounds(), {.aspect = 4.0 / 3.0});
    const auto open = renderer->fluoroscopy(scene, camera, kWidth, kHeight);
    scene.surfaces = {{.vertices = shell.vertices, .triangles = shell.triangles, .attenuation = 30.0}};
    const auto picture = renderer->fluoroscopy(scene, camera, kWidth, kHeight);
    ASSERT_TRUE(open.ok() && picture.ok());
    EXPECT_NEAR(transmitted(*picture) / transmitted(*open), std::exp(-30.0 * 0.02), 0.01);
}

TEST(Fluoroscopy, IsGreyAndTheRodIsItsDarkestPart) {
    REQUIRE_RENDERER(renderer);
    const SmallScene small;
    RenderScene scene = small.scene();
    scene.scale_bar = false;
    const auto picture = renderer->fluoroscopy(scene, small.camera(), kWidth, kHeight);
    ASSERT_TRUE(picture.ok());
    for (std::size_t i = 0; i < picture->rgb.size(); i += 3) {
        ASSERT_EQ(picture->rgb[i], picture->rgb[i + 1]);
        ASSERT_EQ(picture->rgb[i], picture->rgb[i + 2]);
    }
    const double rod = mean_level(*picture, kWidth / 2, kHeight / 2);
    const double organ = mean_level(*picture, kWidth / 2, kHeight / 4);
    EXPECT_LT(rod, 0.2 * organ);
    EXPECT_LT(organ, mean_level(*picture, 10, kHeight / 2));
}

} // namespace
} // namespace trocar::engine
