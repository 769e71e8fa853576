#include "collision/search/session_shapes.hpp"

#include <algorithm>

namespace trocar::collision {

void gather_shape(std::span<const Vec3> from, std::span<const Vec3> to, std::span<const Index> vertices,
                  std::span<double> groups) noexcept {
    double* row = groups.data();
    for (std::size_t first = 0; first < vertices.size(); first += kLanes, row += kShapeGroup)
        for (std::size_t lane = 0; lane < kLanes; ++lane) {
            const Index v = vertices[std::min(first + lane, vertices.size() - 1)];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                row[axis * kLanes + lane] = from[v][static_cast<Eigen::Index>(axis)];
                row[(axis + 3) * kLanes + lane] = to[v][static_cast<Eigen::Index>(axis)];
            }
        }
}

void SessionShapes::build(std::span<const SurfacePart> parts) {
    parts_ = parts;
    first_group_.assign(1, 0);
    first_cluster_.clear();
    for (const SurfacePart& part : parts) {
        first_cluster_.push_back(static_cast<Index>(first_group_.size() - 1));
        for (Index c = 0; c < part.tree.clusters().size(); ++c)
            first_group_.push_back(first_group_.back() + static_cast<Index>((part.touched_by(c).size() + kLanes - 1) / kLanes));
    }
    groups_.assign(first_group_.back() * kShapeGroup, 0.0);
}

void SessionShapes::gather(std::span<const std::span<const Vec3>> from, std::span<const std::span<const Vec3>> to) noexcept {
    std::size_t at = 0;
    for (const SurfacePart& part : parts_)
        for (Index c = 0; c < part.tree.clusters().size(); ++c, ++at)
            gather_shape(
                from[part.surface], to[part.surface], part.touched_by(c),
                std::span(groups_).subspan(first_group_[at] * kShapeGroup, (first_group_[at + 1] - first_group_[at]) * kShapeGroup));
}

std::size_t SessionShapes::memory() const noexcept {
    const auto bytes = [](const auto& v) { return v.capacity() * sizeof(v[0]); };
    return bytes(groups_) + bytes(first_group_) + bytes(first_cluster_);
}

} // namespace trocar::collision
