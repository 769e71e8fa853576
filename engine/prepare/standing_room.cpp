#include "engine/prepare/standing_room.hpp"

#include "base/inside.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// Of the radius: a place that a message names keeps this much more, so that its rounded coordinates still fit.
constexpr double kClearanceMargin = 1.05;

double clearance_at(const InsideTest& inside, const Vec3& p) { return -inside.signed_distance(p); }

/// In the scene's units, ready for the scene file.
std::string show_place(const Scene& scene, const Vec3& p) {
    const double unit = scene.units.length;
    return fmt::format("[{:.6g}, {:.6g}, {:.6g}] {}", p.x() / unit, p.y() / unit, p.z() / unit, scene.units.length_name);
}

std::string show_clearance(double clearance) {
    return clearance >= 0.0 ? fmt::format("has {:.3g} mm of clearance inside", 1e3 * clearance)
                            : fmt::format("lies {:.3g} mm outside of", -1e3 * clearance);
}

/// Of an error: where there is enough, and how far away.
std::string suggest_place(const Scene& scene, const std::optional<Vec3>& place, const Vec3& from) {
    if (!place) return "; expected a thinner instrument: no place of this lumen has that much";
    return fmt::format("; expected a place with more, such as {}, {:.3g} mm away", show_place(scene, *place),
                       1e3 * std::sqrt((*place - from).squaredNorm()));
}

/// m; the first place of the part that is in at the start which has too little clearance.
std::optional<double> find_blocked(const InsideTest& inside, const InstrumentModel& model, const Vec3& entry) {
    for (double s = 0.0; s < model.inserted; s += model.rod.segment)
        if (clearance_at(inside, entry + s * model.port.direction) < model.rod.design.radius) return s;
    return std::nullopt;
}

/// Of the widest inscribed sphere that holds p; 0 where none does.
double lumen_radius_at(const spheretree::LumenTree& lumen, const Vec3& p) {
    double radius = 0.0;
    for (Index ball = 0; ball < lumen.ball_count(); ++ball)
        if (const spheretree::Sphere& sphere = lumen.ball(ball); (sphere.centre - p).squaredNorm() <= sphere.radius * sphere.radius)
            radius = std::max(radius, sphere.radius);
    return radius;
}

} // namespace

std::optional<Vec3> find_clear_place(const spheretree::LumenTree& lumen, const Vec3& p, double radius,
                                        const std::function<bool(const Vec3&)>& accepts) {
    struct Candidate {
        double distance;
        Index ball;
    };
    std::vector<Candidate> candidates;
    for (Index ball = 0; ball < lumen.ball_count(); ++ball) {
        const spheretree::Sphere& sphere = lumen.ball(ball);
        if (sphere.radius >= radius)
            candidates.push_back({std::max(0.0, std::sqrt((sphere.centre - p).squaredNorm()) - (sphere.radius - radius)), ball});
    }
    std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
        return a.distance < b.distance || (a.distance == b.distance && a.ball < b.ball);
    });
    for (const Candidate& candidate : candidates) {
        const spheretree::Sphere& sphere = lumen.ball(candidate.ball);
        const Vec3 off = p - sphere.centre;
        const double length = std::sqrt(off.squaredNorm());
        const double kept = std::min(length, sphere.radius - radius);
        const Vec3 place = length > 0.0 ? Vec3(sphere.centre + kept / length * off) : sphere.centre;
        if (!accepts || accepts(place)) return place;
    }
    return std::nullopt;
}

Result<void> check_entry(const Scene& scene, const SceneInstrument& spec, const InstrumentModel& model, const BodyModel& lumen) {
    const InsideTest inside(lumen.surface);
    const std::string key = "instruments." + spec.name;
    const double radius = model.rod.design.radius;
    const Vec3& port = model.port.position;
    if (const double clearance = clearance_at(inside, port); clearance < radius) {
        const auto whole = [&](const Vec3& p) { return clearance_at(inside, p) >= radius && !find_blocked(inside, model, p); };
        auto place = find_clear_place(*lumen.lumen, port, kClearanceMargin * radius, whole);
        if (!place) place = find_clear_place(*lumen.lumen, port, kClearanceMargin * radius);
        return scene_error(scene, key + ".entry",
                           fmt::format("the entry {} {}, the instrument's radius is {:.3g} mm{}", show_clearance(clearance), lumen.name,
                                       1e3 * radius, suggest_place(scene, place, port)));
    }
    if (const auto blocked = find_blocked(inside, model, port))
        return scene_error(scene, key + ".inserted",
                           fmt::format("{:.3g} mm straight ahead of the entry the instrument meets the wall of {}: "
                                       "insert less at the start",
                                       1e3 * *blocked, lumen.name));
    return {};
}

Result<void> check_target(const Scene& scene, const SceneInstrument& spec, const InstrumentModel& model, const BodyModel& lumen,
                          const Vec3& target) {
    const InsideTest inside(lumen.surface);
    const double radius = model.rod.design.radius, clearance = clearance_at(inside, target);
    if (clearance >= radius) return {};
    const auto stands = [&](const Vec3& p) { return clearance_at(inside, p) >= radius; };
    const auto nearest = find_clear_place(*lumen.lumen, target, radius, stands);
    if (nearest && (*nearest - target).squaredNorm() <= spec.follow->settings.tolerance * spec.follow->settings.tolerance) return {};
    const auto named = find_clear_place(*lumen.lumen, target, kClearanceMargin * radius, stands);
    return scene_error(
        scene, "targets." + scene.targets[spec.follow->target].name,
        fmt::format("the target {} {}, and no place within the tolerance of {:.3g} mm has the {:.3g} mm of the radius of {}{}",
                    show_clearance(clearance), lumen.name, 1e3 * spec.follow->settings.tolerance, 1e3 * radius, spec.name,
                    suggest_place(scene, named ? named : nearest, target)));
}

std::vector<std::string> note_target(const Scene& scene, const SceneInstrument& spec, const InstrumentModel& model, const BodyModel& lumen,
                                     const Vec3& target) {
    const InsideTest inside(lumen.surface);
    const std::string name = "targets." + scene.targets[spec.follow->target].name;
    const double radius = model.rod.design.radius, tolerance = spec.follow->settings.tolerance, clearance = clearance_at(inside, target);
    std::vector<std::string> notes;
    if (clearance < radius)
        if (const auto place = find_clear_place(*lumen.lumen, target, radius))
            notes.push_back(fmt::format("{} {} {}, the radius of {} is {:.3g} mm: its tip comes no nearer than {:.3g} mm, to {}", name,
                                        show_clearance(clearance), lumen.name, spec.name, 1e3 * radius,
                                        1e3 * std::sqrt((*place - target).squaredNorm()), show_place(scene, *place)));
    const double wide = lumen_radius_at(*lumen.lumen, target);
    if (tolerance > wide && !(wide > 0.0))
        notes.push_back(fmt::format("{}: it lies beyond the lumen's inscribed spheres, and a tip within the tolerance of {:.3g} mm counts as "
                                    "arrived; expected a target inside of {}",
                                    name, 1e3 * tolerance, lumen.name));
    else if (tolerance > wide)
        notes.push_back(
            fmt::format("{}: the tolerance of {:.3g} mm is wider than the lumen there (radius {:.3g} mm): a tip that is "
                        "short of the target, or in a branch beside it, counts as arrived; expected instruments.{}.follow."
                        "tolerance of {:.3g} mm or less",
                        name, 1e3 * tolerance, 1e3 * wide, spec.name, 1e3 * wide));
    return notes;
}

} // namespace trocar::engine
