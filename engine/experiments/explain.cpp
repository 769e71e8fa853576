#include "engine/experiments/explain.hpp"

#include "engine/experiments/effect_cost.hpp"
#include "engine/experiments/laid_out.hpp"
#include "engine/experiments/trial_run.hpp"
#include "engine/io/printable.hpp"
#include "engine/render/describe_graphics.hpp"
#include "engine/report/floor.hpp"
#include "engine/scene/check.hpp"
#include "engine/scene/section.hpp"
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/state/state.hpp"
#include "engine/step/simulator.hpp"
#include "engine/time/clock.hpp"
#include "fem/tissue/tangent.hpp"

#include <fmt/format.h>

#include <sys/resource.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// The cost of the effects is measured in about so long.
constexpr double kEffectsTime = 20e3; // ms
/// [-]; a step that exceeds the drive's limit by no more than this share is within it.
constexpr double kRounding = 1e-9;

void tell_effects(const Scene& scene, const PreparedScene& prepared, std::string& text) {
    for (const bool runs : {true, false}) {
        text += fmt::format("\n{}\n", runs ? "simulated" : "not simulated");
        for (const EffectDescriptor* effect : registered_effects()) {
            EffectLine line{has_effect(prepared.model, *effect), std::string(effect->doc)};
            if (effect->explain != nullptr) line = effect->explain(scene, prepared.model);
            if (line.runs == runs) text += fmt::format("  {:<15} {}\n", effect->name, line.why);
        }
    }
}

/// What the constants of a material come to, in the scene's units.
void tell_material(const Scene& scene, const SceneBody& body, const fem::Material& m, const std::string& fibre_words, std::string& text) {
    const fem::SmallStrain small = fem::find_small_strain(m);
    const auto unit = [&](double si) { return with_unit(si, Dimension::Pressure, scene.units); };
    constexpr const char* kNames[] = {"St. Venant-Kirchhoff", "corotational", "neo-Hookean", "Mooney-Rivlin", "Ogden", "Holzapfel-Gasser-Ogden"};
    const bool fibres = m.law == fem::MaterialLaw::Hgo;
    text += fmt::format("  {:<15} {}{}: Young's modulus {}, Poisson's ratio {:.4g} at small strain{}; {} tetrahedra\n", "",
                        kNames[static_cast<std::size_t>(m.law)], body.preset.empty() ? "" : fmt::format(" ({})", body.preset),
                        unit(small.young_modulus()), m.poisson_ratio, fibres ? " without fibres" : "", m.elements == fem::TetElements::Prisms ? "prisms of" : fem::uses_patches(m) ? "patched" : "linear");
    if (m.law >= fem::MaterialLaw::MooneyRivlin)
        text += fmt::format("  {:<15} pulled{}, its tangent is {} at a stretch of 0.8, {} at 1, {} at 1.2\n", "", fibres ? " along the first fibres" : "",
                            unit(fem::find_pull_tangent(m, 0.8)), unit(fem::find_pull_tangent(m, 1.0)), unit(fem::find_pull_tangent(m, 1.2)));
    if (!fibre_words.empty()) text += fmt::format("  {:<15} fibres lie {}\n", "", fibre_words);
    if (const double relaxing = m.g1 + m.g2 + m.g3; relaxing > 0.0)
        text += fmt::format("  {:<15} stress relaxes: the shear modulus at once is {:.4g} times that in the end\n", "", 1.0 + relaxing);
}

/// What a coarse mesh's labels name, and which tissue they have.
void tell_regions(const Scene& scene, const BodySummary& body, std::string& text) {
    for (const RegionSummary& region : body.regions) {
        const std::string tissue = region.has_own_tissue ? fmt::format("Young's modulus {}, {:g} kg/m^3", with_unit(region.young_modulus, Dimension::Pressure, scene.units),
                                                                       region.density)
                                                         : "the body's material";
        text += fmt::format("  {:<15} region {}({} {}): {} tetrahedra, {:.6g} mm^3, {}\n", "",
                            region.name.empty() ? std::string() : printable(fmt::format("{:.40} ", region.name)),
                            printable(fmt::format("{:.40}", body.region_array)), region.label, region.tets, 1e9 * region.volume_m3, tissue);
    }
}

