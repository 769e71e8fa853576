#include "spheretree/build/level_cover.hpp"

#include "spheretree/build/ball_cover.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr double kFirstShare = 0.3;  // of a parent's children are found by its own greedy cover, the rest by splitting
constexpr double kSplitShare = 0.12; // of the balls are split at a time
constexpr unsigned kRoundsPerSplit = 2, kLastRounds = 10, kLevelFitSteps = 8;
constexpr double kGain = 0.995;
constexpr unsigned kRoundsWithoutGain = 6;
constexpr std::size_t kPatience = 24;  // splits tried in vain
constexpr std::size_t kMoveShare = 16; // one ball of so many is moved at a time
constexpr unsigned kMoveTries = 8;
constexpr std::size_t kClaimGroups = 8, kClaimBalls = 32; // of share_out: fewer balls than that are not worth a thread

struct LevelShares {
    std::vector<Index> begin; // [balls + 1]
    std::vector<Index> ids;   // points, by ball
    [[nodiscard]] std::span<const Index> of(std::size_t ball) const {
        return std::span(ids).subspan(begin[ball], begin[ball + 1] - begin[ball]);
    }
};

double need_of(const Ball& ball, const Vec3& p) { return (p - ball.centre).norm() - ball.depth; }

LevelShares list_shares(std::span<const Index> owner, std::size_t balls) {
    LevelShares shares{std::vector<Index>(balls + 1, 0), std::vector<Index>(owner.size())};
    for (const Index ball : owner) ++shares.begin[ball + 1];
    for (std::size_t i = 1; i < shares.begin.size(); ++i) shares.begin[i] += shares.begin[i - 1];
    std::vector<Index> at(shares.begin.begin(), shares.begin.end() - 1);
    for (Index p = 0; p < owner.size(); ++p) shares.ids[at[owner[p]]++] = p;
    return shares;
}

/// What some of the balls would take over.
struct Claims {
    std::vector<double> need; // [points] m, least so far
    std::vector<Index> ball;  // [points] kNoIndex: none of these needs less than the owner
};

/// Owners anew. A point stays with its owner where no other allowed ball needs less; of equal ones the first gets it. Groups of balls
/// claim side by side, and the first group with the least need wins: the same for any number of groups.
void share_out(const LevelTask& task, LevelBalls& level) {
    const std::vector<Vec3>& points = task.points.points();
    std::vector<double> least(points.size()), most;
    for (Index p = 0; p < points.size(); ++p) least[p] = need_of(level.balls[level.owner[p]], points[p]);
    task.points.tree().find_most(least, most);
    std::vector<Claims> groups(std::min<std::size_t>(kClaimGroups, level.balls.size() / kClaimBalls + 1));
    tbb::parallel_for(std::size_t{0}, groups.size(), [&](std::size_t g) {
        Claims& claims = groups[g];
        claims.need = least;
        claims.ball.assign(points.size(), kNoIndex);
        const std::size_t end = level.balls.size() * (g + 1) / groups.size();
        for (auto i = static_cast<Index>(level.balls.size() * g / groups.size()); i < end; ++i) {
            const Ball& ball = level.balls[i];
            task.points.tree().for_each_below(ball.centre, ball.depth, most, [&](Index p, double distance_sq) {
                const double need = std::sqrt(distance_sq) - ball.depth;
                if (need < claims.need[p] && task.points.allowed(p, level.parent[i])) {
                    claims.need[p] = need;
                    claims.ball[p] = i;
                }
            });
        }
    });
    for (const Claims& claims : groups)
        for (Index p = 0; p < points.size(); ++p)
            if (claims.ball[p] != kNoIndex && claims.need[p] < least[p]) {
                least[p] = claims.need[p];
                level.owner[p] = claims.ball[p];
            }
}

/// Radii that hold the shares; balls without a point go.
LevelShares settle(const LevelTask& task, LevelBalls& level) {
    level.fitted.resize(level.balls.size(), 0);
    share_out(task, level);
    LevelShares shares = list_shares(level.owner, level.balls.size());
    const std::vector<Vec3>& points = task.points.points();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, level.balls.size(), kClaimBalls), [&](const auto& range) {
        for (std::size_t i = range.begin(); i < range.end(); ++i) {
            double radius_sq = 0.0;
            for (const Index id : shares.of(i)) radius_sq = std::max(radius_sq, (points[id] - level.balls[i].centre).squaredNorm());
            level.balls[i].radius = std::sqrt(radius_sq);
        }
    });
    std::vector<Index> renumbered(level.balls.size(), kNoIndex);
    Index kept = 0;
    for (std::size_t i = 0; i < level.balls.size(); ++i) {
        if (shares.of(i).empty()) continue;
        level.balls[kept] = level.balls[i];
        level.parent[kept] = level.parent[i];
        level.fitted[kept] = level.fitted[i];
        renumbered[i] = kept++;
    }
    if (kept == level.balls.size()) return shares;
    level.balls.resize(kept);
    level.parent.resize(kept);
    level.fitted.resize(kept);
    for (Index& owner : level.owner) owner = renumbered[owner];
    return list_shares(level.owner, kept);
}

