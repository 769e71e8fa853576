// Letters and the cube of the patient's sides in pictures: they say what the camera sees, and lie where nothing else is changed.
#include "engine/render/orientation.hpp"

#include "engine/fluoroscopy/cone_beam.hpp"
#include "engine/report/lettered_frame.hpp"
#include "engine/scene/patient_sides.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace trocar::engine {
namespace {

TEST(Orientation, LettersAreThoseOfDicomsPatientOrientation) {
    EXPECT_EQ(side_letters(Vec3::UnitX()), "R");
    EXPECT_EQ(side_letters(-Vec3::UnitX()), "L");
    EXPECT_EQ(side_letters(Vec3::UnitY()), "A");
    EXPECT_EQ(side_letters(-Vec3::UnitY()), "P");
    EXPECT_EQ(side_letters(Vec3::UnitZ()), "H");
    EXPECT_EQ(side_letters(-Vec3::UnitZ()), "F");
    EXPECT_EQ(side_letters(Vec3(0.9, -0.436, 0.0)), "RP");
    EXPECT_EQ(side_letters(Vec3(0.98, -0.2, 0.0)), "R");
    EXPECT_EQ(side_letters(Vec3(1.0, 1.0, 0.0).normalized()), "RA"); // a tie: the first of R L A P H F
}

/// At 0/0 the patient's right is on the picture's left; LAO 90 looks at the patient's left side, the front on the picture's left.
TEST(Orientation, EdgesOfTheArmsPicturesAreTheConventions) {
    const auto edges = [](double primary, double secondary) {
        const ConeBeam beam = make_cone_beam(XrayView{}, {primary * std::numbers::pi / 180.0, secondary * std::numbers::pi / 180.0});
        return std::array<std::string, 4>{side_letters(-beam.right), side_letters(beam.right), side_letters(-beam.down), side_letters(beam.down)};
    };
    EXPECT_EQ(edges(0, 0), (std::array<std::string, 4>{"R", "L", "H", "F"}));
    EXPECT_EQ(edges(90, 0), (std::array<std::string, 4>{"A", "P", "H", "F"}));
    EXPECT_EQ(edges(-90, 0), (std::array<std::string, 4>{"P", "A", "H", "F"}));
    EXPECT_EQ(edges(30, 0), (std::array<std::string, 4>{"RA", "LP", "H", "F"}));
    EXPECT_EQ(edges(0, 30), (std::array<std::string, 4>{"R", "L", "HP", "FA"}));
}

TEST(Orientation, MarksLeaveTheMiddleOfAFrameAlone) {
    const ConeBeam beam = make_cone_beam(XrayView{}, {});
    for (const unsigned bits : {8u, 16u}) {
        GreyFrame frame{256, 256, bits, std::vector<std::uint16_t>(256 * 256)};
        for (std::size_t k = 0; k < frame.values.size(); ++k) frame.values[k] = static_cast<std::uint16_t>((k * 37) % (bits == 8 ? 256 : 65536));
        const GreyFrame lettered = lettered_frame(frame, beam);
        std::size_t changed = 0;
        for (unsigned y = 0; y < 256; ++y)
            for (unsigned x = 0; x < 256; ++x) {
                const bool same = lettered.values[y * 256 + x] == frame.values[y * 256 + x];
                changed += !same;
                const bool corner = x < 96 && y < 96, edge = x < 24 || y < 24 || x >= 232 || y >= 232;
                EXPECT_TRUE(same || corner || edge) << x << ", " << y;
            }
        EXPECT_GT(changed, 500u) << bits;
        EXPECT_LT(changed, 8000u) << bits;
    }
}

TEST(Orientation, TheCubeTurnsWithTheCamera) {
    const auto drawn = [](const Vec3& direction) {
        Picture picture{320, 240, std::vector<std::uint8_t>(320 * 240 * 3, 128)};
        draw_orientation_cube(make_view_axes(direction, Vec3::UnitZ()), picture);
        return picture.rgb;
    };
    EXPECT_NE(drawn(-Vec3::UnitY()), drawn(Vec3::UnitY()));
    EXPECT_NE(drawn(-Vec3::UnitY()), drawn(Vec3(-1, -1, 0).normalized()));
    EXPECT_EQ(drawn(-Vec3::UnitY()), drawn(-2.0 * Vec3::UnitY()));
    Picture small{100, 100, std::vector<std::uint8_t>(100 * 100 * 3, 128)};
    draw_orientation_cube(make_view_axes(-Vec3::UnitY(), Vec3::UnitZ()), small);
    EXPECT_EQ(small.rgb, std::vector<std::uint8_t>(100 * 100 * 3, 128));
}

} // namespace
} // namespace trocar::engine
