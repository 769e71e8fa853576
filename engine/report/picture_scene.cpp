#include "engine/report/picture_scene.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace trocar::engine {

namespace {

constexpr double kTipViewHeight = 64.0;   // [-] of a tip picture, in radii of the instrument
constexpr double kTipViewAngle = 0.35;    // rad
constexpr Index kTipTangentNodes = 4;     // back from the tip, for its direction
constexpr double kTipOrganOpacity = 0.05; // an organ around the tip is almost transparent
constexpr double kTipVesselOpacity = 0.26;
constexpr double kInstrumentEmphasis = 0.92; // seen from afar, through two walls and an organ
constexpr double kInstrumentPixels = 2.5;    // half width of an instrument seen from afar
constexpr double kFluoroVessel = 9.0;        // 1/m: a trace of contrast agent
constexpr double kFluoroTail = 0.05;         // m behind the tip that stays in the picture
constexpr double kFluoroOrgan = 1.6;         // 1/m
constexpr std::size_t kMaxMarkers = 4000;
constexpr double kMarkerForce = 1.0e-3;   // N, gentler presses are left out
constexpr double kMarkerRadius = 3.4;     // pixels at a height of 720
constexpr double kSmallestRange = 1.0e-5; // m, of the colour bar

RenderSurface make_surface(PictureView view, const BodyModel& body, const BodyState& state) {
    RenderSurface surface{.vertices = state.surface, .triangles = body.surface.triangles};
    if (body.hollow) {
        surface.colour = palette::kArtery;
        surface.opacity = view == PictureView::Tip ? kTipVesselOpacity : palette::kVesselOpacity;
        surface.attenuation = kFluoroVessel;
    } else if (body.motion == Motion::Deformable) {
        surface.colour = palette::kLiver;
        surface.opacity = view == PictureView::Tip ? kTipOrganOpacity : palette::kOrganOpacity;
        surface.attenuation = kFluoroOrgan;
    } else {
        surface.colour = palette::kRigid;
        surface.attenuation = kFluoroOrgan;
    }
    return surface;
}

std::vector<Vec3> inserted_part(const InstrumentModel& instrument, const fem::RodState& rod) {
    std::vector<Vec3> points{instrument.port.position};
    const Index first = std::min(fem::first_inserted_node(instrument.rod, rod.insertion), static_cast<Index>(rod.position.size()));
    points.insert(points.end(), rod.position.begin() + first, rod.position.end());
    return points;
}

void add_instrument(PictureView view, const InstrumentModel& instrument, const InstrumentState& state, View& out) {
    if (view == PictureView::Anatomy) {
        const std::vector<Vec3>& line = out.lines.emplace_back(inserted_part(instrument, state.rod));
        out.scene.tubes.push_back(
            {.points = line, .radius = instrument.rod.design.radius, .min_radius_px = kInstrumentPixels, .emphasis = kInstrumentEmphasis});
        return;
    }
    out.scene.surfaces.push_back({.vertices = state.skin,
                                  .triangles = instrument.skin.triangles,
                                  .colour = palette::kInstrument,
                                  .emphasis = palette::kInstrumentEmphasis,
                                  .attenuation = palette::kInstrumentAttenuation});
}

constexpr double kMarkerStiffness = 2e4; // N/m, of the depth that a press is coloured by

/// Where walls press on a rod: on the wall, coloured by how deep it is pressed in.
void add_wall_markers(const InstrumentModel& instrument, const InstrumentState& state, RenderScene& out) {
    for (const fem::RodPlane& plane : state.planes) {
        if (!(plane.force > kMarkerForce) || out.markers.size() >= kMaxMarkers) continue;
        const Vec3 axis = (1.0 - plane.weight) * state.rod.position[plane.node] + plane.weight * state.rod.position[plane.node + 1];
        out.markers.push_back({axis - instrument.rod.design.radius * plane.normal, plane.force / kMarkerStiffness});
    }
}

void add_markers(const Moment& moment, RenderScene& out) {
    if (!moment.markers || moment.state.step == 0) return;
    const SceneModel& model = moment.prepared.model;
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        add_wall_markers(model.instruments[i], moment.state.instruments[i], out);
    for (const Contact& contact : moment.contacts)
        if (is_between_bodies(contact) && out.markers.size() < kMaxMarkers)
            out.markers.push_back({contact.point, -contact.gap});
    double deepest = 0.0;
    for (const RenderMarker& marker : out.markers) deepest = std::max(deepest, marker.depth);
    if (deepest < kSmallestRange) out.marker_range = kSmallestRange; // else it follows the deepest
    out.marker_radius_px = kMarkerRadius;
}

std::vector<Vec3> all_points(const Moment& moment) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < moment.state.bodies.size(); ++i) {
        const std::vector<Vec3>& surface = moment.state.bodies[i].surface;
        if (!moment.prepared.model.bodies[i].is_free_space) points.insert(points.end(), surface.begin(), surface.end());
    }
    for (std::size_t i = 0; i < moment.state.instruments.size(); ++i) {
        const std::vector<Vec3> line = inserted_part(moment.prepared.model.instruments[i], moment.state.instruments[i].rod);
        points.insert(points.end(), line.begin(), line.end());
    }
    return points;
}

