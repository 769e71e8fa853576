#include "engine/prepare/effect_preparation.hpp"
#include "engine/prepare/prepare_scene.hpp"

#include "engine/prepare/check_scene.hpp"
#include "engine/prepare/nested.hpp"
#include "engine/prepare/prepare_body.hpp"
#include "engine/prepare/standing_room.hpp"
#include "engine/prepare/tissue_steps.hpp"
#include "engine/prepare/wrap_solids.hpp"
#include "engine/scene/scene_size.hpp"
#include "engine/scene/section.hpp"
#include "engine/time/clock.hpp"
#include "fem/rod/mass_spring.hpp"
#include "spheretree/lumen/lumen_path.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// m; with less play than this a rod runs on the axis of its bore.
constexpr double kLeastPlay = 1e-6;

/// Of the rod's radius: the response keeps no more clearance to the wall than this, or thin instruments would not fit.
constexpr double kLargestClearanceShare = 0.25;
/// Of the clearance: what counts as touching stays well below it, or every rest would be a contact.
constexpr double kLargestDistanceShare = 0.2;
/// [-]; an insertion that is the bound but for this is not beyond it.
constexpr double kRoundingOfUnits = 1e-9;
/// Links of the sphere chain per rod segment: at the node and midway to the next.
constexpr std::size_t kLinksPerSegment = 2;

Result<void> prepare_route(const Scene& scene, const SceneInstrument& spec, const CoarseBodies& coarse, PreparedScene& prepared,
                           InstrumentModel& model) {
    const SceneTarget& target = scene.targets[spec.follow->target];
    const BodyModel& lumen = prepared.model.bodies[model.lumen];
    const Vec3& end = prepared.targets[spec.follow->target].position;
    if (auto stands = check_target(scene, spec, model, lumen, end); !stands.ok()) return stands;
    spheretree::PathOptions options;
    options.min_radius = model.rod.design.radius;
    const auto path = spheretree::find_lumen_path(*lumen.lumen, model.port.position, end, options);
    if (!path.ok())
        return scene_error(scene, "instruments." + spec.name + ".follow",
                           fmt::format("no way from the entry to {}: {}", target.name, path.error().message));
    for (std::string& note : note_target(scene, spec, model, lumen, end)) {
        prepared.notices.push_back(note);
        prepared.bodies[model.lumen].notes.push_back(std::move(note));
    }
    std::vector<Vec3> points;
    std::vector<double> radii;
    for (const auto& point : *path) {
        points.push_back(point.centre);
        radii.push_back(point.radius);
    }
    model.route = make_route(std::move(points), std::move(radii));
    auto links = link_to_host(scene, coarse, prepared.model, model.lumen, model.route->points);
    if (!links.ok()) return links.error();
    model.route_links = std::move(*links);
    model.follow = spec.follow->settings;
    return {};
}

TipHold make_tip_hold(const TipClamp& clamp) {
    TipHold hold;
    hold.slides = clamp.slides, hold.spins = clamp.spins;
    hold.rotation = clamp.rotation, hold.turns = clamp.turns;
    hold.point = clamp.point, hold.axis = clamp.axis;
    for (const KeyFrame& frame : clamp.moves) hold.moves.push_back({frame.time, frame.displacement});
    return hold;
}

/// Detachable instruments before it that enter where it does: it comes out of the port after them.
Result<void> find_whom_it_waits_for(const Scene& scene, const SceneInstrument& spec, std::span<const InstrumentModel> before, InstrumentModel& model) {
    for (std::size_t i = 0; i < before.size(); ++i) {
        const double apart = std::sqrt((before[i].port.position - model.port.position).squaredNorm());
        if (!before[i].detachable || before[i].lumen != model.lumen || !(apart < before[i].rod.design.radius + model.rod.design.radius)) continue;
        model.waits_for.push_back(i);
        if (model.inserted > 0.0)
            return scene_error(scene, "instruments." + spec.name + (spec.path.empty() ? ".inserted" : ".path"),
                               fmt::format("found {:.4g} mm at the start, where {} is still in the same port; expected 0: it comes out after that one",
                                           1e3 * model.inserted, before[i].name));
    }
    return {};
}

