#include "engine/step/solid/surface_travel.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::engine {

SurfaceTravel find_motion(std::span<const Vec3> t0, std::span<const Vec3> t1) noexcept {
    SurfaceTravel motion;
    if (t1.empty()) return motion;
    for (std::size_t v = 0; v < t1.size(); ++v) motion.mean += t1[v] - t0[v];
    motion.mean /= static_cast<double>(t1.size());
    double spread_sq = 0.0, farthest_sq = 0.0;
    for (std::size_t v = 0; v < t1.size(); ++v) {
        const Vec3 way = t1[v] - t0[v];
        spread_sq = std::max(spread_sq, (way - motion.mean).squaredNorm());
        farthest_sq = std::max(farthest_sq, way.squaredNorm());
    }
    motion.spread = std::sqrt(spread_sq);
    motion.farthest = std::sqrt(farthest_sq);
    return motion;
}

double find_relative_way(const SurfaceTravel& a, const SurfaceTravel& b) noexcept {
    return std::min((a.mean - b.mean).norm() + a.spread + b.spread, a.farthest + b.farthest);
}

double find_thickness(std::span<const Vec3> points) {
    if (points.empty()) return 0.0;
    Vec3 middle = Vec3::Zero();
    for (const Vec3& p : points) middle += p;
    middle /= static_cast<double>(points.size());
    Mat3 spread = Mat3::Zero();
    for (const Vec3& p : points) spread += (p - middle) * (p - middle).transpose();
    const Vec3 axis = Eigen::SelfAdjointEigenSolver<Mat3>(spread).eigenvectors().col(0);
    double least = std::numeric_limits<double>::infinity(), most = -least;
    for (const Vec3& p : points) {
        least = std::min(least, axis.dot(p));
        most = std::max(most, axis.dot(p));
    }
    return most - least;
}

} // namespace trocar::engine
