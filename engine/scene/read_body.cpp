#include "base/repair.hpp"
#include "engine/scene/describe_body.hpp"
#include "engine/scene/nearest.hpp"
#include "engine/scene/read_keys.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/scene_size.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {
namespace {

constexpr double kSamePoint = 1e-9; // m

/// Rings between two rows of a tube's axis, about as far apart as its sides are wide: long thin triangles make poor
/// contacts.
void add_rings(ShapeSpec& shape, const Vec3& point, double radius) {
    const Vec3 from = shape.axis.back();
    const double from_radius = shape.axis_radii.back();
    constexpr double kTurn = 6.283185307179586, kMostRings = 2000.0;
    const double side = kTurn * std::max(from_radius, radius) / shape.sides;
    const int rings = static_cast<int>(std::clamp(std::ceil((point - from).norm() / side), 1.0, kMostRings));
    for (int i = 1; i < rings; ++i) {
        const double t = static_cast<double>(i) / rings;
        shape.axis.push_back(from + t * (point - from));
        shape.axis_radii.push_back(from_radius + t * (radius - from_radius));
    }
}

std::optional<Error> read_tube(const CheckContext& context, const Values& values, ShapeSpec& shape) {
    const std::vector<JsonNode>& rows = values.find("axis")->children;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        const Vec3 point(values.column("axis", rows[i], 0), values.column("axis", rows[i], 1), values.column("axis", rows[i], 2));
        const double radius = values.column("axis", rows[i], 3);
        if (i > 0 && (point - shape.axis.back()).norm() < kSamePoint)
            return error_at(context, rows[i].at, fmt::format("{}[{}]", values.path("axis"), i),
                            "found the same point as in the row before; expected another point");
        if (i > 0) add_rings(shape, point, radius);
        shape.axis.push_back(point);
        shape.axis_radii.push_back(radius);
        if (count_triangles(shape) > kMostTriangles) // here, or a short text of far rows would fill the memory with rings
            return error_at(context, rows[i].at, fmt::format("{}[{}]", values.path("axis"), i),
                            fmt::format("found {}: {} triangles up to this row; expected at most {} in the scene", describe_size(shape),
                                        count_triangles(shape), kMostTriangles));
    }
    return std::nullopt;
}

std::optional<Error> read_vessels(const CheckContext& context, const Values& values, ShapeSpec& shape) {
    for (const JsonNode& branch : values.find("branches")->children) {
        anatomy::VesselBranch& read = shape.branches.emplace_back();
        for (const JsonNode& row : branch.children) {
            read.axis.emplace_back(values.column("branches", row, 0), values.column("branches", row, 1), values.column("branches", row, 2));
            read.radii.push_back(values.column("branches", row, 3));
            const std::size_t i = read.axis.size() - 1;
            if (i > 0 && (read.axis[i] - read.axis[i - 1]).norm() < kSamePoint)
                return error_at(context, row.at, fmt::format("{}[{}][{}]", values.path("branches"), shape.branches.size() - 1, i),
                                "found the same point as in the row before; expected another point");
        }
    }
    return std::nullopt;
}

std::optional<Error> read_shape(const Reading& reading, SurfaceSpec& surface) {
    const auto& [context, values, scene] = reading;
    surface.source = SurfaceSource::Shape;
    ShapeSpec& shape = surface.shape;
    if (auto error = read_keys<ShapeKeys>(reading, shape)) return error;
    if (shape.kind == ShapeKind::Tube) return read_tube(context, values, shape);
    if (shape.kind == ShapeKind::Vessels) return read_vessels(context, values, shape);
    if (shape.kind == ShapeKind::Torus && shape.tube_radius >= shape.radius)
        return fail_at(context, values, "tube_radius",
                       fmt::format("found {}; expected less than the ring's radius, {}",
                                   with_unit(shape.tube_radius, Dimension::Length, context.units),
                                   with_unit(shape.radius, Dimension::Length, context.units)));
    return std::nullopt;
}

