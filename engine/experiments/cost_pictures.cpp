#include "engine/experiments/cost_pictures.hpp"

#include "assets/anatomy/shapes.hpp"
#include "engine/report/picture_scene.hpp"
#include "engine/step/solid/solid_trees.hpp"

#include <algorithm>
#include <tuple>

namespace trocar::engine {

namespace {

const Vec3 kTestedColour(0.84, 0.10, 0.12), kAssumedColour(0.93, 0.45, 0.30);
constexpr double kTestedOpacity = 0.75, kAssumedOpacity = 0.30;
constexpr double kMist = 0.55; // of what opacity bodies have in other pictures
/// Spheres of either kind that are drawn, the largest first: beyond it they hide one another.
constexpr std::size_t kMostSpheres = 800;
constexpr std::size_t kFineSpheres = 200; // up to so many are drawn with more triangles

/// Sphere of a contact's side; null where it has none that this step tested.
const spheretree::Sphere* find_sphere(const Simulator& simulator, Thing thing, Index sphere) {
    const SceneModel& model = simulator.model();
    if (sphere == kNoIndex) return nullptr;
    if (!thing.is_body()) {
        const auto& spheres = simulator.raw_state().instruments[thing.index()].chain.spheres;
        return sphere < spheres.size() ? &spheres[sphere] : nullptr;
    }
    return model.bodies[thing.index()].hollow ? nullptr : simulator.find_sphere(thing.index(), sphere); // free space of a lumen is no contact
}

TriMesh mesh_of(const std::vector<spheretree::Sphere>& spheres) {
    const TriMesh unit = anatomy::make_icosphere(Vec3::Zero(), 1.0, spheres.size() <= kFineSpheres ? 2 : 1);
    TriMesh mesh;
    for (const spheretree::Sphere& s : spheres) {
        const auto first = static_cast<Index>(mesh.vertices.size());
        for (const Vec3& v : unit.vertices) mesh.vertices.push_back(s.centre + s.radius * v);
        for (const Triangle& t : unit.triangles) mesh.triangles.push_back({first + t[0], first + t[1], first + t[2]});
    }
    return mesh;
}

void keep_largest(std::vector<spheretree::Sphere>& spheres) {
    std::stable_sort(spheres.begin(), spheres.end(), [](const auto& a, const auto& b) { return a.radius > b.radius; });
    if (spheres.size() > kMostSpheres) spheres.resize(kMostSpheres);
}

} // namespace

ContactSpheres find_contact_spheres(const Simulator& simulator) {
    using Key = std::tuple<bool, Thing, Index>;
    std::vector<Key> keys;
    ContactSpheres found;
    for (const Contact& contact : simulator.sphere_contacts()) {
        const bool assumed = contact.origin == ContactOrigin::AssumedSpheres;
        ++(assumed ? found.assumed_pairs : found.tested_pairs);
        keys.emplace_back(assumed, contact.a, contact.feature_a[0]);
        keys.emplace_back(assumed, contact.b, contact.feature_b[0]);
    }
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    for (const auto& [assumed, body, sphere] : keys)
        if (const spheretree::Sphere* s = find_sphere(simulator, body, sphere); s != nullptr && s->radius >= 0.0)
            (assumed ? found.assumed : found.tested).push_back(*s);
    return found;
}

CostPhotographer::CostPhotographer(const PreparedScene& prepared, unsigned width, unsigned height)
    : prepared_(prepared), width_(width), height_(height) {}

void CostPhotographer::take(const std::string& name, Simulator& simulator) {
    if (!notice_.empty()) return;
    const auto give_up = [this](const Error& error) { notice_ = "no pictures: " + error.to_string(); };
    if (!renderer_) {
        auto renderer = Renderer::make();
        if (!renderer) return give_up(renderer.error());
        renderer_ = std::move(*renderer);
    }
    ContactSpheres spheres = find_contact_spheres(simulator);
    keep_largest(spheres.tested);
    keep_largest(spheres.assumed);
    View view = make_view(PictureView::Anatomy, {prepared_, simulator.state(), {}, false}, width_, height_);
    for (RenderSurface& surface : view.scene.surfaces) surface.opacity = kMist * std::min(surface.opacity, 0.5);
    const TriMesh tested = mesh_of(spheres.tested), assumed = mesh_of(spheres.assumed);
    if (!tested.triangles.empty())
        view.scene.surfaces.push_back(
            {.vertices = tested.vertices, .triangles = tested.triangles, .colour = kTestedColour, .opacity = kTestedOpacity});
    if (!assumed.triangles.empty())
        view.scene.surfaces.push_back(
            {.vertices = assumed.vertices, .triangles = assumed.triangles, .colour = kAssumedColour, .opacity = kAssumedOpacity});
    if (!camera_) camera_ = view.camera;
    const auto picture = renderer_->shaded(view.scene, *camera_, static_cast<int>(width_), static_cast<int>(height_));
    if (!picture) return give_up(picture.error());
    const auto bytes = encode_png(*picture);
    if (!bytes) return give_up(bytes.error());
    pictures_.push_back({name, simulator.state().time, spheres.tested_pairs, spheres.assumed_pairs, {bytes->begin(), bytes->end()}});
}

} // namespace trocar::engine
