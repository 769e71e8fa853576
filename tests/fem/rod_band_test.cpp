// The rod's band solver against a dense one: of any size, shorter than the band included.
#include "fem/rod/rod_band.hpp"

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace trocar::fem {
namespace {

TEST(RodBand, SolvesAsADenseSolverDoes) {
    std::mt19937_64 random(17);
    std::uniform_real_distribution<double> real(-1.0, 1.0);
    for (const std::size_t nodes : {1, 2, 3, 4, 5, 17, 60}) {
        std::vector<double> storage(3 * nodes * (kRodBandwidth + 1)), x(3 * nodes);
        RodBand band(storage, nodes);
        const auto size = static_cast<Eigen::Index>(3 * nodes);
        Eigen::MatrixXd dense = Eigen::MatrixXd::Zero(size, size);
        const auto add = [&](std::size_t i, std::size_t j, const Mat3& m) {
            dense.block<3, 3>(static_cast<Eigen::Index>(3 * i), static_cast<Eigen::Index>(3 * j)) += m;
            if (i != j) dense.block<3, 3>(static_cast<Eigen::Index>(3 * j), static_cast<Eigen::Index>(3 * i)) += m.transpose();
        };
        for (std::size_t i = 0; i < nodes; ++i) {
            const Mat3 own = Mat3::NullaryExpr([&] { return real(random); });
            const Mat3 diagonal = own * own.transpose() + 12.0 * Mat3::Identity();
            band.add(i, i, diagonal);
            add(i, i, diagonal);
            band.add(i, i, 0.5);
            add(i, i, 0.5 * Mat3::Identity());
            for (std::size_t back = 1; back <= std::min<std::size_t>(i, 2); ++back) {
                const Mat3 across = Mat3::NullaryExpr([&] { return real(random); });
                if (back == 1)
                    band.add(i, i - back, across);
                else
                    band.add(i - back, i, Mat3(across.transpose())); // named from the other side
                add(i, i - back, across);
                band.add(i - back, i, 0.25);
                add(i, i - back, 0.25 * Mat3::Identity());
            }
        }
        Eigen::VectorXd right(size);
        for (Eigen::Index k = 0; k < size; ++k) x[static_cast<std::size_t>(k)] = right[k] = real(random);
        band.solve(x);
        const Eigen::VectorXd wanted = dense.ldlt().solve(right);
        for (Eigen::Index k = 0; k < size; ++k)
            EXPECT_NEAR(x[static_cast<std::size_t>(k)], wanted[k], 1e-13) << nodes << " nodes, row " << k;
    }
}

} // namespace
} // namespace trocar::fem
