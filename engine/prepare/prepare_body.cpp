#include "engine/prepare/node_sets.hpp"
#include "engine/prepare/prepare_body.hpp"
#include "base/simplify.hpp"
#include "base/topology.hpp"
#include "engine/prepare/pulse.hpp"

#include "engine/io/read_tets.hpp"
#include "engine/io/weld.hpp"
#include "engine/prepare/coarse.hpp"
#include "engine/prepare/fibre_field.hpp"
#include "engine/prepare/free_space.hpp"
#include "engine/prepare/geometry_cache.hpp"
#include "engine/prepare/sharp_edges.hpp"
#include "engine/prepare/tissue_regions.hpp"
#include "engine/prepare/wall_ties.hpp"
#include "engine/scene/scene_size.hpp"
#include "fem/mesh/lattice.hpp"
#include "fem/mesh/mesh_parts.hpp"
#include "fem/mesh/wall_mesh.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

Motion motion_of(BodyKind kind) {
    switch (kind) {
    case BodyKind::Deformable:
        return Motion::Deformable;
    case BodyKind::Kinematic:
        return Motion::Kinematic;
    case BodyKind::Static:
        break;
    }
    return Motion::Static;
}

/// What preparation says of a body: in its summary, and to whoever runs the scene.
struct Remarks {
    std::vector<std::string>& notes;
    std::vector<std::string>& notices;
};

/// A body's mesh is one piece. Parts apart from the largest one are left out: a few tetrahedra with a notice, more of them not unasked.
/// share  [-] of the mesh's volume
Result<void> check_loose_parts(const SceneBody& body, std::size_t tets, double share, const Remarks& remarks) {
    if (tets == 0) return {};
    if (share > body.coarse.may_drop)
        return Error{ErrorCode::BadMesh,
                     fmt::format("parts of the coarse mesh apart from its largest one, {} tetrahedra with {:.3g} % of its volume, would be "
                                 "left out: a body is one piece; expected at most {:.3g} %; what helps: a body of its own for each part, "
                                 "\"repair\": [\"keep_largest\"], more \"surface_triangles\" than {} where a thin neck came apart, or "
                                 "\"may_drop\": {:.3g}",
                                 tets, 100.0 * share, 100.0 * body.coarse.may_drop, body.coarse.surface_triangles,
                                 std::min(1.0, std::ceil(100.0 * share) / 100.0))};
    const std::string what = fmt::format("{} tetrahedra of the coarse mesh, {:.3g} % of its volume, were left out: parts apart from the "
                                         "largest one, to which their surface is fixed now",
                                         tets, 100.0 * share);
    remarks.notices.push_back(fmt::format("bodies.{}: {}", body.name, what));
    remarks.notes.push_back(what);
    return {};
}

double volume_of(const TetMesh& mesh) {
    double six = 0.0;
    for (const Tet& t : mesh.tets) {
        const Vec3& o = mesh.vertices[t[0]];
        six += (mesh.vertices[t[1]] - o).dot((mesh.vertices[t[2]] - o).cross(mesh.vertices[t[3]] - o));
    }
    return six / 6.0;
}

Result<TetMesh> make_lattice(const SceneBody& body, const TriMesh& surface, const Remarks& remarks) {
    fem::LatticeOptions options;
    options.cell = fem::find_lattice_cell(surface, body.coarse.surface_triangles);
    Result<fem::LatticeMesh> lattice = fem::make_lattice_mesh(surface, options);
    if (!lattice.ok()) {
        Error error = lattice.error();
        if (error.code == ErrorCode::BadMesh)
            error.message += fmt::format("; what helps: more \"surface_triangles\" than {} (cells become smaller), \"repair\": "
                                         "[\"drop_inner_shells\"] for a surface that is a thin shell around a hollow, or \"mesher\": \"tetgen\"",
                                         body.coarse.surface_triangles);
        return error;
    }
    remarks.notes.push_back(fmt::format("coarse mesh by lattice of {:.3g} mm: {:.4f} of the surface's volume, {:.0f} % of its boundary nodes "
                                        "on the surface, the farthest {:.3g} mm off",
                                        1e3 * options.cell, lattice->volume_ratio, 100.0 * lattice->fitted_share, 1e3 * lattice->farthest));
    const auto loose = static_cast<double>(lattice->island_tets), kept = static_cast<double>(lattice->tets.tets.size());
    const Result<void> whole = check_loose_parts(body, lattice->island_tets, loose / (loose + kept), remarks); // congruent before they are fitted
    if (!whole.ok()) return whole.error();
    return std::move(lattice->tets);
}

