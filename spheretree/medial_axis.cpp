#include "spheretree/medial_axis.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>

namespace seldinger::spheretree {

namespace {

/// A ball is not shrunk for a second touching point nearer to the first than this, seen from the centre: it belongs to
/// the roughness of the mesh. Larger: fewer, rounder balls; smaller: balls creep into the corners between facets.
constexpr double kCosSeparation = 0.8;     // [-] about 37 degrees
constexpr int kMaxShrinks = 12;            // each at least halves the excess in practice; 3 to 5 are usual
constexpr int kMaxGrowths = 8;             // steps towards the medial axis
constexpr double kTouch = 1e-6;            // [-] relative: a ball whose excess is below this counts as touching
constexpr unsigned kGrowEvery = 3;         // every third ball is also grown: the axis is far shorter than the wall
constexpr double kSampleSpacing = 0.4;     // of the local radius: triangles longer than this get more samples

class BallFinder {
public:
    BallFinder(const TriMesh& wall, const InsideTest& inside) : wall_(wall), inside_(inside) {
        normals_.reserve(wall.triangles.size());
        for (const Triangle& t : wall.triangles)
            normals_.push_back((wall.vertices[t[1]] - wall.vertices[t[0]])
                                   .cross(wall.vertices[t[2]] - wall.vertices[t[0]]).normalized());
        largest_ = 0.5 * wall.bounds().longest_edge();
    }

    [[nodiscard]] const Vec3& normal(Index triangle) const { return normals_[triangle]; }
    [[nodiscard]] double distance(const Vec3& p) const {
        const auto hit = inside_.tree().closest(p);
        return hit ? hit->distance : 0.0;
    }

    /// Shrinks the ball that touches p until nothing of the wall but roughness is inside it.
    /// start  m, guess of the radius, not too small
    [[nodiscard]] Sphere shrink(const Vec3& p, const Vec3& inward, double start) const {
        double radius = std::min(start, largest_);
        for (int i = 0; i < kMaxShrinks; ++i) {
            const Vec3 centre = p + inward * radius;
            const auto hit = inside_.tree().closest(centre, radius * (1.0 + kTouch));
            if (!hit || hit->distance >= radius * (1.0 - kTouch)) {
                if (i > 0 || radius >= largest_) return {centre, hit ? hit->distance : radius};
                radius = std::min(2.0 * radius, largest_); // the guess was free: it may have been too small
                i = -1;
                continue;
            }
            const Vec3 to_hit = hit->point - p;
            const double along = to_hit.dot(inward);
            const bool seen_from_inside = (centre - hit->point).dot(normals_[hit->triangle]) < 0.0;
            const double cosine = (hit->point - centre).dot(p - centre) / std::max(hit->distance * radius, 1e-300);
            if (seen_from_inside && cosine > kCosSeparation) return {centre, hit->distance};
            if (!(along > 0.0)) return {};
            const double smaller = to_hit.squaredNorm() / (2.0 * along);
            if (!(smaller < radius)) return {centre, hit->distance};
            radius = smaller;
        }
        const Vec3 centre = p + inward * radius;
        return {centre, distance(centre)};
    }

    /// Walks away from the nearest wall as long as that makes the ball larger.
    [[nodiscard]] Sphere grow(Sphere ball) const {
        double step = 0.25 * ball.radius;
        auto hit = inside_.tree().closest(ball.centre);
        for (int i = 0; i < kMaxGrowths && hit && hit->distance > 0.0; ++i) {
            const Vec3 centre = ball.centre + (ball.centre - hit->point) * (step / hit->distance);
            const auto next = inside_.tree().closest(centre);
            if (next && next->distance > ball.radius * (1.0 + 1e-4)) {
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

std::vector<Vec3> vertex_normals(const TriMesh& wall) {
    std::vector<Vec3> normal(wall.vertices.size(), Vec3::Zero());
    for (const Triangle& t : wall.triangles) {
        const Vec3& a = wall.vertices[t[0]];
        const Vec3 area = (wall.vertices[t[1]] - a).cross(wall.vertices[t[2]] - a);
        for (const Index v : t) normal[v] += area;
    }
    return normal;
}

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

class Sampler {
public:
    Sampler(const BallFinder& finder, double min_radius, MedialBalls& out)
        : finder_(finder), min_radius_(min_radius), out_(out) {}

    /// guess  m, in: where to start shrinking; out: the radius that was found
    void add(const Vec3& p, const Vec3& inward, double& guess) {
        WallSample sample{p, inward, 0.0, 0.0};
        const Sphere ball = finder_.shrink(p, inward, 2.0 * guess);
        if (finder_.is_free(ball, min_radius_)) {
            guess = ball.radius;
            sample.radius = ball.radius;
            sample.deficit = std::max(0.0, (p - ball.centre).norm() - ball.radius);
            out_.balls.push_back(ball);
            if (out_.balls.size() % kGrowEvery == 0) add_grown(ball);
        }
        out_.samples.push_back(sample);
    }

private:
    void add_grown(const Sphere& ball) {
        const Sphere grown = finder_.grow(ball); // never crosses the wall: steps are shorter than the radius
        if (grown.radius > ball.radius) out_.balls.push_back(grown);
    }

    const BallFinder& finder_;
    double min_radius_;
    MedialBalls& out_;
};

} // namespace

MedialBalls find_medial_balls(const TriMesh& wall, const InsideTest& inside, double min_radius, std::size_t max_samples) {
    MedialBalls found;
    const BallFinder finder(wall, inside);
    Sampler sampler(finder, min_radius, found);
    double guess = 0.05 * wall.bounds().longest_edge();
    const std::size_t triangle_stride = wall.triangles.size() / std::max<std::size_t>(max_samples, 1) + 1;
    for (Index t = 0; t < wall.triangles.size(); t += static_cast<Index>(triangle_stride)) {
        const Triangle& corners = wall.triangles[t];
        const Vec3 &a = wall.vertices[corners[0]], &b = wall.vertices[corners[1]], &c = wall.vertices[corners[2]];
        sampler.add((a + b + c) / 3.0, -finder.normal(t), guess);
        const double longest = std::sqrt(std::max({(a - b).squaredNorm(), (b - c).squaredNorm(), (c - a).squaredNorm()}));
        const double local = std::max(found.samples.back().radius, min_radius);
        const auto parts = static_cast<unsigned>(std::clamp(longest / (kSampleSpacing * local), 1.0, 16.0));
        if (parts < 2 || found.samples.size() + std::size_t{parts} * parts > max_samples) continue;
        for (const Vec3& w : part_centres(parts)) sampler.add(w[0] * a + w[1] * b + w[2] * c, -finder.normal(t), guess);
    }
    const std::vector<Vec3> normals = vertex_normals(wall);
    for (Index v = 0; v < wall.vertices.size() && found.samples.size() < max_samples; ++v)
        if (normals[v].squaredNorm() > 0.0) sampler.add(wall.vertices[v], -normals[v].normalized(), guess);
    return found;
}

} // namespace seldinger::spheretree
