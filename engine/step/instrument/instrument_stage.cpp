#include "engine/step/instrument/instrument_stage.hpp"

#include "engine/effects/call.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/step/instrument/script.hpp"
#include "engine/step/instrument/wall_exchange.hpp"
#include "engine/step/tissue/surface_spring.hpp"
#include "fem/rod/bore_contact.hpp"
#include "fem/rod/rod_internal.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

constexpr std::optional<DriveCommand> kNoCommand;

/// [-] of the play; an instrument that is farther than this beyond its bore is said to be.
constexpr double kBeyondBore = 0.1;

/// N; resistance at the handle when the last step's contact stopped it: more than a user pushes.
constexpr double kBlocked = 1e3;

/// Solves of a rod that meets itself, each with the planes that the last one lacked.
constexpr unsigned kMostSelfRounds = 4;

TipView view_tip(const InstrumentModel& model, const InstrumentState& state, std::vector<Vec3>& axis) {
    const std::size_t last = model.rod.node_count() - 1;
    const auto shaped = static_cast<std::size_t>(model.rod.design.tip_length / model.rod.segment);
    const std::size_t root = last > shaped + 1 ? last - shaped - 1 : 1;
    fem::carry_material_axis(model.rod, state.rod, model.port, axis);
    const Vec3 chord = state.rod.position[root] - state.rod.position[root - 1];
    const double length = std::sqrt(chord.squaredNorm());
    // The rod is compressed most where it enters: the resistance at the handle. The first segment that is in all of its length tells it.
    const std::size_t entry = std::min<std::size_t>(fem::first_inserted_node(model.rod, state.rod.insertion), last - 1);
    const double shortened = model.rod.segment - std::sqrt((state.rod.position[entry + 1] - state.rod.position[entry]).squaredNorm());
    const double felt = model.rod.stretch_stiffness[entry] * std::max(0.0, shortened);
    return {state.rod.position[last], length > 0.0 ? Vec3(chord / length) : model.port.direction, axis[root],
            state.drive_stopped ? kBlocked : felt, false};
}

/// The route where the organs stand now: embedded in the host of its lumen.
const Route& route_now(const SceneModel& model, std::size_t index, State& state) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentState& now = state.instruments[index];
    if (now.route.points.empty()) now.route = *instrument.route;
    if (instrument.route_links)
        fem::update_embedded_surface(*instrument.route_links, state.bodies[*model.bodies[instrument.lumen].host_body].tissue.position, instrument.route->points,
                   now.route_frames, now.route.points);
    return now.route;
}

/// Places between the tip and the route that are tested for lying inside the lumen. A wall between two branches that is thinner than the
/// distance between them is seen some steps later, where it is thicker.
constexpr std::size_t kSightSamples = 48;

/// Of TipView.
bool sees_route(const SceneModel& model, std::size_t index, const Route& route, const State& state, RodsScratch& rods) {
    const std::size_t lumen = model.instruments[index].lumen;
    const InstrumentState& now = state.instruments[index];
    const Vec3& tip = now.rod.position.back();
    const std::size_t nearest = find_nearest_point(route, tip, now.follow.progress);
    if (is_within_clearance(route, nearest, tip)) return true;
    WallScratch& wall = rods.walls[lumen];
    if (model.bodies[lumen].moves()) wall.inside.follow(state.bodies[lumen].surface); // another state may have been put in place
    std::array<Vec3, kSightSamples> between;
    for (std::size_t k = 0; k < kSightSamples; ++k) {
        const double s = (static_cast<double>(k) + 0.5) / static_cast<double>(kSightSamples);
        between[k] = (1.0 - s) * tip + s * route.points[nearest];
    }
    return wall.inside.count_outside(between) == 0;
}

/// Link k counted from the tip: even ones at nodes, odd ones midway to the next node behind.
struct LinkPlace {
    Index node;    // segment [node, node + 1]
    double weight; // of node + 1
};
LinkPlace place_of_link(const fem::RodModel& rod, Index link) {
    const Index last = static_cast<Index>(rod.node_count() - 1);
    const Index behind = link / 2; // segments between the link and the tip
    if (link % 2 == 1) return {last - behind - 1, 0.5};
    return behind == 0 ? LinkPlace{last - 1, 1.0} : LinkPlace{last - behind, 0.0};
}

