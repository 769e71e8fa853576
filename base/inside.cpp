#include "base/inside.hpp"

namespace seldinger {

int InsideTest::winding_number(const Vec3& p) const noexcept {
    const Box3 box = tree_.bounds();
    if (!is_finite(p) || !box.contains(p)) return 0;
    int axis = 0;
    bool positive = true;
    double shortest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (box.hi[k] - p[k] < shortest) shortest = box.hi[k] - p[k], axis = k, positive = true;
        if (p[k] - box.lo[k] < shortest) shortest = p[k] - box.lo[k], axis = k, positive = false;
    }
    return tree_.ray_crossings(p, axis, positive);
}

double InsideTest::signed_distance(const Vec3& p) const noexcept {
    const auto nearest = tree_.closest(p);
    if (!nearest) return std::numeric_limits<double>::infinity();
    return inside(p) ? -nearest->distance : nearest->distance;
}

} // namespace seldinger