void tell_bodies(const Scene& scene, const PreparedScene& prepared, std::string& text) {
    text += "\nbodies\n";
    for (std::size_t i = 0; i < prepared.bodies.size(); ++i) {
        const BodySummary& b = prepared.bodies[i];
        const BodyModel& model = prepared.model.bodies[i];
        const char* motion = model.motion == Motion::Deformable ? "deformable" : model.motion == Motion::Kinematic ? "kinematic" : "static";
        text += fmt::format("  {:<15} {}{}, {} triangles, {} spheres", b.name, motion, model.hollow ? ", hollow" : "", b.triangles, b.tree_spheres);
        if (b.coarse_tets > 0)
            text += fmt::format(", {} tetrahedra on {} nodes ({} fixed), stable step{} {:.3g} ms", b.coarse_tets, b.coarse_nodes, b.pinned_nodes,
                       model.implicit ? " if it were explicit" : "", 1e3 * b.stable_step_s);
        text += "\n";
        if (model.tissue) tell_material(scene, scene.bodies[i], model.tissue->material, b.fibres, text);
        tell_regions(scene, b, text);
        if (b.links > 0)
            text += fmt::format("  {:<15} {} links to {}, {} static, {} degenerate, longest {:.3g} mm\n", "", b.links,
                       model.host_body && *model.host_body != i ? prepared.bodies[*model.host_body].name : std::string("its own coarse mesh"), b.static_links,
                       b.degenerate_links, 1e3 * b.longest_link_m);
        for (const std::string& note : b.notes) text += fmt::format("  {:<15} {}\n", "", note);
    }
}

/// m/s; the fastest drive command of its script or its route.
double fastest_drive_speed(const InstrumentModel& m) {
    if (m.route) return m.follow.speed;
    double fastest = 0.0;
    for (std::size_t k = 1; k < m.path.size(); ++k)
        fastest = std::max(fastest, std::abs(m.path[k].insertion - m.path[k - 1].insertion) / (m.path[k].time - m.path[k - 1].time));
    return fastest;
}

void tell_instruments(const Scene& scene, const PreparedScene& prepared, std::string& text) {
    if (prepared.model.instruments.empty()) return;
    text += "\ninstruments\n";
    for (std::size_t i = 0; i < prepared.model.instruments.size(); ++i) {
        const InstrumentModel& m = prepared.model.instruments[i];
        text += fmt::format("  {:<15} rod of {} nodes, {:g} mm long, radius {:g} mm, skin of {} triangles, in {}\n", m.name, m.rod.node_count(),
                   1e3 * m.rod.design.length, 1e3 * m.rod.design.radius, m.skin.triangles.size(), prepared.bodies[m.lumen].name);
        const SceneInstrument& told = scene.instruments[i];
        const Bending bending = find_bending(m.rod);
        text += fmt::format("  {:<15} {}bends with {:.3g} N mm^2 at the shaft, {:.3g} at the tip, stretches with {:.3g} N, weighs {:.3g} g/m\n", "",
                   told.device.empty() ? std::string() : told.device + ": ", 1e6 * bending.shaft, 1e6 * bending.tip,
                   m.rod.stretch_stiffness.front() * m.rod.segment, 1e3 * m.rod.mass[1] / m.rod.segment);
        if (m.mass_spring_substeps > 0)
            text += fmt::format("  {:<15} masses and springs, {} explicit sub-steps in a step\n", "", m.mass_spring_substeps);
        if (m.inside)
            text += m.play > 0.0 ? fmt::format("  {:<15} in the bore of {} with {:g} mm of play on all sides, solved with it\n", "",
                                                prepared.model.instruments[*m.inside].name, 1e3 * m.play)
                                  : fmt::format("  {:<15} in the bore of {}: one axis and both stiffnesses where they overlap{}\n", "",
                                                prepared.model.instruments[*m.inside].name,
                                                !told.play ? "" : scene.instruments[*m.inside].inner_radius > 0.0 ? ": less than 1 um of play" : ": it states no inner_radius");
        if (m.tip_hold)
            text += fmt::format("  {:<15} its tip is clamped{}{}\n", "", m.tip_hold->slides ? ", free along its axis" : "",
                       m.tip_hold->spins ? ", free about its axis" : "");
        if (m.route)
            text += fmt::format("  {:<15} driven to {}, {:.0f} mm away along the lumen, narrowest radius {:.2f} mm\n", "",
                       scene.targets[scene.instruments[i].follow->target].name, 1e3 * m.route->length.back(),
                       1e3 * *std::min_element(m.route->radii.begin(), m.route->radii.end()));
        else
            text += fmt::format("  {:<15} script of {} rows\n", "", m.path.size());
        if (const double way = fastest_drive_speed(m) * prepared.model.step_s; way > kDriveReach * (1.0 + kRounding))
            text += fmt::format("  {:<15} its drive would go {:.3g} mm in a step; {:g} mm are taken, expected a step of at most {:.3g} ms\n", "",
                       1e3 * way, 1e3 * kDriveReach, 1e3 * prepared.model.step_s * kDriveReach / way);
    }
}

