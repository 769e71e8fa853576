#include "engine/prepare/load_surface.hpp"

#include "assets/anatomy/shapes.hpp"
#include "engine/io/read_surface.hpp"
#include "engine/prepare/free_space.hpp"
#include "engine/prepare/geometry_cache.hpp"
#include "engine/prepare/patient_cache.hpp"
#include "engine/prepare/surface_rule.hpp"
#include "engine/scene/scene_size.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {

namespace {

/// m; longest edge of a body's box. Anatomy around a catheter is larger than 1 mm and smaller than 10 m.
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
        return make_or_read_vessels(shape.branches, shape.blend, shape.triangles);
    }
    return TriMesh{};
}

Result<TriMesh> read_file(const SurfaceSpec& spec, std::string& note) {
    ReadOptions options;
    options.groups = spec.groups;
    options.weld = true;
    Result<TriMesh> mesh = read_surface(spec.file, options, &note);
    if (mesh.ok())
        for (Vec3& v : mesh->vertices) v *= spec.unit;
    return mesh;
}

Result<TriMesh> make_mesh(const Scene& scene, const SurfaceSpec& spec, std::span<const BodyModel> before, PatientShelf& shelf, std::string& note) {
    switch (spec.source) {
    case SurfaceSource::Around:
        for (const Index body : spec.around)
            if (!before[body].closed)
                return Error{ErrorCode::BadMesh, fmt::format("around needs solids that have an inside, and {} is not closed", scene.bodies[body].name)};
        return make_free_space_wall(before, spec.around, spec.margin);
    case SurfaceSource::File:
        return read_file(spec, note);
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

SurfaceNeeds needs_of(const SceneBody& body) {
    if (body.kind == BodyKind::Deformable) return {"a deformable body", true, false};
    // A tube of the scene's own numbers may cross itself in a sharp bend: no repair helps there, and a notice says so.
    if (body.hollow) return {"a lumen", true, body.surface.source == SurfaceSource::File && !body.surface.may_cross};
    return {"an obstacle", false, false};
}

/// The repairs that the scene asks for, then the rule; the error names the whole chain of repairs that would do.
Result<void> repair_and_check(const SceneBody& body, LoadedSurface& loaded) {
    const SurfaceSpec& spec = body.surface;
    if (Result<void> fans = check_fans(loaded.mesh); !fans.ok()) return fans;
    const TriMesh raw = loaded.mesh;
    const SurfaceNeeds needs = needs_of(body);
    const auto refuse = [&](const std::string& what, ErrorCode code) {
        const RepairAdvice advice = propose_repairs(raw, spec.repair, needs, spec.repairing);
        const std::string help = spec.source == SurfaceSource::File ? describe_advice(advice, RepairWriting::SceneKey, what) : "";
        return Error{code, what + help};
    };
    const Result<RepairReport> repaired = apply_repairs(loaded.mesh, spec.repair, spec.repairing);
    if (!repaired.ok()) return refuse(repaired.error().message, repaired.error().code);
    for (const RepairStep& step : repaired->steps) loaded.notes.push_back("repair " + step.to_string());
    drop_unreferenced_vertices(loaded.mesh);
    if (const Result<void> fans = check_fans(loaded.mesh); !fans.ok())
        return Error{fans.error().code, "after the repairs " + fans.error().message};
    loaded.report = inspect_surface(loaded.mesh);
    const auto defect = find_defect(loaded.mesh, loaded.report, needs);
    if (!defect) return {};
    return defect->repair ? refuse(defect->what, ErrorCode::BadMesh) : Error{ErrorCode::BadMesh, defect->what};
}

/// Of a surface that passes through itself, or may, where nothing forbids it; else empty.
std::string note_crossings(const SceneBody& body, const LoadedSurface& loaded) {
    const bool asked = body.kind == BodyKind::Deformable || (body.hollow && body.surface.may_cross);
    const bool made = body.surface.source != SurfaceSource::File;
    if (made ? !body.hollow : !asked) return "";
    return describe_crossings(find_self_intersections(loaded.mesh, 0));
}

/// All digits: 10.00004 m is not "10 m", which is expected.
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

Result<LoadedSurface> load_surface(const Scene& scene, const SceneBody& body, std::size_t room, std::span<const BodyModel> before, PatientShelf& shelf) {
    const std::string key = "bodies." + body.name + ".surface";
    if (body.surface.source == SurfaceSource::Shape && body.surface.shape.kind == ShapeKind::Tube) { // too long: not worth making
        Box3 axis;
        for (const Vec3& p : body.surface.shape.axis) axis.add(body.scale * p);
        if (const double least = axis.longest_edge(); least > kLargestBody)
            return scene_error(scene, key, find_size_defect(least, scene.units), ErrorCode::BadValue);
    }
    std::string origin;
    Result<TriMesh> mesh = make_mesh(scene, body.surface, before, shelf, origin);
    if (!mesh.ok()) {
        if (!mesh.error().file.empty()) return mesh.error(); // the mesh file's own line is more specific than the scene's
        return scene_error(scene, key, mesh.error().message, mesh.error().code);
    }
    if (mesh->triangles.size() > room)
        return scene_error(scene, key,
                           fmt::format("found {} triangles, {} with the other bodies; expected at most {} in the scene",
                                       mesh->triangles.size(), kMostTriangles - room + mesh->triangles.size(), kMostTriangles));
    LoadedSurface loaded;
    loaded.mesh = std::move(*mesh);
    if (!origin.empty()) loaded.notes.push_back("surface: " + origin);
    if (body.surface.source == SurfaceSource::Around) { // of surfaces that were checked; those of bodies that rest on one another may cross
        if (const std::string defect = find_size_defect(loaded.mesh, scene.units); !defect.empty())
            return scene_error(scene, key, defect, ErrorCode::BadValue);
        return loaded;
    }
    for (Vec3& v : loaded.mesh.vertices) v = body.scale * v + body.translate;
    if (const Result<void> sound = repair_and_check(body, loaded); !sound.ok()) {
        const std::string source = body.surface.source == SurfaceSource::File ? body.surface.file.string() + ": " : "";
        return scene_error(scene, key, source + sound.error().message, sound.error().code);
    }
    if (const std::string defect = find_size_defect(loaded.mesh, scene.units); !defect.empty())
        return scene_error(scene, key, defect, ErrorCode::BadValue);
    if (std::string crossings = note_crossings(body, loaded); !crossings.empty()) loaded.notes.push_back(std::move(crossings));
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

} // namespace trocar::engine