std::uint64_t checksum(std::span<const Index> ids) {
    std::uint64_t sum = 0xcbf29ce484222325ULL; // FNV-1a
    for (const Index id : ids) sum = (sum ^ id) * 0x100000001b3ULL;
    return sum | 1U;
}

/// Fits the balls whose points are not those they were fitted to, in parallel: they are independent. False: there are none.
bool fit_changed(const LevelTask& task, const LevelShares& shares, const BodyDepth& body, LevelBalls& level) {
    std::vector<std::size_t> changed;
    for (std::size_t i = 0; i < level.balls.size(); ++i)
        if (const std::uint64_t sum = checksum(shares.of(i)); sum != level.fitted[i]) {
            level.fitted[i] = sum;
            changed.push_back(i);
        }
    tbb::parallel_for(std::size_t{0}, changed.size(), [&](std::size_t k) {
        const std::size_t i = changed[k];
        level.balls[i] = fit_ball(level.balls[i], task.points.points(), shares.of(i), body, kLevelFitSteps);
    });
    return !changed.empty();
}

double area_of(const LevelTask& task, std::span<const Index> ids) {
    double area = 0.0;
    for (const Index id : ids) area += task.points.areas()[id];
    return area;
}

struct LevelScore {
    double first = 0.0, second = 0.0;
    [[nodiscard]] bool better_than(const LevelScore& other) const {
        return first < 0.999 * other.first || (first <= 1.001 * other.first && second < other.second);
    }
};

LevelScore judge(const LevelTask& task, const LevelShares& shares, std::span<const Ball> balls) {
    LevelScore score;
    double volume = 0.0;
    for (std::size_t i = 0; i < balls.size(); ++i) volume += area_of(task, shares.of(i)) * std::max(balls[i].overhang(), 0.0);
    score = {largest_overhang(balls), volume};
    if (task.aim == LevelAim::LeastVolume) std::swap(score.first, score.second);
    return score;
}

/// The candidate that holds the far half of a share best, or the place itself.
Ball find_second(const LevelTask& task, const Ball& ball, std::span<const Index> half, Index far) {
    const std::vector<Vec3>& points = task.points.points();
    Ball best{points[far], 0.0, 0.0};
    double least = std::numeric_limits<double>::infinity();
    const double limit = ball.overhang();
    for (const Ball& candidate : task.candidates) {
        double need = need_of(candidate, points[far]);
        if (need > limit) continue;
        for (std::size_t k = 0; k < half.size() && need < least; ++k) need = std::max(need, need_of(candidate, points[half[k]]));
        if (need < least) {
            least = need;
            best = candidate;
        }
    }
    return best;
}

/// Points of a share that lie farther than its middle, seen towards its point farthest from the ball's centre.
std::vector<Index> far_half(const LevelTask& task, const Ball& ball, std::span<const Index> share, Index& far) {
    const std::vector<Vec3>& points = task.points.points();
    far = share.front();
    Vec3 middle = Vec3::Zero();
    for (const Index id : share) {
        middle += points[id] / static_cast<double>(share.size());
        if ((points[id] - ball.centre).squaredNorm() > (points[far] - ball.centre).squaredNorm()) far = id;
    }
    const Vec3 axis = points[far] - middle;
    std::vector<Index> half;
    for (const Index id : share)
        if (id == far || (points[id] - middle).dot(axis) > 0.0) half.push_back(id);
    return half;
}

/// A parent with a free child slot that holds most of these points, the present one first. kNoIndex: none holds any.
Index find_parent(const LevelTask& task, std::span<const Index> ids, Index present, std::span<const unsigned> children) {
    if (children[present] < task.branching) return present;
    Index best = kNoIndex;
    std::size_t most = ids.size() / 2;
    for (Index parent = 0; parent < task.parents; ++parent) {
        if (children[parent] >= task.branching) continue;
        std::size_t held = 0;
        for (const Index id : ids) held += task.points.allowed(id, parent);
        if (held > most) {
            most = held;
            best = parent;
        }
    }
    return best;
}

