#include "engine/render/canvas.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

// Strokes on a grid 6 wide and 10 high, y downwards, base line at 10.
constexpr PixelPoint kLift = {-1.0, -1.0}; // pen up
constexpr PixelPoint kZero[] = {{3, 0},     {4.9, .8}, {6, 3.2}, {6, 6.8},  {4.9, 9.2}, {3, 10},
                                {1.1, 9.2}, {0, 6.8},  {0, 3.2}, {1.1, .8}, {3, 0}};
constexpr PixelPoint kOne[] = {{1, 2}, {3.4, 0}, {3.4, 10}};
constexpr PixelPoint kTwo[] = {{.1, 2.6}, {.9, .8}, {3, 0}, {5.1, .8}, {5.8, 2.6}, {5.1, 4.6}, {0, 10}, {6, 10}};
constexpr PixelPoint kThree[] = {{.3, 1.8},  {1.2, .4}, {3, 0},     {5, .6}, {5.6, 2.4}, {5, 4.1}, {2.6, 4.7},
                                 {5.1, 5.4}, {6, 7.3},  {5.1, 9.3}, {3, 10}, {1, 9.5},   {0, 8}};
constexpr PixelPoint kFour[] = {{4.6, 10}, {4.6, 0}, {0, 7}, {6.4, 7}};
constexpr PixelPoint kFive[] = {{5.4, 0}, {.9, 0}, {.4, 4.6}, {2.8, 3.7}, {5, 4.5}, {6, 6.8}, {5.1, 9.2}, {3, 10}, {1, 9.5}, {0, 8.2}};
constexpr PixelPoint kSix[] = {{5.3, .8}, {3.3, 0}, {1.2, 1.2}, {.1, 4.6}, {0, 6.9}, {1, 9.3}, {3, 10},
                               {5, 9.3},  {6, 6.9}, {5, 4.7},   {3, 4},    {1, 4.8}, {0, 6.9}};
constexpr PixelPoint kSeven[] = {{0, 0}, {6, 0}, {2, 10}};
constexpr PixelPoint kEight[] = {{3, 4.7},   {1.1, 4}, {.4, 2.3},  {1.1, .6}, {3, 0},    {4.9, .6}, {5.6, 2.3}, {4.9, 4}, {3, 4.7},
                                 {5.2, 5.5}, {6, 7.3}, {5.2, 9.3}, {3, 10},   {.8, 9.3}, {0, 7.3},  {.8, 5.5},  {3, 4.7}};
constexpr PixelPoint kNine[] = {{.7, 9.2}, {2.7, 10}, {4.8, 8.8}, {5.9, 5.4}, {6, 3.1}, {5, .7}, {3, 0},
                                {1, .7},   {0, 3.1},  {1, 5.3},   {3, 6},     {5, 5.2}, {6, 3.1}};
constexpr PixelPoint kDot[] = {{.6, 9.9}, {.6, 10}};
constexpr PixelPoint kMinus[] = {{.5, 5.5}, {5.5, 5.5}};
constexpr PixelPoint kM[] = {{0, 10}, {0, 3.6}, kLift,    {0, 5.6}, {1.2, 4},   {2.8, 3.7}, {3.8, 4.6}, {4, 6},
                             {4, 10}, kLift,    {4, 5.6}, {5.2, 4}, {6.8, 3.7}, {7.8, 4.6}, {8, 6},     {8, 10}};

