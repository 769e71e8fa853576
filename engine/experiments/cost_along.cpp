#include "engine/prepare/body_pairs.hpp"
#include "engine/experiments/cost_along.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Resultant contact force on every deformable body and on every instrument, N: of springs as the answer leaves them, of places where
/// solids touch as the next step has them.
void find_forces(LookAhead& ahead, Simulator& simulator, std::vector<Vec3>& forces) {
    const SceneModel& model = simulator.model();
    forces.clear();
    std::vector<Vec3> on(model.bodies.size(), Vec3::Zero());
    if (!simulator.raw_state().solids.contacts.empty())
        for (const SolidContact& place : ahead.step_after(simulator).solids.contacts) {
            on[owner_of(model, place.touch.a.index())] += place.touch.force;
            on[owner_of(model, place.touch.b.index())] -= place.touch.force;
        }
    for (std::size_t k = 0; k < model.instruments.size(); ++k)
        if (const auto host = model.bodies[model.instruments[k].lumen].host_body)
            for (const fem::RodPlane& plane : simulator.raw_state().instruments[k].planes)
                if (plane.force > 0.0) on[*host] -= plane.force * plane.normal + plane.drag;
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        if (model.bodies[i].tissue) forces.push_back(on[i]);
    for (const InstrumentState& instrument : simulator.raw_state().instruments) {
        Vec3 sum = Vec3::Zero();
        for (const fem::RodPlane& plane : instrument.planes) sum += std::max(plane.force, 0.0) * plane.normal;
        forces.push_back(sum);
    }
}

} // namespace

void LookAhead::set_exact(Simulator& exact) { exact_ = follow(exact); }

/// The next step's tissue feels the answer: nothing else of that step is asked.
const State& LookAhead::step_after(Simulator& answered) {
    [[maybe_unused]] const bool fits = simulator_.restore(answered.state()).ok(); // of a model of the same sizes
    simulator_.begin_step();
    return simulator_.raw_state();
}

Shape LookAhead::follow(Simulator& answered) {
    (void)step_after(answered);
    Shape shape = shape_of(simulator_.model(), simulator_.state());
    shape.skins = shape_of(answered.model(), answered.state()).skins;
    return shape;
}

SurfaceDistance LookAhead::compare(Simulator& answered) { return compare_shapes(simulator_.model(), follow(answered), exact_); }

/// Solids from the surfaces, instruments from the exact answer.
PatchContacts AlongExactStates::solids_of(const PatchContacts& near, const PatchContacts& reference) const {
    PatchContacts truth = near;
    for (const PatchContact& c : reference)
        if (!c.patch.other.is_body()) truth.push_back(c);
    std::sort(truth.begin(), truth.end(), [](const auto& a, const auto& b) { return a.patch < b.patch; });
    return truth;
}

const SceneModel& model_of(const SceneModel& scene, const CostOptions& options, const CostRow& row) {
    for (const CostVariant& variant : options.variants)
        if (variant.name == row.variant) return *variant.model;
    return scene;
}

void AlongExactStates::Along::finish(double exact_force_sq, CostAlong& row) const {
    const double count = steps > 0 ? static_cast<double>(steps) : 1.0;
    row.pairs_open_mean = open / count;
    row.leaf_contacts_mean = leaves / count;
    row.level_reached_mean = levels / count;
    row.assumed_mean = assumed / count;
    // Without any force in the exact run the error has no scale: a force where there should be none is all wrong.
    row.force_error_rel = exact_force_sq > 0.0 ? std::sqrt(force_sq / exact_force_sq) : (force_sq > 0.0 ? 1.0 : 0.0);
}

AlongExactStates::AlongExactStates(const SceneModel& model, const CostSpec& cost, const CostOptions& options, CostTable& table)
    : table_(table), finder_(model, cost), exact_(model, BudgetLimits{}), ahead_(model), along_(table.rows.size()) {
    (void)go_to_start(exact_, options, model); // where it does not, the exact run has no step to follow
    for (const CostVariant& variant : options.variants) variant_finders_.emplace_back(*variant.model, cost);
    for (std::size_t k = 0; k < along_.size(); ++k) {
        const CostRow& row = table.rows[k];
        along_[k].simulator = std::make_unique<Simulator>(model_of(model, options, row), row.budget.limits);
        along_[k].finder = &finder_;
        along_[k].other_trees = along_[k].simulator->model().contact.sphere_trees != model.contact.sphere_trees;
        for (std::size_t v = 0; v < options.variants.size(); ++v)
            if (options.variants[v].name == row.variant) along_[k].finder = &variant_finders_[v];
    }
    table.tolerance_m = finder_.tolerance();
    for (std::size_t i = 0; i < model.bodies.size(); ++i) table.patch_m.push_back(finder_.patch_size(i));
}