Index count_links(const fem::RodModel& rod, double insertion) {
    const Index nodes = static_cast<Index>(rod.node_count());
    const Index inserted = nodes - fem::first_inserted_node(rod, insertion);
    return inserted == 0 ? 0 : 2 * inserted - 1;
}

Vec3 point_at(const fem::RodState& rod, const LinkPlace& place) {
    return (1.0 - place.weight) * rod.position[place.node] + place.weight * rod.position[place.node + 1];
}

} // namespace

DriveCommand steer_along_route(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentState& now = state.instruments[index];
    const Route& route = route_now(model, index, state);
    TipView view = view_tip(instrument, now, rods.instruments[index].axis);
    view.sees_route = sees_route(model, index, route, state, rods);
    return follow_route(route, instrument.follow, instrument.limits, view, {now.rod.insertion, now.rod.rotation}, model.step_s, now.follow);
}

void keep_instruments(const SceneModel& model, State& state, RodsScratch& rods) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        rods.instruments[i].rod_t0 = state.instruments[i].rod;
        InstrumentStart& start = rods.instruments[i].start;
        start.follow = state.instruments[i].follow;
        start.drive_stopped = state.instruments[i].drive_stopped, start.kept_inside = state.instruments[i].kept_inside;
        start.exact_candidates = state.instruments[i].exact_candidates;
        start.self_planes = state.instruments[i].self_planes;
        rods.instruments[i].last_planes = state.instruments[i].planes; // reserved, and so are their presses; with what dragged a step earlier
        for (auto* planes : {&state.instruments[i].planes, &state.instruments[i].self_planes})
            for (fem::RodPlane& plane : *planes) plane.start_force = plane.force, plane.start_drag = plane.drag;
        rods.instruments[i].self.end();
        rods.instruments[i].is_exact = rods.instruments[i].slowed = rods.instruments[i].is_met = false;
        rods.instruments[i].iterations = 0;
        rods.instruments[i].last_presses = state.instruments[i].presses;
        rods.instruments[i].skin_t0 = state.instruments[i].skin;
        rods.instruments[i].wall_distance.clear();
        rods.instruments[i].proven = {};
    }
    rods.meetings_t0 = state.meetings;
    for (fem::RodMeeting& meeting : state.meetings) meeting.plane.start_force = meeting.plane.force, meeting.plane.start_drag = meeting.plane.drag;
}

void restore_instruments(const SceneModel& model, State& state, const RodsScratch& rods) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        InstrumentState& now = state.instruments[i];
        const InstrumentStart& start = rods.instruments[i].start;
        now.rod = rods.instruments[i].rod_t0;
        now.skin = rods.instruments[i].skin_t0;
        now.planes = rods.instruments[i].last_planes;
        now.presses = rods.instruments[i].last_presses;
        now.self_planes = start.self_planes;
        now.follow = start.follow;
        now.drive_stopped = start.drive_stopped, now.kept_inside = start.kept_inside;
        now.exact_candidates = start.exact_candidates;
    }
    state.meetings = rods.meetings_t0;
}

/// m or rad, to 1e-12: what a path writes in a scene's units comes back as the same bits, and with it the whole run.
static double as_written(double value) noexcept { return std::nearbyint(value * 0x1p40) * 0x1p-40; }

/// Where is its drive to push and turn it? One that another is before in the port does not come out.
static DriveCommand hold_in_port(const SceneModel& model, std::size_t index, const State& state, const DriveCommand& wanted) {
    const InstrumentModel& instrument = model.instruments[index];
    const auto is_out = [&](std::size_t i) { return fem::is_free(model.instruments[i].rod, state.instruments[i].rod.insertion); };
    if (!std::all_of(instrument.waits_for.begin(), instrument.waits_for.end(), is_out)) return {0.0, wanted.rotation};
    return {std::clamp(wanted.insertion, 0.0, longest_insertion(instrument)), wanted.rotation};
}