constexpr PixelPoint kA[] = {{0, 10}, {3, 0}, {6, 10}, kLift, {1.2, 6.4}, {4.8, 6.4}};
constexpr PixelPoint kF[] = {{5.6, 0}, {0, 0}, {0, 10}, kLift, {0, 4.8}, {4.6, 4.8}};
constexpr PixelPoint kH[] = {{0, 0}, {0, 10}, kLift, {6, 0}, {6, 10}, kLift, {0, 5}, {6, 5}};
constexpr PixelPoint kL[] = {{.4, 0}, {.4, 10}, {5.8, 10}};
constexpr PixelPoint kP[] = {{0, 10}, {0, 0}, {3.6, 0}, {5.4, .8}, {6, 2.6}, {5.4, 4.4}, {3.6, 5.2}, {0, 5.2}};
constexpr PixelPoint kR[] = {{0, 10}, {0, 0}, {3.6, 0}, {5.4, .8}, {6, 2.6}, {5.4, 4.4}, {3.6, 5.2}, {0, 5.2}, kLift, {3.2, 5.2}, {6, 10}};

struct Glyph {
    char letter;
    double width;
    std::span<const PixelPoint> strokes;
};
constexpr Glyph kGlyphs[] = {{'0', 6, kZero},  {'1', 6, kOne},   {'2', 6, kTwo},   {'3', 6, kThree}, {'4', 6, kFour},
                             {'5', 6, kFive},  {'6', 6, kSix},   {'7', 6, kSeven}, {'8', 6, kEight}, {'9', 6, kNine},
                             {'.', 1.2, kDot}, {'-', 6, kMinus}, {'m', 8, kM},     {'A', 6, kA},
                             {'F', 6, kF},     {'H', 6, kH},     {'L', 6, kL},   {'P', 6, kP},     {'R', 6, kR}};
constexpr double kGlyphHeight = 10.0;
constexpr double kGlyphGap = 2.6;
constexpr double kSpaceWidth = 2.0;

[[nodiscard]] const Glyph* find_glyph(char letter) noexcept {
    const Glyph* glyph = std::find_if(std::begin(kGlyphs), std::end(kGlyphs), [&](const Glyph& g) { return g.letter == letter; });
    return glyph != std::end(kGlyphs) ? glyph : nullptr;
}

[[nodiscard]] double segment_distance(PixelPoint p, PixelPoint a, PixelPoint b) noexcept {
    const double ux = b.x - a.x;
    const double uy = b.y - a.y;
    const double length_sq = ux * ux + uy * uy;
    const double t = length_sq > 0.0 ? std::clamp(((p.x - a.x) * ux + (p.y - a.y) * uy) / length_sq, 0.0, 1.0) : 0.0;
    return std::hypot(p.x - a.x - t * ux, p.y - a.y - t * uy);
}

// Share of a pixel that lies inside an edge at this signed distance (negative: inside).
[[nodiscard]] double inside_share(double distance) noexcept { return std::clamp(0.5 - distance, 0.0, 1.0); }

} // namespace

template <class Coverage>
void Canvas::paint(PixelPoint lo, PixelPoint hi, const Ink& ink, Coverage&& coverage) {
    const bool seen = lo.x < picture_.width && lo.y < picture_.height && hi.x > 0.0 && hi.y > 0.0; // false for NaN
    if (!seen) return;
    const int x0 = static_cast<int>(std::max(0.0, lo.x - 1.0));
    const int y0 = static_cast<int>(std::max(0.0, lo.y - 1.0));
    const int x1 = static_cast<int>(std::min<double>(picture_.width - 1, hi.x + 1.0));
    const int y1 = static_cast<int>(std::min<double>(picture_.height - 1, hi.y + 1.0));
    for (int y = y0; y <= y1; ++y)
        for (int x = x0; x <= x1; ++x) {
            double light = 0.0; // added to the ink: what a ball's shading needs
            const double alpha = ink.opacity * coverage(PixelPoint{x + 0.5, y + 0.5}, light);
            if (alpha <= 0.0) continue;
            std::uint8_t* pixel = picture_.pixel(x, y);
            for (std::size_t c = 0; c < 3; ++c) {
                const double colour = 255.0 * std::clamp(ink.colour[c] + light, 0.0, 1.0);
                pixel[c] = static_cast<std::uint8_t>(std::lround(pixel[c] + alpha * (colour - pixel[c])));
            }
        }
}

