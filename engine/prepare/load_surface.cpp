#include "engine/prepare/load_surface.hpp"

#include "assets/anatomy/shapes.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/patient_cache.hpp"
#include "engine/scene/scene_size.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace seldinger::engine {

namespace {

/// m; longest edge of a body's box. Nothing that a catheter meets is smaller than a grain of sand or larger than a room.
constexpr double kSmallestBody = 1e-4, kLargestBody = 10.0;
/// Beyond this many body sizes from the origin a double leaves less than a millionth of the body's size: refused.
constexpr double kFarthest = 1e8;

Result<TriMesh> make_shape(const ShapeSpec& shape) {
    switch (shape.kind) {
    case ShapeKind::Sphere:
        return anatomy::make_icosphere(shape.centre, shape.radius, shape.subdivisions);
    case ShapeKind::Box:
        return anatomy::make_box(shape.centre, shape.extent, shape.cells);
    case ShapeKind::Tube:
        return anatomy::make_tube(shape.axis, shape.axis_radii, shape.sides);
    case ShapeKind::Torus: {
        TriMesh mesh = anatomy::make_torus(Vec3::Zero(), shape.radius, shape.tube_radius, 2 * shape.sides, shape.sides);
        for (Vec3& v : mesh.vertices) v += shape.centre;
        return mesh;
    }
    case ShapeKind::Vessels:
        return anatomy::make_vessels(shape.branches, shape.blend, shape.triangles);
    }
    return TriMesh{};
}

Result<TriMesh> read_file(const SurfaceSpec& spec) {
    ReadOptions options;
    options.groups = spec.groups;
    options.weld = true;
    Result<TriMesh> mesh = read_surface(spec.file, options);
    if (mesh.ok())
        for (Vec3& v : mesh->vertices) v *= spec.unit;
    return mesh;
}

Result<TriMesh> make_mesh(const SurfaceSpec& spec, PatientShelf& shelf) {
    switch (spec.source) {
    case SurfaceSource::File:
        return read_file(spec);
    case SurfaceSource::Shape:
        return make_shape(spec.shape);
    case SurfaceSource::Recipe:
        break;
    }
    const auto patient = shelf.find(spec.recipe);
    if (!patient.ok()) return patient.error();
    const TriMesh* part = anatomy::find_part(**patient, spec.part);
    if (part == nullptr) return Error{ErrorCode::BadValue, fmt::format("no part '{}' in the recipe: known are liver, lumen", spec.part)};
    return *part;
}

SurfaceUse use_of(const SceneBody& body) {
    if (body.kind == BodyKind::Deformable) return SurfaceUse::Volume;
    return body.hollow ? SurfaceUse::Lumen : SurfaceUse::Obstacle;
}

std::string list_triangles(const SurfaceReport& report) {
    if (report.bad_triangles.empty()) return "";
    return fmt::format("; first bad triangles: {}", fmt::join(report.bad_triangles, ", "));
}

/// First reason why the surface does not do, with the repair that would help; empty when it does.
std::string find_defect(const SurfaceReport& r, SurfaceUse use) {
    if (r.triangles == 0) return "the surface has no triangles";
    if (!r.finite()) return fmt::format("{} vertices are not finite", r.non_finite_vertices);
    const std::string where = list_triangles(r);
    if (use == SurfaceUse::Obstacle) {
        if (r.closed() && r.oriented() && r.nonmanifold_edges == 0 && r.signed_volume < 0.0)
            return "the closed surface is inside out; repair \"orient\" turns it";
        return "";
    }
    const char* wanted = use == SurfaceUse::Volume ? "a deformable body" : "a lumen";
    if (r.degenerate_triangles > 0)
        return fmt::format("{} needs triangles with area, {} have none{}; repair \"drop_degenerate\" removes them", wanted,
                           r.degenerate_triangles, where);
    if (r.duplicate_triangles > 0)
        return fmt::format("{} triangles stand twice{}; repair \"drop_duplicates\" removes them", r.duplicate_triangles, where);
    if (r.nonmanifold_edges > 0)
        return fmt::format("{} edges belong to three or more triangles{}; repair \"drop_non_manifold\" cuts them open", r.nonmanifold_edges,
                           where);
    if (!r.closed())
        return fmt::format("{} needs a closed surface, this one has {} border edges{}; repair \"fill_holes\" closes it", wanted,
                           r.boundary_edges, where);
    if (!r.oriented())
        return fmt::format("{} edges are used the same way by both triangles{}; repair \"orient\" turns them", r.inconsistent_edges, where);
    if (use == SurfaceUse::Volume && !r.manifold())
        return fmt::format("{} vertices are pinched{}; repair \"drop_non_manifold\" separates them", r.nonmanifold_vertices, where);
    if (!(r.signed_volume > 0.0)) return "the surface is inside out; repair \"orient\" turns it";
    return "";
}

/// All digits: 10.00004 m is not "10 m", which would be right.
std::string find_size_defect(double size, const Units& units) {
    if (!(size >= kSmallestBody && size <= kLargestBody))
        return fmt::format("its longest side is {} m (units.length is {}): bodies measure {:g} m to {:g} m; "
                           "is \"unit\" of the surface right?",
                           size, units.length_name, kSmallestBody, kLargestBody);
    return "";
}

std::string find_size_defect(const TriMesh& mesh, const Units& units) {
    const Box3 box = mesh.bounds();
    const double size = box.longest_edge();
    if (std::string defect = find_size_defect(size, units); !defect.empty()) return defect;
    const double away = box.centre().cwiseAbs().maxCoeff();
    if (away > kFarthest * size)
        return fmt::format("it lies {:.3g} m from the origin, {:.3g} times its size: its shape is lost to rounding", away, away / size);
    return "";
}

std::vector<std::string> list_leniencies(const SurfaceReport& r) {
    std::vector<std::string> notes;
    if (r.components > 1) notes.push_back(fmt::format("{} separate shells", r.components));
    if (!r.closed()) notes.push_back(fmt::format("open: {} border edges", r.boundary_edges));
    if (r.nonmanifold_edges > 0) notes.push_back(fmt::format("{} edges of three or more triangles", r.nonmanifold_edges));
    if (r.inconsistent_edges > 0) notes.push_back(fmt::format("{} edges with neighbours turned apart", r.inconsistent_edges));
    if (r.degenerate_triangles > 0) notes.push_back(fmt::format("{} triangles without area", r.degenerate_triangles));
    if (r.duplicate_triangles > 0) notes.push_back(fmt::format("{} triangles stand twice", r.duplicate_triangles));
    return notes;
}

} // namespace

