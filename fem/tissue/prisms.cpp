#include "fem/tissue/prisms.hpp"

#include "fem/tissue/patches.hpp"
#include "fem/tissue/prism_pairs.hpp"

#include <Eigen/QR>

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

constexpr double kKinkShare = 0.03; // [-] w over t^2 / h^2
constexpr double kShearReach = 0.1; // [-] 1 / s^2 = 1 + this times h^2 / t^2

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

/// Matrices whose products with the edges of a prism's outer tetrahedra have a sum that is `wanted` of its corners.
std::array<Mat3, 2> spread(const Prism& prism, std::span<const Tet> tets, std::size_t first, const SixByThree& wanted, std::span<const TetShape> shapes) {
    Eigen::Matrix<double, 6, 6> rows = Eigen::Matrix<double, 6, 6>::Zero(); // of both tetrahedra the gradient of each corner's weight
    std::array<Mat3, 2> inverse;
    for (int k = 0; k < 2; ++k) {
        const std::size_t at = first + (k == 0 ? 0 : kPrismTets - 1);
        Mat3& to = inverse[static_cast<std::size_t>(k)];
        for (int i = 0; i < 9; ++i) to(i / 3, i % 3) = shapes[at].inverse[i];
        for (std::size_t corner = 0; corner < 4; ++corner) {
            const Eigen::RowVector3d gradient = corner == 0 ? Eigen::RowVector3d(-to.colwise().sum()) : Eigen::RowVector3d(to.row(static_cast<int>(corner) - 1));
            const auto row = std::find(prism.node.begin(), prism.node.end(), tets[at][corner]) - prism.node.begin();
            rows.row(row).segment<3>(3 * k) += gradient;
        }
    }
    const Eigen::Matrix<double, 6, 3> found = rows.completeOrthogonalDecomposition().solve(wanted);
    for (int k = 0; k < 2; ++k) inverse[static_cast<std::size_t>(k)] *= found.middleRows<3>(3 * k);
    return inverse;
}

/// Of one patch, where the plan has it.
struct PatchPlace {
    std::size_t first, lane;
};

/// What a pair's prisms add up to.
struct PairShape {
    Vec3 normal = Vec3::Zero(), edge = Vec3::Zero(); // across the wall, summed; one along it
    double widest = 0.0, thickness = 0.0;            // h^2, of the wider; of the thinner, all layers of the wall

    void add(const Mat3& frame, double layers) {
        const Vec3 area = frame.col(0).cross(frame.col(1)), up = frame.col(2);
        const double height = 2.0 * std::abs(area.normalized().dot(up)) * layers;
        normal += area.dot(up) < 0.0 ? Vec3(-area) : area;
        if (edge.isZero()) edge = frame.col(0);
        thickness = widest > 0.0 ? std::min(thickness, height) : height;
        widest = std::max(widest, area.norm()); // of right triangles the square of what is between edge and edge
    }
};

class PairFiller {
public:
    PairFiller(ForcePlan& plan, std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> x, Index sheet)
        : plan_(plan), tets_(tets), shapes_(shapes), x_(x), sheet_(sheet), layers_(static_cast<double>(x.size() / sheet) - 1.0) {}

    void fill(const PatchPlace& at) {
        double whole = 0.0, share[2] = {};
        for (std::size_t k = 0; k < kPairTets; ++k) whole += volume_at(at, k), share[k / kPrismTets] += volume_at(at, k);
        if (!(whole > 0.0)) return;
        for (double& s : share) s /= whole;
        PairShape shape;
        for (std::size_t p = 0; p < (share[1] > 0.0 ? 2u : 1u); ++p) shape.add(fill_prism(at, p, share), layers_);
        PairBatch& pair = plan_.pairs[at.first / kPatch];
        const Vec3 n = shape.normal.normalized(), along = (shape.edge - n * n.dot(shape.edge)).normalized(), beside = n.cross(along);
        for (int i = 0; i < 3; ++i) pair.along[i][at.lane] = along[i], pair.along[3 + i][at.lane] = beside[i];
        const double narrow = shape.thickness * shape.thickness / shape.widest, both = share[0] * share[1];
        pair.shear[at.lane] = 1.0 / std::sqrt(1.0 + kShearReach / narrow);
        pair.hold[at.lane] = both * kHoldShare / kPatchShare;
        pair.kink[at.lane] = both * std::min(kKinkShare * narrow, kHoldShare) / kPatchShare;
        pair.volume[at.lane] = whole;
    }

private:
    [[nodiscard]] double volume_at(const PatchPlace& at, std::size_t k) const { return plan_.batches[at.first + k].volume[at.lane]; }

    Mat3 fill_prism(const PatchPlace& at, std::size_t p, const double (&share)[2]) {
        const std::size_t first = plan_.tet_of[(at.first + kPrismTets * p) * kBatch + at.lane];
        const Prism prism = prism_of(tets_, first / kPrismTets, sheet_);
        const PrismGradients g = find_gradients(prism, x_);
        const std::array<Mat3, 2> middle = spread(prism, tets_, first, g.middle, shapes_), bend = spread(prism, tets_, first, g.bend, shapes_);
        for (std::size_t k = 0; k < 2; ++k) {
            PrismBatch& to = plan_.prisms[at.first + kPrismTets * p + (k == 0 ? 0 : kPrismTets - 1)];
            for (int i = 0; i < 9; ++i) {
                to.mean[i][at.lane] = share[p] * middle[k](i / 3, i % 3);
                to.bend[i][at.lane] = std::sqrt(share[p]) * bend[k](i / 3, i % 3);
            }
            to.side[at.lane] = !(share[1] > 0.0) ? 0.0 : (p == 0 ? 1.0 : -1.0) / share[p];
        }
        return frame_of(prism, x_);
    }

    ForcePlan& plan_;
    std::span<const Tet> tets_;
    std::span<const TetShape> shapes_;
    std::span<const Vec3> x_;
    Index sheet_;
    double layers_;
};

} // namespace

void fill_prisms(ForcePlan& plan, std::span<const Tet> tets, std::span<const TetShape> shapes, std::span<const Vec3> rest_position, Index sheet) {
    plan.prisms.assign(plan.batches.size(), PrismBatch{});
    plan.pairs.assign(plan.batches.size() / kPatch, PairBatch{});
    PairFiller filler(plan, tets, shapes, rest_position, sheet);
    for (std::size_t first = 0; first < plan.batches.size(); first += kPatch)
        for (std::size_t lane = 0; lane < kBatch; ++lane) filler.fill({first, lane});
}

} // namespace trocar::fem
