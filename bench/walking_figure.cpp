#include "bench/walking_figure.hpp"

#include "base/closest_point.hpp"
#include "base/trig.hpp"

#include <algorithm>
#include <cmath>
#include <map>

namespace trocar::engine {

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kWarmUp = -WalkingFigure::kStanding;    // s before time 0
constexpr double kCadence = 1.1;                         // s per two steps
constexpr double kSpeed = 1.2;                           // m/s
constexpr double kHipHeight = 0.92;                      // m
constexpr double kHipsApart = 0.105;                     // m, half
constexpr double kRounding = 0.09;                       // m, half of the joint's bend along the axis
constexpr double kTorsoDeep = 0.11, kTorsoWide = 0.175;  // m, half axes
constexpr double kTorsoBottom = -0.06, kTorsoTop = 0.52; // m from the hips
constexpr double kSkinOffset = 6e-3; // m, vertices of the cloth keep it from the skin: its sides cut corners by about half of it

/// Rings and sides of the parts: faces 2 rings sides.
struct Tube {
    Index rings, sides;
};
constexpr Tube kLeg{90, 40}, kArm{64, 28}, kTorso{60, 44}, kHead{44, 22};

/// In the plane of the walk, x forwards, z up.
Vec3 down_at(double angle) noexcept {
    const SinCos s = sin_cos(angle);
    return {s.sin, 0.0, -s.cos};
}

} // namespace

Limb::Place Limb::at(double arc) const noexcept {
    const Vec3 first = down_at(swing), second = down_at(swing - flex), joint = root + upper * first;
    if (arc <= upper - kRounding) return {root + arc * first, first};
    if (arc >= upper + kRounding) return {joint + (arc - upper) * second, second};
    const double s = (arc - upper + kRounding) / (2.0 * kRounding); // a parabola with the joint as its middle point
    const Vec3 from = joint - kRounding * first, to = joint + kRounding * second;
    const Vec3 along = (1.0 - s) * first + s * second;
    return {(1.0 - s) * (1.0 - s) * from + 2.0 * s * (1.0 - s) * joint + s * s * to, along / along.norm()};
}

double Limb::radius_at(double arc) const noexcept {
    const double knots[] = {0.0, upper, upper + 0.3 * lower, length()};
    for (std::size_t i = 0; i < 3; ++i)
        if (arc <= knots[i + 1] || i == 2) {
            const double s = std::clamp((arc - knots[i]) / (knots[i + 1] - knots[i]), 0.0, 1.0);
            return radius[i] + s * s * (3.0 - 2.0 * s) * (radius[i + 1] - radius[i]);
        }
    return radius[3];
}

FigurePose WalkingFigure::pose(double time) noexcept {
    // standing at -kWarmUp, walking at 0
    const double ease = std::clamp(1.0 + time / kWarmUp, 0.0, 1.0), share = ease * ease * (3.0 - 2.0 * ease);
    const double phase = 2.0 * kPi * time / kCadence;
    FigurePose pose;
    const double before = std::clamp(kWarmUp + time, 0.0, kWarmUp);
    const double way = time > 0.0 ? kSpeed * time : 0.5 * kSpeed * (before * before / kWarmUp - kWarmUp); // speeding up evenly
    pose.pelvis = Vec3(way, 0.0, kHipHeight + 0.012 * share * sin_cos(2.0 * phase).sin);
    for (std::size_t side = 0; side < 2; ++side) {
        const double own = phase + kPi * static_cast<double>(side), out = side == 0 ? 1.0 : -1.0;
        pose.legs[side] = {.root = pose.pelvis + Vec3(0.0, out * kHipsApart, 0.0),
                           .upper = 0.42,
                           .lower = 0.44,
                           .swing = share * 0.42 * sin_cos(own).sin,
                           .flex = 0.04 + share * 0.42 * (1.0 - sin_cos(own + 1.1).cos),
                           .radius = {0.085, 0.056, 0.058, 0.038}};
        pose.arms[side] = {.root = pose.pelvis + Vec3(0.0, out * 0.22, 0.48),
                           .upper = 0.30,
                           .lower = 0.32,
                           .swing = -share * 0.35 * sin_cos(own).sin,
                           .flex = -0.15 - share * 0.15 * (1.0 + sin_cos(own).sin),
                           .radius = {0.052, 0.038, 0.040, 0.028}};
    }
    return pose;
}