Result<void> prepare_instrument(const Scene& scene, const SceneInstrument& spec, const CoarseBodies& coarse, PatientShelf& shelf,
                                PreparedScene& prepared) {
    const std::string key = "instruments." + spec.name;
    const auto rod = fem::make_rod_model(solid_section(spec));
    if (!rod.ok()) return scene_error(scene, key, rod.error().message, rod.error().code);
    const auto entry = find_place(scene, spec.entry, key + ".entry", shelf);
    if (!entry.ok()) return entry.error();
    InstrumentModel model;
    model.name = spec.name;
    model.rod = *rod;
    model.skin = fem::make_rod_skin(model.rod, spec.skin_triangles);
    model.topology = collision::make_topology(model.skin.triangles, model.skin.vertex_count());
    model.port = {entry->position, entry->direction};
    model.lumen = spec.lumen;
    if (spec.kind == InstrumentKind::MassSpring) {
        const auto substeps = fem::count_mass_spring_substeps(model.rod, scene.time.step);
        if (!substeps.ok()) return scene_error(scene, key + ".kind", substeps.error().message, substeps.error().code);
        model.mass_spring_substeps = *substeps;
    }
    if (spec.inside != kNoIndex) {
        model.inside = spec.inside;
        const double bore = scene.instruments[spec.inside].inner_radius;
        if (spec.play && bore - spec.design.radius > kLeastPlay) model.play = bore - spec.design.radius;
        InstrumentModel& outer = prepared.model.instruments[spec.inside];
        if (model.play > 0.0)
            outer.loose_wire = prepared.model.instruments.size();
        else
            outer.wire = prepared.model.instruments.size(), outer.self_contact = false;
    }
    model.self_contact = spec.self_contact && spec.kind == InstrumentKind::Rod && !shares_axis(model) && !spec.tip_clamp; // unless a wire shares its axis
    model.detachable = spec.detachable;
    model.friction = scene.effects.friction ? spec.friction : 0.0;
    model.inserted = spec.inserted;
    if (spec.tip_load && scene.effects.loads)
        model.tip_force = spec.tip_load->force, model.tip_torque = spec.tip_load->torque, model.tip_over = spec.tip_load->over;
    if (spec.tip_clamp) model.tip_hold = make_tip_hold(*spec.tip_clamp);
    model.limits = spec.limits;
    for (const PathPoint& point : spec.path) model.path.push_back({point.time, point.insertion, point.rotation});
    if (!model.path.empty()) model.inserted = evaluate_path(model.path, 0.0).insertion;
    model.chain = spheretree::make_chain_tree(kLinksPerSegment * (model.rod.node_count() - 1) + 1);
    if (const Result<void> waits = find_whom_it_waits_for(scene, spec, prepared.model.instruments, model); !waits.ok()) return waits;
    const Result<void> entered = check_entry(scene, spec, model, prepared.model.bodies[model.lumen]);
    if (!entered.ok()) return entered;
    if (spec.follow) {
        const Result<void> routed = prepare_route(scene, spec, coarse, prepared, model);
        if (!routed.ok()) return routed;
    }
    prepared.model.instruments.push_back(std::move(model));
    return {};
}

Result<void> prepare_effects(const EffectPreparation& preparation) {
    for (const EffectDescriptor* effect : registered_effects()) {
        if (effect->prepare == nullptr) continue;
        if (Result<void> done = effect->prepare(preparation); !done.ok()) return done;
    }
    return {};
}

EffectSet make_effects(const Scene& scene) {
    EffectSet effects;
    effects.elasticity = scene.effects.elasticity;
    effects.coarse_contact = scene.effects.coarse_contact;
    effects.exact_contact = scene.effects.exact_contact;
    effects.self_contact = scene.effects.self_contact && scene.effects.coarse_contact;
    effects.instrument_contact = scene.effects.instrument_contact && scene.effects.coarse_contact;
    effects.loads = scene.effects.loads;
    if (scene.effects.gravity) effects.gravity = scene.gravity;
    effects.breathing = scene.effects.breathing;
    effects.pulse = scene.effects.pulse;
    if (const auto& drag = scene.effects.blood_drag) {
        effects.blood_drag = drag->blood;
        effects.blood_drag->period = effects.pulse ? effects.pulse->period : 0.0;
    }
    effects.added = scene.effects.added;
    return effects;
}

/// The scene's, as far as its instruments and effects allow.
ContactSpec make_contact(const Scene& scene) {
    ContactSpec contact = scene.contact;
    if (!scene.effects.friction) contact.solid_friction = 0.0;
    for (const SceneInstrument& instrument : scene.instruments)
        contact.clearance = std::min(contact.clearance, kLargestClearanceShare * instrument.design.radius);
    contact.exact_distance = std::min(contact.exact_distance, kLargestDistanceShare * contact.clearance);
    return contact;
}

