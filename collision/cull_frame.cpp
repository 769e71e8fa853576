#include "collision/cull_frame.hpp"

#include "collision/swept_box.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace seldinger::collision {
namespace {

/// Share of the picture and of the depth range that stays empty at the borders.
constexpr double kBorder = 0.002;

/// Rounding of p . x for a unit vector p, in units of the largest coordinate: three products, two sums, and the vector's own error.
constexpr double kProjectionError = 16.0 * 0x1p-53;

/// Single-precision evaluation of a + b u + c v for whole u <= w, v <= h: three roundings of the result, one of each coefficient, so
/// less than 5 units of 2^-24 (|a| + |b| w + |c| h), whether or not products are fused. Eight are allowed.
constexpr double kEvaluationError = 8.0 * 0x1p-24;

struct PicturePoint {
    double x, y, z; // pixels, pixels, depth
};

PicturePoint project(const CullFrame& f, const Vec3& p) noexcept {
    return {(f.view.right.dot(p) - f.left) * f.pixels_x, (f.view.up.dot(p) - f.bottom) * f.pixels_y,
            (f.view.forward.dot(p) - f.nearest) * f.depth_scale};
}

double slack(double a, double b, double c, int w, int h) noexcept {
    return kEvaluationError * (std::abs(a) + std::abs(b) * w + std::abs(c) * h);
}

/// Writes the half-plane with this outward normal that holds the whole prism; sound for any normal, tight for those of the hull.
void write_edge(float (&edge)[3], double a, double b, const std::array<PicturePoint, 6>& points, const Footprint& p, double grow_x,
                double grow_y) noexcept {
    const double length = std::abs(a) + std::abs(b);
    if (!(length > 0.0)) return;
    a /= length;
    b /= length;
    double support = -std::numeric_limits<double>::infinity();
    for (const PicturePoint& q : points) support = std::max(support, a * (q.x - p.x0) + b * (q.y - p.y0));
    support += std::sqrt(a * a * grow_x * grow_x + b * b * grow_y * grow_y); // of the ball, an ellipse in pixels
    // some point of the square [u, u + 1] x [v, v + 1] is inside: its corner against the normal is
    const double bound = support - std::min(a, 0.0) - std::min(b, 0.0);
    edge[0] = static_cast<float>(a);
    edge[1] = static_cast<float>(b);
    edge[2] = -round_down(-(bound + slack(bound, a, b, p.x1 - p.x0, p.y1 - p.y0)));
}

/// Edges of the hull of six points, by walking around it. Where rounding leads astray an edge is merely not the best one.
void write_edges(Footprint& p, const std::array<PicturePoint, 6>& points, double grow_x, double grow_y) noexcept {
    for (auto& edge : p.edge) edge[2] = 1.0f; // 0 <= 1: bounds nothing
    std::size_t start = 0;
    for (std::size_t k = 1; k < 6; ++k)
        if (points[k].x < points[start].x || (points[k].x == points[start].x && points[k].y < points[start].y)) start = k;
    std::size_t at = start;
    for (auto& edge : p.edge) {
        std::size_t next = at;
        double dx = 0.0, dy = 0.0;
        for (std::size_t k = 0; k < 6; ++k) {
            const double ex = points[k].x - points[at].x, ey = points[k].y - points[at].y;
            if (ex == 0.0 && ey == 0.0) continue;
            const double turn = dx * ey - dy * ex;
            const bool farther = ex * ex + ey * ey > dx * dx + dy * dy;
            if (next == at || turn < 0.0 || (turn == 0.0 && farther)) {
                next = k;
                dx = ex;
                dy = ey;
            }
        }
        if (next == at) return; // a point: the rectangle is all there is to know
        write_edge(edge, dy, -dx, points, p, grow_x, grow_y);
        at = next;
        if (points[at].x == points[start].x && points[at].y == points[start].y) return;
    }
}

/// Two planes along the mean normal, as depths over the rectangle, each taken at the corner of the pixel where it reaches farthest.
void write_planes(Footprint& p, const CullFrame& f, const SweptCorners& c, const std::array<PicturePoint, 6>& points) noexcept {
    const Vec3 normal = (c[1] - c[0] + c[4] - c[3]).cross(c[2] - c[0] + c[5] - c[3]);
    const double length = normal.norm();
    p.front[0] = -1.0f;
    p.back[0] = 2.0f;
    if (!(length > 0.0)) return;
    // n . x in picture units: a x + b y + g z
    const double a = f.view.right.dot(normal) / (length * f.pixels_x), b = f.view.up.dot(normal) / (length * f.pixels_y);
    const double g = f.view.forward.dot(normal) / (length * f.depth_scale);
    constexpr double kSteepest = 1e4; // depth ranges per pixel; beyond, nearest and farthest say more
    if (!(std::abs(a) + std::abs(b) < kSteepest * std::abs(g))) return;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const PicturePoint& q : points) {
        const double value = a * (q.x - p.x0) + b * (q.y - p.y0) + g * q.z;
        low = std::min(low, value);
        high = std::max(high, value);
    }
    const double grow = f.reach * (1.0 + 1e-9);
    const double first = (g > 0.0 ? low - grow : high + grow) / g, last = (g > 0.0 ? high + grow : low - grow) / g;
    const double slope_x = -a / g, slope_y = -b / g;
    const double front = first + std::min(slope_x, 0.0) + std::min(slope_y, 0.0),
                 back = last + std::max(slope_x, 0.0) + std::max(slope_y, 0.0);
    const int w = p.x1 - p.x0, h = p.y1 - p.y0;
    p.front[0] = round_down(front - slack(front, slope_x, slope_y, w, h) - 1e-12);
    p.back[0] = -round_down(-(back + slack(back, slope_x, slope_y, w, h) + 1e-12));
    p.front[1] = p.back[1] = static_cast<float>(slope_x);
    p.front[2] = p.back[2] = static_cast<float>(slope_y);
}

} // namespace

