#include "engine/prepare/fibre_field.hpp"

#include "engine/io/printable.hpp"
#include "engine/prepare/geometry_cache.hpp"
#include "engine/scene/nearest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numbers>

namespace trocar::engine {

namespace {

using spheretree::CentrelineTree;

Vec3 centre_of(const TetMesh& mesh, const Tet& t) { return 0.25 * (mesh.vertices[t[0]] + mesh.vertices[t[1]] + mesh.vertices[t[2]] + mesh.vertices[t[3]]); }

void set_axis(const Vec3& direction, std::size_t family, fem::FibreAxes& axes) {
    const Vec3 unit = direction.normalized();
    for (int i = 0; i < 3; ++i) axes.axis[3 * family + static_cast<std::size_t>(i)] = unit[i];
}

Result<void> read_family(const Scene& scene, const std::string& key, const std::string& file, const std::string& name, const BesideTets& beside, std::size_t family,
                         std::vector<fem::FibreAxes>& axes) {
    const auto array = std::find_if(beside.vectors.begin(), beside.vectors.end(), [&](const CellArray& each) { return each.name == name; });
    if (array == beside.vectors.end()) {
        std::vector<std::string> names;
        for (const CellArray& each : beside.vectors) names.push_back(printable(fmt::format("{:.60}", each.name)));
        if (names.empty()) return scene_error(scene, key, fmt::format("found \"{:.60}\", and no cell array of {} has three numbers a cell; expected one, in a VTK or VTU file", name, file));
        return scene_error(scene, key, fmt::format("{}: {}", file, refuse_unknown("cell array of three numbers", name, std::vector<std::string_view>(names.begin(), names.end()))));
    }
    if (array->values.size() != 3 * beside.cells)
        return scene_error(scene, key, fmt::format("the array \"{:.60}\" of {} has {} values; expected {}, three for each of {} cells", name, file, array->values.size(), 3 * beside.cells, beside.cells));
    for (std::size_t t = 0; t < axes.size(); ++t) {
        const std::size_t cell = beside.place_of_tet[t], place = 3 * cell;
        const Vec3 direction(array->values[place], array->values[place + 1], array->values[place + 2]);
        const double length = direction.stableNorm();
        if (!(length > 0.0 && length < std::numeric_limits<double>::infinity()))
            return scene_error(scene, key, fmt::format("the array \"{:.60}\" of {} has ({}, {}, {}) at cell {}; expected a direction, of any finite length above 0", name, file, direction.x(),
                                                       direction.y(), direction.z(), cell));
        set_axis(direction / length, family, axes[t]);
    }
    return {};
}

Result<FibreField> read_field(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const BesideTets& beside) {
    const std::string* const arrays[] = {&body.coarse.fibre1_array, &body.coarse.fibre2_array};
    const std::string file = body.coarse.file.filename().string();
    FibreField field;
    field.axes.resize(mesh.tets.size());
    for (std::size_t family = 0; family < 2; ++family) {
        const std::size_t from = arrays[family]->empty() ? 1 - family : family;
        const std::string key = fmt::format("bodies.{}.coarse.fibre{}_array", body.name, from + 1);
        if (const Result<void> read = read_family(scene, key, file, *arrays[from], beside, family, field.axes); !read.ok()) return read.error();
    }
    field.words = fmt::format("as the arrays of {} say", file);
    return field;
}

/// From the end that is farthest from some place inside, so that no branch is cut in two.
Result<CentrelineTree> find_centreline(const spheretree::LumenTree& lumen) {
    Result<CentrelineTree> tree = make_or_read_centreline(lumen, lumen.ball(0).centre);
    if (!tree.ok()) return tree;
    std::vector<double> way(tree->point_count(), 0.0);
    for (Index i = 1; i < tree->point_count(); ++i) way[i] = way[tree->parents[i]] + (tree->points[i] - tree->points[tree->parents[i]]).norm();
    return make_or_read_centreline(lumen, tree->points[static_cast<std::size_t>(std::max_element(way.begin(), way.end()) - way.begin())]);
}

/// The place of a centreline that a tetrahedron belongs to.
struct Nearest {
    Vec3 point, tangent;
};

Nearest find_nearest(const CentrelineTree& tree, const Vec3& place) {
    Nearest nearest{tree.points[0], tree.points[1] - tree.points[0]};
    double least = std::numeric_limits<double>::infinity();
    for (Index i = 1; i < tree.point_count(); ++i) {
        const Index parent = tree.parents[i];
        const Vec3 along = tree.points[i] - tree.points[parent];
        const double share = std::clamp((place - tree.points[parent]).dot(along) / std::max(along.squaredNorm(), std::numeric_limits<double>::min()), 0.0, 1.0);
        const Vec3 on = tree.points[parent] + share * along;
        const double radius = (1.0 - share) * tree.radii[parent] + share * tree.radii[i], ratio = (place - on).squaredNorm() / std::max(radius * radius, 1e-30);
        if (ratio < least && along.norm() > 0.0) least = ratio, nearest = {on, along};
    }
    return nearest;
}

/// Of a lumen's width: a shorter centreline is a sac's.
constexpr double kLeastLength = 1.5;

std::string angle_words(const fem::Material& m) { return fmt::format("{:.4g} degrees from the circumference either way", m.fibre_angle * 180.0 / std::numbers::pi); }

Result<FibreField> wind_field(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const TriMesh& surface) {
    const std::string key = "bodies." + body.name;
    const Result<spheretree::LumenTree> lumen = make_or_read_lumen_tree(surface);
    if (!lumen.ok()) return scene_error(scene, key + ".surface", lumen.error().message, lumen.error().code);
    const Result<CentrelineTree> tree = find_centreline(*lumen);
    if (!tree.ok()) return scene_error(scene, key + ".material.fibre_course", tree.error().message, tree.error().code);
    if (tree->point_count() < 2)
        return scene_error(scene, key + ".material.fibre_course", "the lumen's centreline is a single point, which nothing winds round; expected fibres that are \"given\"");
    FibreField field;
    fem::Material local = body.material;
    for (const Tet& t : mesh.tets) {
        const Vec3 centre = centre_of(mesh, t);
        const Nearest nearest = find_nearest(*tree, centre);
        local.fibre_axis = nearest.tangent;
        local.fibre_point = nearest.point;
        fem::FibreAxes axes = fem::find_fibres(local, centre);
        if (const Vec3 out = centre - nearest.point; body.fibre_course == FibreCourse::Radial)
            for (std::size_t family = 0; family < 2; ++family) set_axis(out.norm() > 0.0 ? out : nearest.tangent.unitOrthogonal(), family, axes);
        field.axes.push_back(axes);
    }
    field.words = body.fibre_course == FibreCourse::Radial ? "away from the lumen's centreline" : "round the lumen's centreline, " + angle_words(body.material);
    double length = 0.0;
    for (Index i = 1; i < tree->point_count(); ++i) length += (tree->points[i] - tree->points[tree->parents[i]]).norm();
    if (const double widest = 2.0 * *std::max_element(tree->radii.begin(), tree->radii.end()); length < kLeastLength * widest)
        field.note = fmt::format("fibres lie by a centreline of {:.3g} mm in a lumen {:.3g} mm wide, which chance lays in a sac; expected a vessel longer than wide, or fibres that are \"given\"",
                                 1e3 * length, 1e3 * widest);
    return field;
}

FibreField describe_given(const fem::Material& m) {
    const auto shown = [](const Vec3& v, double unit) { return fmt::format("({:.4g}, {:.4g}, {:.4g})", unit * v.x(), unit * v.y(), unit * v.z()); };
    if (m.fibre_axis.norm() > 0.0)
        return {{}, fmt::format("round the line through {} mm along {}, {}", shown(m.fibre_point, 1e3), shown(m.fibre_axis.normalized(), 1.0), angle_words(m)), {}};
    return {{}, fmt::format("along {} and {}", shown(m.fibre1.normalized(), 1.0), shown(m.fibre2.normalized(), 1.0)), {}};
}

} // namespace

Result<FibreField> make_fibre_field(const Scene& scene, const SceneBody& body, const TetMesh& mesh, const BesideTets& beside, const TriMesh& surface) {
    if (body.material.law != fem::MaterialLaw::Hgo) return FibreField{};
    if (!body.coarse.fibre1_array.empty() || !body.coarse.fibre2_array.empty()) return read_field(scene, body, mesh, beside);
    if (body.fibre_course != FibreCourse::Given) return wind_field(scene, body, mesh, surface);
    return describe_given(body.material);
}

} // namespace trocar::engine
