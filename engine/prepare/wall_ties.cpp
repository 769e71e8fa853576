#include "engine/prepare/wall_ties.hpp"

#include "base/inside.hpp"
#include "base/topology.hpp"
#include "engine/prepare/node_sets.hpp"
#include "fem/embedding/tet_locator.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trocar::engine {

namespace {

/// [-]; an organ's tetrahedra inside a lumen keep so much of themselves, for the sake of their nodes, that they resist a change of the lumen's volume by
/// this share of what the organ resists its widening with.
constexpr double kFilling = 0.05, kLeastRoom = 1e-4;
double least_room(const fem::Material& material) {
    const fem::SmallStrain moduli = fem::find_small_strain(material);
    return std::max(kLeastRoom, kFilling * moduli.mu / (moduli.bulk_modulus()));
}

/// Points of a tetrahedron along each of its edges that tell which share of it is taken.
constexpr int kSamples = 5;

/// m^2, by node of a wall: its share of the outside, of the faces that do not face into the lumen.
std::vector<double> find_outer_areas(const TetMesh& wall, const TriMesh& lumen) {
    std::vector<double> area(wall.vertices.size(), 0.0);
    const std::vector<Triangle> faces = boundary_surface(wall).triangles;
    const std::vector<bool> on_bore = face_into(wall, faces, lumen);
    for (std::size_t k = 0; k < faces.size(); ++k) {
        if (on_bore[k]) continue;
        const Vec3 &a = wall.vertices[faces[k][0]], &b = wall.vertices[faces[k][1]], &c = wall.vertices[faces[k][2]];
        for (const Index node : faces[k]) area[node] += (b - a).cross(c - a).norm() / 6.0;
    }
    return area;
}

/// m; of the inscribed ball next to a point.
double bore_beside(const spheretree::LumenTree& lumen, const Vec3& p) {
    double nearest = std::numeric_limits<double>::infinity(), radius = 0.0;
    for (Index ball = 0; ball < lumen.ball_count(); ++ball) {
        const spheretree::Sphere& sphere = lumen.ball(ball);
        const double gap = (p - Vec3(sphere.centre)).norm() - sphere.radius;
        if (gap < nearest) nearest = gap, radius = sphere.radius;
    }
    return radius + std::max(nearest, 0.0);
}

/// An incompressible medium answers a tube of radius b that widens by u with the pressure 2 G u / b: that is the tie of a wall which the organ's
/// tetrahedra do not resolve. Where they do, it is stiffer than a tetrahedron of edge h. docs/tissue.md
double tie_stiffness(double shear, double area, double edge, double radius) noexcept { return 2.0 * shear * area * std::max(2.0 / edge, 1.0 / radius); }

/// fem::Tie of each node of the outside that lies in the organ. outside: how many nodes there are
std::vector<fem::Tie> find_ties(const TetMesh& wall, const BodyModel& vessel, const TetMesh& organ, const fem::TissueModel& tissue, std::size_t& outside) {
    const std::vector<double> area = find_outer_areas(wall, vessel.surface);
    const fem::TetLocator locator(organ);
    const double shear = fem::find_small_strain(tissue.material).mu;
    std::vector<fem::Tie> ties;
    outside = 0;
    for (Index node = 0; node < wall.vertices.size(); ++node) {
        if (!(area[node] > 0.0)) continue;
        ++outside;
        const Vec3& p = wall.vertices[node];
        const Index tet = locator.find(p);
        if (tet == kNoIndex) continue;
        fem::Tie tie;
        tie.node = node;
        tie.host = organ.tets[tet];
        Vec3 corner[4];
        for (std::size_t k = 0; k < 4; ++k) corner[k] = organ.vertices[tie.host[k]];
        double weight[4];
        if (!fem::find_affine(corner, p, weight)) continue;
        std::copy(std::begin(weight), std::end(weight), tie.weight.begin());
        const double edge = std::cbrt(6.0 * std::sqrt(2.0) * tissue.tet_shape[tet].volume);
        tie.stiffness = tie_stiffness(shear * tissue.tet_shape[tet].stiffness, area[node], edge, bore_beside(*vessel.lumen, p));
        ties.push_back(tie);
    }
    return ties;
}

/// A wall and its lumen.
class TakenSpace {
public:
    TakenSpace(const TetMesh& wall, const TriMesh& lumen) : in_wall_(wall), in_lumen_(lumen) {
        for (const Vec3& x : wall.vertices) box_.add(x);
    }
    [[nodiscard]] bool meets(const Box3& box) const noexcept { return (box.lo.array() <= box_.hi.array()).all() && (box_.lo.array() <= box.hi.array()).all(); }
    [[nodiscard]] bool contains(const Vec3& p) const noexcept { return box_.contains(p) && (in_lumen_.inside(p) || in_wall_.find(p) != kNoIndex); }

private:
    Box3 box_;
    fem::TetLocator in_wall_;
    InsideTest in_lumen_;
};

/// visit(point) at points spread evenly over a tetrahedron.
template <class Visit>
void sample_tet(const TetMesh& mesh, const Tet& t, Visit&& visit) {
    constexpr double kPer = 1.0 / kSamples;
    for (int i = 0; i < kSamples; ++i)
        for (int j = 0; i + j < kSamples; ++j)
            for (int k = 0; i + j + k < kSamples; ++k) {
                const int l = kSamples - 1 - i - j - k;
                visit(Vec3(kPer * ((i + 0.25) * mesh.vertices[t[0]] + (j + 0.25) * mesh.vertices[t[1]] + (k + 0.25) * mesh.vertices[t[2]] +
                                   (l + 0.25) * mesh.vertices[t[3]])));
            }
}

/// [tet_count], [-]: what walls and lumens leave of the organ's tetrahedra.
std::vector<double> find_room(const TetMesh& organ, std::span<const TakenSpace> taken, double least) {
    std::vector<double> room(organ.tets.size(), 1.0);
    for (std::size_t tet = 0; tet < room.size(); ++tet) {
        Box3 box;
        for (const Index node : organ.tets[tet]) box.add(organ.vertices[node]);
        if (std::none_of(taken.begin(), taken.end(), [&](const TakenSpace& space) { return space.meets(box); })) continue;
        int all = 0, left = 0;
        sample_tet(organ, organ.tets[tet], [&](const Vec3& p) {
            ++all;
            left += std::none_of(taken.begin(), taken.end(), [&](const TakenSpace& space) { return space.contains(p); });
        });
        room[tet] = std::max(least, static_cast<double>(left) / all);
    }
    return room;
}

/// Tetrahedra of a patch take its mean: patches join what is equally stiff alone, and the same ones come about again.
void even_out(const fem::TissueModel& tissue, std::vector<double>& room) {
    const fem::ForcePlan& plan = tissue.plan;
    if (!plan.patched()) return;
    for (std::size_t first = 0; first < plan.batches.size(); first += fem::kPatch)
        for (std::size_t lane = 0; lane < fem::kBatch; ++lane) {
            const auto each = [&](auto&& visit) {
                for (std::size_t b = first; b < first + fem::kPatch; ++b)
                    if (plan.batches[b].volume[lane] > 0.0) visit(plan.tet_of[b * fem::kBatch + lane], plan.shares[b].share[lane]);
            };
            double mean = 0.0;
            each([&](Index tet, double share) { mean += share * room[tet]; });
            each([&](Index tet, double) { room[tet] = mean; });
        }
}

std::vector<double> times(std::span<const double> factors, std::span<const double> room) {
    std::vector<double> out(room.begin(), room.end());
    for (std::size_t k = 0; k < factors.size(); ++k) out[k] *= factors[k];
    return out;
}

} // namespace

