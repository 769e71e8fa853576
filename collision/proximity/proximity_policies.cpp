#include "collision/proximity/proximity_policies.hpp"

#include "collision/proximity/cones.hpp"
#include "collision/bvh/dop.hpp"

namespace trocar::collision {
namespace {

Error bad_value(const char* key, double value, const char* right) {
    return {.code = ErrorCode::BadValue, .message = std::to_string(value) + " is not possible: " + right, .key = key};
}

/// Distances beyond this would leave the single precision of the bounds.
constexpr double kLargestDistance = 1e30; // m

bool is_length(double value) noexcept { return value >= 0.0 && value <= kLargestDistance; } // false for NaN

/// Radians of a cone that is not everything, a little less.
constexpr double kWidestAngle = 1.5657;

} // namespace

Exactness exactness_of(const ProximityOptions& options) noexcept {
    const bool cones_may_lose = options.normal_cones == NormalCones::Alone || options.normal_cones == NormalCones::Groups ||
                                (options.normal_cones == NormalCones::Contour && options.self_distance > 0.0);
    const bool heuristic = (options.inflation == Inflation::OrientedPaper && options.during_step) ||
                           (options.within != 0 && (cones_may_lose || options.leaf_angle > 0.0)) ||
                           options.coherence == Coherence::VelocityCones || options.leaf_test == LeafTest::Vertices;
    return heuristic ? Exactness::Heuristic : Exactness::Exact;
}

Result<void> check_options(const ProximityOptions& o) {
    if (!is_length(o.distance)) return bad_value("distance", o.distance, "0 to 1e30 m");
    if (!is_length(o.self_distance)) return bad_value("self_distance", o.self_distance, "0 to 1e30 m");
    if (!is_length(o.lazy_tolerance)) return bad_value("lazy_tolerance", o.lazy_tolerance, "0 to 1e30 m");
    if (!is_length(o.significance)) return bad_value("significance", o.significance, "0 to 1e30 m");
    if (!is_dop(o.dop)) return bad_value("dop", static_cast<double>(o.dop), "6, 14, 18 or 26");
    if (o.arity != 2 && o.arity != 4 && o.arity != 8) return bad_value("arity", static_cast<double>(o.arity), "2, 4 or 8");
    if (!(o.cone_half_angle >= 0.0 && o.cone_half_angle <= kWidestAngle))
        return bad_value("cone_half_angle", o.cone_half_angle, "0 to 1.5657 rad, a little less than a right angle");
    if (!(o.leaf_angle >= 0.0 && o.leaf_angle <= 3.2)) return bad_value("leaf_angle", o.leaf_angle, "0 to pi rad");
    if (o.group_count < 1 || o.group_count > 64) return bad_value("group_count", static_cast<double>(o.group_count), "1 to 64");
    if (o.rebuild_after < 1) return bad_value("rebuild_after", 0.0, "at least 1 step");
    if (o.coherence == Coherence::VelocityCones && !(o.reuse_limit > 0.0 && is_length(o.reuse_limit)))
        return bad_value("reuse_limit", o.reuse_limit, "more than 0 m where results are kept");
    return {};
}

} // namespace trocar::collision
