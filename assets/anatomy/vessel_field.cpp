#include "assets/anatomy/vessel_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace trocar::anatomy {
namespace {

struct SegmentHit {
    double distance, along, radius;
};

SegmentHit nearest_on_segment(const Tube& tube, std::size_t i, const Vec3& p) {
    const Vec3 axis = tube.points[i + 1] - tube.points[i];
    const Vec3 offset = p - tube.points[i];
    const double along = std::clamp(offset.dot(axis) / axis.squaredNorm(), 0.0, 1.0);
    const double radius = (1 - along) * tube.radii[i] + along * tube.radii[i + 1];
    return {(offset - along * axis).norm() - radius, along, radius};
}

TubeHit nearest_in_run(const Tube& tube, double spacing, std::size_t first, std::size_t last, const Vec3& p) {
    TubeHit best{std::numeric_limits<double>::infinity(), 0, 0};
    for (std::size_t i = first; i <= last; ++i) {
        const SegmentHit hit = nearest_on_segment(tube, i, p);
        if (hit.distance < best.distance) best = {hit.distance, (static_cast<double>(i) + hit.along) * spacing, hit.radius};
    }
    return best;
}

} // namespace

TubeHit nearest_on_tube(const Tube& tube, const Vec3& p) {
    return nearest_in_run(tube, (tube.points[1] - tube.points[0]).norm(), 0, tube.points.size() - 2, p);
}

VesselField::VesselField(std::vector<Tube> tubes) : tubes_(std::move(tubes)) {
    for (const Tube& tube : tubes_) spacing_.push_back((tube.points[1] - tube.points[0]).norm());
    const Box3 bounds = box();
    origin_ = bounds.lo;
    for (int axis = 0; axis < 3; ++axis)
        size_[static_cast<std::size_t>(axis)] = static_cast<std::int64_t>(std::ceil(bounds.extent()[axis] / cell_)) + 1;
    sort_into_cells();
}

Box3 VesselField::box() const {
    Box3 bounds;
    for (const Tube& tube : tubes_)
        for (std::size_t i = 0; i < tube.points.size(); ++i) {
            bounds.add(tube.points[i] - Vec3::Constant(tube.radii[i]));
            bounds.add(tube.points[i] + Vec3::Constant(tube.radii[i]));
        }
    bounds.inflate(0.006);
    return bounds;
}

void VesselField::sort_into_cells() {
    const double diagonal = std::sqrt(3.0) * cell_;
    double widest_blend = 0.0;
    for (const Tube& tube : tubes_) widest_blend = std::max(widest_blend, tube.blend);
    std::vector<std::pair<Index, Index>> near; // (tube, segment)
    std::vector<double> distance;
    // Segments by coarse bins first, or this would be cells times segments.
    for (std::int64_t z = 0; z < size_[2]; ++z)
        for (std::int64_t y = 0; y < size_[1]; ++y)
            for (std::int64_t x = 0; x < size_[0]; ++x) {
                cell_begin_.push_back(static_cast<Index>(runs_.size()));
                const Vec3 middle =
                    origin_ + cell_ * Vec3(static_cast<double>(x) + 0.5, static_cast<double>(y) + 0.5, static_cast<double>(z) + 0.5);
                near.clear();
                distance.clear();
                double nearest = kReach + 0.5 * diagonal;
                for (Index t = 0; t < tubes_.size(); ++t) {
                    const Tube& tube = tubes_[t];
                    for (Index i = 0; i + 1 < tube.points.size();) {
                        const double d = nearest_on_segment(tube, i, middle).distance;
                        if (d <= kReach + diagonal) {
                            near.emplace_back(t, i);
                            distance.push_back(d);
                            nearest = std::min(nearest, d);
                            ++i;
                            continue;
                        }
                        // Segments are `spacing` long: as many as the excess holds cannot be near either.
                        i += std::max<Index>(1, static_cast<Index>((d - kReach - diagonal) / (1.5 * spacing_[t])));
                    }
                }
                for (std::size_t k = 0; k < near.size(); ++k) {
                    if (distance[k] > nearest + diagonal + widest_blend) continue;
                    if (runs_.size() > cell_begin_.back() && runs_.back().tube == near[k].first && runs_.back().last + 1 == near[k].second)
                        runs_.back().last = near[k].second;
                    else
                        runs_.push_back({near[k].first, near[k].second, near[k].second});
                }
            }
    cell_begin_.push_back(static_cast<Index>(runs_.size()));
}

VesselField::Sample VesselField::look(const Vec3& p) const {
    std::array<std::int64_t, 3> at{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const double c = std::floor((p[static_cast<int>(axis)] - origin_[static_cast<int>(axis)]) / cell_);
        if (!(c >= 0) || c >= static_cast<double>(size_[axis])) return {kReach, 0.001};
        at[axis] = static_cast<std::int64_t>(c);
    }
    const auto cell = static_cast<std::size_t>((at[2] * size_[1] + at[1]) * size_[0] + at[0]);
    double value = kReach, radius = 0.001, nearest = kReach;
    for (Index r = cell_begin_[cell]; r < cell_begin_[cell + 1];) {
        const Index t = runs_[r].tube;
        TubeHit hit{std::numeric_limits<double>::infinity(), 0, 0};
        for (; r < cell_begin_[cell + 1] && runs_[r].tube == t; ++r) {
            const TubeHit h = nearest_in_run(tubes_[t], spacing_[t], runs_[r].first, runs_[r].last, p);
            if (h.distance < hit.distance) hit = h;
        }
        const Tube& tube = tubes_[t];
        const double fade = 1 - smooth_ramp(hit.arc, tube.blend_begin, tube.blend_end);
        value = smooth_min(value, hit.distance, tube.blend * fade);
        if (hit.distance < nearest) {
            nearest = hit.distance;
            radius = hit.radius;
        }
    }
    return {value, radius};
}

} // namespace trocar::anatomy
