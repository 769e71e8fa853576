#include "engine/scene/scene_size.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace trocar::engine {
namespace {

std::size_t size(int count) noexcept { return static_cast<std::size_t>(std::max(count, 0)); }

/// Rings of the rounded ends, as anatomy::make_tube has them.
std::size_t count_tube_rings(const ShapeSpec& shape) noexcept {
    return shape.axis.size() + 2 * (std::max<std::size_t>(size(shape.sides) / 4, 1) - 1);
}

Error fail(const CheckContext& context, const std::string& key, std::string message) {
    const auto place = context.positions.find(key);
    return error_at(context, place != context.positions.end() ? place->second : TextPosition{}, key, std::move(message));
}

/// The number that makes a shape fine: its key and the value.
struct Fineness {
    const char* key;
    int* value;
};
Fineness fineness_of(ShapeSpec& shape) noexcept {
    if (shape.kind == ShapeKind::Box) return {"cells", &shape.cells};
    if (shape.kind == ShapeKind::Sphere) return {"subdivisions", &shape.subdivisions};
    return {"sides", &shape.sides};
}

std::optional<Error> check_shape(const CheckContext& context, const SceneBody& body) {
    ShapeSpec shape = body.surface.shape;
    const bool long_kind = shape.kind == ShapeKind::Tube || shape.kind == ShapeKind::Torus;
    const bool costly = long_kind || body.hollow || body.kind == BodyKind::Deformable;
    if (body.surface.source != SurfaceSource::Shape || shape.kind == ShapeKind::Vessels || !costly) return std::nullopt;
    const std::size_t found = count_triangles(shape);
    if (found <= kMostShapeTriangles) return std::nullopt;
    const std::string what = describe_size(shape), surface = "bodies." + body.name + ".surface";
    const Fineness fineness = fineness_of(shape);
    while (*fineness.value > 3 && count_triangles(shape) > kMostShapeTriangles) --*fineness.value;
    if (count_triangles(shape) > kMostShapeTriangles)
        return fail(context, surface, fmt::format("found {}: {} triangles; expected at most {}", what, found, kMostShapeTriangles));
    const std::string key = surface + "." + fineness.key;
    return fail(context, context.positions.contains(key) ? key : surface,
                fmt::format("found {}: {} triangles; expected at most {}, \"{}\": {}", what, found, kMostShapeTriangles, fineness.key,
                            *fineness.value));
}

} // namespace

std::size_t count_triangles(const ShapeSpec& shape) noexcept {
    switch (shape.kind) {
    case ShapeKind::Sphere:
        return std::size_t{20} << (2 * size(shape.subdivisions));
    case ShapeKind::Box:
        return 12 * size(shape.cells) * size(shape.cells);
    case ShapeKind::Tube:
        return 2 * size(shape.sides) * count_tube_rings(shape); // two a side between rings, one a side at either end
    case ShapeKind::Torus:
        return 4 * size(shape.sides) * size(shape.sides); // twice as many rings as sides
    case ShapeKind::Vessels:
        return shape.triangles;
    }
    return 0;
}

std::string describe_size(const ShapeSpec& shape) {
    switch (shape.kind) {
    case ShapeKind::Sphere:
        return fmt::format("a sphere of {} subdivisions", shape.subdivisions);
    case ShapeKind::Box:
        return fmt::format("a box of {} cells an edge", shape.cells);
    case ShapeKind::Tube:
        return fmt::format("a tube of {} rings with {} sides each", count_tube_rings(shape), shape.sides);
    case ShapeKind::Torus:
        return fmt::format("a torus of {} sides", shape.sides);
    case ShapeKind::Vessels:
        return fmt::format("vessels of {} branches", shape.branches.size());
    }
    return "";
}

std::optional<Error> check_scene_size(const CheckContext& context, const Scene& scene) {
    std::size_t triangles = 0;
    const auto add = [&](std::size_t count, const std::string& key, const std::string& what) -> std::optional<Error> {
        triangles += count;
        if (triangles <= kMostTriangles) return std::nullopt;
        return fail(context, key,
                    fmt::format("found {}: {} triangles, and {} with what stands before; expected at most {} in the scene", what, count,
                                triangles, kMostTriangles));
    };
    for (const SceneBody& body : scene.bodies)
        if (auto error = check_shape(context, body)) return error;
    for (const SceneBody& body : scene.bodies)
        if (body.surface.source == SurfaceSource::Shape)
            if (auto error =
                    add(count_triangles(body.surface.shape), "bodies." + body.name + ".surface", describe_size(body.surface.shape)))
                return error;
    for (const SceneInstrument& instrument : scene.instruments)
        if (auto error = add(instrument.skin_triangles, "instruments." + instrument.name, "an instrument with its skin")) return error;
    return std::nullopt;
}

} // namespace trocar::engine