/// What the trials represent, and the predicted run.
void tell_prediction(const SceneModel& model, Trial& first, Trial& late, std::string& text) {
    const double middle = Trial::middle(first.total);
    const double run_s = 1e-3 * mean_step_ms(model, first, late, model.step_count) * static_cast<double>(model.step_count);
    if (late.total.empty()) {
        text += fmt::format(
            "  predicted       {:.3g} ms a step (collision {:.3g} ms), from a trial of the first {} steps; whole run about {:.3g} s\n",
            middle, Trial::middle(first.collision), first.total.size(), run_s);
        if (!model.instruments.empty()) text += fmt::format("  {:<15} steps with more of an instrument inside cost more\n", "");
        return;
    }
    text += fmt::format("  predicted       {:.3g} ms a step at the start (collision {:.3g} ms), {:.3g} ms with instruments laid along their routes "
               "(collision {:.3g} ms), from trials of {} steps; whole run about {:.3g} s\n",
               middle, Trial::middle(first.collision), Trial::middle(late.total), Trial::middle(late.collision), first.total.size(), run_s);
}

bool has_implicit(const SceneModel& model) {
    return std::any_of(model.bodies.begin(), model.bodies.end(), [](const BodyModel& body) { return body.implicit.has_value(); });
}

/// returns   ms of a step where it is dearest, as far as was tried
double tell_cost(const Scene& scene, const PreparedScene& prepared, const Progress& progress, std::string& text) {
    const SceneModel& model = prepared.model;
    const std::uint64_t steps = std::min(kTrialSteps, model.step_count);
    progress("trying the first steps");
    Trial first = try_steps(model, {}, 0, steps, kTrialTime);
    const std::string substeps = first.last.substeps == 0 ? std::string("no tissue")
                                                          : fmt::format("{} sub-step{} of the tissue ({} {:.3g} ms)", first.last.substeps,
                                                                        first.last.substeps == 1 ? "" : "s",
                                                                        has_implicit(model) ? "the shortest of" : "stable step",
                                                                        1e3 * first.last.stable_step_s);
    text += fmt::format("\ntime and cost\n  step            {:g} ms, {} steps, {}\n", 1e3 * scene.time.step, model.step_count, substeps);
    text += fmt::format("  budget          {} per step over {}\n", scene.budget.to_string(),
               model.budget_covers_step ? "the whole step" : "collision");
    if (!first.last.finite) text += fmt::format("  trial           stopped: {}\n", first.last.failure);
    if (first.total.empty()) return 0.0;
    Trial late;
    if (const std::optional<State> inside = lay_along_routes(model)) late = try_steps(model, inside, kSettlingSteps, steps, kTrialTime);
    tell_prediction(model, first, late, text);
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    text += fmt::format("  memory          {:.0f} MB at most so far\n  preparation     {:.2f} s\n", static_cast<double>(usage.ru_maxrss) / 1024.0,
               prepared.seconds);
    return std::max(Trial::middle(first.total), Trial::middle(late.total));
}