Result<void> join_walls(const Scene& scene, const OrganInHand& organ, const CoarseBodies& coarse, PreparedScene& prepared, fem::TissueModel& tissue,
                        BodySummary& summary) {
    const std::size_t index = prepared.model.bodies.size();
    std::vector<TakenSpace> taken;
    std::string names;
    for (std::size_t i = 0; i < index; ++i) {
        BodyModel& wall = prepared.model.bodies[i];
        if (scene.bodies[i].embedded_in != index || !wall.tissue) continue;
        std::size_t outside = 0;
        std::vector<fem::Tie> ties = find_ties(coarse.meshes[i], wall, organ.mesh, tissue, outside);
        if (ties.empty()) {
            const std::string what = fmt::format("no part of its wall's outside lies in {}: it is not joined to it", summary.name);
            prepared.notices.push_back(fmt::format("bodies.{}: {}", wall.name, what));
            prepared.bodies[i].notes.push_back(what);
            continue;
        }
        prepared.bodies[i].notes.push_back(fmt::format("joined to {} at {} of the {} nodes of its wall's outside", summary.name, ties.size(), outside));
        wall.joint = WallJoint{index, std::move(ties)};
        taken.emplace_back(coarse.meshes[i], wall.surface);
        names += (names.empty() ? "" : ", ") + wall.name;
    }
    if (taken.empty()) return {};
    std::vector<double> room = find_room(organ.mesh, taken, least_room(organ.material));
    even_out(tissue, room);
    double left = 0.0;
    for (std::size_t tet = 0; tet < room.size(); ++tet) left += room[tet] * tissue.tet_shape[tet].volume;
    const std::vector<double> stiffness = times(organ.contrast.stiffness, room), density = times(organ.contrast.density, room);
    Result<fem::TissueModel> made = fem::make_tissue_model(organ.mesh, organ.material, tissue.pinned, {stiffness, density, organ.contrast.fibres});
    if (!made.ok()) return scene_error(scene, "bodies." + summary.name, made.error().message, made.error().code);
    summary.notes.push_back(fmt::format("{:.3g} % of its tissue made room for {} and what is inside", 100.0 * (1.0 - left / tissue.volume), names));
    tissue = std::move(*made);
    return {};
}

void bound_ties(SceneModel& model) {
    for (std::size_t i = 0; i < model.bodies.size(); ++i) {
        const std::optional<WallJoint>& joint = model.bodies[i].joint;
        if (!joint) continue;
        BodyModel& host = model.bodies[joint->host];
        model.bodies[i].tied = fem::bound_tied(joint->ties, model.bodies[i].tissue->plan);
        const std::vector<double> own = fem::bound_hosts(joint->ties, host.tissue->plan);
        host.tied.resize(own.size(), 0.0);
        for (std::size_t k = 0; k < own.size(); ++k) host.tied[k] += own[k];
    }
}

} // namespace trocar::engine