/// As on the angiography table: the organ in the middle, and the instrument's tip wherever it is.
std::vector<Vec3> fluoroscopy_points(const Moment& moment) {
    std::vector<Vec3> points;
    for (std::size_t i = 0; i < moment.state.bodies.size(); ++i) {
        const std::vector<Vec3>& surface = moment.state.bodies[i].surface;
        if (moment.prepared.model.bodies[i].motion == Motion::Deformable) points.insert(points.end(), surface.begin(), surface.end());
    }
    if (points.empty()) return all_points(moment);
    for (const InstrumentState& instrument : moment.state.instruments)
        for (const Vec3& p : instrument.rod.position)
            if ((p - instrument.rod.position.back()).squaredNorm() < kFluoroTail * kFluoroTail) points.push_back(p);
    return points;
}

Camera tip_camera(const InstrumentModel& instrument, const fem::RodState& rod) {
    const Vec3 tip = rod.position.back();
    const std::size_t behind = rod.position.size() - 1 - std::min<std::size_t>(kTipTangentNodes, rod.position.size() - 1);
    const Vec3 along = tip - rod.position[behind];
    const double length = along.norm();
    const Vec3 tangent = length > 0.0 ? Vec3(along / length) : Vec3(Vec3::UnitZ());
    Vec3 direction = kFrontView - kFrontView.dot(tangent) * tangent; // across the instrument, as far in front as that allows
    if (!(direction.norm() > 0.2)) direction = Vec3::UnitX() - tangent.x() * tangent;
    direction.normalize();
    const double height = kTipViewHeight * instrument.rod.design.radius;
    Camera camera;
    camera.look_at = tip - 0.15 * height * tangent;
    camera.field_of_view_rad = kTipViewAngle;
    camera.eye = camera.look_at - direction * (0.5 * height / std::tan(0.5 * kTipViewAngle));
    camera.up = std::abs(direction.z()) < 0.9 ? Vec3::UnitZ() : Vec3::UnitY();
    return camera;
}

/// How far the nearest vertex of a hollow body has moved from its rest place: targets lie in vessels, and go with them.
Vec3 drift_of(const Vec3& rest, const Moment& moment) {
    double nearest = std::numeric_limits<double>::infinity();
    Vec3 drift = Vec3::Zero();
    for (std::size_t i = 0; i < moment.prepared.model.bodies.size(); ++i) {
        const BodyModel& body = moment.prepared.model.bodies[i];
        if (!body.hollow || !body.moves()) continue;
        for (std::size_t v = 0; v < body.surface.vertices.size(); ++v) {
            const double distance = (body.surface.vertices[v] - rest).squaredNorm();
            if (distance >= nearest) continue;
            nearest = distance;
            drift = moment.state.bodies[i].surface[v] - body.surface.vertices[v];
        }
    }
    return drift;
}

} // namespace

View make_view(PictureView view, const Moment& moment, unsigned width, unsigned height) {
    View out;
    const SceneModel& model = moment.prepared.model;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (!model.bodies[i].is_free_space) out.scene.surfaces.push_back(make_surface(view, model.bodies[i], moment.state.bodies[i]));
    out.lines.reserve(model.instruments.size()); // tubes point into it
    for (std::size_t i = 0; i < model.instruments.size(); ++i) add_instrument(view, model.instruments[i], moment.state.instruments[i], out);
    const double aspect = static_cast<double>(width) / static_cast<double>(height);
    const double target_size = model.instruments.empty() ? 0.003 : 3.0 * model.instruments[kLeadInstrument].rod.design.radius;
    for (const Place& target : moment.prepared.targets)
        out.scene.targets.push_back({target.position + drift_of(target.position, moment), target_size});
    if (view == PictureView::Fluoroscopy) {
        out.camera = frame_camera(fluoroscopy_points(moment), {.direction = kAnteroPosteriorView, .aspect = aspect, .orthographic = true});
        return out;
    }
    add_markers(moment, out.scene);
    if (view == PictureView::Tip && !model.instruments.empty())
        out.camera = tip_camera(model.instruments[kLeadInstrument], moment.state.instruments[kLeadInstrument].rod);
    else
        out.camera = frame_camera(all_points(moment), {.direction = kFrontView, .aspect = aspect});
    return out;
}

} // namespace trocar::engine
