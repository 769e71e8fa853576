// Contact of a rod with planes, as its Newton iteration sees it.
//
//   normal     force = max(0, multiplier + k depth)
//   friction   -bound / reach times the way s of the rod's surface from where it is anchored; |s| at most the reach: beyond it the
//              anchor is dragged along
//
// The multiplier is the force that the last stage ended with: one step of an augmented Lagrangian a stage (Hestenes 1969, Powell 1969;
// of contact: Simo & Laursen 1992). Forces balance the rod to the iteration's tolerance whatever k is; what k leaves is a depth of
// (force - multiplier) / k, which is nothing where forces are steady. Friction is Coulomb's by return mapping (Michalowski & Mroz 1978;
// Simo & Laursen 1992): the way to the cone's edge is the same for every force, some micrometres, so that what holds by micronewtons and
// what holds by newtons leave the cone alike, and beyond that the way by which a wall gives to the bound; a held place does not creep, since its anchor stays. The bound follows the normal force only
// where the iteration has nearly settled: normal forces far from balance would let friction throw the rod about. A plane touches two
// neighbouring nodes: the matrix stays a band, O(n) for any number of planes. With torsion the place that slides is on the rod's surface:
// one cone for what slides along it and around it. A place of the rod that meets another one of it does not roll on it.
// Nearly all of a rod's planes are out of reach: those farther off than any node has gone since the iteration began are not evaluated, and of
// the others only those that push, have pushed or are met: the rest would add nothing.
// Deviations: the bound is lagged by an iteration (Tresca's friction, iterated), so that the matrix is symmetric; the rod's tangent and the
// plane's normal are those of the stage's start.
#pragma once

#include "fem/rod/rod_model.hpp"
#include "fem/rod/rod_parts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace trocar::fem {

/// [-] k, of the rod's own stiffness against what is pressed across it.
inline constexpr double kPressAugmentation = 30.0;
/// [-] of the same where the rod presses on itself: what couples its places is as stiff, and conjugate gradients take longer for that.
inline constexpr double kSelfAugmentation = 2.0;
/// m; a place holds until it has moved by this from where it was fixed, with a friction that grows along the way to the cone's edge.
inline constexpr double kStickReach = 2e-6;
/// [-] of the power that a correction starts with: one that ends with more than this against it is shortened, until this much is left.
struct SearchTolerance {
    double overshoot = 0.5, left = 0.05;
};
/// Rounds in which the way is found that a wall gives by: one more than the planes let go and take hold.
inline constexpr int kGivenRounds = 20;
/// Of that way's line search: a step that ends uphill is shortened, so that planes which open and close one another do not go round in circles.
inline constexpr SearchTolerance kGivenTolerance{.overshoot = 1e-9, .left = 1e-3};
/// m; planes nearer than this are evaluated from the beginning, and what rounding may hide of a gap.
inline constexpr double kNearPlanes = 1e-4, kGapRounding = 1e-9;

/// m; a wall that gives way gives way to friction too.
[[nodiscard]] inline double stick_reach(const RodPlane& plane, double bound) noexcept { return kStickReach + plane.give * bound; }

/// What a stage's iteration starts with: the forces that the last one ended with.
/// bound   N, of friction, of the plane's force
inline void begin_press(RodPlane& plane, RodPress& press, double bound) noexcept {
    press = RodPress();
    const Vec3 drag = plane.drag;
    plane.drag.setZero();
    press.force = press.last = press.bounding = plane.force;
    if (!(bound > 0.0)) return;
    const double reach = stick_reach(plane, bound);
    press.anchor = -reach / bound * (drag - plane.normal.dot(drag) * plane.normal);
    const double length = std::sqrt(press.anchor.squaredNorm());
    if (length > reach) press.anchor *= reach / length;
}

