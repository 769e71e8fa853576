#include "spheretree/build/medial_axis.hpp"

#include "spheretree/build/point_tree.hpp"

#include <Eigen/Geometry>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {

namespace {

/// A ball is not shrunk for a second touching point nearer to the first than this, seen from the centre: it belongs to
/// the roughness of the mesh. Larger angle: fewer, rounder balls; smaller: balls creep into the corners between facets.
constexpr double kCosSeparation = 0.5; // [-] 60 degrees: a hexagonal tube still counts as round
constexpr int kMaxShrinks = 16;        // 3 to 5 are usual
constexpr int kMaxGrowths = 8;         // steps towards the medial axis
constexpr unsigned kGrowEvery = 6;     // the axis is far shorter than the wall: a sixth of the balls finds all of it
/// [-] A ball whose innermost hundredth is free counts as touching. At its medial centre a ball touches a whole ring of
/// wall: a stricter test would examine every triangle of the ring.
constexpr double kTouch = 0.01;
constexpr std::size_t kPilots = 4000; // balls that measure the local radius
constexpr double kPilotReach = 1.1;   // of a pilot ball's radius: wall so near to it is as wide as the ball

class BallFinder {
public:
    BallFinder(const TriMesh& wall, const InsideTest& inside) : wall_(wall), inside_(inside) {
        normals_.reserve(wall.triangles.size());
        for (const Triangle& t : wall.triangles)
            normals_.push_back((wall.vertices[t[1]] - wall.vertices[t[0]]).cross(wall.vertices[t[2]] - wall.vertices[t[0]]).normalized());
        largest_ = 0.5 * wall.bounds().longest_edge();
    }

    [[nodiscard]] const Vec3& normal(Index triangle) const { return normals_[triangle]; }

    /// Shrinks the ball that touches p until nothing of the wall but roughness is inside it. Empty where p is in a corner
    /// that no ball reaches.
    /// start  m, guess of the radius
    [[nodiscard]] Sphere shrink(const Vec3& p, const Vec3& inward, double start) const {
        double radius = std::min(start, largest_);
        bool guessing = true; // a guess that is free may have been too small
        for (int i = 0; i < kMaxShrinks; ++i) {
            const Vec3 centre = p + inward * radius;
            const auto hit = inside_.tree().closest(centre, radius * (1.0 - kTouch));
            if (!hit && guessing && radius < largest_) {
                radius = std::min(2.0 * radius, largest_);
                continue;
            }
            if (!hit) return {centre, radius * (1.0 - kTouch)};
            guessing = false;
            const Vec3 to_hit = hit->point - p;
            const double along = to_hit.dot(inward);
            const bool seen_from_inside = (centre - hit->point).dot(normals_[hit->triangle]) < 0.0;
            const double cosine = (hit->point - centre).dot(p - centre) / std::max(hit->distance * radius, 1e-300);
            if (seen_from_inside && cosine > kCosSeparation) return {centre, hit->distance};
            const double smaller = to_hit.squaredNorm() / (2.0 * along);
            if (!(along > 0.0) || !(smaller < radius)) return {};
            radius = smaller;
        }
        return {};
    }

    /// Walks away from the nearest wall as long as that makes the ball larger.
    [[nodiscard]] Sphere grow(Sphere ball) const {
        double step = 0.25 * ball.radius;
        auto hit = inside_.tree().closest(ball.centre);
        for (int i = 0; i < kMaxGrowths && hit && hit->distance > 0.0; ++i) {
            const Vec3 centre = ball.centre + (ball.centre - hit->point) * (step / hit->distance);
            const auto next = inside_.tree().closest(centre);
            if (next && next->distance > ball.radius * 1.001) {
                ball = {centre, next->distance};
                hit = next;
            } else {
                step *= 0.4;
            }
        }
        return ball;
    }

