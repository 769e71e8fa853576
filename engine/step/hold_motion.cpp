// Scaling to the safe fraction: what is proven free of the motion is taken, the rest is not.
#include "engine/step/instrument/instrument_stage.hpp"
#include "engine/step/resolve_contacts.hpp"
#include "engine/step/tissue/surface_place.hpp"
#include "engine/step/tissue/tissue_stage.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Shares of the remaining motion that are tried before everything stays where it was.
constexpr double kHoldShares[] = {0.9, 0.5};
/// A safe share of a motion below this is none.
constexpr double kStuck = 0.01;

template <class T>
void scale(const std::vector<T>& from, double fraction, std::vector<T>& to) {
    for (std::size_t k = 0; k < to.size(); ++k) to[k] = from[k] + fraction * (to[k] - from[k]);
}

void scale_rod(const InstrumentModel& instrument, double fraction, InstrumentState& state, InstrumentScratch& scratch) {
    fem::RodState& rod = state.rod;
    scale(scratch.rod_t0.position, fraction, rod.position);
    for (Vec3& v : rod.velocity) v *= fraction;
    rod.insertion = scratch.rod_t0.insertion + fraction * (rod.insertion - scratch.rod_t0.insertion);
    rod.rotation = scratch.rod_t0.rotation + fraction * (rod.rotation - scratch.rod_t0.rotation);
    const bool stays_out = !scratch.rod_t0.root.isZero(0.0); // else it goes back into its port
    if (!rod.root.isZero(0.0)) rod.root = stays_out ? fem::move_root(scratch.rod_t0, rod.position) : Vec3(Vec3::Zero());
    for (std::size_t k = 0; k < rod.angle.size(); ++k) {
        rod.angle[k] = scratch.rod_t0.angle[k] + fraction * (rod.angle[k] - scratch.rod_t0.angle[k]);
        rod.spin[k] *= fraction;
    }
    fem::place_rod_skin(instrument.rod, instrument.skin, rod, instrument.port, scratch.axis, state.skin);
}

/// Planes go with their walls, which are about to be set back.
void set_back_planes(const SceneModel& model, double fraction, State& state, const RodsScratch& rods) {
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::size_t lumen = model.instruments[i].lumen;
        if (!model.bodies[lumen].host_body) continue;
        const collision::SurfaceMotion wall = wall_motion(model, lumen, state, rods);
        InstrumentState& now = state.instruments[i];
        for (std::size_t k = 0; k < now.planes.size(); ++k) {
            if (now.presses[k].triangle == kNoIndex) continue;
            const Triangle& t = wall.topology->triangles[now.presses[k].triangle];
            const Vec3 moved = point_on(t, now.presses[k].bary, wall.t1) - point_on(t, now.presses[k].bary, wall.t0);
            now.planes[k].offset -= (1.0 - fraction) * now.planes[k].normal.dot(moved);
        }
    }
}

/// Bodies and rods go `fraction` of the way from the start of the step to where they are now.
void scale_motion(const SceneModel& model, const EffectSet& live, double fraction, State& state, BodiesScratch& bodies, RodsScratch& rods,
                  StepReport& report) {
    set_back_planes(model, fraction, state, rods);
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (!model.bodies[i].tissue) continue;
        scale(bodies.start[i].tissue.position, fraction, state.bodies[i].tissue.position);
        scale(bodies.start[i].tissue.relaxed, fraction, state.bodies[i].tissue.relaxed);
        for (Vec3& v : state.bodies[i].tissue.velocity) v *= fraction;
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        scale_rod(model.instruments[i], fraction, state.instruments[i], rods.instruments[i]);
    update_embedded_surfaces(model, live, state, bodies, report);
    for (BodyState& body : state.bodies) {
        body.lumen.miss_steps(); // what it saw is not where the step ends
        body.lumen_step = kNoStep;
    }
    for (WallScratch& wall : rods.walls) wall.last_step = kNoStep;
}

} // namespace

/// Safety is not negotiable: without a budget.
double find_free_share(const SceneModel& model, double distance, const State& state, RodsScratch& rods) {
    double share = 1.0;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        WorkBudget budget;
        follow_wall(model, model.instruments[i].lumen, state, rods);
        rods.hits.clear();
        share = std::min(share, test_skin_at(model, i, state, rods, distance, budget).safe_fraction);
    }
    return share;
}

/// [-] of an instrument's motion that is proven not to take it through itself.
static double self_share(const InstrumentScratch& own) noexcept { return own.meets_itself ? own.self.proven_share() : 1.0; }

bool hold_rods(const SceneModel& model, State& state, RodsScratch& rods, StepReport& report) {
    bool held = false;
    const double met = find_met_share(model, state, rods);
    double all = met; // what may meet is proven apart where each takes the same share
    if (rods.meet)
        for (std::size_t i = 0; i < model.instruments.size(); ++i)
            if (may_be_joined(model, i)) all = std::min(all, self_share(rods.instruments[i]));
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        InstrumentScratch& own = rods.instruments[i];
        const double itself = self_share(own), share = rods.meet && may_be_joined(model, i) ? all : itself;
        if (!(share < 1.0)) continue;
        scale_rod(model.instruments[i], kHoldShares[0] * share, state.instruments[i], own);
        state.instruments[i].kept_inside = false;
        report.self_held += itself < 1.0;
        report.instrument_held += met < 1.0;
        held = true;
    }
    return held;
}

void scale_to_safe_fraction(const SceneModel& model, const EffectSet& live, double fraction, State& state, BodiesScratch& bodies,
                            RodsScratch& rods, StepReport& report) {
    double taken = 1.0; // of the step's motion
    const auto take = [&](double share) {
        scale_motion(model, live, share / taken, state, bodies, rods, report);
        report.safe_fraction = taken = share;
    };
    // A skin that stands within the exact distance (a scaled step ends at its edge) is touching from the start, whatever it
    // does, and would stand there for ever. It moves as far as it is proven not to touch at all.
    if (fraction < kStuck) {
        const auto free_share = [&] { return find_free_share(model, 0.0, state, rods); };
        for (double share = free_share(); taken * share >= kStuck; share = free_share()) {
            if (share == 1.0) {
                report.safe_fraction = taken;
                report.within_distance = true;
                return;
            }
            take(0.5 * share * taken);
        }
    }
    for (const double share : kHoldShares) {
        if (!(fraction > 0.0)) break;
        take(std::min(share * fraction, taken));
        if (find_free_share(model, model.contact.exact_distance, state, rods) == 1.0) return;
    }
    take(0.0);
}

} // namespace trocar::engine