bool is_wall(const SceneBody& body) noexcept { return body.coarse.file.empty() && body.coarse.mesher == CoarseMesher::Wall; }

/// A wall bends, whatever its law.
bool is_in_prisms(const SceneBody& body) noexcept {
    const bool chosen = body.material.elements == fem::TetElements::Automatic;
    return body.material.elements == fem::TetElements::Prisms || (is_wall(body) && chosen && body.material.law != fem::MaterialLaw::StVK);
}

/// Around the lumen's surface, simplified where it has more triangles than asked for; to other numbers where the wall of one folds over.
Result<TetMesh> make_wall(const SceneBody& body, const TriMesh& surface, const Remarks& remarks) {
    constexpr double kShares[] = {1.0, 1.15, 0.87, 1.3, 0.75}; // of the triangles asked for, in this order
    std::string folds;
    for (const double share : kShares) {
        const auto wanted = static_cast<std::size_t>(share * static_cast<double>(body.coarse.surface_triangles));
        TriMesh simple;
        if (surface.triangles.size() > wanted) {
            Result<TriMesh> made = simplify(surface, wanted);
            if (!made.ok()) return made.error();
            simple = std::move(*made);
        }
        const TriMesh& inner = simple.triangles.empty() ? surface : simple;
        Result<fem::WallMesh> wall = fem::make_wall_mesh(inner, {.thickness = body.coarse.thickness, .layers = body.coarse.layers});
        if (!wall.ok()) return wall.error();
        const Vec3& at = inner.vertices[wall->thinnest];
        const std::string place = fmt::format("({:.4g}, {:.4g}, {:.4g}) mm", 1e3 * at.x(), 1e3 * at.y(), 1e3 * at.z());
        if (wall->folds) {
            if (folds.empty()) folds = place;
            continue;
        }
        remarks.notes.push_back(fmt::format("a wall of {:.3g} mm in {} layer{} around {} triangles", 1e3 * body.coarse.thickness, body.coarse.layers,
                                            body.coarse.layers == 1 ? "" : "s", inner.triangles.size()));
        if (wall->thinned > 0)
            remarks.notes.push_back(fmt::format("thinner at {} of its {} places, where it would fold over: {:.2g} of its thickness at {}", wall->thinned,
                                                inner.vertices.size(), wall->least_share, place));
        return std::move(wall->tets);
    }
    return Error{ErrorCode::BadMesh, fmt::format("a wall of {:.3g} mm folds over at {}, even where {:.0f} % of it is left; expected other \"surface_triangles\" than {}, a "
                                                 "surface that is smoother there, or a thinner wall",
                                                 1e3 * body.coarse.thickness, folds, 100.0 * fem::kLeastWall, body.coarse.surface_triangles)};
}

/// Of a mesh from a file: tetrahedra that lie in one another, or several on one side of a face.
Result<void> check_faces(const TetMesh& mesh) {
    std::vector<std::pair<std::array<Index, 3>, Index>> faces;
    for (Index tet = 0; tet < mesh.tets.size(); ++tet)
        for (std::size_t apex = 0; apex < 4; ++apex) {
            const Tet& t = mesh.tets[tet];
            std::array<Index, 3> face{t[(apex + 1) % 4], t[(apex + 2) % 4], t[(apex + 3) % 4]};
            std::sort(face.begin(), face.end());
            faces.emplace_back(face, tet);
        }
    std::sort(faces.begin(), faces.end());
    for (std::size_t k = 2; k < faces.size(); ++k) {
        const auto& face = faces[k].first;
        if (face == faces[k - 2].first)
            return Error{ErrorCode::BadMesh, fmt::format("tetrahedra {}, {} and {} share the face of nodes {}, {} and {}; expected at most two at a face", faces[k - 2].second,
                                                         faces[k - 1].second, faces[k].second, face[0], face[1], face[2])};
    }
    return {};
}

bool has_inner_node(const TetMesh& mesh) {
    std::vector<bool> outside(mesh.vertices.size(), false);
    for (const Triangle& face : boundary_surface(mesh).triangles)
        for (const Index node : face) outside[node] = true;
    return std::find(outside.begin(), outside.end(), false) != outside.end();
}

