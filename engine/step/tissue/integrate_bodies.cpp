// The tissue's part of a step: bodies that touch nothing by themselves, those that touch side by side.
//
// A body by itself takes the sub-steps that it needs (fem::advance), or one implicit one (fem::advance_implicitly; where it does not
// converge, explicit ones after all). Contacts that pressed at the end of the last step, and those that
// the bodies' free motion would pass, join bodies to islands; an island is put back to the step's start and advanced with one sub-step for
// all of its bodies, and impulses between them (fem::TissueLockstep, ContactSolver). An island in which nothing pressed after all keeps
// the free motion: what touches nothing moves as without contact, to the bit. A wall and the organ that it is joined to are one island from the start;
// without contact they take one implicit step together, where they are advanced so.
#include "engine/step/tissue/tissue_stage.hpp"

#include "engine/effects/call.hpp"
#include "engine/effects/registry.hpp"
#include "engine/prepare/scripted_motion.hpp"
#include "engine/step/tissue/wall_ties.hpp"
#include "fem/tissue/integrate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Of the number that the scene asks for, to rounding.
double longest_substep(const SceneModel& model) noexcept { return model.step_s / std::max(1u, model.fixed_substeps) * (1.0 + 1e-12); }

fem::AdvanceReport advance_explicitly(const SceneModel& model, const BodyModel& body, const fem::IntegrateInputs& inputs, BodyState& state, TissueScratch& scratch) {
    fem::SubstepLimits limits;
    limits.max_substeps = model.max_substeps;
    limits.integrator = model.integrator;
    if (model.fixed_substeps > 0) limits.longest = longest_substep(model);
    return fem::advance(*body.tissue, state.tissue, model.step_s, inputs, limits, scratch.rk, state.stable);
}

/// start: of the step, where an implicit step that does not converge goes back to: explicit sub-steps take its place.
fem::AdvanceReport advance_body(const SceneModel& model, const BodyModel& body, const fem::TissueState& start, const fem::IntegrateInputs& inputs,
                                BodyState& state, TissueScratch& scratch) {
    if (body.implicit) {
        fem::AdvanceReport done = fem::advance_implicitly(*body.tissue, *body.implicit, state.tissue, model.step_s, std::max(1u, model.fixed_substeps), inputs,
                                                          scratch.rk, scratch.implicit)
                                      .advance;
        if (!done.refused && done.integrate.finite()) return done;
        state.tissue = start;
    }
    fem::AdvanceReport done = advance_explicitly(model, body, inputs, state, scratch);
    done.instead = body.implicit.has_value();
    return done;
}

bool has_springs(const BodyModel& body) noexcept {
    return std::any_of(body.loads.begin(), body.loads.end(), [](const BodyLoad& load) { return load.kind == LoadKind::Spring; });
}

/// Empty while all went well.
std::string describe_failure(const SceneModel& model, const BodyModel& body, const fem::AdvanceReport& done) {
    const fem::IntegrateReport& end = done.integrate;
    if (done.refused) {
        const bool by_contact = done.tightest.omega_max > 2.0 * done.tightest.tissue_omega;
        return fmt::format("{}: {}the stable step is {:.3g} s, more than {} sub-steps of the step of {:g} s would be needed; {}", body.name,
                           done.instead ? "an implicit step does not converge, and of explicit ones " : "", done.tightest.step, model.max_substeps, model.step_s,
                           by_contact
                               ? std::string(has_springs(body) ? "a spring of its loads, or what presses on it, is stiffer than its tetrahedra. Softer springs (loads), softer contact "
                                                                 "(contact.wall_stiffness), or a coarser coarse mesh"
                                                               : "what presses on it is stiffer than its tetrahedra. Softer contact (contact.wall_stiffness), or a coarser coarse mesh")
                               : fmt::format("its tetrahedron {} is the stiffest, at a smallest volume of {:.3g} of rest. Fewer coarse "
                                             "triangles, the lattice mesher (coarse.mesher; of a wall fewer layers), or softer contact, if it is crushed",
                                             done.tightest.worst_tet, end.min_volume_ratio));
    }
    if (!end.finite())
        return fmt::format("{}: node {} is not finite after {} sub-steps ({}smallest volume ratio {:.3g})", body.name, end.first_bad_node, end.substeps_done,
                           end.first_bad_tet == kNoIndex ? "" : fmt::format("tetrahedron {}, ", end.first_bad_tet), end.least_stage_ratio);
    return {};
}

