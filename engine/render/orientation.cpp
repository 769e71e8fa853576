#include "engine/render/orientation.hpp"

#include "engine/render/canvas.hpp"
#include "engine/scene/patient_sides.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace trocar::engine {
namespace {

struct Side {
    char letter;
    Vec3 way, up; // up: of the letter on its face
};
const std::array<Side, 6> kSides{{{'R', Vec3::UnitX(), Vec3::UnitZ()},
                                  {'L', -Vec3::UnitX(), Vec3::UnitZ()},
                                  {'A', Vec3::UnitY(), Vec3::UnitZ()},
                                  {'P', -Vec3::UnitY(), Vec3::UnitZ()},
                                  {'H', Vec3::UnitZ(), -Vec3::UnitY()},
                                  {'F', -Vec3::UnitZ(), Vec3::UnitY()}}};
constexpr int kLeastEdge = 192;        // pixels, of a picture with a cube
constexpr double kHalf = 17.0, kReach = 37.0; // pixels at a height of 720: half of the cube's edge, the letters around it
constexpr double kFacing = 0.3;        // letters of sides that face the eye, or away from it, more than that are the cube's alone
constexpr double kNearEye = 0.02;
constexpr Ink kPale = {{1.0, 0.96, 0.80}, 1.0}, kDark = {{0.05, 0.07, 0.10}, 0.85};

void draw_outlined(Canvas& canvas, char letter, PixelPoint middle, double height) {
    const double line = std::max(1.3, 0.15 * height);
    canvas.draw_letter(letter, middle, {height, 0.0}, {0.0, height}, 2.6 * line, kDark);
    canvas.draw_letter(letter, middle, {height, 0.0}, {0.0, height}, line, kPale);
}

} // namespace

void draw_orientation_cube(const ViewAxes& axes, Picture& picture) {
    if (std::min(picture.width, picture.height) < kLeastEdge) return;
    Canvas canvas(picture);
    const double scale = std::max(0.75, std::min(picture.height / 720.0, picture.width / 960.0)), half = scale * kHalf;
    const PixelPoint middle{1.5 * scale * kReach, 1.5 * scale * kReach};
    const auto flat = [&](const Vec3& v) { return PixelPoint{v.dot(axes.right), -v.dot(axes.up)}; };
    const auto at = [&](const Vec3& v, double times) { return PixelPoint{middle.x + times * flat(v).x, middle.y + times * flat(v).y}; };
    for (const Side& side : kSides) {
        const double facing = -side.way.dot(axes.forward);
        if (facing > kNearEye) {
            const Vec3 across = side.up.cross(side.way);
            const std::array<PixelPoint, 4> corners{at(side.way - across - side.up, half), at(side.way + across - side.up, half),
                                                    at(side.way + across + side.up, half), at(side.way - across + side.up, half)};
            const double light = 0.35 + 0.45 * facing;
            canvas.fill_quad(corners, {{0.30 * light, 0.48 * light, 0.66 * light}, 1.0});
            for (std::size_t k = 0; k < 4; ++k) canvas.draw_line(corners[k], corners[(k + 1) % 4], 1.2 * scale, {{0.91, 0.93, 0.97}, 1.0});
            const double height = 1.25 * half;
            const PixelPoint to_right = flat(across), to_top = flat(side.up);
            canvas.draw_letter(side.letter, at(side.way, half), {height * to_right.x, height * to_right.y}, {-height * to_top.x, -height * to_top.y},
                               std::max(1.2, 0.13 * height), {{1.0, 1.0, 1.0}, 1.0});
        }
        if (std::abs(facing) <= kFacing) draw_outlined(canvas, side.letter, at(side.way, scale * kReach), 12.0 * scale);
    }
}

void draw_edge_letters(const ViewAxes& axes, Picture& picture) {
    Canvas canvas(picture);
    const double height = std::clamp(picture.height / 32.0, 7.0, 20.0), in = 1.4 * height, step = 0.95 * height;
    const auto write = [&](const Vec3& way, PixelPoint middle) {
        const std::string letters = side_letters(way);
        const double first = middle.x - 0.5 * step * static_cast<double>(letters.size() - 1);
        for (std::size_t k = 0; k < letters.size(); ++k) draw_outlined(canvas, letters[k], {first + step * static_cast<double>(k), middle.y}, height);
    };
    const double x = 0.5 * picture.width, y = 0.5 * picture.height;
    write(axes.up, {x, in}), write(-axes.up, {x, picture.height - in});
    write(-axes.right, {in, y}), write(axes.right, {picture.width - in, y});
}

} // namespace trocar::engine
