#include "spheretree/build/cover_selection.hpp"

#include "spheretree/build/point_tree.hpp"

#include <algorithm>
#include <cmath>
#include <queue>

namespace trocar::spheretree {

namespace {

constexpr double kFarthestLimit = 0.25; // of a ball's radius: samples deeper than this in a corner stay uncovered
constexpr double kOwnBallSlack = 1.02;  // [-] a sample that its own ball misses by more than the limit accepts balls as good

class Cover {
public:
    Cover(const MedialBalls& medial, const CoverLimits& limits)
        : balls_(medial.balls), limits_(limits), tree_(points_of(medial)), open_(medial.samples.size(), 0) {
        limit_.reserve(medial.samples.size());
        for (std::size_t i = 0; i < medial.samples.size(); ++i) {
            const WallSample& s = medial.samples[i];
            const double width = std::min(s.local_radius, 2.0 * s.radius);
            limit_.push_back(std::max({limits.relative_error * width, limits.error_floor, kOwnBallSlack * s.deficit}));
            open_[i] = s.radius > 0.0 && s.radius >= limits.corner_ratio * s.local_radius;
        }
        for (const double l : limit_) largest_limit_ = std::max(largest_limit_, l);
    }

    template <class Visit>
    void for_each_covered(Index ball, Visit&& visit) const {
        const Sphere& b = balls_[ball];
        const double reach = std::min(largest_limit_, std::max(kFarthestLimit * b.radius, 4.0 * limits_.error_floor));
        tree_.for_each_within(b.centre, b.radius + reach, [&](Index sample, double distance_sq) {
            const double limit = b.radius + limit_[sample];
            if (open_[sample] && distance_sq <= limit * limit) visit(sample);
        });
    }
    [[nodiscard]] std::size_t gain(Index ball) const {
        std::size_t count = 0;
        for_each_covered(ball, [&](Index) { ++count; });
        return count;
    }
    void close(Index ball) {
        closed_.clear();
        for_each_covered(ball, [&](Index sample) { closed_.push_back(sample); });
        for (const Index sample : closed_) open_[sample] = 0;
    }

private:
    static std::vector<Vec3> points_of(const MedialBalls& medial) {
        std::vector<Vec3> points;
        points.reserve(medial.samples.size());
        for (const WallSample& s : medial.samples) points.push_back(s.point);
        return points;
    }

    std::span<const Sphere> balls_;
    CoverLimits limits_;
    PointTree tree_;
    std::vector<double> limit_; // [sample_count] m
    std::vector<char> open_;    // [sample_count]
    std::vector<Index> closed_;
    double largest_limit_ = 0.0;
};

struct Candidate {
    std::size_t gain = 0;
    double radius = 0.0;
    Index ball = kNoIndex;
    [[nodiscard]] bool operator<(const Candidate& other) const {
        if (gain != other.gain) return gain < other.gain;
        if (radius != other.radius) return radius < other.radius;
        return ball > other.ball;
    }
};

class UnionFind {
public:
    explicit UnionFind(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), Index{0}); }
    Index find(Index i) {
        while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
        return i;
    }
    bool join(Index a, Index b) {
        a = find(a);
        b = find(b);
        if (a == b) return false;
        parent_[std::max(a, b)] = std::min(a, b);
        return true;
    }

private:
    std::vector<Index> parent_;
};

std::vector<Vec3> centres_of(std::span<const Sphere> balls) {
    std::vector<Vec3> centres;
    centres.reserve(balls.size());
    for (const Sphere& b : balls) centres.push_back(b.centre);
    return centres;
}

/// Deep enough for something to pass from one to the other.
bool passable(const Sphere& a, const Sphere& b) {
    return (a.centre - b.centre).norm() < a.radius + b.radius - 0.1 * std::min(a.radius, b.radius);
}

double largest_radius(std::span<const Sphere> balls) {
    double largest = 0.0;
    for (const Sphere& b : balls) largest = std::max(largest, b.radius);
    return largest;
}

/// Adds candidates that touch two components which nothing chosen connects, larger ones first.
void connect(std::span<const Sphere> balls, std::vector<Index>& chosen) {
    std::vector<Sphere> picked;
    for (const Index c : chosen) picked.push_back(balls[c]);
    std::size_t count = 0;
    const std::vector<Index> component = find_components(picked, count);
    if (count < 2) return;
    UnionFind joined(count);
    std::vector<Index> order(balls.size());
    std::iota(order.begin(), order.end(), Index{0});
    std::sort(order.begin(), order.end(),
              [&](Index a, Index b) { return balls[a].radius != balls[b].radius ? balls[a].radius > balls[b].radius : a < b; });
    const PointTree tree(centres_of(picked));
    const double largest = largest_radius(picked);
    for (const Index candidate : order) {
        bool bridges = false;
        Index first = kNoIndex;
        tree.for_each_within(balls[candidate].centre, balls[candidate].radius + largest, [&](Index k, double) {
            if (!passable(picked[k], balls[candidate])) return;
            if (first == kNoIndex)
                first = component[k];
            else
                bridges = joined.join(first, component[k]) || bridges;
        });
        if (bridges) chosen.push_back(candidate);
    }
}

} // namespace

std::vector<Index> find_components(std::span<const Sphere> balls, std::size_t& count) {
    UnionFind sets(balls.size());
    const PointTree tree(centres_of(balls));
    const double largest = largest_radius(balls);
    for (Index i = 0; i < balls.size(); ++i)
        tree.for_each_within(balls[i].centre, balls[i].radius + std::min(largest, balls[i].radius), [&](Index k, double) {
            if (k != i && balls[k].radius <= balls[i].radius && passable(balls[i], balls[k])) sets.join(i, k);
        });
    std::vector<Index> component(balls.size(), kNoIndex);
    count = 0;
    for (Index i = 0; i < balls.size(); ++i) {
        const Index root = sets.find(i);
        if (component[root] == kNoIndex) component[root] = static_cast<Index>(count++);
        component[i] = component[root];
    }
    return component;
}

std::vector<Index> select_cover(const MedialBalls& medial, const CoverLimits& limits) {
    Cover cover(medial, limits);
    std::priority_queue<Candidate> queue;
    for (Index b = 0; b < medial.balls.size(); ++b)
        if (const std::size_t gain = cover.gain(b); gain > 0) queue.push({gain, medial.balls[b].radius, b});
    std::vector<Index> chosen;
    while (!queue.empty()) {
        Candidate best = queue.top();
        queue.pop();
        const std::size_t gain = cover.gain(best.ball); // gains only fall: a top that keeps its gain is the best of all
        if (gain == 0) continue;
        if (gain < best.gain) {
            best.gain = gain;
            queue.push(best);
            continue;
        }
        cover.close(best.ball);
        chosen.push_back(best.ball);
    }
    connect(medial.balls, chosen);
    return chosen;
}

} // namespace trocar::spheretree