/// beside  of a mesh from a file: its cell arrays, where regions have tissues of their own
Result<TetMesh> make_coarse(const SceneBody& body, const TriMesh& surface, BesideTets& beside, const Remarks& remarks) {
    if (body.coarse.file.empty() && body.coarse.mesher == CoarseMesher::Lattice) return make_lattice(body, surface, remarks);
    if (body.coarse.file.empty() && body.coarse.mesher == CoarseMesher::Wall) return make_wall(body, surface, remarks);
    if (body.coarse.file.empty()) {
        CoarseOptions options;
        options.surface_triangles = body.coarse.surface_triangles;
        options.tetgen.max_volume = body.coarse.max_volume;
        Result<CoarseMesh> coarse = make_coarse_mesh(surface, options);
        if (!coarse.ok()) return coarse.error();
        remarks.notes.push_back(fmt::format("coarse mesh by TetGen from {} surface triangles{}", coarse->surface_triangles,
                                            coarse->from_cache ? ", from the cache" : ""));
        const double whole = volume_of(coarse->tets);
        if (const std::size_t loose = fem::drop_loose_parts(coarse->tets); loose > 0) {
            const Result<void> checked = check_loose_parts(body, loose, 1.0 - volume_of(coarse->tets) / whole, remarks);
            if (!checked.ok()) return checked.error();
            drop_unused_nodes(coarse->tets);
        }
        return std::move(coarse->tets);
    }
    beside.with_arrays = !body.coarse.regions.empty() || !body.coarse.fibre1_array.empty() || !body.coarse.fibre2_array.empty();
    Result<TetMesh> mesh = read_tets(body.coarse.file, &beside);
    if (!mesh.ok()) return mesh;
    if (std::string what = describe_split(beside.split); !what.empty()) remarks.notes.push_back("coarse mesh: " + what);
    for (Vec3& v : mesh->vertices) v = body.scale * (body.coarse.unit * v) + body.translate;
    if (const std::size_t dropped = drop_unreferenced_nodes(*mesh, &beside.place_of_node); dropped > 0)
        remarks.notes.push_back(fmt::format("{} nodes of the coarse mesh belong to no tetrahedron and were dropped", dropped));
    return mesh;
}

fem::Material effective_material(const Scene& scene, const SceneBody& body) {
    fem::Material material = body.material;
    if (is_in_prisms(body)) material.elements = fem::TetElements::Prisms;
    if (!scene.effects.damping) material.viscosity = material.mass_damping = 0.0;
    return material;
}

/// A coarse mesh from a file may be of something else, or in another unit: then it is many times larger or smaller than the surface, or
/// parts of the surface would be embedded in it from afar.
constexpr double kMostMeshRatio = 5.0; // of the boxes' longest edges, either way
constexpr double kLongestLink = 0.5;   // of the surface's longest edge: as far off as half of the body

/// Nothing, or an error that says what does not fit.
std::string find_misfit(const TetMesh& coarse, const TriMesh& surface, double longest_link) {
    Box3 inner, outer;
    for (const Vec3& x : coarse.vertices) inner.add(x);
    for (const Vec3& x : surface.vertices) outer.add(x);
    const double ratio = inner.longest_edge() / outer.longest_edge();
    const std::string sizes =
        fmt::format("the coarse mesh is {:.3g} mm long and the surface {:.3g} mm", 1e3 * inner.longest_edge(), 1e3 * outer.longest_edge());
    if (!(ratio <= kMostMeshRatio && ratio >= 1.0 / kMostMeshRatio))
        return sizes + "; expected one of about its size, perhaps by another \"unit\" of one of the two";
    if (!(longest_link <= kLongestLink * outer.longest_edge()))
        return fmt::format(
            "{}, and a vertex of the surface is {:.3g} mm from the nearest tetrahedron; expected a mesh of the same shape at the same "
            "place",
            sizes, 1e3 * longest_link);
    return {};
}

/// The next body's share of the scene's limit: the limit less what other bodies have or announce.
struct SceneAllowance {
    std::size_t triangles = kMostTriangles, tets = kMostTets;

    SceneAllowance(const Scene& scene, const PreparedScene& prepared) {
        for (const BodySummary& made : prepared.bodies) {
            take(triangles, made.triangles);
            take(tets, made.coarse_tets);
        }
        for (std::size_t i = prepared.bodies.size() + 1; i < scene.bodies.size(); ++i)
            if (scene.bodies[i].surface.source == SurfaceSource::Shape) take(triangles, count_triangles(scene.bodies[i].surface.shape));
        for (const SceneInstrument& instrument : scene.instruments) take(triangles, instrument.skin_triangles);
    }

private:
    static void take(std::size_t& allowance, std::size_t count) noexcept { allowance -= std::min(allowance, count); }
};