void Canvas::fill_disc(PixelPoint centre, double radius, const Ink& ink) {
    paint({centre.x - radius, centre.y - radius}, {centre.x + radius, centre.y + radius}, ink,
          [&](PixelPoint p, double&) { return inside_share(std::hypot(p.x - centre.x, p.y - centre.y) - radius); });
}

void Canvas::draw_ring(PixelPoint centre, double radius, double line_width, const Ink& ink) {
    const double reach = radius + line_width;
    paint({centre.x - reach, centre.y - reach}, {centre.x + reach, centre.y + reach}, ink, [&](PixelPoint p, double&) {
        return inside_share(std::abs(std::hypot(p.x - centre.x, p.y - centre.y) - radius) - 0.5 * line_width);
    });
}

void Canvas::draw_line(PixelPoint from, PixelPoint to, double line_width, const Ink& ink) {
    const double reach = line_width;
    paint({std::min(from.x, to.x) - reach, std::min(from.y, to.y) - reach},
          {std::max(from.x, to.x) + reach, std::max(from.y, to.y) + reach}, ink,
          [&](PixelPoint p, double&) { return inside_share(segment_distance(p, from, to) - 0.5 * line_width); });
}

void Canvas::fill_box(PixelPoint lo, PixelPoint hi, const Ink& ink) {
    paint(lo, hi, ink, [&](PixelPoint p, double&) {
        const double x = std::clamp(std::min(p.x - lo.x, hi.x - p.x) + 0.5, 0.0, 1.0);
        const double y = std::clamp(std::min(p.y - lo.y, hi.y - p.y) + 0.5, 0.0, 1.0);
        return x * y;
    });
}

void Canvas::fill_glow(PixelPoint centre, double radius, const Ink& ink) {
    paint({centre.x - radius, centre.y - radius}, {centre.x + radius, centre.y + radius}, ink, [&](PixelPoint p, double&) {
        const double share = std::max(0.0, 1.0 - std::hypot(p.x - centre.x, p.y - centre.y) / radius);
        return share * share * (3.0 - 2.0 * share);
    });
}

void Canvas::fill_ball(PixelPoint centre, double radius, const Ink& ink) {
    paint({centre.x - radius, centre.y - radius}, {centre.x + radius, centre.y + radius}, ink, [&](PixelPoint p, double& light) {
        const double x = (p.x - centre.x) / radius;
        const double y = (p.y - centre.y) / radius;
        const double z = std::sqrt(std::max(0.0, 1.0 - x * x - y * y));
        const double facing = std::max(0.0, -0.5 * x - 0.6 * y + 0.62 * z);
        light = 0.28 * (facing - 0.6) + 0.55 * std::pow(facing, 18.0);
        return inside_share(std::hypot(p.x - centre.x, p.y - centre.y) - radius);
    });
}

void Canvas::fill_quad(const std::array<PixelPoint, 4>& corners, const Ink& ink) {
    PixelPoint lo = corners[0], hi = corners[0];
    double area = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
        const PixelPoint a = corners[k], b = corners[(k + 1) % 4];
        lo = {std::min(lo.x, a.x), std::min(lo.y, a.y)};
        hi = {std::max(hi.x, a.x), std::max(hi.y, a.y)};
        area += a.x * b.y - b.x * a.y;
    }
    const double side = area < 0.0 ? -1.0 : 1.0;
    paint(lo, hi, ink, [&](PixelPoint p, double&) {
        double outside = -1e9; // signed distance to the nearest edge's line
        for (std::size_t k = 0; k < 4; ++k) {
            const PixelPoint a = corners[k], b = corners[(k + 1) % 4];
            const double length = std::hypot(b.x - a.x, b.y - a.y);
            if (length > 0.0) outside = std::max(outside, -side * ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x)) / length);
        }
        return inside_share(outside);
    });
}

