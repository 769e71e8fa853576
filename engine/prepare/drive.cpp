#include "engine/prepare/drive.hpp"

#include <cmath>
#include <utility>

namespace trocar::engine {

DriveCommand evaluate_path(std::span<const DriveRow> rows, double time) noexcept {
    if (time <= rows.front().time) return {rows.front().insertion, rows.front().rotation};
    for (std::size_t i = 1; i < rows.size(); ++i) {
        if (time > rows[i].time) continue;
        const double span = rows[i].time - rows[i - 1].time;
        const double s = span > 0.0 ? (time - rows[i - 1].time) / span : 1.0;
        return {rows[i - 1].insertion + s * (rows[i].insertion - rows[i - 1].insertion),
                rows[i - 1].rotation + s * (rows[i].rotation - rows[i - 1].rotation)};
    }
    return {rows.back().insertion, rows.back().rotation};
}

Route make_route(std::vector<Vec3> points, std::vector<double> radii) {
    Route route{std::move(points), std::move(radii), {}};
    double length = 0.0;
    for (std::size_t i = 0; i < route.points.size(); ++i) {
        if (i > 0) length += std::sqrt((route.points[i] - route.points[i - 1]).squaredNorm());
        route.length.push_back(length);
    }
    return route;
}

} // namespace trocar::engine
