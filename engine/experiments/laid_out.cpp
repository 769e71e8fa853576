#include "engine/experiments/laid_out.hpp"

#include <algorithm>

namespace trocar::engine {

namespace {

/// Arc length s of the route; before it the port's axis.
Vec3 point_along(const Route& route, const fem::RodPort& port, double s) {
    if (s <= 0.0) return port.position + s * port.direction;
    const auto after = std::upper_bound(route.length.begin(), route.length.end(), s);
    if (after == route.length.end()) return route.points.back();
    const auto k = static_cast<std::size_t>(after - route.length.begin());
    if (k == 0) return route.points.front();
    const double t = (s - route.length[k - 1]) / (route.length[k] - route.length[k - 1]);
    return route.points[k - 1] + t * (route.points[k] - route.points[k - 1]);
}

void lay_along(const InstrumentModel& instrument, InstrumentState& state) {
    const fem::RodModel& rod = instrument.rod;
    const Route& route = *instrument.route;
    const double insertion = std::min(route.length.back(), rod.design.length - 2.0 * rod.segment);
    state.rod.insertion = insertion;
    for (std::size_t i = 0; i < rod.node_count(); ++i)
        state.rod.position[i] =
            point_along(route, instrument.port, insertion - static_cast<double>(rod.node_count() - 1 - i) * rod.segment);
    std::vector<Vec3> axis(rod.node_count());
    fem::place_rod_skin(rod, instrument.skin, state.rod, instrument.port, axis, state.skin);
    state.follow.progress = state.follow.best_progress = insertion;
    state.follow.best_insertion = state.follow.astray_insertion = insertion;
}

} // namespace

std::optional<State> lay_along_routes(const SceneModel& model) {
    State state = make_initial_state(model);
    bool any = false;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        if (!model.instruments[i].route) continue;
        lay_along(model.instruments[i], state.instruments[i]);
        any = true;
    }
    return any ? std::optional(std::move(state)) : std::nullopt;
}

} // namespace trocar::engine
