#include "spheretree/build/piece_sharing.hpp"

#include "spheretree/bounding.hpp"
#include "spheretree/build/point_tree.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr int kMostCuts = 40;
constexpr double kCoarser = 4.0, kWhole = 4.0; // of the smallest pieces: growth from try to try, and where pieces stay whole
constexpr std::size_t kFewBalls = 16;          // so few are all tested for every piece

double reach(const PieceSet& set, const Piece& piece, const Vec3& centre) {
    double far_sq = 0.0;
    for (const Index id : piece.corners) far_sq = std::max(far_sq, (set.point(id) - centre).squaredNorm());
    return std::sqrt(far_sq) * kRoundOut;
}

/// Which balls come into question for a piece: those that hold any of its corners.
class Holders {
public:
    Holders(std::span<const Piece> pieces, std::span<const Ball> balls, const PieceSet& set) {
        all_.resize(balls.size());
        for (Index i = 0; i < balls.size(); ++i) all_[i] = i;
        if (balls.size() <= kFewBalls) return;
        const std::vector<Index> ids = corners_of(pieces);
        std::vector<Vec3> points;
        points.reserve(ids.size());
        for (const Index id : ids) points.push_back(set.point(id));
        const PointTree tree(points);
        std::vector<std::array<Index, 2>> pairs; // point, ball
        for (Index i = 0; i < balls.size(); ++i)
            tree.for_each_within(balls[i].centre, balls[i].radius * (1.0 + 1e-9), [&](Index p, double) { pairs.push_back({ids[p], i}); });
        std::sort(pairs.begin(), pairs.end());
        begin_.assign(ids.back() + 2, 0);
        for (const auto& [point, ball] : pairs) ++begin_[point + 1];
        for (std::size_t p = 1; p < begin_.size(); ++p) begin_[p] += begin_[p - 1];
        for (const auto& [point, ball] : pairs) balls_.push_back(ball);
    }

    [[nodiscard]] std::span<const Index> of(const Piece& piece) {
        if (begin_.empty()) return all_;
        found_.clear();
        for (const Index id : piece.corners) found_.insert(found_.end(), balls_.begin() + begin_[id], balls_.begin() + begin_[id + 1]);
        std::sort(found_.begin(), found_.end());
        found_.erase(std::unique(found_.begin(), found_.end()), found_.end());
        return found_.empty() ? std::span<const Index>(all_) : std::span<const Index>(found_);
    }

private:
    std::vector<Index> all_, begin_, balls_, found_;
};

struct Choice {
    Index holder = kNoIndex;   // holds the piece, with least overhang needed
    Index cheapest = kNoIndex; // needs least overhang to hold it
    double radius = 0.0;       // m, that the cheapest would then have
};

/// m by which the ball's ancestors would have to grow together.
double growth_above(const PieceSet& set, const Piece& piece, const Lineage& above, Index ball) {
    double growth = 0.0;
    for (std::size_t level = 0; level < above.levels.size(); ++level) {
        ball = above.parents[level][ball];
        const Ball& ancestor = above.levels[level][ball];
        growth += std::max(0.0, reach(set, piece, ancestor.centre) - ancestor.radius);
    }
    return growth;
}

void grow_above(const PieceSet& set, const Piece& piece, Lineage& above, Index ball) {
    for (std::size_t level = 0; level < above.levels.size(); ++level) {
        ball = above.parents[level][ball];
        Ball& ancestor = above.levels[level][ball];
        ancestor.radius = std::max(ancestor.radius, reach(set, piece, ancestor.centre));
    }
}

Choice choose(const PieceSet& set, const Piece& piece, std::span<const Ball> balls, std::span<const Index> among, const Lineage& above) {
    Choice choice;
    double least_held = std::numeric_limits<double>::infinity(), least = least_held;
    for (const Index i : among) {
        const double need = reach(set, piece, balls[i].centre);
        double overhang = need - balls[i].depth;
        if (overhang >= least && (need > balls[i].radius || overhang >= least_held)) continue;
        const double growth = growth_above(set, piece, above, i);
        if (need <= balls[i].radius && growth <= 0.0 && overhang < least_held) {
            least_held = overhang;
            choice.holder = i;
        }
        overhang += growth;
        if (overhang < least) {
            least = overhang;
            choice.cheapest = i;
            choice.radius = need;
        }
    }
    return choice;
}

