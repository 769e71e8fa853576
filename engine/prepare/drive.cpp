#include "engine/prepare/drive.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace trocar::engine {

DriveCommand evaluate_path(std::span<const DriveRow> rows, double time) noexcept {
    if (time <= rows.front().time) return {rows.front().insertion, rows.front().rotation};
    const auto next = std::lower_bound(rows.begin() + 1, rows.end(), time, [](const DriveRow& row, double t) { return row.time < t; });
    if (next == rows.end()) return {rows.back().insertion, rows.back().rotation};
    const DriveRow &from = *(next - 1), &to = *next;
    const double span = to.time - from.time;
    const double s = span > 0.0 ? (time - from.time) / span : 1.0;
    return {from.insertion + s * (to.insertion - from.insertion), from.rotation + s * (to.rotation - from.rotation)};
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
