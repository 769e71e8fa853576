// Parts of pictures without a GPU: cameras, meshes with normals, shapes and numbers, PNG, shader texts.
#include "base/topology.hpp"
#include "engine/render/canvas.hpp"
#include "engine/render/picture.hpp"
#include "engine/render/program.hpp"
#include "engine/render/projection.hpp"
#include "engine/render/render_mesh.hpp"
#include "engine/render/shader_text.hpp"

#include "assets/anatomy/shapes.hpp"

#include <gmock/gmock.h>

#include <png.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

namespace trocar::engine {
namespace {

TEST(FrameCamera, ShowsEveryPointAndFillsThePictureToTheMargin) {
    const unsigned seed = 7;
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    for (int trial = 0; trial < 200; ++trial) {
        std::vector<Vec3> points(30);
        for (Vec3& p : points) p = Vec3(0.3 * uniform(random), 0.1 * uniform(random), 0.2 * uniform(random)) + Vec3(1.0, 2.0, -3.0);
        const Framing framing = {.direction = Vec3(uniform(random), uniform(random), uniform(random)),
                                 .up = Vec3(uniform(random), uniform(random), uniform(random)),
                                 .aspect = 1.5,
                                 .field_of_view_rad = 0.6,
                                 .orthographic = trial % 2 == 1,
                                 .margin = 0.1};
        Box3 bounds;
        for (const Vec3& p : points) bounds.add(p);
        const Projection view = make_projection(frame_camera(points, framing), bounds, 600, 400);
        Box3 seen;
        for (const Vec3& p : points) seen.add(view.to_pixel(p));
        const double tolerance = 0.5;
        EXPECT_GE(seen.lo.x(), 60.0 - tolerance) << "seed " << seed << " trial " << trial;
        EXPECT_LE(seen.hi.x(), 540.0 + tolerance) << "seed " << seed << " trial " << trial;
        EXPECT_GE(seen.lo.y(), 40.0 - tolerance) << "seed " << seed << " trial " << trial;
        EXPECT_LE(seen.hi.y(), 360.0 + tolerance) << "seed " << seed << " trial " << trial;
        EXPECT_GT(seen.lo.z(), 0.0);
        const double filled = std::max(seen.extent().x() / 480.0, seen.extent().y() / 320.0);
        EXPECT_NEAR(filled, 1.0, 0.02) << "seed " << seed << " trial " << trial;
    }
}

TEST(FrameCamera, WithNothingToShowOrNoDirectionStillGivesACamera) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Framing& framing : {Framing{}, Framing{.direction = Vec3::Zero()}, Framing{.direction = Vec3(nan, 0, 0)},
                                   Framing{.direction = Vec3::UnitZ(), .up = Vec3::UnitZ()}, Framing{.up = Vec3::Zero()}}) {
        for (const std::vector<Vec3>& points : {std::vector<Vec3>{}, {Vec3(nan, nan, nan)}, {Vec3(1, 2, 3)}}) {
            const Camera camera = frame_camera(points, framing);
            EXPECT_TRUE(is_finite(camera.eye) && is_finite(camera.look_at) && is_finite(camera.up));
            EXPECT_GT((camera.look_at - camera.eye).norm(), 0.0);
        }
    }
}

TEST(Projection, MatricesAndPixelsAgree) {
    for (const bool orthographic : {false, true}) {
        Box3 bounds;
        bounds.add(Vec3(-0.1, -0.2, -0.3));
        bounds.add(Vec3(0.4, 0.2, 0.3));
        const Projection view =
            make_projection(frame_camera(bounds, {.direction = Vec3(1, 2, -0.5), .orthographic = orthographic}), bounds, 300, 200);
        const Vec3 point(0.3, -0.1, 0.2);
        const Eigen::Vector3f relative = (point - view.origin).cast<float>();
        const Eigen::Vector4f clip = view.clip_from_view * (view.view_from_origin * relative.homogeneous());
        const Vec3 pixel = view.to_pixel(point);
        EXPECT_NEAR(150.0 * (1.0 + clip.x() / clip.w()), pixel.x(), 1e-3);
        EXPECT_NEAR(100.0 * (1.0 - clip.y() / clip.w()), pixel.y(), 1e-3);
        EXPECT_GT(clip.z() / clip.w(), 0.0F);
        EXPECT_LT(clip.z() / clip.w(), 1.0F);
    }
}

