// One level of a wrapped tree, all of it at once: balls that hold a whole surface, each beneath a ball of the level above
// that holds the same part. A part of the surface may pass from one parent's children to another's wherever both hold it, so
// that balls go where the surface needs them.
//
// This work is based on: Wang et al. 2006, "Variational sphere set approximation for solid objects" (alternate between sharing
// out and fitting, split what is worst); Stolpner, Kry, Siddiqi 2012, "Medial spheres for shape approximation"; Bradshaw &
// O'Sullivan 2004 (candidates from the medial axis). Deviates: sharing out obeys the hierarchy.
#pragma once

#include "spheretree/build/ball_fit.hpp"
#include "spheretree/build/point_tree.hpp"

#include <algorithm>

namespace trocar::spheretree {

/// Surface points, and which balls of the level above hold them (with all of their own ancestors).
class LevelPoints {
public:
    /// points, areas  [point_count] m, m^2 that each stands for
    LevelPoints(std::vector<Vec3> points, std::vector<double> areas)
        : points_(std::move(points)), areas_(std::move(areas)), tree_(points_) {}

    [[nodiscard]] const std::vector<Vec3>& points() const noexcept { return points_; }
    [[nodiscard]] const std::vector<double>& areas() const noexcept { return areas_; }
    [[nodiscard]] const PointTree& tree() const noexcept { return tree_; }
    [[nodiscard]] std::size_t size() const noexcept { return points_.size(); }

    /// The next level down: parents become what was the level in work. parent_of  [balls] of the level above; empty: the root.
    void enter(std::span<const Ball> balls, std::span<const Index> parent_of);
    /// Back to the first level: everything is allowed.
    void leave() noexcept { words_ = 0; }
    /// Is the point held by this ball of the level above and by all above it?
    [[nodiscard]] bool allowed(Index point, Index parent) const noexcept {
        return words_ == 0 || ((bits_[point * words_ + parent / 64] >> (parent % 64)) & 1U) != 0;
    }

    [[nodiscard]] std::size_t words() const noexcept { return words_; }
    /// A bit for each ball of the level above that all of these points are allowed to.     mask  [words()] out
    void find_common_parents(std::span<const Index> points, std::uint64_t* mask) const noexcept {
        std::fill_n(mask, words_, ~std::uint64_t{0});
        for (const Index point : points)
            for (std::size_t w = 0; w < words_; ++w) mask[w] &= bits_[point * words_ + w];
    }

private:
    std::vector<Vec3> points_;
    std::vector<double> areas_;
    PointTree tree_;
    std::vector<std::uint64_t> bits_; // [point][word]; none: everything is allowed
    std::size_t words_ = 0;
};

struct LevelBalls {
    std::vector<Ball> balls;
    std::vector<Index> parent;         // [balls] ball of the level above
    std::vector<Index> owner;          // [points] the ball that each point is left to
    std::vector<std::uint64_t> fitted; // [balls] checksum of the points that the ball was last fitted to; 0: none
};

enum class LevelAim : std::uint8_t {
    LeastOverhang, // the largest overhang counts
    LeastVolume,   // overhang times area counts: leaves, and the level above them, which says how many leaves a place can have
};

struct LevelTask {
    const LevelPoints& points;
    std::span<const Ball> candidates; // centres inside the body
    std::size_t parents = 1;          // balls of the level above
    unsigned branching = 8;           // children of a parent at most
    LevelAim aim = LevelAim::LeastOverhang;
    std::size_t samples = 768; // of CoverTask: another number is another start
    double worst = 3.0;        // LeastVolume: of the mean overhang; balls beyond it are split first, whatever their area
};

/// above  [points] owner of each point on the level above
[[nodiscard]] LevelBalls cover_level(const LevelTask& task, std::span<const Index> above, const BodyDepth& body);

/// Splits the worst balls as long as a parent has a free child slot, and relaxes in between. False: slots are left, since more balls
/// improve nothing.
bool fill_level(const LevelTask& task, const BodyDepth& body, LevelBalls& level);

[[nodiscard]] double largest_overhang(std::span<const Ball> balls) noexcept;

/// Gives each point to the allowed ball that needs least overhang for it, fits the balls, and so on; keeps the best. Balls
/// without a point go.
void relax_level(const LevelTask& task, const BodyDepth& body, unsigned rounds, LevelBalls& level);

} // namespace trocar::spheretree
