#include "engine/fluoroscopy/patient.hpp"

#include "engine/effects/contrast/contrast.hpp"
#include "engine/fluoroscopy/matter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

namespace trocar::engine {

namespace {

constexpr double kLeastIodine = 1e-6; // kg/m^3, of what is drawn
constexpr unsigned kTubeSides = 12;
constexpr int kArmChecks = 64; // places of a moving arm at which its source is looked for in the patient

/// Every edge is passed as often one way as the other.
bool is_closed(std::span<const Triangle> triangles) {
    std::map<std::pair<Index, Index>, int> balance;
    for (const Triangle& t : triangles)
        for (std::size_t k = 0; k < 3; ++k) {
            const Index a = t[k], b = t[(k + 1) % 3];
            balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
        }
    return !triangles.empty() && std::all_of(balance.begin(), balance.end(), [](const auto& edge) { return edge.second == 0; });
}

XrayMatter matter_of(const FluoroscopySpec& spec, const std::string& name, XrayMatter otherwise) {
    for (const auto& [of, matter] : spec.matter)
        if (of == name) return matter;
    return otherwise;
}

/// Solid angle of a triangle from a place, over 4 pi, with its side as the sign (van Oosterom & Strackee 1983).
double winding_share(const Vec3& a, const Vec3& b, const Vec3& c) {
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    const double over = a.dot(b.cross(c)), under = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    return std::atan2(over, under) / (2.0 * std::numbers::pi);
}

double attenuation_of(XrayMatter matter) { return coefficient_of(matter).linear(); }

} // namespace

State visible_part(const State& state) {
    State part;
    part.step = state.step, part.time = state.time;
    for (const BodyState& body : state.bodies) {
        BodyState& own = part.bodies.emplace_back();
        own.tissue.position = body.tissue.position;
        own.surface = body.surface;
        own.flow_frames = body.flow_frames;
    }
    for (const InstrumentState& instrument : state.instruments) {
        InstrumentState& own = part.instruments.emplace_back();
        own.rod.position = instrument.rod.position;
        own.rod.insertion = instrument.rod.insertion;
        own.skin = instrument.skin;
    }
    part.effects = state.effects;
    return part;
}

void update_visible_part(const SceneModel& model, const State& from, State& to) {
    to.step = from.step, to.time = from.time;
    for (std::size_t i = 0; i < from.bodies.size(); ++i) {
        to.bodies[i].tissue.position = from.bodies[i].tissue.position;
        to.bodies[i].flow_frames = from.bodies[i].flow_frames;
        if (model.bodies[i].moves()) to.bodies[i].surface = from.bodies[i].surface;
    }
    for (std::size_t i = 0; i < from.instruments.size(); ++i) {
        to.instruments[i].rod.position = from.instruments[i].rod.position;
        to.instruments[i].rod.insertion = from.instruments[i].rod.insertion;
        to.instruments[i].skin = from.instruments[i].skin;
    }
    to.effects = from.effects;
}

XrayPatient::XrayPatient(const FluoroscopySpec& spec, const SceneModel& model) : model_(model), wall_(spec.wall) {
    for (const BodyModel& body : model.bodies) {
        XrayBody& own = bodies_.emplace_back();
        own.name = body.name;
        own.moves = body.moves();
        if (body.is_free_space) continue; // air
        own.matter = matter_of(spec, body.name, body.hollow ? XrayMatter::Blood : XrayMatter::Tissue);
        own.attenuation = attenuation_of(own.matter);
        own.shell = body.closed || is_closed(body.surface.triangles) ? 0.0 : spec.shell;
        own.vessel = body.hollow;
        if (own.vessel && own.shell > 0.0 && wall_ > 0.0) own.shell = wall_, own.matter = spec.wall_matter, own.attenuation = attenuation_of(own.matter);
    }
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        XrayBody& own = bodies_[i];
        if (own.shell > 0.0 || model.bodies[i].is_free_space) continue;
        const auto host = model.bodies[i].host_body;
        const double around = host && *host != i && bodies_[*host].shell == 0.0 ? attenuation_of(bodies_[*host].matter) : 0.0;
        if (own.vessel && wall_ > 0.0) own.wall = attenuation_of(spec.wall_matter) - around;
        own.attenuation -= around + own.wall;
    }
    for (const InstrumentModel& instrument : model.instruments) {
        XrayBody& own = instruments_.emplace_back();
        own.name = instrument.name;
        own.matter = matter_of(spec, instrument.name, XrayMatter::Nitinol);
        own.attenuation = attenuation_of(own.matter);
        own.shell = is_closed(instrument.skin.triangles) ? 0.0 : spec.shell;
        own.moves = true;
    }
    for (std::size_t i = 0; i < instruments_.size(); ++i) {
        const InstrumentModel& instrument = model.instruments[i];
        if (instrument.inside)
            instruments_[i].attenuation -= attenuation_of(instruments_[*instrument.inside].matter);
        else if (bodies_[instrument.lumen].shell == 0.0 && !model.bodies[instrument.lumen].is_free_space)
            instruments_[i].attenuation -= attenuation_of(bodies_[instrument.lumen].matter);
    }
}

XraySurface XrayPatient::body(const State& state, std::size_t index) const {
    if (model_.bodies[index].is_free_space) return {};
    return {state.bodies[index].surface, model_.bodies[index].surface.triangles, bodies_[index].attenuation, {}, bodies_[index].shell};
}