/// What effects do to a body in this step.
void find_loads(const EffectStep& step, std::size_t body, const State& state, TissueScratch& scratch, fem::IntegrateInputs& inputs) {
    scratch.pinned_target.clear();
    scratch.force.clear();
    scratch.force_rate.clear();
    scratch.pressures.clear();
    scratch.springs.clear();
    TissueLoads loads{.pinned_target = scratch.pinned_target, .force = scratch.force, .force_rate = scratch.force_rate,
                      .pressures = scratch.pressures, .springs = scratch.springs};
    for (const EffectDescriptor* effect : registered_effects())
        if (effect->load_tissue != nullptr) call(*effect, step, [&](const EffectStep& own) { effect->load_tissue(own, body, state, loads); });
    move_held_nodes(step.model.bodies[body], step.time_t1, scratch.pinned_target);
    inputs.gravity = loads.acceleration;
    inputs.pinned_target = scratch.pinned_target;
    if (!scratch.force_rate.empty()) scratch.force.resize(scratch.force_rate.size(), Vec3::Zero());
    inputs.external_force = scratch.force;
    inputs.force_rate = scratch.force_rate;
    inputs.pressures = scratch.pressures;
}

void load_body(const EffectStep& step, std::size_t body, State& state, TissueScratch& scratch) {
    step.counts.note(effects::elasticity);
    find_loads(step, body, state, scratch, scratch.inputs);
    const fem::ContactSprings& contact = scratch.contact;
    scratch.contact.tied = scratch.springs.tied = step.model.bodies[body].tied;
    scratch.inputs.springs = scratch.springs.springs.empty() ? &contact : &scratch.springs;
    if (!scratch.springs.springs.empty()) fem::append_springs(contact, scratch.springs);
}

void integrate_body(const EffectStep& step, std::size_t body, const fem::TissueState& start, State& state, TissueScratch& scratch) {
    load_body(step, body, state, scratch);
    scratch.advanced = advance_body(step.model, step.model.bodies[body], start, scratch.inputs, state.bodies[body], scratch);
}

/// Adds what the body's integration came to.
void report_body(const SceneModel& model, const BodyModel& body, const fem::AdvanceReport& done, StepReport& report) {
    report.substeps = std::max(report.substeps, done.integrate.substeps_done);
    report.raised_bodies += model.fixed_substeps > 0 && done.integrate.substeps_done > model.fixed_substeps;
    if (report.stable_step_s == 0.0 || done.tightest.step < report.stable_step_s) report.stable_step_s = done.tightest.step;
    report.min_volume_ratio = std::min(report.min_volume_ratio, done.integrate.min_volume_ratio);
    report.inverted_tets += done.integrate.inverted;
    report.explicit_bodies += done.instead;
    report.elastic_j += done.integrate.elastic_j;
    report.kinetic_j += done.integrate.kinetic_j;
    report.failure = describe_failure(model, body, done);
    report.finite = report.failure.empty();
}


/// What one step's integration works with.
struct Stage {
    const SceneModel& model;
    const EffectSet& live;
    State& state;
    BodiesScratch& bodies;
    StepReport& report;
    StepBudget& budget;
    WorkBudget& rows; // places times iterations that the step's solves may take

    [[nodiscard]] EffectStep effects() const { return {model, live, {}, state.time + model.step_s, report.effects}; }
    [[nodiscard]] bool is_tissue(std::size_t i) const noexcept { return model.bodies[i].motion == Motion::Deformable; }
};

Index find_root(std::vector<IslandBody>& bodies, Index i) noexcept {
    while (bodies[i].parent != i) i = bodies[i].parent = bodies[bodies[i].parent].parent;
    return i;
}

