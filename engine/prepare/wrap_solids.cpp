#include "engine/prepare/wrap_solids.hpp"

#include "engine/prepare/cache.hpp"
#include "engine/prepare/foreign_spheres.hpp"
#include "engine/prepare/payload.hpp"
#include "spheretree/build/wrapped_tree.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

constexpr std::string_view kKind = "wrapped";

Result<spheretree::SphereTree> make_tree(const TriMesh& surface, const spheretree::WrappedOptions& options, BodySummary& summary) {
    const auto tell = [&](bool coarser) {
        if (coarser) summary.notes.push_back(spheretree::describe_coarser(surface));
    };
    ContentHash hash;
    hash.feed(maker_version());
    hash.feed(surface);
    hash.feed(spheretree::builder_name(options.builder));
    const std::string key = hash.hex();
    spheretree::SphereTree tree;
    if (auto bytes = read_cache(kKind, key)) {
        Payload payload(std::move(*bytes));
        std::vector<double> coarser; // one number
        if (payload.get_tree(tree) && payload.get(coarser) && coarser.size() == 1) {
            tell(coarser[0] != 0.0);
            return tree;
        }
    }
    Result<spheretree::WrappedTree> built = spheretree::build_wrapped_tree(surface, options);
    if (!built.ok()) return built.error();
    Payload payload;
    payload.put_tree(built->tree);
    payload.put(std::vector<double>{built->coarser ? 1.0 : 0.0});
    tell(built->coarser);
    write_cache(kKind, key, payload.bytes());
    return std::move(built->tree);
}

/// By the medial axis where the surface has an inside.
Result<spheretree::SphereTree> wrap(const TriMesh& surface, BodySummary& summary) {
    const Result<void> medial = spheretree::check_surface_for(surface, spheretree::Builder::Medial);
    if (!medial.ok()) summary.notes.push_back("sphere tree of shell balls: " + medial.error().message);
    return make_tree(surface, {.builder = medial.ok() ? spheretree::Builder::Medial : spheretree::Builder::Shell}, summary);
}

/// The body's own file, in its frame: the unit of the surface's file, or the scene's.
Result<spheretree::SphereTree> read_tree(const Scene& scene, std::size_t index, const TriMesh& surface, PreparedScene& prepared) {
    const SceneBody& body = scene.bodies[index];
    const double unit = body.surface.source == SurfaceSource::File ? body.surface.unit : scene.units.length;
    Result<spheretree::AdoptedTree> adopted = load_spheres(body.spheres, {body.scale * unit, body.translate}, surface);
    if (!adopted.ok()) return adopted.error();
    std::string said = describe_coverage(body.spheres, *adopted);
    if (!adopted->coverage.is_whole()) prepared.notices.push_back(fmt::format("bodies.{}: {}", body.name, said));
    prepared.bodies[index].notes.push_back(std::move(said));
    return std::move(adopted->tree);
}

} // namespace

Result<void> wrap_solids(const Scene& scene, PreparedScene& prepared) {
    SceneModel& model = prepared.model;
    const auto solids = std::count_if(model.bodies.begin(), model.bodies.end(), [](const BodyModel& body) { return !body.hollow; });
    const bool all = model.contact.sphere_trees != SphereTrees::Covering && model.effects.coarse_contact && solids >= 2;
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        BodyModel& body = model.bodies[i];
        const bool from_file = !scene.bodies[i].spheres.empty();
        if (!(all || from_file) || body.hollow || body.surface.triangles.empty()) continue;
        Result<spheretree::SphereTree> tree = from_file ? read_tree(scene, i, body.surface, prepared) : wrap(body.surface, prepared.bodies[i]);
        if (!tree.ok())
            return from_file ? scene_error(scene, "bodies." + body.name + ".spheres", tree.error().to_string(), tree.error().code)
                             : scene_error(scene, "bodies." + body.name + ".surface",
                                           "no wrapped sphere tree (\"sphere_trees\"): " + tree.error().message, tree.error().code);
        body.covering = {};
        body.covering.tree = std::move(*tree);
        prepared.bodies[i].tree_spheres = body.covering.tree.sphere_count();
        if (!body.links) continue;
        const fem::RigidLinks& links = *body.links;
        body.wrapped = spheretree::make_deforming_tree(
            body.covering.tree, body.surface,
            {links.frame_nodes, links.frame_rest, links.vertex_frame, links.vertex_projection, links.vertex_blend, links.node_rest, links.affine_nodes,
             links.affine_weight});
    }
    return {};
}

} // namespace trocar::engine
