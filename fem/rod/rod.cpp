#include "fem/rod/rod.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

namespace {

/// [-] of a segment; what is left of a rod in its port and less than this is nothing: drive commands are multiples of 2^-40 m.
constexpr double kLeastHeld = 1e-6;

} // namespace

Index first_inserted_node(const RodModel& model, double insertion) noexcept {
    const double outside = static_cast<double>(model.node_count() - 1) - insertion / model.segment;
    if (!(outside > kLeastHeld)) return 0;
    // A node exactly on the port counts as outside.
    const double first = std::floor(outside) + 1.0;
    return static_cast<Index>(std::min(first, static_cast<double>(model.node_count())));
}

void place_rod(const RodModel& model, const RodPort& port, double insertion, double rotation, RodState& state) {
    const std::size_t nodes = model.node_count();
    state.position.resize(nodes);
    state.velocity.assign(nodes, Vec3::Zero());
    state.insertion = insertion;
    state.rotation = rotation;
    state.angle.assign(model.twist_stiffness.empty() ? 0 : nodes, rotation);
    state.spin.assign(state.angle.size(), 0.0);
    state.root.setZero();
    for (std::size_t i = 0; i < nodes; ++i)
        state.position[i] = port.position + port.direction * (insertion - static_cast<double>(nodes - 1 - i) * model.segment);
}

} // namespace trocar::fem
