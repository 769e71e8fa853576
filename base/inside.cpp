#include "base/inside.hpp"

#include <algorithm>

namespace trocar {

namespace {

/// Along an axis to the nearest side of the box.
struct Ray {
    int axis = 0;
    bool positive = true;
};

Ray shortest_way_out(const Box3& box, const Vec3& p) noexcept {
    Ray ray;
    double shortest = std::numeric_limits<double>::infinity();
    for (int k = 0; k < 3; ++k) {
        if (box.hi[k] - p[k] < shortest) shortest = box.hi[k] - p[k], ray = {k, true};
        if (p[k] - box.lo[k] < shortest) shortest = p[k] - box.lo[k], ray = {k, false};
    }
    return ray;
}

} // namespace

int InsideTest::winding_number(const Vec3& p) const noexcept {
    const Box3 box = tree_.bounds();
    if (!is_finite(p) || !box.contains(p)) return 0;
    const Ray ray = shortest_way_out(box, p);
    return tree_.ray_crossings(p, ray.axis, ray.positive);
}

std::size_t InsideTest::count_outside(std::span<const Vec3> points) const noexcept {
    const Box3 box = tree_.bounds();
    std::size_t outside = 0;
    std::array<Vec3, TriangleTree::kMaxPacket> packet;
    std::array<int, TriangleTree::kMaxPacket> crossings;
    std::size_t size = 0;
    const auto test_packet = [&] {
        if (size == 0) return;
        const Ray ray = shortest_way_out(box, packet[0]);
        Box3 around;
        for (std::size_t k = 0; k < size; ++k) around.add(packet[k]);
        if (tree_.overlaps_any(around))
            tree_.ray_crossings({packet.data(), size}, ray.axis, ray.positive, {crossings.data(), size});
        else // a closed surface that stays out of a box has one winding number throughout it
            std::fill_n(crossings.begin(), size, tree_.ray_crossings(packet[0], ray.axis, ray.positive));
        outside += static_cast<std::size_t>(std::count(crossings.begin(), crossings.begin() + size, 0));
        size = 0;
    };
    for (const Vec3& p : points) {
        if (!is_finite(p) || !box.contains(p)) {
            ++outside;
            continue;
        }
        packet[size++] = p;
        if (size == packet.size()) test_packet();
    }
    test_packet();
    return outside;
}

double InsideTest::signed_distance(const Vec3& p) const noexcept {
    const auto nearest = tree_.closest(p);
    if (!nearest) return std::numeric_limits<double>::infinity();
    return inside(p) ? -nearest->distance : nearest->distance;
}

} // namespace trocar
