#include "collision/culling/cull_frame.hpp"

#include "collision/swept_box.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::collision {
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

/// Outward normal of a half-plane, |a| + |b| = 1; false: there is none.
bool scale_normal(double& a, double& b) noexcept {
    const double length = std::abs(a) + std::abs(b);
    if (!(length > 0.0)) return false;
    a /= length;
    b /= length;
    return true;
}

/// support   largest a (x - x0) + b (y - y0) of the points
void write_edge(float (&edge)[3], double a, double b, double support, const Footprint& p, double grow_x, double grow_y) noexcept {
    support += std::sqrt(a * a * grow_x * grow_x + b * b * grow_y * grow_y); // of the ball, an ellipse in pixels
    // some point of the square [u, u + 1] x [v, v + 1] is inside: its corner opposite to the normal is
    const double bound = support - std::min(a, 0.0) - std::min(b, 0.0);
    edge[0] = static_cast<float>(a);
    edge[1] = static_cast<float>(b);
    edge[2] = -round_down(-(bound + slack(bound, a, b, p.x1 - p.x0, p.y1 - p.y0)));
}

/// Writes the half-plane with this outward normal that holds the whole prism; sound for any normal, tight for those of the hull.
void write_edge_around(float (&edge)[3], double a, double b, const std::array<PicturePoint, 6>& points, const Footprint& p, double grow_x,
                       double grow_y) noexcept {
    if (!scale_normal(a, b)) return;
    double support = -std::numeric_limits<double>::infinity();
    for (const PicturePoint& q : points) support = std::max(support, a * (q.x - p.x0) + b * (q.y - p.y0));
    write_edge(edge, a, b, support, p, grow_x, grow_y);
}

/// Edges of the hull of six points, by walking around it. Where rounding picks a wrong edge, it is merely not the best one.
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
        if (next == at) return; // a point: the rectangle bounds it
        write_edge_around(edge, dy, -dx, points, p, grow_x, grow_y);
        at = next;
        if (points[at].x == points[start].x && points[at].y == points[start].y) return;
    }
}

/// Planes across a normal: n . x in picture units is a x + b y + g z.
struct PictureNormal {
    double a = 0.0, b = 0.0, g = 0.0;
    bool flat_enough = false; // for depths that are linear in pixels
    [[nodiscard]] double along(const PicturePoint& q, const Footprint& p) const noexcept {
        return a * (q.x - p.x0) + b * (q.y - p.y0) + g * q.z;
    }
};

PictureNormal seen_in(const CullFrame& f, const Vec3& normal) noexcept {
    const double length = normal.norm();
    if (!(length > 0.0)) return {};
    PictureNormal n{f.view.right.dot(normal) / (length * f.pixels_x), f.view.up.dot(normal) / (length * f.pixels_y),
                    f.view.forward.dot(normal) / (length * f.depth_scale)};
    constexpr double kSteepest = 1e4; // depth ranges per pixel; beyond, nearest and farthest are tighter
    n.flat_enough = std::abs(n.a) + std::abs(n.b) < kSteepest * std::abs(n.g);
    return n;
}

/// Two planes as depths over the rectangle, each taken at the corner of the pixel where it reaches farthest.
/// low, high   of n . x over the points
void write_planes(Footprint& p, const CullFrame& f, const PictureNormal& n, double low, double high) noexcept {
    const double grow = f.reach * (1.0 + 1e-9);
    const double first = (n.g > 0.0 ? low - grow : high + grow) / n.g, last = (n.g > 0.0 ? high + grow : low - grow) / n.g;
    const double slope_x = -n.a / n.g, slope_y = -n.b / n.g;
    const double front = first + std::min(slope_x, 0.0) + std::min(slope_y, 0.0),
                 back = last + std::max(slope_x, 0.0) + std::max(slope_y, 0.0);
    const int w = p.x1 - p.x0, h = p.y1 - p.y0;
    p.front[0] = round_down(front - slack(front, slope_x, slope_y, w, h) - 1e-12);
    p.back[0] = -round_down(-(back + slack(back, slope_x, slope_y, w, h) + 1e-12));
    p.front[1] = p.back[1] = static_cast<float>(slope_x);
    p.front[2] = p.back[2] = static_cast<float>(slope_y);
}

void start_planes(Footprint& p) noexcept { // beyond all depths
    p.front[0] = -1.0f;
    p.back[0] = 2.0f;
}

/// Across the triangle's mean normal.
void write_planes_around(Footprint& p, const CullFrame& f, const SweptCorners& c, const std::array<PicturePoint, 6>& points) noexcept {
    start_planes(p);
    const PictureNormal n = seen_in(f, (c[1] - c[0] + c[4] - c[3]).cross(c[2] - c[0] + c[5] - c[3]));
    if (!n.flat_enough) return;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const PicturePoint& q : points) {
        const double value = n.along(q, p);
        low = std::min(low, value);
        high = std::max(high, value);
    }
    write_planes(p, f, n, low, high);
}

