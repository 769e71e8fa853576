#include "engine/step/solid/touch_rules.hpp"

namespace trocar::engine {

bool is_leaf_pair(const SceneModel& model, const Contact& contact) noexcept {
    if (contact.origin == ContactOrigin::TestedSpheres) return true;
    return contact.gap < 0.0 && model.bodies[contact.a.index()].covering.tree.is_leaf(contact.feature_a[0]) &&
           model.bodies[contact.b.index()].covering.tree.is_leaf(contact.feature_b[0]);
}

} // namespace trocar::engine
