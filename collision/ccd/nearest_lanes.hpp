// nearest.hpp for four pairs of features at a time, with the same answers.
#pragma once

#include "collision/lanes.hpp"

#include <array>

namespace trocar::collision {

struct LaneNearest {
    Lanes3 offset;
    Lanes distance;
    std::array<Lanes, 3> bary;
};

/// Regions as in nearest.hpp, the last that holds wins, so they come in reverse order.
TROCAR_LANES_INLINE LaneNearest find_nearest(const std::array<Lanes3, 3>& corner) noexcept {
    const Lanes3 &a = corner[0], &b = corner[1], &c = corner[2];
    const Lanes3 ab = b - a, ac = c - a;
    const Lanes d1 = -dot(ab, a), d2 = -dot(ac, a), d3 = -dot(ab, b), d4 = -dot(ac, b), d5 = -dot(ab, c), d6 = -dot(ac, c);
    const Lanes va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    const Lanes sum = va + vb + vc, zero = all(0.0), one = all(1.0);
    Lanes v = sum > 0.0 ? vb / sum : zero, w = sum > 0.0 ? vc / sum : zero;
    const Lanes along_bc = (d4 - d3) / ((d4 - d3) + (d5 - d6));
    const Mask on_bc = (va <= 0.0) & (d4 >= d3) & (d5 >= d6) & ((d4 - d3) + (d5 - d6) > 0.0);
    v = on_bc ? 1.0 - along_bc : v;
    w = on_bc ? along_bc : w;
    const Mask on_ac = (vb <= 0.0) & (d2 >= 0.0) & (d6 <= 0.0) & (d2 > d6);
    v = on_ac ? zero : v;
    w = on_ac ? d2 / (d2 - d6) : w;
    const Mask at_c = (d6 >= 0.0) & (d5 <= d6);
    v = at_c ? zero : v;
    w = at_c ? one : w;
    const Mask on_ab = (vc <= 0.0) & (d1 >= 0.0) & (d3 <= 0.0) & (d1 > d3);
    v = on_ab ? d1 / (d1 - d3) : v;
    w = on_ab ? zero : w;
    const Mask at_b = (d3 >= 0.0) & (d4 <= d3);
    v = at_b ? one : v;
    w = at_b ? zero : w;
    const Mask at_a = (d1 <= 0.0) & (d2 <= 0.0);
    v = at_a ? zero : v;
    w = at_a ? zero : w;
    const Lanes3 offset = a + v * ab + w * ac;
    return {offset, square_root(dot(offset, offset)), {1.0 - v - w, v, w}};
}

TROCAR_LANES_INLINE Lanes clamped_ratio(Lanes p, Lanes q) noexcept {
    const Lanes zero = all(0.0), one = all(1.0);
    const Lanes ratio = p >= q ? one : p / q;
    return (p <= 0.0) | (q <= 0.0) ? zero : ratio;
}

TROCAR_LANES_INLINE LaneNearest find_nearest(const std::array<Lanes3, 4>& corner) noexcept {
    const Lanes3& r = corner[0];
    const Lanes3 da = corner[2] - corner[0], db = corner[0] - corner[1];
    const Lanes aa = dot(da, da), bb = dot(db, db), ab = dot(da, db), ar = dot(da, r), br = dot(db, r);
    Lanes s = clamped_ratio(ab * br - ar * bb, aa * bb - ab * ab);
    const Lanes t = clamped_ratio(ab * s + br, bb);
    s = t <= 0.0 ? clamped_ratio(-ar, aa) : s;
    s = t >= 1.0 ? clamped_ratio(ab - ar, aa) : s;
    const Lanes3 offset = r + s * da - t * db;
    return {offset, square_root(dot(offset, offset)), {s, t, all(0.0)}};
}

} // namespace trocar::collision
