#include "fem/tissue/prisms.hpp"

#include "fem/tissue/patches.hpp"
#include "fem/tissue/prism_pairs.hpp"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

constexpr double kHoldShare = 0.03, kLeastHold = 0.005; // [-] w: this times (height / edge)^2, between the least and kPatchShare

using SixByThree = Eigen::Matrix<double, 6, 3>;

/// Of the six corners: the gradient at the middle, and how it changes along zeta, without what a body that is only stretched has of it, and across the face.
struct PrismGradients {
    SixByThree middle, bend;
};

PrismGradients find_gradients(const Prism& prism, std::span<const Vec3> x) {
    const Mat3 frame = frame_of(prism, x), inverse = frame.inverse();
    SixByThree middle = SixByThree::Zero(), change = SixByThree::Zero(), corner;
    for (int k = 0; k < 3; ++k)
        for (const int up : {0, 1}) {
            const Vec3 along(k == 0 ? -0.5 : k == 1 ? 0.5 : 0.0, k == 0 ? -0.5 : k == 2 ? 0.5 : 0.0, 0.0);
            middle.row(k + 3 * up) = along + Vec3(0.0, 0.0, up == 1 ? 1.0 / 6.0 : -1.0 / 6.0);
            change.row(k + 3 * up) = up == 1 ? along : Vec3(-along);
            corner.row(k + 3 * up) = x[prism.node[static_cast<std::size_t>(k + 3 * up)]] - x[prism.node[0]];
        }
    PrismGradients g{middle * inverse, change * inverse};
    g.bend -= g.middle * (corner.transpose() * g.bend);
    const Vec3 n = normal_of(frame);
    g.bend = g.bend * (Mat3::Identity() - n * n.transpose());
    return g;
}

/// [3] matrices whose products with the gradients of a prism's tetrahedra have a sum that is `wanted` of its corners.
std::array<Mat3, 3> spread(const Prism& prism, std::span<const Tet> tets, std::span<const TetShape> shapes, std::size_t first, const SixByThree& wanted) {
    Eigen::Matrix<double, 6, 9> rows = Eigen::Matrix<double, 6, 9>::Zero(); // of every tetrahedron the gradient of each corner's weight
    for (int k = 0; k < 3; ++k)
        for (std::size_t corner = 0; corner < 4; ++corner) {
            const Tet& tet = tets[first + static_cast<std::size_t>(k)];
            const double* inverse = shapes[first + static_cast<std::size_t>(k)].inverse;
            Vec3 gradient = Vec3::Zero();
            for (int c = 0; c < 3; ++c)
                if (corner == 0 || corner == static_cast<std::size_t>(c) + 1)
                    for (int i = 0; i < 3; ++i) gradient[i] += (corner == 0 ? -1.0 : 1.0) * inverse[3 * c + i];
            const auto at = std::find(prism.node.begin(), prism.node.end(), tet[corner]) - prism.node.begin();
            for (int i = 0; i < 3; ++i) rows(at, 3 * k + i) += gradient[i];
        }
    const Eigen::Matrix<double, 9, 3> found = rows.completeOrthogonalDecomposition().solve(wanted);
    return {found.topRows<3>(), found.middleRows<3>(3), found.bottomRows<3>()};
}

/// Of one patch, where the plan has it.
struct PatchPlace {
    std::size_t first, lane;
};

void fill_patch(ForcePlan& plan, const PatchPlace& at, std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> x, Index sheet) {
    const auto volume_at = [&](std::size_t k) { return plan.batches[at.first + k].volume[at.lane]; };
    const auto tet_at = [&](std::size_t k) { return plan.tet_of[(at.first + k) * kBatch + at.lane]; };
    double whole = 0.0, share[2] = {}, hold = 1.0;
    for (std::size_t k = 0; k < 6; ++k) whole += volume_at(k), share[k / 3] += volume_at(k);
    if (!(whole > 0.0)) return;
    for (double& s : share) s /= whole;
    const bool pair = share[1] > 0.0;
    for (std::size_t p = 0; p < (pair ? 2u : 1u); ++p) {
        const std::size_t first = tet_at(3 * p);
        const Prism prism = prism_of(tets, first / 3, sheet);
        const PrismGradients g = find_gradients(prism, x);
        const std::array<Mat3, 3> middle = spread(prism, tets, shapes, first, g.middle), bend = spread(prism, tets, shapes, first, g.bend);
        for (std::size_t k = 0; k < 3; ++k) {
            PrismBatch& to = plan.prisms[at.first + 3 * p + k];
            for (int i = 0; i < 9; ++i) {
                to.mean[i][at.lane] = share[p] * middle[k](i / 3, i % 3);
                to.bend[i][at.lane] = std::sqrt(share[p]) * bend[k](i / 3, i % 3);
            }
            to.side[at.lane] = !pair ? 0.0 : (p == 0 ? 1.0 : -1.0) / share[p];
        }
        const Mat3 frame = frame_of(prism, x);
        const double area = frame.col(0).cross(frame.col(1)).norm(), height = 2.0 * std::abs(normal_of(frame).dot(frame.col(2)));
        hold = std::min(hold, height * height / area); // of right triangles: the square of what is between edge and edge
    }
    hold = std::clamp(kHoldShare * hold, kLeastHold, kPatchShare) / kPatchShare * share[0] * share[1];
    for (std::size_t k = 0; k < kPatch; ++k) {
        plan.prisms[at.first + k].volume[at.lane] = whole;
        plan.prisms[at.first + k].hold[at.lane] = hold;
    }
}

} // namespace

void fill_prisms(ForcePlan& plan, std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> rest_position, Index sheet) {
    plan.prisms.assign(plan.batches.size(), PrismBatch{});
    for (std::size_t first = 0; first < plan.batches.size(); first += kPatch)
        for (std::size_t lane = 0; lane < kBatch; ++lane) fill_patch(plan, {first, lane}, tets, shapes, rest_position, sheet);
}

} // namespace trocar::fem