/// s; what contact has taken from bodies may be given back for so long: what is crushed and held must not be fed with what crushing took.
constexpr double kForgotten = 0.02;

/// J, what is left after h seconds of what contact has taken.
double left_of_work(double work, double h) noexcept { return work * (1.0 - std::min(1.0, h / kForgotten)); }

/// Ascending, into islands.members.
void list_members(IslandsScratch& islands, Index root) {
    islands.members.clear();
    for (Index i = root; i < islands.body.size(); ++i)
        if (find_root(islands.body, i) == root) islands.members.push_back(i);
}

/// Bodies with ties to one another, of which nothing else is joined: an implicit step of them all. Where it does not converge, and where they are
/// advanced explicitly, they become an island.
void integrate_joined(const Stage& s, Index root) {
    IslandsScratch& islands = s.bodies.islands;
    list_members(islands, root);
    const bool implicit = s.model.bodies[root].implicit.has_value();
    if (implicit) {
        islands.implicit.clear();
        for (const std::size_t i : islands.members) {
            TissueScratch& scratch = s.bodies.tissue[i];
            load_body(s.effects(), i, s.state, scratch);
            const BodyModel& body = s.model.bodies[i];
            islands.implicit.push_back({*body.tissue, *body.implicit, s.state.bodies[i].tissue, scratch.inputs, scratch.rk, scratch.implicit, scratch.advanced});
        }
        list_ties(s.model, islands.members, islands.ties);
        (void)fem::advance_implicitly(islands.implicit, islands.ties, s.model.step_s, std::max(1u, s.model.fixed_substeps));
        const auto went_well = [&](std::size_t i) { return !s.bodies.tissue[i].advanced.refused && s.bodies.tissue[i].advanced.integrate.finite(); };
        if (std::all_of(islands.members.begin(), islands.members.end(), went_well)) return;
    }
    for (const std::size_t i : islands.members) {
        islands.body[i].is_free = false;
        islands.body[i].is_new = true;
        islands.body[i].is_instead = implicit;
    }
}

/// Bodies that no contact joins.
void integrate_free(const Stage& s) {
    std::vector<IslandBody>& bodies = s.bodies.islands.body;
    const auto is_joined = [&](std::size_t i) { return !s.model.bodies[i].tied.empty(); };
    for (Index i = 0; i < s.model.bodies.size(); ++i) {
        if (!s.is_tissue(i) || !bodies[i].is_free) continue;
        s.state.bodies[i].contact_work = left_of_work(s.bodies.start[i].contact_work, s.model.step_s);
        if (!is_joined(i))
            integrate_body(s.effects(), i, s.bodies.start[i].tissue, s.state, s.bodies.tissue[i]);
        else if (find_root(bodies, i) == i)
            integrate_joined(s, i);
    }
}

/// [-]; of the impulses of a solve that did not converge, so much starts the next: places that contradict one another would add up.
constexpr double kDistrust = 0.5;

/// s; what is left in equal sub-steps of at most `stable`.
double choose_substep(double left, double stable) noexcept { return left / std::max(1.0, std::ceil(left / stable * (1.0 - 1e-12))); }