/// False: there would be more than `most` pieces.
bool try_to_share(std::span<const Piece> pieces, std::span<Ball> balls, PieceSet& set, Lineage& above, double smallest, std::size_t most,
                  std::vector<std::vector<Piece>>& shares) {
    shares.assign(balls.size(), {});
    Holders holders(pieces, balls, set);
    std::vector<std::pair<Piece, int>> open;
    std::size_t room = most > pieces.size() ? most - pieces.size() : 0; // every cut makes one more
    for (const Piece& whole : pieces) {
        const std::span<const Index> among = holders.of(whole);
        open.assign(1, {whole, 0});
        while (!open.empty()) {
            const auto [piece, cuts] = open.back();
            open.pop_back();
            const Choice choice = choose(set, piece, balls, among, above);
            if (choice.holder != kNoIndex) {
                shares[choice.holder].push_back(piece);
                continue;
            }
            int corner = 0;
            const double edge = std::sqrt(set.longest_edge_sq(piece, corner));
            if (cuts < kMostCuts && edge > smallest * balls[choice.cheapest].radius && edge > 0.0) {
                if (room-- == 0) return false;
                const auto halves = set.split(piece, corner);
                open.emplace_back(halves[1], cuts + 1);
                open.emplace_back(halves[0], cuts + 1);
                continue;
            }
            balls[choice.cheapest].radius = std::max(balls[choice.cheapest].radius, choice.radius);
            grow_above(set, piece, above, choice.cheapest);
            shares[choice.cheapest].push_back(piece);
        }
    }
    return true;
}

/// False: there would be more than `most` pieces.
bool try_to_cut(std::span<const Piece> pieces, double longest, PieceSet& set, std::size_t most, std::vector<Piece>& cut) {
    cut.clear();
    std::vector<Piece> open(pieces.rbegin(), pieces.rend());
    while (!open.empty()) {
        if (cut.size() + open.size() > most) return false;
        const Piece piece = open.back();
        open.pop_back();
        int corner = 0;
        if (set.longest_edge_sq(piece, corner) <= longest * longest) {
            cut.push_back(piece);
            continue;
        }
        const auto halves = set.split(piece, corner);
        open.push_back(halves[1]);
        open.push_back(halves[0]);
    }
    return true;
}

} // namespace

std::vector<Index> corners_of(std::span<const Piece> pieces) {
    std::vector<Index> ids;
    ids.reserve(3 * pieces.size());
    for (const Piece& piece : pieces) ids.insert(ids.end(), piece.corners.begin(), piece.corners.end());
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    return ids;
}

void cut_to(double longest, PieceSet& set, std::vector<Piece>& pieces, CutLimit& limit) {
    const std::size_t points_before = set.points().size();
    std::vector<Piece> cut;
    while (!try_to_cut(pieces, longest, set, limit.most, cut)) {
        limit.reached = true;
        set.shrink(points_before);
        longest *= 2.0;
    }
    pieces = std::move(cut);
}

std::vector<std::vector<Piece>> share_pieces(std::span<const Piece> pieces, std::span<Ball> balls, PieceSet& set, Lineage& above,
                                             double smallest, CutLimit& limit) {
    std::vector<std::vector<Piece>> shares;
    const std::vector<Ball> balls_before(balls.begin(), balls.end());
    const std::vector<std::vector<Ball>> above_before = above.levels;
    const std::size_t points_before = set.points().size();
    while (!try_to_share(pieces, balls, set, above, smallest, limit.most, shares)) {
        limit.reached = true;
        std::copy(balls_before.begin(), balls_before.end(), balls.begin());
        above.levels = above_before;
        set.shrink(points_before);
        smallest = smallest < kWhole ? kCoarser * smallest : std::numeric_limits<double>::infinity(); // at last, nothing is cut
    }
    return shares;
}

} // namespace trocar::spheretree
