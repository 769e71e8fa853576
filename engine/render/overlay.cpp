#include "engine/render/overlay.hpp"

#include "engine/render/canvas.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace trocar::engine {
namespace {

constexpr Ink kDarkInk = {{0.16, 0.19, 0.23}, 0.92};
constexpr double kReferenceHeight = 720.0; // line widths and text are given for this picture height

// The largest of 1, 2, 5 times a power of ten that is not above `value`. value > 0.
[[nodiscard]] double round_down(double value) noexcept {
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    for (const double factor : {5.0, 2.0})
        if (factor * power <= value * (1.0 + 1e-9)) return factor * power;
    return power;
}

[[nodiscard]] double round_up(double value) noexcept {
    const double below = round_down(value);
    if (below >= value * (1.0 - 1e-9)) return below;
    return round_down(below * 2.6); // 1 -> 2, 2 -> 5, 5 -> 10
}

[[nodiscard]] std::string millimetres(double metres) { return fmt::format("{:g} mm", 1000.0 * metres); }

[[nodiscard]] double picture_scale(const Picture& picture) noexcept {
    return std::max(0.75, std::min(picture.height / kReferenceHeight, picture.width / 960.0));
}

struct Placed {
    PixelPoint at;
    double distance;
    double pixel_size;
    bool visible;
};

[[nodiscard]] Placed place(const Projection& view, const Vec3& point) noexcept {
    const Vec3 pixel = view.to_pixel(point);
    const double size = view.pixel_size(pixel.z());
    return {{pixel.x(), pixel.y()}, pixel.z(), size, size > 0.0 && is_finite(pixel)};
}

[[nodiscard]] Ink make_ink(const Vec3& colour, double opacity) { return {{colour.x(), colour.y(), colour.z()}, opacity}; }

} // namespace

double find_marker_range(const RenderScene& scene) noexcept {
    if (scene.marker_range > 0.0) return scene.marker_range;
    double deepest = 0.0;
    for (const RenderMarker& marker : scene.markers)
        if (std::isfinite(marker.depth)) deepest = std::max(deepest, marker.depth);
    return deepest > 1e-9 ? round_up(deepest) : 1e-3;
}

void draw_targets(const RenderScene& scene, const Projection& view, Picture& picture) {
    Canvas canvas(picture);
    const double scale = picture_scale(picture);
    for (const RenderTarget& target : scene.targets) {
        const Placed placed = place(view, target.position);
        if (!placed.visible) continue;
        const double radius = std::max(target.radius / placed.pixel_size, 4.0 * scale);
        canvas.fill_glow(placed.at, 3.2 * radius + 6.0 * scale, make_ink(target.colour, 0.70));
        canvas.fill_disc(placed.at, radius + 1.1 * scale, {{1.0, 1.0, 1.0}, 0.90});
        canvas.fill_ball(placed.at, radius, make_ink(target.colour, 1.0));
    }
}

void draw_target_rings(const RenderScene& scene, const Projection& view, Picture& picture) {
    Canvas canvas(picture);
    const double scale = picture_scale(picture);
    for (const RenderTarget& target : scene.targets) {
        const Placed placed = place(view, target.position);
        if (!placed.visible) continue;
        const double radius = std::max(1.8 * target.radius / placed.pixel_size, 9.0 * scale);
        canvas.draw_ring(placed.at, radius, 2.0 * scale, make_ink(target.colour, 0.95));
    }
}

void draw_markers(const RenderScene& scene, const Projection& view, Picture& picture) {
    std::vector<Placed> placed;
    placed.reserve(scene.markers.size());
    for (const RenderMarker& marker : scene.markers) placed.push_back(place(view, marker.position));
    std::vector<std::size_t> order(placed.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::erase_if(order, [&](std::size_t i) { return !placed[i].visible; });
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return placed[a].distance > placed[b].distance; });

    Canvas canvas(picture);
    const double scale = picture_scale(picture);
    const double radius = scene.marker_radius_px * scale;
    const double range = find_marker_range(scene);
    for (const std::size_t i : order) {
        const PixelPoint at = placed[i].at;
        canvas.fill_glow({at.x, at.y + 0.8 * scale}, radius + 3.5 * scale, {{0.05, 0.05, 0.08}, 0.55});
        canvas.fill_disc(at, radius + 1.2 * scale, {{1.0, 1.0, 1.0}, 0.95});
        canvas.fill_disc(at, radius, {depth_colour(scene.markers[i].depth / range), 1.0});
    }
}

void draw_colour_bar(const RenderScene& scene, Picture& picture) {
    constexpr int kTicks = 5;
    Canvas canvas(picture);
    const double scale = picture_scale(picture);
    const double range = find_marker_range(scene);
    const double text = 11.0 * scale;
    const double length = 170.0 * scale;
    const double width = 11.0 * scale;
    const double text_width = std::max(Canvas::text_width(text, millimetres(range)), Canvas::text_width(text, millimetres(0.5 * range)));
    const double right = picture.width - 28.0 * scale - text_width;
    const PixelPoint lo = {right - width - 8.0 * scale, picture.height - 32.0 * scale - length};
    canvas.fill_box({lo.x - 12.0 * scale, lo.y - 14.0 * scale}, {right + text_width + 12.0 * scale, lo.y + length + 14.0 * scale},
                    {{1.0, 1.0, 1.0}, 0.55});
    canvas.fill_box({lo.x - scale, lo.y - scale}, {lo.x + width + scale, lo.y + length + scale}, kDarkInk);
    const int rows = std::max(1, static_cast<int>(length));
    for (int row = 0; row < rows; ++row) {
        const double top = lo.y + length * row / rows;
        canvas.fill_box({lo.x, top}, {lo.x + width, top + length / rows}, {depth_colour(1.0 - (row + 0.5) / rows), 1.0});
    }
    for (int tick = 0; tick < kTicks; ++tick) {
        const double share = static_cast<double>(tick) / (kTicks - 1);
        const double y = lo.y + length * (1.0 - share);
        canvas.draw_line({lo.x + width + scale, y}, {lo.x + width + 5.0 * scale, y}, 1.3 * scale, kDarkInk);
        if (tick % 2 == 0) canvas.draw_text({right + scale, y + 0.5 * text}, text, tick == 0 ? "0" : millimetres(share * range), kDarkInk);
    }
}

void draw_scale_bar(const Projection& view, double distance, Picture& picture) {
    const double pixel = view.pixel_size(distance);
    if (!(pixel > 0.0) || !std::isfinite(pixel)) return;
    Canvas canvas(picture);
    const double scale = picture_scale(picture);
    const double length = round_down(0.22 * picture.width * pixel);
    const PixelPoint left = {28.0 * scale, picture.height - 28.0 * scale};
    const PixelPoint right = {left.x + length / pixel, left.y};
    canvas.draw_line(left, right, 2.2 * scale, kDarkInk);
    for (const double x : {left.x, right.x}) canvas.draw_line({x, left.y - 4.0 * scale}, {x, left.y + 4.0 * scale}, 2.2 * scale, kDarkInk);
    const double text = 11.0 * scale;
    const std::string label = millimetres(length);
    canvas.draw_text({0.5 * (left.x + right.x - Canvas::text_width(text, label)), left.y - 8.0 * scale}, text, label, kDarkInk);
}

} // namespace trocar::engine
