// The lumen's inscribed spheres on a moving wall. A sphere's centre follows the mean displacement of its anchors; its radius is the
// distance to the wall triangles linked to it, evaluated lazily when the descent needs that sphere: an interrupted descent
// pays only for what it visits.
#pragma once

#include "spheretree/lumen/lumen_tree.hpp"

#include <algorithm>

namespace trocar::spheretree {

/// An inscribed sphere over one step: free space of radius `radius` around a centre that moves straight from centre_t0 to centre_t1.
struct MovingBall {
    Vec3 centre_t0 = Vec3::Zero(), centre_t1 = Vec3::Zero(); // m
    double radius = -1.0;                                    // m, free at t0 and at t1; negative: the wall has passed the centre
    double radius_t0 = -1.0;                                 // m, free at t0
    double radius_t1 = -1.0;                                 // m, free at t1
};

/// What an update takes over from the last one about a sphere: its centre and its clearance at the step's end.
struct KeptBall {
    Vec3 centre = Vec3::Zero(); // m, at the step's end
    double radius = -1.0;       // m, likewise
    bool measured = false;      // false: the radius was not asked for, the next step that asks measures it
};

/// Balls and bounds of the current step. Sized by the first update, no allocation afterwards.
class LumenState {
public:
    /// Optional, once: balls whose linked wall vertices all have weight 0 never move and are never measured again.
    /// motion_weight  [vertex_count] 0: this wall vertex never leaves its rest position
    void mark_still(const LumenTree& lumen, std::span<const double> motion_weight);

    /// Moves the centres and the inner bounds; radii follow on demand.
    /// vertices_t0/_t1  [vertex_count] m, the wall at both ends of the step; they must stay alive and unchanged until the
    ///                  next update. Both empty: the wall rests, which costs nothing. Where a step does not begin where
    ///                  the last one ended, call reset() first: radii measured at t1 are taken over as those of t0.
    /// continues        vertices_t0 is to the bit what vertices_t1 was in the last update: half of the centres are known
    void update(const LumenTree& lumen, std::span<const Vec3> vertices_t0, std::span<const Vec3> vertices_t1, bool continues = false);

    void reset() noexcept { balls_.clear(); }                 // forgets the last step; the next update starts afresh
    void miss_steps() noexcept { step_ += at_rest_ ? 0 : 1; } // the wall moved on without an update: no radius of the last update holds

    /// For a run that is saved and goes on elsewhere: [ball_count] what the next update would take over. Empty: nothing, it starts
    /// afresh, or from a wall at rest, which is the same.
    [[nodiscard]] std::vector<KeptBall> kept() const;
    /// The next update goes on from there. kept [ball_count], of a state marked alike
    void keep(const LumenTree& lumen, std::span<const KeptBall> kept);

    /// Conservative against the linked triangles, within 1 % of what they leave free: a triangle that was further away than the build's
    /// link_reach at rest is assumed not to have come nearer than half of that. A ball grows by half of link_reach at most.
    [[nodiscard]] const MovingBall& ball(const LumenTree& lumen, Index ball);

    /// What ball() would cost now, in sphere tests; 0 when it is known already.
    [[nodiscard]] std::uint64_t cost_of(const LumenTree& lumen, Index ball) const noexcept;

    /// Upper bound of (radius - distance to the centre) at p over the balls beneath a sphere, at either end of the step.
    [[nodiscard]] double bound_at(Index sphere, const Vec3& p) const noexcept {
        const Sphere& s = bounds_[sphere];
        return std::min(s.radius - (s.centre - p).norm(), largest_[sphere]);
    }
    [[nodiscard]] bool has_bounds() const noexcept { return !bounds_.empty(); } // false: there was no update yet
    [[nodiscard]] const Vec3& bound_centre(Index sphere) const noexcept { return bounds_[sphere].centre; }
    [[nodiscard]] std::size_t balls_updated() const noexcept { return balls_updated_; } // this step, of all balls

private:
    void size_for(const LumenTree& lumen);
    void rest(const LumenTree& lumen);
    void list_moving(const LumenTree& lumen);
    void move_centres(const LumenTree& lumen, bool continues);
    void move_bound(const LumenTree& lumen, Index sphere);
    void move_bounds(const LumenTree& lumen);
    [[nodiscard]] bool is_known(std::size_t ball) const noexcept { return stamp_[ball] == step_ || stamp_[ball] == kAlways; }

    static constexpr std::uint32_t kAlways = UINT32_MAX; // the stamp of a ball that stands still

    std::vector<MovingBall> balls_;    // [ball_count]
    std::vector<Sphere> swept_;        // [ball_count] bounds a ball at both ends
    std::vector<char> still_;          // [ball_count] or empty
    std::vector<Index> moving_;        // the other balls
    std::vector<Index> moving_bounds_; // spheres with such a ball beneath
    std::vector<std::uint32_t> stamp_; // [ball_count] step of the radius
    std::vector<Sphere> bounds_;       // [sphere_count] over both ends of the step
    std::vector<double> largest_;      // [sphere_count] m
    std::span<const Vec3> vertices_t0_, vertices_t1_;
    std::uint32_t step_ = 0;
    std::size_t balls_updated_ = 0;
    bool at_rest_ = false;
    bool all_bounds_fit_ = false; // those of balls that stand still, too
};

/// Nearest point of the wall among the triangles linked to a ball: where a contact with that ball presses.
struct WallPoint {
    Index triangle = kNoIndex; // wall triangle id; kNoIndex: the ball has no linked triangle
    Vec3 point = Vec3::Zero(); // m
    std::array<double, 3> bary{1.0, 0.0, 0.0};
    double distance = 0.0; // m, from the asked point
};
/// vertices  [vertex_count] m, the wall now; empty: the wall rests
[[nodiscard]] WallPoint find_wall_point(const LumenTree& lumen, std::span<const Vec3> vertices, Index ball, const Vec3& p) noexcept;

} // namespace trocar::spheretree