/// Children that change to another parent that holds all of theirs, so that a full parent can have one more.
class Exchange {
public:
    Exchange(const LevelTask& task, const LevelShares& shares, LevelBalls& level, std::vector<unsigned>& children)
        : task_(task), shares_(shares), level_(level), children_(children), known_(level.balls.size(), 0),
          masks_(level.balls.size() * words()) {}

    /// The nearest parent with a free child slot, child by child from there to here. False: there is no such chain.
    bool free_child_slot(Index parent) {
        if (words() == 0) return false;
        std::vector<std::size_t> via(task_.parents, SIZE_MAX); // the ball that came to each parent
        std::vector<Index> queue{parent};
        std::vector<char> seen(task_.parents, 0);
        seen[parent] = 1;
        for (std::size_t head = 0; head < queue.size(); ++head) {
            const Index from = queue[head];
            if (children_[from] < task_.branching) {
                take_over(from, via);
                return true;
            }
            for (std::size_t ball = 0; ball < known_.size(); ++ball) {
                if (level_.parent[ball] != from) continue;
                const std::uint64_t* mask = mask_of(ball);
                for (Index to = 0; to < task_.parents; ++to)
                    if (seen[to] == 0 && ((mask[to / 64] >> (to % 64)) & 1U) != 0) {
                        seen[to] = 1;
                        via[to] = ball;
                        queue.push_back(to);
                    }
            }
        }
        return false;
    }

private:
    [[nodiscard]] std::size_t words() const noexcept { return task_.points.words(); }
    const std::uint64_t* mask_of(std::size_t ball) {
        std::uint64_t* mask = masks_.data() + ball * words();
        if (known_[ball] == 0) task_.points.find_common_parents(shares_.of(ball), mask);
        known_[ball] = 1;
        return mask;
    }
    void take_over(Index to, const std::vector<std::size_t>& via) {
        while (via[to] != SIZE_MAX) {
            const std::size_t ball = via[to];
            const Index from = level_.parent[ball];
            level_.parent[ball] = to;
            ++children_[to];
            --children_[from];
            to = from;
        }
    }

    const LevelTask& task_;
    const LevelShares& shares_;
    LevelBalls& level_;
    std::vector<unsigned>& children_;
    std::vector<char> known_;
    std::vector<std::uint64_t> masks_; // [ball][word]
};

/// Splits the worst balls that can be split, but for the first `skipped`. Returns how many.
std::size_t split_worst(const LevelTask& task, const LevelShares& shares, LevelBalls& level, std::size_t count, std::size_t skipped) {
    double mean = 0.0;
    for (const Ball& b : level.balls) mean += std::max(b.overhang(), 0.0) / static_cast<double>(level.balls.size());
    std::vector<std::pair<double, std::size_t>> order;
    for (std::size_t i = 0; i < level.balls.size(); ++i) {
        const double overhang = level.balls[i].overhang();
        if (shares.of(i).size() < 2 || !(overhang > 0.0)) continue;
        const double worse = overhang / (task.worst * mean);
        const double weight =
            task.aim == LevelAim::LeastOverhang ? 1.0 : area_of(task, shares.of(i)) * (1.0 + worse * worse * worse * worse);
        order.emplace_back(-weight * overhang, i);
    }
    std::sort(order.begin(), order.end());
    std::vector<unsigned> children(task.parents, 0);
    for (const Index parent : level.parent) ++children[parent];
    Exchange exchange(task, shares, level, children);
    std::size_t added = 0;
    for (const auto& [key, i] : order) {
        if (added == count) break;
        Index far = kNoIndex;
        const std::vector<Index> half = far_half(task, level.balls[i], shares.of(i), far);
        Index parent = find_parent(task, half, level.parent[i], children);
        if (parent == kNoIndex && exchange.free_child_slot(level.parent[i])) parent = find_parent(task, half, level.parent[i], children);
        if (parent == kNoIndex) continue;
        if (skipped > 0) {
            --skipped;
            continue;
        }
        level.balls.push_back(find_second(task, level.balls[i], half, far));
        level.parent.push_back(parent);
        ++children[parent];
        ++added;
    }
    return added;
}