/// By how much a prism grows in the picture: its reach, and what the subtractions and products of project() round; the projection itself
/// is in frame.reach.
PicturePoint growth(const CullFrame& frame) noexcept {
    constexpr double kPixelError = 1e-9;
    return {frame.reach * frame.pixels_x + kPixelError, frame.reach * frame.pixels_y + kPixelError,
            frame.reach * frame.depth_scale + kPixelError};
}

/// Rectangle and depths that hold everything between two corners of a box.
Footprint make_rectangle(const CullFrame& frame, const PicturePoint& low, const PicturePoint& high, const PicturePoint& grow) noexcept {
    const auto pixel = [](double x, int size) { return static_cast<std::int32_t>(std::clamp(std::floor(x), 0.0, size - 1.0)); };
    Footprint p;
    p.x0 = pixel(low.x - grow.x, frame.width);
    p.x1 = pixel(high.x + grow.x, frame.width) + 1;
    p.y0 = pixel(low.y - grow.y, frame.height);
    p.y1 = pixel(high.y + grow.y, frame.height) + 1;
    p.nearest = std::max(round_down(low.z - grow.z), 0.0f);
    p.farthest = std::min(-round_down(-(high.z + grow.z)), 0x1.fffffep-1f);
    return p;
}

void extend(PicturePoint& low, PicturePoint& high, const PicturePoint& q) noexcept {
    low = {std::min(low.x, q.x), std::min(low.y, q.y), std::min(low.z, q.z)};
    high = {std::max(high.x, q.x), std::max(high.y, q.y), std::max(high.z, q.z)};
}

template <class ForEachPoint>
CullFrame make_frame(const ViewDirection& view, double reach, int width, int height, ForEachPoint&& for_each_point) noexcept {
    assert(width > 0 && height > 0 && width <= kLargestPicture && height <= kLargestPicture);
    Box3 seen; // in view coordinates
    double largest = 0.0;
    for_each_point([&](const Vec3& p) {
        seen.add(Vec3(view.right.dot(p), view.up.dot(p), view.forward.dot(p)));
        largest = std::max(largest, p.cwiseAbs().maxCoeff());
    });
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
    return make_frame(view, reach, width, height, [&](auto&& visit) {
        for (const SweptCorners& corners : prisms)
            for (const Vec3& p : corners) visit(p);
    });
}

CullFrame make_cull_frame(const ViewDirection& view, std::span<const Vec3> points, double reach, int width, int height) noexcept {
    return make_frame(view, reach, width, height, [&](auto&& visit) {
        for (const Vec3& p : points) visit(p);
    });
}

Footprint make_footprint(const CullFrame& frame, const SweptCorners& corners) noexcept {
    const PicturePoint grow = growth(frame);
    std::array<PicturePoint, 6> points;
    PicturePoint low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (std::size_t k = 0; k < 6; ++k) {
        points[k] = project(frame, corners[k]);
        extend(low, high, points[k]);
    }
    Footprint p = make_rectangle(frame, low, high, grow);
    write_edges(p, points, grow.x, grow.y);
    write_planes_around(p, frame, corners, points);
    return p;
}

Footprint make_footprint(const CullFrame& frame, std::span<const Vec3> points, const Vec3& normal) noexcept {
    const PicturePoint grow = growth(frame);
    PicturePoint low{1e300, 1e300, 1e300}, high{-1e300, -1e300, -1e300};
    for (const Vec3& x : points) extend(low, high, project(frame, x));
    Footprint p = make_rectangle(frame, low, high, grow);
    start_planes(p);
    for (auto& edge : p.edge) edge[2] = 1.0f; // 0 <= 1: bounds nothing
    const PictureNormal n = seen_in(frame, normal);
    // diagonals, and across the normal: where the points are seen from the side they are a strip
    double sides[6][2] = {{0.5, 0.5}, {0.5, -0.5}, {-0.5, 0.5}, {-0.5, -0.5}, {n.a, n.b}, {-n.a, -n.b}};
    const std::size_t count = scale_normal(sides[4][0], sides[4][1]) && scale_normal(sides[5][0], sides[5][1]) ? 6 : 4;
    double support[6], least = std::numeric_limits<double>::infinity(), most = -least;
    std::fill(std::begin(support), std::end(support), most);
    for (const Vec3& x : points) {
        const PicturePoint q = project(frame, x);
        for (std::size_t k = 0; k < count; ++k) support[k] = std::max(support[k], sides[k][0] * (q.x - p.x0) + sides[k][1] * (q.y - p.y0));
        least = std::min(least, n.along(q, p));
        most = std::max(most, n.along(q, p));
    }
    for (std::size_t k = 0; k < count; ++k) write_edge(p.edge[k], sides[k][0], sides[k][1], support[k], p, grow.x, grow.y);
    if (n.flat_enough) write_planes(p, frame, n, least, most);
    return p;
}

} // namespace trocar::collision
