// Footprints of moving triangles: which pixels a swept triangle may reach and between which depths, in single precision and
// conservatively. One routine makes these footprints; graphics hardware and the CPU reference evaluate the same numbers.
//
// The prism is a bounding one: the convex hull of the six points in the picture's plane, between two planes along the triangle's mean
// normal, between the hull's nearest and farthest depth, all grown by half the contact distance. Two triangles that come within
// the distance share the middle of their shortest connection, so their prisms share a point, hence the pixel it falls into, and a depth.
// Deviates from the image-space paper, which grows prisms and lets the rasteriser sample pixel centres: here a pixel's whole square counts,
// so nothing depends on sample positions, vertex snapping, facing or clipping, and an edge-on or sub-pixel triangle covers what it meets.
#pragma once

#include "base/box.hpp"
#include "base/vec.hpp"

#include <array>
#include <span>

namespace trocar::collision {

/// A parallel projection; the three are orthonormal, depth grows along `forward`.
struct ViewDirection {
    Vec3 right, up, forward;
};
/// Along an axis, or against it.
[[nodiscard]] ViewDirection view_along_axis(int axis, bool reversed) noexcept;
/// Along any direction that is not zero.
[[nodiscard]] ViewDirection view_along(const Vec3& direction) noexcept;

/// A triangle's corners at t0, then at t1: their convex hull holds it at every time between.
using SweptCorners = std::array<Vec3, 6>; // m

/// Maps the bounds of all prisms onto the whole picture, so that pixels are as small as possible. They need not be square.
struct CullFrame {
    ViewDirection view;
    int width = 0, height = 0;                      // pixels
    double left = 0.0, bottom = 0.0, nearest = 0.0; // m, at pixel 0, 0 and at depth 0
    double pixels_x = 1.0, pixels_y = 1.0;          // pixels per m
    double depth_scale = 1.0;                       // 1/m; everything lies at depths inside (0, 1)
    double reach = 0.0;                             // m, by which prisms grow: half the contact distance and the rounding of a projection
};
inline constexpr int kLargestPicture = 8192; // pixels a side: footprints count on exact small integers

/// reach   m, >= 0: half the distance within which triangles count as in contact
/// prisms  finite corners, all that will be drawn or queried
[[nodiscard]] CullFrame make_cull_frame(const ViewDirection& view, std::span<const SweptCorners> prisms, double reach, int width,
                                        int height) noexcept;
[[nodiscard]] CullFrame make_cull_frame(const ViewDirection& view, std::span<const Vec3> points, double reach, int width,
                                        int height) noexcept;

/// As graphics memory holds it: 32 words.
/// u, v    integer pixels from the corner x0, y0
/// covers  pixel (u, v) if edge[k][0] u + edge[k][1] v <= edge[k][2] for all k
/// depth   between max(nearest, front[0] + front[1] u + front[2] v) and min(farthest, back[0] + back[1] u + back[2] v)
struct Footprint {
    std::int32_t x0 = 0, y0 = 0, x1 = 0, y1 = 0; // half open
    float edge[6][3] = {};
    float front[3] = {}, back[3] = {};
    float nearest = 0.0f, farthest = 0.0f;
    float unused[2] = {};
};
static_assert(sizeof(Footprint) == 128);

[[nodiscard]] Footprint make_footprint(const CullFrame& frame, const SweptCorners& corners) noexcept;
/// Of the convex hull of any number of points, at least one: within an octagon of the picture and two planes across a normal.
/// normal   of any length, finite; where the points lie flattest. Zero: no planes
[[nodiscard]] Footprint make_footprint(const CullFrame& frame, std::span<const Vec3> points, const Vec3& normal) noexcept;

/// The depths of one pixel, evaluated in the order that the shaders use.
struct DepthInterval {
    float front, back;
};
[[nodiscard]] inline bool covers(const Footprint& p, float u, float v) noexcept {
    bool inside = true;
    for (const auto& e : p.edge) inside &= e[0] * u + e[1] * v <= e[2];
    return inside;
}
[[nodiscard]] inline DepthInterval depths(const Footprint& p, float u, float v) noexcept {
    const float front = p.front[0] + p.front[1] * u + p.front[2] * v, back = p.back[0] + p.back[1] * u + p.back[2] * v;
    return {front > p.nearest ? front : p.nearest, back < p.farthest ? back : p.farthest};
}

} // namespace trocar::collision