/// Each parent's points covered on their own.
LevelBalls first_balls(const LevelTask& task, std::span<const Index> above, const BodyDepth& body) {
    LevelBalls level;
    level.owner.assign(task.points.size(), 0);
    const LevelShares shares = list_shares(above, task.parents);
    const unsigned most = task.parents == 1 ? task.branching : std::max(1U, static_cast<unsigned>(kFirstShare * task.branching));
    const std::vector<Vec3>& points = task.points.points();
    for (Index parent = 0; parent < task.parents; ++parent) {
        const auto ids = shares.of(parent);
        if (ids.empty()) continue;
        Box3 box;
        for (const Index id : ids) box.add(points[id]);
        std::vector<Ball> near; // that touch the box
        for (const Ball& candidate : task.candidates) {
            const Vec3 nearest = candidate.centre.cwiseMax(box.lo).cwiseMin(box.hi);
            const double reach = 1.05 * std::max(candidate.depth, 0.0);
            if ((nearest - candidate.centre).squaredNorm() <= reach * reach) near.push_back(candidate);
        }
        if (near.size() < 2 * most)
            for (const Index id : ids) near.push_back({points[id], 0.0, 0.0});
        std::vector<std::uint16_t> owner;
        const std::vector<Ball> balls =
            cover_points({points, ids, near, most, task.aim == LevelAim::LeastVolume && task.parents > 1, task.samples}, body, owner);
        for (std::size_t k = 0; k < ids.size(); ++k) level.owner[ids[k]] = static_cast<Index>(level.balls.size() + owner[k]);
        level.balls.insert(level.balls.end(), balls.begin(), balls.end());
        level.parent.resize(level.balls.size(), parent);
    }
    return level;
}

/// Whom each point would go to, were its owner not there.
struct Seconds {
    std::vector<Index> ball;  // [points] kNoIndex: none near
    std::vector<double> need; // [points] m
};

Seconds find_seconds(const LevelTask& task, const LevelBalls& level) {
    const std::vector<Vec3>& points = task.points.points();
    Seconds seconds{std::vector<Index>(points.size(), kNoIndex),
                    std::vector<double>(points.size(), std::numeric_limits<double>::infinity())};
    const double bound = 2.0 * largest_overhang(level.balls);
    for (Index i = 0; i < level.balls.size(); ++i) {
        const Ball& ball = level.balls[i];
        if (!(ball.depth + bound > 0.0)) continue;
        task.points.tree().for_each_within(ball.centre, ball.depth + bound, [&](Index p, double distance_sq) {
            if (level.owner[p] == i || !task.points.allowed(p, level.parent[i])) return;
            const double need = std::sqrt(distance_sq) - ball.depth;
            if (need < seconds.need[p]) {
                seconds.need[p] = need;
                seconds.ball[p] = i;
            }
        });
    }
    return seconds;
}

std::size_t worst_ball(std::span<const Ball> balls) {
    std::size_t worst = 0;
    for (std::size_t i = 1; i < balls.size(); ++i)
        if (balls[i].overhang() > balls[worst].overhang()) worst = i;
    return worst;
}

/// Takes up to `count` balls away, those that the others replace most cheaply. Returns how many.
std::size_t remove_cheapest(const LevelTask& task, const LevelShares& shares, LevelBalls& level, std::size_t count) {
    const Seconds seconds = find_seconds(task, level);
    std::vector<std::pair<double, Index>> order; // cost, ball
    const double worst = largest_overhang(level.balls);
    for (Index i = 0; i < level.balls.size(); ++i) {
        double need = 0.0;
        for (const Index p : shares.of(i)) need = std::max(need, seconds.need[p]);
        if (need >= worst) continue;
        order.emplace_back(
            task.aim == LevelAim::LeastOverhang ? need : area_of(task, shares.of(i)) * (need - 0.5 * level.balls[i].overhang()), i);
    }
    std::sort(order.begin(), order.end());
    if (task.aim == LevelAim::LeastOverhang) { // a child slot is needed beneath the worst ball's parent above all
        const Index parent = level.parent[worst_ball(level.balls)];
        std::stable_partition(order.begin(), order.end(), [&](const auto& entry) { return level.parent[entry.second] == parent; });
    }
    std::vector<char> touched(level.balls.size(), 0), gone(level.balls.size(), 0); // a replacement must stay
    std::size_t removed = 0;
    for (const auto& [cost, i] : order) {
        if (removed == count) break;
        bool free = touched[i] == 0;
        for (const Index p : shares.of(i)) free = free && gone[seconds.ball[p]] == 0;
        if (!free) continue;
        for (const Index p : shares.of(i)) {
            level.owner[p] = seconds.ball[p];
            touched[seconds.ball[p]] = 1;
        }
        gone[i] = 1;
        level.balls[i].depth = -std::numeric_limits<double>::infinity(); // takes no point any more
        ++removed;
    }
    return removed;
}