std::optional<Error> read_file_surface(const Reading& reading, SurfaceSpec& surface) {
    surface.source = SurfaceSource::File;
    if (auto error = read_keys<FileSurfaceKeys>(reading, surface)) return error;
    const bool welds = std::find(surface.repair.begin(), surface.repair.end(), Repair::Weld) != surface.repair.end();
    if (welds || !reading.values.has("weld_tolerance")) return std::nullopt;
    return fail_at(reading.context, reading.values, "weld_tolerance",
                   "unused key: the repairs do not contain weld; expected it added or this left out");
}

std::optional<Error> read_recipe_surface(const Reading& reading, SurfaceSpec& surface) {
    surface.source = SurfaceSource::Recipe;
    surface.file = checked_file(reading.context, reading.values.text("recipe"));
    surface.part = reading.values.text("part") == "liver" ? "liver" : "lumen";
    auto recipe = read_recipe(surface.file);
    if (!recipe) return recipe.error();
    surface.recipe = *recipe;
    return std::nullopt;
}

} // namespace

std::filesystem::path checked_file(const CheckContext& context, const std::string& name) {
    const auto file = resolve_file(name, context.folder); // it passed the check; the file may have vanished since
    return file ? *file : context.folder / name;
}

Error fail_at(const CheckContext& context, const Values& values, std::string_view key, std::string message, ErrorCode code) {
    const JsonNode* member = values.find(key);
    if (member != nullptr) return error_at(context, member->at, values.path(key), std::move(message), code);
    const auto place = context.positions.find(values.path());
    const TextPosition at = place != context.positions.end() ? place->second : TextPosition{1, 1};
    return error_at(context, at, values.path(key), std::move(message), code);
}

std::optional<Error> read_direction(const CheckContext& context, const Values& values, std::string_view key, Vec3& direction) {
    direction = values.vector(key);
    const double largest = direction.cwiseAbs().maxCoeff();
    if (!(largest > 0.0)) return fail_at(context, values, key, "found a direction of length 0; expected one as in [0, 0, 1]");
    direction = (direction / largest).normalized(); // scaled first: squares of tiny or huge numbers leave the range of double
    return std::nullopt;
}

std::optional<Error> read_file_unit(const Reading& reading, double& unit) {
    const Values& values = reading.values;
    unit = values.has("unit") ? *find_unit(Dimension::Length, values.text("unit")) : reading.context.units.length;
    return std::nullopt;
}

std::optional<Error> read_groups(const Reading& reading, std::vector<std::string>& groups) {
    if (const JsonNode* list = reading.values.find("groups"))
        for (const JsonNode& group : list->children) groups.push_back(group.text);
    return std::nullopt;
}

std::optional<Error> read_repairs(const Reading& reading, std::vector<Repair>& repairs) {
    if (const JsonNode* list = reading.values.find("repair"))
        for (const JsonNode& name : list->children) repairs.push_back(*find_repair(name.text));
    return std::nullopt;
}

std::optional<Error> read_surface_spec(const Reading& body, SurfaceSpec& surface) {
    const JsonNode* node = body.values.find("surface");
    if (node == nullptr) return std::nullopt;
    if (node->type == JsonType::Text) {
        surface.source = SurfaceSource::File;
        surface.file = checked_file(body.context, node->text);
        surface.unit = body.context.units.length;
        return std::nullopt;
    }
    const Values values = body.values.object("surface");
    const Reading reading{body.context, values, body.scene};
    if (node->find("file") != nullptr) return read_file_surface(reading, surface);
    if (node->find("around") != nullptr) {
        surface.source = SurfaceSource::Around;
        return read_keys<AroundSurfaceKeys>(reading, surface);
    }
    return node->find("shape") != nullptr ? read_shape(reading, surface) : read_recipe_surface(reading, surface);
}