ViewDirection view_along_axis(int axis, bool reversed) noexcept {
    const Vec3 right = Vec3::Unit((axis + 1) % 3), up = Vec3::Unit((axis + 2) % 3), forward = Vec3::Unit(axis);
    return {right, up, reversed ? Vec3(-forward) : forward};
}

ViewDirection view_along(const Vec3& direction) noexcept {
    const Vec3 forward = direction.normalized();
    int least = 0;
    for (int axis = 1; axis < 3; ++axis)
        if (std::abs(forward[axis]) < std::abs(forward[least])) least = axis;
    const Vec3 right = forward.cross(Vec3::Unit(least)).normalized();
    return {right, forward.cross(right).normalized(), forward};
}

CullFrame make_cull_frame(const ViewDirection& view, std::span<const SweptCorners> prisms, double reach, int width, int height) noexcept {
    assert(width > 0 && height > 0 && width <= kLargestPicture && height <= kLargestPicture);
    Box3 seen; // in view coordinates
    double largest = 0.0;
    for (const SweptCorners& corners : prisms)
        for (const Vec3& p : corners) {
            seen.add(Vec3(view.right.dot(p), view.up.dot(p), view.forward.dot(p)));
            largest = std::max(largest, p.cwiseAbs().maxCoeff());
        }
    CullFrame f{.view = view, .width = width, .height = height};
    f.reach = reach + kProjectionError * largest;
    if (seen.empty()) return f;
    seen.inflate(f.reach);
    const Vec3 extent = seen.extent().cwiseMax(Vec3::Constant(std::max(1e-9 * seen.longest_edge(), 1e-30)));
    seen.lo -= kBorder * extent;
    f.left = seen.lo[0];
    f.bottom = seen.lo[1];
    f.nearest = seen.lo[2];
    f.pixels_x = width / (extent[0] * (1.0 + 2.0 * kBorder));
    f.pixels_y = height / (extent[1] * (1.0 + 2.0 * kBorder));
    f.depth_scale = 1.0 / (extent[2] * (1.0 + 2.0 * kBorder));
    return f;
}

Footprint make_footprint(const CullFrame& frame, const SweptCorners& corners) noexcept {
    // what the subtractions and products of project() round, in pixels: the projection itself is in frame.reach
    constexpr double kPixelError = 1e-9;
    const double grow_x = frame.reach * frame.pixels_x + kPixelError, grow_y = frame.reach * frame.pixels_y + kPixelError;
    const double grow_z = frame.reach * frame.depth_scale + kPixelError;
    std::array<PicturePoint, 6> points;
    PicturePoint low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (std::size_t k = 0; k < 6; ++k) {
        points[k] = project(frame, corners[k]);
        low = {std::min(low.x, points[k].x), std::min(low.y, points[k].y), std::min(low.z, points[k].z)};
        high = {std::max(high.x, points[k].x), std::max(high.y, points[k].y), std::max(high.z, points[k].z)};
    }
    const auto pixel = [](double x, int size) { return static_cast<std::int32_t>(std::clamp(std::floor(x), 0.0, size - 1.0)); };
    Footprint p;
    p.x0 = pixel(low.x - grow_x, frame.width);
    p.x1 = pixel(high.x + grow_x, frame.width) + 1;
    p.y0 = pixel(low.y - grow_y, frame.height);
    p.y1 = pixel(high.y + grow_y, frame.height) + 1;
    p.nearest = std::max(round_down(low.z - grow_z), 0.0f);
    p.farthest = std::min(-round_down(-(high.z + grow_z)), 0x1.fffffep-1f);
    write_edges(p, points, grow_x, grow_y);
    write_planes(p, frame, corners, points);
    return p;
}

} // namespace seldinger::collision