/// The bodies of one island side by side. work: J, what contact has taken from them of late. False: one of them could not be advanced.
bool advance_side_by_side(const Stage& s, std::span<const std::size_t> members, double& work) {
    IslandsScratch& islands = s.bodies.islands;
    ContactScratch& contact = s.bodies.contact;
    const double step = s.model.step_s;
    const double longest = longest_substep(s.model);
    double time = 0.0, taken = 0.0, kicked = 0.0, trust = 1.0;
    for (unsigned count = 0;; ++count) {
        double stable = longest;
        for (fem::TissueLockstep& body : islands.lockstep) stable = std::min(stable, body.find_forces(time, taken));
        const double left = step - time;
        const bool arrived = !(left > 1e-12 * step);
        const double h = arrived ? 0.0 : choose_substep(left, stable), kick = 0.5 * (taken + h);
        const bool stopped = !(stable > 0.0) || (!arrived && left > (static_cast<double>(s.model.max_substeps) - count + 0.5) * h);
        if (count == 0) {
            for (std::size_t k = 0; k < members.size(); ++k) contact.bodies[k].nodes = islands.lockstep[k].nodes();
            islands.solver.observe();
        }
        bool finite = !stopped;
        for (fem::TissueLockstep& body : islands.lockstep) finite = finite && body.kick(kick);
        if (!finite) {
            for (std::size_t k = 0; k < members.size(); ++k)
                s.bodies.tissue[members[k]].advanced = islands.lockstep[k].finish(false, stopped && stable > 0.0);
            return false;
        }
        kick_ties(islands.ties, kick, islands.lockstep);
        for (std::size_t k = 0; k < members.size(); ++k) contact.bodies[k].nodes = islands.lockstep[k].nodes();
        if (!contact.solved.empty()) {
            const double substeps_left = arrived ? 1.0 : 1.0 + std::ceil(left / h);
            const std::uint64_t places = std::max<std::uint64_t>(1, contact.solved.size());
            islands.solver.limit_rows(s.rows.left() / static_cast<std::uint64_t>(substeps_left));
            s.budget.begin_rows(places, islands.solver.holds_wholes());
            const ContactSolve solve =
                arrived ? islands.solver.settle(time) : islands.solver.approach(time, h, (count == 0 ? kick : kick / kicked) * trust, work);
            s.budget.end_rows(solve.relaxed);
            (void)s.rows.spend(std::min(s.rows.left(), solve.relaxed));
            trust = solve.converged ? 1.0 : kDistrust;
            work = left_of_work(work - solve.work, kick);
            s.report.contact_iterations += solve.iterations;
            s.report.contact_unconverged += !solve.converged;
            if (kick > 0.0) s.report.contact_residual_n = std::max(s.report.contact_residual_n, solve.residual / kick);
        }
        if (arrived) break;
        for (fem::TissueLockstep& body : islands.lockstep) body.drift(h);
        time = left > 1.5 * h ? time + h : step;
        taken = h, kicked = kick;
    }
    for (ContactRow& row : contact.solved) row.last *= trust / kicked; // N, from here on
    for (std::size_t k = 0; k < members.size(); ++k) s.bodies.tissue[members[k]].advanced = islands.lockstep[k].finish(true, false);
    return true;
}

/// Rows whose every giving side is in the island.
void list_island_rows(const Stage& s, std::span<const std::size_t> members) {
    ContactScratch& contact = s.bodies.contact;
    std::fill(contact.slot.begin(), contact.slot.end(), ContactSide::kNone);
    contact.bodies.clear();
    for (std::size_t k = 0; k < members.size(); ++k) {
        contact.slot[members[k]] = static_cast<std::uint32_t>(k);
        contact.bodies.push_back({{}, s.model.bodies[members[k]].tissue->plan.inv_mass.data()});
    }
    contact.solved.clear();
    contact.row_of.clear();
    const auto is_in = [&](const ContactSide& side) { return !side.gives() || contact.slot[side.owner] != ContactSide::kNone; };
    for (Index k = 0; k < contact.rows.size(); ++k) {
        ContactRow row = contact.rows[k];
        if (!is_in(row.a) || !is_in(row.b) || !(row.a.gives() || row.b.gives())) continue;
        for (ContactSide* side : {&row.a, &row.b})
            if (side->gives()) side->slot = contact.slot[side->owner];
        row.impulse = s.state.solids.contacts[k].warm; // times the first kick: approach()'s ratio
        contact.solved.push_back(row);
        contact.row_of.push_back(k);
    }
}

