#include "collision/search/face_planes.hpp"

#include "collision/clones.hpp"
#include "collision/bvh/dop_tree.hpp"
#include "collision/lanes.hpp"
#include "collision/swept_box.hpp"

namespace trocar::collision {
namespace {

constexpr std::size_t kMostPoints = 3 * DopTree::kMaxClusterSize;
/// Below this the square of a direction's length has lost its digits.
constexpr double kShortest = 0x1p-900;

struct Hull {
    std::array<Vec3, kMostPoints> t0, t1; // left uninitialised beyond count
    std::size_t count = 0;
    Vec3 centre = Vec3::Zero(); // about
    double size = 0.0;          // largest absolute coordinate, NaN or infinite if one is
};

TROCAR_LANES_INLINE void gather(const SurfaceMotion& motion, std::span<const Index> vertices, Hull& hull) noexcept {
    hull.count = vertices.size();
    double x = 0.0, y = 0.0, z = 0.0, size = 0.0, none = 0.0;
    for (std::size_t i = 0; i < vertices.size(); ++i) {
        const Vec3 &p = motion.t0[vertices[i]], &q = motion.t1[vertices[i]];
        hull.t0[i] = p;
        hull.t1[i] = q;
        x += p[0];
        y += p[1];
        z += p[2];
        for (int axis = 0; axis < 3; ++axis) {
            const double most = std::max(std::abs(p[axis]), std::abs(q[axis]));
            size = std::max(size, most);
            none += 0.0 * p[axis] + 0.0 * q[axis]; // std::max passes NaN over
        }
    }
    const double share = 1.0 / static_cast<double>(vertices.size());
    hull.centre = {share * x, share * y, share * z};
    hull.size = size + none;
}

/// Four faces, side by side.
struct LaneFaces {
    std::array<Lanes3, 3> t0, t1;
    Lanes size; // as Hull has it
};

/// A short group repeats its first face.
TROCAR_LANES_INLINE LaneFaces gather(const SurfaceMotion& motion, const FaceRun& faces, Index first) noexcept {
    constexpr std::size_t kBlock = DopTree::kLanes;
    LaneFaces out;
    const Index* face[kLanes]; // its corners, a row each
    for (Index lane = 0; lane < kLanes; ++lane) {
        const std::size_t at = first + lane < faces.count ? first + lane : first;
        face[lane] = faces.corners + at / kBlock * 3 * kBlock + at % kBlock;
    }
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t row = k * kBlock;
        const Index c0 = face[0][row], c1 = face[1][row], c2 = face[2][row], c3 = face[3][row];
        out.t0[k] = gather_points(motion.t0[c0], motion.t0[c1], motion.t0[c2], motion.t0[c3]);
        out.t1[k] = gather_points(motion.t1[c0], motion.t1[c1], motion.t1[c2], motion.t1[c3]);
    }
    out.size = all(0.0);
    Lanes none = out.size;
    for (const auto* corners : {&out.t0, &out.t1})
        for (const Lanes3& p : *corners) {
            out.size = larger(out.size, larger(magnitude(p.x), larger(magnitude(p.y), magnitude(p.z))));
            none += 0.0 * p.x + 0.0 * p.y + 0.0 * p.z;
        }
    out.size += none;
    return out;
}

/// Which faces have all of the hull beyond them along n, by more than the distance?
TROCAR_LANES_INLINE Mask lies_beyond(const Hull& hull, const LaneFaces& faces, const Lanes3& n, double distance) noexcept {
    Lanes high0 = dot(n, faces.t0[0]), high1 = dot(n, faces.t1[0]);
    for (std::size_t k = 1; k < 3; ++k) {
        high0 = larger(high0, dot(n, faces.t0[k]));
        high1 = larger(high1, dot(n, faces.t1[k]));
    }
    Lanes low0 = all(std::numeric_limits<double>::infinity()), low1 = low0;
    for (std::size_t i = 0; i < hull.count; ++i) {
        const Vec3 &p = hull.t0[i], &q = hull.t1[i];
        low0 = smaller(low0, n.x * p[0] + n.y * p[1] + n.z * p[2]);
        low1 = smaller(low1, n.x * q[0] + n.y * q[1] + n.z * q[2]);
    }
    const Lanes length_sq = dot(n, n), size = larger(faces.size, all(hull.size));
    const Lanes bound = distance * (1.0 + 0x1p-40) * square_root(length_sq) +
                        0x1p-38 * size * (magnitude(n.x) + magnitude(n.y) + magnitude(n.z)) + std::numeric_limits<double>::min();
    const Mask fits = (faces.size <= kLargestCoordinate) & (all(hull.size) <= kLargestCoordinate); // NaN does not
    return fits & (length_sq >= kShortest) & (low0 - high0 > bound) & (low1 - high1 > bound);
}

} // namespace

TROCAR_CLONES
bool hull_keeps_off(const SurfaceMotion& hull, std::span<const Index> vertices, const SurfaceMotion& surface, const FaceRun& faces,
                    double distance) noexcept {
    Hull points;
    gather(hull, vertices, points);
    const Lanes3 centre{all(points.centre[0]), all(points.centre[1]), all(points.centre[2])};
    for (Index first = 0; first < faces.count; first += kLanes) {
        const LaneFaces four = gather(surface, faces, first);
        const Lanes3 away = centre - all(1.0 / 3.0) * (four.t0[0] + four.t0[1] + four.t0[2]);
        const Lanes3 normal = cross(four.t0[1] - four.t0[0], four.t0[2] - four.t0[0]);
        Mask beyond = lies_beyond(points, four, select(dot(normal, away) < 0.0, all(-1.0) * normal, normal), distance);
        if (any(~beyond)) beyond |= lies_beyond(points, four, away, distance);
        if (any(~beyond)) return false;
    }
    return true;
}

} // namespace trocar::collision
