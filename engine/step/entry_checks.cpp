#include "engine/step/entry_checks.hpp"

#include "engine/scene/settings.hpp"
#include "engine/scene/check_keys.hpp"
#include "engine/scene/describe_contact.hpp"
#include "engine/scene/describe_effects.hpp"
#include "engine/scene/describe_instrument.hpp"
#include "engine/scene/table.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>

namespace trocar::engine {

namespace {

Error bad(std::string key, std::string message) { return {ErrorCode::BadValue, std::move(message), {}, 0, 0, std::move(key)}; }

/// Numbers one after another; the first that is wrong is kept.
class NumberCheck {
public:
    NumberCheck& positive(const char* key, double value) { return take(value > 0.0, key, value, "a finite number above 0"); }
    NumberCheck& not_negative(const char* key, double value) { return take(value >= 0.0, key, value, "a finite number, 0 or more"); }
    NumberCheck& finite(const char* key, const Vec3& value) {
        for (int axis = 0; axis < 3; ++axis) take(true, key, value[axis], "three finite numbers");
        return *this;
    }
    /// By the description of the struct's keys.
    template <class Keys>
    NumberCheck& keys(const char* key, const typename Keys::Struct& s) {
        if (first_) return *this;
        if (const auto misfit = find_misfit<Keys>(s)) first_ = bad(fmt::format("{}.{}", key, misfit->key), misfit->message);
        return *this;
    }
    [[nodiscard]] Result<void> result() const { return first_ ? Result<void>(*first_) : Result<void>(); }

private:
    NumberCheck& take(bool in_range, const char* key, double value, const char* expected) {
        if (!first_ && !(in_range && std::isfinite(value))) first_ = bad(key, fmt::format("found {:g}, expected {}", value, expected));
        return *this;
    }
    std::optional<Error> first_;
};

Error no_such(const char* key, const char* what, std::size_t found, std::size_t count) {
    return bad(key, count == 0 ? fmt::format("found {} {}, and there is none", what, found)
                               : fmt::format("found {} {}, expected one from 0 to {}", what, found, count - 1));
}

} // namespace

Result<void> check_limits(const BudgetLimits& limits) {
    if (limits.mode != BudgetMode::Wall && limits.mode != BudgetMode::Work && limits.mode != BudgetMode::Exact)
        return bad("budget.mode", fmt::format("found {}, expected Wall, Work or Exact", static_cast<unsigned>(limits.mode)));
    if (limits.mode == BudgetMode::Wall && !(limits.wall_s >= 0.0 && limits.wall_s <= kMaxBudgetSeconds))
        return bad("budget.wall_s", fmt::format("found {:g} s, expected a time from 0 to {:g} s", limits.wall_s, kMaxBudgetSeconds));
    return {};
}

Result<void> check_drive_command(const SceneModel& model, std::size_t instrument, const DriveCommand& wanted) {
    if (instrument >= model.instruments.size()) return no_such("instrument", "instrument", instrument, model.instruments.size());
    for (const auto& [key, value] : {std::pair("insertion", wanted.insertion), std::pair("rotation", wanted.rotation)})
        if (!std::isfinite(value)) return bad(key, fmt::format("found {:g}, expected a finite number", value));
    return {};
}

Result<void> check_pull(const SceneModel& model, const Pull& pull) {
    if (pull.body >= model.bodies.size()) return no_such("pull.body", "body", pull.body, model.bodies.size());
    const std::size_t vertices = model.bodies[pull.body].surface.vertices.size();
    if (pull.vertex >= vertices) return no_such("pull.vertex", "vertex", pull.vertex, vertices);
    for (int axis = 0; axis < 3; ++axis)
        if (!(std::abs(pull.target[axis]) <= kMaxCoordinate))
            return bad("pull.target",
                       fmt::format("found {:g} m, expected a place within {:g} m of the origin", pull.target[axis], kMaxCoordinate));
    return {};
}

Result<void> check_inputs(const SceneModel& model, const Inputs& inputs) {
    if (!inputs.drive.empty() && inputs.drive.size() != model.instruments.size())
        return bad("drive", fmt::format("found {} commands, expected none, or one for each of {} instruments (nullopt: its script)",
                                        inputs.drive.size(), model.instruments.size()));
    Result<void> fine;
    for (std::size_t i = 0; i < inputs.drive.size() && fine.ok(); ++i)
        if (inputs.drive[i]) fine = check_drive_command(model, i, *inputs.drive[i]);
    if (fine.ok() && inputs.pull) fine = check_pull(model, *inputs.pull);
    for (const EffectDescriptor* effect : registered_effects())
        if (const double share = inputs.live.share(*effect); fine.ok() && !(share >= 0.0 && share <= 1.0))
            fine = bad(fmt::format("live.{}", effect->name), fmt::format("found {:g}, expected a share from 0 to 1", share));
        else if (fine.ok() && share < 1.0 && effect->scale == nullptr)
            fine = bad(fmt::format("live.{}", effect->name), fmt::format("found {:g}, but {} is fixed for a run; expected 1", share, effect->name));
    if (fine.ok() && inputs.budget) fine = check_limits(*inputs.budget);
    return fine;
}

Result<void> check_settings(const SceneModel& model) {
    NumberCheck check;
    check.positive("step_s", model.step_s).positive("max_substeps", model.max_substeps);
    const EffectSet& effects = model.effects;
    if (effects.gravity) check.finite("gravity", *effects.gravity);
    if (effects.breathing) {
        BreathingSpec breathing = *effects.breathing;
        if (breathing.amplitude == 0.0) breathing.amplitude = BreathingSpec{}.amplitude; // it is faded in from none
        check.keys<BreathingKeys>("breathing", breathing);
    }
    if (effects.pulse) check.keys<PulseKeys>("pulse", *effects.pulse);
    if (effects.blood_drag)
        check.keys<BloodPropertyKeys>("blood_drag", *effects.blood_drag).not_negative("blood_drag.period", effects.blood_drag->period);
    check.keys<ContactKeys>("contact", model.contact);
    for (const InstrumentModel& instrument : model.instruments)
        check.keys<LimitKeys>("limits", instrument.limits)
            .keys<FollowSettingKeys>("follow", instrument.follow)
            .not_negative("friction", instrument.friction);
    return check.result();
}

} // namespace trocar::engine
