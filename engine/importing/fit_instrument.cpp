#include "engine/importing/fit_instrument.hpp"

#include "engine/prepare/way_shape.hpp"
#include "engine/scene/device.hpp"
#include "engine/scene/nearest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Of the narrowest radius on the way: the instrument's, within what instruments are, m.
constexpr double kRadiusShare = 0.35, kThinnest = 1e-4, kThickest = 6e-4;
/// Radii of the widest fork on the way that the tip at rest reaches to the side: across the lumen, and into a branch beyond it.
constexpr double kReach = 3.0;
/// The tip's bend: of the sharpest fork's turn, because walls straighten it; within these bounds, rad.
constexpr double kBendShare = 1.5, kLeastBend = 0.7, kMostBend = 1.8;
/// Tip's length: of the narrowest radius where the way has no fork; within these bounds, m.
constexpr double kPlainTip = 5.0, kShortestTip = 2e-3, kLongestTip = 6e-2;
/// Of the target's radius, nearly its inscribed sphere: a tip that is so near has arrived. A shaped tip lies on the wall, and one that lies there
/// is as much in the vessel as one in its middle.
constexpr double kArrivedShare = 0.97;
/// Radii of the narrowest place on the way that it is driven a second, and the fastest, m/s: in a small vessel a turn of the handle takes as long
/// as in a wide one.
constexpr double kRadiiASecond = 12.0, kFastest = 0.03;
/// An instrument needs this much beyond its radius, on its way.
constexpr double kRoom = 1.3;
/// Of the widest place behind it: near its end a way counts as long as it is this wide, an entry likewise.
constexpr double kFullWidth = 0.9;
/// m: beyond the entry an instrument begins with at most this much, straight.
constexpr double kMostInserted = 8e-3;
/// m: an instrument is longer than its way by this much, and no longer than this.
constexpr double kSpareLength = 0.1, kLongestInstrument = 3.0;

double clearance(const InsideTest& inside, const Vec3& p) { return -inside.signed_distance(p); }

/// First point of the way that is not narrowed by the cap it begins at.
std::size_t find_begin(const CentrelineWay& way, double inlet_radius) {
    double along = 0.0, widest = way.radii[0];
    std::size_t last = 1;
    for (; last < way.points.size() && along < 3.0 * inlet_radius; ++last) {
        along += (way.points[last] - way.points[last - 1]).norm();
        widest = std::max(widest, way.radii[last]);
    }
    for (std::size_t i = 0; i + 1 < last; ++i)
        if (way.radii[i] >= kFullWidth * widest) return i;
    return 0;
}

/// Last point of the way that is not narrowed by the cap it ends at.
std::size_t find_end(const CentrelineWay& way, double end_radius) {
    double along = 0.0, widest = way.radii.back();
    std::size_t first = way.points.size() - 1;
    for (; first > 0 && along < 3.0 * end_radius; --first) {
        along += (way.points[first] - way.points[first - 1]).norm();
        widest = std::max(widest, way.radii[first]);
    }
    for (std::size_t i = way.points.size() - 1; i > first; --i)
        if (way.radii[i] >= kFullWidth * widest) return i;
    return first;
}

VesselTarget make_target(const CentrelineWay& way, std::size_t begin, const VesselEnd& end) {
    const std::size_t last = std::max(begin + 1, std::min(find_end(way, end.radius), way.points.size() - 1));
    VesselTarget target{end.name, way.points[last], way.radii[last], way.radii[begin], 0.0};
    for (std::size_t i = begin + 1; i <= last; ++i) {
        target.narrowest = std::min(target.narrowest, way.radii[i]);
        target.way += (way.points[i] - way.points[i - 1]).norm();
    }
    return target;
}

/// Along the way over the width of the lumen, so that no single point decides.
Vec3 direction_at(const CentrelineWay& way, std::size_t from) {
    double along = 0.0;
    std::size_t to = from;
    while (to + 1 < way.points.size() && along < 3.0 * way.radii[from]) along += (way.points[to + 1] - way.points[to]).norm(), ++to;
    const Vec3 ahead = way.points[to] - way.points[from];
    return ahead.norm() > 0.0 ? Vec3(ahead.normalized()) : Vec3(Vec3::UnitZ());
}

double free_ahead(const InsideTest& inside, const Vec3& from, const Vec3& direction, double radius) {
    constexpr double kStep = 2.5e-4; // m
    double s = 0.0;
    while (s < 1.25 * kMostInserted && clearance(inside, from + (s + kStep) * direction) >= kRoom * radius) s += kStep;
    return s;
}

/// What a tip must do on a way: at its forks, between the entry and the target.
struct ForkNeeds {
    double radius = 0.0; // m, of the lumen at the widest fork
    double turn = 0.0;   // rad, of the way at the fork that turns it most
};

ForkNeeds find_needs(std::span<const CentrelineBranch> branches, Index branch, const CentrelineWay& way, std::size_t begin) {
    ForkNeeds needs;
    std::size_t behind = 0; // points from the fork to the way's end
    for (Index b = branch; branches[b].parent != kNoIndex; b = branches[b].parent) {
        behind += branches[b].points.size() - 1;
        const std::size_t fork = way.points.size() - 1 - behind;
        if (fork <= begin) break;
        needs.radius = std::max(needs.radius, way.radii[fork]);
        needs.turn = std::max(needs.turn, measure_place(way.points, way.radii, fork).turn);
    }
    return needs;
}

