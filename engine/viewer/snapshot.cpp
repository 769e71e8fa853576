#include "engine/effects/registry.hpp"
#include "engine/viewer/snapshot.hpp"

#include "engine/step/solid/solid_trees.hpp"
#include "fem/rod/rod_frames.hpp"

#include <algorithm>

namespace trocar::engine::viewer {

namespace {

Point to_point(const Vec3& v) noexcept { return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())}; }

void copy(const std::vector<Vec3>& from, std::vector<Point>& to) noexcept {
    for (std::size_t k = 0; k < from.size(); ++k) to[k] = to_point(from[k]);
}

void copy_surfaces(const State& state, Snapshot& snapshot, bool all) noexcept {
    std::size_t part = 0;
    for (const BodyState& body : state.bodies) {
        if (all || snapshot.moves[part]) copy(body.surface, snapshot.surfaces[part]);
        ++part;
    }
    for (const InstrumentState& instrument : state.instruments) copy(instrument.skin, snapshot.surfaces[part++]);
}

void list_contacts(const Session& session, Snapshot& snapshot) {
    snapshot.contacts.clear();
    const std::span<const Contact> contacts = session.simulator().contacts();
    const std::size_t shown = std::min(contacts.size(), kMostDots);
    for (const Contact& contact : contacts.first(shown))
        snapshot.contacts.push_back({to_point(contact.point), static_cast<float>(-contact.gap)});
    snapshot.contacts_left_out = contacts.size() - shown;
}

void add_sphere(const spheretree::Sphere& sphere, SphereKind kind, Snapshot& snapshot) {
    if (!(sphere.radius > 0.0)) return; // nothing of it is inserted
    if (snapshot.spheres.size() < kMostSpheres)
        snapshot.spheres.push_back({to_point(sphere.centre), static_cast<float>(sphere.radius), kind});
    else
        ++snapshot.spheres_left_out;
}

/// The level of a tree at which a descent that reached `level` stopped.
std::pair<Index, Index> spheres_of_level(const spheretree::SphereTree& tree, int level) {
    if (tree.level_count() == 0) return {0, 0};
    const auto clamped = static_cast<std::size_t>(std::clamp(level, 0, tree.leaf_depth()));
    return {tree.level_begin[clamped], tree.level_begin[clamped + 1]};
}

SphereKind kind_of_group(const spheretree::ChainTree& chain, Index sphere, std::span<const spheretree::LinkStatus> status) {
    SphereKind kind = SphereKind::Free;
    for (const Index link : chain.tree.items_of(sphere)) {
        if (link >= status.size()) continue;
        if (status[link] == spheretree::LinkStatus::Open) return SphereKind::Assumed;
        if (status[link] == spheretree::LinkStatus::Contact) kind = SphereKind::Contact;
    }
    return kind;
}

void list_spheres(const Session& session, Snapshot& snapshot) {
    const SceneModel& model = session.model();
    const Simulator& simulator = session.simulator();
    if (!session.permits(effects::coarse_contact) || !session.status().effects[index_of(effects::coarse_contact)] || !session.status().stepped) return;
    const int level = simulator.report().level_reached;
    for (std::size_t i = 0; i < model.instruments.size(); ++i) {
        const spheretree::ChainTree& chain = model.instruments[i].chain;
        const auto status = simulator.link_status(i);
        const auto [begin, end] = spheres_of_level(chain.tree, level);
        for (Index sphere = begin; sphere < end; ++sphere)
            add_sphere(simulator.raw_state().instruments[i].chain.spheres[sphere], kind_of_group(chain, sphere, status), snapshot);
    }
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        if (model.bodies[i].hollow || !model.instruments.empty()) continue; // solids meet solids only
        const auto [begin, end] = spheres_of_level(model.bodies[i].covering.tree, level);
        for (Index sphere = begin; sphere < end; ++sphere)
            if (const spheretree::Sphere* known = simulator.find_sphere(i, sphere)) add_sphere(*known, SphereKind::Free, snapshot);
    }
}

void list_rod(const Session& session, Snapshot& snapshot) {
    snapshot.rod.clear();
    if (!session.has_instrument()) return;
    const fem::RodState& rod = session.simulator().raw_state().instruments[kLeadInstrument].rod;
    const Index first = fem::first_inserted_node(session.model().instruments[kLeadInstrument].rod, rod.insertion);
    for (std::size_t k = first; k < rod.position.size(); ++k) snapshot.rod.push_back(to_point(rod.position[k]));
}

void list_tips(const Session& session, Snapshot& snapshot) noexcept {
    for (std::size_t i = 0; i < snapshot.tips.size(); ++i) {
        const InstrumentModel& model = session.model().instruments[i];
        const fem::RodState& rod = session.simulator().raw_state().instruments[i].rod;
        const std::size_t last = rod.position.size() - 1;
        fem::carry_material_axis(model.rod, rod, model.port, std::span(snapshot.axes).first(rod.position.size()));
        snapshot.tips[i] = {rod.position[last], fem::rod_tangent(rod.position, last, model.port.direction), snapshot.axes[last]};
    }
}

} // namespace

void prepare_snapshot(Session& session, Snapshot& snapshot) {
    const State& state = session.simulator().state();
    snapshot.surfaces.clear();
    snapshot.moves.clear();
    for (std::size_t i = 0; i < state.bodies.size(); ++i) {
        snapshot.surfaces.emplace_back(state.bodies[i].surface.size());
        snapshot.moves.push_back(session.model().bodies[i].moves());
    }
    for (const InstrumentState& instrument : state.instruments) {
        snapshot.surfaces.emplace_back(instrument.skin.size());
        snapshot.moves.push_back(true);
        snapshot.rod.reserve(instrument.rod.position.size());
        snapshot.axes.resize(std::max(snapshot.axes.size(), instrument.rod.position.size()));
    }
    snapshot.tips.resize(state.instruments.size());
    snapshot.contacts.reserve(kMostDots);
    snapshot.spheres.reserve(kMostSpheres);
    copy_surfaces(state, snapshot, true);
    list_tips(session, snapshot);
}

void fill_snapshot(Session& session, bool spheres, Snapshot& snapshot) {
    copy_surfaces(session.simulator().state(), snapshot, false);
    list_contacts(session, snapshot);
    snapshot.spheres.clear();
    snapshot.spheres_left_out = 0;
    if (spheres) list_spheres(session, snapshot);
    list_rod(session, snapshot);
    list_tips(session, snapshot);
    snapshot.status = session.status();
    snapshot.report = session.simulator().report();
    snapshot.contrast = effects::measure_contrast(session.model(), session.simulator().raw_state());
    snapshot.assumed_error_m = session.assumed_error_m();
    snapshot.run = session.run();
    snapshot.work_enough = session.work_enough();
    if (const Recording* recording = session.recording().get()) {
        snapshot.recorded_steps = recording->steps();
        snapshot.repeatable = recording->repeatable();
    }
}

} // namespace trocar::engine::viewer