Result<const anatomy::Anatomy*> PatientShelf::find(const anatomy::Recipe& recipe) {
    const std::string key = patient_key(recipe);
    for (const Entry& entry : entries_)
        if (entry.key == key) return static_cast<const anatomy::Anatomy*>(entry.patient.get());
    Result<anatomy::Anatomy> patient = make_patient(recipe, key);
    if (!patient.ok()) return patient.error();
    entries_.push_back({key, std::make_unique<anatomy::Anatomy>(std::move(*patient))});
    return static_cast<const anatomy::Anatomy*>(entries_.back().patient.get());
}

Result<LoadedSurface> load_surface(const Scene& scene, const SceneBody& body, std::size_t room, PatientShelf& shelf) {
    const std::string key = "bodies." + body.name + ".surface";
    if (body.surface.source == SurfaceSource::Shape && body.surface.shape.kind == ShapeKind::Tube) { // too long: not worth making
        Box3 axis;
        for (const Vec3& p : body.surface.shape.axis) axis.add(body.scale * p);
        if (const double least = axis.longest_edge(); least > kLargestBody)
            return scene_error(scene, key, find_size_defect(least, scene.units), ErrorCode::BadValue);
    }
    Result<TriMesh> mesh = make_mesh(body.surface, shelf);
    if (!mesh.ok()) {
        if (!mesh.error().file.empty()) return mesh.error(); // the mesh file's own line says more than the scene's
        return scene_error(scene, key, mesh.error().message, mesh.error().code);
    }
    if (mesh->triangles.size() > room)
        return scene_error(scene, key,
                           fmt::format("found {} triangles, {} with the other bodies; at most {} in the scene would be right",
                                       mesh->triangles.size(), kMostTriangles - room + mesh->triangles.size(), kMostTriangles));
    LoadedSurface loaded;
    loaded.mesh = std::move(*mesh);
    for (Vec3& v : loaded.mesh.vertices) v = body.scale * v + body.translate;
    if (!body.surface.repair.empty()) {
        const Result<RepairReport> repaired = apply_repairs(loaded.mesh, body.surface.repair, {body.surface.weld_tolerance});
        if (!repaired.ok()) return scene_error(scene, key, repaired.error().message, repaired.error().code);
        for (const RepairStep& step : repaired->steps) loaded.notes.push_back("repair " + step.to_string());
    }
    drop_unreferenced_vertices(loaded.mesh);
    loaded.report = inspect_surface(loaded.mesh);
    std::string defect = find_defect(loaded.report, use_of(body));
    if (!defect.empty()) {
        const std::string source = body.surface.source == SurfaceSource::File ? body.surface.file.string() + ": " : "";
        return scene_error(scene, key, source + defect, ErrorCode::BadMesh);
    }
    defect = find_size_defect(loaded.mesh, scene.units);
    if (!defect.empty()) return scene_error(scene, key, defect, ErrorCode::BadValue);
    for (std::string& note : list_leniencies(loaded.report)) loaded.notes.push_back(std::move(note));
    return loaded;
}

Result<Place> find_place(const Scene& scene, const PlaceSpec& spec, const std::string& key, PatientShelf& shelf) {
    if (spec.landmark.empty()) return Place{spec.position, spec.direction};
    const SceneBody& body = scene.bodies[spec.body];
    const auto patient = shelf.find(body.surface.recipe);
    if (!patient.ok()) return scene_error(scene, key, patient.error().message, patient.error().code);
    const anatomy::Landmark* landmark = anatomy::find_landmark(**patient, spec.landmark);
    if (landmark != nullptr) return Place{body.scale * landmark->position + body.translate, landmark->direction};
    std::vector<std::string> known;
    for (const anatomy::Landmark& each : (*patient)->landmarks) known.push_back(each.name);
    return scene_error(scene, key,
                       fmt::format("no landmark '{}' in body {}: known are {}", spec.landmark, body.name, fmt::join(known, ", ")));
}

} // namespace seldinger::engine