/// Integrates one island from the start of the step.
void integrate_island(const Stage& s, std::span<const std::size_t> members) {
    IslandsScratch& islands = s.bodies.islands;
    list_island_rows(s, members);
    islands.lockstep.clear();
    double work = 0.0; // J
    for (const std::size_t i : members) {
        TissueScratch& scratch = s.bodies.tissue[i];
        work += s.bodies.start[i].contact_work;
        s.state.bodies[i].contact_work = left_of_work(s.bodies.start[i].contact_work, s.model.step_s); // where nothing presses
        s.state.bodies[i].tissue = s.bodies.start[i].tissue;
        load_body(s.effects(), i, s.state, scratch);
        islands.lockstep.emplace_back(*s.model.bodies[i].tissue, s.state.bodies[i].tissue, s.model.step_s, scratch.inputs,
                                      fem::SubstepLimits{}, scratch.rk, s.state.bodies[i].stable);
    }
    list_ties(s.model, members, islands.ties);
    islands.solver.begin(s.bodies.contact.solved, s.bodies.contact.bodies);
    const bool advanced = advance_side_by_side(s, members, work);
    for (const std::size_t i : members) s.bodies.tissue[i].advanced.instead = islands.body[i].is_instead;
    if (!advanced) return;
    bool pushed = false;
    for (std::size_t k = 0; k < s.bodies.contact.solved.size(); ++k) {
        const ContactRow& row = s.bodies.contact.solved[k];
        SolidContact& place = s.state.solids.contacts[s.bodies.contact.row_of[k]];
        place.touch.force = row.sum / s.model.step_s;
        place.warm = row.last;
        pushed = pushed || !row.sum.isZero(0.0);
    }
    const auto has_free_end = [&](std::size_t i) { return islands.body[i].has_free_end; };
    if (pushed)
        for (const std::size_t i : members) s.state.bodies[i].contact_work = work / static_cast<double>(members.size());
    if (pushed || !std::all_of(members.begin(), members.end(), has_free_end)) return;
    for (const std::size_t i : members) { // nothing touched: each as by itself, to the bit
        s.state.bodies[i].tissue = islands.body[i].free_end;
        s.bodies.tissue[i].advanced = islands.body[i].free_advanced;
    }
}

/// Joins what the contact joins, and marks it to be integrated.
void join(const ContactRow& row, std::vector<IslandBody>& bodies) noexcept {
    const Index a = static_cast<Index>(row.a.gives() ? row.a.owner : row.b.owner), b = static_cast<Index>(row.b.gives() ? row.b.owner : a);
    const Index low = std::min(find_root(bodies, a), find_root(bodies, b)), high = std::max(find_root(bodies, a), find_root(bodies, b));
    bodies[high].parent = low;
    for (const Index i : {a, b}) bodies[i].is_new = true;
    for (Index i = low; i < bodies.size(); ++i) // and what ties join to them
        if (find_root(bodies, i) == low) bodies[i].is_free = false;
}

/// All islands of which a body is new.
void integrate_islands(const Stage& s) {
    IslandsScratch& islands = s.bodies.islands;
    for (Index root = 0; root < islands.body.size(); ++root) {
        if (islands.body[root].is_free || find_root(islands.body, root) != root) continue;
        list_members(islands, root);
        const bool is_new = std::any_of(islands.members.begin(), islands.members.end(), [&](std::size_t i) { return islands.body[i].is_new; });
        for (const std::size_t i : islands.members) islands.body[i].is_new = false;
        if (is_new) integrate_island(s, islands.members);
    }
}

/// Contacts that nobody expected to press, and that would be passed as the bodies stand at the step's end. False: none.
bool join_what_met(const Stage& s) {
    IslandsScratch& islands = s.bodies.islands;
    bool any = false;
    for (std::size_t k = 0; k < s.bodies.contact.rows.size(); ++k) {
        const ContactRow& row = s.bodies.contact.rows[k];
        if (islands.joined[k] || !(row.a.gives() || row.b.gives())) continue;
        if (!(find_gap(s.model, row, s.model.step_s, s.state) < 0.0)) continue;
        islands.joined[k] = true;
        const auto is_in_one = [&] {
            const Index a = static_cast<Index>(row.a.gives() ? row.a.owner : row.b.owner);
            const Index b = static_cast<Index>(row.b.gives() ? row.b.owner : a);
            return !islands.body[a].is_free && !islands.body[b].is_free && find_root(islands.body, a) == find_root(islands.body, b);
        };
        if (is_in_one()) continue; // it was solved with the others
        join(row, islands.body);
        any = true;
    }
    return any;
}

