#include "engine/scene/nearest.hpp"
#include "engine/scene/reader.hpp"
#include "engine/scene/recipe.hpp"
#include "engine/scene/scene_size.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace trocar::engine {
namespace {

/// Words of a table's choice and what they mean, in one order.
template <class T, std::size_t count>
T find_choice(const std::array<std::pair<std::string_view, T>, count>& choices, std::string_view word) {
    for (const auto& [name, value] : choices)
        if (name == word) return value;
    return choices.front().second;
}

constexpr std::array<std::pair<std::string_view, BodyKind>, 3> kBodyKinds = {
    {{"deformable", BodyKind::Deformable}, {"static", BodyKind::Static}, {"kinematic", BodyKind::Kinematic}}};
constexpr std::array<std::pair<std::string_view, ShapeKind>, 5> kShapes = {{{"sphere", ShapeKind::Sphere},
                                                                            {"box", ShapeKind::Box},
                                                                            {"tube", ShapeKind::Tube},
                                                                            {"torus", ShapeKind::Torus},
                                                                            {"vessels", ShapeKind::Vessels}}};
constexpr std::array<std::pair<std::string_view, fem::MaterialLaw>, 3> kLaws = {
    {{"neo_hookean", fem::MaterialLaw::NeoHookean}, {"corotational", fem::MaterialLaw::Corotational}, {"stvk", fem::MaterialLaw::StVK}}};

constexpr double kSamePoint = 1e-9; // m

double file_unit(const CheckContext& context, const Values& values) {
    return values.has("unit") ? *find_unit(Dimension::Length, values.text("unit")) : context.units.length;
}

std::optional<Error> read_file_surface(const CheckContext& context, const Values& values, SurfaceSpec& surface) {
    surface.source = SurfaceSource::File;
    surface.file = checked_file(context, values.text("file"));
    surface.unit = file_unit(context, values);
    if (const JsonNode* groups = values.find("groups"))
        for (const JsonNode& group : groups->children) surface.groups.push_back(group.text);
    bool welds = false;
    if (const JsonNode* repairs = values.find("repair"))
        for (const JsonNode& name : repairs->children) {
            surface.repair.push_back(*find_repair(name.text));
            welds = welds || surface.repair.back() == Repair::Weld;
        }
    surface.repairing.may_remove = values.number("may_remove");
    surface.repairing.may_split = values.flag("may_split");
    surface.may_cross = values.flag("may_cross");
    if (!values.has("weld_tolerance")) return std::nullopt;
    surface.repairing.weld_tolerance = values.number("weld_tolerance");
    if (welds) return std::nullopt;
    return fail_at(context, values, "weld_tolerance", "unused key: the repairs do not contain weld; expected it added or this left out");
}

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
    shape.blend = values.number("blend");
    shape.triangles = values.count<std::size_t>("triangles");
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

std::optional<Error> read_shape(const CheckContext& context, const Values& values, SurfaceSpec& surface) {
    surface.source = SurfaceSource::Shape;
    ShapeSpec& shape = surface.shape;
    shape.kind = find_choice(kShapes, values.text("shape"));
    shape.centre = values.vector("centre");
    shape.subdivisions = values.count<int>("subdivisions");
    shape.cells = values.count<int>("cells");
    shape.sides = values.count<int>("sides");
    shape.radius = values.number("radius", 0.0);
    shape.tube_radius = values.number("tube_radius", 0.0);
    if (shape.kind == ShapeKind::Box) shape.extent = values.vector("extent");
    if (shape.kind == ShapeKind::Tube) return read_tube(context, values, shape);
    if (shape.kind == ShapeKind::Vessels) return read_vessels(context, values, shape);
    if (shape.kind == ShapeKind::Torus && shape.tube_radius >= shape.radius)
        return fail_at(context, values, "tube_radius",
                       fmt::format("found {}; expected less than the ring's radius, {}",
                                   with_unit(shape.tube_radius, Dimension::Length, context.units),
                                   with_unit(shape.radius, Dimension::Length, context.units)));
    return std::nullopt;
}

std::optional<Error> read_surface(const CheckContext& context, const Values& body, SurfaceSpec& surface) {
    const JsonNode& node = *body.find("surface");
    if (node.type == JsonType::Text) {
        surface.source = SurfaceSource::File;
        surface.file = checked_file(context, node.text);
        surface.unit = context.units.length;
        return std::nullopt;
    }
    const Values values = body.object("surface");
    if (node.find("file") != nullptr) return read_file_surface(context, values, surface);
    if (node.find("shape") != nullptr) return read_shape(context, values, surface);
    surface.source = SurfaceSource::Recipe;
    surface.file = checked_file(context, values.text("recipe"));
    surface.part = values.text("part") == "liver" ? "liver" : "lumen";
    auto recipe = read_recipe(surface.file);
    if (!recipe) return recipe.error();
    surface.recipe = *recipe;
    return std::nullopt;
}

std::optional<Error> read_region(const CheckContext& context, const Values& values, const JsonNode& node, FixedRegion& region) {
    if (node.find("direction") != nullptr) {
        region.kind = RegionKind::Direction;
        region.fraction = values.number("fraction");
        return read_direction(context, values, "direction", region.direction);
    }
    if (node.find("sphere") != nullptr) {
        const Values ball = values.object("sphere");
        region.kind = RegionKind::Sphere;
        region.centre = ball.vector("centre");
        region.radius = ball.number("radius");
        return std::nullopt;
    }
    region.kind = RegionKind::Box;
    const auto& corners = values.find("box")->children;
    for (std::size_t i = 0; i < 3; ++i) {
        region.box.lo[static_cast<int>(i)] = values.column("box", corners[0], i);
        region.box.hi[static_cast<int>(i)] = values.column("box", corners[1], i);
    }
    if ((region.box.lo.array() < region.box.hi.array()).all()) return std::nullopt;
    return fail_at(context, values, "box", "found an empty box; expected the lower corner first, then the upper one");
}

std::optional<Error> read_tissue(const CheckContext& context, const Values& values, SceneBody& body) {
    const Values material = values.object("material");
    body.material.law = find_choice(kLaws, material.text("law"));
    body.material.young_modulus = material.number("young_modulus");
    body.material.poisson_ratio = material.number("poisson_ratio");
    body.material.density = material.number("density");
    body.material.viscosity = material.number("viscosity");
    body.material.mass_damping = material.number("mass_damping");
    body.cap_viscosity = material.flag("cap_viscosity");

    const Values coarse = values.object("coarse");
    if (values.has("coarse") && values.find("coarse")->find("file") != nullptr) {
        body.coarse.file = checked_file(context, coarse.text("file"));
        body.coarse.unit = file_unit(context, coarse);
    } else {
        body.coarse.lattice = coarse.text("mesher") == "lattice";
        body.coarse.surface_triangles = coarse.count<std::size_t>("surface_triangles");
        body.coarse.max_volume = coarse.number("max_volume", 0.0);
    }
    const JsonNode* fixed = values.find("fixed");
    for (std::size_t i = 0; fixed != nullptr && i < fixed->children.size(); ++i) {
        const JsonNode& node = fixed->children[i];
        const std::string path = fmt::format("{}[{}]", values.path("fixed"), i);
        const Values region = values.element("fixed", node, path);
        if (auto error = read_region(context, region, node, body.fixed.emplace_back())) return error;
    }
    return std::nullopt;
}

std::optional<Error> read_motion(const CheckContext& context, const Values& values, SceneBody& body) {
    for (const JsonNode& row : values.find("motion")->children) {
        KeyFrame frame{values.column("motion", row, 0), {}};
        for (std::size_t i = 0; i < 3; ++i) frame.displacement[static_cast<int>(i)] = values.column("motion", row, i + 1);
        if (!body.motion.empty() && frame.time <= body.motion.back().time)
            return error_at(context, row.at, fmt::format("{}[{}]", values.path("motion"), body.motion.size()),
                            fmt::format("found the time {} after {}; expected increasing times",
                                        with_unit(frame.time, Dimension::Time, context.units),
                                        with_unit(body.motion.back().time, Dimension::Time, context.units)));
        body.motion.push_back(frame);
    }
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

std::optional<Error> read_body(const CheckContext& context, const Values& values, SceneBody& body) {
    body.kind = find_choice(kBodyKinds, values.text("kind"));
    if (auto error = read_surface(context, values, body.surface)) return error;
    body.scale = values.number("scale");
    body.translate = values.vector("translate");
    body.hollow = values.flag("hollow");
    body.self_contact = body.kind != BodyKind::Deformable || values.flag("self_contact");
    body.blend = values.number("blend", SceneBody{}.blend);
    if (values.has("blend") && !values.has("embedded_in"))
        return fail_at(context, values, "blend", "unused key: the body is not embedded_in another; expected that added or this left out");
    if (body.kind == BodyKind::Deformable) return read_tissue(context, values, body);
    if (body.kind == BodyKind::Kinematic) return read_motion(context, values, body);
    return std::nullopt;
}

std::optional<Error> resolve_host_body(const CheckContext& context, const Values& values, const Scene& scene, SceneBody& body) {
    if (!values.has("embedded_in")) return std::nullopt;
    const std::string name = values.text("embedded_in");
    std::vector<std::string_view> deformable;
    for (const SceneBody& other : scene.bodies)
        if (other.kind == BodyKind::Deformable) deformable.push_back(other.name);
    body.embedded_in = find_body(scene, name);
    if (body.embedded_in == kNoIndex)
        return fail_at(context, values, "embedded_in",
                       fmt::format("found the unknown body \"{:.60}\"; {}", name, suggest("deformable body", name, deformable)));
    if (scene.bodies[body.embedded_in].kind != BodyKind::Deformable)
        return fail_at(context, values, "embedded_in",
                       fmt::format("the body \"{}\" is not deformable, so it cannot carry another; {}", name,
                                   suggest("deformable body", name, deformable)));
    return std::nullopt;
}

} // namespace trocar::engine
