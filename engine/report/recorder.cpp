#include "engine/report/recorder.hpp"

#include "fem/rod/coaxial.hpp"
#include "fem/rod/rod.hpp"
#include "fem/rod/rod_internal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

namespace trocar::engine {

namespace {

constexpr std::uint64_t kCollectionEvery = 16; // states between two writings of the collection

/// A body's name as part of a file's name.
std::string file_stem(const std::string& name) {
    std::string stem;
    for (const char c : name) {
        const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' || c == '_';
        stem += plain ? c : '_';
    }
    return stem.empty() ? "body" : stem;
}

std::vector<double> flatten(const std::vector<Vec3>& values) {
    std::vector<double> flat;
    flat.reserve(3 * values.size());
    for (const Vec3& v : values) flat.insert(flat.end(), {v.x(), v.y(), v.z()});
    return flat;
}

std::vector<double> volume_ratios(const fem::TissueModel& tissue, const std::vector<Vec3>& x) {
    std::vector<double> ratios;
    ratios.reserve(tissue.tet_count());
    for (std::size_t t = 0; t < tissue.tet_count(); ++t) {
        const Tet& tet = tissue.tet_nodes[t];
        const Vec3 a = x[tet[1]] - x[tet[0]], b = x[tet[2]] - x[tet[0]], c = x[tet[3]] - x[tet[0]];
        ratios.push_back(a.dot(b.cross(c)) / (6.0 * tissue.tet_shape[t].volume));
    }
    return ratios;
}

Result<void> write_coarse(const std::filesystem::path& path, const fem::TissueModel& tissue, const fem::TissueState& state) {
    const std::vector<double> velocity = flatten(state.velocity), ratio = volume_ratios(tissue, state.position);
    const std::array<DataArray, 1> points{{{"velocity", 3, velocity}}}, cells{{{"volume_ratio", 1, ratio}}};
    return write_vtu(path, {state.position, tissue.tet_nodes}, {points, cells});
}

/// The line of an instrument's nodes beyond its port, with what it carries inside and what presses on it: N, N m.
Result<void> write_axis(const std::filesystem::path& path, const InstrumentModel& instrument, const InstrumentState& state, const fem::RodInternalForces& inside) {
    const fem::RodState& rod = state.rod;
    const std::size_t nodes = rod.position.size();
    std::vector<Vec3> pressed(nodes, Vec3::Zero());
    for (const fem::RodPlane& plane : state.planes) {
        const Vec3 force = plane.force * plane.normal + plane.drag;
        pressed[plane.node] += (1.0 - plane.weight) * force;
        pressed[plane.node + 1] += plane.weight * force;
    }
    const std::size_t first = std::min<std::size_t>(fem::first_inserted_node(instrument.rod, rod.insertion), nodes - 1);
    std::vector<double> tension, torque;
    for (std::size_t i = first; i < nodes; ++i) { // of the segment behind a node
        tension.push_back(inside.tension[std::max<std::size_t>(i, 1) - 1]);
        torque.push_back(inside.torque[std::max<std::size_t>(i, 1) - 1]);
    }
    const auto beyond = [&](const std::vector<Vec3>& list) { return std::vector<Vec3>(list.begin() + static_cast<std::ptrdiff_t>(first), list.end()); };
    const std::vector<double> moment = flatten(beyond(inside.moment)), contact = flatten(beyond(pressed));
    const std::array<DataArray, 4> points{{{"tension_n", 1, tension}, {"torque_nm", 1, torque}, {"moment_nm", 3, moment}, {"contact_force_n", 3, contact}}};
    return write_vtp_line(path, beyond(rod.position), points);
}

std::vector<fem::RodInternalForces> find_all_internal_forces(const SceneModel& model, const State& state) {
    std::vector<fem::RodInternalForces> inside;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const InstrumentModel& own = model.instruments[i];
        inside.push_back(fem::find_internal_forces(own.rod, state.instruments[i].rod, own.port, {own.tip_hold.has_value(), own.mass_spring_substeps > 0}));
    }
    for (std::size_t i = 0; i < model.instruments.size(); ++i)
        if (const auto wire = model.instruments[i].wire)
            fem::part_tension(model.instruments[i].rod, state.instruments[i].rod, model.instruments[*wire].rod, state.instruments[*wire].rod, inside[i], inside[*wire]);
    return inside;
}

} // namespace

Result<std::vector<std::string>> write_state(const std::filesystem::path& folder, const SceneModel& model, const State& state,
                                             const std::string& suffix, bool only_moving) {
    std::vector<std::string> files;
    const auto name = [&](std::size_t index, const std::string& body, const char* ending) {
        return files.emplace_back(fmt::format("{:02}_{}{}", index, file_stem(body), suffix) + ending);
    };
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        if (only_moving && !body.moves()) continue;
        const std::string file = name(i, body.name, ".vtp");
        if (auto written = write_vtp(folder / file, {state.bodies[i].surface, body.surface.triangles}); !written) return written.error();
        if (!body.tissue) continue;
        const std::string coarse = name(i, body.name + "_coarse", ".vtu");
        if (auto written = write_coarse(folder / coarse, *body.tissue, state.bodies[i].tissue); !written) return written.error();
    }
    const std::vector<fem::RodInternalForces> inside = find_all_internal_forces(model, state);
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const std::string file = name(model.bodies.size() + i, model.instruments[i].name, ".vtp");
        if (auto written = write_vtp(folder / file, {state.instruments[i].skin, model.instruments[i].skin.triangles}); !written)
            return written.error();
        const std::string axis = name(model.bodies.size() + i, model.instruments[i].name + "_axis", ".vtp");
        if (auto written = write_axis(folder / axis, model.instruments[i], state.instruments[i], inside[i]); !written) return written.error();
    }
    return files;
}

Recorder::Recorder(const SceneModel& model, std::filesystem::path folder, std::uint64_t every)
    : model_(model), folder_(std::move(folder)), every_(every), collection_(folder_ / "states.pvd") {}

Result<void> Recorder::start(const State& state) {
    if (every_ == 0) return {};
    std::error_code failed;
    std::filesystem::create_directories(folder_, failed);
    if (failed) return Error{.code = ErrorCode::CannotWrite, .message = "cannot be made: " + failed.message(), .file = folder_.string()};
    for (std::size_t i = 0; i < model_.bodies.size(); ++i) {
        if (model_.bodies[i].moves()) continue;
        const std::string file = fmt::format("{:02}_{}.vtp", i, file_stem(model_.bodies[i].name));
        if (auto written = write_vtp(folder_ / file, model_.bodies[i].surface); !written) return written;
        still_.push_back(file);
    }
    return add(state);
}

Result<void> Recorder::after_step(const State& state) {
    if (every_ == 0 || state.step % every_ != 0) return {};
    return add(state);
}

Result<void> Recorder::add(const State& state) {
    const auto files = write_state(folder_, model_, state, fmt::format("_{:06}", state.step), true);
    if (!files) return files.error();
    unsigned part = 0;
    for (const std::string& file : still_) collection_.add(state.time, file, part++);
    for (const std::string& file : *files) collection_.add(state.time, file, part++);
    last_step_ = state.step;
    return count_++ % kCollectionEvery == 0 ? collection_.write() : Result<void>();
}

Result<void> Recorder::finish(const State& state) {
    if (every_ == 0) return {};
    if (state.step != last_step_)
        if (Result<void> added = add(state); !added) return added;
    return collection_.write();
}

} // namespace trocar::engine
