#include "spheretree/build/ball_cover.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr std::size_t kCandidates = 768;
constexpr int kBisections = 9;
constexpr unsigned kFitSteps = 10; // of each ball, each round
constexpr unsigned kRounds = 10, kBriefRounds = 2;
constexpr unsigned kMoves = 6; // times a ball may be taken from where it is needed least to where it is needed most

/// Every stride-th, so that at most `most` are left.
template <class T>
std::vector<T> thin(std::span<const T> all, std::size_t most) {
    std::vector<T> kept;
    const std::size_t count = std::min(all.size(), most);
    kept.reserve(count);
    for (std::size_t k = 0; k < count; ++k) kept.push_back(all[k * all.size() / count]);
    return kept;
}

class GreedyCover {
public:
    explicit GreedyCover(const CoverTask& task)
        : ids_(thin(task.ids, task.samples)), candidates_(thin(task.candidates, kCandidates)), words_((ids_.size() + 63) / 64),
          need_(ids_.size() * candidates_.size()), bits_(words_ * candidates_.size()), open_(words_) {
        for (std::size_t i = 0; i < candidates_.size(); ++i)
            for (std::size_t k = 0; k < ids_.size(); ++k)
                need_[i * ids_.size() + k] =
                    static_cast<float>((task.points[ids_[k]] - candidates_[i].centre).norm() - candidates_[i].depth);
    }

    [[nodiscard]] std::span<const Ball> candidates() const noexcept { return candidates_; }

    /// Overhang at which a single candidate holds each point at best: no cover does better.
    [[nodiscard]] double least() const {
        float worst = 0.0F;
        for (std::size_t k = 0; k < ids_.size(); ++k) {
            float best = std::numeric_limits<float>::infinity();
            for (std::size_t i = 0; i < candidates_.size(); ++i) best = std::min(best, need_[i * ids_.size() + k]);
            worst = std::max(worst, best);
        }
        return worst;
    }
    /// Overhang at which one candidate holds all.
    [[nodiscard]] double most() const {
        float best = std::numeric_limits<float>::infinity();
        for (std::size_t i = 0; i < candidates_.size(); ++i)
            best = std::min(best, *std::max_element(row(i), row(i) + static_cast<std::ptrdiff_t>(ids_.size())));
        return best;
    }

    /// Candidates that hold all points with this overhang; empty where more than `limit` would be needed.
    /// source   Chvatal 1979: the one that holds most of what is left, again and again; ties by lower id
    std::vector<Index> at(double overhang, unsigned limit) {
        const auto allowed = static_cast<float>(overhang);
        std::fill(bits_.begin(), bits_.end(), 0);
        for (std::size_t i = 0; i < candidates_.size(); ++i)
            for (std::size_t k = 0; k < ids_.size(); ++k) bits_[i * words_ + k / 64] |= std::uint64_t{row(i)[k] <= allowed} << (k % 64);
        std::fill(open_.begin(), open_.end(), 0);
        for (std::size_t k = 0; k < ids_.size(); ++k) open_[k / 64] |= std::uint64_t{1} << (k % 64);
        std::size_t left = ids_.size();
        std::vector<Index> chosen;
        while (left > 0 && chosen.size() < limit) {
            Index best = 0;
            std::size_t best_gain = 0;
            for (std::size_t i = 0; i < candidates_.size(); ++i) {
                std::size_t gain = 0;
                for (std::size_t w = 0; w < words_; ++w) gain += static_cast<std::size_t>(std::popcount(open_[w] & bits_[i * words_ + w]));
                if (gain > best_gain) {
                    best_gain = gain;
                    best = static_cast<Index>(i);
                }
            }
            if (best_gain == 0) return {};
            chosen.push_back(best);
            left -= best_gain;
            for (std::size_t w = 0; w < words_; ++w) open_[w] &= ~bits_[best * words_ + w];
        }
        return left == 0 ? chosen : std::vector<Index>{};
    }

private:
    [[nodiscard]] const float* row(std::size_t candidate) const { return need_.data() + candidate * ids_.size(); }

    std::vector<Index> ids_;
    std::vector<Ball> candidates_;
    std::size_t words_;
    std::vector<float> need_;         // [candidate][point] m, overhang that the candidate needs to hold the point
    std::vector<std::uint64_t> bits_; // [candidate][word] points held
    std::vector<std::uint64_t> open_; // [word] points not held yet
};

std::vector<Ball> find_start(const CoverTask& task) {
    GreedyCover greedy(task);
    double low = greedy.least(), high = greedy.most();
    std::vector<Index> chosen = greedy.at(high, task.most);
    for (int k = 0; k < kBisections && high > low; ++k) {
        const double middle = 0.5 * (low + high);
        std::vector<Index> fewer = greedy.at(middle, task.most);
        if (fewer.empty()) {
            low = middle;
        } else {
            high = middle;
            chosen = std::move(fewer);
        }
    }
    std::vector<Ball> balls;
    for (const Index i : chosen) balls.push_back(greedy.candidates()[i]);
    return balls;
}

/// Point lists of each ball, in one array.
struct Shares {
    std::vector<Index> begin; // [balls + 1]
    std::vector<Index> ids;
    [[nodiscard]] std::span<const Index> of(std::size_t ball) const {
        return std::span(ids).subspan(begin[ball], begin[ball + 1] - begin[ball]);
    }
};