void shape_tip(FittingInstrument& fit, const ForkNeeds& needs, double narrowest) {
    fit.tip_angle = std::clamp(kBendShare * needs.turn, kLeastBend, kMostBend);
    const double reaching = kReach * needs.radius / tip_reach(1.0, fit.tip_angle);
    fit.tip_length = std::clamp(std::max(kPlainTip * narrowest, reaching), kShortestTip, kLongestTip);
}

/// The widest way that does not turn back, if there is one; of equally wide ones the longest, so that there is something to see.
std::size_t choose_target(const std::vector<VesselTarget>& targets, const std::vector<ForkNeeds>& needs) {
    std::size_t best = 0;
    for (std::size_t t = 1; t < targets.size(); ++t) {
        const bool back = needs[t].turn > kTurnsBack, best_back = needs[best].turn > kTurnsBack;
        const double a = targets[t].narrowest, b = targets[best].narrowest;
        const bool wider = a > 1.001 * b || (a > 0.999 * b && targets[t].way > targets[best].way);
        if (back != best_back ? best_back : wider) best = t;
    }
    return best;
}

/// Radius, segment and length of a catheter made for the way to the target.
Result<void> size_catheter(FittingInstrument& fit, const VesselTarget& aim, double longest) {
    fit.radius = std::clamp(kRadiusShare * aim.narrowest, kThinnest, kThickest);
    fit.segment = std::clamp(1.2 * aim.narrowest, 5e-4, 2.5e-3);
    fit.length = std::min(longest + kSpareLength, kLongestInstrument);
    if (aim.narrowest >= kRoom * fit.radius) return {};
    return Error{ErrorCode::BadMesh,
                 fmt::format("its widest way is {:.3g} mm wide at its narrowest place, and instruments are {:.3g} mm at least; expected "
                             "another --unit, or another --inlet",
                             2e3 * aim.narrowest, 2e3 * kThinnest)};
}

/// The same of a device, which is cut off behind where it is longer than the ways.
Result<void> size_device(FittingInstrument& fit, std::string_view name, const VesselTarget& aim, double longest, std::vector<std::string>& notes) {
    const auto text = find_device(name);
    if (!text) return Error{ErrorCode::BadUsage, refuse_unknown("device", name, device_names()), {}, 0, 0, "--instrument"};
    const Result<Device> device = parse_device(*text, std::string(name));
    if (!device.ok()) return device.error();
    const fem::RodDesign& design = device->instrument.design;
    fit.device = name;
    fit.radius = design.radius;
    fit.segment = std::min(design.segment, std::clamp(1.2 * aim.narrowest, 5e-4, 2.5e-3));
    fit.length = std::min(longest + kSpareLength, design.length);
    if (design.length < longest)
        notes.push_back(fmt::format("{} is {:.4g} mm long, and the farthest target is {:.4g} mm away", name, 1e3 * design.length, 1e3 * longest));
    if (aim.narrowest >= kRoom * fit.radius) return {};
    return Error{ErrorCode::BadMesh,
                 fmt::format("its widest way is {:.3g} mm wide at its narrowest place, and {} is {:.3g} mm thick; expected a place {:g} times as wide: another "
                             "device, another --unit, or another --inlet",
                             2e3 * aim.narrowest, name, 2e3 * fit.radius, kRoom)};
}

} // namespace

Result<void> fit_instrument(ImportedVessel& vessel, const InsideTest& inside, std::string_view device) {
    std::vector<std::size_t> begins;
    std::vector<CentrelineWay> ways;
    std::vector<ForkNeeds> needs;
    for (std::size_t e = 1; e < vessel.ends.size(); ++e) {
        ways.push_back(way_to(vessel.branches, vessel.end_branch[e]));
        begins.push_back(std::min(find_begin(ways.back(), vessel.ends[0].radius), ways.back().points.size() - 2));
        vessel.targets.push_back(make_target(ways.back(), begins.back(), vessel.ends[e]));
        needs.push_back(find_needs(vessel.branches, vessel.end_branch[e], ways.back(), begins.back()));
    }
    FittingInstrument& fit = vessel.instrument;
    fit.target = choose_target(vessel.targets, needs);
    const VesselTarget& aim = vessel.targets[fit.target];
    double longest = 0.0;
    for (const VesselTarget& target : vessel.targets) longest = std::max(longest, target.way);
    const Result<void> sized = device.empty() ? size_catheter(fit, aim, longest) : size_device(fit, device, aim, longest, vessel.notes);
    if (!sized.ok()) return sized;
    vessel.entry = ways[fit.target].points[begins[fit.target]];
    vessel.direction = direction_at(ways[fit.target], begins[fit.target]);
    fit.inserted = 0.8 * free_ahead(inside, vessel.entry, vessel.direction, fit.radius);
    shape_tip(fit, needs[fit.target], aim.narrowest);
    fit.speed = std::min(kRadiiASecond * aim.narrowest, kFastest);
    fit.tolerance = kArrivedShare * aim.radius;
    std::size_t narrow = 0;
    for (const VesselTarget& target : vessel.targets) narrow += target.narrowest < kRoom * fit.radius;
    if (narrow > 0)
        vessel.notes.push_back(fmt::format("{} of {} targets lie behind places that are too narrow for the instrument's radius of {:.3g} mm; "
                                           "a smaller {} reaches them",
                                           narrow, vessel.targets.size(), 1e3 * fit.radius, fit.device.empty() ? "\"radius\" in the scene" : "device"));
    return {};
}

} // namespace trocar::engine