TEST(RenderMesh, ABallIsSmoothAndABoxKeepsItsEdges) {
    RenderMesh mesh;
    const TriMesh ball = anatomy::make_icosphere(Vec3(1.0, 0.0, 0.0), 0.1, 3);
    make_render_mesh(ball.vertices, ball.triangles, Vec3(1.0, 0.0, 0.0), mesh);
    EXPECT_EQ(mesh.vertices.size(), ball.vertices.size());
    EXPECT_EQ(mesh.indices.size(), 3 * ball.triangles.size());
    for (const RenderVertex& v : mesh.vertices)
        for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(v.normal[axis], v.position[axis] / 0.1F, 0.02F);

    const TriMesh box = anatomy::make_box(Vec3::Zero(), Vec3(1.0, 1.0, 1.0));
    make_render_mesh(box.vertices, box.triangles, Vec3::Zero(), mesh);
    for (const Index i : mesh.indices) {
        const RenderVertex& v = mesh.vertices[i];
        const float largest = std::max({std::abs(v.normal[0]), std::abs(v.normal[1]), std::abs(v.normal[2])});
        EXPECT_NEAR(largest, 1.0F, 1e-6F) << "a corner of a box has its face's normal";
    }
}

TEST(TubeMesh, IsClosedOrientedAndAsThickAsAskedFor) {
    std::vector<Vec3> points;
    for (int i = 0; i <= 100; ++i) points.emplace_back(0.1 * std::cos(0.03 * i), 0.1 * std::sin(0.03 * i), 0.001 * i);
    const std::array<double, 1> radius = {0.004};
    const TriMesh tube = make_tube_mesh(points, radius);
    const SurfaceReport report = inspect_surface(tube);
    EXPECT_TRUE(report.closed() && report.manifold() && report.oriented());
    double length = 0.0;
    for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
    const double volume = std::numbers::pi * 0.004 * 0.004 * (length + 4.0 / 3.0 * 0.004);
    EXPECT_NEAR(report.signed_volume / volume, 1.0, 0.03);
}

TEST(TubeMesh, LeavesOutWhatCannotBeATube) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const std::array<double, 1> radius = {0.1};
    EXPECT_TRUE(make_tube_mesh({}, radius).triangles.empty());
    EXPECT_TRUE(make_tube_mesh(std::array{Vec3(0, 0, 0), Vec3(0, 0, 0)}, radius).triangles.empty());
    EXPECT_TRUE(make_tube_mesh(std::array{Vec3(0, 0, 0), Vec3(0, 0, 1)}, {}).triangles.empty());
    const TriMesh tube = make_tube_mesh(std::array{Vec3(0, 0, 0), Vec3(nan, 0, 0), Vec3(0, 0, 1), Vec3(0, 0, 1)}, radius);
    EXPECT_TRUE(inspect_surface(tube).closed());
}

[[nodiscard]] Picture make_gradient() {
    Picture picture{37, 21, std::vector<std::uint8_t>(3 * 37 * 21)};
    for (std::size_t i = 0; i < picture.rgb.size(); ++i) picture.rgb[i] = static_cast<std::uint8_t>(i * 7);
    return picture;
}

TEST(Png, ReadsBackAsItWasWritten) {
    const Picture picture = make_gradient();
    const auto bytes = encode_png(picture);
    ASSERT_TRUE(bytes.ok());
    png_image image = {};
    image.version = PNG_IMAGE_VERSION;
    ASSERT_NE(png_image_begin_read_from_memory(&image, bytes->data(), bytes->size()), 0);
    image.format = PNG_FORMAT_RGB;
    std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(image));
    ASSERT_NE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr), 0);
    EXPECT_EQ(image.width, 37U);
    EXPECT_EQ(image.height, 21U);
    EXPECT_EQ(rgb, picture.rgb);
}

