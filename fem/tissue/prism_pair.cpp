#include "fem/tissue/prism_pair.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

void PrismPair::add(const PrismBatch& prism, std::size_t k, const Mat3& edges) {
    const auto by = [&](const double(&m)[9][kBatch]) {
        Mat3 matrix;
        for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = m[i][lane_];
        return Mat3(edges * matrix);
    };
    const Mat3 part = by(prism.mean);
    mean_ += part;
    jump_ += prism.side[lane_] * part;
    bent_[k / kPrismTets] += by(prism.bend);
}

void PrismPair::complete() {
    const auto axis = [&](std::size_t first) { return Vec3(pair_.along[first][lane_], pair_.along[first + 1][lane_], pair_.along[first + 2][lane_]); };
    const Vec3 along[2] = {axis(0), axis(3)}, across = along[0].cross(along[1]);
    const Vec3 edge[2] = {mean_ * along[0], mean_ * along[1]}, up = mean_ * across, area = edge[0].cross(edge[1]);
    const double size = std::max(area.norm(), kLeastPairArea);
    const Vec3 normal = area / size;
    double step[2] = {};
    for (std::size_t i = 0; i < 2; ++i) {
        const Vec3 kink = jump_ * along[i];
        step[i] = normal.dot(kink);
        hold_ += 0.5 * (pair_.hold[lane_] * (kink.squaredNorm() - step[i] * step[i]) + pair_.kink[lane_] * step[i] * step[i]);
    }
    const Vec3 fold = (step[0] * edge[1] - step[1] * edge[0]).cross(normal) / size;
    const double both = pair_.hold[lane_] * kPatchShare / kHoldShare, growth = 1.0 / (1.0 + std::sqrt(1.0 + both * fold.squaredNorm()));
    felt_ = mean_ - (1.0 - pair_.shear[lane_]) * (up - normal * normal.dot(up)) * across.transpose() +
            growth * both * fold * (step[0] * along[0] + step[1] * along[1]).transpose();
}

} // namespace trocar::fem