/// TetGen would run until its time or memory ends: a mesh of tetrahedra no larger than that has at least so many.
Result<void> check_max_volume(const Scene& scene, const SceneBody& body, const TriMesh& surface, const SceneAllowance& allowance) {
    if (!body.coarse.file.empty() || body.coarse.mesher != CoarseMesher::TetGen || !(body.coarse.max_volume > 0.0)) return {};
    const double volume = std::abs(signed_volume(surface)), count = volume / body.coarse.max_volume;
    if (!(count > static_cast<double>(allowance.tets))) return {};
    return scene_error(
        scene, "bodies." + body.name + ".coarse.max_volume",
        fmt::format("{:.3g} mm^3 asks for {:.3g} tetrahedra or more of a body of {:.3g} mm^3, and at most {} would be taken; "
                    "expected {:.3g} mm^3 or more",
                    1e9 * body.coarse.max_volume, count, 1e9 * volume, allowance.tets, 1e9 * volume / static_cast<double>(allowance.tets)));
}

Result<void> prepare_tissue(const Scene& scene, const SceneBody& spec, const SceneAllowance& allowance, CoarseBodies& coarse, PreparedScene& prepared,
                            BodyModel& model, BodySummary& summary) {
    const std::string key = "bodies." + spec.name;
    if (const Result<void> sized = check_max_volume(scene, spec, model.surface, allowance); !sized.ok()) return sized;
    BesideTets beside;
    Result<TetMesh> mesh = make_coarse(spec, model.surface, beside, {summary.notes, prepared.notices});
    if (!mesh.ok()) return scene_error(scene, key + ".coarse", mesh.error().to_string(), mesh.error().code);
    if (mesh->tets.size() > allowance.tets)
        return scene_error(scene, key + ".coarse",
                           fmt::format("found {} tetrahedra, {} with the other bodies; expected at most {} in the scene", mesh->tets.size(),
                                       kMostTets - allowance.tets + mesh->tets.size(), kMostTets));
    Result<TissueRegions> regions = make_tissue_regions(scene, spec, *mesh, beside);
    if (!regions.ok()) return regions.error();
    const Result<SceneBody> listed = list_region_nodes(scene, spec, mesh->vertices, beside.place_of_node, prepared.model.bodies, model);
    if (!listed.ok()) return listed.error();
    const SceneBody& body = *listed;
    const std::vector<Index> pinned = find_pinned(body.fixed, mesh->vertices);
    if (!body.fixed.empty() && pinned.empty())
        return scene_error(scene, key + ".fixed", "no node of the coarse mesh lies in any of these regions");
    for (std::size_t i = 0; i < body.fixed.size() && body.fixed.size() > 1; ++i)
        if (find_region_nodes(body.fixed[i].region, mesh->vertices).empty())
            prepared.notices.push_back(fmt::format("{}.fixed[{}] holds nothing: no node of the coarse mesh lies in it", key, i));
    if (const Result<void> held = prepare_held(scene, body, mesh->vertices, pinned, model); !held.ok()) return held;
    const auto sheet = is_wall(body) ? static_cast<Index>(mesh->vertices.size() / (body.coarse.layers + 1)) : 0;
    const Result<FibreField> fibres = make_fibre_field(scene, body, *mesh, beside, model.surface);
    if (!fibres.ok()) return fibres.error();
    const fem::TetContrast contrast{regions->stiffness, regions->density, fibres->axes};
    Result<fem::TissueModel> tissue = fem::make_tissue_model(*mesh, effective_material(scene, body), pinned, contrast, sheet);
    if (!tissue.ok())
        return scene_error(scene, key,
                           body.coarse.file.empty() ? tissue.error().message
                                                    : fmt::format("{}: {}", body.coarse.file.string(), tissue.error().message),
                           tissue.error().code);
    if (!body.coarse.file.empty())
        if (const Result<void> checked = check_faces(*mesh); !checked.ok())
            return scene_error(scene, key + ".coarse", fmt::format("{}: {}", body.coarse.file.string(), checked.error().message), checked.error().code);
    if (const Result<void> joined = join_walls(scene, {*mesh, effective_material(scene, body), contrast}, coarse, prepared, *tissue, summary); !joined.ok())
        return joined;
    Result<fem::RigidLinks> links = spec.hollow ? fem::make_bore_links(*mesh, model.surface) : fem::make_surface_links(*mesh, model.surface);
    if (!links.ok()) return scene_error(scene, key + ".surface", links.error().message, links.error().code);
    if (!body.coarse.file.empty())
        if (const std::string misfit = find_misfit(*mesh, model.surface, links->max_length); !misfit.empty())
            return scene_error(scene, key + ".coarse", fmt::format("{}: {}", body.coarse.file.string(), misfit));
    summary.coarse_nodes = mesh->vertices.size();
    summary.coarse_tets = mesh->tets.size();
    summary.pinned_nodes = tissue->pinned.size();
    summary.region_array = std::move(regions->array);
    summary.fibres = fibres->words;
    if (!fibres->note.empty()) summary.notes.push_back(fibres->note);
    summary.regions = std::move(regions->list);
    if (!fem::uses_patches(tissue->material) && body.material.poisson_ratio > fem::kLockingPoissonRatio)
        summary.notes.push_back(
            fmt::format("Poisson's ratio {} above {}: linear tetrahedra lock; a cantilever of 41K of them bends 0.88 of "
                        "what it should at 0.45, 0.71 at 0.49, 0.29 at 0.499; \"elements\": \"patched\" does not",
                        body.material.poisson_ratio, fem::kLockingPoissonRatio));
    if (sheet == 0 && fem::uses_patches(tissue->material) && !has_inner_node(*mesh))
        summary.notes.push_back("no node of the coarse mesh lies inside it: where it is one tetrahedron thick it bends 2 to 3 times as much as it should; finer cells, or a "
                                "thicker body, do not");
    if (const Result<void> loaded = prepare_loads(scene, body, *mesh, *tissue, model, prepared.notices); !loaded.ok()) return loaded;
    model.tissue = std::move(*tissue);
    model.links = std::move(*links);
    coarse.meshes.back() = std::move(*mesh);
    return {};
}