/// What presses from the last step on joins its bodies from the start.
void begin_islands(const Stage& s) {
    IslandsScratch& islands = s.bodies.islands;
    islands.joined.assign(s.bodies.contact.rows.size(), 0);
    for (Index i = 0; i < islands.body.size(); ++i) {
        islands.body[i].parent = i;
        islands.body[i].is_free = true;
        islands.body[i].is_new = islands.body[i].has_free_end = islands.body[i].is_instead = false;
    }
    for (Index i = 0; i < islands.body.size(); ++i)
        if (const std::optional<WallJoint>& joint = s.model.bodies[i].joint) {
            const Index a = find_root(islands.body, i), b = find_root(islands.body, static_cast<Index>(joint->host));
            islands.body[std::max(a, b)].parent = std::min(a, b);
        }
    for (std::size_t k = 0; k < s.bodies.contact.rows.size(); ++k) {
        SolidContact& place = s.state.solids.contacts[k];
        place.touch.force.setZero();
        const ContactRow& row = s.bodies.contact.rows[k];
        if (!(row.a.gives() || row.b.gives()) || (place.touch.gap > 0.0 && place.warm.isZero(0.0))) continue;
        islands.joined[k] = true;
        join(row, islands.body);
    }
}

void keep_free_end(const Stage& s, std::size_t i) {
    IslandBody& body = s.bodies.islands.body[i];
    body.has_free_end = true;
    body.free_end = s.state.bodies[i].tissue;
    body.free_advanced = s.bodies.tissue[i].advanced;
}

/// Of what contact may still join to others, with what ties join to it.
void keep_free_ends(const Stage& s) {
    std::vector<IslandBody>& bodies = s.bodies.islands.body;
    for (const ContactRow& row : s.bodies.contact.rows)
        for (const ContactSide* side : {&row.a, &row.b}) {
            if (!side->gives() || !bodies[side->owner].is_free || bodies[side->owner].has_free_end) continue;
            const Index root = find_root(bodies, static_cast<Index>(side->owner));
            for (Index i = root; i < bodies.size(); ++i)
                if (find_root(bodies, i) == root) keep_free_end(s, i);
        }
}

void report_contact(State& state, StepReport& report) {
    for (SolidContact& place : state.solids.contacts) {
        if (place.touch.force.isZero(0.0)) place.warm.setZero(); // it left, or never came
        const double normal = place.touch.normal.dot(place.touch.force);
        report.solid_force_n += normal;
        report.max_solid_force_n = std::max(report.max_solid_force_n, normal);
    }
}

} // namespace

void integrate_bodies(const SceneModel& model, const EffectSet& live, State& state, BodiesScratch& bodies, StepReport& report,
                      StepBudget& budget) {
    if (!live.elasticity) return;
    WorkBudget rows(0);
    const Stage stage{model, live, state, bodies, report, budget, rows};
    for (TissueScratch& scratch : bodies.tissue) scratch.rk.evaluations = 0;
    make_rows(model, state, bodies.contact);
    if (!bodies.contact.rows.empty()) rows = budget.grant_rows();
    begin_islands(stage);
    integrate_free(stage);
    keep_free_ends(stage);
    integrate_islands(stage);
    while (join_what_met(stage)) integrate_islands(stage);
    if (!bodies.contact.rows.empty()) budget.settle_rows(rows);
    report_contact(state, report);
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (stage.is_tissue(i)) report.tet_evaluations += bodies.tissue[i].rk.evaluations * model.bodies[i].tissue->tet_count();
    report.elastic_j += tie_energy(model, state);
    for (std::size_t i = 0; i < model.bodies.size() && report.finite; ++i)
        if (stage.is_tissue(i)) report_body(model, model.bodies[i], bodies.tissue[i].advanced, report);
}

} // namespace trocar::engine