XraySurface XrayPatient::wall(const State& state, std::size_t index) {
    if (bodies_[index].wall == 0.0) return {};
    const std::vector<Vec3>& points = state.bodies[index].surface;
    const std::vector<Triangle>& triangles = model_.bodies[index].surface.triangles;
    wall_points_.assign(points.size(), Vec3::Zero());
    for (const Triangle& t : triangles) {
        const Vec3 twice_area = (points[t[1]] - points[t[0]]).cross(points[t[2]] - points[t[0]]);
        for (const Index corner : t) wall_points_[corner] += twice_area;
    }
    for (std::size_t n = 0; n < points.size(); ++n) wall_points_[n] = points[n] + wall_ * wall_points_[n].normalized();
    return {wall_points_, triangles, bodies_[index].wall, {}, 0.0};
}

XraySurface XrayPatient::instrument(const State& state, std::size_t index) const {
    return {state.instruments[index].skin, model_.instruments[index].skin.triangles, instruments_[index].attenuation, {}, instruments_[index].shell};
}

/// Each cell of the flow is a straight prism of its volume.
XraySurface XrayPatient::contrast(const State& state) {
    contrast_points_.clear(), contrast_triangles_.clear(), contrast_attenuation_.clear();
    // of a regular polygon with the circle's area
    const double widen = std::sqrt(2.0 * std::numbers::pi / (kTubeSides * std::sin(2.0 * std::numbers::pi / kTubeSides)));
    effects::visit_contrast(model_, state, flow_points_, [&](const Vec3& from, const Vec3& to, double radius, double iodine) {
        const Vec3 way = to - from;
        const double length = way.norm();
        if (!(iodine > kLeastIodine) || !(length > 0.0)) return;
        const Vec3 axis = way / length, off = std::abs(axis.z()) < 0.9 ? Vec3(Vec3::UnitZ()) : Vec3(Vec3::UnitX());
        const Vec3 e = axis.cross(off).normalized(), f = axis.cross(e);
        const auto first = static_cast<Index>(contrast_points_.size());
        for (const Vec3& middle : {from, to})
            for (unsigned k = 0; k < kTubeSides; ++k) {
                const double turn = 2.0 * std::numbers::pi * k / kTubeSides;
                contrast_points_.push_back(middle + widen * radius * (std::cos(turn) * e + std::sin(turn) * f));
            }
        const auto add = [&](Index a, Index b, Index c) { contrast_triangles_.push_back({first + a, first + b, first + c}); };
        for (Index k = 0; k < kTubeSides; ++k) {
            const Index next = (k + 1) % kTubeSides;
            add(k, next, kTubeSides + next), add(k, kTubeSides + next, kTubeSides + k);
        }
        for (Index k = 2; k < kTubeSides; ++k) add(0, k, k - 1), add(kTubeSides, kTubeSides + k - 1, kTubeSides + k);
        contrast_attenuation_.resize(contrast_triangles_.size(), kIodineAttenuation * iodine);
    });
    return {contrast_points_, contrast_triangles_, 0.0, contrast_attenuation_, 0.0};
}

std::vector<std::string> XrayPatient::notices() const {
    std::vector<std::string> all;
    for (const auto* list : {&bodies_, &instruments_})
        for (const XrayBody& body : *list)
            if (body.shell > 0.0)
                all.push_back(fmt::format("fluoroscopy: the surface of \"{}\" is not closed: it attenuates as a shell of {:g} mm, not by its inside", body.name,
                                          1e3 * body.shell));
    return all;
}

XrayView XrayPatient::whole_view(const SceneModel& model, const State& state, std::array<unsigned, 2> pixels) {
    Box3 box;
    for (std::size_t i = 0; i < state.bodies.size(); ++i)
        if (!model.bodies[i].is_free_space)
            for (const Vec3& p : state.bodies[i].surface) box.add(p);
    XrayView view;
    view.name = "ap";
    view.pixels = pixels;
    if (!(box.lo.x() <= box.hi.x())) return view;
    view.isocentre = box.centre();
    const Vec3 extent = box.extent();
    const double near = std::max(0.5 * extent.norm(), 1e-3);
    view.sod = std::max(view.sod, 3.0 * near);
    view.sid = 1.4 * view.sod;
    const double widest = view.sid / (view.sod - 0.5 * extent.y()) * 1.05; // of what lies nearest to the source, with a margin
    const double pitch = widest * std::max({extent.x() / pixels[0], extent.z() / pixels[1], 1e-6});
    view.detector = {pitch * pixels[0], pitch * pixels[1]};
    return view;
}

const XrayBody* XrayPatient::find_around(const State& state, const Vec3& place) const {
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
        if (bodies_[i].shell > 0.0 || model_.bodies[i].is_free_space) continue;
        const std::vector<Vec3>& points = state.bodies[i].surface;
        double turns = 0.0;
        for (const Triangle& t : model_.bodies[i].surface.triangles)
            turns += winding_share(points[t[0]] - place, points[t[1]] - place, points[t[2]] - place);
        if (std::abs(turns) > 0.5) return &bodies_[i];
    }
    return nullptr;
}

Result<void> XrayPatient::check_source(const State& state, const XrayView& view) const {
    const double from = view.arm.empty() ? 0.0 : view.arm.front().time, to = view.arm.empty() ? 0.0 : view.arm.back().time;
    for (int k = 0; k < (view.arm.empty() ? 1 : kArmChecks); ++k) {
        const ArmAngles angles = find_angles(view, from + (to - from) * k / (kArmChecks - 1));
        const XrayBody* around = find_around(state, make_cone_beam(view, angles).source);
        if (around != nullptr)
            return Error{ErrorCode::BadValue, fmt::format("the source of \"{}\" stands inside \"{}\" at {:.4g}/{:.4g} deg; expected it outside the patient: a larger "
                                                          "sod, or another isocentre",
                                                          view.name, around->name, angles.primary * 180.0 / std::numbers::pi,
                                                          angles.secondary * 180.0 / std::numbers::pi)};
    }
    return {};
}

} // namespace trocar::engine
