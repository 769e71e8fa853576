#include "engine/prepare/check_scene.hpp"

#include "engine/scene/check_keys.hpp"
#include "engine/scene/describe_body.hpp"
#include "engine/scene/describe_contact.hpp"
#include "engine/scene/describe_effects.hpp"
#include "engine/scene/describe_instrument.hpp"
#include "engine/scene/describe_run.hpp"
#include "engine/scene/scene_size.hpp"
#include "engine/scene/table.hpp"

#include <fmt/format.h>

#include <limits>

namespace trocar::engine {

namespace {

constexpr double kNoLimit = std::numeric_limits<double>::max();
constexpr double kMostSteps = 1e9;

/// The first error is kept; keys are those of the file.
class SceneCheck {
public:
    explicit SceneCheck(const Scene& scene) : scene_(scene) {}

    void number(const std::string& key, double value, double least, double most) {
        if (!(value >= least && value <= most))
            fail(key, most == kNoLimit ? fmt::format("found {:g}, expected a finite number, {:g} or more", value, least)
                                       : fmt::format("found {:g}, expected a number from {:g} to {:g}", value, least, most));
    }
    void above(const std::string& key, double value, double most = kNoLimit) {
        number(key, value, 0.0, most);
        if (value == 0.0) fail(key, "found 0, expected more");
    }
    void place(const std::string& key, const Vec3& value) {
        for (int axis = 0; axis < 3; ++axis) number(key, value[axis], -kMaxCoordinate, kMaxCoordinate);
    }
    void direction(const std::string& key, const Vec3& value) {
        if (auto message = refuse_direction(value)) fail(key, std::move(*message));
    }
    /// By the description of the struct's keys.
    template <class Keys>
    void keys(const std::string& key, const typename Keys::Struct& s) {
        if (const auto misfit = find_misfit<Keys>(s)) fail(key + "." + misfit->key, misfit->message);
    }
    void index(const std::string& key, std::size_t value, std::size_t count, const char* what) {
        if (value >= count) fail(key, fmt::format("found {} {}, expected one of the scene's {}", what, value, count));
    }
    void fail(const std::string& key, std::string message) {
        if (!error_) error_ = scene_error(scene_, key, std::move(message));
    }
    [[nodiscard]] bool failed() const noexcept { return error_.has_value(); }
    [[nodiscard]] Result<void> result() const { return error_ ? Result<void>(*error_) : Result<void>(); }

private:
    const Scene& scene_;
    std::optional<Error> error_;
};

void check_time(const Scene& scene, SceneCheck& check) {
    const TimeSpec& time = scene.time;
    check.keys<TimeKeys>("time", time);
    if (!check.failed() && !(time.duration / time.step <= kMostSteps))
        check.fail("time.duration", fmt::format("found {:g} steps, expected at most {:g}", time.duration / time.step, kMostSteps));
    const BudgetLimits& limits = scene.budget.limits;
    if (limits.mode != BudgetMode::Wall && limits.mode != BudgetMode::Work && limits.mode != BudgetMode::Exact)
        check.fail("budget", fmt::format("found mode {}, expected Wall, Work or Exact", static_cast<unsigned>(limits.mode)));
    if (limits.mode == BudgetMode::Wall) check.number("budget", limits.wall_s, 0.0, kMaxBudgetSeconds);
}

void check_effects(const Scene& scene, SceneCheck& check) {
    check.place("gravity", scene.gravity / 10.0); // m/s^2: 1000 is ten times what the largest accepted one has
    check.keys<EffectsKeys>("effects", scene.effects);
    check.keys<ContactKeys>("contact", scene.contact);
    check.keys<CostKeys>("cost", scene.cost);
}

void check_place(const Scene& scene, const std::string& key, const PlaceSpec& place, SceneCheck& check) {
    check.place(key, place.position);
    check.direction(key, place.direction);
    if (!place.landmark.empty()) check.index(key, place.body, scene.bodies.size(), "body");
}

/// Counts that decide how much memory a shape takes, before anything of that size is made.
void check_shape(const std::string& key, const ShapeSpec& shape, SceneCheck& check) {
    check.keys<ShapeKeys>(key, shape);
    for (const Vec3& point : shape.axis) check.place(key + ".axis", point);
    for (const double radius : shape.axis_radii) check.above(key + ".axis", radius, kMaxCoordinate);
    if (shape.kind == ShapeKind::Tube && (shape.axis.size() < 2 || shape.axis_radii.size() != shape.axis.size()))
        check.fail(key + ".axis", fmt::format("found {} points and {} radii, expected two points or more with a radius each",
                                              shape.axis.size(), shape.axis_radii.size()));
    if (!check.failed() && count_triangles(shape) > kMostTriangles)
        check.fail(key, fmt::format("found {}, expected at most {} triangles", describe_size(shape), kMostTriangles));
}

void check_fixed(const std::string& key, const FixedRegion& region, SceneCheck& check) {
    if (region.kind == RegionKind::Direction) check.keys<DirectionRegionKeys>(key, region);
    if (region.kind == RegionKind::Sphere) check.keys<SphereRegionKeys>(key, region);
    if (region.kind == RegionKind::Plane) check.keys<PlaneRegionKeys>(key, region);
    if (region.kind == RegionKind::Near) check.keys<NearRegionKeys>(key, region);
}

void check_rows(const std::string& key, const std::vector<LoadRow>& rows, SceneCheck& check) {
    double last = -kNoLimit;
    for (const LoadRow& row : rows) {
        check.number(key, row.time, last, kNoLimit);
        check.number(key, row.value, -kNoLimit, kNoLimit);
        last = row.time;
    }
}

void check_frames(const std::string& key, const std::vector<KeyFrame>& frames, SceneCheck& check) {
    double last = -kNoLimit;
    for (const KeyFrame& frame : frames) {
        check.number(key, frame.time, last, kNoLimit);
        check.place(key, frame.displacement);
        last = frame.time;
    }
}

void check_held(const std::string& key, const HeldRegion& held, SceneCheck& check) {
    check_fixed(key, held.region, check);
    check.keys<HeldMotionKeys>(key, held);
    check_rows(key + ".turns", held.turns, check);
    check_frames(key + ".moves", held.moves, check);
}

/// Torsion is the effect twist.
void check_tip(const std::string& key, const SceneInstrument& instrument, SceneCheck& check) {
    const bool twists = instrument.design.torsion;
    if (const auto& load = instrument.tip_load) {
        check_rows(key + ".tip_load.over", load->over, check);
        if (load->torque != 0.0 && !twists) check.fail(key + ".tip_load.torque", "found a torque without the effect twist, expected that effect");
    }
    if (const auto& clamp = instrument.tip_clamp) {
        check.keys<TipClampKeys>(key + ".tip_clamp", *clamp);
        check_rows(key + ".tip_clamp.turns", clamp->turns, check);
        check_rows(key + ".tip_clamp.rotation", clamp->rotation, check);
        check_frames(key + ".tip_clamp.moves", clamp->moves, check);
        if (!clamp->rotation.empty() && !twists)
            check.fail(key + ".tip_clamp.rotation", "found a rotation without the effect twist, expected that effect");
    }
}

void check_load(const std::string& key, const LoadSpec& load, SceneCheck& check) {
    if (load.region) check_fixed(key + ".where", *load.region, check);
    check_rows(key + ".over", load.over, check);
    for (int axis = 0; axis < 3; ++axis) check.number(key, load.vector[axis], -kNoLimit, kNoLimit);
    check.number(key, load.number, -kNoLimit, kNoLimit);
}

void check_around(const Scene& scene, std::size_t i, SceneCheck& check) {
    const SceneBody& body = scene.bodies[i];
    const std::string key = "bodies." + body.name + ".surface";
    check.keys<AroundSurfaceKeys>(key, body.surface);
    if (body.kind != BodyKind::Static || !body.hollow || body.embedded_in != kNoIndex)
        check.fail(key, "found a free space of another kind, expected a static, hollow body that is embedded in none");
    if (body.surface.around.empty()) check.fail(key + ".around", "found no body, expected one at least");
    std::size_t deformable = 0;
    for (const Index solid : body.surface.around) {
        check.index(key + ".around", solid, i, "body before it,");
        if (check.failed()) return;
        const SceneBody& other = scene.bodies[solid];
        deformable += other.kind == BodyKind::Deformable;
        if (other.hollow || other.kind == BodyKind::Kinematic || other.embedded_in != kNoIndex || deformable > 1)
            check.fail(key + ".around", "found a body that cannot bound it, expected solids, static ones and at most one that deforms");
    }
}

void check_body(const Scene& scene, std::size_t i, SceneCheck& check) {
    const SceneBody& body = scene.bodies[i];
    const std::string key = "bodies." + body.name;
    check.keys<BodyKeys>(key, body);
    check.keys<FileSurfaceKeys>(key + ".surface", body.surface);
    check.above(key + ".surface.unit", body.surface.unit);
    if (body.surface.source == SurfaceSource::Shape) check_shape(key + ".surface", body.surface.shape, check);
    if (body.surface.source == SurfaceSource::Around) check_around(scene, i, check);
    if (body.hollow && !body.spheres.empty()) check.fail(key + ".spheres", "found a sphere tree for a hollow body, expected none");
    if (body.embedded_in != kNoIndex) {
        check.index(key + ".embedded_in", body.embedded_in, scene.bodies.size(), "body");
        if (!check.failed() && (body.embedded_in == i || scene.bodies[body.embedded_in].kind != BodyKind::Deformable))
            check.fail(key + ".embedded_in", "found a body that cannot carry it, expected another one that is deformable");
        if (!check.failed() && body.kind == BodyKind::Deformable && (!body.hollow || body.embedded_in < i || scene.bodies[body.embedded_in].hollow))
            check.fail(key + ".embedded_in", "found a body that is not joined to it, expected a hollow one before an organ that is not hollow");
        if (!check.failed() && body.kind == BodyKind::Kinematic)
            check.fail(key + ".embedded_in", "found a body that moves as told, expected a static one, or the wall of a hollow one");
    }
    if (body.kind == BodyKind::Deformable) {
        check.above(key + ".coarse.unit", body.coarse.unit);
        if (body.coarse.file.empty()) check.keys<MeshedCoarseKeys>(key + ".coarse", body.coarse);
        if (body.coarse.file.empty() && !body.coarse.regions.empty())
            check.fail(key + ".coarse.regions", "found regions of a mesh that is made, expected a file whose cells belong to them");
        if (body.coarse.file.empty() && body.hollow != (body.coarse.mesher == CoarseMesher::Wall))
            check.fail(key + ".coarse", "expected a wall around the surface of a hollow body, and of no other");
        for (const TissueRegion& region : body.coarse.regions) check.keys<TissueRegionKeys>(key + ".coarse.regions." + region.name, region);
        for (const HeldRegion& held : body.fixed) check_held(key + ".fixed", held, check);
        for (const LoadSpec& load : body.loads) check_load(key + ".loads", load, check);
    }
    if (body.kind == BodyKind::Kinematic && body.motion.empty())
        check.fail(key + ".motion", "found no row, expected one at least for a kinematic body");
    check_frames(key + ".motion", body.motion, check);
}

void check_instrument(const Scene& scene, std::size_t i, SceneCheck& check) {
    const SceneInstrument& instrument = scene.instruments[i];
    const std::string key = "instruments." + instrument.name;
    check.index(key + ".lumen", instrument.lumen, scene.bodies.size(), "body");
    if (!check.failed() && !scene.bodies[instrument.lumen].hollow) check.fail(key + ".lumen", "found a body that is not hollow");
    if (instrument.inside != kNoIndex) check.index(key + ".inside", instrument.inside, i, "instrument before it,");
    check_place(scene, key + ".entry", instrument.entry, check);
    check.keys<InstrumentKeys>(key, instrument);
    check_tip(key, instrument, check);
    double last = -kNoLimit;
    for (const PathPoint& point : instrument.path) {
        check.number(key + ".path", point.time, last, kNoLimit);
        check.number(key + ".path", point.insertion, -kMaxCoordinate, kMaxCoordinate);
        check.number(key + ".path", point.rotation, -kNoLimit, kNoLimit);
        last = point.time;
    }
    if (!instrument.follow) return;
    check.index(key + ".follow", instrument.follow->target, scene.targets.size(), "target");
}

} // namespace

Result<void> check_scene(const Scene& scene) {
    SceneCheck check(scene);
    check_time(scene, check);
    check_effects(scene, check);
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) check_body(scene, i, check);
    for (const SceneTarget& target : scene.targets) check_place(scene, "targets." + target.name, target.place, check);
    for (std::size_t i = 0; i < scene.instruments.size(); ++i) check_instrument(scene, i, check);
    if (scene.effects.blood_drag && scene.effects.blood_drag->inlet)
        check_place(scene, "effects.blood_drag.inlet", scene.effects.blood_drag->inlet->place, check);
    return check.result();
}

} // namespace trocar::engine
