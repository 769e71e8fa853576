// The baselines: each node of a level is cut into balls for the next one.
#include "spheretree/bounding.hpp"
#include "spheretree/build/node_split.hpp"
#include "spheretree/build/wrapped_nodes.hpp"

#include <cmath>

namespace trocar::spheretree {

namespace {

constexpr double kPieceShare = 1.0 / 6.0; // longest edge of a piece, of its node's radius
constexpr double kSmallestPiece = 0.04;   // of the ball's radius
constexpr std::size_t kSamples = 5000;    // of the medial axis
constexpr unsigned kRootRounds = 64;

class NodeBuilder {
public:
    NodeBuilder(const TriMesh& surface, const WrappedOptions& options, const BodyDepth& body)
        : options_(options), body_(body), out_{{}, PieceSet(surface.vertices)} {
        if (options.builder == Builder::Hubbard) medial_ = find_candidates(surface, body, kSamples);
        cuts_.most = kMoreOfShares * most_pieces(options.branching, surface.triangles.size());
        WrappedNode root;
        for (Index t = 0; t < surface.triangles.size(); ++t) root.pieces.push_back({surface.triangles[t], t});
        std::vector<Sphere> corners;
        for (const Index id : corners_of(root.pieces)) corners.push_back({out_.set.point(id), 0.0});
        const Sphere around = enclose(corners, kRootRounds);
        root.ball = {around.centre, body_.at(around.centre), around.radius};
        const Vec3 centre = surface.bounds().centre(); // a cube, so that its octants are cubes
        const Vec3 half = Vec3::Constant(0.5 * surface.bounds().longest_edge());
        root.cell = {centre - half, centre + half};
        out_.nodes.push_back(std::move(root));
    }

    WrappedNodes build(const BuildProgress& progress) {
        double told = 0.0;
        for (std::size_t n = 0; n < out_.nodes.size(); ++n) {
            if (out_.nodes[n].level < options_.depth) split_node(n);
            const double share = static_cast<double>(n + 1) / static_cast<double>(out_.nodes.size()); // more nodes may follow
            if (share >= told + 0.01) progress(told = share);
        }
        out_.coarser = cuts_.reached;
        return std::move(out_);
    }

private:
    [[nodiscard]] bool is_octree() const { return options_.builder == Builder::Octree; }

    void split_node(std::size_t n) {
        std::vector<Piece> pieces = std::move(out_.nodes[n].pieces);
        out_.nodes[n].pieces.clear();
        const Ball node = out_.nodes[n].ball;
        if (!is_octree() && node.radius > 0.0) cut_to(kPieceShare * node.radius, out_.set, pieces, cuts_);
        const std::vector<Index> ids = corners_of(pieces);
        const NodeTask task{out_.set.points(), ids, medial_, node, out_.nodes[n].cell, options_.branching};
        const std::vector<ChildBall> children = is_octree() ? split_by_octants(task, body_) : split_by_merging(task, body_);
        std::vector<Ball> balls;
        for (const ChildBall& child : children) balls.push_back(child.ball);
        if (!is_octree()) fit_to_corners(ids, balls);
        Lineage none;
        auto shares = share_pieces(pieces, balls, out_.set, none, kSmallestPiece, cuts_);
        const auto level = static_cast<std::uint8_t>(out_.nodes[n].level + 1);
        for (std::size_t i = 0; i < balls.size(); ++i) {
            if (shares[i].empty()) continue;
            out_.nodes[n].children.push_back(out_.nodes.size());
            out_.nodes.push_back({balls[i], children[i].cell, std::move(shares[i]), {}, level});
        }
    }

    /// Radii at which every corner lies in the ball that needs least overhang for it.
    void fit_to_corners(std::span<const Index> ids, std::vector<Ball>& balls) const {
        for (const Index id : ids) {
            const Vec3& p = out_.set.point(id);
            std::size_t best = 0;
            double least = std::numeric_limits<double>::infinity();
            for (std::size_t i = 0; i < balls.size(); ++i)
                if (const double need = (p - balls[i].centre).norm() - balls[i].depth; need < least) {
                    least = need;
                    best = i;
                }
            balls[best].radius = std::max(balls[best].radius, (least + balls[best].depth) * kRoundOut);
        }
    }

    WrappedOptions options_;
    const BodyDepth& body_;
    WrappedNodes out_;
    std::vector<Ball> medial_;
    CutLimit cuts_; // of a node's pieces
};

} // namespace

WrappedNodes build_by_nodes(const TriMesh& surface, const WrappedOptions& options, const BodyDepth& body, const BuildProgress& progress) {
    return NodeBuilder(surface, options, body).build(progress);
}

} // namespace trocar::spheretree
