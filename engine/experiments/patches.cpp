#include "engine/experiments/patches.hpp"

#include "engine/prepare/body_pairs.hpp"
#include "engine/step/solid/solid_stage.hpp"

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// Edge of a patch where the scene does not say: this many mean edges of the surface, so that a contact's own spread does
/// not decide.
constexpr double kEdgesPerPatch = 4.0;
constexpr double kMostCells = 60000.0; // along an axis

double mean_edge(const TriMesh& mesh) {
    double sum = 0.0;
    for (const Triangle& t : mesh.triangles)
        for (std::size_t k = 0; k < 3; ++k) sum += (mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm();
    return mesh.triangles.empty() ? 1.0 : sum / (3.0 * static_cast<double>(mesh.triangles.size()));
}

/// Sorts, and keeps the deepest of each patch.
void settle(PatchContacts& contacts) {
    std::sort(contacts.begin(), contacts.end(),
              [](const PatchContact& a, const PatchContact& b) { return a.patch != b.patch ? a.patch < b.patch : a.depth > b.depth; });
    const auto same = [](const PatchContact& a, const PatchContact& b) { return a.patch == b.patch; };
    contacts.erase(std::unique(contacts.begin(), contacts.end(), same), contacts.end());
}

} // namespace

PatchFinder::PatchFinder(const SceneModel& model, const CostSpec& cost)
    : model_(model), tolerance_(cost.tolerance > 0.0 ? cost.tolerance : model.contact.margin), grids_(model.bodies.size()),
      inside_(model.bodies.size()) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const BodyModel& body = model.bodies[i];
        Grid& grid = grids_[i];
        const Box3 bounds = body.surface.bounds();
        grid.size = cost.patch > 0.0 ? cost.patch : kEdgesPerPatch * mean_edge(body.surface);
        grid.size = std::max(grid.size, bounds.longest_edge() / kMostCells);
        grid.origin = bounds.empty() ? Vec3(Vec3::Zero()) : bounds.lo;
        for (const Triangle& t : body.surface.triangles)
            grid.cell_of_triangle.push_back(
                cell_of(i, (body.surface.vertices[t[0]] + body.surface.vertices[t[1]] + body.surface.vertices[t[2]]) / 3.0));
        if (!body.hollow) grid.cells_of_sphere.resize(body.covering.tree.sphere_count());
    }
    for (std::size_t i = 0; i < model.bodies.size(); ++i)
        for (std::size_t j = 0; j < model.bodies.size(); ++j)
            if (i != j && inside_[i].tree().empty() && are_solid_pair(model, i, j)) inside_[i] = InsideTest(model.bodies[i].surface);
}

std::array<std::uint16_t, 3> PatchFinder::cell_of(std::size_t body, const Vec3& rest_point) const noexcept {
    std::array<std::uint16_t, 3> cell{};
    for (int axis = 0; axis < 3; ++axis) {
        const double at = std::floor((rest_point[axis] - grids_[body].origin[axis]) / grids_[body].size);
        cell[static_cast<std::size_t>(axis)] = static_cast<std::uint16_t>(std::clamp(at, 0.0, 65535.0));
    }
    return cell;
}

const std::vector<std::array<std::uint16_t, 3>>& PatchFinder::cells_of_sphere(std::size_t body, Index sphere) {
    auto& cells = grids_[body].cells_of_sphere[sphere];
    if (!cells.empty()) return cells;
    for (const Index triangle : model_.bodies[body].covering.tree.items_of(sphere))
        cells.push_back(grids_[body].cell_of_triangle[triangle]);
    std::sort(cells.begin(), cells.end());
    cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
    return cells;
}

void PatchFinder::find_near_one_way(std::size_t body, std::size_t other, const State& state, PatchContacts& found) const {
    const BodyModel& own = model_.bodies[body];
    const InsideTest& against = inside_[other];
    Box3 reach = against.tree().bounds();
    reach.inflate(tolerance_);
    const std::vector<Vec3>& surface = state.bodies[body].surface;
    for (Index v = 0; v < surface.size(); ++v) {
        if (!reach.contains(surface[v]) || own.topology.vertex_owner[v] == kNoIndex) continue;
        auto hit = against.tree().closest(surface[v], tolerance_);
        const bool inside = against.inside(surface[v]);
        if (!hit && inside) hit = against.tree().closest(surface[v]);
        if (!hit) continue;
        const double depth = tolerance_ - (inside ? -hit->distance : hit->distance);
        const Thing a = Thing::body(body), b = Thing::body(other);
        found.push_back({{a, b, grids_[body].cell_of_triangle[own.topology.vertex_owner[v]]}, depth});
        found.push_back({{b, a, grids_[other].cell_of_triangle[hit->triangle]}, depth});
    }
}