std::optional<Error> read_coarse(const Reading& body, CoarseSpec& coarse) {
    const JsonNode* node = body.values.find("coarse");
    if (node == nullptr) return std::nullopt;
    const Values values = body.values.object("coarse");
    const Reading reading{body.context, values, body.scene};
    return node->find("file") != nullptr ? read_keys<FileCoarseKeys>(reading, coarse) : read_keys<MeshedCoarseKeys>(reading, coarse);
}

std::optional<Error> read_regions(const Reading& reading, std::vector<TissueRegion>& regions) {
    const auto& [context, values, scene] = reading;
    const JsonNode* node = values.find("regions");
    if (node == nullptr && values.has("region_array"))
        return fail_at(context, values, "region_array", "unused key: no region has a tissue of its own; expected regions added or this left out");
    for (std::size_t i = 0; node != nullptr && i < node->children.size(); ++i) {
        const JsonNode& member = node->children[i];
        const Values own = values.element("regions", member, join_key(values.path("regions"), member.key));
        TissueRegion region;
        region.name = member.key;
        if (auto error = read_keys<TissueRegionKeys>({context, own, scene}, region)) return error;
        for (const TissueRegion& other : regions)
            if (region.label == other.label && region.label != TissueRegion::kNoLabel)
                return fail_at(context, own, "label", fmt::format("found {}, which is {}'s; expected a label for each region", region.label, other.name));
        regions.push_back(std::move(region));
    }
    return std::nullopt;
}

std::optional<Error> read_box(const Reading& reading, Box3& box) {
    const JsonNode* corners = reading.values.find("box");
    if (corners == nullptr) return std::nullopt;
    for (std::size_t i = 0; i < 3; ++i) {
        box.lo[static_cast<int>(i)] = reading.values.column("box", corners->children[0], i);
        box.hi[static_cast<int>(i)] = reading.values.column("box", corners->children[1], i);
    }
    if ((box.lo.array() < box.hi.array()).all()) return std::nullopt;
    return fail_at(reading.context, reading.values, "box", "found an empty box; expected the lower corner first, then the upper one");
}

std::optional<Error> read_motion(const Reading& reading, std::vector<KeyFrame>& motion) { return read_frames(reading, "motion", motion); }

/// Tissue around a lumen, not in it; and a wall only around a lumen.
std::optional<Error> check_wall(const Reading& reading, const SceneBody& body) {
    if (body.kind != BodyKind::Deformable || !body.coarse.file.empty() || body.hollow == (body.coarse.mesher == CoarseMesher::Wall)) return std::nullopt;
    if (!body.hollow)
        return fail_at(reading.context, reading.values, "coarse", "found a wall around a body that is not hollow; expected \"hollow\": true beside it, or another mesher");
    return fail_at(reading.context, reading.values, reading.values.has("coarse") ? "coarse" : "hollow",
                   "the surface is a lumen, which this mesher would fill with tissue; expected \"coarse\": {\"mesher\": \"wall\", \"thickness\": ...}, a mesh of "
                   "its wall from a file, or \"kind\": \"static\", perhaps \"embedded_in\" the organ around it");
}