/// Balls from where they are needed least to where they are needed most, some at a time, as long as that helps.
void move_balls(const LevelTask& task, const BodyDepth& body, LevelBalls& level) {
    LevelScore score = judge(task, list_shares(level.owner, level.balls.size()), level.balls);
    std::size_t count = task.aim == LevelAim::LeastOverhang ? 1 : level.balls.size() / kMoveShare + 1;
    for (unsigned tries = 0; tries < kMoveTries && count > 0; ++tries) {
        LevelBalls moved = level;
        if (remove_cheapest(task, list_shares(level.owner, level.balls.size()), moved, count) == 0) return;
        const LevelShares shares = settle(task, moved);
        const std::size_t room = task.parents * task.branching - moved.balls.size();
        if (split_worst(task, shares, moved, std::min(room, count), 0) == 0) return;
        relax_level(task, body, kRoundsPerSplit, moved);
        const LevelScore now = judge(task, list_shares(moved.owner, moved.balls.size()), moved.balls);
        if (now.better_than(score)) {
            score = now;
            level = std::move(moved);
        } else if (task.aim == LevelAim::LeastOverhang && now.first <= score.first) {
            return; // the worst ball is as good as its parent's place allows
        } else {
            count /= 2;
        }
    }
}

} // namespace

double largest_overhang(std::span<const Ball> balls) noexcept {
    double largest = 0.0;
    for (const Ball& b : balls) largest = std::max(largest, b.overhang());
    return largest;
}

void LevelPoints::enter(std::span<const Ball> balls, std::span<const Index> parent_of) {
    const std::size_t words = (balls.size() + 63) / 64;
    std::vector<std::uint64_t> bits(words * points_.size(), 0);
    for (Index i = 0; i < balls.size(); ++i)
        tree_.for_each_within(balls[i].centre, balls[i].radius, [&](Index p, double) {
            if (parent_of.empty() || allowed(p, parent_of[i])) bits[p * words + i / 64] |= std::uint64_t{1} << (i % 64);
        });
    bits_ = std::move(bits);
    words_ = words;
}

void relax_level(const LevelTask& task, const BodyDepth& body, unsigned rounds, LevelBalls& level) {
    LevelShares shares = settle(task, level);
    LevelBalls best = level;
    LevelScore best_score = judge(task, shares, level.balls);
    for (unsigned round = 0; round < rounds; ++round) {
        if (!fit_changed(task, shares, body, level)) break;
        shares = settle(task, level);
        if (const LevelScore score = judge(task, shares, level.balls); score.better_than(best_score)) {
            best_score = score;
            best = level;
        }
    }
    level = std::move(best);
}

bool fill_level(const LevelTask& task, const BodyDepth& body, LevelBalls& level) {
    const std::size_t most = task.parents * task.branching;
    LevelScore best = judge(task, list_shares(level.owner, level.balls.size()), level.balls);
    std::size_t skipped = 0;   // splits without effect: the new ball lost its points again
    unsigned without_gain = 0; // rounds of splits: a ball is not made of smaller balls
    while (level.balls.size() < most && skipped < kPatience && without_gain < kRoundsWithoutGain) {
        const auto wanted = static_cast<std::size_t>(kSplitShare * static_cast<double>(level.balls.size())) + 1;
        const LevelShares shares = list_shares(level.owner, level.balls.size());
        LevelBalls split = level;
        const std::size_t added = split_worst(task, shares, split, std::min(wanted, most - level.balls.size()), skipped);
        if (added == 0) break;
        relax_level(task, body, kRoundsPerSplit, split);
        if (split.balls.size() <= level.balls.size()) {
            skipped += added;
            continue;
        }
        level = std::move(split);
        skipped = 0;
        const LevelScore now = judge(task, list_shares(level.owner, level.balls.size()), level.balls);
        const bool gained = now.first < kGain * best.first || now.second < kGain * best.second;
        without_gain = gained ? 0 : without_gain + 1;
        best = {std::min(best.first, now.first), std::min(best.second, now.second)};
    }
    return level.balls.size() == most;
}

LevelBalls cover_level(const LevelTask& task, std::span<const Index> above, const BodyDepth& body) {
    LevelBalls level = first_balls(task, above, body);
    relax_level(task, body, kRoundsPerSplit, level);
    const bool full = fill_level(task, body, level);
    move_balls(task, body, level);
    if (full) fill_level(task, body, level);
    relax_level(task, body, kLastRounds, level);
    return level;
}

} // namespace trocar::spheretree