void summarise_links(const fem::RigidLinks& links, BodySummary& summary) {
    summary.links = links.vertex_count();
    summary.static_links = links.static_count;
    summary.degenerate_links = links.degenerate;
    summary.longest_link_m = links.max_length;
}

/// Ends of sharp edges, each once.
std::vector<Index> find_sharp_vertices(const BodyModel& model) {
    std::vector<Index> out;
    for (const Index e : model.sharp_edges) out.insert(out.end(), {model.topology.edges[e][0], model.topology.edges[e][1]});
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
}

/// Sharp corners that the coarse mesh does not reach: what strikes them turns their links, and they sink into it.
void note_corners(const Scene& scene, const SceneBody& body, const BodyModel& model, BodySummary& summary) {
    if (!scene.effects.coarse_contact || !model.links || !(model.links->max_length > scene.contact.margin)) return;
    const fem::RigidLinks& links = *model.links;
    double farthest = 0.0;
    for (const Index e : model.sharp_edges)
        for (const Index v : model.topology.edges[e]) {
            if (links.vertex_frame[v] == kNoIndex || links.is_affine(links.vertex_frame[v])) continue;
            Vec3 on_mesh = Vec3::Zero();
            for (std::size_t k = 0; k < 3; ++k) on_mesh += links.vertex_weight[v][k] * links.node_rest[links.frame_nodes[links.vertex_frame[v]][k]];
            farthest = std::max(farthest, (model.surface.vertices[v] - on_mesh).norm());
        }
    if (!(farthest > scene.contact.margin)) return;
    const char* remedy = !body.coarse.file.empty() ? "a mesh that reaches them" : body.coarse.mesher == CoarseMesher::Lattice ? "\"mesher\": \"tetgen\"" : "more \"surface_triangles\"";
    summary.notes.push_back(fmt::format("{} sharp edges, with corners up to {:.3g} mm off the coarse mesh: struck, these may sink in by as much; what helps: {}",
                                        model.sharp_edges.size(), 1e3 * farthest, remedy));
}

} // namespace