/// Fibres are said to lie one way, and an artery's lie round its vessel where nothing is said.
std::optional<Error> read_fibre_course(const Reading& reading, SceneBody& body) {
    const auto& [context, values, scene] = reading;
    const char* array = !body.coarse.fibre1_array.empty() ? "fibre1_array" : !body.coarse.fibre2_array.empty() ? "fibre2_array" : nullptr;
    if (array != nullptr && body.material.law != fem::MaterialLaw::Hgo)
        return fail_at(context, values.object("coarse"), array, "found an array of fibres of a tissue without; expected \"law\": \"hgo\" in its \"material\", or this left out");
    if (!values.has("material")) return std::nullopt;
    const Values material = values.object("material");
    bool given = false;
    for (const char* key : {"fibre1", "fibre2", "fibre_axis", "fibre_point"}) given |= material.has(key);
    if (body.preset.starts_with("artery") && body.hollow && !given && array == nullptr && !material.has("fibre_course")) body.fibre_course = FibreCourse::Centreline;
    const bool courses = body.fibre_course != FibreCourse::Given;
    if (courses && !body.hollow)
        return fail_at(context, material, "fibre_course", "found fibres round a vessel of a body that is not hollow; expected \"hollow\": true, or \"given\"");
    if (courses && array != nullptr) return fail_at(context, material, "fibre_course", fmt::format("found a course of fibres beside {}; expected one of both", array));
    for (const char* key : {"fibre1", "fibre2", "fibre_axis", "fibre_point"})
        if (material.has(key) && (courses || array != nullptr))
            return fail_at(context, material, key, fmt::format("unused key: fibres lie by {}; expected one of both", courses ? "fibre_course" : array));
    if (material.has("fibre_angle") && (array != nullptr || body.fibre_course == FibreCourse::Radial))
        return fail_at(context, material, "fibre_angle", fmt::format("unused key: fibres lie by {}; expected this left out", array != nullptr ? array : "fibre_course \"radial\""));
    return std::nullopt;
}

/// A branch of relaxation has a share and a time.
std::optional<Error> check_branches(const Reading& reading, const SceneBody& body) {
    if (!reading.values.has("material")) return std::nullopt;
    const Values material = reading.values.object("material");
    const fem::Material& m = body.material;
    const double share[] = {m.g1, m.g2, m.g3}, time[] = {m.tau1, m.tau2, m.tau3};
    for (int k = 0; k < 3; ++k) {
        const std::string g = fmt::format("g{}", k + 1), tau = fmt::format("tau{}", k + 1);
        if (share[k] > 0.0 && !(time[k] > 0.0) && (material.has(g) || material.has(tau)))
            return fail_at(reading.context, material, material.has(tau) ? tau : g, fmt::format("{} is {:g} and {} is 0; expected {} above 0 s", g, share[k], tau, tau));
        if (material.has(tau) && !(share[k] > 0.0))
            return fail_at(reading.context, material, tau, fmt::format("unused key: {} is 0 here; expected {} above 0 or this left out", g, g));
    }
    return std::nullopt;
}

std::optional<Error> read_body(const Reading& reading, SceneBody& body) {
    if (reading.values.has("material")) {
        const Values material = reading.values.object("material");
        if (material.has("preset")) {
            body.preset = material.text("preset");
            body.material = *find_preset(body.preset);
        }
    }
    if (auto error = read_keys<BodyKeys>(reading, body)) return error;
    if (reading.values.has("spheres") && body.hollow)
        return fail_at(reading.context, reading.values, "spheres",
                       "found a sphere tree for a hollow body, whose spheres are those inscribed in its lumen; expected this left out, or \"hollow\" "
                       "left out");
    if (auto error = check_wall(reading, body)) return error;
    if (auto error = check_branches(reading, body)) return error;
    if (auto error = read_fibre_course(reading, body)) return error;
    if (!reading.values.has("blend") || reading.values.has("embedded_in")) return std::nullopt;
    return fail_at(reading.context, reading.values, "blend",
                   "unused key: the body is not embedded_in another; expected that added or this left out");
}