/// Force and stiffness of one plane.
/// depth      m, that is missing of its offset
/// across     N/m, augmentation
/// softness   m/N, of what is behind it
/// bound      N, of friction, of RodPress::bounding
/// slide      () -> m, of the rod's surface on what carries the plane, since the stage's start
template <class Slide>
void evaluate_press(RodPlane& plane, RodPress& press, double depth, double across, double softness, double bound, bool holds,
                    const Slide& slide) noexcept {
    const double yields = 1.0 + across * softness, force = (press.force + across * depth) / yields;
    const bool touches = holds || force > 0.0;
    plane.force = touches ? force : 0.0;
    press.stiffness = touches ? across / yields : 0.0;
    press.shared.setZero();
    const bool pushes = touches || bound > 0.0;
    if (pushes || press.pushes) {
        plane.drag.setZero();
        press.aside.setZero();
    }
    press.pushes = pushes;
    if (!(bound > 0.0)) return;
    const Vec3 trial = press.anchor + slide();
    const double length = std::sqrt(trial.squaredNorm());
    const Mat3 aside = Mat3::Identity() - plane.normal * plane.normal.transpose();
    if (const double reach = stick_reach(plane, bound); length <= reach) { // it holds
        plane.drag = -bound / reach * trial;
        press.aside = bound / reach * aside;
        return;
    }
    const Vec3 way = trial / length;
    plane.drag = -bound * way;
    press.aside = bound / length * (aside - way * way.transpose());
}

/// Takes note of a plane's normal force; with `bounds` friction's bound becomes that of now. Returns by how much the worse of both changed, N.
[[nodiscard]] inline double update_press(const RodPlane& plane, RodPress& press, bool bounds) noexcept {
    double change = std::abs(plane.force - press.last);
    press.last = plane.force;
    if (!bounds) return change;
    change = std::max(change, std::abs(plane.force - press.bounding));
    press.bounding = plane.force;
    return change;
}

/// N/m, of the rod against what is pressed across it: at its stiffest node; where the tip alone is beyond the port, at the one behind it.
[[nodiscard]] inline double stiffness_across(const RodModel& model, double dt, Index first) noexcept {
    double across = 0.0;
    for (std::size_t i = std::clamp<std::size_t>(first, 1, model.node_count() - 2); i + 1 < model.node_count(); ++i) {
        const double turn = bend_stencil(model, i)[1];
        across = std::max(across, 1.5 * model.bending_of(i) * turn * turn + model.mass[i] / (dt * dt));
    }
    return across;
}

inline constexpr int kSearchRounds = 12;

/// A correction that planes which it meets, or leaves, throw back ends where they balance the rest: a line search by regula falsi.
/// Planes that open each other in turn settle so.
/// most      of the correction, that has been made
/// power     J, of all forces over the correction, at its start
/// power_at  (part) -> J, where `part` of it is made
/// move_by   (part): goes on by so much of it
template <class PowerAt, class MoveBy>
void search_along(double most, double power, const PowerAt& power_at, const MoveBy& move_by, const SearchTolerance& tolerance = {}) noexcept {
    double low = 0.0, high = most, at_low = power, at_high = power_at(most);
    if (!(at_high < -tolerance.overshoot * power)) return;
    double part = most;
    for (int round = 0, side = 0; round < kSearchRounds; ++round) {
        const double next = low + (high - low) * at_low / (at_low - at_high);
        move_by(next - part);
        part = next;
        const double now = power_at(part);
        if (std::abs(now) <= tolerance.left * power) return;
        if (now > 0.0) {
            low = part, at_low = now;
            if (side > 0) at_high *= 0.5;
            side = 1;
        } else {
            high = part, at_high = now;
            if (side < 0) at_low *= 0.5;
            side = -1;
        }
    }
}

class RodContact {
public:
    /// twists   the rod has angles, and rolls on what it touches
    RodContact(const RodModel& model, const RodState& state, const RodDrive& drive, std::span<RodPlane> planes, double dt, Index first,
               bool twists, RodWorkspace& workspace, std::vector<RodPress>& presses, RodNear& near) noexcept
        : model_(model), state_(state), drive_(drive), planes_(planes), dt_(dt), first_(first), twists_(twists), work_(workspace),
          presses_(presses), near_(near) {
        begin();
    }

    [[nodiscard]] std::span<RodPlane> planes() const noexcept { return planes_; }
    [[nodiscard]] RodPress& press(std::size_t k) noexcept { return presses_[k]; }
    [[nodiscard]] const RodPress& press(std::size_t k) const noexcept { return presses_[k]; }

    /// Those that may have a force, or had one in the last correction; in their order.
    [[nodiscard]] std::span<const Index> awake() const noexcept { return near_.awake; }

