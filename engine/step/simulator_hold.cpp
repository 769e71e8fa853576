// Motion that is held back: what is proven free of it is taken, the rest is not.
#include "engine/step/instrument_stage.hpp"
#include "engine/step/simulator.hpp"
#include "engine/step/tissue_stage.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Shares of the remaining motion that are tried before everything stays where it was.
constexpr double kHoldShares[] = {0.9, 0.5};
/// A safe share of a motion below this is none.
constexpr double kStuck = 0.01;

} // namespace

/// Contacts were left after all corrections: everything moves only as far as that is proven free.
void Simulator::scale_to_safe_fraction(double fraction) {
    // A skin that stands within the exact distance (a step that was held back ends at its edge) is touching from the start, whatever it
    // does, and would stand there for ever. It moves as far as it is proven not to touch at all.
    if (fraction < kStuck) {
        double taken = 1.0;
        for (double share = find_free_share(0.0); taken * share >= kStuck; share = find_free_share(0.0)) {
            if (share == 1.0) {
                context_.report.safe_fraction = taken;
                context_.report.within_distance = true;
                return;
            }
            taken *= 0.5 * share;
            scale_motion(0.5 * share);
        }
    }
    for (const double share : kHoldShares) {
        scale_motion(share * fraction);
        context_.report.safe_fraction = share * fraction;
        if (find_free_share(model_.contact.exact_distance) == 1.0) return;
    }
    scale_motion(0.0);
    context_.report.safe_fraction = 0.0;
}

/// Up to which share of the motion as it is does no skin come so near to its wall? Safety is not negotiable: without a budget.
double Simulator::find_free_share(double distance) {
    double share = 1.0;
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
        WorkBudget budget;
        refit_wall(model_, model_.instruments[i].lumen, state_, context_);
        context_.exact.clear();
        share = std::min(share, test_skin_at(model_, i, state_, context_, distance, budget).safe_fraction);
    }
    return share;
}

/// Forces of a solve whose motion was not taken mean nothing: nothing is pushed in the next step.
void Simulator::forget_forces() {
    for (InstrumentState& instrument : state_.instruments)
        for (fem::RodPlane& plane : instrument.planes) plane.force = 0.0;
}

/// Bodies and rods go `fraction` of the way from the start of the step to where they are now.
void Simulator::scale_motion(double fraction) {
    const auto scale = [fraction](const std::vector<Vec3>& from, std::vector<Vec3>& to) {
        for (std::size_t k = 0; k < to.size(); ++k) to[k] = from[k] + fraction * (to[k] - from[k]);
    };
    for (std::size_t i = 0; i < model_.bodies.size(); ++i) {
        if (!model_.bodies[i].tissue) continue;
        scale(context_.bodies[i].tissue_t0.position, state_.bodies[i].tissue.position);
        for (Vec3& v : state_.bodies[i].tissue.velocity) v *= fraction;
    }
    for (std::size_t i = 0; i < model_.instruments.size(); ++i) {
        const InstrumentModel& instrument = model_.instruments[i];
        InstrumentScratch& scratch = context_.instruments[i];
        fem::RodState& rod = state_.instruments[i].rod;
        scale(scratch.rod_t0.position, rod.position);
        for (Vec3& v : rod.velocity) v *= fraction;
        rod.insertion = scratch.rod_t0.insertion + fraction * (rod.insertion - scratch.rod_t0.insertion);
        rod.rotation = scratch.rod_t0.rotation + fraction * (rod.rotation - scratch.rod_t0.rotation);
        for (std::size_t k = 0; k < rod.angle.size(); ++k) {
            rod.angle[k] = scratch.rod_t0.angle[k] + fraction * (rod.angle[k] - scratch.rod_t0.angle[k]);
            rod.spin[k] *= fraction;
        }
        fem::place_rod_skin(instrument.rod, instrument.skin, rod, instrument.port, scratch.axis, state_.instruments[i].skin);
    }
    update_embedded_surfaces(model_, state_, context_);
    for (BodyState& body : state_.bodies) {
        body.lumen.miss_steps(); // what it saw is not where the step ends
        body.lumen_step = kNoStep;
    }
}

} // namespace trocar::engine