/// The settings that make_contact and apply_drive_commands reduce against the scene's, with the vessel that the instrument moves in.
void note_bounds(const Scene& scene, PreparedScene& prepared) {
    const std::vector<InstrumentModel>& instruments = prepared.model.instruments;
    if (instruments.empty()) return;
    const auto by_radius = [](const InstrumentModel& a, const InstrumentModel& b) { return a.rod.design.radius < b.rod.design.radius; };
    const InstrumentModel& thinnest = *std::min_element(instruments.begin(), instruments.end(), by_radius);
    const ContactSpec& contact = prepared.model.contact;
    std::vector<std::string>& notes = prepared.bodies[thinnest.lumen].notes;
    if (contact.clearance < scene.contact.clearance)
        notes.push_back(fmt::format("contact.clearance {:.4g} mm lowered to {:.4g} mm, {:g} of the radius of {}: with more of it thin "
                                    "instruments would not fit",
                                    1e3 * scene.contact.clearance, 1e3 * contact.clearance, kLargestClearanceShare, thinnest.name));
    if (contact.exact_distance < scene.contact.exact_distance)
        notes.push_back(fmt::format("contact.exact_distance {:.4g} mm lowered to {:.4g} mm, {:g} of the clearance of {:.4g} mm: with more "
                                    "of it every rest on a wall would be a contact",
                                    1e3 * scene.contact.exact_distance, 1e3 * contact.exact_distance, kLargestDistanceShare,
                                    1e3 * contact.clearance));
    for (const InstrumentModel& instrument : instruments) {
        for (const std::size_t i : instrument.waits_for)
            prepared.bodies[instrument.lumen].notes.push_back(fmt::format("{} waits in the port until {} is wholly out of it", instrument.name, instruments[i].name));
        const double bound = longest_insertion(instrument); // apply_drive_commands goes no farther
        double asked = instrument.inserted;
        for (const DriveRow& row : instrument.path) asked = std::max(asked, row.insertion);
        if (asked > bound * (1.0 + kRoundingOfUnits))
            prepared.bodies[instrument.lumen].notes.push_back(
                fmt::format("{} is to be inserted {:.4g} mm, and {:.4g} mm are taken: two segments of {:.4g} mm of its length of "
                            "{:.4g} mm stay at the port",
                            instrument.name, 1e3 * asked, 1e3 * bound, 1e3 * instrument.rod.segment, 1e3 * instrument.rod.design.length));
    }
}

void fill_settings(const Scene& scene, SceneModel& model) {
    model.name = scene.name;
    model.file = scene.file.string();
    model.step_s = scene.time.step;
    model.step_count = scene.time.step_count();
    model.fixed_substeps = scene.time.substeps;
    model.max_substeps = scene.time.max_substeps;
    model.integrator = scene.time.explicit_rule();
    model.budget = scene.budget.limits;
    model.budget_covers_step = scene.budget.scope == BudgetScope::Step;
    model.drop = scene.budget.drop;
    model.effects = make_effects(scene);
    model.contact = make_contact(scene);
    model.packing = scene.outputs.packing;
}

} // namespace

Result<PreparedScene> make_prepared_scene(const Scene& scene, const Progress& progress) {
    const StopWatch watch;
    if (const std::size_t count = scene.bodies.size() + scene.instruments.size(); count > kMostBodies)
        return scene_error(scene, "bodies", fmt::format("found {} bodies and instruments, expected at most {}", count, kMostBodies));
    if (const Result<void> checked = check_scene(scene); !checked.ok()) return checked.error();
    const auto say = [&](const std::string& what) {
        if (progress) progress(what);
    };
    PreparedScene prepared;
    PatientShelf shelf;
    CoarseBodies coarse;
    fill_settings(scene, prepared.model);
    for (const SceneBody& body : scene.bodies) {
        say("body " + body.name);
        const Result<void> done = prepare_body(scene, body, shelf, coarse, prepared);
        if (!done.ok()) return done.error();
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        const Result<void> done = embed_in_host(scene, i, coarse, prepared);
        if (!done.ok()) return done.error();
    }
    if (const Result<void> chosen = choose_tissue_steps(scene, coarse, prepared); !chosen.ok()) return chosen.error();
    find_nested(prepared);
    if (const Result<void> wrapped = wrap_solids(scene, prepared); !wrapped.ok()) return wrapped.error();
    for (const SceneTarget& target : scene.targets) {
        const auto place = find_place(scene, target.place, "targets." + target.name, shelf);
        if (!place.ok()) return place.error();
        prepared.targets.push_back(*place);
    }
    for (const SceneInstrument& instrument : scene.instruments) {
        say("instrument " + instrument.name);
        const Result<void> done = prepare_instrument(scene, instrument, coarse, shelf, prepared);
        if (!done.ok()) return done.error();
    }
    if (const Result<void> effects = prepare_effects({scene, coarse, shelf, prepared}); !effects.ok()) return effects.error();
    note_bounds(scene, prepared);
    prepared.seconds = 1e-3 * watch.elapsed_ms();
    return prepared;
}

Prepared::Prepared(PreparedScene scene) : scene_(std::make_shared<const PreparedScene>(std::move(scene))) {}

const SceneModel& Prepared::model() const noexcept { return scene_->model; }

std::span<const BodySummary> Prepared::bodies() const noexcept { return scene_->bodies; }

std::span<const Place> Prepared::targets() const noexcept { return scene_->targets; }

std::span<const std::string> Prepared::notices() const noexcept { return scene_->notices; }

double Prepared::seconds() const noexcept { return scene_->seconds; }

Result<Prepared> prepare_scene(const Scene& scene, const Progress& progress) {
    Result<PreparedScene> made = make_prepared_scene(scene, progress);
    return made ? Result<Prepared>(Prepared(std::move(*made))) : Result<Prepared>(made.error());
}

} // namespace trocar::engine
