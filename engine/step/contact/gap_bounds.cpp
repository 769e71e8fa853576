#include "engine/step/contact/gap_bounds.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

void GapBounds::reserve(std::size_t rows, std::size_t bodies) {
    bound_.reserve(rows);
    speeds_.reserve(bodies);
}

void GapBounds::begin(std::span<const ContactRow> rows, std::size_t bodies) {
    bound_.clear();
    speeds_.assign(bodies, {});
    for (const ContactRow& row : rows) {
        Bound bound{.normal = row.normal, .velocity = row.a.velocity - row.b.velocity, .gap = row.gap};
        const ContactSide* const sides[2] = {&row.a, &row.b};
        for (std::size_t side = 0; side < 2; ++side) {
            if (!sides[side]->gives()) continue;
            bound.slot[side] = sides[side]->slot;
            bound.blend[side] = sides[side]->blend;
            for (std::size_t foot = 0; foot < sides[side]->feet; ++foot)
                for (const double weight : sides[side]->weight[foot]) bound.spread[side] += std::abs(sides[side]->share[foot] * weight);
        }
        bound_.push_back(bound);
    }
}

void GapBounds::find_speeds(std::span<const GivingBody> bodies) noexcept {
    const auto velocity_of = [](const fem::NodeRecord& node) { return Vec3(node.v[0], node.v[1], node.v[2]); };
    for (std::size_t k = 0; k < bodies.size(); ++k) {
        Vec3 mean = Vec3::Zero();
        for (const fem::NodeRecord& node : bodies[k].nodes) mean += velocity_of(node);
        if (!bodies[k].nodes.empty()) mean /= static_cast<double>(bodies[k].nodes.size());
        double apart_sq = 0.0;
        for (const fem::NodeRecord& node : bodies[k].nodes) apart_sq = std::max(apart_sq, (velocity_of(node) - mean).squaredNorm());
        speeds_[k] = {mean, std::sqrt(apart_sq)};
    }
}

/// m/s, at which the gap grows at least, as the bodies move now.
double GapBounds::least_rate(const Bound& bound) const noexcept {
    Vec3 mean = bound.velocity;
    double apart = 0.0;
    for (std::size_t side = 0; side < 2; ++side) {
        if (bound.slot[side] == ContactSide::kNone) continue;
        const Speeds& speeds = speeds_[bound.slot[side]];
        mean += (side == 0 ? bound.blend[side] : -bound.blend[side]) * speeds.mean;
        apart += std::abs(bound.blend[side]) * bound.spread[side] * speeds.apart;
    }
    return bound.normal.dot(mean) - apart;
}

void GapBounds::advance(double h) noexcept {
    for (Bound& bound : bound_) bound.gap += h * least_rate(bound);
}

} // namespace trocar::engine