    /// Forces and stiffness of every plane where the rod is now.
    void evaluate() noexcept {
        reach_for(farthest_way());
        evaluate_near([](const RodPress&) { return false; });
    }
    /// The same for a stage's first correction: what pressed when it began still holds, both ways. Where the rod would have gone freely most
    /// gaps are open by more than the micrometre that lets go of a force; without those planes it would spring by millimetres, into others.
    void evaluate_held() noexcept {
        reach_for(farthest_way());
        evaluate_near([](const RodPress& press) { return press.force > 0.0; });
    }

    /// Takes note of the normal forces; with `bounds` friction's bounds become those of now. Returns by how much the worst of either
    /// changed, N.
    double update(bool bounds) noexcept {
        double change = 0.0;
        for (const Index k : near_.awake) change = std::max(change, update_press(planes_[k], presses_[k], bounds));
        return change;
    }

    /// Friction that the last normal forces allow: bounds were those of the iteration before.
    void stay_in_cone() noexcept {
        for (const Index k : near_.awake) {
            RodPlane& plane = planes_[k];
            const double most = bound_of(plane, plane.force), drag = std::sqrt(plane.drag.squaredNorm());
            if (drag > most) plane.drag *= most / drag;
        }
    }

    /// N, of the normal forces.
    [[nodiscard]] double largest_force() const noexcept {
        double largest = 0.0;
        for (const Index k : near_.awake) largest = std::max(largest, planes_[k].force);
        return largest;
    }

    [[nodiscard]] Vec3 force(std::size_t k) const noexcept { return planes_[k].force * planes_[k].normal + planes_[k].drag; }
    /// m/rad, around the rod: how its surface at the plane moves as it turns.
    [[nodiscard]] Vec3 roll(const RodPlane& plane) const noexcept {
        return -model_.design.radius * work_.tangent[plane.node].cross(plane.normal);
    }

private:
    void begin() noexcept {
        if (presses_.size() < planes_.size()) presses_.resize(planes_.size()); // never shrinks
        near_.planes.reserve(presses_.capacity());
        near_.normal.reserve(presses_.capacity());
        near_.offset.reserve(presses_.capacity());
        near_.asleep.reserve(presses_.capacity());
        near_.places.reserve(presses_.capacity());
        near_.awake.reserve(presses_.capacity());
        const bool own = !planes_.empty() && planes_.front().other != kNoIndex;
        across_ = (own ? kSelfAugmentation : kPressAugmentation) * stiffness_across(model_, dt_, first_);
        softness_ = 1.0 / drive_.contact_stiffness;
        for (std::size_t k = 0; k < planes_.size(); ++k) {
            const RodPlane& plane = planes_[k];
            begin_press(planes_[k], presses_[k], bound_of(plane, plane.force));
            presses_[k].gap = plane.normal.dot(start_of(plane)) - plane.offset - plane.give * std::sqrt(plane.felt.squaredNorm());
        }
        list_near(kNearPlanes);
    }

    /// Where the iteration began, of a plane as point() tells it. What does not move is where the port has put it.
    [[nodiscard]] Vec3 start_of(const RodPlane& plane) const noexcept {
        const auto at = [&](Index i) -> const Vec3& { return i >= first_ ? work_.start[i] : state_.position[i]; };
        Vec3 place = (1.0 - plane.weight) * at(plane.node) + plane.weight * at(plane.node + 1);
        if (plane.other != kNoIndex) place -= (1.0 - plane.other_weight) * at(plane.other) + plane.other_weight * at(plane.other + 1);
        return place;
    }
    /// m; no node has gone farther since the iteration began, rounding allowed for.
    [[nodiscard]] double farthest_way() const noexcept {
        double farthest_sq = 0.0;
        bool finite = true;
        for (std::size_t i = first_; i < model_.node_count(); ++i) {
            const double way_sq = (state_.position[i] - work_.start[i]).squaredNorm();
            finite = finite && way_sq < std::numeric_limits<double>::infinity();
            farthest_sq = std::max(farthest_sq, way_sq);
        }
        return finite ? std::sqrt(farthest_sq) : std::numeric_limits<double>::infinity();
    }
    void reach_for(double way) noexcept {
        if (!(way <= within_)) list_near(2.0 * way);
    }
    void list_near(double within) noexcept {
        within_ = within;
        near_.planes.clear(), near_.normal.clear(), near_.offset.clear(), near_.asleep.clear(), near_.places.clear(); // reserved
        for (std::size_t k = 0; k < planes_.size(); ++k) {
            const RodPlane& plane = planes_[k];
            const double way = plane.other == kNoIndex ? within : 2.0 * within; // both places go
            if (!(presses_[k].force > 0.0) && presses_[k].gap > way + kGapRounding) continue;
            const Index at = static_cast<Index>(near_.planes.size());
            if (at == 0 || !is_of_place(plane, planes_[near_.planes.back()]) || at - near_.places.back().begin == kMostOfSide)
                near_.places.push_back({at, at, plane.node, plane.other, plane.weight, plane.other_weight});
            near_.planes.push_back(static_cast<Index>(k));
            near_.normal.push_back(plane.normal);
            near_.offset.push_back(plane.offset);
            near_.asleep.push_back(0);
            near_.places.back().end = at + 1;
        }
    }
    /// What one side of a place is pushed by moves as one; planes of a wall that stands push each for itself.
    [[nodiscard]] static bool is_of_place(const RodPlane& plane, const RodPlane& last) noexcept {
        return plane.node == last.node && plane.weight == last.weight && plane.other == last.other && plane.other_weight == last.other_weight &&
               (plane.give > 0.0) == (last.give > 0.0) && (plane.side == last.side || !(plane.give > 0.0));
    }