void apply_drive_commands(const SceneModel& model, std::span<const std::optional<DriveCommand>> drive, State& state, RodsScratch& rods,
                          StepReport& report) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const InstrumentModel& instrument = model.instruments[i];
        InstrumentState& now = state.instruments[i];
        InstrumentScratch& scratch = rods.instruments[i];
        const DriveCommand from{now.rod.insertion, now.rod.rotation};
        DriveCommand wanted = from;
        const bool has_path = !instrument.path.empty();
        const std::optional<DriveCommand>& by_user = drive.empty() ? kNoCommand : drive[i];
        if (instrument.route && (by_user || has_path)) (void)route_now(model, i, state); // the report measures
        if (by_user)
            wanted = *by_user;
        else if (has_path)
            wanted = evaluate_path(instrument.path, state.time + model.step_s);
        else if (instrument.route)
            wanted = steer_along_route(model, i, state, rods);
        now.drive_stopped = false;
        scratch.command = from;
        if (fem::is_free(instrument.rod, from.insertion)) continue; // it has left its port: the drive has no hold of it
        wanted = hold_in_port(model, i, state, wanted);
        scratch.command = limit_command(from, wanted, instrument.limits, model.step_s);
        const double advance = scratch.command.insertion - from.insertion;
        report.drive_limited += advance > kDriveReach || advance < -kDriveReach;
        scratch.command.insertion = as_written(from.insertion + std::clamp(advance, -kDriveReach, kDriveReach));
        scratch.command.rotation = as_written(scratch.command.rotation);
    }
}

void load_instruments(const SceneModel& model, const EffectSet& live, State& state, RodsScratch& rods, StepReport& report) {
    const EffectStep step{model, live, {}, state.time + model.step_s, report.effects};
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        InstrumentScratch& own = rods.instruments[i];
        own.flow.clear();
        own.force.clear();
        RodLoads loads{.flow = own.flow, .force = own.force, .scratch = rods.walls[model.instruments[i].lumen].flow_points};
        for (const EffectDescriptor* effect : registered_effects())
            if (effect->load_rod != nullptr) call(*effect, step, [&](const EffectStep& own_step) { effect->load_rod(own_step, i, state, loads); });
        own.acceleration = loads.acceleration;
        own.friction = loads.friction;
        own.tip = loads.tip;
        if (model.instruments[i].tip_hold) own.clamp = find_tip_clamp(model.instruments[i], step.time_t1);
        own.meets_itself = live.self_contact && model.instruments[i].self_contact;
        if (own.meets_itself) report.effects.note(effects::self_contact);
        if (!own.meets_itself) state.instruments[i].self_planes.clear();
    }
    begin_meetings(model, live, state, rods, report);
}

static fem::RodDrive make_drive(const SceneModel& model, std::size_t index, const RodsScratch& rods) {
    const InstrumentScratch& scratch = rods.instruments[index];
    fem::RodDrive drive;
    drive.port = model.instruments[index].port;
    drive.insertion = scratch.command.insertion;
    drive.rotation = scratch.command.rotation;
    drive.gravity = scratch.acceleration;
    drive.contact_stiffness = model.contact.rod_stiffness;
    drive.friction = scratch.friction;
    drive.flow = scratch.flow;
    drive.force = scratch.force;
    drive.tip = scratch.tip;
    drive.clamp = scratch.clamp;
    return drive;
}

static fem::SolvedRod make_solved(const SceneModel& model, std::size_t index, const fem::RodDrive& drive, State& state, RodsScratch& rods) {
    InstrumentState& now = state.instruments[index];
    InstrumentScratch& scratch = rods.instruments[index];
    return {scratch.slowed ? scratch.thicker : model.instruments[index].rod, now.rod, drive, now.planes, scratch.rod, scratch.rod_report,
            now.self_planes, static_cast<Index>(index)};
}

std::unique_ptr<fem::RodSolver> make_solver(const SceneModel& model, std::size_t index, std::size_t plane_count) {
    const InstrumentModel& instrument = model.instruments[index];
    if (shares_axis(instrument)) return nullptr;
    if (instrument.wire) return fem::make_coaxial_solver(instrument.rod, model.instruments[*instrument.wire].rod, plane_count);
    if (instrument.mass_spring_substeps > 0) return fem::make_mass_spring_solver(instrument.mass_spring_substeps);
    return fem::make_implicit_solver();
}