    [[nodiscard]] bool is_free(const Sphere& ball, double min_radius) const {
        return ball.radius >= min_radius && inside_.inside(ball.centre);
    }

private:
    const TriMesh& wall_;
    const InsideTest& inside_;
    std::vector<Vec3> normals_; // [triangle_count] unit, outward
    double largest_ = 0.0;      // m
};

/// Centres of the n * n congruent parts of a triangle, as weights of its corners.
std::vector<Vec3> part_centres(unsigned n) {
    std::vector<Vec3> weights;
    for (unsigned i = 0; i < n; ++i)
        for (unsigned j = 0; i + j < n; ++j) {
            weights.emplace_back(Vec3(i + 1.0 / 3, j + 1.0 / 3, n - i - j - 2.0 / 3) / n);
            if (i + j + 1 < n) weights.emplace_back(Vec3(i + 2.0 / 3, j + 2.0 / 3, n - i - j - 4.0 / 3) / n);
        }
    return weights;
}

struct Spot { // a place to sample
    Vec3 point;
    Index triangle;
};

Vec3 triangle_centre(const TriMesh& wall, Index t) {
    const Triangle& v = wall.triangles[t];
    return (wall.vertices[v[0]] + wall.vertices[v[1]] + wall.vertices[v[2]]) / 3.0;
}

/// Radius of the largest pilot ball near each triangle; the median pilot where none is near.
std::vector<double> find_local_radius(const TriMesh& wall, const BallFinder& finder, double min_radius) {
    std::vector<Vec3> centres;
    for (Index t = 0; t < wall.triangles.size(); ++t) centres.push_back(triangle_centre(wall, t));
    const PointTree tree(centres);
    std::vector<double> local(wall.triangles.size(), 0.0), found;
    double guess = 0.05 * wall.bounds().longest_edge();
    const std::size_t stride = wall.triangles.size() / kPilots + 1;
    for (std::size_t t = 0; t < wall.triangles.size(); t += stride) {
        const auto id = static_cast<Index>(t);
        const Sphere ball = finder.shrink(centres[t], -finder.normal(id), 2.0 * guess);
        if (!finder.is_free(ball, min_radius)) continue;
        guess = ball.radius;
        found.push_back(ball.radius);
        tree.for_each_within(ball.centre, kPilotReach * ball.radius, [&](Index i, double) { local[i] = std::max(local[i], ball.radius); });
    }
    std::sort(found.begin(), found.end());
    const double median = found.empty() ? min_radius : found[found.size() / 2];
    for (double& radius : local)
        if (radius == 0.0) radius = median;
    return local;
}

/// Parts of large triangles, whole small ones.
std::vector<Spot> propose_spots(const TriMesh& wall, std::span<const double> local, double spacing) {
    std::vector<Spot> spots;
    for (Index t = 0; t < wall.triangles.size(); ++t) {
        const Triangle& v = wall.triangles[t];
        const Vec3 &a = wall.vertices[v[0]], &b = wall.vertices[v[1]], &c = wall.vertices[v[2]];
        const double longest = std::sqrt(std::max({(a - b).squaredNorm(), (b - c).squaredNorm(), (c - a).squaredNorm()}));
        const auto parts = static_cast<unsigned>(std::clamp(longest / (spacing * local[t]), 1.0, 32.0));
        for (const Vec3& w : part_centres(parts)) spots.push_back({w[0] * a + w[1] * b + w[2] * c, t});
    }
    return spots;
}

/// Drops spots that are nearer to an earlier one than the spacing allows.
std::vector<Spot> thin_out(std::span<const Spot> spots, std::span<const double> local, double spacing) {
    std::vector<Vec3> points;
    for (const Spot& s : spots) points.push_back(s.point);
    const PointTree tree(points);
    std::vector<char> dropped(spots.size(), 0);
    std::vector<Spot> kept;
    for (Index i = 0; i < spots.size(); ++i) {
        if (dropped[i]) continue;
        kept.push_back(spots[i]);
        tree.for_each_within(points[i], 0.6 * spacing * local[spots[i].triangle], [&](Index k, double) { dropped[k] = 1; });
    }
    return kept;
}

/// Spacing at which about max_samples spots are left: a spot takes about half a spacing squared after thinning.
double affordable_spacing(const TriMesh& wall, std::span<const double> local, const SampleOptions& options) {
    double spots = 0.0;
    for (Index t = 0; t < wall.triangles.size(); ++t) {
        const Triangle& v = wall.triangles[t];
        const Vec3& a = wall.vertices[v[0]];
        const double area = 0.5 * (wall.vertices[v[1]] - a).cross(wall.vertices[v[2]] - a).norm();
        spots += area / (0.5 * options.spacing * options.spacing * local[t] * local[t]);
    }
    return options.spacing * std::sqrt(std::max(1.0, spots / static_cast<double>(std::max<std::size_t>(options.max_samples, 1))));
}

} // namespace

MedialBalls find_medial_balls(const TriMesh& wall, const InsideTest& inside, const SampleOptions& options) {
    MedialBalls found;
    const BallFinder finder(wall, inside);
    const std::vector<double> local = find_local_radius(wall, finder, options.min_radius);
    const double spacing = affordable_spacing(wall, local, options);
    const std::vector<Spot> spots = thin_out(propose_spots(wall, local, spacing), local, spacing);
    std::vector<Sphere> shrunk(spots.size()); // radius 0: not free
    tbb::parallel_for(std::size_t{0}, spots.size(), [&](std::size_t i) {
        const Sphere ball = finder.shrink(spots[i].point, -finder.normal(spots[i].triangle), 1.5 * local[spots[i].triangle]);
        shrunk[i] = finder.is_free(ball, options.min_radius) ? ball : Sphere{};
    });
    for (std::size_t i = 0; i < spots.size(); ++i) {
        WallSample sample{spots[i].point, -finder.normal(spots[i].triangle), local[spots[i].triangle], 0.0, 0.0};
        const Sphere ball = shrunk[i];
        if (ball.radius > 0.0) {
            sample.radius = ball.radius;
            sample.deficit = std::max(0.0, (sample.point - ball.centre).norm() - ball.radius);
            found.balls.push_back(ball);
            if (found.balls.size() % kGrowEvery == 0) { // never crosses the wall: steps are shorter than the radius
                const Sphere grown = finder.grow(ball);
                if (grown.radius > ball.radius) found.balls.push_back(grown);
            }
        }
        found.samples.push_back(sample);
    }
    return found;
}

} // namespace trocar::spheretree
