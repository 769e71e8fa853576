#include "assets/anatomy/arteries.hpp"

#include "assets/anatomy/curves.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

namespace trocar::anatomy {
namespace {

/// m, least wall-to-wall gap between vessels beyond their common mouth: grid and triangles must resolve it.
constexpr double kLeastArteryGap = 0.0018;
/// m of arc: a branch must have left its parent by then, or the two run side by side.
constexpr double kLongestMouth = 0.032;

/// Fine enough for the narrowest stretch.
double sample_spacing(const VesselPlan& plan) {
    double narrowest = plan.legs.front().radius;
    for (const Leg& leg : plan.legs) narrowest = std::min(narrowest, leg.radius);
    return std::clamp(0.4 * narrowest, 0.0005, 0.002);
}

constexpr double kTakeOffRadius = 0.013; // m, arc in which a tangential branch turns away

/// Way points of a branch's start: across the parent's axis, or an arc that begins tangentially some way before the fork, as
/// a parabola whose corner is on the axis.
std::vector<Vec3> take_off(const VesselPlan& plan, const LaidVessel& parent, std::size_t& parent_sample) {
    const std::vector<Vec3>& axis = parent.tube.points;
    const std::size_t fork = nearest_sample(axis, plan.attach);
    const Vec3 next = plan.legs.front().points.front();
    parent_sample = fork;
    if (!plan.tangential) return {axis[fork]};
    const Vec3 to_next = next - axis[fork], ahead = tangent(axis, fork);
    const double turn = std::atan2(ahead.cross(to_next).norm(), ahead.dot(to_next));
    const double lead =
        std::clamp(kTakeOffRadius * std::tan(0.5 * std::min(turn, 2.0)), 1.2 * parent.tube.radii[fork], 0.8 * to_next.norm());
    const auto back = std::min(fork, static_cast<std::size_t>(std::lround(lead / parent.spacing)));
    parent_sample = fork - back;
    const Vec3 start = axis[parent_sample];
    const Vec3 corner = start + lead * tangent(axis, parent_sample);
    const Vec3 end = corner + std::min(lead, 0.85 * (next - corner).norm()) * (next - corner).normalized();
    std::vector<Vec3> way;
    for (const double t : {0.0, 0.2, 0.4, 0.6, 0.8, 1.0}) way.push_back((1 - t) * (1 - t) * start + 2 * t * (1 - t) * corner + t * t * end);
    return way;
}

/// Smooth axis from the parent through all legs' way points.
void lay_axis(const VesselPlan& plan, std::span<const LaidVessel> laid, LaidVessel& vessel) {
    std::vector<Vec3> way;
    vessel.spacing = sample_spacing(plan);
    if (plan.parent != kNoIndex) way = take_off(plan, laid[plan.parent], vessel.parent_sample);
    for (const Leg& leg : plan.legs) way.insert(way.end(), leg.points.begin(), leg.points.end());
    std::vector<Vec3> axis = smooth_curve(way, vessel.spacing);
    relax_bends(axis, plan.least_bend, 2);
    vessel.tube.points = resample(axis, vessel.spacing);
    vessel.spacing = (vessel.tube.points[1] - vessel.tube.points[0]).norm();
    for (const Leg& leg : plan.legs) vessel.leg_end.push_back(nearest_sample(vessel.tube.points, leg.points.back()));
    vessel.leg_end.back() = vessel.tube.points.size() - 1;
}

/// Nominal radii, with a gentle taper where one leg passes into the next.
void set_radii(LaidVessel& vessel) {
    vessel.tube.radii.resize(vessel.tube.points.size());
    std::size_t begin = 0;
    for (std::size_t k = 0; k < vessel.legs.size(); ++k) {
        const Leg& leg = vessel.legs[k];
        const double end_radius = leg.end_radius > 0 ? leg.end_radius : leg.radius;
        const double before = k == 0                              ? leg.radius
                              : vessel.legs[k - 1].end_radius > 0 ? vessel.legs[k - 1].end_radius
                                                                  : vessel.legs[k - 1].radius;
        const std::size_t end = vessel.leg_end[k];
        const double length = 0.9 * static_cast<double>(end - begin) * vessel.spacing;
        for (std::size_t i = begin; i <= end; ++i) {
            const double along = static_cast<double>(i - begin) * vessel.spacing;
            const double share = end > begin ? static_cast<double>(i - begin) / static_cast<double>(end - begin) : 1.0;
            const double own = leg.radius + share * (end_radius - leg.radius);
            const double taper = smooth_ramp(along, 0.0, std::min(4.0 * before, length));
            vessel.tube.radii[i] = before + taper * (own - before);
        }
        begin = end;
    }
}

/// Sideways sway of an intrahepatic segment's middle over its length, for a unit variation.
constexpr double kSway = 0.07;

double distance_to_all(std::span<const LaidVessel> laid, const Vec3& p) {
    double least = std::numeric_limits<double>::infinity();
    for (const LaidVessel& v : laid) least = std::min(least, nearest_on_tube(v.tube, p).distance);
    return least;
}

/// Finds where the vessel leaves the others' walls, widens its mouth, sizes its fillet, checks that it stays clear afterwards.
Result<void> open_mouth(const VesselPlan& plan, std::span<const LaidVessel> laid, LaidVessel& vessel) {
    if (plan.parent == kNoIndex) return {};
    Tube& tube = vessel.tube;
    const double radius = vessel.legs.front().radius;
    const double parent_radius = laid[plan.parent].tube.radii[vessel.parent_sample];
    const double ratio = std::clamp((radius / parent_radius - 0.45) / 0.4, 0.0, 1.0);
    tube.blend = radius * (1.5 - 0.4 * ratio);

    std::size_t axis_out = 0, wall_out = 0;
    for (std::size_t i = 0; i < tube.points.size(); ++i) {
        const double outside = distance_to_all(laid, tube.points[i]);
        if (axis_out == 0 && outside > 0) axis_out = i;
        if (wall_out == 0 && outside > tube.radii[i] + std::max(tube.blend, kLeastArteryGap)) wall_out = i;
        if (wall_out > 0 && outside < tube.radii[i] + kLeastArteryGap)
            return Error{ErrorCode::BadMesh, vessel.legs.front().name + " comes too near to another vessel"};
    }
    if (wall_out == 0 || static_cast<double>(wall_out) * vessel.spacing > kLongestMouth + 2 * parent_radius)
        return Error{ErrorCode::BadMesh, vessel.legs.front().name + " does not leave its parent"};
    vessel.mouth = axis_out;
    tube.blend_begin = static_cast<double>(wall_out) * vessel.spacing;
    tube.blend_end = tube.blend_begin + 4 * radius;
    for (std::size_t i = 0; i < tube.points.size(); ++i) {
        const double past = (static_cast<double>(i) - static_cast<double>(axis_out)) * vessel.spacing;
        tube.radii[i] += plan.funnel * (1 - smooth_ramp(past, 0, 2.5 * radius));
    }
    return {};
}

} // namespace

void add_tree_plans(const Recipe& recipe, const HepaticTree& tree, std::vector<VesselPlan>& plans) {
    const auto leg_of = [&](Index i) {
        const TreeSegment& s = tree.segments[i];
        Random dice((static_cast<std::uint64_t>(recipe.seed) << 16) + i); // no vessel is perfectly straight
        const Vec3 axis = s.to - s.from;
        const Vec3 middle = 0.5 * (s.from + s.to) + (i > 1 ? kSway : 0.0) * recipe.variation * axis.cross(dice.cube());
        std::string name = i == 0 ? "right_hepatic" : i == 1 ? "left_hepatic" : "hepatic_" + std::to_string(i - 1);
        return Leg{std::move(name), murray_radius(recipe, s.flow), {middle, s.to}, i > 1};
    };
    struct Open {
        Index segment, plan;
    };
    std::vector<Open> open; // vessels still to be followed to their end
    const auto trunk = static_cast<Index>(
        std::find_if(plans.begin(), plans.end(), [](const VesselPlan& p) { return p.legs.back().name == "proper_hepatic"; }) -
        plans.begin());
    assert(trunk < plans.size());
    const auto start_branch = [&](Index segment, Index parent) {
        VesselPlan plan;
        plan.parent = parent;
        plan.parent_leg = plans[parent].legs.size() - 1;
        plan.attach = tree.segments[segment].from;
        plan.tangential = true;
        plans.push_back(plan);
        open.push_back({segment, static_cast<Index>(plans.size() - 1)});
    };
    start_branch(1, trunk);
    open.push_back({0, trunk});
    for (std::size_t k = 0; k < open.size(); ++k) {
        for (Index i = open[k].segment; i != kNoIndex; i = tree.segments[i].major) {
            plans[open[k].plan].legs.push_back(leg_of(i));
            if (tree.segments[i].minor != kNoIndex) start_branch(tree.segments[i].minor, open[k].plan);
        }
    }
}

Result<std::vector<LaidVessel>> lay_vessels(const std::vector<VesselPlan>& plans) {
    std::vector<LaidVessel> laid;
    for (const VesselPlan& plan : plans) {
        LaidVessel vessel;
        vessel.parent = plan.parent;
        vessel.parent_leg = plan.parent_leg;
        vessel.legs = plan.legs;
        lay_axis(plan, laid, vessel);
        set_radii(vessel);
        if (const auto opened = open_mouth(plan, laid, vessel); !opened) return opened.error();
        laid.push_back(std::move(vessel));
    }
    return laid;
}

} // namespace trocar::anatomy