/// All of what is solved together; their drives first, which the rods refer to.
template <std::size_t... kRod>
static void solve_joint(const SceneModel& model, bool rough, State& state, RodsScratch& rods, std::index_sequence<kRod...>) {
    const auto instrument = [&](std::size_t k) { return rods.together[std::min(k, rods.together.size() - 1)]; };
    std::array<fem::RodDrive, sizeof...(kRod)> drive{make_drive(model, instrument(kRod), rods)...};
    for (fem::RodDrive& one : drive) one.rough = rough;
    const std::array<fem::SolvedRod, sizeof...(kRod)> all{make_solved(model, instrument(kRod), drive[kRod], state, rods)...};
    for (fem::RodMeeting& meeting : state.meetings) meeting.plane.force = meeting.plane.start_force, meeting.plane.drag = meeting.plane.start_drag;
    fem::solve_together(std::span(all).first(rods.together.size()), state.meetings, model.step_s, rods.joint);
}

/// From the step's start, with the forces that it began with.
static void solve_rods(const SceneModel& model, std::size_t index, bool rough, State& state, RodsScratch& rods) {
    for (const std::size_t one : solved_with(model, rods, index)) {
        state.instruments[one].rod = rods.instruments[one].rod_t0; // same sizes: copies, never allocates
        for (auto* planes : {&state.instruments[one].planes, &state.instruments[one].self_planes})
            for (fem::RodPlane& plane : *planes) plane.force = plane.start_force, plane.drag = plane.start_drag;
    }
    if (!rods.together.empty() && rods.together.front() == index) {
        solve_joint(model, rough, state, rods, std::make_index_sequence<fem::kMostTogether>());
        for (const std::size_t one : rods.together) rods.instruments[one].iterations += rods.instruments[one].rod_report.iterations;
        return;
    }
    fem::RodDrive drive = make_drive(model, index, rods);
    drive.rough = rough;
    const fem::SolvedRod own = make_solved(model, index, drive, state, rods);
    if (const auto wire = model.instruments[index].wire) {
        const fem::RodDrive inner_drive = make_drive(model, *wire, rods);
        const fem::SolvedRod both[] = {own, make_solved(model, *wire, inner_drive, state, rods)};
        rods.solvers[index]->solve(both, model.step_s);
    } else {
        rods.solvers[index]->solve({&own, 1}, model.step_s);
    }
    rods.instruments[index].iterations += own.report.iterations;
}

/// Is what the rods may not pass proven apart? Where not there are planes that the last solve lacked.
static bool check_apart(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    bool apart = true;
    for (const std::size_t one : solved_with(model, rods, index)) {
        InstrumentScratch& own = rods.instruments[one];
        InstrumentState& now = state.instruments[one];
        if (own.meets_itself) apart = own.self.check(model.instruments[one].rod, own.rod_t0.position, now.rod.position, now.self_planes) && apart;
    }
    if (rods.together.empty() || rods.together.front() != index) return apart;
    return check_meetings(model, state, rods) && apart;
}

/// Until the rods are proven not to have passed through themselves or one another, or as often as that is worth: what is proven then is taken,
/// hold_rods.
static void solve_apart(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    for (const std::size_t one : solved_with(model, rods, index)) {
        InstrumentScratch& own = rods.instruments[one];
        InstrumentState& now = state.instruments[one];
        if (!own.meets_itself || own.self.has_begun()) continue;
        own.self.begin(model.instruments[one].rod, own.rod_t0.position, now.rod.position, model.step_s);
        own.self.list_planes(model.instruments[one].rod, own.rod_t0.position, now.rod.position, now.self_planes);
    }
    for (unsigned round = 0; round < kMostSelfRounds; ++round) {
        solve_rods(model, index, false, state, rods);
        if (check_apart(model, index, state, rods)) return;
    }
}

