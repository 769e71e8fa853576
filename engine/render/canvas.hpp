// Private to engine/render: antialiased shapes and numbers painted over a finished picture. Coordinates are pixels from the
// top left corner, with pixel centres at one half.
#pragma once

#include "engine/render/picture.hpp"

#include <array>
#include <span>
#include <string_view>

namespace trocar::engine {

struct Ink {
    std::array<double, 3> colour; // sRGB, 0..1
    double opacity = 1.0;
};
struct PixelPoint {
    double x, y;
};

class Canvas {
public:
    explicit Canvas(Picture& picture) : picture_(picture) {}

    void fill_disc(PixelPoint centre, double radius, const Ink& ink);
    void draw_ring(PixelPoint centre, double radius, double line_width, const Ink& ink);
    void draw_line(PixelPoint from, PixelPoint to, double line_width, const Ink& ink);
    void fill_box(PixelPoint lo, PixelPoint hi, const Ink& ink);
    /// Full ink at the centre, none at `radius`.
    void fill_glow(PixelPoint centre, double radius, const Ink& ink);
    /// A shaded ball, lit from the upper left.
    void fill_ball(PixelPoint centre, double radius, const Ink& ink);

    /// Convex; corners in order, either way round.
    void fill_quad(const std::array<PixelPoint, 4>& corners, const Ink& ink);
    /// Digits, dot, minus, space and the letters m, A, F, H, L, P, R, drawn with strokes; others leave a gap. `at` is the left end of the
    /// base line. Returns nothing; text_width tells how wide it will be.
    void draw_text(PixelPoint at, double height, std::string_view text, const Ink& ink);
    /// One of these letters as a slanted surface shows it. across, down   from its middle: one height of a letter to the right and down
    void draw_letter(char letter, PixelPoint middle, PixelPoint across, PixelPoint down, double line_width, const Ink& ink);
    [[nodiscard]] static double text_width(double height, std::string_view text) noexcept;

private:
    template <class Coverage>
    void paint(PixelPoint lo, PixelPoint hi, const Ink& ink, Coverage&& coverage);
    Picture& picture_;
};

/// Colour of a share 0..1: dark violet, blue, green, yellow, perceptually uniform, also for red-blind readers.
/// source   the anchor colours are those of viridis (Smith & van der Walt 2015), joined by straight lines
[[nodiscard]] std::array<double, 3> depth_colour(double share) noexcept;

} // namespace trocar::engine