WalkingFigure::WalkingFigure() {
    for (const Tube& tube : {kLeg, kLeg, kArm, kArm, kTorso, kHead}) add_tube(tube.rings, tube.sides);
}

/// Rings from the top, then the two ends' middles.
void WalkingFigure::add_tube(Index rings, Index sides) {
    const auto first = static_cast<Index>(vertex_count_);
    const auto id = [&](Index ring, Index side) { return first + ring * sides + side % sides; };
    const Index top = first + rings * sides, bottom = top + 1;
    for (Index side = 0; side < sides; ++side) {
        triangles_.push_back({top, id(0, side), id(0, side + 1)});
        triangles_.push_back({bottom, id(rings - 1, side + 1), id(rings - 1, side)});
        for (Index ring = 0; ring + 1 < rings; ++ring) {
            triangles_.push_back({id(ring, side), id(ring + 1, side), id(ring + 1, side + 1)});
            triangles_.push_back({id(ring, side), id(ring + 1, side + 1), id(ring, side + 1)});
        }
    }
    vertex_count_ += rings * sides + 2;
}

void WalkingFigure::place_skin(double time, std::vector<Vec3>& skin) const {
    const FigurePose now = pose(time);
    skin.clear();
    const auto place_limb = [&](const Limb& limb, const Tube& tube) {
        for (Index ring = 0; ring < tube.rings; ++ring) {
            const double arc = limb.length() * static_cast<double>(ring) / static_cast<double>(tube.rings - 1);
            const Limb::Place at = limb.at(arc);
            const Vec3 across(-at.along[2], 0.0, at.along[0]);
            for (Index side = 0; side < tube.sides; ++side) {
                const SinCos angle = sin_cos(2.0 * kPi * static_cast<double>(side) / tube.sides);
                skin.push_back(at.point + limb.radius_at(arc) * (angle.cos * across + angle.sin * Vec3::UnitY()));
            }
        }
        skin.push_back(limb.at(0.0).point);
        skin.push_back(limb.at(limb.length()).point);
    };
    /// Upright, with half axes by height.
    const auto place_trunk = [&](double from, double to, const Tube& tube, auto half_axes) {
        for (Index ring = 0; ring < tube.rings; ++ring) {
            const double share = static_cast<double>(ring) / static_cast<double>(tube.rings - 1), z = to + share * (from - to);
            const auto [deep, wide] = half_axes(1.0 - share);
            for (Index side = 0; side < tube.sides; ++side) {
                const SinCos angle = sin_cos(2.0 * kPi * static_cast<double>(side) / tube.sides);
                skin.push_back(now.pelvis + Vec3(deep * angle.cos, wide * angle.sin, z));
            }
        }
        skin.push_back(now.pelvis + Vec3(0.0, 0.0, to));
        skin.push_back(now.pelvis + Vec3(0.0, 0.0, from));
    };
    for (const Limb& leg : now.legs) place_limb(leg, kLeg);
    for (const Limb& arm : now.arms) place_limb(arm, kArm);
    place_trunk(kTorsoBottom, kTorsoTop, kTorso, [](double) { return std::array{kTorsoDeep, kTorsoWide}; });
    place_trunk(0.58, 0.82, kHead, [](double up) {
        const double round = std::sqrt(std::max(0.02, 4.0 * up * (1.0 - up)));
        return std::array{0.1 * round, 0.08 * round};
    });
}

namespace {

constexpr Index kWaistSides = 22, kWaistStrips = 7;   // around the pelvis
constexpr Index kLegSides = 15, kLegStrips = 21;      // around each leg; then one strip to a cuff of kCuffSides
constexpr Index kCuffSides = 14, kCrotchVertices = 3; // between front and back of the lowest ring of the waist
constexpr double kCrotch = -0.15, kWaistTop = 0.12;   // m from the hips
constexpr double kCuff = 0.80;                        // m along the leg
constexpr double kLoose = 0.016;                      // m, between cloth and leg as it is sewn

Vec3 waist_point(Index ring, Index side, const Vec3& pelvis) {
    const SinCos angle = sin_cos(2.0 * kPi * static_cast<double>(side) / kWaistSides);
    const double down = static_cast<double>(ring) / kWaistStrips, loose = 1.04 + 0.06 * down;
    return pelvis +
           Vec3(loose * kTorsoDeep * angle.cos, (loose + 0.02 * down) * kTorsoWide * angle.sin, kWaistTop + down * (kCrotch - kWaistTop));
}

} // namespace