void solve_instrument(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods, bool rough) {
    if (is_solved_with_another(model, rods, index)) return;
    const bool met = !rods.together.empty() && rods.together.front() == index;
    if ((rods.instruments[index].meets_itself || met) && !rough)
        solve_apart(model, index, state, rods);
    else
        solve_rods(model, index, rough, state, rods);
    for (const std::size_t one : solved_with(model, rods, index)) {
        const InstrumentModel& instrument = model.instruments[one];
        InstrumentState& now = state.instruments[one];
        fem::place_rod_skin(instrument.rod, instrument.skin, now.rod, instrument.port, rods.instruments[one].axis, now.skin);
    }
}

void update_instrument_trees(const SceneModel& model, std::size_t index, State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    InstrumentScratch& scratch = rods.instruments[index];
    const fem::RodModel& rod = instrument.rod;
    // Spheres half a segment apart hold the tube between them when their radius reaches its edge midway.
    const double half = 0.25 * rod.segment;
    const double radius = std::sqrt(rod.design.radius * rod.design.radius + half * half);
    const Index links = count_links(rod, std::min(scratch.rod_t0.insertion, state.instruments[index].rod.insertion));
    scratch.links_t0.clear();
    scratch.links_t1.clear();
    for (Index link = 0; link < links; ++link) {
        const LinkPlace place = place_of_link(rod, link);
        scratch.links_t0.push_back({point_at(scratch.rod_t0, place), radius});
        scratch.links_t1.push_back({point_at(state.instruments[index].rod, place), radius});
    }
    spheretree::update_chain(instrument.chain, scratch.links_t0, scratch.links_t1, state.instruments[index].chain);
}

void update_lumens(const SceneModel& model, State& state, RodsScratch& rods) {
    for (const InstrumentModel& instrument : model.instruments) {
        const BodyModel& wall = model.bodies[instrument.lumen];
        BodyState& own = state.bodies[instrument.lumen];
        if (own.lumen_step == state.step) continue; // another instrument is in it, too
        const bool continues = own.lumen_step + 1 == state.step;
        if (!continues && own.lumen_step != kNoStep) own.lumen.miss_steps();
        if (wall.moves())
            own.lumen.update(*wall.lumen, rods.walls[instrument.lumen].surface_t0, own.surface, continues);
        else
            own.lumen.update(*wall.lumen, {}, {});
        own.lumen_step = state.step;
    }
}

void add_to_descent(const SceneModel& model, std::size_t index, State& state, spheretree::Descent& descent) {
    const InstrumentModel& instrument = model.instruments[index];
    descent.add_hollow_pair(
        {Thing::instrument(index), &instrument.chain, &state.instruments[index].chain},
        {Thing::body(instrument.lumen), &*model.bodies[instrument.lumen].lumen, &state.bodies[instrument.lumen].lumen});
}

void report_presses(std::size_t index, const State& state, StepReport& report) {
    for (const fem::RodPlane& plane : state.instruments[index].planes) {
        if (!(plane.force > 0.0)) continue;
        report.contact_force_n += plane.force;
        report.friction_force_n += std::sqrt(plane.drag.squaredNorm());
        report.max_contact_force_n = std::max(report.max_contact_force_n, plane.force);
    }
}

void report_rods(const SceneModel& model, const State& state, const RodsScratch& rods, StepReport& report) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const fem::RodReport& rod = rods.instruments[i].rod_report;
        report.rod_iterations += rods.instruments[i].iterations;
        report.unsettled_rods += rod.unconverged;
        report.slowed_rods += rods.instruments[i].slowed;
        report.rod_stretch = std::max(report.rod_stretch, fem::find_largest_stretch(model.instruments[i].rod, state.instruments[i].rod));
        for (const fem::RodPlane& plane : state.instruments[i].self_planes) {
            if (!(plane.force > 0.0)) continue;
            ++report.self_contacts;
            report.self_force_n += plane.force;
        }
        report.exchange_gap_n += find_exchange_gap(model, i, state, rods);
        report.balance_n += std::sqrt((rod.handle_force + rod.clamp_force + rod.contact_force + rod.body_force).squaredNorm());
    }
    for (const fem::RodMeeting& meeting : state.meetings) {
        if (meeting.play > 0.0) {
            const double excess = fem::find_bore_excess(meeting, state.instruments[meeting.rod].rod.position, state.instruments[meeting.other_rod].rod.position);
            report.bore_excess_m = std::max(report.bore_excess_m, excess);
            report.beyond_bores += excess > kBeyondBore * meeting.play;
        }
        if (!(meeting.plane.force > 0.0)) continue;
        ++report.instrument_contacts;
        report.instrument_force_n += meeting.plane.force;
    }
    if (model.instruments.empty()) return;
    const fem::RodReport& first = rods.instruments[kLeadInstrument].rod_report;
    report.handle_force_n = first.handle_force.dot(model.instruments[kLeadInstrument].port.direction);
    report.handle_torque_nm = first.handle_torque;
}

