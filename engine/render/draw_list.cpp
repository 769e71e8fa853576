#include "engine/render/draw_list.hpp"

#include "engine/render/render_mesh.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace trocar::engine {
namespace {

void send_mesh(const GlApi& gl, const RenderMesh& mesh, DrawItem& item) {
    item.layout = GlVertexArray(gl);
    item.vertices = GlBuffer(gl);
    item.indices = GlBuffer(gl);
    item.index_count = static_cast<GLsizei>(mesh.indices.size());
    if (mesh.indices.empty()) return;
    gl.NamedBufferData(item.vertices.name(), static_cast<GLsizeiptr>(mesh.vertices.size() * sizeof(RenderVertex)), mesh.vertices.data(),
                       GL_STATIC_DRAW);
    gl.NamedBufferData(item.indices.name(), static_cast<GLsizeiptr>(mesh.indices.size() * sizeof(Index)), mesh.indices.data(),
                       GL_STATIC_DRAW);
    const GLuint layout = item.layout.name();
    gl.VertexArrayVertexBuffer(layout, 0, item.vertices.name(), 0, sizeof(RenderVertex));
    gl.VertexArrayElementBuffer(layout, item.indices.name());
    const std::array<GLuint, 2> offset = {offsetof(RenderVertex, position), offsetof(RenderVertex, normal)};
    for (GLuint attribute = 0; attribute < offset.size(); ++attribute) {
        gl.EnableVertexArrayAttrib(layout, attribute);
        gl.VertexArrayAttribFormat(layout, attribute, 3, GL_FLOAT, GL_FALSE, offset[attribute]);
        gl.VertexArrayAttribBinding(layout, attribute, 0);
    }
}

template <class Body>
[[nodiscard]] DrawItem make_item(const Body& body) {
    DrawItem item;
    for (std::size_t i = 0; i < item.colour.size(); ++i) item.colour[i] = to_linear(body.colour[static_cast<Eigen::Index>(i)]);
    item.opacity = static_cast<float>(std::clamp(body.opacity, 0.0, 1.0));
    item.emphasis = static_cast<float>(std::clamp(body.emphasis, 0.0, 1.0));
    item.fluoro_thickness = body.fluoro_thickness;
    item.attenuation = static_cast<float>(body.attenuation);
    return item;
}

void add_finite(Box3& box, const Vec3& p) noexcept {
    if (is_finite(p)) box.add(p);
}

[[nodiscard]] std::vector<double> tube_radii(const RenderTube& tube, const Projection& view, bool thicken) {
    std::vector<double> radius;
    radius.reserve(tube.points.size());
    for (const Vec3& p : tube.points) {
        const double pixel = view.pixel_size((p - view.eye).dot(view.forward));
        radius.push_back(thicken && pixel > 0.0 ? std::max(tube.radius, tube.min_radius_px * pixel) : tube.radius);
    }
    return radius;
}

} // namespace

float to_linear(double srgb) noexcept {
    const double c = std::clamp(srgb, 0.0, 1.0);
    return static_cast<float>(c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4));
}

Box3 find_bounds(const RenderScene& scene) noexcept {
    Box3 box;
    for (const RenderSurface& surface : scene.surfaces)
        for (const Vec3& p : surface.vertices) add_finite(box, p);
    for (const RenderTube& tube : scene.tubes)
        for (const Vec3& p : tube.points) {
            add_finite(box, p + Vec3::Constant(tube.radius));
            add_finite(box, p - Vec3::Constant(tube.radius));
        }
    for (const RenderTarget& target : scene.targets) add_finite(box, target.position);
    for (const RenderMarker& marker : scene.markers) add_finite(box, marker.position);
    return box;
}

std::vector<DrawItem> upload(const GlApi& gl, const RenderScene& scene, const Projection& view, bool thicken) {
    std::vector<DrawItem> items;
    items.reserve(scene.surfaces.size() + scene.tubes.size());
    RenderMesh mesh;
    for (const RenderSurface& surface : scene.surfaces) {
        make_render_mesh(surface.vertices, surface.triangles, view.origin, mesh);
        send_mesh(gl, mesh, items.emplace_back(make_item(surface)));
    }
    for (const RenderTube& tube : scene.tubes) {
        const TriMesh skin = make_tube_mesh(tube.points, tube_radii(tube, view, thicken));
        make_render_mesh(skin.vertices, skin.triangles, view.origin, mesh);
        send_mesh(gl, mesh, items.emplace_back(make_item(tube)));
    }
    return items;
}

void draw(const GlApi& gl, const DrawItem& item) {
    if (item.index_count == 0) return;
    gl.BindVertexArray(item.layout.name());
    gl.DrawElements(GL_TRIANGLES, item.index_count, GL_UNSIGNED_INT, nullptr);
}

} // namespace trocar::engine