Trousers::Trousers(bool walks) : time_(WalkingFigure::kStanding), walks_(walks) {
    sew();
    add_springs();
    before_ = now_;
    while (time_ < -0.5 * WalkingFigure::kStep) advance();
}

/// Three borders (waist 22, cuffs 14 sides), 1,626 faces: 7 strips of 44, 2 times 21 of 30, 2 of 29.
void Trousers::sew() {
    const FigurePose pose = WalkingFigure::pose(time_);
    std::vector<Index> upper, lower;
    for (Index ring = 0; ring <= kWaistStrips; ++ring) {
        lower.clear();
        for (Index side = 0; side < kWaistSides; ++side) {
            lower.push_back(static_cast<Index>(now_.size()));
            now_.push_back(waist_point(ring, side, pose.pelvis));
        }
        if (ring == 0) waist_ = lower;
        if (ring > 0) add_strip(upper, lower);
        upper = lower;
    }
    const std::vector<Index> hips = upper;
    std::vector<Index> crotch; // from the back to the front
    for (Index i = 1; i <= kCrotchVertices; ++i) {
        const double share = static_cast<double>(i) / (kCrotchVertices + 1);
        crotch.push_back(static_cast<Index>(now_.size()));
        now_.push_back((1.0 - share) * now_[hips[kWaistSides / 2]] + share * now_[hips[0]] -
                       Vec3(0.0, 0.0, 0.03 * 4.0 * share * (1.0 - share)));
    }
    for (std::size_t side = 0; side < 2; ++side) {
        const Limb& leg = pose.legs[side];
        upper.clear();
        for (Index i = 0; i <= kWaistSides / 2; ++i) upper.push_back(hips[(i + (side == 0 ? 0 : kWaistSides / 2)) % kWaistSides]);
        if (side == 0)
            upper.insert(upper.end(), crotch.begin(), crotch.end());
        else
            upper.insert(upper.end(), crotch.rbegin(), crotch.rend());
        const Vec3 first = now_[upper[0]] - leg.at(-kCrotch).point;
        const double start = std::atan2(first[1], first[0]);
        for (Index ring = 1; ring <= kLegStrips + 1; ++ring) {
            const double arc = -kCrotch + (kCuff + kCrotch) * static_cast<double>(ring) / (kLegStrips + 1);
            const Limb::Place at = leg.at(arc);
            const Vec3 across(-at.along[2], 0.0, at.along[0]);
            const Index sides = ring <= kLegStrips ? kLegSides : kCuffSides;
            lower.clear();
            for (Index i = 0; i < sides; ++i) {
                const SinCos angle = sin_cos(start + 2.0 * kPi * static_cast<double>(i) / sides);
                lower.push_back(static_cast<Index>(now_.size()));
                now_.push_back(at.point + (leg.radius_at(arc) + kLoose) * (angle.cos * across + angle.sin * Vec3::UnitY()));
            }
            add_strip(upper, lower);
            upper = lower;
        }
    }
}

/// Between two closed rows, each run through counter-clockwise seen from above; always the shorter step next.
void Trousers::add_strip(std::span<const Index> upper, std::span<const Index> lower) {
    const std::size_t m = upper.size(), n = lower.size();
    for (std::size_t i = 0, k = 0; i < m || k < n;) {
        const bool down = i == m || (k < n && (k + 1) * m <= (i + 1) * n);
        if (down) {
            triangles_.push_back({upper[i % m], lower[k], lower[(k + 1) % n]});
            ++k;
        } else {
            triangles_.push_back({upper[i], lower[k % n], upper[(i + 1) % m]});
            ++i;
        }
    }
}