std::optional<Error> resolve_host_body(const CheckContext& context, const Values& values, const Scene& scene, SceneBody& body) {
    if (!values.has("embedded_in")) return std::nullopt;
    const std::string name = values.text("embedded_in");
    const bool is_wall = body.kind == BodyKind::Deformable;
    if (is_wall && !body.hollow)
        return fail_at(context, values, "embedded_in",
                       "found an organ in another; expected \"hollow\": true beside it, for a vessel whose wall is joined to the tissue around it, or this left out");
    const auto own = static_cast<Index>(&body - scene.bodies.data());
    const auto may_be = [&](const SceneBody& other) { // a wall is joined to an organ that stands after it
        return other.kind == BodyKind::Deformable && &other != &body && (!is_wall || (!other.hollow && static_cast<Index>(&other - scene.bodies.data()) > own));
    };
    std::vector<std::string_view> deformable;
    for (const SceneBody& other : scene.bodies)
        if (may_be(other)) deformable.push_back(other.name);
    body.embedded_in = find_body(scene, name);
    if (body.embedded_in == kNoIndex)
        return fail_at(context, values, "embedded_in",
                       fmt::format("found the unknown body \"{:.60}\"; {}", name, suggest("deformable body", name, deformable)));
    if (scene.bodies[body.embedded_in].kind != BodyKind::Deformable)
        return fail_at(context, values, "embedded_in",
                       fmt::format("the body \"{}\" is not deformable, so it cannot carry another; {}", name,
                                   suggest("deformable body", name, deformable)));
    if (!is_wall || may_be(scene.bodies[body.embedded_in])) return std::nullopt;
    const char* what = body.embedded_in == own                  ? "is the vessel itself"
                       : scene.bodies[body.embedded_in].hollow ? "is hollow, and no wall is joined to another"
                                                                : "stands before this one, and a vessel stands before the organ that its wall is joined to";
    return fail_at(context, values, "embedded_in", fmt::format("the body \"{}\" {}; {}", name, what, suggest("deformable body", name, deformable)));
}

std::optional<Error> resolve_around(const CheckContext& context, const Values& values, const Scene& scene, std::size_t index,
                                    SurfaceSpec& surface) {
    if (surface.source != SurfaceSource::Around) return std::nullopt;
    const SceneBody& own = scene.bodies[index];
    if (own.kind != BodyKind::Static || !own.hollow)
        return fail_at(context, values, own.hollow ? "kind" : "surface",
                       "the free space around bodies is what instruments move in: expected \"kind\": \"static\", \"hollow\": true");
    for (const char* key : {"scale", "translate", "embedded_in"})
        if (values.has(key))
            return fail_at(context, values, key, "unused key: a surface around bodies lies where they do, and moves with them; expected it left out");
    const JsonNode* names = values.find("surface")->find("around");
    std::vector<std::string_view> before;
    for (std::size_t i = 0; i < index; ++i)
        if (!scene.bodies[i].hollow) before.push_back(scene.bodies[i].name);
    for (std::size_t i = 0; i < names->children.size(); ++i) {
        const JsonNode& name = names->children[i];
        const auto fail = [&](std::string message) {
            return error_at(context, name.at, fmt::format("{}.surface.around[{}]", values.path(), i), std::move(message));
        };
        const Index body = find_body(scene, name.text);
        if (body == kNoIndex) return fail(fmt::format("found the unknown body \"{:.60}\"; {}", name.text, suggest("solid body", name.text, before)));
        if (body >= index)
            return fail(fmt::format("the body \"{}\" does not stand before \"{}\"; {}", name.text, own.name, suggest("solid body", name.text, before)));
        const SceneBody& solid = scene.bodies[body];
        if (solid.hollow) return fail(fmt::format("the body \"{}\" is hollow; {}", name.text, suggest("solid body", name.text, before)));
        if (solid.kind == BodyKind::Kinematic || solid.embedded_in != kNoIndex)
            return fail(fmt::format("the body \"{}\" {}, which instruments cannot meet from outside yet; expected one that is static, or deformable", name.text,
                                    solid.kind == BodyKind::Kinematic ? "moves as told" : "is embedded in another one"));
        for (const Index other : surface.around) {
            if (other == body) return fail(fmt::format("found \"{}\" twice; expected it once", name.text));
            if (scene.bodies[other].kind == BodyKind::Deformable && solid.kind == BodyKind::Deformable)
                return fail(fmt::format("\"{}\" and \"{}\" both deform; expected at most one body that does, and static ones", scene.bodies[other].name,
                                        name.text));
        }
        surface.around.push_back(body);
    }
    return std::nullopt;
}

} // namespace trocar::engine
