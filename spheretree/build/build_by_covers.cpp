// Medial-axis and shell trees: level by level, each as a whole, then the pieces of the surface shared out for good.
#include "spheretree/bounding.hpp"
#include "spheretree/build/level_cover.hpp"
#include "spheretree/build/medial_axis.hpp"
#include "spheretree/build/trim_balls.hpp"
#include "spheretree/build/wrapped_nodes.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr std::size_t kMostLeaves = 65'536;
constexpr double kPointsAcross = 3.6; // cuts of a leaf's patch: fewer, and borders cannot move
constexpr std::size_t kMostCandidates = 40'000, kLeastCandidates = 1'500;
constexpr std::size_t kStarts[] = {768, 512, 1024, 1536};
constexpr double kSecondWeight = 2.5; // spheres of the second level may reach outside 0.4 times as far as those of the first
constexpr double kWorstLeaf = 3.0, kWorstInner = 1.0;     // of LevelTask
constexpr double kCutToRelax = 0.02, kCutForGood = 0.015; // smallest pieces, of the ball's radius
constexpr std::size_t kShellPoints = 96;                  // a leaf: volumes of its outside to a few per cent
constexpr unsigned kLastRelax = 4, kLastFit = 24;

double area_of(const PieceSet& set, const Piece& piece) {
    const Vec3& a = set.point(piece.corners[0]);
    return 0.5 * (set.point(piece.corners[1]) - a).cross(set.point(piece.corners[2]) - a).norm();
}

class CoverBuilder {
public:
    CoverBuilder(const TriMesh& surface, const WrappedOptions& options, BodyDepth& body)
        : options_(options), body_(body), out_{{}, PieceSet(surface.vertices)} {
        for (unsigned k = 0; k < options.depth && leaves_ < kMostLeaves; ++k) leaves_ *= options.branching;
        leaves_ = std::min(leaves_, kMostLeaves);
        for (Index t = 0; t < surface.triangles.size(); ++t) pieces_.push_back({surface.triangles[t], t});
        first_.most = most_pieces(leaves_, pieces_.size());
        second_.most = kMoreOfShares * first_.most;
        double area = 0.0;
        for (const Piece& piece : pieces_) area += area_of(out_.set, piece);
        const double patch = std::sqrt(area / static_cast<double>(leaves_));
        if (!(patch > 0.0)) return; // no area
        cut_to(patch / kPointsAcross, out_.set, pieces_, first_);
        if (!body_.solid()) return;
        body_.set_cloud(make_points().points(), patch / kPointsAcross);
        candidates_ = find_candidates(surface, body_, std::clamp(10 * leaves_, kLeastCandidates, kMostCandidates));
    }

    WrappedNodes build(const BuildProgress& progress) {
        progress_ = progress;
        tell(1);
        make_root();
        make_levels();
        tell(options_.depth + 2);
        share_out();
        tell(options_.depth + 3);
        make_nodes();
        tell(options_.depth + 4);
        trim_leaves();
        out_.coarser = first_.reached || second_.reached;
        return std::move(out_);
    }

private:
    /// Of the candidates, the levels, and what follows them: a stage each.
    void tell(unsigned stages) const { progress_(static_cast<double>(stages) / static_cast<double>(options_.depth + 5)); }

    [[nodiscard]] LevelPoints make_points() {
        ids_ = corners_of(pieces_);
        std::vector<double> area(out_.set.points().size(), 0.0), areas;
        for (const Piece& piece : pieces_)
            for (const Index id : piece.corners) area[id] += area_of(out_.set, piece) / 3.0;
        std::vector<Vec3> points;
        for (const Index id : ids_) {
            points.push_back(out_.set.point(id));
            areas.push_back(area[id]);
        }
        return {std::move(points), std::move(areas)};
    }

    void make_root() {
        std::vector<Sphere> corners;
        for (const Index id : corners_of(pieces_)) corners.push_back({out_.set.point(id), 0.0});
        const Sphere around = enclose(corners, 64);
        root_ = {around.centre, body_.at(around.centre), around.radius};
    }

    void make_levels() {
        if (options_.depth == 0) return;
        LevelPoints points = make_points();
        if (!body_.solid())
            for (const Vec3& p : points.points()) candidates_.push_back({p, 0.0, 0.0});
        if (options_.depth > 2) choose_first(points);
        for (unsigned k = static_cast<unsigned>(levels_.size()) + 1; k <= options_.depth; ++k) {
            enter(points, levels_, k);
            levels_.push_back(cover(points, levels_, k, kStarts[0]));
            if (k < options_.depth) widen(levels_.back().balls);
            tell(k + 1);
        }
        refine();
    }