bool AlongExactStates::step(const std::function<void(const CostRow&, Simulator&)>& show) {
    start_ = exact_.state();
    if (!exact_.step().finite) return false;
    for (Along& along : along_) {
        const Result<void> restored = restore_variant(*along.simulator, start_, exact_.model());
        if (!restored) {
            table_.notices.push_back(fmt::format("answers of single steps are compared up to step {}: {}", steps_, restored.error().to_string()));
            return false;
        }
        along.simulator->step();
    }
    const PatchContacts near = finder_.find_near(exact_.state());
    const PatchContacts reference = finder_.find_answer(exact_);
    count_uncovered(near, reference);
    find_forces(ahead_, exact_, exact_forces_);
    for (const Vec3& f : exact_forces_) exact_force_sq_ += f.squaredNorm();
    ++steps_;
    const PatchContacts truth = solids_of(near, reference);
    named_.clear();
    for (std::size_t k = 0; k < along_.size(); ++k) {
        compare(along_[k], along_[k].other_trees ? truth : reference, table_.rows[k]);
        if (show) show(table_.rows[k], *along_[k].simulator);
    }
    std::sort(named_.begin(), named_.end());
    depth_patches_ += static_cast<std::uint64_t>(std::unique(named_.begin(), named_.end()) - named_.begin());
    return true;
}

void AlongExactStates::compare_surfaces() {
    ahead_.set_exact(exact_);
    for (std::size_t k = 0; k < along_.size(); ++k) table_.rows[k].surface.join(ahead_.compare(*along_[k].simulator));
}

void AlongExactStates::finish() {
    for (std::size_t k = 0; k < along_.size(); ++k) {
        along_[k].finish(exact_force_sq_, table_.rows[k]);
        table_.rows[k].depth_patches = depth_patches_;
    }
    if (near_covered_ > 0) table_.near_depth_rms_m = std::sqrt(near_excess_sq_ / static_cast<double>(near_covered_));
    if (steps_ > 0 && !exact_forces_.empty())
        table_.force_rms_n = std::sqrt(exact_force_sq_ / static_cast<double>(steps_ * exact_forces_.size()));
}

/// Compares the independent search with the exact answer for the same surfaces.
void AlongExactStates::count_uncovered(const PatchContacts& near, const PatchContacts& reference) {
    table_.near_patches += near.size();
    for (const PatchContact& c : near) {
        const PatchContact* const named = find_patch(reference, c.patch);
        table_.near_uncovered += named == nullptr;
        if (named == nullptr) continue;
        near_excess_sq_ += (named->depth - c.depth) * (named->depth - c.depth);
        ++near_covered_;
    }
}

void AlongExactStates::compare(Along& along, const PatchContacts& reference, CostRow& row) {
    const StepReport& report = along.simulator->report();
    const PatchContacts answer = along.finder->find_answer(*along.simulator);
    PatchDifference difference = compare_patches(reference, answer);
    if (difference.missed > 0) difference.unseen = count_unseen(reference, answer, finder_.find_near(along.simulator->raw_state()));
    row.contacts += difference;
    for (const PatchContacts* list : {&reference, &answer})
        for (const PatchContact& contact : *list) named_.push_back(contact.patch);
    find_forces(ahead_, *along.simulator, forces_);
    for (std::size_t k = 0; k < forces_.size(); ++k) along.force_sq += (forces_[k] - exact_forces_[k]).squaredNorm();
    along.open += static_cast<double>(report.pairs_open);
    along.leaves += static_cast<double>(report.leaf_contacts);
    along.levels += report.level_reached;
    along.assumed += static_cast<double>(report.assumed);
    ++along.steps;
}

double CostAlong::depth_error_rms_m() const noexcept {
    return depth_patches > 0 ? std::sqrt(contacts.depth_error_sq / static_cast<double>(depth_patches)) : 0.0;
}

} // namespace trocar::engine