/// Sides of faces, and across them the two corners that face each other.
void Trousers::add_springs() {
    std::map<std::array<Index, 2>, Index> opposite;
    const auto add = [&](Index a, Index b, double stiffness) { springs_.push_back({a, b, (now_[a] - now_[b]).norm(), stiffness}); };
    for (const Triangle& t : triangles_)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = t[k], b = t[(k + 1) % 3], corner = t[(k + 2) % 3];
            const auto [known, fresh] = opposite.try_emplace({std::min(a, b), std::max(a, b)}, corner);
            if (fresh)
                add(a, b, 0.5);
            else
                add(known->second, corner, 0.02);
        }
}

void Trousers::advance() {
    constexpr int kParts = 4;
    for (int part = 0; part < kParts; ++part)
        advance_part(time_ + WalkingFigure::kStep * part / kParts, time_ + WalkingFigure::kStep * (part + 1) / kParts);
    time_ += WalkingFigure::kStep;
}

/// source   Mueller, Heidelberger, Hennix, Ratcliff, "Position based dynamics" (2007)
void Trousers::advance_part(double from, double to) {
    const double dt = to - from;
    const FigurePose pose_from = WalkingFigure::pose(walks_ ? from : WalkingFigure::kStanding),
                     pose_to = WalkingFigure::pose(walks_ ? to : WalkingFigure::kStanding);
    start_ = now_;
    for (std::size_t v = 0; v < now_.size(); ++v) now_[v] += 0.998 * (now_[v] - before_[v]) - Vec3(0.0, 0.0, 9.81 * dt * dt);
    before_ = start_;
    for (const Index v : waist_) now_[v] = start_[v] + pose_to.pelvis - pose_from.pelvis;
    for (int round = 0; round < 12; ++round) {
        for (const Spring& s : springs_) {
            const Vec3 between = now_[s.a] - now_[s.b];
            const double length = between.norm();
            if (!(length > 1e-9)) continue;
            const Vec3 correction = s.stiffness * (length - s.rest) / length * between;
            now_[s.a] -= correction;
            now_[s.b] += correction;
        }
        for (const Index v : waist_) now_[v] = start_[v] + pose_to.pelvis - pose_from.pelvis;
    }
    keep_out(pose_from, pose_to);
}

/// Vertices that are nearer than kSkinOffset to a leg or the trunk are put there, and dragged along a little.
void Trousers::keep_out(const FigurePose& from, const FigurePose& to) {
    constexpr std::size_t kPieces = 24;
    constexpr double kDrag = 0.15; // share of the sliding that friction takes in one part of a step
    for (std::size_t side = 0; side < 2; ++side) {
        const Limb &leg = to.legs[side], &old = from.legs[side];
        std::array<Vec3, kPieces + 1> axis;
        for (std::size_t i = 0; i <= kPieces; ++i) axis[i] = leg.at(leg.length() * static_cast<double>(i) / kPieces).point;
        for (std::size_t v = waist_.size(); v < now_.size(); ++v) {
            double best_sq = 1e9, arc = 0.0;
            Vec3 on = axis[0];
            for (std::size_t i = 0; i < kPieces; ++i) {
                const PointOnSegment near = closest_on_segment(now_[v], {axis[i], axis[i + 1]});
                if (near.distance_sq >= best_sq) continue;
                best_sq = near.distance_sq;
                on = near.point;
                arc = leg.length() * (static_cast<double>(i) + near.parameter) / kPieces;
            }
            const double keep = leg.radius_at(arc) + kSkinOffset, distance = std::sqrt(best_sq);
            if (distance >= keep || !(distance > 1e-9)) continue;
            now_[v] = on + keep / distance * (now_[v] - on);
            const Vec3 sliding = (now_[v] - before_[v]) - (leg.at(arc).point - old.at(arc).point);
            now_[v] -= kDrag * sliding;
        }
    }
    for (std::size_t v = waist_.size(); v < now_.size(); ++v) {
        const Vec3 p = now_[v] - to.pelvis;
        if (p[2] < kTorsoBottom - kSkinOffset || p[2] > kTorsoTop) continue;
        const double x = p[0] / (kTorsoDeep + kSkinOffset), y = p[1] / (kTorsoWide + kSkinOffset), out = std::sqrt(x * x + y * y);
        if (out < 1.0 && out > 1e-9) {
            now_[v][0] = to.pelvis[0] + p[0] / out;
            now_[v][1] = to.pelvis[1] + p[1] / out;
        }
    }
}

} // namespace trocar::engine