Shares share_out(const CoverTask& task, std::span<const Ball> balls, std::vector<std::uint16_t>& owner) {
    owner.resize(task.ids.size());
    std::vector<Index> count(balls.size() + 1, 0);
    for (std::size_t k = 0; k < task.ids.size(); ++k) {
        const Vec3& p = task.points[task.ids[k]];
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const double need = (p - balls[i].centre).norm() - balls[i].depth;
            if (need < least) {
                least = need;
                owner[k] = static_cast<std::uint16_t>(i);
            }
        }
        ++count[owner[k] + 1U];
    }
    Shares shares{std::move(count), std::vector<Index>(task.ids.size())};
    for (std::size_t i = 1; i < shares.begin.size(); ++i) shares.begin[i] += shares.begin[i - 1];
    std::vector<Index> at(shares.begin.begin(), shares.begin.end() - 1);
    for (std::size_t k = 0; k < task.ids.size(); ++k) shares.ids[at[owner[k]]++] = task.ids[k];
    return shares;
}

/// Largest overhang and the sum of all: what a cover is judged by.
struct Score {
    double largest = 0.0, sum = 0.0;
    [[nodiscard]] bool better_than(const Score& other) const {
        return largest < 0.999 * other.largest || (largest <= 1.001 * other.largest && sum < other.sum);
    }
};

Score judge(std::span<const Ball> balls) {
    Score score;
    for (const Ball& b : balls) {
        score.largest = std::max(score.largest, b.overhang());
        score.sum += b.overhang();
    }
    return score;
}

/// Radii as their shares ask for; balls without a share go.
void fit_radii(const CoverTask& task, const Shares& shares, std::vector<Ball>& balls) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < balls.size(); ++i) {
        const auto ids = shares.of(i);
        if (ids.empty()) continue;
        double radius_sq = 0.0;
        for (const Index id : ids) radius_sq = std::max(radius_sq, (task.points[id] - balls[i].centre).squaredNorm());
        balls[i].radius = std::sqrt(radius_sq);
        balls[kept++] = balls[i];
    }
    balls.resize(kept);
}

void settle(const CoverTask& task, std::vector<Ball>& balls, std::vector<std::uint16_t>& owner) {
    const std::size_t before = balls.size();
    fit_radii(task, share_out(task, balls, owner), balls);
    if (balls.size() != before) fit_radii(task, share_out(task, balls, owner), balls); // owners are numbered anew
}

/// Takes the ball that the others replace most cheaply to the farthest point of the worst ball. False: nothing to gain.
bool move_one(const CoverTask& task, const BodyDepth& body, std::vector<Ball>& balls, const std::vector<std::uint16_t>& owner) {
    if (balls.empty() || task.ids.empty()) return false;
    std::size_t worst = 0;
    for (std::size_t i = 1; i < balls.size(); ++i)
        if (balls[i].overhang() > balls[worst].overhang()) worst = i;
    std::size_t spare = balls.size();
    if (balls.size() >= task.most) { // overhang the others would need, without ball i
        std::vector<double> without(balls.size(), 0.0);
        for (std::size_t k = 0; k < task.ids.size(); ++k) {
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t i = 0; i < balls.size(); ++i)
                if (i != owner[k]) least = std::min(least, (task.points[task.ids[k]] - balls[i].centre).norm() - balls[i].depth);
            without[owner[k]] = std::max(without[owner[k]], least);
        }
        for (std::size_t i = 0; i < balls.size(); ++i)
            if (i != worst && (spare == balls.size() || without[i] < without[spare])) spare = i;
        if (spare == balls.size() || without[spare] >= balls[worst].overhang()) return false;
    }
    Vec3 far = balls[worst].centre;
    double distance = -1.0;
    for (std::size_t k = 0; k < task.ids.size(); ++k) {
        if (owner[k] != worst) continue;
        const double d = (task.points[task.ids[k]] - balls[worst].centre).squaredNorm();
        if (d > distance) {
            distance = d;
            far = task.points[task.ids[k]];
        }
    }
    Ball fresh; // halfway to it: inside, where the body is round
    fresh.centre = 0.5 * (balls[worst].centre + far);
    fresh.depth = body.at(fresh.centre);
    if (spare == balls.size())
        balls.push_back(fresh);
    else
        balls[spare] = fresh;
    return true;
}

} // namespace

void improve_cover(const CoverTask& task, const BodyDepth& body, unsigned rounds, std::vector<Ball>& balls,
                   std::vector<std::uint16_t>& owner) {
    settle(task, balls, owner);
    std::vector<Ball> best = balls;
    Score best_score = judge(balls);
    for (unsigned round = 0; round < rounds; ++round) {
        const Shares shares = share_out(task, balls, owner);
        for (std::size_t i = 0; i < balls.size(); ++i)
            if (const auto ids = shares.of(i); !ids.empty()) balls[i] = fit_ball(balls[i], task.points, ids, body, kFitSteps);
        settle(task, balls, owner);
        if (const Score score = judge(balls); score.better_than(best_score)) {
            best_score = score;
            best = balls;
        }
    }
    balls = std::move(best);
    settle(task, balls, owner);
}

std::vector<Ball> cover_points(const CoverTask& task, const BodyDepth& body, std::vector<std::uint16_t>& owner) {
    std::vector<Ball> balls = find_start(task);
    improve_cover(task, body, task.brief ? kBriefRounds : kRounds, balls, owner);
    for (unsigned k = 0; k < kMoves && !task.brief; ++k) {
        std::vector<Ball> moved = balls;
        std::vector<std::uint16_t> moved_owner = owner;
        if (!move_one(task, body, moved, moved_owner)) break;
        improve_cover(task, body, kRounds / 2, moved, moved_owner);
        if (!judge(moved).better_than(judge(balls))) break;
        balls = std::move(moved);
        owner = std::move(moved_owner);
    }
    return balls;
}

} // namespace trocar::spheretree
