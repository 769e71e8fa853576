#include "fem/tissue/prism_pair.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

void PrismPair::add(const PrismBatch& prism, std::size_t k, const Block<double>& edges) {
    const auto by = [&](const double(&m)[9][kBatch]) {
        Mat3 matrix;
        for (int i = 0; i < 9; ++i) matrix(i / 3, i % 3) = m[i][lane_];
        return Mat3(to_matrix(edges) * matrix);
    };
    const Mat3 part = by(prism.mean);
    mean_ += part;
    jump_ += prism.side[lane_] * part;
    bent_[k / kPrismTets] += by(prism.bend);
}

void PrismPair::complete() {
    for (std::size_t i = 0; i < 2; ++i) {
        along_[i] = Vec3(pair_.along[3 * i][lane_], pair_.along[3 * i + 1][lane_], pair_.along[3 * i + 2][lane_]);
        edge_[i] = mean_ * along_[i];
        kink_[i] = jump_ * along_[i];
    }
    across_ = along_[0].cross(along_[1]);
    up_ = mean_ * across_;
    less_ = 1.0 - pair_.shear[lane_];
    both_ = pair_.hold[lane_] * kPatchShare / kHoldShare;
    const Vec3 area = edge_[0].cross(edge_[1]);
    per_area_ = 1.0 / std::max(area.norm(), kLeastPairArea);
    normal_ = area * per_area_;
    for (std::size_t i = 0; i < 2; ++i) step_[i] = normal_.dot(kink_[i]);
    fold_ = (step_[0] * edge_[1] - step_[1] * edge_[0]).cross(normal_) * per_area_;
    root_ = std::sqrt(1.0 + both_ * fold_.squaredNorm());
    growth_ = 1.0 / (1.0 + root_);
    felt_ = mean_ - less_ * (up_ - normal_ * normal_.dot(up_)) * across_.transpose() +
            growth_ * both_ * fold_ * (step_[0] * along_[0] + step_[1] * along_[1]).transpose();
}

double PrismPair::hold_energy() const {
    double sum = 0.0;
    for (std::size_t i = 0; i < 2; ++i) {
        const double across_sq = step_[i] * step_[i];
        sum += pair_.hold[lane_] * (kink_[i].squaredNorm() - across_sq) + pair_.kink[lane_] * across_sq;
    }
    return 0.5 * sum;
}

PrismBending PrismPair::bending(std::size_t prism) const {
    const Vec3 bent[2] = {bent_[prism] * along_[0], bent_[prism] * along_[1]};
    return {edge_[0].dot(bent[0]), edge_[1].dot(bent[1]), 0.5 * (edge_[0].dot(bent[1]) + edge_[1].dot(bent[0]))};
}

void PrismPair::add_bending(std::size_t prism, const PrismBending& stress, PairStress& to) const {
    const double by[2][2] = {{stress[0], 0.5 * stress[2]}, {0.5 * stress[2], stress[1]}};
    for (std::size_t i = 0; i < 2; ++i)
        for (std::size_t j = 0; j < 2; ++j) {
            to.bent[prism] += by[i][j] * edge_[i] * along_[j].transpose();
            to.mean += by[i][j] * (bent_[prism] * along_[j]) * along_[i].transpose();
        }
}

PairStress PrismPair::pull_back(const Mat3& stress) const {
    const Vec3 pull[2] = {stress * along_[0], stress * along_[1]}, lean = stress * across_;
    // less of the leaning
    const double across = normal_.dot(lean);
    const Vec3 by_up = -less_ * (lean - normal_ * across);
    Vec3 by_normal = less_ * (normal_.dot(up_) * lean + across * up_);
    // the stretch of what is folded
    const Vec3 by_stretch = step_[0] * pull[0] + step_[1] * pull[1];
    const Vec3 by_fold = both_ * (growth_ * by_stretch - both_ * growth_ * growth_ / root_ * fold_.dot(by_stretch) * fold_);
    const Vec3 mix = step_[0] * edge_[1] - step_[1] * edge_[0], by_mix = normal_.cross(by_fold) * per_area_;
    by_normal += by_fold.cross(mix) * per_area_;
    const double by_step[2] = {growth_ * both_ * fold_.dot(pull[0]) + edge_[1].dot(by_mix), growth_ * both_ * fold_.dot(pull[1]) - edge_[0].dot(by_mix)};
    for (std::size_t i = 0; i < 2; ++i) by_normal += by_step[i] * kink_[i];
    // the normal, whose length is kept where the area is not tiny, and the area
    const bool unit = per_area_ * kLeastPairArea < 1.0;
    const Vec3 by_area = per_area_ * (by_normal - (unit ? normal_.dot(by_normal) + fold_.dot(by_fold) : 0.0) * normal_);
    const Vec3 by_edge[2] = {edge_[1].cross(by_area) - step_[1] * by_mix, by_area.cross(edge_[0]) + step_[0] * by_mix};
    PairStress s{stress + by_up * across_.transpose(), Mat3::Zero(), {Mat3::Zero(), Mat3::Zero()}};
    for (std::size_t i = 0; i < 2; ++i) {
        s.mean += by_edge[i] * along_[i].transpose();
        s.jump += by_step[i] * normal_ * along_[i].transpose();
    }
    return s;
}

} // namespace trocar::fem
