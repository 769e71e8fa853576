#include "fem/rod/rod_internal.hpp"

#include "fem/rod/rod.hpp"
#include "fem/rod/rod_band.hpp"
#include "fem/rod/rod_parts.hpp"
#include "fem/rod/rod_twist.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::fem {

RodInternalForces find_internal_forces(const RodModel& model, const RodState& state, const RodPort& port, RodSolvedAs as) {
    const std::size_t nodes = model.node_count();
    RodInternalForces out;
    out.tension.assign(nodes - 1, 0.0);
    out.moment.assign(nodes, Vec3::Zero());
    out.torque.assign(nodes - 1, 0.0);
    const Index first = first_inserted_node(model, state.insertion);
    RodState rod = state; // the frames of a step begin where the last one ended, and count angles anew
    std::fill(rod.spin.begin(), rod.spin.end(), 0.0);
    RodWorkspace work;
    size_workspace(nodes, work);
    size_twist_workspace(model, work);
    RodDrive drive;
    drive.port = port;
    drive.insertion = state.insertion, drive.rotation = state.rotation;
    if (as.clamped) drive.clamp.emplace();
    RodTwist twist(model, rod, drive, 1.0, first, work);
    const bool twists = !state.angle.empty();
    if (twists)
        twist.begin();
    else
        find_rest_bend(model, rod, port, work);
    const double share = as.mass_spring ? 1.0 : inserted_share(model, state.insertion, first);
    for (std::size_t i = first > 0 ? first - 1 : 0; i + 1 < nodes; ++i) {
        const double length = std::sqrt((state.position[i + 1] - state.position[i]).squaredNorm());
        out.tension[i] = model.stretch_stiffness[i] / (i + 1 == first ? share : 1.0) * (length - rest_length(model, i));
        if (twists) out.torque[i] = twist.torque_behind(static_cast<Index>(i + 1));
    }
    for (std::size_t i = std::max<std::size_t>(first, 1); i + 1 < nodes; ++i) {
        const double bent = i == first ? std::min(1.0, share + 0.5) : 1.0; // of the length that bends there, what is beyond the port
        out.moment[i] = model.bend_stiffness[i] * model.segment / bent *
                        work.tangent[i].cross(second_difference(state.position, i) - bent * work.rest_bend[i]);
    }
    return out;
}

double find_largest_stretch(const RodModel& model, const RodState& state) noexcept {
    const std::size_t first = first_inserted_node(model, state.insertion), last = model.node_count() - 2; // what clamps the tip may hold it beyond the port
    double most = 0.0;
    for (std::size_t i = std::min(first > 0 ? first - 1 : 0, last); i <= last; ++i) {
        const double length = std::sqrt((state.position[i + 1] - state.position[i]).squaredNorm()), rest = rest_length(model, i);
        most = std::max(most, std::abs(length - rest) / rest);
    }
    return most;
}

} // namespace trocar::fem