TEST(Png, AFileEndsCompleteOrIsNotThere) {
    const auto folder = std::filesystem::temp_directory_path() / "trocar_gpu_picture_test";
    std::filesystem::create_directories(folder);
    const auto path = folder / "picture.png";
    ASSERT_TRUE(write_png(path, make_gradient()).ok());
    EXPECT_GT(std::filesystem::file_size(path), 100U);
    const auto missing = write_png(folder / "no" / "such" / "folder.png", make_gradient());
    ASSERT_FALSE(missing.ok());
    EXPECT_EQ(missing.error().code, ErrorCode::CannotWrite);
    Picture torn = make_gradient();
    torn.rgb.pop_back();
    EXPECT_EQ(write_png(path, torn).error().code, ErrorCode::BadValue);
    EXPECT_FALSE(encode_png(Picture{}).ok());
    std::filesystem::remove_all(folder);
}

TEST(Canvas, ClipsShapesAtTheBorderAndIgnoresNonFiniteOnes) {
    Picture picture{20, 20, std::vector<std::uint8_t>(3 * 20 * 20, 255)};
    Canvas canvas(picture);
    const Ink ink = {{0.0, 0.0, 0.0}, 1.0};
    const double nan = std::numeric_limits<double>::quiet_NaN();
    canvas.fill_disc({nan, 3.0}, 4.0, ink);
    canvas.fill_disc({3.0, 3.0}, nan, ink);
    canvas.fill_disc({-1e300, 1e300}, 2.0, ink);
    canvas.draw_text({-50.0, 500.0}, 10.0, "12.5 mm", ink);
    EXPECT_THAT(picture.rgb, testing::Each(255));
    canvas.fill_disc({0.0, 0.0}, 5.0, ink);
    EXPECT_EQ(picture.pixel(0, 0)[0], 0);
    EXPECT_EQ(picture.pixel(9, 9)[0], 255);
}

TEST(Canvas, TextIsAsWideAsPromised) {
    Picture picture{200, 40, std::vector<std::uint8_t>(3 * 200 * 40, 255)};
    Canvas canvas(picture);
    canvas.draw_text({10.0, 30.0}, 20.0, "0.25 mm", {{0.0, 0.0, 0.0}, 1.0});
    int last = 0;
    for (int y = 0; y < 40; ++y)
        for (int x = 0; x < 200; ++x)
            if (picture.pixel(x, y)[0] < 128) last = std::max(last, x);
    EXPECT_NEAR(last, 10.0 + Canvas::text_width(20.0, "0.25 mm"), 3.0);
    EXPECT_EQ(Canvas::text_width(20.0, ""), 0.0);
}

TEST(DepthColour, GrowsBrighterWithDepthAndStaysInRange) {
    double before = -1.0;
    for (int i = 0; i <= 50; ++i) {
        const auto c = depth_colour(i / 50.0);
        const double brightness = 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2];
        EXPECT_GT(brightness, before);
        before = brightness;
    }
    EXPECT_EQ(depth_colour(-3.0), depth_colour(0.0));
    EXPECT_EQ(depth_colour(9.0), depth_colour(1.0));
    EXPECT_EQ(depth_colour(std::numeric_limits<double>::quiet_NaN()), depth_colour(0.0));
}

TEST(Shaders, AreEmbeddedAndTheirIncludesReplaced) {
    EXPECT_GE(shader_texts().size(), 10U);
    for (const ShaderText& shader : shader_texts()) {
        const auto text = assemble_shader(shader.name);
        ASSERT_TRUE(text.ok()) << text.error().message;
        EXPECT_THAT(*text, testing::StartsWith("#version 450 core\n"));
        EXPECT_THAT(*text, testing::Not(testing::HasSubstr("#include")));
    }
    const auto unknown = assemble_shader("no_such.glsl");
    ASSERT_FALSE(unknown.ok());
    EXPECT_THAT(unknown.error().message, testing::HasSubstr("no_such.glsl"));
}

} // namespace
} // namespace trocar::engine