    /// What the balls of level k - 1 hold becomes what those of level k may hold.
    static void enter(LevelPoints& points, std::span<const LevelBalls> levels, unsigned k) {
        if (k > 1) points.enter(levels[k - 2].balls, k == 2 ? std::span<const Index>{} : std::span<const Index>(levels[k - 2].parent));
    }

    /// Level k beneath `levels`.
    [[nodiscard]] LevelBalls cover(const LevelPoints& points, std::span<const LevelBalls> levels, unsigned k, std::size_t samples) const {
        const bool leaves = k == options_.depth, above_leaves = k > 1 && k + 1 == options_.depth;
        const LevelAim aim = leaves || above_leaves ? LevelAim::LeastVolume : LevelAim::LeastOverhang;
        const std::vector<Index> root(k == 1 ? points.size() : 0, 0);
        const std::size_t parents = k == 1 ? 1 : levels[k - 2].balls.size();
        return cover_level({points, candidates_, parents, options_.branching, aim, samples, leaves ? kWorstLeaf : kWorstInner},
                           k == 1 ? root : levels[k - 2].owner, body_);
    }

    /// The first two levels from several starts, side by side: a good first level is one that can be refined.
    void choose_first(LevelPoints& points) {
        struct Start {
            std::vector<LevelBalls> levels;
            double cost = 0.0;
        };
        std::array<Start, std::size(kStarts)> starts;
        tbb::parallel_for(std::size_t{0}, starts.size(), [&](std::size_t i) {
            auto& [levels, cost] = starts[i];
            LevelPoints own = points;
            levels.push_back(cover(own, levels, 1, kStarts[i]));
            const double first = largest_overhang(levels[0].balls);
            widen(levels[0].balls);
            enter(own, levels, 2);
            levels.push_back(cover(own, levels, 2, kStarts[0]));
            cost = std::max(first, kSecondWeight * largest_overhang(levels[1].balls));
            widen(levels[1].balls);
        });
        levels_ = std::move(
            std::min_element(starts.begin(), starts.end(), [](const Start& a, const Start& b) { return a.cost < b.cost; })->levels);
        enter(points, levels_, 2);
    }

    /// The leaves again, on points that lie dense where leaves meet.
    void refine() {
        LevelBalls& leaves = levels_.back();
        Lineage above = lineage();
        const auto shares = share_pieces(pieces_, leaves.balls, out_.set, above, kCutToRelax, second_);
        pieces_.clear();
        std::vector<Index> owner_of(out_.set.points().size(), kNoIndex);
        for (Index i = 0; i < shares.size(); ++i)
            for (const Piece& piece : shares[i]) {
                pieces_.push_back(piece);
                for (const Index id : piece.corners) owner_of[id] = i;
            }
        LevelPoints dense = make_points();
        for (std::size_t k = 0; k + 1 < levels_.size(); ++k)
            dense.enter(above.levels[levels_.size() - 2 - k],
                        k == 0 ? std::span<const Index>{} : std::span<const Index>(levels_[k].parent));
        leaves.owner.clear();
        for (const Index id : ids_) leaves.owner.push_back(owner_of[id]);
        const std::size_t parents = levels_.size() > 1 ? levels_[levels_.size() - 2].balls.size() : 1;
        const LevelTask task{dense, candidates_, parents, options_.branching, LevelAim::LeastVolume, kStarts[0], kWorstLeaf};
        const std::size_t before = leaves.balls.size();
        relax_level(task, body_, kLastRelax, leaves);
        if (leaves.balls.size() < before) fill_level(task, body_, leaves); // balls that lost all of theirs
    }

    /// Every ball as far outside as the worst of its level: what a parent holds, its children may share with others' children.
    static void widen(std::vector<Ball>& balls) {
        double largest = 0.0;
        for (const Ball& b : balls) largest = std::max(largest, b.overhang());
        for (Ball& b : balls) b.radius = std::max(b.radius, (b.depth + largest) * kRoundOut);
    }

    [[nodiscard]] Lineage lineage() const {
        Lineage above;
        for (std::size_t k = levels_.size(); k-- > 1;) {
            above.parents.push_back(levels_[k].parent);
            above.levels.push_back(levels_[k - 1].balls);
        }
        return above;
    }

    void share_out() {
        if (options_.depth == 0) {
            shares_ = {pieces_};
            return;
        }
        Lineage above = lineage();
        for (Ball& b : levels_.back().balls) b.radius *= kRoundOut;
        shares_ = share_pieces(pieces_, levels_.back().balls, out_.set, above, kCutForGood, second_);
        for (std::size_t k = 0; k < above.levels.size(); ++k) levels_[levels_.size() - 2 - k].balls = above.levels[k];
    }