void Canvas::draw_letter(char letter, PixelPoint middle, PixelPoint across, PixelPoint down, double line_width, const Ink& ink) {
    const Glyph* glyph = find_glyph(letter);
    if (glyph == nullptr) return;
    const auto place = [&](PixelPoint g) {
        const double x = (g.x - 0.5 * glyph->width) / kGlyphHeight, y = g.y / kGlyphHeight - 0.5;
        return PixelPoint{middle.x + x * across.x + y * down.x, middle.y + x * across.y + y * down.y};
    };
    const double reach = 0.5 * (std::hypot(across.x, across.y) + std::hypot(down.x, down.y)) + line_width;
    paint({middle.x - reach, middle.y - reach}, {middle.x + reach, middle.y + reach}, ink, [&](PixelPoint p, double&) {
        double nearest = 1e9;
        for (std::size_t i = 0; i + 1 < glyph->strokes.size(); ++i) {
            const PixelPoint a = glyph->strokes[i], b = glyph->strokes[i + 1];
            if (a.x < -0.5 || b.x < -0.5) continue; // pen up
            nearest = std::min(nearest, segment_distance(p, place(a), place(b)));
        }
        return inside_share(nearest - 0.5 * line_width);
    });
}

void Canvas::draw_text(PixelPoint at, double height, std::string_view text, const Ink& ink) {
    const double scale = height / kGlyphHeight;
    const double line_width = std::max(1.2, 1.35 * scale);
    for (const char letter : text) {
        const Glyph* glyph = find_glyph(letter);
        // the strokes of a glyph are one shape: painting them one by one would darken where they meet
        const double width = glyph != nullptr ? glyph->width : kSpaceWidth;
        if (glyph != nullptr)
            paint({at.x - line_width, at.y - height - line_width}, {at.x + scale * width + line_width, at.y + line_width}, ink,
                  [&](PixelPoint p, double&) {
                      const auto place = [&](PixelPoint g) { return PixelPoint{at.x + scale * g.x, at.y + scale * (g.y - kGlyphHeight)}; };
                      double nearest = 1e9;
                      for (std::size_t i = 0; i + 1 < glyph->strokes.size(); ++i) {
                          const PixelPoint a = glyph->strokes[i];
                          const PixelPoint b = glyph->strokes[i + 1];
                          if (a.x < -0.5 || b.x < -0.5) continue; // pen up
                          nearest = std::min(nearest, segment_distance(p, place(a), place(b)));
                      }
                      return inside_share(nearest - 0.5 * line_width);
                  });
        at.x += scale * (width + kGlyphGap);
    }
}

double Canvas::text_width(double height, std::string_view text) noexcept {
    double width = 0.0;
    for (const char letter : text) {
        const Glyph* glyph = find_glyph(letter);
        width += (glyph != nullptr ? glyph->width : kSpaceWidth) + kGlyphGap;
    }
    return text.empty() ? 0.0 : (width - kGlyphGap) * height / kGlyphHeight;
}

std::array<double, 3> depth_colour(double share) noexcept {
    constexpr std::array<std::array<double, 3>, 9> kAnchors = {{{0.267, 0.005, 0.329},
                                                                {0.279, 0.175, 0.483},
                                                                {0.230, 0.322, 0.546},
                                                                {0.173, 0.449, 0.558},
                                                                {0.128, 0.567, 0.551},
                                                                {0.158, 0.684, 0.502},
                                                                {0.369, 0.789, 0.383},
                                                                {0.678, 0.864, 0.190},
                                                                {0.993, 0.906, 0.144}}};
    const double at = (share > 0.0 ? std::min(share, 1.0) : 0.0) * (kAnchors.size() - 1);
    const std::size_t low = std::min(static_cast<std::size_t>(at), kAnchors.size() - 2);
    std::array<double, 3> colour;
    for (std::size_t c = 0; c < 3; ++c)
        colour[c] = kAnchors[low][c] + (at - static_cast<double>(low)) * (kAnchors[low + 1][c] - kAnchors[low][c]);
    return colour;
}

} // namespace trocar::engine