Result<void> prepare_body(const Scene& scene, const SceneBody& body, PatientShelf& shelf, CoarseBodies& coarse, PreparedScene& prepared) {
    const SceneAllowance allowance(scene, prepared);
    Result<LoadedSurface> surface = load_surface(scene, body, allowance.triangles, prepared.model.bodies, shelf);
    if (!surface.ok()) return surface.error();
    BodyModel model;
    BodySummary summary;
    summary.name = model.name = body.name;
    summary.notes = std::move(surface->notes);
    summary.vertices = surface->mesh.vertices.size();
    summary.triangles = surface->mesh.triangles.size();
    model.motion = motion_of(body.kind);
    model.surface = std::move(surface->mesh);
    model.hollow = body.hollow;
    model.is_free_space = body.surface.source == SurfaceSource::Around;
    model.self_contact = body.self_contact;
    model.velocity = body.velocity;
    model.spin = body.spin;
    for (const KeyFrame& frame : body.motion) model.path.push_back({frame.time, frame.displacement});
    coarse.meshes.emplace_back();
    if (model.motion == Motion::Deformable) {
        const Result<void> done = prepare_tissue(scene, body, allowance, coarse, prepared, model, summary);
        if (!done.ok()) return done;
        if (model.hollow) model.host_body = prepared.model.bodies.size(); // itself: what presses on its surface presses on its wall
    }
    model.topology = collision::make_topology(model.surface.triangles, model.surface.vertices.size());
    if (model.hollow) {
        Result<spheretree::LumenTree> lumen = make_or_read_lumen_tree(model.surface);
        if (!lumen.ok()) return scene_error(scene, "bodies." + body.name + ".surface", lumen.error().message, lumen.error().code);
        summary.inscribed_spheres = lumen->ball_count();
        summary.tree_spheres = lumen->tree.sphere_count();
        model.lumen = std::move(*lumen);
        if (scene.effects.pulse && !model.is_free_space) model.pulse_reach = find_pulse_reach(model.surface, *model.lumen, scene.effects.pulse->amplitude);
    } else {
        const SurfaceReport report = inspect_surface(model.surface);
        model.closed = report.closed() && report.oriented() && report.signed_volume > 0.0;
        model.covering = spheretree::build_covering_tree(model.surface);
        summary.tree_spheres = model.covering.tree.sphere_count();
        if (model.closed) model.sharp_edges = find_sharp_edges(model.surface, model.topology);
        if (model.links) fem::follow_tets(*model.links, model.tissue->tet_nodes, model.surface.vertices, find_sharp_vertices(model));
        note_corners(scene, body, model, summary);
    }
    if (model.links) summarise_links(*model.links, summary);
    prepared.model.bodies.push_back(std::move(model));
    prepared.bodies.push_back(std::move(summary));
    return {};
}

Result<std::optional<fem::RigidLinks>> link_to_host(const Scene& scene, const CoarseBodies& coarse, const SceneModel& model, std::size_t vessel,
                                                    std::span<const Vec3> points) {
    const std::optional<std::size_t> host = model.bodies[vessel].host_body;
    if (!host) return std::optional<fem::RigidLinks>();
    Result<fem::RigidLinks> links = *host == vessel ? fem::make_middle_links(coarse.meshes[*host], points)
                                                    : fem::make_embedded_links(coarse.meshes[*host], points, scene.bodies[vessel].blend);
    if (!links.ok()) return links.error();
    return std::optional<fem::RigidLinks>(std::move(*links));
}

Result<void> embed_in_host(const Scene& scene, std::size_t index, const CoarseBodies& coarse, PreparedScene& prepared) {
    const SceneBody& body = scene.bodies[index];
    BodyModel& model = prepared.model.bodies[index];
    if (model.is_free_space) {
        model.host_body = find_host(prepared.model.bodies, body.surface.around);
        if (!model.host_body) return {};
        model.links = link_free_space_wall(prepared.model.bodies, body.surface.around, *model.host_body, model.surface.vertices.size());
        summarise_links(*model.links, prepared.bodies[index]);
        return {};
    }
    if (body.embedded_in == kNoIndex || model.tissue) return {}; // a wall of its own is joined, not carried
    Result<fem::RigidLinks> links = fem::make_embedded_links(coarse.meshes[body.embedded_in], model.surface.vertices, body.blend);
    if (!links.ok()) return scene_error(scene, "bodies." + body.name + ".embedded_in", links.error().message, links.error().code);
    model.links = std::move(*links);
    model.host_body = body.embedded_in;
    BodySummary& summary = prepared.bodies[index];
    summarise_links(*model.links, summary);
    if (summary.static_links == summary.links) summary.notes.push_back("no part lies inside its host body: it stays static");
    return {};
}

} // namespace trocar::engine