    /// From the place that carries it, if one does. Of a plane, or of all planes of a place.
    template <class AtPlace>
    [[nodiscard]] static Vec3 point(const AtPlace& at, const std::vector<Vec3>& position) noexcept {
        Vec3 place = (1.0 - at.weight) * position[at.node] + at.weight * position[at.node + 1];
        if (at.other != kNoIndex) place -= (1.0 - at.other_weight) * position[at.other] + at.other_weight * position[at.other + 1];
        return place;
    }
    [[nodiscard]] static double mean(const RodPlane& plane, const std::vector<double>& value) noexcept {
        return (1.0 - plane.weight) * value[plane.node] + plane.weight * value[plane.node + 1];
    }

    /// m; of the rod's surface on the wall since the sub-step's start.
    [[nodiscard]] Vec3 slide(const RodPlane& plane) const noexcept {
        Vec3 moved = point(plane, state_.position) - point(plane, work_.start) - dt_ * plane.wall_velocity;
        moved -= plane.normal.dot(moved) * plane.normal;
        if (twists_ && plane.other == kNoIndex) moved += (mean(plane, state_.angle) - mean(plane, work_.start_angle)) * roll(plane);
        return moved;
    }

    /// holds(press)
    template <class Holds>
    void evaluate_near(const Holds& holds) noexcept {
        near_.awake.clear();
        for (const RodPlace& place : near_.places) {
            const Vec3 at = point(place, state_.position);
            bool any = false;
            for (Index k = place.begin; k < place.end; ++k) {
                if (near_.asleep[k] == 0) near_.asleep[k] = is_calm(near_.planes[k]);
                if (near_.asleep[k] != 0 && !(near_.offset[k] - near_.normal[k].dot(at) > 0.0)) continue;
                near_.asleep[k] = 0;
                any = true;
                if (planes_[near_.planes[k]].give > 0.0) break; // they move as one
                near_.awake.push_back(near_.planes[k]); // reserved, as below
                evaluate(planes_[near_.awake.back()], presses_[near_.awake.back()], holds(presses_[near_.awake.back()]));
            }
            const std::span<const Index> all = std::span<const Index>(near_.planes).subspan(place.begin, place.end - place.begin);
            if (!any || !(planes_[all.front()].give > 0.0)) continue;
            std::fill(near_.asleep.begin() + place.begin, near_.asleep.begin() + place.end, std::uint8_t{0});
            near_.awake.insert(near_.awake.end(), all.begin(), all.end());
            evaluate_place(all, holds);
        }
    }
    /// Nothing is left of it but what its depth will add.
    [[nodiscard]] bool is_calm(Index k) const noexcept {
        const RodPress& press = presses_[k];
        const RodPlane& plane = planes_[k];
        return !press.pushes && !press.pushed && plane.force == 0.0 && press.force == 0.0 && press.last == 0.0 && press.bounding == 0.0 &&
               plane.felt.isZero(0.0);
    }

    /// Planes of one side of a place at most; more of them are two sides.
    static constexpr std::size_t kMostOfSide = 64;
    using Depths = std::array<double, kMostOfSide>; // m, of planes of one place whose wall has not moved

