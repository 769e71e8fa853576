#include "engine/prepare/scripted_motion.hpp"

#include "base/trig.hpp"

#include <cmath>
#include <numbers>

namespace trocar::engine {

Vec3 evaluate_motion(const std::vector<MotionRow>& path, double time) noexcept {
    if (path.empty()) return Vec3::Zero();
    if (time <= path.front().time) return path.front().displacement;
    for (std::size_t i = 1; i < path.size(); ++i) {
        if (time > path[i].time) continue;
        const double span = path[i].time - path[i - 1].time;
        const double s = span > 0.0 ? (time - path[i - 1].time) / span : 1.0;
        return path[i - 1].displacement + s * (path[i].displacement - path[i - 1].displacement);
    }
    return path.back().displacement;
}

double wave_at(double period, double time) noexcept {
    const double turns = time / period;
    const double phase = 2.0 * std::numbers::pi * (turns - std::floor(turns));
    return 0.5 * (1.0 - sin_cos(phase).cos);
}

} // namespace trocar::engine