void list_presses(const SceneModel& model, std::size_t index, const State& state, ContactOrigin origin, std::vector<Contact>& contacts) {
    const InstrumentModel& instrument = model.instruments[index];
    const InstrumentState& now = state.instruments[index];
    const std::vector<Vec3>& surface = state.bodies[instrument.lumen].surface;
    for (std::size_t k = 0; k < now.planes.size(); ++k) {
        const fem::RodPlane& plane = now.planes[k];
        if (!(plane.force > 0.0)) continue;
        Contact contact;
        contact.a = Thing::instrument(index);
        contact.b = Thing::body(instrument.lumen);
        contact.origin = origin;
        contact.normal = plane.normal;
        contact.gap = -plane.force / model.contact.rod_stiffness;
        contact.force = plane.force * plane.normal + plane.drag;
        contact.point = point_at(state.instruments[index].rod, {plane.node, plane.weight});
        contact.feature_a[0] = plane.node;
        const WallPress& press = now.presses[k];
        if (press.triangle != kNoIndex) {
            contact.point.setZero();
            for (std::size_t corner = 0; corner < 3; ++corner) {
                contact.feature_b[corner] = model.bodies[instrument.lumen].surface.triangles[press.triangle][corner];
                contact.bary_b[corner] = press.bary[corner];
                contact.point += press.bary[corner] * surface[contact.feature_b[corner]];
            }
        }
        contacts.push_back(contact);
    }
}

void list_self_presses(const SceneModel& model, std::size_t index, const State& state, ContactOrigin origin, std::vector<Contact>& contacts) {
    const InstrumentState& now = state.instruments[index];
    for (const fem::RodPlane& plane : now.self_planes) {
        if (!(plane.force > 0.0)) continue;
        Contact contact;
        contact.a = contact.b = Thing::instrument(index);
        contact.origin = origin;
        contact.normal = plane.normal;
        const Vec3 one = point_at(now.rod, {plane.node, plane.weight}), two = point_at(now.rod, {plane.other, plane.other_weight});
        contact.gap = plane.normal.dot(one - two) - 2.0 * model.instruments[index].rod.design.radius;
        contact.force = plane.force * plane.normal + plane.drag;
        contact.point = 0.5 * (one + two);
        contact.feature_a[0] = plane.node;
        contact.feature_b[0] = plane.other;
        contact.bary_a[0] = 1.0 - plane.weight, contact.bary_a[1] = plane.weight;
        contact.bary_b[0] = 1.0 - plane.other_weight, contact.bary_b[1] = plane.other_weight;
        contacts.push_back(contact);
    }
}

std::uint32_t count_lumen_exits(const SceneModel& model, std::size_t index, const State& state, RodsScratch& rods) {
    const InstrumentModel& instrument = model.instruments[index];
    const InstrumentState& now = state.instruments[index];
    const InsideTest& inside = rods.walls[instrument.lumen].inside;
    const Index first = fem::first_inserted_node(instrument.rod, now.rod.insertion);
    std::uint32_t exits = 0;
    const std::vector<Index>& node = instrument.skin.vertex_node;
    for (std::size_t from = 0, to = 0; from < node.size(); from = to) { // a ring of the skin after another
        while (to < node.size() && node[to] == node[from]) ++to;
        if (node[from] >= first) exits += static_cast<std::uint32_t>(inside.count_outside(std::span(now.skin).subspan(from, to - from)));
    }
    return exits;
}

} // namespace trocar::engine