    /// Refits leaves to the points left to them: less of them outside.
    void trim_leaves() {
        if (!body_.solid() || options_.depth == 0) return;
        std::vector<Ball> balls;
        std::vector<std::vector<Index>> holds;
        std::vector<std::size_t> nodes;
        std::vector<Piece> all;
        for (std::size_t n = 0; n < out_.nodes.size(); ++n) {
            const WrappedNode& node = out_.nodes[n];
            if (node.pieces.empty()) continue;
            nodes.push_back(n);
            balls.push_back(node.ball);
            holds.push_back(corners_of(node.pieces));
            all.insert(all.end(), node.pieces.begin(), node.pieces.end());
        }
        const ShellPoints shell(all, out_.set, body_, largest_overhang(balls), kShellPoints * balls.size());
        trim_balls(shell, holds, out_.set, body_, balls);
        for (std::size_t k = 0; k < nodes.size(); ++k) out_.nodes[nodes[k]].ball = balls[k];
    }

    [[nodiscard]] Ball fit(const Ball& start, std::span<const Index> ids) const {
        Ball ball = fit_ball(start, out_.set.points(), ids, body_, kLastFit);
        ball.radius *= kRoundOut;
        return ball;
    }

    /// Corners beneath each ball of every level; balls are fitted to exactly those, and go where there are none.
    void make_nodes() {
        std::vector<std::vector<std::vector<Index>>> corners(levels_.size());
        for (std::size_t k = levels_.size(); k-- > 0;) {
            corners[k].resize(levels_[k].balls.size());
            if (k + 1 == levels_.size()) {
                for (std::size_t i = 0; i < shares_.size(); ++i) corners[k][i] = corners_of(shares_[i]);
            } else {
                for (std::size_t i = 0; i < corners[k + 1].size(); ++i) {
                    auto& mine = corners[k][levels_[k + 1].parent[i]];
                    mine.insert(mine.end(), corners[k + 1][i].begin(), corners[k + 1][i].end());
                }
            }
        }
        WrappedNode root;
        root.ball = root_;
        if (options_.depth == 0) root.pieces = std::move(shares_.front());
        out_.nodes.push_back(std::move(root));
        std::vector<std::size_t> above{0}; // node of each ball of the level above
        for (std::size_t k = 0; k < levels_.size(); ++k) {
            std::vector<std::size_t> order(levels_[k].balls.size()), here(levels_[k].balls.size(), SIZE_MAX);
            for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
            const auto parent_of = [&](std::size_t i) { return k == 0 ? std::size_t{0} : above[levels_[k].parent[i]]; };
            std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return parent_of(a) < parent_of(b); });
            for (const std::size_t i : order) {
                if (corners[k][i].empty()) continue;
                here[i] = out_.nodes.size();
                out_.nodes[parent_of(i)].children.push_back(here[i]);
                WrappedNode node;
                node.ball = fit(levels_[k].balls[i], corners[k][i]);
                node.level = static_cast<std::uint8_t>(k + 1);
                if (k + 1 == levels_.size()) node.pieces = std::move(shares_[i]);
                out_.nodes.push_back(std::move(node));
            }
            above = std::move(here);
        }
    }

    WrappedOptions options_;
    BuildProgress progress_;
    BodyDepth& body_;
    WrappedNodes out_;
    std::size_t leaves_ = 1;
    CutLimit first_, second_; // of pieces before they are shared out, and after
    std::vector<Piece> pieces_;
    std::vector<Index> ids_;
    std::vector<Ball> candidates_;
    Ball root_;
    std::vector<LevelBalls> levels_; // below the root
    std::vector<std::vector<Piece>> shares_;
};

} // namespace

std::vector<Ball> find_candidates(const TriMesh& surface, const BodyDepth& body, std::size_t samples) {
    SampleOptions options;
    options.min_radius = 1e-6 * surface.bounds().longest_edge();
    options.max_samples = samples;
    std::vector<Ball> candidates;
    for (const Sphere& s : find_medial_balls(surface, body.inside(), options).balls)
        candidates.push_back({s.centre, body.at(s.centre), 0.0});
    return candidates;
}

WrappedNodes build_by_covers(const TriMesh& surface, const WrappedOptions& options, BodyDepth& body, const BuildProgress& progress) {
    return CoverBuilder(surface, options, body).build(progress);
}

} // namespace trocar::spheretree