    /// What the planes of a place push with where their wall has moved by `given`: the sum, and its stiffness. Returns which of them touch, a bit
    /// each.
    template <class Holds>
    std::uint64_t sum_place(std::span<const Index> place, const Depths& depths, const Vec3& given, const Holds& holds, Vec3& sum, Mat3& stiffness) const noexcept {
        sum.setZero(), stiffness.setZero();
        std::uint64_t touching = 0;
        const double yields = 1.0 + across_ * softness_;
        for (std::size_t i = 0; i < place.size(); ++i) {
            const RodPlane& plane = planes_[place[i]];
            const RodPress& press = presses_[place[i]];
            const double force = (press.force + across_ * (depths[i] + plane.normal.dot(given))) / yields;
            if (!(force > 0.0) && !holds(press)) continue;
            sum += force * plane.normal;
            stiffness += across_ / yields * plane.normal * plane.normal.transpose();
            touching |= std::uint64_t{1} << i;
        }
        return touching;
    }

    /// Planes of one place of a wall that gives way: given = give (felt - sum(given)), by Newton's method; the sum is piecewise linear and grows
    /// with `given`. Most places neither touch nor did: they are asked once.
    template <class Holds>
    void evaluate_place(std::span<const Index> place, const Holds& holds) noexcept {
        const RodPlane& first = planes_[place.front()];
        Vec3& given = presses_[place.front()].given;
        Vec3 sum;
        Mat3 stiffness;
        Depths depths;
        const Vec3 at = point(first, state_.position);
        for (std::size_t i = 0; i < place.size(); ++i) depths[i] = planes_[place[i]].offset - planes_[place[i]].normal.dot(at);
        const bool untouched = first.felt.isZero(0.0);
        if (untouched) given.setZero();
        std::uint64_t touching = sum_place(place, depths, given, holds, sum, stiffness), before = untouched && touching == 0 ? touching : ~touching;
        for (int round = 0; round < kGivenRounds && touching != before; ++round) {
            const Vec3 slope = given - first.give * (first.felt - sum); // of the energy, whose least is where the wall stands
            const Vec3 way = (Mat3::Identity() + first.give * stiffness).inverse() * -slope;
            given += way;
            before = std::exchange(touching, sum_place(place, depths, given, holds, sum, stiffness));
            bool is_whole = true;
            search_along(
                1.0, -way.dot(slope), [&](double) { return -way.dot(Vec3(given - first.give * (first.felt - sum))); },
                [&](double part) {
                    is_whole = false;
                    given += part * way;
                    touching = sum_place(place, depths, given, holds, sum, stiffness);
                },
                kGivenTolerance);
            if (!is_whole) before = ~touching;
        }
        bool told = false;
        for (std::size_t i = 0; i < place.size(); ++i) {
            RodPlane& plane = planes_[place[i]];
            RodPress& press = presses_[place[i]];
            evaluate_press(plane, press, depths[i] + plane.normal.dot(given), across_, softness_, bound_of(plane, press.bounding), holds(press),
                           [&] { return slide(plane); });
            const bool touches = press.stiffness > 0.0;
            press.stiffness = 0.0;
            if (!touches || told) continue;
            told = true;
            press.shared = stiffness * (Mat3::Identity() + first.give * stiffness).inverse();
        }
    }

    void evaluate(RodPlane& plane, RodPress& press, bool holds) const noexcept {
        const double depth = plane.offset - plane.normal.dot(point(plane, state_.position));
        evaluate_press(plane, press, depth, across_, softness_, bound_of(plane, press.bounding), holds, [&] { return slide(plane); });
    }

    [[nodiscard]] double bound_of(const RodPlane& plane, double force) const noexcept { return drive_.friction * plane.friction_share * force; }

    const RodModel& model_;
    const RodState& state_;
    const RodDrive& drive_;
    std::span<RodPlane> planes_;
    double dt_;
    Index first_;
    bool twists_;
    RodWorkspace& work_;
    std::vector<RodPress>& presses_;
    RodNear& near_;
    double within_ = 0.0;   // m, of RodNear
    double across_ = 0.0;   // N/m, augmentation
    double softness_ = 0.0; // m/N, of what is behind the planes
};

} // namespace trocar::fem