/// What a budget of nothing still runs, effect by effect, and what it takes.
void tell_floor(const Scene& scene, const PreparedScene& prepared, const Progress& progress, std::string& text) {
    const SceneModel& model = prepared.model;
    text += "\nfloor: what a step runs under a budget of nothing\n";
    for (const EffectDescriptor* effect : registered_effects()) {
        if (effect->floor == nullptr || !has_effect(model, *effect)) continue;
        if (const std::string what = effect->floor(model); !what.empty()) text += fmt::format("  {:<15} {}\n", effect->name, what);
    }
    constexpr const char* kOutside = "tissue, embedded surfaces, the spheres that follow them, the free motion of instruments";
    if (!model.budget_covers_step)
        text += fmt::format("  {:<15} {}\n", "not charged", kOutside);
    else
        text += fmt::format("  {:<15} {}: charged with this scope, by the size of the meshes; left out only as \"drop\" says\n", "whole step", kOutside);
    progress("trying a budget of nothing");
    const std::optional<State> inside = lay_along_routes(model);
    const auto floor = measure_floor(Simulator(model), inside ? &*inside : nullptr, kTrialSteps, kTrialTime);
    if (!floor) return;
    constexpr std::array<const char*, kAccountParts> kNames{"solve", "descent", "exact", "walls", "surfaces"};
    std::string parts;
    for (std::size_t k = 0; k < kAccountParts; ++k) parts += fmt::format("{}{} {:.2g}", k > 0 ? ", " : "", kNames[k], floor->part_ms[k]);
    text += fmt::format("  {:<15} {:.3g} ms a step ({}), median of {} steps under work:0 {}\n", "measured", floor->ms, parts, floor->steps,
                        inside ? "with instruments laid along their routes" : "from the start");
    const BudgetLimits& limits = scene.budget.limits;
    if (limits.mode == BudgetMode::Wall && floor->ms > 1e3 * limits.wall_s)
        text += fmt::format("  {:<15} the scene's budget of {:.3g} ms is below the floor of {:.3g} ms: it is accepted, and overrun by that\n", "",
                            1e3 * limits.wall_s, floor->ms);
}

/// Each effect left out alone, beside the whole scene.
/// step_ms   what a step takes, about
void tell_effect_costs(const PreparedScene& prepared, double step_ms, const Progress& progress, std::string& text) {
    std::uint64_t runs = 0;
    for (const EffectDescriptor* effect : registered_effects()) runs += 2 * has_effect(prepared.model, *effect);
    const double round_ms = static_cast<double>(runs) * step_ms;
    if (static_cast<double>(kFewestSteps) * round_ms > kEffectsTime) {
        text += fmt::format("\ncost of each effect: not tried, for a step with and without each takes {:.3g} s\n", 1e-3 * round_ms);
        return;
    }
    std::uint64_t steps = std::min(kTrialSteps, prepared.model.step_count);
    while (steps > kFewestSteps && static_cast<double>(steps) * round_ms > kEffectsTime) --steps;
    const std::vector<EffectCost> costs =
        measure_effects(prepared.model, steps, [&](const std::string& what) { progress("trying the scene " + what); });
    text += fmt::format("\ncost of each effect, from a trial of {} steps (processor time of a step with it, without it)\n", steps);
    for (const EffectCost& cost : costs) {
        const std::string saved = cost.is_lost_in_noise() ? fmt::format("below what can be measured ({:.2g} ms)", cost.noise_ms)
                                                          : fmt::format("{:.3g} ms", cost.saved_ms());
        text += fmt::format("  {:<15} {}  ({:.3g}, {:.3g})\n", cost.effect->name, saved, cost.with_ms, cost.without_ms);
    }
}

void tell_graphics(std::string& text) {
    text += "\ngraphics\n";
    for (const GraphicsLine& line : describe_graphics()) text += fmt::format("  {:<15} {}\n", line.what, line.how);
}

} // namespace

void explain_scene(const Scene& scene, const PreparedScene& prepared, const std::function<void(const std::string&)>& tell,
                   const Progress& progress) {
    std::string text = fmt::format("{}   {}\n", scene.name, scene.file.string());
    for (const std::string& question : scene.questions) text += fmt::format("  question: {}\n", question);
    tell_effects(scene, prepared, text);
    tell_bodies(scene, prepared, text);
    tell_instruments(scene, prepared, text);
    tell_graphics(text);
    tell(text); // what is tried from here on may take a while
    text.clear();
    const double step_ms = tell_cost(scene, prepared, progress, text);
    tell_floor(scene, prepared, progress, text);
    tell(text);
    text.clear();
    tell_effect_costs(prepared, step_ms, progress, text);
    tell(text);
}

} // namespace trocar::engine