PatchContacts PatchFinder::find_near(const State& state) {
    for (std::size_t i = 0; i < inside_.size(); ++i)
        if (!inside_[i].tree().empty() && model_.bodies[i].moves()) inside_[i].refit(state.bodies[i].surface);
    PatchContacts found;
    for (std::size_t i = 0; i < model_.bodies.size(); ++i)
        for (std::size_t j = 0; j < model_.bodies.size(); ++j)
            if (i != j && are_solid_pair(model_, i, j)) find_near_one_way(i, j, state, found);
    settle(found);
    return found;
}

void PatchFinder::add_side(const Contact& contact, bool is_a, PatchContacts& found) {
    const auto [own, other] = is_a ? std::pair(contact.a, contact.b) : std::pair(contact.b, contact.a);
    const Index sphere = is_a ? contact.feature_a[0] : contact.feature_b[0];
    if (sphere == kNoIndex) return;
    const bool assumed = contact.origin == ContactOrigin::AssumedSpheres;
    const double gap = assumed ? std::max(std::min(contact.gap, 0.0), -model_.contact.assumed_depth) : contact.gap;
    if (gap > tolerance_) return;
    for (const auto& cell : cells_of_sphere(own.index(), sphere))
        found.push_back({{own, other, cell}, tolerance_ - gap});
}

PatchContacts PatchFinder::find_answer(const Simulator& simulator) {
    PatchContacts found;
    for (const Contact& contact : simulator.sphere_contacts()) {
        if (!is_between_bodies(contact)) continue; // instruments: their presses
        add_side(contact, true, found);
        add_side(contact, false, found);
    }
    for (const Contact& contact : simulator.contacts()) {
        if (contact.a.is_body() || contact.feature_b[0] == kNoIndex) continue;
        const std::vector<Vec3>& rest = model_.bodies[contact.b.index()].surface.vertices;
        Vec3 at = Vec3::Zero();
        for (std::size_t k = 0; k < 3; ++k)
            if (contact.feature_b[k] != kNoIndex) at += contact.bary_b[k] * rest[contact.feature_b[k]];
        found.push_back({{contact.b, contact.a, cell_of(contact.b.index(), at)}, std::max(-contact.gap, 0.0)});
    }
    settle(found);
    return found;
}

PatchDifference& PatchDifference::operator+=(const PatchDifference& other) noexcept {
    reference += other.reference;
    missed += other.missed;
    unseen += other.unseen;
    spurious += other.spurious;
    depth_error_sq += other.depth_error_sq;
    compared += other.compared;
    return *this;
}

const PatchContact* find_patch(const PatchContacts& contacts, const PatchId& patch) noexcept {
    const auto at = std::lower_bound(contacts.begin(), contacts.end(), patch, [](const PatchContact& c, const PatchId& p) { return c.patch < p; });
    return at != contacts.end() && at->patch == patch ? &*at : nullptr;
}

std::uint64_t count_unseen(const PatchContacts& reference, const PatchContacts& answer, const PatchContacts& near) noexcept {
    return static_cast<std::uint64_t>(std::count_if(reference.begin(), reference.end(), [&](const PatchContact& c) {
        return c.patch.other.is_body() && !find_patch(answer, c.patch) && find_patch(near, c.patch);
    }));
}

PatchDifference compare_patches(const PatchContacts& reference, const PatchContacts& answer) noexcept {
    PatchDifference difference;
    difference.reference = reference.size();
    const auto add = [&](double error) {
        difference.depth_error_sq += error * error;
        ++difference.compared;
    };
    auto a = answer.begin();
    for (const PatchContact& r : reference) {
        for (; a != answer.end() && a->patch < r.patch; ++a) {
            ++difference.spurious;
            add(a->depth);
        }
        if (a != answer.end() && a->patch == r.patch) {
            add(a->depth - r.depth);
            ++a;
        } else {
            ++difference.missed;
            add(r.depth);
        }
    }
    for (; a != answer.end(); ++a) {
        ++difference.spurious;
        add(a->depth);
    }
    return difference;
}

} // namespace trocar::engine
