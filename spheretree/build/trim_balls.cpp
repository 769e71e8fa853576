#include "spheretree/build/trim_balls.hpp"

#include "spheretree/bounding.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr unsigned kRounds = 2, kSteps = 3;
constexpr double kFirstStep = 0.5; // of a ball's reach outside
constexpr double kGain = 1.0 - 1e-9;

/// The six ways along the axes and the eight along the diagonals.
std::array<Vec3, 14> find_directions() {
    std::array<Vec3, 14> ways;
    for (int axis = 0; axis < 3; ++axis) {
        ways[static_cast<std::size_t>(2 * axis)] = Vec3::Unit(axis);
        ways[static_cast<std::size_t>(2 * axis + 1)] = -Vec3::Unit(axis);
    }
    for (std::size_t k = 0; k < 8; ++k)
        ways[6 + k] = Vec3((k & 1U) != 0 ? 1.0 : -1.0, (k & 2U) != 0 ? 1.0 : -1.0, (k & 4U) != 0 ? 1.0 : -1.0) / std::sqrt(3.0);
    return ways;
}

/// One ball's search. Points that other balls hold as well are shared with them.
struct Trim {
    const ShellPoints& shell;
    std::span<const std::uint16_t> held_by; // [shell points] balls of the round before
    const std::vector<Index>& holds;
    const PieceSet& set;
    const BodyDepth& body;
    Ball before;       // as counted in held_by
    double most = 0.0; // m, overhang allowed

    [[nodiscard]] double radius_at(const Vec3& centre) const {
        double radius_sq = 0.0;
        for (const Index id : holds) radius_sq = std::max(radius_sq, (set.point(id) - centre).squaredNorm());
        return std::sqrt(radius_sq) * kRoundOut;
    }
    [[nodiscard]] double cost(const Vec3& centre, double radius) const {
        double sum = 0.0;
        const std::vector<Vec3>& at = shell.points();
        shell.tree().for_each_within(centre, radius, [&](Index p, double) {
            const bool mine = (at[p] - before.centre).squaredNorm() <= before.radius * before.radius;
            sum += 1.0 / (1.0 + static_cast<double>(held_by[p] - (mine ? 1 : 0)));
        });
        return sum;
    }

    [[nodiscard]] Ball run() const {
        static const std::array<Vec3, 14> kWays = find_directions();
        Ball best = before;
        best.radius = radius_at(best.centre);
        double least = cost(best.centre, best.radius), step = kFirstStep * std::max(best.overhang(), 0.0);
        for (unsigned k = 0; k < kSteps && step > 0.0; ++k, step *= 0.5)
            for (const Vec3& way : kWays) {
                Ball tried;
                tried.centre = best.centre + step * way;
                tried.radius = radius_at(tried.centre);
                const double now = cost(tried.centre, tried.radius);
                if (!(now < kGain * least)) continue;
                tried.depth = body.at(tried.centre);
                if (!(tried.depth > 0.0) || tried.overhang() > most) continue;
                best = tried;
                least = now;
            }
        return best;
    }
};

} // namespace

ShellPoints::ShellPoints(std::span<const Piece> pieces, const PieceSet& set, const BodyDepth& body, double height, std::size_t count)
    : tree_({}) {
    const auto twice_area = [&](const Piece& piece) {
        const Vec3& a = set.point(piece.corners[0]);
        return Vec3((set.point(piece.corners[1]) - a).cross(set.point(piece.corners[2]) - a));
    };
    double total = 0.0;
    for (const Piece& piece : pieces) total += twice_area(piece).norm();
    if (!(total > 0.0) || !(height > 0.0)) return;
    constexpr double kPlastic = 1.2207440846057596; // x^4 = x + 1: evenly spread triples, Roberts 2018
    constexpr double kStep[3] = {1.0 / kPlastic, 1.0 / (kPlastic * kPlastic), 1.0 / (kPlastic * kPlastic * kPlastic)};
    double due = 0.0;
    std::size_t n = 0;
    for (const Piece& piece : pieces) {
        const Vec3 normal = twice_area(piece);
        const double size = normal.norm();
        if (!(size > 0.0)) continue;
        for (due += static_cast<double>(count) * size / total; due >= 1.0; due -= 1.0, ++n) {
            double u[3];
            for (int k = 0; k < 3; ++k) u[k] = std::fmod(0.5 + static_cast<double>(n + 1) * kStep[k], 1.0);
            if (u[0] + u[1] > 1.0) u[0] = 1.0 - u[0], u[1] = 1.0 - u[1];
            const Vec3 &a = set.point(piece.corners[0]), &b = set.point(piece.corners[1]), &c = set.point(piece.corners[2]);
            points_.push_back(a + u[0] * (b - a) + u[1] * (c - a) + normal * (u[2] * height / size));
        }
    }
    std::vector<char> outside(points_.size());
    tbb::parallel_for(std::size_t{0}, points_.size(), [&](std::size_t p) { outside[p] = !body.inside().inside(points_[p]); });
    std::size_t kept = 0;
    for (std::size_t p = 0; p < points_.size(); ++p)
        if (outside[p] != 0) points_[kept++] = points_[p];
    points_.resize(kept);
    tree_ = PointTree(points_);
}

void trim_balls(const ShellPoints& shell, std::span<const std::vector<Index>> holds, const PieceSet& set, const BodyDepth& body,
                std::span<Ball> balls) {
    double most = 0.0;
    for (const Ball& ball : balls) most = std::max(most, ball.overhang());
    std::vector<std::uint16_t> held_by(shell.size());
    std::vector<Ball> trimmed(balls.size());
    for (unsigned round = 0; round < kRounds; ++round) {
        std::fill(held_by.begin(), held_by.end(), std::uint16_t{0});
        for (const Ball& ball : balls)
            shell.tree().for_each_within(ball.centre, ball.radius, [&](Index p, double) {
                if (held_by[p] < 0xffff) ++held_by[p];
            });
        tbb::parallel_for(std::size_t{0}, balls.size(), [&](std::size_t i) {
            trimmed[i] = holds[i].empty() ? balls[i] : Trim{shell, held_by, holds[i], set, body, balls[i], most}.run();
        });
        std::copy(trimmed.begin(), trimmed.end(), balls.begin());
    }
}

} // namespace trocar::spheretree
